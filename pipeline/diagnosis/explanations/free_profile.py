"""A profile along the cable in any form: a sum of waves in the place of the forms it was found by.

A step, a kink or several bumps are no form of the catalogue, and what three forms leave of a strong one is many times
the noise. Once a cause along the cable is in the model, its profile may be whatever the photos ask for. Photos of the
force-free cable show K0(s) directly, photos under load by what does not grow with the moment, so that waves are a
nearly linear problem. What is known of their amounts beforehand (`causes.profile.wave`) is in the fit, so that waves
that nothing asks for stay at zero, and whether waves are likelier than a few forms is for the posterior to say.
"""

from __future__ import annotations

import numpy as np

from pipeline.diagnosis.causes import Cause
from pipeline.diagnosis.causes.profile import deviation, position_of, profile, wave
from pipeline.records import Array
from rod.inverse.extension import Extension, Term
from rod.inverse.fit import Fit, fit
from rod.inverse.observation import Observation

WAVES = 24
"""Of a sharp step of K0 by 3 1/m, 24 leave waves of 0.5 um across the cable: a twentieth of a pixel's tenth, below what
a photo shows. A shape has 20 functions a photo, so more could hardly be told apart."""


def free_profile(observation: Observation, fitted: Fit, cause: Cause) -> list[Fit]:
    """Fit waves in the place of the forms of a cause along the cable; empty where that has no equilibrium.

    Parameters
    ----------
    observation : Observation
    fitted : Fit
        With the cause in it.
    cause : Cause
        A profile along the cable.
    """
    extension, vector = in_waves(fitted, cause)
    starts, base, (at, facts) = [vector], extension.base, (extension.base.pre_curvature_index, extension.facts)
    if at is not None and "mounted" not in facts.branch:
        # nothing shows the cable at rest, and few forms that are far from the data leave the side of K0 to chance
        starts.append(np.r_[base.neutral(), vector[len(base.names) :]])
        starts[1][at] = -vector[at]
    found = [fit(observation, extension, start, near=fitted.run) for start in starts]
    return sorted((one for one in found if one.run.prediction is not None), key=lambda one: one.chi2)[:1]


def in_waves(fitted: Fit, cause: Cause) -> tuple[Extension, Array]:
    """The model with waves in the place of the forms of a cause, and the vector nearest to the fitted one.

    Waves have mean zero; a mean that the forms had (spots) goes to the law, or to K0.
    """
    own = fitted.extension.terms_of(cause)
    rest, vector = fitted.extension.without(fitted.vector, own)
    uniform, varying = rest.model(vector), fitted.extension.model(fitted.vector)
    terms = tuple(Term(cause, wave(k)) for k in range(1, WAVES + 1))
    position = position_of(uniform)
    waves = np.column_stack([np.ones_like(position), *(profile(term.variant, position) for term in terms)])
    mean, *amounts = np.linalg.lstsq(waves, deviation(uniform, varying, cause), rcond=None)[0]
    if cause.unit == "-":
        vector = rest.base.stiffer(vector, 1.0 + max(mean, -0.9))
        amounts = [amount / (1.0 + max(mean, -0.9)) for amount in amounts]
    elif (bend := rest.base.pre_curvature_index) is not None:
        vector[bend] += mean
    return Extension(rest.base, rest.facts, (*rest.terms, *terms)), np.r_[vector, amounts]
