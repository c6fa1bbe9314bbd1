"""A photo of another size than the rest of its series, and a picture that shows nothing."""

import numpy as np
import pytest

from pipeline.messages import Message
from pipeline.records import LoadStep, Rejected
from pipeline.vision.photo import Photo
from pipeline.vision.rough import Bearing, RoughCable
from pipeline.vision.segmentation import find_cable
from pipeline.vision.series_search import Shot
from pipeline.vision.shots import of_one_size

NOTHING = np.empty(0)


def shot(number: int, size: tuple[int, int], length: float | None = 900.0, *, steep: bool = False) -> Shot:
    """A photo of so many px on which the cable is so long; None: refused. ``steep``: it runs up the picture."""
    step, name = LoadStep(number, "loading", 0.0, 0.0, 0.0, None, NOTHING, NOTHING, None), f"step_{number}.png"
    if length is None:
        return Shot(step, Rejected(name, Message("photo/contrast.no-edges")), None, size)
    path = np.column_stack([np.linspace(50.0, 50.0 + length, 50), np.full(50, 200.0)])
    path = path[:, ::-1] if steep else path
    ends = [Bearing((float(u), float(v)), 0.1) for u, v in path[[0, -1]]]
    grey = np.zeros((1, 1), np.float32)
    return Shot(step, RoughCable(name, path, (0, 49), *ends, 10.0, grey, (0, 0), True, 0.5, 1.0), None, size)


@pytest.mark.parametrize("length", [450.0, None])
def test_scaled_photo_is_refused_for_its_size(length: float | None) -> None:
    shots = [shot(0, (1000, 400)), shot(1, (500, 200), length), shot(2, (1000, 400))]
    settled, findings = of_one_size(shots)
    assert settled[::2] == shots[::2]
    refused = settled[1].found
    assert isinstance(refused, Rejected)
    assert refused.code == "photo/size"
    assert "500 x 200 px" in refused.reason
    assert "1000 x 400 px" in refused.reason
    assert not findings


def test_cropped_photo_is_used() -> None:
    shots = [shot(0, (1000, 400)), shot(1, (980, 380)), shot(2, (1000, 400))]
    settled, findings = of_one_size(shots)
    assert settled == shots
    assert [(f.code, f.level) for f in findings] == [("photo/size", "info")]
    assert "step_1.png has 980 x 380 px" in findings[0].message


@pytest.mark.parametrize("steep", [{1}, {0, 2}])
def test_a_photo_turned_by_a_quarter_is_refused(steep: set[int]) -> None:
    shots = [shot(number, (1000, 1000), steep=number in steep) for number in range(3)]
    settled, findings = of_one_size(shots)
    assert settled[::2] == shots[::2]
    assert isinstance(settled[1].found, Rejected)
    assert settled[1].found.code == "photo/turned"
    assert not findings


def test_photos_of_no_usual_size_are_used_and_their_sizes_named() -> None:
    assert of_one_size([shot(number, (1000, 400)) for number in range(2)])[1] == ()
    for sizes in ([(1000, 400), (500, 200)], [(1000, 400), (500, 200), (800, 320)]):
        shots = [shot(number, size) for number, size in enumerate(sizes)]
        settled, (told,) = of_one_size(shots)
        assert settled == shots
        assert (told.code, told.level) == ("photo/size", "warning")
        assert all(f"step_{number}.png {w} x {h} px" in told.message for number, (w, h) in enumerate(sizes))


@pytest.mark.parametrize(("level", "percent"), [(2.0, "1 %"), (120.0, "47 %"), (260.0, "100 %")])
def test_picture_of_a_lens_cap_is_named(level: float, percent: str) -> None:
    noise = np.random.default_rng(0).normal(level, 2.0, (200, 400))
    found = find_cable(Photo("a.png", noise.clip(0, 255).astype(np.uint8), 8))
    assert isinstance(found, Rejected)
    assert found.code == "photo/blank"
    assert f"its brightness is {percent} everywhere" in found.reason
