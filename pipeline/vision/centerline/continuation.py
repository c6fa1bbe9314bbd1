"""What is known of a fitted curve where nothing of it is seen: under the covers, up to the bearing axes.

The penalty alone continues the curvature there as a parabola whose coefficients the last seen sections tell badly. Two
things more are known, and both go in as measurements with their own uncertainty, whatever the cable's law:

- The curvature bends under a cover as it does where the cable is seen: ``kappa''`` at the ends is zero within the rms
  of ``kappa''`` along the seen part (its noise taken off), and never surer than that of a half wave from end to end
  with the curve's amplitude. Neither ``kappa`` nor its slope is held.
- The cable passes through the bearing axes, as far as these are known: as found, with the play of a cable in its
  bearing. Covers lie above the cable and are seen too far out by a share of their distance from the middle of the
  picture, the same share at both ends: one nuisance along the chord, one across it.

On path-traced photos at 8 px/mm the first took a quarter off the errors of the last 10 mm, the second another tenth;
axes known without error would take off half.

Lengths in m, chord frame; source: the update is that of Kalman (1960).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import BSpline

from pipeline.records import Array
from pipeline.settings.vision.centerline import CurveSettings
from pipeline.vision.centerline.curvature import DEGREE
from pipeline.vision.centerline.curve_fit import CurveFit, rms_of_bow
from pipeline.vision.rough import AxisKind
from pipeline.vision.scale.chord import ChordFrame


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
    rows, values, noise = _calm_ends(fit, covariance)
    if set(kinds) <= {"cover", "given"}:
        outward = settings.outward_std if "cover" in kinds else 0.0
        by_axes = _axes(fit, chord, settings.axis_play_widths * width, outward)
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


def _calm_ends(fit: CurveFit, covariance: Array) -> tuple[Array, Array, Array]:
    """Rows, values and noise of ``kappa''`` at both ends: zero within what it is along the seen part."""
    curve = fit.curve
    knots = curve.frame.knots
    first, last = (float(np.quantile(fit.s, share)) for share in (0.1, 0.9))
    spline = BSpline(knots, np.eye(curve.frame.size - 2), DEGREE)
    along = spline(np.linspace(first, last, 60), nu=2)
    variance = np.maximum(((along @ covariance[2:, 2:]) * along).sum(axis=1), 0.0)
    seen = float(np.mean((along @ curve.coefficients) ** 2 - variance))
    rows = np.zeros((2, curve.frame.size))
    rows[:, 2:] = spline(knots[[0, -1]], nu=2)
    values = -rows[:, 2:] @ curve.coefficients
    return rows, values, np.eye(2) * max(seen, rms_of_bow(curve, 2) ** 2)


def _axes(fit: CurveFit, chord: ChordFrame, play: float, outward: float) -> tuple[Array, Array, Array]:
    """Rows, values and noise of the distances of both axes from the curve, along its normals."""
    curve = fit.curve
    feet = curve.foot(chord.axes, np.array([0.0, curve.frame.knots[-1]]))
    where, angle = curve.at(feet)
    normal = np.column_stack([-np.sin(angle), np.cos(angle)])
    rows = curve.normal_basis(feet)
    values = ((chord.axes - where) * normal).sum(axis=1)
    # Apart along the chord, together across it; the middle of the picture lies beside the chord by half of its half.
    outward = 0.5 * outward * chord.chord
    common = normal * np.array([[-outward, 0.5 * outward], [outward, 0.5 * outward]])
    return rows, values, np.eye(2) * (chord.axis_std**2 + play**2) + common @ common.T
