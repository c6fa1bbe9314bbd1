"""Where the bearing stood in a hold: the mean where it stood still, the photo's sample where it moved, and how well.

Truth is the noise-free place of the simulated bearing at the time of the photo.
"""

import numpy as np
import pytest

from pipeline.intake.holdplace import hold_places

SIGMA = 1.5e-4


def holds(seed, course, *, samples=12, steps=6):
    """Samples of an encoder that scatters by `SIGMA`, the photo at the last of each hold, and the true places there."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, samples)
    clean = [3e-3 * number + course(t) for number in range(steps)]
    photo = [np.arange(samples) == samples - 1] * steps
    return [c + SIGMA * rng.standard_normal(samples) for c in clean], photo, np.array([c[-1] for c in clean])


COURSES = {
    "stands still": lambda t: np.zeros_like(t),
    "creeps by six standard deviations": lambda t: 9e-4 * t,
    "arrives late": lambda t: np.where(t < 0.25, -3e-3 * (1.0 - 4.0 * t), 0.0),
    "moved once within the step": lambda t: np.where(t < 0.3, -2e-3, 0.0),
}


@pytest.mark.parametrize("name", COURSES)
def test_places_scatter_about_the_truth_as_much_as_they_say(name):
    z = []
    for seed in range(60):
        logged, photo, truth = holds(seed, COURSES[name])
        found = hold_places(logged, photo)
        z.append((np.array(found.place) - truth) / np.array(found.std))
    z = np.concatenate(z)
    # 360 places; sigma itself is known to 15 % of a log, and late samples within its reach pull a mean a little
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1.0, abs=0.2)
    assert abs(np.mean(z)) < 0.35


def test_a_mean_is_better_than_the_sample_at_the_photo():
    logged, photo, truth = holds(1, COURSES["stands still"], samples=25)
    found = hold_places(logged, photo)
    assert found.sigma == pytest.approx(SIGMA, rel=0.33)  # the median of 144 changes is known to 11 %: three of those
    assert np.all(np.array(found.std) < 0.27 * SIGMA)  # one over the root of 25, that error of sigma, a sample less
    assert np.all(np.abs(np.array(found.place) - truth) < 4.0 * SIGMA / 5.0)


@pytest.mark.parametrize(
    ("logged", "photo"),
    [
        ([np.full(9, 3e-3), np.full(9, 6e-3)], [np.arange(9) == 8] * 2),  # a setpoint, to the digit
        ([np.array([3.0e-3, 3.1e-3]), np.array([6.0e-3, 6.1e-3])], [np.array([False, True])] * 2),  # two changes
        ([np.array([3e-3]), np.array([6e-3])], [np.array([True])] * 2),
    ],
)
def test_a_log_that_tells_no_scatter_says_so(logged, photo):
    found = hold_places(logged, photo)
    assert found.std == (None, None)
    assert found.place == tuple(hold[-1] for hold in logged)


def test_a_log_that_scatters_contradicts_nothing(specimen_folder):
    rng = np.random.default_rng(3)
    rows = ["step,branch,displacement_mm,force_N,image"]
    for step, (at, force) in enumerate([(0.0, 0.0), (4.0, 2.3), (8.0, 2.9)]):
        for sample in range(8):
            branch = "loading" if step else "mounted"
            image = f"step_{step}.png" if sample == 7 else ""
            place = at + 0.15 * rng.standard_normal()
            rows.append(f"{step},{branch},{place:.4f},{force + 1e-3 * rng.standard_normal():.4f},{image}")
    folder = specimen_folder(log="\n".join(rows))
    found = folder.read()
    assert folder.codes() == ["log/displacement-noise"]
    # 0.15 mm over the root of 8 is 0.053 mm; the scatter of 21 changes is known to a fifth, twice that
    assert all(step.displacement_std_m == pytest.approx(0.053e-3, rel=0.4) for step in found.steps)
    assert [1e3 * step.displacement_m for step in found.steps] == pytest.approx([0.0, 4.0, 8.0], abs=4 * 0.053)
