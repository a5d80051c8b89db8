"""Faults of real renderers, as named changes of a program, a scene or an image."""
