"""Meshes for tests and benchmarks."""

import numpy as np

from volref.scene.mesh import Mesh


def bumpy_sphere(triangles, bump=0.15, center=(0.0, 0.0, 0.0), radius=1.0, **options):
    """Return a closed bumpy sphere of about `triangles` triangles, by latitude and longitude."""
    rows = int(np.sqrt(triangles / 4))
    polar, azimuth = np.meshgrid(
        np.linspace(0.001, np.pi - 0.001, rows + 1), np.arange(2 * rows) / rows * np.pi, indexing="ij"
    )
    r = radius * (1 + bump * np.sin(5 * polar) * np.sin(7 * azimuth))
    flat = np.sin(polar)
    points = np.stack([r * flat * np.cos(azimuth), r * flat * np.sin(azimuth), r * np.cos(polar)], axis=-1)
    i, j = np.meshgrid(np.arange(rows), np.arange(2 * rows), indexing="ij")
    corner, beside = i * 2 * rows + j, i * 2 * rows + (j + 1) % (2 * rows)
    below, below_beside = corner + 2 * rows, beside + 2 * rows
    faces = np.concatenate(
        [
            np.stack([corner, below, beside], axis=-1).reshape(-1, 3),
            np.stack([beside, below, below_beside], axis=-1).reshape(-1, 3),
        ]
    )
    return Mesh(points.reshape(-1, 3) + center, faces, **options)
