"""Every plane shape of a bar that is clamped at one end and pinned at the other, in closed form, and which are stable.

No moment acts at the bearing. With psi the angle between tangent and reaction, w the root of the reaction's size and
L = EI = 1, sin(psi / 2) = k cd(w (1 - s)), and the shape follows in elliptic functions (Mikata, Acta Mechanica 190
(2007) 133). Two numbers, k and w / K(k), give all shapes; the bearing lies on the clamp's line on curves of them.

The curvature vanishes at the bearing and at every second multiple of K(k) from there. Between two zeros curvature
itself is a motion without second variation of energy (it turns the reaction), so a shape with two zeros between clamp
and bearing has two unstable motions, one of which keeps the bearing on its line: w <= 4 K(k) holds all stable ones.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipj, ellipk

from rod.bending_test import BendingTest, simulate
from rod.characteristic import Characteristic
from rod.equilibrium import Outcome
from rod.support import Support

EI, LENGTH = 5e-3, 0.2
BAR = BendingTest(LENGTH, Characteristic.constant(EI), left=Support("clamp", angle=0.0))
CRITICAL = 20.190728556  # tan u = u; Timoshenko and Gere, chapter 2
NODES = 100


def placed(k, turns):
    """Chord, height of the bearing over the clamp's line, P, and w for k and turns = w / K(k)."""
    w = turns * ellipk(k * k)
    sn, cn, _, am = ellipj(ellipk(k * k) + w, k * k)
    along, across = 2.0 * (ellipeinc(am, k * k) - ellipe(k * k)) / w - 1.0, -2.0 * k * cn / w
    tilt = -2.0 * np.arcsin(k * sn)  # of the reaction against the clamp
    chord, height = along * np.cos(tilt) - across * np.sin(tilt), along * np.sin(tilt) + across * np.cos(tilt)
    return chord, height, w * w * np.cos(tilt), w


def is_stable(k, turns):
    """Whether int (dtheta'^2 - w^2 cos(psi) dtheta^2) ds is positive while the bearing stays on its line."""
    w = placed(k, turns)[3]
    rest = 1.0 - (np.arange(NODES) + 0.5) / NODES
    psi, at_clamp = (2.0 * np.arcsin(k * ellipj(ellipk(k * k) + w * to, k * k)[0]) for to in (rest, 1.0))
    diagonal = np.r_[3.0, np.full(NODES - 2, 2.0), 1.0] * NODES - w * w * np.cos(psi) / NODES
    matrix = np.zeros((NODES + 1, NODES + 1))
    matrix[:NODES, :NODES] = np.diag(diagonal) - NODES * (np.eye(NODES, k=1) + np.eye(NODES, k=-1))
    matrix[-1, :-1] = matrix[:-1, -1] = np.cos(psi - at_clamp) / NODES
    return np.count_nonzero(np.linalg.eigvalsh(matrix) < 0.0) == 1  # that of the multiplier


@pytest.fixture(scope="module")
def shapes():
    """All bent shapes with at most one zero of curvature between clamp and bearing: chord, P, whether stable."""
    found, grid = [], np.linspace(1e-3, 4.0, 800)
    halves = np.r_[np.linspace(0.01, np.pi / 2.0 - 1e-3, 250), np.pi / 2.0 - np.geomspace(1e-3, 1e-7, 60)]
    for k in np.sin(halves):
        height = placed(k, grid)[1]
        for i in np.flatnonzero(height[:-1] * height[1:] < 0.0):
            turns = brentq(lambda at, k=k: placed(k, at)[1], grid[i], grid[i + 1])
            chord, _, P, _ = placed(k, turns)
            found.append((chord, P / CRITICAL, is_stable(k, turns)))
    chord, load, stable = np.array(found).T
    return chord, load, stable == 1.0


def test_no_shape_before_the_clamp_is_stable_above_its_largest_force(shapes):
    chord, load, stable = shapes
    before = stable & (chord > 0.0)
    assert load[before].min() == pytest.approx(1.0, abs=1e-3)  # it begins at the critical load
    assert load[before].max() == pytest.approx(1.1396, abs=1e-3)
    top = np.argmax(np.where(before, load, 0.0))
    lost = simulate(BAR, forces=[1.2 * CRITICAL * EI / LENGTH**2])[0]
    assert lost.outcome is Outcome.TURNING_POINT
    assert lost.force == pytest.approx(load[top] * CRITICAL * EI / LENGTH**2, rel=1e-3)
    assert lost.chord / LENGTH == pytest.approx(chord[top], abs=0.02)  # 250 shapes on a curve that is flat there


@pytest.mark.parametrize("times", [0.8, 1.05, 1.1, 1.2, 2.0, 4.0])
@pytest.mark.parametrize("mirrored", [False, True])
def test_each_load_has_the_stable_shape_of_the_closed_form(shapes, times, mirrored):
    chord, load, stable = shapes
    test = replace(BAR, left=Support(), right=Support("clamp", angle=0.0)) if mirrored else BAR
    force = times * CRITICAL * EI / LENGTH**2
    near, jumped = (simulate(test, forces=[force], branch=branch)[0] for branch in ("natural", "jump"))
    before, pulled = (np.flatnonzero(stable & side) for side in (chord > 0.0, chord < 0.0))
    pulled = pulled[np.argsort(load[pulled])]
    if times < 1.0:
        assert near.good
        assert near.chord == pytest.approx(LENGTH, rel=1e-6)  # straight
    elif times < 1.13:
        before = before[np.argsort(load[before])]
        assert near.good
        assert near.chord / LENGTH == pytest.approx(np.interp(times, load[before], chord[before]), abs=3e-3)
    else:  # only the one pulled straight beyond the clamp is left
        assert near.outcome is Outcome.TURNING_POINT
        assert jumped.good
        assert jumped.chord / LENGTH == pytest.approx(np.interp(times, load[pulled], chord[pulled]), abs=3e-3)
