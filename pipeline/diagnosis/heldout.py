"""Gain on held-out steps, computed: whole levels are left out, both models refitted, and asked for the rest."""

from __future__ import annotations

import numpy as np

from pipeline.diagnosis.fit import Fit, fit, sensitivities, whole_residual
from pipeline.diagnosis.gain import Fold, HeldOut, folds_by_level, held_out
from pipeline.diagnosis.maps import rms_errors
from pipeline.diagnosis.observation import Observation, observe
from pipeline.diagnosis.workbench import Workbench
from pipeline.result import GainPart
from pipeline.settings.diagnosis import DiagnosisSettings


def measured_gain(
    bench: Workbench, extended: Fit, settings: DiagnosisSettings
) -> tuple[GainPart | None, HeldOut | None]:
    """Share of the excess misfit that the extension removes on steps it has not seen, with its interval.

    None where there are fewer than two levels, a model cannot be refitted, or the base shows no excess held out.
    """
    observation = bench.observation
    groups = folds_by_level(
        bench.facts.displacement, bench.facts.branch, same=settings.same_level * max(bench.facts.travel, 1e-12)
    )
    if len(groups) < 2:
        return None, None
    used_photos = {photo.step for photo in observation.photos}
    folds, errors = [], []
    for group in groups:
        inside = observe(
            bench.test,
            settings,
            photo_noise=observation.photo_noise,
            without_photos=frozenset(i for i in range(len(bench.test.steps)) if i in group or i not in used_photos),
            without_forces=frozenset(
                i for i in range(len(bench.test.steps)) if i in group or not len(observation.forces[i])
            ),
        )
        before, after = (_refit(inside, model, settings) for model in (bench.base, extended))
        if before.run.prediction is None or after.run.prediction is None:
            continue
        folds.append(_fold(observation, group, before, after))
        errors.append([rms_errors(observation, model, group) for model in (before, after)])
    found = held_out(folds, draws=settings.gain_draws, rng=np.random.default_rng(settings.seed)) if folds else None
    if found is None:
        return None, None
    force = [_rms(np.concatenate([error[k][0] for error in errors])) for k in (0, 1)]
    shape = [_rms(np.concatenate([error[k][1] for error in errors])) for k in (0, 1)]
    part = GainPart(
        heldout_excess_removed=found.removed,
        ci95=found.interval,
        force_rmse_N=(force[0], force[1]),
        shape_rmse_m=(shape[0], shape[1]),
    )
    return part, found


def _refit(inside: Observation, model: Fit, settings: DiagnosisSettings) -> Fit:
    return fit(
        inside,
        model.extension,
        model.vector,
        iterations=settings.iterations,
        tolerance=settings.tolerance,
        near=model.run,
        cutoff=1e-4,  # what the remaining steps cannot tell stays where it was, and counts for neither model
    )


def _fold(observation: Observation, group: list[int], before: Fit, after: Fit) -> Fold:
    rows = np.isin(observation.rows.step, group)
    residuals = [
        whole_residual(observation, model.run.prediction, model.vector, model.extension.prior)
        for model in (before, after)
    ]
    jacobian = sensitivities(
        observation, after.extension, after.vector, after.extension.base_model(after.vector), after.run
    )
    outside = np.r_[rows, np.zeros(len(jacobian) - len(rows), dtype=bool)]
    base, extended = (np.asarray(value)[: len(rows)][rows] for value in residuals)
    return Fold(base, extended, jacobian[~outside], jacobian[outside])


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0
