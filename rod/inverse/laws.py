"""The law of a base model as unknowns: of any form (`AnyLaw`), or the paper's spline through few points (`FewPoints`).

Both turn unknowns of order one into a law and say what is known of them beforehand, as rows of unit variance. A law of
any form has coefficients of log f_EI on the abscissa of both ways to the characteristic (`rod.stiffness_law`), positive
whatever they are. Its prior here is a wide one, the same for all causes, so that none is preferred for what it leaves
to the law: `rough` of `rod.law_prior` with tau of `ROUGHNESS`. A law of few points is for the paper's two steps alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.optimize import isotonic_regression

from rod.array import Array
from rod.characteristic import Characteristic
from rod.compliance_law import ComplianceLaw, LawBasis, moment_basis, refreshed
from rod.law_prior import Family, priors
from rod.stiffness_law import StiffnessLaw

COEFFICIENTS = 16
"""Of log f_EI: enough for a law of any form about which causes are weighed."""

ROUGHNESS = 5.0
"""Prior size of d^2 log f / dxi^2: along its own abscissa a sixfold fall by stick and slip has 3.7 in the mean, 6.5 at
most. With twice as much a law that rises thirtyfold from rest, beside a K0 of the other sign, took friction of the
bearings for its own."""

REST_SLOPE = 1.0
"""Prior size of d log f / dxi at rest: a cable that bends alike to both sides has none."""


SOFTER = (1.0, 1.5)
"""Mean and standard deviation of how far log f falls from rest to the largest bend. Moments of real cables fall 4- to
70-fold, by stick and slip; what hardens does so two- or threefold. A law that rises thousandfold from rest, beside a K0
of the other sign, takes a zero of the displacement for its own."""

FreeLaw = StiffnessLaw | ComplianceLaw
Abscissa = Literal["bend", "moment"]


@dataclass(frozen=True, eq=False)
class AnyLaw:
    """Coefficients of log f_EI on a basis of bends, or of the log compliance on one of moments.

    Over bends other causes may carry a part of the moment, and the law stays what it is at all other bends. Over
    moments K0 is added to all curvatures alike, whatever the law: what photos without a force-free one leave open of
    both is told rightly by the linear model.
    """

    basis: LawBasis
    over: Abscissa = "bend"

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return self.basis.size

    def curve(self, unknowns: Array) -> FreeLaw:
        """The law at coefficients (size,)."""
        law = self.basis.law(unknowns)
        return StiffnessLaw(law) if self.over == "bend" else law

    def by(self, unknowns: Array) -> Array:
        """Change (size, size) of the curve's own parameters with the unknowns: the coefficients are its parameters."""
        return np.eye(self.size)

    def stiffer(self, factor: float) -> Array:
        """Change (size,) that makes the law so much stiffer: B-splines of equal coefficients are a constant."""
        return np.full(self.size, np.log(factor) if self.over == "bend" else -np.log(factor))

    @cached_property
    def prior(self) -> Array:
        """Rows (m, size) a fit holds it by: rough, and flat at rest, as far as `ROUGHNESS` and `REST_SLOPE` let it."""
        rough = priors(self.basis, "rough")[0]
        slope = self.basis.spline(self.basis.xi[2 * self.basis.rest], 1) / REST_SLOPE
        weight, mode = np.linalg.eigh(rough.form / ROUGHNESS**2 + np.outer(slope, slope))
        kept = weight > 1e-9 * weight[-1]  # the level has no prior
        return np.asarray(np.sqrt(weight[kept])[:, None] * mode.T[kept])

    @property
    def families(self) -> tuple[Family, ...]:
        """What fits are weighed by: laws that change alike everywhere.

        Quick ones would triple the work, and are the same for all causes.
        """
        return priors(self.basis, "even")

    def softening(self, unknowns: Array) -> tuple[float, Array]:
        """How far log f falls from rest to the largest bend, less `SOFTER`, over its spread; and its derivative."""
        rest = float(self.basis.xi[2 * self.basis.rest])
        ends = self.basis.spline(np.array([rest, float(rest < 0.5)]))
        by = (ends[0] - ends[1]) * (1.0 if self.over == "bend" else -1.0) / SOFTER[1]
        return float(by @ unknowns) - SOFTER[0] / SOFTER[1], by


@dataclass(frozen=True, eq=False)
class FewPoints:
    """Logarithms of the ordinates of a natural spline over a reference stiffness (N m^2); knots (p,) in 1/m.

    ``abscissa`` as of `rod.characteristic.Characteristic`.
    """

    knots: Array
    stiffness: float

    @property
    def size(self) -> int:
        """Number of points."""
        return len(self.knots)

    def curve(self, unknowns: Array) -> Characteristic:
        """The spline at unknowns (size,)."""
        ordinates = self.stiffness * np.exp(unknowns)
        return Characteristic.from_ordinates(self.knots, ordinates, reading="tangent", abscissa="excess")

    def by(self, unknowns: Array) -> Array:
        """The law's own parameters are its ordinates."""
        return np.diag(self.stiffness * np.exp(unknowns))

    def stiffer(self, factor: float) -> Array:
        """All ordinates alike."""
        return np.full(self.size, np.log(factor))

    @property
    def prior(self) -> Array:
        """No rows: few points need no prior."""
        return np.zeros((0, self.size))


Law = AnyLaw | FewPoints

BINS = 40
"""Of the moments that photos show: each holds the curvatures of some dozens of sections."""

SURE = 0.3
"""Standard deviation of log f_EI as photos show it by the moment P y alone."""


def as_photographed(
    moment: Array, curvature: Array, *, unit: float, rest: float | None = None
) -> tuple[AnyLaw, Array, float] | None:
    """The law that photos show by the moment P y, without any simulation: K(m) rises, whatever its form.

    A law with an early knee, beside K0 by a straight line through all curvatures, would be sought from the other side
    of the true K0 and never found.

    Parameters
    ----------
    moment, curvature : (n,) N m, 1/m
        Of all sections of all photos.
    unit : N m^2
        Of the coefficients.
    rest : 1/m or None
        K0, where it is known; else as the smallest moments show it.

    Returns
    -------
    (law, coefficients (p,), K0 in 1/m), or None where the moments show no law.
    """
    order = np.argsort(moment)
    bins = [part for part in np.array_split(order, BINS) if part.size]
    m, K = (np.array([np.mean(row[part]) for part in bins]) for row in (moment, curvature))
    K = isotonic_regression(K).x
    if not m[-1] > m[0]:
        return None
    # a force-free photo fills the first bins, all of no moment: they are one point of a line
    low = m <= max(m[0] + 0.1 * (m[-1] - m[0]), np.unique(m)[:3][-1])
    slope, at_zero = np.polyfit(m[low], K[low], 1)
    rest = float(at_zero) if rest is None else rest
    bend = np.append(0.0, K - rest)
    rises = np.append(True, np.diff(np.maximum.accumulate(bend)) > 1e-4 * np.ptp(bend))
    bend, m = bend[rises], np.append(0.0, m)[rises]
    if not (slope > 0.0 and bend.size > 3 and np.all(np.diff(m) > 0.0)):
        return None
    plain = AnyLaw(moment_basis(0.0, float(bend[-1]), unit=unit, size=COEFFICIENTS))
    rows = plain.basis.at(0.5 * (bend[1:] + bend[:-1])) / SURE
    log_f = np.log(np.diff(m) / np.diff(bend) / unit) / SURE
    found = np.linalg.lstsq(np.vstack([rows, plain.prior]), np.r_[log_f, np.zeros(len(plain.prior))])[0]
    rise = plain.basis.law(found)
    law = AnyLaw(refreshed(rise, 0.0, float(bend[-1])))
    return law, law.basis.projected(rise), rest


def following(tangent: Array, bend: Array, *, unit: float) -> tuple[AnyLaw, Array]:
    """A law of any form near a given one: f_EI (n,) N m^2 at rising bends (n,) 1/m from 0, and its coefficients."""
    basis = moment_basis(0.0, float(bend[-1]), unit=unit, size=COEFFICIENTS)
    log_f = np.interp(basis.moments, bend, np.log(tangent / unit))
    return AnyLaw(basis), np.asarray(np.linalg.lstsq(basis.at_ends, log_f, rcond=None)[0])


FINE = 256
"""Coefficients of a law on its way from one abscissa to another: a plateau is hardly anything of the moments."""


def over_moments(law: StiffnessLaw, bends: Array) -> ComplianceLaw:
    """The same law as one over the moments of the given bends (n,) 1/m."""
    bend = np.linspace(min(float(bends.min()), 0.0), max(float(bends.max()), 0.0), 20 * FINE)
    moment, f = law.rise.bend(bend), law.rise.compliance(bend)  # told as the bend over the moment, see `StiffnessLaw`
    basis = moment_basis(float(moment[0]), float(moment[-1]), unit=1.0 / law.stiffness_scale, size=FINE)
    log_c = np.interp(basis.moments, moment, np.log(law.stiffness_scale / f))
    return basis.law(np.asarray(np.linalg.lstsq(basis.at_ends, log_c, rcond=None)[0]))
