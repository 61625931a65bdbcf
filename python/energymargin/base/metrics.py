"""The metrics: names, which share an axis, the settings of each, and how values are written."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from energymargin.base.aliases import Floats

ANY = "/any"
"""Ends the name of a metric that asks for at least one of several objects, instead of all."""

TIMED = {"probability": "captured", "probability/success": "success", "probability/any": "any"}
"""Those that ask about a problem's horizon, and which curve of a CaptureProbability each is of."""

METRICS = (
    *("capture", "success", "effort", "effort/est", "effort/rrt", "force"),
    *("capture/any", "success/any", "effort/any", "effort/est/any", "effort/rrt/any"),
    *TIMED,
)

LEAST_EFFORT = ("effort", "effort/any")
"""The least work that was found, as of `em.escape_effort`, with a horizon and without. The other
efforts are the paper's Algorithm 1 as published, with the planner that they name."""


CLOCKLESS = ("capture", "success", "force", "capture/any", "success/any")
"""Those that ask a question without a clock."""


USUAL = ("probability", "effort", "probability/any", "effort/any")
"""Those that `energymargin score` asks over a horizon if none is chosen."""


class Kind(NamedTuple):
    """Metrics whose values can be compared, and so share an axis."""

    metrics: tuple[str, ...]
    """Those of at least one object (ANY) go with them."""
    title: str
    unit: str
    """[J], or the range of a pure number, or "-"."""
    settings: tuple[str, ...]
    """Those of SearchSettings that change its values."""

    @property
    def axis(self) -> str:
        """The label of its axis."""
        return f"{self.title} [{self.unit}]"


OF_TREES = ("nodes", "seed", "nodes_per_edge", "least_likelihood")
OF_ROLLOUTS = ("rollouts", "seed", "strength", "objects", "common_random_numbers")
OF_ESCAPES = ("nodes", "seed", "stop_at_escape")
KINDS = {
    "likelihood": Kind(("capture", "success"), "likelihood", "0..1", OF_TREES),
    "probability": Kind(("probability", "probability/success"), "probability", "0..1", OF_ROLLOUTS),
    "effort": Kind(("effort", "effort/est", "effort/rrt"), "effort of escape", "J", OF_ESCAPES),
    "force": Kind(("force",), "force score", "-", ()),
}


def of_kind(kind: str, metrics: Iterable[str]) -> list[str]:
    """Those of a kind, each metric of at least one object after that of all."""
    there = set(metrics)
    return [m for name in KINDS[kind].metrics for m in (name, name + ANY) if m in there]


def unit(metric: str) -> str:
    """ "J"; empty for a pure number."""
    return "J" if metric_kind(metric) is KINDS["effort"] else ""


def settings_of(metric: str) -> tuple[str, ...]:
    """The settings that change its values; of another program's metric those of a tree."""
    return (metric_kind(metric) or KINDS["likelihood"]).settings


def is_likelihood(metric: str) -> bool:
    """Whether it lies between 0 and 1."""
    return metric_kind(metric) in (KINDS["likelihood"], KINDS["probability"])


def axis_label(metric: str) -> str:
    """An axis of one metric, as "effort [J]"; another program's has no unit."""
    kind = metric_kind(metric)
    return metric if kind is None else f"{metric} [{kind.unit}]"


def value_text(metric: str, value: float) -> str:
    """A value without its unit, as "0.981", or what it means: "no escape"."""
    if math.isnan(value):
        return "missing"
    if math.isinf(value):
        return "no escape" if unit(metric) else "infinite"
    return f"{value:.3f}" if is_likelihood(metric) else f"{value:.3g}"


def with_unit(metric: str, value: float) -> str:
    """A value as `value_text`, with its unit."""
    text = value_text(metric, value)
    return f"{text} {unit(metric)}".rstrip() if math.isfinite(value) else text


def check_metrics(metrics: Sequence[str]) -> None:
    """Raises ValueError on an unknown metric, or none at all."""
    if isinstance(metrics, str):
        raise ValueError(f"metrics is {metrics!r}, expected several: [{metrics!r}]")
    unknown = [metric for metric in metrics if metric not in METRICS]
    if unknown or not metrics:
        what = repr(unknown[0]) if unknown else "empty"
        raise ValueError(f"metrics is {what}, expected some of {', '.join(METRICS)}")


def check_scores(metric: str, values: Floats) -> None:
    """Raises ValueError on a score that cannot be. NaN is one that is not there, and inf an effort
    without an escape."""
    low, high = (0.0, 1.0) if is_likelihood(metric) else (-sys.float_info.max, math.inf)
    wrong = values[(values < low) | (values > high)]
    if len(wrong):
        expected = "0 to 1" if is_likelihood(metric) else "a number or inf"
        text = f"{metric} has {wrong[0]:g}, expected {expected}, or NaN where there is none"
        raise ValueError(text)


def metric_kind(metric: str) -> Kind | None:
    """The kind of a metric; None of another program's."""
    name = metric.removesuffix(ANY)
    return next((kind for kind in KINDS.values() if name in kind.metrics), None)
