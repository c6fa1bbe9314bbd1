"""What the search hands to the sub-pixel measurement: a cable found to about a pixel, and why to trust it.

Pixel coordinates ``(u, v)`` are those of the photo as displayed; (0, 0) is the centre of the top-left pixel, ``u`` runs
right, ``v`` down. Grey values are fractions of the photo's full range (0 black, 1 white) along one colour projection.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.records import Array, Finding
from pipeline.vision.evidence import Evidence
from pipeline.vision.photo import Closeup
from pipeline.vision.polyline import step_lengths

WIDTH_OFF = 0.15
"""Relative; scales and diameters are known to some percent, and light moves both edges of a cable by less: what is
farther off in width is another thing, such as a strip split off along a highlight, which is 30 % too narrow.
"""

AxisKind = Literal["cover", "given", "end", "clamp"]


@dataclass(frozen=True)
class Bearing:
    """A bearing axis on the photo and how it was found.

    Attributes
    ----------
    center_px : (u, v) px
    std_px : px
        Standard deviation of each coordinate of the axis.
    radius_px : px or None
        Of the round cover; None where no cover was measured. The cable is not seen within it.
    radius_std_px : px or None
    kind : str
        ``cover``: centre of the round cover; ``given``: pixels of the user; ``end``: visible end of the cable;
        ``clamp``: the cable disappears in a larger object there.
    sure : bool
        True for a cover that was seen all round, or with a mark on its axis: nothing else looks like that.
    """

    center_px: tuple[float, float]
    std_px: float
    radius_px: float | None = None
    radius_std_px: float | None = None
    kind: AxisKind = "cover"
    sure: bool = False


@dataclass(frozen=True)
class RoughCable:
    """The cable on one photo, to about a pixel.

    Attributes
    ----------
    image : str
        Name relative to the specimen folder.
    path_px : (k, 2) px
        Polyline ``(u, v)`` from the left to the right bearing axis, smooth, points about evenly spaced (at most a
        quarter of the cable's width apart). Where the cable is seen it lies within about a tenth of the width of
        the midline.
    visible : (first, last)
        Indices into ``path_px``, both included: the part in which the cable is seen. Outside, the path runs straight to
        the bearing axis and carries no information.
    half_width_px : px
        Half the width of the cable's mask, median along the cable.
    grey : (h, w) float32
        Window of the photo around the cable, projected to one grey value.
    origin_px : (u, v) px
        Photo pixel of ``grey[0, 0]``: photo pixel ``(u, v)`` is ``grey[v - origin_px[1], u - origin_px[0]]``.
    dark : bool
        True if the cable is darker than the ground in ``grey``.
    contrast : grey
        Median step between ground and cable, positive.
    weights : tuple of float
        Colour projection: weight of each channel as stored (one for grey photos).
    goes_on : bool
        The cable seems to go on beyond an end of it.
    evidence : Evidence
        For being a cable, along the path.
    rival : RoughCable or None
        As it is seen in other colours, or with its ground: measured instead, where this one is refused.
    by_rims : bool
        Seen by the dark lines along its edges, see `pipeline.vision.search.creases`.
    """

    image: str
    path_px: Array
    visible: tuple[int, int]
    left: Bearing
    right: Bearing
    half_width_px: float
    grey: NDArray[np.float32]
    origin_px: tuple[int, int]
    dark: bool
    contrast: float
    weights: tuple[float, ...] = (1.0,)
    findings: tuple[Finding, ...] = ()
    goes_on: bool = False
    evidence: Evidence = field(default_factory=Evidence)
    rival: RoughCable | None = None
    by_rims: bool = False

    @property
    def axes(self) -> tuple[Bearing, Bearing]:
        """The left and the right bearing axis."""
        return self.left, self.right

    @property
    def seen_px(self) -> Array:
        """The part of the path ``(m, 2)`` in which the cable is seen, px."""
        return self.path_px[self.visible[0] : self.visible[1] + 1]

    @property
    def closeup(self) -> Closeup:
        """The window in which the cable is dark."""
        return Closeup(self.grey if self.dark else -self.grey, self.origin_px)

    @property
    def length_px(self) -> float:
        """Length of the path from axis to axis, px."""
        return float(step_lengths(self.path_px).sum())
