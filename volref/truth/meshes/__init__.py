"""Meshes: what rays meet of them, opaque, transparent or cut open, and the volume between their layers."""
