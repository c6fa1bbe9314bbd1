"""Residuals for people: a map over arc length and step, in sigma and in m; forces in N; chords in m.

The shape residual of a photo is measured minus simulated position along the normal, less what the errors of its own
bearing axes make of it. On the map it is averaged over a few points along the cable, and its sigma is that of the
average, correlation along s included; so an honest model shows values within about 2.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from scipy import linalg

from pipeline.records import Array
from rod.inverse.fit import Fit
from rod.inverse.noise import section_covariance
from rod.inverse.observation import KINDS, Observation, normal_distance
from rod.inverse.photo_fit import photo_fit
from rod.measurement import MeasuredTest

COLUMNS = 24
"""Cells of the map along the cable: each averages four section blocks."""


def residual_map(test: MeasuredTest, observation: Observation, fitted: Fit) -> dict[str, Any]:
    """Map over s and step, both branches, in sigma and in m and N.

    Returns
    -------
    dict
        A `pipeline.result.ResidualMap`: ``s_m`` (c,), and by step: ``steps``, ``branches``, ``displacement_m``,
        ``force_N``, ``force_sigma``, ``chord_m``, ``chord_sigma``, ``shape_m`` (steps, c), ``shape_sigma`` (steps, c);
        null where nothing was measured. Beside them ``chi2`` and ``data`` by kind.
    """
    prediction = fitted.run.prediction
    if prediction is None:
        return {}
    edges = np.linspace(0.0, float(prediction.s[-1]), COLUMNS + 1)
    photos = {photo.step: photo for photo in observation.photos}
    table: dict[str, Any] = {
        "s_m": (0.5 * (edges[1:] + edges[:-1])).tolist(),
        **{key: [] for key in ("steps", "branches", "displacement_m", "force_N", "force_sigma")},
        **{key: [] for key in ("chord_m", "chord_sigma", "shape_m", "shape_sigma")},
    }
    for i, step in enumerate(test.steps):
        table["steps"].append(step.step)
        table["branches"].append(step.branch)
        table["displacement_m"].append(step.displacement)
        samples = observation.forces[i]
        mean = float(np.mean(samples - prediction.samples[i][: len(samples)])) if len(samples) else None
        table["force_N"].append(mean)
        std = float(observation.force_std[i]) / np.sqrt(max(len(samples), 1))
        table["force_sigma"].append(None if mean is None else mean / std)
        photo = photos.get(i)
        if photo is None:
            for key in ("chord_m", "chord_sigma"):
                table[key].append(None)
            for key in ("shape_m", "shape_sigma"):
                table[key].append([None] * COLUMNS)
            continue
        chord = photo.chord - float(prediction.chord[i])
        table["chord_m"].append(chord)
        table["chord_sigma"].append(chord / photo.chord_std)
        across = photo_fit(observation, fitted, photo, photo.sections).distance
        covariance = section_covariance(
            photo.sections, factor=observation.photo_noise.factor, stretch=observation.photo_noise.stretch
        )
        cells, sigma = _cells(photo.sections.s, across, covariance, edges)
        table["shape_m"].append(cells)
        table["shape_sigma"].append(sigma)
    table["chi2"], table["data"] = chi2_by_kind(observation, fitted)
    return table


def _cells(s: Array, across: Array, covariance: Array, edges: Array) -> tuple[list[float | None], list[float | None]]:
    means: list[float | None] = []
    sigmas: list[float | None] = []
    for low, high in pairwise(edges):
        inside = np.flatnonzero((s >= low) & (s < high))
        if inside.size == 0:
            means.append(None)
            sigmas.append(None)
            continue
        mean = float(np.mean(across[inside]))
        means.append(mean)
        sigmas.append(mean / float(np.sqrt(np.mean(covariance[np.ix_(inside, inside)]))))
    return means, sigmas


def chi2_by_kind(observation: Observation, fitted: Fit) -> tuple[dict[str, float], dict[str, int]]:
    """Chi-square and number of data of forces, chords and shapes."""
    square = fitted.residual[: observation.rows.count] ** 2
    kinds = range(len(KINDS) - 1)
    return (
        {KINDS[k]: float(square[observation.rows.kind == k].sum()) for k in kinds},
        {KINDS[k]: int(np.sum(observation.rows.kind == k)) for k in kinds},
    )


def rms_errors(observation: Observation, fitted: Fit, steps: list[int]) -> tuple[Array, Array]:
    """Force errors (N, mean of each hold) and shape errors (m, every block) of the named steps, for an rms."""
    prediction = fitted.run.prediction
    if prediction is None:
        return np.zeros(0), np.zeros(0)
    force = [
        float(np.mean(observation.forces[i] - prediction.samples[i][: len(observation.forces[i])]))
        for i in steps
        if len(observation.forces[i])
    ]
    shape = [normal_distance(p.sections, prediction, p.step) for p in observation.photos if p.step in steps]
    return np.array(force), np.concatenate(shape) if shape else np.zeros(0)


def across_cable(observation: Observation, field: Array, step: int) -> tuple[Array, Array] | None:
    """Arc lengths (k,) m and the shape across the cable (k,) m of a whitened residual (N,) on the photo of a step."""
    photo = next((photo for photo in observation.photos if photo.step == step), None)
    if photo is None:
        return None
    own = observation.separated(field)[observation.rows.of_photo(step)]
    return photo.sections.s, photo.basis @ linalg.lstsq(photo.whiten[:, 1:] @ photo.basis, own)[0]
