"""How a volume and opaque meshes come together: in the loop's end, on the canvas, and what is then seen.

R rays, F fragments; colours are (F, 4).
"""

import numpy as np

from volref.arrays import Booleans, Floats, Indices


def with_object(fragments: Floats, objects: Floats, rule: str) -> Floats:
    """Return colours with an opaque object behind them, by the rule of `MeshCut.composition`.

    Examples
    --------
    A gray half before a white object: the printed form leaves alpha 1 only where it was 0 or 1.

    >>> half, white = np.array([[0.25, 0.25, 0.25, 0.5]]), np.array([[1.0, 1.0, 1.0, 1.0]])
    >>> [with_object(half, white, rule).tolist() for rule in ("over", "printed")]
    [[[0.75, 0.75, 0.75, 1.0]], [[0.625, 0.625, 0.625, 0.75]]]
    """
    alpha = fragments[:, 3:]
    if rule == "printed":
        color = alpha * fragments[:, :3] + (1 - alpha) * objects[:, :3]
        return np.concatenate([color, alpha * alpha + (1 - alpha)], axis=1)
    color = fragments[:, :3] + (1 - alpha) * objects[:, :3]
    return np.concatenate([color, np.ones_like(alpha)], axis=1)


def met_in_loop(fragments: Floats, hit: Booleans, objects: Floats, rule: str) -> Floats:
    """Return colours of rays (R, 4), with the objects (R, 4) behind those that met one."""
    return np.where(hit[:, None], with_object(fragments, objects, rule), fragments)


def behind_all(
    fragments: Floats, pixel: Indices, objects: Floats, covered: Indices
) -> tuple[Floats, Indices]:
    """Return the fragments of one pass that shows meshes too: behind the volume, and where there is none.

    objects (H * W, 4): the target of their colours, which are at the pixels `covered`.
    """
    there = objects[pixel, 3] > 0
    together = met_in_loop(fragments, there, objects[pixel], "over")
    alone = np.setdiff1d(covered, pixel)
    return np.concatenate([together, objects[alone]]), np.concatenate([pixel, alone])


def distance_shown(distance: Floats, pixel: Indices, alpha: Floats) -> Floats:
    """Return the distance (H, W) of meshes that are seen; +inf also where the volume hides them wholly."""
    shown = distance.copy()
    shown.reshape(-1)[pixel[alpha >= 1]] = np.inf
    return shown
