"""Errors that photos have in common at the same place of the cable: they join rows that were whitened photo by photo.

Print on the sheath, or the ground below the end that stands still, moves the midline by the same on every photo. The
light moves it by much the same wherever the cable has the same direction under the lamp, which stands still. Taken for
noise of each photo by itself, a dozen photos would average away what they all share, and make of a twentieth
of a pixel a cause at ten standard deviations.

With the rows of all photos, each whitened by its own noise, the errors that photos share have the covariance K over the
sections of all: that of the waves, and that of the light between two photos (within one it is in the whitening A
already). The covariance of the rows is ``1 + A K A' = 1 + U diag(v) U'``. Its inverse root,
``1 - U diag(1 - 1 / sqrt(1 + v)) U'``, is the symmetric one, so a row stays that of its photo as far as can be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rod.array import Array
from rod.inverse.noise import light_alike
from rod.measurement import slow_covariance
from rod.midline import Midline

LEAST = 1e-3
"""Variance, in units of that of each photo's noise, below which what photos share is nothing."""


@dataclass(frozen=True, eq=False)
class CommonErrors:
    """Directions ``U`` (n, m) of the rows of all photos in which they err alike, and their added variances (m,).

    A variance is negative, and above -1, in directions that what photos share leaves: differences between them.
    """

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


def common_errors(sections: Sequence[Midline], whiten: Sequence[Array]) -> CommonErrors | None:
    """Errors that the photos of a test share; None where none are stated.

    Parameters
    ----------
    sections : sequence of Midline
        Of every photo.
    whiten : sequence of (1 + q, 1 + k)
        Acts on (chord residual, normal residuals of the sections) of each.
    """
    if len(sections) < 2:
        return None
    joint = shared_light(sections, whiten) + _joint(_waves(sections), sections, whiten)
    variances, directions = np.linalg.eigh(0.5 * (joint + joint.T))
    kept = np.abs(variances) > LEAST
    return CommonErrors(directions[:, kept], variances[kept]) if kept.any() else None


def shared_light(sections: Sequence[Midline], whiten: Sequence[Array]) -> Array:
    """Covariance (n, n) that the light's error makes between rows of different photos, each whitened by its own."""
    pairs = ([np.zeros((len(a.s), len(b.s))) if a is b else light_alike(a, b) for b in sections] for a in sections)
    return _joint(np.block(list(pairs)), sections, whiten)


def _waves(sections: Sequence[Midline]) -> Array:
    """Covariance (k, k) over the sections of all photos of waves that are the same on all."""
    std = float(np.sqrt(np.mean([own.common[0] ** 2 for own in sections])))
    length = float(np.median([own.common[1] for own in sections]))
    return slow_covariance(np.concatenate([own.s for own in sections]), ((std, length),))


def _joint(covariance: Array, sections: Sequence[Midline], whiten: Sequence[Array]) -> Array:
    """Covariance (n, n) of the whitened rows from one of the sections (k, k), all photos one after the other."""
    ends = np.cumsum([0, *(len(own.s) for own in sections)])
    rows = np.vstack([root[:, 1:] @ covariance[a:b] for root, a, b in zip(whiten, ends, ends[1:], strict=False)])
    return np.hstack([rows[:, a:b] @ root[:, 1:].T for root, a, b in zip(whiten, ends, ends[1:], strict=False)])
