"""How wrong contacts are, and how long they take: here, in PyBullet and in MuJoCo.

`make bench-contact` writes a table (out/contact.md) and a picture (out/contact.png).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from contact_engines import Engine, MuJoCo, Ours, PyBullet
from contact_scenes import SCENES, Judged, Question, judged
from tables import machine, markdown, write

__all__ = ["ENGINES", "figure", "main", "measure", "report"]

ENGINES: tuple[Engine, ...] = (
    Ours(),
    *(PyBullet(iterations) for iterations in (10, 50, 200, 1000)),
    *(MuJoCo(step) for step in (1 / 240, 1 / 1000, 1 / 4000)),
)
RUNS = 5  # of each scene, for the median of its times
LEAST = 1e-4  # mm: a smaller error is drawn there
STYLES = {Ours: ("#D55E00", "o"), PyBullet: ("#0072B2", "s"), MuJoCo: ("#009E73", "^")}

Found = Mapping[tuple[str, str], Judged | None]


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/contact.md"))
    parser.add_argument("--runs", type=int, default=RUNS, help="of each scene, for its times")
    parser.add_argument("--pages", type=Path, help="folder of pages, as docs")
    given = parser.parse_args()
    found = measure(given.runs)
    text = report(found)
    write(given.out, text, "bench-contact", given.pages)
    figure(found).savefig(given.out.with_suffix(".png"))
    print(text)


def measure(runs: int) -> dict[tuple[str, str], Judged | None]:
    """By scene and engine; None where an engine diverges."""
    found: dict[tuple[str, str], Judged | None] = {}
    for question in SCENES:
        for engine in ENGINES:
            found[question.name, engine.name] = _tried(question, engine, runs)
    return found


def _tried(question: Question, engine: Engine, runs: int) -> Judged | None:
    try:
        return judged(question, engine, runs)
    except (RuntimeError, ValueError):  # an engine that diverges, or what it leaves
        return None


def report(found: Found) -> str:
    """A table for each scene."""
    parts = [
        "# Contacts: error and time\n",
        f"{machine('mujoco', 'pybullet')}. Ours and PyBullet take steps of 1/240 s. MuJoCo's "
        "cones are elliptic, its contacts as stiff as its step lets them be. A grip is to fall at "
        "1.05 of its limit. The push is compared with Coulomb's law, integrated apart from any "
        "engine. Times are medians, in one process and one thread.\n",
    ]
    for question in SCENES:
        rows = []
        for engine in ENGINES:
            one = found[question.name, engine.name]
            if one is None:
                rows.append([engine.name, "diverged", "", "", ""])
                continue
            falls = "" if one.falls is None else "yes" if one.falls else "no"
            numbers = [f"{one.error:.3g}", f"{1e6 * one.step:.1f}", f"{1e3 * one.second:.2f}"]
            rows.append([engine.name, *numbers, falls])
        header = ["", question.what, "a step [us]", "a simulated second [ms]", "falls above"]
        if question.name != "grip":
            header, rows = header[:-1], [row[:-1] for row in rows]
        parts += [f"## {question.name.capitalize()}\n", markdown(header, rows)]
    return "\n".join(parts)


def figure(found: Found) -> Figure:
    """Error against time of a simulated second, a panel for each scene."""
    picture = Figure(figsize=(9, 7), dpi=200, layout="constrained")
    for ax, question in zip(picture.subplots(2, 2).flat, SCENES, strict=True):
        for kind, (color, marker) in STYLES.items():
            engines = [engine for engine in ENGINES if isinstance(engine, kind)]
            judgements = [found[question.name, engine.name] for engine in engines]
            points = [
                (1e3 * one.second, max(one.error, LEAST))
                for one in judgements
                if one is not None and math.isfinite(one.error)
            ]
            if points:
                ax.plot(
                    *zip(*points, strict=True), marker, ls="-", color=color, label=kind.__name__
                )
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set_title(question.name, fontsize=10)
        ax.set_xlabel("time of a simulated second [ms]", fontsize=8)
        ax.set_ylabel(question.what, fontsize=8)
    picture.axes[0].legend(fontsize=8, frameon=False)
    return picture


if __name__ == "__main__":
    main()
