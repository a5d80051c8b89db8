"""Seed 000 in real WebGL beyond the common scenes: many meshes, colours of all kinds, depths as floats."""

import numpy as np
import pytest

from tests.webgl.cases import as_numbers
from tests.webgl.figures import figures
from tests.webgl.scenes import field, scene, towards
from tests.webgl.systems import arbelaz
from volref import Mesh
from volref.emulation.ambiguity import ambiguous
from volref.emulation.catalogue import named
from volref.emulation.device import Device
from volref.emulation.passes import emulate
from volref.phantoms.meshes import box_mesh

# Each switch of the printed form by itself: what one hides in the other is not hidden here.
ALONE = {
    "depth": "window-over-w",
    "packing": "printed",
    "comparison": "one-step-early",
    "composition": "printed",
}


def crowd():
    """Boxes in front, inside, behind and across, by colours of vertices, of faces and of their own."""
    volume = field((17, 20, 13), spacing=(1.1, 0.9, 1.7))
    camera = towards(volume, (0.8, -0.9, 0.6))
    middle, way = volume.corners.mean(axis=0), np.array([0.8, -0.9, 0.6])
    beside = np.array([0.75, 0.66, 0.0])
    boxes = (
        box_mesh((3, 3, 4), middle + 12 * way - 5 * beside),
        box_mesh((4, 5, 6), middle + way + 2 * beside),
    )
    rainbow = [Mesh(box.vertices, box.faces, place_colors(box.vertices)) for box in boxes]
    sides = np.linspace(0.11, 0.93, 36).reshape(12, 3)
    behind = box_mesh((9, 9, 9), middle - 15 * way - 6 * beside)
    across = box_mesh((40, 2, 3), middle + np.array([0, 4, 0]))
    shell = Mesh(across.vertices, across.faces, (0.31, 0.87, 0.55), sides="front")
    return scene(volume, camera, meshes=(*rainbow, Mesh(behind.vertices, behind.faces, sides), shell))


def place_colors(vertices):
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return 0.07 + 0.81 * (vertices - low) / (high - low)


def held(webgl, pipeline):
    """Figures of each target, after the bounds of all systems are held."""
    drawn, device = crowd(), Device.named(webgl.name)
    ours, theirs = dict(emulate(drawn, pipeline, device).passes), arbelaz.draw(webgl, drawn, pipeline)
    assert set(ours) == set(theirs)
    for name in ours:
        one, other = ours[name], theirs[name]
        if name.endswith("_depth"):
            one, other = (as_numbers(image, pipeline) for image in (one, other))
        found = figures(one, other, lambda: ambiguous(drawn, pipeline, device), (0.0,))
        said = f"{webgl.name}, {name}: {found}"
        assert found.unexplained == 0, said
        assert found.exact >= 0.995 if found.bytes else found.percentile(99) <= 1e-5, said


@pytest.mark.parametrize("name", ["arbelaz2016", "arbelaz2016-printed"])
def test_many_meshes_with_colors_of_all_kinds_are_drawn_as_by_webgl(webgl, name):
    held(webgl, named(name))


@pytest.mark.parametrize("switch", ALONE)
def test_each_switch_of_the_printed_form_alone_is_the_shaders(webgl, switch):
    held(webgl, named("arbelaz2016").with_switches(meshes={switch: ALONE[switch]}))


def test_depths_may_be_floats(webgl):
    floats = {"packing": "exact", "format": "float"}
    held(webgl, named("arbelaz2016").with_switches(meshes=floats, rays={"format": "float"}))


@pytest.mark.parametrize("switch", ALONE)
def test_a_switch_that_the_shader_does_not_have_is_seen(webgl, switch):
    coarse = named("arbelaz2016").with_switches(stepping={"steps": 25})
    drawn = crowd()
    theirs = arbelaz.draw(webgl, drawn, coarse)["canvas"]
    wrong = coarse.with_switches(meshes={switch: ALONE[switch]})
    right, ours = (emulate(drawn, one, Device.named(webgl.name)).rgba8 for one in (coarse, wrong))
    differ = (ours != theirs).any(axis=-1).sum()
    assert differ > 20 + 5 * (right != theirs).any(axis=-1).sum()
