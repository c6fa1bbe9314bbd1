"""Mechanics of a planar Cosserat rod in a bending test: numpy and scipy only, no files, photos, plots or clocks."""
