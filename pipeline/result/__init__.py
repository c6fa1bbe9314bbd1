"""The result of one specimen: ``result.json`` as a typed record, and its published schema.

``result.json`` is at once the cache, the provenance record, the report's only source and what the Python API returns.
SI units; the unit stands in every name. Arrays are plain lists so that any program reads them. What is read is checked:
a file that is none, is cut off, or holds numbers nobody can measure is refused; fields nobody here knows are passed
over.
"""

from __future__ import annotations

from pipeline.result.files import from_json, read_result, schema, to_json
from pipeline.result.parts import (
    AgreementPart,
    AnswerPart,
    BalancePart,
    BlindSpot,
    CauseForm,
    CausePart,
    CauseRow,
    Curve,
    DiagnosisPart,
    FindingPart,
    ForceCorrectionPart,
    GainPart,
    InversePart,
    KnotPart,
    MisfitPart,
    NextExperiment,
    PhotoPart,
    PointwisePart,
    PreviewPart,
    ResidualMap,
    Result,
    ScalePart,
    SpecimenPart,
    StepPart,
)

__all__ = [
    "AgreementPart",
    "AnswerPart",
    "BalancePart",
    "BlindSpot",
    "CauseForm",
    "CausePart",
    "CauseRow",
    "Curve",
    "DiagnosisPart",
    "FindingPart",
    "ForceCorrectionPart",
    "GainPart",
    "InversePart",
    "KnotPart",
    "MisfitPart",
    "NextExperiment",
    "PhotoPart",
    "PointwisePart",
    "PreviewPart",
    "ResidualMap",
    "Result",
    "ScalePart",
    "SpecimenPart",
    "StepPart",
    "from_json",
    "read_result",
    "schema",
    "to_json",
]
