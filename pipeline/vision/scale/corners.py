"""Corners of a chessboard to a hundredth of a pixel: the crossing of two blurred edges, fitted to the grey values.

About each corner, in board axes ``a, b`` (in squares), the picture is

``z = c0 + c1 erf(n1 . d / (sqrt(2) sigma)) erf(n2 . d / (sqrt(2) sigma)) + c2 . d``,   ``d = (u, v) - corner``,

two edges of free direction (normals n1, n2) blurred alike, an even slope of light on top. Gauss-Newton over the corner,
both directions and sigma; the c are linear. A tone curve and spread ink change both pairs of opposite squares alike and
leave the crossing where it is. All pixels along the edges speak, so that white noise of standard deviation s leaves

``std(corner) = s / (2 |c1|) sqrt(2 sqrt(pi) sigma / length)``

with ``length`` the length of edge in the window that is normal to the coordinate (same limit as for an edge of the
cable): 0.005 px where finders by gradients or by a response leave 0.03 to 0.15 px.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares
from scipy.special import erf

from pipeline.records import Array

_CORNER_REACH = 0.4  # squares; how far from a corner its edges are fitted: before the next corner's
_CORNER_MARGIN = 0.9  # share of the white margin beside a ChArUco marker; the rest is the marker's blur
_CORNER_REACH_PX = 20.0  # px; longer edges hardly help, and a lens bends them: 1 % of barrel by 0.005 px over 20 px
_CORNER_BLUR_PX = 1.5  # px; blur at the start, wide enough to reach the edge from a pixel
_CORNER_CONTRAST = 2.0  # half the step from black to white over the rms that the fit leaves; noise of 10 % has 4
_CORNER_MOVE = 0.15  # squares; a corner found farther from its start is another thing


def refine_corners(grey: Array, uv: Array, cells: Array, marker_share: float = 0.0) -> Array:
    """Corners fitted to the picture.

    Parameters
    ----------
    grey : (h, w)
        Picture.
    uv : (n, 2) px
        Corners as a finder gives them, good to a few pixels.
    cells : (n, 2, 2) px
        Columns: what one square along a and along b is on the picture at each corner.
    marker_share : float
        Of a square, width of the markers of a ChArUco board: a cross along the edges is used, beside them.

    Returns
    -------
    (n, 2) px
        NaN where the picture shows no such crossing.
    """
    margin = _CORNER_MARGIN * 0.5 * (1.0 - marker_share)
    return np.array([_refined(grey, at, cell, margin) for at, cell in zip(uv, cells, strict=True)])


def _refined(grey: Array, start: Array, cell: Array, margin: float) -> Array:
    lost = np.full(2, np.nan)
    place, value = _pixels(grey, start, cell, margin)
    if len(value) < 36:  # nine unknowns of a corner, each from four pixels
        return lost

    def fitted(x: Array) -> tuple[Array, float]:
        """Residuals ``(n,)`` and c1 for a corner, directions of its edges, and log sigma."""
        d, normal = place - x[:2], np.stack([-np.sin(x[2:4]), np.cos(x[2:4])])
        edge = erf(d @ normal / (np.sqrt(2.0) * np.exp(x[4])))
        linear = np.column_stack([np.ones(len(d)), edge.prod(axis=1), d])
        amount = np.linalg.solve(linear.T @ linear + 1e-9 * np.eye(4), linear.T @ value)
        return value - linear @ amount, float(amount[1])

    def misfit(x: Array) -> Array:
        return fitted(x)[0]

    guess = np.array([*start, *np.arctan2(cell[1], cell[0]), np.log(_CORNER_BLUR_PX)])
    # what a further step would gain is a hundredth of what noise leaves
    fit = least_squares(misfit, guess, method="lm", ftol=1e-4)
    left, step = fitted(fit.x)
    square = float(np.hypot(*cell).min())
    clear = abs(step) > _CORNER_CONTRAST * float(np.std(left))
    stayed = np.hypot(*(fit.x[:2] - start)) < _CORNER_MOVE * square and np.exp(fit.x[4]) < _CORNER_REACH * square
    return np.asarray(fit.x[:2]) if fit.success and clear and stayed else lost


def _pixels(grey: Array, start: Array, cell: Array, margin: float) -> tuple[Array, Array]:
    """Places ``(n, 2)`` and values ``(n,)`` of the pixels about a corner, ``margin`` squares from an edge at most."""
    sides = np.hypot(*cell)
    reach = np.minimum(_CORNER_REACH, _CORNER_REACH_PX / sides)
    extent = np.ceil(np.abs(cell) @ reach).astype(int)
    low = np.maximum(np.round(start).astype(int) - extent, 0)
    high = np.minimum(np.round(start).astype(int) + extent, np.array(grey.shape[::-1]) - 1)
    if np.any(high < low):
        return np.empty((0, 2)), np.empty(0)
    v, u = np.mgrid[low[1] : high[1] + 1, low[0] : high[0] + 1]
    place = np.column_stack([u.ravel(), v.ravel()]).astype(np.float64)
    ab = np.abs((place - start) @ np.linalg.inv(cell).T)
    inside = (ab < reach).all(axis=1) & (ab.min(axis=1) < margin)
    place = place[inside]
    return place, np.asarray(grey[place[:, 1].astype(int), place[:, 0].astype(int)], np.float64)
