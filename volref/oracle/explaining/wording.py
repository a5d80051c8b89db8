"""An explanation in words."""

from volref.oracle.explaining.findings import Finding, Part
from volref.oracle.faults.separating import charts_for

# Numbers of a percentage that is nearly all are not rounded up to all of it.
ALL = 0.995


def explained_by(best: Finding, runner_up: Finding | None) -> str:
    """Return that faults explain an image, and what else comes near."""
    message = f"{words_of(best)}; explains {share(best)} of what is outside"
    return message + (f"; next: {shortly(runner_up)}" if runner_up else "")


def not_identifiable(best: Finding, rivals: list[Finding]) -> tuple[str, tuple[str, ...]]:
    """Return that several faults draw the same picture here, and which charts would tell them apart."""
    names = [words_of(best), *(words_of(one) for one in rivals)]
    charts = tuple(dict.fromkeys(chart for one in rivals for chart in charts_for(best.rows[0], one.rows[0])))
    message = (
        f"not identifiable in this scene: {', or '.join(names)}; each explains {share(best)} of what is "
    )
    return message + f"outside; render the chart {' or '.join(repr(chart) for chart in charts)}", charts


def none_of_these(best: Finding | None) -> str:
    """Return that no fault explains an image, and what comes nearest."""
    message = "none of the known faults explains the image"
    if best is None or best.explained <= 0:
        return message
    return message + f"; the nearest: {shortly(best)} of what is outside"


def words_of(finding: Finding) -> str:
    """Return what is wrong, in words, with the names of the faults and their strengths."""
    both = "; and ".join(_part(part) for part in finding.parts)
    return both if len(finding.parts) == 1 else f"two faults: {both}"


def shortly(finding: Finding) -> str:
    """Return the names of faults and what they explain."""
    names = " + ".join(f"{part.fault.key}{_strength(part, ' at ')}" for part in finding.parts)
    return f"{names}, {share(finding)}"


def share(finding: Finding) -> str:
    """Return a share in percent; all of it only if it is.

    Examples
    --------
    >>> share(Finding((), 0.9996)), share(Finding((), 1.0)), share(Finding((), 0.42))
    ('99.9 %', '100 %', '42 %')
    """
    value = finding.explained
    if ALL < value < 1:
        return f"{min(100 * value, 99.9):.1f} %"
    return f"{100 * value:.0f} %"


def _part(part: Part) -> str:
    return f"{part.fault.title} ({part.fault.key}{_strength(part, ', strength ')})"


def _strength(part: Part, before: str) -> str:
    alone = part.fault.strengths == (1.0,)
    return "" if alone else f"{before}{part.strength:.3g}"
