"""Faults of the data, told apart from causes: a mixed-up photo is not physics.

Before anything is fitted, photographed chords are held against the displacement log (order of photos, unit), photos
against each other (doubled), traced against stated length, forces against what a cable can do (unit, sign) and against
each other (stuck). After the base fit, breaks in the forces (`force_breaks`) and single items (`outlier`) are sought.

Codes: ``photo/order``, ``photo/doubled``, ``force/sign``, ``force/stuck``, ``force/unit``, ``log/unit``,
``log/displacement``, ``length/traced``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from pipeline.diagnosis.fits.stuck_forces import stuck_forces
from pipeline.records import Finding, doubtful
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.measurement import MeasuredShape, MeasuredStep, MeasuredTest

Array = NDArray[np.float64]

UNITS = {1e3: "m", 1e-3: "um", 10.0: "cm", 25.4: "inches"}
"""What the displacement column may hold if the chord changes this many times as much as the log says."""

ALONE = 4.0
"""Times the spread of all other sums of chord and displacement: a sum that far away is alone among them."""


@dataclass(frozen=True)
class ForceCorrection:
    """What was wrong with the forces of some steps: shown = factor * force + offset (N); steps by their numbers.

    ``errors``: what the correction may be off by, N for each of the steps, rows of one standard deviation each.
    """

    steps: tuple[int, ...]
    factor: float
    offset: float
    errors: tuple[tuple[float, ...], ...] = ()

    def applied(self, test: MeasuredTest) -> MeasuredTest:
        """The test with these forces as they should have been, and with what they may be off by together."""
        steps = tuple(self._corrected(s) if s.step in self.steps else s for s in test.steps)
        errors = tuple(dict(zip(self.steps, row, strict=True)) for row in self.errors)
        return replace(test, steps=steps, common_force_errors=(*test.common_force_errors, *errors))

    def _corrected(self, step: MeasuredStep) -> MeasuredStep:
        return replace(
            step,
            force=(step.force - self.offset) / self.factor,
            force_std=step.force_std / abs(self.factor),
            hold_forces=None if step.hold_forces is None else (step.hold_forces - self.offset) / self.factor,
        )


@dataclass(frozen=True)
class Faults:
    """What is wrong with the data.

    Attributes
    ----------
    test : MeasuredTest
        With displacements replaced by chords where their unit is wrong.
    findings : tuple of Finding
    photos, forces : frozenset of int
        Indices of steps whose photo, or force, is not to be used.
    corrections : tuple of ForceCorrection
        Those that ``test`` has got.
    """

    test: MeasuredTest
    findings: tuple[Finding, ...] = ()
    photos: frozenset[int] = frozenset()
    forces: frozenset[int] = frozenset()
    corrections: tuple[ForceCorrection, ...] = ()

    def loaded_forces(self) -> list[int]:
        """Indices of the steps under load whose force may be used; without any, stiffness has no scale."""
        steps = enumerate(self.test.steps)
        return [i for i, step in steps if step.branch != "mounted" and step.force and i not in self.forces]

    def joined(self, other: Faults) -> Faults:
        """Both."""
        return Faults(
            other.test,
            (*self.findings, *other.findings),
            self.photos | other.photos,
            self.forces | other.forces,
            (*self.corrections, *other.corrections),
        )


def faults_of_input(test: MeasuredTest, settings: DiagnosisSettings) -> Faults:
    """Faults that show without any fit."""
    found = Faults(test)
    for check in (
        _unit_of_displacement,
        _doubled_photos,
        _order_of_photos,
        _displacement,
        _traced_length,
        _forces,
    ):
        found = found.joined(check(found, settings))
    return found.joined(_stuck(found))


def _with_both(found: Faults) -> list[int]:
    steps = found.test.steps
    return [
        i
        for i, step in enumerate(steps)
        if step.chord is not None and step.displacement is not None and i not in found.photos
    ]


def _unit_of_displacement(found: Faults, settings: DiagnosisSettings) -> Faults:
    """The chord changes by another factor than one per displacement: a unit."""
    test, used = found.test, _with_both(found)
    if len(used) < 2:
        return Faults(test)
    chord = np.array([test.steps[i].chord for i in used], dtype=float)
    displacement = np.array([test.steps[i].displacement for i in used], dtype=float)
    if np.ptp(displacement) <= 0.0 or np.ptp(chord) <= 0.0:
        return Faults(test)
    slope, at_zero = np.polyfit(displacement, chord, 1)
    left = float(np.sqrt(np.mean((chord - at_zero - slope * displacement) ** 2)))
    factor = min(UNITS, key=lambda unit: abs(np.log(abs(slope) / unit)))
    near = abs(np.log(abs(slope) / factor)) < settings.chord_mismatch
    if slope >= 0.0 or not near or left > settings.chord_mismatch * np.ptp(chord):
        return Faults(test)
    steps = tuple(
        replace(step, displacement=None if step.displacement is None else -slope * step.displacement)
        for step in test.steps
    )
    return Faults(replace(test, steps=steps), (doubtful("log/unit.scaled", times=-slope, unit=UNITS[factor]),))


def _doubled_photos(found: Faults, settings: DiagnosisSettings) -> Faults:
    """Two photos from files of the same contents, or whose noise is the same, are one photo."""
    steps = found.test.steps
    pictures = [(i, step.shape) for i, step in enumerate(steps) if step.shape is not None]
    findings, dropped = [], set()
    for (i, one), (j, other) in combinations(pictures, 2):
        assert one is not None and other is not None
        same_file = steps[i].picture is not None and steps[i].picture == steps[j].picture
        if not same_file and not _same_noise(one, other, settings.doubled_share):
            continue
        gap = {k: abs(_mismatch(found.test, k)) for k in (i, j)}
        wrong = j if gap[j] >= gap[i] else i
        dropped.add(wrong)
        both = {"step": steps[i].step, "other": steps[j].step}
        findings.append(doubtful("photo/doubled.picture", **both, wrong=steps[wrong].step))
    return Faults(found.test, tuple(findings), frozenset(dropped))


def _same_noise(one: MeasuredShape, other: MeasuredShape, share: float) -> bool:
    if abs(len(one.section_s) - len(other.section_s)) > 2:
        return False
    x = np.interp(one.section_s, other.section_s, other.section_x)
    y = np.interp(one.section_s, other.section_s, other.section_y)
    apart = float(np.sqrt(np.mean((one.section_x - x) ** 2 + (one.section_y - y) ** 2)))
    # Against the scatter as it is, not as it is stated: an elastic cable unloaded in the same steps shows every shape
    # twice, and only the noise of the two photos then differs.
    return apart < share * min(_scatter(one), _scatter(other))


def _scatter(shape: MeasuredShape) -> float:
    """Root mean square distance of the sections from the smooth centerline, m."""
    theta = np.interp(shape.section_s, shape.s, shape.theta)
    dx = shape.section_x - CubicHermiteSpline(shape.s, shape.x, np.cos(shape.theta))(shape.section_s)
    dy = shape.section_y - CubicHermiteSpline(shape.s, shape.y, np.sin(shape.theta))(shape.section_s)
    return float(np.sqrt(np.mean((-np.sin(theta) * dx + np.cos(theta) * dy) ** 2)))


def _mismatch(test: MeasuredTest, index: int) -> float:
    """Chord plus displacement of a step, against the median of all."""
    sums = {
        i: step.chord + step.displacement
        for i, step in enumerate(test.steps)
        if step.chord is not None and step.displacement is not None
    }
    return sums[index] - float(np.median(list(sums.values()))) if index in sums else 0.0


def _order_of_photos(found: Faults, settings: DiagnosisSettings) -> Faults:
    """Chords fit the displacements in another order than the one given."""
    test, used = found.test, _with_both(found)
    if len(used) < 2:
        return Faults(test)
    chord = np.array([test.steps[i].chord for i in used], dtype=float)
    displacement = np.array([test.steps[i].displacement for i in used], dtype=float)
    travel = float(np.ptp(displacement))
    if travel <= 0.0:
        return Faults(test)
    by_log = np.argsort(displacement, kind="stable")
    by_photo = np.argsort(-chord, kind="stable")
    sorted_sum = chord[by_photo] + displacement[by_log]
    natural = float(np.median(sorted_sum))
    given = chord + displacement - natural
    limit = settings.chord_mismatch * travel
    wrong = np.abs(given) > limit
    if wrong.sum() < 2 or np.any(np.abs(sorted_sum - natural) > limit):
        return Faults(test)
    out = [used[k] for k in np.flatnonzero(wrong)]
    return Faults(test, (doubtful("photo/order", steps=[test.steps[i].step for i in out]),), frozenset(out))


def _displacement(found: Faults, settings: DiagnosisSettings) -> Faults:
    """One chord under load that does not fit its displacement, where all others do; its step then goes by the chord.

    The force-free step is none of them: play and a yielding frame set it apart from all others.
    """
    test, used = found.test, [i for i in _with_both(found) if found.test.steps[i].branch != "mounted"]
    if len(used) < 4:
        return Faults(test)
    chord = np.array([test.steps[i].chord for i in used], dtype=float)
    sums = chord + np.array([test.steps[i].displacement for i in used], dtype=float)
    off = sums - np.median(sums)
    worst = int(np.argmax(np.abs(off)))
    rest, travel = float(np.ptp(np.delete(off, worst))), float(np.ptp(chord))
    if abs(off[worst]) < max(settings.displacement_mismatch * travel, ALONE * rest):
        return Faults(test)
    step = test.steps[used[worst]]
    apart = "apart" if off[worst] > 0.0 else "nearer"
    finding = doubtful("log/displacement", step=step.step, off_m=abs(off[worst]), apart=apart)
    steps = tuple(replace(one, displacement=None) if one is step else one for one in test.steps)
    return Faults(replace(test, steps=steps), (finding,))


def _traced_length(found: Faults, settings: DiagnosisSettings) -> Faults:
    """All photos show another length than the one stated."""
    test = found.test
    traced = [float(step.shape.s[-1]) for i, step in enumerate(test.steps) if step.shape and i not in found.photos]
    if not traced:
        return Faults(test)
    off = float(np.median(traced)) / test.length - 1.0
    if abs(off) < settings.length_mismatch or np.ptp(traced) / test.length > abs(off):
        return Faults(test)
    # covers above the cable are seen too far apart, never too near: then neither need be wrong
    key = "length/traced.covers" if off > 0.0 and test.axis_parallax_std > 0.0 else "length/traced"
    return Faults(test, (doubtful(key, seen_m=np.median(traced), stated_m=test.length),))


def _forces(found: Faults, settings: DiagnosisSettings) -> Faults:
    """Forces of the wrong sign, or of a size no cable has."""
    test = found.test
    pushed = [step for step in test.steps if step.branch != "mounted"]
    forces = np.array([step.force for step in pushed])
    if forces.size and np.mean(forces < 0.0) > 0.5:
        return Faults(test, (doubtful("force/sign"),))
    stiffness = float(np.max(np.abs(forces), initial=0.0)) * test.length**2 / np.pi**2
    low, high = settings.stiffness_range
    if 0.0 < stiffness < low or stiffness > high:
        return Faults(test, (doubtful("force/unit", stiffness=stiffness, low=low, high=high),))
    return Faults(test)


def _stuck(found: Faults) -> Faults:
    """Forces that stand still while the bearing moves."""
    test = found.test
    stuck = stuck_forces(test.steps)
    if not stuck:
        return Faults(test)
    steps = [test.steps[i] for i in stuck]
    read = np.mean([step.force for step in steps])
    finding = doubtful("force/stuck", steps=[step.step for step in steps], force_N=read)
    return Faults(test, (finding,), forces=frozenset(stuck))
