"""The parts of a result: what ``result.json`` holds, by name and unit.

The parts fixed by the contract (schema, specimen, answer, photos, inverse, balance, agreement, diagnosis, findings,
provenance) keep their names; more stands beside them.
"""

from __future__ import annotations

from enum import Enum
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from pipeline.messages import UNREADABLE, Message, ended, free_text
from pipeline.records import Level

# Nothing measured comes near it, and its square and cube are numbers still.
Number = Annotated[float, Field(ge=-1e30, le=1e30)]
Floats = list[Number]


def check_one_length(part: BaseModel, needed: tuple[str, ...], optional: tuple[str, ...] = ()) -> None:
    """Refuse lists of a part that differ in length; optional ones may be empty.

    Raises `ValueError` with the lengths.
    """
    lengths = {name: len(getattr(part, name)) for name in (*needed, *optional)}
    if len({lengths[name] for name in lengths if name in needed or lengths[name]}) > 1:
        raise ValueError(f"lists of different lengths: {', '.join(f'{n} {count}' for n, count in lengths.items())}")


class Part(BaseModel):
    """Base of all parts: frozen; keys it does not know are passed over; NaN is null, written by whoever fills it."""

    model_config = ConfigDict(
        frozen=True,
        extra="ignore",
        allow_inf_nan=False,
        populate_by_name=True,
        json_schema_extra={"additionalProperties": True},
    )


class SaidPart(Part):
    """A sentence as data, so that it can be said in any language; beside it stands its English text."""

    TEXT: ClassVar[str] = "message"

    key: str = Field("", description="which sentence of the catalogue; empty where only its English text is known")
    values: dict[str, Any] = Field(
        {}, description="what stands in the sentence, by name; SI units, and further sentences as key and values"
    )

    @classmethod
    def told(cls, said: Message) -> dict[str, Any]:
        """The fields of the part that hold what is said."""
        return {cls.TEXT: str(said), **said.stored()}

    @property
    def said(self) -> Message:
        """What is said, to be told in any language; its English text where the catalogue does not know it."""
        try:
            return Message.read({"key": self.key, "values": self.values})
        except UNREADABLE:
            return free_text(str(getattr(self, self.TEXT)))


class SpecimenPart(Part):
    """The cable and the rig, as given."""

    id: str = Field(description="name of the specimen, that of its folder unless specimen.toml says otherwise")
    length_m: Number | None = Field(
        None, description="of the cable between the bearing axes, m; null if specimen.toml could not be read"
    )
    diameter_m: Number | None = Field(None, description="outer diameter of the cable, m")
    folder: str = Field(description="where it was measured")
    moving_bearing: str = Field("", description="the one that is pushed: left or right")
    description: dict[str, str] = Field({}, description="free texts of specimen.toml, such as its type")


class PreviewPart(Part):
    """Reduced photo for the report: base64 JPEG; displayed px = preview px * reduction."""

    jpeg_base64: str = Field(description="the reduced photo, JPEG in base64")
    width: int = Field(description="of the preview, px")
    height: int = Field(description="of the preview, px")
    reduction: Number = Field(description="displayed px of the photo in one px of the preview")
    strip_base64: str | None = Field(None, description="the cable straightened along its centerline, JPEG in base64")


class PhotoPart(SaidPart):
    """One photo: traced (with its centerline) or rejected (with the reason)."""

    TEXT = "reason"

    image: str = Field(description="file name within the specimen's folder")
    step: int = Field(description="number of its step in the log")
    status: Literal["traced", "rejected", "missing"] = Field(
        description="traced, rejected (the reason says why) or missing (named in the log, not in the folder)"
    )
    reason: str | None = Field(None, description="why it was not traced")
    code: str | None = Field(None, description="of the reason, for `cablebend explain`")
    chord_m: Number | None = Field(None, description="distance of the bearing axes on the photo, m")
    chord_std_m: Number | None = Field(None, description="its standard deviation, m")
    traced_length_m: Number | None = Field(None, description="length of the centerline between the bearing axes, m")
    traced_length_std_m: Number | None = Field(None, description="its standard deviation, m")
    width_m: Number | None = Field(None, description="width of the cable on the photo, m")
    width_std_m: Number | None = Field(None, description="its standard deviation, m")
    left_px: tuple[Number, Number] | None = Field(
        None, description="left bearing axis, px of the photo as displayed; (0, 0) is the centre of its top-left pixel"
    )
    right_px: tuple[Number, Number] | None = Field(None, description="right bearing axis, px as left_px")
    mirrored: bool | None = Field(None, description="true if y points up on the photo, against its rows")
    s_m: Floats = Field([], description="arc length from the left bearing axis, m")
    x_m: Floats = Field([], description="along the chord from the left bearing axis, m")
    y_m: Floats = Field([], description="across the chord toward the bow, m")
    u_px: Floats = Field([], description="column in the photo as displayed, px")
    v_px: Floats = Field([], description="row in the photo as displayed, px")
    theta_rad: Floats = Field([], description="angle of the tangent from the chord toward the bow, rad")
    kappa_per_m: Floats = Field([], description="curvature, 1/m, positive in the direction of the bow")
    kappa_std_per_m: Floats = Field([], description="its standard deviation, 1/m")
    seen: list[bool] = Field([], description="false where the cable was hidden and its centerline was continued")
    kappa_fit_per_m: Floats = Field([], description="curvature of the fitted simulation at s_m, 1/m")
    shape_residual_m: Floats = Field([], description="measured minus simulated position along the normal at s_m, m")
    shape_residual_std_m: Floats = Field(
        [], description="its standard deviation, m: photo noise, correlated; axes apart"
    )
    preview: PreviewPart | None = Field(None, description="reduced picture, sizes in px; null if it cannot be read")

    @model_validator(mode="after")
    def _whole(self) -> Self:
        places = ("s_m", "x_m", "y_m", "u_px", "v_px", "theta_rad", "kappa_per_m", "kappa_std_per_m", "seen")
        check_one_length(self, places, ("kappa_fit_per_m", "shape_residual_m", "shape_residual_std_m"))
        return self


class ScalePart(SaidPart):
    """Scale of the photos and where it came from; `axis_parallax_std` as in `pipeline.records.Traces`."""

    TEXT = "source"

    px_per_mm: Number = Field(description="pixels of a photo in one millimetre, at the height of the cable's axis")
    std_relative: Number = Field(description="its standard deviation over itself, common to all photos")
    source: str = Field(description="where it came from, in words")
    axis_parallax_std: Number = Field(
        0.0, description="standard deviation of the relative distance by which bearing covers are seen too far apart"
    )


class StepPart(Part):
    """One displacement step: measured and simulated force."""

    step: int = Field(description="number in the log")
    branch: str = Field(description="mounted, loading or unloading")
    displacement_m: Number = Field(description="of the pushed bearing toward the other, m")
    force_N: Number = Field(description="mean of the hold, N, positive in compression")
    force_std_N: Number = Field(description="its standard deviation, N")
    force_fit_N: Number | None = Field(
        None, description="of the fitted simulation, N; see residuals_after for the extended model"
    )
    image: str | None = Field(None, description="its photo; null without one")


class Curve(Part):
    """A characteristic on a grid: moment and both readings with pointwise 1-sigma bands, on the visited range."""

    kappa_per_m: Floats = Field(description="curvature, increasing, 1/m")
    moment_Nm: Floats = Field(description="bending moment, N m")
    moment_std_Nm: Floats = Field(description="its standard deviation, N m")
    tangent_Nm2: Floats = Field(description="bending stiffness f_EI = dm/dkappa, N m^2")
    tangent_std_Nm2: Floats = Field(description="its standard deviation, N m^2")
    secant_Nm2: Floats = Field(description="moment over the bend from rest, m / (kappa - K0), N m^2")
    secant_std_Nm2: Floats = Field(description="its standard deviation, N m^2")
    supported: list[bool] = Field(
        description="whether the cable was bent to this curvature on any photo; nothing is known elsewhere"
    )
    tangent_factor_Nm2: list[Floats] = Field(
        [], description="F (n, r) in N m^2, F F^T is the covariance of tangent_Nm2 along the grid; empty if not known"
    )
    pre_curvature_factor_per_m: Floats = Field(
        [], description="g (r,) in 1/m, F g is the covariance of tangent_Nm2 with the pre-curvature; empty if not known"
    )

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if any(high <= low for low, high in pairwise(self.kappa_per_m)):
            raise ValueError("kappa_per_m does not increase")
        if len({len(row) for row in self.tangent_factor_Nm2}) > 1:
            raise ValueError("tangent_factor_Nm2 has rows of different lengths")
        factor, rest = "tangent_factor_Nm2", self.pre_curvature_factor_per_m
        if rest and self.tangent_factor_Nm2 and len(rest) != len(self.tangent_factor_Nm2[0]):
            raise ValueError("pre_curvature_factor_per_m has not the length of the rows of tangent_factor_Nm2")
        along = set(Curve.model_fields) - {factor, "pre_curvature_factor_per_m"}
        check_one_length(self, tuple(sorted(along)), (factor,))
        return self


class Widening(Part):
    """How much wider the band of the answer is than its own fit tells: for weak causes and for what nobody knows."""

    kappa_per_m: Floats = Field(description="curvature, increasing, 1/m")
    tangent_factor: list[Floats] = Field(
        description="F (n, r), relative: F F^T is the covariance of the logarithm of tangent_Nm2 that is added"
    )
    pre_curvature_factor_per_m: Floats = Field(description="g (r,) in 1/m: the same for the pre-curvature")

    def of(self, curve: Curve) -> Curve:
        """A curve with the wider band.

        At fixed curvature an error df of the tangent and dK0 of the pre-curvature are an error of the moment of
        ``-f(K0) dK0 + integral of df``.
        """
        kappa, tangent = np.array(curve.kappa_per_m), np.array(curve.tangent_Nm2)
        relative = [np.interp(kappa, self.kappa_per_m, column) for column in np.array(self.tangent_factor).T]
        by_f = tangent[:, None] * np.column_stack(relative)
        by_rest = np.array(self.pre_curvature_factor_per_m)
        rise = np.cumsum(np.diff(kappa)[:, None] * (by_f[1:] + by_f[:-1]) / 2.0, axis=0)
        by_m = np.vstack([np.zeros_like(by_rest), rise]) - tangent[0] * by_rest
        tangent_std, moment_std = (
            np.hypot(std, np.linalg.norm(more, axis=1))
            for std, more in ((curve.tangent_std_Nm2, by_f), (curve.moment_std_Nm, by_m))
        )
        bend = np.array(curve.moment_Nm) / curve.secant_Nm2
        far = bend > 1e-3 * bend.max()  # at rest the secant is the tangent, and so is its band
        secant_std = np.where(far, moment_std / np.where(far, bend, 1.0), tangent_std)
        whole = {"tangent_std_Nm2": tangent_std, "moment_std_Nm": moment_std, "secant_std_Nm2": secant_std}
        update: dict[str, Any] = {name: values.tolist() for name, values in whole.items()}
        if curve.tangent_factor_Nm2:
            update["tangent_factor_Nm2"] = np.hstack([curve.tangent_factor_Nm2, by_f]).tolist()
            update["pre_curvature_factor_per_m"] = [*curve.pre_curvature_factor_per_m, *by_rest.tolist()]
        return curve.model_copy(update=update)


class KnotPart(Part):
    """A point of the fitted law, tangent reading."""

    kappa_per_m: Number = Field(description="curvature, 1/m")
    tangent_Nm2: Number = Field(description="f_EI there, N m^2")
    std_Nm2: Number = Field(description="its standard deviation, N m^2")


class MisfitPart(Part):
    """How well the fitted simulation explains the data: what it leaves, in units and in standard deviations."""

    force_rmse_N: Number = Field(description="measured minus simulated force, root mean square, N")
    shape_rmse_m: Number = Field(description="measured minus simulated position, root mean square, m")
    chi2: Number = Field(description="sum of squares of all residuals in standard deviations")
    degrees_of_freedom: Number = Field(description="what chi2 is expected to be")


class WayPart(SaidPart):
    """One of the two ways to f_EI: how it ended, and where it leads."""

    TEXT = "advice"

    outcome: str = Field(description="how it ended")
    advice: str = Field("", description="what that means and what to do")
    pre_curvature_per_m: Number | None = Field(None, description="K0, curvature at rest, 1/m")
    pre_curvature_std_per_m: Number | None = Field(None, description="its standard deviation, 1/m")
    supported_per_m: tuple[Number, Number] | None = Field(None, description="curvatures visited, from and to, 1/m")
    curve: Curve | None = Field(None, description="f_EI and moment on a grid")

    @classmethod
    def ending(cls, outcome: Enum) -> dict[str, Any]:
        """The fields that hold how it ended."""
        return {"outcome": outcome.name.lower(), **cls.told(ended(outcome))}


class InversePart(WayPart):
    """Way one: simulate the experiment and fit."""

    reading: Literal["tangent"] = Field("tangent", description="f_EI is dm/dkappa")
    converged: bool = Field(description="whether the fit is to be trusted")
    knots: list[KnotPart] = Field([], description="points of f_EI along the fitted law")
    misfit: MisfitPart | None = Field(None, description="how well the simulation explains the data")
    nuisance: dict[str, tuple[Number, Number]] = Field({}, description="fitted value and std, e.g. scale, length")
    branches: dict[str, Curve] = Field({}, description="loading and unloading fitted apart")


class PointwisePart(Part):
    """The paper's (kappa, f_EI)-graph of one photo, Eq. (14) point by point."""

    step: int = Field(description="number in the log")
    kappa_per_m: Floats = Field(description="curvature, 1/m")
    tangent_Nm2: Floats = Field(description="dm/dkappa at each point, N m^2")


class BalancePart(WayPart):
    """Way two: balance equations, no simulation."""

    points_kappa_per_m: Floats = Field([], description="curvature of points along the photos, 1/m")
    points_moment_Nm: Floats = Field([], description="their moment by statics, force times y, N m")
    pointwise: list[PointwisePart] = Field([], description="the paper's graph, photo by photo")
    checks: dict[str, Number] = Field({}, description="left against right half, photo against photo: z or p")


class AgreementPart(Part):
    """Both ways compared as the same quantity on the range both visited."""

    quantity: Literal["tangent"] = Field("tangent", description="what both ways are compared as")
    rms_relative: Number | None = Field(None, description="root mean square difference of f_EI over f_EI")
    max_relative: Number | None = Field(None, description="largest difference of f_EI over f_EI")
    compatible: bool | None = Field(None, description="whether their bands allow the difference; null if not tested")
    p_value: Number | None = Field(None, description="probability of a difference as large as this by chance")
    level: Number = Field(0.05, description="p value below which they are said to disagree")
    range_per_m: tuple[Number, Number] | None = Field(None, description="curvatures compared, from and to, 1/m")
    pre_curvature: dict[str, tuple[Number, Number]] = Field({}, description="K0 and std: photo, balance, inverse")
    hints: list[str] = Field([], description="what the way they differ points to")


Method = Literal["extended", "inverse", "balance"]


class AnswerPart(SaidPart):
    """Which of the curves is the result, why, and whether a fault of the data makes it none of the cable's."""

    TEXT = "reason"

    method: Method | None = Field(None, description="which curve: extended, inverse or balance; null without any")
    usable: bool = Field(description="false where a fault of the data makes the numbers none of the cable's")
    reason: str = Field(description="why it is this curve, or why not usable")
    pre_curvature_per_m: Number | None = Field(None, description="K0 of that curve, 1/m")
    pre_curvature_std_per_m: Number | None = Field(None, description="its standard deviation, 1/m")


class FindingPart(SaidPart):
    """Something a reader must know."""

    code: str = Field(description="what it is, for `cablebend explain CODE`")
    level: Level = Field(description="error, warning or info")
    message: str = Field(description="one sentence for people")

    @classmethod
    def of(cls, level: Level, said: Message, *, code: str = "") -> FindingPart:
        """The part for something said; its code is that of the message unless another is given."""
        return cls(code=code or said.code, level=level, **cls.told(said))
