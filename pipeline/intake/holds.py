"""Samples -> load steps: which rows form a hold, with which photo and force.

A hold is a run of rows with one step number and branch, or, where the log has no step numbers, with one displacement.
Signs of the result: force positive in compression, displacement positive toward the other bearing (see `signs`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.intake.holdforce import Hold, HoldForces, hold_forces
from pipeline.intake.holdplace import HoldPlaces, hold_places
from pipeline.intake.samples import Samples
from pipeline.intake.signs import FREE, force_sign, from_mounted, inferred_branches, signed_displacements
from pipeline.intake.specimenfile import LogSpec
from pipeline.messages import Message
from pipeline.records import Array, Branch, Finding, LoadStep, doubtful, inferred
from pipeline.settings.intake import IntakeSettings

SPREAD = 8.0
"""Standard deviations of the scatter that the samples of a hold may lie apart: 1,000 of them do so by 6.5."""

ONE_PLACE = 2e-3
"""Of the travel; encoders scatter below 0.1 %, steps are above 1 % of the travel."""

LEAST_SAMPLES = 3
"""Of a hold, in a log without step numbers; shorter plateaus are part of the ramp."""

OVER_RAMP = 3.0
"""Times the median stretch of a ramp; in a log without step numbers, sampled often enough to show stretches of constant
displacement on the way, too, longer ones are holds."""

RAMP = 5
"""Stretches in a row, each just beside the last, of a ramp; fewer are holds at almost one displacement."""

WILD = 1.0
"""Of the largest median force of a hold; a sample further from those of its hold is no noise and no relaxation."""

WILD_ROUNDS = 10
"""Times that wild forces are left out; without them the largest hold may have a smaller median, and show more."""
SAME = 4.0
"""Standard deviations of a place: two holds further apart are at two places."""


@dataclass(frozen=True)
class Run:
    """Rows ``first`` to ``last`` (exclusive) of the samples that form a hold, and its step number."""

    first: int
    last: int
    step: int

    @property
    def rows(self) -> slice:
        """The rows, to index arrays with."""
        return slice(self.first, self.last)


def load_steps(
    samples: Samples, spec: LogSpec, settings: IntakeSettings
) -> tuple[tuple[LoadStep, ...], tuple[Finding, ...]]:
    """Group the samples into steps.

    Raises `InputError` ``log/swapped-columns`` if the force is constant in every hold while the displacement scatters,
    ``log/too-many-steps``.
    """
    read = samples
    samples, tolerance, runs, grouped = _grouped(read, settings)
    left_out: list[Finding] = []
    while len(left_out) < WILD_ROUNDS and (wild := _wild(read.forces, runs)):
        line, force = read.lines[wild[0]], float(read.forces[wild[0]])
        left_out.append(doubtful("log/wild-force", count=len(wild), line=line, force_N=force))
        read = read.without(wild)
        samples, tolerance, runs, grouped = _grouped(read, settings)
    places = hold_places(
        [samples.displacements[run.rows] for run in runs],
        [np.isin(np.arange(run.first, run.last), _rows_with_photo(samples, run)) for run in runs],
    )
    positions = places.place
    same = max(tolerance, SAME * max((std for std in places.std if std is not None), default=0.0))
    means = np.array([float(np.mean(samples.forces[run.rows])) for run in runs])
    sign, signed = force_sign(means, np.array(positions), spec)
    forces = sign * samples.forces
    holds = [_hold(samples, forces, run) for run in runs]
    fitted = hold_forces(holds, resolution=samples.resolution, settings=settings)
    if samples.branches is None:
        branches, directed = inferred_branches(positions, fitted.force, same)
    else:
        branches, directed = [samples.branches[run.first] for run in runs], []
    steps = _steps(samples, runs, branches, places, holds, fitted)
    how = _fit_findings(fitted, places, tolerance, settings)
    within = _hold_findings(samples, runs, max(5.0 * tolerance, SPREAD * places.sigma))
    return steps, (*left_out, *grouped, *signed, *directed, *how, *within, *_order_findings(steps, same))


def _grouped(samples: Samples, settings: IntakeSettings) -> tuple[Samples, float, list[Run], tuple[Finding, ...]]:
    """The samples with signed displacements, how close these are one place (m), the holds, and what was inferred."""
    travel = float(np.ptp(samples.displacements)) or float(abs(samples.displacements[0])) or 1.0
    tolerance = ONE_PLACE * travel
    mounted = _mounted(samples, tolerance)
    displacements, moved = from_mounted(samples.displacements, mounted, travel)
    displacements, turned = signed_displacements(displacements)
    samples = replace(samples, displacements=displacements)
    runs, found = _runs(samples, tolerance)
    if len(runs) > settings.steps_max:  # a ramp without holds, or a step column that counts the rows
        raise InputError(Message("log/too-many-steps", steps=len(runs), limit=settings.steps_max))
    _check_swapped(samples, runs)
    return samples, tolerance, runs, (*moved, *turned, *found)


def _steps(
    samples: Samples,
    runs: Sequence[Run],
    branches: Sequence[Branch],
    places: HoldPlaces,
    holds: Sequence[Hold],
    fitted: HoldForces,
) -> tuple[LoadStep, ...]:
    """The record of each hold."""
    timed = samples.times is not None
    return tuple(
        LoadStep(
            step=run.step,
            branch=branch,
            displacement_m=position,
            force_N=force,
            force_std_N=std,
            photo_time_s=hold.photo_time if timed else None,
            times_s=hold.times if timed else np.empty(0),
            forces_N=hold.forces,
            image=next((image for image in samples.images[run.rows] if image), None),
            line=samples.lines[run.first],
            displacement_std_m=scatter,
        )
        for run, branch, position, scatter, hold, force, std in zip(
            runs, branches, places.place, places.std, holds, fitted.force, fitted.std, strict=True
        )
    )


def _mounted(samples: Samples, tolerance: float) -> NDArray[np.bool_]:
    """Rows (n,) of the mounted cable: as the log calls them, else a first hold without force."""
    if samples.branches is not None:
        return np.array([branch == "mounted" for branch in samples.branches])
    away = np.abs(samples.displacements - samples.displacements[0]) > tolerance
    first = np.logical_and.accumulate(~away)
    middle = abs(float(np.median(samples.forces[first])))
    free = middle <= FREE * float(np.max(np.abs(samples.forces)))
    return np.asarray(first & free)


def _runs(samples: Samples, tolerance: float) -> tuple[list[Run], list[Finding]]:
    """Holds in the order of the log, with unique step numbers."""
    branches, displacements = samples.branches or ("",) * len(samples.lines), samples.displacements
    if samples.steps is not None:
        marks = list(zip(samples.steps, branches, strict=True))
        starts = [0, *(row for row in range(1, len(marks)) if marks[row] != marks[row - 1])]
        return _numbered(samples, starts, tolerance)
    starts = [0]
    for row in range(1, len(displacements)):
        moved = abs(displacements[row] - displacements[starts[-1]]) > tolerance
        if moved or branches[row] != branches[row - 1]:
            starts.append(row)
    stretches = list(pairwise([*starts, len(displacements)]))
    long = _held(stretches, displacements, tolerance)
    named = [any(samples.images[slice(*pair)]) for pair in stretches]
    held = [pair for pair, keep in zip(stretches, long | named, strict=True) if keep] if long.any() else stretches
    key = "log/steps-inferred.way" if len(held) < len(stretches) else "log/steps-inferred"
    runs = [Run(first, last, number) for number, (first, last) in enumerate(held)]
    return runs, [inferred(key, steps=len(held), others=len(stretches) - len(held))]


def _held(stretches: Sequence[tuple[int, int]], displacements: Array, tolerance: float) -> NDArray[np.bool_]:
    """Which stretches of constant displacement are holds and no part of a ramp, (n,).

    A slow ramp, or a fast one sampled often, is a chain of stretches a little more than the tolerance apart: what has
    two samples or more moves on by at most twice that. In a chain only those are holds that stand out by their length.
    """
    firsts = np.array([first for first, _ in stretches])
    lengths = np.array([last - first for first, last in stretches])
    held = lengths >= LEAST_SAMPLES
    breaks = np.flatnonzero(np.abs(np.diff(displacements[firsts])) > 2.0 * tolerance) + 1
    for chain in np.split(np.arange(lengths.size), breaks):
        if chain.size >= RAMP:
            held[chain] &= lengths[chain] > OVER_RAMP * np.median(lengths[chain])
    return held


def _numbered(samples: Samples, starts: Sequence[int], tolerance: float) -> tuple[list[Run], list[Finding]]:
    """Holds by the step column; numbers that are missing or come back are replaced by the order of the log."""
    labels, displacements = samples.steps or (), samples.displacements
    pairs = list(pairwise([*starts, len(labels)]))
    numbers = [_number(labels[first]) for first in starts]
    known = [number for number in numbers if number is not None]
    if len(set(known)) == len(numbers):
        return [Run(*pair, number) for pair, number in zip(pairs, known, strict=True)], []
    noted = [inferred("log/steps-renumbered")]
    begun: dict[int, int] = {}
    for again, number in zip(starts, numbers, strict=True):
        if number is None or begun.setdefault(number, again) == again:
            continue
        first = begun[number]
        if abs(displacements[again] - displacements[first]) > tolerance:
            place = {"line": samples.lines[first], "again": samples.lines[again], "step": number}
            at = {"one_m": displacements[first], "other_m": displacements[again]}
            noted.append(doubtful("steps/doubled", **place, **at))
    return [Run(*pair, number) for number, pair in enumerate(pairs)], noted


def _number(label: str) -> int | None:
    """Step number of a cell such as ``3``, ``3.0`` or ``Stufe 3``."""
    found = re.fullmatch(r"\D*?(\d{1,9})(?:[.,]0*)?", label, re.ASCII)
    return int(found[1]) if found else None


def _rows_with_photo(samples: Samples, run: Run) -> list[int]:
    """Rows that name the (first) photo of a hold."""
    named = [row for row in range(run.first, run.last) if samples.images[row]]
    return [row for row in named if samples.images[row] == samples.images[named[0]]]


def _hold(samples: Samples, forces: Array, run: Run) -> Hold:
    """Forces of a run over time, or over the number of the sample where the log has no time."""
    rows = _rows_with_photo(samples, run)
    if samples.times is None:
        times, photo = np.arange(run.first, run.last, dtype=np.float64), np.array(rows, dtype=np.float64)
    else:
        times, photo = samples.times[run.rows], samples.times[rows]
    return Hold(times, forces[run.rows], photo_time=float(np.mean(photo)) if rows else None)


def _check_swapped(samples: Samples, runs: Sequence[Run]) -> None:
    """Refuse a log whose force stands still to the last digit in every hold while its displacement scatters."""
    holds = [run.rows for run in runs if run.last - run.first > 2]
    if len(holds) < 2 or any(np.ptp(samples.forces[hold]) > 0.0 for hold in holds):
        return
    scatter = [float(np.ptp(samples.displacements[hold])) for hold in holds]
    if min(scatter) > 0.0 and np.ptp(samples.forces) > 0.0:
        raise InputError(Message("log/swapped-columns", holds=len(holds), scatter_m=max(scatter)))


def _wild(forces: Array, runs: Sequence[Run]) -> list[int]:
    """Rows whose force no cable could have: a slipped digit, a damaged transmission.

    Only where the other samples of the hold agree that it is wrong, which takes four of them.
    """
    middles = np.array([float(np.median(forces[run.rows])) for run in runs])
    limit = WILD * float(np.max(np.abs(middles)))
    found = []
    for run, middle in zip(runs, middles, strict=True):
        off = np.flatnonzero(np.abs(forces[run.rows] - middle) > limit)
        if limit > 0.0 and 0 < 4 * off.size < run.last - run.first:
            found += [run.first + int(row) for row in off]
    return found


def _fit_findings(
    fitted: HoldForces, places: HoldPlaces, tolerance: float, settings: IntakeSettings
) -> Iterator[Finding]:
    """Findings on how forces and their errors were taken from the holds, and on displacements that scatter."""
    if fitted.degree:
        yield inferred("log/trend", degree=fitted.degree)
    if not fitted.sampled:
        share = settings.force_std_relative
        yield inferred("log/force-std", share=share, std_N=float(fitted.std[0]))
    if places.sigma > tolerance:  # by more than the difference that makes a new hold
        largest = max(std for std in places.std if std is not None)
        yield inferred("log/displacement-noise", scatter_m=places.sigma, std_m=largest)


def _hold_findings(samples: Samples, runs: Sequence[Run], most: float) -> Iterator[Finding]:
    """Contradictions within a hold: a displacement that moves by more than ``most`` (m), more than one photo."""
    for run in runs:
        place = {"line": samples.lines[run.first], "step": run.step}
        spread = float(np.ptp(samples.displacements[run.rows]))
        if spread > most:
            yield doubtful("steps/displacement-spread", spread_m=spread, **place)
        images = list(dict.fromkeys(image for image in samples.images[run.rows] if image))
        if len(images) > 1:
            taken, other = map(repr, images[:2])
            yield doubtful("photo/several", count=len(images), taken=taken, other=other, **place)


def _order_findings(steps: Sequence[LoadStep], tolerance: float) -> Iterator[Finding]:
    """Contradictions between neighbouring steps; displacements closer than ``tolerance`` (m) are equal."""
    for before, after in pairwise(steps):
        change = after.displacement_m - before.displacement_m
        place = {"line": after.line, "step": after.step, "before": before.step}
        way = {"from_m": before.displacement_m, "to_m": after.displacement_m}
        if after.branch == before.branch and abs(change) <= tolerance:
            yield doubtful("steps/doubled.place", **place, **way)
        elif {"loading": -change, "unloading": change}.get(after.branch, 0.0) > tolerance:
            yield doubtful("steps/branch", branch=after.branch, **place, **way)
        if abs(after.step - before.step) > 1:
            yield doubtful("steps/missing", **place)
    for step in steps:
        if step.branch == "mounted" and abs(step.displacement_m) > tolerance:
            at = step.displacement_m
            yield doubtful("steps/branch.mounted", line=step.line, step=step.step, displacement_m=at)
