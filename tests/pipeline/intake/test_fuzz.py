"""Whatever bytes a specimen folder holds: a valid record or an `InputError`, never another exception.

Two kinds of input: arbitrary bytes, and valid files with damage. Together at least 10,000 examples by default; set
CABLEBEND_FUZZ to multiply them. An example is drawn from its number, which a failure tells.
"""

import math
import os
import random
import string
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import InputError
from pipeline.intake.forcelog import read_force_log
from pipeline.intake.specimenfile import LogSpec, read_specimen_file
from pipeline.settings.intake import IntakeSettings

SETTINGS = IntakeSettings()
EXAMPLES = int(os.environ.get("CABLEBEND_FUZZ", "1")) * 2500

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
PLAIN_LOG = b"step,displacement_mm,force_N,image\n0,0.0,0.1,a.png\n1,2.0,1.1,b.png\n"
CELLS = [*NUMBERS, *TIMES, "", "-", "x", '"', "a.png", "loading", "=1+1", "\u0661", "\u00b2", "\x1c"]
NAMES = ["step", "branch", "time_s", "displacement_mm", "force_N", "image", "Kraft [mN]", "Weg / mm", "Kraft [?]"]
NAMES += ["x", "", "Bild", "Zeit", "force", "[N]"]
PIECES = [b"[", b"]", b'"', b"=", b"\n", b".", b",", b"9" * 9]


def table(drawn: random.Random) -> bytes:
    """A log that looks like a log: headers from the trade, cells from everywhere."""
    separator = drawn.choice(",;\t")
    names = drawn.choices(NAMES, k=drawn.randint(1, 7))
    if drawn.random() < 0.8:
        names = ["step", "branch", "time_s", "displacement_mm", "force_N", "image"]
    usual = [[str(k), drawn.choice(["loading", ""]), str(k), f"{2 * k}.5", f"{k}.25", ""] for k in range(12)]
    rows = [
        drawn.choices(CELLS, k=drawn.randint(1, len(names) + 1)) if drawn.random() < 0.2 else row
        for row in usual[: drawn.randint(0, 12)]
    ]
    text = "\n".join(separator.join(row) for row in [names, *rows])
    return text.encode(drawn.choice(["utf-8", "utf-16", "utf-16-le", "utf-8-sig"]))


def damaged(drawn: random.Random, original: bytes) -> bytes:
    """A valid file with a few bytes replaced, inserted or cut."""
    data = bytearray(original)
    for _ in range(drawn.choice([1, 1, 2, 4])):
        place = drawn.randint(0, len(data))
        kind = drawn.choice(["replace", "insert", "cut"])
        text = "".join(drawn.choices(string.printable, k=drawn.randint(1, 4))).encode()
        # most bytes at random are no UTF-8, and nothing but that would be tested
        piece = drawn.choice([drawn.choice(PIECES), text, text, drawn.randbytes(drawn.choice([0, 0, 1, 4]))])
        if kind == "insert":
            data[place:place] = piece
        elif kind == "replace":
            data[place : place + len(piece)] = piece
        else:
            del data[place : place + drawn.randint(1, 20)]
    return bytes(data)


def arbitrary(drawn: random.Random, most: int) -> bytes:
    """Any bytes, often none, often few different ones."""
    size = drawn.choice([drawn.randint(0, 4), drawn.randint(0, most)])
    return bytes(drawn.choices(drawn.randbytes(drawn.choice([1, 3, 256])), k=size))


def every_example(test: Callable[[random.Random], None]) -> None:
    """Run a test on all its examples."""
    for number in range(EXAMPLES):
        try:
            test(random.Random(number))
        except Exception as error:
            raise AssertionError(f"example {number} breaks it") from error


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
        assert len(error.said.parts()) > 1
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
        assert len(error.said.parts()) > 1
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
        columns=drawn.choice([*3 * [{}], *columns]),
        units=drawn.choice([{}, {}, {"force": "mN"}, {"time": "?"}]),
        separator=drawn.choice([*3 * [None], ";", "\t"]),
        decimal=drawn.choice([*3 * [None], ",", "."]),
        encoding=drawn.choice([*6 * [None], "utf-8", "cp1252", "utf-16"]),
        force_sign=drawn.choice([None, "tension", "compression"]),
    )


def test_any_specimen_file(place):
    def check(drawn: random.Random) -> None:
        data = arbitrary(drawn, 300) if drawn.random() < 0.5 else damaged(drawn, TOML)
        toml_or_refusal(data, place)

    every_example(check)


def test_damaged_specimen_file(place):
    every_example(lambda drawn: toml_or_refusal(damaged(drawn, TOML), place))


def test_any_table(place):
    every_example(lambda drawn: log_or_refusal(table(drawn), spec(drawn), place))


def test_any_log(place):
    def check(drawn: random.Random) -> None:
        data = arbitrary(drawn, 200) if drawn.random() < 0.5 else damaged(drawn, PLAIN_LOG)
        log_or_refusal(data, spec(drawn), place)

    every_example(check)


def test_examples_lie_on_both_sides_of_the_border(place):
    """Else all the others would show that whatever comes is refused."""

    def read(reader, data) -> bool:
        try:
            reader(data)
        except InputError:
            return False
        return True

    def log(data):
        (place / "force.csv").write_bytes(data)
        read_force_log(place / "force.csv", LogSpec(), SETTINGS)

    def toml(data):
        (place / "specimen.toml").write_bytes(data)
        read_specimen_file(place, SETTINGS)

    makers = [(log, table), (log, lambda d: damaged(d, PLAIN_LOG)), (toml, lambda d: damaged(d, TOML))]
    for reader, make in makers:
        # of 2500 examples a hundred are read and a hundred refused
        assert 8 <= sum(read(reader, make(random.Random(number))) for number in range(200)) <= 192
