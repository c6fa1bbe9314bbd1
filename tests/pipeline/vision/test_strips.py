"""Masks and skeletons: what is thick, by exact distances; how long what leaves a path is, on drawn pictures."""

import cv2
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from pipeline.vision.search.crosscut import find_flanks
from pipeline.vision.search.strips import thick_part


@pytest.mark.parametrize("seed", range(8))
def test_thick_is_what_lies_in_a_disc_that_fits_into_the_mask(seed):
    rng = np.random.default_rng(seed)
    mask = np.zeros((300, 400), np.uint8)
    for _ in range(4):
        (a, b), r = rng.integers(0, 300, (2, 2)), int(rng.integers(8, 50))
        cv2.circle(mask, a.tolist(), r, 1, cv2.FILLED)
        cv2.line(mask, a.tolist(), b.tolist(), 1, r)
    least = float(rng.uniform(33.0, 60.0))
    radius = round(least) // 2
    core = distance_transform_edt(mask) > radius
    near = distance_transform_edt(~core) if core.any() else np.full(mask.shape, np.inf)
    found = thick_part(mask, least).astype(bool)
    sure = np.abs(near - radius) > 0.01  # distances equal to the radius are decided by a rounding
    np.testing.assert_array_equal(found[sure], (near <= radius)[sure])


def test_nothing_is_thick_where_all_is_thin_and_all_is_where_nothing_is_left_out():
    mask = np.zeros((200, 300), np.uint8)
    cv2.line(mask, (10, 100), (290, 120), 1, 21)
    assert not thick_part(mask, 40.0).any()
    assert thick_part(np.ones((200, 300), np.uint8), 40.0).all()


def test_a_flat_strip_of_unknown_width_shows_no_edges():
    offsets = np.arange(-22.0, 22.1)
    flanks = find_flanks(np.zeros((90, 45), np.float32), offsets, 10.0, known=False)
    assert np.isnan(flanks.left).all() and np.isnan(flanks.right).all()
