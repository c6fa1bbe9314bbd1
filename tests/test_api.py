"""The README's Python example, run word for word, and what the package offers without loading anything heavy."""

import ast
import importlib
import importlib.resources
import inspect
import io
import itertools
import os
import re
import shutil
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path
from types import SimpleNamespace

import cablebend
import numpy as np
import pytest
from matplotlib.figure import Figure

import pipeline.run
from pipeline.faults import Faults
from pipeline.report.maps import answer_map, measured_map
from pipeline.result import Result, SpecimenPart
from pipeline.settings import ReportSettings, Settings
from tests.pipeline.report.virtual_diagnosis import diagnosis_of
from tests.pipeline.report.virtual_result import measured_result
from tests.test_cli import HEAVY

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
HOUSE = (ROOT / "fixtures/readme/house.md").read_text(encoding="utf-8")


def example() -> str:
    """The block after the marker, as a reader would copy it."""
    found = re.search(r"<!-- python example -->\s*```python\n(.*?)```", README, re.DOTALL)
    assert found, "README.md has no block after <!-- python example -->"
    return found[1]


def stages() -> list[str]:
    """Functions that the table of stages names, with the arguments it shows."""
    table = HOUSE.partition("<!-- python stages -->")[2].partition("\n\n")[0]
    return re.findall(r"\| `((?:pipeline|rod)\.[^`]+)` \|", table)


def test_the_example_of_the_readme_runs_as_it_stands(tmp_path, monkeypatch):
    shutil.copytree(ROOT / "fixtures/specimens/three", tmp_path / "fixtures/specimens/three")
    (tmp_path / "three-results").mkdir()
    monkeypatch.chdir(tmp_path)
    told, names = io.StringIO(), {}
    with redirect_stdout(told):
        exec(compile(example(), "README.md", "exec"), names)
    result = names["result"]
    assert isinstance(result, Result)
    assert result.status == "measured"
    assert result.headline in told.getvalue()
    assert result._repr_html_().startswith("<table>")
    assert {"kappa_per_m", "tangent_Nm2", "tangent_std_Nm2"} <= set(names["curves"].columns)
    assert [step.status for step in names["prediction"].steps] == ["predicted", "predicted"]
    # The same result twice, once by way of the disk.
    assert names["comparison"].max_relative < 1e-9
    assert names["comparison"].verdict == "no difference seen"
    written = {path.name for path in (tmp_path / "three-results").iterdir()}
    assert {"result.json", "characteristic.csv", "report.html", "report.pdf"} <= written


@pytest.mark.parametrize("call", stages())
def test_stages_exist_with_the_arguments_shown(call):
    name, _, arguments = call.partition("(")
    module, _, function = name.rpartition(".")
    signature = inspect.signature(getattr(importlib.import_module(module), function))
    given = [argument.strip() for argument in arguments.rstrip(")").split(",")]
    named = {argument.partition("=")[0]: None for argument in given if "=" in argument}
    signature.bind(*(argument for argument in given if "=" not in argument), **named)


def test_the_house_names_the_stages():
    assert len(stages()) > 5


def test_importing_the_package_loads_nothing_heavy():
    program = "import sys\nimport cablebend\ndir(cablebend)\nprint(sorted(sys.modules))"
    there = {**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT), str(ROOT / "pipeline/door")))}
    done = subprocess.run([sys.executable, "-c", program], env=there, capture_output=True, text=True, check=True)
    assert not {name.strip(" '[]\n").partition(".")[0] for name in done.stdout.split(",")} & HEAVY


def test_everything_offered_is_there():
    for name in cablebend.__all__:
        assert getattr(cablebend, name) is not None
    assert sorted(cablebend.__all__) == sorted([*itertools.chain(*cablebend.ROOMS.values()), "__version__", "rod"])
    with pytest.raises(AttributeError, match="has no attribute 'mesure'"):
        cablebend.__getattr__("mesure")


def test_type_checkers_see_what_the_door_offers():
    tree = ast.parse(Path(cablebend.__file__).read_text(encoding="utf-8"))
    (typed,) = [node for node in tree.body if isinstance(node, ast.If)]
    told = {(node.module, alias.name) for node in typed.body for alias in node.names}
    offered = {(module, name) for module, names in cablebend.ROOMS.items() for name in names if module != "rod"}
    assert told == offered | {("rod", "*")}


def test_every_package_says_that_it_is_typed():
    for name in ("rod", "pipeline", "cablebend"):
        assert importlib.resources.files(name).joinpath("py.typed").is_file()


@pytest.fixture(scope="module")
def named():
    result = measured_result()
    return result.model_copy(update={"diagnosis": diagnosis_of("named", result.photos)})


@pytest.mark.parametrize("language", ["en", "de"])
def test_plots_are_figures_that_show_themselves(named, language, tmp_path):
    settings = ReportSettings(language=language)
    plots = [cablebend.plot_characteristic, cablebend.plot_forces, cablebend.plot_residuals]
    for figure in (*(plot(named, settings=settings) for plot in plots), cablebend.plot_photo(named, 0)):
        assert isinstance(figure, Figure)
        assert figure._repr_png_().startswith(b"\x89PNG")
        figure.savefig(tmp_path / "figure.pdf")


def test_what_was_not_measured_cannot_be_plotted(named):
    failed = Result(status="failed", specimen=SpecimenPart(id="a", folder="a"))
    for plot in (cablebend.plot_characteristic, cablebend.plot_forces, cablebend.plot_residuals):
        with pytest.raises(ValueError, match=r"a has no \w+ to plot"):
            plot(failed)
        with pytest.raises(ValueError, match=r"a hat keine \w+ zum Zeichnen"):
            plot(failed, settings=ReportSettings(language="de"))
    with pytest.raises(ValueError, match="steps with one: 0"):
        cablebend.plot_photo(named, 99)


def test_residuals_are_those_of_the_model_that_answers(named):
    assert answer_map(named) is named.diagnosis.residuals_after
    refuted = named.diagnosis.model_copy(update={"extended_refuted": True})
    unexplained = named.model_copy(update={"diagnosis": refuted})
    assert unexplained.answer.method == "inverse"
    assert answer_map(unexplained) == measured_map(named)


def test_a_diagnosis_that_breaks_costs_neither_way_nor_report(tmp_path, monkeypatch):
    def broken(*_):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(pipeline.run, "diagnose", broken)
    result = cablebend.measure(ROOT / "fixtures/specimens/plain")
    assert result.diagnosis is None and result.inverse.curve is not None and result.balance.curve is not None
    told = [finding.message for finding in result.findings if finding.code == "diagnosis/program-error"]
    assert len(told) == 1 and "LinAlgError: Singular matrix" in told[0]
    cablebend.write(result.model_copy(update={"photos": []}), tmp_path)
    assert "Singular matrix" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_diagnosis_that_wants_more_memory_than_there_is_costs_nothing_else(monkeypatch):
    def broken(*_):
        raise MemoryError("Unable to allocate 298. GiB")  # 200,000 samples in one hold asked for it

    monkeypatch.setattr(pipeline.run, "diagnose", broken)
    part, findings, _ = pipeline.run._diagnosed(Faults(SimpleNamespace()), SimpleNamespace(), Settings())
    assert part is None
    assert [finding.code for finding in findings] == ["diagnosis/program-error"]
    assert "298. GiB" in findings[0].message
