"""All cases of the study, by family."""

from collections.abc import Sequence

from volref.errors import SceneError
from volref.io.guard import nearest
from volref.studies.stability import (
    borders,
    box,
    compositing,
    encoding,
    meshes,
    sampling,
    segments,
    sizes,
    stiff,
    tables,
    views,
)
from volref.studies.stability.case import Case

CASES: tuple[Case, ...] = (
    *segments.CASES,
    *compositing.CASES,
    *box.CASES,
    *sampling.CASES,
    *tables.CASES,
    *meshes.CASES,
    *views.CASES,
    *sizes.CASES,
    *stiff.CASES,
    *encoding.CASES,
    *borders.CASES,
)


def chosen_cases(names: Sequence[str] | None = None) -> tuple[Case, ...]:
    """Return the cases of these names or families, in the order of `CASES`; None: all.

    Raises
    ------
    SceneError
        If a name is neither.

    Examples
    --------
    >>> [case.name for case in chosen_cases(["thin-segment", "camera-inside"])]
    ['thin-segment', 'camera-inside']
    """
    if names is None:
        return CASES
    known = {case.name for case in CASES} | {case.family for case in CASES}
    for name in names:
        if name not in known:
            message = (
                f"the case must be a name or a family of the study, got {name!r}; {nearest(name, known)}"
            )
            raise SceneError(message)
    return tuple(case for case in CASES if {case.name, case.family} & set(names))
