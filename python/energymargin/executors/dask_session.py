"""The jobs of a DaskPool and its connection to the scheduler, on an event loop of its own.

Dask's Client cancels all that it waits for when it loses the scheduler, even if it finds it again
at once, and gives up after half a minute. So whenever a future of ours is cancelled, or the
scheduler does not answer, the client is put away, another one made, and every job that has not
come back is submitted again.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import pickle
import time
import uuid
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from energymargin.executors.dask_worker import Answer, Task, stop_pool
from energymargin.executors.jobs import Outcome

if TYPE_CHECKING:
    import distributed

__all__ = ["DaskSession", "Event"]

Event = Outcome | int | str | Exception
"""A job that has ended, the number of one that was dropped, words for a person, or the end of all.
"""

CONNECT = 5.0  # [s] for one attempt to connect, during which Dask tries again and again
SHORTEST_ATTEMPT = 0.5  # [s] when the patience is nearly over
ANSWER = 30.0  # [s] until a scheduler that is connected but silent counts as away
POLL = 0.5  # [s] between two questions for the workers
LONGEST_PAUSE = 2.0  # [s] between two attempts to connect

_Away = (OSError, asyncio.TimeoutError)
_Cancelled = (asyncio.CancelledError, concurrent.futures.CancelledError)


class DaskSession:
    """All of it runs on one event loop; only `happened` is heard outside."""

    def __init__(
        self,
        address: str,
        security: Any,
        release: str,
        release_of: Callable[[], str],
        patience: float,
        *,
        happened: Callable[[Event], None],
    ) -> None:
        """`happened` hears each event; the rest as in DaskPool."""
        self.slots = 0
        self._address = address
        self._security = security
        self._release = release
        self._release_of = release_of
        self._patience = patience
        self._happened = happened
        self._pool = uuid.uuid4().hex
        self._client: distributed.Client | None = None
        self._workers: dict[str, int] | None = None
        self._jobs: dict[int, bytes] = {}
        self._running: dict[int, asyncio.Task[None]] = {}
        self._waiting: deque[int] = deque()
        self._suspects: deque[int] = deque()
        self._stopping = False
        self._lost = asyncio.Event()

    async def open(self) -> None:
        """Connects; raises ConnectionError if no scheduler answers, ValueError if none can."""
        try:
            self._count(await self._connect(CONNECT))
        except _Away as error:
            raise ConnectionError(
                f"no Dask scheduler answers at {self._address} within {CONNECT:g} s; "
                "start one with `dask scheduler`, or check the address"
            ) from error
        except ValueError as error:
            raise ValueError(
                f"cluster is {self._address!r}, but expected the address of a Dask scheduler, "
                f"as tcp://127.0.0.1:8786: {error}"
            ) from error

    async def run(self) -> None:
        """Watches the workers and the connection, for ever."""
        while True:
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._lost.wait(), POLL)
            if self._lost.is_set() or not await self._answers():
                await self._reconnect()

    async def close(self) -> None:
        """Gives up every job, and the connection."""
        self._stopping = True
        await self._disconnect()

    def submit(self, job: int, pickled: bytes) -> None:
        """A job, as a pickled pair of function and payload."""
        self._jobs[job] = pickled
        self._waiting.append(job)
        self._hand_out()

    async def stop(self) -> None:
        """Tells the jobs that run to return what they have, and the others not to start."""
        self._stopping = True
        for job in set(self._jobs) - set(self._running):
            self._drop(job)
        if self._client is not None:
            with contextlib.suppress(Exception):  # whoever does not hear it is cancelled later
                await self._client.run(stop_pool, self._pool, on_error="ignore")

    def cancel(self) -> None:
        """Gives up every job."""
        self._stopping = True
        for task in self._running.values():
            task.cancel()

    # The connection.

    async def _connect(self, timeout: float) -> dict[str, int]:
        """The workers' threads, by address."""
        import distributed

        client = distributed.Client(
            self._address,
            security=self._security,
            timeout=timeout,
            asynchronous=True,
            set_as_default=False,
            name="energymargin",
        )
        try:
            await client
            workers: dict[str, int] = await asyncio.wait_for(client.nthreads(), timeout)
        except BaseException:
            await _close(client)
            raise
        self._client = client
        self._lost.clear()
        return workers

    async def _disconnect(self) -> None:
        client, self._client = self._client, None
        self._workers, self.slots = None, 0
        running = list(self._running.values())
        self._running.clear()
        for task in running:
            task.cancel()
        await asyncio.gather(*running, return_exceptions=True)
        if client is not None:
            await _close(client)

    async def _reconnect(self) -> None:
        began = time.monotonic()
        self._happened(
            f"the Dask scheduler at {self._address} is away: trying again "
            f"for up to {self._patience:g} s"
        )
        await self._disconnect()
        pause = 0.1
        while True:
            try:
                left = began + self._patience - time.monotonic()
                workers = await self._connect(min(CONNECT, max(left, SHORTEST_ATTEMPT)))
                break
            except _Away as error:
                self._check_patience(time.monotonic() - began, error)
            await asyncio.sleep(pause)
            pause = min(2 * pause, LONGEST_PAUSE)
        self._happened(
            f"the Dask scheduler is back after {time.monotonic() - began:.1f} s: "
            f"{len(self._jobs)} jobs are submitted again"
        )
        self._count(workers)
        self._waiting = deque(job for job in self._jobs if job not in self._suspects)
        self._hand_out()

    def _check_patience(self, waited: float, error: BaseException) -> None:
        if waited >= self._patience:
            raise ConnectionError(
                f"the Dask scheduler at {self._address} has been away for {waited:.0f} s; "
                "what is done is kept: when it is back, the same command goes on"
            ) from error

    async def _answers(self) -> bool:
        client = self._client
        if client is None or client.status != "running":
            return False
        try:
            self._count(await asyncio.wait_for(client.nthreads(), ANSWER))
        except _Away:
            return False
        return True

    def _count(self, workers: dict[str, int]) -> None:
        """Takes note of the workers' threads, and says what a person wants to know of it."""
        before, self._workers = self._workers, dict(workers)
        self.slots = sum(workers.values())
        for address in set(before or ()) - set(workers):
            self._happened(
                f"the worker {address} is gone, {len(workers)} are left; "
                "what it had at hand runs elsewhere"
            )
        if not workers and before != {}:
            self._happened(
                f"no workers at {self._address}: waiting for one (`dask worker {self._address}`)"
            )

    # The jobs.

    def _hand_out(self) -> None:
        """Starts what may start: all that waits, or one suspect with nothing beside it."""
        if self._client is None or self._stopping:
            return
        if not self._suspects:
            while self._waiting:
                self._start(self._client, self._waiting.popleft())
        elif not self._running:
            self._start(self._client, self._suspects[0])

    def _start(self, client: distributed.Client, job: int) -> None:
        task = asyncio.create_task(self._run(client, job))
        self._running[job] = task
        task.add_done_callback(lambda task: self._ran(job, task))

    def _ran(self, job: int, task: asyncio.Task[None]) -> None:
        if self._running.get(job) is task:
            del self._running[job]
            self._hand_out()

    async def _run(self, client: distributed.Client, job: int) -> None:
        from distributed import KilledWorker

        call = Task(self._pool, self._release, self._release_of, self._jobs[job])
        key = f"energymargin-{uuid.uuid4().hex}"
        future = None
        try:
            future = client.submit(pickle.loads, pickle.dumps(call), key=key, pure=False)
            answer = await future
        except _Cancelled:
            self._cancelled(job)
        except KilledWorker as killed:
            self._killed(job, killed)
        except Exception as error:
            in_task = future is not None and future.status == "error"
            if not in_task and (client.status != "running" or isinstance(error, _Away)):
                self._lost.set()
            else:
                self._failed(error)
        else:
            self._answered(job, answer)

    def _cancelled(self, job: int) -> None:
        if self._stopping:
            self._drop(job)
        else:
            self._lost.set()

    def _killed(self, job: int, killed: distributed.KilledWorker) -> None:
        """Dask blames all that its dead workers had at hand; guilty is who kills them alone."""
        if job in self._suspects:
            worker = killed.last_worker.address
            self._end(Outcome(job, died=f"its worker died each time, the last one {worker}"))
        else:
            self._suspects.append(job)

    def _failed(self, error: Exception) -> None:
        """Jobs' own errors come as answers, so this is of a worker that cannot run them."""
        self._happened(
            RuntimeError(
                f"the workers of {self._address} cannot run jobs of this energymargin "
                f"({self._release}): {type(error).__name__}: {error}; "
                "they need the same release of it, and the same Python"
            )
        )

    def _answered(self, job: int, answer: Answer) -> None:
        kind, data = answer
        if kind == "refused":
            words = pickle.loads(data)
            self._happened(RuntimeError(f"{words}; install the same release of energymargin there"))
        elif kind == "skipped" and self._stopping:
            self._drop(job)
        elif kind == "skipped" or (kind == "stopped" and not self._stopping):
            self._again(job)  # its worker was closing
        else:
            self._end(_outcome(job, kind == "error", data))

    def _again(self, job: int) -> None:
        if job not in self._suspects:
            self._waiting.append(job)

    def _end(self, outcome: Outcome) -> None:
        self._forget(outcome.job)
        self._happened(outcome)

    def _drop(self, job: int) -> None:
        self._forget(job)
        self._happened(job)

    def _forget(self, job: int) -> None:
        self._jobs.pop(job, None)
        if job in self._suspects:
            self._suspects.remove(job)


async def _close(client: distributed.Client) -> None:
    with contextlib.suppress(Exception):  # what goes wrong with it is no concern any more
        await asyncio.wait_for(client.close(), 1.0)


def _outcome(job: int, is_error: bool, data: bytes) -> Outcome:
    try:
        value = pickle.loads(data)
    except Exception as error:
        return Outcome(job, error=error)
    return Outcome(job, error=value) if is_error else Outcome(job, value)
