"""Work by the workers of a Dask cluster, which come and go."""

from __future__ import annotations

import asyncio
import re
import time
import traceback
from collections.abc import Callable, Collection
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from energymargin.base.errors import ExecutorError, needs_extra
from energymargin.evaluate.parallel import Done, RemoteWorkers

if TYPE_CHECKING:
    from distributed import Client

CONNECT = 5.0  # s; for the first connection, during which Dask tries again and again
LOOK = 0.5  # s; between two questions for the workers
ANSWER = 2.0  # s; until a scheduler that is asked for its workers is asked another time
CLOSE = 1.0  # s; to leave the cluster


@dataclass(frozen=True)
class Dask:
    """The workers of a Dask cluster; each of their threads scores a problem at a time.

    Needs the extra [cluster], here and on the workers. Problems are sent to them as JSON, so
    regions made of a Python predicate need threads, and so does an em.Policy whose code cannot be
    pickled.
    """

    scheduler: str | Client
    """Its address, such as tcp://127.0.0.1:8786, or a Client."""
    notice: Callable[[str], None] | None = None
    """Called with a line of text if there are no workers, or one is gone."""

    def __post_init__(self) -> None:
        """Raises ValueError on a string that is no address."""
        if isinstance(self.scheduler, str) and not re.search(r"[\w\]]:\d+$", self.scheduler):
            expected = "expected an address such as tcp://127.0.0.1:8786"
            raise ValueError(f"scheduler is {self.scheduler!r}, {expected}")

    def workers(self) -> RemoteWorkers:
        """As Executor.workers. Raises ConnectionError if there is no scheduler."""
        return _DaskWorkers(
            self.scheduler, (lambda _text: None) if self.notice is None else self.notice
        )


class _DaskWorkers(RemoteWorkers):
    """The threads of a cluster's workers. Dask replaces those that die, and does their work again;
    what ends worker after worker it calls a KilledWorker."""

    def __init__(self, scheduler: str | Client, notice: Callable[[str], None]) -> None:
        super().__init__(0)
        self._notice = notice
        self._client, self._is_ours = _connected(scheduler), isinstance(scheduler, str)
        self._executor = self._client.get_executor(pure=False)
        self._address = self._client.scheduler.address
        self._threads: dict[str, int] | None = None  # of each worker
        self._next_look = 0.0

    @property
    def slots(self) -> int:
        """The workers' threads, as of half a second ago. Raises ConnectionError if the scheduler is
        gone."""
        if time.monotonic() >= self._next_look:
            self._next_look = time.monotonic() + LOOK
            if self._client.status != "running":
                raise self._away()
            with suppress(OSError, asyncio.TimeoutError):
                ask = self._client.scheduler.ncores
                self._see(dict(self._client.sync(ask, callback_timeout=ANSWER)))
        return sum((self._threads or {}).values())

    def stop(self, chunks: Collection[Future[Done]]) -> None:
        """As Workers.stop; a chunk that a worker has begun runs to its end there."""
        if self._client.status == "running":
            self._executor.shutdown(wait=False)
            self._executor = self._client.get_executor(pure=False)

    def close(self) -> None:
        """Leaves the cluster; a Client that was given stays."""
        if self._is_ours:
            self._client.close(timeout=CLOSE)

    def is_lost(self, error: Exception) -> bool:
        """As Workers.is_lost: a worker took them with it while they were fetched, at which Dask's
        executor itself fails."""
        last = traceback.extract_tb(error.__traceback__)[-1:]
        fails = [at.name for at in last] == ["_cascade_future"]
        return fails and isinstance(error, AttributeError | ValueError)

    def explained(self, error: Exception) -> Exception:
        """As Workers.explained."""
        from distributed import KilledWorker

        if isinstance(error, KilledWorker):
            return ExecutorError(error)
        if isinstance(error, CancelledError):  # all are, with the scheduler
            return self._away()
        if isinstance(error, ImportError):
            text = f"the workers of {self._address} cannot run this energymargin: {error}"
            return RuntimeError(f"{text}; they need the same release of it, and the same Python")
        return error

    def _away(self) -> ConnectionError:
        return ConnectionError(
            f"the Dask scheduler at {self._address} is gone, or was restarted; what is done is "
            "kept: when it is there, the same command goes on"
        )

    def _see(self, threads: dict[str, int]) -> None:
        """Gives notice of workers that are gone, or of none."""
        before, self._threads = self._threads, threads
        for address in set(before or ()) - set(threads):
            gone = f"the worker {address} is gone, {len(threads)} are left"
            self._notice(f"{gone}; what it had at hand runs elsewhere")
        if not threads and before != {}:
            way = f"waiting for one (`dask worker {self._address}`)"
            self._notice(f"no workers at {self._address}: {way}")


def _connected(scheduler: str | Client) -> Any:  # a Client, whose types say that it may be closed
    with needs_extra("a Dask cluster", "cluster"):
        from distributed import Client
    if isinstance(scheduler, Client):
        return scheduler
    client = Client.__new__(Client)
    try:
        name: Any = {"name": "energymargin", "set_as_default": False}
        Client.__init__(client, scheduler, timeout=CONNECT, **name)
        return client
    except KeyboardInterrupt:  # left to itself, its end may wait forever for that of another one
        client.close(timeout=CLOSE)
        raise
    except (OSError, asyncio.TimeoutError) as error:
        raise ConnectionError(
            f"no Dask scheduler answers at {scheduler} within {CONNECT:g} s; start one with "
            "`dask scheduler`, or check the address"
        ) from error
