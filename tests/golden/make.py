"""Writes the golden problems and values anew: `.venv/bin/python tests/golden/make.py`.

Do so only when a change of the physics, of a search or of a seed is meant, and say which in the
commit. Then ALGORITHM in searches.py, or ALGORITHM_IMPROVED if only efforts of the improved
search have moved, becomes the version that has the change, so that stores do not take old scores
for new ones. Problems are made once: only with --problems are they made again from the tasks.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import energymargin as em
from energymargin.evaluate.searches import ALGORITHM, ALGORITHM_IMPROVED

FOLDER = Path(__file__).parent
# (seed, frame) of each task's problem: moments of which the scores have something to say.
MOMENTS = {
    "balance": (8, 4),
    "grasp": (8, 5),
    "push": (9, 2),
    "push-multi": (7, 0),
    "push-real": (3, 3),
    "scoop": (8, 5),
    "topple": (9, 3),
}
PARAMETERS = {"push-real": {"object": "irregular"}}  # others than the task's own
NODES, SAMPLES, SEED = 60, 300, 7
SEARCHES = ("improved", "published")
OF_SPEED = ("problem-topple",)  # their capture set is left by speed, so there is no escape energy


def problem_files() -> list[Path]:
    """One problem file a task."""
    return sorted(FOLDER.glob("problem-*.json"))


def values(name: str, problem: em.Problem, threads: int = 1) -> dict[str, str]:
    """Every metric, to the last bit."""
    several = problem.captured_any is not None
    found: dict[str, float | None] = {}
    cap = em.capture_score(problem, nodes=NODES, seed=SEED, trees=3, threads=threads, warn=False)
    for score in ("capture", "success", "capture_any", "success_any"):
        found[score] = getattr(cap, score)
        found[f"{score}_stderr"] = getattr(cap, f"{score}_stderr")
    for planner in ("est", "rrt"):
        for captured in ("all", "any") if several else ("all",):
            for search in SEARCHES:
                asked = {"planner": planner, "captured": captured, "search": search}
                effort = em.escape_effort(problem, nodes=NODES, seed=SEED, **asked).effort
                found[f"effort/{planner}/{captured}/{search}"] = effort
    bodies = json.loads(problem.to_json())["scene"]["bodies"]
    first = next(body["name"] for body in bodies if body.get("role") == "object")
    for planner in () if name in OF_SPEED else ("bit*", "rrt*"):
        found[f"escape_energy/{planner}"] = em.escape_energy(
            problem, planner=planner, samples=SAMPLES, seed=SEED, object=first
        ).energy
    found["force"] = em.force_score(problem).force
    return {metric: value.hex() for metric, value in found.items() if value is not None}


def part(golden: dict[str, dict[str, str]], improved: bool) -> dict[str, dict[str, str]]:
    """The values of the improved search, or all the others."""
    return {
        name: {k: v for k, v in own.items() if k.endswith("/improved") == improved}
        for name, own in golden.items()
    }


def main() -> None:
    """Problems if asked for, and values."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--problems", action="store_true", help="the problems too, from the tasks")
    if parser.parse_args().problems:
        for name, (seed, frame) in MOMENTS.items():
            task = em.tasks.make(name, **PARAMETERS.get(name, {}))
            ran = task.rollout(seed=seed)
            problem = task.problem(ran.states[frame], ran.params, ran.contacts[frame])
            problem.save(FOLDER / f"problem-{name}.json")
    golden = {path.stem: values(path.stem, em.Problem.load(path)) for path in problem_files()}
    before = json.loads((FOLDER / "values.json").read_text())
    algorithms = {"algorithm": ALGORITHM, "algorithm_improved": ALGORITHM_IMPROVED}
    for name, improved in {"ALGORITHM": False, "ALGORITHM_IMPROVED": True}.items():
        now = algorithms[name.lower()]
        moved = part(golden, improved) != part(before["values"], improved)
        if moved and before[name.lower()] == now:
            sys.exit(f"scores moved, but {name} in searches.py is still {now}: raise it")
    text = json.dumps({**algorithms, "values": golden}, indent=1)
    (FOLDER / "values.json").write_text(text + "\n")


if __name__ == "__main__":
    main()
