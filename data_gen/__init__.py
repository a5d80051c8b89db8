"""Writes the made-up fields, meshes, storms and tables of `volref.phantoms` to files."""
