"""Way one, and the engine of all fits: photos and forces to f_EI(K) and K0 by simulating the experiment (Sec. 4).

`estimate` is the inverse problem. Its parts serve the diagnosis too, which extends the model by causes:

data with weights   `observation` (noise, force_noise, common_errors, linearised)
model               `prediction`, `simulation`, `camera`; `laws`, `base`; `cause`, `extension`
fit                 `bending`, `sensitivities`, `step`, `fit`, `base_fit`
answer              `mean_law`, `gains`, `photo_fit`, `estimate`
"""

from rod.inverse.estimate import Estimate, InverseOutcome, estimate

__all__ = ["Estimate", "InverseOutcome", "estimate"]
