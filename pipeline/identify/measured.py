"""Records of folder and photos -> the one record that the mechanics reads.

Steps of the force log and centerlines of the photos meet by the photo's name. SI units; axes of `rod.measurement`.
"""

from __future__ import annotations

import numpy as np

from pipeline.records import Array, Centerline, LoadStep, Specimen, Traces
from pipeline.settings.identify import IdentifySettings
from rod.measurement import MeasuredStep, MeasuredTest

HOLD_SAMPLES = 1000
"""Of a hold, at most: what forces do during one, relax or drift, a thousand means show as well as a million samples,
each of which would be a row of the diagnosis."""


def measured_test(specimen: Specimen, traces: Traces, settings: IdentifySettings) -> MeasuredTest:
    """The bending test as the mechanics sees it.

    Parameters
    ----------
    specimen : Specimen
    traces : Traces
        Outcome of each photo; rejected ones leave a step with its force only.
    settings : IdentifySettings

    Returns
    -------
    MeasuredTest
        Steps in the order of the test.
    """
    lines = {photo.image: photo for photo in traces.photos if isinstance(photo, Centerline)}
    floor = settings.force_std_floor_relative * max((abs(step.force_N) for step in specimen.steps), default=0.0)
    put = _axes_put_by_log(specimen)
    steps = tuple(
        _step(
            step,
            lines.get(step.image) if step.image is not None else None,
            floor,
            traces.scale.px_per_m,
            specimen.hashes.get(step.image or ""),
            step.step in put,
        )
        for step in specimen.steps
    )
    diagonals = [
        0.5 * np.hypot(line.preview.width, line.preview.height) * line.preview.reduction / traces.scale.px_per_m
        for line in lines.values()
        if line.preview is not None
    ]
    return MeasuredTest(
        length=specimen.length_m,
        length_std=settings.length_std_relative * specimen.length_m,
        scale_std=traces.scale.std_relative,
        axis_std=settings.axis_std_m,
        axis_parallax_std=traces.axis_parallax_std,
        camera_foot_std=settings.camera_foot_std_m,
        steps=steps,
        moving=specimen.rig.moving_bearing,
        picture_half_diagonal=float(max(diagonals)) if diagonals else None,
    )


def _axes_put_by_log(specimen: Specimen) -> frozenset[int]:
    """Numbers of the steps whose photos show no axis that moves: it went by the log from where it was on the first."""
    rig, shown = specimen.rig, [step for step in specimen.steps if step.image in specimen.images]
    if rig.bearings_px is None or rig.marker_diameter_m is not None:
        return frozenset()
    by_hand = {name for name, hints in specimen.hints.items() if hints.ends_px or hints.path_px}
    went = (step for step in shown if step.displacement_m != shown[0].displacement_m)
    return frozenset(step.step for step in went if step.image not in by_hand)


def _step(
    step: LoadStep, line: Centerline | None, floor: float, px_per_m: float, picture: str | None, put_by_log: bool
) -> MeasuredStep:
    return MeasuredStep(
        step=step.step,
        branch=step.branch,
        displacement=step.displacement_m if np.isfinite(step.displacement_m) else None,
        force=step.force_N,
        # A log of zeros has no scale of its own; the smallest positive number keeps the weights finite.
        force_std=max(step.force_std_N if np.isfinite(step.force_std_N) else 0.0, floor, np.finfo(float).tiny),
        chord=None if line is None else line.chord_m,
        chord_std=None if line is None else line.chord_std_m,
        shape=None if line is None else line.shape,
        time=_time(step),
        hold_times=_thinned(step.times_s),
        hold_forces=_thinned(step.forces_N),
        picture_centre=None if line is None else picture_centre(line, px_per_m),
        displacement_std=step.displacement_std_m,
        picture=None if line is None else picture,
        chord_by_log=line is not None and put_by_log,
    )


def _thinned(samples: Array) -> Array | None:
    """Samples of a hold, or means of neighbours where there are more than `HOLD_SAMPLES`; None without any."""
    if samples.size > HOLD_SAMPLES:
        first = np.unique(np.linspace(0, samples.size, HOLD_SAMPLES, endpoint=False).astype(int))
        samples = np.add.reduceat(samples, first) / np.diff(np.append(first, samples.size))
    return samples if samples.size else None


def _time(step: LoadStep) -> float | None:
    """Time of the photo, s; of a hold whose photo the log does not name its middle, as its force is its mean."""
    if step.photo_time_s is not None or not step.times_s.size:
        return step.photo_time_s
    return float(np.mean(step.times_s))


def picture_centre(line: Centerline, px_per_m: float) -> tuple[float, float] | None:
    """Centre of the picture in the chord frame of its photo, m; None where the size of the picture is not known."""
    if line.preview is None:
        return None
    size = np.array([line.preview.width, line.preview.height]) * line.preview.reduction
    left, right = np.array(line.left_px), np.array(line.right_px)
    along = (right - left) / np.hypot(*(right - left))
    across = line.side * np.array([-along[1], along[0]])
    centre = (0.5 * (size - 1.0) - left) / px_per_m
    return float(centre @ along), float(centre @ across)
