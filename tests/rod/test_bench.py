"""The rod against the independent simulator behind the shared specimens: another solver, another discretisation.

Their law, K0 and chords are given in ``truth.json``; forces, curvatures and moments are compared. The elements of
bench-b's friction and the slope of bench-c's pre-curvature are read off the truth's own m(K) and kappa, not fitted.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rod.bending_test import BendingTest, simulate
from rod.laws import StickSlip
from rod.section import InternalFriction


def truth(shared_data: Path, name: str) -> tuple[BendingTest, list[dict[str, object]]]:
    data = json.loads((shared_data / "bench" / name / "truth.json").read_text(encoding="utf-8"))
    law = StickSlip(data["ei0"], data["ei1"], data["kc"])
    return BendingTest(1e-3 * data["L_mm"], law, data["K0"], elements=200), data["steps"]


def agree(test: BendingTest, steps: list[dict[str, object]]) -> None:
    """Forces to 1e-4, moments and shapes to 1e-4 of their largest value, curvature to 1e-3 of its range.

    The truth's curvature belongs to cells of its grid of 200 and lies half a cell beside its arc length at the ends.
    """
    force = max(abs(step["F"]) for step in steps)
    for step, found in zip(steps, simulate(test, chords=[1e-3 * step["chord_mm"] for step in steps]), strict=True):
        assert found.good
        s, xy = 1e-3 * np.array(step["s_mm"]), 1e-3 * np.array(step["xy_mm"])
        assert found.force == pytest.approx(step["F"], abs=1e-4 * force)
        moment = np.interp(s, found.s, found.moment)
        assert np.abs(moment - step["m"]).max() < 1e-4 * force * test.length * 0.25
        assert np.abs(np.interp(s, found.s, found.y) - (xy - xy[0])[:, 1]).max() < 1e-5 * test.length
        inside = slice(2, -2)
        kappa = np.interp(s, found.s, found.kappa)
        assert np.abs(kappa - step["kappa"])[inside].max() < 4e-3 * np.ptp(kappa) + 1e-3


@pytest.mark.shared
def test_plain_cable(shared_data: Path) -> None:
    agree(*truth(shared_data, "bench-a"))


@pytest.mark.shared
def test_cable_with_internal_friction_forth_and_back(shared_data: Path) -> None:
    test, steps = truth(shared_data, "bench-b")
    # Moment above the law on first loading: bends at D = 1 and 10/3 1/m, slopes 0.3 EI0 (1 + 0.6) and 0.3 EI0 0.6.
    stiffness = 0.3 * test.characteristic.EI0
    late = InternalFriction(2.0 * stiffness, 10.0 / 3.0, elements=1)
    agree(replace(test, friction=InternalFriction(stiffness, 1.0, elements=1, beside=late)), steps)


@pytest.mark.shared
def test_cable_with_pre_curvature_growing_along_it(shared_data: Path) -> None:
    test, steps = truth(shared_data, "bench-c")
    agree(replace(test, pre_curvature=lambda xi: test.pre_curvature + 0.7 * (2.0 * xi - 1.0)), steps)
