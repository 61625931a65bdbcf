"""`em.executors.ask`: questions go out to workers, and their answers come back and are kept.

Nothing else runs workers; docs/engineering/answers.md follows a question on its way.
"""

from __future__ import annotations

import concurrent.futures
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from itertools import count, takewhile
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from energymargin._core import Cancel
from energymargin.base.interrupts import held_interrupts
from energymargin.base.limits import Limit
from energymargin.evaluate.executors.choice import Executor, chosen_executor
from energymargin.evaluate.parallel import MOST, Chunk, Flow, Task, Workers

if TYPE_CHECKING:
    from energymargin.evaluate.store.answer_file import AnswerFile

Question = TypeVar("Question")
Answer = TypeVar("Answer")

Pairs = Sequence[tuple[Question, Answer]]


@dataclass(frozen=True, eq=False)
class Kept(Generic[Question, Answer]):
    """A store of answers, each under the digest of its question."""

    file: AnswerFile
    """Open, to put answers in."""
    digest: Callable[[Question], bytes]
    """`file.key` of all that the answer of a question depends on."""
    read: Callable[[Question, bytes], Answer]
    """The answer that was written so."""
    written: Callable[[Answer], bytes | None]
    """An answer as it is kept; None if it is not, as an error."""


def ask(
    questions: Iterable[Sequence[Question]],
    answer: Callable[[Sequence[Any], Cancel], Sequence[Any]],
    on_answers: Callable[[Pairs[Question, Answer]], object],
    *,
    split: Callable[[Question], Iterable[Sequence[Any]]] | None = None,
    join: Callable[[Question, Sequence[Any]], Answer] | None = None,
    partly: bool = False,
    kept: Kept[Question, Answer] | None = None,
    most: int = MOST,
    total: int = 0,
    progress: Callable[[int, int], None] | None = None,
    threads: int | None = None,
    executor: Executor | concurrent.futures.Executor | Workers | None = None,
    timeout: float | None = None,
    cancel: Cancel | None = None,
) -> bool:
    """Answers questions on workers; False if the limit came before the last answer.

    Args:
        questions: in batches, made when workers have room for them; a batch may be empty.
        answer: answer(parts, cancel) runs on a worker, and returns the results of parts in their
            order; None of a part that is in the result before it. Once the cancel is set it returns
            early, with the results of the first parts, or raises.
        on_answers: on_answers([(question, answer), ...]) gets whole answers as they come, in this
            thread.
        split: the parts of a question, in batches. There are len(question), which may fall to those
            that could be made. None: a question is one part, and its answer that part's result.
        join: join(question, results) makes an answer of the results of the parts, in their order.
        partly: at the limit, questions are joined of the first results that are there.
        kept: a store. What it has is delivered first, and each new answer is kept at once.
        most: parts that a worker gets at a time.
        total: how many parts there are, for `progress`; an answer of the store counts as one.
        progress: progress(done, total) is called as results come in.
        threads: None takes all cores that this process may use.
        executor: in place of threads, of `em.executors`; or its workers, which then stay open.
        timeout: after so many seconds what is finished is delivered.
        cancel: the same once it is set.

    On Ctrl-C what is finished is delivered within 0.2 s, and KeyboardInterrupt is raised; so with
    any other error, which is then raised: ExecutorError if a worker has died.
    """
    limit = Limit(timeout, cancel)
    asking = _Asking(split, join, kept, on_answers, total, progress)
    asked: Iterable[list[_Asked]] = (list(map(_Asked, batch)) for batch in questions)
    if kept is not None:
        asked = [asking.unknown(kept, batch) for batch in asked]
    with ExitStack() as opened:
        if not isinstance(executor, Workers):
            executor = opened.enter_context(chosen_executor(executor, threads).workers())
        flow = Flow(executor, asking.parts(asked), most)
        with held_interrupts() as interrupted:
            try:
                while flow.busy and not (interrupted.is_set() or limit.reached):
                    for tasks in flow.chunks():
                        chunk = Chunk(answer, [part for _, part in tasks], limit.rest()["timeout"])
                        flow.sent(executor.submit(chunk), tasks)
                    asking.take(flow.results())
            finally:
                asking.take(flow.stop())
        if interrupted.is_set():
            raise KeyboardInterrupt
    if partly:
        asking.finish()
    return not flow.busy


@dataclass(eq=False)
class _Asked:
    """A question that is asked."""

    question: Any
    digest: bytes = b""
    results: dict[int, Any] = field(default_factory=dict)
    """By the number of the part."""


@dataclass(eq=False)
class _Asking:
    """What is asked, and what came of it."""

    split: Callable[[Any], Iterable[Sequence[Any]]] | None
    join: Callable[[Any, Sequence[Any]], Any] | None
    kept: Kept[Any, Any] | None
    on_answers: Callable[[Pairs[Any, Any]], object]
    total: int
    progress: Callable[[int, int], None] | None
    done: int = 0
    open: dict[_Asked, None] = field(default_factory=dict)
    """Questions that are with workers."""

    def unknown(self, kept: Kept[Any, Any], batch: Sequence[_Asked]) -> list[_Asked]:
        """Delivers the answers that the store has; the other questions."""
        found = {}
        for one in batch:
            one.digest = kept.digest(one.question)
            if (content := kept.file.answer(one.digest)) is not None:
                found[one] = kept.read(one.question, content)
        self._deliver([(one.question, answer) for one, answer in found.items()], len(found))
        return [one for one in batch if one not in found]

    def parts(self, asked: Iterable[Sequence[_Asked]]) -> Iterator[list[Task]]:
        """Parts of questions, each known by its question and its number."""
        for batch in asked:
            if self.split is None or not batch:
                self.open |= dict.fromkeys(batch)
                yield [((one, 0), one.question) for one in batch]
                continue
            for one in batch:
                self.open[one], numbers = None, count()
                for piece in self.split(one.question):
                    yield [((one, next(numbers)), part) for part in piece]

    def take(self, results: Sequence[tuple[tuple[_Asked, int], Any]]) -> None:
        """Keeps and delivers the answers that are whole by these results."""
        for (one, number), result in results:
            one.results[number] = result
        size: Callable[[Any], int] = len if self.split else lambda _: 1
        whole = [one for one in self.open if len(one.results) == size(one.question)]
        answers = [(one.question, self._answer(one)) for one in whole]
        for one, (_, answer) in zip(whole, answers, strict=True):
            del self.open[one]
            if self.kept is not None and (content := self.kept.written(answer)) is not None:
                self.kept.file.keep(one.digest, content)
        self._deliver(answers, len(results))

    def finish(self) -> None:
        """Delivers what there is of the questions that are not whole."""
        begun = [one for one in self.open if 0 in one.results]
        self._deliver([(one.question, self._answer(one)) for one in begun], 0)

    def _answer(self, one: _Asked) -> Any:
        """The answer of the first results, up to a part that has none."""
        if self.join is None:
            return one.results[0]
        first = [one.results[k] for k in takewhile(one.results.__contains__, count())]
        return self.join(one.question, [result for result in first if result is not None])

    def _deliver(self, answers: Pairs[Any, Any], done: int) -> None:
        self.done += done
        if answers:
            self.on_answers(answers)
        if done and self.progress is not None:
            self.progress(self.done, self.total)
