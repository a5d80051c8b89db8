"""Records of switches check themselves and say what they hold."""

from dataclasses import dataclass
from typing import Annotated

import pytest

from volref import SceneError
from volref.emulation.switches import Flag, Real, Switches, Whole, Word, check_head, checked_keys, switches_of


@dataclass(frozen=True)
class HotPlate(Switches, group="hot_plate"):
    """A record of one switch of each kind."""

    label: str = "plate"
    heat: Annotated[str, Word("how hot", {"low": "warm", "high": "hot"})] = "low"
    rings: Annotated[int, Whole("rings in use", low=1, high=4)] = 2
    watts: Annotated[float | None, Real("power (None: all there is)", low=0.5, high=2000)] = None
    locked: Annotated[bool, Flag("whether children may not use it")] = False


def test_fields_with_a_rule_are_switches_in_their_order():
    found = switches_of(HotPlate)
    assert [switch.name for switch in found] == ["heat", "rings", "watts", "locked"]
    assert [switch.default for switch in found] == ["low", 2, None, False]
    assert [switch.optional for switch in found] == [False, False, True, False]
    assert found[1].rule == Whole("rings in use", low=1, high=4)


@pytest.mark.parametrize(
    ("switches", "sentence"),
    [
        ({"heat": "Low"}, r"hot_plate.heat must be .*, got 'Low'"),
        ({"heat": None}, r"hot_plate.heat must be"),
        ({"rings": 0}, r"hot_plate.rings must be a whole number from 1 to 4, got 0"),
        ({"rings": 2.0}, r"hot_plate.rings must be a whole number from 1 to 4, got 2.0"),
        ({"rings": True}, r"hot_plate.rings must be a whole number from 1 to 4, got True"),
        ({"watts": 0.25}, r"hot_plate.watts must be at least 0.5, got 0.25"),
        ({"watts": 2001}, r"hot_plate.watts must be at most 2000, got 2001"),
        ({"watts": float("nan")}, r"hot_plate.watts must be finite, got nan"),
        ({"watts": "7"}, r"hot_plate.watts must be a number, got '7'"),
        ({"watts": True}, r"hot_plate.watts must be a number, got True"),
        ({"locked": 0}, r"hot_plate.locked must be true or false, got 0"),
        ({"locked": None}, r"hot_plate.locked must be true or false, got None"),
    ],
)
def test_a_switch_that_breaks_its_rule_is_refused(switches, sentence):
    with pytest.raises(SceneError, match=f"^{sentence}"):
        HotPlate(**switches)


def test_a_record_becomes_plain_data_and_comes_back():
    plate = HotPlate("mine", "high", 3, 7, locked=True)
    assert plate.as_dict() == {"label": "mine", "heat": "high", "rings": 3, "watts": 7.0, "locked": True}
    assert isinstance(plate.watts, float)
    assert HotPlate.from_dict("plate", {"rings": 3}) == HotPlate(rings=3)
    with pytest.raises(
        SceneError, match=r"^plate must have switches it knows, got 'ring'; use one of heat, "
    ):
        HotPlate.from_dict("plate", {"ring": 3})
    with pytest.raises(SceneError, match=r"^plate must be an object of switches, got 'x'"):
        HotPlate.from_dict("plate", "x")


def test_the_head_of_a_document_must_be_the_right_one():
    values = checked_keys("plate", {"format": "volref-plate", "version": 1}, ["format", "version"])
    check_head("plate", values, "volref-plate", 1)
    assert values == {}
    for head in (
        {"format": "x", "version": 1},
        {"format": "volref-plate"},
        {"format": "volref-plate", "version": True},
    ):
        with pytest.raises(SceneError, match=r"; this is another kind of file$"):
            check_head("plate", dict(head), "volref-plate", 1)
