"""Do the error bars tell the truth? The 95 % band of kappa over 100 rendered bows, in even and in directional light.

At 7 px/mm, to draw so many in half a minute; bands scale with the picture as errors do (see the targets at 5 and 12).
"""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.vision.render.sheath import Sheath
from tests.pipeline.vision.bow_scene import bow_scene, directional, traced_errors

SCENES = 50


def even(rng):
    return bow_scene(rng, px_per_mm=7.0, noise=rng.choice([0.005, 0.02, 0.05]))


def lit(rng):
    return bow_scene(
        rng,
        px_per_mm=7.0,
        noise=rng.choice([0.005, 0.02, 0.05]),
        light=directional(rng),
        sheath=Sheath(gloss=rng.uniform(0.2, 0.6), text="H05VV-F 2x1.0" if rng.random() < 0.5 else ""),
    )


@pytest.mark.parametrize("make", [even, lit], ids=["even", "directional"])
def test_band_of_kappa_covers_the_truth(make):
    found = traced_errors(SCENES, make, seed=30)
    covered = np.array([e.covered() for e in found])
    assert 0.90 <= covered.mean() <= 0.99
    # Nor may the good mean hide bad ends: they alone.
    ends = np.array([e.covered()[~e.inner].mean() for e in found])
    assert ends.mean() >= 0.88
    # Errors in units of their bands: not a few scenes off by many.
    worst = [np.max(np.abs(e.kappa / e.kappa_std)) for e in found]
    assert np.quantile(worst, 0.95) < 4.5
