"""From photos to arc-length-parametrised centerlines with curvature and true error bars.

`trace_series` measures all photos of a specimen, `trace_photo` a single one without scale.
"""

from pipeline.vision.series import trace_photo, trace_series

__all__ = ["trace_photo", "trace_series"]
