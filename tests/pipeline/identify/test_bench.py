"""From rendered photos to the characteristic: shared specimens of another simulator, solver and renderer."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from pipeline.identify import identify
from pipeline.intake.folder import read_specimen
from pipeline.settings import Settings
from pipeline.vision.series import trace_series
from tests.rod.virtual_cable import StickSlip

SHARED = Path(os.environ.get("CABLEBEND_SHARED", Path(__file__).resolve().parents[4] / "shared")) / "data" / "bench"

pytestmark = pytest.mark.shared


def identified(name):
    settings = Settings()
    specimen = read_specimen(SHARED / name, settings.intake)
    truth = json.loads((SHARED / name / "truth.json").read_text())
    found = identify(specimen, trace_series(specimen, settings.vision), settings.identify)
    return found, StickSlip(truth["ei0"], truth["ei1"], truth["kc"], truth["K0"])


def test_nothing_hidden():
    found, law = identified("bench-a")
    for way, bound in ((found.inverse, 0.015), (found.balance, 0.015)):
        relative = way.tangent / law.tangent(way.kappa) - 1
        assert np.sqrt(np.mean(relative**2)) < bound
        assert np.mean(np.abs(relative) < 1.96 * way.tangent_std / way.tangent) > 0.8
        assert abs(way.pre_curvature - law.K0) < 0.05
    assert found.agreement.compatible
    for fit in found.inverse.evaluation.steps:
        if fit.force is not None:
            assert abs(fit.force[0]) < 0.01 * fit.data.step.force


@pytest.mark.parametrize("name", ["bench-b", "bench-c"])
def test_hidden_effects_show_as_residuals_not_as_a_crash(name):
    found, _ = identified(name)
    assert found.inverse.characteristic is not None
    assert found.balance.measured
    assert any(finding.code.startswith("identify/misfit") for finding in found.findings)
    assert max(found.inverse.model.blur) > 3.0
