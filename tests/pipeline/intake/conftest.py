import textwrap
from pathlib import Path

import pytest

from pipeline.intake.folder import read_specimen
from pipeline.settings.intake import IntakeSettings

TOML = """\
[specimen]
length_mm = 181.0
diameter_mm = 4.6

[camera]
scale_px_per_mm = 11.0
"""
LOG = """\
step,branch,time_s,displacement_mm,force_N,image
0,mounted,1.0,0.0,-0.002,
0,mounted,5.0,0.0,0.003,
0,mounted,9.0,0.0,0.001,step_0.png
1,loading,61.0,4.0,2.301,
1,loading,65.0,4.0,2.304,
1,loading,69.0,4.0,2.298,step_1.png
2,loading,121.0,8.0,2.902,
2,loading,125.0,8.0,2.899,
2,loading,129.0,8.0,2.903,step_2.png
"""
BEGIN = b"\x89PNG"  # of a picture; the rest is its name
PHOTOS = ("images/step_0.png", "images/step_1.png", "images/step_2.png")


class SpecimenFolder:
    """A specimen folder on disk, and what the intake makes of it. Photos are told apart, not looked at."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def write(self, name: str, content: str | bytes) -> Path:
        target = self.path / name
        target.parent.mkdir(parents=True, exist_ok=True)
        data = content.encode() if isinstance(content, str) else content
        target.write_bytes(data)
        return target

    def read(self, **settings):
        return read_specimen(self.path, IntakeSettings(**settings))

    def codes(self, **settings) -> list[str]:
        return [finding.code for finding in self.read(**settings).findings]

    def message(self, code: str, **settings) -> str:
        found = [finding.message for finding in self.read(**settings).findings if finding.code == code]
        assert len(found) == 1, found
        return found[0]


@pytest.fixture
def specimen_folder(tmp_path):
    """Makes specimen folders: ``specimen_folder(log=..., toml=..., photos=..., name=...)``."""

    def make(log=LOG, toml=TOML, photos=PHOTOS, name="cable-07", more=""):
        folder = SpecimenFolder(tmp_path / name)
        folder.write("specimen.toml", toml + textwrap.dedent(more))
        if log is not None:
            folder.write("force.csv", log)
        for photo in photos:
            folder.write(photo, BEGIN + photo.encode())
        return folder

    return make
