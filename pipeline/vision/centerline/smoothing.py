"""Penalised least squares with correlated errors: the weight of the penalty and the correlation by REML.

Model: ``y = J q + e``, ``e`` Gaussian with standard deviations ``sigma std_i`` and correlation ``exp(-ds/l)`` along s;
``D q ~ N(0, sigma^2 / mu)``. Unknown: q, sigma, mu, l. The exponential correlation is that of a Markov process, so
errors are whitened exactly by differences of neighbours, in O(n).

For one ``l`` the whitened problem is brought to diagonal form once (QR of the stacked ``[R; sqrt(mu_0) D]``, the
singular vectors of its upper block Q1: the generalised singular values of the pair), after which every ``mu`` costs
O(p). Squared normal equations, which lose half the digits, are never formed; ``Q1' Q1`` is, for the columns of the
whole are orthonormal, so that its eigenvalues keep an absolute error of one rounding.

The restricted likelihood over ``log mu`` is kept whole: estimate and covariance are averaged over it, so that a weight
that the data leave open widens the bands.

Source: Patterson and Thompson (1971), Biometrika 58, 545; Wood (2017), Generalized Additive Models, sec. 6.2;
Fisher (1921), Metron 1, 3 for z of a correlation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from pipeline.records import Array
from pipeline.vision.median import median

_FLOOR = 1e-14  # squared generalised singular values below it are unseen by the data


@dataclass(frozen=True)
class Smooth:
    """Estimate of a penalised problem.

    Attributes
    ----------
    estimate : (p,)
    root : (p, p)
        ``covariance = root @ root.T``, sigma included.
    gain : (p, n)
        Derivative of the estimate with respect to the data.
    sigma : float
        Scale of the given standard deviations; 1 if they were right.
    correlation_length : float
        In the unit of the positions.
    """

    estimate: Array
    root: Array
    gain: Array
    sigma: float
    correlation_length: float

    @property
    def covariance(self) -> Array:
        """Covariance ``(p, p)`` of the estimate."""
        return self.root @ self.root.T


def whiten(rows: Array, std: Array, gaps: Array, length: float) -> Array:
    """Rows ``(n, ...)`` in units of independent errors; ``gaps`` ``(n - 1,)`` are the distances of neighbours."""
    scaled = rows / std.reshape(-1, *[1] * (rows.ndim - 1))
    rho = _correlations(gaps, length).reshape(-1, *[1] * (rows.ndim - 1))
    return np.concatenate([scaled[:1], (scaled[1:] - rho * scaled[:-1]) / np.sqrt(1.0 - rho**2)])


def _correlations(gaps: Array, length: float) -> Array:
    # Capped: two sections at the same place would be taken for one, and their difference for infinitely certain.
    return np.asarray(np.minimum(np.exp(-np.maximum(gaps, 0.0) / length), 0.999))


@dataclass(frozen=True)
class _Diagonal:
    """The problem in the coordinates in which data and penalty are both diagonal.

    Attributes
    ----------
    gamma2 : (p,)
        Share of the data in each coordinate; 1 - gamma2 is that of the penalty.
    projected : (p,)
        Data in these coordinates, times the root of their share.
    triangle, turned : (p, p)
        Coordinates to q; see `back`.
    scale : (p,)
    total : float
        Squared length of the data.
    count, null : int
        Number of data, dimension of what is not penalised.
    log_det : float
        Of the correlation matrix, and of the normal matrix in the frame of q less that in these coordinates: both
        change with the correlation length.
    least : float
        Squared length of the penalised quantity below which the penalty is not believed, in units of the data.
    """

    gamma2: Array
    projected: Array
    triangle: Array
    turned: Array
    scale: Array
    total: float
    count: int
    null: int
    log_det: float
    least: float

    @cached_property
    def back(self) -> Array:
        """Coordinates to q, ``(p, p)``."""
        return np.asarray(solve_triangular(self.triangle, self.turned, check_finite=False) / self.scale[:, None])

    def shrinkage(self, weight: Array) -> Array:
        """Diagonal of the normal matrix at every weight, ``(w, p)``."""
        return np.asarray(self.gamma2 + np.multiply.outer(weight, 1.0 - self.gamma2))

    def weights(self) -> Array:
        """Weights (w,) of the penalty over all decades that can matter, by factors of about two."""
        ratio = np.sort(np.maximum(self.gamma2, _FLOOR) / np.maximum(1.0 - self.gamma2, _FLOOR))[: -self.null]
        return np.exp(np.linspace(np.log(0.1 * ratio[0]), np.log(1e3 * ratio[-1]), 97))

    def criterion(self, weights: Array) -> tuple[Array, Array]:
        """Restricted likelihood, -2 log, and sigma squared at every weight, (w,) each."""
        share = self.shrinkage(weights)
        freedom = self.count - self.null
        # Without noise nothing is left but rounding, which must not become the logarithm of zero.
        left = self.total - (self.projected**2 / share).sum(axis=1)
        sigma2 = np.maximum(left, 1e-20 * self.total) / freedom
        rank = len(self.gamma2) - self.null
        value = freedom * np.log(sigma2) + np.log(share).sum(axis=1) - rank * np.log(weights)
        # A weight that leaves less than ``least``: its prior, with rank terms of variance sigma^2 / weight each.
        believed = weights * self.least <= rank * sigma2
        believed[0] = True
        return np.where(believed, value + self.log_det, np.inf), sigma2


def _diagonal(whitened: Array, penalty: Array, null: int, noise_log_det: float, least: float) -> _Diagonal:
    """Diagonal form of whitened columns ``[design, data]``."""
    size = whitened.shape[1] - 1
    triangle = np.zeros((size + 1, size + 1))  # its last column holds the data: Q itself is never needed
    triangle[: len(whitened)] = np.linalg.qr(whitened, mode="r")  # the penalty tells what few data leave open
    r, data = triangle[:size, :size], triangle[:, size]
    stacked = np.zeros((size + len(penalty), size))
    stacked[:size] = r
    gain = np.linalg.norm(r) / np.linalg.norm(penalty)
    stacked[size:, size - penalty.shape[1] :] = penalty * gain
    length = np.linalg.norm(stacked, axis=0)
    q0, r0 = np.linalg.qr(stacked / length)
    upper = q0[:size]
    gamma2, turned = np.linalg.eigh(upper.T @ upper)
    return _Diagonal(
        gamma2=np.clip(gamma2, 0.0, 1.0),
        projected=turned.T @ (upper.T @ data[:size]),
        triangle=r0,
        turned=turned,
        scale=length,
        total=float(data @ data),
        count=len(whitened),
        null=null,
        # weights count from gain^2, so the penalty's own determinant is told in that unit
        log_det=noise_log_det
        + float(2.0 * np.log(np.abs(np.diag(r0)) * length).sum() - 2.0 * (size - null) * np.log(gain)),
        least=float(gain**2 * least),
    )


@dataclass(frozen=True)
class Problem:
    """A penalised least-squares problem.

    Attributes
    ----------
    design : (n, p)
    data : (n,)
    penalty : (d, k)
        Of the last k parameters; its null space with the p - k free ones has dimension ``null``.
    null : int
    std : (n,)
        Relative size of the errors.
    position : (n,)
        Along s, ascending.
    least : float
        Squared length of the penalised quantity that is expected at least. Without it correlated errors can take over
        all that a stiff penalty leaves of the curve, and the bands of a curve too stiff are too narrow.
    """

    design: Array
    data: Array
    penalty: Array
    null: int
    std: Array
    position: Array
    least: float = 0.0

    @cached_property
    def _known(self) -> dict[float, _Diagonal]:
        """Diagonal forms by correlation length: the likeliest one is asked for again."""
        return {}

    @cached_property
    def gaps(self) -> Array:
        """Distances of neighbours, ``(n - 1,)``."""
        return np.diff(self.position)

    def correlation_length(self, longest: float) -> float:
        """Likeliest correlation length, from a fifth of the distance of neighbours (none) up to ``longest``."""
        gap = median(self.gaps)
        shortest = 0.2 * gap
        # Even in Fisher's z of neighbours, by which likelihoods of correlations are nearly parabolas.
        low, high = (np.arctanh(np.exp(-gap / length)) for length in (shortest, max(longest, 2.0 * shortest)))
        tried = np.linspace(low, high, 7)  # leaves 0.02 of z, a third of what 240 points tell
        lengths = -gap / np.log(np.tanh(tried))
        diagonals = [self._diagonal(float(length)) for length in lengths]
        alone = np.array([diagonal.criterion(diagonal.weights())[0].min() for diagonal in diagonals])
        return float(-gap / np.log(np.tanh(_lowest(tried, alone))))

    def estimate(self, correlation_length: float) -> Array:
        """Estimate ``(p,)`` at the likeliest weight of the penalty."""
        diagonal = self._diagonal(correlation_length)
        weights = diagonal.weights()
        best = weights[[int(np.argmin(diagonal.criterion(weights)[0]))]]
        return np.asarray(diagonal.back @ (diagonal.projected / diagonal.shrinkage(best)[0]))

    def smooth(self, correlation_length: float, *, bias_share: float = 1.0) -> Smooth:
        """Estimate, covariance and gain, averaged over the likelihood of the weight.

        The posterior covariance is that of the noise carried through the fit, and of the smoothing's bias if the truth
        were as rough as the penalty allows. ``bias_share`` is the part of the latter that is counted.
        """
        diagonal = self._diagonal(correlation_length)
        weights = diagonal.weights()
        value, sigma2 = diagonal.criterion(weights)
        odds = np.exp(-0.5 * (value - value.min()))
        odds /= odds.sum()
        share = diagonal.shrinkage(weights)
        each = diagonal.projected / share
        mean = odds @ each
        spread = np.sqrt(odds)[:, None] * (each - mean)
        noise = diagonal.gamma2 / share**2
        variance = np.diag(odds @ (sigma2[:, None] * (noise + bias_share * (1.0 / share - noise)))) + spread.T @ spread
        values, vectors = np.linalg.eigh(variance)
        # In these coordinates the whitened design is orthogonal, with squared column lengths gamma2.
        orthogonal = whiten(self.design, self.std, self.gaps, correlation_length) @ diagonal.back
        white = (diagonal.back * (odds @ (1.0 / share))) @ orthogonal.T
        return Smooth(
            estimate=diagonal.back @ mean,
            root=diagonal.back @ (vectors * np.sqrt(np.maximum(values, 0.0))),
            gain=_unwhiten(white, self.std, self.gaps, correlation_length),
            sigma=float(np.sqrt(odds @ sigma2)),
            correlation_length=correlation_length,
        )

    def _diagonal(self, length: float) -> _Diagonal:
        if length not in self._known:
            rho = _correlations(self.gaps, length)
            columns = whiten(np.column_stack([self.design, self.data]), self.std, self.gaps, length)
            determinant = float(np.log1p(-(rho**2)).sum())
            self._known[length] = _diagonal(columns, self.penalty, self.null, determinant, self.least)
        return self._known[length]


def _lowest(places: Array, values: Array) -> float:
    """Minimum of values at even places, by the parabola through the lowest and its neighbours; within the places."""
    at = int(np.clip(np.argmin(values), 1, len(places) - 2))
    before, here, after = values[at - 1 : at + 2]
    bend = before - 2.0 * here + after
    if bend <= 0.0:
        return float(places[np.argmin(values)])
    step = 0.5 * (before - after) / bend * (places[1] - places[0])
    return float(np.clip(places[at] + step, places[0], places[-1]))


def _unwhiten(gain: Array, std: Array, gaps: Array, length: float) -> Array:
    """Gain on the data from the gain on whitened data: transposed differences."""
    rho = _correlations(gaps, length)
    root = np.sqrt(1.0 - rho**2)
    out = gain.copy()
    out[:, 1:] /= root
    out[:, :-1] -= gain[:, 1:] * (rho / root)
    return np.asarray(out / std)
