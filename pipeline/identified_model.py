"""The cable a result describes: characteristic, pre-curvature and what else the diagnosis found in it, with covariance.

What belongs to the cable goes with it into any other experiment: friction between its wires, set, stiffness and
pre-curvature that vary along it. What belongs to rig, load cell or camera stays behind.

Uncertainty: the result holds f on a grid K_j with F F^T its covariance, and g with F g its covariance with K0. Errors
of f and of K0 largely cancel in the moment, and so in forces. Amounts and forms of causes have rows beside F.

Signs and units: SI; amounts in the units of their causes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.causes import CATALOGUE, Cause, Variant
from pipeline.diagnosis.causes.law import LAW
from pipeline.result import CauseForm, Result, Visited
from rod.bending_test import BendingTest
from rod.characteristic import Characteristic
from rod.inverse.prediction import Facts, Model

Array = NDArray[np.float64]
Zero = Literal["natural", "length"]

IN_THE_LAW = (LAW,)
"""Causes of the cable that are in its characteristic already."""


@dataclass(frozen=True, eq=False)
class CableForm:
    """One form of a cause that belongs to the cable.

    Attributes
    ----------
    cause : Cause
    amount : float
    variant : Variant
        With ``at`` and ``width`` as fitted.
    factor : (1 + tuned, r)
        Rows of the amount and of what was fitted of the form, beside the factor of the characteristic.
    """

    cause: Cause
    amount: float
    variant: Variant
    factor: Array

    @property
    def std(self) -> Array:
        """Standard deviations (1 + tuned,)."""
        return np.asarray(np.linalg.norm(self.factor, axis=1))

    def moved(self, row: int, by: float) -> CableForm:
        """The form with another amount (row 0) or another place or width."""
        if row == 0:
            return replace(self, amount=self.amount + by)
        name = self.variant.tuned[row - 1]
        return replace(self, variant=self.variant.moved({name: getattr(self.variant, name) + by}))


@dataclass(frozen=True, eq=False)
class IdentifiedModel:
    """Characteristic, pre-curvature and forms of causes of a result with their joint covariance.

    Attributes
    ----------
    method : str
        ``extended``, ``inverse`` or ``balance``.
    characteristic : Characteristic
        Tangent reading, a control point at each of the n curvatures of the result.
    pre_curvature : 1/m
    factor : (n + 1, r)
        F with F F^T the covariance of the n control points (N m^2) and, last, the pre-curvature (1/m).
    visited : (low, high) 1/m
    forms : tuple of CableForm
        What else belongs to the cable; empty for a uniform, elastic one.
    """

    method: str
    characteristic: Characteristic
    pre_curvature: float
    factor: Array
    visited: tuple[float, float]
    forms: tuple[CableForm, ...] = ()

    @property
    def pre_curvature_std(self) -> float:
        """Standard deviation of the pre-curvature, 1/m."""
        return float(np.linalg.norm(self.factor[-1]))

    @property
    def remembers(self) -> bool:
        """Whether a step depends on the steps before it."""
        section = self.bending_test(1.0, elements=20).rod.section
        return section.friction is not None or section.plastic_rate > 0.0

    def bending_test(self, length: float, *, zero: Zero = "natural", elements: int = 100) -> BendingTest:
        """An ideal test of such a cable of another length, m.

        A cable whose rest curvature varies or grows keeps its law: f_EI then is one of the excess curvature K - K0.
        """
        law = self.characteristic
        if self.forms:
            law = replace(law, knots=law.knots - self.pre_curvature, abscissa="excess")
        model = Model(BendingTest(length, law, self.pre_curvature, zero=zero, elements=elements))
        for form in self.forms:
            model = form.cause.apply(model, form.amount, form.variant, _facts(length, self))
        return model.bending

    def factor_of_test(self) -> Array:
        """Factor (n + 1, r) of the control points of `bending_test` and the pre-curvature."""
        if not self.forms:
            return self.factor
        law, K = self.characteristic, self.characteristic.knots
        step = 1e-5 * float(np.ptp(K))
        slope = (law.f(K + step) - law.f(K - step)) / (2.0 * step)
        # at a fixed excess curvature D, f moves by what it does at K = K0 + D and by f' dK0
        return np.vstack([self.factor[:-1] + slope[:, None] * self.factor[-1], self.factor[-1:]])


def identified_model(result: Result) -> IdentifiedModel | None:
    """The cable of a result; None without a characteristic."""
    curve = result.answer.curve
    if curve is None:
        return None
    law = Characteristic.from_ordinates(curve.kappa, curve.tangent)
    factor = _joint_factor(curve)
    forms = _forms(result, columns=factor.shape[1]) if curve.method == "extended" else ()
    visited = float(curve.kappa[0]), float(curve.kappa[-1])
    return IdentifiedModel(curve.method, law, curve.pre_curvature, factor, visited, forms)


def _joint_factor(curve: Visited) -> Array:
    """Factor of the joint covariance of f along the curve and K0, (n + 1, r); see the module.

    Without a factor of f its errors are taken as one common factor on the whole curve: the widest band of a force.
    """
    F, link, std = curve.factor, curve.rest_factor, curve.pre_curvature_std
    if not F.shape[1]:
        F = curve.tangent_std[:, None]
    if link.size != F.shape[1]:
        link = np.zeros(F.shape[1])
    length = float(np.linalg.norm(link))
    link = link * (min(1.0, std / length) if length > 0.0 else 0.0)  # a correlation of one at most, rounded
    own = np.sqrt(max(std**2 - float(link @ link), 0.0))
    return np.block([[F, np.zeros((len(F), 1))], [link[None, :], np.array([[own]])]])


def _forms(result: Result, *, columns: int) -> tuple[CableForm, ...]:
    """Forms of the causes that belong to the cable."""
    catalogue = {cause.name: cause for cause in CATALOGUE if cause.seat == "cable" and cause.name not in IN_THE_LAW}
    parts = [] if result.diagnosis is None else result.diagnosis.causes
    return tuple(
        _cable_form(catalogue[part.name], form, columns)
        for part in parts
        if part.name in catalogue
        for form in part.forms
    )


def _cable_form(cause: Cause, form: CauseForm, columns: int) -> CableForm:
    """The form with its rows beside the factor of the characteristic; without any its amount is exact."""
    rows = np.zeros((1 + len(form.tuned), columns))
    given = np.array(form.factor, dtype=float)
    if given.size:
        rows[:, : given.shape[1]] = given
    return CableForm(cause, form.amount, Variant(form.label, form.at, form.width, tuple(form.tuned)), rows)


def _facts(length: float, model: IdentifiedModel) -> Facts:
    """Circumstances of one step of an ideal test: no cause of the cable asks for more than its sizes."""
    low, high = model.visited
    moment = float(model.characteristic.moment(np.array([high]), model.pre_curvature)[0])
    return Facts(
        branch=("loading",),
        displacement=np.zeros(1),
        displacement_std=np.zeros(1),
        photo_time=np.zeros(1),
        hold_times=(np.zeros(1),),
        clock=np.zeros(1),
        picture_centre=np.zeros((1, 2)),
        half_diagonal=length,
        moving="left",
        timed=False,
        length=length,
        force_scale=moment / length,
        moment_scale=moment,
        curvature_scale=high - low,
        force_share=np.ones(1),
        chord_by_log=np.full(1, np.nan),
    )
