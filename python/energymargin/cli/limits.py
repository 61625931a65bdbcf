"""The command `energymargin limits`."""

from __future__ import annotations

from html import escape as escape_html
from pathlib import Path
from typing import Any

import energymargin as em
from energymargin.base.bars import bar
from energymargin.base.replacing import replace_text
from energymargin.cli import grasp_words as words, terminal
from energymargin.cli.options import Output, Where, given, require_beside

CARDS = (".html", ".md", ".json")
PAGE = '<!doctype html><html lang="en"><meta charset="utf-8"><title>How much it can take: '


def limits(
    file: Path,
    /,
    *,
    vary: list[str],
    hand: str | None = None,
    protocol: str | None = None,
    probability: float = 0.95,
    confidence: float = 0.95,
    draws: int | None = None,
    seed: int = 0,
    store: Path | None = None,
    output: Output = None,
    overwrite: bool = False,
    rows: words.Rows = words.Rows(),
    thing: words.Thing = words.Thing(),
    where: Where = Where(),
) -> None:
    """Say how much a problem, or each grasp of a file, can take: critical values with intervals.

    Example: `energymargin limits push.json --vary friction.box=0.05:1 --vary push=0:20`

    How hard must a hand close: `energymargin limits mug.h5 --hand panda --object mug.obj --mass 0.2
    --vary force=1:60`

    Args:
        file: A problem with a horizon, from `problem.save(...)`; with --hand grasps, as of
            `energymargin grasps`.
        vary: NAME=LOW:HIGH, once for each quantity: push (N), horizon (s), speed (of the plan, 1 as
            it is), delay (s) and gain of a feedback, friction.BODY, friction.BODY,BODY of a pair,
            mass.BODY (kg), force.JOINT (of its drive), x.BODY to z.BODY, by which a body is moved
            (m), and rx.BODY to rz.BODY, by which it is turned (rad). Of grasps: force (N),
            friction, mass (kg), x to z (m) and rx to rz (rad), by which the hand is off.
        hand: With it the file has grasps: as of `energymargin grasps`, by name or as JSON.
        protocol: Of grasps: hold (by default), lift, shake, graspa, acronym, or JSON.
        probability: What is asked of the probability.
        confidence: Of each interval.
        draws: Rollouts of each value at most, 120, or as many as a probability near 0 or 1 needs;
            more make the interval narrower.
        seed: Of the draws, which are the same for all values.
        store: A file of answers; what it has is not run again.
        output: Also the card, as .html with a picture, .md or .json.
        overwrite: Replace the file if it exists.
    """
    if output is not None:
        terminal.require_free(output, overwrite=overwrite, suffixes=CARDS)
    require_beside("hand", hand, protocol=protocol, **given(thing))
    ranges = dict(map(_range, vary))
    if len(ranges) < len(vary):
        raise ValueError(f"--vary is {', '.join(vary)}, expected each quantity once")
    asked: dict[str, Any] = {"vary": ranges, "seed": seed, "executor": where.executor()}
    asked |= {"probability": probability, "confidence": confidence, "timeout": where.timeout}
    asked |= {"store": store, "draws": draws}
    found: em.actions.CriticalValues | em.grasps.GraspLimits
    if hand is None:
        with bar("Searching", "rollouts") as progress:
            found = em.critical_values(em.Problem.load(str(file)), progress=progress, **asked)
    else:
        found = _of_grasps(rows.read(file), hand, protocol or "hold", thing, asked)
    told = em.summary.summary(found)
    if hand is None:
        terminal.print_markdown(told.to_markdown())
    else:
        terminal.out.print(told, markup=False, highlight=False, soft_wrap=True)
    if output is not None:
        page = f"{PAGE}{escape_html(file.name)}</title>{told.to_html()}\n"
        cards = {".html": page, ".md": told.to_markdown()}
        replace_text(output, cards.get(output.suffix) or found.to_json())
        terminal.say_written([output])
    terminal.require_complete(found, "all values were tried")


def _of_grasps(
    found: em.grasps.GraspSet, hand: str, protocol: str, thing: words.Thing, asked: dict[str, Any]
) -> em.grasps.GraspLimits:
    with words.arguments_as_options(words.OF_OBJECT), bar("Searching", "grasps") as progress:
        object = em.grasps.GraspObject.of(found.object, **given(thing))
        what = (found, words.chosen_hand(hand), object, words.chosen_protocol(protocol))
        return em.grasps.limits(*what, progress=progress, **asked)


def _range(text: str) -> tuple[str, tuple[float, float]]:
    """The name and the range of `NAME=LOW:HIGH`."""
    name, _, ends = text.partition("=")
    try:
        low, high = map(float, ends.split(":"))
    except ValueError:
        raise ValueError(f"--vary is {text!r}, expected NAME=LOW:HIGH, as push=0.1:20") from None
    return name, (low, high)
