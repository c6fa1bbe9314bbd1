"""Pictures for people: the photo reduced, and the cable straightened along its centerline and magnified across.

If the tracing is right, the cable in the strip is a straight band between the two measured edges; whatever it follows
wrongly shows as a bend of the band, magnified.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from pipeline.records import Array, Centerline, Preview
from pipeline.settings.vision import PreviewSettings
from pipeline.vision.median import quantile
from pipeline.vision.photo import Photo, reduce_area, straightened
from pipeline.vision.polyline import arc_lengths
from pipeline.vision.rough import RoughCable
from pipeline.vision.search.crosscut import path_normals

# Okabe and Ito's orange and sky blue (blue, green, red): told apart by colour-blind readers and on dark and bright.
_MIDDLE, _EDGE = (0, 159, 230), (233, 180, 86)
_STRIP_HEIGHT_PX = 160  # px; a bend of a hundredth of the width is a pixel high


def reduce_photo(photo: Photo, settings: PreviewSettings) -> Preview:
    """The photo at the size of a report's column, as JPEG; levels stretched to the range it uses."""
    factor = max(1.0, max(photo.size) / settings.long_side_px)
    size = (max(1, round(photo.size[0] / factor)), max(1, round(photo.size[1] / factor)))
    shown = np.asarray(cv2.convertScaleAbs(reduce_area(photo.pixels, size), alpha=255.0 / photo.full_scale), np.uint8)
    return Preview(_jpeg(shown, settings), size[0], size[1], photo.size[0] / size[0])


def with_strip(preview: Preview, line: Centerline, rough: RoughCable, settings: PreviewSettings) -> Preview:
    """Add the cable straightened: arc length to the right from the left bearing axis, the bow's side downward."""
    path = np.column_stack([line.u_px, line.v_px])
    s = arc_lengths(path)
    along = np.linspace(0.0, s[-1], settings.long_side_px)
    points = np.column_stack([np.interp(along, s, path[:, 0]), np.interp(along, s, path[:, 1])])
    normal = path_normals(points) * (-1.0 if line.mirrored else 1.0)
    half = 2.0 * rough.half_width_px  # a width on each side of the middle
    across = np.linspace(-half, half, _STRIP_HEIGHT_PX)
    strip = straightened(rough.grey, points - rough.origin_px, normal, across)[..., 0].T
    picture = np.asarray(cv2.cvtColor(_stretched(strip, line, s, along), cv2.COLOR_GRAY2BGR), np.uint8)
    zoom = (_STRIP_HEIGHT_PX - 1) / (2.0 * half)
    middle = 0.5 * (_STRIP_HEIGHT_PX - 1)
    picture[round(middle), ::2] = _MIDDLE
    for side in (-1.0, 1.0):
        picture[round(middle + side * rough.half_width_px * zoom), ::4] = _EDGE
    return replace(preview, strip=_jpeg(picture, settings))


def _stretched(strip: NDArray[np.float32], line: Centerline, s: Array, along: Array) -> NDArray[np.uint8]:
    seen = np.interp(along, s, line.shape.seen.astype(float)) > 0.5
    # every eighth pixel tells the range
    part = strip[::4, seen if seen.any() else slice(None)][:, ::2]
    low, high = (quantile(part, share) for share in (0.005, 0.995))
    strip = (strip - np.float32(low)) * np.float32(255.0 / max(high - low, 1e-6))
    levels: NDArray[np.uint8] = np.clip(strip, 0, 255, out=strip).astype(np.uint8)
    return levels


def _jpeg(picture: NDArray[np.uint8], settings: PreviewSettings) -> bytes:
    done, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, settings.jpeg_quality])
    if not done:
        raise ValueError("a picture of uint8 grey or colour can always be coded")
    return data.tobytes()
