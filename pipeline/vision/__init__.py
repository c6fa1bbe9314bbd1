"""From photos to arc-length-parametrised centerlines with curvature and true error bars."""
