"""The workers of a Dask cluster, which come and go; so may its scheduler, for a while.

Jobs and answers travel as pickled bytes: Dask's scheduler needs no energymargin, and where a worker
lacks it the error comes back to the driver. `work` and what it calls run on the workers.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import pickle
import time
import uuid
import warnings
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from functools import cache
from importlib.metadata import version
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Literal

from energymargin.closing import Closing
from energymargin.executors.pool import Job, Outcome
from energymargin.executors.worker import sendable

if TYPE_CHECKING:
    import distributed

__all__ = ["Answer", "DaskPool", "installed_release", "stop_pool", "work"]

CONNECT = 5.0  # [s] for the first connection, during which Dask tries again and again
ANSWER = 2.0  # [s] until a scheduler that is asked for its workers is asked another time
POLL = 0.5  # [s] between two questions for the workers
CLOSE = 1.0  # [s] to leave the cluster

# Loggers that report on the connection from Dask's thread; the pool's notices say it better.
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
_DASKS_THREAD = "IO loop"

Answer = tuple[Literal["value", "error", "stopped", "skipped", "refused"], bytes]
"""How a job ended on a worker, and its pickled value, error or message. A job that was `stopped`
has a value too, one that was `skipped` has none."""

# States of a Dask task whose result is still wanted: not those after a cancel or a release.
_WANTED = ("executing", "long-running")
_ENDING = ("closing", "closed", "failed")
_stopped_pools: set[str] = set()


@cache
def installed_release() -> str:
    """The version of energymargin that is installed here."""
    return version("energymargin")


def stop_pool(pool: str) -> None:
    """On a worker: the jobs of a pool that run here return, and those that come do not start."""
    _stopped_pools.add(pool)


class _RemoteCall:
    """A call of `work` on a worker: `pickle.loads` runs it there, and gives the Answer."""

    def __init__(self, pool: str, release: str, release_of: Callable[[], str], job: bytes) -> None:
        """`release` is what `release_of` must say on the worker; `job` as in `work`."""
        self._arguments = (pool, release, release_of, job)

    def __reduce__(self) -> tuple[Callable[..., Answer], tuple[Any, ...]]:
        """What to call where it is unpickled."""
        return work, self._arguments


def work(pool: str, release: str, release_of: Callable[[], str], job: bytes) -> Answer:
    """On a worker: runs a job, a pickled pair of function and payload."""
    from distributed import get_worker

    worker = get_worker()
    if release_of() != release:
        words = f"the worker {worker.address} has release {release_of()}, and this is {release}"
        return "refused", pickle.dumps(words)
    if pool in _stopped_pools:
        return "skipped", b""
    stopped = _Stopped(pool, worker)
    try:
        function: Job
        function, payload = pickle.loads(job)
        value = pickle.dumps(function(payload, stopped))
    except Exception as error:
        return "error", pickle.dumps(sendable(error))
    return "stopped" if stopped.seen else "value", value


class _Stopped:
    """Whether nobody waits for the job that runs in this thread of a worker: a Stopped."""

    def __init__(self, pool: str, worker: distributed.Worker) -> None:
        self.seen = False
        self._pool = pool
        self._worker = worker
        self._task = worker.state.tasks[worker.get_current_task()]

    def __call__(self) -> bool:
        self.seen = self.seen or (
            self._pool in _stopped_pools
            or self._task.state not in _WANTED
            or self._worker.status.name in _ENDING
        )
        return self.seen


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
            release_of: How a worker finds its release: a function of a module.
            notice: Gets a line of text when workers or the scheduler come or go, in `take` and
                `stop`.
            patience: How long a scheduler may be away [s].

        Raises:
            ImportError: dask and distributed are not installed.
            ValueError: an argument of another kind.
            ConnectionError: no scheduler answers.
        """
        self._address, security = _scheduler(cluster)
        if not patience >= 0:
            raise ValueError(f"patience is {patience!r}, but expected seconds, 0 or more")
        warnings.filterwarnings("ignore", "Sending large graph", UserWarning)
        self._name = uuid.uuid4().hex
        self._release, self._release_of = release or release_of(), release_of
        self._notice = (lambda _words: None) if notice is None else notice
        self._patience = patience
        self._jobs: dict[int, bytes] = {}  # all that have not ended
        self._waiting: deque[int] = deque()
        self._suspects: deque[int] = deque()  # jobs beside which workers died
        self._running: dict[Future[Answer | None], int] = {}
        self._answers: SimpleQueue[Future[Answer | None]] = SimpleQueue()
        self._ended: list[Outcome] = []  # here, so that Ctrl-C in `take` loses none
        self._failure: Exception | None = None
        self._stopping = False
        self._workers: dict[str, int] | None = None
        self._next_look = 0.0
        self._away: float | None = None  # since when
        with contextlib.ExitStack() as stack:
            stack.enter_context(_quiet())
            self._client = _connected(self._address, security, patience)
            self._quiet = stack.pop_all()
        self._loop = self._client.loop.asyncio_loop
        self._look()

    @property
    def slots(self) -> int:
        """The workers' threads, as of half a second ago; 0 while there is no worker."""
        return sum((self._workers or {}).values())

    def submit(self, job: int, function: Job, payload: Any) -> None:
        """As Pool.submit. Raises what pickle raises on a payload that it cannot send."""
        self._jobs[job] = pickle.dumps((function, payload))
        self._waiting.append(job)
        self._hand_out()

    def take(self, timeout: float) -> list[Outcome]:
        """As Pool.take.

        Raises:
            ConnectionError: the scheduler has been away for too long.
            RuntimeError: a worker cannot run jobs, or has another release.
        """
        self._listen(timeout, lambda: bool(self._ended or self._failure))
        if self._failure is not None and not self._ended:
            raise self._failure
        return self._taken()

    def stop(self, timeout: float) -> list[Outcome]:
        """As Pool.stop; then cancels what has not come."""
        self._stopping = True
        for job in set(self._jobs) - set(self._running.values()):
            self._forget(job)
        asyncio.run_coroutine_threadsafe(self._tell_workers(), self._loop)
        self._listen(timeout, lambda: not self._jobs)
        self._cancel()
        return self._taken()

    def close(self) -> None:
        """Cancels what has not come, and leaves the cluster; a Client that was given stays."""
        self._stopping = True
        self._cancel()
        with contextlib.suppress(Exception):  # its errors matter to nobody any more
            self._client.close(timeout=CLOSE)
        self._quiet.close()

    def _listen(self, timeout: float, enough: Callable[[], bool]) -> None:
        """Until there is enough, or the timeout [s] is over."""
        end = time.monotonic() + timeout
        left = timeout
        while True:
            self._look()
            self._hand_out()
            with contextlib.suppress(Empty):
                self._hear(self._answers.get(timeout=max(0.0, min(left, POLL))))
                while True:
                    self._hear(self._answers.get_nowait())
            left = end - time.monotonic()
            if enough() or left <= 0:
                return

    def _taken(self) -> list[Outcome]:
        taken, self._ended = self._ended, []
        return taken

    # The scheduler and its workers.

    def _look(self) -> None:
        """Now and then: is the scheduler there, and which workers has it?"""
        now = time.monotonic()
        if now < self._next_look:
            return
        self._next_look = now + POLL
        if self._client.status != "running":
            self._wait_for_scheduler(now)
            return
        if self._away is not None:
            self._notice(f"the Dask scheduler is back after {now - self._away:.1f} s")
            self._away = None
        with contextlib.suppress(OSError, asyncio.TimeoutError):
            ask = self._client.scheduler.ncores
            self._count(self._client.sync(ask, callback_timeout=ANSWER))

    def _wait_for_scheduler(self, now: float) -> None:
        """Dask tries to connect again, until the patience is over."""
        if self._away is None:
            self._away, self._workers = now, None
            self._notice(
                f"the Dask scheduler at {self._address} is away: trying again "
                f"for up to {self._patience:g} s"
            )
        over = self._client.status == "closed" or now - self._away >= self._patience
        if over and self._failure is None:
            self._failure = ConnectionError(
                f"the Dask scheduler at {self._address} has been away for {self._patience:g} s; "
                "what is done is not lost: when it is back, the same command goes on"
            )

    def _count(self, workers: dict[str, int]) -> None:
        """Notes the workers' threads, and gives notice of workers that are gone, or of none."""
        before, self._workers = self._workers, dict(workers)
        for address in set(before or ()) - set(workers):
            self._notice(
                f"the worker {address} is gone, {len(workers)} are left; "
                "what it had at hand runs elsewhere"
            )
        if not workers and before != {}:
            self._notice(
                f"no workers at {self._address}: waiting for one (`dask worker {self._address}`)"
            )

    # The jobs.

    def _hand_out(self) -> None:
        """Starts what may start: all that waits, or one suspect with nothing beside it."""
        if self._stopping or self._client.status != "running":
            return
        if not self._suspects:
            while self._waiting:
                self._start(self._waiting.popleft())
        elif not self._running:
            self._start(self._suspects[0])

    def _start(self, job: int) -> None:
        task = _RemoteCall(self._name, self._release, self._release_of, self._jobs[job])
        answer = asyncio.run_coroutine_threadsafe(self._answer(pickle.dumps(task)), self._loop)
        self._running[answer] = job
        answer.add_done_callback(self._answers.put)

    async def _answer(self, task: bytes) -> Answer | None:
        """In Dask's thread: what a worker answers. None if the task was lost: Dask's Client cancels
        all that it waits for when it loses the scheduler, even if it finds it again at once."""
        future = None
        try:
            key = f"energymargin-{uuid.uuid4().hex}"
            future = self._client.submit(pickle.loads, task, key=key, pure=False)
            answer: Answer = await future
        except (Exception, asyncio.CancelledError):
            if future is not None and future.status == "error":
                raise
            return None
        return answer

    async def _tell_workers(self) -> None:
        """In Dask's thread: jobs that run return what they have, and the others do not start."""
        with contextlib.suppress(Exception):  # jobs that do not hear it are cancelled later
            await self._client.run(stop_pool, self._name, on_error="ignore")

    def _cancel(self) -> None:
        for answer in list(self._running):
            answer.cancel()

    def _hear(self, future: Future[Answer | None]) -> None:
        from distributed import KilledWorker

        job = self._running.pop(future)
        try:
            answer = None if future.cancelled() else future.result()
        except KilledWorker as killed:
            self._killed(job, killed)
        except Exception as error:
            self._failure = self._cannot_run(error)
        else:
            self._answered(job, answer)

    def _killed(self, job: int, killed: distributed.KilledWorker) -> None:
        """Dask blames each job of a dead worker; guilty is one that kills a worker on its own."""
        if job in self._suspects:
            worker = killed.last_worker.address
            self._end(Outcome(job, died=f"its worker died each time, the last one {worker}"))
        else:
            self._suspects.append(job)

    def _cannot_run(self, error: Exception) -> RuntimeError:
        """Jobs' own errors come as answers, so this is of a worker that cannot run them."""
        return RuntimeError(
            f"the workers of {self._address} cannot run jobs of this energymargin "
            f"({self._release}): {type(error).__name__}: {error}; "
            "they need the same release of it, and the same Python"
        )

    def _answered(self, job: int, answer: Answer | None) -> None:
        kind, data = answer or ("skipped", b"")
        if kind == "refused":
            words = pickle.loads(data)
            self._failure = RuntimeError(f"{words}; install the same release of energymargin there")
        elif kind == "skipped" and self._stopping:
            self._forget(job)
        elif kind == "skipped" or (kind == "stopped" and not self._stopping):
            self._again(job)  # it was lost, or its worker was closing
        else:
            self._end(_outcome(job, kind == "error", data))

    def _again(self, job: int) -> None:
        if job not in self._suspects:
            self._waiting.append(job)

    def _end(self, outcome: Outcome) -> None:
        self._forget(outcome.job)
        self._ended.append(outcome)

    def _forget(self, job: int) -> None:
        self._jobs.pop(job, None)
        if job in self._suspects:
            self._suspects.remove(job)


def _scheduler(cluster: str | distributed.Client) -> tuple[str, distributed.Security | None]:
    """The address of a scheduler, and the security of connections to it."""
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


def _connected(
    address: str, security: distributed.Security | None, patience: float
) -> Any:  # a Client, whose own types say that it may not be connected
    """A Client that, once it was connected, looks for a lost scheduler as long as the patience."""
    from distributed import Client

    options = {"security": security, "set_as_default": False, "name": "energymargin"}
    try:
        Client(address, timeout=CONNECT, **options).close(timeout=CLOSE)
        return Client(address, timeout=max(patience, CONNECT), **options)
    except (OSError, asyncio.TimeoutError) as error:
        raise ConnectionError(
            f"no Dask scheduler answers at {address} within {CONNECT:g} s; "
            "start one with `dask scheduler`, or check the address"
        ) from error
    except ValueError as error:
        raise ValueError(
            f"cluster is {address!r}, but expected the address of a Dask scheduler, "
            f"as tcp://127.0.0.1:8786: {error}"
        ) from error


def _outcome(job: int, is_error: bool, data: bytes) -> Outcome:
    try:
        value = pickle.loads(data)
    except Exception as error:
        return Outcome(job, error=error)
    return Outcome(job, error=value) if is_error else Outcome(job, value)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keeps Dask's reports on connections from the terminal."""

    def others(record: logging.LogRecord) -> bool:
        return record.threadName != _DASKS_THREAD

    for name in _NOISY:
        logging.getLogger(name).addFilter(others)
    try:
        yield
    finally:
        for name in _NOISY:
            logging.getLogger(name).removeFilter(others)
