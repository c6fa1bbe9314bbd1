"""Settings of the search for the cable: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.vision.stage import StageSettings


class SegmentationSettings(StageSettings):
    """Search for the cable."""

    cells_across: float = Field(
        8.0, ge=4, description="cells across the cable in the reduced photo: a highlight of a fifth is still one cell"
    )
    min_ground_std: float = Field(
        0.002, gt=0, description="fraction of full range; half a level of 8 bits: no ground is calmer than its rounding"
    )
    thick_widths: float = Field(
        1.7, gt=1, description="widths; wider things are objects: a soft shadow widens the mask by up to a half"
    )
    min_piece_widths: float = Field(2.5, gt=0, description="widths; shorter pieces are writing, dirt or texture")
    width_ratio_range: tuple[float, float] = Field(
        (0.5, 1.7), description="ratio to the diameter; mask widths of a cable with shadow or with a rim lost in glare"
    )
    least_slenderness: float = Field(
        10.0, gt=0, description="widths; a shorter strip of unknown width is a fold or a thing: no rod bends on ten"
    )
    min_partner_widths: float = Field(
        8.0, gt=0, description="widths; an end that meets a strip shorter than that meets a bolt or a letter"
    )
    pair_search_widths: float = Field(
        0.6, gt=0, description="widths; a shadow as wide as the cable draws the mask's middle half a width aside"
    )
    pair_width_doubt: float = Field(
        0.6, ge=0, lt=1, description="weight of a pair far off the given width: diameters are mistyped"
    )
    smoothing_widths: float = Field(
        0.8, gt=0, description="widths; smooths the skeleton's steps and shifts a bend of radius ten widths by 0.03"
    )
    seen_share: float = Field(
        0.4, gt=0, lt=1, description="share of the median contrast from which a section counts as seen"
    )
    joint_angle_deg: float = Field(
        30.0,
        gt=0,
        lt=90,
        description="degrees; over five widths a cable turns by less unless its bend radius is ten widths",
    )
    beyond_least_widths: float = Field(
        2.5,
        gt=0,
        description="widths; of the same strip beyond an end make it a piece: a clamp's screw or jaw is shorter",
    )
