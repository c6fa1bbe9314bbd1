"""The parts of a result: what ``result.json`` holds, by name and unit.

The parts fixed by the contract (schema, specimen, answer, photos, inverse, balance, agreement, diagnosis, findings,
provenance) keep their names; more stands beside them.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from pipeline.result.lists import Floats, Number, check_one_length


class Part(BaseModel):
    """Base of all parts: frozen; keys it does not know are passed over; NaN is null, written by whoever fills it."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False, populate_by_name=True)


class SpecimenPart(Part):
    """The cable and the rig, as given."""

    id: str
    length_m: Number | None = Field(None, description="None if specimen.toml could not be read")
    diameter_m: Number | None = None
    folder: str
    moving_bearing: str = ""
    description: dict[str, str] = {}


class PreviewPart(Part):
    """Reduced photo for the report: base64 JPEG; displayed px = preview px * reduction."""

    jpeg_base64: str
    width: int
    height: int
    reduction: Number
    strip_base64: str | None = None


class PhotoPart(Part):
    """One photo: traced (with its centerline) or rejected (with the reason)."""

    image: str
    step: int
    status: Literal["traced", "rejected", "missing"]
    reason: str | None = None
    code: str | None = None
    chord_m: Number | None = None
    chord_std_m: Number | None = None
    traced_length_m: Number | None = None
    traced_length_std_m: Number | None = None
    width_m: Number | None = None
    width_std_m: Number | None = None
    left_px: tuple[Number, Number] | None = None
    right_px: tuple[Number, Number] | None = None
    mirrored: bool | None = None
    s_m: Floats = []
    x_m: Floats = []
    y_m: Floats = []
    u_px: Floats = []
    v_px: Floats = []
    theta_rad: Floats = []
    kappa_per_m: Floats = []
    kappa_std_per_m: Floats = []
    seen: list[bool] = []
    kappa_fit_per_m: Floats = Field([], description="curvature of the fitted simulation at s_m")
    shape_residual_m: Floats = Field([], description="measured minus simulated position along the normal, at s_m")
    shape_residual_std_m: Floats = Field([], description="its standard deviation: photo noise, correlated")
    quality: dict[str, Number] = {}
    preview: PreviewPart | None = None

    @model_validator(mode="after")
    def _whole(self) -> Self:
        places = ("s_m", "x_m", "y_m", "u_px", "v_px", "theta_rad", "kappa_per_m", "kappa_std_per_m", "seen")
        check_one_length(self, places, ("kappa_fit_per_m", "shape_residual_m", "shape_residual_std_m"))
        return self


class ScalePart(Part):
    """Scale of the photos and where it came from; `axis_parallax_std` as in `pipeline.records.Traces`."""

    px_per_mm: Number
    std_relative: Number
    source: str
    axis_parallax_std: Number = 0.0


class StepPart(Part):
    """One displacement step: measured and simulated force."""

    step: int
    branch: str
    displacement_m: Number
    force_N: Number
    force_std_N: Number
    force_fit_N: Number | None = None
    image: str | None = None


class Curve(Part):
    """A characteristic on a grid: moment and both readings with pointwise 1-sigma bands, on the visited range."""

    kappa_per_m: Floats
    moment_Nm: Floats
    moment_std_Nm: Floats
    tangent_Nm2: Floats
    tangent_std_Nm2: Floats
    secant_Nm2: Floats
    secant_std_Nm2: Floats
    supported: list[bool]
    tangent_factor_Nm2: list[Floats] = Field(
        [], description="F (n, r) with F F^T the covariance of tangent_Nm2 along the grid; empty if not known"
    )

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if any(high <= low for low, high in pairwise(self.kappa_per_m)):
            raise ValueError("kappa_per_m does not increase")
        if len({len(row) for row in self.tangent_factor_Nm2}) > 1:
            raise ValueError("tangent_factor_Nm2 has rows of different lengths")
        factor = "tangent_factor_Nm2"
        check_one_length(self, tuple(name for name in Curve.model_fields if name != factor), (factor,))
        return self


class KnotPart(Part):
    """A control point of the natural cubic spline, tangent reading."""

    kappa_per_m: Number
    tangent_Nm2: Number
    std_Nm2: Number


class MisfitPart(Part):
    """How well the fitted simulation explains the data, in units and in sigma."""

    force_rmse_N: Number
    shape_rmse_m: Number
    curvature_rmse_per_m: Number | None = None
    chi2: Number
    degrees_of_freedom: Number
    chi2_by_block: dict[str, tuple[Number, Number]] = Field({}, description="chi2 and number of data by block")


class InversePart(Part):
    """Way one: simulate the experiment and fit."""

    reading: Literal["tangent"] = "tangent"
    outcome: str
    advice: str = ""
    converged: bool
    iterations: int = 0
    pre_curvature_per_m: Number | None = None
    pre_curvature_std_per_m: Number | None = None
    supported_per_m: tuple[Number, Number] | None = None
    knots: list[KnotPart] = []
    knots_chosen_by: str = ""
    curve: Curve | None = None
    misfit: MisfitPart | None = None
    nuisance: dict[str, tuple[Number, Number]] = Field({}, description="fitted value and std, e.g. scale, length")
    branches: dict[str, Curve] = Field({}, description="loading and unloading fitted apart")


class PointwisePart(Part):
    """The paper's (kappa, f_EI)-graph of one photo, Eq. (14) point by point."""

    step: int
    kappa_per_m: Floats
    tangent_Nm2: Floats


class BalancePart(Part):
    """Way two: balance equations, no simulation."""

    outcome: str
    advice: str = ""
    pre_curvature_per_m: Number | None = None
    pre_curvature_std_per_m: Number | None = None
    supported_per_m: tuple[Number, Number] | None = None
    curve: Curve | None = None
    points_kappa_per_m: Floats = []
    points_moment_Nm: Floats = []
    pointwise: list[PointwisePart] = []
    checks: dict[str, Number] = Field({}, description="left against right half, photo against photo: z or p")


class AgreementPart(Part):
    """Both ways compared as the same quantity on the range both visited."""

    quantity: Literal["tangent"] = "tangent"
    rms_relative: Number | None = None
    max_relative: Number | None = None
    compatible: bool | None = None
    p_value: Number | None = None
    level: Number = 0.05
    range_per_m: tuple[Number, Number] | None = None
    pre_curvature: dict[str, tuple[Number, Number]] = Field({}, description="K0 and std: photo, balance, inverse")
    hints: list[str] = []


class CauseForm(Part):
    """One form of a cause as it stands in the extended model: what a prediction needs of it."""

    label: str = Field("", description="in words, as it completes the cause's name")
    amount: Number = Field(description="in the cause's unit")
    std: Number
    at: Number = Field(0.0, description="place in shares of the length, curvature in 1/m, time in s or direction")
    width: Number = Field(
        0.0, description="of a spot, in shares of the length; of what a steep camera foreshortens its distance, m"
    )
    tuned: list[str] = Field([], description="which of `at` and `width` were fitted")
    factor: list[Floats] = Field(
        [],
        description="G (1 + tuned, r): with F of the extended curve, G F^T is the covariance of amount and form with f",
    )


class CausePart(Part):
    """A named cause with its class of twins, probability and estimate."""

    name: str
    class_: Annotated[list[str], Field(alias="class")] = []
    probability: Number
    estimate: Number
    std: Number
    unit: str
    forms: list[CauseForm] = Field([], description="of the extended model; several may act together")


class CauseRow(Part):
    """One row of the table of causes; see `pipeline.diagnosis`."""

    name: str
    z: Number
    p_adjusted: Number
    estimate: Number
    std: Number
    unit: str
    minimal_detectable: Number | None = None
    surviving_fraction: Number
    nearest_twin: str = ""
    twin_cosine: Number = 0.0
    delta_chi2: Number | None = None
    heldout_excess_removed: Number | None = None
    stiffness_shift: Number | None = None


class GainPart(Part):
    """What the extension bought, on steps it had not seen."""

    heldout_excess_removed: Number
    ci95: tuple[Number, Number]
    force_rmse_N: tuple[Number, Number]
    shape_rmse_m: tuple[Number, Number]


class BlindSpot(Part):
    """A cause that cannot be seen here but would hurt."""

    name: str
    stiffness_bias_at_plausible_size: Number
    settled_by: str


class NextExperiment(Part):
    """The cheapest measurement that separates what is confused."""

    what: str
    separates: list[str]


class ResidualMap(Part):
    """Residuals over arc length and step, in standard deviations; null where there is no photo or no force."""

    s_m: Floats
    steps: list[int]
    branches: list[str] = []
    shape_sigma: list[list[Number | None]]
    force_sigma: list[Number | None] = []
    shape_m: list[list[Number | None]] = []
    force_N: list[Number | None] = []
    chord_m: list[Number | None] = []
    chord_sigma: list[Number | None] = []
    displacement_m: list[Number | None] = []
    chi2: dict[str, Number] = Field({}, description="by kind of data: force, chord, shape")
    data: dict[str, int] = Field({}, description="number of data by kind")


# a simulation that found no equilibrium leaves an empty one
MapOrNone = Annotated[ResidualMap | None, BeforeValidator(lambda given: given or None)]


class ForceCorrectionPart(Part):
    """Forces of some steps that were wrong together: shown = factor * force + offset; a finding says why."""

    steps: list[int]
    factor: Number
    offset_N: Number
    errors_N: list[list[Number]] = Field(
        [], description="what the correction may be off by at each of the steps; a row is one standard deviation"
    )


class DiagnosisPart(Part):
    """What the simulation gets wrong, and why."""

    verdict: Literal["adequate", "named", "class", "two_causes", "unexplained", "underpowered"]
    headline: str
    causes: list[CausePart] = []
    table: list[CauseRow] = []
    gain: GainPart | None = None
    blind_spots: list[BlindSpot] = []
    next_experiment: NextExperiment | None = None
    extended: Curve | None = Field(None, description="f_EI identified again with the extended model")
    extended_refuted: bool = Field(
        False, description="whether the data refute the extended model, so that its curve is no answer"
    )
    leftover: dict[str, Any] | None = None
    residuals_before: MapOrNone = Field(None, description="of the fitted simulation")
    residuals_after: MapOrNone = Field(None, description="of the model extended by the causes")
    twins: dict[str, dict[str, Number]] = Field({}, description="cosines of confusable causes")
    left_out_photos: list[int] = Field([], description="steps whose photo contradicts all else; a finding says why")
    left_out_forces: list[int] = Field([], description="steps whose force contradicts all else")
    corrected_forces: list[ForceCorrectionPart] = Field([], description="forces that both ways use as corrected")


Method = Literal["extended", "inverse", "balance"]


class AnswerPart(Part):
    """Which of the curves is the result, why, and whether a fault of the data makes it none of the cable's."""

    method: Method | None = None
    usable: bool
    reason: str
    pre_curvature_per_m: Number | None = None
    pre_curvature_std_per_m: Number | None = None


class FindingPart(Part):
    """Something a reader must know."""

    code: str
    level: Literal["info", "warning", "error"]
    message: str
