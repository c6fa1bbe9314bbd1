"""Non-linear parametric bootstrap of the family of scores, for a score near its threshold.

Data are drawn at the fitted base model, the base model is refitted to them in full, and the largest statistic of each
refit is compared with what the linear theory draws. Where curvature of the model widens the distribution, the threshold
is raised by the ratio of the means; a ratio within two standard errors of one leaves it as it was.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.diagnosis.fit import fit
from pipeline.diagnosis.score import admissible, score
from pipeline.diagnosis.workbench import Workbench
from pipeline.settings.diagnosis import DiagnosisSettings


def confirmed_limit(bench: Workbench, settings: DiagnosisSettings) -> float:
    """Threshold after the bootstrap; the linear one where the largest score is not near it or no refit succeeds."""
    if abs(bench.largest - bench.limit) > settings.bootstrap_margin or not settings.bootstrap:
        return bench.limit
    rng = np.random.default_rng(settings.seed)
    rows = len(bench.observation.rows.kind)
    maxima = []
    for _ in range(settings.bootstrap):
        # the data of the base model's own prediction plus noise: the residual at the fit becomes pure noise
        drawn = replace(bench.observation, added=rng.standard_normal(rows) - bench.base.residual[:rows])
        found = fit(
            drawn,
            bench.base.extension,
            bench.base.vector,
            iterations=settings.iterations,
            tolerance=settings.tolerance,
            near=bench.base.run,
        )
        if found.run.prediction is not None and found.converged:
            z = score(found.residual, found.jacobian, bench.suspicion.columns, visible=settings.visible).z
            maxima.append(float(admissible(z, bench.suspicion.sign).max()))
    if len(maxima) < 2:
        return bench.limit
    linear = float(np.mean(bench.maxima))
    ratio = float(np.mean(maxima)) / linear
    spread = float(np.std(maxima, ddof=1)) / np.sqrt(len(maxima)) / linear
    return bench.limit * ratio if ratio > 1.0 + 2.0 * spread else bench.limit
