"""Goldens of many recipes, over any executor: each is made by itself and appears whole or not at all."""

from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias, TypeVar

from volref.errors import FormatError
from volref.golden.reading import load_bundle
from volref.golden.recipe import Recipe, subject_of
from volref.golden.writing import write_subject
from volref.truth.workers import results

Result = TypeVar("Result")

# Called now and then with (tasks done, tasks in all).
Progress: TypeAlias = Callable[[int, int], None]


@dataclass(frozen=True)
class Made:
    """A golden and its folder: "made", or "kept" because it was there already, of the same recipe."""

    name: str
    folder: Path
    state: str


def make_goldens(
    recipes: Iterable[Recipe],
    out: str | Path,
    *,
    executor: Executor | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> list[Made]:
    """Make the golden bundles of recipes, each in a folder of its name in `out`.

    One that is there already, undamaged and of the same recipe, is kept: a run that was interrupted goes on
    where it stopped, and two at a time do not clash.

    Parameters
    ----------
    executor
        Who makes them, any `concurrent.futures.Executor`; None: this process, one after the other.  On other
        machines `out` has to be a folder that all of them share.
    overwrite
        Whether all are made anew.
    progress
        Called with (done, in all) after each.

    Raises
    ------
    FormatError
        If a folder is there that is no bundle of the same recipe, or one cannot be written.
    SceneError
        If a program cannot draw a scene.
    """
    place = Path(out)
    tasks: list[tuple[object, ...]] = [(recipe, place) for recipe in recipes]
    return work(remade if overwrite else made, tasks, executor, progress)


def work(
    function: Callable[..., Result],
    tasks: list[tuple[object, ...]],
    executor: Executor | None,
    progress: Progress | None,
) -> list[Result]:
    """Return function(*task) of each task in their order, computed here or by an executor."""
    found: dict[int, Result] = {}
    here = ((number, function(*task)) for number, task in enumerate(tasks))
    with closing(here if executor is None else results(executor, function, tasks)) as ended:
        for number, result in ended:
            assert result is not None
            found[number] = result
            if progress is not None:
                progress(len(found), len(tasks))
    return [found[number] for number in range(len(tasks))]


def made(recipe: Recipe, out: Path) -> Made:
    """Make a golden, or keep the one that is there."""
    folder = out / recipe.name
    if _is_there(folder, recipe):
        return Made(recipe.name, folder, "kept")
    try:
        _write(recipe, folder, overwrite=False)
    except FormatError:
        # Another process may have made the same one meanwhile.
        if _is_there(folder, recipe):
            return Made(recipe.name, folder, "kept")
        raise
    return Made(recipe.name, folder, "made")


def remade(recipe: Recipe, out: Path) -> Made:
    """Make a golden anew."""
    _write(recipe, out / recipe.name, overwrite=True)
    return Made(recipe.name, out / recipe.name, "made")


def _write(recipe: Recipe, folder: Path, *, overwrite: bool) -> None:
    about = {"name": recipe.name, "title": recipe.title}
    subject, document = subject_of(recipe), dict(recipe.document)
    write_subject(folder, subject, **about, recipe=document, truth=recipe.truth, overwrite=overwrite)


def _is_there(folder: Path, recipe: Recipe) -> bool:
    """Whether a folder is the undamaged bundle of a recipe."""
    return folder.is_dir() and load_bundle(folder).manifest["recipe"] == dict(recipe.document)
