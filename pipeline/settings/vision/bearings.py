"""Settings of bearing covers and axes: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.vision.stage import StageSettings


class BearingSettings(StageSettings):
    """Bearing covers and axes."""

    radius_std: float = Field(
        0.01,
        gt=0,
        description="relative; of a cover's radius in px where the scale is known: 0.1 mm on 12 mm, and light",
    )
    search_radii: float = Field(
        0.12,
        gt=0,
        lt=0.5,
        description="radii; half range along a ray in which the rim is searched around the first guess",
    )
    near_radii: float = Field(
        0.045, gt=0, description="radii; half range in which edges are sought at last: a bevel is twice as far away"
    )
    min_rim: float = Field(
        0.35, gt=0, lt=1, description="share of the rim with an edge on the circle; chance alone gives a tenth"
    )
    sure_rim: float = Field(0.7, gt=0, lt=1, description="share of the rim; with so much seen no other centre is tried")
    mark_cells: float = Field(
        12.0,
        gt=4,
        description="cells; a mark's largest radius in the picture it is searched on: a line stays a cell wide",
    )
    same_axis_radii: float = Field(
        0.03, gt=0, description="radii; a ring farther off was not turned on the axis: a sticker, a hole beside it"
    )
    same_radius: float = Field(
        0.04, gt=0, lt=1, description="relative; covers of one rig are turned alike, light and blur move a rim less"
    )
    inner_disc: float = Field(
        0.82,
        gt=0,
        lt=1,
        description="radii; bright middle of a cover whose rim is of the ground's look: sought between 0.72 and 0.92,"
        " smaller ones are marks, larger ones pass for the rim",
    )
    rim_over_texture: float = Field(
        2.5, gt=0, description="ratio to the median slope of the rays; weaker edges are noise and texture"
    )
    center_std_floor_px: float = Field(
        0.02, gt=0, description="px; light and rounding of the cover move the centre by so much whatever the noise"
    )
    cover_margin_widths: float = Field(
        0.1, ge=0, description="widths; the blurred rim of a cover spoils the edges so far beyond its circle"
    )
    given_std_px: float = Field(1.0, gt=0, description="px; how well a person reads an axis off a screen")
    vertical_deg: float = Field(
        10.0,
        gt=0,
        lt=45,
        description="degrees; a chord nearer to the vertical has no left end that a person would agree on",
    )
