"""A force channel that does not answer to the bending is refused; one that answers, however weakly, is not."""

import numpy as np
import pytest

from pipeline.errors import InputError

FORCES = {"mounted": (0.0, 2.3, 2.7, 2.9), "loading": (2.3, 2.33, 2.35, 2.37)}


def text(first, forces, *, noise=2e-3, samples=5, seed=1):
    rng = np.random.default_rng(seed)
    rows = ["step,branch,displacement_mm,force_N"]
    for step, force in enumerate(forces):
        branch = first if step == 0 else "loading"
        place = 3.0 * (step + (first != "mounted"))
        rows += [f"{step},{branch},{place},{force + noise * rng.standard_normal():.5f}" for _ in range(samples)]
    return "\n".join(rows)


@pytest.mark.parametrize("first", FORCES)
@pytest.mark.parametrize(("level", "noise"), [(2.5, 0.0), (2.5, 2e-3), (-3e-3, 1e-3)])
def test_a_force_that_stands_still_is_refused(specimen_folder, first, level, noise):
    folder = specimen_folder(log=text(first, [level] * 4, noise=noise))
    if first == "loading" and noise == 1e-3:
        folder.read()  # forces of nothing but noise: no step says that they ought to differ
        return
    with pytest.raises(InputError) as caught:
        folder.read()
    assert caught.value.code == "log/force-stands-still"


@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_all_bent_steps_at_the_end_of_the_range_are_refused(specimen_folder, noise):
    with pytest.raises(InputError, match="3 steps between 3 and 9 mm read 2"):
        specimen_folder(log=text("mounted", [0.0, 2.0, 2.0, 2.0], noise=noise)).read()


@pytest.mark.parametrize("first", FORCES)
@pytest.mark.parametrize("samples", [1, 5])
def test_a_force_that_answers_is_read(specimen_folder, first, samples):
    # without a mounted step: 3 % over the steps, what a straight cable of 200 mm does over 12 mm of travel
    assert len(specimen_folder(log=text(first, FORCES[first], samples=samples)).read().steps) == 4
