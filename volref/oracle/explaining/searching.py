"""The search: all faults at their listed strengths, the best ones' strengths fitted, then pairs."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from volref.oracle.explaining.findings import Finding, Part, ranked
from volref.oracle.explaining.trying import Trials, key_of
from volref.oracle.faults.fault import Fault, Subject
from volref.oracle.faults.making import strengths_for

# What a single fault has to explain for no pair to be looked for.
ENOUGH = 0.95

# Once a fault explains `SETTLED`, only those that explain `NEAR` may be its rivals and have theirs fitted.
SETTLED, NEAR = 0.99, 0.5

# How many of the best faults have their strength fitted, and are kept for the whole image.
FITTED, KEPT = 8, 8

# How many of the best faults are tried together with every other one.
LEADING = 3

# Steps of a golden section, each of which leaves 0.62 of the span, and of Gauss and Newton after them.
STEPS, NEWTON_STEPS, GOLDEN = 2, 4, (5**0.5 - 1) / 2

# How many of the best are searched further where they do not settle it, and by how many sections.
POLISHED, POLISHING = 2, 6

# Pictures at strengths closer than this share of the span differ by noise as much as by a slope.
LEAST_GAP = 0.02

# Shares of the second of two pictures in a mixture.
MIXTURES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)

# Strengths closer than this share of the span are one.
CLOSE = 2e-4


def singles(trials: Trials, faults: list[Fault]) -> list[Finding]:
    """Return what each fault explains, at the best of its strengths."""
    plan = [Part(one, strength) for one in faults for strength in strengths_for(one, trials.subject)]
    trials.expected = len(plan) + FITTED * (STEPS + NEWTON_STEPS) + KEPT
    found = [trials.tried(part) for part in plan]
    found = ranked([*found, *_between(trials, found)])
    found = ranked([*found, *(_refined(trials, one, 0) for one in _worth_fitting(found))])
    unsure = [one for one in found[:POLISHED] if NEAR < one.explained < SETTLED]
    return ranked([*found, *(_polished(trials, one) for one in unsure)])


def _polished(trials: Trials, finding: Finding) -> Finding:
    """Return a finding with its strength searched near by: some pictures change by leaps."""
    fault, strength = finding.parts[0].fault, finding.parts[0].strength
    if not fault.fitted:
        return finding
    known = sorted(found.parts[0].strength for found in trials.seen.values() if found.key == fault.key)
    at = known.index(strength)
    low, high = known[max(at - 1, 0)], known[min(at + 1, len(known) - 1)]
    seen = _sections(lambda other: trials.tried(Part(fault, other)), low, high, POLISHING)
    return max([finding, *seen], key=lambda one: one.explained)


def _between(trials: Trials, found: list[Finding]) -> list[Finding]:
    """Return what faults explain between two listed strengths, where a mixture of those does better."""
    listed: dict[str, list[Finding]] = {}
    for one in found:
        if one.parts[0].fault.fitted and np.isfinite(one.explained):
            listed.setdefault(one.key, []).append(one)
    better = []
    for several in listed.values():
        several.sort(key=lambda finding: finding.parts[0].strength)
        mixed = [_mixed(trials, one, other) for one, other in pairwise(several)]
        explained, strength = max(mixed, default=(-np.inf, 0.0))
        if explained > max(finding.explained for finding in several):
            better.append(trials.tried(Part(several[0].parts[0].fault, strength)))
    return better


def _mixed(trials: Trials, one: Finding, other: Finding) -> tuple[float, float]:
    """Return how much the best mixture of two pictures explains, and the strength that stands for it."""
    here, there = (trials.looked_at[key_of(finding.parts)] for finding in (one, other))
    assert here is not None
    assert there is not None
    low, high = one.parts[0].strength, other.parts[0].strength
    return max(
        (trials.measure.explained((1 - share) * here + share * there), (1 - share) * low + share * high)
        for share in MIXTURES
    )


def _worth_fitting(found: list[Finding]) -> list[Finding]:
    """Return the best findings with a strength to fit: once the image is explained, those that come near."""
    fitted = [one for one in found if one.parts[0].fault.fitted]
    if found and found[0].explained >= SETTLED:
        return [one for one in fitted if one.explained >= NEAR]
    return fitted[:FITTED]


def pairs_of(trials: Trials, faults: list[Fault], alone: list[Finding]) -> list[Finding]:
    """Return what the best faults explain together with another one."""
    leading = [one.parts[0] for one in alone[:LEADING]]
    others = [one.parts[0] for one in alone]
    plan = {
        _in_order(faults, one, other): None
        for one in leading
        for other in others
        if one.fault.key != other.fault.key
    }
    trials.expected = trials.count + len(plan) + 8 * (STEPS + NEWTON_STEPS)
    found = ranked([trials.tried(*pair) for pair in plan])
    better = []
    for one in found[:2]:
        for place in (0, 1, 0, 1):
            one = _refined(trials, one, place)
        better.append(one)
    return ranked([*found[:KEPT], *better])


def _in_order(faults: list[Fault], one: Part, other: Part) -> tuple[Part, Part]:
    keys = [fault.key for fault in faults]
    first, second = sorted((one, other), key=lambda part: keys.index(part.fault.key))
    return first, second


def _refined(trials: Trials, finding: Finding, place: int) -> Finding:
    """Return a finding with the strength of one of its faults fitted: golden sections, then Gauss-Newton."""
    part = finding.parts[place]
    if not part.fault.fitted or finding.explained >= 1.0:
        return finding

    def at(strength: float) -> Finding:
        parts = list(finding.parts)
        parts[place] = Part(part.fault, strength)
        return trials.tried(*parts)

    low, high = _span(part, trials.subject)
    seen = [finding, *_sections(at, low, high, STEPS)]
    for _ in range(NEWTON_STEPS):
        seen.sort(key=lambda one: -one.explained)
        strength = _newton(trials, seen, place, LEAST_GAP * (high - low))
        if strength is None or not low <= strength <= high or _known(seen, strength, place, high - low):
            break
        seen.append(at(strength))
    return max(seen, key=lambda one: one.explained)


def _known(seen: list[Finding], strength: float, place: int, span: float) -> bool:
    """Tell whether a strength has been tried, or one so close that it makes no difference."""
    return any(abs(one.parts[place].strength - strength) < CLOSE * span for one in seen)


def _sections(at: Callable[[float], Finding], low: float, high: float, steps: int) -> list[Finding]:
    """Return what is found where golden sections of a span lead to."""
    inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    seen: list[Finding] = []
    for _ in range(steps):
        one, other = (at(strength) for strength in inner)
        seen += [one, other]
        if one.explained >= other.explained:
            high = inner[1]
            inner = [high - GOLDEN * (high - low), inner[0]]
        else:
            low = inner[0]
            inner = [inner[1], low + GOLDEN * (high - low)]
    return seen


def _newton(trials: Trials, seen: list[Finding], place: int, gap: float) -> float | None:
    """Return where the best strength lies if pictures change evenly from the best to one some way off.

    Differences count by their size, not its square: each is divided by it, and by a level at least.
    """
    best, strength = seen[0], seen[0].parts[place].strength
    others = (one for one in seen[1:] if abs(one.parts[place].strength - strength) >= gap)
    near = min(others, key=lambda one: abs(one.parts[place].strength - strength), default=None)
    here = trials.looked_at[key_of(best.parts)]
    there = None if near is None else trials.looked_at[key_of(near.parts)]
    if near is None or here is None or there is None:
        return None
    slope = (there - here) / (near.parts[place].strength - strength)
    left = trials.measure.image - here
    weight = trials.measure.weight / (np.abs(left) + 1 / 255)
    steepness = float(np.sum(weight * slope * slope))
    if steepness == 0:
        return None
    moved = strength + float(np.sum(weight * slope * left)) / steepness
    return None if moved == strength else moved


def _span(part: Part, subject: Subject) -> tuple[float, float]:
    """Return between which strengths the best one lies, if one of the listed ones is the best of those."""
    listed = sorted({*strengths_for(part.fault, subject), part.strength})
    at = listed.index(part.strength)
    gaps = np.diff(listed)
    usual = float(np.min(gaps)) if len(gaps) else 0.5 * abs(part.strength)
    low = listed[at - 1] if at else _beyond(part.strength, -usual)
    high = listed[at + 1] if at + 1 < len(listed) else _beyond(part.strength, usual)
    return low, high


def _beyond(strength: float, by: float) -> float:
    """Return a strength farther out; not through 0, where a fault is another one: half as far."""
    moved = strength + by
    return moved if strength == 0 or strength * moved > 0 else strength / 2
