"""Virtual experiments: a cable, a rig and a protocol in, a specimen folder with photos and force log out, truth apart.

`simulate_specimen` bends the cable with `rod`, `write_specimen` photographs and logs what any solver has bent,
`demo_specimen` makes the specimen of ``cablebend demo``. Every cause of the catalogue can be hidden in the data,
`pipeline.simulate.effects` says how. All chance comes from the experiment's seed.
"""

from pipeline.simulate.effects import EFFECTS as EFFECTS
from pipeline.simulate.effects import parse_effect as parse_effect
from pipeline.simulate.experiment import Experiment as Experiment
from pipeline.simulate.experiment import State as State
from pipeline.simulate.experiment import bend as bend
from pipeline.simulate.experiment import protocol as protocol
from pipeline.simulate.photography import Photography as Photography
from pipeline.simulate.specimen import Written as Written
from pipeline.simulate.specimen import demo_specimen as demo_specimen
from pipeline.simulate.specimen import simulate_specimen as simulate_specimen
from pipeline.simulate.specimen import write_specimen as write_specimen
