"""The camera of the rendered photos: plane of the cable axis (metres) to pixels and back.

Axes: table plane (X, Y) in m; picture u to the right, v down, pixel (0, 0) is the centre of the top-left pixel.
The map is, in this order,

1. look-at and roll: (X, Y) minus the point looked at, turned by ``roll_rad`` (a positive roll turns the cable from u
   toward v), Y mirrored if ``mirrored``; now the axes are those of the picture;
2. pinhole with tilt: (X, Y) -> A (X, Y) / (1 + gx X + gy Y), the perspective terms g in 1/m. At a finite camera
   distance D the tilt angle is asin(|g| D) and A holds its foreshortening (a true rotation about the point looked at);
   at infinite distance A = 1;
3. scale: px per metre, right at the point looked at and at the height of the cable axis;
4. lens: r -> r (1 + k1 (r / R)^2), R half the picture's diagonal; k1 < 0 is a barrel.

Every step is inverted exactly (the radial cubic by Newton's method to rounding), so that the truth of a rendered photo
is the camera's own and never traced from a picture.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot, inf, isinf, pi, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """Size, pose and lens of a camera above the table.

    Attributes
    ----------
    width, height : int px
    px_per_m : float
        On the plane of the cable axis, at the point looked at.
    look_at_m : (X, Y) m
        Table point in the middle of the picture.
    roll_rad : float
    mirrored : bool
        The bow (positive Y) points up on the picture instead of down.
    k1 : float
        Relative radial displacement at half the picture's diagonal.
    perspective_per_m : (gx, gy) 1/m
        In picture axes: gx along u, gy along v.
    distance_m : float
        Camera to the plane of the cable axis; ``inf`` for a picture without parallax.
    """

    width: int = 2448
    height: int = 1000
    px_per_m: float = 10_500.0
    look_at_m: tuple[float, float] = (0.09, 0.03)
    roll_rad: float = 0.0
    mirrored: bool = False
    k1: float = 0.0
    perspective_per_m: tuple[float, float] = (0.0, 0.0)
    distance_m: float = inf

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1 or not self.px_per_m > 0 or not self.distance_m > 0:
            raise ValueError("a camera needs a positive size, scale and distance")
        if self.k1 <= -1 / 3:
            raise ValueError(f"k1 = {self.k1} folds the picture: r (1 + k1 (r/R)^2) must grow up to the corner")
        if not isinf(self.distance_m) and hypot(*self.perspective_per_m) * self.distance_m >= 1:
            raise ValueError("perspective terms beyond a tilt of 90 degrees")

    @property
    def half_diagonal_px(self) -> float:
        """Distance from the middle to a corner, the unit of the lens distortion."""
        return 0.5 * hypot(self.width, self.height)

    def turned(self, quarter_turns: int) -> Camera:
        """Turn the camera by multiples of 90 degrees; the picture's sides swap with odd ones."""
        odd = quarter_turns % 2 == 1
        return replace(
            self,
            width=self.height if odd else self.width,
            height=self.width if odd else self.height,
            roll_rad=self.roll_rad + quarter_turns * pi / 2,
        )

    def homography(self, height_m: float = 0.0) -> Array:
        """Matrix (3, 3) from table plane at ``height_m`` above the cable axis to pixels before the lens distortion.

        Homogeneous; pixels count from the middle of the picture.
        """
        c, s = np.cos(self.roll_rad), np.sin(self.roll_rad)
        flip = -1.0 if self.mirrored else 1.0
        pose = np.array([[c, -s * flip, 0.0], [s, c * flip, 0.0], [0.0, 0.0, 1.0]])
        shift = np.array([[1.0, 0.0, -self.look_at_m[0]], [0.0, 1.0, -self.look_at_m[1]], [0.0, 0.0, 1.0]])
        return np.asarray(np.diag([self.px_per_m, self.px_per_m, 1.0]) @ self._pinhole(height_m) @ pose @ shift)

    def _pinhole(self, height_m: float) -> Array:
        gx, gy = self.perspective_per_m
        if isinf(self.distance_m):
            return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [gx, gy, 1.0]])
        # Smallest rotation whose third row is (a, b, c): its upper block is 1 - (a, b)(a, b)^T / (1 + c).
        D = self.distance_m
        a, b = gx * D, gy * D
        c = sqrt(1.0 - a * a - b * b)
        return np.array(
            [
                [1.0 - a * a / (1 + c), -a * b / (1 + c), a * height_m],
                [-a * b / (1 + c), 1.0 - b * b / (1 + c), b * height_m],
                [gx, gy, 1.0 - c * height_m / D],
            ]
        )

    def project(self, X: ArrayLike, Y: ArrayLike, *, height_m: float = 0.0) -> tuple[Array, Array]:
        """Pixels of table points (m), lens and tilt included."""
        U, V, W = np.tensordot(self.homography(height_m), _homogeneous(X, Y), axes=1)
        return self.distort(U / W, V / W)

    def distort(self, du: ArrayLike, dv: ArrayLike) -> tuple[Array, Array]:
        """Pixels (as counted in the picture) of undistorted pixels counted from the middle."""
        du, dv = np.asarray(du, dtype=float), np.asarray(dv, dtype=float)
        gain = 1.0 + self.k1 * (du**2 + dv**2) / self.half_diagonal_px**2
        return du * gain + 0.5 * (self.width - 1), dv * gain + 0.5 * (self.height - 1)

    def undistort(self, u: ArrayLike, v: ArrayLike) -> tuple[Array, Array]:
        """Inverse of `distort`: undistorted pixels (n,) counted from the middle."""
        du, dv = (
            np.asarray(u, dtype=float) - 0.5 * (self.width - 1),
            np.asarray(v, dtype=float) - 0.5 * (self.height - 1),
        )
        if self.k1 == 0.0:
            return du, dv
        rho = np.hypot(du, dv) / self.half_diagonal_px
        r = rho.copy()
        for _ in range(8):  # quadratic from a start within k1: rounding is reached after four or five for |k1| < 0.1
            r -= (r + self.k1 * r**3 - rho) / (1.0 + 3.0 * self.k1 * r**2)
        gain = 1.0 / (1.0 + self.k1 * r**2)
        return du * gain, dv * gain

    def plane(self, u: ArrayLike, v: ArrayLike, *, height_m: float = 0.0) -> tuple[Array, Array]:
        """Table points (m) seen at pixels; inverse of `project`."""
        back = np.linalg.inv(self.homography(height_m))
        X, Y, W = np.tensordot(back, _homogeneous(*self.undistort(u, v)), axes=1)
        return X / W, Y / W


def _homogeneous(a: ArrayLike, b: ArrayLike) -> Array:
    a, b = np.broadcast_arrays(np.asarray(a, dtype=float), np.asarray(b, dtype=float))
    return np.stack([a, b, np.ones_like(a)])
