"""A run and a report cut off before each of their operations on files, by a kill and by a power cut.

``python -m tests.pipeline.cut_batches run|report FOLDER`` prints how many operations there were, once for each way of
cutting. After each cut every result must be the old one or the new one, whole, and the same command must finish.
"""

import argparse
import functools
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from unittest import mock

from pipeline.batch import Store, redraw
from pipeline.batch.specimen import Stages
from pipeline.intake.folder import read_specimen
from pipeline.report.files import write_atomic
from pipeline.result import Result, to_json
from pipeline.settings import Settings
from tests.pipeline.cheap_batch import cheap_stages, run_cheaply, stored, write_specimens
from tests.pipeline.power_cut import run_until

WAYS = ("killed", "power", "reordered")
"""See `power_cut`."""


MEASURED: dict[object, Result] = {}
"""Of specimens and logs: to read and measure them changes no file, and a process to be cut off inherits it."""


@functools.cache
def read(folder, settings, log):
    """What a specimen folder with that log holds."""
    return read_specimen(folder, settings)


def known(folder, settings):
    """The same without a look at more than the log."""
    return read(folder, settings, (folder / "force.csv").read_bytes())


def drawing(edition: str) -> Stages:
    """The stand-in for the pipeline, with files written as the pipeline writes them, different in each edition."""
    cheap = cheap_stages()

    def measure(folder, settings, *, command):
        known = folder, (folder / "force.csv").read_bytes(), command
        if known not in MEASURED:
            MEASURED[known] = cheap.measure(folder, settings, command=command)
        return MEASURED[known]

    def write(result, folder, settings):
        write_atomic(folder / "result.json", to_json(result))
        write_atomic(folder / "report.html", edition)

    def write_index(out, settings):
        write_atomic(out / "index.txt", " ".join(Store(out).names()))
        return []

    return Stages(measure, write, write_index)


def run(batch: Path, out: Path, edition: str) -> None:
    """Measure what changed."""
    with (
        mock.patch("tests.pipeline.cheap_batch.cheap_stages", return_value=drawing(edition)),
        mock.patch("pipeline.batch.specimen.read_specimen", known),
    ):
        run_cheaply(batch, out, in_process=True)


def report(batch: Path, out: Path, edition: str) -> None:
    """Draw everything again."""
    with mock.patch("pipeline.batch.batch.PIPELINE", drawing(edition)):
        assert [trouble for _, trouble in redraw(out, Settings())] == [None] * len(list(batch.iterdir()))


def results(out: Path) -> dict[str, dict[str, bytes]]:
    """Files of every result, by its name."""
    found: dict[str, dict[str, bytes]] = {}
    for path, data in stored(out).items():
        name, _, file = path.rpartition("/")
        found.setdefault(name, {})[file] = data
    found.pop("", None)
    return found


def cut_everywhere(act: Callable[[Path], None], how: str, before: Path, here: Path, new: set[str]) -> int:
    """Cut an action off before each operation; how many there were.

    Parameters
    ----------
    act : callable
        Changes the folder of results it is given.
    how : str
        See `run_until`.
    before : Path
        Folder of results at the beginning.
    here : Path
        Where that is copied for each cut: results hold its path.
    new : set of str
        Names of results that may be missing after a cut: there was none before.
    """
    old, pages = results(before), {stored(before)["index.txt"]}
    shutil.copytree(before, here)
    act(here)
    wanted = results(here)
    assert all(wanted[name] != files for name, files in old.items())
    pages.add(stored(here)["index.txt"])
    begun: list[object] = []  # what the same command began with after a cut; from the same again it ends the same way
    for n in range(1, 10_000):
        shutil.rmtree(here)
        shutil.copytree(before, here)
        count = run_until(n, how, here, functools.partial(act, here))
        where = f"{how} before operation {n}"
        with Store(here).locked():
            left = results(here)
        for name in wanted:
            assert left.get(name) in (old.get(name), wanted[name]), f"{where}: {name} is neither old nor new"
            assert name in left or name in new, f"{where}: {name} is lost"
        assert stored(here)["index.txt"] in pages, f"{where}: half a page"
        state = left, sorted((here / ".cablebend").rglob("*"))
        if state not in begun:
            begun.append(state)
            act(here)
            assert results(here) == wanted, f"{where}: the same command does not finish"
        if count is not None:
            assert count == n - 1
            assert left == wanted, f"{how} after the end: something was not on the disk"
            break
    return count


def main() -> None:
    """Make a small batch, cut it off everywhere, print the number of operations."""
    parser = argparse.ArgumentParser()
    parser.add_argument("action", choices=["run", "report"])
    parser.add_argument("folder", type=Path)
    given = parser.parse_args()
    batch, before, here = (given.folder / name for name in ("batch", "before", "here"))
    write_specimens(batch, ["a", "b"])
    run(batch, here, "first")
    here.rename(before)
    if given.action == "run":
        log = batch / "a/force.csv"
        log.write_text(log.read_text().replace("2.301", "2.302"))
        shutil.rmtree(before / "b")
    act, new = (run, {"b"}) if given.action == "run" else (report, set())
    for how in WAYS:
        count = cut_everywhere(lambda out: act(batch, out, "second"), how, before, here, new)
        sys.stdout.write(f"{how} {count}\n")
        shutil.rmtree(here)


if __name__ == "__main__":
    with mock.patch("os.fsync"):  # the real disk is not what is tested, and slow
        main()
