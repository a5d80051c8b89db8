"""A GPU program that draws a volume, described by its switches.

A program takes these decisions, in this order; each group of switches is one record:

    rays        where a ray enters and leaves the box, in texture space (0..1 edge to edge), and how exactly
    stepping    where its samples lie, how many there are, and what ends it
    volume      how the volume lies in textures, and how a position becomes texture coordinates
    table       the transfer function as a texture
    opacity     from the opacity of the table to that of a sample
    lighting    what lights do to the colour of a sample
    accumulation  how samples are put together
    meshes      how opaque meshes cut the volume
    output      what happens to the colour on its way to the canvas

`volref/emulation/catalogue` holds the named systems.  The words are those of the pages in docs/systems.
"""

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from volref.emulation.groups import (
    Accumulation,
    Lighting,
    MeshCut,
    Output,
    RaySetup,
    SampleOpacity,
    Stepping,
    TableTexture,
    VolumeTexture,
)
from volref.emulation.switches import Plain, Switches, check_head, checked_keys, switches_of
from volref.errors import SceneError
from volref.scene.transfer_checks import checked_domain

FORMAT = "volref-pipeline"
FORMAT_VERSION = 1


@dataclass(frozen=True)
class Pipeline:
    """A GPU program, described by its switches.

    Parameters
    ----------
    name, title, source
        A short name; one line for people; where the program is published.
    domain
        Values that the textures hold as 0 and 1; None: the first and the last knot of the scene's transfer
        function.  Of one from a table with texel centres these lie half an entry inside the table's domain:
        give the domain here then.
    rays, stepping, volume, table, opacity, lighting, accumulation, meshes, output
        The decisions; see the head of this module.

    Raises
    ------
    SceneError
        If a switch breaks its rule.

    Examples
    --------
    >>> pipeline = Pipeline("mine").with_switches(stepping={"rule": "count", "steps": 200})
    >>> pipeline.stepping.steps, Pipeline.from_json(pipeline.to_json()) == pipeline
    (200, True)
    """

    name: str
    title: str = ""
    source: str = ""
    domain: tuple[float, float] | None = None
    rays: RaySetup = field(default_factory=RaySetup)
    stepping: Stepping = field(default_factory=Stepping)
    volume: VolumeTexture = field(default_factory=VolumeTexture)
    table: TableTexture = field(default_factory=TableTexture)
    opacity: SampleOpacity = field(default_factory=SampleOpacity)
    lighting: Lighting = field(default_factory=Lighting)
    accumulation: Accumulation = field(default_factory=Accumulation)
    meshes: MeshCut = field(default_factory=MeshCut)
    output: Output = field(default_factory=Output)

    def __post_init__(self) -> None:
        """Refuse a name that is not one, and groups of another kind."""
        for name in ("name", "title", "source"):
            if not isinstance(getattr(self, name), str):
                message = f"pipeline.{name} must be a text, got {getattr(self, name)!r}; give a text"
                raise SceneError(message)
        if not self.name:
            message = "pipeline.name must be a short name, got ''; give one"
            raise SceneError(message)
        if self.domain is not None:
            object.__setattr__(self, "domain", checked_domain("pipeline.domain", self.domain))
        for name, kind in GROUPS.items():
            if not isinstance(getattr(self, name), kind):
                message = f"pipeline.{name} must be a {kind.__name__}, got {getattr(self, name)!r}; "
                raise SceneError(message + "build one, or give a table of switches to with_switches")

    def with_switches(self, name: str | None = None, **groups: Mapping[str, Plain]) -> Self:
        """Return the same pipeline with other switches, by group: `with_switches(table={"size": 32})`.

        Raises
        ------
        SceneError
            If there is no such group or switch, or it breaks its rule.
        """
        changed: dict[str, Any] = {} if name is None else {"name": name}
        for group, values in checked_keys("pipeline", groups, list(GROUPS)).items():
            before = getattr(self, group)
            allowed = [switch.name for switch in switches_of(GROUPS[group])]
            changes = checked_keys(f"pipeline.{group}", values, allowed)
            changed[group] = dataclasses.replace(before, **changes)
        return dataclasses.replace(self, **changed)

    def as_dict(self) -> dict[str, Any]:
        """Return the pipeline as plain data, every switch spelt out."""
        head = {"format": FORMAT, "version": FORMAT_VERSION, "name": self.name, "title": self.title}
        head |= {"source": self.source, "domain": None if self.domain is None else list(self.domain)}
        return head | {name: getattr(self, name).as_dict() for name in GROUPS}

    def to_json(self) -> str:
        """Return the pipeline as JSON text, every switch spelt out."""
        return json.dumps(self.as_dict(), indent=2) + "\n"

    @classmethod
    def from_dict(cls, document: object) -> Self:
        """Return the pipeline of plain data; what is left out has its default.

        Raises
        ------
        SceneError
            If it is of another format or version, or a switch is unknown or breaks its rule.
        """
        if isinstance(document, Mapping) and "unknown" in document:
            raise SceneError(_open_switches(document["unknown"]))
        allowed = ["format", "version", "name", "title", "source", "domain", *GROUPS]
        values = checked_keys("pipeline", document, allowed)
        check_head("pipeline", values, FORMAT, FORMAT_VERSION)
        for name, kind in GROUPS.items():
            if name in values:
                values[name] = kind.from_dict(f"pipeline.{name}", values[name])
        if "name" not in values:
            message = "pipeline.name must be given, got none; give a short name"
            raise SceneError(message)
        return cls(**values)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Return the pipeline of JSON text; see `from_dict`."""
        try:
            document = json.loads(text)
        except (ValueError, RecursionError) as error:
            message = f"pipeline must be JSON, got text that is not ({error}); write one with to_json"
            raise SceneError(message) from error
        return cls.from_dict(document)


# Name of each group of switches and its kind, in the order of the program.
GROUPS: dict[str, type[Switches]] = {
    "rays": RaySetup,
    "stepping": Stepping,
    "volume": VolumeTexture,
    "table": TableTexture,
    "opacity": SampleOpacity,
    "lighting": Lighting,
    "accumulation": Accumulation,
    "meshes": MeshCut,
    "output": Output,
}


def _open_switches(unknown: object) -> str:
    """Return why a set of pipelines is not one."""
    names = ", ".join(map(str, unknown)) if isinstance(unknown, Mapping) else repr(unknown)
    message = f"pipeline.unknown must not be there in one pipeline, got the open switches {names or 'none'}; "
    return message + "settle them, or load the set with load_candidates"
