"""The results section of a README, from the files of the paper's studies."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

from energymargin import tasks
from energymargin.evaluation import PAPER_HORIZON
from energymargin.experiments.table2 import LONG_HORIZON, STAND_IN

__all__ = ["BEGIN", "END", "check_readme", "put_into", "results_section"]

BEGIN, END = "<!-- results: energymargin reproduce all -->", "<!-- end of the results -->"
SCORES = {
    "capture": "capture",
    "effort/est": "effort, AO-EST",
    "effort/rrt": "effort, AO-RRT",
    "force": "force (baseline)",
    "success": "success",
}


def check_readme(readme: Path) -> None:
    """Raises ValueError on a README without the two lines, OSError if there is none."""
    _halves(readme)


def put_into(readme: Path, folder: Path) -> None:
    """Replaces what stands between BEGIN and END, and copies the pictures into `docs` beside it.

    Raises ValueError on a README without the two lines, or a folder without any of the studies.
    """
    before, after = _halves(readme)
    section = results_section(folder)
    docs = readme.parent / "docs"
    docs.mkdir(exist_ok=True)
    for name in STUDIES:
        for picture in (folder / name).glob(f"{name.replace('-', '_')}.png"):
            shutil.copyfile(picture, docs / picture.name)
    readme.write_text(f"{before}{BEGIN}\n\n{section}\n{END}{after}")


def _halves(readme: Path) -> tuple[str, str]:
    """What stands before and after the section."""
    before, begin, rest = readme.read_text().partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"{readme} has no lines {BEGIN!r} and {END!r}, between which results go")
    return before, after


def results_section(folder: Path) -> str:
    """Of the studies that the folder has; ValueError if it has none."""
    parts = [
        make(_rows(path), f"docs/{path.stem}.png")
        for name, make in STUDIES.items()
        if (path := folder / name / f"{name.replace('-', '_')}.csv").exists()
    ]
    if not parts:
        raise ValueError(f"{folder} has none of the studies {', '.join(STUDIES)}")
    return "\n".join(parts)


Rows = list[dict[str, str]]


def _table1(rows: Rows, _picture: str) -> str:
    """The default reading of each task."""
    lines = [
        "**Prediction in simulation (the paper's Table I).** The scores of 500 recorded states a "
        "task (50 trajectories, 10 frames each) against what was recorded: is the object captured "
        "now (horizon 0, as in the paper), and does the trajectory succeed? AUC/AP, "
        "in bold ours, beside it the paper's on its own data.",
        "",
        f"| | {' | '.join(SCORES.values())} |",
        "| --- " * (1 + len(SCORES)) + "|",
    ]
    for name in dict.fromkeys(row["task"] for row in rows):
        effector = getattr(tasks.make(name), "effector", "")
        cells = []
        for score in SCORES:
            wanted = (name, effector, score, "" if score == "success" else str(PAPER_HORIZON))
            found = [
                r for r in rows if (r["task"], r["effector"], r["score"], r["horizon"]) == wanted
            ]
            cells.append(_beside(found[0]) if found else "")
        lines.append(f"| {name}, {effector} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _efficiency(rows: Rows, picture: str) -> str:
    lines = [
        "**Time efficiency.** Success prediction (AUC/AP) and computing time of a state on one "
        "thread, by the nodes of the tree, on `push`; mean of several seeds of the search "
        "([more](docs/studies.md)).",
        "",
        "| nodes | success | paper's | time a state | paper's |",
        "| --- " * 5 + "|",
    ]
    for row in rows:
        there = row["paper_seconds"] != ""
        paper = _pair(row["paper_success_auc"], row["paper_success_ap"]) if there else ""
        time = f"{float(row['paper_seconds']):.3g} s" if there else ""
        ours = f"**{_pair(row['success_auc'], row['success_ap'])}**"
        own_time = f"**{float(row['seconds']):.3g} s**"
        lines.append(f"| {row['nodes']} | {ours} | {paper} | {own_time} | {time} |")
    return "\n".join([*lines, "", f"![Time efficiency]({picture})", "", _drawn("efficiency"), ""])


def _perturbation(rows: Rows, picture: str) -> str:
    kinds = list(dict.fromkeys(row["error"] for row in rows))
    levels = list(dict.fromkeys(row["scaled"] for row in rows if row["source"] == "ours"))
    found = {(row["source"], row["error"], float(row["scaled"])): row["ap"] for row in rows}
    lines = [
        "**Errors of the model.** AP of the capture score on `push` with errors in friction, "
        "velocity and position, and of the force score with errors in the contact forces, by the "
        "scaled largest error: 1 is about the whole of what the quantity is. In bold ours, beside "
        "it the paper's where it has that point ([what they are](docs/studies.md)).",
        "",
        f"| scaled error | {' | '.join(kinds)} |",
        "| --- " * (1 + len(kinds)) + "|",
    ]
    for level in map(float, levels):
        cells = []
        for kind in kinds:
            paper = found.get(("paper", kind, level))
            ours = _short(float(found["ours", kind, level]), 3)
            cells.append(f"**{ours}** {_short(float(paper), 2) if paper else ''}".strip())
        lines.append(f"| {level:g} | {' | '.join(cells)} |")
    drawn = _drawn("perturbation")
    return "\n".join([*lines, "", f"![AP with errors of the model]({picture})", "", drawn, ""])


def _figure_quality(_rows: Rows, picture: str) -> str:
    return "\n".join(
        [
            f"![A failed and a successful push, three frames each]({picture})",
            "",
            _drawn(
                "figure-quality", "(success, capture) under each frame, from trees of 100 nodes."
            ),
            "",
        ]
    )


def _table2(rows: Rows, picture: str) -> str:
    columns = (("capture", PAPER_HORIZON), ("capture", LONG_HORIZON), ("success", ""))
    found = {(r["combination"], r["score"], r["horizon"]): r for r in rows}
    lines = [
        f"**Recorded pushes (the paper's Table II).** *{STAND_IN}* AUC/AP, in bold ours, beside it "
        "the paper's on its own recordings, captured now. "
        "[What the trees show](docs/push_real.md).",
        "",
        f"| | capture, now | {LONG_HORIZON} frames (0.6 s) | success |",
        "| --- " * 4 + "|",
    ]
    names = dict.fromkeys(r["combination"] for r in rows)
    for name in names:
        cells = [_beside(found[name, score, str(horizon)]) for score, horizon in columns]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    means = [_mean([found[n, score, str(horizon)] for n in names]) for score, horizon in columns]
    lines.append(f"| mean | {' | '.join(means)} |")
    caption = _drawn("table2", "Of each combination the state that its score gets most wrong.")
    return "\n".join([*lines, "", f"![Trees of ten states]({picture})", "", caption, ""])


def _drawn(study: str, caption: str = "") -> str:
    """What stands below a study's picture: a caption, and the command that draws it."""
    return f"*{caption} (`energymargin reproduce {study}` draws this.)*".replace("* (", "*(")


def _mean(rows: Rows) -> str:
    """Of the values that there are, as a row's."""
    names = ("auc", "ap", "paper_auc", "paper_ap")
    values = {n: [float(row[n]) for row in rows if row[n]] for n in names}
    return _beside({n: str(np.mean(of)) if of else "" for n, of in values.items()}, 3)


def _rows(path: Path) -> Rows:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def _beside(row: dict[str, str], digits: int = 2) -> str:
    """Ours in bold, and the paper's with so many digits."""
    ours = _pair(row["auc"], row["ap"]) if row["auc"] else "—"
    paper = _pair(row["paper_auc"], row["paper_ap"], digits) if row["paper_auc"] else ""
    return f"**{ours}** {paper}".strip()


def _pair(auc: str, ap: str, digits: int = 3) -> str:
    """Such as ".981/.992"."""
    return "/".join(_short(float(value), digits) for value in (auc, ap))


def _short(value: float, digits: int) -> str:
    text = f"{value:.{digits}f}"
    return "1.00" if text.startswith("1") else text.removeprefix("0")


STUDIES: dict[str, Callable[[Rows, str], str]] = {
    "table1": _table1,
    "efficiency": _efficiency,
    "perturbation": _perturbation,
    "figure-quality": _figure_quality,
    "table2": _table2,
}
