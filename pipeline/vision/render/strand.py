"""A cable as a curve, and its picture with exact edges.

`Curve` is a centerline in the chord frame: origin at the left bearing axis, x through both axes, y toward the bow,
metres. `strand_layer` colours the pixels it covers.

Strategy of the picture: each pixel near the cable knows the nearest node of the curve (nodes at most one pixel apart).
In that node's frame (t along the tangent, n along the normal) the signed distance to the osculating circle is

    o = q / (1 + sqrt(1 - kappa q)),   q = 2 n - kappa (t^2 + n^2),

which misses the curve by kappa' t^3 / 6, below 1e-6 px for any cable. The covered part of a pixel cell is that of a
half plane: sharp, the exact area (`half_plane`); or seen through a lens, the normal integral (`soft_edge`). The lens
must act before the pixels do: a sharp picture blurred afterwards moves an edge by up to 0.02 px with its place in the
pixel, because the skewness f (1 - f) (1 - 2 f) of a partly covered pixel survives the blur. The colour is sampled on
3 x 3 points a pixel and weighted with what each of their cells covers; deep inside a sheath of one colour two do.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import partial
from math import ceil, sqrt

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree
from scipy.special import ndtr

from pipeline.vision.render.lens import Camera
from pipeline.vision.render.lighting import Light, cylinder
from pipeline.vision.render.sheath import Sheath, albedo, ink

Array = NDArray[np.float64]

SAMPLES = 3  # per pixel and direction, for colour only: edges are exact with one
CLEAR = 8.0  # standard deviations of the lens, or pixels, from which a border is out of sight
CELL = 4  # pixels wide and high
TOGETHER = 8192  # pixels worked on at a time: their thirty columns stay in the processor's cache


@dataclass(frozen=True)
class Curve:
    """Centerline in the chord frame: arc length, position, tangent angle, curvature; (n,) each, m, rad, 1/m."""

    s: Array
    x: Array
    y: Array
    theta: Array
    kappa: Array

    @property
    def chord(self) -> float:
        """Distance of the ends, m."""
        return float(np.hypot(self.x[-1] - self.x[0], self.y[-1] - self.y[0]))


@dataclass(frozen=True)
class Strand:
    """A cable on the table.

    Attributes
    ----------
    curve : Curve
    diameter_m : float
    sheath : Sheath
    place_m : (X, Y) m
        Of the curve's origin on the table.
    angle_rad : float
        Of the curve's x axis on the table, from X toward Y.
    overhang_m : float
        Straight continuation beyond both ends; 0 shows blunt ends on the axes.
    """

    curve: Curve
    diameter_m: float = 0.0046
    sheath: Sheath = field(default_factory=Sheath)
    place_m: tuple[float, float] = (0.0, 0.0)
    angle_rad: float = 0.0
    overhang_m: float = 0.0

    def on_table(self, x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
        """Table coordinates (n,) of points (n,) in the chord frame, m."""
        c, q = np.cos(self.angle_rad), np.sin(self.angle_rad)
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        return self.place_m[0] + c * x - q * y, self.place_m[1] + q * x + c * y


@dataclass(frozen=True)
class Layer:
    """Coloured pixels: flat indices (n,), covered part (n,), colour (n, channels) as brightness."""

    index: NDArray[np.intp]
    alpha: Array
    colour: Array


@dataclass(frozen=True)
class _Nodes:
    s: Array
    X: Array
    Y: Array
    tangent: Array
    kappa: Array
    u: Array
    v: Array


@dataclass(frozen=True)
class _Frame:
    """Pixels (n,) as their nearest node sees them: along the tangent and the normal, what a pixel changes of that.

    ``t``, ``n`` (n,) m; ``t_grad``, ``n_grad`` (2, n) m per pixel's width and height; ``s``, ``kappa`` of the node;
    ``end`` whether an end of the cable is near.
    """

    t: Array
    n: Array
    t_grad: Array
    n_grad: Array
    s: Array
    kappa: Array
    end: NDArray[np.bool_]

    def only(self, those: NDArray[np.bool_]) -> _Frame:
        """Some of the pixels."""
        return _Frame(*(getattr(self, item.name)[..., those] for item in fields(self)))

    def offset(self, t: Array, n: Array) -> Array:
        """Signed distance of points from the osculating circle."""
        bend = 2 * n - self.kappa * (t**2 + n**2)
        return np.asarray(bend / (1.0 + np.sqrt(np.maximum(1.0 - self.kappa * bend, 0.0))))


def strand_layer(strand: Strand, camera: Camera, light: Light, channels: int, *, blur_px: float = 0.0) -> Layer:
    """Layer of a cable on the picture of ``camera``, lit by ``light``, its edges blurred by a lens of ``blur_px``."""
    nodes, radius = _nodes(strand, camera), 0.5 * strand.diameter_m
    index, u, v, i = _near(nodes, camera, radius)
    alpha, colour = np.zeros(index.size), np.zeros((index.size, channels))
    for first in range(0, index.size, TOGETHER):
        part = np.arange(first, min(first + TOGETHER, index.size))
        frame = _frame(nodes, camera, u[part], v[part], i[part])
        depth = radius - np.abs(frame.n) - 2.0 * np.hypot(*frame.n_grad)
        inside = (depth > CLEAR * max(blur_px, 1.0) * np.hypot(*frame.n_grad)) & ~frame.end & strand.sheath.plain
        alpha[part[inside]] = SAMPLES**2
        colour[part[inside]] = _filled(strand, frame.only(inside), light, channels)
        rest = frame.only(~inside)
        alpha[part[~inside]], colour[part[~inside]] = _covered(strand, nodes, camera, light, rest, channels, blur_px)
    seen = alpha > 1e-7
    colour = colour[seen] / alpha[seen, None]
    return Layer(index[seen], np.minimum(alpha[seen] / SAMPLES**2, 1.0), colour)


def _frame(nodes: _Nodes, camera: Camera, u: Array, v: Array, i: NDArray[np.intp]) -> _Frame:
    """Pixels (u, v) with their nearest nodes."""
    X, Y = camera.plane(u, v)
    jac = _jacobian(camera, u, v)
    c, q = np.cos(nodes.tangent[i]), np.sin(nodes.tangent[i])
    return _Frame(
        t=(X - nodes.X[i]) * c + (Y - nodes.Y[i]) * q,
        n=(X - nodes.X[i]) * -q + (Y - nodes.Y[i]) * c,
        t_grad=np.stack([c * jac[0, 0] + q * jac[1, 0], c * jac[0, 1] + q * jac[1, 1]]),
        n_grad=np.stack([-q * jac[0, 0] + c * jac[1, 0], -q * jac[0, 1] + c * jac[1, 1]]),
        s=nodes.s[i],
        kappa=nodes.kappa[i],
        end=(i < 3) | (i >= nodes.s.size - 3),
    )


def _filled(strand: Strand, frame: _Frame, light: Light, channels: int) -> Array:
    """Sum of the colours (n, channels) of pixels deep inside a sheath of one colour.

    Brightness changes across the cable alone: two points with the variance of all samples stand for them.
    """
    radius, slope = 0.5 * strand.diameter_m, np.hypot(*frame.n_grad)
    apart, total = slope * sqrt((SAMPLES**2 - 1.0) / 12.0) / SAMPLES, np.zeros((frame.n.size, channels))
    for side in (-1.0, 1.0):
        across = frame.offset(frame.t, frame.n + side * apart) / radius
        total += _shade(strand.sheath, light, across, across, frame.n_grad / slope, channels)
    return 0.5 * SAMPLES**2 * total


def _covered(
    strand: Strand, nodes: _Nodes, camera: Camera, light: Light, frame: _Frame, channels: int, blur_px: float
) -> tuple[Array, Array]:
    """Covered cells (n,) of pixels, and the sum of their colours (n, channels)."""
    radius, ends = 0.5 * strand.diameter_m, np.flatnonzero(frame.end)
    normal = frame.n_grad / np.hypot(*frame.n_grad)
    # A blurred curved border moves toward its centre by kappa sigma^2 / 2, as in curve shortening.
    inward = 0.5 * frame.kappa * (blur_px**2 + 1.0 / 12.0) / camera.px_per_m**2 if blur_px else 0.0
    inside = partial(soft_edge, blur_px=blur_px) if blur_px else half_plane
    # the farther border shows beside the nearer one only where a cable is hardly wider than what blurs it
    thin = radius * camera.px_per_m < CLEAR * max(blur_px, 1.0)
    marked = ends.size or not strand.sheath.plain  # else it does not matter where along the cable a pixel lies
    alpha, colour, tip = np.zeros(frame.n.size), np.zeros((frame.n.size, channels)), frame.t_grad[:, ends]
    steps = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    for du in steps:
        for dv in steps:
            tk = frame.t + frame.t_grad[0] * du + frame.t_grad[1] * dv
            nk = frame.n + frame.n_grad[0] * du + frame.n_grad[1] * dv
            offset = frame.offset(tk, nk) - inward
            along = frame.s + tk / (1.0 - frame.kappa * nk) if marked else frame.s
            cover = inside(radius - np.abs(offset), frame.n_grad, SAMPLES)
            if thin:
                cover += inside(radius + np.abs(offset), frame.n_grad, SAMPLES) - 1.0
            if ends.size:
                cover[ends] *= inside(along[ends] - nodes.s[0], tip, SAMPLES)
                cover[ends] *= inside(nodes.s[-1] - along[ends], tip, SAMPLES)
            alpha += cover
            colour += cover[:, None] * _shade(strand.sheath, light, along / radius, offset / radius, normal, channels)
    return alpha, colour


def half_plane(distance: Array, gradient: Array, cells: int = 1) -> Array:
    """Part of a pixel cell (n,) inside the half plane ``distance > 0``.

    Parameters
    ----------
    distance : (n,)
        Of the cell's centre from the border, positive inside.
    gradient : (2, n)
        Change of the distance over a pixel's width and height.
    cells : int
        Cells a pixel and direction.

    Notes
    -----
    The distance over a cell is the sum of two uniform variables: their distribution is a trapezoid, its integral is

        sum of +- max(d +- (a +- b) / 2, 0)^2 / (2 a b).
    """
    gradient = np.abs(gradient) / cells
    a = np.max(gradient, axis=0)
    # Below 1e-4 of a cell the cell is aligned with the border; the formula would lose its digits to 0/0.
    b = np.maximum(np.min(gradient, axis=0) / a, 1e-4)
    d = np.clip(distance / a, -1.5, 1.5)
    p, m = 0.5 * (1.0 + b), 0.5 * (1.0 - b)
    outer = np.maximum(d + p, 0) ** 2 + np.maximum(d - p, 0) ** 2
    inner = np.maximum(d + m, 0) ** 2 + np.maximum(d - m, 0) ** 2
    return np.asarray(np.clip((outer - inner) / (2.0 * b), 0.0, 1.0))


def soft_edge(distance: Array, gradient: Array, cells: int = 1, *, blur_px: float) -> Array:
    """Like `half_plane`, through a Gaussian lens; the cell's own box enters with its variance (1/12 of its width^2)."""
    slope = np.sqrt(gradient[0] ** 2 + gradient[1] ** 2)
    z = distance / (slope * sqrt(blur_px**2 + 1.0 / (12.0 * cells**2)))
    cover = (z > 0.0).astype(float)
    near = np.flatnonzero(np.abs(z) < CLEAR)  # the integral is dear, and farther off it is 0 or 1 within rounding
    cover[near] = ndtr(z[near])
    return np.asarray(cover)


def disc_cover(
    camera: Camera, centre_m: tuple[float, float], radius_m: float, *, blur_px: float = 0.0
) -> tuple[NDArray[np.intp], Array, Array]:
    """Flat indices, covered part and distances (2, n) px from its centre of the pixels of a disc on the table."""
    u0, v0 = (float(a) for a in camera.project(*centre_m))
    reach = 1.2 * radius_m * camera.px_per_m + 4.0
    cols = np.arange(max(0, ceil(u0 - reach)), min(camera.width, int(u0 + reach) + 1))
    rows = np.arange(max(0, ceil(v0 - reach)), min(camera.height, int(v0 + reach) + 1))
    u, v = (a.ravel().astype(float) for a in np.meshgrid(cols, rows))
    X, Y = camera.plane(u, v)
    dX, dY = X - centre_m[0], Y - centre_m[1]
    r = np.maximum(np.hypot(dX, dY), 1e-12)
    jac = _jacobian(camera, u, v)
    gradient = np.stack([(dX * jac[0, k] + dY * jac[1, k]) / r for k in (0, 1)])
    # The very centre has no direction; any will do deep inside.
    gradient[0] = np.where(r < 1e-9 * radius_m, jac[0, 0], gradient[0])
    alpha = soft_edge(radius_m - r, gradient, blur_px=blur_px) if blur_px else half_plane(radius_m - r, gradient)
    index = (v * camera.width + u).astype(np.intp)
    seen = alpha > 1e-7
    return index[seen], alpha[seen], np.stack([u - u0, v - v0])[:, seen]


def _nodes(strand: Strand, camera: Camera) -> _Nodes:
    curve, over = strand.curve, strand.overhang_m
    fx, fy, fk = (CubicSpline(curve.s, a) for a in (curve.x, curve.y, curve.kappa))
    s0, s1 = float(curve.s[0]), float(curve.s[-1])
    s = np.linspace(s0 - over, s1 + over, ceil(1.1 * (s1 - s0 + 2 * over) * camera.px_per_m) + 8)
    inside = np.clip(s, s0, s1)
    dx, dy = fx(inside, 1), fy(inside, 1)
    beyond = s - inside
    X, Y = strand.on_table(fx(inside) + beyond * dx, fy(inside) + beyond * dy)
    # The curvature's sign: positive toward y means clockwise in (x, y), the osculating circle wants counter-clockwise.
    kappa = np.where(beyond == 0, -fk(inside), 0.0)
    return _Nodes(s, X, Y, np.arctan2(dy, dx) + strand.angle_rad, kappa, *camera.project(X, Y))


def _near(nodes: _Nodes, camera: Camera, radius: float) -> tuple[NDArray[np.intp], Array, Array, NDArray[np.intp]]:
    """Pixels that may show the cable: flat index, u, v and the nearest node.

    Searched for is that of cells of some pixels, from which each of their pixels goes on along the curve.
    """
    width = 2 * ceil(1.15 * radius * camera.px_per_m + 4)  # 15 % for what tilt and lens magnify
    mask = np.zeros((camera.height, camera.width), np.uint8)
    inside = np.clip(np.column_stack([nodes.u, nodes.v]), -4 * camera.width, 5 * camera.width)
    cv2.polylines(mask, [np.rint(inside[:, None]).astype(np.int32)], False, 255, width)
    index = np.flatnonzero(mask)
    rows, columns = np.divmod(index, camera.width)
    wide = camera.width // CELL + 1
    cell = rows // CELL * wide + columns // CELL
    nearest = np.zeros((camera.height // CELL + 1) * wide, dtype=np.intp)
    nearest[cell] = 1
    known = np.flatnonzero(nearest)
    middle = CELL * np.column_stack(np.divmod(known, wide)[::-1]) + 0.5 * (CELL - 1)
    nearest[known] = cKDTree(np.column_stack([nodes.u, nodes.v])).query(middle)[1]
    u, v, i = columns.astype(float), rows.astype(float), nearest[cell]
    along_u, along_v = np.gradient(nodes.u), np.gradient(nodes.v)
    square = along_u**2 + along_v**2
    for _ in range(2):
        beyond = ((u - nodes.u[i]) * along_u[i] + (v - nodes.v[i]) * along_v[i]) / square[i]
        i = np.clip(i + np.rint(beyond).astype(np.intp), 0, nodes.u.size - 1)
    return index, u, v, i


def _jacobian(camera: Camera, u: Array, v: Array) -> Array:
    """Change of (X, Y) over one pixel in u and in v: (2, 2, n), [table axis, picture axis]."""
    if camera.k1 == 0.0 and camera.perspective_per_m == (0.0, 0.0):
        one = np.linalg.inv(camera.homography())[:2, :2]
        return np.broadcast_to(one[:, :, None], (2, 2, u.size))
    du = np.subtract(camera.plane(u + 0.5, v), camera.plane(u - 0.5, v))
    dv = np.subtract(camera.plane(u, v + 0.5), camera.plane(u, v - 0.5))
    return np.stack([du, dv], axis=1)


def _shade(sheath: Sheath, light: Light, along: Array, across: Array, normal: Array, channels: int) -> Array:
    diffuse, glossy = cylinder(light, across, normal[0], normal[1], gloss=sheath.gloss, shininess=sheath.shininess)
    colour = ink(sheath.colour, channels) if sheath.plain else albedo(sheath, along, across, channels)
    return diffuse[:, None] * colour + glossy[:, None]
