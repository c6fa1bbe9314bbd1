"""The catalogue of causes, one small file a family. A new cause is one new class in the list below, nothing else.

``pre_curvature`` is part of the base model and therefore no candidate; see `pipeline.diagnosis.rediscovery` for where
it is one.
"""

from __future__ import annotations

from pipeline.diagnosis.causes.bow import OutOfPlaneBow
from pipeline.diagnosis.causes.camera import CameraTilt, LensDistortion, ScaleError
from pipeline.diagnosis.causes.law import Hysteresis, NonlinearStiffness, PlasticSet, StiffnessDrift
from pipeline.diagnosis.causes.load_cell import ForceDrift, ForceGain, ForceOffset, Relaxation
from pipeline.diagnosis.causes.profile import PreCurvatureVarying, StiffnessVarying
from pipeline.diagnosis.causes.rig import (
    BearingFriction,
    BearingStiffness,
    DisplacementOffset,
    InPlaneLoad,
    LengthError,
    RigCompliance,
    RigidEnds,
)
from rod.inverse.cause import Cause, Variant

__all__ = ["CATALOGUE", "SUSPECTS", "Cause", "Variant"]

CATALOGUE: tuple[Cause, ...] = (
    NonlinearStiffness(),
    PreCurvatureVarying(),
    StiffnessVarying(),
    Hysteresis(),
    PlasticSet(),
    Relaxation(),
    BearingFriction(),
    BearingStiffness(),
    RigidEnds(),
    RigCompliance(),
    DisplacementOffset(),
    LengthError(),
    ForceOffset(),
    ForceDrift(),
    ForceGain(),
    InPlaneLoad(),
    ScaleError(),
    LensDistortion(),
    CameraTilt(),
    OutOfPlaneBow(),
    StiffnessDrift(),
)

SUSPECTS: tuple[Cause, ...] = tuple(cause for cause in CATALOGUE if not isinstance(cause, NonlinearStiffness))
"""What may be wrong about a cable whose law has any form; the form itself is asked for in the paper's own two steps."""
