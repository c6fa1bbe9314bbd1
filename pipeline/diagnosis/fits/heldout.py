"""Gain on held-out steps, computed: whole levels are left out, both models refitted, and asked for the rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.fits.maps import rms_errors
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.statistics.gain import Fold, folds_by_level, held_out
from pipeline.result import GainPart
from pipeline.settings.diagnosis import DiagnosisSettings
from rod.inverse.fit import Fit, fit
from rod.inverse.observation import Observation

SAME_LEVEL = 0.01
"""Share of the travel; loading and unloading steps closer than this are left out together."""

DRAWS = 2000
"""Behind the interval of the gain; its ends are then known to 2 %."""

STEPS_WITHOUT = 4
"""Gauss-Newton steps of a refit without one level, from the fit with it; two settle it usually."""


def measured_gain(bench: Workbench, extended: Fit, settings: DiagnosisSettings) -> GainPart | None:
    """Share of the excess misfit that the extension removes on steps it has not seen, with its interval.

    None where there are fewer than two levels, a model cannot be refitted, or the base shows no excess held out.
    """
    observation = bench.observation
    groups = folds_by_level(
        bench.facts.displacement, bench.facts.branch, same=SAME_LEVEL * max(bench.facts.travel, 1e-12)
    )
    if len(groups) < 2:
        return None
    folds, errors = [], []
    for group in groups:
        left_out = np.isin(observation.rows.step, group)
        before, after = (_refit(observation, model, left_out) for model in (bench.base, extended))
        folds.append(_fold(before, after, left_out))
        errors.append([rms_errors(observation, model, group) for model in (before, after)])
    found = held_out(folds, draws=DRAWS, rng=np.random.default_rng(settings.seed))
    if found is None or not np.isfinite(found[0]):
        return None
    force = [_rms(np.concatenate([error[k][0] for error in errors])) for k in (0, 1)]
    shape = [_rms(np.concatenate([error[k][1] for error in errors])) for k in (0, 1)]
    return GainPart(
        heldout_excess_removed=found[0],
        ci95=found[1],
        force_rmse_N=(force[0], force[1]),
        shape_rmse_m=(shape[0], shape[1]),
    )


def _refit(observation: Observation, model: Fit, left_out: NDArray[np.bool_]) -> Fit:
    """The model fitted to the rows that stay, from where it was with all."""
    priors = np.ones(len(model.residual) - len(left_out), dtype=bool)
    return fit(
        observation,
        model.extension,
        model,
        iterations=STEPS_WITHOUT,
        cutoff=1e-4,  # what the remaining steps cannot tell stays where it was, and counts for neither model
        kept=np.r_[~left_out, priors],
    )


def _fold(before: Fit, after: Fit, left_out: NDArray[np.bool_]) -> Fold:
    outside = np.r_[left_out, np.zeros(len(after.jacobian) - len(left_out), dtype=bool)]
    base, extended = (model.residual[: len(left_out)][left_out] for model in (before, after))
    return Fold(base, extended, after.jacobian[~outside], after.jacobian[outside])


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
