"""Opaque meshes: their targets, and how they meet the volume."""
