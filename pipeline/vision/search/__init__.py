"""What on a photo could be the cable: what stands out of the ground, strips, their flanks, cross-cuts, ends."""
