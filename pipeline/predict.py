"""A new experiment by the identified model: from a result and displacement steps to forces and shapes with bands.

The model is the cable of the result on an ideal rig of any length (Sec. 2 of the paper: what f_EI is identified for):
the characteristic the result answers with (extended, else inverse, else balance), its pre-curvature K0, and what the
extended model holds of friction, set and variation along the cable; see `pipeline.identified_model`.

A cable with friction or set remembers: its steps then are one test in the order given, from the mounted cable on.
Without them each step stands for itself.

The joint covariance of all that goes to forces and shapes to first order, by the derivatives of `rod.sensitivity`, and
for causes by differences over a tenth of their standard deviation. Length and displacements of the new experiment are
exact.

Outside the curvatures that were visited no cable was looked at: such a step is refused, or marked where the caller
asks for it; then f goes on straight and the band says nothing about what the cable does there.

Signs and units: chord frame, SI; force positive in compression; displacement positive where the bearings approach.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np
from scipy.optimize import brentq

from pipeline.identified_model import IdentifiedModel, Zero, identified_model
from pipeline.messages import Message, ended, word
from pipeline.records import Array, Finding, doubtful, inferred
from pipeline.result import CausePart, Result
from pipeline.result.visited import html_table
from pipeline.rounding import plain
from pipeline.units import quantity
from rod.bending_test import BendingTest, simulate
from rod.equilibrium import Equilibrium
from rod.sensitivity import derivatives

Status = Literal["predicted", "extrapolated", "refused", "no equilibrium"]

DIFFERENCE = 0.1
"""Standard deviations of an amount or form by which it is moved to see what that does: within its band, well above
rounding."""

ELEMENTS = 400
"""Of the simulated rod; its height is within 1e-6 of the length, a fifth of a good band."""

SLACK = 0.01
"""Share of the visited range by which a curvature may lie outside it: a repeated step may come out sharper by the noise
of its photo, and f_EI does not change on that distance."""


@dataclass(frozen=True, eq=False)
class PredictedStep:
    """One displacement step; arrays along the cable are empty and the force is None unless a shape was computed.

    Attributes
    ----------
    displacement_m : float
    status : {"predicted", "extrapolated", "refused", "no equilibrium"}
    said : Message or None
        Why not simply predicted; `reason` in English.
    chord_m, force_N, force_std_N, kappa_max_per_m : float or None
    s_m, x_m, x_std_m, y_m, y_std_m, theta_rad, theta_std_rad, kappa_per_m, kappa_std_per_m : (m,)
    """

    displacement_m: float
    status: Status
    said: Message | None = None
    chord_m: float | None = None
    force_N: float | None = None
    force_std_N: float | None = None
    kappa_max_per_m: float | None = None
    s_m: Sequence[float] = ()
    x_m: Sequence[float] = ()
    x_std_m: Sequence[float] = ()
    y_m: Sequence[float] = ()
    y_std_m: Sequence[float] = ()
    theta_rad: Sequence[float] = ()
    theta_std_rad: Sequence[float] = ()
    kappa_per_m: Sequence[float] = ()
    kappa_std_per_m: Sequence[float] = ()

    @property
    def reason(self) -> str:
        """Why the step is not simply predicted; empty if it is."""
        return "" if self.said is None else str(self.said)

    def told(self) -> str:
        """Force with its standard deviation and largest curvature, or why there are none."""
        if self.force_N is None:
            return f"{self.status}: {self.reason}"
        bent = f"{quantity(self.force_N, 'N', self.force_std_N)}, bent to {plain(self.kappa_max_per_m or 0.0)} 1/m"
        return f"{bent} ({self.status}: {self.reason})" if self.reason else bent


PREDICTED = tuple(one.name for one in fields(PredictedStep) if one.default == ())
"""Arrays of a predicted step along the cable."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """A predicted experiment.

    Attributes
    ----------
    specimen : str
        Whose characteristic it is.
    method : str
    length_m : float
    zero : {"natural", "length"}
        Where displacement is counted from.
    pre_curvature_per_m, pre_curvature_std_per_m : float
    visited_per_m : (low, high)
    reachable_m : float or None
        Largest displacement within the visited range; computed where a step lies beyond it.
    steps : tuple of PredictedStep
    findings : tuple of Finding
    """

    specimen: str
    method: str
    length_m: float
    zero: Zero
    pre_curvature_per_m: float
    pre_curvature_std_per_m: float
    visited_per_m: tuple[float, float]
    reachable_m: float | None
    steps: tuple[PredictedStep, ...]
    findings: tuple[Finding, ...] = ()

    def _repr_html_(self) -> str:
        """Show the prediction in a notebook, a row a step."""
        rows = [(f"{plain(1e3 * step.displacement_m, 4)} mm", step.told()) for step in self.steps]
        rows += [(finding.level, str(finding.said)) for finding in self.findings if finding.level != "info"]
        return html_table(f"{self.specimen}, {plain(1e3 * self.length_m, 4)} mm long: predicted forces", rows)


def predict(
    result: Result,
    displacements_m: Sequence[float],
    *,
    length_m: float | None = None,
    zero: Zero = "natural",
    extrapolate: bool = False,
    elements: int = ELEMENTS,
) -> Prediction | None:
    """Forces and shapes of a new experiment by the identified model.

    Parameters
    ----------
    result : Result
    displacements_m : sequence of float
        Steps, m.
    length_m : float, optional
        Between the bearing axes; by default that of the specimen.
    zero : {"natural", "length"}
        Displacement is counted from the mounted, force-free cable, or from the chord that equals the length.
    extrapolate : bool
        Compute steps beyond the visited range too, marked ``extrapolated``, instead of refusing them.
    elements : int
        Of the simulated rod.

    Returns
    -------
    Prediction or None
        None if the result holds no characteristic.

    Raises
    ------
    ValueError
        For no displacement, one that is not finite or as long as the cable, a length of no cable, a result that is not
        usable, or one whose numbers are none of a cable.
    """
    length = result.specimen.length_m if length_m is None else length_m
    if not len(displacements_m) or not np.all(np.isfinite(displacements_m)):
        raise ValueError(Message("misuse.displacements"))
    model = identified_model(result)
    if model is None:
        return None
    if not (told := result.answer).usable:
        raise ValueError(Message("comparison.unusable", name=result.specimen.id, reason=told.said))
    if length is None:
        raise ValueError(Message("cli.no-length"))
    _check_sizes(length, displacements_m, model)
    test = model.bending_test(length, zero=zero, elements=elements)
    steps = _steps(test, model, [float(d) for d in displacements_m], extrapolate)
    limit = reachable(test, model) if any(step.status != "predicted" for step in steps) else None
    return Prediction(
        specimen=result.specimen.id,
        method=model.method,
        length_m=length,
        zero=zero,
        pre_curvature_per_m=model.pre_curvature,
        pre_curvature_std_per_m=model.pre_curvature_std,
        visited_per_m=model.visited,
        reachable_m=limit,
        steps=tuple(_explained(step, limit) for step in steps),
        findings=tuple(_findings(result, model)),
    )


LENGTHS_M = (1e-3, 1e3)
"""No rig holds a cable that is shorter or longer."""


def _check_sizes(length: float, displacements: Sequence[float], model: IdentifiedModel) -> None:
    """Refuse numbers that are of no test; `ValueError` says which."""
    low, high = LENGTHS_M
    if not low <= length <= high:
        raise ValueError(Message("misuse.length", length_m=length))
    largest = max(displacements, key=abs)
    if abs(largest) >= length:
        raise ValueError(Message("misuse.bearings-meet", given_m=largest, length_m=length))
    if np.mean(model.characteristic.ordinates) <= 0.0:
        raise ValueError(Message("fault.negative"))


def reachable(test: BendingTest, model: IdentifiedModel) -> float | None:
    """Largest displacement at which the cable is still within the visited range, m; None if there is none."""
    high = model.visited[1]

    def excess(displacement: float) -> float:
        (step,) = simulate(test, [displacement], branch="up")
        return float(step.kappa.max()) / high - 1.0 if step.good else 1.0

    # Pushed by half its length a cable is bent to a mean curvature of about 4 / length: bracket from there downward.
    top = 0.5 * test.length
    return float(brentq(excess, 0.0, top, xtol=1e-6 * top)) if excess(0.0) < 0.0 < excess(top) else None


def _steps(
    test: BendingTest, model: IdentifiedModel, displacements: list[float], extrapolate: bool
) -> tuple[PredictedStep, ...]:
    """All steps; where the cable remembers, those after one that cannot be predicted cannot either."""
    if not model.remembers:
        paths = [simulate(test, [d], branch="up") for d in displacements]
        return tuple(_step(test, model, path, d, extrapolate) for path, d in zip(paths, displacements, strict=True))
    whole, steps, lost = simulate(test, displacements, branch="up"), [], None
    for count, displacement in enumerate(displacements, start=1):
        if lost:
            steps.append(PredictedStep(displacement, "refused", lost))
            continue
        steps.append(_step(test, model, whole[:count], displacement, extrapolate))
        if steps[-1].force_N is None:
            lost = Message("prediction.lost", displacement_m=displacement)
    return tuple(steps)


def _step(
    test: BendingTest, model: IdentifiedModel, path: tuple[Equilibrium, ...], displacement: float, extrapolate: bool
) -> PredictedStep:
    """The last step of a path."""
    step = path[-1]
    if not step.good:
        return PredictedStep(displacement, "no equilibrium", ended(step.outcome))
    (low, high), sharpest = model.visited, float(step.kappa.max())
    slack = SLACK * (high - low)
    status: Status = "predicted"
    said = None
    if sharpest > high + slack or step.kappa.min() < min(low, float(test.rod.section.pre_curvature.min())) - slack:
        reach = {"from_per_m": step.kappa.min(), "to_per_m": sharpest}
        said = Message("prediction.beyond", low_per_m=low, high_per_m=high, **reach)
        if not extrapolate:
            return PredictedStep(displacement, "refused", said, chord_m=step.chord, kappa_max_per_m=sharpest)
        status = "extrapolated"
    return PredictedStep(displacement, status, said, **_with_bands(test, model, path))


def _explained(step: PredictedStep, limit: float | None) -> PredictedStep:
    """A step without equilibrium that lies beyond the visited range: what the continued law does there says nothing."""
    if step.status != "no equilibrium" or limit is None or step.displacement_m <= limit:
        return step
    return replace(step, status="refused", said=Message("prediction.unknown"))


ALONG = {"x": "m", "y": "m", "theta": "rad", "kappa": "per_m"}
"""What of an equilibrium has a band along the cable, and its unit."""

BANDED = ("force", *ALONG)


def _with_bands(test: BendingTest, model: IdentifiedModel, path: tuple[Equilibrium, ...]) -> dict[str, Any]:
    """Force and shape of the last equilibrium of a path with standard deviations to first order, by field."""
    step, by = path[-1], derivatives(test, path, ["ordinates", "pre_curvature"])[-1]
    law = model.factor_of_test()
    causes = _by_causes(test, model, path)

    def std(name: str) -> Array:
        columns = getattr(by, name) @ law
        for rows, changes in causes:
            columns = columns + changes[name] @ rows
        return np.asarray(np.linalg.norm(columns, axis=-1))

    return {
        "chord_m": step.chord,
        "force_N": step.force,
        "force_std_N": float(std("force")),
        "kappa_max_per_m": float(step.kappa.max()),
        "s_m": step.s.tolist(),
        **{f"{name}_{unit}": getattr(step, name).tolist() for name, unit in ALONG.items()},
        **{f"{name}_std_{unit}": std(name).tolist() for name, unit in ALONG.items()},
    }


def _by_causes(
    test: BendingTest, model: IdentifiedModel, path: tuple[Equilibrium, ...]
) -> list[tuple[Array, dict[str, Array]]]:
    """For every form of a cause its rows of the factor (q, r), and what moves by name, (..., q) per unit."""
    found, here = [], path[-1]
    displacements = [test.zero_chord - step.chord for step in path]
    for place, form in enumerate(model.forms):
        rows, columns = [], []
        for row, by in enumerate(DIFFERENCE * form.std):
            forms = (*model.forms[:place], form.moved(row, by), *model.forms[place + 1 :])
            cable = replace(model, forms=forms).bending_test(test.length, elements=here.rod.edges.size - 2)
            there = simulate(replace(cable, zero=test.zero), displacements, branch="up", starts=path)[-1]
            if by > 0.0 and there.good:
                rows.append(form.factor[row])
                columns.append({name: (getattr(there, name) - getattr(here, name)) / by for name in BANDED})
        if rows:
            found.append((np.array(rows), {name: np.stack([c[name] for c in columns], axis=-1) for name in BANDED}))
    return found


def _findings(result: Result, model: IdentifiedModel) -> list[Finding]:
    """What a reader of the prediction must know about the model it was made with."""
    found = [doubtful("predict/balance")] if model.method == "balance" else []
    if (diagnosis := result.diagnosis) is not None:
        found += _about_causes(diagnosis.causes, model)
        found += [doubtful("predict/unexplained")] if diagnosis.verdict == "unexplained" else []
    return found


def _about_causes(causes: list[CausePart], model: IdentifiedModel) -> list[Finding]:
    """Which causes are in the prediction, which are not, and what other names one may have."""
    held = {form.cause.name for form in model.forms}
    inside = [cause for cause in causes if cause.name in held]
    rest = [cause.name for cause in causes if cause.name not in held]
    found = []
    if inside:
        names = [word(cause.name) for cause in inside]
        others = [word(name) for cause in inside for name in cause.class_ if name != cause.name]
        told = [Message("predict/cause.contains", names=names)]
        told += [Message("predict/cause.order")] if model.remembers else []
        told += [Message("predict/cause.class", others=others)] if others else []
        found.append((doubtful if others else inferred)("predict/cause", sentences=told))
    if rest:
        found.append(inferred("predict/left-out", names=map(word, rest)))
    return found
