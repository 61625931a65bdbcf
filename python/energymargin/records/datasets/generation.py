"""Random trajectories of a task, in memory or in a file.

A file of any size is made in shards by any number of workers. Each shard is on disk as soon as it
is done, so that the next run goes on where one ended. The file is the same to the byte, whoever
made which shard.

A store beside the dataset's file, `.push.h5.parts`, has the shards that are done: trajectories in a
row, as a .npz of a Block. So a run may end at any moment, and another one goes on.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import lru_cache, partial
from importlib.metadata import version
from itertools import groupby, pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from energymargin import tasks
from energymargin._core import Cancel, Cancelled
from energymargin.base.aliases import AnyPath
from energymargin.base.checks import core_count, whole_number
from energymargin.base.limits import Limit
from energymargin.evaluate.asking import Pairs, ask
from energymargin.evaluate.executors.choice import Executor, Processes, Threads
from energymargin.evaluate.store.answer_file import AnswerFile
from energymargin.records.datasets import files
from energymargin.records.datasets.columns import COLUMNS, Block, as_block
from energymargin.records.datasets.dataset import Dataset, load, open
from energymargin.tasks.base import Task, parameters_of
from energymargin.tasks.registry import is_installed
from energymargin.tasks.scripted import ScriptedTask
from energymargin.tasks.trajectories import Trajectory

Progress = Callable[[int, int], None]
# At most, of a shard: 0.1 s of balance, 3 s of grasp, 20 MB.
SHARD_TRAJECTORIES = 50
SHARD_STATES = 20_000
SHARDS, REQUEST = b"shards", b"request"  # what the store has


def generate(
    task: str | Task,
    *,
    path: AnyPath | None = None,
    trajectories: int = 50,
    frames: int = 10,
    seed: int = 0,
    processes: int | None = 1,
    executor: Executor | None = None,
    progress: Progress | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> Dataset:
    """Random trajectories of a task, in memory or in a file.

    Args:
        task: a name, or a task from `tasks.make`.
        path: the file that is made, and replaced if it is there. The dataset is then open, to be
            read in blocks: close it, or use it in a `with` statement. None: it is in memory.
        trajectories: how many. Trajectory i is the same for any number of them.
        frames: how many of each are recorded, evenly spaced.
        seed: the same seed gives the same trajectories, to the last bit.
        processes: 1 is this one alone, None is one for each core if there is work for more than
            one. The dataset is the same for all.
        executor: in place of processes, of `em.executors`, as Dask(scheduler).
        progress: progress(done, total) is called after each trajectory, or each few.
        timeout: after so many seconds the dataset has the first trajectories, those that are done.
            A task that is no ScriptedTask is asked in between trajectories alone.
        cancel: the same once it is set.

    With a `path`, trajectories that are done wait in a store beside the file until it is whole.
    After Ctrl-C, a kill, a full disk or a timeout the same call goes on from there.

    Raises ValueError on an unknown task, numbers out of range, a task that workers cannot make, or
    a store with shards of another dataset; TimeoutError or Cancelled if not even one trajectory is
    done; RuntimeError if a few trajectories end one worker after the other; OSError if the file
    cannot be written.
    """
    limit = Limit(timeout, cancel)
    made = tasks.make(task) if isinstance(task, str) else task
    total = whole_number("trajectories", trajectories, 1)
    core_count("processes", processes)
    request = Request.of(made, frames, seed)
    whole_number("frames", frames, 1)
    with TemporaryDirectory() as temporary:
        file = Path(temporary, "dataset.h5") if path is None else Path(path)
        with Parts(file, request) as parts:
            missing, size = parts.missing(total), request.most
            left = sum(map(len, missing))
            workers = _executor(made, -(-left // size), processes, executor)
            done = total - left
            if done and progress is not None:
                progress(done, total)
            ask(
                (gap[k : k + size] for gap in missing for k in range(0, len(gap), size)),
                partial(generate_shard, request, made if workers is None else None),
                parts.keep_shards,
                most=size,
                total=total,
                progress=progress and (lambda now, _: progress(done + now, total)),
                executor=workers or Threads(1),
                **limit.rest(),
            )
            count = next((gap.start for gap in parts.missing(total)), total)
            if count == 0:
                limit.require("one trajectory was done")
            whole = parts.trajectories(count)
            files.write(file, request.task, request.parameters, request.seed, whole)
            if count == total:
                parts.forget()
        return load(file) if path is None else open(file)


def _executor(
    task: Task, shards: int, processes: int | None, executor: Executor | None
) -> Executor | None:
    """Where so many shards are made; None: in this process."""
    if executor is not None:
        if processes not in (None, 1):
            raise ValueError(f"processes is {processes}, expected 1 or None with an executor")
        _require_registered(task, "there is an executor")
        return executor
    if processes is None:
        processes = core_count("processes", None) if _can_be_made_again(task) else 1
    elif processes > 1:
        _require_registered(task, f"processes is {processes}")
    processes = min(processes, shards)
    return None if processes <= 1 else Processes(processes)


def _require_registered(task: Task, given: str) -> None:
    if not _can_be_made_again(task):
        text = f"{given}, but workers cannot make the task {task.name!r} of {type(task).__module__}"
        text += ": register it as an entry point of the group 'energymargin.tasks'"
        raise ValueError(f"{text}, or use processes=1")


def _can_be_made_again(task: Task) -> bool:
    """Whether a worker gets the same task by its name and parameters."""
    if not is_installed(task.name):
        return False
    parameters = parameters_of(task)
    again = tasks.make(task.name, **json.loads(json.dumps(parameters)))
    return type(again) is type(task) and parameters_of(again) == parameters


@dataclass(frozen=True, eq=False)
class Request:
    """What the trajectories depend on: each is made from this and its index alone."""

    task: str
    parameters: dict[str, Any]
    seed: int
    frames: int

    @property
    def most(self) -> int:
        """Trajectories of a shard."""
        return max(1, min(SHARD_TRAJECTORIES, SHARD_STATES // self.frames))

    @classmethod
    def of(cls, task: Task, frames: int, seed: int) -> Request:
        """Raises ValueError on a seed of more than 63 bits; a rollout checks `frames`."""
        seed = whole_number("seed", seed, 0, 2**63 - 1)
        return cls(task.name, parameters_of(task), seed, frames)


def generate_shard(
    request: Request, task: Task | None, indices: Sequence[int], cancel: Cancel
) -> list[Block | None]:
    """On a worker: trajectories in a row as one shard, at the first of them; once it is cancelled,
    those that are finished. None: the task of the request is made there."""
    task = task or _made(json.dumps(asdict(request)))
    recorded: list[Trajectory] = []
    interruptible = isinstance(task, ScriptedTask) and type(task).rollout is ScriptedTask.rollout
    options: dict[str, Any] = {"cancel": cancel} if interruptible else {}
    try:
        for index in indices:
            if cancel.is_set:
                break
            recorded.append(task.rollout(_stream(request.seed, index), request.frames, **options))
    except Cancelled:
        if not cancel.is_set:  # the task's own
            raise
    places = range(len(recorded))
    results: list[Block | None] = []
    for _, row in groupby(places, lambda place: indices[place] - place):
        first, *others = row
        results += [as_block(recorded[first : first + 1 + len(others)]), *(None for _ in others)]
    return results


@lru_cache(1)
def _made(request: str) -> Task:
    """The task, made once for all jobs of a run: its entry point takes longer than a trajectory."""
    fields = json.loads(request)
    return tasks.make(fields["task"], **fields["parameters"])


def _stream(seed: int, index: int) -> int:
    """The seed of one trajectory: 63 bits, which fit every integer type on disk."""
    (number,) = np.random.SeedSequence((seed, index)).generate_state(1, np.uint64)
    return int(number) >> 1


class Parts(AnswerFile):
    """The store of the shards of one file."""

    doing = "generating"

    def __init__(self, path: Path, request: Request) -> None:
        """Opens it, or makes it.

        Raises ValueError if another process has it, or if it has shards of another request.
        """
        place = parts_of(path)
        if place.is_dir():
            raise ValueError(f"{place} is a folder of parts, as of 0.14: remove it, and ask again")
        super().__init__(place, create=True)
        self.request = request
        asked = json.dumps({**asdict(request), "energymargin": version("energymargin")})
        try:
            self._require_asked(json.loads(asked))
            if self.answer(REQUEST) != asked.encode():
                self.keep(REQUEST, asked.encode())
        except BaseException:
            self.close()
            raise

    def add(self, first: int, block: Block) -> None:
        """Keeps a shard; the first of its trajectories has this index."""
        columns: dict[str, Any] = {f"column_{name}": block.columns[name] for name in COLUMNS}
        file = io.BytesIO()
        np.savez(file, rows=block.rows, bodies=np.array(json.dumps(block.bodies)), **columns)
        self.keep(SHARDS, file.getvalue(), first, len(block))

    def keep_shards(self, made: Pairs[int, Block | None]) -> None:
        """Keeps shards, each beside the first of its trajectories, as soon as they come."""
        for first, block in made:
            if block is not None:
                self.add(first, block)

    def missing(self, total: int) -> list[range]:
        """The trajectories of `total` that are in no shard, rising: those between two shards."""
        spans = [(0, 0), *self.spans(SHARDS), (total, total)]
        gaps = (range(last, min(first, total)) for (_, last), (first, _) in pairwise(spans))
        return [gap for gap in gaps if gap]

    def trajectories(self, total: int) -> Iterator[Trajectory]:
        """The first `total` trajectories.

        Raises ValueError if a shard is damaged, and drops it.
        """
        for first, last in self.spans(SHARDS):
            if first < total:
                yield from map(self._read(first).trajectory, range(min(last, total) - first))

    def __exit__(self, *error: object) -> None:
        """Closes it, and removes it if it has no shards. It needs no checksum: each .npz has its
        own."""
        self.close(remove=not self.spans(SHARDS))

    def forget(self) -> None:
        """Drops all shards, once the file is whole."""
        with self.transaction():
            self.database.execute("DELETE FROM answers")

    def _require_asked(self, asked: dict[str, Any]) -> None:
        found = json.loads(self.answer(REQUEST) or "{}")
        different = [name for name in asked if found.get(name) != asked[name]]
        if different and self.spans(SHARDS):
            shown = "; ".join(f"{n}: {found.get(n)} there, {asked[n]} now" for n in different)
            text = f"{self.path} holds parts of other trajectories. To go on with those"
            raise ValueError(f"{text}, ask for the same; to drop them, remove that file. {shown}")

    def _read(self, first: int) -> Block:
        content = self.answer(SHARDS, first) or b""
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
                columns = {name: arrays[f"column_{name}"] for name in COLUMNS}
                return Block(arrays["rows"], columns, json.loads(str(arrays["bodies"])))
        except (ValueError, LookupError, EOFError, zipfile.BadZipFile) as error:
            with self.transaction():
                self.database.execute("DELETE FROM answers WHERE first = ?", (first,))
            text = f"the shard of {self.path} that begins with trajectory {first} was damaged"
            raise ValueError(f"{text}, and is removed: the same call makes it again") from error


def parts_of(path: Path) -> Path:
    """Where the shards of this file wait."""
    return path.with_name(f".{path.name}.parts")


def trajectories_kept(path: Path) -> int:
    """How many trajectories of a file that is being made are done."""
    with suppress(FileNotFoundError, ValueError), AnswerFile(parts_of(path)) as parts:
        return sum(last - first for first, last in parts.spans(SHARDS))
    return 0
