"""The row of a specimen in the index: a result in a few thousand bytes, stored in its ``entry.json``.

`index_row` takes it from a result, `as_entry` and `from_entry` write and read it. What reads a batch as a whole (index,
summary, mean of repeat specimens) reads rows alone: a result with its photos is a thousand times as large. SI units.
"""

from __future__ import annotations

from base64 import b64decode, b64encode
from dataclasses import asdict, dataclass
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, PlainValidator, StrictBool, StrictInt, TypeAdapter

from pipeline.messages import UNREADABLE, Message
from pipeline.records import Array
from pipeline.rounding import digits

if TYPE_CHECKING:
    from pipeline.result import Result, Visited

Finite = Annotated[float, Field(allow_inf_nan=False)]
End = tuple[Finite, Finite, Finite]
Text = Annotated[str, AfterValidator(lambda text: text.encode("utf-8", "replace").decode("utf-8"))]
Told = Annotated[Message | None, PlainValidator(lambda said: said if said is None else Message.read(said))]
STATUSES = ("measured", "partial", "failed")

ROW = 6
"""Version of what stands in an entry; another one is made anew from the result."""

SHAPES, SHAPE_POINTS = 5, 11
SHAPE_SIZE = (1100, 400)
"""Of the picture of the shapes, in tenths of a px: whole numbers are short."""


@dataclass(frozen=True)
class RowCurve:
    """The visited part of a characteristic on a few curvatures, equally spaced.

    Attributes
    ----------
    kappa : (n,) 1/m
    tangent, tangent_std : (n,) N m^2
    factor : (n, r) N m^2
        F with F F^T the covariance of the tangent; r = 0 where it is not known.
    """

    kappa: Array
    tangent: Array
    tangent_std: Array
    factor: NDArray[np.float32]


@dataclass(frozen=True)
class IndexRow:
    """What the index keeps of a specimen; SI units.

    Attributes
    ----------
    id, type, status, verdict : str
    causes, twins : tuple of str
        Named ones, and other names that the data cannot tell from them.
    usable : bool
    fault : Message or None
        Why it is not usable.
    method : str
        Which curve answers; empty without any.
    low, high : (kappa, f_EI, std) or None
        Ends of the range that the data determine, 1/m and N m^2.
    pre_curvature : (K0, std) or None
        1/m.
    rms_relative, compatible : float, bool or None
        How far the two ways differ, and whether their bands allow it.
    photos_used, photos_given, warnings, errors : int
    worst, reason : str, Message or None
        Code of the worst finding and what it says; nothing without warning or error.
    shapes : str
        SVG path of measured shapes in the chord frame, to one scale, bow downwards.
    curve : RowCurve or None
    report : str
        Path of the report relative to the index; empty if there is none.
    outlying : bool
        Not usable because of the others of its type.
    """

    id: Text
    type: Text
    status: Literal["measured", "partial", "failed"]
    verdict: Literal["none", "adequate", "named", "class", "two_causes", "unexplained", "underpowered"]
    causes: tuple[Text, ...]
    twins: tuple[Text, ...]
    usable: StrictBool
    fault: Told
    method: Text
    low: End | None
    high: End | None
    pre_curvature: tuple[Finite, Finite] | None
    rms_relative: Finite | None
    compatible: StrictBool | None
    photos_used: StrictInt
    photos_given: StrictInt
    warnings: StrictInt
    errors: StrictInt
    worst: Text
    reason: Told
    shapes: Text
    curve: Annotated[RowCurve | None, PlainValidator(_curve)]
    report: Text = ""
    outlying: StrictBool = False

    @property
    def state(self) -> str:
        """What became of the specimen: its status, or ``unusable`` where numbers were measured that are not its own."""
        return "unusable" if self.status != "failed" and self.method and not self.usable else self.status


def index_row(result: Result) -> IndexRow:
    """Row of one result, without its report."""
    told, found = result.answer, result.diagnosis.causes if result.diagnosis else []
    curve, levels = told.curve, ("error", "warning")
    worst = next((f for level in levels for f in result.findings if f.level == level), None)
    low, high = curve.ends() if curve else (None, None)
    return IndexRow(
        id=result.specimen.id,
        type=result.specimen.description.get("type", ""),
        status=result.status,
        verdict=result.diagnosis.verdict if result.diagnosis else "none",
        causes=tuple(cause.name for cause in found),
        twins=tuple(dict.fromkeys(name for cause in found for name in cause.class_ if name != cause.name)),
        usable=told.usable,
        fault=None if told.usable else told.said,
        method=told.method or "",
        low=low,
        high=high,
        pre_curvature=None if curve is None else (curve.pre_curvature, curve.pre_curvature_std),
        rms_relative=result.agreement.rms_relative if result.agreement else None,
        compatible=result.agreement.compatible if result.agreement else None,
        photos_used=sum(photo.status == "traced" for photo in result.photos),
        photos_given=len(result.photos),
        warnings=sum(f.level == "warning" for f in result.findings),
        errors=sum(f.level == "error" for f in result.findings),
        worst="" if worst is None else worst.code,
        reason=None if worst is None else worst.said,
        shapes=_shapes(result),
        curve=None if curve is None else thinned(curve, POINTS),
    )


POINTS = 24
"""Of a characteristic kept in the index; a spline of few control points needs no more."""


def thinned(curve: Visited, points: int) -> RowCurve:
    """The curve interpolated to so many points."""
    grid = np.linspace(curve.kappa[0], curve.kappa[-1], points)
    columns = [np.interp(grid, curve.kappa, column) for column in curve.factor.T]
    # F F^T is all that is asked for: a square tells it, and most curves have more columns
    square = np.vstack([np.zeros((points, points)), *columns])
    return RowCurve(
        kappa=grid,
        tangent=np.interp(grid, curve.kappa, curve.tangent),
        tangent_std=np.interp(grid, curve.kappa, curve.tangent_std),
        factor=np.transpose(np.linalg.qr(square, mode="r")).astype(np.float32)[:, : points if columns else 0],
    )


def _shapes(result: Result) -> str:
    """SVG path of some of the measured shapes, steps evenly chosen."""
    traced = [photo for photo in result.photos if len(photo.x_m) > 1]
    width = max((max(photo.x_m) for photo in traced), default=0.0)
    if width <= 0.0:
        return ""
    scale = (SHAPE_SIZE[0] - 40) / width
    parts = []
    for place in sorted({round(i) for i in np.linspace(0, len(traced) - 1, min(SHAPES, len(traced)))}):
        photo = traced[place]
        at = np.linspace(0, len(photo.x_m) - 1, SHAPE_POINTS).round().astype(int)
        points = np.column_stack([20 + scale * np.array(photo.x_m)[at], 40 + scale * np.array(photo.y_m)[at]])
        points = np.clip(points, -9999, 9999).round().astype(int)
        steps = np.diff(points, axis=0).ravel().tolist()
        parts.append(f"M{points[0][0]} {points[0][1]}l{' '.join(map(str, steps))}")
    return "".join(parts)


def as_entry(row: IndexRow) -> dict[str, Any]:
    """The row as plain values for ``entry.json``, without what is around it; numbers to nine digits.

    But for the factor: most of a row, it is the base64 of its 32 bits a number, which is read ten times as fast.
    """
    plain = {name: value for name, value in asdict(row).items() if name not in ("curve", "report", "outlying")}
    curve = row.curve
    plain["curve"] = None if curve is None else {
        "range": digits([curve.kappa[0], curve.kappa[-1]], 9),
        "tangent": digits(curve.tangent, 9),
        "tangent_std": digits(curve.tangent_std, 9),
        "factor": b64encode(curve.factor.astype("<f4").tobytes()).decode(),
    }  # fmt: skip
    return {"version": ROW, **plain}


def from_entry(data: object) -> IndexRow:
    """The row of an entry; raises `ValueError` if it is none, or one of another version."""
    if not isinstance(data, dict) or data.get("version") != ROW:
        raise ValueError("no row of this version")
    try:
        return _adapter().validate_python({name: value for name, value in data.items() if name != "version"})
    except UNREADABLE as error:
        raise ValueError(f"no row: {error}") from error


@cache
def _adapter() -> TypeAdapter[IndexRow]:
    return TypeAdapter(IndexRow)


def _curve(data: Any) -> RowCurve | None:
    if data is None:
        return None
    low, high = data["range"]
    tangent, tangent_std = np.array([data["tangent"], data["tangent_std"]], dtype=float)
    factor = np.frombuffer(b64decode(data["factor"], validate=True), "<f4").reshape(tangent.size, -1)
    if tangent.size < 2 or not low < high or factor.shape[1] not in (0, tangent.size):
        raise ValueError("a curve of nothing, or numbers that are too few or many")
    if not all(np.isfinite(numbers).all() for numbers in (low, high, tangent, tangent_std, factor)):
        raise ValueError("numbers that are not finite")
    return RowCurve(np.linspace(low, high, tangent.size), tangent, tangent_std, factor)
