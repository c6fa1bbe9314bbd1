"""Series whose ground shows strips like the cable: what stands still is not the cable.

Pictures are drawn here by OpenCV, three times as large and then reduced: arcs of circles over a bed that stands still.
"""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial import cKDTree

from pipeline.records import CameraSpec, Centerline, LoadStep, RigSpec, Specimen
from pipeline.settings.vision import VisionSettings
from pipeline.vision import what_moves
from pipeline.vision.photo import Photo
from pipeline.vision.search import beyond
from pipeline.vision.series import given_calibration, trace_series
from pipeline.vision.series_search import Search, Shot
from pipeline.vision.still_ground import Ground, moved_colours

SIZE, LENGTH, WIDTH, COVER = (1000, 420), 700.0, 16.0, 44.0  # px
FIXED = np.array([880.0, 330.0])
SCALE = 4000.0  # px/m
CHORDS = [685.0, 670.0, 655.0, 640.0, 625.0]  # px


def arc(chord: float) -> np.ndarray:
    """Points (n, 2) px of an arc of that chord, from the moving axis to the fixed one, bowed up."""
    half = brentq(lambda angle: np.sin(angle) / angle - chord / LENGTH, 1e-3, 3.0)
    radius, angles = 0.5 * LENGTH / half, np.linspace(-half, half, 2000)
    middle = FIXED - (0.5 * chord, -radius * np.cos(half))
    return middle + radius * np.stack([np.sin(angles), -np.cos(angles)], axis=1)


ZOOM = 3


def at(points: np.ndarray) -> np.ndarray:
    """Points (..., 2) px in sixteenths of a pixel of the larger picture, as OpenCV draws them."""
    return np.rint(16.0 * (ZOOM * (np.asarray(points) + 0.5) - 0.5)).astype(int)


def drawn(
    bed: np.ndarray, chord: float, colour: tuple[int, ...], *, covers: bool, light: float, seed: int
) -> np.ndarray:
    """The bed (h, w, 3) with a cable of that colour on it."""
    cable, cover = np.zeros((2, SIZE[1] * ZOOM, SIZE[0] * ZOOM), np.uint8)
    cv2.polylines(cable, [at(arc(chord))[:, None]], False, 255, round(WIDTH * ZOOM), cv2.LINE_AA, 4)
    for axis in arc(chord)[[0, -1]]:
        for radius, value in ((0.5 * COVER, 255), (4.0, 0)):
            cv2.circle(cover, at(axis).tolist(), round(16.0 * ZOOM * radius), value, cv2.FILLED, cv2.LINE_AA, 4)
    masks = [cv2.resize(mask, SIZE, interpolation=cv2.INTER_AREA)[..., None] / 255.0 for mask in (cable, cover)]
    picture = bed + masks[0] * (np.array(colour) - bed)
    picture = picture + covers * masks[1] * (225.0 - picture)
    noise = np.random.default_rng(seed).normal(0.0, 1.5, picture.shape)
    return np.clip(light * picture + noise, 0, 255).astype(np.uint8)


def slotted() -> np.ndarray:
    """Aluminium with slots as wide as the cable, and scratches along them."""
    bed = np.full((SIZE[1], SIZE[0], 3), 185.0) + np.random.default_rng(1).normal(0.0, 4.0, (SIZE[1], 1, 1))
    for row in range(15, SIZE[1], 70):
        bed[row : row + int(WIDTH)] = 42.0
    return bed


def specimen(folder: Path, bed: np.ndarray, colour: tuple[int, ...], *, covers: bool) -> Specimen:
    steps, images = [], {}
    for k, chord in enumerate(CHORDS):
        name, light = f"step_{k}.png", 1.0 + 0.04 * np.sin(2.0 * k)
        cv2.imwrite(str(folder / name), drawn(bed, chord, colour, covers=covers, light=light, seed=k))
        travel = (CHORDS[0] - chord) / SCALE
        steps.append(LoadStep(k, "loading", travel, 1.0, 0.01, None, np.empty(0), np.empty(0), name))
        images[name] = folder / name
    first = arc(CHORDS[0])[[0, -1]]
    given = None if covers else tuple((float(u), float(v)) for u, v in first)
    rig = RigSpec("left", COVER / SCALE if covers else None, bearings_px=given)
    return Specimen("a", folder, LENGTH / SCALE, WIDTH / SCALE, CameraSpec(SCALE), rig, tuple(steps), images)


def off_px(line: Centerline, chord: float) -> float:
    """Largest distance of a centerline from its arc."""
    seen = np.stack([line.u_px, line.v_px], axis=1)
    return float(cKDTree(arc(chord)).query(seen)[0].max())


@pytest.mark.parametrize(("colour", "least"), [(110, 5), (45, 3), (235, 5)])
def test_a_cable_across_slots_of_its_width_is_told_by_what_moves(colour: int, least: int, tmp_path: Path) -> None:
    """A grey one, one as black as the slots, of which photos may be refused, one brighter than all."""
    traces = trace_series(specimen(tmp_path, slotted(), (colour,) * 3, covers=True), VisionSettings())
    assert "photo/still-ground" in {finding.code for finding in traces.findings}
    lines = traces.photos
    off = [off_px(line, chord) for line, chord in zip(lines, CHORDS, strict=True) if isinstance(line, Centerline)]
    assert len(off) >= least
    assert max(off) < 0.25 * WIDTH and np.median(off) < 0.5


def test_a_cable_seen_between_sure_covers_is_not_searched_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bed, settings = np.full((SIZE[1], SIZE[0], 3), (110.0, 130.0, 60.0)), VisionSettings()
    series = specimen(tmp_path, bed, (60, 60, 60), covers=True)
    (scale,) = given_calibration(series, settings)
    search, calls = Search(series, settings, scale), []

    def searched(search: Search, shots: dict[int, Shot], *rest: object) -> dict[int, object]:
        calls.append(sorted(shots))
        return dict.fromkeys(shots, whole)

    shots = search.find_all()
    whole = shots[0].found
    for k in (1, 3):  # half of it was seen
        shots[k] = replace(shots[k], found=replace(shots[k].found, path_px=shots[k].found.path_px[::2] / 2.0))
    monkeypatch.setattr(what_moves, "_searched", searched)
    found = what_moves.found_moving(search, shots)
    assert calls[-1] == [1, 3] and all(len(call) == 1 for call in calls[:-2])
    assert [new.found is old.found for new, old in zip(found, shots, strict=True)] == [True, False, True, False, True]


def test_a_strip_beside_the_given_axes_is_not_the_cable(tmp_path: Path) -> None:
    """A white cable lies along the border, the one between the axes is black on green."""
    bed = np.full((SIZE[1], SIZE[0], 3), (110.0, 130.0, 60.0))
    bed[390 : 390 + int(WIDTH)] = 240.0
    photos = trace_series(specimen(tmp_path, bed, (60, 60, 60), covers=False), VisionSettings()).photos
    assert all(isinstance(photo, Centerline) for photo in photos)
    assert max(off_px(line, chord) for line, chord in zip(photos, CHORDS, strict=True)) < 0.5


def test_ground_is_what_photos_show_that_do_not_show_the_cable() -> None:
    """A cable that lies in one place on three of five photos, a black slot, lamps that flicker."""
    lights, beds = (1.0, 0.9, 1.1, 1.0, 0.95), np.full((60, 200), 180.0)
    beds[20:30] = 40.0
    photos, truth = [], beds / 255.0
    for k, light in enumerate(lights):
        picture = beds.copy()
        left = 120 if k < 3 else 20 * k - 40
        picture[:, left : left + 15] = 100.0
        photos.append(Photo(f"{k}", np.rint(light * picture).astype(np.uint8), 8))
    colour = min(moved_colours(photos), key=lambda each: abs(each[0] - 100.0 / 255.0))
    ground = Ground.of(photos, colour)
    assert ground.colour == pytest.approx(100.0 / 255.0, abs=0.01)
    assert np.abs(ground.picture.pixels / 65535.0 - truth).max() < 0.01
    share = 4.0 * (ground.without(photos[1]).pixels / 65535.0 - 0.5)
    assert np.abs(share[:, 122:133] - 1.0).max() < 0.1 and np.abs(share[:, :118]).max() < 0.1


def test_following_a_strip_ends_where_it_gets_no_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def again(standout: object, cut: object, path: np.ndarray, width: float, least: float) -> np.ndarray:
        calls.append(len(path))
        assert len(calls) < 10
        return path.copy()

    monkeypatch.setattr(beyond, "_ahead", again)
    cut = type("Cut", (), {"path": np.zeros((40, 2))})()
    assert beyond.follow(None, cut, 5.0) is None
