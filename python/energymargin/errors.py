"""The base of the package's own errors."""

__all__ = ["EnergyMarginError"]


class EnergyMarginError(Exception):
    """Base of the errors that have a type of their own: `em.ScoreError`, `em.tasks.TaskError`, a
    state that makes no problem, a file that cannot be read, labels that are all alike.

    A bad argument is a ValueError. What a timeout or a cancel ends is a TimeoutError or
    `em.Cancelled`, which are no errors of the package: the caller asked for them.
    """
