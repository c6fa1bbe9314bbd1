"""Residuals of all photos as a table (photos, functions along the cable), and the strongest pattern in it.

One thing that is wrong leaves one shape along the cable that comes and goes from step to step: a table of rank one. Its
size is the largest singular value, to which noise spread over the whole table hardly adds. Errors of the bearing axes
can do much to a photo and are no misfit of the model, so the pattern is looked for beside them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.observations.noise import by_axes
from pipeline.diagnosis.observations.observation import Observation

Array = NDArray[np.float64]

COARSE = 11
"""Chord and polynomials up to degree 9 of every photo: the part of the table where most leftovers have their pattern,
with half the noise of the whole one."""


@dataclass(frozen=True, eq=False)
class PhotoTable:
    """The photos' rows of the residual as a table, and what errors of the bearing axes do to each photo.

    Attributes
    ----------
    rows : (photos, functions) int
        Chord and shape of every photo, coarse to fine.
    axes : (photos, functions, 3)
        Orthonormal directions of the axes' errors.
    """

    rows: NDArray[np.int_]
    axes: Array

    @classmethod
    def of(cls, observation: Observation) -> PhotoTable:
        """The table of an observation; photos cut to what all of them have."""
        own = [observation.rows.of_photo(photo.step) for photo in observation.photos]
        common = min((len(rows) for rows in own), default=0)
        rows = np.array([r[:common] for r in own], dtype=int).reshape(len(own), common)
        moved = [photo.whiten[:common] @ by_axes(photo.sections, photo.chord) for photo in observation.photos]
        return cls(rows, _orthonormal(np.array(moved).reshape(len(own), common, -1 if common else 0)))

    @property
    def parts(self) -> list[PhotoTable]:
        """The whole table, and the coarse functions of it; none without photos."""
        coarse = PhotoTable(self.rows[:, :COARSE], _orthonormal(self.axes[:, :COARSE]))
        return [self, coarse] if self.rows.size else []

    def heights(self, tables: Array, *, doubt: float) -> list[Array]:
        """Square of the largest singular value (n,) of tables (n, photos, functions) and of their coarse functions.

        In units of their noise: what is left of a table without its strongest pattern shows the level of its noise
        about as well as that is known beforehand (log variance to ``doubt``), and both together halve the doubt.
        """
        squares = [_squares(part.beside_axes(tables)) for part in self.parts]
        known = 2.0 / max(doubt, 1e-6) ** 2
        free = (self.rows.shape[0] - 1) * (self.rows.shape[1] - self.axes.shape[2] - 1)
        return [own[:, -1] * (known + free) / (known + squares[0][:, :-1].sum(axis=1)) for own in squares]

    def strongest(self, table: Array) -> Array:
        """The strongest pattern of one table (photos, functions), as a table of that size (of the coarse functions)."""
        left, weight, right = np.linalg.svd(self.beside_axes(table[None])[0], full_matrices=False)
        return np.asarray(weight[0] * np.outer(left[:, 0], right[0]))

    def along_axes(self, tables: Array) -> Array:
        """The part of tables (n, photos, functions) that errors of the axes can make."""
        share = np.matmul(tables[:, :, : self.rows.shape[1]].transpose(1, 0, 2), self.axes)
        return np.asarray(np.matmul(share, self.axes.transpose(0, 2, 1)).transpose(1, 0, 2))

    def beside_axes(self, tables: Array) -> Array:
        """What is left of tables (n, photos, functions) without that part."""
        return np.asarray(tables[:, :, : self.rows.shape[1]] - self.along_axes(tables))


def _orthonormal(columns: Array) -> Array:
    """Orthonormal columns (photos, functions, k) of the same span, photo by photo."""
    return np.asarray(np.linalg.qr(columns)[0]) if columns.size else columns


def _squares(tables: Array) -> Array:
    """Squares (n, k) of the singular values of tables (n, photos, functions), rising."""
    turned = tables.transpose(0, 2, 1)
    square = tables @ turned if tables.shape[1] < tables.shape[2] else turned @ tables
    return np.asarray(np.maximum(np.linalg.eigvalsh(square), 0.0))
