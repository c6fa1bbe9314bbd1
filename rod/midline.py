"""The raw midline of one photo as independent data: block means along the normal, and their noise.

A photo holds a thousand and more midline sections whose errors are correlated over some ten pixels and share a slowly
varying part (light). A hundred blocks know a bent cable as well as all of them: the mean over a block of width b keeps
all but 1/24 (2 pi b/l)^2 of what varies with the wavelength l, two thousandths at a quarter of the cable.

A block mean is taken of the distance of the sections from the smooth curve of the same photo, and put back on that
curve at the centre of the block: the mean of positions on an arc would lie inside it.

Noise model (see `rod.measurement.MeasuredShape`): section errors ``std_i std_j exp(-|ds| / correlation_length)`` plus
the slow parts ``std^2 exp(-ds^2 / (2 length^2))`` of light and ground.

Axes: chord frame; "normal" is the displacement along ``(-sin theta, cos theta)``; SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rod.array import Array
from rod.measurement import MeasuredShape, SlowErrors, slow_covariance

LEAST_SECTIONS = 8
"""Raw midline points that make a shape."""

BLOCKS = 160
"""Of one photo, for both ways to the law."""


@dataclass(frozen=True, eq=False)
class Midline:
    """Independent data of one photo.

    Attributes
    ----------
    s, x, y, theta : (b,) m, m, m, rad
        Centres of the blocks: arc length on the smooth curve, measured position, direction of the tangent.
    offset : (b,) m
        Of the measured position from the smooth curve, along its normal.
    section_s, section_std : (k,) m
        Raw sections in increasing order.
    first, sections : (b,)
        Index of the first section of each block and their number.
    correlation_length : m
        Of the sections' errors.
    slow : tuple of (std m, length m)
        Slow sideways errors: of the light first, then of waves that a textured ground makes on this photo alone.
    common : (std m, length m)
        Waves that are the same at the same s on all photos.
    """

    s: Array
    x: Array
    y: Array
    theta: Array
    offset: Array
    section_s: Array
    section_std: Array
    first: NDArray[np.intp]
    sections: NDArray[np.intp]
    correlation_length: float
    slow: SlowErrors
    common: tuple[float, float] = (0.0, 0.0)

    def random(self, stretch: float = 1.0) -> Array:
        """Covariance (b, b) m^2 of the sections' own errors, their correlation length stretched."""
        if not self.section_s.size:
            return np.zeros((0, 0))
        length, reach = stretch * self.correlation_length, float(np.ptp(self.section_s))
        covariance = block_covariance(self.section_s, self.section_std, self.first, self.sections, length)
        covariance[np.diag_indices_from(covariance)] += (1e-9 * reach) ** 2  # only keeps it regular
        return covariance

    @cached_property
    def covariance(self) -> Array:
        """Of the position along the normal, (b, b) m^2: as stated, all slow errors of this photo included."""
        light, (own, length) = self.slow
        return self.random() + slow_covariance(self.s, (light, (float(np.hypot(own, self.common[0])), length)))

    @cached_property
    def factor(self) -> Array:
        """Lower triangular (b, b) m; ``factor @ factor.T = covariance``."""
        return np.asarray(np.linalg.cholesky(self.covariance), float)

    @property
    def on_curve(self) -> Array:
        """The same places on the smooth curve, (b, 2) m."""
        normal = np.column_stack([-np.sin(self.theta), np.cos(self.theta)])
        return np.asarray(np.column_stack([self.x, self.y]) - self.offset[:, None] * normal)


def _nowhere() -> Midline:
    none, index = np.zeros(0), np.zeros(0, dtype=np.intp)
    return Midline(none, none, none, none, none, none, none, index, index, 0.0, ((0.0, 0.0), (0.0, 0.0)))


NOWHERE = _nowhere()
"""Of a step that no photo shows."""


def midline(shape: MeasuredShape, *, blocks: int = BLOCKS) -> Midline:
    """Block means of the raw sections with their errors.

    Parameters
    ----------
    shape : MeasuredShape
    blocks : int
        At least that many, of equally many sections each; what is left over at the ends is dropped.

    Raises
    ------
    ValueError
        If there are fewer than eight sections.
    """
    size = shape.section_s.size
    if size < LEAST_SECTIONS:
        raise ValueError(f"{size} midline sections do not make a shape")
    members = max(1, size // blocks)
    left = size % members
    order = np.argsort(shape.section_s, kind="stable")[left // 2 : size - (left - left // 2)]
    s, std = shape.section_s[order], shape.section_std[order]
    distance = shape.section_offsets()[order]
    first = np.arange(0, s.size, members)
    sections = np.full(first.size, members)
    mean = np.add.reduceat(s, first) / sections
    offset = np.add.reduceat(distance, first) / sections
    x, y, theta = shape.at(mean)
    x, y = x - offset * np.sin(theta), y + offset * np.cos(theta)
    # a doubt as large as the cable says all there is to say; more would only drown the noise in rounding errors
    light, waves, alike = np.minimum([shape.systematic_std, shape.wave_std, shape.common_std], np.ptp(s)).tolist()
    own, common = ((light, shape.systematic_length), (waves, shape.wave_length)), (alike, shape.wave_length)
    return Midline(mean, x, y, theta, offset, s, std, first, sections, shape.correlation_length, own, common)


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
    # inside the blocks, which may hold unlike numbers of sections: pairs at a time, up to as many apart as any is wide
    inside = np.add.reduceat(std**2, first)
    for apart in range(1, int(sections.max())):
        pairs = std[apart:] * std[:-apart] * np.exp(-(s[apart:] - s[:-apart]) / rho)
        pairs[block[apart:] != block[:-apart]] = 0.0
        inside += 2.0 * np.bincount(block[apart:], weights=pairs, minlength=first.size)
    covariance[np.diag_indices_from(covariance)] = inside / sections**2
    return np.asarray(covariance)
