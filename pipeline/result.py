"""The result of one specimen: ``result.json`` as a typed record, and its published schema.

``result.json`` is at once the cache, the provenance record, the report's only source and what the Python API returns.
SI units; the unit stands in every name. Arrays are plain lists so that any program reads them.
The parts fixed by the contract (schema, specimen, photos, inverse, balance, agreement, diagnosis, findings, provenance)
keep their names; more stands beside them.
"""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from pipeline.errors import InputError
from pipeline.rounding import rounded

Floats = list[float]


class Part(BaseModel):
    """Base of all parts: frozen, no unknown keys, NaN and infinity written as null by whoever fills it."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True)


class SpecimenPart(Part):
    """The cable and the rig, as given."""

    id: str
    length_m: float | None = Field(None, description="None if specimen.toml could not be read")
    diameter_m: float | None = None
    folder: str
    moving_bearing: str = ""
    description: dict[str, str] = {}


class PreviewPart(Part):
    """Reduced photo for the report: base64 JPEG; displayed px = preview px * reduction."""

    jpeg_base64: str
    width: int
    height: int
    reduction: float
    strip_base64: str | None = None


class PhotoPart(Part):
    """One photo: traced (with its centerline) or rejected (with the reason)."""

    image: str
    step: int
    status: Literal["traced", "rejected", "missing"]
    reason: str | None = None
    code: str | None = None
    chord_m: float | None = None
    chord_std_m: float | None = None
    traced_length_m: float | None = None
    traced_length_std_m: float | None = None
    width_m: float | None = None
    width_std_m: float | None = None
    left_px: tuple[float, float] | None = None
    right_px: tuple[float, float] | None = None
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
    quality: dict[str, float] = {}
    preview: PreviewPart | None = None


class ScalePart(Part):
    """Scale of the photos and where it came from; `axis_parallax_std` as in `pipeline.records.Traces`."""

    px_per_mm: float
    std_relative: float
    source: str
    axis_parallax_std: float = 0.0


class StepPart(Part):
    """One displacement step: measured and simulated force."""

    step: int
    branch: str
    displacement_m: float
    force_N: float
    force_std_N: float
    force_fit_N: float | None = None
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


class KnotPart(Part):
    """A control point of the natural cubic spline, tangent reading."""

    kappa_per_m: float
    tangent_Nm2: float
    std_Nm2: float


class MisfitPart(Part):
    """How well the fitted simulation explains the data, in units and in sigma."""

    force_rmse_N: float
    shape_rmse_m: float
    curvature_rmse_per_m: float | None = None
    chi2: float
    degrees_of_freedom: float
    chi2_by_block: dict[str, tuple[float, float]] = Field({}, description="chi2 and number of data by block")


class InversePart(Part):
    """Way one: simulate the experiment and fit."""

    reading: Literal["tangent"] = "tangent"
    outcome: str
    advice: str = ""
    converged: bool
    iterations: int = 0
    pre_curvature_per_m: float | None = None
    pre_curvature_std_per_m: float | None = None
    supported_per_m: tuple[float, float] | None = None
    knots: list[KnotPart] = []
    curve: Curve | None = None
    misfit: MisfitPart | None = None
    nuisance: dict[str, tuple[float, float]] = Field({}, description="fitted value and std, e.g. scale, length")
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
    pre_curvature_per_m: float | None = None
    pre_curvature_std_per_m: float | None = None
    supported_per_m: tuple[float, float] | None = None
    curve: Curve | None = None
    points_kappa_per_m: Floats = []
    points_moment_Nm: Floats = []
    pointwise: list[PointwisePart] = []
    checks: dict[str, float] = Field({}, description="left against right half, photo against photo: z or p")


class AgreementPart(Part):
    """Both ways compared as the same quantity on the range both visited."""

    quantity: Literal["tangent"] = "tangent"
    rms_relative: float | None = None
    max_relative: float | None = None
    compatible: bool | None = None
    p_value: float | None = None
    level: float = 0.05
    range_per_m: tuple[float, float] | None = None
    pre_curvature: dict[str, tuple[float, float]] = Field({}, description="K0 and std: photo, balance, inverse")
    hints: list[str] = []


class CauseForm(Part):
    """One form of a cause as it stands in the extended model: what a prediction needs of it."""

    label: str = Field("", description="in words, as it completes the cause's name")
    amount: float = Field(description="in the cause's unit")
    std: float
    at: float = Field(0.0, description="place in shares of the length, curvature in 1/m, time in s or direction")
    width: float = Field(
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
    probability: float
    estimate: float
    std: float
    unit: str
    forms: list[CauseForm] = Field([], description="of the extended model; several may act together")


class CauseRow(Part):
    """One row of the table of causes; see `pipeline.diagnosis`."""

    name: str
    z: float
    p_adjusted: float
    estimate: float
    std: float
    unit: str
    minimal_detectable: float | None = None
    surviving_fraction: float
    nearest_twin: str = ""
    twin_cosine: float = 0.0
    delta_chi2: float | None = None
    heldout_excess_removed: float | None = None
    stiffness_shift: float | None = None


class GainPart(Part):
    """What the extension bought, on steps it had not seen."""

    heldout_excess_removed: float
    ci95: tuple[float, float]
    force_rmse_N: tuple[float, float]
    shape_rmse_m: tuple[float, float]


class BlindSpot(Part):
    """A cause that cannot be seen here but would hurt."""

    name: str
    stiffness_bias_at_plausible_size: float
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
    shape_sigma: list[list[float | None]]
    force_sigma: list[float | None] = []
    shape_m: list[list[float | None]] = []
    force_N: list[float | None] = []
    chord_m: list[float | None] = []
    chord_sigma: list[float | None] = []
    displacement_m: list[float | None] = []
    chi2: dict[str, float] = Field({}, description="by kind of data: force, chord, shape")
    data: dict[str, int] = Field({}, description="number of data by kind")


class ForceCorrectionPart(Part):
    """Forces of some steps that were wrong together: shown = factor * force + offset; a finding says why."""

    steps: list[int]
    factor: float
    offset_N: float
    errors_N: list[list[float]] = Field(
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
    residuals_before: dict[str, Any] | None = Field(None, description="a `ResidualMap`")
    residuals_after: dict[str, Any] | None = None
    twins: dict[str, dict[str, float]] = Field({}, description="cosines of confusable causes")
    left_out_photos: list[int] = Field([], description="steps whose photo contradicts all else; a finding says why")
    left_out_forces: list[int] = Field([], description="steps whose force contradicts all else")
    corrected_forces: list[ForceCorrectionPart] = Field([], description="forces that both ways use as corrected")


class FindingPart(Part):
    """Something a reader must know."""

    code: str
    level: Literal["info", "warning", "error"]
    message: str


class Result(Part):
    """Everything measured on one specimen."""

    schema_: Annotated[Literal["cablebend/result/1"], Field(alias="schema")] = "cablebend/result/1"
    status: Literal["measured", "partial", "failed"]
    headline: str = ""
    specimen: SpecimenPart
    scale: ScalePart | None = None
    photos: list[PhotoPart] = []
    steps: list[StepPart] = []
    inverse: InversePart | None = None
    balance: BalancePart | None = None
    agreement: AgreementPart | None = None
    diagnosis: DiagnosisPart | None = None
    findings: list[FindingPart] = []
    provenance: dict[str, Any] = {}

    def _repr_html_(self) -> str:
        """Show the result in a notebook: what was found, each number with its standard deviation."""
        agreement = self.agreement.pre_curvature if self.agreement else {}
        rows = [(f"pre-curvature K0, {way}", rounded(value, std) + " 1/m") for way, (value, std) in agreement.items()]
        for way, part in (("inverse", self.inverse), ("balance", self.balance)):
            if part is not None and part.curve is not None and part.curve.kappa_per_m:
                rows += [(f"f_EI, {way}, at {kappa:.3g} 1/m", text) for kappa, text in _ends(part.curve)]
        if self.diagnosis is not None:
            rows.append((f"diagnosis: {self.diagnosis.verdict}", self.diagnosis.headline))
        rows += [(finding.level, finding.message) for finding in self.findings if finding.level != "info"]
        body = "".join(f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in rows)
        title = f"{self.specimen.id}: {self.status}" + (f". {self.headline}" if self.headline else "")
        return f"<table><caption>{escape(title)}</caption><tbody>{body}</tbody></table>"


def _ends(curve: Curve) -> list[tuple[float, str]]:
    """First and last supported point of a characteristic: curvature and tangent with its standard deviation."""
    points = [i for i, supported in enumerate(curve.supported) if supported]
    ends = (points[0], points[-1]) if points else ()
    return [
        (curve.kappa_per_m[i], rounded(1e3 * curve.tangent_Nm2[i], 1e3 * curve.tangent_std_Nm2[i]) + " mN m²")
        for i in ends
    ]


def to_json(result: Result) -> str:
    """Text of ``result.json``: contract names, no NaN, one line per top-level entry not guaranteed."""
    return result.model_dump_json(by_alias=True, indent=1)


def from_json(text: str) -> Result:
    """Read ``result.json`` back; raises ``pydantic.ValidationError`` for anything that is not one."""
    return Result.model_validate_json(text)


def read_result(path: Path | str) -> Result:
    """Read ``result.json``, or the one in a folder.

    Raises
    ------
    InputError
        ``result/unreadable`` if it cannot be read or is none.
    """
    file = Path(path) / "result.json" if Path(path).is_dir() else Path(path)
    try:
        return from_json(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        told = error.strerror.lower() if isinstance(error, OSError) and error.strerror else type(error).__name__
        raise InputError(
            f"is no readable result ({told})",
            path=file,
            code="result/unreadable",
            remedy="give a result.json that `cablebend run` wrote, or its folder",
        ) from error


def schema() -> dict[str, Any]:
    """JSON schema of ``result.json``, published as ``result.schema.json``."""
    return Result.model_json_schema(by_alias=True)
