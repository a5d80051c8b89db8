"""Switches: the fields of frozen records that say themselves what they mean and may be.

A record of switches is a frozen dataclass that inherits from `Switches` and annotates each field:

    filter: Annotated[str, Word("how texels are fetched", {"nearest": "...", "linear": "..."})] = "linear"
    steps: Annotated[int, Whole("samples along a ray", low=1)] = 100

It checks itself when it is built.  Lists for people, questions (`volref pipelines new`), JSON and the search
for a program's faults all read the same annotations.
"""

import dataclasses
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Annotated, Any, ClassVar, Self, TypeAlias, cast, get_args, get_origin, get_type_hints

from volref.arrays import number, one_of, whole_number
from volref.errors import SceneError

Plain: TypeAlias = str | int | float | bool | None


@dataclass(frozen=True)
class Word:
    """A switch that is one of some words; `choices` says what each means."""

    meaning: str
    choices: Mapping[str, str]

    def checked(self, name: str, value: object) -> Plain:
        """Return the word, or refuse it."""
        return one_of(name, value, tuple(self.choices))


@dataclass(frozen=True)
class Whole:
    """A switch that is a whole number from `low` to `high`."""

    meaning: str
    low: int = 0
    high: int = 1 << 20

    def checked(self, name: str, value: object) -> Plain:
        """Return the number, or refuse it."""
        return whole_number(name, value, low=self.low, high=self.high)


@dataclass(frozen=True)
class Real:
    """A switch that is a real number from `low` to `high`."""

    meaning: str
    low: float = 0.0
    high: float = 1e30

    def checked(self, name: str, value: object) -> Plain:
        """Return the number, or refuse it."""
        if isinstance(value, bool | str):
            message = f"{name} must be a number, got {value!r}; give one finite number"
            raise SceneError(message)
        return number(name, value, low=self.low, high=self.high)


@dataclass(frozen=True)
class Flag:
    """A switch that is on or off."""

    meaning: str

    def checked(self, name: str, value: object) -> Plain:
        """Return whether it is on, or refuse what is neither."""
        if not isinstance(value, bool):
            message = f"{name} must be true or false, got {value!r}; choose one"
            raise SceneError(message)
        return value


Rule: TypeAlias = Word | Whole | Real | Flag


@dataclass(frozen=True)
class Switch:
    """A switch of a record: its name, its rule, whether it may be None, and its default."""

    name: str
    rule: Rule
    optional: bool
    default: Plain


@dataclass(frozen=True)
class Switches:
    """A record of switches; see the head of this module.

    group: what comes before the name of a switch in sentences, given with the class.
    """

    group: ClassVar[str]

    def __init_subclass__(cls, *, group: str) -> None:
        """Keep the name of the group."""
        cls.group = group

    def __post_init__(self) -> None:
        """Refuse a switch that breaks its rule."""
        for switch in switches_of(type(self)):
            value = getattr(self, switch.name)
            if value is None and switch.optional:
                continue
            checked = switch.rule.checked(f"{self.group}.{switch.name}", value)
            object.__setattr__(self, switch.name, checked)

    def as_dict(self) -> dict[str, Plain]:
        """Return the switches as plain data for JSON."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, name: str, values: object) -> Self:
        """Return a record from plain data; switches that are not there have their default.

        Raises
        ------
        SceneError
            If `values` is not such a table, or holds a switch that there is not.
        """
        return cls(**checked_keys(name, values, [switch.name for switch in switches_of(cls)]))


def checked_keys(name: str, values: object, allowed: list[str]) -> dict[str, Any]:
    """Return a table of plain data whose keys are all allowed.

    Raises
    ------
    SceneError
        If it is no table, or has another key.
    """
    if not isinstance(values, Mapping):
        message = f"{name} must be an object of switches, got {values!r}; give {{}} for the defaults"
        raise SceneError(message)
    strange = [str(key) for key in values if key not in allowed]
    if strange:
        message = f"{name} must have switches it knows, got {strange[0]!r}; use one of {', '.join(allowed)}"
        raise SceneError(message)
    return dict(values)


def check_head(name: str, values: dict[str, Any], kind: str, version: int) -> None:
    """Take "format" and "version" out of a document, and refuse it if they are others.

    Raises
    ------
    SceneError
        If they are not those.
    """
    for key, wanted in (("format", kind), ("version", version)):
        got = values.pop(key, None)
        if type(got) is not type(wanted) or got != wanted:
            message = f"{name}.{key} must be {wanted!r}, got {got!r}; this is another kind of file"
            raise SceneError(message)


def switches_of(kind: type[Switches]) -> tuple[Switch, ...]:
    """Return the switches of a kind of record, in their order."""
    return _all_switches(cast("Hashable", kind))


@cache
def _all_switches(kind: Hashable) -> tuple[Switch, ...]:
    assert isinstance(kind, type)
    hints, found = get_type_hints(kind, include_extras=True), []
    for field in fields(kind):
        hint = hints[field.name]
        if get_origin(hint) is Annotated:
            plain, rule = get_args(hint)
            found.append(
                Switch(field.name, rule, type(None) in get_args(plain), cast("Plain", field.default))
            )
    return tuple(found)
