"""Settings of the room ``identify``: unit in the name, reason in the description."""

from __future__ import annotations

from pydantic import Field

from pipeline.settings.part import SettingsPart


class IdentifySettings(SettingsPart):
    """How well the rig is known: what ``identify`` weighs forces, displacements and bearing axes by."""

    length_std_relative: float = Field(
        5e-4, gt=0, description="relative; a steel rule read to 0.1 mm on a cable of 200 mm"
    )
    force_std_floor_relative: float = Field(
        2e-4, gt=0, description="of the largest force; a load cell of the best class, however quiet its samples are"
    )
    displacement_std_m: float = Field(
        2e-5, gt=0, description="m; a spindle with a dial gauge, against the chord on the photos"
    )
    axis_std_m: float = Field(
        5e-5,
        ge=0,
        description="m; of each coordinate of a bearing axis, common to all photos: a cover's shadow pulls its rim by "
        "a fifth of a pixel on every photo alike, and covers are glued or screwed on to a twentieth of a mm",
    )
    camera_foot_std_m: float = Field(
        0.05,
        ge=0,
        description="m; of the point below the camera about the picture's middle: 3 degrees off plumb at a metre, or a "
        "photo that was cut",
    )
