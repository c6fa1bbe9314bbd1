"""Errors that all photos have alike at the same place of the cable: they join rows that were whitened photo by photo.

Print on the sheath, or the ground below the end that stands still, moves the midline by the same on every photo. Taken
for noise of each photo by itself, eight photos would make of a hundredth of a pixel a cable that is bent at rest in
waves, three standard deviations from zero.

With the rows r of all photos, each whitened by its own noise, the common errors ``e`` (covariance K over the sections
of all photos) add ``A e``, A the whitening: the covariance is ``1 + A K A' = 1 + U diag(v) U'``. Its inverse root,
``1 - U diag(1 - 1 / sqrt(1 + v)) U'``, is the symmetric one, so a row stays that of its photo as far as can be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.observations.noise import Sections
from rod.measurement import slow_covariance

Array = NDArray[np.float64]

LEAST = 1e-3
"""Variance, in units of that of each photo's noise, below which a common error is none."""


@dataclass(frozen=True, eq=False)
class CommonWaves:
    """Directions ``U`` (n, m) of the rows of all photos in which they err alike, and their added variances (m,)."""

    directions: Array
    variances: Array

    def whitened(self, rows: Array) -> Array:
        """Rows (n, ...) of unit variance from rows that were whitened photo by photo."""
        return self._scaled(rows, 1.0 / np.sqrt(1.0 + self.variances))

    def undone(self, rows: Array) -> Array:
        """Rows (n, ...) whitened photo by photo from rows of unit variance."""
        return self._scaled(rows, np.sqrt(1.0 + self.variances))

    def _scaled(self, rows: Array, factors: Array) -> Array:
        along = self.directions.T @ rows
        return np.asarray(rows + self.directions @ ((factors - 1.0) * along.T).T)


def common_waves(sections: Sequence[Sections], whiten: Sequence[Array]) -> CommonWaves | None:
    """What the photos of a test err alike; None where nothing is told of it.

    Parameters
    ----------
    sections : sequence of Sections
        Of every photo.
    whiten : sequence of (1 + q, 1 + k)
        Acts on (chord residual, normal residuals of the sections) of each.
    """
    std = float(np.sqrt(np.mean([own.common[0] ** 2 for own in sections]))) if sections else 0.0
    if len(sections) < 2 or not std > 0.0:
        return None
    length = float(np.median([own.common[1] for own in sections]))
    covariance = slow_covariance(np.concatenate([own.s for own in sections]), ((std, length),))
    ends = np.cumsum([0, *(len(own.s) for own in sections)])
    rows = np.vstack([root[:, 1:] @ covariance[a:b] for root, a, b in zip(whiten, ends, ends[1:], strict=False)])
    joint = np.hstack([rows[:, a:b] @ root[:, 1:].T for root, a, b in zip(whiten, ends, ends[1:], strict=False)])
    variances, directions = np.linalg.eigh(0.5 * (joint + joint.T))
    kept = variances > LEAST
    return CommonWaves(directions[:, kept], variances[kept]) if kept.any() else None
