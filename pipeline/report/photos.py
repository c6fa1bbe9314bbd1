"""One photo as evidence: its centerline drawn over it, its curvature with band and fit, what is left between them.

The centerline is drawn in the pixels of the preview: preview px = displayed px / reduction. Pixel (0, 0) is the
centre of the top-left pixel, while SVG counts from its corner, hence half a displayed pixel is added. Parts of the
cable that no photo shows (under a bearing cover) are drawn dashed and shaded.
"""

from __future__ import annotations

import base64
import io

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import imread

from pipeline.report.canvas import LIGHT, ONE_ROW, Area, finish, plot_area
from pipeline.report.ruling import Ruling, printable
from pipeline.report.words import Words
from pipeline.result import PhotoPart

PICTURE_HEAD = 18.0
"""Room above a photo for its name, px."""


def overlay_paths(photo: PhotoPart) -> tuple[str, str]:
    """SVG paths (attribute ``d``) of the seen and the extended centerline in px of the preview; empty without any."""
    if photo.preview is None or not photo.u_px:
        return "", ""
    u, v = ((np.asarray(px) + 0.5) / photo.preview.reduction for px in (photo.u_px, photo.v_px))
    seen = np.asarray(photo.seen, dtype=bool)
    return _path(u, v, seen), _path(u, v, ~seen)


def _path(u: np.ndarray, v: np.ndarray, chosen: np.ndarray) -> str:
    """Runs of chosen points as sub-paths; a run reaches to the neighbour on its right so that runs touch."""
    runs = [range(first, min(last + 1, u.size)) for first, last in _runs(chosen)]
    return "".join("M" + "L".join(f"{u[i]:.1f} {v[i]:.1f}" for i in run) for run in runs if len(run) > 1)


def _runs(chosen: np.ndarray) -> list[tuple[int, int]]:
    """Where runs of chosen points begin, and end (exclusive)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(int), [0]]))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def bearing_marks(photo: PhotoPart) -> list[tuple[float, float]]:
    """Bearing axes in px of the preview."""
    if photo.preview is None:
        return []
    axes = (photo.left_px, photo.right_px)
    return [((p[0] + 0.5) / photo.preview.reduction, (p[1] + 0.5) / photo.preview.reduction) for p in axes if p]


def draw_photo(area: Area, photo: PhotoPart, words: Words) -> Axes:
    """Draw one photo with its centerline; hidden parts dashed. The photo has a preview."""
    head = 14.0 / area.bbox.height
    axes, preview = area.add_axes((0.0, 0.0, 1.0, 1.0 - head)), photo.preview
    axes.set_axis_off()
    if preview is not None:
        file = io.BytesIO(base64.b64decode(preview.jpeg_base64))
        axes.imshow(imread(file, format="jpeg"), cmap="gray", vmin=0, vmax=255)
        axes.set_autoscale_on(False)
        u, v = ((np.asarray(px) + 0.5) / preview.reduction - 0.5 for px in (photo.u_px, photo.v_px))
        if u.size:
            axes.plot(u, v, color="#2aa8dd", lw=0.8, ls=(0, (3, 2)))
            axes.plot(np.where(photo.seen, u, np.nan), v, color="#ffb000", lw=1.0)
    status = "" if photo.status == "traced" else f", {words(f'status_{photo.status}')}"
    label = printable(f"{words('fig_photo', step=photo.step)}{status}")
    area.text(0.0, 1.0 - 10.0 / area.bbox.height, label, size=8.5, color=LIGHT["ink"])
    return axes


def draw_photo_curvature(figure: Area, photo: PhotoPart, words: Words) -> Axes:
    """Draw kappa(s) of one photo with its band and the fit; below, the position left over along the normal."""
    height, s = figure.bbox.height, 1e3 * np.asarray(photo.s_m)
    residual = bool(photo.shape_residual_m)
    axes = plot_area(figure, top=ONE_ROW, bottom=0.42 * height if residual else 42.0)
    kappa, half = np.asarray(photo.kappa_per_m), words.half_band * np.asarray(photo.kappa_std_per_m)
    axes.fill_between(s, kappa - half, kappa + half, color=LIGHT["measured"], alpha=0.18, lw=0.0)
    axes.plot(s, kappa, color=LIGHT["measured"], lw=1.6, label=words("measured"))
    if fit := photo.kappa_fit_per_m:
        axes.plot(s, fit, color=LIGHT["inverse"], ls=(0, (5, 2)), lw=1.6, label=words("simulated"))
    seen = np.asarray(photo.seen, dtype=bool)
    if seen.any():  # under a cover the band widens without bound; what is seen decides the scale
        low, high = (kappa - half)[seen].min(), (kappa + half)[seen].max()
        axes.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
    _along_the_cable(axes, s, seen)
    if residual:
        _residual(figure, photo, s, words)
    under = Ruling(labelled=False) if residual else Ruling(words("axis_s"))
    return finish(axes, words, x=under, y=words("axis_kappa"), legend=3)


def _residual(figure: Area, photo: PhotoPart, s: np.ndarray, words: Words) -> None:
    """Measured minus simulated position along the normal, with the noise of the photo as a band around zero."""
    axes = plot_area(figure, top=0.66 * figure.bbox.height)
    unit = words.unit("m", *photo.shape_residual_m, *photo.shape_residual_std_m)
    if photo.shape_residual_std_m:
        half = unit.factor * words.half_band * np.asarray(photo.shape_residual_std_m)
        axes.fill_between(s, -half, half, color=LIGHT["unvisited"], alpha=0.2, lw=0.0)
    axes.axhline(0.0, color=LIGHT["muted"], lw=0.8)
    axes.plot(s, unit.factor * np.asarray(photo.shape_residual_m), color=LIGHT["measured"], lw=1.2)
    _along_the_cable(axes, s, np.asarray(photo.seen, dtype=bool))
    finish(axes, words, x=words("axis_s"), y=Ruling(words("axis_residual", unit=unit.symbol), most=4))


def _along_the_cable(axes: Axes, s: np.ndarray, seen: np.ndarray) -> None:
    """From bearing to bearing, what the photo does not show shaded."""
    for first, last in _runs(~seen):
        axes.axvspan(s[first], s[min(last, s.size - 1)], color=LIGHT["unvisited"], alpha=0.18, lw=0.0)
    axes.set_xlim(s[0], s[-1])
