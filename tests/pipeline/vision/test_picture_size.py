"""A photo of another size than the rest of its series, and a picture that shows nothing."""

import numpy as np
import pytest

from pipeline.messages import Message
from pipeline.records import LoadStep, Rejected
from pipeline.vision.photo import Photo
from pipeline.vision.rough import Bearing, RoughCable
from pipeline.vision.segmentation import find_cable
from pipeline.vision.shots import Shot, of_one_size

NOTHING = np.empty(0)


def shot(number: int, size: tuple[int, int], length: float | None = 900.0) -> Shot:
    """A photo of so many px on which the cable is so long; None: refused."""
    step, name = LoadStep(number, "loading", 0.0, 0.0, 0.0, None, NOTHING, NOTHING, None), f"step_{number}.png"
    if length is None:
        return Shot(step, Rejected(name, Message("photo/contrast.no-edges")), None, size)
    path = np.column_stack([np.linspace(50.0, 50.0 + length, 50), np.full(50, 200.0)])
    ends = [Bearing((float(u), 200.0), 0.1) for u in path[[0, -1], 0]]
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


@pytest.mark.parametrize("other", [[(400, 1000)], [(500, 200), (500, 200)], []])
def test_turned_photos_and_those_without_a_usual_size_are_left(other: list[tuple[int, int]]) -> None:
    shots = [shot(number, size) for number, size in enumerate([(1000, 400), (1000, 400), *other])]
    assert of_one_size(shots) == (shots, ())


@pytest.mark.parametrize(("level", "percent"), [(2.0, "1 %"), (120.0, "47 %"), (260.0, "100 %")])
def test_picture_of_a_lens_cap_is_named(level: float, percent: str) -> None:
    noise = np.random.default_rng(0).normal(level, 2.0, (200, 400))
    found = find_cable(Photo("a.png", noise.clip(0, 255).astype(np.uint8), 8))
    assert isinstance(found, Rejected)
    assert found.code == "photo/blank"
    assert f"its brightness is {percent} everywhere" in found.reason
