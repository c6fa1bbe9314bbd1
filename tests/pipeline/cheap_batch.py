"""Batches whose measurement costs milliseconds: everything around it is the real thing.

Specimens are small real folders; the stand-in for the measurement reads them, opens every photo with the program's own
loader and follows what the specimen's notes ask for (die, hang, fail, fill the disk). Also a program of its own, to be
interrupted and killed: ``python -m tests.pipeline.cheap_batch FOLDER OUT [--scheduler ADDRESS]``. With the environment
variable ``HELD_BEYOND_FIVE_IN`` = OUT it holds once five specimens are stored: whoever interrupts it is never too late.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from unittest import mock

import cv2
import numpy as np

from pipeline.batch import run_batch
from pipeline.batch.specimen import Stages
from pipeline.cli.run import exit_code
from pipeline.intake.folder import find_specimens
from pipeline.settings import Settings

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 300.0  # ends a test that hangs; a run takes 10 s on an idle machine and minutes on a busy one
TOML = """\
[specimen]
id = "{id}"
length_mm = 181.0
diameter_mm = 4.6
notes = "{notes}"

[camera]
scale_px_per_mm = 11.0
"""
LOG = """\
step,branch,displacement_mm,force_N,image
0,mounted,0.0,-0.002,
0,mounted,0.0,0.003,
0,mounted,0.0,0.001,images/step_0.png
1,loading,4.0,2.301,
1,loading,4.0,2.304,
1,loading,4.0,2.298,images/step_1.png
2,loading,8.0,2.902,
2,loading,8.0,2.899,
2,loading,8.0,2.903,images/step_2.png
"""


def write_specimens(folder: Path, names, *, notes: str = "") -> None:
    """Small specimens with three photos each, all photos different."""
    for number, name in enumerate(names):
        place = folder / name
        (place / "images").mkdir(parents=True)
        (place / "specimen.toml").write_text(TOML.format(id=name, notes=notes))
        (place / "force.csv").write_text(LOG)
        for step in range(3):
            photo = np.full((48, 64), 200, np.uint8)
            photo[20 + step, :] = (50 + number) % 200
            photo[0, 0] = number % 256
            (place / f"images/step_{step}.png").write_bytes(cv2.imencode(".png", photo)[1].tobytes())


def cheap_stages() -> Stages:
    """The stand-in, as functions inside a function: they travel to workers by value, whoever started these."""

    def measure(folder, settings, *, command):
        import os
        import signal
        import time

        from pipeline.intake.folder import read_specimen
        from pipeline.records import Rejected
        from pipeline.result import FindingPart, PhotoPart, Result, SpecimenPart
        from pipeline.vision.photo import load_photo

        specimen = read_specimen(Path(folder), settings.intake)
        held, parent = os.environ.get("HELD_BEYOND_FIVE_IN"), os.getppid()
        while held and os.getppid() == parent and len(list(Path(held).glob("*/entry.json"))) >= 5:
            time.sleep(0.05)
        wish, _, argument = specimen.description.get("notes", "").partition(" ")
        if wish == "delay":
            time.sleep(float(argument))
        elif wish == "die":
            os.kill(os.getpid(), signal.SIGKILL)
        elif wish == "die-once" and not Path(argument).exists():
            Path(argument).touch()
            os._exit(1)
        elif wish == "hang":
            grown = b"x" * int(argument or 0)
            time.sleep(3600.0 + len(grown))
        elif wish == "bug":
            raise ZeroDivisionError("float division by zero")
        elif wish == "memory":
            raise MemoryError
        loaded = {name: load_photo(path, settings.vision.photo) for name, path in specimen.images.items()}
        rejected = {name: photo for name, photo in loaded.items() if isinstance(photo, Rejected)}
        photos = [
            PhotoPart(image=name, step=0, status="rejected", reason=rejected[name].reason)
            if name in rejected
            else PhotoPart(image=name, step=0, status="traced", chord_m=float(photo.pixels.mean()))
            for name, photo in loaded.items()
        ]
        notes = [FindingPart(code=f.code, level=f.level, message=f.message) for f in specimen.findings]
        lost = len(specimen.steps) - len(loaded) + len(rejected)
        return Result(
            status="partial" if lost else "measured",
            headline=f"{lost} photos lost: " + "; ".join(f"{p.image}: {p.reason}" for p in rejected.values())
            if lost
            else "measured",
            specimen=SpecimenPart(
                id=specimen.id, folder=str(folder), length_m=specimen.length_m, description=specimen.description
            ),
            photos=photos,
            findings=notes,
            provenance={"command": command},
        )

    def write(result, folder, settings):
        import resource

        from pipeline.result import to_json

        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        if result.specimen.description.get("notes") == "full":
            resource.setrlimit(resource.RLIMIT_FSIZE, (100, limits[1]))
        try:
            (folder / "result.json").write_text(to_json(result) + "\n")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)

    def write_index(out, settings):
        import json

        from pipeline.batch import Store

        store = Store(out)
        rows = [json.dumps(store.entry(name), sort_keys=True) for name in store.names()]
        (out / "index.txt").write_text("\n".join(rows) + "\n")
        return []

    return Stages(measure, write, write_index)


def run_cheaply(folder: Path, out: Path, *, scheduler: str | None = None, on_outcome=lambda *a: None, **batch):
    """Run a batch with the stand-in; the version is held still, or a source file saved meanwhile would be a new one."""
    settings = Settings.model_validate({"batch": {"workers": 2} | batch})
    found = find_specimens([folder], settings.intake)
    with mock.patch("pipeline.batch.orders.code_version", return_value="test"):
        return run_batch(found, out, settings, scheduler=scheduler, stages=cheap_stages(), on_outcome=on_outcome)


def start(*arguments, **environment) -> subprocess.Popen:
    """A batch as a program of its own, in a group of its own so that it can be interrupted as a terminal does."""
    command = [sys.executable, "-m", "tests.pipeline.cheap_batch", *map(str, arguments)]
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, cwd=ROOT, start_new_session=True, env=os.environ | environment, **silent)


def wait_for(condition, process: subprocess.Popen, seconds: float = PATIENCE_S) -> None:
    until = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < until
        time.sleep(0.05)


def stored(out: Path) -> dict[str, bytes]:
    """Everything a batch left, by name, but for the log, which has times in it."""
    files = (path for path in sorted(out.rglob("*")) if path.is_file() and ".cablebend" not in path.parts)
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in files if path.name != "cablebend.log"}


def main() -> int:
    """Run a batch as a program of its own."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--scheduler")
    options = parser.parse_args()
    return exit_code(run_cheaply(options.folder, options.out, scheduler=options.scheduler))


if __name__ == "__main__":
    sys.exit(main())
