"""Which questions a description of a program asks, in the program's order, and which of them matter.

A switch matters where its needs are met: each of them names another switch and the values of it that make the
question worth asking.  A switch that is unknown has several values; one that will do is enough.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeAlias

from volref.emulation.pipeline import GROUPS, Pipeline
from volref.emulation.switches import Flag, Plain, Switch, Word, switches_of
from volref.errors import SceneError

Test: TypeAlias = Callable[[Plain], bool]
Known: TypeAlias = Mapping[str, tuple[Plain, ...]]


class Question(NamedTuple):
    """A switch and its name, group.switch."""

    name: str
    switch: Switch


def _is(*words: Plain) -> Test:
    return lambda value: value in words


def _given(value: Plain) -> bool:
    return value is not None


def _bends(value: Plain) -> bool:
    return value != 1.0


def _bakes_gradients(value: Plain) -> bool:
    return isinstance(value, str) and value.startswith("sobel")


ATLAS = {"volume.layout": _is("atlas")}
TWO_PASSES = {"rays.kind": _is("coordinates")}
MESH_DEPTH = {"meshes.kind": _is("depth")}
ARTISTIC = {"output.tone_map": _is("artistic")}

NEEDS: dict[str, Mapping[str, Test]] = {
    "rays.direction": {"rays.kind": _is("slab")},
    "rays.front": TWO_PASSES,
    "rays.no_exit": TWO_PASSES,
    "rays.format": TWO_PASSES,
    "rays.filter": TWO_PASSES,
    "stepping.steps": {"stepping.rule": _is("count", "texture-length")},
    "stepping.length": {"stepping.rule": _is("texture-length", "world-length", "voxel-count")},
    "stepping.last_step": {"stepping.end": _is("length-before")},
    "stepping.opaque_test": {"stepping.opaque_at": _given},
    "stepping.stopped": {"stepping.opaque_at": _given},
    "volume.tiles_across": ATLAS,
    "volume.first_tile": ATLAS,
    "volume.rows": ATLAS,
    "volume.padding": ATLAS,
    "volume.in_tile": ATLAS,
    "volume.slices": ATLAS,
    "volume.second_slice": ATLAS,
    "volume.between": ATLAS,
    "volume.tile_row": ATLAS,
    "volume.tile_column": ATLAS,
    "volume.second_column": ATLAS,
    "volume.seam": {"volume.geometry": _is("spherical", "spherical-printed")},
    "table.steepest": {"table.rows": lambda rows: rows != 1},
    "table.order": {"volume.geometry": _is("box")},
    "lighting.zero": {"lighting.gradient": _bakes_gradients},
    "lighting.flat": {"lighting.gradient": _bakes_gradients},
    "lighting.normals": {"lighting.model": _is("lit", "cej")},
    "lighting.space": {"lighting.model": _is("cej")},
    "meshes.depth": MESH_DEPTH,
    "meshes.packing": MESH_DEPTH,
    "meshes.comparison": MESH_DEPTH,
    "meshes.composition": MESH_DEPTH,
    "meshes.measure": {"meshes.kind": _is("distance")},
    "meshes.scale": {"meshes.kind": _is("distance", "depth")},
    "meshes.format": {"meshes.kind": _is("distance", "depth")},
    "output.low": ARTISTIC,
    "output.mid": ARTISTIC,
    "output.high": ARTISTIC,
    "output.saturation": ARTISTIC,
    "output.encodings": {"output.gamma": _bends},
}


def questions() -> list[Question]:
    """Return all questions in the program's order."""
    return [
        Question(f"{group}.{switch.name}", switch)
        for group, kind in GROUPS.items()
        for switch in switches_of(kind)
    ]


def known_of(pipeline: Pipeline) -> dict[str, tuple[Plain, ...]]:
    """Return the value of each switch of a pipeline, as the one that it may have."""
    return {
        f"{group}.{name}": (value,)
        for group in GROUPS
        for name, value in getattr(pipeline, group).as_dict().items()
    }


def matters(name: str, known: Known) -> bool:
    """Tell whether a switch changes anything, for what is known of the others.

    Examples
    --------
    >>> matters("volume.slices", {"volume.layout": ("3d",)})
    False
    >>> matters("volume.slices", {"volume.layout": ("3d", "atlas")})
    True
    """
    return all(any(map(test, known[other])) for other, test in NEEDS.get(name, {}).items())


def choices_of(switch: Switch) -> list[Plain]:
    """Return the values among which a switch is chosen by number; none for numbers."""
    rule = switch.rule
    if isinstance(rule, Word):
        return [*rule.choices, *([None] if switch.optional else [])]
    return [False, True] if isinstance(rule, Flag) else []


def answered(question: Question, text: str, default: Plain) -> tuple[Plain, ...]:
    """Return the values that an answer stands for: one, or several where it is unknown.

    A number of a list, a word, nothing for the default; "unknown", or "unknown" and values.

    Raises
    ------
    SceneError
        If it is no answer to the question.

    Examples
    --------
    >>> steps, slices = (q for q in questions() if q.name in ("stepping.steps", "volume.slices"))
    >>> answered(slices, "2", "centers"), answered(slices, "", "centers"), answered(steps, "250", 100)
    (('last',), ('centers',), (250,))
    >>> answered(slices, "unknown", "centers"), answered(steps, "unknown 100, 200", 100)
    (('count', 'last', 'centers'), (100, 200))
    """
    words = text.strip()
    if not words:
        return (default,)
    first, _, rest = words.partition(" ")
    if first != "unknown":
        return (_one(question, words),)
    if rest:
        return tuple(dict.fromkeys(_one(question, part.strip()) for part in rest.split(",")))
    if not choices_of(question.switch):
        message = f"{question.name} must be unknown among values, got none; answer such as: unknown 100, 200"
        raise SceneError(message)
    return tuple(choices_of(question.switch))


def _one(question: Question, word: str) -> Plain:
    """Return the value of one word."""
    name, switch = question
    choices = choices_of(switch)
    if word.isdecimal() and choices:
        if not 1 <= int(word) <= len(choices):
            message = f"{name} must be a number from 1 to {len(choices)}, got {word}; choose one"
            raise SceneError(message)
        return choices[int(word) - 1]
    if word == "none" and switch.optional:
        return None
    if isinstance(switch.rule, Flag):
        return switch.rule.checked(name, {"yes": True, "no": False}.get(word, word))
    if isinstance(switch.rule, Word):
        return switch.rule.checked(name, word)
    try:
        number: Plain = int(word)
    except ValueError:
        try:
            number = float(word)
        except ValueError:
            number = word
    return switch.rule.checked(name, number)
