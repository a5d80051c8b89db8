"""`results`: work over any executor, in whatever order it ends."""

import threading
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import closing

import pytest
from hypothesis import given
from hypothesis import strategies as st

from volref.truth import workers
from volref.truth.workers import results


class Desk(Executor):
    """An executor whose tasks end when and as the test says; it counts what it was given and not yet did."""

    def __init__(self, order=None, breaks_at=None):
        self.order, self.breaks_at = order or (lambda _: 0), breaks_at
        self.open, self.taken, self.most_open = [], 0, 0

    def submit(self, function, *words):
        if self.breaks_at is not None and self.taken >= self.breaks_at:
            raise BrokenExecutor
        future = Future()
        self.taken += 1
        self.open.append((future, function, words))
        self.most_open = max(self.most_open, len(self.open))
        return future

    def work(self):
        """End one task; all of them in error if the executor breaks now."""
        if self.breaks_at is not None and self.taken >= self.breaks_at:
            for future, *_ in self.open:
                future.set_exception(BrokenExecutor("a process died"))
            self.open = []
            return
        future, function, words = self.open.pop(self.order(len(self.open)))
        if future.set_running_or_notify_cancel():
            future.set_result(function(*words))


@pytest.fixture
def working(monkeypatch):
    """Let a desk end a task whenever somebody waits for one."""

    def on(desk):
        wait = workers._Pending.next_finished

        def next_finished(self, deadline):
            if desk.open:
                desk.work()
            return wait(self, deadline)

        monkeypatch.setattr(workers._Pending, "next_finished", next_finished)
        return desk

    return on


def square(number):
    return number * number


def squares(count):
    return [(i, i * i) for i in range(count)]


def items(count):
    return ((i,) for i in range(count))


@given(st.integers(0, 12), st.integers(1, 4), st.integers(1, 5))
def test_every_item_has_its_result_whatever_the_threads_and_however_many_are_handed_over(
    count, threads, ahead
):
    with ThreadPoolExecutor(threads) as pool:
        assert sorted(results(pool, square, items(count), ahead=ahead)) == squares(count)


@pytest.mark.parametrize("order", [lambda _: 0, lambda many: many - 1, lambda many: many // 2])
def test_results_come_in_the_order_in_which_they_end(working, order):
    desk = working(Desk(order))
    got = list(results(desk, square, items(9), ahead=4))
    assert sorted(got) == squares(9)
    assert (got == squares(9)) == (order(4) == 0)


def test_no_more_is_handed_over_than_asked_for_and_items_are_taken_when_they_are_needed(working):
    desk, taken = working(Desk()), []

    def watched():
        for i in range(10):
            taken.append(i)
            yield (i,)

    for done, _ in enumerate(results(desk, square, watched(), ahead=3), start=1):
        assert len(taken) <= done + 3
    assert desk.most_open == 3


def test_an_exception_in_a_task_is_raised_and_cancels_what_has_not_begun(working):
    desk = working(Desk())
    with pytest.raises(ZeroDivisionError):
        list(results(desk, lambda number: 1 // number, items(5), ahead=5))
    assert [future.cancelled() for future, *_ in desk.open] == [True] * 4


def test_closing_cancels_what_has_not_begun(working):
    desk = working(Desk())
    with closing(results(desk, square, items(5), ahead=5)) as done:
        assert next(done) == (0, 0)
    assert [future.cancelled() for future, *_ in desk.open] == [True] * 4


class Clock:
    now = 0.0

    def perf_counter(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    """The time is what the test says."""
    made = Clock()
    monkeypatch.setattr(workers, "time", made)
    return made


def test_after_the_deadline_nothing_is_handed_over_and_what_has_not_begun_has_no_result(working, clock):
    desk = working(Desk())
    done = results(desk, square, items(9), ahead=3, deadline=1.0)
    first = next(done)
    clock.now = 2.0
    assert (first, list(done)) == ((0, 0), [(i, None) for i in range(1, 9)])
    assert desk.taken == 3


def test_a_deadline_that_has_passed_leaves_everything(clock):
    clock.now = 2.0
    with ThreadPoolExecutor(1) as pool:
        assert list(results(pool, square, items(3), deadline=1.0)) == [(i, None) for i in range(3)]


def test_what_runs_at_the_deadline_is_waited_for(clock):
    begun, release = threading.Event(), threading.Event()

    def wait(number):
        begun.set()
        release.wait()
        return number * number

    def three():
        yield from items(3)
        begun.wait()
        clock.now = 2.0

    with ThreadPoolExecutor(1) as pool:
        done = results(pool, wait, three(), deadline=1.0)
        assert [next(done), next(done)] == [(1, None), (2, None)]
        release.set()
        assert list(done) == [(0, 0)]


@pytest.mark.parametrize("breaks_at", [0, 1, 4, 7])
@pytest.mark.parametrize("threads", [1, 2])
def test_what_a_broken_executor_left_is_done_here_with_a_warning(working, breaks_at, threads):
    desk = working(Desk(breaks_at=breaks_at))
    with pytest.warns(RuntimeWarning, match="the executor broke") as told:
        got = list(results(desk, square, items(8), ahead=2, threads=threads))
    assert sorted(got) == squares(8)
    assert len(told) == 1


def test_what_somebody_else_cancelled_is_done_here(working):
    desk = working(Desk())
    work = results(desk, square, items(6), ahead=6)
    next(work)
    desk.open[2][0].cancel()
    with pytest.warns(RuntimeWarning, match="the executor broke"):
        assert sorted([(0, 0), *work]) == squares(6)
