"""The cable within a band: what it makes together with a hard shadow beside it.

``mask -> pieces up to a few cables wide -> skeleton -> picture straightened along it -> the pair of opposite edges one
diameter apart -> strip of the cable``

A lamp draws a shadow as dark as the cable, and both melt into one band up to two and a half cables wide that narrows
where the cable runs along the light. The shadow adds edges of its own; the known diameter tells which two are the
cable's.
All lengths in cells.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d, median_filter

from pipeline.vision.median import median, scatter
from pipeline.vision.search.backdrop import Image
from pipeline.vision.search.crosscut import SMOOTHING_WIDTHS, path_normals, smooth_path, straighten
from pipeline.vision.search.flanks import find_flanks
from pipeline.vision.search.strips import MIN_PIECE_WIDTHS, WIDTH_RATIO_RANGE, Mask, Strip, find_strips

_MIN_BAND_EDGES = 0.5  # share of sections that show both edges of a cable within a band


def strips_in_bands(picture: Image, mask: Mask, thick: Mask, width: float, most: float) -> list[Strip]:
    """Strips of the cable's width within the bands of a mask, longest first.

    Parameters
    ----------
    picture : (h, w) ground sigmas
        What the mask was made of.
    mask : (h, w)
    thick : (h, w)
        What is wider than any band.
    width : cells
        The cable's.
    most : widths
        Of the widest band.
    """
    bands = find_strips(mask, thick, width, ratios=(WIDTH_RATIO_RANGE[0], most))
    strips = [_cable_within(picture, band, width, 0.5 * (most - 1.0)) for band in bands]
    return sorted((strip for strip in strips if strip is not None), key=lambda strip: -strip.length)


def _cable_within(picture: Image, band: Strip, width: float, search: float) -> Strip | None:
    """The cable's strip in a band; None where most sections show no pair of edges."""
    path = smooth_path(band.path, SMOOTHING_WIDTHS * width)
    # a skeleton runs into a corner of the band over its last half width
    corner = round(0.5 * band.width)
    path = path[corner : len(path) - corner]
    if len(path) < MIN_PIECE_WIDTHS * width:
        return None
    _, normal = path_normals(path)
    straight, rows, offsets = straighten(picture, path, normal, width)
    flanks = find_flanks(straight[..., 0], offsets, width, len(path) / len(rows), known=True, search=search)
    both = np.isfinite(flanks.left + flanks.right)
    if both.mean() < _MIN_BAND_EDGES:
        return None
    middle = np.where(both, 0.5 * (flanks.left + flanks.right), flanks.middle)
    middle = gaussian_filter1d(median_filter(middle, 9, mode="nearest"), width * len(rows) / len(path), mode="nearest")
    across = (flanks.right - flanks.left)[both]
    return replace(
        band,
        path=path + np.interp(np.arange(len(path)), rows, middle)[:, None] * normal,
        width=median(across),
        width_scatter=scatter(across) / width,
    )
