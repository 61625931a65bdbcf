"""The workers of a Dask cluster, which come and go; so may its scheduler, for a while."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import pickle
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from energymargin.closing import Closing
from energymargin.executors.dask_session import DaskSession, Event
from energymargin.executors.dask_worker import installed_release
from energymargin.executors.jobs import Job, Outcome

if TYPE_CHECKING:
    import distributed

__all__ = ["DaskPool"]

# Who reports in our thread that a connection has ended, which the pool's notices say better.
_NOISY = (
    "asyncio",
    "distributed.batched",
    "distributed.client",
    "distributed.comm.core",
    "distributed.comm.tcp",
    "distributed.core",
    "distributed.utils",
    "distributed.utils_comm",
    "tornado.application",
)


class DaskPool(Closing):
    """The workers of a Dask cluster; a Pool.

    A job whose workers die again and again comes back as one that died. While the scheduler is
    away the pool waits for it, and submits again what had not come back.
    """

    def __init__(
        self,
        cluster: str | distributed.Client,
        *,
        release: str | None = None,
        release_of: Callable[[], str] = installed_release,
        notice: Callable[[str], None] | None = None,
        patience: float = 600.0,
    ) -> None:
        """Connects to a scheduler.

        Args:
            cluster: The scheduler's address, as tcp://127.0.0.1:8786, or a Client of it, which is
                asked for the address and for its security alone.
            release: What workers must have; None for what `release_of` says here.
            release_of: How a worker finds what it has: a function of a module.
            notice: Hears one line of words when workers or the scheduler come or go. It is called
                in `take` and `stop`.
            patience: How long a scheduler may be away [s].

        Raises:
            ImportError: dask and distributed are not installed.
            ValueError: an argument of another kind.
            ConnectionError: no scheduler answers.
        """
        address, security = _scheduler(cluster)
        if not patience >= 0:
            raise ValueError(f"patience is {patience!r}, but expected seconds, 0 or more")
        warnings.filterwarnings("ignore", "Sending large graph", UserWarning)
        self._notice = notice
        self._failure: Exception | None = None
        self._jobs: set[int] = set()
        self._ended: list[Outcome] = []  # here, so that Ctrl-C in `take` loses none
        self._events: SimpleQueue[Event] = SimpleQueue()
        self._arguments = (address, security, release or release_of(), release_of, patience)
        opened: Future[None] = Future()
        self._thread = threading.Thread(target=self._work, args=(opened,), daemon=True)
        self._thread.start()
        try:
            opened.result()
        except KeyboardInterrupt:
            if not opened.cancel() and opened.exception() is None:
                self.close()
            raise

    @property
    def slots(self) -> int:
        """The workers' threads, as of half a second ago; 0 while there is no worker."""
        return self._session.slots

    def submit(self, job: int, function: Job, payload: Any) -> None:
        """As Pool.submit. Raises what pickle raises on a payload that it cannot send."""
        pickled = pickle.dumps((function, payload))
        self._jobs.add(job)
        self._call(self._session.submit, job, pickled)

    def take(self, timeout: float) -> list[Outcome]:
        """As Pool.take.

        Raises:
            ConnectionError: the scheduler has been away for too long.
            RuntimeError: a worker cannot run jobs, or has another release.
        """
        self._listen(timeout, lambda: bool(self._ended))
        if self._failure is not None and not self._ended:
            raise self._failure
        return self._taken()

    def stop(self, timeout: float) -> list[Outcome]:
        """As Pool.stop; then cancels what has not come."""
        self._call(self._stop)
        self._listen(timeout, lambda: not self._jobs)
        self._call(self._session.cancel)
        return self._taken()

    def close(self) -> None:
        """Cancels what has not come, and leaves the cluster; a Client that was given stays."""
        self._call(self._main.cancel)
        self._thread.join(2.0)

    def _listen(self, timeout: float, enough: Callable[[], bool]) -> None:
        end = time.monotonic() + timeout
        with contextlib.suppress(Empty):
            while not enough() and self._failure is None:
                self._hear(self._events.get(timeout=max(0.0, end - time.monotonic())))
            while True:
                self._hear(self._events.get_nowait())

    def _taken(self) -> list[Outcome]:
        taken, self._ended = self._ended, []
        return taken

    def _hear(self, event: Event) -> None:
        if isinstance(event, Outcome):
            self._jobs.discard(event.job)
            self._ended.append(event)
        elif isinstance(event, int):
            self._jobs.discard(event)
        elif isinstance(event, Exception):
            self._failure = event
        elif self._notice is not None:
            self._notice(event)

    def _call(self, function: Callable[..., object], *arguments: Any) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended, and said why
            self._loop.call_soon_threadsafe(function, *arguments)

    # In the thread of the event loop.

    def _work(self, opened: Future[None]) -> None:
        with _quiet():
            asyncio.run(self._serve(opened))

    async def _serve(self, opened: Future[None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._loop.set_exception_handler(lambda loop, context: None)  # of connections that ended
        self._session = DaskSession(*self._arguments, happened=self._events.put)
        try:
            await self._session.open()
        except Exception as error:
            if opened.set_running_or_notify_cancel():
                opened.set_exception(error)
            return
        if not opened.set_running_or_notify_cancel():  # Ctrl-C came before
            await self._session.close()
            return
        self._main = asyncio.create_task(self._session.run())
        opened.set_result(None)
        try:
            await self._main
        except asyncio.CancelledError:
            pass
        except Exception as error:
            self._events.put(error)
        await self._session.close()

    def _stop(self) -> None:
        self._stopping = asyncio.create_task(self._session.stop())


def _scheduler(cluster: str | distributed.Client) -> tuple[str, Any]:
    """Its address, and how to talk to it safely."""
    try:
        from distributed import Client
    except ImportError as error:
        raise ImportError(
            "a Dask cluster needs dask and distributed: pip install 'energymargin[cluster]'"
        ) from error
    if isinstance(cluster, Client) and cluster.scheduler is not None:
        return str(cluster.scheduler.address), cluster.security
    if isinstance(cluster, str) and cluster:
        return cluster, None
    raise ValueError(
        f"cluster is {cluster!r}, but expected the address of a Dask scheduler, "
        "as tcp://127.0.0.1:8786, or a connected distributed.Client"
    )


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keeps Dask's reports on connections of this thread from the terminal."""
    ours = threading.get_ident()

    def others(record: logging.LogRecord) -> bool:
        return record.thread != ours

    for name in _NOISY:
        logging.getLogger(name).addFilter(others)
    try:
        yield
    finally:
        for name in _NOISY:
            logging.getLogger(name).removeFilter(others)
