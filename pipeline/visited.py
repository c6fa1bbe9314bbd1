"""The visited part of the characteristics of a result, which of them is the answer, and what must be said before it.

Only the visited range is ever used: below the pre-curvature and above the largest curvature no cable was looked at.
All that reads a characteristic out of a result (report, prediction, comparison) reads it here. SI units, as in
`pipeline.result.Curve`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.result import Curve, DiagnosisPart, FindingPart, Result

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
