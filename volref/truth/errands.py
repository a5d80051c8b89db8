"""Work for other processes: what is sent to them, and what they do with it.

An errand goes with every task and is small: the volume by reference; transfer function, camera and plan as
they are.  A process reads the volume and makes it ready once, and keeps the last ones.
"""

import dataclasses
import importlib
import socket
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from volref.arrays import Floats, Indices
from volref.errors import FormatError
from volref.io.references import Folder, Message, VolumeReference, fetch_volume, pack, refer_to_volume, unpack
from volref.planning import Plan
from volref.records import Layers
from volref.scene.scene import Scene
from volref.scene.volume import Volume
from volref.truth.canvas import light_behind
from volref.truth.integration import Integrated, Integration
from volref.truth.meshes.layered import integrate_layered


@dataclass(frozen=True)
class Errand:
    """An `Integration` on its way to another process; equal errands are the same work."""

    versions: str
    volume: VolumeReference | None
    rest: Message


def errand_of(integration: Integration, folder: Folder) -> Errand:
    """Return the errand of an integration whose scene has a volume; files go to `folder` if they must."""
    scene, plan = integration.scene, integration.plan
    # Meshes stay: where they end the rays, and what colour they have, goes with each task.
    left = {"meshes"} | ({"volume"} if isinstance(scene.volume, Volume) else set())
    fields = [field.name for field in dataclasses.fields(scene) if field.name not in left]
    view = {name: getattr(scene, name) for name in fields}
    decided = {
        field.name: getattr(plan, field.name) for field in dataclasses.fields(plan) if field.name != "scene"
    }
    message = pack((view, decided), folder)
    # The sweeps of a radar are few: they go with the rest.
    volume = refer_to_volume(scene.volume, folder) if isinstance(scene.volume, Volume) else None
    return Errand(_versions(), volume, message)


def run_errand(
    errand: Errand,
    parts: Sequence[Indices],
    distance: Floats | None,
    behind: Floats | None,
    layers: Layers | None,
    tolerance: float,
) -> Integrated:
    """Integrate `parts`, each by itself, and return their R pixels one after the other.

    distance (R,) and behind (R, 4) are of all parts; None: there is no surface, only the background.  So are
    the layers; None: no mesh is transparent.

    Raises
    ------
    FormatError
        If a file of the errand cannot be read here, or holds something else by now, or this is another
        version of volref or NumPy.
    """
    integration = _integration(errand)
    done, first = [], 0
    for pixels in parts:
        its = np.arange(first, first := first + len(pixels))
        ends = np.full(len(pixels), np.inf) if distance is None else distance[its]
        light = light_behind(integration.scene, None, pixels) if behind is None else behind[its]
        between = None if layers is None else layers.of_pixels(its)
        done.append(integrate_layered(integration, between, pixels, ends, light, tolerance))
    return Integrated(
        np.concatenate([part.rgba for part in done]),
        np.concatenate([part.bound for part in done]),
        sum(part.samples for part in done),
        done[0].worker,
        None if done[0].hit is None else np.concatenate([part.hit for part in done if part.hit is not None]),
    )


# A process may have several threads, as those of Dask have: one of them reads, the others wait for it.
_READING = threading.Lock()


def _integration(errand: Errand) -> Integration:
    if errand.versions != _versions():
        message = f"workers must have {errand.versions} as their client has, got {_versions()} on "
        raise FormatError(message + f"{socket.gethostname()}; install the same versions everywhere")
    if errand.volume is not None:
        errand.volume.file.checked()  # also if it was read before
    with _READING:
        return _made_ready(errand)


@lru_cache(maxsize=2)
def _made_ready(errand: Errand) -> Integration:
    view, decided = unpack(errand.rest)
    if errand.volume is not None:
        view["volume"] = fetch_volume(errand.volume)
    scene = Scene(**view)
    integration = Integration(scene, Plan(scene=scene, **decided))
    integration.make_ready()
    return integration


def _versions() -> str:
    """Return what the last digits of an image depend on."""
    volref = importlib.import_module("volref")  # an import would load what lies above this layer
    return f"volref {volref.__version__} and NumPy {np.__version__}"


def forget() -> None:
    """Let go of the volumes that this process kept."""
    _made_ready.cache_clear()
    fetch_volume.cache_clear()
