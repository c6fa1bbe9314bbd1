from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.diagnosis.causes import CATALOGUE
from pipeline.diagnosis.presentation.named import named_causes
from pipeline.diagnosis.statistics.pairs import pair_gains
from pipeline.diagnosis.statistics.score import score
from pipeline.diagnosis.statistics.twins import between_causes, cosines, nearest


@pytest.fixture
def scored():
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((60, 6))
    columns[:, 1] = columns[:, 0] + 0.2 * columns[:, 1]
    data = 3.0 * columns[:, 2] - 2.0 * columns[:, 4] + rng.standard_normal(60)
    return data, columns, score(data, np.zeros((60, 0)), columns)


def removed(data, columns):
    left = data - columns @ np.linalg.lstsq(columns, data, rcond=None)[0]
    return data @ data - left @ left


def test_gain_of_a_pair_is_that_of_the_joint_fit(scored):
    data, columns, found = scored
    gains = pair_gains(found.z, cosines(found.unit), np.zeros(6), np.arange(6), collinear=0.999)
    for i in range(6):
        for j in range(i + 1, 6):
            assert gains[i, j] == pytest.approx(removed(data, columns[:, [i, j]]), rel=1e-9)
    assert set(np.unravel_index(np.argmax(gains), gains.shape)) == {2, 4}


def test_forms_of_one_cause_and_wrong_signs_make_no_pair(scored):
    _, _, found = scored
    owner = np.array([0, 0, 1, 2, 3, 4])
    sign = np.array([0, 0, 0, 0, 1, 0])  # direction 4 enters with a negative amount
    gains = pair_gains(found.z, cosines(found.unit), sign, owner, collinear=0.999)
    assert gains[0, 1] == 0.0 and gains[2, 4] == 0.0 and gains[2, 3] > 0.0


def test_nearest_twin():
    angle = np.radians([0.0, 10.0, 60.0, 90.0])
    unit = np.vstack([np.cos(angle), np.sin(angle)])
    owner = np.array([0, 1, 2, 2])
    table = between_causes(cosines(unit), owner, 3)
    index, closeness = nearest(table)
    assert index.tolist() == [1, 0, 1]
    assert closeness[2] == pytest.approx(np.cos(np.radians(50.0)))


def test_of_two_causes_none_is_said_to_be_perhaps_the_other():
    slips, tilts, drifts = 3, 18, 13
    both = SimpleNamespace(causes=(slips, tilts), amount=lambda kind: (1.0, 0.1), size=lambda kind: None)
    places = ((slips,), (tilts, slips, drifts))  # that only one of them acts is a hypothesis of its own
    found = SimpleNamespace(
        accepted=both, classes=places, posterior=SimpleNamespace(of=lambda k: 0.7), unmodelled=False
    )
    parts = named_causes(SimpleNamespace(suspicion=SimpleNamespace(causes=CATALOGUE)), found, None, None)
    assert [part.class_ for part in parts] == [[CATALOGUE[slips].name], [CATALOGUE[k].name for k in (tilts, drifts)]]
