"""A wrong diameter: told once with the width that the photos show, and no photo is traced beside its cable."""

from dataclasses import replace
from pathlib import Path

import pytest

from pipeline.intake.folder import read_specimen
from pipeline.messages import Message
from pipeline.records import Centerline, Rejected, Scale, Traces
from pipeline.settings import Settings
from pipeline.vision import single
from pipeline.vision.series import trace_series
from pipeline.vision.stated_width import with_width_seen

FOLDER = Path(__file__).parents[3] / "fixtures" / "specimens" / "three"
SETTINGS = Settings()
STATED = 4.6e-3


@pytest.fixture(scope="module")
def specimen():
    return read_specimen(FOLDER, SETTINGS.intake)


def widths(traces):
    return [photo.width_m for photo in traces.photos if isinstance(photo, Centerline)]


@pytest.mark.parametrize("factor", [2.0, 0.5, 1.4])
def test_a_wrong_diameter_is_one_finding_and_every_photo_is_traced_with_the_width_seen(specimen, factor):
    traces = trace_series(replace(specimen, diameter_m=factor * STATED), SETTINGS.vision)
    (told,) = [finding for finding in traces.findings if finding.code == "diameter/seen"]
    assert told.level == "error" and "cable 4.6" in told.message
    assert f"diameter_mm says {1e3 * factor * STATED:.3g}" in told.message
    assert widths(traces) == pytest.approx([STATED] * 3, rel=0.02)  # half a pixel of 23
    lengths = [photo.traced_length_m for photo in traces.photos]
    assert lengths == pytest.approx([specimen.length_m] * 3, rel=3e-4)  # two axes of 0.1 px on 920 px, twice that


def test_the_right_diameter_is_not_doubted(specimen):
    traces = trace_series(specimen, SETTINGS.vision)
    assert len(widths(traces)) == 3 and "diameter/seen" not in [finding.code for finding in traces.findings]


def test_a_photo_that_breaks_the_look_without_a_diameter_costs_no_specimen(specimen, monkeypatch):
    def broken(*_, **__):
        raise ValueError("numbers nobody foresaw")

    refused = tuple(Rejected(image, Message("photo/width.neither")) for image in specimen.images)
    traces = Traces(refused, Scale(5e3, 1e-3, Message("scale.number")))
    monkeypatch.setattr(single, "find_cable", broken)
    assert with_width_seen(specimen, traces, SETTINGS.vision, broken) is traces
