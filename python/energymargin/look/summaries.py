"""The summary of each class: a function of its name, as `summary` looks for it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin import _core
from energymargin.base.metrics import ANY, TIMED, unit, value_text
from energymargin.base.summary import MOST_ROWS, Picture, Summary
from energymargin.base.table_text import DASH
from energymargin.evaluate.futures import disturbance_in_words, future_rows, plan_rows

if TYPE_CHECKING:
    from energymargin.act.critical import CriticalValue
    from energymargin.act.improvement import Improvement
    from energymargin.act.limits import CriticalValues
    from energymargin.act.profile import MarginProfile
    from energymargin.act.ranking import Ranking
    from energymargin.act.surrogates import Surrogate
    from energymargin.evaluate.scoring import ScoreTable
    from energymargin.grasps import GraspComparison, GraspScores
    from energymargin.grasps.trials import GraspTrials
    from energymargin.model.scenes.reports import SceneReport
    from energymargin.records.datasets import Dataset
    from energymargin.records.evaluation import Cell, Evaluation, LabelledScores
    from energymargin.records.store import Run, ScoreStore
    from energymargin.tasks.trajectories import Trajectory

NONE_FOUND = "infinite: no way out was found"
NOTHING_SEARCHED = "It was stopped before anything was searched: there is no value."
UNFINISHED = "Not complete: it was stopped before its end."
NOISE = 1e-12  # N, or m; what is less is left of numbers that cancel out
EQUAL = 1e-9  # of their number: weights that differ by less do not
DETAIL = 150  # cells of the sets along the longer side of a state's picture, which is quick
STATE = "the state: object orange, effector green, capture set blue, success set grey and dashed"
MOST_NAMES = 4  # of bodies

SummaryRow = tuple[str, object]


# Searches


def capture_score(score: _core.CaptureScore) -> Summary:
    """Likelihoods with their standard errors, if there are several trees."""
    rows: dict[str, object] = {}
    for name in ("capture", "success", "capture_any", "success_any"):
        value, stderr = getattr(score, name), getattr(score, f"{name}_stderr")
        if value is not None:
            error = "" if stderr is None else f" ± {stderr:.3f} (standard error)"
            rows[name.replace("_any", ", at least one object")] = f"{value:.3f}{error}"
    rows["no score is finer than"] = f"{score.resolution:.2g}"
    rows["trees"] = f"{len(score.capture_by_tree)} of {score.nodes} nodes"
    return _search("Capture score", rows, score, score.nodes)


def escape_effort(result: _core.EscapeEffort) -> Summary:
    """The effort, and when it was found."""
    rows: dict[str, object] = {"effort": _energy(result.effort)}
    if math.isfinite(result.effort):
        rows["path"] = f"{max(len(result.path) - 1, 0)} edges"
        rows["found at node"] = result.history[-1][0] if result.history else 0
    return _search("Effort of escape", {**rows, "nodes": result.nodes}, result, result.nodes)


def escape_energy(result: _core.EscapeEnergy) -> Summary:
    """The barrier, and how it was found."""
    rows: dict[str, object] = {"energy": _energy(result.energy)}
    if math.isfinite(result.energy):
        rows["path"] = f"{len(result.path)} states, the barrier at row {result.barrier}"
    rows["poses drawn"] = result.samples
    return _search("Escape energy", rows, result, result.samples)


def _search(title: str, rows: Mapping[str, object], result: Any, size: int) -> Summary:
    """A search of that size, which may have been stopped before it found anything."""
    if not (size or result.complete):
        return Summary(title, notes=[NOTHING_SEARCHED])
    return Summary(title, list(rows.items()), notes=_notes(result))


def force_score(score: _core.ForceScore) -> Summary:
    """The score and its terms."""
    rows: list[SummaryRow] = [
        ("score", _without_noise(score.force)),
        ("distance of object and effector", f"{_without_noise(score.distance)} m"),
    ]
    for name, terms in (("effector", score.effector), ("all else", score.ground)):
        rows.append((f"{name}: normal forces", f"{_without_noise(terms.engage)} N"))
        rows.append((f"{name}: to the friction cones' edges", f"{_without_noise(terms.stick)} N"))
    return Summary("Force score", rows)


def _without_noise(value: float) -> str:
    return f"{value:.4g}" if abs(value) > NOISE else "0"


def tree(found: _core.Tree) -> Summary:
    """The size of a search tree."""
    rows: list[SummaryRow] = [
        ("nodes", f"{len(found) - 1} and the root"),
        ("numbers in a state", found.states.shape[1]),
        ("largest cost", _energy(float(found.costs.max()))),
        ("longest edge", f"{float(found.durations.max()):.3g} s"),
    ]
    return Summary("Search tree", rows)


def _energy(energy: float) -> str:
    return f"{energy:.4g} J" if math.isfinite(energy) else NONE_FOUND


def _notes(result: Any) -> list[str]:
    """Warnings as sentences, and whether it was stopped."""
    sentences = [_sentence(warning) for warning in getattr(result, "warnings", ())]
    return sentences if result.complete else [*sentences, UNFINISHED]


def capture_probability(found: _core.CaptureProbability) -> Summary:
    """The probability with its interval, what happens undisturbed, and the curve beside."""

    def with_interval(value: float, which: str) -> str:
        low, high = found.interval(which=which)
        return f"{value:.3f} ({low:.3f} to {high:.3f} with 95 % confidence)"

    if found.undisturbed is None:
        undisturbed = "was not asked for"
    elif found.undisturbed:
        undisturbed = "stays captured"
    else:
        undisturbed = f"leaves at {found.undisturbed_time:.3g} s"
    if found.undisturbed_success is not None:
        undisturbed += ", succeeds" if found.undisturbed_success else ", does not succeed"
    rollouts = str(found.rollouts)
    if abs(found.effective - found.rollouts) > EQUAL * found.rollouts:
        rollouts += f", worth {found.effective:.3g} of equal weight"
    if found.diverged:
        rollouts += f", and {found.diverged} that diverged and do not count"
    rows = {
        f"captured for {found.times[-1]:.3g} s": with_interval(found.captured, "captured"),
        "mean time captured": f"{found.mean_time:.3g} s",
        "undisturbed": undisturbed,
    }
    if found.success is not None:
        rows["success at the end"] = with_interval(found.success, "success")
    if found.any is not None:
        rows["captured, at least one object"] = with_interval(found.any.captured, "any")
    for name, each in found.by_object.items():
        rows[f"captured, {name}"] = f"{each.captured:.3f}"
    rows["rollouts"] = rollouts
    curve = Picture("plot_probability", found, "its curve", {"legend": False})
    return Summary("Probability", list(rows.items()), notes=_notes(found), picture=curve)


# Questions


def problem(asked: _core.Problem) -> Summary:
    """The question, beside a picture of the state."""
    sets = {
        "capture set": asked.captured,
        "success set": asked.succeeded,
        "capture set of at least one object": asked.captured_any,
        "bounds of the search": asked.within,
    }
    contacts = asked.contacts
    rows: list[SummaryRow] = [
        ("bodies", _bodies_in_words(asked.scene)),
        ("largest force", _vector(asked.force, "N")),
        ("largest torque", _vector(asked.torque, "N m")),
        ("longest edge", f"{asked.duration:g} s"),
        ("effector", {"coast": "coasts", "drive": "is driven"}[asked.effector]),
        ("rate λ", f"{asked.rate:g} 1/J"),
        ("sets", ", ".join(name for name, region in sets.items() if region is not None)),
        ("measured contacts", "none" if contacts is None else len(contacts)),
        *future_rows(asked),
    ]
    state = Picture("plot_state", asked, STATE, {"detail": DETAIL})
    return Summary("Problem", rows, picture=state)


def plan(of_robot: _core.Plan) -> Summary:
    """What the robot does, and how long."""
    return Summary(type(of_robot).__name__, plan_rows(of_robot))


def scene(made: _core.Scene) -> Summary:
    """Its bodies, a row each."""
    head = ("body", "role", "shape", "mass [kg]", "friction")
    bodies = []
    for body in made.bodies:
        mass = "kinematic" if body.kinematic else f"{body.mass:.4g}"
        role, shape = body.role.replace("none", ""), type(body.shape).__name__
        mass = "fixed" if body.fixed else mass
        bodies.append((body.name, role, shape, mass, f"{body.friction:.3g}"))
    note = f"{len(made.joints)} joints, {len(made.springs)} springs, gravity "
    note += f"{_vector(made.gravity, 'm/s²')}, {made.dimension} numbers in a state"
    if made.friction_rule != "product":
        note += f", friction by the {made.friction_rule} of two coefficients"
    if made.pair_frictions:
        note += f", coefficients of pairs: {len(made.pair_frictions)}"
    return Summary("Scene", bodies, head, [note])


def scene_report(report: SceneReport) -> Summary:
    """What became of the files of a scene, a row each."""
    notes = [] if report else ["Nothing was left out, left loose, or stated."]
    return Summary("Report of a scene", report, ("what", "name", ""), notes)


def _vector(values: Iterable[float], unit: str) -> str:
    return f"({', '.join(f'{value:.4g}' for value in values)}) {unit}"


def _bodies_in_words(scene: _core.Scene) -> str:
    parts = []
    for role, title in {"object": "object", "effector": "effector", "none": "others"}.items():
        names = [body.name for body in scene.bodies if body.role == role]
        more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
        parts += [f"{title}: {', '.join(names[:MOST_NAMES])}{more}"] if names else []
    return "; ".join(parts)


# Scores of many


def score_table(scores: ScoreTable) -> Summary:
    """The first problems' scores, a row each."""
    rows = [
        (int(scores.index[i]), *(value_text(m, values[i]) for m, values in scores.scores.items()))
        for i in range(min(len(scores), MOST_ROWS))
    ]
    notes = [f"{float(np.sum(scores.seconds)):.3g} s of computing."]
    notes += [] if scores.complete else ["Not complete: some problems were not scored in time."]
    head = ("problem", *map(_named, scores.scores))
    return Summary("Scores", rows, head, notes, total=len(scores))


def _named(metric: str) -> str:
    return f"{metric} [{unit(metric)}]" if unit(metric) else metric


def labelled_scores(labelled: LabelledScores) -> Summary:
    """By metric, the number of scores and their range."""
    states = len(labelled.trajectory)
    head = ("metric", "scores", "missing", "infinite", "least", "median", "largest")
    rows = [(_named(name), *_counts(values)) for name, values in labelled.scores.items()]
    members = labelled.by_trajectory() if states else []
    good = sum(bool(labelled.success[own[-1]]) for own in members)
    note = (
        f"Captured: {int(labelled.captured.sum())} of {states} states; "
        f"successful: {good} of {len(members)} trajectories."
    )
    return Summary(f"Labelled scores of {labelled.task}", rows, head, [note])


def _counts(values: NDArray[np.float64]) -> tuple[object, ...]:
    missing, infinite = int(np.isnan(values).sum()), int(np.isinf(values).sum())
    counts = (len(values) - missing, missing, infinite)
    finite = values[np.isfinite(values)]
    if not len(finite):
        return (*counts, "", "", "")
    return (*counts, *(f"{v:.3g}" for v in (finite.min(), np.median(finite), finite.max())))


def evaluation(result: Evaluation) -> Summary:
    """AUC and AP of each score with their intervals, by horizon and beside the paper's; two tables
    if there are several objects: of all, and of at least one."""
    head = ("score", *result.columns)
    rows = {score: list(map(_stacked, cells.values())) for score, cells in result.states.items()}
    for score, cell in result.trajectories.items():
        rows[score] = [_stacked(cell), *[""] * (len(result.frames) - 1)]
    lines = [(score, *cells, *result.paper_column(score)) for score, cells in rows.items()]
    of_any = [line for line in lines if line[0].endswith(ANY)]
    if not (of_any or result.several):
        return Summary("", lines, head, lead=result.caption)
    of_all = [line for line in lines if not line[0].endswith(ANY)]
    some = Summary("At least one object: captured, and successful", of_any, head)
    title = "All objects: captured together, and successful together"
    return Summary(title, of_all, head, lead=result.caption, further=some)


def _stacked(cell: Cell | None) -> str:
    return DASH if cell is None else "\n".join((cell.value(), *cell.intervals()))


def grasp_comparison(result: GraspComparison) -> Summary:
    """AUC and AP of each score, of the pairs within an object, and how far it is behind."""
    head = ("score", "AUC/AP", "AUC within an object", "behind the probability")
    rows = [
        (
            name,
            _stacked(one.cell),
            _with_span(one.within, one.within_interval),
            DASH if one.ahead_interval is None else _with_span(one.ahead, one.ahead_interval),
        )
        for name, one in result.scores.items()
    ]
    things = ", ".join(result.objects)
    lead = f"{result.held} of {result.grasps} grasps hold ({things})."
    notes = [f"{result.left_out} grasps have no label or no probability."] * (result.left_out > 0)
    return Summary("Which grasps hold", rows, head, notes, lead=lead)


def _with_span(value: float, interval: tuple[float, float] | None) -> str:
    """A value and below it its interval, with a sign where it may be negative."""
    ends = [] if interval is None else [" to ".join(f"{end:.2f}" for end in interval)]
    return DASH if math.isnan(value) else "\n".join([f"{value:.3f}", *ends])


def score_store(store: ScoreStore) -> Summary:
    """Its runs, a row each."""
    head = ("run", "task", "states scored", "scores", "asked about", "settings")
    rows = [(one.number, one.task, *_run_rows(one).values()) for one in store.runs()]
    notes = [] if rows else ["There are no runs."]
    return Summary(f"Scores in {store.path.name}", rows, head, notes)


def _run_rows(one: Run) -> dict[str, str]:
    scored, states = one.counts()
    return {
        "states scored": f"{scored} of {states}",
        "scores": ", ".join(one.metrics),
        "asked about": "the state as it is" if one.future is None else str(one.future),
        "settings": ", ".join(f"{name} = {_short(value)}" for name, value in one.settings.items()),
    }


def run(one: Run) -> Summary:
    """How many states have scores, and with which settings."""
    times = one.times()
    # What a search above gives too takes no time.
    shares = (f"{metric} {t / sum(times.values()):.0%}" for metric, t in times.items() if t)
    rows = {
        "task": one.task,
        "parameters": "unknown" if one.parameters is None else _parameters(one.parameters),
        **_run_rows(one),
        "algorithm": one.algorithm,
        "time of a state": ": ".join(filter(None, (f"{one.seconds():.3g} s", ", ".join(shares)))),
    }
    if any(metric in TIMED for metric in one.metrics):
        rows["probabilities"] = disturbance_in_words(one.settings)
    if one.sampling is not None:
        rows["not known for sure"] = f"{one.sampling}; each score is the mean of its particles"
    return Summary(f"Run {one.number} of {one.store.path.name}", list(rows.items()))


def surrogate(one: Surrogate) -> Summary:
    """What it learned, and how good it is on trajectories that it did not learn from."""
    good = one.quality
    rows = {
        "score": f"{one.metric} of {one.source['task']}",
        "features": f"{len(one.names) - len(one.given)} of a state",
        "given with a state": ", ".join(one.given) or "nothing",
        "tested on": f"{good.states} states of {good.trajectories} trajectories",
        "AUC": f"{good.auc:.3f}, of the scores themselves {good.auc_of_scores:.3f}",
        "calibration error": f"{good.calibration_error:.3f}",
        "within the interval": f"{good.coverage:.1%}, expected {one.coverage:.1%}",
        "refused": f"{good.refused:.1%}",
    }
    return Summary(f"Surrogate of {one.source['task']}", list(rows.items()))


# Trajectories


def trajectory(recorded: Trajectory) -> Summary:
    """Its frames and labels, and what was drawn for it."""
    captured, yes = recorded.captured, {True: "yes", False: "no"}
    lost = "" if captured.all() else f", first lost at {recorded.times[captured.argmin()]:.3g} s"
    rows: dict[str, object] = {
        "frames": f"{len(recorded)}, {recorded.times[0]:.3g} to {recorded.times[-1]:.3g} s",
        "captured": f"{int(captured.sum())} frames{lost}",
        "success": yes[bool(recorded.success)],
    }
    if recorded.captured_any is not None:
        rows["captured, at least one object"] = f"{int(recorded.captured_any.sum())} frames"
    if recorded.success_any is not None:
        rows["success, at least one object"] = yes[bool(recorded.success_any)]
    rows |= {"seed": recorded.seed, "drawn for it": _parameters(recorded.params)}
    return Summary("Trajectory", list(rows.items()))


def dataset(recorded: Dataset) -> Summary:
    """Its task and parameters, and how many trajectories and states it has."""
    successes = recorded.successes
    rows: list[SummaryRow] = [
        ("trajectories", f"{len(successes)}, {int(successes.sum())} succeed"),
        ("states", recorded.size),
        ("parameters", _parameters(recorded.parameters)),
        ("seed", recorded.seed),
    ]
    return Summary(f"Dataset of {recorded.task}", rows)


def _parameters(values: Mapping[str, Any]) -> str:
    """Parameters in words; None is one that is drawn at random for each trajectory."""
    named = values.items()
    parts = [f"{n} drawn at random" if v is None else f"{n} = {_short(v)}" for n, v in named]
    return ", ".join(parts) or "nothing"


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


# Plans


def ranking(result: Ranking) -> Summary:
    """The candidates from the best to the worst, beside their intervals; and the decision."""
    metric = result.metric
    rows = [
        (
            place,
            each.name,
            value_text(metric, each.score),
            f"{value_text(metric, each.low)} to {value_text(metric, each.high)}",
            each.draws,
            result.left(each.name),
        )
        for place, each in enumerate(result, 1)
    ]
    wild = [
        f"{each.diverged} of {each.draws} rollouts of {each.name} diverged, and do not count."
        for each in result
        if each.diverged
    ]
    head = ("", "candidate", _named(metric), "95 % interval", "draws", "")
    picture = Picture("plot_ranking", result, "the candidates with their intervals")
    return Summary("", rows, head, [_sentence(result.decision), *wild], picture=picture)


def improvement(result: Improvement) -> Summary:
    """The parameters before and after, and the last comparison."""
    start, found = result.start, result.values
    rows = [(name, f"{start[name]:.4g}", f"{found[name]:.4g}") for name in found]
    head, notes = ("parameter", "start", "found"), [_sentence(result.decision)]
    return Summary("", rows, head, notes, further=ranking(result.ranking))


def margin_profile(result: MarginProfile) -> Summary:
    """Where it is weakest, beside the probability at each moment."""
    rows: list[SummaryRow] = [
        ("moments", len(result)),
        ("of them captured", int(result.captured.sum())),
        ("from, to", f"{result.times[0]:.4g} s, {result.times[-1]:.4g} s"),
    ]
    picture = Picture("plot_margin_profile", result, "the probability at each moment")
    return Summary("Margin along a plan", rows, notes=[f"{result.summary}."], picture=picture)


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}{'' if text.endswith('?') else '.'}"


# Grasps

_MOVED = (
    "in {:.0%} of the trials the hand was in the object or the table and got another pose: it may "
    "look better than it is"
)


def grasp_scores(scores: GraspScores) -> Summary:
    """The ranked grasps: all of a few, of many the best, the most doubtful and the worst."""
    n, trials = scores.endings.shape
    order = scores.ranked
    ranks = np.arange(len(order))
    if len(order) > MOST_ROWS:
        third = MOST_ROWS // 3
        doubt = np.abs(scores.probabilities[order] - 0.5)[third:-third]
        doubtful = third + np.sort(np.argsort(doubt, kind="stable")[:third])
        ranks = np.concatenate([ranks[:third], doubtful, ranks[-third:]])
    table = scores.table(ranks.tolist())
    lead = f"{_counted(n, 'grasp')}, {_counted(trials, 'trial')} of {scores.horizon:g} s each"
    lead += "; the best, the most doubtful and the worst" * (len(ranks) < len(order))
    notes = [_sentence(note) for note in _grasp_notes(scores) if note]
    picture = Picture("plot_grasps", scores, "probabilities with their 95 % intervals, by rank")
    rows = list(zip(*table.values(), strict=True))
    return Summary("", rows, tuple(table), notes, lead=lead, picture=picture)


def grasp_trials(asked: GraspTrials) -> Summary:
    """What was asked about grasps: object, hand, protocol, belief and disturbance."""
    from energymargin.grasps import words

    rows: list[SummaryRow] = [
        ("object", words.of_object(asked.object)),
        ("hand", words.of_hand(asked.hand)),
        ("protocol", words.of_protocol(asked.protocol)),
        ("lost", words.of_loss(asked.protocol)),
        ("not known", words.of_belief(asked.belief)),
        ("disturbance", words.of_disturbance(asked)),
        ("a hand in the object", words.OF_COLLIDING[asked.colliding]),
        ("seed", asked.seed),
    ]
    return Summary("What was asked", rows)


def _grasp_notes(scores: GraspScores) -> list[str]:
    """What there is to know about the table."""
    n, made = len(scores.grasps), (scores.endings != -1).sum()
    missing = int((scores.endings == -1).any(axis=1).sum()) - len(scores.errors)
    moved = scores.colliding.sum() if scores.trials.colliding != "lost" else 0
    return [
        _against_labels(scores),
        _MOVED.format(moved / made) if moved else "",
        *scores.warnings,
        f"not complete: {missing} of {n} grasps were not scored" if missing else "",
    ]


def _against_labels(scores: GraspScores) -> str:
    """The AUC of the probabilities, if there are labels of both kinds."""
    from energymargin.grasps import compare

    try:
        found = compare({"": scores}, columns={"": {}})
    except ValueError:
        return ""
    cell = found.scores["probability"].cell
    low, high = cell.auc_interval or (0.0, 1.0)
    lost = found.grasps - found.held
    within = f"AUC {cell.auc:.2f} ({low:.2f} to {high:.2f})"
    return f"{within} against the labels: {found.held} held, {lost} lost"


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}{'s' * (number != 1)}"


# How much it can take


def critical_value(one: CriticalValue) -> Summary:
    """Where it holds, with the interval, and what it took."""
    holds, ends = _where_it_holds(one)
    rows = [
        ("holds", holds),
        (f"{one.confidence:.0%} interval", ends),
        ("captured with probability", f"{one.probability:g}"),
        ("rollouts", one.rollouts),
    ]
    notes = [] if one.monotone else ["Not monotone: new draws have tested the ends."]
    notes += [] if one.complete else [UNFINISHED]
    return Summary(f"Critical {one.quantity}", rows, notes=notes)


def critical_values(found: CriticalValues) -> Summary:
    """A row for each: nominal value, where it holds, with the interval, and margin."""
    rows = [
        (one.quantity, _with_unit(nominal, one.unit), *_where_it_holds(one), _margin(margin))
        for one, nominal, margin in zip(found, found.nominals, found.margins, strict=True)
    ]
    first = found.tightest
    notes = [found.question] + ([] if first is None else [f"Tightest: {first.quantity}."])
    notes += [] if found.complete else [UNFINISHED]
    return Summary("", rows, ("quantity", "nominal", "holds", "interval", "margin"), notes)


def _where_it_holds(one: CriticalValue) -> tuple[str, str]:
    """In words, and the intervals, a part for each crossing."""
    if not one.crossings:
        low, high = (_with_unit(end, one.unit) for end in one.range)
        return "not known" if one.side == "unknown" else one.side, f"asked from {low} to {high}"
    holds = [f"{side} {_with_unit(value, one.unit)}" for value, _, _, side in one.crossings]
    ends = [f"{low:.4g} to {_with_unit(high, one.unit)}" for _, low, high, _ in one.crossings]
    return " and ".join(holds), " and ".join(ends)


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".rstrip()


def _margin(margin: float) -> str:
    if math.isnan(margin):
        return "not known"
    return f"{margin:+.0%}" if math.isfinite(margin) else DASH
