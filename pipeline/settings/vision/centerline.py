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
    width_tolerance: float = Field(
        0.15, gt=0, description="relative; prior of the width in the search when the diameter is known, else twice that"
    )
    inside_radii: float = Field(
        0.25,
        gt=0,
        description="of the radius; part of the sheath used for an edge: leaves out highlight and text, and the farther"
        " from the edge, the more shading bends away from the ramp (0.35 moved the midline by a third more)",
    )
    outside_radii: float = Field(
        0.18,
        gt=0,
        description="of the radius; part of the ground used for an edge: more brings more of the ground's texture"
        " (0.45 raised the error of kappa on brushed metal by half), less only more pixel noise",
    )
    edge_window_blurs: float = Field(
        2.5, gt=0, description="blurs; least part of sheath and ground on each side: beyond it the edge's tail is over"
    )
    pixel_outlier: float = Field(
        4.0,
        gt=0,
        description="standard deviations from the profile of the neighbourhood: letters, dirt; Gaussian noise passes it"
        " once in 16,000; at 1.5 times it a pixel of a section has no weight",
    )
    plain_step: float = Field(
        0.1, ge=0, description="of the edge's step; differences up to it are texture or slow light, not letters"
    )
    least_pixel_share: float = Field(
        0.5, gt=0, le=1, description="weight left on a section's pixels; with less there is something else than an edge"
    )
    least_step_sigmas: float = Field(
        3.0,
        ge=0,
        description="standard deviations of an edge's step; a lesser one is none: on paper that hid 12 diameters, edges"
        " of noise along the search's straight bridge moved the midline by 30 px",
    )
    width_departure: float = Field(
        0.08,
        gt=0,
        description="relative; a stretch whose width is farther from the usual one is left out: a cable's is constant"
        " within 5 %",
    )
    edge_outlier: float = Field(
        6.0, gt=0, description="robust standard deviations from the neighbouring edges; the other edge takes over"
    )
    least_sections: int = Field(
        12, ge=8, description="found in the search or measured at all; fewer do not fix a curve that bends both ways"
    )
    cover_check_radii: float = Field(
        0.6,
        gt=0,
        description="of the radius; a section counts where it is free of covers that far out on both sides: inside the"
        " edges' windows",
    )
    least_seen_radii: float = Field(10.0, gt=0, description="of the radius; a shorter seen piece is no measurement")
    longest_side_px: float = Field(
        12.0, gt=3, description="px; more sheath or ground than this adds texture, not knowledge of the edge"
    )
    small_radius_px: float = Field(
        15.0,
        gt=0,
        description="px; thinner cables leave little room for shading: plain error function, see ramps_worth",
    )
    ramps_worth: float = Field(
        1.5,
        ge=1,
        description="ratio of the widths' errors by the plain error function to those with ramps, above which a thin"
        " cable's edges get ramps all the same: they double the scatter, which a ratio near 1 does not repay",
    )
    width_play: float = Field(
        0.04,
        ge=0,
        description="of the width; so much it may be off the expected one throughout: scales and diameters are known to"
        " some percent, and what both edges are off alike leaves the midline in place",
    )
    roundness: float = Field(
        0.005,
        gt=0,
        description="of the width; a sheath is round and even so far: edges whose places are surer than that are"
        " averaged, the width of the cable tells nothing of them",
    )
    profile_windows: int = Field(
        16, ge=1, description="along the cable; in each, blur and shading of the edges are found: light turns slowly"
    )
    section_spacing_diameters: float = Field(
        0.6, gt=0, description="diameters; sections closer than that tell the same of kappa, see knot_spacing_diameters"
    )
    min_sections: int = Field(
        240, ge=60, description="of a short cable; fewer would average over bends, their errors are nearly independent"
    )
    max_sections: int = Field(1000, ge=60, description="of a long cable; bounds the time of the fit")
    knot_spacing_diameters: float = Field(
        1.5, gt=0, description="diameters; a cable cannot bend more sharply than over its own width"
    )
    min_intervals: int = Field(16, ge=4, description="knot intervals; fewer bias kappa at mid-span above 0.05 %")
    first_intervals: int = Field(
        36, ge=4, description="knot intervals tried first; a bow between two bearings uses ten to fifteen"
    )
    crowded_share: float = Field(
        0.6,
        gt=0,
        lt=1,
        description="of the parameters in effective use, above which knots are doubled: the penalty, not"
        " the knots, shall decide",
    )
    path_knot_diameters: float = Field(
        5.0,
        gt=0,
        description="diameters; knots of the path that the edges are sought along, and first try of a long cable",
    )
    most_path_intervals: int = Field(120, ge=16, description="knot intervals of that path; bounds the time")
    penalty_order: int = Field(
        3,
        ge=1,
        le=3,
        description="derivative of kappa that is penalised: 3 leaves a parabola free, the bow's first shape;"
        " 2 was 30 % worse inside the span",
    )
    longest_correlation_diameters: float = Field(
        2.0,
        gt=0,
        description="diameters; bound of the errors' correlation length, longer ones cannot be told from a bend",
    )
    least_balance: float = Field(
        0.8,
        ge=0,
        le=1,
        description="of both edges in a section (1: they count alike) for its width to tell how long errors"
        " last: one edge then has four times the other's variance",
    )
    slow_light_order: int = Field(
        5,
        ge=1,
        description="of the polynomial of s that level and step of an edge follow on an even sheath and ground: light"
        " turns with the cable, once from end to end",
    )
    least_slow_sections: int = Field(
        80, ge=20, description="edges of a side; fewer do not tell how far level and step depart from that polynomial"
    )
    least_slow_share: float = Field(
        0.9,
        gt=0,
        le=1,
        description="of the sections, by edge; where fewer show it, what they show is no even light: white on white,"
        " edges held to it made a curve that looked right, 20 px beside the cable",
    )
    slow_width_order: int = Field(
        5,
        ge=1,
        description="of the polynomial of s that the width may follow by light, lens and distance of the camera",
    )
    bias_share: float = Field(
        0.5,
        ge=0,
        le=1,
        description="part of the penalty's bias that counts as uncertainty: an equilibrium is smoother than"
        " the penalty allows; with 1 the 95 % band of kappa covered 98.6 % of smooth bows, with 0 92 %, with 0.5 97 %",
    )
    lay_pitch_widths: float = Field(
        0.25, gt=0, description="widths; places along the cable at which the photos' midlines are held together"
    )
    lay_smooth_widths: float = Field(
        1.5,
        gt=0,
        description="widths; standard deviation of the running mean that is left alone: of a wave four widths long, the"
        " lay of a twisted pair, a twentieth is left, of a soft spot that long nine tenths",
    )
    light_length_share: float = Field(
        0.35,
        gt=0,
        description="of the seen length; correlation length of the light's error: it follows the cable's"
        " direction, which turns once from end to end; over 135 scenes 0.35 was likelier than 0.25 and 0.5",
    )
    width_excess: float = Field(
        1.5,
        ge=1,
        description="ratio of the errors by the width's variation to those that scatter and light tell, above which"
        " the former count: over ten effective parameters chance passes it once in a hundred",
    )
    least_wave_px: float = Field(
        0.01,
        ge=0,
        description="px; waves in a midline that no width need show: grid of pixels, demosaicing, tone curve; of this"
        " size they are on photos of even light and little noise",
    )
    least_wave_gain: float = Field(
        7.8,
        ge=0,
        description="-2 log likelihood that waves in the widths must gain: three parameters gain as much by chance once"
        " in twenty series at most",
    )
    points: int = Field(201, ge=20, description="points of the centerline: 1 mm for a cable of 0.2 m")
    max_band_percent: float = Field(
        30.0,
        gt=0,
        description="per cent of the range of curvature; a photo whose 95 % band is wider on either side tells no law",
    )
    axis_distance_radii: float = Field(
        0.25,
        gt=0,
        description="of the radius; a centerline that misses a bearing axis by more is worth a warning: over 100"
        " rendered rigs right ones missed by 0.06 at most",
    )
    least_departure: float = Field(
        0.25,
        gt=0,
        description="of the second derivative of a half wave; so far the curvature under a cover may depart from the"
        " bow of a straight law however well the seen part keeps to it: with 1 the last 10 mm of path-traced photos"
        " were off by 4.1 % of kappa_max, with 0.25 by 3.6 %, with 0.1 no better, and the bands of all cover",
    )
    axis_play_widths: float = Field(
        0.02,
        gt=0,
        description="widths; how far a cable sits beside its bearing's axis: 0.1 mm on 5 mm, the play of a sheath in a"
        " bore made for it",
    )
