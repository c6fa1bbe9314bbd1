"""What scale, tilt and lens leave open of the curvature: one error for all photos, not seen in the scatter of any.

A scale too large by a share d makes every curvature too large by d (the cable seems smaller). Where the plane was
fitted to a board, its maps one standard deviation aside along each principal direction of the fit's covariance tell
the rest: each bends the path of the cable by an amount of its own,

``var(kappa) = var by scatter and light + (std_uniform kappa)^2 + sum_i (kappa(map_i) - kappa(map))^2``

Units: SI; pixels of the photo as displayed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.records import Array, Centerline
from pipeline.vision.scale.calibration import Calibration
from pipeline.vision.scale.plane import PlaneMap


def with_doubt_of_plane(line: Centerline, calibration: Calibration) -> Centerline:
    """The line with the errors of its scale and plane in the band of its curvature.

    Parameters
    ----------
    line : Centerline
        ``kappa_std`` by what its own photo tells.
    calibration : Calibration
        With which it was measured.
    """
    uv = np.column_stack([line.u_px, line.v_px])
    kappa = _curvature(uv, line.shape.s, calibration.plane)
    variance = (calibration.uniform_std * line.shape.kappa) ** 2
    for aside in calibration.aside:
        variance += (_curvature(uv, line.shape.s, aside) - kappa) ** 2
    return replace(line, kappa_std=np.sqrt(line.kappa_std**2 + variance))


def _curvature(uv: Array, s: Array, plane: PlaneMap) -> Array:
    """Curvature ``(n,)`` on the plane of a smooth path of pixels ``(n, 2)`` given at ``s``."""
    path = CubicSpline(s, plane.to_plane(uv))
    (dx, dy), (ddx, ddy) = path(s, 1).T, path(s, 2).T
    return np.asarray((dx * ddy - dy * ddx) / np.hypot(dx, dy) ** 3)
