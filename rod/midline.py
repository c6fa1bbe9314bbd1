"""The raw midline of one photo as independent data: block means along the normal, and the whitener of their noise.

A photo holds a thousand and more midline sections whose errors are correlated over some ten pixels and share a slowly
varying part (light). Blocks of about one correlation length lose less than a tenth of a percent of what the sections
know about a smooth curve (for a block of one correlation length the mean of an Ornstein-Uhlenbeck process keeps all but
1/12 (b/l)^2 of a wavelength-l component), and turn thousands of rows into a hundred or two.

A block mean is taken of the distance of the sections from the smooth curve of the same photo, and put back on that
curve at the centre of the block: the mean of positions on an arc would lie inside it.

Noise model (see `rod.measurement.MeasuredShape`): section errors ``std_i std_j exp(-|ds| / correlation_length)`` plus
the slow parts ``std^2 exp(-ds^2 / (2 length^2))`` of light and ground.

Axes: chord frame; "normal" is the displacement along ``(-sin theta, cos theta)``; SI units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rod.measurement import MeasuredShape, slow_covariance

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Midline:
    """Independent data of one photo.

    Attributes
    ----------
    s, x, y, theta : (b,) m, m, m, rad
        Centres of the blocks: arc length on the smooth curve, measured position, direction of the tangent.
    offset : (b,) m
        Of the measured position from the smooth curve, along its normal.
    covariance : (b, b) m^2
        Of the position along the normal.
    factor : (b, b) m
        Lower triangular; ``factor @ factor.T = covariance``.
    whitener : (b, b) 1/m
        Its inverse; ``whitener @ covariance @ whitener.T = 1``.
    """

    s: Array
    x: Array
    y: Array
    theta: Array
    offset: Array
    covariance: Array
    factor: Array
    whitener: Array

    @property
    def on_curve(self) -> Array:
        """The same places on the smooth curve, (b, 2) m."""
        normal = np.column_stack([-np.sin(self.theta), np.cos(self.theta)])
        return np.asarray(np.column_stack([self.x, self.y]) - self.offset[:, None] * normal)


def midline(shape: MeasuredShape, *, blocks: int = 160) -> Midline:
    """Block means of the raw sections with their covariance.

    Parameters
    ----------
    shape : MeasuredShape
    blocks : int
        At most that many; fewer where a correlation length is longer. 160 on a cable of 180 mm are 1.1 mm each.

    Raises
    ------
    ValueError
        If there are fewer than eight sections.
    """
    order = np.argsort(shape.section_s)
    s, std = shape.section_s[order], shape.section_std[order]
    if s.size < 8:
        raise ValueError(f"{s.size} midline sections do not make a shape")
    distance = shape.section_offsets()[order]
    reach = float(s[-1] - s[0])
    width = max(reach / blocks, shape.correlation_length)
    count = max(8, min(blocks, int(np.ceil(reach / width)), s.size))
    label = np.minimum(((s - s[0]) / reach * count).astype(int), count - 1)
    _, first, sections = np.unique(label, return_index=True, return_counts=True)
    mean = np.add.reduceat(s, first) / sections
    offset = np.add.reduceat(distance, first) / sections
    x, y, theta = shape.at(mean)
    covariance = block_covariance(s, std, first, sections, shape.correlation_length)
    # A doubt as large as the cable says all there is to say; more would only drown the noise in rounding errors.
    covariance += slow_covariance(mean, tuple((min(error, reach), length) for error, length in shape.slow))
    covariance[np.diag_indices_from(covariance)] += (1e-9 * reach) ** 2  # only keeps it regular
    x, y = x - offset * np.sin(theta), y + offset * np.cos(theta)
    factor = np.asarray(np.linalg.cholesky(covariance), float)
    return Midline(mean, x, y, theta, offset, covariance, factor, np.tril(np.linalg.inv(factor)))


def block_covariance(
    s: Array, std: Array, first: NDArray[np.intp], sections: NDArray[np.intp], correlation_length: float
) -> Array:
    """Exact covariance of block means of errors ``std_i std_j exp(-|s_i - s_j| / correlation_length)``.

    Between blocks a < b the exponential splits into a part of a (distance to its last section), the gap, and a part of
    b (distance from its first section), so no matrix over all sections is formed.

    Parameters
    ----------
    s, std : (k,) m
        Sections in increasing order.
    first, sections : (b,)
        Index of the first section of each block and their number.
    """
    rho = max(correlation_length, 1e-12)
    last = first + sections - 1
    block = np.repeat(np.arange(first.size), sections)
    tail = np.add.reduceat(std * np.exp(-(s[last][block] - s) / rho), first) / sections
    head = np.add.reduceat(std * np.exp(-(s - s[first][block]) / rho), first) / sections
    gap = s[first][None, :] - s[last][:, None]
    upper = np.triu(tail[:, None] * head[None, :] * np.exp(-np.maximum(gap, 0.0) / rho), 1)
    covariance = upper + upper.T
    for k, (i, n) in enumerate(zip(first, sections, strict=True)):
        inside = np.exp(-np.abs(s[i : i + n, None] - s[None, i : i + n]) / rho)
        covariance[k, k] = std[i : i + n] @ inside @ std[i : i + n] / n**2
    return np.asarray(covariance)
