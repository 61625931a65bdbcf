"""What each class looks like in a notebook: a table, some with a picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin._core import (
    Body,
    CaptureProbability,
    CaptureScore,
    EscapeEffort,
    EscapeEnergy,
    ForceScore,
    Plan,
    Problem,
    Scene,
    Tree,
)
from energymargin.futures import future_rows, plan_rows
from energymargin.metrics import unit, value_text
from energymargin.notebook.html import MOST_ROWS, NamedValue, beside, drawn, grid, table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from energymargin.actions import Improvement, Ranking
    from energymargin.actions.along_plan import Along
    from energymargin.datasets import Dataset
    from energymargin.evaluation import Cell, Evaluation, LabelledScores
    from energymargin.scoring import ScoreTable
    from energymargin.store import Run, ScoreStore
    from energymargin.trajectories import Trajectory

__all__ = [
    "along",
    "capture_probability",
    "capture_score",
    "dataset",
    "escape_effort",
    "escape_energy",
    "evaluation",
    "force_score",
    "improvement",
    "labelled_scores",
    "plan",
    "problem",
    "ranking",
    "run",
    "scene",
    "score_store",
    "score_table",
    "trajectory",
    "tree",
]

NONE_FOUND = "infinite: no way out was found"
NOTHING_SEARCHED = "It was stopped before anything was searched: there is no value."
NOISE = 1e-12  # N, or m; what is less is left of numbers that cancel out

EQUAL = 1e-9  # of their number: weights that differ by less do not

CURVE_SIZE, STATE_SIZE = (4.5, 3.0), (4.5, 3.2)  # inch, of the pictures
DETAIL = 150  # cells of the sets along the longer side of a state's picture, which is quick
COLORS = "object orange, effector green; capture set blue, success set grey with dashed edge"
MOST_NAMES = 4  # of bodies


def capture_score(score: CaptureScore) -> str:
    """Likelihoods with their standard errors, if there are several trees."""
    if not (score.nodes or score.complete):
        return table("Capture score", [], NOTHING_SEARCHED)
    rows: list[NamedValue] = []
    for which in ("capture", "success", "capture_any", "success_any"):
        value = getattr(score, which)
        if value is not None:
            rows.append((_of_any(which), _likelihood(value, getattr(score, f"{which}_stderr"))))
    trees = len(score.capture_by_tree)
    rows.append(("no score is finer than", f"{score.resolution:.2g}"))
    rows.append(("trees", f"{trees} of {score.nodes} nodes"))
    return table("Capture score", rows, _sentences(_unfinished(score.complete), score.warnings))


def _of_any(which: str) -> str:
    name = which.removesuffix("_any")
    return name if name == which else f"{name}, at least one object"


def _likelihood(value: float, stderr: float | None) -> str:
    return f"{value:.3f}" if stderr is None else f"{value:.3f} ± {stderr:.3f} (standard error)"


def escape_effort(result: EscapeEffort) -> str:
    """The effort, and when it was found."""
    if not (result.nodes or result.complete):
        return table("Effort of escape", [], NOTHING_SEARCHED)
    rows: list[NamedValue] = [("effort", _energy(result.effort))]
    if math.isfinite(result.effort):
        rows.append(("path", f"{max(len(result.path) - 1, 0)} edges"))
        rows.append(("found at node", result.history[-1][0] if result.history else 0))
    rows.append(("nodes", result.nodes))
    note = _sentences(_unfinished(result.complete), result.warnings)
    return table("Effort of escape", rows, note)


def escape_energy(result: EscapeEnergy) -> str:
    """The barrier, and how it was found."""
    if not (result.samples or result.complete):
        return table("Escape energy", [], NOTHING_SEARCHED)
    rows: list[NamedValue] = [("energy", _energy(result.energy))]
    if math.isfinite(result.energy):
        rows.append(("path", f"{len(result.path)} states, the barrier at row {result.barrier}"))
    rows.append(("poses drawn", result.samples))
    return table("Escape energy", rows, _unfinished(result.complete))


def force_score(score: ForceScore) -> str:
    """The score and its terms."""
    return table(
        "Force score",
        [
            ("score", _without_noise(score.force)),
            ("distance of object and effector", f"{_without_noise(score.distance)} m"),
            ("effector: normal forces", f"{_without_noise(score.effector.engage)} N"),
            ("effector: to the friction cones' edges", f"{_without_noise(score.effector.stick)} N"),
            ("all else: normal forces", f"{_without_noise(score.ground.engage)} N"),
            ("all else: to the friction cones' edges", f"{_without_noise(score.ground.stick)} N"),
        ],
    )


def _without_noise(value: float) -> str:
    return f"{value:.4g}" if abs(value) > NOISE else "0"


def tree(found: Tree) -> str:
    """The size of a search tree."""
    rows: list[NamedValue] = [
        ("nodes", f"{len(found) - 1} and the root"),
        ("numbers in a state", found.states.shape[1]),
        ("largest cost", _energy(float(found.costs.max()))),
        ("longest edge", f"{float(found.durations.max()):.3g} s"),
    ]
    return table("Search tree", rows)


def _energy(energy: float) -> str:
    return f"{energy:.4g} J" if math.isfinite(energy) else NONE_FOUND


def _sentences(unfinished: str, warnings: Sequence[str]) -> str:
    """Warnings and `unfinished` as sentences, in a line."""
    sentences = [f"{warning[0].upper()}{warning[1:]}." for warning in warnings]
    return " ".join([*sentences, unfinished]).strip()


def _unfinished(complete: bool) -> str:
    return "" if complete else "Not complete: it was stopped before its end."


def capture_probability(found: CaptureProbability) -> str:
    """The probability with its interval, what happens undisturbed, and the curve beside."""
    horizon = float(found.times[-1])
    rows: list[NamedValue] = [
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
    note = _sentences(_unfinished(found.complete), found.warnings)
    return beside(table("Probability", rows, note), drawn(_draw(found), CURVE_SIZE), "its curve")


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


def _draw(found: CaptureProbability) -> Callable[[Axes], None]:
    def draw(ax: Axes) -> None:
        from energymargin.plots import plot_probability

        plot_probability(found, ax=ax, legend=False)

    return draw


def problem(asked: Problem) -> str:
    """The question, beside a picture of the state."""
    sets = {
        "success set": asked.succeeded,
        "capture set of at least one object": asked.captured_any,
        "bounds of the search": asked.within,
    }
    rows: list[NamedValue] = [
        ("bodies", _bodies_in_words(asked.scene)),
        ("largest force", _vector(asked.force, "N")),
        ("largest torque", _vector(asked.torque, "N m")),
        ("longest edge", f"{asked.duration:g} s"),
        ("effector", {"coast": "coasts", "drive": "is driven"}[asked.effector]),
        ("rate λ", f"{asked.rate:g} 1/J"),
        (
            "sets",
            ", ".join(
                ["capture set", *(name for name, region in sets.items() if region is not None)]
            ),
        ),
    ]
    contacts = asked.contacts
    rows.append(("measured contacts", "none" if contacts is None else len(contacts)))
    rows += future_rows(asked)
    return beside(table("Problem", rows), _picture(asked), "the state", COLORS)


def plan(of_robot: Plan) -> str:
    """What the robot does, and how long."""
    return table("Plan", plan_rows(of_robot))


def scene(made: Scene) -> str:
    """Its bodies, a row each."""
    head = ("body", "role", "shape", "mass [kg]", "friction")
    bodies = [
        (
            body.name,
            body.role if body.role != "none" else "",
            type(body.shape).__name__,
            _mass(body),
            f"{body.friction:.3g}",
        )
        for body in made.bodies
    ]
    more = f"{len(made.joints)} joints, {len(made.springs)} springs, "
    note = f"{more}gravity {_vector(made.gravity, 'm/s²')}, {made.dimension} numbers in a state"
    if made.friction_rule != "product":
        note += f", friction by the {made.friction_rule} of two coefficients"
    if made.pair_frictions:
        note += f", coefficients of pairs: {len(made.pair_frictions)}"
    return grid("Scene", head, bodies, note)


def _mass(body: Body) -> str:
    """Or why it does not count."""
    if body.fixed:
        return "fixed"
    return "kinematic" if body.kinematic else f"{body.mass:.4g}"


def _vector(values: Iterable[float], unit: str) -> str:
    return f"({', '.join(f'{value:.4g}' for value in values)}) {unit}"


def _bodies_in_words(scene: Scene) -> str:
    names: dict[str, list[str]] = {"object": [], "effector": [], "none": []}
    for body in scene.bodies:
        names[body.role].append(body.name)
    parts = [
        f"{role if role != 'none' else 'others'}: {_first_names(own)}"
        for role, own in names.items()
        if own
    ]
    return "; ".join(parts)


def _first_names(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(names[:MOST_NAMES]) + more


def _picture(problem: Problem) -> bytes | None:
    def draw(ax: Axes) -> None:
        from energymargin.plots import plot_state

        plot_state(problem, ax=ax, detail=DETAIL)

    return drawn(draw, STATE_SIZE)


def score_table(scores: ScoreTable) -> str:
    """The first problems' scores, a row each."""
    names = list(scores.scores)
    rows = [
        (int(scores.index[i]), *(value_text(name, scores.scores[name][i]) for name in names))
        for i in range(min(len(scores), MOST_ROWS))
    ]
    head = ("problem", *map(_named, names))
    seconds = f"{float(np.sum(scores.seconds)):.3g} s of computing."
    missing = "" if scores.complete else " Not complete: some problems were not scored in time."
    return grid("Scores", head, rows, seconds + missing, len(scores))


def _named(metric: str) -> str:
    return f"{metric} [{unit(metric)}]" if unit(metric) else metric


def ranking(result: Ranking) -> str:
    """The candidates from the best to the worst, beside their intervals."""
    metric = result.metric
    rows = [
        (
            one.name,
            value_text(metric, one.score),
            f"{value_text(metric, one.low)} to {value_text(metric, one.high)}",
            one.draws if one.racing else f"{one.draws}, then {result.left(one.name)}",
        )
        for one in result
    ]
    head = ("candidate", _named(metric), "95 % interval", "draws")
    made = grid("Ranking", head, rows, f"{result.decision}.", len(result))

    def draw(ax: Axes) -> None:
        from energymargin.plots import plot_ranking

        plot_ranking(result, ax)

    return beside(made, drawn(draw, STATE_SIZE), "the candidates with their intervals")


def along(result: Along) -> str:
    """Where it is weakest, beside the probability at each moment."""
    rows = [
        ("moments", len(result)),
        ("of them captured", int(result.captured.sum())),
        ("from, to", f"{result.times[0]:.4g} s, {result.times[-1]:.4g} s"),
    ]

    def draw(ax: Axes) -> None:
        from energymargin.plots import plot_along

        plot_along(result, ax=ax)

    made = table("Margin along a plan", rows, f"{result.summary}.")
    return beside(made, drawn(draw, STATE_SIZE), "the probability at each moment")


def improvement(result: Improvement) -> str:
    """The parameters before and after, and the last comparison."""
    start, found = result.start, result.values
    rows = [(name, f"{start[name]:.4g}", f"{found[name]:.4g}") for name in found]
    made = grid("Improvement", ("parameter", "start", "found"), rows, f"{result.decision}.")
    return made + ranking(result.ranking)


def evaluation(result: Evaluation) -> str:
    """AUC and AP of each score, by horizon."""
    head = ("score", *(f"h = {horizon}" for horizon in result.horizons))
    rows: list[Sequence[object]] = [
        (score, *(_cell(cell) for cell in cells.values())) for score, cells in result.states.items()
    ]
    for name, cell in result.trajectories.items():
        rows.append((name, _cell(cell), *[""] * (len(result.horizons) - 1)))
    note = (
        "AUC/AP, with the 95 % interval of AUC. States: captured in their own frame and the "
        f"next h; success: of whole trajectories, by their last {result.last} frames."
    )
    if result.missing:
        note += f" {result.left_out}."
    return grid(f"Evaluation of {result.task}", head, rows, note)


def _cell(cell: Cell | None) -> str:
    return "one label only" if cell is None else f"{cell.value()}\n{cell.intervals()[0]}"


def labelled_scores(labelled: LabelledScores) -> str:
    """By metric, the number of scores and their range."""
    states = len(labelled.trajectory)
    head = ("metric", "scores", "missing", "infinite", "least", "median", "largest")
    rows = [(_named(name), *_summary(values)) for name, values in labelled.scores.items()]
    members = labelled.by_trajectory() if states else []
    good = sum(bool(labelled.success[own[-1]]) for own in members)
    note = (
        f"Captured: {int(labelled.captured.sum())} of {states} states; "
        f"successful: {good} of {len(members)} trajectories."
    )
    return grid(f"Labelled scores of {labelled.task}", head, rows, note)


def _summary(values: NDArray[np.float64]) -> tuple[object, ...]:
    finite = values[np.isfinite(values)]
    counts = (
        int((~np.isnan(values)).sum()),
        int(np.isnan(values).sum()),
        int(np.isinf(values).sum()),
    )
    if not len(finite):
        return (*counts, "", "", "")
    return (*counts, *(f"{v:.3g}" for v in (finite.min(), np.median(finite), finite.max())))


def trajectory(recorded: Trajectory) -> str:
    """Its frames and labels, and what was drawn for it."""
    captured = recorded.captured
    lost = "" if captured.all() else f", first lost at {recorded.times[captured.argmin()]:.3g} s"
    rows: list[NamedValue] = [
        ("frames", f"{len(recorded)}, {recorded.times[0]:.3g} to {recorded.times[-1]:.3g} s"),
        ("captured", f"{int(captured.sum())} frames{lost}"),
        ("success", _yes(recorded.success)),
    ]
    if recorded.captured_any is not None:
        some = f"{int(recorded.captured_any.sum())} frames"
        rows.append(("captured, at least one object", some))
    if recorded.success_any is not None:
        rows.append(("success, at least one object", _yes(recorded.success_any)))
    rows += [("seed", recorded.seed), ("drawn for it", _parameters(recorded.params))]
    return table("Trajectory", rows)


def dataset(recorded: Dataset) -> str:
    """Its task and parameters, and how many trajectories and states it has."""
    successes = recorded.successes
    return table(
        f"Dataset of {recorded.task}",
        [
            ("trajectories", f"{len(successes)}, {int(successes.sum())} succeed"),
            ("states", recorded.size),
            ("parameters", _parameters(recorded.parameters)),
            ("seed", recorded.seed),
        ],
    )


def score_store(store: ScoreStore) -> str:
    """Its runs, a row each."""
    rows = [
        (one.number, one.task, _scored(one), ", ".join(one.metrics), _asked(one), _settings(one))
        for one in store.runs()
    ]
    head = ("run", "task", "states scored", "scores", "asked about", "settings")
    return grid(f"Scores in {store.path.name}", head, rows, "" if rows else "There are no runs.")


def run(one: Run) -> str:
    """How many states have scores, and with which settings."""
    parameters = "unknown" if one.parameters is None else _parameters(one.parameters)
    return table(
        f"Run {one.number} of {one.store.path.name}",
        [
            ("task", one.task),
            ("parameters", parameters),
            ("states scored", _scored(one)),
            ("scores", ", ".join(one.metrics)),
            ("asked about", _asked(one)),
            ("settings", _settings(one)),
            ("algorithm", one.algorithm),
            ("time of a state", f"{one.seconds():.3g} s"),
        ],
    )


def _scored(one: Run) -> str:
    scored, states = one.counts()
    return f"{scored} of {states}"


def _asked(one: Run) -> str:
    return "the state as it is" if one.future is None else str(one.future)


def _settings(one: Run) -> str:
    return ", ".join(f"{name} = {_short(value)}" for name, value in one.settings.items())


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _parameters(values: Mapping[str, Any]) -> str:
    """Of a task, or of a trajectory. None is a parameter that is drawn for each trajectory."""
    named = values.items()
    parts = [f"{n} drawn at random" if v is None else f"{n} = {_short(v)}" for n, v in named]
    return ", ".join(parts) or "nothing"


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
