"""Draws the contact sheets of docs/gallery.md: `python -m data_gen.gallery`."""
