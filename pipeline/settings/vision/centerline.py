"""Settings of the sub-pixel measurement of the centerline: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.vision.stage import StageSettings


class CurveSettings(StageSettings):
    """Edges of the cable, midline, curvature spline and the figures that forbid a measurement."""

    search_radii: float = Field(
        0.35,
        gt=0,
        lt=1,
        description="of the radius; how far from its expected place an edge is sought: a path misled by"
        " a shadow is off by less, the next false edge (highlight, text) is mostly farther",
    )
    least_sections: int = Field(
        12, ge=8, description="found in the search or measured at all; fewer do not fix a curve that bends both ways"
    )
    least_slow_sections: int = Field(
        80, ge=20, description="edges of a side; fewer do not tell how far level and step depart from that polynomial"
    )
    slow_width_order: int = Field(
        5,
        ge=1,
        description="of the polynomial of s that the width may follow by light, lens and distance of the camera",
    )
    light_length_share: float = Field(
        0.35,
        gt=0,
        description="of the seen length; correlation length of the light's error: it follows the cable's"
        " direction, which turns once from end to end; over 135 scenes 0.35 was likelier than 0.25 and 0.5",
    )
    points: int = Field(201, ge=20, description="points of the centerline: 1 mm for a cable of 0.2 m")
    max_band_percent: float = Field(
        30.0,
        gt=0,
        description="per cent of the range of curvature; a photo whose 95 % band is wider on either side tells no law",
    )
