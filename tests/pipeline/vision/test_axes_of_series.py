"""What the photos of a series tell each other of their axes: what they share is found, what differs is left open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.vision.centerline.axes_of_series import AxisSight, told_alone, told_by_others

CHORD, PLAY, PARALLAX, NOISE, PHOTOS = 0.17, 1e-4, 0.004, 2e-5, 6


MOST_SCORE = 1.3
"""Standard deviations, rms; twenty series tell it to a tenth: three of those."""


def seen(rng, *, lid=(0.0, 0.0), share=0.0, play=0.0, foot=(0.0, 0.0)):
    """Sights of a series whose bow grows, and its true misses (n, 2) without noise."""
    sights, truth = [], []
    for index in range(PHOTOS):
        turn = np.array([-1.0, 1.0]) * (0.15 + 0.09 * index)
        places = np.array([[0.002 * index, 0.0], [CHORD, 0.0]])
        normals = np.column_stack([-np.sin(turn), np.cos(turn)])
        off = share * (places - foot) + np.array([lid, np.zeros(2)]) + play * rng.standard_normal((2, 2))
        true = (off * normals).sum(axis=1)
        miss = true + NOISE * rng.standard_normal(2)
        sights.append(AxisSight(miss, NOISE**2 * np.eye(2), places, normals, PARALLAX, PLAY))
        truth.append(true)
    return sights, np.array(truth)


def judged(count=20, **rig):
    """Errors of what is told, m, and in standard deviations; the usual standard deviation of one photo alone, m."""
    off, scores, alone = [], [], []
    for seed in range(count):
        sights, truth = seen(np.random.default_rng([44, seed]), **rig)
        for sight, told, true in zip(sights, told_by_others(sights), truth, strict=True):
            off.append(told.shift - true)
            scores.append((told.shift - true) / np.sqrt(np.diag(told.covariance)))
            alone.append(np.sqrt(np.diag(told_alone(sight).covariance)))
    return (float(np.sqrt(np.mean(np.square(values)))) for values in (off, scores, alone))


@pytest.mark.parametrize(
    "rig",
    [{}, {"share": 0.008, "foot": (0.07, 0.03)}, {"lid": (1e-4, -1e-4)}, {"share": 0.004, "lid": (-1e-4, 5e-5)}],
    ids=["exact", "parallax", "lid", "both"],
)
def test_what_the_photos_share_is_found(rig):
    off, score, alone = judged(**rig)
    # to the noise of a sight, and half as much again where the bows turn too little; a photo alone knows a tenth of it
    assert off < 1.5 * NOISE < 0.15 * alone
    assert score < MOST_SCORE


def test_play_that_differs_from_photo_to_photo_is_left_open():
    off, score, _ = judged(play=PLAY)
    assert off > 0.8 * PLAY  # nothing can foretell it
    assert score < MOST_SCORE


def test_a_photo_that_disagrees_is_not_held_to_the_others():
    sights, _ = seen(np.random.default_rng(3))
    astray = replace(sights[2], miss=sights[2].miss + np.array([0.0, 5e-4]))
    told = told_by_others([*sights[:2], astray, *sights[3:]])
    assert told[2].covariance[1, 1] > (4e-4) ** 2  # of the 5e-4 m that it is off by
    assert told_by_others(sights)[2].covariance[1, 1] < NOISE**2


def test_one_photo_is_told_nothing():
    sights, _ = seen(np.random.default_rng(4))
    (told,) = told_by_others(sights[:1])
    np.testing.assert_array_equal(told.shift, 0.0)
    assert told_by_others([]) == []
