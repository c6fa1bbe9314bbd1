"""Centerlines of a given curvature, integrated here."""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.vision.render import Curve

NODES = 2001


def of_curvature(kappa: Callable[[np.ndarray], np.ndarray] | float, length: float) -> Curve:
    """Curve of a curvature kappa(s), 1/m, its ends on the x axis, positive curvature bending toward y.

    The tangent angle falls along s where the bow is positive: x' = cos theta, y' = sin theta, theta' = -kappa. It is
    integrated by the spline through the nodes, the position by Gauss points on it.
    """
    s = np.linspace(0.0, length, NODES)
    values = np.broadcast_to(np.asarray(kappa(s) if callable(kappa) else kappa, dtype=float), s.shape)
    angle = CubicSpline(s, values).antiderivative()
    nodes, weights = np.polynomial.legendre.leggauss(4)
    h = s[1] - s[0]
    inner = angle(s[:-1, None] + 0.5 * h * (nodes + 1.0))
    x = np.concatenate([[0.0], np.cumsum(0.5 * h * np.cos(inner) @ weights)])
    y = np.concatenate([[0.0], np.cumsum(-0.5 * h * np.sin(inner) @ weights)])
    lift = -np.arctan2(y[-1], x[-1])
    c, q = np.cos(lift), np.sin(lift)
    return Curve(s, c * x - q * y, q * x + c * y, lift - angle(s), values.copy())
