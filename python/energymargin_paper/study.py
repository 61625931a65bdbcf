"""What all studies share: settings, a folder of results, a table, numbers and figures."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from energymargin.base.checks import core_count
from energymargin.base.replacing import replace_text
from energymargin.base.settings import setting
from energymargin.cli.terminal import out, progress_bar

if TYPE_CHECKING:
    from _typeshed import DataclassInstance
    from matplotlib.figure import Figure

__all__ = ["Progress", "Result", "Study", "setting"]

Progress = Callable[..., None]
"""Called with what the study's `bar` takes: (done, total), if it says nothing else."""


class Result(Protocol):
    """What a study finds."""

    def to_markdown(self) -> str:
        """Its tables."""
        ...

    def to_csv(self) -> str:
        """Its numbers, in full precision."""
        ...


SettingsT = TypeVar("SettingsT", bound="DataclassInstance")
ResultT = TypeVar("ResultT", bound=Result)


class Study(ABC, Generic[SettingsT, ResultT]):
    """A study. Its docstring is the help of its command; its module has it as `STUDY`.

    Settings are a frozen dataclass that checks itself; a field made by `setting` is an option.
    """

    name: str
    """Name of its command and folder; its files have it with underscores."""
    settings: SettingsT
    """Settings of the whole study."""
    quick: SettingsT
    """For a first picture."""
    title: str
    """What it does, beside the progress bar."""
    unit: str
    """What the progress bar counts."""
    threaded: bool = True
    """Whether it takes a number of threads."""
    improved: bool = False
    """Whether efforts of the improved search are in it, which may move alone."""
    packages: tuple[str, ...] = ()
    """Whose versions may move a number, beside numpy and scipy."""
    folders: tuple[str, ...] = ()
    """Variables of the environment that name folders of data, which it takes if they are set and
    its settings name none."""

    @property
    def stem(self) -> str:
        """The name of its files."""
        return self.name.replace("-", "_")

    @abstractmethod
    def compute(
        self, settings: SettingsT, folder: Path, threads: int, progress: Progress
    ) -> ResultT:
        """Computes what the folder does not have yet."""

    def figures(self, result: ResultT) -> Iterator[tuple[str, Figure]]:
        """The pictures, each with the name of its file; none of a study without one."""
        yield from ()

    def bar(self) -> AbstractContextManager[Progress]:
        """The progress bar at the terminal."""
        return progress_bar(self.title, self.unit)

    def show(self, result: ResultT) -> None:
        """The tables at the terminal."""
        out.print(result.to_markdown(), markup=False, highlight=False, soft_wrap=True)

    def write(self, result: ResultT, folder: Path) -> None:
        """The tables (.md) and the numbers (.csv)."""
        replace_text(folder / f"{self.stem}.md", result.to_markdown())
        replace_text(folder / f"{self.stem}.csv", result.to_csv())

    def reproduce(
        self,
        settings: SettingsT,
        folder: Path,
        *,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> ResultT:
        """Makes the study in a folder, from what is there already; writes its tables and numbers.

        `threads`: all cores if not given. Raises ValueError on a folder that holds another study.
        """
        count = core_count("threads", threads)
        folder.mkdir(parents=True, exist_ok=True)
        result = self.compute(settings, folder, count, progress or (lambda *_: None))
        self.write(result, folder)
        return result
