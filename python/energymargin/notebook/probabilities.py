"""What a probability over a horizon looks like in a notebook: numbers, and its curve."""

from __future__ import annotations

from typing import Any

from energymargin._core import CaptureProbability
from energymargin.notebook.pictures import beside, drawn
from energymargin.notebook.tables import Row, table

__all__ = ["capture_probability"]

SIZE = (4.5, 3.0)  # inch, of the curve
EQUAL = 1e-9  # of their number: weights that differ by less do not


def capture_probability(found: CaptureProbability) -> str:
    """The probability with its interval, what became of it undisturbed, and the curve beside."""
    horizon = float(found.times[-1])
    rows: list[Row] = [
        (f"captured for {horizon:.3g} s", _with_interval(found, found.captured, "captured")),
        ("mean time captured", f"{found.mean_time:.3g} s"),
        ("undisturbed", _undisturbed(found)),
    ]
    if found.success is not None:
        rows.append(("success at the end", _with_interval(found, found.success, "success")))
    if found.any is not None:
        value = _with_interval(found, found.any.captured, "any")
        rows.append(("captured, at least one object", value))
    rows += [
        (f"captured, object {number}", f"{one.captured:.3f}")
        for number, one in enumerate(found.by_object)
    ]
    rows.append(("rollouts", _rollouts(found)))
    said = "" if found.complete else "Not complete: it was stopped before its end."
    return beside(table("Probability", rows, said), drawn(_draw(found), SIZE), "its curve")


def _with_interval(found: CaptureProbability, value: float, which: str) -> str:
    low, high = found.interval(which=which)
    return f"{value:.3f} ({low:.3f} to {high:.3f} with 95 % confidence)"


def _undisturbed(found: CaptureProbability) -> str:
    stays = "stays captured" if found.undisturbed else f"leaves at {found.undisturbed_time:.3g} s"
    if found.undisturbed_success is None:
        return stays
    return f"{stays}, {'succeeds' if found.undisturbed_success else 'does not succeed'}"


def _rollouts(found: CaptureProbability) -> str:
    words = [str(found.rollouts)]
    if abs(found.effective - found.rollouts) > EQUAL * found.rollouts:
        words.append(f"worth {found.effective:.3g} of equal weight")
    if found.diverged:
        words.append(f"and {found.diverged} that diverged and do not count")
    return ", ".join(words)


def _draw(found: CaptureProbability) -> Any:
    def draw(ax: Any) -> None:
        from energymargin.plots import plot_probability

        plot_probability(found, ax, legend=False)

    return draw
