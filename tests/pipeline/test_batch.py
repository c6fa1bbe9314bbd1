"""A batch loses nothing: an interrupt or a kill nothing that was finished, a second run nothing of the first."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from pipeline.batch import Store, processes
from pipeline.batch.orders import result_names
from pipeline.cli.run import exit_code
from pipeline.errors import InputError
from pipeline.settings import Settings
from pipeline.settings.batch import BatchSettings
from tests.pipeline.cheap_batch import PATIENCE_S, TOML, run_cheaply, start, stored, wait_for, write_specimens

ROOT = Path(__file__).resolve().parents[2]
BROKEN = ROOT / "fixtures" / "broken"


def sentence(code: str) -> str:
    return (BROKEN / code / "sentence.txt").read_text(encoding="utf-8").rstrip("\n")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Ten specimens and what an undisturbed run makes of them."""
    folder = tmp_path_factory.mktemp("undisturbed")
    write_specimens(folder / "batch", [f"cable-{n}" for n in range(10)], notes="delay 0.5")
    tally = run_cheaply(folder / "batch", folder / "out")
    assert (tally.measured, tally.failed, tally.reused) == (10, 0, 0)
    return folder


def test_everything_is_stored(undisturbed):
    files = stored(undisturbed / "out")
    assert {f"cable-{n}/{name}" for n in range(10) for name in ("result.json", "entry.json")} <= files.keys()
    log = (undisturbed / "out/cablebend.log").read_text()
    assert all(f"cable-{n}: measured" in log for n in range(10))
    assert not any((undisturbed / "out/.cablebend/staging").iterdir())


def test_same_results_from_a_cluster(undisturbed, tmp_path):
    address = tmp_path / "scheduler.json"
    programs = [
        ["scheduler", "--scheduler-file", address, "--host", "127.0.0.1", "--port", "0", "--no-dashboard"],
        ["worker", "--scheduler-file", address, "--nworkers", "1", "--nthreads", "1", "--no-dashboard"],
    ]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    started = [
        subprocess.Popen(
            [sys.executable, "-m", "dask", *map(str, program)],
            cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )
        for program in programs
    ]  # fmt: skip
    try:
        wait_for(lambda: address.exists() and address.read_text().endswith("}"), started[0])
        scheduler = json.loads(address.read_text())["address"]
        tally = run_cheaply(undisturbed / "batch", tmp_path / "out", scheduler=scheduler)
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait(timeout=PATIENCE_S)
    assert (tally.measured, tally.failed) == (10, 0)
    assert stored(tmp_path / "out") == stored(undisturbed / "out")


def test_the_same_command_redoes_only_what_changed(undisturbed, tmp_path):
    batch, out = tmp_path / "batch", tmp_path / "out"
    write_specimens(batch, ["a", "b", "c"])
    run_cheaply(batch, out, in_process=True)
    first = stored(out)
    assert run_cheaply(batch, out, in_process=True).reused == 3
    (batch / "b/force.csv").write_text((batch / "b/force.csv").read_text().replace("2.301", "2.302"))
    kept = {}
    tally = run_cheaply(
        batch, out, in_process=True, on_outcome=lambda outcome, tally: kept.update({outcome.name: outcome.reused})
    )
    assert kept == {"a": True, "b": False, "c": True}
    assert tally.measured == 3
    changed = {name for name, data in stored(out).items() if first.get(name) != data}
    assert changed == {"b/entry.json", "index.txt"}


def test_other_settings_are_another_measurement_but_limits_are_not(tmp_path):
    write_specimens(tmp_path / "batch", ["a", "b"])
    run_cheaply(tmp_path / "batch", tmp_path / "out", in_process=True)
    assert run_cheaply(tmp_path / "batch", tmp_path / "out", in_process=True, timeout_s=77.0).reused == 2
    toml = tmp_path / "batch/a/specimen.toml"
    toml.write_text(toml.read_text().replace("4.6", "4.7"))
    assert run_cheaply(tmp_path / "batch", tmp_path / "out", in_process=True).reused == 1


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_interrupted_or_killed_and_resumed_equals_undisturbed(how, undisturbed, tmp_path):
    shutil.copytree(undisturbed / "batch", tmp_path / "batch")
    out = tmp_path / "out"
    process = start(tmp_path / "batch", out, HELD_BEYOND_FIVE_IN=str(out))
    wait_for(lambda: len(list(out.glob("*/entry.json"))) >= 3, process)
    if how == signal.SIGINT:
        os.killpg(process.pid, how)  # as Ctrl-C in a terminal: the workers get it too
    else:
        process.send_signal(how)
    _, told = process.communicate(timeout=PATIENCE_S)
    finished = len(list(out.glob("*/entry.json")))
    assert 3 <= finished < 10
    assert process.returncode == (-how if how == signal.SIGKILL else 130)
    assert "Traceback" not in told
    if how != signal.SIGKILL:
        assert len((out / "index.txt").read_text().splitlines()) == finished
    before = (out / "cablebend.log").read_text()
    resumed = run_cheaply(tmp_path / "batch", out, in_process=True)
    assert exit_code(resumed) == 0
    assert (out / "cablebend.log").read_text().removeprefix(before).count(": kept,") >= finished
    here = {name: data.replace(bytes(tmp_path), bytes(undisturbed)) for name, data in stored(out).items()}
    assert here == stored(undisturbed / "out")


def test_two_runs_into_one_folder_do_not_mix(undisturbed, tmp_path, monkeypatch):
    shutil.copytree(undisturbed / "batch", tmp_path / "batch")
    out = tmp_path / "out"
    process = start(tmp_path / "batch", out)
    wait_for(lambda: list(out.glob("*/entry.json")), process)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as refused, Store(Path("out")).locked():
        pass
    assert (refused.value.code, refused.value.sentence) == ("out/busy", sentence("out/busy"))
    assert process.wait(timeout=PATIENCE_S) == 0
    process.stderr.close()
    assert len(list(out.glob("*/entry.json"))) == 10


def test_output_that_cannot_be_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("out").write_text("a file")
    with pytest.raises(InputError) as refused, Store(Path("out")).locked():
        pass
    assert (refused.value.code, refused.value.sentence) == ("out/unwritable", sentence("out/unwritable"))


def test_no_scheduler(tmp_path):
    write_specimens(tmp_path / "batch", ["a", "b"])
    with pytest.raises(InputError) as refused:
        run_cheaply(tmp_path / "batch", tmp_path / "out", scheduler="tcp://127.0.0.1:9")
    assert (refused.value.code, refused.value.sentence) == ("batch/no-scheduler", sentence("batch/no-scheduler"))


def test_a_folder_that_is_no_result_is_left_alone(tmp_path):
    write_specimens(tmp_path / "batch", ["a", "b"])
    precious = tmp_path / "out/a/precious.txt"
    precious.parent.mkdir(parents=True)
    precious.write_text("mine")
    tally = run_cheaply(tmp_path / "batch", tmp_path / "out", in_process=True)
    assert (tally.measured, tally.failed) == (1, 1)
    assert tally.unstored["a"]["code"] == "out/foreign-folder"
    assert [path.name for path in precious.parent.iterdir()] == ["precious.txt"]


def test_specimens_with_one_id_get_names_of_their_own(tmp_path):
    for place in ("x/one", "x/two", "y/one", "y/three"):
        write_specimens(tmp_path, [place])
        (tmp_path / place / "specimen.toml").write_text(TOML.format(id="Cable" if "y" in place else "cable", notes=""))
    folders = [tmp_path / place for place in ("x/one", "x/two", "y/one", "y/three")]
    names = result_names(folders, Settings())
    assert names == ["cable--one--x", "cable--two", "Cable--one--y", "Cable--three"]
    (tmp_path / "y/three/specimen.toml").write_text(TOML.format(id="index.html", notes=""))
    assert result_names(folders[-1:], Settings()) == ["index.html--three"]
    assert run_cheaply(tmp_path, tmp_path / "out", in_process=True).measured == 4


def test_a_worker_that_dies_once_is_forgiven(tmp_path):
    write_specimens(tmp_path / "batch", ["a", "b"])
    write_specimens(tmp_path / "batch", ["c"], notes=f"die-once {tmp_path / 'died'}")
    tally = run_cheaply(tmp_path / "batch", tmp_path / "out", workers=1)
    assert (tally.measured, tally.failed) == (3, 0)
    assert (tmp_path / "died").exists()


def test_a_worker_that_grows_too_much_costs_its_specimen(tmp_path):
    write_specimens(tmp_path / "batch", ["a", "c"])
    write_specimens(tmp_path / "batch", ["b"], notes="hang 1000000000")
    tally = run_cheaply(tmp_path / "batch", tmp_path / "out", workers=1, memory_per_worker_gb=0.8)
    assert (tally.measured, tally.failed) == (2, 1)
    assert Store(tmp_path / "out").entry("b")["code"] == "specimen/worker-died"


def test_the_memory_of_a_container_is_shared_by_its_workers(tmp_path, monkeypatch):
    limits = {"none": "max\n", "container": "2000000000\n", "missing": None}
    for name, text in limits.items():
        if text is not None:
            (tmp_path / name).write_text(text)
    monkeypatch.setattr(processes, "CONTAINER", tuple(tmp_path / name for name in limits))
    assert processes._bytes_per_worker(BatchSettings(), 4) == pytest.approx(0.95 * 2e9 / 4)
    (tmp_path / "container").unlink()
    assert processes._bytes_per_worker(BatchSettings(), 1) == pytest.approx(0.95 * psutil.virtual_memory().total)
