"""Lengths along a line of points (n, 2)."""

from __future__ import annotations

import numpy as np

from pipeline.records import Array


def step_lengths(points: Array) -> Array:
    """Distances (n - 1,) of neighbouring points."""
    return np.asarray(np.hypot(*np.diff(points, axis=0).T))


def arc_lengths(points: Array) -> Array:
    """Arc length (n,) of each point from the first."""
    return np.concatenate([[0.0], np.cumsum(step_lengths(points))])
