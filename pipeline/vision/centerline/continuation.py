"""What is known of a fitted curve where nothing of it is seen: under the covers, up to the bearing axes.

The penalty alone continues the curvature there as a parabola whose coefficients the last seen sections tell badly. Two
things more are known, and both go in as measurements with their own uncertainty, whatever the cable's law:

- Under a cover the curve is the bow that it is where the cable is seen. Between its bearings a cable carries no load,
  so its moment obeys ``m' = -F sin(theta - phi)``, with one force F in one direction phi whatever the bearings bring
  in; of a law that is straight ``kappa' = -(a sin theta + b cos theta)`` with two constants of the photo, whatever its
  K0. Other laws, K0 and stiffness that vary and loads depart from it. By ``kappa'' + (a cos theta - b sin theta)
  kappa`` they show how far along the seen part; at the ends it is within the rms of that (its noise taken off) of its
  mean, and never surer than a share of the ``kappa''`` of a half wave with the curve's amplitude. Neither ``kappa`` nor
  its slope is held.
- The cable passes through the bearing axes, as far as these are known: as found, with the play of a cable in its
  bearing. Covers lie above the cable and are seen too far out by a share of their distance from the camera's foot, the
  same share at both ends. What of that is common to the photos of a series they tell together
  (`pipeline.vision.centerline.axes_of_series`).

Lengths in m, chord frame, ``kappa = d theta / ds`` in its axes. Source: the update is that of Kalman (1960); the
elastica Love (1927), Treatise on the Mathematical Theory of Elasticity, art. 262.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import BSpline

from pipeline.records import Array
from pipeline.vision.centerline.axes_of_series import AxesTold, AxisSight, told_alone
from pipeline.vision.centerline.curvature import DEGREE, PlaneCurve, normals
from pipeline.vision.centerline.curve_fit import CurveFit, rms_of_bow
from pipeline.vision.median import quantile
from pipeline.vision.scale.plane import ChordFrame

_END_WIDTHS = 0.25  # widths; how far aside of the cable's middle the search puts a visible end: a corner of its mask
_PLACES = 60  # along the seen part: the curvature has about ten degrees of freedom there
_LEAST_DEPARTURE = 0.25
"""Of the second derivative of a half wave; so far the curvature under a cover may depart from the bow of a straight law
however well the seen part keeps to it: with 1 the last 10 mm of path-traced photos were off by 4.1 % of kappa_max,
with 0.25 by 3.6 %, with 0.1 no better, and the bands of all cover.
"""
_AXIS_PLAY_WIDTHS = 0.02
"""Widths; how far a cable sits beside its bearing's axis: 0.1 mm on 5 mm, the play of a sheath in a bore made for it.
"""


def continue_to_axes(
    fit: CurveFit,
    covariance: Array,
    chord: ChordFrame,
    *,
    width: float,
    told: AxesTold | None = None,
) -> tuple[CurveFit, Array]:
    """Curve and covariance ``(p, p)`` of its parameters with what is known of the unseen ends.

    Parameters
    ----------
    covariance : (p, p)
        Of the curve's parameters, the light's errors included.
    width : m
        Of the cable.
    told : AxesTold, optional
        What the other photos of the series tell of how the cable passes the axes.
    """
    rows, values, noise = _bow_at_ends(fit, covariance)
    past, misses, across = _axes(fit, chord)
    if chord.marked:
        if told is None:
            told = told_alone(_sight(misses, np.eye(2), across, chord, width))
        shift, loose = told.shift, told.covariance + chord.axis_std**2 * np.eye(2)
    else:  # a visible end tells roughly where the curve ends, where its last sections are lost
        shift, loose = np.zeros(2), (_END_WIDTHS * width) ** 2 * np.eye(2)
    rows, values = np.vstack([rows, past]), np.concatenate([values, misses - shift])
    noise = np.block([[noise, np.zeros((2, 2))], [np.zeros((2, 2)), loose]])
    step, updated = _updated(covariance, rows, values, noise)
    return replace(fit, curve=fit.curve.moved(step)), updated


def sight_of_axes(fit: CurveFit, covariance: Array, chord: ChordFrame, *, width: float) -> AxisSight | None:
    """How the curve continued as a bow passes the axes, as above.

    None where these are its own ends, or where the fit is not finite.
    """
    if not chord.marked:
        return None
    step, covariance = _updated(covariance, *_bow_at_ends(fit, covariance))
    rows, misses, across = _axes(fit, chord)
    loose = rows @ covariance @ rows.T + chord.axis_std**2 * np.eye(2)
    if not (np.isfinite(misses).all() and np.isfinite(loose).all()):
        return None  # what broke on one photo shall not reach the others
    return _sight(misses - rows @ step, loose, across, chord, width)


def _sight(misses: Array, covariance: Array, across: Array, chord: ChordFrame, width: float) -> AxisSight:
    places, play = chord.origin + chord.axes @ chord.rotation, _AXIS_PLAY_WIDTHS * width
    return AxisSight(misses, covariance, places, across @ chord.rotation, chord.axis_parallax_std, play)


def _updated(covariance: Array, rows: Array, values: Array, noise: Array) -> tuple[Array, Array]:
    """Step ``(p,)`` of the parameters and their covariance by measurements ``rows q = values`` with their noise."""
    # The second derivatives and the distances differ by orders of magnitude.
    size = np.sqrt(np.diag(noise))
    rows, values, noise = rows / size[:, None], values / size, noise / np.outer(size, size)
    shared = covariance @ rows.T
    gain = np.linalg.solve(rows @ shared + noise, shared.T).T
    kept = np.eye(len(covariance)) - gain @ rows
    return gain @ values, kept @ covariance @ kept.T + gain @ noise @ gain.T


def _bow_at_ends(fit: CurveFit, covariance: Array) -> tuple[Array, Array, Array]:
    """Rows, values and noise of the departure from a bow at both ends: as along the seen part."""
    curve = fit.curve
    first, last = (quantile(fit.s, share) for share in (0.1, 0.9))
    a, b = _pull(curve, np.linspace(fit.s[0], fit.s[-1], _PLACES))
    along = _departure(curve, np.linspace(first, last, _PLACES), a, b)
    usual = along.mean(axis=0)
    off = along - usual
    variance = np.maximum(((off @ covariance[2:, 2:]) * off).sum(axis=1), 0.0)
    seen = float(np.mean((off @ curve.coefficients) ** 2 - variance))
    rows = np.zeros((2, curve.frame.size))
    rows[:, 2:] = _departure(curve, curve.frame.knots[[0, -1]], a, b) - usual
    values = -rows[:, 2:] @ curve.coefficients
    return rows, values, np.eye(2) * max(seen, (_LEAST_DEPARTURE * rms_of_bow(curve, 2)) ** 2)


def _departure(curve: PlaneCurve, s: Array, a: float, b: float) -> Array:
    """Rows ``(n, J)`` of ``kappa'' + (a cos theta - b sin theta) kappa``: zero for a bow of a straight law."""
    splines = BSpline(curve.frame.knots, np.eye(curve.frame.size - 2), DEGREE)
    theta = curve.at(s)[1]
    return np.asarray(splines(s, nu=2) + (a * np.cos(theta) - b * np.sin(theta))[:, None] * splines(s))


def _pull(curve: PlaneCurve, s: Array) -> tuple[float, float]:
    """The constants ``(a, b)`` of a bow by least squares at ``s``, at most those of one with a full wave in it.

    Its force would be four times the one at which a cable between bearings gives way: on a cable nearly straight it
    would be the noise that is fitted.
    """
    theta = curve.at(s)[1]
    slope = BSpline(curve.frame.knots, curve.coefficients, DEGREE)(s, nu=1)
    found = np.linalg.lstsq(-np.column_stack([np.sin(theta), np.cos(theta)]), slope, rcond=None)[0]
    most, size = (2.0 * np.pi / np.ptp(curve.frame.knots)) ** 2, float(np.hypot(*found))
    a, b = found * (most / size if size > most else 1.0)
    return float(a), float(b)


def _axes(fit: CurveFit, chord: ChordFrame) -> tuple[Array, Array, Array]:
    """Rows ``(2, p)`` and values ``(2,)`` of the axes' distances from the curve along its normals, and these (2, 2)."""
    curve = fit.curve
    feet = curve.foot(chord.axes, np.array([0.0, curve.frame.knots[-1]]))
    where, angle = curve.at(feet)
    across = normals(angle)
    return curve.normal_basis(feet), ((chord.axes - where) * across).sum(axis=1), across
