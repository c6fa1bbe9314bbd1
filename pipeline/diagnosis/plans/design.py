"""What an experiment could see, before it is made.

From a planned cable, protocol and precision to: how well f_EI and K0 will be known, what each cause must measure to be
seen (at the family-wise threshold, with the stated power), what survives of its trace, its nearest twin, what an unseen
one would do to f_EI, which causes stay invisible, and which protocol takes which twins apart. Nothing here needs data:
all follows from the sensitivities of the planned test.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.diagnosis.causes import SUSPECTS
from pipeline.diagnosis.fits.extended import curve
from pipeline.diagnosis.fits.workbench import Workbench, beside_errors, scored
from pipeline.diagnosis.plans.next_experiment import Protocol, protocols, still_open
from pipeline.diagnosis.plans.plan import Precision, planned_test
from pipeline.diagnosis.posterior.detectable import Detectable, detectable
from pipeline.diagnosis.posterior.error_grid import error_grid
from pipeline.diagnosis.statistics.twins import nearest
from pipeline.messages import DECIMAL, PER, Message, ended, entry, word
from pipeline.records import Array
from pipeline.result import Curve
from pipeline.result.visited import html_table
from pipeline.rounding import plain
from pipeline.settings.diagnosis import DiagnosisSettings
from pipeline.units import amount_unit
from rod.characteristic import MomentCurve
from rod.inverse.base import Base
from rod.inverse.extension import Extension
from rod.inverse.fit import fit
from rod.inverse.laws import following
from rod.inverse.observation import observe
from rod.inverse.prediction import Facts
from rod.inverse.simulation import run
from rod.laws import StickSlip


@dataclass(frozen=True)
class Plan:
    """A planned experiment.

    Attributes
    ----------
    length : m
    stiffness, stiffness_bent : N m^2
        f_EI at rest and far from it; equal for a linear cable.
    transition : 1/m
        Curvature change over which one goes over into the other.
    law : MomentCurve or None
        In the place of these three.
    pre_curvature : 1/m
    displacements : tuple of m
        Loading steps from the mounted position.
    mounted, unload : bool
        Whether the force-free cable is photographed, and the way back measured in the same steps.
    photos : bool
    px_per_mm : float
    section_px, correlation_px, systematic_px, axis_px : px
        Noise of the midline, see `rod.measurement.MeasuredShape`, and of a bearing axis.
    force_noise : share of the largest force
    samples, hold, cycle : int, s, s
        Force samples in a hold, its duration, time from hold to hold.
    cover_mm : mm
        Radius of the bearing covers.
    scale_std, length_std_mm : relative, mm
    """

    length: float = 0.181
    stiffness: float = 0.018
    stiffness_bent: float = 0.008
    transition: float = 4.5
    law: MomentCurve | None = None
    pre_curvature: float = 2.0
    displacements: tuple[float, ...] = (0.0046, 0.0092, 0.0138)
    mounted: bool = True
    unload: bool = False
    photos: bool = True
    px_per_mm: float = 11.0
    section_px: float = 0.05
    correlation_px: float = 10.0
    systematic_px: float = 0.02
    axis_px: float = 0.05
    force_noise: float = 0.003
    samples: int = 8
    hold: float = 20.0
    cycle: float = 60.0
    cover_mm: float = 6.0
    scale_std: float = 1e-3
    length_std_mm: float = 0.1


@dataclass(frozen=True)
class CausePlan:
    """What the planned test would show of one cause; ``separated_by``, not planned yet, tells it from its twin."""

    name: str
    unit: str
    plausible: float
    minimal_detectable: float | None
    surviving_fraction: float
    nearest_twin: str
    twin_cosine: float
    stiffness_bias_at_plausible_size: float
    visible: bool
    separated_by: Message | None

    def told(self, language: str = "en") -> tuple[str, ...]:
        """Name, amount from which it shows, plausible amount, whether that shows, how far f_EI is off then."""
        decimal, unit = DECIMAL[language], self.unit.replace(" per ", PER[language])
        never, seen = (word(name).said(language) for name in ("never", "yes" if self.visible else "no"))
        least, likely = (
            never if size is None else amount_unit(unit, size, decimal=decimal).plain(size, 2)
            for size in (self.minimal_detectable, self.plausible)
        )
        off = plain(100.0 * self.stiffness_bias_at_plausible_size, 2, decimal=decimal)
        return self.name, least, likely, seen, f"{off} %"

    @property
    def twin(self) -> Message:
        """How much of its trace survives, what it is most like, and what tells both apart."""
        parts = [Message("plan.survives", survives=self.surviving_fraction)]
        if self.nearest_twin:
            parts.append(Message("plan.like", twin=self.nearest_twin, cosine=self.twin_cosine))
        if self.separated_by:
            parts.append(Message("plan.helps", by=self.separated_by))
        return Message("plan.trace", parts=parts)


@dataclass(frozen=True)
class Design:
    """Outlook on a planned test.

    Attributes
    ----------
    extent : Curve
        f_EI with the band to be expected.
    stiffness_std : relative
        Root mean square of that band.
    pre_curvature_std : 1/m
    threshold : float
        Family-wise, in sigma.
    causes : list of CausePlan
        The most visible first.
    """

    extent: Curve
    stiffness_std: float
    pre_curvature_std: float
    threshold: float
    causes: list[CausePlan]

    @property
    def known(self) -> Message:
        """What the test will know of f_EI and K0, and from where on a cause shows."""
        low, high = self.extent.kappa_per_m[0], self.extent.kappa_per_m[-1]
        stds = {"stiffness": self.stiffness_std, "K0_per_m": self.pre_curvature_std, "threshold": self.threshold}
        return Message("plan.known", low_per_m=low, high_per_m=high, **stds)

    def _repr_html_(self) -> str:
        """Outlook as HTML for a notebook."""
        heads = ("shows from", "plausible", "visible", "f_EI off")
        rows = [
            (name, "; ".join(f"{head} {text}" for head, text in zip(heads, texts, strict=True)))
            for name, *texts in (cause.told() for cause in self.causes)
        ]
        return html_table("planned test", [("f_EI", str(self.known)), *rows])


def design(plan: Plan, settings: DiagnosisSettings | None = None) -> Design:
    """Outlook on a planned experiment.

    Raises
    ------
    ValueError
        If the planned cable has no equilibrium at a planned displacement, or nothing to measure is planned.
    """
    settings = settings or DiagnosisSettings()
    if not plan.displacements or min(plan.displacements) <= 0.0:
        raise ValueError(Message("misuse.no-step"))
    bench = planned_bench(plan, settings)
    table = _closeness(bench)
    more = [protocol for protocol in protocols(bench.facts) if not protocol.turned]
    others = [(protocol, _closeness(planned_bench(plan, settings, protocol.facts))) for protocol in more]
    grid = error_grid(bench.observation, bench.facts)
    found = detectable(grid, bench.observation, bench.base, bench.suspicion, power=settings.power)
    causes = [_cause_plan(bench, found, index, table, others, settings) for index in range(len(bench.suspicion.causes))]
    extent = curve(bench.base)
    relative = np.array(extent.tangent_std_Nm2) / np.array(extent.tangent_Nm2)
    bend = bench.base.extension.base.pre_curvature_index
    assert bend is not None
    return Design(
        extent=extent,
        stiffness_std=float(np.sqrt(np.mean(relative**2))),
        pre_curvature_std=float(np.sqrt(bench.base.covariance[bend, bend])),
        threshold=bench.limit,
        causes=sorted(causes, key=lambda c: (c.minimal_detectable or np.inf) / c.plausible),
    )


def _facts(plan: Plan) -> Facts:
    steps = [(0.0, "mounted")] if plan.mounted else []
    steps += [(d, "loading") for d in plan.displacements]
    if plan.unload:
        steps += [(d, "unloading") for d in plan.displacements[-2::-1]]
    times = np.linspace(0.0, plan.hold, plan.samples) if plan.samples > 1 else np.zeros(1)
    force = np.pi**2 * plan.stiffness_bent / plan.length**2
    bow = 0.64 * np.sqrt(plan.length * max(plan.displacements))
    return Facts(
        branch=tuple(branch for _, branch in steps),
        displacement=np.array([d for d, _ in steps]),
        displacement_std=np.zeros(len(steps)),
        photo_time=np.full(len(steps), times[-1]),
        hold_times=(times,) * len(steps),
        clock=plan.cycle * np.arange(len(steps), dtype=float),
        picture_centre=np.tile([0.5 * plan.length, 0.5 * bow], (len(steps), 1)),
        half_diagonal=0.65 * plan.length,
        moving="left",
        timed=plan.samples > 1,
        length=plan.length,
        force_scale=force,
        moment_scale=force * bow,
        curvature_scale=np.pi**2 * bow / plan.length**2,
        force_share=np.array([float(branch != "mounted") for _, branch in steps]),
        chord_by_log=np.full(len(steps), np.nan),
    )


def planned_bench(plan: Plan, settings: DiagnosisSettings, facts: Facts | None = None) -> Workbench:
    """The planned test, or one of other ``facts``, made without noise, its base model fitted and all causes scored."""
    facts = facts or _facts(plan)
    law = plan.law or StickSlip(plan.stiffness, plan.stiffness_bent, plan.transition)
    bends = np.linspace(0.0, 1.3 * facts.curvature_scale, 400)
    tangent = law.tangent(bends + plan.pre_curvature, plan.pre_curvature)
    form, coefficients = following(tangent, bends, unit=plan.stiffness_bent)
    base = Base(
        law=form,
        length=plan.length,
        scale_std=plan.scale_std,
        length_std=1e-3 * plan.length_std_mm / plan.length,
        first=plan.pre_curvature,
    )
    vector = base.neutral()
    vector[: form.size] = coefficients
    made = run(base.model(vector), facts)
    if made.prediction is None:
        assert made.failed is not None
        raise ValueError(Message("misuse.unmakeable", said=ended(made.failed)))
    pixel = 1e-3 / plan.px_per_mm
    precision = Precision(
        force_std=plan.force_noise * float(np.max(np.abs(made.prediction.force))),
        chord_std=np.sqrt(2.0) * plan.axis_px * pixel,
        section_std=plan.section_px * pixel,
        correlation_length=plan.correlation_px * pixel,
        systematic_std=plan.systematic_px * pixel,
        systematic_length=0.2 * plan.length,
        section_pitch=3.0 * pixel,
        cover=1e-3 * plan.cover_mm,
        scale_std=plan.scale_std,
        length_std=1e-3 * plan.length_std_mm,
    )
    test = planned_test(made, facts, precision, photos=plan.photos)
    observation = observe(test)
    observation = replace(observation, force_std=np.full(len(facts.branch), precision.force_std), force_freedom=0)
    fitted = fit(observation, Extension(base, facts), vector, near=made)
    return scored(test, observation, beside_errors(observation, fitted), SUSPECTS, settings)


def _closeness(bench: Workbench) -> Array:
    """Cosines (c, c) of the causes in their usual forms."""
    return bench.suspicion.closeness(bench.suspicion.usual)


def _cause_plan(
    bench: Workbench,
    found: Detectable,
    index: int,
    table: Array,
    others: list[tuple[Protocol, Array]],
    settings: DiagnosisSettings,
) -> CausePlan:
    suspicion, cause = bench.shown(index), bench.suspicion.causes[index]
    own = np.intersect1d(suspicion.of(index), suspicion.usual)
    plausible = cause.plausible(bench.facts)
    if own.size == 0:
        return CausePlan(
            cause.name, cause.unit, plausible, None, 0.0, "", 0.0, 0.0, False, entry("settled", cause.name)
        )
    norm = suspicion.scores.norm[own]
    best = int(own[np.argmax(norm)])
    smallest = found.smallest(index)
    twin, closeness = nearest(table)
    # what the law takes over on loading alone shows on the way back
    separated = Message("next.unload") if bench.in_law.of(index).size else None
    if closeness[index] > settings.twin_cosine:
        freed = [(other[index, twin[index]], protocol.what) for protocol, other in others]
        better = [pair for pair in freed if pair[0] < settings.twin_cosine]
        pair = (cause, suspicion.causes[twin[index]])
        settled = [entry("settled", each.name) for each in pair if still_open(each, bench)]
        separated = Message(min(better)[1]) if better else next(iter(settled), None)
    return CausePlan(
        name=cause.name,
        unit=cause.unit,
        plausible=plausible,
        minimal_detectable=smallest if np.isfinite(smallest) else None,
        surviving_fraction=float(suspicion.scores.surviving[best]),
        nearest_twin=suspicion.causes[twin[index]].name if twin[index] >= 0 else "",
        twin_cosine=float(closeness[index]),
        stiffness_bias_at_plausible_size=bench.stiffness_bias(index),
        visible=smallest <= plausible,
        separated_by=separated,
    )
