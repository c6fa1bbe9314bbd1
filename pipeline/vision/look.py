"""A look at the photos of a specimen before it is measured: what a run would refuse is said at once.

Specimen -> findings, by the first steps of a run: every photo is read, and the cable is sought on it. Files cut off,
black or blurred pictures, a second strip, a poor ground, a wrong scale and pictures of other sizes show here;
nothing is measured.
"""

from __future__ import annotations

from dataclasses import replace

from pipeline.records import Finding, Level, Rejected, Specimen, said_once
from pipeline.settings import VisionSettings
from pipeline.vision.picture_size import of_one_size
from pipeline.vision.series import given_calibration
from pipeline.vision.shots import find_cables


def look_at_photos(specimen: Specimen, settings: VisionSettings) -> tuple[Finding, ...]:
    """What is wrong with the photos of a specimen; a photo that a run would refuse is a warning, all of them an error.

    Raises
    ------
    InputError
        The calibration photos cannot be used.
    """
    shots, covers = find_cables(specimen, next(iter(given_calibration(specimen, settings)), None), settings)
    shots, sizes = of_one_size(shots)
    refused = [shot.found for shot in shots if isinstance(shot.found, Rejected)]
    level: Level = "error" if len(refused) == len(shots) else "warning"
    return (*covers, *sizes, *said_once((one.image, replace(one.finding, level=level)) for one in refused))
