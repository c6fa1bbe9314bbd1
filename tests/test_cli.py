"""The command line: exit codes, stdout and stderr, settings, and nothing heavy before it is needed."""

import json
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

from pipeline.assembly import provenance
from pipeline.batch.specimen import Stages
from pipeline.cli import main
from pipeline.cli.configuration import commented_settings, read_settings
from pipeline.cli.group import COMMANDS
from pipeline.errors import InputError
from pipeline.intake.folder import read_specimen
from pipeline.settings import Settings
from tests.pipeline.cheap_batch import cheap_stages, write_specimens

ROOT = Path(__file__).resolve().parents[1]
HEAVY = {
    "numpy",
    "scipy",
    "pandas",
    "matplotlib",
    "cv2",
    "skimage",
    "PIL",
    "pydantic",
    "jinja2",
    "rich",
    "dask",
    "distributed",
}
IN_PROCESS = ("--set", "batch.in_process=true")

PIPELINE = "pipeline.batch.batch.PIPELINE"


def call(*arguments, **options):
    return CliRunner().invoke(main, [str(argument) for argument in arguments], **options)


@pytest.fixture
def cheap(monkeypatch, tmp_path):
    """Specimens a, b and c, and a measurement that costs nothing."""
    monkeypatch.setattr(PIPELINE, cheap_stages())
    monkeypatch.chdir(tmp_path)
    write_specimens(tmp_path / "batch", ["a", "b", "c"])
    return tmp_path


@pytest.mark.parametrize("arguments", [["--help"], *([name, "--help"] for name in COMMANDS)], ids=lambda a: a[0])
def test_help_loads_nothing_heavy(arguments):
    program = (
        "import sys\nfrom pipeline.cli import main\n"
        f"main({arguments!r}, standalone_mode=False)\nprint(sorted(sys.modules), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "Usage:" in done.stdout
    loaded = {name.strip(" '[]").partition(".")[0] for name in done.stderr.split(",")}
    assert not loaded & HEAVY


def test_module_and_command_are_one():
    done = subprocess.run(
        [sys.executable, "-m", "pipeline", "--version"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout == call("--version").stdout
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    assert scripts == {"cablebend": "pipeline.cli:main"}


def test_all_measured(cheap):
    done = call("run", "batch", "-o", "out", *IN_PROCESS)
    assert done.exit_code == 0
    assert [line.split()[:2] for line in done.stdout.splitlines()[:3]] == [[name, "measured"] for name in "abc"]
    assert "3 of 3 measured, 0 failed: out/index.html" in done.stdout
    assert done.stderr.splitlines() == [line for line in done.stderr.splitlines() if line.startswith("[")]
    again = call("run", "batch", "-o", "out", *IN_PROCESS)
    assert "(3 kept from an earlier run)" in again.stdout


def test_json_of_a_run(cheap):
    (cheap / "batch/b/force.csv").write_text("")
    done = call("run", "batch", "-o", "out", "--json", *IN_PROCESS)
    assert done.exit_code == 1
    document = json.loads(done.stdout)
    assert [specimen["status"] for specimen in document["specimens"]] == ["measured", "failed", "measured"]
    assert document["specimens"][1]["code"] == "log/empty"
    assert document["counts"] == {"total": 3, "measured": 2, "failed": 1, "kept": 0}
    assert document["interrupted"] is False


def test_command_that_reproduces_a_result_can_be_copied_and_runs_nothing_else(cheap):
    strange = cheap / 'batch/a $(touch pwned) "b"'
    (cheap / "batch/a").rename(strange)
    call("run", strange.relative_to(cheap), "-o", "out", "--set", 'report.language="de"', *IN_PROCESS)
    command = json.loads((cheap / "out/a/result.json").read_text())["provenance"]["command"]
    assert shlex.split(command)[:5] == ["cablebend", "run", str(strange), "-o", "OUT"]
    assert shlex.split(command)[5:7] == ["--set", 'report.language="de"']
    subprocess.run(["sh", "-c", command.replace("cablebend", "true", 1)], cwd=cheap, check=True)
    assert not (cheap / "pwned").exists()


def test_log_that_cannot_be_written_costs_no_result(cheap):
    (cheap / "out").mkdir()
    (cheap / "out/cablebend.log").symlink_to("/dev/full")
    done = call("run", "batch", "-o", "out", *IN_PROCESS)
    assert done.exit_code == 0
    assert "Logging error" not in done.stderr
    (cheap / "taken/cablebend.log").mkdir(parents=True)
    done = call("run", "batch", "-o", "taken", *IN_PROCESS)
    assert done.exit_code == 2
    assert "taken: cannot be written (is a directory)" in done.stderr


def test_one_specimen_folder(cheap):
    done = call("run", "batch/a", "-o", "out")
    assert done.exit_code == 0
    assert (cheap / "out/a/result.json").exists()


def test_nothing_could_be_measured(cheap):
    (cheap / "batch/a/specimen.toml").write_text("")
    assert call("run", "batch/a", "-o", "out").exit_code == 3
    (cheap / "empty").mkdir()
    done = call("run", "empty", "-o", "out")
    assert done.exit_code == 3
    assert done.stderr.startswith("cablebend: empty: holds no specimen.toml")


def test_a_folder_that_does_not_exist_costs_the_others_nothing(cheap):
    assert call("run", "nowhere", "-o", "out").exit_code == 2
    done = call("run", "nowhere", "batch", "-o", "out", *IN_PROCESS)
    assert done.exit_code == 1
    assert "3 of 3 measured" in done.stdout


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "batch"],
        ["run", "-o", "out"],
        ["measure", "batch"],
        ["run", "batch", "-o", "out", "--workers", "0"],
        ["run", "batch", "-o", "out", "--set", "intake.log_max_byte=3"],
        ["run", "batch", "-o", "out", "--set", "batch.timeout_s=-3"],
        ["run", "batch", "-o", "out", "--settings", "missing.toml"],
        ["run", "batch", "-o", "batch/a/specimen.toml"],
        ["simulate", "virtual", "--hide", "rig_complianc=1e-5"],
        ["simulate", "virtual", "--hide", "rig_compliance"],
        ["simulate", "virtual", "--length-mm", "-1"],
        ["simulate", "virtual", "--hide", "rigid_ends=0.09"],
        ["simulate", "virtual", "--hide", "pre_curvature=40"],
        ["simulate", "virtual", "--k0", "-18"],
        ["simulate", "virtual", "--hide", "stiffness_varying=-1.5"],
        ["simulate", "virtual", "--hide", "force_offset=0.1", "--hide", "force_offset=0.2"],
        ["explain", "rig_complianc"],
        ["init"],
    ],
    ids=" ".join,
)
def test_usage_and_configuration(arguments, cheap):
    done = call(*arguments)
    assert done.exit_code == 2
    assert done.stderr
    assert not done.stdout
    assert isinstance(done.exception, SystemExit)


def test_interrupt_keeps_what_is_done(cheap, monkeypatch):
    stages = cheap_stages()

    def measure(folder, settings, *, command):
        if folder.name == "b":
            raise KeyboardInterrupt
        return stages.measure(folder, settings, command=command)

    monkeypatch.setattr(PIPELINE, Stages(measure, stages.write, stages.write_index))
    done = call("run", "batch", "-o", "out", *IN_PROCESS)
    assert done.exit_code == 130
    assert "the same command resumes" in done.stderr
    assert (cheap / "out/a/result.json").exists()
    assert (cheap / "out/index.txt").exists()
    monkeypatch.setattr(PIPELINE, stages)
    assert "(1 kept from an earlier run)" in call("run", "batch", "-o", "out", *IN_PROCESS).stdout


def test_report_draws_again_without_measuring(cheap, monkeypatch):
    call("run", "batch", "-o", "out", *IN_PROCESS)
    before = (cheap / "out/a/result.json").read_bytes()
    (cheap / "out/b/result.json").write_text("{")
    drawn = []
    stages = cheap_stages()

    def write(result, folder, settings):
        drawn.append((result.specimen.id, settings.report.language))
        stages.write(result, folder, settings)

    monkeypatch.setattr(PIPELINE, Stages(None, write, stages.write_index))
    done = call("report", "out", "--language", "de")
    assert done.exit_code == 0
    assert drawn == [("a", "de"), ("c", "de")]
    assert "b: result.json kann nicht gelesen werden: Sie ist kein lesbares Ergebnis" in done.stderr
    assert (cheap / "out/a/result.json").read_bytes() == before
    assert "(3 kept" in call("run", "batch", "-o", "out", *IN_PROCESS).stdout


def test_reports_can_wait_until_they_are_asked_for(cheap, monkeypatch):
    drawn = []
    stages = cheap_stages()

    def write(result, folder, settings):
        stages.write(result, folder, settings)
        if settings.batch.reports:
            drawn.append(result.specimen.id)

    monkeypatch.setattr(PIPELINE, Stages(stages.measure, write, stages.write_index))
    assert call("run", "batch", "-o", "out", "--no-reports", *IN_PROCESS).exit_code == 0
    assert drawn == []
    (cheap / "out/b/result.json").write_text("{")
    assert "(2 kept" in call("run", "batch", "-o", "out", *IN_PROCESS).stdout  # the broken one is measured again
    assert drawn == ["a", "b", "c"]
    assert "(3 kept" in call("run", "batch", "-o", "out", *IN_PROCESS).stdout
    assert drawn == ["a", "b", "c"]


def test_check_measures_nothing_and_says_what_is_wrong(cheap):
    for name in "abc":  # with photos that show a cable
        shutil.rmtree(cheap / "batch" / name)
        shutil.copytree(ROOT / "fixtures/specimens/three", cheap / "batch" / name)
    done = call("check", "batch", *IN_PROCESS)
    assert done.exit_code == 0
    assert "3 of 3 specimens would run" in done.stdout
    (cheap / "batch/b/force.csv").write_text("step,displacement_mm,force_N\n1,2,abc\n")
    (cheap / "batch/c/images/step_01.jpg").unlink()
    done = call("check", "batch", "--json", *IN_PROCESS)
    assert done.exit_code == 1
    rows = json.loads(done.stdout)["specimens"]
    assert [row["status"] for row in rows] == ["ok", "error", "warning"]
    assert "force.csv, line 2: force 'abc' is no number" in rows[1]["findings"][0]["message"]
    assert rows[2]["findings"][0]["code"] == "photo/missing"
    assert not (cheap / "out").exists()


def test_a_place_that_cannot_be_used_is_one_sentence(tmp_path):
    (tmp_path / "file").touch()
    done = call("demo", "-o", tmp_path / "file" / "inside")
    assert done.exit_code == 2
    assert done.stderr.startswith(f"cablebend: {tmp_path / 'file' / 'inside'}")
    assert done.stderr.endswith(": not a directory; check that the place exists and can be used.\n")


def test_init_then_check_then_run(cheap):
    folder = cheap / "batch/a"
    (folder / "specimen.toml").unlink()
    done = call("init", folder)
    assert done.exit_code == 0
    assert call("check", folder).exit_code == 3
    path = folder / "specimen.toml"
    path.write_text(
        path.read_text().replace("length_mm = 0.0", "length_mm = 181").replace("diameter_mm = 0.0", "diameter_mm = 5")
    )
    (row,) = json.loads(call("check", folder, "--json").stdout)["specimens"]
    assert row["steps"] and {one["code"] for one in row["findings"]} == {"photo/contrast"}  # they show no cable
    assert call("run", folder, "-o", "out").exit_code == 0


def test_all_settings_can_be_written_and_read_back(tmp_path):
    path = tmp_path / "settings.toml"
    path.write_text(call("init", "--settings").stdout, encoding="utf-8")
    assert read_settings(path, ()) == Settings()


def test_every_setting_says_what_it_is_and_why():
    lines = commented_settings(Settings()).splitlines()
    values = [number for number, line in enumerate(lines) if " = " in line and not line.startswith("# ")]
    assert len(values) > 40
    assert [lines[number] for number in values if not lines[number - 1].startswith("# ")] == []


def test_settings_from_file_and_assignments(tmp_path):
    path = tmp_path / "settings.toml"
    path.write_text("[intake]\nlog_max_bytes = 5\n[vision.photo]\nmax_megapixels = 7\n")
    settings = read_settings(path, ("intake.log_max_bytes=6", "report.language=de", 'report.language="de"'))
    assert settings.intake.log_max_bytes == 6
    assert settings.vision.photo.max_megapixels == 7
    assert settings.report.language == "de"


@pytest.mark.parametrize(
    ("text", "code", "line", "hint"),
    [
        ("[intakes]\n", "settings/unknown-key", 1, "the nearest one is intake"),
        ("[intake]\nlog_max_byte = 5\n", "settings/unknown-key", 2, "the nearest one is intake.log_max_bytes"),
        ("[vision.photo]\nmax_megabyte = 5\n", "settings/unknown-key", 2, "the nearest one is vision.photo."),
        ("[report]\nlanguage = 'fr'\n", "settings/wrong-value", 2, 'the default is "en"'),
        ("[intake\n", "toml/syntax", 1, ""),
        # integers of 6,000 digits: Python does not write them, be it into a message or into a result
        (f"[intake]\nphotos_max = 0x{'F' * 5000}\n", "settings/wrong-value", 2, "photos_max = ..."),
        (f"intake = 0x{'F' * 5000}\n", "settings/wrong-value", 1, "intake = ..."),
        (f"[intake]\nmodulus_range_mpa = [0x{'F' * 5000}, 1]\n", "settings/wrong-value", None, "..."),
        (f"[report]\nlanguage = 0x{'F' * 5000}\n", "settings/wrong-value", 2, "language = ..."),
    ],
)
def test_settings_that_are_refused(text, code, line, hint, tmp_path):
    path = tmp_path / "settings.toml"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        read_settings(path, ())
    assert (refused.value.code, refused.value.line) == (code, line)
    assert hint in refused.value.sentence


def test_language_is_no_part_of_a_result():
    specimen = read_specimen(ROOT / "fixtures" / "specimens" / "three", Settings().intake)
    parts = [
        provenance(specimen, Settings(report={"language": language}), "cablebend run")["settings"]
        for language in ("de", "en")
    ]
    assert parts[0] == parts[1]
    assert "band_coverage" in parts[0]["report"]


def test_language_reaches_the_reports_and_no_result(cheap, monkeypatch):
    written = []
    stages = cheap_stages()

    def write(result, folder, settings):
        written.append(settings.report.language)
        stages.write(result, folder, settings)

    monkeypatch.setattr(PIPELINE, Stages(stages.measure, write, stages.write_index))
    results = []
    for language, kept in (("de", ""), ("en", "(1 kept"), ("en", "(1 kept")):  # drawn again, and measured once
        done = call("run", "batch/a", "-o", "out", "--language", language, *IN_PROCESS)
        assert done.exit_code == 0 and kept in done.stdout
        results.append((cheap / "out/a/result.json").read_bytes())
    assert written == ["de", "en"]
    assert results[0] == results[1]
    assert call("run", "batch/a", "-o", "out", "--language", "fr").exit_code == 2


def test_simulated_specimen_is_read_like_any_other_and_keeps_its_truth_apart(tmp_path):
    done = call("simulate", tmp_path / "virtual", "--steps", 1, "--hide", "force_offset=0.02", "--seed", 3)
    assert done.exit_code == 0
    assert {path.name for path in (tmp_path / "virtual").iterdir()} == {"images", "force.csv", "specimen.toml"}
    assert json.loads((tmp_path / "virtual.truth.json").read_text())["effects"] == {"force_offset": [0.02]}
    checked = json.loads(call("check", tmp_path / "virtual", "--json").stdout)["specimens"]
    assert [(row["status"], row["steps"], row["photos"], row["findings"]) for row in checked] == [("ok", 2, 2, [])]


def test_design_ranks_causes_and_says_what_stays_invisible():
    found = json.loads(call("design", "--steps", 3, "--json").stdout)
    causes = {cause["name"]: cause for cause in found["causes"]}
    assert len(causes) == 20  # all but the form of the law, which may be any
    assert not causes["force_gain"]["visible"]  # the same as the scale of EI, always
    assert 0.0 < found["stiffness_std"] < 0.1
    more = json.loads(call("design", "--steps", 6, "--step-mm", 2.3, "--unload", "--json").stdout)
    assert more["pre_curvature_std"] < found["pre_curvature_std"]
    assert call("design", "--step-mm", -1).exit_code == 2


def test_folders_too_deep_to_be_searched_are_told_in_one_sentence(cheap):
    (cheap / "batch/b").rename(cheap / "b")
    deep = cheap / "batch/1/2/3"
    (deep / "empty").mkdir(parents=True)
    (cheap / "b").rename(deep / "b")
    assert call("check", "batch", *IN_PROCESS).stderr == ""
    done = call("check", "batch", "--set", "intake.search_depth=3")
    assert done.stderr == (
        "cablebend: folders more than 3 levels below the one given were not searched (2, first batch/1/2/3/b); "
        "give a folder nearer to them, or raise intake.search_depth.\n"
    )
    assert "0 of 2 specimens would run" in done.stdout
    done = call("check", "batch/1", "--set", "intake.search_depth=2")
    assert done.exit_code == 3 and "not searched (2, first batch/1/2/3/b)" in done.stderr


def test_folders_without_description_are_told(cheap):
    (cheap / "batch/b/specimen.toml").unlink()
    done = call("check", "batch", *IN_PROCESS)
    assert "batch/b: has photos and a table but no specimen.toml" in done.stderr
    assert "0 of 2 specimens would run" in done.stdout
    (cheap / "batch/b").rename(cheap / "batch/b\x1b[2J")
    done = call("check", "batch", *IN_PROCESS)  # a name does not command the terminal
    assert "batch/b\\x1b[2J: has photos" in done.stderr
