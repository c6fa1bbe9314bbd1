"""Stages' records to one `Result`: nothing is measured here, only put in its place and dated.

``Specimen, Traces, Identification, diagnosis -> Result``. The provenance holds all that a stranger needs to get the
same numbers again: versions of the program and its libraries, SHA-256 of every input, the settings, the command. Only
``provenance["clock"]`` differs between two runs over the same input.
"""

from __future__ import annotations

import base64
import datetime
import importlib.metadata
import platform
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from typing import Any, TypeVar

import numpy as np

from pipeline import __version__
from pipeline.identify import Identification, IdentificationParts, identification_parts
from pipeline.identify.parts import PhotoResidual
from pipeline.messages import Message
from pipeline.records import Centerline, Finding, LoadStep, Preview, Rejected, Specimen, Traces, said_once
from pipeline.result import (
    BalancePart,
    DiagnosisPart,
    FindingPart,
    InversePart,
    PhotoPart,
    PreviewPart,
    Result,
    ScalePart,
    SpecimenPart,
    Widening,
)
from pipeline.result.answer import OF_NO_CABLE
from pipeline.result.diagnosed import CAUSES_NAMED
from pipeline.result.headline import headline
from pipeline.rounding import digits
from pipeline.settings import Settings

PROGRAM = "cablebend"
LIBRARIES = ("numpy", "scipy", "pandas", "matplotlib", "opencv-python-headless", "scikit-image", "pydantic", "pillow")
SIGNIFICANT_DIGITS = 9  # of an array in result.json: finer than any error bar, a third of the size of full precision


def provenance(specimen: Specimen, settings: Settings, command: str) -> dict[str, Any]:
    """Versions, input hashes, settings and command; the clock under its own key."""
    return {
        "program": PROGRAM,
        "version": __version__,
        "python": platform.python_version(),
        "libraries": {name: importlib.metadata.version(name) for name in LIBRARIES},
        "inputs_sha256": specimen.hashes,
        # neither workers nor the language of a report change a result: the same numbers are the same bytes
        "settings": settings.model_dump(mode="json", exclude={"batch": True, "report": {"language"}}),
        "command": command or f"{PROGRAM} run {specimen.folder.absolute()} -o OUT",
        "clock": {"created_utc": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")},
    }


def assemble(
    specimen: Specimen,
    traces: Traces,
    identification: Identification,
    diagnosis: DiagnosisPart | None,
    *,
    findings: Iterable[Finding] = (),
    settings: Settings,
    command: str = "",
) -> Result:
    """Put everything measured on one specimen into its `Result`.

    Parameters
    ----------
    specimen, traces, identification
        The stages' records.
    diagnosis : DiagnosisPart or None
        None where a fault of the data makes the numbers none of the cable's.
    findings : iterable of Finding
        Faults of the data, and what the diagnosis noticed; those of the other stages are in their records.
    settings : Settings
    command : str
        The command that reproduces the result.
    """
    parts = identification_parts(identification)
    wider = None if diagnosis is None else diagnosis.widening
    fitted = parts.inverse.converged
    result = Result(
        status="measured" if fitted else "partial" if parts.balance.curve is not None else "failed",
        specimen=SpecimenPart(
            id=specimen.id,
            length_m=specimen.length_m,
            diameter_m=specimen.diameter_m,
            folder=str(specimen.folder),
            moving_bearing=specimen.rig.moving_bearing,
            description=specimen.description,
        ),
        scale=ScalePart(
            px_per_mm=traces.scale.px_per_m / 1e3,
            std_relative=traces.scale.std_relative,
            **ScalePart.told(traces.scale.source),
            axis_parallax_std=traces.axis_parallax_std,
        ),
        photos=photo_parts(specimen, traces, parts),
        steps=parts.steps,
        inverse=with_all_believed(parts.inverse, wider if fitted else None),
        balance=with_all_believed(parts.balance, None if fitted else wider),
        agreement=parts.agreement,
        diagnosis=diagnosis,
        findings=_gathered(specimen, traces, parts, list(findings), diagnosis),
        provenance=provenance(specimen, settings, command),
    )
    return result.model_copy(update={"answer_": result.answer.stored(), "headline": str(headline(result))})


Way = TypeVar("Way", InversePart, BalancePart)


def with_all_believed(part: Way, widening: Widening | None) -> Way:
    """The curve of the answer with all hypotheses of the diagnosis in its band."""
    if widening is None or part.curve is None or part.pre_curvature_std_per_m is None:
        return part
    more = float(np.linalg.norm(widening.pre_curvature_factor_per_m))
    rest = float(np.hypot(part.pre_curvature_std_per_m, more))
    return part.model_copy(update={"curve": widening.of(part.curve), "pre_curvature_std_per_m": rest})


OF_THE_DATA = {"identify/force-zero", "identify/chord-displacement", "identify/inverse-opposite-forces"}
"""What identification notices without a model."""


def without_advice(identified: Iterable[Finding], diagnosis: DiagnosisPart | None) -> list[Finding]:
    """Findings of identification: beside a curve with the cause, what both ways without it lead to is no warning."""
    if diagnosis is None or diagnosis.extended is None or diagnosis.verdict not in CAUSES_NAMED:
        return list(identified)
    lacking = Message("way.inverse-extended")
    return [
        one if one.code in OF_THE_DATA else Finding(one.code, "info", lacking if one.level == "error" else one.said)
        for one in identified
    ]


def _gathered(
    specimen: Specimen,
    traces: Traces,
    parts: IdentificationParts,
    diagnosed: Sequence[Finding],
    diagnosis: DiagnosisPart | None,
) -> list[FindingPart]:
    """Findings of all stages in their order, each fault told once."""
    photos, identified = photo_findings(traces.photos), without_advice(parts.findings, diagnosis)
    if traces.photos and all(isinstance(photo, Rejected) for photo in traces.photos):
        # that is why nothing is measured, not what both ways lack for it
        photos, identified = [replace(one, level="error") for one in photos], []
    if any(one.code in OF_NO_CABLE for one in (*specimen.findings, *diagnosed)):  # what follows from it is no warning
        identified = [replace(one, level="info") for one in identified]
    earlier = [*specimen.findings, *traces.findings, *photos, *identified]
    found = dict.fromkeys([*without_those_told_better(earlier, diagnosed), *diagnosed])  # two may have seen the same
    return [FindingPart.of(f.level, f.said, code=f.code) for f in found]


def photo_parts(specimen: Specimen, traces: Traces, parts: IdentificationParts) -> list[PhotoPart]:
    """One part per photo of the log: traced, rejected or missing."""
    outcomes = {photo.image: photo for photo in traces.photos}
    return [
        _photo_part(step, outcomes.get(step.image), parts.photos.get(step.step))
        for step in specimen.steps
        if step.image is not None
    ]


def photo_findings(photos: Iterable[Centerline | Rejected]) -> list[Finding]:
    """What was noticed on photos, and why some were refused; what is the same on several is said once, with names."""
    return said_once(
        (photo.image, finding)
        for photo in photos
        for finding in (photo.findings if isinstance(photo, Centerline) else [photo.finding])
    )


TOLD_BETTER = {
    "photo/doubled": {"photo/doubled"},
    "log/unit": {"scale/displacement"},
    "length/traced": {"scale/length", "identify/length", "identify/scale"},
    "length/other-cable": {"scale/length", "identify/length", "identify/scale"},
}
"""Faults of the data, and findings by which other rooms noticed the same without knowing what it is."""


def without_those_told_better(earlier: Iterable[Finding], faults: Iterable[Finding]) -> list[Finding]:
    """Earlier findings but for those that are told as faults."""
    named = set[str]().union(*(TOLD_BETTER.get(finding.code, set()) for finding in faults))
    return [finding for finding in earlier if finding.code not in named]


MEASURED = (
    *("chord_m", "chord_std_m", "traced_length_m", "traced_length_std_m", "width_m", "width_std_m"),
    *("left_px", "right_px", "mirrored"),
)
"""Of a centerline, as the result keeps it."""


def _photo_part(step: LoadStep, photo: Centerline | Rejected | None, residual: PhotoResidual | None) -> PhotoPart:
    image = str(step.image)
    if not isinstance(photo, Centerline):
        said = Message("photo/missing.part") if photo is None else photo.said
        return PhotoPart(
            image=image,
            step=step.step,
            status="missing" if photo is None else "rejected",
            code=said.code,
            **PhotoPart.told(said),
            preview=None if photo is None else _preview_part(photo.preview),
        )
    shape = photo.shape
    along = {"s_m": shape.s, "x_m": shape.x, "y_m": shape.y, "theta_rad": shape.theta, "kappa_per_m": shape.kappa}
    along |= {"u_px": photo.u_px, "v_px": photo.v_px, "kappa_std_per_m": photo.kappa_std}
    return PhotoPart(
        image=image,
        step=step.step,
        status="traced",
        **{name: getattr(photo, name) for name in MEASURED},
        **{name: digits(values, SIGNIFICANT_DIGITS) for name, values in along.items()},
        seen=shape.seen.tolist(),
        preview=_preview_part(photo.preview),
        **({} if residual is None else asdict(residual)),
    )


def _preview_part(preview: Preview | None) -> PreviewPart | None:
    if preview is None:
        return None
    return PreviewPart(
        jpeg_base64=base64.b64encode(preview.jpeg).decode(),
        width=preview.width,
        height=preview.height,
        reduction=preview.reduction,
        strip_base64=None if preview.strip is None else base64.b64encode(preview.strip).decode(),
    )
