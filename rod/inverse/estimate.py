"""What the inverse problem hands over: outcome, characteristic with bands on the visited range, and the fit itself.

Signs and axes: chord frame of `rod.measurement`; f_EI is the tangent reading dm/dK; SI units.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from rod.compliance_law import ComplianceLaw
from rod.inverse.evaluation import Evaluation, evaluate
from rod.inverse.fit_model import FitModel
from rod.law_prior import Posterior, averaged, priors
from rod.measured_law import Array, MeasuredLaw, Source, propagated

INVISIBLE = 0.5
"""Standard deviation of log f, or K0 times length, beyond which it counts as not visible: a factor of 1.6."""


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


@dataclass(frozen=True)
class Estimate:
    """What the inverse problem makes of a test; SI units, tangent reading.

    Attributes
    ----------
    outcome : InverseOutcome
    characteristic : ComplianceLaw or None
        The fitted law.
    law : MeasuredLaw or None
        The same on a grid over the visited range, with bands; None where there is no characteristic.
    law_forms : (n, p)
        Forms of log(tangent) on the law's grid that the priors allow, one standard deviation each.
    model, evaluation, unknowns, covariance
        The fit itself: unknowns (q,) with covariance (q, q); residuals and jacobian whitened by the noise as stated,
        whatever ``model.blur`` the bands were made with.
    invisible : tuple of (float or None, float)
        What the data leave open; see `invisible_combinations`.
    iterations : int
        Evaluations of the model, all fits together.
    """

    outcome: InverseOutcome
    characteristic: ComplianceLaw | None = None
    law: MeasuredLaw | None = None
    law_forms: Array = field(default_factory=lambda: np.empty(0))
    model: FitModel | None = None
    evaluation: Evaluation | None = None
    unknowns: Array = field(default_factory=lambda: np.empty(0))
    covariance: Array = field(default_factory=lambda: np.empty(0))
    invisible: tuple[tuple[float | None, float], ...] = ()
    iterations: int = 0

    @property
    def converged(self) -> bool:
        """True if there is a characteristic to rely on within its band."""
        return self.outcome is InverseOutcome.CONVERGED


def read_off(
    model: FitModel, found: Evaluation, posterior: Posterior, *, grid: int, outcome: InverseOutcome
) -> Estimate:
    """Estimate from a settled fit: curves on the visited range with bands by propagation."""
    p, u = model.basis.size, found.unknowns
    by_forces = _moved_by_forces(model, found, posterior.covariance)
    covariance = posterior.covariance + by_forces @ by_forces.T
    curve, K0 = model.law(u), model.pre_curvature(u)
    visited = [float(v) for fit in found.steps for v in (fit.simulated.kappa.min(), fit.simulated.kappa.max())]
    # the abscissa was laid along the fit before the last: beyond it, by a little at most, nothing is known of the law
    low, high = np.clip([min(visited), max(visited)], K0 + curve.bends[0], K0 + curve.bends[-1])
    kappa = np.linspace(low, high, grid)
    moment, f = curve.bound(np.array([K0]))(kappa)
    by_moment, by_log = np.zeros((kappa.size, u.size)), np.zeros((kappa.size, u.size))
    by_moment[:, :p] = curve.moment_by_parameters(kappa, K0)
    by_moment[:, p] = -f / model.length
    by_log[:, :p] = curve.log_tangent_by_parameters(kappa, K0)
    by_log[:, p] = curve.log_slope(moment) * f / model.length
    scale = _unknown_scale(model, found, by_log @ covariance @ by_log.T)
    law = propagated(
        kappa,
        K0,
        moment=moment,
        tangent=f,
        by_moment=np.column_stack([by_moment, scale * moment]),
        by_log=np.column_stack([by_log, np.full(kappa.size, scale)]),
        by_pre_curvature=np.eye(u.size + 1)[p] / model.length,
        covariance=np.pad(covariance, (0, 1)) + np.diag(np.eye(u.size + 1)[-1]),
    )
    splines = model.basis.at(moment)
    rest = tuple(name for name in found.blocks if _is_rest(model, name))
    loaded = _without(model, found, rest) if rest else replace(posterior, mean=u)
    blurred = model.blur != (1.0, 1.0)
    return Estimate(
        outcome=outcome,
        characteristic=curve,
        law=replace(
            law,
            gains=_gains(model, found, by_log @ posterior.covariance) | {("common_force", -1): by_log @ by_forces},
            # coefficients of log c = -log f by least squares on the grid, which covers the moments of the basis
            shortfall=by_log @ posterior.shrinkage @ np.linalg.pinv(splines),
            loaded_pre_curvature=float(loaded.mean[p]) / model.length,
            loaded_pre_curvature_std=float(np.sqrt(loaded.covariance[p, p])) / model.length,
        ),
        law_forms=splines @ posterior.law_forms,
        model=model,
        evaluation=evaluate(replace(model, blur=(1.0, 1.0)), u, starts=found.equilibria) if blurred else found,
        unknowns=u,
        covariance=covariance,
        invisible=invisible_combinations(model, law, covariance),
    )


def _unknown_scale(model: FitModel, found: Evaluation, log_covariance: Array) -> float:
    """Standard deviation of a common factor of f by which the covariance (n, n) of log f falls short of the forces.

    Only forces tell it, and no law knows it better. A prior of its form over an abscissa of moments holds it all the
    same: by nothing where forces are good to a per cent, too sharply where they contradict each other by many.
    """
    known = [(s.simulated.force / (s.data.step.force_std * model.blur[1])) ** 2 for s in found.steps if s.force]
    return float(np.sqrt(max(1.0 / sum(known) - float(log_covariance.mean()), 0.0)))


def _without(model: FitModel, found: Evaluation, blocks: tuple[str, ...]) -> Posterior:
    """The posterior with some blocks of the data left out."""
    keep = np.ones(found.value.size, dtype=bool)
    for name in blocks:
        keep[found.blocks[name]] = False
    return averaged(found.value[keep], found.jacobian[keep], found.unknowns, priors(model.basis))


def invisible_combinations(
    model: FitModel, law: MeasuredLaw, covariance: Array
) -> tuple[tuple[float | None, float], ...]:
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
    K0_std = float(np.sqrt(covariance[model.basis.size, model.basis.size]))
    if K0_std > INVISIBLE:
        open_ones.append((None, K0_std / model.length))
    return tuple(open_ones)


def _is_rest(model: FitModel, block: str) -> bool:
    kind, _, step = block.partition("/")
    return kind in ("shape", "chord") and any(d.at_rest and str(d.step.step) == step for d in model.data)


def _moved_by_forces(model: FitModel, found: Evaluation, response: Array) -> Array:
    """Moves (q, e) of the unknowns by errors that several forces have in common."""
    moved = np.zeros((response.shape[0], len(model.force_errors)))
    for fit in found.steps:
        step = fit.data.step
        if fit.force is not None:
            J = found.jacobian[found.blocks[f"force/{step.step}"]]
            newtons = [errors.get(step.step, 0.0) for errors in model.force_errors]
            moved -= np.outer(response @ J[0], newtons) / (step.force_std * model.blur[1])
    return moved


def _gains(model: FitModel, found: Evaluation, response: Array) -> dict[Source, Array]:
    """Response of log(tangent) to every source of error; `response` (n, q) is its derivative by -J^T dr."""
    gains: dict[Source, Array] = {}
    for name in model.nuisances:
        part, _, step = name.partition("/")
        # With the normal matrix A and a nuisance e of prior variance 1: A^-1 (A - 1) e - e = -A^-1 e.
        gains[part, int(step or -1)] = -response[:, [model.index(name)]]
    for name, rows in found.blocks.items():
        part, _, step = name.partition("/")
        if part in ("shape", "force"):
            gains["photo" if part == "shape" else part, int(step)] = -response @ found.jacobian[rows].T
    return gains
