"""From photos to arc-length-parametrised centerlines with curvature and true error bars.

`series.trace_series` measures all photos of a specimen, `single.trace_photo` a single one without scale. Nothing is
imported here: who only reads a photo needs no fit.
"""
