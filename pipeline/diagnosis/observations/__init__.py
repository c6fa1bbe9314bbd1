"""What was observed and what a model predicts for it: circumstances, simulation, noise, whitened residuals."""
