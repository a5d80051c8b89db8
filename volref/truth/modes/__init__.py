"""Modes that reduce each ray to one value or one point: extremes, means, isosurfaces, slices."""
