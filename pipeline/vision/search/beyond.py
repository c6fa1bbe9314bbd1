"""Whether the cable goes on beyond the end of what was found.

A ruled line, a thing or the border of a shadow that lies across a cable ends its strip, and what lies beyond looks like
another thing. Straight on from the end a strip of the same width whose step is the same share of its ground's
brightness is the same cable: a shadow dims both alike.
All lengths in cells.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from pipeline.records import Array
from pipeline.settings.vision.search import SegmentationSettings
from pipeline.vision.search.backdrop import Standout
from pipeline.vision.search.crosscut import CrossCut, cut_across, path_normals
from pipeline.vision.search.ends import led_on, straight_body


def goes_on(standout: Standout, cut: CrossCut, width: float, settings: SegmentationSettings, *, at_start: bool) -> bool:
    """True if beyond the first or the last point of a strip, led on as it ends, there is more of the same.

    Parameters
    ----------
    standout : Standout
    cut : CrossCut
        The strip's cross-cuts.
    width : cells
        Of the strip.
    settings : SegmentationSettings
    at_start : bool
        The first point, else the last.
    """
    path = cut.path[::-1] if at_start else cut.path
    body, outward = straight_body(path, width, 1.5 * width)
    reach = float(np.hypot(*(path[-1] - body[-1])))
    ahead = led_on(body, outward, reach + settings.beyond_widths * width, width)[len(body) + int(reach) :]
    rows, columns = standout.residual.shape[:2]
    inside = np.all((ahead >= 0) & (ahead <= (columns - 1, rows - 1)), axis=1)
    ahead = ahead[: int(np.argmin(inside))] if not inside.all() else ahead
    least = settings.beyond_least_widths * width
    if len(ahead) < least:
        return False
    more = cut_across(standout, ahead, width, settings, known=True)
    if more.dark != cut.dark:
        return False
    usual = float(np.median(_weber(standout, cut, width, settings)))
    edges = np.flatnonzero(np.diff(np.r_[0, _alike(standout, more, width, usual, settings), 0]))
    return bool(np.max(edges[1::2] - edges[::2], initial=0) > least)


def shaded(standout: Standout, cut: CrossCut, width: float, settings: SegmentationSettings) -> NDArray[np.bool_]:
    """Sections ``(k,)`` that look like most of the strip but for the light on them."""
    return _alike(standout, cut, width, float(np.median(_weber(standout, cut, width, settings))), settings)


def _alike(
    standout: Standout, cut: CrossCut, width: float, usual: float, settings: SegmentationSettings
) -> NDArray[np.bool_]:
    low, high = settings.beyond_contrast
    share = _weber(standout, cut, width, settings) / usual
    return (np.abs(cut.width / width - 1.0) < settings.beyond_width_off) & (share > low) & (share < high)


def _weber(standout: Standout, cut: CrossCut, width: float, settings: SegmentationSettings) -> Array:
    """Step of each section by the brightness of its ground."""
    _, normal = path_normals(cut.path)
    beside = (cut.path[:, None, :] + np.array([-1.2, 1.2])[:, None] * width * normal[:, None, :]).astype(np.float32)
    ground = cv2.remap(
        standout.picture, beside[..., 0], beside[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(cut.step / np.maximum(ground.reshape(len(cut.path), -1).mean(axis=1), settings.beyond_darkest))
