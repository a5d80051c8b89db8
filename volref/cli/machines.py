"""--dask: workers on this machine or others, as an executor."""

import argparse
import logging
import signal
import socket
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from volref.errors import FormatError

if TYPE_CHECKING:
    from distributed import Client

# Seconds after which a scheduler is taken for dead, and one that has no workers for useless.
CONNECT_SECONDS, WORKER_SECONDS = 10.0, 60.0

# They tell of every worker that ends, ours included; what concerns the user arrives as an exception.
TALKERS = ("distributed", "tornado.application")


def add_dask(parser: argparse.ArgumentParser) -> None:
    """Add --dask."""
    parser.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="let Dask workers do the work: the address of a scheduler, such as tcp://10.0.0.1:8786, or "
        "'local:N' for N processes on this machine, 'local' for one per core (extra 'distributed')",
    )


@contextmanager
def executor_at(address: str | None) -> Iterator[Executor | None]:
    """Yield the executor that --dask names; None if it names none.

    Raises
    ------
    FormatError
        If Dask is not installed, the address is none, nobody works there, or workers die of a task.
    """
    if address is None:
        yield None
        return
    try:
        from distributed import Client, KilledWorker, LocalCluster
    except ImportError as error:
        message = f"distributed must be installed to use --dask, got no module {error.name!r}; "
        raise FormatError(message + "run: pip install 'volref[distributed]'") from error
    with ExitStack() as stack:
        stack.enter_context(_silence())
        local = address.partition(":")[0] == "local"
        if local:
            # Without a limit: Dask would count mapped pages of the volume and restart its workers.
            settings = {"memory_limit": 0, "dashboard_address": ":0", "silence_logs": logging.CRITICAL}
            workers = _local_workers(address)
            place = stack.enter_context(LocalCluster(n_workers=workers, threads_per_worker=1, **settings))
        else:
            _check_answers(address)
            place = address
        client = stack.enter_context(Client(place, timeout=CONNECT_SECONDS, set_as_default=False))
        _wait_for_workers(client, address)
        if local:
            client.run(_ignore_ctrl_c)
        try:
            yield client.get_executor()
        except KilledWorker as error:
            message = (
                f"--dask workers must outlive their tasks, got {error.allowed_failures + 1} that died of the "
            )
            message += "same one; give each more memory, or start fewer on a machine"
            raise FormatError(message) from error


def _local_workers(address: str) -> int:
    """Return N of an address local:N; by default one worker for each core."""
    from volref.truth.crew import available_cores

    _, colon, count = address.partition(":")
    if not colon:
        return available_cores()
    if count.isdecimal() and 1 <= int(count) <= 1024:
        return int(count)
    message = f"--dask local:N must have a number of workers from 1 to 1024, got {count!r}; "
    raise FormatError(message + "write for instance local:4")


def _check_answers(address: str) -> None:
    """Refuse an address at which nobody answers, before Dask tries for long."""
    from distributed.comm import get_address_host_port

    try:
        socket.create_connection(get_address_host_port(address), timeout=CONNECT_SECONDS).close()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        message = f"--dask must name a scheduler that answers, got {address!r} ({reason}); start one with "
        raise FormatError(message + "'dask scheduler', or pass local:N") from error


def _wait_for_workers(client: "Client", address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=WORKER_SECONDS)
    except TimeoutError as error:
        message = f"--dask must name a scheduler with workers, got none at {address!r} in "
        message += f"{WORKER_SECONDS:g} s; start one with 'dask worker {address}'"
        raise FormatError(message) from error


def _ignore_ctrl_c() -> None:
    """Let this worker ignore what a terminal sends to all of its processes: its client ends it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _silence() -> Iterator[None]:
    loggers = [logging.getLogger(name) for name in TALKERS]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
