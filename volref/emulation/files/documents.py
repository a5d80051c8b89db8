"""Pipelines and devices in files: JSON from strangers, and the schema that says what it may hold."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from volref.emulation.device import FORMAT as DEVICE_FORMAT
from volref.emulation.device import FORMAT_VERSION as DEVICE_FORMAT_VERSION
from volref.emulation.device import Device
from volref.emulation.pipeline import FORMAT, FORMAT_VERSION, GROUPS, Pipeline
from volref.emulation.switches import (
    Flag,
    Switch,
    Switches,
    Whole,
    Word,
    check_head,
    checked_keys,
    switches_of,
)
from volref.errors import FormatError, SceneError
from volref.io.guard import existing_file, one_line, parse_json, spell_bytes, wrapped

# A pipeline has 15 kB with every switch spelt out; sets of pipelines have some more.
LARGEST_BYTES = 2**20

Record = TypeVar("Record")


def load_pipeline(path: str | Path) -> Pipeline:
    """Return the pipeline in a JSON file.

    Raises
    ------
    FormatError
        If there is no such file, or it is no pipeline; see `Pipeline.from_dict`.
    """
    return read_record(path, "pipeline", Pipeline.from_dict)


def load_device(path: str | Path) -> Device:
    """Return the device in a JSON file.

    Raises
    ------
    FormatError
        If there is no such file, or it is no device.
    """
    return read_record(path, "device", device_from_dict)


def device_from_dict(document: object) -> Device:
    """Return the device of plain data, as `Device.to_json` writes it; what is left out is ideal.

    Raises
    ------
    SceneError
        If it is of another format or version, or a switch is unknown or breaks its rule.
    """
    allowed = ["format", "version", "name", *(switch.name for switch in switches_of(Device))]
    values = checked_keys("device", document, allowed)
    check_head("device", values, DEVICE_FORMAT, DEVICE_FORMAT_VERSION)
    name = values.get("name", "mine")
    if not isinstance(name, str) or not name:
        message = f"device.name must be a short name, got {name!r}; give one"
        raise SceneError(message)
    return Device(**values | {"name": name})


def read_record(path: str | Path, kind: str, build: Callable[[object], Record]) -> Record:
    """Return what `build` makes of the document in a JSON file.

    Raises
    ------
    FormatError
        If there is no such file, or `build` refuses what it holds.
    """
    file = existing_file(path)
    size = file.stat().st_size
    if size > LARGEST_BYTES:
        message = f"{file.name} must have at most {spell_bytes(LARGEST_BYTES)}, as a {kind} has, got "
        raise FormatError(message + f"{spell_bytes(size)}; check the path")
    with wrapped(file, "JSON document", "mend it at that place"):
        document = parse_json(file.read_text(encoding="utf-8"))
    try:
        return build(document)
    except SceneError as error:
        sentence, _, cure = str(error).rpartition("; ")
        message = f"{file.name}: {one_line(sentence)}; {one_line(cure)}"
        raise FormatError(message) from error


def pipeline_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of pipeline files, made from the switches.

    It also allows "unknown", the open switches of a set of pipelines (`load_candidates`), which
    `load_pipeline` refuses.  Two rules that take several numbers are beyond it: the ends of "domain" must
    rise, and so must low, mid and high of "output".

    Examples
    --------
    >>> schema = pipeline_schema()
    >>> schema["properties"]["table"]["properties"]["coordinate"]["enum"]
    ['direct', 'centered']
    """
    text = {"type": "string"}
    ends = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
    properties: dict[str, Any] = {
        "format": {"const": FORMAT},
        "version": {"const": FORMAT_VERSION},
        "name": {"type": "string", "minLength": 1, "description": "a short name"},
        "title": text | {"description": "one line for people"},
        "source": text | {"description": "where the program is published"},
        "domain": {
            "anyOf": [ends, {"type": "null"}],
            "description": "values that the textures hold as 0 and 1, null: those of the scene's table",
        },
    }
    for name, kind in GROUPS.items():
        switches = {switch.name: switch_schema(switch) for switch in switches_of(kind)}
        properties[name] = _table(switches, _definition(kind))
    properties["unknown"] = _table(
        {
            f"{group}.{switch.name}": {"type": "array", "items": switch_schema(switch), "minItems": 1}
            for group, kind in GROUPS.items()
            for switch in switches_of(kind)
        },
        "switches that are open, each with the values that it may have; makes the file a set of pipelines",
    )
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "a volref pipeline"}
    return (
        head
        | _table(properties, Pipeline.__doc__.splitlines()[0] if Pipeline.__doc__ else "")
        | {"required": ["format", "version", "name"]}
    )


def switch_schema(switch: Switch) -> dict[str, Any]:
    """Return the JSON Schema of one switch."""
    rule, described = switch.rule, {"description": switch.rule.meaning, "default": switch.default}
    if isinstance(rule, Word):
        choices = [*rule.choices, *([None] if switch.optional else [])]
        words = "; ".join(f"{word}: {meaning}" for word, meaning in rule.choices.items())
        return {"enum": choices} | described | {"description": f"{rule.meaning} ({words})"}
    if isinstance(rule, Flag):
        kind: dict[str, Any] = {"type": "boolean"}
    else:
        name = "integer" if isinstance(rule, Whole) else "number"
        kind = {"type": name, "minimum": rule.low, "maximum": rule.high}
    return ({"anyOf": [kind, {"type": "null"}]} if switch.optional else kind) | described


def _definition(kind: type[Switches]) -> str:
    return kind.__doc__.splitlines()[0] if kind.__doc__ else ""


def _table(properties: Mapping[str, Any], description: str) -> dict[str, Any]:
    return {
        "type": "object",
        "description": description,
        "properties": dict(properties),
        "additionalProperties": False,
    }
