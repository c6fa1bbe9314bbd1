"""Edges that share what the light tells: level and step of a section are those of its neighbourhood, slowly changing.

An edge is fitted on each section by itself, with level ``a`` and step ``A`` free. In a window of twelve pixels their
errors go along with that of its place: free, they leave it 1.2 times the error it had if they were known. On an even
sheath and ground they are known, from all other sections: they follow a polynomial of s, up to a variance ``T`` for
texture, text and light that bends more than it. So much as a section's level and step are off beyond that, its place is
off as its covariance ``C`` tells:

    t0' = t0 - C_tp (C_pp + T)^-1 (p - p0),   var t0' = C_tt - C_tp (C_pp + T)^-1 C_pt,   p = (a, A)

``T`` is told by the sections themselves, from section to section and over blocks of them: misfit that lasts would move
many places alike, and counts as often as it lasts. A coarse ground leaves the edges as they were.

Lengths in px, grey values as fractions of full range.
"""

from __future__ import annotations

import numpy as np

from pipeline.records import Array
from pipeline.vision.median import median, robust_fit, scatter

LEAST_SLOW_SECTIONS = 80  # edges of a side; fewer do not tell how far level and step depart from the polynomial
_BLOCK = 8  # sections: short beside the bends of the polynomial, long beside texture
_LASTING = 4.0  # blocks that a misfit lasts at most, before the polynomial follows it
# Of the errors' variance: where nothing is off 1.0 is found from section to section and 1.2 to 1.35 over blocks, with a
# scatter of 0.25. With 1.5 light that bends by 0.7 % of the step, unseen in noise of a sixth of it, moves an edge by a
# quarter of a section's error, and kappa is 1 % better.
_CHANCE = 1.2
_ROUNDING = 1e-12  # grey squared; drawn pictures without noise have no errors at all
_SLOW_LIGHT_ORDER = 5
"""Of the polynomial of s that level and step of an edge follow on an even sheath and ground: light turns with the
cable, once from end to end.
"""
_LEAST_SLOW_SHARE = 0.9
"""Of the sections, by edge; where fewer show it, what they show is no even light: white on white, edges held to it made
a curve that looked right, 20 px beside the cable.
"""


def steadied(place: Array, light: Array, covariance: Array, s: Array) -> tuple[Array, Array]:
    """Places of edges and their standard deviations ``(2, n)``, with level and step of each side slow along s.

    Parameters
    ----------
    place : (2, n) px
        By side and section; NaN where there is no edge.
    light : (2, n, 2) grey
        Level and step.
    covariance : (2, n, 3, 3)
        Of level, step and place.
    s : (n,) px
    """
    free = np.sqrt(covariance[..., 2, 2])
    known = np.isfinite(place)
    if known.sum(axis=1).min() < LEAST_SLOW_SECTIONS or known.mean(axis=1).min() < _LEAST_SLOW_SHARE:
        return place, free
    slow = np.polynomial.legendre.legvander(2.0 * (s - s[0]) / (s[-1] - s[0]) - 1.0, _SLOW_LIGHT_ORDER)
    off, extra, plain = np.zeros(light.shape), np.zeros((2, 2)), known.copy()
    for k in (0, 1):
        for side in (0, 1):
            there, variance = known[side], covariance[side, known[side], k, k]
            away = light[side, there, k] - slow[there] @ robust_fit(slow[there], light[side, there, k])
            # Letters and dirt are no light: what they do to a section says nothing of its place.
            near = np.abs(away) < 4.0 * np.sqrt(np.maximum(variance, scatter(away, 0.0) ** 2) + _ROUNDING)
            extra[side, k] = _extra(np.where(near, away, 0.0), variance, slow.shape[1])
            off[side, there, k] = away
            plain[side, there] &= near
    # Both sides lie on one ground and on one sheath: together they tell a half more surely what is no chance.
    extra = np.maximum(extra.mean(axis=0), 0.0)
    shared = covariance[..., :2, 2]
    allowed = covariance[..., :2, :2] + np.diag(extra + _ROUNDING)
    gain = np.linalg.solve(allowed, shared[..., None])[..., 0] * plain[..., None]
    std = np.sqrt(np.maximum(covariance[..., 2, 2] - (gain * shared).sum(axis=-1), 0.0))
    return place - (gain * off).sum(axis=-1), std


def _extra(off: Array, variance: Array, followed: int) -> float:
    """Variance of what is off the slow light beyond the errors' ``variance`` ``(n,)``, as it acts on a section.

    ``followed`` is the number of columns that the slow light has. By chance it may be negative.
    """
    usual = median(variance)
    means = off[: len(off) // _BLOCK * _BLOCK].reshape(-1, _BLOCK).mean(axis=1)
    lasting = float((means**2).sum()) / max(len(means) - followed, 1)
    return max(scatter(off, 0.0) ** 2 - _CHANCE * usual, _LASTING * (_BLOCK * lasting - _CHANCE * usual))
