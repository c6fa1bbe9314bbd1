"""Sizes that do not fit together are told with their figures: units off by a thousand, lengths, displacements."""

import re

import numpy as np
import pytest

from pipeline.intake.plausibility import size_findings
from pipeline.records import LoadStep
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


def test_the_figures_are_right():
    (finding,) = size_findings(0.2, 5e-3, steps(1000.0, 0.012), settings=SETTINGS)
    EI = float(re.search(r"pi\^2 = ([\d.]+)\u00a0N m²", finding.message)[1])
    modulus = float(re.search(r"modulus of ([\d.e+]+) MPa", finding.message)[1])
    assert pytest.approx(1000.0 * 0.2**2 / np.pi**2, rel=5e-3) == EI
    assert modulus == pytest.approx(EI / (np.pi * 5e-3**4 / 64.0) * 1e-6, rel=1e-2)


def test_stocky_cable_and_odd_displacements():
    assert "size/slenderness" in codes(0.02, 6e-3, 50.0, 1e-3)
    assert "size/displacement" in codes(0.181, 4.6e-3, 0.5, 4.0)
    assert "size/displacement" in codes(0.181, 4.6e-3, 0.5, 4e-6)


def test_scale_the_wrong_way_round():
    seen = size_findings(0.181, 4.6e-3, steps(0.5, 0.012), scale_px_per_m=1e3 / 5.1, settings=SETTINGS)
    assert [finding.code for finding in seen] == ["size/scale"]
    assert "0.9 px wide" in seen[0].message and "not mm per px" in seen[0].message
    assert size_findings(0.181, 4.6e-3, steps(0.5, 0.012), scale_px_per_m=5.1e3, settings=SETTINGS) == ()
