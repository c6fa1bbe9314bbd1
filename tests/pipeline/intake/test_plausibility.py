"""Sizes that do not fit together are told with their figures: units off by a thousand, lengths, displacements."""

import re

import numpy as np
import pytest

from pipeline.intake.plausibility import size_findings
from pipeline.records import LoadStep
from pipeline.report.words import Words
from pipeline.settings.intake import IntakeSettings

SETTINGS = IntakeSettings()


def steps(force, displacement_m):
    empty = np.empty(0)
    return tuple(
        LoadStep(n, "loading", displacement_m * (n + 1) / 3, force, 1e-3 * force, None, empty, empty, None)
        for n in range(3)
    )


def codes(length_m, diameter_m, force, displacement_m=0.012):
    return [f.code for f in size_findings(length_m, diameter_m, steps(force, displacement_m), settings=SETTINGS)]


# length / m, diameter / m, force / N: the cable of the paper, benches of ../shared, a fine lead, a power cable
CABLES = [(0.181, 4.6e-3, 0.5), (0.2, 6e-3, 0.87), (0.19, 5e-3, 2.1), (0.1, 1.2e-3, 0.03), (1.5, 25e-3, 60.0)]


@pytest.mark.parametrize(("length", "diameter", "force"), CABLES)
def test_cables_as_they_are_pass(length, diameter, force):
    assert codes(length, diameter, force, 0.07 * length) == []


@pytest.mark.parametrize(("length", "diameter", "force"), CABLES)
@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_force_off_by_a_thousand(length, diameter, force, factor):
    assert codes(length, diameter, factor * force, 0.07 * length) == ["size/force"]


def found_for(EI, diameter):
    """Findings of a cable of bending stiffness EI / (N m²) that is bent by a tenth of its length."""
    force = 1.1 * np.pi**2 * EI / 0.181**2
    return size_findings(0.181, diameter, steps(force, 0.018), settings=SETTINGS)


@pytest.mark.parametrize("factor", [1.0, 1e-3, 1e3])
def test_what_no_bar_of_steel_and_no_loose_wire_has_is_an_error(factor):
    """A cable of 18 mN m² and 4.6 mm, as it is and with its forces a thousand times too large or small."""
    found = found_for(0.012 * factor, 4.6e-3)
    levels = {1.0: [], 1e-3: ["warning"], 1e3: ["error"]}[factor]  # 0.5 MPa: hardly a cable, but some soft cord
    assert [finding.level for finding in found] == levels
    if factor == 1e3:
        assert "1000 times too large (mN taken for N, or N for kN)" in found[0].message
        assert "steel" in found[0].message
    if factor == 1e-3:
        assert "1000 times too small (kN taken for N, or N for mN)" in found[0].message


@pytest.mark.parametrize(
    ("factor", "said"),
    [(101.97, "grams taken for N"), (1e9, "MN written for mN"), (1e13, "do not fit"), (1e-6, "loose")],
)
def test_other_units_of_force(factor, said):
    (finding,) = found_for(0.02 * factor, 4.6e-3)
    assert finding.code == "size/force" and said in finding.message
    assert not re.search(r"\de[+-]\d", finding.message)  # who is tired reads 1e+01 as 1
    german = Words("de").said(finding.said)
    assert german.language == "de" and "times too" not in german.text and " for " not in german.text


@pytest.mark.parametrize("diameter", [2e-3, 3e-3, 5e-3, 8e-3, 15e-3, 30e-3])
@pytest.mark.parametrize("EI", [1e-5, 1e-4, 1e-3, 1e-2, 1e-1])
def test_no_cable_is_called_impossible(EI, diameter):
    """All but those below 5 kPa, softer than a gel: 30 mm thick, 0.1 mN m² is no cable."""
    modulus = EI / (np.pi * diameter**4 / 64.0)
    assert modulus < 5e3 or not [finding for finding in found_for(EI, diameter) if finding.level == "error"]


def test_the_figures_are_right():
    (finding,) = size_findings(0.2, 5e-3, steps(1000.0, 0.012), settings=SETTINGS)
    EI = float(re.search(r"π² = ([\d.]+)\u00a0N m²", finding.message)[1])
    modulus = float(re.search(r"modulus of ([\d.e+]+) MPa", finding.message)[1])
    expected = 1000.0 * 0.2**2 / np.pi**2
    # both are printed to three digits, half of the last of which is at most 0.5 % of the number
    assert pytest.approx(expected, rel=5e-3) == EI
    assert modulus == pytest.approx(expected / (np.pi * 5e-3**4 / 64.0) * 1e-6, rel=5e-3)


def test_stocky_cable_and_odd_displacements():
    assert "size/slenderness" in codes(0.02, 6e-3, 50.0, 1e-3)
    assert "size/displacement" in codes(0.181, 4.6e-3, 0.5, 4.0)
    assert "size/displacement" in codes(0.181, 4.6e-3, 0.5, 4e-6)


def test_scale_the_wrong_way_round():
    seen = size_findings(0.181, 4.6e-3, steps(0.5, 0.012), scale_px_per_m=1e3 / 5.1, settings=SETTINGS)
    assert [finding.code for finding in seen] == ["size/scale"]
    assert "0.9 px wide" in seen[0].message and "not mm per px" in seen[0].message
    assert size_findings(0.181, 4.6e-3, steps(0.5, 0.012), scale_px_per_m=5.1e3, settings=SETTINGS) == ()
