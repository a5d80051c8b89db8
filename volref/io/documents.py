"""JSON documents against the published schema, with a sentence for what is wrong.

`scene.schema.json` (JSON Schema draft 2020-12) is the one statement of which keys a scene has and what
they hold.  This module reads the small part of the language that the schema uses; tests hold it to a full
implementation.  What the numbers must obey is the business of the records.
"""

import json
from collections.abc import Callable, Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from volref.errors import FormatError
from volref.io.guard import Foreign, nearest, one_line

FORMAT_VERSION = 1

# The words of JSON Schema that `find_problem` understands; the first ones bear no rule.
KEYWORDS = frozenset(
    {
        *("$schema", "$id", "$defs", "title", "description", "examples", "default"),
        *("$ref", "anyOf", "const", "enum", "type", "properties", "required", "additionalProperties"),
        *("items", "minItems", "maxItems", "minLength"),
    }
)


def scene_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of scene.json."""
    text = resources.files("volref.io").joinpath("scene.schema.json").read_text(encoding="utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema


def check_format(file: Path, document: object, name: str) -> None:
    """Refuse a document that is not of format `name`, or of a version this volref does not read.

    Raises
    ------
    FormatError
        If it is not.
    """
    if not isinstance(document, dict):
        message = f"{file.name} must hold a JSON object, got {_kind(document)}; write {{key: value}}"
        raise FormatError(message)
    if document.get("format") != name:
        message = f"{file.name}: format must be {name!r}, got {_show(document.get('format'))}; "
        raise FormatError(message + "set it, or load another file")
    version = document.get("format_version")
    if not _same(version, FORMAT_VERSION):
        message = f"{file.name}: format_version must be {FORMAT_VERSION}, got {_show(version)}; "
        raise FormatError(message + "save it again with this volref, or install a newer one")


def check_document(file: Path, document: object, definition: str | None = None) -> None:
    """Refuse a document that breaks the schema (the part `definition` of it).

    Raises
    ------
    FormatError
        If a key is unknown or missing, or a value is of the wrong kind or shape.
    """
    schema = _schema()
    rule = schema if definition is None else schema["$defs"][definition]
    problem = find_problem(document, rule, schema["$defs"], definition or "")
    if problem is not None:
        raise FormatError(f"{file.name}: {problem}")


def whole_numbers(document: Foreign, definition: str | None = None) -> Foreign:
    """Return a document with an int wherever the schema asks for an integer: JSON may write 4 as 4.0.

    Floats from 2**53 on stay, so no message has to show 300 digits.  What breaks the schema stays as it is.

    Examples
    --------
    >>> whole_numbers({"width": 4.0, "background": [0.0, 0.0, 0.0, 1.0]})
    {'width': 4, 'background': [0.0, 0.0, 0.0, 1.0]}
    """
    schema = _schema()
    rule = schema if definition is None else schema["$defs"][definition]
    return _whole(document, rule, schema["$defs"])


def find_problem(
    value: object, rule: Mapping[str, Any], definitions: Mapping[str, Any], name: str
) -> str | None:
    """Return what is wrong with `value`, as "name rule, value; cure", or None.

    Examples
    --------
    >>> find_problem([1, 2], {"type": "array", "minItems": 3}, {}, "camera.eye")
    'camera.eye must have at least 3 items, got 2; add the missing ones'
    """
    if "$ref" in rule:
        return find_problem(value, definitions[rule["$ref"].removeprefix("#/$defs/")], definitions, name)
    if "anyOf" in rule:
        return _problem_of_choice(value, rule["anyOf"], definitions, name)
    where = name or "the document"
    if "const" in rule and not _same(value, rule["const"]):
        return f"{where} must be {_show(rule['const'])}, got {_show(value)}; change it"
    if "enum" in rule and not any(_same(value, choice) for choice in rule["enum"]):
        choices = " or ".join(_show(choice) for choice in rule["enum"])
        return f"{where} must be {choices}, got {_show(value)}; {nearest(str(value), rule['enum'])}"
    if "type" in rule and not TYPES[rule["type"]](value):
        return f"{where} must be {SPELLED[rule['type']]}, got {_show(value)}; change it"
    if isinstance(value, dict):
        return _problem_of_object(value, rule, definitions, name)
    if isinstance(value, list):
        return _problem_of_array(value, rule, definitions, where)
    if isinstance(value, str) and len(value) < rule.get("minLength", 0):
        return f"{where} must not be empty, got ''; write it out or leave the key away"
    return None


def _whole(value: Foreign, rule: Mapping[str, Any], definitions: Mapping[str, Any]) -> Foreign:
    if "$ref" in rule:
        return _whole(value, definitions[rule["$ref"].removeprefix("#/$defs/")], definitions)
    if "anyOf" in rule:
        # One branch after the other: none calls a number what another calls an integer.
        for branch in rule["anyOf"]:
            value = _whole(value, branch, definitions)
        return value
    if isinstance(value, dict):
        known = rule.get("properties", {})
        return {key: _whole(item, known.get(key, {}), definitions) for key, item in value.items()}
    if isinstance(value, list) and "items" in rule:
        return [_whole(item, rule["items"], definitions) for item in value]
    whole = rule.get("type") == "integer" and isinstance(value, float) and value.is_integer()
    return int(value) if whole and abs(value) < 2**53 else value


def _problem_of_object(
    value: dict[str, object], rule: Mapping[str, Any], definitions: Mapping[str, Any], name: str
) -> str | None:
    known = rule.get("properties", {})
    if rule.get("additionalProperties") is False:
        for key in value:
            if key not in known:
                where = one_line(_join(name, key))
                return f"{where} must be a key that is known, got {_show(key)}; {nearest(key, known)}"
    for key in rule.get("required", ()):
        if key not in value:
            return f"{_join(name, key)} must be given, got nothing; add the key"
    problems = (
        find_problem(value[key], known[key], definitions, _join(name, key)) for key in value if key in known
    )
    return next((problem for problem in problems if problem is not None), None)


def _problem_of_array(
    value: list[object], rule: Mapping[str, Any], definitions: Mapping[str, Any], where: str
) -> str | None:
    count = len(value)
    if count < rule.get("minItems", 0):
        return f"{where} must have at least {rule['minItems']} items, got {count}; add the missing ones"
    if count > rule.get("maxItems", count):
        return f"{where} must have at most {rule['maxItems']} items, got {count}; remove some"
    if "items" not in rule:
        return None
    problems = (
        find_problem(item, rule["items"], definitions, f"{where}[{i}]") for i, item in enumerate(value)
    )
    return next((problem for problem in problems if problem is not None), None)


def _problem_of_choice(
    value: object, branches: list[Mapping[str, Any]], definitions: Mapping[str, Any], name: str
) -> str | None:
    """Return None if one branch fits, else the problem of the branch that `value` looks most like."""
    kind = _problem_of_kind(value, branches, name)
    if kind is not None:
        return kind
    problems = []
    for branch in branches:
        problem = find_problem(value, branch, definitions, name)
        if problem is None:
            return None
        problems.append((_likeness(value, branch, definitions), problem))
    return max(problems, key=lambda pair: pair[0])[1]


def _problem_of_kind(value: object, branches: list[Mapping[str, Any]], name: str) -> str | None:
    """Return what is wrong with the key "kind" of an object whose branches are told apart by it."""
    rules = [branch.get("properties", {}).get("kind", {}) for branch in branches]
    if not isinstance(value, dict) or "kind" not in value or not all("const" in rule for rule in rules):
        return None
    kinds = list(dict.fromkeys(rule["const"] for rule in rules))
    return find_problem(value["kind"], {"enum": kinds}, {}, _join(name, "kind"))


def _likeness(
    value: object, rule: Mapping[str, Any], definitions: Mapping[str, Any]
) -> tuple[bool, bool, int]:
    """Rank a branch: of the same kind, with the same constants (such as "kind"), with many keys in common."""
    if "$ref" in rule:
        return _likeness(value, definitions[rule["$ref"].removeprefix("#/$defs/")], definitions)
    same_kind = "type" not in rule or TYPES[rule["type"]](value)
    if not isinstance(value, dict):
        return same_kind, False, 0
    known = rule.get("properties", {})
    constants = [key for key in known if "const" in known[key] and key in rule.get("required", ())]
    agree = all(_same(value.get(key), known[key]["const"]) for key in constants)
    missing = sum(key not in value for key in rule.get("required", ()))
    return same_kind, agree, 2 * sum(key in known for key in value) - missing


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_integer(value: object) -> bool:
    return _is_number(value) and not (isinstance(value, float) and not value.is_integer())


TYPES: dict[str, Callable[[object], bool]] = {
    "object": lambda value: isinstance(value, dict),
    "array": lambda value: isinstance(value, list),
    "string": lambda value: isinstance(value, str),
    "number": _is_number,
    "integer": _is_integer,
    "boolean": lambda value: isinstance(value, bool),
}
SPELLED = {
    "object": "an object",
    "array": "a list",
    "string": "text",
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
}


@cache
def _schema() -> dict[str, Any]:
    return scene_schema()


def _same(one: object, other: object) -> bool:
    """Equality as JSON has it: 1 and 1.0 are the same, 1 and true are not."""
    return one == other and isinstance(one, bool) == isinstance(other, bool)


def _join(name: str, key: str) -> str:
    return f"{name}.{key}" if name else key


def _kind(value: object) -> str:
    return "null" if value is None else type(value).__name__


def _show(value: object) -> str:
    if isinstance(value, dict | list):
        return f"{_kind(value)} of {len(value)}"
    return "nothing" if value is None else one_line(repr(value))
