"""Radars as maps, as volumes on a grid, and in motion."""
