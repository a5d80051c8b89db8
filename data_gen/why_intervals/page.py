"""The page docs/why-intervals.md."""

from collections import Counter
from collections.abc import Iterable, Sequence

from data_gen.why_intervals.criteria import CRITERIA
from data_gen.why_intervals.drawing import TESTED
from data_gen.why_intervals.judging import ANY_MACHINE
from data_gen.why_intervals.prose import (
    BY_SCENE,
    COMMANDS,
    FIGURE,
    HEAD,
    HINDSIGHT,
    LIMITS,
    METHOD,
    OFF_BY,
    RESULT,
    SOURCES,
    UNSEEN,
    WIDTHS,
    filled,
    lines,
)
from data_gen.why_intervals.records import Findings, Interval, Record
from data_gen.why_intervals.scenes import CASES, PIXELS
from data_gen.why_intervals.summary import (
    COLUMNS,
    VISIBLE,
    Column,
    best_thresholds,
    correct,
    hidden,
    keys_of,
    tally,
    visible,
)
from volref.oracle.verdict import INSIDE, LOW_QUALITY, NOT_COMPARABLE, OUTSIDE

# The set of machines that is named nowhere else.
ANY = ANY_MACHINE.name

# How the names of images by real WebGL begin.
WEBGL = "WebGL"


def page(findings: Findings) -> str:
    """Return the page as Markdown."""
    records = findings.records
    parts = (
        "# Why intervals\n",
        _head(records),
        _table(records),
        _result(records),
        "\n" + FIGURE,
        "\n## What is judged\n",
        _method(records),
        "\n## Fault by fault\n",
        _per_fault(records),
        "\n## Faults that do not show\n",
        _hidden(records),
        "\n## Would another threshold do?\n",
        _best(records),
        "\n## Where volref is blind or wrong\n",
        _volref(findings),
        "\n## What an interval does not do\n",
        _limits(records),
        "\n## Where the rules are from\n",
        _sources(findings),
    )
    return "".join(parts)


def _head(records: Sequence[Record]) -> str:
    counts = {"faulty": len(visible(records)), "correct": len(correct(records))}
    commands = COMMANDS.format(webgl=" --webgl" if _by_webgl(records) else "")
    return filled(HEAD, criteria=len(CRITERIA), **counts) + commands


def _table(records: Sequence[Record]) -> str:
    faulty, right = len(visible(records)), len(correct(records))
    rows = [f"| rule | | faults caught of {faulty} | correct images wrongly failed of {right} |"]
    rows.append("|---|---|--:|--:|")
    for column in COLUMNS:
        found = tally(column, records)
        name = f"**{column.name}**" if column.name.startswith("volref") else column.name
        rows.append(f"| {name} | {column.rule} | {found.caught} | {found.failed} |")
    return lines(*rows)


def _result(records: Sequence[Record]) -> str:
    """Return the table in words."""
    rules = [tally(column, records) for column in COLUMNS[: len(CRITERIA)]]
    known = tally(COLUMNS[-1], records)
    status = Counter((record.kind, record.any.status) for record in (*visible(records), *correct(records)))
    return filled(
        RESULT,
        most=max(one.caught for one in rules if one.failed == 0),
        hindsight=max(best.caught for best in best_thresholds(records)),
        least=min((one.failed for one in rules if one.caught == one.faulty), default="no"),
        known=known.caught,
        known_failed=known.failed or "none",
        warned=status["fault", LOW_QUALITY],
        warned_right=status["correct", LOW_QUALITY],
        open_right=status["correct", NOT_COMPARABLE],
    )


def _method(records: Sequence[Record]) -> str:
    machines = dict.fromkeys(record.name for record in correct(records))
    real = "; two implementations of real WebGL draw them too, where a program of theirs is at hand"
    return filled(
        METHOD,
        scenes=len({record.scene for record in records}),
        pixels=PIXELS,
        faults=len(keys_of(records)),
        visible=VISIBLE,
        hidden=len(hidden(records)),
        machines=", ".join(name for name in machines if not name.startswith(WEBGL)),
        real=real if _by_webgl(records) else "",
    )


def _per_fault(records: Sequence[Record]) -> str:
    """Return what each fault moves and what misses it."""
    rows = ["| fault | scenes | off by | missed in all of them by | in some by | volref catches |"]
    rows.append("|---|--:|--:|---|---|--:|")
    for key in keys_of(records):
        images = [record for record in visible(records) if record.name == key]
        if images:
            sizes = [record.apart for record in images]
            size = f"{min(sizes)}…{max(sizes)}" if min(sizes) < max(sizes) else f"{sizes[0]}"
            always, partly = _missing(images)
            known = sum(record.known.caught for record in images)
            rows.append(f"| {key} | {len(images)} | {size} | {always} | {partly} | {known} |")
    return filled(OFF_BY) + lines(*rows)


def _missing(images: Sequence[Record]) -> tuple[str, str]:
    """Return the names of the projects whose rule misses all the images, and some of them."""
    always, partly = [], []
    for column in COLUMNS[: len(CRITERIA)]:
        missed = sum(not column.rejects(image) for image in images)
        if missed == len(images):
            always.append(column.name)
        elif missed:
            partly.append(column.name)
    return ", ".join(always) or "-", ", ".join(partly) or "-"


def _hidden(records: Sequence[Record]) -> str:
    """Return what is said of faults that do not show."""
    unseen = hidden(records)
    equal = [record for record in unseen if record.apart == 0]
    crying = {column.name: sum(map(column.rejects, equal)) for column in COLUMNS}
    ones = [record for record in unseen if record.apart == 1]
    return filled(
        UNSEEN,
        unseen=len(unseen),
        equal=len(equal),
        crying=", ".join(f"{name} {count}" for name, count in crying.items() if count) or "nobody does",
        ones=len(ones),
        known=sum(record.known.caught for record in ones),
    )


def _best(records: Sequence[Record]) -> str:
    """Return what other thresholds could do."""
    found = sorted(best_thresholds(records), key=lambda one: one.caught)
    return filled(HINDSIGHT) + lines(
        f"| measure | threshold | faults caught of {len(visible(records))} |",
        "|---|--:|--:|",
        *(f"| {LABELS[best.measure]} | {best.threshold:.4g} | {best.caught} |" for best in found),
        f"| **volref** | derived for each pixel | {tally(COLUMNS[-1], records).caught} |",
    )


LABELS = {
    "mismatch_strict": "pixels by pixelmatch 0.1",
    "mismatch_playwright": "pixels by pixelmatch 0.2",
    "vtk": "VTK's SSIM in Lab",
    "ssim": "SSIM",
    "psnr": "PSNR in dB",
    "flip": "mean FLIP",
    "fuzzy": "dEQP's fuzzyCompare",
    "correlation": "correlation",
    "rms": "RMS in 1/255",
    "above_blender": "pixels above 0.016",
    "max": "largest difference in 1/255",
}


def _volref(findings: Findings) -> str:
    """Return where volref passes a fault or fails a correct image, and how wide its intervals are."""
    records = findings.records
    return (
        _missed(records)
        + _wrongly("with the machine named", correct(records), COLUMNS[-1])
        + _by_scene(findings)
        + _wrongly("by `webgl-highp`", correct(records), COLUMNS[-2])
        + _widths(findings.intervals)
    )


def _missed(records: Sequence[Record]) -> str:
    """Return which faults that show are passed though the machine is named."""
    missed = [record for record in visible(records) if not record.known.caught]
    if not missed:
        return "\nFaults that show and pass, with the machine named: none.\n"
    return f"\nFaults that show and pass, with the machine named: {len(missed)}.\n" + lines(
        "| scene | fault | off by |",
        "|---|---|--:|",
        *(f"| {CASES[one.scene].title} | {one.name} | {one.apart} |" for one in missed),
    )


def _by_scene(findings: Findings) -> str:
    """Return which part of the faults a set of machines lets through, and how wide its intervals are."""
    faulty = visible(findings.records)
    widths = {one.scene: one for one in findings.intervals if one.device == ANY}
    rows = []
    for scene in dict.fromkeys(record.scene for record in faulty):
        status = Counter(record.any.status for record in faulty if record.scene == scene)
        passed = status[INSIDE] + status[NOT_COMPARABLE]
        counts = f"{status.total()} | {status[OUTSIDE]} | {status[LOW_QUALITY]} | {passed}"
        rows.append(f"| {CASES[scene].title} | {counts} | {widths[scene].p99:.1f} |")
    return filled(BY_SCENE, alien=_alien(findings.records)) + lines(
        "| scene | faults that show | caught | with a warning | passed | p99 in 1/255 |",
        "|---|--:|--:|--:|--:|--:|",
        *rows,
    )


def _alien(records: Sequence[Record]) -> str:
    """Return the scenes in which the machine that faults are drawn on is not in the set."""
    outside = [one for one in correct(records) if one.name == TESTED.name and one.any.caught]
    return ", ".join(CASES[one.scene].title for one in outside) or "none"


def _wrongly(how: str, images: Iterable[Record], column: Column) -> str:
    """Return which correct images are failed."""
    failed = Counter(image.name for image in images if column.rejects(image))
    names = ", drawn by " + ", ".join(f"{name} ({count})" for name, count in failed.items()) if failed else ""
    return filled(f"Correct images that fail, {how}: {sum(failed.values()) or 'none'}{names}.")


def _widths(intervals: Sequence[Interval]) -> str:
    rows = ["| device | p50 | p99 | ambiguous |", "|---|--:|--:|--:|"]
    for device in dict.fromkeys(one.device for one in intervals):
        own = [one for one in intervals if one.device == device]
        p50, p99 = (_span([getattr(one, name) for one in own], "{:.2f}") for name in ("p50", "p99"))
        share = _span([100 * one.ambiguous for one in own], "{:.1f}")
        rows.append(f"| `{device}` | {p50} | {p99} | {share} % |")
    return filled(WIDTHS) + lines(*rows)


def _span(values: Sequence[float], form: str) -> str:
    return f"{form.format(min(values))}…{form.format(max(values))}"


def _limits(records: Sequence[Record]) -> str:
    right = correct(records)
    return filled(
        LIMITS,
        any_failed=tally(COLUMNS[-2], records).failed,
        unequal=sum(record.measures["max"] > 0 for record in right),
        correct=len(right),
    )


def _sources(findings: Findings) -> str:
    rows = [f"| {one.name} | {one.rule} | {one.source} |" for one in CRITERIA]
    made_by = ", ".join(f"{name} {version}" for name, version in findings.made_by.items())
    cases = [CASES[name] for name in dict.fromkeys(record.scene for record in findings.records)]
    scenes = "; ".join(f"{case.title}, by `{case.pipeline.name}`" for case in cases)
    return (
        lines("| project | rule | read in |", "|---|---|---|", *rows)
        + filled(SOURCES)
        + filled(f"Scenes: {scenes}.")
        + filled(f"Made by {made_by}.")
    )


def _by_webgl(records: Sequence[Record]) -> bool:
    return any(record.name.startswith(WEBGL) for record in records)
