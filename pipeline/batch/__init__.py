"""Many specimens: `pipeline.run` around each folder, in processes of this machine or on a cluster.

`orders` says what is measured and under which name, `specimen` measures one folder and stores it, `batch` hands
specimens to `processes` of this machine or to a dask `cluster`, `store` owns the folder of results.
"""

from __future__ import annotations

from pipeline.batch.batch import Tally, redraw, run_batch
from pipeline.batch.specimen import Outcome
from pipeline.batch.store import Store

__all__ = ["Outcome", "Store", "Tally", "redraw", "run_batch"]
