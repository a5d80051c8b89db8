"""Sets of pipelines: a program of which some switches are not known.

In a file they are a pipeline with one more key, the values that each open switch may have:

    "unknown": {"volume.slices": ["count", "last", "centers"], "stepping.steps": [100, 200]}
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

from volref.emulation.agreement import check_steps
from volref.emulation.files.documents import read_record
from volref.emulation.pipeline import GROUPS, Pipeline
from volref.emulation.switches import Plain, switches_of
from volref.errors import SceneError


@dataclass(frozen=True)
class Candidates:
    """A pipeline, and switches of it that may have one of several values.

    Parameters
    ----------
    pipeline
        The program, each open switch at a value that is as likely as any.
    unknown
        Values by "group.switch", such as {"volume.slices": ("count", "last")}.

    Raises
    ------
    SceneError
        If there is no such switch, or a value breaks its rule or is there twice.

    Examples
    --------
    >>> found = Candidates(Pipeline("mine"), {"volume.slices": ("count", "last"), "table.size": (256, 512)})
    >>> found.count, [(one.volume.slices, one.table.size) for one in found][:3]
    (4, [('count', 256), ('count', 512), ('last', 256)])
    """

    pipeline: Pipeline
    unknown: Mapping[str, tuple[Plain, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse switches that there are not, and values that they cannot have."""
        if not isinstance(self.unknown, Mapping):
            message = f"unknown must be an object of lists, got {self.unknown!r}; name switches and values"
            raise SceneError(message)
        checked = {name: _checked_values(name, values) for name, values in self.unknown.items()}
        object.__setattr__(self, "unknown", MappingProxyType(checked))

    @property
    def count(self) -> int:
        """How many combinations there are; those that break a rule together are left out of the iteration."""
        return math.prod(len(values) for values in self.unknown.values())

    def __iter__(self) -> Iterator[Pipeline]:
        """Yield the pipelines of all combinations, the last switch changing fastest."""
        for values in product(*self.unknown.values()):
            changes: dict[str, dict[str, Plain]] = {}
            for name, value in zip(self.unknown, values, strict=True):
                group, _, switch = name.partition(".")
                changes.setdefault(group, {})[switch] = value
            try:
                one = self.pipeline.with_switches(None, **changes)
                check_steps(one.stepping)
            except SceneError:
                continue
            yield one

    def as_dict(self) -> dict[str, Any]:
        """Return the set as plain data for JSON."""
        unknown = {name: list(values) for name, values in self.unknown.items()}
        return self.pipeline.as_dict() | ({"unknown": unknown} if unknown else {})

    @classmethod
    def from_dict(cls, document: object) -> Self:
        """Return the set of plain data; without "unknown" it has one pipeline.

        Raises
        ------
        SceneError
            If it is no pipeline, or "unknown" breaks a rule.
        """
        if not isinstance(document, Mapping) or "unknown" not in document:
            return cls(Pipeline.from_dict(document))
        rest = {key: value for key, value in document.items() if key != "unknown"}
        return cls(Pipeline.from_dict(rest), document["unknown"])


def load_candidates(path: str | Path) -> Candidates:
    """Return the set of pipelines in a JSON file, as `volref pipelines new` writes it.

    Raises
    ------
    FormatError
        If there is no such file, or it is none; see `Candidates.from_dict`.
    """
    return read_record(path, "pipeline", Candidates.from_dict)


def _checked_values(name: object, values: object) -> tuple[Plain, ...]:
    group, _, word = str(name).partition(".")
    found = (
        [switch for switch in switches_of(GROUPS[group]) if switch.name == word] if group in GROUPS else []
    )
    if not found:
        message = f"unknown must name switches as group.switch, got {name!r}; "
        raise SceneError(message + "see the names with: volref pipelines show texture3d")
    if not isinstance(values, list | tuple) or not values:
        message = f"unknown.{name} must be a list of values, got {values!r}; name at least one"
        raise SceneError(message)
    checked: list[Plain] = []
    for value in values:
        keep = value is None and found[0].optional
        one = None if keep else found[0].rule.checked(f"unknown.{name}", value)
        if one in checked:
            message = f"unknown.{name} must have each value once, got {value!r} twice; remove one"
            raise SceneError(message)
        checked.append(one)
    return tuple(checked)
