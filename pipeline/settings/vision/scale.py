"""Settings of scale and plane of the photos: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.vision.stage import StageSettings


class CalibrationSettings(StageSettings):
    """Scale and plane of the photos."""

    given_scale_std: float = Field(
        0.001, gt=0, description="relative; a scale bar read on a photo: one pixel in a thousand"
    )
    cover_diameter_std: float = Field(
        0.004, gt=0, description="relative; 0.05 mm on 12 mm: how well a turned cover is known and its rim is lit"
    )
    cover_height_m: float = Field(
        1e-3, ge=0, description="m; top of a cover or marker above the cable's upper side: a lid and its screw"
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
    corner_reach: float = Field(
        0.4, gt=0, lt=0.5, description="squares; how far from a corner its edges are fitted: before the next corner's"
    )
    corner_margin: float = Field(
        0.9, gt=0, le=1, description="share of the white margin beside a ChArUco marker; the rest is the marker's blur"
    )
    corner_reach_px: float = Field(
        20.0,
        gt=4,
        description="px; longer edges hardly help, and a lens bends them: 1 % of barrel by 0.005 px over 20 px",
    )
    corner_pixels: int = Field(36, ge=12, description="pixels; nine unknowns of a corner, each from four")
    corner_blur_px: float = Field(
        1.5, gt=0, description="px; blur at the start, wide enough to reach the edge from a pixel"
    )
    corner_step_px: float = Field(1e-3, gt=0, description="px; a tenth of what noise leaves at best")
    corner_contrast: float = Field(
        2.0, gt=0, description="half the step from black to white over the rms that the fit leaves; noise of 10 % has 4"
    )
    corner_move: float = Field(
        0.15, gt=0, description="squares; a corner found farther from its start is another thing"
    )
    lens_photos: int = Field(10, ge=3, description="photos; from so many on they may show the board in any position")
    usual_lens: float = Field(
        0.02, gt=0, description="relative; standard deviation of k1 at half the diagonal among lenses nobody corrected"
    )
    corner_std_px: float = Field(
        0.15, gt=0, description="px; corners of real boards off the plane, before they are fitted"
    )
    lens_sigmas: float = Field(
        3.0, gt=0, description="sigmas; a weaker k2 or tangential term adds more error than it removes"
    )
    max_board_rms_px: float = Field(0.5, gt=0, description="px; real boards reach 0.12 to 0.16 px, bent ones do not")
    max_border_std: float = Field(
        0.002,
        gt=0,
        description="relative, scale at the border against the middle; curvature is off by half of it, 0.1 %",
    )
    one_plane_ratio: float = Field(
        1.5,
        gt=1,
        description="ratio of the corners' rms in one plane to that in free positions; tilts of a degree double it",
    )
    usual_distance_m: float = Field(
        0.8,
        gt=0,
        description="m; camera above the cable where nobody says; twice the standard deviations that follow from it"
        " reach a bench stand of 0.4 m",
    )
    check_sigmas: float = Field(3.0, gt=0, description="sigmas; one false finding in 400 checks")
    check_floor: float = Field(
        0.005, gt=0, description="relative; smaller deviations change the stiffness by less than one percent"
    )
