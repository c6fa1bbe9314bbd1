"""``paper.json`` as the contract names it, and a page that needs nothing else."""

import json
import re
import xml.etree.ElementTree as ElementTree

import pytest

from pipeline.report.paper import draw, statements, write_paper
from pipeline.report.words import Words


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("paper")
    return out, write_paper(out)


@pytest.fixture(scope="module")
def folder(made):
    return made[0]


def test_numbers_have_the_contracts_names(folder):
    numbers = json.loads((folder / "paper.json").read_text(encoding="utf-8"))
    for reading in ("secant", "tangent"):
        assert len(numbers["table1"][reading]["force_N"]) == len(numbers["table1"][reading]["kappa_max_per_m"]) == 3
    assert numbers["inverse"]["iterations_to_1e-3"] <= 10
    assert len(numbers["inverse"]["history"]) == numbers["inverse"]["iterations"] + 1
    assert numbers["inverse"]["pre_curvature_per_m"] == pytest.approx(2.0)
    assert numbers["forced_straight"]["ordinates_Nm2"][0] < 0.0
    assert numbers["forced_straight"]["converged"]
    # physics notes: -36, +14 and +16 mN, where the paper says "small deviations"
    assert numbers["forced_straight"]["force_error_N"] == pytest.approx([-0.036, 0.014, 0.016], abs=6e-4)
    steps = numbers["rediscovery"]
    assert [step["cause"] for step in steps] == ["nonlinear_stiffness", "pre_curvature"]
    assert steps[1]["heldout_excess_removed"] > 0.99  # without noise nothing but the model's own grid is left
    assert sum(row["share"] for row in numbers["disagreement"] if row["share"] is not None) == pytest.approx(1.0)


def test_figures_stand_alone_and_on_the_page(folder):
    page = (folder / "paper.html").read_text(encoding="utf-8")
    assert "http://" not in page.replace("http://www.w3.org/", "") and "https://" not in page
    assert "&#" not in page.partition("<style>")[2].partition("</style>")[0]  # escaped quotes end a style sheet
    assert "−36, +14, +16\u00a0mN" in page
    for said in (
        "initial rod",
        "forces and curvatures over the iterations",
        "Eq. (6)",
        "Eq. (7)",
        "K0 free",
        "photo 3",
    ):
        assert said in page
    figures = sorted(path.stem for path in folder.glob("*.svg"))
    assert figures == ["fig3", "fig4", "fig5", "fig6", "fig7a", "fig7b", "fig7c", "fig7d"]
    for name in figures:
        assert ElementTree.fromstring((folder / f"{name}.svg").read_text(encoding="utf-8")).tag.endswith("svg")
        assert f'id="{name}"' in page


def test_statements_and_figures_are_german_where_asked_for(made):
    words = Words("de")
    said = " ".join(part for row in statements(made[1], words) for part in row)
    assert re.search(r"bis zu \d+ % einer Kraft", said)
    assert "veränderliche Vorkrümmung" in said and "Newton-Schritten" in said
    assert "EI = 0,01 N m²" in said and "f_EI(0) = −0,6" in said and "step" not in said
    figures = draw(made[1], words)
    assert [title for title, _ in figures][-1] == "Bild 7: alles zusammen"
    drawn = "".join(figure.svg for _, figure in figures)
    for text in ("Anfangslage: ohne Kraft", "bezogen auf Tabelle 1", "K0 frei", "inverses Problem", "Krümmung κ [1/m]"):
        assert text in drawn
    assert "iteration<" not in drawn and "Table 1" not in drawn
