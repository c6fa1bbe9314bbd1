"""Settings of the room ``intake``: what a specimen folder may hold and when its contents are doubted."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class IntakeSettings(BaseModel):
    """Limits and thresholds of ``intake``."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    # Untrusted input
    allow_outside: bool = Field(
        False, description="read files outside the specimen folder (links, '..'); off: folders may come from strangers"
    )
    toml_max_bytes: int = Field(
        1_000_000, gt=0, description="bytes; a thousand times what a commented specimen.toml needs"
    )
    log_max_bytes: int = Field(
        50_000_000, gt=0, description="bytes; a day at 10 samples a second is 40 MB, read in a few seconds"
    )
    photo_max_bytes: int = Field(
        800_000_000,
        gt=0,
        description="bytes; 120 Mpx of 16-bit colour are 720 MB; as vision.photo.max_file_megabytes, for photos "
        "measured without a folder",
    )
    photos_max: int = Field(10_000, gt=0, description="photos in one folder; a test has tens of steps")
    steps_max: int = Field(10_000, gt=0, description="steps in one force log; as many as photos")
    search_depth: int = Field(12, gt=0, description="folders below the given one; deeper trees are linked or a mistake")

    # Force log
    header_search_lines: int = Field(
        300, gt=0, description="lines; the metadata blocks of testing machines have up to about 100"
    )
    number_limit: float = Field(
        1e9, gt=0, description="N, mm, s or count; beyond any test, so a number that large is a slipped digit or damage"
    )
    epoch_s: float = Field(1e7, gt=0, description="s; times beyond 115 days count from an epoch and are made relative")
    same_displacement_relative: float = Field(
        2e-3, gt=0, description="of the travel; encoders scatter below 0.1 %, steps are above 1 % of the travel"
    )
    hold_min_samples: int = Field(
        3, gt=1, description="samples; in a log without step numbers shorter plateaus are part of the ramp"
    )
    hold_over_ramp: float = Field(
        3.0,
        gt=1,
        description="times the median stretch of a ramp; in a log without step numbers, sampled often enough to show "
        "stretches of constant displacement on the way, too, longer ones are holds",
    )
    ramp_min_stretches: int = Field(
        5, gt=1, description="stretches in a row, each just beside the last; fewer are holds at almost one displacement"
    )
    zero_force_relative: float = Field(
        0.05, gt=0, description="of the largest force; at displacement 0 a cable with more is not force-free"
    )
    sign_share: float = Field(
        0.75, gt=0.5, le=1.0, description="of the loaded steps; so many of one sign decide the sign of the log"
    )

    # Displacement at the time of the photo
    place_min_changes: int = Field(
        8,
        gt=1,
        description="changes from sample to sample, over all holds; fewer tell the scatter of the displacement worse "
        "than to a third",
    )
    place_wander: float = Field(
        1.5,
        gt=1,
        description="times the scatter from sample to sample; a hold whose samples lie wider about their median moves, "
        "and only the sample at the photo says where the bearing stood",
    )

    # Force at the time of the photo
    trend_degree_max: int = Field(
        4, ge=0, description="degree of the polynomial in time; relaxation over a hold is followed to 1 % by degree 4"
    )
    trend_level: float = Field(
        0.01, gt=0, lt=1, description="significance at which the holds together ask for one degree more; few false ones"
    )
    wild_force_relative: float = Field(
        1.0,
        gt=0,
        description="of the largest median force of a hold; a sample further from those of its hold is no noise and no "
        "relaxation of a cable",
    )
    still_force_sigma: float = Field(
        4.0,
        gt=0,
        description="standard deviations; a log none of whose forces differs by more from one and the same tells of no "
        "cable: of a test that could be used the largest force has hundreds",
    )
    still_force_relative: float = Field(
        2e-3,
        gt=0,
        description="of the largest force; without a mounted step forces must change by more over three steps: half "
        "the travel over the length, for a travel of 2 % at least three times this",
    )
    force_std_relative: float = Field(
        3e-3, gt=0, description="of the largest force; where no hold has repeated samples: a load cell of class 0.5"
    )

    # Plausible size
    length_range_mm: tuple[float, float] = Field(
        (5.0, 20_000.0), description="mm; outside, the length is surely in another unit"
    )
    diameter_range_mm: tuple[float, float] = Field(
        (0.05, 500.0), description="mm; from a fine wire to a submarine cable; outside, surely another unit"
    )
    scale_range_px_per_mm: tuple[float, float] = Field(
        (0.05, 5_000.0), description="px/mm; from a phone at 10 m to a microscope; outside, surely another unit"
    )
    cable_width_min_px: float = Field(
        4.0,
        gt=0,
        description="px; diameter times the scale given: a cable thinner than this on the photos has no two edges to "
        "measure, and the scale was probably written as mm per px",
    )
    slenderness_min: float = Field(
        5.0, gt=0, description="length / diameter; below, a cable is no rod in bending and a unit is probably wrong"
    )
    modulus_range_mpa: tuple[float, float] = Field(
        (2.0, 40_000.0),
        description="MPa; P L^2/(pi^2 I) of a full round section: rubber alone has 2 to 10 MPa, copper strands that "
        "stick together 40 GPa; a thousandfold error of the force leaves this range for most cables",
    )
