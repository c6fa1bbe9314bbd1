"""The lay of the strands and the print on the sheath: what all photos show at the same place of the cable.

Dark strands, letters and the shade between them pull an edge by some hundredths of a pixel. They go along with the
cable, so the same wiggle of the midline stands at the same arc length on every photo: averaged over the photos it is
no noise, and a joint test would take it for a misfit of the simulation. Its part faster than any bend of a cable
is taken off the sections of all photos.

``centerlines of a series -> the same with sections relieved of the common wiggle``

A bend that comes and goes within two diameters moves the cable by less than an edge can be placed, so what is smoother
than that is left alone: a kink or a soft spot is not touched.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from pipeline.records import Centerline, Rejected
from pipeline.settings.vision.centerline import CurveSettings
from rod.measurement import MeasuredShape

Array = NDArray[np.float64]

_LAY_PITCH_WIDTHS = 0.25  # widths; places along the cable at which the photos' midlines are held together
_LAY_SMOOTH_WIDTHS = 1.5
"""Widths; standard deviation of the running mean that is left alone: of a wave four widths long, the lay of a twisted
pair, a twentieth is left, of a soft spot that long nine tenths.
"""


def without_lay(
    lines: tuple[Centerline | Rejected, ...], diameter_m: float, settings: CurveSettings
) -> tuple[Centerline | Rejected, ...]:
    """Sections of a series relieved of the fast wiggle that all photos have in common.

    Parameters
    ----------
    lines : tuple of Centerline or Rejected
        Outcomes of the photos of one cable.
    diameter_m : m
    settings : CurveSettings

    Returns
    -------
    tuple of Centerline or Rejected
        In the same order. Of the common wiggle only that part is taken which chance does not make of the photos' own
        noise; a single photo is returned as it is.
    """
    shapes = relieved([line.shape for line in lines if isinstance(line, Centerline)], diameter_m)
    rest = iter(shapes)
    return tuple(replace(line, shape=next(rest)) if isinstance(line, Centerline) else line for line in lines)


def relieved(shapes: list[MeasuredShape], diameter_m: float) -> list[MeasuredShape]:
    """Shapes of one cable without the fast wiggle that they have in common; see `without_lay`."""
    if len(shapes) < 2:
        return shapes
    pitch = _LAY_PITCH_WIDTHS * diameter_m
    grid = np.arange(0.0, max(float(shape.s[-1]) for shape in shapes) + pitch, pitch)
    wiggle = _common(np.array([_fast(shape, grid) for shape in shapes]))
    spare = len(shapes) / (len(shapes) - 1.0)
    return [_relieved(shape, grid, wiggle, spare=spare) for shape in shapes]


def _fast(shape: MeasuredShape, grid: Array) -> Array:
    """Distance (g,) m of the sections from their curve on the grid, without what a bend could do; nan where unseen."""
    across = shape.section_offsets()
    cell = np.rint(shape.section_s / (grid[1] - grid[0])).astype(int).clip(0, grid.size - 1)
    count = np.bincount(cell, minlength=grid.size)
    mean = np.bincount(cell, across, grid.size) / np.maximum(count, 1)
    width = _LAY_SMOOTH_WIDTHS / _LAY_PITCH_WIDTHS
    # Weighted, so that the unseen ends and gaps pull nothing.
    weight = gaussian_filter1d((count > 0).astype(float), width, mode="constant")
    slow = gaussian_filter1d(np.where(count > 0, mean, 0.0), width, mode="constant") / np.maximum(weight, 1e-12)
    return np.where(count > 0, mean - slow, np.nan)


def _common(wiggles: Array) -> Array:
    """Mean (g,) of the photos' wiggles (n, g), shrunk by the share of its variance that their own noise makes."""
    seen = np.isfinite(wiggles)
    count = seen.sum(axis=0)
    mean = np.where(seen, wiggles, 0.0).sum(axis=0) / np.maximum(count, 1)
    shared = count > 1
    if not shared.any():
        return np.zeros_like(mean)
    own = np.where(seen, wiggles - mean, 0.0)[:, shared] ** 2
    chance = float(np.mean(own.sum(axis=0) / (count[shared] - 1) / count[shared]))
    power = float(np.mean(mean[shared] ** 2))
    return np.where(shared, mean, 0.0) * (max(0.0, 1.0 - chance / power) if power > 0.0 else 0.0)


def _relieved(shape: MeasuredShape, grid: Array, wiggle: Array, *, spare: float) -> MeasuredShape:
    """Sections without the wiggle; their standard deviations shrink as their scatter does.

    The wiggle holds a part of the photo's own noise: `spare`, photos over photos less one, gives it back.
    """
    if not shape.section_s.size:
        return shape
    off, across = np.interp(shape.section_s, grid, wiggle), shape.section_offsets()
    theta = np.interp(shape.section_s, shape.s, shape.theta)
    before, after = float(np.mean(across**2)), float(np.mean((across - off) ** 2))
    share = min(1.0, spare * after / before) if before > 0.0 else 1.0
    return replace(
        shape,
        section_x=shape.section_x + np.sin(theta) * off,
        section_y=shape.section_y - np.cos(theta) * off,
        section_std=shape.section_std * np.sqrt(share),
    )
