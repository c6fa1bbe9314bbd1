"""The specimen of ``cablebend demo``: a cable nobody has measured, photographed with known truth, from a seed.

The cable, its pre-curvature, the camera's roll and the print on the sheath differ from seed to seed within what is
usual on such a rig; nothing is hidden in it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.simulate.experiment import Experiment, protocol
from pipeline.simulate.photography import Photography
from pipeline.simulate.specimen import Written, simulate_specimen


def demo_specimen(folder: Path, seed: int = 0, *, truth_file: Path | None = None) -> Written:
    """Simulate and photograph a mounted cable and six loading steps; a few seconds.

    Parameters
    ----------
    folder : Path
    seed : int
        Chooses cable, camera and noise.
    truth_file : Path or None
        See `pipeline.simulate.specimen.write_specimen`.
    """
    rng = np.random.default_rng([seed, 2])
    length = rng.uniform(0.17, 0.21)
    EI0 = float(np.exp(rng.uniform(np.log(4e-3), np.log(4e-2))))
    experiment = Experiment(
        id=folder.name,
        length_m=round(length, 4),
        diameter_m=round(rng.uniform(0.0042, 0.0062), 4),
        EI0=EI0,
        EI1=EI0 * rng.uniform(0.3, 0.6),
        kc=rng.uniform(3.5, 6.0),
        K0=rng.uniform(1.0, 2.5),
        displacements_m=protocol("loading", 6, round(0.0125 * length, 4)),
        seed=seed,
    )
    photography = Photography(roll_rad=rng.uniform(-0.02, 0.02))
    printed = replace(photography.sheath, text=f"CABLEBEND DEMO {seed:04d}", text_pitch=30.0)
    return simulate_specimen(
        folder, experiment, photography=replace(photography, sheath=printed), truth_file=truth_file
    )
