"""Work on all photos together: which one is to blame where it breaks, and what is left where none is."""

from pathlib import Path

import pytest

from pipeline.records import Centerline, Rejected
from pipeline.vision import series as series_module
from pipeline.vision import trace_series
from pipeline.vision.guard import jointly
from tests.pipeline.vision.test_series import SETTINGS, codes, series


def test_the_photo_whose_absence_heals_is_to_blame() -> None:
    def total(values: tuple[float | Rejected, ...]) -> float:
        kept = [value for value in values if not isinstance(value, Rejected)]
        if 0.0 in kept:
            raise AssertionError("a zero")
        return sum(kept)

    assert jointly("ab", (1.0, 2.0), total) == ((1.0, 2.0), 3.0)
    (first, second), found = jointly("ab", (1.0, 0.0), total)
    assert (first, found) == (1.0, 1.0) and isinstance(second, Rejected)
    assert second.image == "b" and "b: the tracing failed (AssertionError: a zero)" in second.reason
    assert jointly("ab", (0.0, 0.0), total) == ((0.0, 0.0), None)


def test_work_on_all_photos_that_always_breaks_costs_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> object:
        raise TypeError

    for stage in ("told_by_others", "without_lay", "on_one_side"):
        monkeypatch.setattr(series_module, stage, broken)
    traces = trace_series(series(tmp_path), SETTINGS)
    assert all(isinstance(photo, Centerline) for photo in traces.photos)
    assert codes(traces) == {"photo/program-error"}
