"""What a score depends on beside its problem: the settings of its search, and ALGORITHM."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Literal, TypedDict

import numpy as np

from energymargin.checks import not_negative_number, one_of, whole_number, yes_or_no
from energymargin.disturbances import Uniform
from energymargin.metrics import settings_of

if TYPE_CHECKING:
    from typing_extensions import Unpack

__all__ = [
    "ALGORITHM",
    "ALGORITHM_IMPROVED",
    "SEARCHES",
    "SETTINGS",
    "LooseSettings",
    "Search",
    "SearchSettings",
    "algorithm",
    "algorithm_of",
    "chosen_settings",
]

ALGORITHM = "0.14.0"
"""The version of energymargin since which the same settings give the same bits. A change that moves
any score sets it to the version that has the change, together with the golden values."""

ALGORITHM_IMPROVED = "0.14.0"
"""The same of the efforts of search="improved", which more changes may move than the others."""

Search = Literal["improved", "published"]
"""Of the efforts, as of `escape_effort`."""
SEARCHES: tuple[Search, ...] = ("improved", "published")

MOST_NODES = 10**9

# Settings that came later: with these values, a question is the one that it was without them.
LATER: dict[str, Any] = {
    "search": "published",
    "strength": 1.0,
    "objects": None,
    "common_random_numbers": False,
}


@dataclass(frozen=True)
class SearchSettings:
    """Settings of the searches and rollouts behind the scores. Raises ValueError on bad values."""

    nodes: int = 1000
    """Nodes of each search tree."""
    seed: int = 0
    """Each problem has a stream of its own: the tree of problem i has the seed stream(seed, i)."""
    nodes_per_edge: int = 1
    """Of capture and success, as of `capture_score`."""
    least_likelihood: float = 0.0
    """Of capture and success, as of `capture_score`."""
    stop_at_escape: bool = False
    """Of the efforts, as of `escape_effort`."""
    rollouts: int = 30
    """Of the probabilities, as of `capture_probability`."""
    strength: float = 1.0
    """Of their disturbance, as of `em.disturbances.Uniform`."""
    objects: int | None = None
    """The same: how many of several objects it meets at a time; None: all."""
    common_random_numbers: bool = False
    """Of the probabilities: every problem draws from the seed itself, and not from its own stream,
    so that problems are compared under the same disturbances."""
    search: Search | None = None
    """Of the efforts, as of `escape_effort`: "improved", or "published", which is the paper's;
    None: that which ranks, "improved" of problems with a horizon and "published" of others."""

    def __post_init__(self) -> None:
        """Checks each of them, and brings it to one type, so that stores know 0 and 0.0 as one."""
        checked = {
            "nodes": whole_number("nodes", self.nodes, 1, MOST_NODES),
            "seed": whole_number("seed", self.seed, 0, 2**64 - 1),
            "nodes_per_edge": whole_number("nodes_per_edge", self.nodes_per_edge, 1, MOST_NODES),
            "least_likelihood": _share("least_likelihood", self.least_likelihood),
            "search": None if self.search is None else one_of("search", self.search, SEARCHES),
            "stop_at_escape": yes_or_no("stop_at_escape", self.stop_at_escape),
            "rollouts": whole_number("rollouts", self.rollouts, 1, MOST_NODES),
            "strength": not_negative_number("strength", self.strength),
            "objects": None
            if self.objects is None
            else whole_number("objects", self.objects, 1, MOST_NODES),
            "common_random_numbers": yes_or_no("common_random_numbers", self.common_random_numbers),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def of(self, metric: str) -> dict[str, Any]:
        """Those that change the value of one metric, by which stores know its question."""
        names = settings_of(metric)
        return {
            name: value
            for name, value in self.all().items()
            if name in names and not (name in LATER and value == LATER[name])
        }

    @property
    def disturbance(self) -> Uniform:
        """The disturbance of the probabilities."""
        return Uniform(self.strength, self.objects)

    def of_clock(self, *, timed: bool) -> SearchSettings:
        """The same of problems with a horizon or of others, with a word for the search."""
        search = self.search or ("improved" if timed else "published")
        changed: SearchSettings = replace(self, search=search)
        return changed

    def all(self) -> dict[str, Any]:
        """All of them, by name."""
        return asdict(self)


SETTINGS: tuple[str, ...] = tuple(field.name for field in fields(SearchSettings))
"""The names of all settings."""


class LooseSettings(TypedDict, total=False):
    """The fields of SearchSettings as keywords of a function."""

    nodes: int
    seed: int
    nodes_per_edge: int
    least_likelihood: float
    stop_at_escape: bool
    rollouts: int
    strength: float
    objects: int | None
    common_random_numbers: bool
    search: Search | None


def chosen_settings(
    settings: SearchSettings | None, **loose: Unpack[LooseSettings]
) -> SearchSettings:
    """`settings`, or those that are given one by one; ValueError on both, or on bad values."""
    if settings is None:
        return SearchSettings(**loose)
    if not isinstance(settings, SearchSettings):
        raise ValueError(f"settings is {settings!r}, expected SearchSettings(...)")
    if loose:
        raise ValueError(
            f"settings and {next(iter(loose))} are given, expected one of them: "
            "dataclasses.replace(settings, ...) changes some"
        )
    return settings


def algorithm_of(question: Mapping[str, Any]) -> str:
    """The version of energymargin since which a metric of these settings has the same bits."""
    return ALGORITHM_IMPROVED if question.get("search") == "improved" else ALGORITHM


def algorithm() -> str:
    """ALGORITHM and ALGORITHM_IMPROVED, as a worker elsewhere is asked for them."""
    return ALGORITHM if ALGORITHM == ALGORITHM_IMPROVED else f"{ALGORITHM}/{ALGORITHM_IMPROVED}"


def _share(name: str, value: float) -> float:
    """`value`, if it is a number from 0 to below 1; else a ValueError with `name`."""
    number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    if number and 0 <= value < 1:
        return float(value) + 0.0  # which makes 0.0 of -0.0
    raise ValueError(f"{name} is {value!r}, expected a number of at least 0 and below 1")
