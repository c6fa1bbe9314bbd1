"""The visited part of a characteristic: all of it that may be used, with its band and its pre-curvature.

Below the pre-curvature and above the largest curvature no cable was looked at: nothing is known there. SI units.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from html import escape

import numpy as np

from pipeline.records import Array
from pipeline.result.parts import Curve, Method
from pipeline.rounding import plain, rounded


@dataclass(frozen=True, eq=False)
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
    pre_curvature, pre_curvature_std : float
        K0 as the way found it that the curve comes from, 1/m.
    rest_factor : (r,) 1/m
        With F rest_factor the covariance of the tangent with the pre-curvature; empty where it is not known.
    """

    method: Method
    kappa: Array
    moment: Array
    moment_std: Array
    tangent: Array
    tangent_std: Array
    secant: Array
    secant_std: Array
    factor: Array
    pre_curvature: float
    pre_curvature_std: float
    rest_factor: Array = field(default_factory=lambda: np.zeros(0))

    def at(self, kappa: float) -> tuple[float, float]:
        """Tangent and its standard deviation at a curvature, in N m^2, interpolated linearly."""
        value, std = (float(np.interp(kappa, self.kappa, along)) for along in (self.tangent, self.tangent_std))
        return value, std

    @property
    def known(self) -> bool:
        """Whether f_EI is known to better than itself anywhere."""
        return bool(np.any(self.tangent_std < self.tangent))

    def ends(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Curvature, tangent and its standard deviation (1/m, N m^2) at both ends of the range that the data determine.

        Where little of the cable was bent so far, the band runs away (`FAR`), and f_EI there is no figure to quote.
        """
        band = self.tangent_std / np.abs(self.tangent)
        held = np.flatnonzero(band <= FAR * np.median(band))[[0, -1]]
        first, last = ((float(self.kappa[i]), float(self.tangent[i]), float(self.tangent_std[i])) for i in held)
        return first, last

    def told(self) -> tuple[tuple[str, str], ...]:
        """K0 and the tangent at both ends in words, each with its standard deviation, by name."""
        ends = [(f"f_EI at {plain(k)} 1/m", f"{rounded(1e3 * f, 1e3 * std)} mN m²") for k, f, std in self.ends()]
        return (("K0", f"{rounded(self.pre_curvature, self.pre_curvature_std)} 1/m"), *ends)

    def _repr_html_(self) -> str:
        """Show the curve in a notebook."""
        return html_table(self.method, self.told())


FAR = 3.0
"""Times its median: a relative band wider than that is not determined by the data but by its neighbours."""


def html_table(caption: str, rows: Iterable[tuple[str, str]]) -> str:
    """A caption and rows of name and text as an HTML table, for a notebook."""
    body = "".join(f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in rows)
    return f"<table><caption>{escape(caption)}</caption><tbody>{body}</tbody></table>"


STORED = {"kappa": "kappa_per_m", "moment": "moment_Nm", "moment_std": "moment_std_Nm", "tangent": "tangent_Nm2"}
STORED |= {"tangent_std": "tangent_std_Nm2", "secant": "secant_Nm2", "secant_std": "secant_std_Nm2"}
"""What stands along a `Visited`, and its name in a `Curve`."""


def visited(
    method: Method, curve: Curve | None, pre_curvature: tuple[float | None, float | None] = (None, None)
) -> Visited | None:
    """The visited part of a curve; None if there is none of at least two points.

    Without a pre-curvature of its own (value and standard deviation) a curve tells it where its moment is zero.
    """
    if curve is None:
        return None
    keep = np.flatnonzero(curve.supported)
    if keep.size < 2:
        return None
    along = {name: np.asarray(getattr(curve, stored), dtype=np.float64)[keep] for name, stored in STORED.items()}
    kappa, moment, tangent = along["kappa"], along["moment"], along["tangent"]
    rest, rest_std = pre_curvature
    if rest is None or rest_std is None:
        nearest = int(np.argmin(np.abs(moment)))  # the error of zero moment there is that of the moment over f
        rest = float(kappa[nearest] - moment[nearest] / tangent[nearest])
        rest_std = float(along["moment_std"][nearest] / abs(tangent[nearest]))
    rows = len(curve.kappa_per_m)
    return Visited(
        method=method,
        **along,
        factor=np.reshape(np.asarray(curve.tangent_factor_Nm2, dtype=np.float64), (rows, -1))[keep],
        pre_curvature=rest,
        pre_curvature_std=rest_std,
        rest_factor=np.asarray(curve.pre_curvature_factor_per_m, dtype=np.float64),
    )
