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
  bearing. Covers lie above the cable and are seen too far out by a share of their distance from the middle of the
  picture, the same share at both ends: one nuisance along the chord, one across it.

On path-traced photos at 5 to 16 px/mm the first takes a third off the errors of the last 10 mm, the second a twentieth;
axes known without error would take off half. As the penalty of the whole fit the bow would take off another twentieth
and pull the seen part toward a straight law: characteristics of bent laws by the balance came out up to 1.8 times as
far off.

Lengths in m, chord frame, ``kappa = d theta / ds`` in its axes. Source: the update is that of Kalman (1960); the
elastica Love (1927), Treatise on the Mathematical Theory of Elasticity, art. 262.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import BSpline

from pipeline.records import Array
from pipeline.settings.vision.centerline import CurveSettings
from pipeline.vision.centerline.curvature import DEGREE, PlaneCurve
from pipeline.vision.centerline.curve_fit import CurveFit, rms_of_bow
from pipeline.vision.rough import AxisKind
from pipeline.vision.scale.chord import ChordFrame

_PLACES = 60  # along the seen part: the curvature has about ten degrees of freedom there


def continue_to_axes(
    fit: CurveFit,
    covariance: Array,
    chord: ChordFrame,
    *,
    kinds: tuple[AxisKind, AxisKind],
    width: float,
    settings: CurveSettings,
) -> tuple[CurveFit, Array]:
    """Curve and covariance ``(p, p)`` of its parameters with what is known of the unseen ends.

    Parameters
    ----------
    fit : CurveFit
    covariance : (p, p)
        Of the curve's parameters, the light's errors included.
    chord : ChordFrame
    kinds : pair of str
        Of the axes: a visible end is put where the cable is seen to end and tells nothing more.
    width : m
        Of the cable.
    """
    rows, values, noise = _bow_at_ends(fit, covariance, settings.least_departure)
    if set(kinds) <= {"cover", "given"}:
        by_axes = _axes(fit, chord, settings.axis_play_widths * width)
        rows, values = np.vstack([rows, by_axes[0]]), np.concatenate([values, by_axes[1]])
        noise = np.block([[noise, np.zeros((2, 2))], [np.zeros((2, 2)), by_axes[2]]])
    # The second derivatives and the distances differ by orders of magnitude.
    size = np.sqrt(np.diag(noise))
    rows, values, noise = rows / size[:, None], values / size, noise / np.outer(size, size)
    shared = covariance @ rows.T
    gain = np.linalg.solve(rows @ shared + noise, shared.T).T
    kept = np.eye(len(covariance)) - gain @ rows
    updated = kept @ covariance @ kept.T + gain @ noise @ gain.T
    return replace(fit, curve=fit.curve.moved(gain @ values)), updated


def _bow_at_ends(fit: CurveFit, covariance: Array, least: float) -> tuple[Array, Array, Array]:
    """Rows, values and noise of the departure from a bow at both ends: as along the seen part."""
    curve = fit.curve
    first, last = (float(np.quantile(fit.s, share)) for share in (0.1, 0.9))
    a, b = _pull(curve, np.linspace(fit.s[0], fit.s[-1], _PLACES))
    along = _departure(curve, np.linspace(first, last, _PLACES), a, b)
    usual = along.mean(axis=0)
    off = along - usual
    variance = np.maximum(((off @ covariance[2:, 2:]) * off).sum(axis=1), 0.0)
    seen = float(np.mean((off @ curve.coefficients) ** 2 - variance))
    rows = np.zeros((2, curve.frame.size))
    rows[:, 2:] = _departure(curve, curve.frame.knots[[0, -1]], a, b) - usual
    values = -rows[:, 2:] @ curve.coefficients
    return rows, values, np.eye(2) * max(seen, (least * rms_of_bow(curve, 2)) ** 2)


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


def _axes(fit: CurveFit, chord: ChordFrame, play: float) -> tuple[Array, Array, Array]:
    """Rows, values and noise of the distances of both axes from the curve, along its normals."""
    curve = fit.curve
    feet = curve.foot(chord.axes, np.array([0.0, curve.frame.knots[-1]]))
    where, angle = curve.at(feet)
    normal = np.column_stack([-np.sin(angle), np.cos(angle)])
    rows = curve.normal_basis(feet)
    values = ((chord.axes - where) * normal).sum(axis=1)
    # Apart along the chord, together across it; the middle of the picture lies beside the chord by half of its half.
    outward = 0.5 * chord.axis_parallax_std * chord.chord
    common = normal * np.array([[-outward, 0.5 * outward], [outward, 0.5 * outward]])
    return rows, values, np.eye(2) * (chord.axis_std**2 + play**2) + common @ common.T
