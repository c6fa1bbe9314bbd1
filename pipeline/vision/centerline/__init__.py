"""From a cable found to a pixel to its centerline: edges, midline, path, curvature spline with covariance."""
