"""A hundred specimens, every fifth damaged in another of twenty ways: 80 complete, 20 reported with their reason."""

import json
import struct
import zlib
from pathlib import Path

import pytest

from pipeline.batch import Store
from pipeline.cli.run import exit_code
from tests.pipeline.cheap_batch import run_cheaply, write_specimens

SPECIMENS, KINDS = 100, 20


def png_header(width: int, height: int) -> bytes:
    """A picture that claims to be enormous: a bomb for whoever reserves the memory first."""
    header = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + header + struct.pack(">I", zlib.crc32(header))


def photo(folder: Path) -> Path:
    return folder / "images/step_1.png"


def truncated(folder):
    photo(folder).write_bytes(photo(folder).read_bytes()[:60])


def empty_photo(folder):
    photo(folder).write_bytes(b"")


def wrong_type(folder):
    photo(folder).write_text("this is no picture")


def huge(folder):
    photo(folder).write_bytes(png_header(200_000, 200_000))


def folder_for_photo(folder):
    photo(folder).unlink()
    photo(folder).mkdir()


def no_photo(folder):
    photo(folder).unlink()


def nan_forces(folder):
    edit(folder / "force.csv", *((value, "NaN") for value in LOGGED))


def swapped(folder):
    edit(folder / "force.csv", ("displacement_mm,force_N", "force_N,displacement_mm"))


def no_log(folder):
    (folder / "force.csv").unlink()


def cyclic_log(folder):
    (folder / "force.csv").unlink()
    (folder / "force.csv").symlink_to("force.csv")


def outside_log(folder):
    (folder / "force.csv").unlink()
    (folder / "force.csv").symlink_to("/etc/hostname")


def binary_log(folder):
    (folder / "force.csv").write_bytes(bytes(range(256)))


def misspelt(folder):
    edit(folder / "specimen.toml", ("length_mm", "lenght_mm"))


def no_toml_syntax(folder):
    edit(folder / "specimen.toml", ("181.0", "181,0"))


def bad_id(folder):
    edit(folder / "specimen.toml", ('id = "', 'id = "../'))


def wish(note):
    def damage(folder):
        edit(folder / "specimen.toml", ('notes = ""', f'notes = "{note}"'))

    return damage


def edit(path, *changes):
    text = path.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)


LOGGED = ("-0.002", "0.003", "0.001", "2.301", "2.304", "2.298", "2.902", "2.899", "2.903")
PARTIAL = {
    **dict.fromkeys([truncated, empty_photo, wrong_type, huge], "step_1.png"),
    **dict.fromkeys([folder_for_photo, no_photo], "1 photos lost"),
}
FAILED = {
    nan_forces: "log/empty",
    swapped: "log/swapped-columns",
    no_log: "folder/no-force-log",
    cyclic_log: "file/unreadable",
    outside_log: "file/outside",
    binary_log: "log/encoding",
    misspelt: "toml/unknown-key",
    no_toml_syntax: "toml/syntax",
    bad_id: "toml/wrong-value",
    wish("die"): "specimen/worker-died",
    wish("hang"): "specimen/timeout",
    wish("bug"): "specimen/program-error",
    wish("memory"): "specimen/memory",
    wish("full"): "specimen/file-system",
}


@pytest.fixture(scope="module")
def damaged_batch(tmp_path_factory):
    folder = tmp_path_factory.mktemp("faults")
    names = [f"s{n:03d}" for n in range(SPECIMENS)]
    write_specimens(folder / "batch", names)
    damages = [*PARTIAL, *FAILED]
    assert len(damages) == KINDS
    for damage, name in zip(damages, names[::5], strict=True):
        damage(folder / "batch" / name)
    tally = run_cheaply(folder / "batch", folder / "out", timeout_s=15.0)
    return folder, tally, dict(zip(damages, names[::5], strict=True))


def test_nothing_is_lost(damaged_batch):
    folder, tally, damaged = damaged_batch
    store = Store(folder / "out")
    entries = {name: store.entry(name) for name in store.names()}
    assert len(entries) == SPECIMENS
    assert tally.trouble == ()
    complete = {name for name, entry in entries.items() if entry["status"] == "measured"}
    assert len(complete) == SPECIMENS - KINDS
    assert complete.isdisjoint(damaged.values())
    assert (tally.measured, tally.failed) == (SPECIMENS - len(FAILED), len(FAILED))
    assert exit_code(tally) == 1


@pytest.mark.parametrize("damage", PARTIAL, ids=lambda damage: damage.__name__)
def test_a_bad_photo_costs_the_photo(damage, damaged_batch):
    folder, _, damaged = damaged_batch
    entry = Store(folder / "out").entry(damaged[damage])
    assert entry["status"] == "partial"
    assert PARTIAL[damage] in entry["headline"]


@pytest.mark.parametrize("number", range(len(FAILED)), ids=lambda n: list(FAILED.values())[n])
def test_every_failure_has_its_reason(number, damaged_batch):
    folder, _, damaged = damaged_batch
    damage, code = list(FAILED.items())[number]
    name = damaged[damage]
    entry = Store(folder / "out").entry(name)
    assert (entry["status"], entry["code"]) == ("failed", code)
    result = json.loads((folder / "out" / name / "result.json").read_text())
    assert result["status"] == "failed"
    assert result["findings"][0]["code"] == code
    assert len(entry["headline"]) > 20
    assert "\n" not in entry["headline"]
