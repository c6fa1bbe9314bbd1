"""From the poorest model to the paper's: a straight cable of constant stiffness, and what must be added to it.

The same scores, refits and held-out gains as in `diagnose`, started from K0 = 0 and one stiffness, on the data in the
order in which the paper takes them up. Its Eq. (6) has the forces alone: from them follows that the stiffness depends
on curvature. Its Eq. (7) adds the photos: from them follows that the cable is bent at rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from pipeline.diagnosis.causes.law import LAW
from pipeline.diagnosis.explanations.forms import SHAPE_GAIN
from pipeline.diagnosis.explanations.refit import cost
from pipeline.diagnosis.fits.heldout import measured_gain
from pipeline.diagnosis.fits.search import suspect
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.plans.design import Plan, planned_bench
from pipeline.faults import faults_of_input
from pipeline.result import GainPart
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.bending_test import TABLE_1, TABLE_1_KNOTS, TABLE_1_ORDINATES
from rod.characteristic import Characteristic
from rod.inverse.base import start
from rod.inverse.extension import Extension
from rod.inverse.fit import ITERATIONS, Fit, fit
from rod.inverse.laws import FewPoints
from rod.inverse.observation import Observation, observe
from rod.inverse.prediction import Facts, facts_of
from rod.measurement import MeasuredTest


@dataclass(frozen=True)
class Discovery:
    """One step from a poorer model to a richer one.

    Attributes
    ----------
    name : str
        ``nonlinear_stiffness`` or ``pre_curvature``.
    data : str
        ``forces`` or ``forces and photos``: what it was found in.
    chi2 : (before, after)
    added : int
        Parameters the step adds.
    rivals : dict of name -> chi-square
        What the other extension on offer reached on the same data.
    gain : GainPart or None
        On held-out steps of the data it was found in.
    """

    name: str
    data: str
    chi2: tuple[float, float]
    added: int
    rivals: dict[str, float]
    gain: GainPart | None


def papers_test(settings: DiagnosisSettings | None = None) -> MeasuredTest:
    """The paper's virtual experiment (Table 1, tangent reading) as it would be measured, without noise."""
    plan = Plan(
        length=TABLE_1["length"],
        stiffness_bent=TABLE_1_ORDINATES[-1],
        law=Characteristic.from_ordinates(TABLE_1_KNOTS, TABLE_1_ORDINATES),
        pre_curvature=TABLE_1["pre_curvature"],
        displacements=tuple(k * TABLE_1["step"] for k in (1, 2, 3)),
        mounted=False,
    )
    return planned_bench(plan, settings or DiagnosisSettings()).test


def rediscover(test: MeasuredTest, settings: DiagnosisSettings | None = None) -> list[Discovery]:
    """Extend the straight cable of constant stiffness until forces and photos are explained.

    In the order found; ends when neither extension is asked for.
    """
    settings = settings or DiagnosisSettings()
    faults = faults_of_input(test)
    facts = facts_of(faults.test)
    pictures = frozenset(range(len(test.steps)))
    forces = observe(faults.test, without_photos=pictures, without_forces=faults.forces)
    everything = observe(faults.test, without_photos=faults.photos, without_forces=faults.forces)
    bent, curved = False, False
    found: list[Discovery] = []
    for data, observation in (("forces", forces), ("forces and photos", everything)):
        while not (bent and curved):
            before = _fitted(faults.test, observation, facts, curved=curved, bent=bent)
            offers = {}
            if not curved:
                offers[LAW] = _fitted(faults.test, observation, facts, curved=True, bent=bent)
            if not bent:
                offers["pre_curvature"] = _fitted(faults.test, observation, facts, curved=curved, bent=True)
            best = min(offers, key=lambda name: cost(offers[name]))
            if cost(before) - cost(offers[best]) < SHAPE_GAIN:
                break
            curved, bent = curved or best == LAW, bent or best == "pre_curvature"
            gain = _gain(faults.test, observation, facts, settings, before, offers[best])
            found.append(
                Discovery(
                    name=best,
                    data=data,
                    chi2=(before.chi2, offers[best].chi2),
                    added=offers[best].extension.size - before.extension.size,
                    rivals={name: offer.chi2 for name, offer in offers.items() if name != best},
                    gain=gain,
                )
            )
            if data == "forces":
                break  # Eq. (6) has as many unknowns as forces: a second extension on them alone would prove nothing
    return found


def _fitted(test: MeasuredTest, observation: Observation, facts: Facts, *, curved: bool, bent: bool) -> Fit:
    """The best fit of one of the four models, from three stiffnesses and, if bent, three pre-curvatures."""
    base = start(test, facts, points=3 if curved else 1, straight=not bent)
    if not bent and isinstance(base.law, FewPoints):  # the control points then count from zero curvature
        knots = base.law.knots + (base.law.knots > 0.0) * base.first
        base = replace(base, law=replace(base.law, knots=knots))
    starts = (1.0, 0.0), (0.5, 0.0), (2.0, 0.1 * facts.curvature_scale)
    vectors = (base.neutral(stiffness=stiffness, bend=bend) for stiffness, bend in starts)
    fits = (fit(observation, Extension(base, facts), vector, iterations=2 * ITERATIONS) for vector in vectors)
    return min(fits, key=cost)


def _gain(
    test: MeasuredTest, observation: Observation, facts: Facts, settings: DiagnosisSettings, before: Fit, after: Fit
) -> GainPart | None:
    """Held-out gain of a step."""
    if before.run.prediction is None:
        return None
    suspicion = suspect(observation, before, ())
    bench = Workbench(test, facts, observation, before, suspicion, suspicion, 0.0)
    return measured_gain(bench, after, settings)
