"""Settings of the room ``intake``: what a specimen folder may hold, and which cables and load cells are usual."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.part import SettingsPart


class IntakeSettings(SettingsPart):
    """Limits of ``intake``, and what it takes for usual."""

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
        description="bytes; a larger photo is refused unread: 120 Mpx of 16-bit colour are 720 MB",
    )
    photos_max: int = Field(10_000, gt=0, description="photos in one folder; a test has tens of steps")
    steps_max: int = Field(10_000, gt=0, description="steps in one force log; as many as photos")
    search_depth: int = Field(12, gt=0, description="folders below the given one; deeper trees are linked or a mistake")

    # Cables and load cells
    force_std_relative: float = Field(
        3e-3, gt=0, description="of the largest force; where no hold has repeated samples: a load cell of class 0.5"
    )
    modulus_range_mpa: tuple[float, float] = Field(
        (2.0, 40_000.0),
        description="MPa; P L^2/(pi^2 I) of a full round section: rubber alone has 2 to 10 MPa, copper strands that "
        "stick together 40 GPa; a thousandfold error of the force leaves this range for most cables",
    )
