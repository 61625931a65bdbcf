"""How far the decomposition of meshes is: pieces that coacd has looked at, of those it knows of.

coacd cuts a solid in two, and its pieces again, in rounds whose number nobody knows before. So the
total grows from round to round. The last piece is the merge of small ones.
"""

from __future__ import annotations

import re
from collections.abc import Callable

__all__ = ["Progress", "Tally", "pieces"]

Progress = Callable[[int, int], None]
"""progress(done, total)"""

LINE = re.compile(r"waiting pool: (\d+)|Processing \[([\d.]+)%\]|(Merge Convex Hulls)")


def pieces(log: str) -> tuple[int, int]:
    """Done and in total, as far as the log of a running coacd goes."""
    rounds: list[int] = []
    share = 0.0
    for count, percent, merge in LINE.findall(log):
        if count:
            rounds.append(int(count))
            share = 0.0
        elif merge:
            share = 1.0
        else:
            share = max(share, float(percent) / 100.0)
    if not rounds:
        return 0, 1
    return sum(rounds[:-1]) + round(share * rounds[-1]), sum(rounds) + 1


class Tally:
    """The progress of several works, one after the other."""

    def __init__(self, report: Progress | None, works: int = 1) -> None:
        """Of so many works, of which each counts as 1 until it begins; None: reported to nobody."""
        self._report = report
        self._waiting = works
        self._before = 0  # in the works that are done
        self._current = 0  # in the work that is being done

    @property
    def total(self) -> int:
        """In all works, as far as is known."""
        return self._before + self._current + self._waiting

    def expect(self, works: int) -> None:
        """So many are still to begin."""
        self._waiting = works

    def begin(self) -> Progress:
        """Ends the work before, and returns the progress of the next one."""
        self._before += self._current
        self._waiting = max(self._waiting - 1, 0)
        self._current = 1

        def report(done: int, total: int) -> None:
            self._current = total
            if self._report is not None:
                self._report(self._before + done, self.total)

        return report
