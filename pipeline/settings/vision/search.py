"""Settings of the search for the cable: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.vision.stage import StageSettings


class SegmentationSettings(StageSettings):
    """Search for the cable."""

    sure_width_scatter: float = Field(
        0.04, gt=0, description="relative, robust; a cable's edges keep their distance, a texture's vary by 0.1"
    )
    reduced_side_cells: int = Field(
        1000,
        ge=200,
        description="cells; long side of the reduced photo where the diameter is unknown: a skeleton takes 20 ms",
    )
    first_coarser: int = Field(
        3,
        ge=2,
        description="cells; so many times fewer along a side are tried first where the diameter is unknown: they are"
        " enough for the cable of most photos, and take a third of the time",
    )
    trace_share: float = Field(
        0.03,
        gt=0,
        lt=1,
        description="of the area of the strips that cover most; narrower ones that cover less are specks and writing",
    )
    alone_clear_widths: float = Field(
        3.0, gt=1, description="widths; a strip that comes back to itself as near as that is looked at more closely"
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
    cover_hole_widths: tuple[float, float] = Field(
        (0.5, 3.2), description="widths; radii of holes that the rims of covers leave: covers are 2 to 6 diameters wide"
    )
    ring_roundness: float = Field(
        0.85,
        gt=0,
        le=1,
        description="share of its smallest circle that a hole fills; a disc in cells 0.93 and more, a square 0.64",
    )
    ring_wall_widths: float = Field(
        0.6, gt=0, description="widths; how thick the rim of a cover may be: loops of cable are one width thick"
    )
    ring_free_share: float = Field(
        0.6,
        gt=0,
        lt=1,
        description="of the directions in which the ring is thinner: the cable takes a tenth, a shadow a third of them",
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
    least_slenderness: float = Field(
        10.0, gt=0, description="widths; a shorter strip of unknown width is a fold or a thing: no rod bends on ten"
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
        2.0, gt=0, description="widths; an end nearer than that to the middle of another strip as wide touches it"
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
    accepted_slenderness_ratio: tuple[float, float] = Field(
        (0.6, 1.5),
        description="ratio of length to width as seen and as stated, where no scale is known; covers hide up to a "
        "third of a short, thick cable, and a sheath may be dark at its flanks",
    )
    seen_share: float = Field(
        0.4, gt=0, lt=1, description="share of the median contrast from which a section counts as seen"
    )
    corridor_widths: float = Field(
        2.25, gt=2, description="widths; half corridor kept at full resolution: noise is read up to 1.6 widths away"
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
    beyond_widths: float = Field(
        10.0, gt=0, description="widths; so far beyond a visible end more of the cable is looked for"
    )
    beyond_least_widths: float = Field(
        2.5,
        gt=0,
        description="widths; of the same strip beyond an end make it a piece: a clamp's screw or jaw is shorter",
    )
    beyond_leads_widths: tuple[tuple[float, float], ...] = Field(
        ((1.5, 4.0), (1.5, 10.0), (6.0, 10.0)),
        description="widths; pieces by which a path is led on, how far before its end they end and how long they are: a"
        " short one follows a bend; the end of a mask runs some widths along the border of a shadow",
    )
    beyond_most_share: float = Field(
        3.0,
        gt=0,
        description="of the strip's length; followed no farther: a strip found is at least a quarter of the cable",
    )
    beyond_object_contrast: float = Field(
        0.8,
        gt=0,
        description="of the strip's step; thick things that stand out so much are clamps at the end of what was"
        " followed, those that stand out less may be shadows",
    )
    beyond_darkest: float = Field(
        0.02, gt=0, description="of full range; a ground darker than that is counted as so bright: it tells no share"
    )
    hidden_widths: float = Field(
        15.0,
        gt=0,
        description="widths; what hides an end before an axis that was given is no longer: a clamp of 30 mm on 2 mm",
    )
    unlike_widths: float = Field(
        6.0,
        gt=0,
        description="widths; a longer rest of a strip that looks unlike it is no cover: those are 2 to 6 wide",
    )
    fading_share: float = Field(
        0.5, gt=0, lt=1, description="of the step before an end that is left beyond it: covers leave less, glare more"
    )
    sheet_widths: float = Field(
        60.0, gt=0, description="widths; a sheet of paper across a cable hides no more of it: 300 mm of 5 mm"
    )
    sheet_turn_deg: float = Field(
        60.0, gt=0, lt=90, description="degrees against the chord; a cable turns by twice that at most under a sheet"
    )
    clamp_tail_share: float = Field(
        0.1, gt=0, lt=1, description="of the strip's length; a cable's tail beyond a clamp is shorter, its rest longer"
    )
    whole_share: float = Field(
        0.97, gt=0, lt=1, description="of the known length; a strip so long with free ends is the whole cable"
    )
    beyond_width_off: float = Field(
        0.15,
        gt=0,
        description="relative; a cable's width is constant within 5 %, where a line crosses it edges are lost",
    )
    beyond_contrast: tuple[float, float] = Field(
        (0.6, 1.6),
        description="of the strip's step by its ground's brightness; a shadow leaves it as it is, but stray light and"
        " the camera's curve do not; covers and clamps differ by more",
    )
