"""A commented ``specimen.toml`` to fill in, for a folder that has photos and a force log but no description yet."""

from __future__ import annotations

import json
from pathlib import Path

from pipeline.errors import InputError
from pipeline.intake.folder import candidate_logs
from pipeline.intake.photos import list_photos, no_photos
from pipeline.intake.specimenfile import NAME, folder_name
from pipeline.messages import Message
from pipeline.settings.intake import IntakeSettings

TEMPLATE = """\
# Description of one bending test for cablebend. Lines with "# key = ..." are optional: remove the # to use them.
# In this folder: {photos} photos{logs}.

[specimen]
id = "{id}"                 # name of the result; default: the folder's name
length_mm = 0.0             # TO FILL IN: cable length between the two bearing axes
diameter_mm = 0.0           # TO FILL IN: outer diameter of the cable
# type = "..."              # free text; specimens of one type are pooled in the index
# batch = "..."
# notes = "..."
# temperature_C = 23.0

[camera]                    # where the scale comes from; the first that is given counts
# scale_px_per_mm = 10.0    # a number, or
# calibration = "calibration"                              # a folder of chessboard photos in the plane of the cable
# board = {{columns = 9, rows = 6, square_mm = 10.0}}        # with inner corners and the measured side of a square
# distance_mm = 400.0       # camera to that plane, to correct for the height of the cable axis
# neither: bearing distance by the displacement log, or the diameter of the bearing covers

[rig]
moving_bearing = "left"     # or "right"
# bearing_marker_mm = 12.0  # diameter of the round cover on each bearing axis
# bearings_px = [[100, 500], [2000, 500]]  # axes in the first photo, left and right, where no cover can be seen
# force_sign = "compression"               # or "tension": which sign of the log means compression

# [[photos]]                # one such table for each photo that you correct, in px of that photo
# image = "images/step_03.png"
# use = false               # leave it out; its step keeps its force
# region_px = [100, 50, 2000, 900]         # look for the cable only here
# exclude_px = [[[400, 300], [460, 300], [460, 380]]]      # polygons around what hides or touches the cable
# path_px = [[100, 500], [700, 300], [1300, 480]]          # clicks along the cable, from end to end
# ends_px = [[100, 500], [1300, 480]]      # where its axis meets the bearing axes, or ends

[force_log]                 # only what cannot be told from the file itself
{file}# columns = {{force = "Kraft [N]", displacement = "Weg [mm]", step = "Schritt", image = "Bild"}}
# units = {{force = "N", displacement = "mm", time = "s"}}
# decimal = ","             # or "."
# separator = ";"           # or "," or "\\t"
# encoding = "cp1252"       # or "utf-8", "utf-16"
"""


def write_template(folder: Path, settings: IntakeSettings) -> Path:
    """Write a commented ``specimen.toml`` into a folder; its path.

    Raises `InputError` ``init/exists`` if there is one already, ``folder/missing``, ``folder/no-photos``.
    """
    path = folder / NAME
    if not folder.is_dir():
        raise InputError(Message("folder/missing.photos"), path=folder)
    photos = list_photos(folder, without=None, settings=settings)
    if not photos:
        raise no_photos(folder, settings)
    logs = candidate_logs(folder)
    text = TEMPLATE.format(
        id=folder_name(folder),
        photos=len(photos),
        logs=f" and the table{'s' * (len(logs) > 1)} {', '.join(logs[:5])}" if logs else ", but no force log yet",
        file=f"file = {json.dumps(logs[0], ensure_ascii=False)}\n" if len(logs) == 1 else '# file = "force.csv"\n',
    )
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError as error:
        raise InputError(Message("init/exists"), path=path) from error
    return path
