"""Faults of the data that show without any fit: a mixed-up photo is not physics.

Photographed chords are held against the displacement log (order of photos, unit), photos against each other (doubled),
traced against stated length, forces against what a cable can do (sign) and against each other (stuck).

Codes: ``photo/order``, ``photo/doubled``, ``photo/moving-apart``, ``force/sign``, ``force/stuck``, ``log/unit``,
``log/displacement``, ``length/traced``, ``length/other-cable``, ``rig/axis-by-log``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np

from pipeline.faults.record import Faults
from pipeline.faults.stuck_forces import stuck_forces
from pipeline.records import Array, doubtful, failed, inferred
from rod.measurement import MeasuredShape, MeasuredStep, MeasuredTest

UNITS = {1e3: "m", 1e-3: "um", 10.0: "cm", 25.4: "inches"}
"""What the displacement column may hold if the chord changes this many times as much as the log says."""

ALONE = 4.0
"""Times the spread of all other sums of chord and displacement: a sum that far away is alone among them. Also standard
deviations of a chord: displacements nearer to each other are those of one place."""

MISMATCH = 0.15
"""Of the travel: mismatch of chord and displacement from which order or unit is doubted. Play, a yielding frame and a
wrong zero stay below a tenth."""

OF_ONE = 0.02
"""Of the travel: mismatch of a single chord and its displacement from which that displacement is doubted, in place of a
photo or a cause: a fifth of a step of ten."""

DOUBLED = 0.03
"""Of the scatter of the sections: two photos that differ by less are one photo; light and ground that stay make two
photos of one shape alike to an eighth."""

TOGETHER = 0.5
"""Correlation of chords and displacements that noise about no motion at all hardly reaches; it is -1 in a test."""

OTHER_LENGTH = 0.01
"""Relative: traced against stated length from which length_mm is doubted; a rule is read to a tenth of that."""

OTHER_CABLE = 0.1
"""Relative; a ruler or a chessboard errs by hundredths. By a tenth and more a length is that of something else, or in
another unit, and f_EI, which grows with its square, is off by a fifth."""


def faults_of_input(test: MeasuredTest) -> Faults:
    """Faults that show without any fit."""
    found = Faults(test)
    checks: tuple[Callable[[Faults], Faults], ...] = (
        _unit_of_displacement,
        _doubled_photos,
        _order_of_photos,
        _displacement,
        _moving_apart,
        _traced_length,
        _axis_by_log,
        _forces,
        _stuck,
    )
    for check in checks:
        found = found.joined(check(found))
    return found


def _logged(found: Faults, *, loaded: bool = False) -> tuple[list[int], Array, Array]:
    """Steps (n,) with a chord on a photo and a displacement in the log: their indices, displacements and chords (m)."""
    both = [
        (i, step.displacement, step.chord)
        for i, step in enumerate(found.test.steps)
        if step.chord is not None and step.displacement is not None and i not in found.photos
        if not loaded or step.branch != "mounted"
    ]
    _, displacement, chord = np.array(both, dtype=float).reshape(-1, 3).T
    return [i for i, *_ in both], displacement, chord


def _unit_of_displacement(found: Faults) -> Faults:
    """The chord changes by another factor than one per displacement: a unit."""
    test, (used, displacement, chord) = found.test, _logged(found)
    if len(used) < 2 or np.ptp(displacement) <= 0.0 or np.ptp(chord) <= 0.0:
        return Faults(test)
    slope, at_zero = np.polyfit(displacement, chord, 1)
    left = float(np.sqrt(np.mean((chord - at_zero - slope * displacement) ** 2)))
    factor = min(UNITS, key=lambda unit: abs(np.log(abs(slope) / unit)))
    near = abs(np.log(abs(slope) / factor)) < MISMATCH
    if slope >= 0.0 or not near or left > MISMATCH * np.ptp(chord):
        return Faults(test)
    steps = tuple(
        replace(step, displacement=None if step.displacement is None else -slope * step.displacement)
        for step in test.steps
    )
    return Faults(replace(test, steps=steps), (doubtful("log/unit.scaled", times=-slope, unit=UNITS[factor]),))


def _doubled_photos(found: Faults) -> Faults:
    """Two photos from files of the same contents, or whose noise is the same, are one photo."""
    steps = found.test.steps
    pictures = [(i, step.shape) for i, step in enumerate(steps) if step.shape is not None]
    findings, dropped, gap = [], set(), _mismatch(found)
    for (i, one), (j, other) in combinations(pictures, 2):
        assert one is not None and other is not None
        same_file = steps[i].picture is not None and steps[i].picture == steps[j].picture
        if not same_file and not _same_noise(one, other, DOUBLED):
            continue
        wrong = j if gap.get(j, 0.0) >= gap.get(i, 0.0) else i
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
    return float(np.sqrt(np.mean(shape.section_offsets() ** 2)))


def _mismatch(found: Faults) -> dict[int, float]:
    """How far chord plus displacement of each step lies from the median of all, m."""
    used, displacement, chord = _logged(found)
    sums = displacement + chord
    return dict(zip(used, np.abs(sums - np.median(sums)).tolist() if used else [], strict=True))


def _order_of_photos(found: Faults) -> Faults:
    """Chords fit the displacements in another order than the one given: each photo goes to the step that it fits.

    A cable that is pushed further has a shorter chord, whatever rig and cable do; where the bearing moves one way, play
    and a yielding frame change nothing of that. Steps of one displacement (up and down) cannot be told apart by it: a
    photo that may be of either is left out.
    """
    used, displacement, _ = _logged(found)
    travel = float(np.ptp(displacement)) if used else 0.0
    whole = _put_in_order(found.test, used, MISMATCH * travel)
    if whole.findings:
        return whole
    for branch in ("loading", "unloading"):
        own = [i for i in used if found.test.steps[i].branch == branch]
        whole = whole.joined(_put_in_order(whole.test, own, OF_ONE * travel, spread=ALONE))
    return whole


def _put_in_order(test: MeasuredTest, used: list[int], limit: float, *, spread: float = 0.0) -> Faults:
    """Photos of some steps at those that they fit, where chords are off by more than a limit (m) as they are given.

    ``spread``: by more than so many times what they differ by in their order, too.
    """
    displacement, chord = (np.array([getattr(test.steps[i], name) for i in used]) for name in ("displacement", "chord"))
    if len(used) < 2:
        return Faults(test)
    by_log, by_photo = np.argsort(displacement, kind="stable"), np.argsort(-chord, kind="stable")
    sums = chord[by_photo] + displacement[by_log]
    limit = max(limit, spread * float(np.ptp(sums)))
    wrong = np.abs(chord + displacement - np.median(sums)) > limit
    if not limit > 0.0 or wrong.sum() < 2 or np.any(np.abs(sums - np.median(sums)) > limit):
        return Faults(test)
    level = np.zeros(len(used), dtype=int)
    alike = ALONE * max(test.steps[i].chord_std or 0.0 for i in used)
    level[by_log] = np.cumsum(np.diff(displacement[by_log], prepend=displacement.min()) > alike)
    belongs = np.empty_like(level)
    belongs[by_photo] = level[by_log]
    steps, moved, out = list(test.steps), {}, set()
    for one in np.unique(level):
        places = [used[k] for k in np.flatnonzero((level == one) & (belongs != one))]
        photos = [used[k] for k in np.flatnonzero((belongs == one) & (level != one))]
        if len(places) > 1:
            out.update(places)
        elif places:
            steps[places[0]] = _with_photo_of(test.steps[places[0]], test.steps[photos[0]])
            moved[test.steps[places[0]].step] = test.steps[photos[0]].step
    put_right = Faults(replace(test, steps=tuple(steps)), photos=frozenset(out), moved=moved)
    told = [doubtful("photo/order", steps=sorted(moved))] if moved else []
    if out:
        told.append(doubtful("photo/order.unclear", steps=[test.steps[i].step for i in sorted(out)]))
    return replace(put_right, findings=tuple(told))


def _with_photo_of(step: MeasuredStep, other: MeasuredStep) -> MeasuredStep:
    return replace(
        step,
        chord=other.chord,
        chord_std=other.chord_std,
        shape=other.shape,
        picture_centre=other.picture_centre,
        picture=other.picture,
    )


def _displacement(found: Faults) -> Faults:
    """One chord under load that does not fit its displacement, where all others do; its step then goes by the chord.

    The force-free step is none of them: play and a yielding frame set it apart from all others.
    """
    test, (used, displacement, chord) = found.test, _logged(found, loaded=True)
    if len(used) < 4:
        return Faults(test)
    sums = chord + displacement
    off = sums - np.median(sums)
    worst = int(np.argmax(np.abs(off)))
    rest, travel = float(np.ptp(np.delete(off, worst))), float(np.ptp(chord))
    if abs(off[worst]) < max(OF_ONE * travel, ALONE * rest):
        return Faults(test)
    step = test.steps[used[worst]]
    apart = "apart" if off[worst] > 0.0 else "nearer"
    finding = doubtful("log/displacement", step=step.step, off_m=abs(off[worst]), apart=apart)
    steps = tuple(replace(one, displacement=None) if one is step else one for one in test.steps)
    doubted = {used[worst]: float(step.displacement or 0.0)}
    return Faults(replace(test, steps=steps), (finding,), doubted=doubted)


def _moving_apart(found: Faults) -> Faults:
    """The bearings move apart on the photos where the log pushes them together."""
    used, displacement, chord = _logged(found)
    if len(used) < 3:
        return Faults(found.test)
    moved, chord = displacement - displacement.mean(), chord - chord.mean()
    together = float(moved @ chord) > TOGETHER * float(np.linalg.norm(moved) * np.linalg.norm(chord))
    return Faults(found.test, (failed("photo/moving-apart"),) if together else ())


def _traced_length(found: Faults) -> Faults:
    """All photos show another length than the one stated."""
    test = found.test
    used = [step for i, step in enumerate(test.steps) if step.shape and i not in found.photos]
    used = [step for step in used if not step.chord_by_log] or used
    traced = [float(step.shape.s[-1]) for step in used if step.shape]
    if not traced:
        return Faults(test)
    off = float(np.median(traced)) / test.length - 1.0
    if abs(off) >= OTHER_CABLE:
        return Faults(test, (failed("length/other-cable", seen_m=np.median(traced), stated_m=test.length),))
    if abs(off) < OTHER_LENGTH or np.ptp(traced) / test.length > abs(off):
        return Faults(test)
    # covers above the cable are seen too far apart, never too near: then neither need be wrong
    key = "length/traced.covers" if off > 0.0 and test.axis_parallax_std > 0.0 else "length/traced"
    return Faults(test, (doubtful(key, seen_m=np.median(traced), stated_m=test.length),))


def _axis_by_log(found: Faults) -> Faults:
    """Photos that do not show where the axis that moves is."""
    count = sum(step.chord_by_log for step in found.test.steps)
    told = (inferred("rig/axis-by-log", count=count, moving=found.test.moving),) if count else ()
    return Faults(found.test, told)


def _forces(found: Faults) -> Faults:
    """Forces of the wrong sign."""
    pulling = [step.force < 0.0 for step in found.test.steps if step.branch != "mounted"]
    return Faults(found.test, (doubtful("force/sign"),) if 2 * sum(pulling) > len(pulling) else ())


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
