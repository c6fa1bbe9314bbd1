"""Way one, the inverse problem: from photos and forces to the characteristic by simulating the experiment (Sec. 4).

The discrete rod is fitted to the midlines and to the forces of all steps at once, each residual divided by its standard
deviation (Eq. (7) with statistical weights in place of w; the paper's own objective is in `rod.paper_fit`). The
chords of the photos drive the simulation, and where there is no photo the displacement log does. Without a force-free
photo it is the log that tells where the axes stood at rest, unless that contradicts the photos. What is fitted:
`rod.inverse.base`; how: `rod.inverse.base_fit`; the law as the mean over what is not known of its form:
`rod.inverse.mean_law`. A force-free photo is held against the arc of curvature K0; its force says something about the
load cell, nothing about the cable, and is left out. Where the simulation cannot follow the data within their noise, the
misfit counts as noise. Bands are by propagation, on the visited range only.

Signs and axes: chord frame of `rod.measurement`; P positive in compression, K positive toward the bow; f_EI is the
tangent reading dm/dK; SI units.

Source: *Identification of Nonlinear Elastic Bending Behavior for Cable Simulation*, Sec. 4, Eqs. (6), (7).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property

import numpy as np

from rod.array import Array
from rod.compliance_law import ComplianceLaw
from rod.equilibrium import Outcome
from rod.inverse.base import ELEMENTS, measured_curvatures
from rod.inverse.base_fit import BaseFit, base_fit, law_of
from rod.inverse.fit import Fit
from rod.inverse.gains import gains, loaded_pre_curvature
from rod.inverse.laws import FreeLaw
from rod.inverse.mean_law import linearised, mean_law, moved_by_forces, rows_posterior, weights
from rod.inverse.observation import KINDS, ZERO_STD, Observation
from rod.inverse.prediction import facts_of
from rod.measured_law import POINTS, MeasuredLaw, propagated
from rod.measurement import MeasuredStep, MeasuredTest
from rod.midline import LEAST_SECTIONS

OPPOSITE = -0.5
"""Correlation of curvature and moment below which forces contradict photos; noise brings it to zero, not below."""

INVISIBLE = 0.5
"""Standard deviation of log f, or K0 times length, beyond which it counts as not visible: a factor of 1.6."""


FUNCTIONS = 32
"""Of the shapes that a photo is compared by: an early knee is met by a twentieth of the cable at either end."""


class InverseOutcome(Enum):
    """How the inverse problem ended; the value is advice to the reader."""

    CONVERGED = "the simulation was fitted to all photos and forces"
    STALLED = (
        "the fit did not settle; this usually means that a photo or a force contradicts the others: look at the "
        "residuals of each step"
    )
    LIMIT_POINT = (
        "on the way the bending moment stopped growing with curvature, where no stable shape exists; this usually "
        "means wrong forces or a wrong scale: check the units of the force and px/mm"
    )
    NO_EQUILIBRIUM = (
        "no simulated cable reaches the measured chords; this usually means that length_mm or the scale is wrong, or "
        "that the photos belong to other steps"
    )
    NOT_VISIBLE = (
        "the data do not fix every parameter (the combinations that stay open are named beside); bend further, add "
        "steps, or add a photo of the force-free cable"
    )
    OPPOSITE_FORCES = (
        "the curvature falls where the moment P y grows, which no cable does; this usually means that the force log "
        "counts compression as negative (set rig.force_sign) or that photos and forces are mixed up (check the column "
        "image)"
    )
    NO_DATA = (
        "no loaded step has both a photo and a force, so pre-curvature and stiffness cannot be told apart; take photos "
        "of the steps, and check why those there are were rejected"
    )


@dataclass(frozen=True, eq=False)
class Estimate:
    """What the inverse problem makes of a test; SI units, tangent reading.

    Attributes
    ----------
    outcome : InverseOutcome
    test : MeasuredTest or None
        The steps that were fitted, as they were driven.
    observation : Observation or None
        Their data with weights.
    fitted : Fit or None
        The model at the mean over the priors of its law; None without one.
    covariance : (p, p)
        Of its vector.
    law : MeasuredLaw or None
        On a grid over the visited range, with bands.
    law_forms : (n, k)
        Forms of log(tangent) on the law's grid that the priors allow, one standard deviation each.
    invisible : tuple of (float or None, float)
        What the data leave open; see `invisible_combinations`.
    """

    outcome: InverseOutcome
    test: MeasuredTest | None = None
    observation: Observation | None = None
    fitted: Fit | None = None
    covariance: Array = field(default_factory=lambda: np.empty(0))
    law: MeasuredLaw | None = None
    law_forms: Array = field(default_factory=lambda: np.empty(0))
    invisible: tuple[tuple[float | None, float], ...] = ()

    @property
    def converged(self) -> bool:
        """True if there is a characteristic to rely on within its band."""
        return self.outcome is InverseOutcome.CONVERGED

    @property
    def characteristic(self) -> FreeLaw | None:
        """The fitted law."""
        return None if self.fitted is None else law_of(self.fitted)

    @cached_property
    def nuisances(self) -> dict[str, tuple[float, float, float]]:
        """What is fitted beside law and K0: value, standard deviation, and standard deviation before the test.

        ``length`` (m) and ``scale`` (relative) are what is added to the stated ones; those of `rod.inverse.base.AXES`
        are errors of axes and camera.
        """
        if self.fitted is None:
            return {}
        base, vector = self.fitted.extension.base, self.fitted.vector
        # of law and K0 nothing is known: a precision of theirs lets that of all others be inverted
        open_ones = np.diag((np.arange(vector.size) <= base.law.size).astype(float))
        known = np.linalg.inv(base.prior[: base.known].T @ base.prior[: base.known] + open_ones)
        found = {}
        for name in (*base.axes, "scale", "length"):
            at = base.names.index(name)
            unit = -base.length if name == "length" else 1.0
            std, before = (abs(unit) * float(np.sqrt(table[at, at])) for table in (self.covariance, known))
            found[name] = unit * float(vector[at]), std, before
        return found

    def chi2(self, kind: str, step: int | None = None) -> tuple[float, int]:
        """Sum of squares and number of the residuals of a kind (`KINDS`), of one step (its index) or of all."""
        if self.fitted is None or self.observation is None:
            return 0.0, 0
        if kind == "prior":
            value = self.fitted.residual[self.observation.rows.count :]
        else:
            rows = self.observation.rows
            own = (rows.kind == KINDS.index(kind)) & ((rows.step == step) if step is not None else True)
            value = self.fitted.residual[: rows.count][own]
        return float(value @ value), value.size


def estimate(
    test: MeasuredTest,
    *,
    begin: tuple[float, float] | None = None,
    elements: int = ELEMENTS,
) -> Estimate:
    """Characteristic, pre-curvature and their uncertainty by fitting the simulated experiment.

    Parameters
    ----------
    test : MeasuredTest
    begin : (N m^2, 1/m) or None
        Constant EI and K0 to start from; None takes both from the curvatures that photos show over the moment P y.
    elements : int
        Of the simulated cable.

    Returns
    -------
    Estimate
        Look at ``outcome``.

    Raises
    ------
    ValueError
        If two steps have one number.
    """
    if len({step.step for step in test.steps}) < len(test.steps):
        raise ValueError("every step of a test needs a number of its own")
    test, at_rest = _driven(test)
    rest = frozenset(i for i, step in enumerate(test.steps) if step.branch == "mounted")
    if not any(step.shape is not None and step.force != 0.0 for i, step in enumerate(test.steps) if i not in rest):
        return Estimate(InverseOutcome.NO_DATA)
    curvatures, moments = measured_curvatures(test)
    if np.corrcoef(moments, curvatures)[0, 1] < OPPOSITE:
        return Estimate(InverseOutcome.OPPOSITE_FORCES)

    def fitted_to(data: MeasuredTest, unloaded: frozenset[int]) -> BaseFit:
        return base_fit(
            data,
            facts_of(data),
            begin=begin,
            elements=elements,
            functions=FUNCTIONS,
            calibrated=False,
            without_forces=unloaded,
        )

    if at_rest is not None and not rest:
        longer, unloaded = replace(test, steps=(at_rest, *test.steps)), frozenset([0])
        told = fitted_to(longer, unloaded)
        if told.fitted.run.prediction is not None and _without(told, 0) < CONTRADICTS:
            return _read_off(longer, told.observation, mean_law(*told, ("bend", "moment")), unloaded)
    found = fitted_to(test, rest)
    if found.fitted.run.prediction is None:
        limit = found.fitted.run.failed is Outcome.LIMIT_POINT
        return Estimate(InverseOutcome.LIMIT_POINT if limit else InverseOutcome.NO_EQUILIBRIUM)
    return _read_off(test, found.observation, mean_law(*found, ("bend",) if rest else ("bend", "moment")), rest)


CONTRADICTS = 16.0
"""Chi-square (4 sigma) by which the zero of the log contradicts all other data."""


def _without(found: BaseFit, step: int) -> float:
    """Chi-square saved, to first order, by leaving out the chord of a step, by the step's index."""
    rows, fitted = found.observation.rows, found.fitted
    row = int(np.flatnonzero((rows.kind == KINDS.index("chord")) & (rows.step == step))[0])
    known = float(fitted.jacobian[row] @ fitted.covariance @ fitted.jacobian[row])
    return float(fitted.residual[row] ** 2 / max(1.0 - known, 1e-9))  # a row that alone tells K0 contradicts nothing


def _shown(step: MeasuredStep) -> bool:
    return step.shape is not None and step.shape.section_s.size >= LEAST_SECTIONS


def _driven(test: MeasuredTest) -> tuple[MeasuredTest, MeasuredStep | None]:
    """The test as it drives the simulation, and the cable at rest where the log alone tells of it.

    Chords of photos drive, so that a wrong zero of the log moves nothing. The chord of a step without a photo is that
    of the log, whose zero the photos of the others tell. A force is that of its photo, whatever it does in the hold.
    """
    # of the cable tells a photo, or the force at a displacement
    steps = [s for s in test.steps if _shown(s) or (s.branch != "mounted" and s.displacement is not None)]
    loaded = [step for step in steps if _shown(step) and step.displacement is not None]
    zeros = np.array([_chord(step) + (step.displacement or 0.0) for step in loaded])
    scatter = float(zeros.std(ddof=1)) if zeros.size > 1 else 0.0
    std = np.hypot(scatter, max((step.chord_std or 0.0 for step in loaded), default=0.0))

    def driven(step: MeasuredStep) -> MeasuredStep:
        free = replace(step, displacement=None, displacement_std=None, hold_forces=None, hold_times=None)
        if _shown(step):
            return replace(free, chord=_chord(step), displacement=0.0 if step.branch == "mounted" else None)
        if step.displacement is None or not zeros.size:
            return replace(step, shape=None, chord=None, hold_forces=None, hold_times=None)
        own = np.hypot(std, step.displacement_std or 0.0)
        return replace(free, shape=None, chord=float(zeros.mean()) - step.displacement, chord_std=float(own))

    at_rest = None
    # what unloads only may have taken a set, and comes to rest elsewhere
    if zeros.size and all(step.chord is not None for step in loaded) and any(s.branch == "loading" for s in steps):
        number = min(step.step for step in steps) - 1
        chord, own = float(zeros.mean()), float(np.hypot(std, ZERO_STD))
        at_rest = MeasuredStep(number, "mounted", 0.0, force=0.0, force_std=1.0, chord=chord, chord_std=own)
    return replace(test, steps=tuple(map(driven, steps))), at_rest


def _chord(step: MeasuredStep) -> float:
    """Distance of the axes by a photo, m; of its ends, where the photo does not tell."""
    assert step.shape is not None
    x, y = step.shape.x, step.shape.y
    return float(np.hypot(x[-1] - x[0], y[-1] - y[0])) if step.chord is None else step.chord


def _read_off(test: MeasuredTest, observation: Observation, fitted: Fit, rest: frozenset[int]) -> Estimate:
    """Curves on the visited range with bands by propagation."""
    base, size = fitted.extension.base, fitted.extension.size
    law, K0 = law_of(fitted), fitted.pre_curvature
    posterior = rows_posterior(fitted, *linearised(observation, fitted))
    errors = [np.array([each.get(step.step, 0.0) for step in test.steps]) for each in test.common_force_errors]
    by_forces = moved_by_forces(observation, fitted, posterior.covariance, errors)
    covariance = posterior.covariance + by_forces @ by_forces.T
    kappa = K0 + np.linspace(min(float(fitted.excess.min()), 0.0), float(fitted.excess.max()), POINTS)
    by_log, by_moment = by_parameters(fitted, kappa)
    moment, scale = law.moment(kappa, K0), _unknown_scale(observation, fitted, by_log @ covariance @ by_log.T)
    measured = propagated(
        kappa,
        K0,
        moment=moment,
        tangent=law.tangent(kappa, K0),
        by_moment=np.column_stack([by_moment, scale * moment]),
        by_log=np.column_stack([by_log, np.full(kappa.size, scale)]),
        by_pre_curvature=np.eye(size + 1)[base.law.size],
        covariance=np.pad(covariance, (0, 1)) + np.diag(np.eye(size + 1)[-1]),
    )
    over_moments = isinstance(law, ComplianceLaw)
    splines = law.basis.at(moment if over_moments else kappa - K0)
    loaded, loaded_std = loaded_pre_curvature(test, observation, fitted, rest, functions=FUNCTIONS)
    measured = replace(
        measured,
        gains=gains(test, observation, fitted, by_log @ posterior.covariance)
        | {("common_force", -1): by_log @ by_forces},
        # coefficients of log f, or of log c = -log f, by least squares on the grid, which covers the basis
        shortfall=(by_log if over_moments else -by_log) @ posterior.shrinkage @ np.linalg.pinv(splines),
        loaded_pre_curvature=loaded,
        loaded_pre_curvature_std=loaded_std,
    )
    invisible = invisible_combinations(measured, test.length)
    outcome = InverseOutcome.CONVERGED if fitted.converged else InverseOutcome.STALLED
    if fitted.converged and invisible:
        outcome = InverseOutcome.NOT_VISIBLE
    forms = splines @ posterior.law_forms
    return Estimate(outcome, test, observation, fitted, covariance, measured, forms, invisible)


def by_parameters(fitted: Fit, K: Array) -> tuple[Array, Array]:
    """Derivatives (n, p) of log f_EI and of the moment (N m) at curvatures (n,) 1/m by the vector of a fit."""
    base, law = fitted.extension.base, law_of(fitted)
    K0, own, bend = fitted.pre_curvature, law.parameters, base.pre_curvature_index
    by_log, by_moment = np.zeros((2, len(K), fitted.extension.size))
    by_log[:, :own] = law.log_tangent_by_parameters(K, K0)
    by_moment[:, :own] = law.moment_by_parameters(K, K0)
    if bend is not None:
        by_log[:, bend] = law.log_tangent_by_pre_curvature(K, K0)
        by_moment[:, bend] = law.moment_by_pre_curvature(K, K0)
    return by_log, by_moment


def _unknown_scale(observation: Observation, fitted: Fit, log_covariance: Array) -> float:
    """Standard deviation of a common factor of f by which the covariance (n, n) of log f falls short of the forces.

    Only forces tell it, and no law knows it better. A prior of its form over an abscissa of bends holds it all the
    same: by nothing where forces are good to a per cent, too sharply where they contradict each other by many.
    """
    assert fitted.run.prediction is not None
    weight = float(weights(observation, fitted)[observation.rows.force].min(initial=1.0))
    holds = zip(observation.forces, fitted.run.prediction.force, observation.force_std, strict=True)
    known = sum(len(data) * (weight * force / std) ** 2 for data, force, std in holds)
    return float(np.sqrt(max(1.0 / known - float(log_covariance.mean()), 0.0)))


def invisible_combinations(law: MeasuredLaw, length: float) -> tuple[tuple[float | None, float], ...]:
    """Parts of the law and K0 whose standard deviation exceeds `INVISIBLE`.

    Returns
    -------
    tuple of (float or None, float)
        Curvature (1/m) with the std of log f_EI there; for K0 None with its std (1/m).
    """
    open_ones: list[tuple[float | None, float]] = []
    std = np.sqrt(np.diag(law.log_covariance))
    for where in (slice(None, law.kappa.size // 3), slice(law.kappa.size // 3, None)):
        worst = int(np.argmax(std[where])) + (where.start or 0)
        if std[worst] > INVISIBLE:
            open_ones.append((float(law.kappa[worst]), float(std[worst])))
    if law.pre_curvature_std * length > INVISIBLE:
        open_ones.append((None, law.pre_curvature_std))
    return tuple(open_ones)
