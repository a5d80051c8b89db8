"""Pipelines by name: the five seed systems, as they work and as they are printed, and their kin."""

from functools import cache

from volref.emulation.catalogue import (
    arbelaz,
    barbagallo,
    baseline,
    burkalo,
    cej,
    congote,
    congote_radar,
    vpt,
    x3dom,
)
from volref.emulation.pipeline import Pipeline
from volref.errors import SceneError

MODULES = (baseline, arbelaz, congote, congote_radar, barbagallo, cej, vpt, x3dom, burkalo)


@cache
def pipelines() -> dict[str, Pipeline]:
    """Return all pipelines of the catalogue by name."""
    return {pipeline.name: pipeline for module in MODULES for pipeline in module.PIPELINES}


def named(name: str) -> Pipeline:
    """Return the pipeline of a name.

    Raises
    ------
    SceneError
        If there is none.
    """
    if name not in pipelines():
        message = f"pipeline must be one of the catalogue, got {name!r}; use one of {', '.join(pipelines())}"
        raise SceneError(message)
    return pipelines()[name]
