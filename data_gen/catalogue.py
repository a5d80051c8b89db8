"""What can be written, by name.  Everything comes from `volref.phantoms`; nothing is computed here."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from volref.phantoms import fields, meshes, specimens, storms, transfer
from volref.scene import Mesh, TransferFunction, Volume

Item: TypeAlias = Volume | Mesh | TransferFunction | storms.PolarScan

# The seeds' radars scan the sky every ten minutes.
STORM_INTERVAL_S, STORM_SCANS = 600.0, 4

# A series to play: close enough in time that a cell does not move farther than it is wide.
SERIES_INTERVAL_S, SERIES_SCANS, SERIES_SIZE = 300.0, 9, (64, 64, 16)


@dataclass(frozen=True)
class Entry:
    """One name: what it is, whether it depends on the seed, and how its items are made, by file stem."""

    about: str
    seeded: bool
    make: Callable[[int], dict[str, Item]]


def _one(name: str, about: str, make: Callable[[], Item]) -> tuple[str, Entry]:
    return name, Entry(about, seeded=False, make=lambda _: {name: make()})


def _seeded(name: str, about: str, make: Callable[[int], Item]) -> tuple[str, Entry]:
    return name, Entry(about, seeded=True, make=lambda seed: {name: make(seed)})


def _storm_scans(seed: int) -> dict[str, Item]:
    storm = storms.make_storm(seed)
    return {
        f"storm_polar_{k:02d}": storms.sample_polar(storm, k * STORM_INTERVAL_S, sweep_seconds=15.0)
        for k in range(STORM_SCANS)
    }


def _storm_boxes(seed: int) -> dict[str, Item]:
    storm = storms.make_storm(seed)
    return {
        f"storm_box_{k:02d}": storms.sample_cartesian(storm, k * STORM_INTERVAL_S) for k in range(STORM_SCANS)
    }


def _storm_series(seed: int) -> dict[str, Item]:
    storm = storms.make_storm(seed)
    return {
        f"storm_series_{k:02d}": storms.sample_cartesian(storm, k * SERIES_INTERVAL_S, size=SERIES_SIZE)
        for k in range(SERIES_SCANS)
    }


CATALOGUE: dict[str, Entry] = dict(
    [
        _one("homogeneous_box", "one value", fields.homogeneous_box),
        _one("linear_ramp", "0 to 1 along z", fields.linear_ramp),
        _one("exponential_ramp", "0.1 to 10 along z, exponential", fields.exponential_ramp),
        _one("sphere", "distance from the centre", fields.sphere),
        _one("squared_distance", "squared distance from the centre", fields.squared_distance),
        _one("shells", "concentric shells, 8 voxels apart", fields.shells),
        _one("marschner_lobb", "the Marschner-Lobb test signal, 41 samples a side", fields.marschner_lobb),
        _seeded("gaussian_blobs", "fourteen Gaussians", lambda seed: fields.gaussian_blobs(seed=seed)),
        _seeded("vessel", "made-up CT of a calcified aorta (HU)", lambda seed: specimens.vessel(seed=seed)),
        _seeded(
            "filaments", "made-up fluorescence stack (counts)", lambda seed: specimens.filaments(seed=seed)
        ),
        (
            "storm_polar",
            Entry("made-up storm, four radar volumes 10 minutes apart", seeded=True, make=_storm_scans),
        ),
        ("storm_box", Entry("the same storm on a box (dBZ)", seeded=True, make=_storm_boxes)),
        (
            "storm_series",
            Entry(
                "the same storm on a small box, nine times 5 minutes apart", seeded=True, make=_storm_series
            ),
        ),
        _one("box_mesh", "a closed box", meshes.box_mesh),
        _one("sphere_mesh", "a closed icosphere", meshes.sphere_mesh),
        _one("torus_mesh", "a closed torus", meshes.torus_mesh),
        _one("tube_mesh", "a closed straight tube", meshes.tube_mesh),
        _one("plane_mesh", "a rectangle with a checkerboard texture", meshes.plane_mesh),
        _one("tf_grey_ramp", "table: black to white", transfer.grey_ramp),
        _one("tf_few_knots", "table: eight knots", transfer.few_knots),
        _one("tf_smooth", "table: a smooth curve, 33 knots", transfer.smooth),
        _one("tf_smooth_curve_256", "table: the same curve, 256 knots", transfer.smooth_curve_256),
        _one("tf_spiky", "table: spikes one knot wide, up to 1e4 per voxel", transfer.spiky),
        _one("tf_jump", "table: opaque below 0.5, clear above", lambda: transfer.jump(0.5)),
    ]
)
