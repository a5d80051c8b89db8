"""What every rival is given: a field to sample, rays through it, and light to return.

R rays, n samples.  Along a ray t is in world units from where it enters the volume; a padded index position
is start + t slope.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from volref.arrays import Floats
from volref.planning import plan
from volref.scene.scene import Scene
from volref.scene.transfer import TransferFunction
from volref.scene.volume import Volume
from volref.stages.classify import Table, classify
from volref.stages.sampling import trilinear
from volref.truth.fields import PlainField, plain_field
from volref.workspace import Workspace

# Extinction, per unit distance, of an opacity of 1, for rules that need a number: opaque at 4e-5 of it.
OPAQUE = 2.0**20


@dataclass(frozen=True, eq=False)
class Medium:
    """A field with its transfer function: ready to be sampled, and as they were given."""

    field: PlainField
    volume: Volume
    transfer: TransferFunction


@dataclass(frozen=True, eq=False)
class Bundle:
    """Rays through the field: start and slope (3, R), length (R,) > 0 in world units, falling."""

    start: Floats
    slope: Floats
    length: Floats


@dataclass(frozen=True, eq=False)
class Light:
    """What a rival found: transmittance (R,), premultiplied colour (3, R), values taken."""

    transmittance: Floats
    color: Floats
    samples: int


# A rival made ready for one field and one setting.
Integrator: TypeAlias = Callable[[Bundle, Workspace], Light]


def medium_of(scene: Scene) -> Medium:
    """Prepare the volume of `scene` for the rivals."""
    return Medium(plain_field(scene, plan(scene, method="march").everything()), *scene.gridded)


def steepest_slope(volume: Volume) -> float:
    """Return a bound on how fast the value can change along any line, per world unit.

    Along index axis i the field changes by at most D_i, the greatest difference of neighbouring samples; the
    bound is the length of the longest world gradient with index components between -D_i and D_i.

    Examples
    --------
    >>> steepest_slope(Volume(np.array([[[0.0, 3.0, 4.0]]]), spacing=(2, 1, 1)))
    1.5
    """
    per_index, before = np.zeros(3), volume.values[0]
    for layer in volume.values:  # layer by layer, for volumes that barely fit the memory
        here = layer.astype(np.float64)
        for axis, difference in enumerate((np.diff(here, axis=1), np.diff(here, axis=0), here - before)):
            per_index[axis] = max(per_index[axis], np.abs(difference).max(initial=0.0))
        before = here
    signs = np.array([(1, 1, 1), (1, 1, -1), (1, -1, 1), (1, -1, -1)])
    return float(np.linalg.norm((signs * per_index) @ volume.index_from_world[:3, :3], axis=1).max())


def sample(medium: Medium, start: Floats, slope: Floats, t: Floats, work: Workspace) -> Floats:
    """Return the values at `t` (..., n) along rays whose start and slope are (3, n); they lie in `work`."""
    position: Floats = work.get("position", 3 * t.size).reshape(3, *t.shape)
    for place, first, stride in zip(position, start, slope, strict=True):
        np.multiply(t, stride, out=place)
        np.add(place, first, out=place)
    return trilinear(medium.field.grid, position.reshape(3, -1), work).reshape(t.shape)


def paint(medium: Medium, values: Floats, work: Workspace) -> tuple[Floats, Floats]:
    """Return straight colours (3, ...) and extinctions (...) of `values`; they lie in `work`."""
    colors, strength = classify(medium.field.table, values.reshape(-1), work)
    sigma = extinction_of(medium.field.table, strength)
    return colors.reshape(3, *values.shape), sigma.reshape(values.shape)


def extinction_of(table: Table, strength: Floats) -> Floats:
    """Overwrite an interpolated strength with the extinction it stands for; opacity 1 is `OPAQUE`."""
    if table.interpolation == "extinction":
        return strength
    np.negative(strength, out=strength)
    with np.errstate(divide="ignore"):
        np.log1p(strength, out=strength)
    np.maximum(strength, -OPAQUE, out=strength)
    return np.multiply(strength, -1.0 / table.unit_distance, out=strength)
