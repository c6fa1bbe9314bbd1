"""The type of all arrays of real numbers; their shapes and units are said where they are described."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
