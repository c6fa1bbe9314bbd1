"""One photo to one centerline, with the picture that shows it.

``photo -> cable (segmentation) -> followed, fitted (centerline) -> Centerline with its preview``
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

from pipeline.records import Centerline, PhotoHints, Preview, Rejected
from pipeline.settings.vision import VisionSettings
from pipeline.vision.centerline.axes_of_series import AxesTold
from pipeline.vision.centerline.ground_waves import Waves
from pipeline.vision.centerline.measurement import Followed, centerline_of, follow_cable
from pipeline.vision.guard import guarded
from pipeline.vision.judgement import Cable
from pipeline.vision.photo import Photo, load_photo
from pipeline.vision.preview import reduce_photo, with_strip
from pipeline.vision.scale.plane import PlaneMap
from pipeline.vision.segmentation import find_cable


def trace_photo(
    path: Path,
    *,
    diameter_px: float | None = None,
    hints: PhotoHints | None = None,
    settings: VisionSettings | None = None,
) -> Centerline | Rejected:
    """Trace the cable on a single photo, without a specimen and without a scale.

    Parameters
    ----------
    diameter_px : px, optional
        Diameter of the cable; measured on the photo if not given.
    hints : PhotoHints, optional
        What a person says about the photo.

    Returns
    -------
    Centerline or Rejected
        From visible end to visible end. Lengths are in px wherever the record says m.
    """
    settings = VisionSettings() if settings is None else settings
    photo = guarded(Path(path).name, partial(load_photo, Path(path), settings.photo))
    if isinstance(photo, Rejected):
        return photo
    return guarded(photo.name, partial(_traced, photo, diameter_px, hints, settings))


def _traced(
    photo: Photo, diameter_px: float | None, hints: PhotoHints | None, settings: VisionSettings
) -> Centerline | Rejected:
    preview = reduce_photo(photo, settings.preview)
    rough = find_cable(photo, cable=Cable(diameter_px=diameter_px), hints=hints)
    if isinstance(rough, Rejected):
        return shown(rough, preview, settings)
    plane = PlaneMap.from_scale(1.0)
    return shown(follow_cable(rough, plane=plane, diameter_m=diameter_px), preview, settings)


def shown(
    cable: Followed | Rejected,
    preview: Preview | None,
    settings: VisionSettings,
    told: AxesTold | None = None,
    waves: Waves | None = None,
) -> Centerline | Rejected:
    """Centerline of a cable, with its picture."""
    line = cable if isinstance(cable, Rejected) else centerline_of(cable, settings, told, waves)
    if preview is not None and isinstance(cable, Followed) and isinstance(line, Centerline):
        preview = with_strip(preview, line, cable.rough, settings.preview)
    return line if preview is None else replace(line, preview=preview)
