"""The command `energymargin limits`."""

from __future__ import annotations

from html import escape as escape_html
from pathlib import Path

from rich.markup import escape

from energymargin.base.bars import bar
from energymargin.base.replacing import replace_text
from energymargin.cli.options import Output, Where
from energymargin.cli.places import require_free
from energymargin.cli.terminal import TIMED_OUT, out, say, warn

CARDS = (".html", ".md", ".json")
PAGE = '<!doctype html><html lang="en"><meta charset="utf-8"><title>How much it can take: '


def limits(
    problem: Path,
    /,
    *,
    vary: list[str],
    probability: float = 0.95,
    confidence: float = 0.95,
    draws: int = 120,
    seed: int = 0,
    store: Path | None = None,
    output: Output = None,
    overwrite: bool = False,
    where: Where = Where(),
) -> None:
    """Say how much a problem can take: the critical value of each quantity, and the tightest.

    Example: `energymargin limits push.json --vary friction.box=0.05:1 --vary push=0.1:20`

    Args:
        problem: A problem file, from `problem.save(...)`, with a horizon.
        vary: NAME=LOW:HIGH, once for each quantity: push (N), horizon (s), speed (of the plan, 1 as
            it is), delay (s) and gain of a feedback, friction.BODY, friction.BODY,BODY of a pair,
            mass.BODY (kg), force.JOINT (of its drive), x.BODY to z.BODY, by which a body is moved
            (m), and rx.BODY to rz.BODY, by which it is turned (rad).
        probability: What is asked of the capture probability.
        confidence: Of each interval.
        draws: Rollouts of each value at most; more make the interval narrower.
        seed: Of the draws, which are the same for all values.
        store: A file of answers; what it has is not run again.
        output: Also the card, as .html with a picture, .md or .json.
        overwrite: Replace the file if it exists.
    """
    from energymargin import Problem, actions
    from energymargin.summary import summary

    if output is not None:
        require_free(output, overwrite=overwrite, suffixes=CARDS)
    asked = dict(map(_range, vary))
    with bar("Searching", "rollouts") as progress:
        found = actions.critical_values(
            Problem.load(str(problem)),
            asked,
            probability=probability,
            confidence=confidence,
            draws=draws,
            seed=seed,
            store=store,
            executor=where.executor(),
            progress=progress,
            timeout=where.timeout,
        )
    table = found.to_markdown()
    out.print(table, markup=False, highlight=False, soft_wrap=True)
    if output is not None:
        page = f"{PAGE}{escape_html(problem.name)}</title>{summary(found).to_html()}\n"
        cards = {".html": page, ".json": found.to_json()}
        replace_text(output, cards.get(output.suffix, table))
        say(f"Wrote {escape(str(output))}")
    if not found.complete:
        warn("the time was over before all values were tried")
        raise SystemExit(TIMED_OUT)


def _range(text: str) -> tuple[str, tuple[float, float]]:
    """The name and the range of `NAME=LOW:HIGH`."""
    name, _, ends = text.partition("=")
    try:
        low, high = map(float, ends.split(":"))
    except ValueError:
        raise ValueError(f"--vary is {text!r}, expected NAME=LOW:HIGH, as push=0.1:20") from None
    return name, (low, high)
