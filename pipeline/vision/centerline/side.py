"""One positive side for all photos of a series: that to which the most bent cable bows.

A single photo counts curvature positive toward its own bow. Over a series that would lose a sign: a cable pushed
against its natural bow, or one so straight that noise decides, shows its force-free photo from the other side, and its
pre-curvature is negative.

``centerlines, each in its own chord frame -> the same with y toward one side``
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.records import Centerline, Finding, Rejected, inferred, said_once
from rod.measurement import MeasuredShape

_OTHER_SIDE_WIDTHS = 0.5  # widths; a bow that anyone sees: a smaller one to the other side is a straight cable


def on_one_side(
    lines: tuple[Centerline | Rejected, ...], diameter_m: float
) -> tuple[tuple[Centerline | Rejected, ...], tuple[Finding, ...]]:
    """Centerlines with y of all chord frames toward one side of the photo.

    Parameters
    ----------
    lines : tuple of Centerline or Rejected
        As measured, every y toward the photo's own bow; left and right are the same bearings on all photos.
    diameter_m : m

    Returns
    -------
    tuple of Centerline or Rejected
        In the same order.
    tuple of Finding
        ``photo/other-side`` for every cable that visibly bows to the other side.
    """
    traced = [line for line in lines if isinstance(line, Centerline)]
    if len(traced) < 2:
        return lines, ()
    side = max(traced, key=_bow).side
    turned = [line for line in traced if line.side != side]
    names = {line.image for line in turned}
    bows = [(line.image, _bow(line)) for line in turned if _bow(line) > _OTHER_SIDE_WIDTHS * diameter_m]
    findings = tuple(said_once((image, inferred("photo/other-side", bow_m=bow)) for image, bow in bows))
    return tuple(
        replace(line, shape=reflected(line.shape), mirrored=not line.mirrored)
        if isinstance(line, Centerline) and line.image in names
        else line
        for line in lines
    ), findings


def _bow(line: Centerline) -> float:
    return float(np.max(np.abs(line.shape.y)))


def reflected(shape: MeasuredShape) -> MeasuredShape:
    """The shape with y toward the other side: directions, curvature and all errors along the normal change sign."""
    return replace(
        shape,
        y=-shape.y,
        theta=-shape.theta,
        kappa=-shape.kappa,
        basis_normal=-shape.basis_normal,
        basis_theta=-shape.basis_theta,
        basis_kappa=-shape.basis_kappa,
        section_y=-shape.section_y,
    )
