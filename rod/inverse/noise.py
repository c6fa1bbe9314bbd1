"""Noise of the photos, also beyond what they state; that of the forces is in `force_noise`.

In: block means of the midline of each photo (`rod.midline`). Out: their covariance with the level and the correlation
length that they show. The residuals of a fit never set a variance here: only the part of a photo's scatter that no bent
cable can follow (faster along s than the smooth basis of the comparison) does, so misfit cannot hide in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from rod.array import Array
from rod.measurement import MeasuredShape, slow_covariance
from rod.midline import Midline

STRETCHES = (0.35, 0.5, 0.64, 0.8, 1.0, 1.25, 1.6, 2.1, 2.8, 3.6, 4.5)
"""Trial factors of the stated correlation length; a grid of ratio 1.7 chose 0.6 where 0.8 was likeliest and put the
slow noise a third too low."""

STRETCH_SPREAD = 0.5
"""Logarithm of that factor; a photo's own estimate of its correlation length scatters by half, and a stretch chosen by
chance made one null in fifty look like a cause."""

TURN = 0.5
"""Angle (rad) over which the light's error becomes another: what a lamp does to both edges goes with the cosine of its
direction to the cable, and faster where a flank turns into shade."""

PRIOR_WEIGHT = 20.0
"""Samples that the noise level stated by the photos counts for against the level seen."""


def section_covariance(sections: Midline, *, factor: float = 1.0, stretch: float = 1.0) -> Array:
    """Covariance (k, k) of the block means: random part times ``factor``^2, stretched along s, plus the slow parts."""
    return np.asarray(factor**2 * sections.random(stretch) + slow_errors(sections))


def slow_errors(sections: Midline) -> Array:
    """Covariance (k, k) of the slow errors of a photo: its own, and what the light does to all photos alike."""
    return np.asarray(light_alike(sections, sections) + slow_covariance(sections.s, sections.slow))


def light_alike(one: Midline, other: Midline) -> Array:
    """Covariance (k, j) of what the light does to two photos, or to one, wherever the cable has the same direction."""
    turn = np.subtract.outer(one.theta, other.theta) / TURN
    return np.asarray(one.slow[0][0] * other.slow[0][0] * np.exp(-0.5 * turn**2))


def by_axes(sections: Midline | MeasuredShape, chord: float) -> Array:
    """What unit errors of the bearing axes do to (chord, normal distances of the sections): columns (1 + k, 4).

    Left axis along and across the chord, right axis along and across it.
    """
    normal_x, normal_y = -np.sin(sections.theta), np.cos(sections.theta)
    share = sections.x / chord
    shapes = np.column_stack([-normal_x, -normal_y * (1.0 - share), np.zeros_like(share), -normal_y * share])
    return np.vstack([np.array([-1.0, 0.0, 1.0, 0.0]), shapes])


def smooth_basis(s: Array, length: float, *, functions: int) -> Array:
    """Legendre polynomials (k, functions) of ``s / length``: every misfit of a bent cable that the data can show."""
    return np.asarray(np.polynomial.legendre.legvander(2.0 * s / length - 1.0, max(functions - 1, 0)), float)[
        :, :functions
    ]


@dataclass(frozen=True)
class PhotoNoise:
    """Correction of the stated noise of sections: std times ``factor``, correlation length times ``stretch``."""

    factor: float = 1.0
    stretch: float = 1.0


def calibrate_photo_noise(residuals: list[Array], sections: list[Midline], bases: list[Array]) -> PhotoNoise:
    """Noise level and correlation of the sections from what is faster along s than ``bases``.

    Restricted likelihood over all photos: the smooth basis is projected out, so neither a misfit of the model nor a
    cause can raise the level. What is fast along s tells factor^2 / stretch well and the stretch alone badly, but the
    slow noise that a cause must exceed goes with factor^2 * stretch. So the stretch is the mean over the likelihood,
    not its maximum: that jumps from trial to trial, and the slow noise with it.

    Parameters
    ----------
    residuals : list of (k,) m
        Normal distance of the block means from any smooth reference (the fitted cable).
    sections, bases : lists
        Per photo; bases (k, q) as of `smooth_basis`.
    """
    contrasts = [linalg.qr(basis)[0][:, basis.shape[1] :] for basis in bases]
    fast = [contrast.T @ residual for contrast, residual in zip(contrasts, residuals, strict=True)]

    def level(stretch: float) -> tuple[float, float]:
        """Factor and log-likelihood at a stretch."""
        square, freedom, determinant = PRIOR_WEIGHT, PRIOR_WEIGHT, 0.0
        for part, block, contrast in zip(fast, sections, contrasts, strict=True):
            root = linalg.cholesky(contrast.T @ section_covariance(block, stretch=stretch) @ contrast, lower=True)
            square += float(np.sum(linalg.solve_triangular(root, part, lower=True) ** 2))
            freedom += contrast.shape[1]
            determinant += 2.0 * float(np.sum(np.log(np.diag(root))))
        off = np.log(stretch) / STRETCH_SPREAD
        value = -0.5 * (determinant + freedom * np.log(square / freedom) + off**2)
        return float(np.sqrt(square / freedom)), value

    trials = np.array([level(stretch) for stretch in STRETCHES])
    weight = np.exp(trials[:, 1] - trials[:, 1].max())
    weight /= weight.sum()
    stretch = float(np.exp(weight @ np.log(STRETCHES)))
    return PhotoNoise(level(stretch)[0], stretch)
