"""A result as pandas frames with the unit in every column's name: for notebooks, and what the tables are written from.

One row a point of a curve, a force, a photo or a cause. SI units. Names of the columns are those of the contract.
"""

from __future__ import annotations

import pandas as pd

from pipeline.compare import Comparison
from pipeline.predict import PREDICTED, Prediction
from pipeline.report.curves import equivalent, smallest_radius
from pipeline.report.exports import BEAM, beam_table
from pipeline.result import Curve, Result

CHARACTERISTIC = (
    "kappa_per_m",
    "moment_Nm",
    "tangent_Nm2",
    "tangent_std_Nm2",
    "secant_Nm2",
    "supported",
    "moment_std_Nm",
    "secant_std_Nm2",
)
CENTERLINE = ("s_m", "x_m", "y_m", "u_px", "v_px", "theta_rad", "kappa_per_m", "kappa_std_per_m")


def characteristic_frame(result: Result) -> pd.DataFrame:
    """Moment curve and both readings by every way, with standard deviations.

    ``supported`` marks the visited range; ``answer`` is 1 on the rows of the one curve that is the result, else 0.
    """
    whole: dict[str, Curve | None] = {
        "inverse": result.inverse.curve if result.inverse else None,
        "balance": result.balance.curve if result.balance else None,
        "extended": result.diagnosis.extended if result.diagnosis else None,
    }
    parts = []
    for method, curve in whole.items():
        if curve is not None:
            columns = {name: getattr(curve, name) for name in CHARACTERISTIC}
            parts.append(pd.DataFrame({"method": method, "answer": int(method == result.answer.method)} | columns))
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=["method", "answer", *CHARACTERISTIC])


def centerlines_frame(result: Result) -> pd.DataFrame:
    """Centerlines of all traced photos; ``seen`` is false where the cable was hidden and extended by the model."""
    parts = [
        pd.DataFrame({"image": photo.image, **{name: getattr(photo, name) for name in CENTERLINE}, "seen": photo.seen})
        for photo in result.photos
        if photo.s_m
    ]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=["image", *CENTERLINE, "seen"])


def forces_frame(result: Result) -> pd.DataFrame:
    """Forces measured and simulated by step; compression positive."""
    names = ("step", "branch", "displacement_m", "force_N", "force_std_N", "force_fit_N", "image")
    return pd.DataFrame([{name: getattr(step, name) for name in names} for step in result.steps], columns=list(names))


def photos_frame(result: Result) -> pd.DataFrame:
    """Outcome of every photo with its lengths."""
    lengths = [f"{name}{end}" for name in ("chord", "traced_length", "width") for end in ("_m", "_std_m")]
    names = ["image", "step", "status", "reason", *lengths]
    return pd.DataFrame([{name: getattr(photo, name) for name in names} for photo in result.photos], columns=names)


def causes_frame(result: Result) -> pd.DataFrame:
    """All causes examined; estimates in the unit of the column ``unit``."""
    rows = result.diagnosis.table if result.diagnosis else []
    return pd.DataFrame([row.model_dump() for row in rows])


def simulation_frame(result: Result, bounds: tuple[float, float] | None = None) -> pd.DataFrame:
    """Constants a simulation program asks for: equivalent EI over a range of curvature, K0, smallest radius, causes.

    Columns quantity, value, std, unit, note; each quantity once. A cause that was named stands under its name. No rows
    where the numbers are not usable. ``bounds`` (low, high) in 1/m of the equivalent stiffness are by default those of
    the visited range.
    """
    rows: list[tuple[str, float, float | None, str, str]] = []
    columns = ["quantity", "value", "std", "unit", "note"]
    curve = result.answer.curve
    if curve is not None and not result.answer.usable:
        return pd.DataFrame(columns=columns)
    if curve is not None:
        if constant := equivalent(curve, bounds):
            note = f"{curve.method}, kappa {constant.low:.6g} to {constant.high:.6g} 1/m"
            note += ", std is an upper bound" if constant.bound else ""
            rows.append(("equivalent_stiffness", constant.stiffness, constant.std, "N m2", note))
        rows.append(("pre_curvature", curve.pre_curvature, curve.pre_curvature_std, "1/m", curve.method))
    radius = smallest_radius(result)
    if radius is not None:
        rows.append(("smallest_bend_radius_seen", radius[0], radius[1], "m", f"photo of step {radius[2]}"))
    part = result.diagnosis
    for cause in part.causes if part is not None and part.verdict != "unexplained" else []:
        apart = "are without it" if result.answer.method == "extended" else "contain what it does"
        share = "> 0.99" if cause.probability > 0.99 else f"{cause.probability:.2g}"
        note = f"probability {share}; the numbers above {apart}"
        rows.append((cause.name, cause.estimate, cause.std, cause.unit.replace("^", ""), note))
    return pd.DataFrame(rows, columns=columns)


def beam_frame(result: Result) -> pd.DataFrame:
    """Moment over the bend away from rest, from zero on: the table a nonlinear beam element asks for.

    ``measured`` is 0 for the side to which a straight cable was not bent, and which is taken to be alike. No rows where
    the numbers are not usable.
    """
    curve = result.answer.curve if result.answer.usable else None
    return pd.DataFrame(columns=list(BEAM)) if curve is None else beam_table(curve)


def prediction_frame(prediction: Prediction) -> pd.DataFrame:
    """Forces and shapes of a predicted experiment: one row a point of a shape, one row for a step without shape."""
    ahead = ("displacement_m", "status", "chord_m", "force_N", "force_std_N")
    parts = []
    for step in prediction.steps:
        part = pd.DataFrame({name: getattr(step, name) or [None] for name in PREDICTED}, dtype=float)
        for place, name in enumerate(ahead):
            part.insert(place, name, getattr(step, name))
        parts.append(part.astype({name: float for name in ahead if name != "status"}))
    return pd.concat(parts, ignore_index=True)


def comparison_frame(comparison: Comparison) -> pd.DataFrame:
    """Ratio of two characteristics along the common range with its standard deviation."""
    return pd.DataFrame(
        {"kappa_per_m": comparison.kappa_per_m, "ratio": comparison.ratio, "ratio_std": comparison.ratio_std}
    )
