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
from scipy.special import erf

from pipeline.records import Array

_CORNER_STEP_PX = 1e-3  # px; a tenth of what noise leaves at best
_ROUNDS = 15
_CORNER_REACH = 0.4  # squares; how far from a corner its edges are fitted: before the next corner's
_CORNER_MARGIN = 0.9  # share of the white margin beside a ChArUco marker; the rest is the marker's blur
_CORNER_REACH_PX = 20.0  # px; longer edges hardly help, and a lens bends them: 1 % of barrel by 0.005 px over 20 px
_CORNER_PIXELS = 36  # pixels; nine unknowns of a corner, each from four
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
    square = float(np.hypot(*cell).min())
    if len(value) < _CORNER_PIXELS:
        return lost
    at = start.copy()
    turn = np.arctan2(cell[1], cell[0])
    log_sigma = float(np.log(_CORNER_BLUR_PX))
    for _ in range(_ROUNDS):
        slopes, linear = _linearised(place - at, turn, float(np.exp(log_sigma)))
        amount, *_ = np.linalg.lstsq(linear, value, rcond=None)
        left = value - linear @ amount
        step, *_ = np.linalg.lstsq(np.column_stack([amount[1] * slopes, linear]), left, rcond=None)
        # half of the blur at a time: beyond it the edge's slope says nothing about how far the edge is
        move = np.clip(step[:2], -1.0, 1.0)
        at, turn = at + move, turn + np.clip(step[2:4], -0.1, 0.1)
        log_sigma += float(np.clip(step[4], -0.5, 0.5))
        if np.abs(move).max() < _CORNER_STEP_PX:
            break
    clear = abs(amount[1]) > _CORNER_CONTRAST * float(np.std(left))
    stayed = np.hypot(*(at - start)) < _CORNER_MOVE * square and np.exp(log_sigma) < _CORNER_REACH * square
    return at if clear and stayed and np.abs(move).max() < 10.0 * _CORNER_STEP_PX else lost


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


def _linearised(d: Array, turn: Array, sigma: float) -> tuple[Array, Array]:
    """Slopes ``(n, 5)`` of the product of both edges by corner, directions, log sigma; its linear terms ``(n, 4)``."""
    along = np.stack([np.cos(turn), np.sin(turn)])
    normal = np.stack([-along[1], along[0]])
    t = d @ normal / sigma
    edge = np.asarray(erf(t / np.sqrt(2.0)), np.float64)
    rise = np.sqrt(2.0 / np.pi) * np.exp(-0.5 * t * t) * edge[:, ::-1]
    slopes = np.column_stack([-(rise @ normal.T) / sigma, -rise * (d @ along) / sigma, -(rise * t).sum(axis=1)])
    return slopes, np.column_stack([np.ones(len(d)), edge[:, 0] * edge[:, 1], d])
