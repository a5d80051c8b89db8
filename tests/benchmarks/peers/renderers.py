"""The renderers that are compared: a name, what it is, where it lives and over which settings it goes.

A renderer's `prepare` takes a problem, does all that a user would do once (imports, upload, compilation),
and returns what draws one frame at a setting, which alone is timed.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec

from tests.benchmarks.peers.problems import Problem
from volref.arrays import Floats

# Draws a frame (height, width, 4) at a setting.
Draw = Callable[[float], Floats]

STEPS = (4.0, 2.0, 1.0, 0.5, 0.25, 0.125)
FINER_STEPS = (*STEPS, 0.0625, 0.03125)
PACKAGE = "tests.benchmarks.peers"


@dataclass(frozen=True)
class Renderer:
    """One way to draw a problem.

    Parameters
    ----------
    name
        For the command line and the results.
    title
        For people.
    module, function
        Where its `prepare` is: "module" of this package, and the function in it.
    needs
        Packages it does not do without.
    knob
        What the settings are: "step" in voxels, or "tolerance".
    ladder
        The settings, coarse to fine.
    meshes
        Whether it draws meshes.
    patience
        By what to multiply the seconds that a frame may take: a ladder of few, slow rungs deserves more.
    """

    name: str
    title: str
    module: str
    function: str
    needs: tuple[str, ...] = ()
    knob: str = "step"
    ladder: tuple[float, ...] = STEPS
    meshes: bool = True
    patience: float = 1.0

    @property
    def ours(self) -> bool:
        """Whether it is volref."""
        return self.name.startswith("volref")

    @property
    def missing(self) -> tuple[str, ...]:
        """Packages that are not installed."""
        return tuple(package for package in self.needs if find_spec(package) is None)

    @property
    def versions(self) -> dict[str, str]:
        """Versions of the packages it needs; call it where none is missing."""
        return {package: version(package) for package in self.needs}

    def prepare(self, problem: Problem) -> tuple[Draw, str]:
        """Return what draws frames, and a remark on how it does, or ""."""
        made: tuple[Draw, str] = getattr(import_module(f"{PACKAGE}.{self.module}"), self.function)(problem)
        return made


RENDERERS = {
    renderer.name: renderer
    for renderer in (
        Renderer(
            "volref-march32", "volref, march in float32", "volref_methods", "march_in_float32",
            patience=2.0,
        ),
        Renderer("volref-march", "volref, march in float64", "volref_methods", "march", patience=0.5),
        Renderer(
            "volref-auto", "volref, estimated", "volref_methods", "estimated",
            knob="tolerance", ladder=(1e-2, 1e-3, 1e-4),
        ),
        Renderer(
            "volref-exact", "volref, certified", "volref_methods", "certified",
            knob="tolerance", ladder=(1e-2, 1e-9), patience=6.0,
        ),
        Renderer("vtk-fixed", "VTK, fixed-point CPU caster", "vtk_casters", "fixed_point", ("vtk",)),
        Renderer("vtk-gpu", "VTK, GPU caster on software GL", "vtk_casters", "software_gpu", ("vtk",)),
        Renderer(
            "scipy", "SciPy map_coordinates marcher", "scipy_marcher", "prepare", ("scipy",),
            meshes=False, patience=2.0,
        ),
        Renderer(
            "numba", "Numba marcher", "numba_marcher", "prepare", ("numba",),
            ladder=FINER_STEPS, meshes=False, patience=1.5,
        ),
        Renderer(
            "drjit", "Dr.Jit (LLVM) marcher", "drjit_marcher", "prepare", ("drjit", "mitsuba"),
            ladder=FINER_STEPS, patience=2.0,
        ),
    )
}  # fmt: skip
