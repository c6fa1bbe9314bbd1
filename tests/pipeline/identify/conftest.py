"""One test with known truth and its identification, shared by the tests of this room."""

import numpy as np
import pytest

from pipeline.identify import identify_test
from pipeline.settings import IdentifySettings
from tests.rod.virtual_cable import StickSlip, force_free
from tests.rod.virtual_photo import bending_test

LAW, LENGTH = StickSlip(5e-3, 1.5e-3, 4.0, 2.0), 0.2


@pytest.fixture(scope="session")
def law():
    return LAW


@pytest.fixture(scope="session")
def settings():
    return IdentifySettings()


@pytest.fixture(scope="session")
def measured():
    """Force-free photo, four steps forth, two of them visited again on the way back."""
    chords = force_free(LAW, LENGTH).chord - np.array([4e-3, 8e-3, 12e-3, 16e-3])
    return bending_test(LAW, LENGTH, chords, np.random.default_rng(6), unloading=2)[0]


@pytest.fixture(scope="session")
def found(measured, settings):
    return identify_test(measured, settings)
