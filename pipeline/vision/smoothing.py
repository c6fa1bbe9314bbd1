"""Penalised least squares with correlated errors: the weight of the penalty and the correlation by REML.

Model: ``y = J q + e``, ``e`` Gaussian with standard deviations ``sigma std_i`` and correlation ``exp(-ds/l)`` along s;
``D q ~ N(0, sigma^2 / mu)``. Unknown: q, sigma, mu, l. The exponential correlation is that of a Markov process, so
errors are whitened exactly by differences of neighbours, in O(n).

For one ``l`` the whitened problem is brought to diagonal form once (QR of the stacked ``[R; sqrt(mu_0) D]``, SVD of
its upper block: the generalised singular values of the pair), after which every ``mu`` costs O(p). Squared normal
equations, which lose half the digits, are never formed.

The restricted likelihood over ``log mu`` is kept whole: estimate and covariance are averaged over it, so that a weight
that the data leave open widens the bands.

Source: Patterson and Thompson (1971), Biometrika 58, 545; Wood (2017), Generalized Additive Models, sec. 6.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr, solve_triangular
from scipy.optimize import minimize_scalar

from pipeline.records import Array

_GRID = 97  # weights tried, over all that can matter: steps of a factor of about two, likelihoods vary over decades
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
    freedom : float
        Effective number of parameters.
    correlation_length : float
        In the unit of the positions.
    """

    estimate: Array
    root: Array
    gain: Array
    sigma: float
    freedom: float
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
    """The problem in the coordinates in which data and penalty are both diagonal."""

    gamma2: Array  # share of the data in each coordinate; 1 - gamma2 that of the penalty
    projected: Array  # data in these coordinates
    left: Array  # (n, p) whitened data to coordinates
    back: Array  # (p, p) coordinates to q
    total: float  # squared length of the data
    null: int
    noise_log_det: float

    def shrinkage(self, weight: Array | float) -> Array:
        return np.asarray(self.gamma2 + np.multiply.outer(weight, 1.0 - self.gamma2))

    def weights(self) -> Array:
        ratio = np.sort(np.maximum(self.gamma2, _FLOOR) / np.maximum(1.0 - self.gamma2, _FLOOR))[: -self.null]
        return np.geomspace(0.1 * ratio[0], 1e3 * ratio[-1], _GRID)

    def criterion(self, weights: Array) -> tuple[Array, Array]:
        """Restricted likelihood, -2 log, and sigma squared at every weight."""
        share = self.shrinkage(weights)
        count = len(self.left) - self.null
        sigma2 = (self.total - (self.gamma2 * self.projected**2 / share).sum(axis=1)) / count
        rank = len(self.gamma2) - self.null
        value = count * np.log(sigma2) + np.log(share).sum(axis=1) - rank * np.log(weights)
        return value + self.noise_log_det, sigma2


def _diagonal(design: Array, data: Array, penalty: Array, null: int, noise_log_det: float) -> _Diagonal:
    size = design.shape[1]
    full = np.zeros((len(penalty), size))
    full[:, size - penalty.shape[1] :] = penalty
    full *= np.linalg.norm(design) / np.linalg.norm(full)
    q, r = qr(design, mode="economic", check_finite=False)
    stacked = np.concatenate([r, full])
    length = np.linalg.norm(stacked, axis=0)
    q0, r0 = qr(stacked / length, mode="economic", check_finite=False)
    u, gamma, vt = np.linalg.svd(q0[:size])
    left = q @ u
    back = solve_triangular(r0, vt.T, check_finite=False) / length[:, None]
    gamma = np.minimum(gamma, 1.0)
    # `left` spans what the data see; coordinate i of q is gamma_i (u_i . y) / shrinkage.
    return _Diagonal(
        gamma**2,
        gamma * (left.T @ data) / np.maximum(gamma, 1e-300),
        left,
        back,
        float(data @ data),
        null,
        noise_log_det,
    )


def smooth(
    design: Array,
    data: Array,
    *,
    penalty: Array,
    null: int,
    std: Array,
    position: Array,
    longest: float,
    correlation_length: float | None = None,
) -> Smooth:
    """Solve the penalised problem; the correlation length is sought up to ``longest`` unless given.

    Parameters
    ----------
    design : (n, p)
    data : (n,)
    penalty : (d, k)
        Of the last k parameters; its null space with the p - k free ones has dimension ``null``.
    std : (n,)
        Relative size of the errors.
    position : (n,)
        Along s, ascending.
    """
    gaps = np.diff(position)
    shortest = 0.2 * float(np.median(gaps))

    def problem(length: float) -> _Diagonal:
        rho = _correlations(gaps, length)
        both = whiten(np.column_stack([design, data]), std, gaps, length)
        return _diagonal(both[:, :-1], both[:, -1], penalty, null, float(np.log1p(-(rho**2)).sum()))

    if correlation_length is None:

        def value(log_length: float) -> float:
            chosen = problem(float(np.exp(log_length)))
            return float(chosen.criterion(chosen.weights())[0].min())

        bounds = (np.log(shortest), np.log(max(longest, 2.0 * shortest)))
        found = minimize_scalar(value, bounds=bounds, method="bounded", options={"xatol": 0.1})
        correlation_length = float(np.exp(found.x))
    chosen = problem(correlation_length)
    return _average(chosen, std, gaps, correlation_length)


def _average(chosen: _Diagonal, std: Array, gaps: Array, length: float) -> Smooth:
    """Estimate and covariance over the likelihood of the weight."""
    weights = chosen.weights()
    value, sigma2 = chosen.criterion(weights)
    odds = np.exp(-0.5 * (value - value.min()))
    odds /= odds.sum()
    share = chosen.shrinkage(weights)
    gamma = np.sqrt(chosen.gamma2)
    each = gamma * chosen.projected / share
    mean = odds @ each
    spread = np.sqrt(odds)[:, None] * (each - mean)
    variance = np.diag(odds @ (sigma2[:, None] / share)) + spread.T @ spread
    values, vectors = np.linalg.eigh(variance)
    root = chosen.back @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    filter_ = odds @ (gamma / share)
    white = (chosen.back * filter_) @ chosen.left.T  # (p, n), acts on whitened data
    return Smooth(
        estimate=chosen.back @ mean,
        root=root,
        gain=_unwhiten(white, std, gaps, length),
        sigma=float(np.sqrt(odds @ sigma2)),
        freedom=float((odds @ (chosen.gamma2 / share)).sum()),
        correlation_length=length,
    )


def _unwhiten(gain: Array, std: Array, gaps: Array, length: float) -> Array:
    """Gain on the data from the gain on whitened data: transposed differences."""
    rho = _correlations(gaps, length)
    root = np.sqrt(1.0 - rho**2)
    out = gain.copy()
    out[:, 1:] /= root
    out[:, :-1] -= gain[:, 1:] * (rho / root)
    return np.asarray(out / std)
