"""Settings of the stages of ``vision`` before the sub-pixel measurement: unit and reason in the description."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class StageSettings(BaseModel):
    """Base of the stages: frozen, unknown keys refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class PhotoSettings(StageSettings):
    """Loading of photos."""

    max_megapixels: float = Field(
        120.0, gt=0, description="Mpx; a larger photo is refused before decoding: 12 bytes a pixel would pass 1.5 GB"
    )
    max_file_megabytes: float = Field(
        800.0, gt=0, description="MB; a larger file is refused unread: 120 Mpx of 16-bit colour are 720 MB"
    )
    min_side_px: int = Field(32, ge=1, description="px; a smaller picture shows no cable of five widths and its ground")


class CalibrationSettings(StageSettings):
    """Scale and plane of the photos."""

    given_scale_std: float = Field(
        0.001, gt=0, description="relative; a scale bar read on a photo: one pixel in a thousand"
    )
    cover_diameter_std: float = Field(
        0.004, gt=0, description="relative; 0.05 mm on 12 mm: how well a turned cover is known and its rim is lit"
    )
    cover_height_std: float = Field(
        0.003,
        ge=0,
        description="relative; covers and their travel look larger than the cable below them: 3 mm seen from a metre",
    )
    length_scale_std: float = Field(
        0.005, gt=0, description="relative; 1 mm on 200 mm: how well the length between the axes is known"
    )
    max_scale_std: float = Field(
        0.01, gt=0, description="relative; a source of scale worse than that is no better than the cable's length"
    )
    board_std: float = Field(
        3e-4, gt=0, description="relative; a printed board measured with a ruler: 0.1 mm on 300 mm"
    )
    board_search_px: int = Field(
        2000, ge=500, description="px; long side at which the board is searched, corners are refined at full resolution"
    )
    lens_photos: int = Field(10, ge=3, description="photos; from so many on they may show the board in any position")
    lens_sigmas: float = Field(3.0, gt=0, description="sigmas; a weaker lens term adds more error than it removes")
    max_board_rms_px: float = Field(0.5, gt=0, description="px; real boards reach 0.12 to 0.16 px, bent ones do not")
    one_plane_ratio: float = Field(
        1.5,
        gt=1,
        description="ratio of the corners' rms in one plane to that in free positions; tilts of a degree double it",
    )
    usual_distance_m: float = Field(
        0.4, gt=0, description="m; camera above the cable where nobody says: half the height of a bench stand"
    )
    check_sigmas: float = Field(3.0, gt=0, description="sigmas; one false finding in 400 checks")
    check_floor: float = Field(
        0.005, gt=0, description="relative; smaller deviations change the stiffness by less than one percent"
    )


class SegmentationSettings(StageSettings):
    """Search for the cable."""

    min_contrast_to_noise: float = Field(
        5.0, gt=0, description="ratio; below it the edges' errors stop being Gaussian and false edges win"
    )
    sure_edges_share: float = Field(
        0.95, gt=0, le=1, description="share of sections with both edges from which their distance can show the cable"
    )
    sure_width_off: float = Field(
        0.1, gt=0, description="relative; distance of the edges to a known diameter: scale and blur are off by less"
    )
    sure_width_scatter: float = Field(
        0.04, gt=0, description="relative, robust; a cable's edges keep their distance, a texture's vary by 0.1"
    )
    sure_texture_weight: float = Field(
        0.5, gt=0, le=1, description="weight of the texture beside a strip whose width shows that it is the cable"
    )
    reduced_side_cells: int = Field(
        1000,
        ge=200,
        description="cells; long side of the reduced photo where the diameter is unknown: a skeleton takes 20 ms",
    )
    cells_across: float = Field(
        8.0, ge=4, description="cells across the cable in the reduced photo: a highlight of a fifth is still one cell"
    )
    min_ground_std: float = Field(
        0.002, gt=0, description="fraction of full range; half a level of 8 bits: no ground is calmer than its rounding"
    )
    closing_widths: float = Field(
        0.45, ge=0, lt=1, description="widths; gaps closed in the mask: a highlight takes up to a third of the width"
    )
    opening_widths: float = Field(
        0.3, ge=0, lt=1, description="widths; specks removed: texture is finer than the cable"
    )
    thick_widths: float = Field(
        1.7, gt=1, description="widths; wider things are objects: a soft shadow widens the mask by up to a half"
    )
    max_pieces: int = Field(12, ge=1, description="largest pieces of a mask that are traced; the cable is among them")
    min_piece_widths: float = Field(2.5, gt=0, description="widths; shorter pieces are writing, dirt or texture")
    width_ratio_range: tuple[float, float] = Field(
        (0.5, 1.7), description="ratio to the diameter; mask widths of a cable with shadow or with a rim lost in glare"
    )
    max_width_guesses: int = Field(
        3, ge=1, description="widths tried where the diameter is unknown; 1 was right so far"
    )
    joint_gap_widths: float = Field(
        5.0, ge=0, description="widths; a sticker, glare or crossing interrupts the mask by a few widths"
    )
    ring_gap_widths: float = Field(
        2.5, ge=0, description="widths; a ring or writing on the sheath interrupts the skeleton so far, covers farther"
    )
    min_length_share: float = Field(
        0.2, gt=0, lt=1, description="share of the photo's long side; a shorter strip is not the subject of the photo"
    )
    visible_share: float = Field(
        0.55, gt=0, lt=1, description="share of the known length that must be seen; covers hide up to a quarter"
    )
    max_length_ratio: float = Field(
        1.25, gt=1, description="ratio to the known length; longer strips are rails and edges of the table"
    )
    rival_share: float = Field(
        0.5, gt=0, lt=1, description="share of the longest strip's length, and of the best contrast, of another rival"
    )
    min_branch_widths: float = Field(
        2.5,
        gt=1,
        description="widths; shorter spurs of the skeleton come from the mask's rim, longer ones are branches",
    )
    junction_widths: float = Field(3.5, gt=0, description="widths; strips' ends that meet at a crossing are so near")
    touching_widths: float = Field(
        2.0, gt=0, description="widths; an end nearer than that to the middle of another strip touches it"
    )
    min_partner_widths: float = Field(
        8.0, gt=0, description="widths; an end that meets a strip shorter than that meets a bolt or a letter"
    )
    level_factors: tuple[float, ...] = Field(
        (0.5, 2.0, 0.25), description="ratios to Otsu's level that are tried next: texture may push it up or down"
    )
    higher_levels: int = Field(
        2, ge=0, description="levels tried above Otsu's, each splits what stands above the last: shadow, then cable"
    )
    least_level: float = Field(
        5.0, gt=0, description="sigmas of the ground; a strip above it is no play of noise and texture"
    )
    lowest_level: float = Field(
        3.0, gt=0, description="sigmas of the ground; the last level that is tried, below it noise makes strips"
    )
    max_judged_pictures: int = Field(
        4, ge=1, description="readings with a long strip that are judged; what four of them refuse is not the cable"
    )
    max_covered_share: float = Field(
        0.5, gt=0, le=1, description="share of the photo; a mask that covers more is ground, not cable"
    )
    pair_pooling_widths: float = Field(
        1.0, gt=0, description="widths; sections pooled for the pair of edges: letters are shorter, bends longer"
    )
    pair_search_widths: float = Field(
        0.6, gt=0, description="widths; a shadow as wide as the cable draws the mask's middle half a width aside"
    )
    band_widths: tuple[float, ...] = Field(
        (2.2, 3.2), description="widths; cable and hard shadow together, by a lamp 45 and 25 degrees above the table"
    )
    min_band_edges: float = Field(
        0.5, gt=0, le=1, description="share of sections that show both edges of a cable within a band"
    )
    pair_wander_cost: float = Field(
        0.5,
        ge=0,
        description="usual edges for each column moved; a mask wanders slowly, a jump to a shadow's edge must pay",
    )
    pair_width_range: tuple[float, float] = Field(
        (0.45, 1.6), description="ratios to the width that are tried: half a cable along a highlight, and a shadow's"
    )
    pair_widths: int = Field(26, ge=5, description="widths tried, 5 % apart; the edges are then sought in 15 %")
    pair_width_std: float = Field(
        0.25, gt=0, description="logarithm; how far a given diameter may be off before the edges count for less"
    )
    pair_width_doubt: float = Field(
        0.6, ge=0, lt=1, description="weight of a pair far off the given width: diameters are mistyped"
    )
    pair_width_share: float = Field(
        0.9, gt=0, lt=1, description="ratio to the best pair's score from which a wider pair is preferred"
    )
    edge_reach_widths: float = Field(
        0.1, gt=0, lt=0.5, description="widths; an edge is sought so near to the pair's place; glare is farther"
    )
    least_edge_share: float = Field(
        0.15, gt=0, lt=1, description="ratio to the usual steepest slope; a flatter place is no edge: half is shade"
    )
    texture_widths: float = Field(
        12.0,
        gt=0,
        description="widths; what beside the cable is even along so much of it is light; a fold of cloth is shorter",
    )
    smoothing_widths: float = Field(
        0.8, gt=0, description="widths; smooths the skeleton's steps and shifts a bend of radius ten widths by 0.03"
    )
    accepted_width_ratio: tuple[float, float] = Field(
        (0.65, 1.35), description="ratio of the edges' distance to the diameter; a sheath may be dark at its flanks"
    )
    max_width_scatter: float = Field(0.15, gt=0, description="relative; width of a cable is constant, of a shadow not")
    seen_share: float = Field(
        0.4, gt=0, lt=1, description="share of the median contrast from which a section counts as seen"
    )
    corridor_widths: float = Field(
        2.25, gt=2, description="widths; half corridor kept at full resolution: noise is read up to 1.6 widths away"
    )
    max_blur_widths: float = Field(
        0.2, gt=0, description="widths; beyond it the spreads of both edges overlap in the middle"
    )
    search_margin_share: float = Field(
        0.12, gt=0, description="share of the cable's extent; a step moves the bow by less, else all is searched"
    )
    joint_angle_deg: float = Field(
        30.0,
        gt=0,
        lt=90,
        description="degrees; over five widths a cable turns by less unless its bend radius is ten widths",
    )


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
        (0.9, 3.2),
        description="widths of the cable; range of radii searched where no size is given: covers of 2 to 6 diameters,"
        " and the mask may be a tenth wider or narrower than the cable",
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
    same_radius: float = Field(
        0.04, gt=0, lt=1, description="relative; covers of one rig are turned alike, light and blur move a rim less"
    )
    end_on_rim: float = Field(
        0.4,
        gt=0,
        lt=1,
        description="radii; how far from the rim the cable's mask may end: led straight on by a width at most",
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


class SeriesSettings(StageSettings):
    """Photos of one specimen together."""

    min_travel_m: float = Field(
        2e-4, gt=0, description="m; below it rounding of the log and play of the bearings hide which bearing moves"
    )
    max_fixed_shift_m: float = Field(
        2e-4, gt=0, description="m; the fixed bearing may rock by its play; more means that camera or frame moved"
    )
    max_length_spread: float = Field(
        0.005, gt=0, description="relative; a cable's length is constant, tracing repeats within a tenth of this"
    )
    max_length_deviation: float = Field(
        0.01, gt=0, description="relative; length_mm is measured to about half a percent and so is the scale"
    )


class PreviewSettings(StageSettings):
    """Pictures for people."""

    long_side_px: int = Field(1200, ge=200, description="px; as wide as a report's column on a dense screen")
    strip_widths: float = Field(1.0, gt=0.5, description="cable widths shown on each side of the middle of the strip")
    strip_height_px: int = Field(160, ge=40, description="px; a bend of a hundredth of the width is a pixel high")
    jpeg_quality: int = Field(80, ge=10, le=100, description="percent; about 80 kB a photo without visible blocks")
