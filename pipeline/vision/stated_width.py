"""A stated diameter that no photo shows: told once, with the width that they show, and measured with that.

A diameter that is wrong by a factor leads the search astray: with twice the width, shadow, highlight and ground beside
the cable pass for its edges. So where most photos are refused for what their strips look like, a few are traced without
any diameter. If these agree on another width, and on a cable about as long as stated, it is the diameter that is wrong.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.messages import Message
from pipeline.records import Centerline, Finding, Rejected, Specimen, Traces
from pipeline.settings.vision import VisionSettings
from pipeline.vision.rough import WIDTH_OFF
from pipeline.vision.single import trace_photo

MISLED = frozenset({"photo/width", "photo/bearing", "photo/hidden-end", "photo/crossing", "photo/outline"})
"""What photos are refused for when a strip of another width is looked for: edges beside the cable, or half of it."""


def with_width_seen(
    specimen: Specimen,
    traces: Traces,
    settings: VisionSettings,
    retrace: Callable[[Specimen, VisionSettings], Traces],
) -> Traces:
    """The traces as they are, or those with the width that the photos show.

    Parameters
    ----------
    traces : Traces
        With the diameter as stated.
    retrace : callable
        Trace a series.

    Returns
    -------
    Traces
        Where the width seen does not lead to more photos, all of them are refused: what was traced is not the cable.
    """
    refused = [photo for photo in traces.photos if isinstance(photo, Rejected) and photo.code in MISLED]
    if 2 * len(refused) < max(len(traces.photos), 1):
        return traces
    width_m = _width_seen(specimen, traces, settings)
    if width_m is None:
        return traces
    again = retrace(replace(specimen, diameter_m=width_m), settings)
    seen = [photo.width_m for photo in again.photos if isinstance(photo, Centerline)]
    better = len(seen) > len(again.photos) - len(refused)
    said = Message(
        "diameter/seen",
        shown_m=np.median(seen) if better else width_m,
        stated_mm=1e3 * specimen.diameter_m,
        used="width-taken" if better else "width-unused",
    )
    finding = Finding(said.code, "error", said)
    if better:
        return replace(again, findings=(finding, *again.findings))
    photos = tuple(_refused(photo) for photo in traces.photos)
    return replace(traces, photos=photos, findings=(finding, *traces.findings))


def _width_seen(specimen: Specimen, traces: Traces, settings: VisionSettings) -> float | None:
    """Width (m) on which a few photos agree that are traced without a diameter; None if it may be the stated one."""
    paths: list[Path] = [specimen.images[photo.image] for photo in traces.photos if photo.image in specimen.images]
    # of three photos all that can be traced must agree, and at least two
    places = {round(place) for place in np.linspace(0, len(paths) - 1, 3)} if paths else set()
    lines = [trace_photo(paths[i], settings=settings) for i in sorted(places)]
    free = [line for line in lines if isinstance(line, Centerline)]
    px_per_m = specimen.camera.scale_px_per_m or traces.scale.px_per_m
    # where no photo could be measured, 1 px/m stands for a scale that nobody knows
    if len(free) < min(2, len(paths)) or not free or px_per_m <= 1.0:
        return None
    widths = np.array([line.width_m for line in free]) / px_per_m
    lengths = np.array([line.traced_length_m for line in free]) / px_per_m / specimen.length_m
    # widths of one cable agree to a percent, those of shadows and highlights do not
    alike = np.ptp(widths) < 0.05 * np.median(widths)
    # covers hide up to a diameter or three at each end, and photos have a scale
    whole = lengths.min() > 0.7 and lengths.max() < 1.1
    width = float(np.median(widths))
    off = abs(width / specimen.diameter_m - 1.0) > WIDTH_OFF
    return width if alike and whole and off else None


def _refused(photo: Centerline | Rejected) -> Rejected:
    if isinstance(photo, Rejected):
        return photo
    return Rejected(photo.image, Message("photo/width.neither", width_m=photo.width_m), photo.preview)
