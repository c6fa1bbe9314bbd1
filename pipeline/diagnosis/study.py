"""How often the diagnosis is right: false alarms, power, right names, size and coverage of the set, calibration.

Two studies. `linear_study` draws noise and effects on the sensitivities of a planned test: ten thousand specimens in
seconds, enough digits for false alarms, power and calibration, but blind to whatever is not linear. `full_study` runs
the whole diagnosis on specimens that a maker provides, which must be another solver than the fit's (the project's tests
hand in collocation solutions with the noise of real photos). Both return counts with their standard errors.
"""

from __future__ import annotations

import datetime
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.design import Plan, planned_bench
from pipeline.diagnosis.diagnose import diagnose
from pipeline.diagnosis.score import admissible, sigma_needed
from pipeline.diagnosis.verdict import Weighed, credible_set, probabilities, scan_share
from pipeline.diagnosis.workbench import Workbench
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.measurement import MeasuredTest

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rate:
    """A share of so many trials."""

    share: float
    trials: int

    @property
    def std(self) -> float:
        """Standard error, by the rule of succession so that 0 of n is not certain."""
        p = (self.share * self.trials + 1.0) / (self.trials + 2.0)
        return float(np.sqrt(p * (1.0 - p) / (self.trials + 2.0)))


@dataclass(frozen=True)
class LinearStudy:
    """Outcome of `linear_study`.

    Attributes
    ----------
    false_alarms : Rate
        Anything named where nothing is hidden.
    misjudged : dict of str -> Rate
        The same with the noise 20 % larger than stated, and with heavy tails (Student, 5 degrees).
    power : Rate
        Detected at the detectable amount.
    in_set : dict of times -> Rate
        True cause in the 95 % set at multiples of that amount.
    set_size : dict of times -> mean size of the set
    calibration : float
        Largest gap between stated probability and share right, in bins of 0.1 with at least 200 specimens.
    seed, draws : int
    date : str
    """

    false_alarms: Rate
    misjudged: dict[str, Rate]
    power: Rate
    in_set: dict[float, Rate]
    set_size: dict[float, float]
    calibration: float
    seed: int
    draws: int
    date: str


def linear_study(
    plan: Plan, *, draws: int = 10000, seed: int = 1, settings: DiagnosisSettings | None = None
) -> LinearStudy:
    """Study on the sensitivities of a planned test.

    Parameters
    ----------
    plan : Plan
    draws : int
        Specimens for each figure.
    seed : int
    settings : DiagnosisSettings or None
    """
    settings = settings or DiagnosisSettings()
    bench = planned_bench(plan, settings)
    rng = np.random.default_rng(seed)
    unit, sign = bench.suspicion.scores.unit, bench.suspicion.sign

    def alarms(noise: Array) -> Rate:
        return Rate(float(np.mean(admissible(noise @ unit, sign).max(axis=1) > bench.limit)), len(noise))

    size = (draws, len(unit))
    heavy = rng.standard_t(5, size) / np.sqrt(5.0 / 3.0)
    needed = sigma_needed(bench.limit, power=settings.power)
    seen, in_set, sizes, stated = [], {}, {}, []
    for times in (1.0, 2.0, 4.0):
        right, count, detected, chance = _named(bench, times * needed, draws, rng, settings)
        in_set[times], sizes[times] = Rate(float(np.mean(right)), len(right)), float(np.mean(count))
        stated.append(chance)
        if times == 1.0:
            seen = detected
    return LinearStudy(
        false_alarms=alarms(rng.standard_normal(size)),
        misjudged={"noise 20 % larger": alarms(1.2 * rng.standard_normal(size)), "heavy tails": alarms(heavy)},
        power=Rate(float(np.mean(seen)), draws),
        in_set=in_set,
        set_size=sizes,
        calibration=_calibration(np.vstack(stated)),
        seed=seed,
        draws=draws,
        date=_today(),
    )


def _named(
    bench: Workbench, size: float, draws: int, rng: np.random.Generator, settings: DiagnosisSettings
) -> tuple[list[bool], list[int], list[bool], Array]:
    """Specimens with one effect of ``size`` sigma in the clearest form of a random visible cause."""
    suspicion = bench.suspicion
    causes = [k for k in range(len(suspicion.causes)) if np.any(suspicion.scores.norm[suspicion.of(k)] > 0.0)]
    right, count, detected, stated = [], [], [], []
    for _ in range(draws):
        truth = int(rng.choice(causes))
        own = suspicion.of(truth)
        form = int(own[np.argmax(suspicion.scores.norm[own])])
        way = suspicion.sign[form] or rng.choice([-1.0, 1.0])
        z = (way * size * suspicion.scores.unit[:, form] + rng.standard_normal(len(bench.base.residual))) @ (
            suspicion.scores.unit
        )
        statistic = admissible(z, suspicion.sign)
        detected.append(bool(statistic[form] > bench.limit))
        if statistic.max() <= bench.limit:
            continue
        options = [_option(statistic[suspicion.of(k)], suspicion.causes[k].sign) for k in causes]
        chance = probabilities(options, reduced_chi2=1.0, implausible=settings.implausible)
        members = [causes[k] for k in credible_set(chance, level=settings.set_level)]
        right.append(truth in members)
        count.append(len(members))
        stated.append((float(chance.max()), float(members[0] == truth)))
    return right, count, detected, np.array(stated).reshape(-1, 2)


def _option(statistic: Array, sign: int) -> Weighed:
    return Weighed(float(statistic.max() ** 2), scan=scan_share(statistic), signs=1 if sign else 2)


def _calibration(stated: Array) -> float:
    gaps = [0.0]
    for low in np.arange(0.3, 1.0, 0.1):
        chosen = (stated[:, 0] > low) & (stated[:, 0] <= low + 0.1)
        if chosen.sum() >= 200:
            gaps.append(abs(float(stated[chosen, 1].mean() - stated[chosen, 0].mean())))
    return max(gaps)


@dataclass(frozen=True)
class Case:
    """One specimen of a full study: the hidden name (empty for none) and its amount, seed and protocol."""

    name: str
    amount: float
    protocol: str
    seed: int


@dataclass(frozen=True)
class FullStudy:
    """Outcome of `full_study`.

    Attributes
    ----------
    false_alarms : Rate
        Anything but ``adequate`` or ``underpowered`` where nothing is hidden.
    named : Rate
        True name in the class of a cause that was found.
    set_size : float
    removed : list of float
        Held-out share of the excess misfit that the named cause removes.
    confusion : dict of hidden name -> dict of found name (``-`` for none) -> count
    verdicts : dict of hidden name -> dict of verdict -> count
    date : str
    """

    false_alarms: Rate
    named: Rate
    set_size: float
    removed: list[float]
    confusion: dict[str, dict[str, int]] = field(default_factory=dict)
    verdicts: dict[str, dict[str, int]] = field(default_factory=dict)
    date: str = ""


def full_study(
    cases: Iterable[Case],
    make: Callable[[Case], MeasuredTest],
    *,
    settings: DiagnosisSettings | None = None,
    progress: Callable[[Case, str], None] | None = None,
) -> FullStudy:
    """Run the whole diagnosis on made specimens.

    Parameters
    ----------
    cases : iterable of Case
    make : callable
        From a case to its measured test; must not use the program's own simulation.
    settings : DiagnosisSettings or None
    progress : callable or None
        Called after each case with its verdict.
    """
    settings = settings or DiagnosisSettings()
    null: list[bool] = []
    right: list[bool] = []
    sizes: list[int] = []
    removed: list[float] = []
    confusion: dict[str, dict[str, int]] = {}
    verdicts: dict[str, dict[str, int]] = {}
    for case in cases:
        part, _ = diagnose(make(case), None, settings)
        found = part.causes[0].name if part.causes else "-"
        row, word = confusion.setdefault(case.name, {}), verdicts.setdefault(case.name, {})
        row[found] = row.get(found, 0) + 1
        word[part.verdict] = word.get(part.verdict, 0) + 1
        if case.name == "":
            null.append(part.verdict not in ("adequate", "underpowered"))
        else:
            names = {name for cause in part.causes for name in cause.class_}
            right.append(case.name in names)
            sizes.extend([len(names)] if names else [])
            if part.gain is not None:
                removed.append(part.gain.heldout_excess_removed)
        if progress is not None:
            progress(case, part.verdict)
    return FullStudy(
        false_alarms=Rate(float(np.mean(null)) if null else 0.0, len(null)),
        named=Rate(float(np.mean(right)) if right else 0.0, len(right)),
        set_size=float(np.mean(sizes)) if sizes else 0.0,
        removed=removed,
        confusion=confusion,
        verdicts=verdicts,
        date=_today(),
    )


def _today() -> str:
    return datetime.datetime.now(datetime.UTC).date().isoformat()
