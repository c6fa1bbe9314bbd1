"""Records of folder and photos to the record of the mechanics."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.faults import faults_of_input
from pipeline.identify import identification_parts, identify, measured_test
from pipeline.identify.measured import picture_centre
from pipeline.messages import Message
from pipeline.records import (
    CameraSpec,
    Centerline,
    LoadStep,
    PhotoHints,
    Preview,
    Rejected,
    RigSpec,
    Scale,
    Specimen,
    Traces,
)
from pipeline.settings import IdentifySettings

PX_PER_M = 11e3


def centerline(step, *, bow_up=False, size=(2640, 1200)):
    """The step's shape as a traced photo: left axis at pixel (300, 600), bow down or up."""
    shape, sign = step.shape, -1 if bow_up else 1
    u, v = 300 + PX_PER_M * shape.x, 600 + sign * PX_PER_M * shape.y
    preview = Preview(b"", size[0] // 4, size[1] // 4, 4.0)
    return Centerline(
        f"images/{step.step}.png",
        shape,
        u,
        v,
        np.ones_like(u),
        np.ones_like(u),
        step.chord,
        step.chord_std,
        0.2,
        1e-5,
        (300.0, 600.0),
        (300.0 + PX_PER_M * step.chord, 600.0),
        0.05,
        4e-3,
        1e-5,
        bow_up,
        preview=preview,
    )


def load_step(step):
    samples = step.force + 1e-3 * np.arange(4)
    return LoadStep(
        step.step,
        step.branch,
        step.displacement,
        step.force,
        step.force_std,
        step.time,
        60.0 + np.arange(4.0),
        samples,
        f"images/{step.step}.png",
    )


@pytest.fixture
def specimen(measured):
    steps = tuple(load_step(s) for s in measured.steps if s.branch != "unloading")
    return Specimen("x", Path("x"), 0.2, 4e-3, CameraSpec(PX_PER_M), RigSpec("right"), steps, {})


@pytest.fixture
def traces(measured):
    return Traces(
        tuple(centerline(s) for s in measured.steps),
        Scale(PX_PER_M, 3e-4, Message("scale.number")),
        axis_parallax_std=4e-3,
    )


def test_steps_and_photos_meet_by_name(specimen, traces, measured):
    test = measured_test(specimen, traces, IdentifySettings())
    assert [s.step for s in test.steps] == [s.step for s in specimen.steps]
    assert all(s.shape is m.shape for s, m in zip(test.steps, measured.steps, strict=False))
    assert test.scale_std == 3e-4
    assert test.axis_parallax_std == 4e-3
    assert test.moving == "right"
    assert test.length_std == pytest.approx(1e-4)
    assert np.array_equal(test.steps[1].hold_forces, specimen.steps[1].forces_N)


def test_a_photo_that_the_log_does_not_name_was_taken_in_the_middle_of_its_hold(specimen, traces):
    """A single hold without a time would hide all that goes with time, drift and relaxation, from the diagnosis."""
    unnamed = replace(specimen.steps[1], photo_time_s=None)
    changed = replace(specimen, steps=(specimen.steps[0], unnamed, *specimen.steps[2:]))
    test = measured_test(changed, traces, IdentifySettings())
    assert test.steps[1].time == pytest.approx(61.5)
    assert test.steps[0].time == specimen.steps[0].photo_time_s


def test_an_axis_given_for_the_first_photo_goes_by_the_log_on_others(specimen, traces):
    """Unless a marker shows it, or a person where it is on a photo."""
    first, second, *_ = specimen.steps
    given = replace(specimen.rig, bearings_px=((100.0, 50.0), (900.0, 50.0)))
    images = {step.image: Path(step.image) for step in specimen.steps}
    there = replace(specimen, rig=given, images=images, hints={second.image: PhotoHints(ends_px=given.bearings_px)})

    def by_log(specimen):
        return [step.step for step in measured_test(specimen, traces, IdentifySettings()).steps if step.chord_by_log]

    assert by_log(there) == [step.step for step in specimen.steps if step not in (first, second)]
    assert by_log(replace(there, rig=replace(given, marker_diameter_m=0.012))) == by_log(specimen) == []


def test_a_rejected_photo_leaves_the_force(specimen, traces):
    photos = list(traces.photos)
    photos[2] = Rejected(photos[2].image, Message("photo/blur", blur_px=5.0, width_px=9.0))
    test = measured_test(specimen, Traces(tuple(photos), traces.scale), IdentifySettings())
    assert test.steps[2].shape is None
    assert test.steps[2].chord is None
    assert test.steps[2].force == specimen.steps[2].force_N


def test_a_hold_of_200_000_samples_becomes_a_thousand_means(specimen, traces):
    times = np.linspace(0.0, 200.0, 200_001)
    forces = 0.5 + np.exp(-times / 20.0) + np.random.default_rng(1).normal(0.0, 1e-2, times.size)
    long = replace(specimen.steps[1], times_s=times, forces_N=forces)
    test = measured_test(replace(specimen, steps=(specimen.steps[0], long)), traces, IdentifySettings())
    step = test.steps[1]
    assert step.hold_times.size == step.hold_forces.size == 1000
    assert step.hold_forces.mean() == pytest.approx(forces.mean(), abs=1e-5)
    # means of 200 scatter by a fourteenth of a sample, about the same course
    off = step.hold_forces - 0.5 - np.exp(-step.hold_times / 20.0)
    assert np.std(off) == pytest.approx(1e-2 / np.sqrt(200), rel=0.1)
    few = measured_test(specimen, traces, IdentifySettings()).steps[1]
    assert np.array_equal(few.hold_forces, specimen.steps[1].forces_N)


def test_forces_without_scatter_keep_a_finite_weight(specimen, traces):
    settings = IdentifySettings()
    quiet = tuple(
        LoadStep(s.step, s.branch, s.displacement_m, s.force_N, 0.0, s.photo_time_s, s.times_s, s.forces_N, s.image)
        for s in specimen.steps
    )
    silent = Specimen(**{**vars(specimen), "steps": quiet})
    largest = max(s.force_N for s in quiet)
    for step in measured_test(silent, traces, settings).steps:
        assert step.force_std == pytest.approx(settings.force_std_floor_relative * largest)


@pytest.mark.parametrize("bow_up", [False, True])
def test_centre_of_the_picture_lies_where_it_was_drawn(measured, bow_up):
    line = centerline(measured.steps[2], bow_up=bow_up)
    x, y = picture_centre(line, PX_PER_M)
    assert x == pytest.approx((1319.5 - 300) / PX_PER_M)
    assert y == pytest.approx((-1 if bow_up else 1) * (599.5 - 600) / PX_PER_M)


def test_identify_names_the_photos_of_the_steps(specimen, traces, settings, law):
    images = {step.step: step.image for step in specimen.steps}
    found = identify(faults_of_input(measured_test(specimen, traces, settings)), images, settings)
    parts = identification_parts(found)
    assert [s.image for s in parts.steps] == [s.image for s in specimen.steps]
    error = found.inverse.law.tangent / law.tangent(found.inverse.law.kappa) - 1
    assert np.sqrt(np.mean(error**2)) < 0.02
