"""A picture of what stands out to strips of constant width: mask, skeleton, path.

``mask -> closed (highlights, writing) -> thick things removed -> skeleton of each thin piece -> longest path ->
pieces that continue each other joined``

All lengths in cells of the reduced photo; points are ``(u, v)``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra
from skimage.graph import pixel_graph
from skimage.morphology import skeletonize

from pipeline.records import Array
from pipeline.vision.median import median
from pipeline.vision.polyline import arc_lengths, step_lengths

Mask = NDArray[np.uint8]

THICK_WIDTHS = 1.7  # widths; wider things are objects: a soft shadow widens the mask by up to a half
MIN_PIECE_WIDTHS = 2.5  # widths; shorter pieces are writing, dirt or texture, beyond an end a clamp's screw or jaw
WIDTH_RATIO_RANGE = (0.5, THICK_WIDTHS)
"""To the diameter; mask widths of a cable with shadow or with a rim lost in glare, and of another that is as likely."""
JOINT_ANGLE_DEG = 30.0  # degrees; over five widths a cable turns by less unless its bend radius is ten widths
_JOINT_GAP_WIDTHS = 5.0  # widths; a sticker, glare or crossing interrupts the mask by a few widths


@dataclass(frozen=True)
class Strip:
    """A piece of the picture that is much longer than wide.

    Attributes
    ----------
    path : (k, 2) cells
        Along the middle, from one end to the other.
    width : cells
        Median along the path.
    """

    path: Array
    width: float

    @property
    def length(self) -> float:
        """Length of the path in cells."""
        return float(step_lengths(self.path).sum())


def strip_mask(above: NDArray[np.bool_], width: float) -> Mask:
    """Mask of what stands out, closed over highlights and filled where writing leaves holes."""
    # A highlight takes up to a third of the width.
    mask = _morphology(above.astype(np.uint8), cv2.MORPH_CLOSE, _disc(0.45 * width))
    contours, tree = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    small = [
        contour
        for contour, (_, _, _, parent) in zip(contours, tree[0] if tree is not None else (), strict=True)
        if parent >= 0 and cv2.contourArea(contour) < width**2
    ]
    cv2.drawContours(mask, small, -1, 1, cv2.FILLED)
    # Specks of noise and texture are thinner than any cable.
    return _morphology(mask, cv2.MORPH_OPEN, _disc(0.3 * width))


def drawn_path(path: Array, width: float, shape: tuple[int, ...]) -> Mask:
    """Mask of a picture of some shape with a strip so wide along a path, and nothing else."""
    mask = np.zeros(shape[:2], np.uint8)
    cv2.polylines(mask, [np.rint(path).astype(np.int32)], False, 1, max(1, round(width)))
    return mask


def thick_part(mask: Mask, least: float) -> Mask:
    """Things at least so many cells wide: clamps, covers, the holder."""
    disc = _disc(least)
    if len(disc) <= 31:
        return _morphology(mask, cv2.MORPH_OPEN, disc)
    # the same by distances, whose time does not grow with the disc: less from here on
    radius = len(disc) // 2
    core = cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) > radius
    if not core.any():
        return np.zeros_like(mask)
    away = cv2.distanceTransform(np.logical_not(core).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(away <= radius, np.uint8)


def find_strips(mask: Mask, thick: Mask, width: float, *, most: float = THICK_WIDTHS) -> list[Strip]:
    """Strips of about the given width (cells), longest first, ``most`` widths wide."""
    grown = _morphology(thick, cv2.MORPH_DILATE, _disc(3.0))
    thin = mask & (1 - grown)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(thin, connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA]
    largest = 1 + np.argsort(areas)[::-1][:12]  # the cable is among them
    strips = []
    for label in largest[areas[largest - 1] >= MIN_PIECE_WIDTHS * width**2]:
        u, v, w, h = stats[label, :4]
        piece = np.pad((labels[v : v + h, u : u + w] == label).astype(np.uint8), 1)
        strip = _trace(piece)
        if strip is not None and WIDTH_RATIO_RANGE[0] * width <= strip.width <= most * width:
            strips.append(replace(strip, path=strip.path + np.array([u - 1, v - 1])))
    return sorted(strips, key=lambda strip: -strip.length)


def ridge_widths(mask: Mask) -> list[tuple[float, float]]:
    """Widths (cells) that strips in the mask have and about how long they are in all, the longest first.

    The distance transform at the ridge is half the width; long strips of constant width pile up in its histogram.
    """
    depth = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
    ridge = (depth > 0) & (depth >= cv2.dilate(depth, np.ones((3, 3), np.uint8)) - 0.3)
    widths = 2.0 * depth[ridge]
    edges = np.geomspace(2.0, max(max(mask.shape) / 25.0, 4.0), 20)  # a picture of 50 cells has some width too
    counts = np.histogram(widths, edges)[0].astype(np.float64)
    # A ridge is up to as thick as the strip's cells allow; neighbouring bins belong to the same strip.
    pooled = np.convolve(counts, [0.5, 1.0, 0.5], mode="same")
    order = [i for i in np.argsort(pooled)[::-1] if pooled[i] >= max(pooled[max(i - 1, 0) : i + 2])]
    best = [i for i in order[:3] if pooled[i] > 0]  # the first was right so far
    return [(float(np.sqrt(edges[i] * edges[i + 1])), float(pooled[i])) for i in best]


def join_strips(strips: list[Strip], width: float) -> list[Strip]:
    """Join strips whose ends face each other across a gap."""
    strips = list(strips)
    while True:
        best = _best_joint(strips, width)
        if best is None:
            return sorted(strips, key=lambda strip: -strip.length)
        i, j, first, second = best
        a, b = strips[i], strips[j]
        share = np.array([a.length, b.length]) / (a.length + b.length)
        path = np.vstack([first, _bridge(first[-1], second[0]), second])
        joined = Strip(path, float(share @ (a.width, b.width)))
        strips = [strip for k, strip in enumerate(strips) if k not in (i, j)] + [joined]


def _bridge(start: Array, stop: Array) -> Array:
    """Points a cell apart between two ends, without them: a path must be dense to tell where it crosses itself."""
    count = max(2, round(float(np.hypot(*(stop - start)))) + 1)
    return np.linspace(start, stop, count)[1:-1]


def _best_joint(strips: list[Strip], width: float) -> tuple[int, int, Array, Array] | None:
    best, least = None, _JOINT_GAP_WIDTHS * width
    for i, a in enumerate(strips):
        for j in range(i + 1, len(strips)):
            for first in (a.path, a.path[::-1]):
                for second in (strips[j].path, strips[j].path[::-1]):
                    gap = float(np.hypot(*(second[0] - first[-1])))
                    if gap < least and arc_joins(first, second, width, JOINT_ANGLE_DEG):
                        best, least = (i, j, first, second), gap
    return best


def arc_joins(first: Array, second: Array, width: float, most_deg: float) -> bool:
    """True if an arc that leaves the end of ``first`` along it arrives at the start of ``second`` along that.

    An arc leaves its chord by the angle by which it comes back to it, at most ``most_deg``; a cable that bends unevenly
    by about that. Skeletons end up to half a width short and aside, so the direction of a short gap means nothing.
    """
    leaving, arriving, gap = end_direction(first, width), -end_direction(second[::-1], width), second[0] - first[-1]
    chord = gap if np.hypot(*gap) > width else leaving + arriving
    ways = ((leaving, chord), (chord, arriving))
    out, back = (np.degrees(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b)) for a, b in ways)
    return bool(max(abs(out), abs(back)) < most_deg and abs(out - back) < JOINT_ANGLE_DEG)


def end_direction(path: Array, width: float) -> Array:
    """Unit vector (2,) that leaves a path (n, 2) at its last point, over three widths, without the last half width."""
    s = arc_lengths(path)
    far, near = np.searchsorted(s, [s[-1] - 3.5 * width, s[-1] - 0.5 * width])
    piece = path[max(far, 0) : max(near, far + 2)]
    piece = path if len(piece) < 2 else piece
    chord = piece[-1] - piece[0]
    return np.asarray(chord / (np.hypot(*chord) + 1e-12))


def _trace(piece: Mask) -> Strip | None:
    """Skeleton of one connected piece -> its longest shortest path."""
    skeleton = skeletonize(piece.astype(bool))
    vu = np.argwhere(skeleton)
    if len(vu) < 3:
        return None
    graph, _ = pixel_graph(skeleton, connectivity=2)  # its nodes are in the order of ``vu``
    # the oldest scipy that is allowed walks no graph whose indices have 64 bits
    graph.indices, graph.indptr = graph.indices.astype(np.int32), graph.indptr.astype(np.int32)
    start = _farthest(dijkstra(graph, indices=[0])[0])
    reach, before = (of_start[0] for of_start in dijkstra(graph, indices=[start], return_predecessors=True))
    node = _farthest(reach)
    nodes = []
    while node >= 0:
        nodes.append(node)
        node = int(before[node])
    path = vu[nodes][:, ::-1].astype(np.float64)
    depth = cv2.distanceTransform(piece, cv2.DIST_L2, 5)
    along = 2.0 * depth[vu[nodes][:, 0], vu[nodes][:, 1]] - 1.0  # the centre of a cell counts as inside by half a cell
    inner = along[len(along) // 10 : len(along) - len(along) // 10] if len(along) > 20 else along
    return Strip(path, median(inner))


def _farthest(reach: Array) -> int:
    """Node with the longest way to it, among those that can be reached."""
    return int(np.argmax(np.where(np.isfinite(reach), reach, -1.0)))


def _disc(diameter: float) -> Mask:
    size = max(1, round(diameter)) | 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)


def _morphology(mask: Mask, kind: int, disc: Mask) -> Mask:
    return np.asarray(cv2.morphologyEx(mask, kind, disc), np.uint8)
