"""Energies of the parts of a rod, made of their moments: none of it is needed to find an equilibrium.

``stored`` is what the end of a step gives back, ``potential`` that of the increment, what the step dissipates included:
its derivative is the moment. Energies per length (n,) in N, those of supports in J.
"""

import numpy as np

PANELS = 16
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
POINTS = ((np.arange(PANELS)[:, None] + 0.5 * (_NODES + 1.0)) / PANELS).reshape(-1, 1)
WEIGHTS = np.tile(0.5 * _WEIGHTS / PANELS, PANELS)


def law_energy(law, K, K0):
    """Integral of a law's moment from K0 to K, Gauss points on panels."""
    return (K - K0) * (WEIGHTS @ law.moment(K0 + (K - K0) * POINTS, K0))


def _of_law(section, K, p):
    """Of the law alone from its rest K0 + p to curvature K."""
    law, K0, rest = section.law, section.pre_curvature, section.pre_curvature + p
    if not section.law_stays:
        return law_energy(law, K - p, K0)
    return law_energy(law, K, K0) - law_energy(law, rest, K0) - law.moment(rest, K0) * (K - rest)


def section_stored(section, K, memory):
    energy = _of_law(section, K, section.set_at(K, memory)) * (1.0 if section.profile is None else section.profile)
    if section.friction is None:
        return energy
    q = section.friction.share(K, memory)[0]
    return energy + 0.5 * (section.friction.slip * section.friction.stick * q**2).sum(axis=0)


def section_potential(section, K, memory):
    # up to the curvature reached before, the set stays; beyond, it grows
    turn = np.minimum(K, section.pre_curvature + memory.reached) if section.plastic_rate else K
    before = section.grows(memory.reached) + section.given(memory)
    energy = _of_law(section, turn, np.broadcast_to(before, K.shape))
    if section.plastic_rate:
        k = turn + (K - turn) * POINTS
        reads = section.read(k, section.set_at(k, memory))
        growing = sum(read.share * section.law.moment(read.at, section.pre_curvature) for read in reads)
        energy = energy + (K - turn) * (WEIGHTS @ growing)
    energy = energy * (1.0 if section.profile is None else section.profile)
    if section.friction is None:
        return energy
    u, c, k = np.abs((K - memory.relaxed) / section.friction.stick), section.friction.stick, section.friction.smooth
    element = np.where(u < 1.0, 0.5 * u**2, u - 0.5) * c
    # one that gives way gradually: what it stored before the step, and its moment integrated over the way d of it
    way, d, before = np.sign(K - memory.last), np.abs(K - memory.last), (memory.last - memory.relaxed[k]) / c[k]
    element[k] = 0.5 * c[k] * before**2 + d - (1.0 - way * before) * c[k] * (1.0 - np.exp(-d / c[k]))
    return energy + (section.friction.slip * element).sum(axis=0)


def support_stored(support, angle, rest, slip):
    u = min(1.0, max(-1.0, (angle - slip) / support.stick_angle))
    return 0.5 * support.stiffness * (angle - rest) ** 2 + 0.5 * support.friction_moment * support.stick_angle * u**2


def support_potential(support, angle, rest, slip):
    u = abs(angle - slip) / support.stick_angle
    friction = support.friction_moment * support.stick_angle * (0.5 * u**2 if u < 1.0 else u - 0.5)
    return 0.5 * support.stiffness * (angle - rest) ** 2 + friction
