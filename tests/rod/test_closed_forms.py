"""Pieces of the rod held against closed forms: circles, rotations, beam theory, refused input."""

from types import SimpleNamespace

import numpy as np
import pytest

from rod.balance.moment_points import HIDDEN, _arc, _tied
from rod.bending_test import BendingTest, simulate
from rod.characteristic import Characteristic
from rod.compliance_law import CELLS, moment_basis, refreshed
from rod.equilibrium import solve
from rod.inverse.camera import axes_off, scaled
from rod.inverse.observation import Places, foot_points
from rod.inverse.prediction import Prediction
from rod.paper import _from_photo, _graph
from rod.reduction import Hold
from rod.support import CLAMP, FREE, Support

LENGTH, RADIUS = 0.2, 0.15
HALF = 0.5 * LENGTH / RADIUS
CHORD = 2.0 * RADIUS * np.sin(HALF)
FACTS = SimpleNamespace(length=LENGTH, picture_centre=np.zeros((1, 2)), half_diagonal=0.2)


def circle(s):
    """Bow of a circle over its chord: x, y, theta of arc lengths from its left end."""
    theta = HALF - s / RADIUS
    return RADIUS * (np.sin(HALF) - np.sin(theta)), RADIUS * (np.cos(theta) - np.cos(HALF)), theta


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_an_arc_to_an_axis_is_the_rest_of_the_circle(way):
    begin, end = 0.3 * LENGTH, LENGTH if way > 0.0 else 0.0
    x, y, theta = circle(begin)
    arc = _arc(np.array([begin, x, y, theta, 1.0 / RADIUS]), np.array(circle(end)[:2]), way)
    s = np.linspace(begin, end, HIDDEN + 1)
    assert arc == pytest.approx(np.column_stack([s, *circle(s), np.full(s.size, 1.0 / RADIUS)]), abs=1e-9)


@pytest.mark.parametrize("hidden", [(0.0, 0.0), (0.02, 0.0), (0.02, 0.03)])
def test_a_cable_under_covers_is_the_circle_that_is_seen_between_them(hidden):
    s = np.linspace(0.0, LENGTH, 401)
    x, y, theta = circle(s)
    seen = (s >= hidden[0]) & (s <= LENGTH - hidden[1])
    shape = SimpleNamespace(s=s, x=x, y=y, theta=theta, kappa=np.full(s.size, 1.0 / RADIUS), seen=seen)
    curve, free = _tied(shape, CHORD)
    assert np.all(np.diff(curve[:, 0]) >= 0.0)
    assert curve[[0, -1], 1:3] == pytest.approx(np.array([[0.0, 0.0], [CHORD, 0.0]]), abs=1e-9)
    assert curve[:, 1:4] == pytest.approx(np.column_stack(circle(curve[:, 0])), abs=1e-8)
    inside = (curve[:, 0] > hidden[0] + 1e-9) & (curve[:, 0] < LENGTH - hidden[1] - 1e-9)
    assert np.all(free[inside] == 1.0) and (free.min() == 0.0) == any(hidden)
    under = curve[:, 0] < hidden[0]
    assert free[under] == pytest.approx(curve[under, 0] / max(hidden[0], 1e-9), abs=1e-6)
    beyond = curve[:, 0] > LENGTH - hidden[1]
    assert free[beyond] == pytest.approx((LENGTH - curve[beyond, 0]) / max(hidden[1], 1e-9), abs=1e-6)


def test_a_photo_whose_axes_were_found_beside_their_place_lies_on_the_curve_turned_alike():
    """A scale too small by a thousandth and axes off by millimetres: the chord frame runs through what was found."""
    s = np.linspace(0.0, LENGTH, 401)
    x, y, theta = circle(s)
    none = np.zeros(0)
    true = Prediction(none, (), np.array([CHORD]), s, x[None], y[None], theta[None])
    grown, left, right = 1e-3, np.array([1e-3, -2e-3]), np.array([-5e-4, 2e-3])
    seen = axes_off(np.r_[left, right, np.zeros(4)])(scaled(grown)(true, FACTS), FACTS)
    found = np.array([CHORD / (1.0 + grown), 0.0]) + right - left
    turn = np.array([found, [-found[1], found[0]]]) / np.hypot(*found)
    points = (np.column_stack([x, y]) / (1.0 + grown) - left) @ turn.T
    assert seen.chord[0] == pytest.approx(np.hypot(*found), rel=1e-12)
    assert np.column_stack([seen.x[0], seen.y[0]]) == pytest.approx(points, abs=1e-12)
    places = Places(np.zeros(361, dtype=int), s[20:-20], points[20:-20, 0], points[20:-20, 1], ())
    foot = foot_points(places, seen)
    assert np.abs(np.cos(foot.direction) * foot.gap_y - np.sin(foot.direction) * foot.gap_x).max() < 1e-9
    assert seen.s[foot.left] + foot.t * foot.width == pytest.approx(s[20:-20] / (1.0 + grown), abs=1e-8)


def test_the_abscissa_of_a_law_that_does_not_change_is_the_share_of_the_moment():
    for low, high in ((0.0, 0.05), (-0.02, 0.05)):
        law = moment_basis(low, high, unit=60.0).law(np.zeros(24))
        basis = refreshed(law, low, high)
        assert basis.moments.size == basis.at_ends.shape[0] == CELLS + 1
        m = np.linspace(low, high, 11)
        assert basis.place(m) == pytest.approx((m - low) / (high - low), abs=1e-9)


def test_the_papers_graph_is_the_ratio_of_the_slopes_where_the_curvature_changes():
    s = np.linspace(0.0, np.pi, 201)
    kappa, graph = _graph(s, 9.0 * np.sin(s), 27.0 * np.sin(s), turn=9.0 * np.cos(s), lift=27.0 * np.cos(s))
    kept = np.abs(np.cos(s)) > 0.05
    kept[[0, -1]] = False
    assert kappa == pytest.approx(9.0 * np.sin(s)[kept]) and graph == pytest.approx(np.full(kappa.size, 3.0))


def test_noise_of_the_papers_photo_lies_along_the_normal(monkeypatch):
    """Points of a curve all moved by d along its normal are those of the parallel curve."""
    d, s = 2e-3, np.linspace(0.0, LENGTH, 20_001)
    theta = 0.5 - 25.0 * s**2
    x, y = (np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * s[1])]) for v in (np.cos(theta), np.sin(theta)))
    step = SimpleNamespace(s=s, x=x, y=y, theta=theta, force=1.0)
    parallel = SimpleNamespace(s=s, x=x - d * np.sin(theta), y=y + d * np.cos(theta), theta=theta, force=1.0)
    monkeypatch.setattr("rod.paper.POSITION_NOISE", d)
    moved = _from_photo(step, SimpleNamespace(standard_normal=np.ones))
    exact = _from_photo(parallel, SimpleNamespace(standard_normal=np.zeros))
    assert moved[0].size > 500
    for told, meant in zip(moved, exact, strict=True):
        assert told == pytest.approx(meant, rel=1e-3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Characteristic.from_ordinates([0.0], [1.0], reading="chord"), "unknown reading"),
        (lambda: Characteristic.from_ordinates([0.0], [1.0], abscissa="moment"), "unknown reading"),
        (lambda: Hold(chord=0.1, compliance=-1.0), "compliance and stiffening must not be negative"),
        (
            lambda: simulate(
                BendingTest(
                    LENGTH,
                    Characteristic.constant(5e-3),
                    left=Support(rigid_length=0.15),
                    right=Support(rigid_length=0.1),
                ),
                [0.01],
            ),
            "rigid pieces leave nothing",
        ),
    ],
)
def test_what_cannot_be_is_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_forces_and_moments_of_a_step_bend_a_cantilever_as_beam_theory_says() -> None:
    """Deflection F a^2 (3 L - a) / (6 EI) by a force at a, M L^2 / (2 EI) by a moment at the end; the last step stays.

    Gere and Timoshenko, Mechanics of Materials, appendix on cantilever beams, cases 5 and 6.
    """
    EI, L, F, M, n = 2.0, 0.5, 1e-4, -3e-5, 100
    forces = np.zeros((2, n + 1, 2))
    forces[1, 60] = 0.0, F
    test = BendingTest(
        L,
        EI,
        left=CLAMP,
        right=FREE,
        elements=n,
        forces_by_step=forces,
        moments_by_step=np.array([[0.0, M], [0.0, 0.0]]),
    )
    tips = [solve(test.rod_at(step), Hold(tip=(0.0, 0.0))).y[-1] for step in (0, 1, 2)]
    a = 0.6 * L
    pushed = F * a**2 * (3.0 * L - a) / (6.0 * EI)
    assert tips == pytest.approx([-M * L**2 / (2.0 * EI), pushed, pushed], rel=1e-4)
