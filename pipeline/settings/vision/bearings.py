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
    radius_std_by_cable: float = Field(
        0.05, gt=0, description="relative; where only the cable's width on the photo tells the scale"
    )
    search_radii: float = Field(
        0.12,
        gt=0,
        lt=0.5,
        description="radii; half range along a ray in which the rim is searched around the first guess",
    )
    ring_width: float = Field(
        0.05, gt=0, description="radii; std of the ring that seeks centres: as well as the radius is known"
    )
    near_radii: float = Field(
        0.045, gt=0, description="radii; half range in which edges are sought at last: a bevel is twice as far away"
    )
    light_reach_px: float = Field(
        4.0, ge=2, description="px; half range about an edge in which the light's slopes are fitted with it"
    )
    bevel_spread_share: float = Field(
        0.22,
        ge=0,
        description="of the rim's blur; standard deviation of what a bevel moves the rim all round: half at most on 18"
        " rendered covers",
    )
    min_rim: float = Field(
        0.35, gt=0, lt=1, description="share of the rim with an edge on the circle; chance alone gives a tenth"
    )
    sure_rim: float = Field(0.7, gt=0, lt=1, description="share of the rim; with so much seen no other centre is tried")
    mark_radii: float = Field(
        0.6, gt=0, lt=1, description="radii of a cover; largest dot, screw or bevel that marks the axis of one not seen"
    )
    cover_radii_widths: tuple[float, float] = Field(
        (0.62, 3.2),
        description="widths of the cable; range of radii searched where no size is given: covers of 1.4 to 6 diameters,"
        " and the mask may be a tenth wider or narrower than the cable; a smaller one shows too little of its rim",
    )
    mark_widths: float = Field(
        0.8,
        gt=0,
        description="widths of the cable; largest radius of a dot or screw that marks an axis where no size is given:"
        " half a cover of the usual size",
    )
    mark_cells: float = Field(
        12.0,
        gt=4,
        description="cells; a mark's largest radius in the picture it is searched on: a line stays a cell wide",
    )
    mark_aside: float = Field(
        0.3, gt=0, description="of the distance ahead of the cable's end; how far aside of its direction the axis lies"
    )
    mark_tries: int = Field(
        4, ge=1, description="roundest places where a mark is fitted: edges of cover and shadow pass for round ones"
    )
    astray_radii: float = Field(
        0.16, gt=0, lt=0.5, description="radii; how far a rim that is not sure may lie off the centre: half a bevel"
    )
    sure_center_radii: float = Field(
        0.004, gt=0, description="radii; a centre with a wider std is not sure: shadow or bevel took part of the rim"
    )
    certain_center_px: float = Field(
        0.05,
        gt=0,
        description="px; a rim seen all round that tells its centre so well needs no rings: 0.01 mm at 5 px/mm, less"
        " than the play of a bearing",
    )
    ring_range: tuple[float, float] = Field(
        (0.1, 0.96), description="radii; where dots, grooves and bevels lie: below is a punch mark, above the rim"
    )
    rings: int = Field(2, ge=0, description="rings of a cover that are fitted at most: the strongest tell the most")
    same_axis_radii: float = Field(
        0.03, gt=0, description="radii; a ring farther off was not turned on the axis: a sticker, a hole beside it"
    )
    expected_reach_radii: float = Field(
        2.5,
        gt=1,
        description="radii; a cover of a neighbouring photo is sought again if the cable's end is so near: mostly it is"
        " one away, an end led astray by the cover's shadow two",
    )
    same_end_radii: float = Field(
        0.1,
        gt=0,
        description="radii of a cover, and rad; strips of one photo that end so near and alike show one cover or none:"
        " a tenth of what a mask's end is allowed to be off",
    )
    same_radius: float = Field(
        0.04, gt=0, lt=1, description="relative; covers of one rig are turned alike, light and blur move a rim less"
    )
    end_on_rim: float = Field(
        0.4,
        gt=0,
        lt=1,
        description="radii; how far from the rim the cable's mask may end: led straight on by a width at most",
    )
    lost_before_rim: float = Field(
        1.9,
        gt=1,
        description="radii from where a cable is lost to the centre of a cover; letters up to its rim hide 0.9 of it, a"
        " dot of half the cover's size lies two of its own radii ahead",
    )
    lost_cable_reach: float = Field(
        3.1, gt=1, description="radii; the same where another end shows that it is a cover: as far as it is searched"
    )
    inner_disc: float = Field(
        0.82,
        gt=0,
        lt=1,
        description="radii; bright middle of a cover whose rim is of the ground's look: sought between 0.72 and 0.92,"
        " smaller ones are marks, larger ones pass for the rim",
    )
    rim_tolerance: float = Field(
        0.015,
        gt=0,
        description="radii; an edge so near to the circle belongs to the rim, chance edges spread ten times wider",
    )
    rim_over_texture: float = Field(
        2.5, gt=0, description="ratio to the median slope of the rays; weaker edges are noise and texture"
    )
    pooled_rays: float = Field(1.5, gt=0, description="rays; standard deviation of the pooling along the rim")
    soft_rim_px: float = Field(
        2.5, ge=1, description="px; blur of a rim that is sought where no sharp one is seen: focus lost, or 3 % noise"
    )
    min_soft_rim: float = Field(
        0.5,
        gt=0,
        lt=1,
        description="share of the rim where it is sought as a soft one: neighbouring directions share more, so chance"
        " gives more; focus lost left 0.6, a moved camera, whose rim is doubled, 0.45",
    )
    aside_std_radii: float = Field(
        0.25,
        gt=0,
        description="radii; how far aside of the visible cable's direction the centre lies: bend under the cover",
    )
    directions: int = Field(
        160, ge=90, description="rays of the circle fit at most; more share their pixels and tell little new"
    )
    edge_over_texture: float = Field(
        3.0, gt=0, description="ratio to the median gradient in the window; stronger edges count no more than this"
    )
    candidates: int = Field(3, ge=1, description="best voted centres that are fitted; the rim decides among them")
    center_std_floor_px: float = Field(
        0.02, gt=0, description="px; light and rounding of the cover move the centre by so much whatever the noise"
    )
    trimmed_widths: float = Field(
        0.8, gt=0, description="widths; so much of a skeleton's end runs into a corner of the mask and is replaced"
    )
    cover_margin_widths: float = Field(
        0.1, ge=0, description="widths; the blurred rim of a cover spoils the edges so far beyond its circle"
    )
    stroke_widths: float = Field(
        0.25,
        gt=0,
        description="widths; a shorter change near the end is print: letters are 0.6 high, strokes a sixth of it",
    )
    cut_std_widths: float = Field(
        0.04, gt=0, description="widths; a cut with pliers is square and the path centred to about a twentieth"
    )
    given_std_px: float = Field(1.0, gt=0, description="px; how well a person reads an axis off a screen")
    end_std_widths: float = Field(
        0.1, gt=0, description="widths; a cut or clamped end is found to about a tenth of the cable's width"
    )
    vertical_deg: float = Field(
        10.0,
        gt=0,
        lt=45,
        description="degrees; a chord nearer to the vertical has no left end that a person would agree on",
    )
