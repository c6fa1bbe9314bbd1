"""Derivatives by what has no name: friction in the cable, what is given step by step, a knot of the law.

Against difference quotients of whole simulations, there and back.
"""

from dataclasses import replace

import numpy as np
import pytest

from rod.bending_test import BendingTest
from rod.parameters import Toward
from rod.section import InternalFriction
from rod.support import Support
from tests.rod.test_sensitivity import BASIS, EVERYTHING, JOINTS, VARIATIONS, XI, Vary, displaced, worst_error

BESIDE = replace(EVERYTHING, friction=replace(EVERYTHING.friction, beside=InternalFriction(7e-4, 0.4, 1)))
GRADUAL = replace(EVERYTHING, friction=replace(BESIDE.friction, beside=InternalFriction(7e-4, 2.5, 2, gradual=True)))


def beside(name: str) -> Vary:
    def vary(test: BendingTest, h: float) -> BendingTest:
        other = replace(test.friction.beside, **{name: getattr(test.friction.beside, name) + h})
        return replace(test, friction=replace(test.friction, beside=other))

    return vary


GIVEN = replace(
    EVERYTHING,
    friction=None,
    plastic_rate=0.0,
    left=Support(stiffness=2e-3),
    right=Support(rigid_length=3e-3),
    grown=np.outer([0.0, 0.1, 0.25, 0.4, 0.4, 0.4], np.sin(np.pi * XI)),
)


def given_set(test: BendingTest, h: float) -> BendingTest:
    return replace(test, grown=test.grown + h * np.outer(np.arange(6.0), BASIS))


BY_STEP = 1e-4 * np.c_[[0, 1, -1, 2, 1, -1.0], [1, 1, 2, 0, -1, 1]]
RUBBING = replace(EVERYTHING, friction=None, plastic_rate=0.0, friction_by_step=BY_STEP)


def rubbing(test: BendingTest, h: float) -> BendingTest:
    return replace(test, friction_by_step=test.friction_by_step + h * np.c_[[0, 1, 2, -1, 1, 3.0], [2, 0, 1, 1, -1, 1]])


PUSHED = replace(
    EVERYTHING,
    friction=None,
    plastic_rate=0.0,
    moments_by_step=10.0 * BY_STEP,
    forces_by_step=np.multiply.outer([0.0, 0.02, -0.03, 0.01, 0.02, 0.0], np.c_[np.sin(7.0 * XI), np.cos(3.0 * XI)]),
)


def pushing(test: BendingTest, h: float) -> BendingTest:
    more = np.multiply.outer([1.0, 0.0, 2.0, -1.0, 1.0, 3.0], np.c_[np.eye(JOINTS)[7], np.eye(JOINTS)[25]])
    return replace(test, forces_by_step=test.forces_by_step + h * more)


def turning(test: BendingTest, h: float) -> BendingTest:
    return replace(test, moments_by_step=test.moments_by_step + h * np.c_[[0, 1, 2, -1, 1, 3.0], [2, 0, 1, 1, -1, 1]])


def stick_angles(test: BendingTest, h: float) -> BendingTest:
    ends = [replace(s, stick_angle=s.stick_angle + h) for s in (test.left, test.right)]
    return replace(test, left=ends[0], right=ends[1])


def inner_knot(test: BendingTest, h: float) -> BendingTest:
    knots = test.characteristic.knots + np.array([0.0, h, 0.0])
    return replace(test, characteristic=replace(test.characteristic, knots=knots))


@pytest.mark.parametrize(
    ("test", "vary", "h"),
    [
        (BESIDE, beside("half_width"), 3e-6),
        (BESIDE, beside("stick_curvature"), 3e-4),
        (GRADUAL, beside("half_width"), 3e-6),
        (GRADUAL, beside("stick_curvature"), 3e-4),
        (GRADUAL, VARIATIONS["load_y"][0], 3e-4),
        (GRADUAL, VARIATIONS["pre_curvature[0]"][0], 3e-4),
        (stick_angles(EVERYTHING, 0.03), stick_angles, 3e-5),
        (EVERYTHING, inner_knot, 1e-3),
        (GIVEN, given_set, 3e-4),
        (RUBBING, rubbing, 3e-6),
        (PUSHED, pushing, 3e-5),
        (PUSHED, turning, 3e-6),
        (PUSHED, VARIATIONS["length"][0], 3e-6),
        (replace(GIVEN, law_stays=True), given_set, 3e-4),
    ],
)
def test_toward_what_has_no_name(test: BendingTest, vary: Vary, h: float) -> None:
    assert worst_error(test, Toward(test, vary(test, 1e-4 * h), 1e-4 * h), vary, h, displaced) < 1e-5
