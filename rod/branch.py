"""Sides of the bow: which one is asked for, and which one a shape has.

A cable on two bearings can bow to either side. ``natural`` is the side on which it comes from the force-free shape (a
straight cable that buckles: up), ``opposite`` the other one, ``up`` (toward +y) and ``down`` are absolute. ``jump`` is
natural too, and goes on where the equilibria from the force-free shape on end: to where the cable comes to rest.

Units: m, rad, N.
"""

from __future__ import annotations

from typing import Literal

from rod.discretisation import Rod

Branch = Literal["natural", "opposite", "up", "down", "jump"]


def bow_side(rod: Rod, branch: Branch) -> int:
    """Side asked for: +1 up, -1 down, 0 if only following the path from the force-free shape can tell."""
    if branch in ("up", "down"):
        return 1 if branch == "up" else -1
    side, certain = rod.leaning
    if branch == "opposite":
        return -side
    return side if certain and branch != "jump" else 0
