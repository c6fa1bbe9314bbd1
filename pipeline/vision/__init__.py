"""From photos to arc-length-parametrised centerlines with curvature and true error bars.

`trace_series` measures all photos of a specimen, `trace_photo` a single one without scale.
"""

from pipeline.vision.series import trace_series
from pipeline.vision.single import trace_photo

__all__ = ["trace_photo", "trace_series"]
