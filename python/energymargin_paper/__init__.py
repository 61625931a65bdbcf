"""The paper's tables and figures made again (`paper`), and our own studies (`evidence`).

A study is one module with one `Study`; `STUDIES` is the list of them, and of what each shows.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from energymargin_paper.study import Study

__all__ = ["STUDIES", "load"]

PAPER = {
    "table1": "Prediction of robustness and success, on every task (Table I)",
    "perturbation": "Prediction with errors of the model (the figure of robustness)",
    "table2": "Prediction on recorded pushes, a simulated stand-in (Table II)",
    "published": "The authors' own data: their scores and ours on the same states",
}
EVIDENCE = {
    "foresight": "What each score of a state foresees of the next frames",
    "act": "Plans chosen by the margin, against nominal ones, in worlds held out",
    "guard": "A guard in front of a noisy policy, against a filter in each step",
    "policies": "Controllers and policies in the loop: in held-out worlds, learned, and of others",
    "contact": "Whether grips hold and towers stand, and what moves keeps its momentum",
    "grasps": "Grasps that others made: beside MuJoCo, a real robot and FleX",
    "tosses": "Real tosses of a cube: the face, the place and the turn at the end",
    "engines": "Labels, escapes and probabilities in MuJoCo too",
}
STUDIES = PAPER | EVIDENCE
"""What each study shows, by name; `table1` is in the module `paper.table1`."""


def load(name: str) -> Study[Any, Any]:
    """The study of a name, one of STUDIES."""
    package = "paper" if name in PAPER else "evidence"
    module = import_module(f"energymargin_paper.{package}.{name.replace('-', '_')}")
    found: Study[Any, Any] = module.STUDY
    return found
