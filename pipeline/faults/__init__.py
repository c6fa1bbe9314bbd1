"""What is wrong with the data, found once, before both ways: units, signs, order of photos, doubled ones, stuck forces.

A fault is put right where that is certain, or its datum left out, and told once with its size. Faults that only a
fitted model shows (a break in the forces, one photo against all others) are added by the diagnosis.
"""

from pipeline.faults.input import faults_of_input
from pipeline.faults.record import Faults, ForceCorrection

__all__ = ["Faults", "ForceCorrection", "faults_of_input"]
