"""Generic fields of misfit, from coarse to fine: what any smooth thing that is wrong would leave in the data.

A field is one shape along the cable (a polynomial of a photo's normal residuals), or the chords, or the forces, times
one pattern over the steps. Patterns are polynomials of the load level first, with the same and with the opposite sign
on the two branches, then whatever changes from step to step as no level does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.observations.observation import Observation
from pipeline.diagnosis.observations.prediction import Facts

Array = NDArray[np.float64]

DEGREES = range(2, 10)
"""Of the polynomials along the cable: 0 and 1 move and turn it as a whole, which its bearing axes hold; more than 9
bends within a tenth of the cable are no smooth misfit."""

FORCE, CHORD, DEGREE = -0.5, 0.2, 0.7
"""Fineness of a field is the number of its pattern plus this: forces come before the shapes of their pattern, chords
after the coarsest one, and each further degree counts for seven tenths of a further pattern."""

IMITATED = 1e-3
"""Share of a unit column below which it is taken for one that earlier columns can imitate."""


class _Field(NamedTuple):
    """A column (rows,) and its place in the order, coarse to fine."""

    fineness: float
    column: Array


def smooth_fields(observation: Observation, facts: Facts, *, rows: int) -> Array:
    """Generic fields (rows, k), coarse to fine; ``rows`` counts the prior rows too, which stay zero."""
    own = {photo.step: observation.rows.of_photo(photo.step) for photo in observation.photos}
    at = np.flatnonzero(observation.rows.force)
    step = observation.rows.step[at]
    fields: list[_Field] = []
    for order, pattern in enumerate(_patterns(facts)):
        force = np.zeros(rows)
        force[at] = pattern[step] / observation.force_std[step]
        fields.append(_Field(order + FORCE, force))
        for degree in DEGREES:
            shape = np.zeros(rows)
            for photo in observation.photos:
                if degree < photo.basis.shape[1]:
                    shape[own[photo.step]] = pattern[photo.step] * (photo.whiten[:, 1:] @ photo.basis[:, degree])
            fields.append(_Field(order + DEGREE * (degree - DEGREES.start), shape))
        chord = np.zeros(rows)
        for photo in observation.photos:
            chord[own[photo.step]] = pattern[photo.step] * photo.whiten[:, 0]
        fields.append(_Field(order + CHORD, chord))
    return observation.joined(np.column_stack([field.column for field in sorted(fields, key=lambda f: f.fineness)]))


def _patterns(facts: Facts) -> Array:
    """Orthonormal patterns (steps, steps) over the steps as rows, slow to fast."""
    level = facts.displacement / max(facts.travel, 1e-30)
    back = np.array([-1.0 if branch == "unloading" else 1.0 for branch in facts.branch])
    powers = [level**power * side for power in range(len(level)) for side in (np.ones_like(level), back)]
    return ordered_basis(np.column_stack([*powers, np.eye(len(level))])).T


def ordered_basis(columns: Array) -> Array:
    """Orthonormal columns of the same span, in the same order; what earlier columns can imitate drops out."""
    kept = np.zeros((len(columns), 0))
    for column in (columns / np.linalg.norm(columns, axis=0)).T:
        rest = column - kept @ (kept.T @ column)
        rest -= kept @ (kept.T @ rest)  # once more: what is left may be a thousandth of what went in
        if np.linalg.norm(rest) > IMITATED:
            kept = np.column_stack([kept, rest / np.linalg.norm(rest)])
    return kept


def basis_beside(fitted: Array, fields: Array) -> Array:
    """Orthonormal basis (N, k) of fields beside what is fitted, coarse to fine.

    Parameters
    ----------
    fitted : (N, p)
        Orthonormal.
    fields : (N, j)
        Those that the fit or coarser ones can imitate drop out.
    """
    kept = fields - fitted @ (fitted.T @ fields)
    seen = np.linalg.norm(kept, axis=0) > IMITATED * np.maximum(np.linalg.norm(fields, axis=0), 1e-300)
    return ordered_basis(kept[:, seen])
