"""Virtual experiments: a cable, a rig and a protocol in, a specimen folder with photos and force log out, truth apart.

`simulate_specimen` bends the cable with `rod`, `write_specimen` photographs and logs what any solver has bent,
`demo_specimen` makes the specimen of ``cablebend demo``. Every cause of the catalogue can be hidden in the data,
`pipeline.simulate.effects` says how. All chance comes from the experiment's seed.
"""

from pipeline.simulate.effects import EFFECTS, parse_effect
from pipeline.simulate.experiment import Experiment, State, bend, protocol
from pipeline.simulate.photography import Photography
from pipeline.simulate.specimen import Written, demo_specimen, simulate_specimen, write_specimen

__all__ = [
    "EFFECTS",
    "Experiment",
    "Photography",
    "State",
    "Written",
    "bend",
    "demo_specimen",
    "parse_effect",
    "protocol",
    "simulate_specimen",
    "write_specimen",
]
