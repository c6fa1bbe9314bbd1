"""Non-linear parametric bootstrap of the family of scores, for a score near its threshold.

Data are drawn at the fitted base model, the base model is refitted to them in full, and the largest statistic of each
refit is compared with what the linear theory says of the same draw. Where curvature of the model widens the
distribution, the threshold is raised by the ratio of the means; a ratio within two standard errors of one leaves it as
it was. Only the same draw tells curvature: prior knowledge that the fitted model contradicts (a length that is off)
stays contradicted in every draw and makes the largest statistic larger in both.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.diagnosis.fits.fit import fit_from
from pipeline.diagnosis.fits.workbench import Workbench
from pipeline.diagnosis.statistics.score import admissible, score
from pipeline.settings.diagnosis import DiagnosisSettings


def confirmed_limit(bench: Workbench, settings: DiagnosisSettings) -> float:
    """Threshold after the bootstrap; the linear one where the largest score is not near it."""
    near = abs(bench.largest - bench.limit) <= settings.bootstrap_margin
    return bench.limit * widening(bench, settings) if near else bench.limit


def widening(bench: Workbench, settings: DiagnosisSettings) -> float:
    """How much wider the scores spread than the linear theory says; 1 where it is right or no refit succeeds."""
    if not settings.bootstrap:
        return 1.0
    rng = np.random.default_rng(settings.seed)
    rows = bench.observation.rows.count
    scores, sign = bench.suspicion.scores, bench.suspicion.sign
    bent, straight = [], []
    for _ in range(settings.bootstrap):
        # the data of the base model's own prediction plus noise: the residual at the fit becomes pure noise
        noise = rng.standard_normal(rows)
        drawn = replace(bench.observation, added=noise - bench.base.residual[:rows])
        found = fit_from(drawn, bench.base.extension, bench.base.vector, bench.base, settings)
        if found.run.prediction is not None and found.converged:
            z = score(found.residual, found.jacobian, bench.suspicion.columns, visible=settings.visible).z
            bent.append(float(admissible(z, sign).max()))
            linear = scores.unit.T @ np.r_[noise, bench.base.residual[rows:]]
            straight.append(float(admissible(linear, sign).max()))
    if len(bent) < 2:
        return 1.0
    usual = float(np.mean(straight))
    wider = np.subtract(bent, straight) / usual
    spread = float(np.std(wider, ddof=1)) / np.sqrt(len(wider))
    return 1.0 + float(np.mean(wider)) if np.mean(wider) > 2.0 * spread else 1.0
