"""Pixels to metres: the plane's map (tilt, lens), board photos, where the scale comes from, the chord frame."""
