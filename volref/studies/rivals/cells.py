"""Rivals that cut the ray at the faces of cells, between which the field is a cubic.

R rays, n pieces; positions are in padded index space, where faces lie at whole numbers.
"""

import numpy as np

from volref.arrays import Floats, Indices
from volref.studies.rivals.gauss import composite_pieces, gauss_pieces
from volref.studies.rivals.medium import Bundle, Integrator, Light, Medium
from volref.workspace import Workspace

# A piece is accepted below the part of the tolerance that its share of the ray earns it, or this part.
LEAST_SHARE = 1e-3

# A piece is halved at most this often: then it is 1e-12 of a cell long.
MOST_HALVINGS = 40

# A ray that moves less than this part of an index along an axis meets none of its faces.
PARALLEL = 1e-14


def cell_gauss(medium: Medium, parts: float, nodes: int) -> Integrator:
    """Integrate by Gauss-Legendre rules aligned with the cells, knots of the table ignored.

    Each cell's stretch of a ray is cut into as many equal `parts`, a whole number, usually 1.
    """

    def integrate(bundle: Bundle, work: Workspace) -> Light:
        ray, start, length = cell_pieces(bundle)
        part = np.arange(parts)
        start = (start[:, None] + part * (length / parts)[:, None]).ravel()
        ray, length = np.repeat(ray, len(part)), np.repeat(length / parts, len(part))
        depth, light = gauss_pieces(medium, bundle, ray, start, length, nodes, work)
        return composite_pieces(ray, depth, light, len(bundle.length), nodes * len(ray))

    return integrate


def halving(medium: Medium, tolerance: float, nodes: int) -> Integrator:
    """Integrate by halving each cell's part of a ray until it agrees with its halves (Novins and Arvo 1992).

    A piece is accepted, and its halves are kept, when opacity and light of the one and of the two differ by
    less than `tolerance` times its share of the ray.  Two rules that both miss a feature agree.
    """

    def integrate(bundle: Bundle, work: Workspace) -> Light:
        ray, start, length = cell_pieces(bundle)
        depth, light = gauss_pieces(medium, bundle, ray, start, length, nodes, work)
        samples = nodes * len(ray)
        done: list[tuple[Indices, Floats, Floats, Floats]] = []
        for halvings in range(MOST_HALVINGS + 1):
            half = length / 2
            front, front_light = gauss_pieces(medium, bundle, ray, start, half, nodes, work)
            back, back_light = gauss_pieces(medium, bundle, ray, start + half, half, nodes, work)
            samples += 2 * nodes * len(ray)
            both, both_light = front + back, front_light + np.exp(-front) * back_light
            off = np.maximum(np.abs(np.exp(-depth) - np.exp(-both)), np.abs(light - both_light).max(axis=0))
            allowed = tolerance * np.maximum(length / bundle.length[ray], LEAST_SHARE)
            good = (off <= allowed) | (halvings == MOST_HALVINGS)
            done.append((ray[good], start[good], both[good], both_light[:, good]))
            bad = ~good
            if not bad.any():
                break
            ray = np.concatenate([ray[bad], ray[bad]])
            start = np.concatenate([start[bad], start[bad] + half[bad]])
            length = np.concatenate([half[bad], half[bad]])
            depth = np.concatenate([front[bad], back[bad]])
            light = np.concatenate([front_light[:, bad], back_light[:, bad]], axis=1)
        ray, start, depth, light = (np.concatenate(parts, axis=-1) for parts in zip(*done, strict=True))
        order = np.lexsort((start, ray))
        return composite_pieces(ray[order], depth[order], light[:, order], len(bundle.length), samples)

    return integrate


def cell_pieces(bundle: Bundle) -> tuple[Indices, Floats, Floats]:
    """Return ray, start and length (n,) of the parts of rays between faces, front to back, ray after ray.

    Examples
    --------
    >>> bundle = Bundle(np.array([[0.5], [1.5], [1.5]]), np.array([[2.0], [0.0], [0.0]]), np.array([1.0]))
    >>> [part.tolist() for part in cell_pieces(bundle)]
    [[0, 0, 0], [0.0, 0.25, 0.75], [0.25, 0.5, 0.25]]
    """
    rays = len(bundle.length)
    edges = [np.zeros((rays, 1)), bundle.length[:, None]]
    for first, slope in zip(bundle.start, bundle.slope, strict=True):
        ends = np.stack([first, first + bundle.length * slope])
        moving = np.abs(slope) * bundle.length > PARALLEL
        lowest = np.ceil(ends.min(axis=0))
        most = int((np.floor(ends.max(axis=0)) - lowest).max()) + 1
        face = lowest[:, None] + np.arange(most)
        t = (face - first[:, None]) / np.where(moving, slope, np.inf)[:, None]
        edges.append(np.clip(t, 0.0, bundle.length[:, None]))
    along = np.sort(np.concatenate(edges, axis=1), axis=1)
    length = np.diff(along, axis=1)
    ray, piece = np.nonzero(length > 0)
    return ray, along[ray, piece], length[ray, piece]
