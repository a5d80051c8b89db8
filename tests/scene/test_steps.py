"""Searching sorted numbers by an even grid: the answer is that of a binary search, bit for bit."""

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from volref.scene.steps import MOST_TURNS, steps_of

NUMBERS = st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40)


@given(numbers=NUMBERS, values=NUMBERS)
@example(numbers=[0.0, 5e-324], values=[0.0, 5e-324])
@example(numbers=[1.0] * 20, values=[1.0, 2.0])
@example(numbers=[0.0, 1e6, *np.nextafter(1e6, 0) * np.ones(9)], values=[1e6])
def test_counts_are_those_of_a_binary_search(numbers, values):
    ordered = np.sort(numbers)
    at = np.concatenate((values, ordered, np.nextafter(ordered, -np.inf), np.nextafter(ordered, np.inf)))
    found = steps_of(ordered).count_up_to(at)
    assert found.tolist() == np.searchsorted(ordered, at, side="right").tolist()


def test_even_numbers_take_one_comparison_and_crowded_ones_a_search():
    assert steps_of(np.arange(0.5, 360.0)).turns == 1
    crowded = np.append(np.linspace(0, 1e-6, MOST_TURNS + 9), 360.0)
    assert steps_of(crowded).turns > MOST_TURNS
