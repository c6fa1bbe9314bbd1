"""Experiments not yet made: what they could show, and which one comes next."""
