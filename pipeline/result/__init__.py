"""The result of one specimen: ``result.json`` as a typed record, and its published schema.

``result.json`` is at once the cache, the provenance record, the report's only source and what the Python API returns.
SI units; the unit stands in every name. Arrays are plain lists so that any program reads them. What is read is checked:
a file that is none, is cut off, or holds numbers nobody can measure is refused; fields nobody here knows are passed
over.
"""

from __future__ import annotations

from pipeline.result.answer import Answer, curves, leading, none_of_its_type, set_aside, trusted
from pipeline.result.diagnosed import (
    BlindSpot,
    CauseForm,
    CausePart,
    CauseRow,
    DiagnosisPart,
    ForceCorrectionPart,
    GainPart,
    HypothesisPart,
    LeftoverPart,
    NextExperiment,
    ResidualMap,
    TwinPart,
)
from pipeline.result.files import from_json, read_result, schema, to_json
from pipeline.result.parts import (
    AgreementPart,
    BalancePart,
    Curve,
    FindingPart,
    InversePart,
    KnotPart,
    MisfitPart,
    PhotoPart,
    PointwisePart,
    PreviewPart,
    ScalePart,
    SpecimenPart,
    StepPart,
    Widening,
)
from pipeline.result.visited import Visited, visited
from pipeline.result.whole import SCHEMA, Result

__all__ = [
    "SCHEMA",
    "AgreementPart",
    "Answer",
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
    "HypothesisPart",
    "InversePart",
    "KnotPart",
    "LeftoverPart",
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
    "TwinPart",
    "Visited",
    "Widening",
    "curves",
    "from_json",
    "leading",
    "none_of_its_type",
    "read_result",
    "schema",
    "set_aside",
    "to_json",
    "trusted",
    "visited",
]
