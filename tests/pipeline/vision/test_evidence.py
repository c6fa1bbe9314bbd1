"""What leaves a strip is a crossing, what lies beside it is none; one too short to be weighed has no figures."""

import cv2
import numpy as np
import pytest

from pipeline.vision.evidence import unlike_a_cable, weigh
from pipeline.vision.photo import Closeup
from pipeline.vision.search.backdrop import Standout
from pipeline.vision.search.crosscut import crossed_at, cut_across


@pytest.mark.parametrize(("widths_long", "told"), [(3, 0), (12, 3)])
def test_a_refusal_tells_only_what_was_weighed(widths_long, told):
    """A grey strip 20 px wide without edges; four widths of it are the least."""
    count = 4 * widths_long + 1
    closeup = Closeup(np.full((120, 60 + 5 * count), 0.5, np.float32), (0, 0))
    middle = np.column_stack([30.0 + 5.0 * np.arange(count), np.full(count, 60.0)])
    across = np.tile([0.0, 1.0], (count, 1))
    refused = unlike_a_cable(weigh(closeup, middle, across, np.full(count, 20.0), std=0.1))
    assert len(refused.values) == told
    assert all(np.isfinite(value) for value in refused.values.values())


@pytest.mark.parametrize("step", [0.0, 0.1, 0.27, 0.3, 0.4])
def test_faint_edges_all_along_are_seen_all_along(step):
    """A strip in noise: its edges are one thing where they are about alike, however many blocks fall below the limit.

    With three standard deviations for every block half of a cable of 3.4 was told to show no edge.
    """
    rng, count = np.random.default_rng(5), 401
    picture = 0.5 + 0.2 * rng.standard_normal((120, 2080))
    picture[50:70] -= step
    middle = np.column_stack([40.0 + 5.0 * np.arange(count), np.full(count, 59.5)])
    across = np.tile([0.0, 1.0], (count, 1))
    widths = 20.0 + 0.1 * rng.standard_normal(count)
    found = weigh(Closeup(picture.astype(np.float32), (0, 0)), middle, across, widths, std=0.1, known=True)
    assert found.enough == (found.edges > 3.0)
    assert not found.enough or found.seen > 0.9


ARMS = {
    "nothing": (),
    "a bolt as large as they are": (((320, 100 - 18), 11.0),),
    "a bolt that touches": (((320, 100 - 10), 11.0),),
    "another cable ahead of it": (((500, 60), (500, 10), 10),),
    "another cable that ends a width before it": (((300, 75), (300, 10), 10),),
    "a tee": (((300, 100), (300, 10), 10),),
    "a tee aslant": (((300, 100), (400, 10), 10),),
    "a thinner one": (((300, 100), (320, 10), 5),),
    "a cable across": (((260, 190), (340, 10), 10),),
    "a loop that comes back": (((300, 100), (330, 40), 10), ((330, 40), (300, 10), 10)),
}


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("dark", [True, False])
def test_a_crossing_is_where_something_like_it_leads_away_from_a_strip(name, dark):
    """A strip 10 px wide from u = 60 to 460 at v = 100."""
    grey = np.full((200, 560), 0.8, np.float32)
    cv2.line(grey, (60, 100), (460, 100), 0.2, 10)
    for start, *rest in ARMS[name]:
        if len(rest) == 2:
            cv2.line(grey, start, rest[0], 0.2, rest[1])
        else:
            cv2.circle(grey, start, round(rest[0]), 0.2, cv2.FILLED)
    grey += np.random.default_rng(1).normal(0.0, 0.01, grey.shape).astype(np.float32)
    standout = Standout.of((grey if dark else 1.0 - grey)[..., None] - np.float32(0.8 if dark else 0.2), (0, 0))
    path = np.column_stack([np.arange(60.0, 461.0), np.full(401, 100.0)])
    crossed = crossed_at(standout, cut_across(standout, path, 10.0))
    if list(ARMS).index(name) < 5:
        assert crossed is None
    else:
        assert crossed is not None
        assert crossed[0] == pytest.approx(300.0, abs=15.0)
