"""A strip that is too short to be weighed is refused without figures: an infinite one cannot be stored."""

import numpy as np
import pytest

from pipeline.vision.evidence import Course, unlike_a_cable, weigh


@pytest.mark.parametrize(("widths_long", "told"), [(3, 0), (12, 3)])
def test_a_refusal_tells_only_what_was_weighed(widths_long, told):
    """A grey strip 20 px wide without edges; four widths of it are the least."""
    count = 4 * widths_long + 1
    course = Course(
        np.full((120, 60 + 5 * count), 0.5, np.float32),
        (0, 0),
        dark=True,
        middle=np.column_stack([30.0 + 5.0 * np.arange(count), np.full(count, 60.0)]),
        across=np.tile([0.0, 1.0], (count, 1)),
    )
    refused = unlike_a_cable(weigh(course, np.full(count, 20.0), std=0.1))
    assert len(refused.values) == told
    assert all(np.isfinite(value) for value in refused.values.values())
