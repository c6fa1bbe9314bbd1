"""What photos err alike: the joint whitening against the covariance written out."""

import numpy as np
import pytest

from rod.inverse.common_errors import common_errors
from rod.inverse.noise import section_covariance, smooth_basis
from rod.midline import Midline

LENGTH = 0.18
COMMON = (2e-6, 8e-3)


def sections(count, common=COMMON, light=3e-6, turned=0.0):
    s, flat = np.linspace(0.01, 0.17, count), np.zeros(count)
    theta, std = turned + np.linspace(1.0, -1.0, count), np.full(count, 4e-6)
    each, one = np.arange(count), np.ones(count, dtype=int)
    slow = (light, 0.06), (1e-6, 8e-3)
    return Midline(s, s, flat, theta, flat, s, std, each, one, 5e-4, slow, common)


def whitening(own):
    """Components of the sections along a smooth basis, of unit variance by the photo's own noise; the chord is idle."""
    root = np.linalg.cholesky(section_covariance(own))
    design = np.linalg.solve(root, smooth_basis(own.s, LENGTH, functions=12))
    rows = np.linalg.qr(design)[0].T @ np.linalg.inv(root)
    return np.hstack([np.zeros((12, 1)), rows])


def test_rows_of_all_photos_have_unit_covariance():
    photos = [sections(60), sections(50, turned=0.3), sections(60)]
    whiten = [whitening(own) for own in photos]
    found = common_errors(photos, whiten)
    at = np.concatenate([own.s for own in photos])
    alike = COMMON[0] ** 2 * np.exp(-0.5 * (np.subtract.outer(at, at) / COMMON[1]) ** 2)
    theta = np.concatenate([own.theta for own in photos])
    photo = np.repeat([0, 1, 2], [len(own.s) for own in photos])
    lamp = 9e-12 * np.exp(-0.5 * (np.subtract.outer(theta, theta) / 0.5) ** 2)
    alike += lamp * np.not_equal.outer(photo, photo)  # within a photo it is in the whitening already
    whole, ends = np.zeros((36, len(at))), np.cumsum([0, *(len(own.s) for own in photos)])
    for k, root in enumerate(whiten):
        whole[12 * k : 12 * k + 12, ends[k] : ends[k + 1]] = root[:, 1:]
    covariance = np.eye(36) + whole @ alike @ whole.T
    assert np.linalg.eigvalsh(covariance).max() > 2.0  # what photos err alike matters here
    mixed = found.whitened(np.eye(36))
    # directions below a thousandth are left out
    assert mixed @ covariance @ mixed.T == pytest.approx(np.eye(36), abs=2e-3)
    assert mixed == pytest.approx(mixed.T)
    assert found.undone(found.whitened(np.arange(36.0))) == pytest.approx(np.arange(36.0))


def test_nothing_alike():
    photos = [sections(60, (0.0, 0.0), light=0.0)] * 3
    assert common_errors(photos, [whitening(own) for own in photos]) is None
    assert common_errors([sections(60)], [whitening(sections(60))]) is None
    assert common_errors([], []) is None
