"""Random switches, drawn from what the switches say of themselves."""

from hypothesis import strategies as st

from volref.emulation.pipeline import GROUPS, Pipeline
from volref.emulation.switches import Flag, Whole, Word, switches_of


def values_of(switch):
    """Return a strategy for the values of a switch."""
    rule = switch.rule
    if isinstance(rule, Word):
        found = st.sampled_from(sorted(rule.choices))
    elif isinstance(rule, Flag):
        found = st.booleans()
    elif isinstance(rule, Whole):
        found = st.integers(rule.low, rule.high)
    else:
        found = st.floats(rule.low, rule.high)
    return st.none() | found if switch.optional else found


def groups(kind):
    """Return a strategy for records of switches; the tone map's three numbers are put in order."""
    switches = {switch.name: values_of(switch) for switch in switches_of(kind)}
    if "mid" in switches:
        ends = ("low", "mid", "high")
        rest = st.fixed_dictionaries({name: one for name, one in switches.items() if name not in ends})
        three = st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3, unique=True).map(sorted)
        return st.builds(lambda most, some: kind(**most, **dict(zip(ends, some, strict=True))), rest, three)
    return st.builds(kind, **switches)


def pipelines():
    """Return a strategy for pipelines of any switches."""
    domains = st.none() | st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=2, unique=True).map(
        lambda ends: tuple(sorted(ends))
    )
    parts = {name: groups(kind) for name, kind in GROUPS.items()}
    return st.builds(Pipeline, st.text(min_size=1), st.text(), st.text(), domains, **parts)
