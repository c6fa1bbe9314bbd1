"""What breaks on one photo, or in the work on all together, costs that photo at most."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from pipeline.records import Centerline, Rejected, RigSpec
from pipeline.vision import series as series_module
from pipeline.vision import series_search as search_module
from pipeline.vision import shots as shots_module
from pipeline.vision import single as single_module
from pipeline.vision.guard import jointly
from pipeline.vision.series import trace_series
from tests.pipeline.vision.test_series import FLAT, SETTINGS, lines, series


def test_the_photo_whose_absence_heals_is_to_blame() -> None:
    def total(values: tuple[float | Rejected, ...]) -> float:
        kept = [value for value in values if not isinstance(value, Rejected)]
        if 0.0 in kept:
            raise AssertionError("a zero")
        return sum(kept)

    assert jointly("ab", (1.0, 2.0), total) == 3.0
    assert jointly("ab", (1.0, 0.0), total) == 1.0
    assert jointly("abc", (0.0, 1.0, 0.0), total) == 1.0
    both = jointly("ab", (0.0, 0.0), total)
    assert isinstance(both, Rejected) and "the tracing failed (AssertionError: a zero)" in both.reason


@pytest.mark.parametrize("stage", ["told_by_others", "of_one_size", "check_scale"])
def test_work_on_all_photos_that_always_breaks_says_why_on_each(
    stage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> object:
        raise TypeError("no number")

    monkeypatch.setattr(series_module, stage, broken)
    photos = trace_series(series(tmp_path), SETTINGS).photos
    assert [photo.image for photo in photos] == [f"step_0{k}.png" for k in range(3)]
    for photo in photos:
        assert isinstance(photo, Rejected) and photo.code == "photo/program-error"
        assert "TypeError: no number" in photo.reason and photo.preview is not None


@pytest.mark.parametrize("stage", ["load_photo", "find_cable", "follow_cable", "with_strip", "with_doubt_of_plane"])
def test_photo_that_breaks_the_program_costs_that_photo_alone(
    stage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    modules = {"load_photo": search_module, "find_cable": search_module, "with_strip": single_module}
    module = modules.get(stage, series_module)
    sound, calls = getattr(module, stage), []

    def broken(*args: object, **named: object) -> object:
        calls.append(args)
        if len(calls) == 2 or (stage == "find_cable" and args[0].name == "step_01.png"):  # it is searched twice
            raise np.linalg.LinAlgError("Singular matrix")
        return sound(*args, **named)

    monkeypatch.setattr(module, stage, broken)
    first, second, third = trace_series(series(tmp_path), SETTINGS).photos
    assert isinstance(first, Centerline) and isinstance(third, Centerline)
    assert isinstance(second, Rejected) and second.code == "photo/program-error"
    assert "LinAlgError: Singular matrix" in second.reason
    assert (second.preview is None) == (stage == "load_photo")


def test_a_picture_that_cannot_be_shown_is_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> object:
        raise cv2.error

    monkeypatch.setattr(search_module, "reduce_photo", broken)
    assert all(line.preview is None for line in lines(trace_series(series(tmp_path), SETTINGS)))


@pytest.mark.parametrize(
    ("stage", "error"),
    [
        ("on_one_side", np.linalg.LinAlgError()),
        ("of_one_size", IndexError()),
        ("from_found", ZeroDivisionError()),
        ("with_fixed_cover", ValueError()),
        ("wandering_px", np.linalg.LinAlgError()),
        ("check_scale", ValueError()),
    ],
)
def test_photo_that_breaks_the_work_on_all_costs_that_photo_at_most(
    stage: str, error: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second of three."""
    sound = getattr(series_module, stage)

    def broken(*given: object, **named: object) -> object:
        photos = next(one for one in given if isinstance(one, (list, tuple)))
        own = [getattr(one, "found", getattr(one, "rough", one)) for one in photos]
        if any(one.image == "step_01.png" for one in own if not isinstance(one, Rejected)):
            raise error
        return sound(*given, **named)

    monkeypatch.setattr(series_module, stage, broken)
    specimen = series(tmp_path, scale_error=None if stage == "from_found" else 0.0)
    first, second, third = trace_series(specimen, FLAT).photos
    assert isinstance(first, Centerline) and isinstance(third, Centerline)
    assert isinstance(second, Rejected) and second.preview is not None
    assert second.code == "photo/program-error" and type(error).__name__ in second.reason


def test_a_search_for_covers_that_breaks_costs_no_specimen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def broken(*_: object) -> float:
        asked.append(True)
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(shots_module, "cover_radius", broken)
    traces = trace_series(series(tmp_path, given=RigSpec("left", None), cover_m=0.0098), FLAT)
    assert asked and len(traces.photos) == 3
