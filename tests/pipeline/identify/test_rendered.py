"""From photos of our own renderer to the characteristic; the cables are bent by quadrature, not by the rod."""

import numpy as np
import pytest

from pipeline.identify import identify_test, measured_test
from pipeline.intake.folder import read_specimen
from pipeline.settings import Settings
from pipeline.simulate import Experiment, State, write_specimen
from pipeline.vision.series import trace_series
from tests.rod.virtual_cable import StickSlip, equilibrium, force_free

CABLES = {
    "stiff, bent at rest": Experiment(id="stiff", EI0=0.3, EI1=0.08, kc=4.0, K0=2.5, seed=3),
    "soft, nearly straight": Experiment(id="soft", length_m=0.2, EI0=2e-4, EI1=1e-4, kc=3.0, K0=0.6, seed=4),
}
STEPS = (0.0, 0.004, 0.008, 0.012)


def state(shape, law):
    return State(shape.force, shape.chord, shape.s, shape.x, shape.y, shape.theta, shape.kappa, law.moment(shape.kappa))


@pytest.mark.parametrize("name", CABLES)
def test_characteristic_from_rendered_photos(tmp_path, name):
    given = CABLES[name]
    experiment = Experiment(**{**vars(given), "displacements_m": STEPS})
    law = StickSlip(given.EI0, given.EI1, given.kc, given.K0)
    rest = force_free(law, given.length_m)
    shapes = [rest, *(equilibrium(law, given.length_m, rest.chord - d) for d in STEPS[1:])]
    written = write_specimen(tmp_path / given.id, experiment, states=tuple(state(s, law) for s in shapes))
    settings = Settings()
    specimen = read_specimen(written.folder, settings.intake)
    found = identify_test(
        measured_test(specimen, trace_series(specimen, settings.vision), settings.identify), settings.identify
    )
    for way in (found.inverse.law, found.balance.law):
        relative = way.tangent / law.tangent(way.kappa) - 1
        # promised of rendered photos: 1.5 % rms, K0 within 0.05 1/m
        assert np.sqrt(np.mean(relative**2)) < 0.015
        assert abs(way.pre_curvature - law.K0) < 0.05
        # One curve counts for about three independent points; 0.7 is missed by chance once in a hundred curves.
        assert np.mean(np.abs(relative) < 1.96 * way.tangent_std / way.tangent) > 0.7
    assert found.agreement.p_value > 1e-3
