"""What the simulation gets wrong, which cause explains it, and what is gained by extending the model."""
