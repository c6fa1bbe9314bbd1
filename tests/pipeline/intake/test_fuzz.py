"""Whatever bytes a specimen folder holds: a valid record or an `InputError`, never another exception.

Two kinds of input: arbitrary bytes, and valid files with damage. Together at least 10,000 examples by default; set
CABLEBEND_FUZZ to multiply them.
"""

import math
import os
import random
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pipeline.errors import InputError
from pipeline.intake.forcelog import read_force_log
from pipeline.intake.specimenfile import LogSpec, read_specimen_file
from pipeline.settings.intake import IntakeSettings

SETTINGS = IntakeSettings()
EXAMPLES = int(os.environ.get("CABLEBEND_FUZZ", "1")) * 2500
fuzz = settings(max_examples=EXAMPLES, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))

TOML = b"""[specimen]
id = "a"
length_mm = 181.0
diameter_mm = 4.6
[camera]
board = {columns = 9, rows = 6, square_mm = 10.0}
[rig]
bearings_px = [[100, 500.5], [2000, 498]]
[force_log]
columns = {force = "Kraft [N]", displacement = 3}
"""
NUMBERS = [
    "0",
    "1",
    "2.5",
    "-3",
    "1,5",
    "1.234",
    "1,234",
    "1e3",
    "1e400",
    "9" * 30,
    "1'000",
    "0x10",
    "1_0",
    "1.2 N",
    "1,2-",
    "nan",
    "inf",
]
TIMES = ["12:00:01", "2026-11-21 10:00:00", "31.02.2026 10:00:00", "2026-13-41 99:99:99"]
CELLS = [*NUMBERS, *TIMES, "", "-", "x", '"', "a.png", "loading", "=1+1", "\u0661", "\u00b2", "\x1c"]
NAMES = ["step", "branch", "time_s", "displacement_mm", "force_N", "image", "Kraft [mN]", "Weg / mm", "Kraft [?]"]
NAMES += ["x", "", "Bild", "Zeit", "force", "[N]"]
PIECES = [b"[", b"]", b'"', b"=", b"\n", b".", b",", b"9" * 9]
SEEDS = st.integers(0, 2**64 - 1).map(random.Random)
"""Ten draws of an example by Hypothesis take longer than what is tested; one that seeds them all is enough."""


def table(drawn: random.Random) -> bytes:
    """A log that looks like a log: headers from the trade, cells from everywhere."""
    separator = drawn.choice(",;\t")
    names = drawn.choices(NAMES, k=drawn.randint(1, 7))
    if drawn.random() < 0.5:
        names = ["step", "branch", "time_s", "displacement_mm", "force_N", "image"]
    rows = [drawn.choices(CELLS, k=drawn.randint(1, len(names) + 1)) for _ in range(drawn.randint(0, 12))]
    text = "\n".join(separator.join(row) for row in [names, *rows])
    return text.encode(drawn.choice(["utf-8", "utf-16", "utf-16-le", "utf-8-sig"]))


def damaged(original: bytes) -> st.SearchStrategy[bytes]:
    """A valid file with a few bytes replaced, inserted or cut."""

    def damage(drawn: random.Random) -> bytes:
        data = bytearray(original)
        for _ in range(drawn.randint(1, 4)):
            place = drawn.randint(0, len(data))
            kind = drawn.choice(["replace", "insert", "cut"])
            piece = drawn.choice(PIECES) if drawn.random() < 0.5 else drawn.randbytes(drawn.randint(1, 4))
            if kind == "insert":
                data[place:place] = piece
            elif kind == "replace":
                data[place : place + len(piece)] = piece
            else:
                del data[place : place + drawn.randint(1, 20)]
        return bytes(data)

    return SEEDS.map(damage)


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """One folder for all examples: each overwrites the file of the one before."""
    return tmp_path_factory.mktemp("fuzz")


def toml_or_refusal(data: bytes, folder: Path) -> None:
    (folder / "specimen.toml").write_bytes(data)
    try:
        file = read_specimen_file(folder, SETTINGS)
    except InputError as error:
        assert error.code
        assert error.remedy
        return
    assert math.isfinite(file.length_m)
    assert file.length_m > 0.0
    assert file.diameter_m > 0.0
    assert file.id
    assert not set(file.id) & set("/\\\0")


def log_or_refusal(data: bytes, spec: LogSpec, folder: Path) -> None:
    path = folder / "force.csv"
    path.write_bytes(data)
    try:
        log = read_force_log(path, spec, SETTINGS)
    except InputError as error:
        assert error.code
        assert error.remedy
        return
    assert log.steps
    assert len({step.step for step in log.steps}) == len(log.steps)
    for step in log.steps:
        assert np.all(np.isfinite(step.forces_N))
        assert np.all(np.isfinite(step.times_s))
        assert len(step.times_s) in (0, len(step.forces_N))
        assert math.isfinite(step.force_N)
        assert math.isfinite(step.displacement_m)
        assert step.force_std_N > 0.0
        assert step.branch in ("mounted", "loading", "unloading")


def spec(drawn: random.Random) -> LogSpec:
    """What a user may say of a log."""
    columns = [{}, {"force": "x"}, {"force": 2, "displacement": 1}, {"force": 1, "displacement": 1000}]
    return LogSpec(
        columns=drawn.choice(columns),
        units=drawn.choice([{}, {"force": "mN"}, {"time": "?"}]),
        separator=drawn.choice([None, ";", "\t"]),
        decimal=drawn.choice([None, ",", "."]),
        encoding=drawn.choice([None, "utf-8", "cp1252", "utf-16"]),
        force_sign=drawn.choice([None, "tension", "compression"]),
    )


SPECS = SEEDS.map(spec)


@fuzz
@given(st.binary(max_size=300) | damaged(TOML))
def test_any_specimen_file(place, data):
    toml_or_refusal(data, place)


@fuzz
@given(damaged(TOML))
def test_damaged_specimen_file(place, data):
    toml_or_refusal(data, place)


@fuzz
@given(SEEDS.map(table), SPECS)
def test_any_table(place, data, spec):
    log_or_refusal(data, spec, place)


@fuzz
@given(
    st.binary(max_size=200) | damaged(b"step,displacement_mm,force_N,image\n0,0.0,0.1,a.png\n1,2.0,1.1,b.png\n"), SPECS
)
def test_any_log(place, data, spec):
    log_or_refusal(data, spec, place)
