"""Work over an executor: results as they come, and nothing left behind when it ends.

Any `concurrent.futures.Executor` will do.  Nothing here knows what the work is.
"""

import contextlib
import math
import queue
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from itertools import chain, islice
from typing import Any, Generic, TypeAlias, TypeVar

Result = TypeVar("Result")
Numbered: TypeAlias = tuple[int, tuple[Any, ...]]

# Tasks handed over before their results are back: more than the workers of most clusters, and few enough
# that what the tasks carry takes little memory.
AHEAD = 256


def results(
    executor: Executor,
    function: Callable[..., Result],
    items: Iterable[tuple[Any, ...]],
    *,
    deadline: float = math.inf,
    ahead: int = AHEAD,
    threads: int = 1,
) -> Generator[tuple[int, Result | None], None, None]:
    """Yield (i, function(*item)) for each item, number i, in the order in which they end.

    Items are taken as they are needed.  Close the iterator (`contextlib.closing`) to cancel what has not
    begun, which an exception in a task or between two results does too.  If the executor breaks, because one
    of its processes died, what is left is done in this process, with a warning.

    Parameters
    ----------
    executor
        Who does the work.  It is not shut down.
    function, items
        The work; for other processes both have to be pickled.
    deadline
        Time by `time.perf_counter` after which nothing is handed over and what has not begun is cancelled;
        the result of such items is None.
    ahead
        How many items are handed over before their results are back.
    threads
        Threads of this process to work with if the executor breaks.

    Examples
    --------
    >>> with ThreadPoolExecutor(2) as pool:
    ...     sorted(results(pool, pow, [(2, 3), (2, 4)]))
    [(0, 8), (1, 16)]
    """
    waiting = enumerate(items)
    pending: _Pending[Result] = _Pending(executor, function)
    late = False
    try:
        while True:
            if not late and deadline < time.perf_counter():
                late = True
                pending.cancel()
            if not (late or pending.lost):
                pending.hand_over(islice(waiting, ahead - len(pending)))
            if not len(pending):
                break
            future = pending.next_finished(math.inf if late else deadline)
            if future is not None:
                yield from pending.collect(future, late=late)
    finally:
        pending.cancel()
    if late:
        yield from ((number, None) for number, _ in chain(pending.lost, waiting))
    elif pending.lost:
        yield from _done_here(function, chain(pending.lost, waiting), threads)


class _Pending(Generic[Result]):
    """Futures handed over to an executor, and the items that it lost."""

    def __init__(self, executor: Executor, function: Callable[..., Result]) -> None:
        self.executor, self.function = executor, function
        self.lost: list[Numbered] = []
        self._items: dict[Future[Result], Numbered] = {}
        self._finished: queue.SimpleQueue[Future[Result]] = queue.SimpleQueue()

    def __len__(self) -> int:
        return len(self._items)

    def hand_over(self, items: Iterable[Numbered]) -> None:
        """Hand over items; those that a broken executor does not take are lost."""
        for number, item in items:
            try:
                future = self.executor.submit(self.function, *item)
            except BrokenExecutor:
                self.lost.append((number, item))
                return
            self._items[future] = number, item
            future.add_done_callback(self._finished.put)

    def next_finished(self, deadline: float) -> Future[Result] | None:
        """Wait for a future that is done or cancelled; None if none is by the deadline."""
        timeout = None if deadline == math.inf else max(deadline - time.perf_counter(), 0.0)
        with contextlib.suppress(queue.Empty):
            return self._finished.get(timeout=timeout)
        return None

    def collect(self, future: Future[Result], *, late: bool) -> Iterator[tuple[int, Result | None]]:
        """Yield the number and result of a finished future, unless it is lost; what is late has none."""
        number, item = self._items.pop(future)
        try:
            result = future.result()
        except (BrokenExecutor, CancelledError):
            if late:
                yield number, None
            else:
                self.lost.append((number, item))
        else:
            yield number, result

    def cancel(self) -> None:
        """Cancel what has not begun."""
        for future in list(self._items):
            future.cancel()


def _done_here(
    function: Callable[..., Result], items: Iterable[Numbered], threads: int
) -> Iterator[tuple[int, Result | None]]:
    """Do in this process what a broken executor left."""
    message = "the executor broke, as when a worker process is killed: what it had not finished is done in "
    warnings.warn(message + "this process", RuntimeWarning, stacklevel=2)
    numbers: list[int] = []

    def left() -> Iterator[tuple[Any, ...]]:
        for number, item in items:
            numbers.append(number)
            yield item

    with ThreadPoolExecutor(threads) as pool:
        for place, result in results(pool, function, left(), ahead=2 * threads):
            yield numbers[place], result
