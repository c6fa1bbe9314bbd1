"""The visited part of the characteristics of a result, which of them is the answer, and whether it may be used.

A fault of the data (a unit or sign of the force, photos of something else) makes numbers that fit and are none of the
cable's. They are told, but in no mean and no comparison: `answer` decides that, here alone.

Only the visited range is ever used: below the pre-curvature and above the largest curvature no cable was looked at.
All that reads a characteristic out of a result (report, prediction, comparison) reads it here. SI units, as in
`pipeline.result.Curve`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.result import AnswerPart, Curve, DiagnosisPart, FindingPart, Result
from pipeline.rounding import plain

Array = NDArray[np.float64]
METHODS = ("inverse", "balance", "extended")


@dataclass(frozen=True)
class Visited:
    """The visited part of a characteristic.

    Attributes
    ----------
    method : str
        ``inverse``, ``balance`` or ``extended``.
    kappa : (n,) 1/m
        Increasing.
    moment, moment_std : (n,) N m
    tangent, tangent_std, secant, secant_std : (n,) N m^2
    factor : (n, r) N m^2
        Factor F with F F^T the covariance of the tangent; r = 0 where it is not known.
    """

    method: str
    kappa: Array
    moment: Array
    moment_std: Array
    tangent: Array
    tangent_std: Array
    secant: Array
    secant_std: Array
    factor: Array

    def rest(self) -> tuple[float, float]:
        """Curvature of zero moment and its standard deviation, which is that of the moment there over f; 1/m."""
        nearest = int(np.argmin(np.abs(self.moment)))
        f = self.tangent[nearest]
        return float(self.kappa[nearest] - self.moment[nearest] / f), float(self.moment_std[nearest] / abs(f))

    def at(self, kappa: float) -> tuple[float, float]:
        """Tangent and its standard deviation at a curvature, in N m^2, interpolated linearly."""
        return (
            float(np.interp(kappa, self.kappa, self.tangent)),
            float(np.interp(kappa, self.kappa, self.tangent_std)),
        )


def visited(method: str, curve: Curve | None) -> Visited | None:
    """The visited part of a curve; None if there is none of at least two points."""
    if curve is None:
        return None
    keep = np.flatnonzero(curve.supported)
    if keep.size < 2:
        return None

    def kept(values: list[float] | list[list[float]]) -> Array:
        return np.asarray(values, dtype=np.float64)[keep]

    return Visited(
        method=method,
        kappa=kept(curve.kappa_per_m),
        moment=kept(curve.moment_Nm),
        moment_std=kept(curve.moment_std_Nm),
        tangent=kept(curve.tangent_Nm2),
        tangent_std=kept(curve.tangent_std_Nm2),
        secant=kept(curve.secant_Nm2),
        secant_std=kept(curve.secant_std_Nm2),
        factor=kept(curve.tangent_factor_Nm2) if curve.tangent_factor_Nm2 else np.zeros((keep.size, 0)),
    )


def curves(result: Result) -> dict[str, Visited]:
    """Visited parts of all characteristics of a result, by method."""
    whole = {
        "inverse": result.inverse.curve if result.inverse else None,
        "balance": result.balance.curve if result.balance else None,
        "extended": result.diagnosis.extended if result.diagnosis else None,
    }
    parts = {method: visited(method, whole[method]) for method in METHODS}
    return {method: part for method, part in parts.items() if part is not None}


def refuted(diagnosis: DiagnosisPart | None) -> bool:
    """Whether the data refute the extended model: its curve is no answer."""
    return diagnosis is not None and diagnosis.extended_refuted


def trusted(result: Result) -> dict[str, Visited]:
    """`curves` without an extended model that the data refute, unless nothing else was found."""
    parts = curves(result)
    kept = {method: part for method, part in parts.items() if method != "extended"}
    return kept if kept and refuted(result.diagnosis) else parts


def best(result: Result) -> Visited | None:
    """The characteristic the report answers with: extended, else inverse if its fit converged, else balance."""
    parts = trusted(result)
    fitted = result.inverse is not None and result.inverse.converged
    order = ("extended", "inverse", "balance") if fitted else ("extended", "balance", "inverse")
    return next((parts[method] for method in order if method in parts), None)


def pre_curvature(result: Result, curve: Visited) -> tuple[float, float]:
    """Pre-curvature of the way a curve comes from and its standard deviation, 1/m.

    An extended model tells it with its curve alone.
    """
    part = {"inverse": result.inverse, "balance": result.balance}.get(curve.method)
    if part is None or part.pre_curvature_per_m is None or part.pre_curvature_std_per_m is None:
        return curve.rest()
    return part.pre_curvature_per_m, part.pre_curvature_std_per_m


def leading(findings: Iterable[FindingPart]) -> FindingPart | None:
    """The finding that comes before every number: with data at fault the numbers may be wrong, however well they fit.

    An error, or a force of doubtful size: the scale of f_EI is nothing that fits or misfits. What a way to f_EI was
    refused for stands where its numbers would be, and an error of the program is none of the data.
    """
    faults = [f for f in findings if not f.code.startswith("identify/") and not f.code.endswith("/program-error")]
    first = (f for f in faults if f.level == "error")
    return next(first, next((f for f in faults if f.code == "size/force"), None))


WRONG_SCALE = {"size/force", "force/unit", "identify/force-sign"}
"""Findings after which f_EI has the scale or the sign of no cable, of whatever level."""

OTHER_CABLE = 0.1
"""Relative; a ruler or a chessboard errs by hundredths. By a tenth and more a length is that of something else, or in
another unit, and f_EI, which grows with its square, is off by a fifth."""


TOGETHER = 0.5
"""Correlation of chords and displacements that noise about no motion at all hardly reaches; it is -1 in a test."""


def answer(result: Result) -> AnswerPart:
    """The answer of a result as stored, or `decided` now: which curve it is, and whether it may be used."""
    return result.answer or decided(result)


def decided(result: Result) -> AnswerPart:
    """Which curve is the result, why, and whether a fault of the data makes it none of the cable's."""
    curve, fault = best(result), data_fault(result)
    if curve is None:
        first = next((f.message for f in result.findings if f.level == "error"), "no characteristic was measured")
        return AnswerPart(usable=False, reason=fault or first)
    rest, std = pre_curvature(result, curve)
    return AnswerPart(
        method=curve.method,
        usable=not fault,
        reason=fault or _why(result, curve.method),
        pre_curvature_per_m=rest,
        pre_curvature_std_per_m=std,
    )


def _why(result: Result, method: str) -> str:
    """Why a curve is the answer."""
    if method == "extended":
        return "the model with the causes that were found explains the data best"
    if refuted(result.diagnosis):
        return "the data refute the extended model, so the plain one answers"
    if method == "inverse" and result.inverse is not None and result.inverse.converged:
        return "the simulation was fitted, and no cause had to be added to it"
    return "the simulation could not be fitted" if method == "balance" else "no other way gave a characteristic"


def data_fault(result: Result) -> str:
    """What makes the numbers of a result none of the cable's, in a sentence; empty if nothing does.

    Faults that were left out or corrected (a photo of another step, a dead load cell, a sign turned midway) do not.
    """
    diagnosis = result.diagnosis
    turned = diagnosis is not None and any(part.factor < 0.0 for part in diagnosis.corrected_forces)
    wrong = WRONG_SCALE if turned else WRONG_SCALE | {"force/sign"}
    told = next((finding.message for finding in result.findings if finding.code in wrong), "")
    return told or _other_length(result) or _moving_apart(result) or _negative(best(result))


def _other_length(result: Result) -> str:
    """The photos show a cable of quite another length than the one stated."""
    seen = [photo.traced_length_m for photo in result.photos if photo.traced_length_m is not None]
    stated = result.specimen.length_m
    if not seen or not stated or abs(float(np.median(seen)) / stated - 1.0) < OTHER_CABLE:
        return ""
    shown = plain(1e3 * float(np.median(seen)), 4)
    return (
        f"the photos show a cable of {shown} mm where length_mm says {plain(1e3 * stated, 4)}: they are of another "
        "cable, or scale or length is in another unit"
    )


def _moving_apart(result: Result) -> str:
    """The bearings move apart on the photos that were used, where the log pushes them together."""
    unused = result.diagnosis.left_out_photos if result.diagnosis else []
    chords = {photo.step: photo.chord_m for photo in result.photos if photo.step not in unused}
    both = [(s.displacement_m, chord) for s in result.steps if (chord := chords.get(s.step)) is not None]
    if len(both) < 3:
        return ""
    moved, chord = np.array(both).T - np.mean(both, axis=0)[:, None]
    if float(moved @ chord) <= TOGETHER * float(np.linalg.norm(moved) * np.linalg.norm(chord)):
        return ""
    return "on the photos the bearings move apart where the log pushes them together: they are of another test"


def _negative(curve: Visited | None) -> str:
    """A cable that helps to bend itself."""
    if curve is None or float(np.mean(curve.tangent)) > 0.0:
        return ""
    return "the bending stiffness comes out negative, which no cable has: the sign of the forces is wrong"


def none_of_its_type(times: float, *, others: int, kind: str) -> str:
    """Why a specimen is not usable whose f_EI is so many times that of most others of its type."""
    return (
        f"f_EI is {plain(times, 2)} times that of the other {others} specimens of type {kind}: check the unit of the "
        "forces"
    )
