"""The result of one specimen: ``result.json`` as a typed record, and its published schema.

``result.json`` is at once the cache, the provenance record, the report's only source and what the Python API returns.
SI units; the unit stands in every name. Arrays are plain lists so that any program reads them. What is read is checked:
a file that is none, is cut off, or holds numbers nobody can measure is refused; fields nobody here knows are passed
over.
"""

from __future__ import annotations

from pipeline.result.answer import Answer as Answer
from pipeline.result.answer import curves as curves
from pipeline.result.answer import leading as leading
from pipeline.result.answer import set_aside as set_aside
from pipeline.result.answer import trusted as trusted
from pipeline.result.diagnosed import BlindSpot as BlindSpot
from pipeline.result.diagnosed import CauseForm as CauseForm
from pipeline.result.diagnosed import CausePart as CausePart
from pipeline.result.diagnosed import CauseRow as CauseRow
from pipeline.result.diagnosed import DiagnosisPart as DiagnosisPart
from pipeline.result.diagnosed import ForceCorrectionPart as ForceCorrectionPart
from pipeline.result.diagnosed import GainPart as GainPart
from pipeline.result.diagnosed import HypothesisPart as HypothesisPart
from pipeline.result.diagnosed import LeftoverPart as LeftoverPart
from pipeline.result.diagnosed import NextExperiment as NextExperiment
from pipeline.result.diagnosed import ResidualMap as ResidualMap
from pipeline.result.diagnosed import TwinPart as TwinPart
from pipeline.result.files import from_json as from_json
from pipeline.result.files import read_result as read_result
from pipeline.result.files import schema as schema
from pipeline.result.files import to_json as to_json
from pipeline.result.parts import AgreementPart as AgreementPart
from pipeline.result.parts import BalancePart as BalancePart
from pipeline.result.parts import Curve as Curve
from pipeline.result.parts import FindingPart as FindingPart
from pipeline.result.parts import InversePart as InversePart
from pipeline.result.parts import KnotPart as KnotPart
from pipeline.result.parts import MisfitPart as MisfitPart
from pipeline.result.parts import PhotoPart as PhotoPart
from pipeline.result.parts import PointwisePart as PointwisePart
from pipeline.result.parts import PreviewPart as PreviewPart
from pipeline.result.parts import ScalePart as ScalePart
from pipeline.result.parts import SpecimenPart as SpecimenPart
from pipeline.result.parts import StepPart as StepPart
from pipeline.result.parts import Widening as Widening
from pipeline.result.visited import Visited as Visited
from pipeline.result.visited import visited as visited
from pipeline.result.whole import SCHEMA as SCHEMA
from pipeline.result.whole import Result as Result
