"""Columns of a fit against central differences of whole simulations."""

from dataclasses import replace

import numpy as np
import pytest

from fixtures.continuum import Cable
from fixtures.effects import LARGEST, PROTOCOLS
from fixtures.hidden import hidden_test
from pipeline.diagnosis.causes import CATALOGUE
from rod.inverse import simulation
from rod.inverse.base import start
from rod.inverse.extension import Extension, Term
from rod.inverse.observation import observe
from rod.inverse.prediction import facts_of
from rod.inverse.sensitivities import sensitivities, whole_residual
from rod.inverse.simulation import run

TEST = hidden_test(Cable(), PROTOCOLS["loop"], largest=LARGEST, seed=1)
FACTS = facts_of(TEST)


@pytest.mark.parametrize("turned", [False, True])
def test_place_and_width_of_a_spot_move_the_data_as_whole_simulations_say(turned):
    test = hidden_test(Cable(), PROTOCOLS["three"], largest=LARGEST, seed=1)
    facts, kinds = facts_of(test), {cause.name: cause for cause in CATALOGUE}
    held = [("stiffness_varying", 5, -0.1), ("pre_curvature_varying", 4, 0.1)]
    terms = tuple(Term(kinds[name], kinds[name].variants(facts)[form]) for name, form, _ in held)
    base = start(test, facts)
    extension = Extension(base, facts, terms, turned=turned)
    amounts = tuple(share * 10.0 * kinds[name].plausible(facts) for name, _, share in held)
    vector, observation = extension.start(base.neutral(), amounts), observe(test)
    base_model = extension.base_model(vector)
    here = run(extension.model(vector, of=base_model), facts)
    jacobian = sensitivities(observation, extension, vector, base_model, here)
    for j in range(len(base.names), extension.size):
        quotient = central(observation, extension, vector, here, j)
        # the quotient is right to the square of its step; a one-sided one was off by 1 %
        assert np.abs(jacobian[:, j] - quotient).max() < 1e-3 * np.abs(quotient).max(), j


@pytest.mark.parametrize("name", ["pre_curvature", "scale", "length"])
def test_moves_of_the_curve_along_itself_change_no_distance(name):
    """By a direction of the curve interpolated between its nodes, columns were off by 9e-5, 7e-5 and 4e-5."""
    test = hidden_test(Cable(), PROTOCOLS["three"], largest=LARGEST, seed=1)
    facts, observation = facts_of(test), observe(test)
    extension = Extension(start(test, facts), facts, ())
    vector = extension.start(extension.base.neutral(), ())
    base_model, j = extension.base_model(vector), extension.base.names.index(name)
    here = run(extension.model(vector, of=base_model), facts)
    column = sensitivities(observation, extension, vector, base_model, here)[:, j]
    quotient = central(observation, extension, vector, here, j)
    photos = np.flatnonzero(~observation.rows.force)
    assert np.linalg.norm((column - quotient)[photos]) < 1e-5 * np.linalg.norm(quotient[photos])


def central(observation, extension, vector, here, j):
    ends = []
    for step in (extension.steps[j], -extension.steps[j]):
        trial = vector.copy()
        trial[j] += step
        there = run(extension.model(trial), extension.facts, near=here).prediction
        ends.append(whole_residual(observation, there, trial, extension.prior))
    return (ends[1] - ends[0]) / (2.0 * extension.steps[j])


FORMS = [(cause.name, form) for cause in CATALOGUE for form in range(len(cause.variants(FACTS)))]


@pytest.mark.parametrize(("name", "form"), FORMS)
def test_every_form_of_every_cause_moves_the_data_as_whole_simulations_say(name, form, monkeypatch):
    (cause,) = (cause for cause in CATALOGUE if cause.name == name)
    beside = next(one for one in CATALOGUE if one.name == ("in_plane_load" if name == "hysteresis" else "hysteresis"))
    variant = cause.variants(FACTS)[form]
    if "width" in variant.tuned and variant.width == variant.width_range[0]:
        variant = replace(variant, width=np.mean(variant.width_range))  # at an end of its range it moves to one side
    terms = (Term(cause, variant), Term(beside, beside.variants(FACTS)[0]))
    extension = Extension(start(TEST, FACTS), FACTS, terms)
    vector = extension.start(extension.base.neutral(), (cause.plausible(FACTS), 0.2 * beside.plausible(FACTS)))
    observation, base_model = observe(TEST), extension.base_model(vector)
    here = run(extension.model(vector, of=base_model), FACTS)
    monkeypatch.setattr(simulation, "solve", None)  # nothing is simulated for it
    jacobian = sensitivities(observation, extension, vector, base_model, here)
    monkeypatch.undo()
    for j in range(len(extension.base.names) + terms[0].size):
        quotient = central(observation, extension, vector, here, j)
        error = jacobian[:, j] - quotient
        # elements of friction begin to slip one after the other: a quotient over that is off where they do
        assert np.linalg.norm(error) < 0.02 * np.linalg.norm(quotient), j
