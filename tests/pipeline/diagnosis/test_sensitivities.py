"""Columns of a fit against central differences of whole simulations."""

import numpy as np
import pytest

from fixtures.continuum import Cable
from fixtures.effects import LARGEST, PROTOCOLS
from fixtures.hidden import hidden_test
from fixtures.scores import SETTINGS
from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.fits.base import start
from pipeline.diagnosis.fits.extension import Extension, Term
from pipeline.diagnosis.fits.sensitivities import sensitivities, whole_residual
from pipeline.diagnosis.observations.observation import observe
from pipeline.diagnosis.observations.prediction import facts_of
from pipeline.diagnosis.observations.simulation import run


@pytest.mark.parametrize("turned", [False, True])
def test_place_and_width_of_a_spot_move_the_data_as_whole_simulations_say(turned):
    test = hidden_test(Cable(), PROTOCOLS["three"], largest=LARGEST, seed=1)
    facts, kinds = facts_of(test), {cause.name: cause for cause in CATALOGUE}
    held = [("stiffness_varying", 5, -0.1), ("nonlinear_stiffness", 4, 0.1), ("pre_curvature_varying", 4, 0.1)]
    terms = tuple(Term(kinds[name], kinds[name].variants(facts)[form]) for name, form, _ in held)
    base = start(test, facts, knots=5, elements=120, smoothness=SETTINGS.roughness)
    extension = Extension(base, facts, terms, turned=turned)
    amounts = tuple(share * 10.0 * kinds[name].plausible(facts) for name, _, share in held)
    vector, observation = extension.start(base.neutral(), amounts), observe(test, SETTINGS)
    base_model = extension.base_model(vector)
    here = run(extension.model(vector, of=base_model), facts)
    jacobian = sensitivities(observation, extension, vector, base_model, here)
    closed = [0, 1, 2, 3, 5, 6, 7]  # all but the place of the control point, whose spline has kinks
    for j in (len(base.names) + k for k in closed):
        ends = []
        for step in (extension.steps[j], -extension.steps[j]):
            trial = vector.copy()
            trial[j] += step
            there = run(extension.model(trial), facts, near=here).prediction
            ends.append(whole_residual(observation, there, trial, extension.prior))
        quotient = (ends[1] - ends[0]) / (2.0 * extension.steps[j])
        # the quotient is right to the square of its step; a one-sided one was off by 1 %
        assert np.abs(jacobian[:, j] - quotient).max() < 1e-3 * np.abs(quotient).max(), j
