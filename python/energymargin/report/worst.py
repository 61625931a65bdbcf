"""The states that each score gets most wrong, as pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from energymargin._core import CaptureScore
from energymargin.evaluation.curves import CAPTURED
from energymargin.evaluation.wrongness import Wrongness
from energymargin.metrics import with_unit
from energymargin.report.pictures import RepeatedSearch, SearchRepeater, picture
from energymargin.report.subject import Data, Subject

__all__ = ["Card", "Mistakes", "Worst", "worst"]


@dataclass(frozen=True)
class Card:
    """One state, and why it is shown."""

    title: str
    text: str
    image: str | None
    """A data URI; None if there is no picture."""
    why: str = ""
    """Why there is none of this state, why it is not that of the score in the file, or why the
    score says less than it seems to."""


@dataclass(frozen=True)
class Mistakes:
    """The most wrong states of one metric."""

    metric: str
    cards: list[Card]
    none: str
    """Why there is none, if so."""


@dataclass(frozen=True)
class Worst:
    """The most wrong states of all metrics."""

    metrics: list[Mistakes]
    lacking: str
    """Why there are no pictures at all; empty if there are."""


def worst(
    subject: Subject,
    data: Data,
    every: Sequence[Wrongness],
    *,
    each: int,
    progress: Callable[[float], None],
) -> Worst:
    """Of each metric and label up to `each` states; `progress` hears of the share that is done."""
    chosen = [
        (one, [p for label in (False, True) for p in one.worst(label, each)]) for one in every
    ]
    total, done = max(1, sum(len(places) for _, places in chosen)), 0
    drawer = _Drawer(subject, data)
    found = []
    for one, places in chosen:
        cards = []
        for place in places:
            progress(done / total)
            cards.append(drawer.card(one, place))
            done += 1
        found.append(Mistakes(one.metric, cards, _none(one)))
    return Worst(found, drawer.lacking)


class _Drawer:
    """Makes the cards."""

    def __init__(self, subject: Subject, data: Data) -> None:
        self._subject, self._data = subject, data
        self._grower: SearchRepeater | None = None
        self.lacking = data.lacking
        """Why it can draw no picture; empty if it can."""
        if data.dataset is not None:
            try:
                self._grower = SearchRepeater(data.dataset, subject.settings, subject.future)
            except ValueError as error:
                self.lacking = str(error)

    def card(self, one: Wrongness, place: int) -> Card:
        """Of a state, or of the last state of a trajectory."""
        number = self._number(one, place)
        title = _title(one, place)
        text = f"{self._where(number)}. {_why(one, place)}"
        if self._grower is None:
            return Card(title, text, None)
        try:
            grown = self._grower.grow(number, one.metric)
            image = picture(grown, self._grower.plane)
        except (ValueError, RuntimeError) as error:  # of a task that has changed, or is gone
            return Card(title, text, None, f"No picture: {error}.")
        return Card(title, text, image, self._notes(one, number, grown))

    def _number(self, one: Wrongness, place: int) -> int:
        """Of the state that stands for a place in what is compared."""
        if one.target == CAPTURED:
            return int(one.compared.number[place])
        return int(self._subject.members[one.compared.trajectory[place]][-1])

    def _where(self, number: int) -> str:
        labelled, frame = self._subject.labelled, int(self._subject.frames[number])
        t = int(labelled.trajectory[number])
        time = ""
        if self._data.dataset is not None:
            time = f" ({self._data.dataset.trajectories[t].times[frame]:.3g} s)"
        return f"Trajectory {t}, frame {frame}{time}"

    def _notes(self, one: Wrongness, number: int, grown: RepeatedSearch) -> str:
        """What is to be known of the picture, and of the score."""
        doubts = grown.search.doubts if isinstance(grown.search, CaptureScore) else ()
        notes = [f"{doubt[0].upper()}{doubt[1:]}." for doubt in doubts]
        changed = self._changed(one, number, grown)
        return " ".join([changed, *notes] if changed else notes)

    def _changed(self, one: Wrongness, number: int, grown: RepeatedSearch) -> str:
        """Whether the tree in the picture is another one than that of the score in the file."""
        stored = self._subject.scores(one.metric)[number]
        if grown.score == stored:
            return ""
        return (
            f"Not the tree of the score in the file: grown again it gives {grown.score:.4g}, and "
            f"the file says {stored:.4g}. The task or energymargin has changed since."
        )


def _title(one: Wrongness, place: int) -> str:
    """The score and what happened: the contradiction."""
    score, label = one.compared.scores[place], bool(one.compared.labels[place])
    return f"{one.metric} {with_unit(one.metric, float(score))}, but {one.words(label).one}"


def _why(one: Wrongness, place: int) -> str:
    label = bool(one.compared.labels[place])
    side = "below" if label else "above"
    if one.ranks.level[place]:
        side += " or level with"
    share = one.ranks.beyond[place] + one.ranks.level[place]
    return f"Ranked {side} {_percent(share)} of the {one.words(not label).many}."


def _none(one: Wrongness) -> str:
    if one.compared.of_both_kinds:
        return "it ranks none on the wrong side"
    return "there are no scores" if not len(one.compared.labels) else "all have the same label"


def _percent(share: float) -> str:
    """Of a share between 0 and 1; neither end is said unless it is meant."""
    text = f"{100 * share:.0f}"
    if text == "100" and share < 1:
        return "more than 99 %"
    return "less than 1 %" if text == "0" else f"{text} %"
