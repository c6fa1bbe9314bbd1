"""The README's Python example, run word for word, and what the package offers without loading anything heavy."""

import importlib
import inspect
import io
import re
import shutil
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import pipeline.run
from pipeline.result import Result
from pipeline.settings import Settings
from tests.test_cli import HEAVY

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def example() -> str:
    """The block after the marker, as a reader would copy it."""
    found = re.search(r"<!-- python example -->\s*```python\n(.*?)```", README, re.DOTALL)
    assert found, "README.md has no block after <!-- python example -->"
    return found[1]


def stages() -> list[str]:
    """Functions that the table of stages names, with the arguments it shows."""
    table = README.partition("<!-- python stages -->")[2].partition("\n\n")[0]
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
def test_stages_of_the_readme_exist_with_the_arguments_shown(call):
    name, _, arguments = call.partition("(")
    module, _, function = name.rpartition(".")
    signature = inspect.signature(getattr(importlib.import_module(module), function))
    given = [argument.strip() for argument in arguments.rstrip(")").split(",")]
    named = {argument.partition("=")[0]: None for argument in given if "=" in argument}
    signature.bind(*(argument for argument in given if "=" not in argument), **named)


def test_the_readme_names_the_stages():
    assert len(stages()) > 5


def test_importing_the_package_loads_nothing_heavy():
    program = "import sys\nimport pipeline\ndir(pipeline)\nprint(sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not {name.strip(" '[]\n").partition(".")[0] for name in done.stdout.split(",")} & HEAVY


def test_everything_offered_is_there():
    for name in pipeline.__all__:
        assert getattr(pipeline, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'mesure'"):
        pipeline.__getattr__("mesure")


def test_a_diagnosis_that_breaks_costs_neither_way_nor_report(tmp_path, monkeypatch):
    def broken(*_):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(pipeline.run, "diagnose", broken)
    result = pipeline.measure(ROOT / "fixtures/specimens/three")
    assert result.diagnosis is None and result.inverse.curve is not None and result.balance.curve is not None
    told = [finding.message for finding in result.findings if finding.code == "diagnosis/program-error"]
    assert len(told) == 1 and "LinAlgError: Singular matrix" in told[0]
    pipeline.write(result, tmp_path)
    assert "Singular matrix" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_diagnosis_that_wants_more_memory_than_there_is_costs_nothing_else(monkeypatch):
    def broken(*_):
        raise MemoryError("Unable to allocate 298. GiB")  # 200,000 samples in one hold asked for it

    monkeypatch.setattr(pipeline.run, "diagnose", broken)
    part, findings = pipeline.run._diagnosed(SimpleNamespace(test=None), Settings())
    assert part is None
    assert [finding.code for finding in findings] == ["diagnosis/program-error"]
    assert "298. GiB" in findings[0].message
