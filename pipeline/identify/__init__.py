"""From traces and forces to the characteristic by two ways, and whether they agree.

Parts: `measured` (pixels and log to `rod.measurement.MeasuredTest`), `ways` (both ways, branches apart and together),
`agreement` (the same quantity compared with the joint uncertainty), `findings` (what a reader must know), `parts` (what
goes into ``result.json``).
"""

from pipeline.identify.identification import Identification
from pipeline.identify.measured import measured_test
from pipeline.identify.parts import IdentificationParts, identification_parts
from pipeline.identify.ways import identify, identify_test

__all__ = [
    "Identification",
    "IdentificationParts",
    "identification_parts",
    "identify",
    "identify_test",
    "measured_test",
]
