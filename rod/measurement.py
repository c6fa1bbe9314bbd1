"""What the bending test tells the mechanics: one record per displacement step, SI units, no pixels.

Axes: the chord frame. Origin at the left bearing axis, x along the line through both axes, y toward the bow, so the
curvature of a cable bent to its natural side is positive. Force ``P`` along the chord, positive in compression.

Both ways to the bending stiffness characteristic read these records and nothing else of each other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rod.array import Array

SlowErrors = tuple[tuple[float, float], ...]
"""Standard deviation and correlation length of errors that no averaging of neighbours reduces."""


def slow_covariance(s: Array, errors: SlowErrors) -> Array:
    """Covariance (k, k) at arc lengths (k,) of errors with correlation ``exp(-ds^2 / (2 length^2))``."""
    apart = s[:, None] - s[None, :]
    total = np.zeros_like(apart)
    for std, length in errors:
        if std > 0.0:
            total += std**2 * np.exp(-0.5 * (apart / max(length, 1e-12)) ** 2)
    return np.asarray(total)


@dataclass(frozen=True)
class MeasuredShape:
    """A centerline in the chord frame, as measured on one photo.

    The curve ``x(s), y(s), theta(s), kappa(s)`` on ``n`` points is the smooth estimate of the vision stage. Its errors
    are linear in ``p`` parameters with joint covariance: ``d normal = basis_normal @ dq`` and so on, where "normal"
    is the displacement along the normal ``(-sin theta, cos theta)``.
    The ``k`` sections are the raw midline points of the visible cable, before smoothing.

    Attributes
    ----------
    s, x, y : (n,) m
        Arc length from the left bearing axis and position.
    theta : (n,) rad
    kappa : (n,) 1/m
    seen : (n,) bool
        False where the cable lies under a bearing cover and was extended by the model.
    basis_normal : (n, p) m, basis_theta : (n, p) rad, basis_kappa : (n, p) 1/m
        Derivatives with respect to the parameters q of the curve.
    covariance : (p, p)
        Of q, systematic part included.
    section_s, section_x, section_y : (k,) m
        Raw midline points.
    section_std : (k,) m
        Standard deviation of a section along the normal, correlated along s.
    correlation_length : m
        Of the section errors: correlation exp(-ds / correlation_length).
    systematic_std : m
        Slowly varying sideways error common to neighbouring sections (light), not reduced by averaging.
    systematic_length : m
        Its correlation length along s.
    wave_std, wave_length : m
        The same of waves that a textured ground makes along the edges: longer than `correlation_length`, shorter than
        a bend of the cable; 0 where there are none.
    common_std : m
        Of waves of that length which are the same at the same s on all photos of a test: print on the sheath, the
        ground below the end that stands still.
    """

    s: Array
    x: Array
    y: Array
    theta: Array
    kappa: Array
    seen: NDArray[np.bool_]
    basis_normal: Array
    basis_theta: Array
    basis_kappa: Array
    covariance: Array
    section_s: Array
    section_x: Array
    section_y: Array
    section_std: Array
    correlation_length: float
    systematic_std: float
    systematic_length: float
    wave_std: float = 0.0
    wave_length: float = 0.0
    common_std: float = 0.0

    @property
    def slow(self) -> SlowErrors:
        """Standard deviation and correlation length (m) of the light's error and of all waves of one photo."""
        waves = float(np.hypot(self.wave_std, self.common_std))
        return (self.systematic_std, self.systematic_length), (waves, self.wave_length)

    def at(self, s: Array) -> tuple[Array, Array, Array]:
        """x, y (m) and theta (rad) of the smooth curve at arc lengths (b,) m; cubic Hermite between its points."""
        from scipy.interpolate import CubicHermiteSpline  # takes half a second, and most who hold a record ask for none

        x, y = (
            np.asarray(CubicHermiteSpline(self.s, v, slope)(s))
            for v, slope in ((self.x, np.cos(self.theta)), (self.y, np.sin(self.theta)))
        )
        return x, y, np.interp(s, self.s, self.theta)

    def section_offsets(self) -> Array:
        """Distance of the sections from the smooth curve along its normal, (k,) m."""
        x, y, theta = self.at(self.section_s)
        return np.asarray(-np.sin(theta) * (self.section_x - x) + np.cos(theta) * (self.section_y - y))


@dataclass(frozen=True)
class MeasuredStep:
    """Force, displacement and shape of one displacement step.

    Attributes
    ----------
    step : int
        Number in the force log.
    branch : str
        ``mounted``, ``loading`` or ``unloading``.
    displacement : m or None
        By the log, from the mounted position.
    displacement_std : m or None
        How far the log scatters there; None where it does not tell, as with one sample or a setpoint.
    force, force_std : N
        At the time of the photo; compression positive.
    chord, chord_std : m or None
        Distance of the bearing axes by the photo, and its standard deviation without the common scale error.
    shape : MeasuredShape or None
        None if the photo was rejected or is missing; the force still counts.
    time : s or None
        Of the photo, same clock as ``hold_times``.
    hold_times : (h,) s or None
        Times of the force samples of this hold; None where the log has no time.
    hold_forces : (h,) N or None
        The force samples of this hold (compression positive); relaxation and drift are read from them.
    picture_centre : (x, y) m or None
        Where the centre of the picture lies in the chord frame of this photo: lens distortion and camera tilt are
        counted from there.
    picture : str or None
        What the file of the photo holds, such as its hash: steps with the same have one and the same photo.
    chord_by_log : bool
        The photo shows only one axis: the one that moves was put where it is by the displacement of the log, so the
        chord is as wrong as that, and with it the frame of the shape.
    """

    step: int
    branch: str
    displacement: float | None
    force: float
    force_std: float
    chord: float | None = None
    chord_std: float | None = None
    shape: MeasuredShape | None = None
    time: float | None = None
    hold_times: Array | None = None
    hold_forces: Array | None = None
    picture_centre: tuple[float, float] | None = None
    displacement_std: float | None = None
    picture: str | None = None
    chord_by_log: bool = False

    @property
    def samples(self) -> Array:
        """The force samples of the hold, or the one force where there are none, (h,) N."""
        return np.array([self.force]) if self.hold_forces is None else self.hold_forces


@dataclass(frozen=True)
class MeasuredTest:
    """A whole bending test.

    Attributes
    ----------
    length : m
        Cable length between the bearing axes.
    length_std : m
    scale_std : relative
        Common to all photos: every length on the photos may be off by this factor.
    axis_std : m
        Of each coordinate of a bearing axis, common to all photos: what is found as the axis is off the pin by this.
    axis_parallax_std : relative
        Common to all photos: what marks an axis lies by a height h above the cable and is seen farther from the foot of
        the camera than it is by h / distance of the way.
    camera_foot_std : m
        Of the camera's foot, either coordinate, about the centre of the picture.
    steps : tuple of MeasuredStep
        In the order of the test.
    moving : str
        ``left`` or ``right``: the bearing that is pushed.
    picture_half_diagonal : m or None
        Half the diagonal of the picture on the plane of the cable.
    common_force_errors : tuple of mappings of step number -> N
        Errors that forces of several steps have in common, beside ``force_std``: each one standard deviation, and
        independent of the others. What is left of a fault that was corrected.
    """

    length: float
    length_std: float
    scale_std: float
    steps: tuple[MeasuredStep, ...]
    moving: str = "left"
    picture_half_diagonal: float | None = None
    axis_std: float = 0.0
    axis_parallax_std: float = 0.0
    camera_foot_std: float = 0.0
    common_force_errors: tuple[Mapping[int, float], ...] = ()
