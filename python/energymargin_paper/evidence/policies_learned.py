"""A learned policy on the push: who foresees its failures five frames ahead?

A small network learns from a scripted expert to push the box to the wall; its twin sees with noise.
Both run in episodes under random forces on the box. Each state that is captured is asked: will the
box stay captured over the next five frames? What answers are the probability with the policy in
the loop, that of its undisturbed commands replayed, the capture score, and a learned classifier.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from energymargin._core import Cancel, Plan, Problem, Scene, World, capture_probability, stream
from energymargin.base.aliases import Floats
from energymargin.base.table_text import markdown_table
from energymargin.evaluate.searches import SearchSettings, metric_search, value_of
from energymargin.model.policies import Policy
from energymargin.records.evaluation.bootstrap import (
    auc_ap,
    auc_ap_draws,
    bootstrap_weights,
    central,
    ranked,
)
from energymargin.tasks.push import PushTask
from energymargin_paper.evidence.act_demo import HOLD, held, noise
from energymargin_paper.evidence.calibration import calibration_error
from energymargin_paper.probabilities import learned

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TITLE = "A learned policy"

# The expert: a force ahead that holds a speed, and one aside that keeps the pusher behind the box.
LOW, HIGH = np.array([-5.0, 0.0]), np.array([5.0, 15.0])  # N
SPEED, HASTE, FRICTION_FORCE = 0.6, 8.0, 4.5  # m/s ahead, N s/m, N
ASIDE, DAMPING, TURN = 12.0, 8.0, 0.5  # N/m, N s/m, m of the pusher aside for a radian of the box

# The network and how it learns.
LAYERS = (8, 32, 32, 2)
LESSONS, STRAY = 40, 2.0  # episodes of the expert, N of noise on what it does
UPDATES, BATCH, RATE = 3000, 256, 2e-3
BLUR = np.array([0.15, 0.15, 0.3, 0.3, 0.3, 0.6, 0.3, 0.3])  # noise of what the twin sees
POLICIES = {"learned": None, "its noisy twin": BLUR}

# The episodes.
FORCE, TORQUE, CORRELATION = 3.0, 0.18, 1.0  # N, N m on the box, s
STEPS, FRAME, AHEAD = 60, 6, 5  # control steps of an episode and of a frame, frames ahead
CONTROL = round(HOLD * 240)  # steps of the simulation in one of control
NODES = 50  # of the capture score
DRAWS = 2000  # of the bootstrap
CLOSED, OPEN, SCORE, CLASSIFIER = "policy in the loop", "its plan", "capture score", "classifier"
METHODS = (CLOSED, OPEN, SCORE, CLASSIFIER)
LESSON_SEEDS, EPISODE_SEEDS = 500_000, 10_000  # the force was chosen on episodes from 0 on
EPISODE, SEEING = 1, 2  # streams of an episode's draws


def observe(states: Floats) -> Floats:
    """What the policy sees of states (n, s): where the pusher is from the box, the box's yaw and
    velocities, the pusher's velocity; shape (n, 8)."""
    box, pusher = states[:, :13], states[:, 13:26]
    yaw = 2 * np.arctan2(box[:, 5], box[:, 6])
    level = np.asarray((yaw + np.pi / 2) % np.pi - np.pi / 2)
    apart = pusher[:, :2] - box[:, :2]
    return np.asarray(np.hstack([apart, level[:, None], box[:, [7, 8, 12]], pusher[:, 7:9]]))


def expert(seen: Floats) -> Floats:
    """Forces on the pusher, shape (n, 2)."""
    aside, _, yaw, drift, _, _, speed_aside, speed = seen.T
    across = -ASIDE * (aside + TURN * yaw) - DAMPING * (speed_aside - drift)
    forces = np.column_stack([across, FRICTION_FORCE + HASTE * (SPEED - speed)])
    return np.asarray(np.clip(forces, LOW, HIGH))


@dataclass(frozen=True, eq=False)
class Network:
    """Two hidden layers of tanh."""

    weights: list[Floats]
    biases: list[Floats]

    def __call__(self, seen: Floats) -> Floats:
        """Forces, shape (n, 2), within their bounds."""
        return np.asarray(np.clip(self.layers(seen)[-1] * HIGH, LOW, HIGH))

    def layers(self, seen: Floats) -> list[Floats]:
        """What each layer says, from the observations on."""
        found = [seen]
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            sums = found[-1] @ weight + bias
            found.append(sums if k == len(self.weights) - 1 else np.tanh(sums))
        return found


@cache
def trained(seed: int) -> Network:
    """The network after its lessons: what the expert would do where it, or a noisy one, came."""
    seen = np.concatenate([_lesson(seed, number) for number in range(LESSONS)])
    wanted = expert(seen) / HIGH
    random = np.random.default_rng([seed, LESSON_SEEDS])
    sizes = list(itertools.pairwise(LAYERS))
    network = Network(
        [random.normal(size=size) / np.sqrt(size[0]) for size in sizes],
        [np.zeros(size[1]) for size in sizes],
    )
    parameters = network.weights + network.biases
    rules = [Adam(parameter) for parameter in parameters]
    for update in range(1, UPDATES + 1):
        batch = random.integers(len(seen), size=BATCH)
        slopes = _slopes(network, seen[batch], wanted[batch])
        for rule, slope in zip(rules, slopes, strict=True):
            rule.change(slope, update)
    return network


class Adam:
    """How an array learns (Kingma and Ba 2015), with a rate that falls to zero."""

    def __init__(self, array: Floats) -> None:
        """`array` is changed in place."""
        self.array, self.mean, self.square = array, np.zeros_like(array), np.zeros_like(array)

    def change(self, slope: Floats, update: int) -> None:
        """Goes down a slope, in the update of a number from 1 on."""
        self.mean += 0.1 * (slope - self.mean)
        self.square += 0.001 * (slope**2 - self.square)
        size = np.sqrt(self.square / (1 - 0.999**update)) + 1e-8
        rate = RATE * (1 - update / UPDATES)
        self.array -= rate * self.mean / (1 - 0.9**update) / size


def _slopes(network: Network, seen: Floats, wanted: Floats) -> list[Floats]:
    """Of the mean squared error, by weight and then by bias."""
    layers = network.layers(seen)
    error = (layers[-1] - wanted) / len(seen)
    of_weights, of_biases = list[Floats](), list[Floats]()
    for k in reversed(range(len(network.weights))):
        of_weights.insert(0, layers[k].T @ error)
        of_biases.insert(0, error.sum(axis=0))
        error = (error @ network.weights[k].T) * (1 - layers[k] ** 2)
    return of_weights + of_biases


def _lesson(seed: int, number: int) -> Floats:
    """What the expert sees in an episode in which its forces are noisy."""
    random = np.random.default_rng([seed, LESSON_SEEDS + number])

    def act(seen: Floats) -> Floats:
        return np.clip(expert(seen) + STRAY * random.normal(size=2), LOW, HIGH)

    task, params, start = _begun(LESSON_SEEDS + number)
    return observe(_episode(World(task.scene(params)), start, act, _forces(random, STEPS)))


def _begun(seed: int) -> tuple[PushTask, Any, Floats]:
    """The task, and params and start of a seed, as of `task.rollout`."""
    task, random = PushTask(), np.random.default_rng(seed)
    params = task.draw(random)
    return task, params, np.asarray(task.start(World(task.scene(params)), params, random))


def _forces(random: np.random.Generator, pieces: int) -> Floats:
    """On the box in each control step, shape (pieces, 6)."""
    return noise(random, pieces, np.array([FORCE, FORCE, 0, 0, 0, TORQUE]), CORRELATION)


def _episode(
    world: World,
    state: Floats,
    act: Callable[[Floats], Floats],
    forces: Floats | None,
    steps: int = STEPS,
) -> Floats:
    """States at the control times, from the start on, shape (steps + 1, n)."""
    states = [state]
    for k in range(steps):
        drives = {"effector": _held(act(observe(states[-1][None]))[0])}
        if forces is not None:
            drives["object"] = np.tile(forces[k], (CONTROL, 1))
        moved = world.simulate(states[-1], CONTROL, drives=drives, record=[CONTROL])
        states.append(np.asarray(moved.states)[0])
    return np.array(states)


def _held(action: Floats) -> Floats:
    """Forces (2,) as a wrench for each step of a control step, shape (CONTROL, 6)."""
    return np.tile([*action, 0.0, 0.0, 0.0, 0.0], (CONTROL, 1))


def cases(settings: Any) -> list[str]:
    """An episode of each policy."""
    return [f"{policy} {k}" for policy in POLICIES for k in range(settings.episodes)]


def run(case: str, settings: Any, cancel: Cancel) -> dict[str, Any]:
    """An episode: whether the box stays captured from each frame on, and what foresees it."""
    policy, number = case.rsplit(" ", 1)
    seed = EPISODE_SEEDS + int(number)
    blur, network = POLICIES[policy], trained(settings.seed)
    random = np.random.default_rng([settings.seed, seed, EPISODE])
    eyes = np.random.default_rng([settings.seed, seed, SEEING])
    task, params, start = _begun(seed)

    def act(seen: Floats) -> Floats:
        return network(seen if blur is None else seen + blur * eyes.normal(size=seen.shape))

    world = World(task.scene(params))
    states = _episode(world, start, act, _forces(random, STEPS))
    inside = task.captured_throughout(params).contains(world.scene, states)
    asked = [f for f in range(FRAME, STEPS - FRAME * AHEAD + 1, 2 * FRAME) if inside[f]]
    found: dict[str, Any] = {"captured": bool(inside.all()), "states": [], "stays": [], "said": []}
    for f in asked:
        problem = task.future(states[f], f * HOLD, params, FRAME * AHEAD * HOLD, None)
        alone = task.problem(states[f], params)
        found["states"].append(states[f].tolist())
        found["stays"].append(bool(inside[f : f + FRAME * AHEAD + 1].all()))
        plans = {
            CLOSED: in_the_loop(network, blur),
            OPEN: replayed(world.scene, states[f], network),
        }
        draws = stream(settings.seed, STEPS * seed + f)
        said = {n: _probability(problem, p, draws, settings) for n, p in plans.items()}
        search = SearchSettings(NODES, draws)
        said[SCORE] = value_of("capture", metric_search(alone, "capture", search, 0))
        found["said"].append(said)
        if cancel.is_set:
            break
    return found


def _probability(problem: Problem, plan: Plan, seed: int, settings: Any) -> float:
    """That the box stays, under forces as they are in the episodes."""

    def forced(random: np.random.Generator, times: Floats) -> Floats:
        return held(times, lambda pieces: _forces(random, pieces))

    options: dict[str, Any] = {"rollouts": settings.rollouts, "seed": seed, "threads": 1}
    asked = problem.replace(plan=plan)
    return float(
        capture_probability(asked, disturbance=forced, undisturbed=False, **options).captured
    )


def in_the_loop(network: Network, blur: Floats | None = None) -> Policy:
    """The policy as a plan of a problem."""
    return Policy(
        lambda seen, memory, time: network(seen),
        period=HOLD,
        observe=observe,
        command=["effector.fx", "effector.fy"],
        noise=blur,
        name="network",
    )


def replayed(scene: Scene, state: Floats, network: Network) -> Plan:
    """What the policy does from a state on if nothing disturbs it, as a plan."""
    states = _episode(World(scene), state, network, None, FRAME * AHEAD)
    rows = np.zeros((FRAME * AHEAD, 6))
    rows[:, :2] = network(observe(states[:-1]))
    return Plan(HOLD, wrenches={"effector": rows})


def report(settings: Any, found: dict[str, Any]) -> str:
    """AUCs, what the policy in the loop is ahead, and calibration."""
    header = ["policy", "states", "stay", *METHODS, "loop - plan", "calibration of the loop"]
    rows = [_row(policy, *_gathered(policy, found, settings)) for policy in POLICIES]
    text = (
        f"A network of {LAYERS[1]} and {LAYERS[2]} neurons in numpy pushes the box at 24 Hz, as a "
        f"scripted expert taught it in {LESSONS} episodes; its twin sees with noise. Random forces "
        f"of {FORCE:g} N act on the box. Of the states that are captured: do they stay so for five "
        "frames, 1.25 s? AUC with 95 % intervals, episodes drawn. *Its plan*: what the policy does "
        "from that state on if nothing disturbs it, replayed. The classifier learns from the other "
        "episodes."
    )
    return f"{text}\n\n{markdown_table(header, rows)}"


def _row(policy: str, labels: Floats, episode: Floats, scores: dict[str, Floats]) -> list[str]:
    counts = [policy, str(len(labels)), f"{labels.mean():.0%}" if len(labels) else "-"]
    if not (labels.any() and not labels.all()):
        return [*counts, *["-"] * (len(METHODS) + 2)]
    stays = labels.astype(bool)
    places = np.unique(episode, return_inverse=True)[1]
    weights = bootstrap_weights(int(places.max()) + 1, DRAWS, 0)
    draws = {m: auc_ap_draws(ranked(s), stays, places, weights)[0] for m, s in scores.items()}
    cells = []
    for method in METHODS:
        low, high = central(draws[method]) or (np.nan, np.nan)
        cells.append(f"**{auc_ap(scores[method], stays)[0]:.3f}** {low:.3f} to {high:.3f}")
    ahead = auc_ap(scores[CLOSED], stays)[0] - auc_ap(scores[OPEN], stays)[0]
    low, high = central(draws[CLOSED] - draws[OPEN]) or (np.nan, np.nan)
    wrong = calibration_error(scores[CLOSED], labels)
    return [*counts, *cells, f"**{ahead:+.3f}** {low:+.3f} to {high:+.3f}", f"{wrong:.3f}"]


def _gathered(
    policy: str, found: dict[str, Any], settings: Any
) -> tuple[Floats, Floats, dict[str, Floats]]:
    """Labels (N,), numbers of episodes (N,), and scores (N,) by method."""
    episodes = [found[f"{policy} {k}"] for k in range(settings.episodes)]
    labels = np.array([stays for one in episodes for stays in one["stays"]], dtype=float)
    episode = np.array([k for k, one in enumerate(episodes) for _ in one["stays"]], dtype=int)
    said = [each for one in episodes for each in one["said"]]
    scores = {m: np.array([each[m] for each in said]) for m in (CLOSED, OPEN, SCORE)}
    states = np.array([state for one in episodes for state in one["states"]])
    every = np.ones(len(labels), dtype=bool)
    scores[CLASSIFIER] = learned(states, labels.astype(bool), episode, every, settings.seed)
    return labels, episode, scores


def draw(ax: Axes, found: dict[str, Any]) -> None:
    """AUCs of both policies, a bar for each score."""
    for shift, policy in enumerate(POLICIES):
        own = [one for case, one in found.items() if case.rsplit(" ", 1)[0] == policy]
        stays = np.array([stays for one in own for stays in one["stays"]], dtype=bool)
        if not stays.any() or stays.all():
            continue
        said = [each for one in own for each in one["said"]]
        aucs = [auc_ap(np.array([e[m] for e in said]), stays)[0] for m in METHODS[:3]]
        ax.bar(np.arange(3) + 0.4 * shift, aucs, 0.38, label=policy)
    ax.set_xticks(np.arange(3) + 0.2, [CLOSED, OPEN, SCORE], fontsize=7)
    ax.set(ylim=(0.5, 1.0), ylabel="AUC, five frames ahead")
    if ax.patches:
        ax.legend(fontsize=7, frameon=False)
