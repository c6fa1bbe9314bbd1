"""What photos scatter: covariance of the sections of a photo; that of the forces is in `force_noise`.

In: the raw midline sections of a `rod.measurement.MeasuredShape`. Out: block means of sections with their exact
covariance. The residuals of a fit never set a variance here: only the part of a photo's scatter that no bent cable can
follow (faster along s than the smooth basis of the comparison) does, so misfit cannot hide in it.

Notation. A photo has sections with standard deviation sigma(s), correlation exp(-ds / l) and a slow sideways error
(light) of standard deviation sigma_sys and correlation exp(-ds^2 / (2 l_sys^2)). ``m`` neighbouring sections at pitch D
form a block; with rho = exp(-D / l) the block means have (AR(1) sums)

    variance   sigma^2 / m^2 (m + 2 sum_{j=1}^{m-1} (m - j) rho^j)
    covariance sigma^2 / m^2 rho^{m g} (sum_{j=0}^{m-1} rho^j) (sum_{j=0}^{m-1} rho^-j)      at g blocks apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.interpolate import CubicHermiteSpline

from rod.measurement import MeasuredShape, SlowErrors, slow_covariance

Array = NDArray[np.float64]

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


@dataclass(frozen=True)
class Sections:
    """Block means of the midline sections of one photo, in the chord frame.

    Attributes
    ----------
    s, x, y, theta : (k,) m, rad
        Arc length, position and direction of the blocks.
    std : (k,) m
        Of a single section in the block, along the normal.
    members : int
        Sections in a block.
    pitch : m
        Distance of neighbouring sections.
    correlation_length : m
    slow : tuple of (std m, length m)
        Slow sideways errors: of the light first, then of waves that a textured ground makes on this photo alone.
    common : (std m, length m)
        Waves that are the same at the same s on all photos.
    """

    s: Array
    x: Array
    y: Array
    theta: Array
    std: Array
    members: int
    pitch: float
    correlation_length: float
    slow: SlowErrors
    common: tuple[float, float] = (0.0, 0.0)


def block_means(shape: MeasuredShape, *, blocks: int) -> Sections:
    """Average neighbouring sections: what is faster than the comparison can use becomes precision.

    The deviation from the smooth centerline is averaged, not the position, so the bend within a block costs nothing.
    Sections left over by the division are dropped at both ends alike.
    """
    order = np.argsort(shape.section_s, kind="stable")
    s = shape.section_s[order]
    curve_x = CubicHermiteSpline(shape.s, shape.x, np.cos(shape.theta))
    curve_y = CubicHermiteSpline(shape.s, shape.y, np.sin(shape.theta))
    across = shape.section_offsets()[order]
    members = max(1, len(s) // blocks)
    count = len(s) // members
    first = (len(s) - count * members) // 2

    def mean(values: Array) -> Array:
        return np.asarray(values[first : first + count * members].reshape(count, members).mean(axis=1))

    at, offset = mean(s), mean(across)
    middle = np.interp(at, shape.s, shape.theta)
    return Sections(
        s=at,
        x=curve_x(at) - np.sin(middle) * offset,
        y=curve_y(at) + np.cos(middle) * offset,
        theta=middle,
        std=np.sqrt(mean(shape.section_std[order] ** 2)),
        members=members,
        pitch=float(np.median(np.diff(s))),
        correlation_length=shape.correlation_length,
        slow=((shape.systematic_std, shape.systematic_length), (shape.wave_std, shape.wave_length)),
        common=(shape.common_std, shape.wave_length),
    )


def block_correlation(count: int, *, members: int, pitch: float, length: float) -> Array:
    """Covariance (count, count) of means of ``members`` unit-variance sections with correlation exp(-ds / length)."""
    rho = np.exp(-pitch / length) if length > 0.0 else 0.0
    j = np.arange(1, members)
    variance = (members + 2.0 * np.sum((members - j) * rho**j)) / members**2
    gap = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    if rho == 0.0:
        return np.asarray(variance * (gap == 0), dtype=float)
    # rho^{m g} (sum rho^j)(sum rho^-j), written with exponents that are never negative
    ramp = np.sum(rho ** np.arange(members))
    near = np.sum(rho ** (members - 1 - np.arange(members)))
    between = ramp * near * rho ** np.maximum(members * gap - (members - 1), 0) / members**2
    return np.asarray(np.where(gap == 0, variance, between))


def section_covariance(sections: Sections, *, factor: float = 1.0, stretch: float = 1.0) -> Array:
    """Covariance (k, k) of the block means: random part times ``factor``^2, stretched along s, plus the slow parts."""
    random = block_correlation(
        len(sections.s),
        members=sections.members,
        pitch=sections.pitch,
        length=sections.correlation_length * stretch,
    )
    random *= factor**2 * np.outer(sections.std, sections.std)
    return random + slow_errors(sections)


def slow_errors(sections: Sections) -> Array:
    """Covariance (k, k) of the slow errors of a photo: its own, and what the light does to all photos alike."""
    return np.asarray(light_alike(sections, sections) + slow_covariance(sections.s, sections.slow))


def light_alike(one: Sections, other: Sections) -> Array:
    """Covariance (k, j) of what the light does to two photos, or to one, wherever the cable has the same direction."""
    turn = np.subtract.outer(one.theta, other.theta) / TURN
    return np.asarray(one.slow[0][0] * other.slow[0][0] * np.exp(-0.5 * turn**2))


def by_axes(sections: Sections, chord: float) -> Array:
    """What unit errors of the bearing axes do to (chord, normal distances of the sections): columns (1 + k, 3).

    Left axis along x, left and right axis across it; the right axis along x moves the chord alone.
    """
    normal_x, normal_y = -np.sin(sections.theta), np.cos(sections.theta)
    share = sections.x / chord
    shapes = np.column_stack([-normal_x, -normal_y * (1.0 - share), -normal_y * share])
    return np.vstack([np.r_[-1.0, 0.0, 0.0], shapes])


def smooth_basis(s: Array, length: float, *, functions: int) -> Array:
    """Legendre polynomials (k, functions) of ``s / length``: every misfit of a bent cable that the data can show."""
    return np.asarray(np.polynomial.legendre.legvander(2.0 * s / length - 1.0, functions - 1), dtype=float)


@dataclass(frozen=True)
class PhotoNoise:
    """Correction of the stated noise of sections: std times ``factor``, correlation length times ``stretch``.

    ``doubt`` is the standard deviation of the logarithm of its slow part's variance, which is what a misfit has to
    exceed: nothing but its extrapolation from the fast part is known.
    """

    factor: float = 1.0
    stretch: float = 1.0
    doubt: float = 0.0


def calibrate_photo_noise(residuals: list[Array], sections: list[Sections], bases: list[Array]) -> PhotoNoise:
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

    Returns
    -------
    PhotoNoise
    """
    turned = [linalg.qr(basis)[0] for basis in bases]
    split = [(q[:, : basis.shape[1]], q[:, basis.shape[1] :]) for q, basis in zip(turned, bases, strict=True)]
    fast = [contrast.T @ residual for (_, contrast), residual in zip(split, residuals, strict=True)]

    def level(stretch: float) -> tuple[float, float, float]:
        """Factor, log-likelihood and log of the slow variance at a stretch."""
        square, freedom, determinant, slow = PRIOR_WEIGHT, PRIOR_WEIGHT, 0.0, 0.0
        for part, block, (smooth, contrast) in zip(fast, sections, split, strict=True):
            covariance = section_covariance(block, stretch=stretch)
            root = linalg.cholesky(contrast.T @ covariance @ contrast, lower=True)
            square += float(np.sum(linalg.solve_triangular(root, part, lower=True) ** 2))
            freedom += contrast.shape[1]
            determinant += 2.0 * float(np.sum(np.log(np.diag(root))))
            slow += float(np.sum(smooth * (covariance @ smooth)))
        off = np.log(stretch) / STRETCH_SPREAD
        value = -0.5 * (determinant + freedom * np.log(square / freedom) + off**2)
        return float(np.sqrt(square / freedom)), value, float(np.log(slow * square / freedom))

    trials = np.array([level(stretch) for stretch in STRETCHES])
    weight = np.exp(trials[:, 1] - trials[:, 1].max())
    weight /= weight.sum()
    stretch = float(np.exp(weight @ np.log(STRETCHES)))
    freedom = PRIOR_WEIGHT + sum(part.size for part in fast)
    scatter = float(weight @ (trials[:, 2] - weight @ trials[:, 2]) ** 2)
    return PhotoNoise(level(stretch)[0], stretch, float(np.sqrt(scatter + 2.0 / freedom)))
