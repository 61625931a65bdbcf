"""The base of the package's own errors, those of them that no module of its own has, and what a
missing package says.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def needs_extra(what: str, extra: str) -> Iterator[None]:
    """An import in the `with` block that fails raises ImportError with what brings the package, or
    with what a package that is there lacks.
    """
    way = f"pip install 'energymargin[{extra}]'"
    try:
        yield
    except ModuleNotFoundError as error:
        raise ImportError(f"{what} needs {error.name}: {way}") from error
    except ImportError as error:
        text = f"{what}: a package of {way} is there and does not load: {error}"
        raise ImportError(text) from error


class EnergyMarginError(Exception):
    """Base of the errors that have a type of their own: `em.ScoreError`, `em.tasks.TaskError`, a
    state that makes no problem, a file that cannot be read, labels that are all alike.

    A bad argument is a ValueError. What a timeout or a cancel ends is a TimeoutError or
    `em.Cancelled`, which are no errors of the package: the caller asked for them.
    """


class DivergedError(EnergyMarginError, RuntimeError):
    """So many rollouts diverged that what is left says nothing."""

    def __init__(self, subject: str, diverged: int, rollouts: int) -> None:
        """`subject`: what the rollouts are of, as the name of a candidate."""
        super().__init__(subject, diverged, rollouts)
        self.subject, self.diverged, self.rollouts = subject, diverged, rollouts

    def __str__(self) -> str:
        """What diverged, and what to do."""
        return (
            f"{self.diverged} of {self.rollouts} rollouts of {self.subject} diverged, expected at "
            "most 1 % of them, or one of several: take a shorter step of the scene or a weaker "
            "disturbance, or leave it out"
        )


class ExecutorError(EnergyMarginError, RuntimeError):
    """The workers of a call cannot go on: one of them has died, or their executor was shut down."""

    def __init__(self, why: object) -> None:
        """`why`: what the executor said."""
        super().__init__(" ".join(str(why).split()).rstrip(".") or type(why).__name__)

    def __str__(self) -> str:
        """What happened, and what to do."""
        return (
            f"the executor is broken, or was shut down: {self.args[0]}; what was done before is "
            "kept: the same call goes on from there, with an executor that works"
        )
