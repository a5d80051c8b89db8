"""One rendered image as one HTML file: no scripts, no network, every picture inside.

Whatever comes from a scene or a caller is text and is escaped here; nobody passes markup in.
"""

import platform
from collections.abc import Sequence
from html import escape

import numpy as np

from volref.arrays import Numbers
from volref.image import encode_rgba8
from volref.planning import SHORTCUTS, Plan
from volref.report.figures import KINDS, Figures, figures_of, levels
from volref.report.markup import (
    Row,
    code_block,
    document,
    facts,
    inline_image,
    legend,
    paragraph,
    scrolling,
    section,
)
from volref.report.pictures import ColoredMap, distance_map, error_map
from volref.scene.camera import Camera
from volref.scene.mesh import Mesh
from volref.scene.radar import RadarVolume
from volref.scene.scene import Scene
from volref.scene.transfer2d import TransferFunction2D
from volref.scene.volume import Volume
from volref.truth.result import Render


def render_page(
    scene: Scene,
    out: Render,
    *,
    title: str,
    lead: str = "",
    alt: str = "",
    unit: str = "world units",
    figures: Sequence[Row] = (),
    repeat: Sequence[Row] = (),
    notice: str = "",
) -> str:
    """Return an HTML page that shows an image, its error, its cost, and how it came about.

    Parameters
    ----------
    scene, out
        What was drawn, and the result of `volref.render`.
    title, lead
        Heading, and what the picture shows in a sentence or two.
    alt
        What the picture shows, for readers who do not see it; `lead` if empty.
    unit
        The unit of length of the scene's world.
    figures
        More (name, value) rows under the picture.
    repeat
        Ways to make the picture again: (what it is, the code).
    notice
        What must be said about the data.
    """
    numbers = figures_of(out)
    parts = [
        f"<header><h1>{escape(title)}</h1>{paragraph(lead)}</header>",
        _picture(scene, out, alt or lead or title),
        section("Error and time", _figures(numbers, figures)),
        section("Depth and error", _maps(out, unit)),
        section("What was done, and what was left out", _plan(out.plan, unit)),
        section("The scene", facts(scene_rows(scene, unit))),
        section("Make it again", "".join(code_block(name, code) for name, code in repeat)) if repeat else "",
        section("Versions", facts(version_rows())),
        section("Data", f'<pre class="text">{escape(notice)}</pre>') if notice else "",
    ]
    return document(title, "\n".join(part for part in parts if part))


def scene_rows(scene: Scene, unit: str = "world units") -> list[Row]:
    """Return what a scene holds as (name, words)."""
    rows = [("image", f"{scene.width} x {scene.height} pixels")]
    if scene.volume is not None:
        rows += _volume_rows(scene.volume, unit)
    if scene.transfer is not None:
        knots, kind = scene.envelope.values, scene.envelope.interpolation
        span = f"{knots[0]:g} to {knots[-1]:g}"
        words = f"{len(knots)} knots from {span}, {kind} linear between them"
        if isinstance(scene.transfer, TransferFunction2D):
            high, wide = scene.transfer.rgba.shape[:2]
            words = f"{wide} values from {span} x {high} gradient magnitudes"
        elif scene.transfer.gradient_opacity is not None:
            words += "; times a factor by the gradient"
        rows.append(("transfer function", words))
    rows += _look_rows(scene)
    rows += [_mesh_row(i, mesh) for i, mesh in enumerate(scene.meshes)]
    rows += _camera_rows(scene.camera, unit)
    rows.append(("background", f"{_numbers(scene.background)} (premultiplied RGBA, working space)"))
    return rows


def _look_rows(scene: Scene) -> list[Row]:
    """Return what decides the look beside the table, as far as it is not the default."""
    rows = [] if scene.mode == "composite" else [("mode", scene.mode)]
    if scene.isovalue is not None:
        rows.append(("isovalue", f"{scene.isovalue:g}"))
    if scene.lights:
        model = "phong" if scene.material is None else scene.material.model
        rows.append(("lights", f"{', '.join(light.kind for light in scene.lights)}; {model}"))
    if scene.needs_gradient:
        rows.append(("gradient", scene.gradient))
    if scene.classification != "post":
        rows.append(("classification", scene.classification))
    planes = [("slice plane", plane) for plane in (scene.slice_plane,) if plane is not None]
    planes += [("clipping plane", plane) for plane in scene.clip]
    return rows + [
        (name, f"through {_numbers(plane.point.tolist())}, normal {_numbers(plane.normal.tolist())}")
        for name, plane in planes
    ]


def version_rows() -> list[Row]:
    """Return the versions that a number on the page may depend on."""
    from volref import __version__

    return [
        ("volref", __version__),
        ("Python", platform.python_version()),
        ("NumPy", np.__version__),
        ("machine", f"{platform.system()} {platform.machine()}"),
    ]


def _volume_rows(volume: Volume | RadarVolume, unit: str) -> list[Row]:
    low, high = volume.value_bounds
    if isinstance(volume, RadarVolume):
        words = f"{len(volume.sweeps)} sweeps of a weather radar, {volume.quantity}"
        return [("volume", words), ("values", f"{low:g} to {high:g} {volume.units}")]
    return [
        ("volume", f"{' x '.join(map(str, volume.size))} voxels, {volume.values.dtype}"),
        ("spacing", f"{' x '.join(f'{s:g}' for s in volume.spacing)} {unit}"),
        ("values", f"{low:g} to {high:g}"),
    ]


def _mesh_row(index: int, mesh: Mesh) -> Row:
    dropped = f", {mesh.dropped} without an area dropped" if mesh.dropped else ""
    words = f"{len(mesh.faces):,} triangles, {len(mesh.vertices):,} vertices{dropped}"
    seen = f", opacity {mesh.opacity:g}" if mesh.opacity < 1 else ""
    seen += ", lit" if mesh.lit else ""
    return f"mesh {index}", f"{words}; colour: {mesh.coloring}{seen}"


def _camera_rows(camera: Camera, unit: str) -> list[Row]:
    world = camera.world_from_view
    opening = {
        "perspective": f"perspective, {camera.fov_y} degrees high",
        "orthographic": f"orthographic, {camera.height} {unit} high",
        "matrix": "given by its matrices",
    }[camera.kind]
    place = f"at {_numbers(world[:3, 3])}, looking along {_numbers(-world[:3, 2])} ({unit})"
    return [("camera", f"{opening}; {place}")]


def _picture(scene: Scene, out: Render, alt: str) -> str:
    image = inline_image(encode_rgba8(out.rgba), alt, scene.width, scene.height)
    caption = f"<strong>{escape(figures_of(out).sentence)}</strong>"
    return f'<figure class="picture">{image}<figcaption>{caption}</figcaption></figure>'


def _figures(numbers: Figures, more: Sequence[Row]) -> str:
    kind, meaning = KINDS[numbers.error_kind]
    work = "piece" if numbers.method == "exact" else "sample"
    rows: list[Row] = []
    if numbers.error_kind != "none":
        rows += [
            (f"{kind} error, largest", f"{levels(numbers.error_max)} / 255"),
            (f"{kind} error, 99% of pixels below", f"{levels(numbers.error_p99)} / 255"),
            (f"{kind} error, median", f"{levels(numbers.error_median)} / 255"),
            (f"pixels within {levels(numbers.tolerance)} / 255", f"{_floor_percent(numbers.within)}%"),
        ]
    rows += [
        ("rendering", f"{numbers.seconds:.2f} s"),
        ("threads", str(numbers.threads)),
        (f"{work}s", f"{numbers.samples:,}"),
    ]
    if numbers.ns_per_sample is not None:
        rows.append((f"wall time per {work}", f"{numbers.ns_per_sample:.0f} ns"))
    tiles = "".join(
        f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in [*rows, *more]
    )
    scale = (
        "Errors are in the working space, the largest over red, green, blue and alpha; 1/255 is one level "
    )
    scale += "of an 8-bit image."
    return f'<dl class="figures">{tiles}</dl>{paragraph(f"{meaning} {scale}")}'


def _maps(out: Render, unit: str) -> str:
    distance = distance_map(out.distance, unit)
    error = error_map(out.bound)
    surface = float(np.isfinite(out.distance).mean())
    nothing = "No ray meets a surface."
    seen = f"Distance along the ray to the first surface, which {surface:.0%} of the rays meet."
    kind = KINDS[out.bound_kind][0]
    about = f"{kind.capitalize()} error of each pixel, on a logarithmic scale."
    return (
        '<div class="pair">'
        + _map("Depth", distance, seen if surface else nothing)
        + _map("Error", error, about)
        + "</div>"
    )


def _map(name: str, picture: ColoredMap, about: str) -> str:
    height, width = picture.colors.shape[:2]
    ends = f" Scale: {picture.ticks[0][1]} to {picture.ticks[-1][1]} {picture.unit}." if picture.ticks else ""
    image = inline_image(picture.colors, f"{name} map. {about}{ends}", width, height)
    caption = f"<h3>{name}</h3>{legend(picture)}{paragraph(about)}"
    return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"


def _plan(plan: Plan, unit: str) -> str:
    how = f"Method {plan.method}"
    if plan.step:
        how += f": a sample every {plan.step:g} {unit}, at most {plan.most_segments} on a ray"
    elif plan.method == "exact" and plan.includes("volume"):
        how += ": rays are cut into pieces where they pass from voxel to voxel, and further only where the "
        how += "tolerance asks for it; there is no step"
    left_out = [stage.name for stage in plan.stages if not stage.included]
    saving = [stage.name for stage in plan.stages if stage.included and stage.name in SHORTCUTS]
    told = f"Stages left out: {', '.join(left_out) or 'none'}. "
    told += f"Work saved by: {', '.join(saving) or 'nothing'}."
    rows = "".join(
        f'<tr><th scope="row">{escape(stage.name)}</th>'
        f'<td class="{"in" if stage.included else "out"}">{"in" if stage.included else "left out"}</td>'
        f"<td>{escape(stage.reason)}</td></tr>"
        for stage in plan.stages
    )
    head = '<tr><th scope="col">stage</th><th scope="col">in or out</th><th scope="col">why</th></tr>'
    table = f"<table><thead>{head}</thead><tbody>{rows}</tbody></table>"
    return paragraph(f"{how}. {told}") + scrolling("Stages", table)


def _numbers(values: Sequence[float] | Numbers) -> str:
    return "(" + ", ".join(f"{float(value) + 0.0:.4g}" for value in values) + ")"


def _floor_percent(part: float) -> str:
    """Return a percentage that says 100 only for all."""
    return f"{np.floor(part * 1000) / 10:g}"
