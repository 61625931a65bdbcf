"""Scores of one problem, and two helpers: the compiled functions with typed keywords.

Python checks the names of the arguments, the core their values: an error names the argument, its
value and what was expected.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal

import energymargin._core as core
from energymargin.base.aliases import Floats
from energymargin.base.bars import Update
from energymargin.base.checks import core_count
from energymargin.base.doors import check_doors
from energymargin.disturbances import Disturbance, Uniform

__all__ = [
    "capture_probability",
    "capture_score",
    "effort_lower_bound",
    "escape_effort",
    "escape_energy",
    "force_score",
    "mass_properties",
    "stream",
]


UNIFORM = Uniform()

# What the core takes where a number is not given: the most with a tolerance or a threshold, else
# the number.
MOST_TREES = 1000
MOST_ROLLOUTS = 10000
MOST_OF_DECISION = 300
ROLLOUTS = 30
REPLICAS = 1000


def capture_score(
    problem: core.Problem,
    *,
    nodes: int = 1000,
    seed: int = 0,
    rate: float | None = None,
    trees: int | None = None,
    threads: int | None = None,
    nodes_per_edge: int = 1,
    nodes_per_round: int = 1,
    least_likelihood: float = 0.0,
    tolerance: float | None = None,
    timeout: float | None = None,
    cancel: core.Cancel | None = None,
    progress: Callable[[int, int], None] | None = None,
    warn: bool = True,
) -> core.CaptureScore:
    """Likelihood to stay in the capture set and to be in the success set, Algorithm 2.

    Args:
        problem: the question.
        nodes: of each search tree, besides its root.
        seed: the same seed gives the same bits.
        rate: lambda of eq. 4 [1/J]; by default the problem's.
        trees: independent trees, by default 1. Two or more give standard errors.
        threads: for several trees, and for the nodes of a round; None takes all cores. The score
            does not depend on them.
        nodes_per_edge: the most states of a rollout that are nodes, its end and evenly spaced ones.
            More of them take fewer rollouts. The tree grows from the ends alone.
        nodes_per_round: how many nodes are extended at once, all drawn from the tree before, and at
            most as many as it has. From 16 on a single tree keeps two threads busy. 1 is Algorithm
            2; another number gives another tree.
        least_likelihood: a rollout ends for good where its likelihood falls to this share of the
            root's.
        tolerance: trees are added until every standard error is at most this. It takes at least 8
            trees, and at most `trees`, by default 1000.
        timeout: the search ends after so many seconds.
        cancel: the search ends once it is set.
        progress: progress(done, total) is called now and then with the nodes of all trees so far.
            An exception of it ends the search.
        warn: whether the score's warnings are issued.

    After a timeout or a cancel the complete trees count, up to the first that is not; if there is
    none, the first tree as far as it is. `complete` is False then.

    Warns, as PlausibilityWarning and once for each scene, if the resolution is above 0.2, or if the
    score is above 0.5 although the state leaves the capture set within 1 s without a disturbance;
    and if more than 1 % of the steps did not converge, or of the time is lost. `warnings` of the
    score has the same texts. Raises ValueError on a bad problem or argument.
    """
    given = locals() | {"threads": core_count("threads", threads)}
    count = trees or (1 if tolerance is None else MOST_TREES)
    return core.capture_score(**given | {"progress": _counted(progress, nodes, count)})


def escape_effort(
    problem: core.Problem,
    *,
    planner: str = "est",
    nodes: int = 1000,
    searches: int = 1,
    threads: int | None = None,
    nodes_per_round: int = 1,
    seed: int = 0,
    captured: str = "all",
    search: str = "improved",
    sampling: str | None = None,
    shorten: bool | None = None,
    stop_at_escape: bool = False,
    lower_bound: bool = False,
    bound_cells: int = 100000,
    bound_tolerance: float = 0.05,
    timeout: float | None = None,
    cancel: core.Cancel | None = None,
    progress: Callable[[int, int], None] | None = None,
    warn: bool = True,
) -> core.EscapeEffort:
    """The least work that was found of an escape from the capture set (eq. 2).

    It is an upper bound of the effort of escape, and falls with the nodes. The metric 'effort' of
    `em.score` is this; its 'effort/est' and 'effort/rrt' are search='published', always.

    Args:
        problem: the question.
        planner: 'est' or 'rrt', the x of AO-x.
        nodes: of the search tree, besides its root.
        searches: independent ones, which share the nodes; the first have one more where they do not
            divide. The tree is that of the one with the least effort; steps, `discarded` and
            `diverged` are those of all.
        threads: for several searches, and for the nodes of a round; None takes all cores. The
            effort does not depend on them.
        nodes_per_round: how many nodes are extended at once, all drawn from the tree before, and
            how many changes of the best escape are tried at once. From 16 on a single search keeps
            two threads busy. 1 is Algorithm 1; another number is another search.
        seed: the same seed gives the same bits.
        captured: of several objects, 'all' asks for the effort until one has left, 'any' until the
            last one has.
        search: 'improved', with a horizon and without, or 'published', the paper's Algorithm 1 as
            it is: without a horizon its efforts were 2 to 16 times the least with 1000 nodes, or
            inf. It chooses `sampling` and `shorten` unless they are given.
        sampling: of wrenches. 'uniform' (published; paper, Section V), or 'mixed' (improved):
            about half of them uniform, the others at their bounds, along one axis, zero, or with a
            horizon that of the edge before.
        shorten: spend nine of ten nodes, once there is an escape, on making it cheaper: edges are
            dropped, shortened, weakened, cut in two and merged, and each change is simulated
            (improved).
        stop_at_escape: end a rollout where a look every 4 steps sees it outside of the capture set,
            and not only at its end.
        lower_bound: after the search, bound the effort from below too, as `effort_lower_bound`
            does. It has the time that the search leaves.
        bound_cells: of poses of each object that the lower bound looks at.
        bound_tolerance: the lower bound is done once its barrier is known to this share.
        timeout: the search ends after so many seconds.
        cancel: the search ends once it is set.
        progress: progress(done, total) is called now and then with the nodes so far. An exception
            of it ends the search.
        warn: whether the effort's warnings are issued.

    With a horizon or a plan an escape has to be outside in time, at one of the looks (every
    `check`), and to stay outside for `dwell`, or up to the horizon, without a wrench. Its effort is
    that up to its first look outside. The first rollout is the undisturbed future: an object that
    leaves without a disturbance has effort 0, for any number of nodes and through `within` or not.
    So has a state that is outside at the start. A wrench lasts up to `duration`, a wait as long as
    it takes.

    After a timeout or a cancel the tree has the bits of one search of as many nodes, and `complete`
    is False.

    Warns, as PlausibilityWarning and once for each scene, if a cheaper escape was discarded; if the
    effort is above 0 although the state leaves the capture set without a disturbance, which is
    looked for within 1 s if there is no horizon; and if more than 1 % of the steps did not
    converge, or of the time is lost. `warnings` of the result has the same texts. Raises ValueError
    on a bad problem or argument.
    """
    given = locals() | {"threads": core_count("threads", threads)}
    return core.escape_effort(**given | {"progress": _counted(progress, nodes)})


def effort_lower_bound(
    problem: core.Problem,
    *,
    cells: int = 100000,
    tolerance: float = 0.05,
    captured: str = "all",
    timeout: float | None = None,
    cancel: core.Cancel | None = None,
) -> core.LowerBound:
    """A lower bound of the effort of escape: no disturbance gets the object out with less work.

    Args:
        problem: the question.
        cells: of poses of each object to look at.
        tolerance: the search ends once the barrier is known to this share.
        captured: of several objects, 'all' asks for the effort until one has left, 'any' until the
            last one has.
        timeout: the search ends after so many seconds.
        cancel: the search ends once it is set.

    The bound is the least potential energy over which the object can leave, minus all energy that
    may help it at the start. Bodies that can move are in nobody's way here. The bound is 0 where
    nothing is certain, and `reason` says why. After a timeout or a cancel the bound is what is
    certain so far, and `complete` is False. Raises ValueError on a bad problem or argument.
    """
    return core.effort_lower_bound(**locals())


def capture_probability(
    problem: core.Problem,
    *,
    plan: core.Plan | None = None,
    disturbance: Disturbance | Callable[[Any, Any], Any] | None = None,
    rollouts: int | None = None,
    seed: int = 0,
    first: int = 0,
    threads: int | None = None,
    tolerance: float | None = None,
    above: float | None = None,
    design: Literal["independent", "sobol"] = "independent",
    success: bool = False,
    by_object: bool = False,
    undisturbed: bool = True,
    most_diverged: float = 0.01,
    step: float | Literal["auto"] | None = None,
    drawn_step: float | None = None,
    rare: bool = False,
    level: Callable[[Floats], Any] | None = None,
    ahead: float | None = None,
    timeout: float | None = None,
    cancel: core.Cancel | None = None,
    progress: Callable[[int, int], None] | None = None,
    warn: bool = True,
) -> core.CaptureProbability:
    """Probability that the objects stay captured over the problem's horizon while the robot follows
    its plan.

    Args:
        problem: the question, with a horizon or a plan.
        plan: a Plan, Feedback or Policy in place of the problem's; its duration is the horizon.
        disturbance: a model of em.disturbances; None: Uniform(). Or a function (random, times)
            of a numpy Generator and the times of the steps, shape (steps,) [s], that returns
            wrenches, shape (steps, 6 k) for k objects [N, N m].
        rollouts: by default 30.
        seed: the same seed draws the same disturbances, in units of the bounds, for every problem.
        first: the number of the first rollout. A part of the rollouts has the bits that it has in
            the whole.
        threads: for several rollouts; None takes all cores. The probability does not depend on
            them.
        tolerance: rollouts are added, 32, 64, 128, ..., until half of the 95 % interval is at most
            this. It takes at most `rollouts`, by default 10000.
        above: rollouts are added, 8, 12, 16, 20, 25, ..., until `above` of the result tells whether
            the probability is above this. Either wrong answer has a probability of at most .05,
            by a sequential test (Ville's inequality). It takes at most `rollouts`, by default 300;
            near the threshold it is not told by then: None.
        design: "sobol" spreads the rollouts evenly over the first 256 random numbers of each, which
            is 36 pushes of an object (randomized quasi-Monte Carlo, a Sobol sequence with Owen's
            scramble): unbiased, with a smaller variance unless many short pushes follow each other,
            and an interval that blocks of neighbouring rollouts tell. Best with a power of two,
            from 64 on. Not with `above`, Boltzmann, functions.
        success: also the probability of being in the success set at the horizon. Rollouts go on
            after an exit.
        undisturbed: also one rollout without a disturbance, before the others.
        most_diverged: share of the rollouts that may diverge; one always may, if others are left
            and it is not 0. Those that do, do not count: `diverged` is their number. 1: any number,
            and where none is left the probability is NaN.
        by_object: of several objects also the probability of any, and of each.
        step: rollouts take this longer step [s], and a share of them (`repeated`) the scene's too,
            under the same disturbances: a multilevel estimate (Giles 2015), the mean with the long
            step plus the mean difference. It is unbiased for the scene's step, and its interval is
            one of that. 32 rollouts with each step, which do not count, choose the share; with
            "auto" also the step, of 2, 4 and 8 of the scene, or none if none saves simulation.
            For narrow intervals, as with a tolerance of .03. For the loss of all objects alone,
            without success, by_object, above, design and Boltzmann.
        drawn_step: disturbances are drawn in steps of this length [s], by default those of the
            scene; problems that differ in their step alone then meet the same ones.
        rare: for losses that are rare, down to 1e-6 and below, by adaptive multilevel splitting
            (Brehier et al. 2016). `rollouts` are replicas, by default 1000. `lost` is what it is
            for. For the loss of all objects alone, without success, by_object, tolerance, above and
            design, for Uniform, Gaussian and noise of the plan.
        level: with rare, a function of a state, shape (n,), that rises towards a loss; by default
            how far the edge of the capture set is where it is forecast to be nearest. `lost` is
            unbiased with any, and precise with a good one.
        ahead: with rare, the level is that function, by default the signed distance to the edge as
            a share of the start's, and what it gains in so long at its rate of now [s]. By default
            there is a forecast instead; with a level of your own, as long as a rate is remembered,
            which 20 rollouts of their own tell.
        timeout: the call ends after so many seconds.
        cancel: the call ends once it is set.
        progress: progress(done, total) is called now and then with the rollouts so far. With
            `rare` it is not known how many there will be: the total is `done` from `rollouts` on.
            An exception of it ends the call.
        warn: whether the probability's warnings are issued.

    After a timeout or a cancel the complete rollouts count, up to the first that is not, and
    `complete` is False; if there is none, TimeoutError or Cancelled is raised. Raises ValueError on
    a problem without horizon and plan, or a bad argument, and RuntimeError if more than
    `most_diverged` of the rollouts diverge. Warns, as PlausibilityWarning and once for each scene,
    if more than 1 % of the steps did not converge, or of the time is lost; `warnings` of the result
    has the same texts.
    """
    given = locals() | {"threads": core_count("threads", threads)}
    del given["plan"]
    if plan is not None:
        from energymargin.model.plans import with_plan

        given["problem"] = with_plan(problem, plan)
    given["disturbance"] = UNIFORM if disturbance is None else disturbance
    given["finds_step"] = step == "auto"
    given["step"] = None if step == "auto" else step
    most = ROLLOUTS if tolerance is None else MOST_ROLLOUTS
    most = most if above is None else MOST_OF_DECISION
    count = rollouts or (REPLICAS if rare else most)
    return core.capture_probability(**given | {"progress": _counted(progress, count)})


def escape_energy(
    problem: core.Problem,
    *,
    planner: str = "bit*",
    samples: int = 2000,
    seed: int = 0,
    reach: float | None = None,
    object: str | None = None,
    timeout: float | None = None,
    cancel: core.Cancel | None = None,
) -> core.EscapeEnergy:
    """The least potential energy above the start's over which the object leaves the capture set.

    The object moves slowly and without friction, and everything else stays where it is.

    Args:
        problem: the question.
        planner: 'bit*' or 'rrt*'.
        samples: poses of the object to draw.
        seed: the same seed gives the same bits.
        reach: half the edge of the box around the start to search in [m]; by default it adapts.
        object: name of the object that leaves; needed if there are several.
        timeout: the search ends after so many seconds.
        cancel: the search ends once it is set.

    After a timeout or a cancel the result is the lowest barrier so far, and `complete` is False.
    Raises ValueError on a bad problem or argument.
    """
    return core.escape_energy(**locals())


def force_score(
    problem: core.Problem, *, weights: core.ForceWeights | None = None
) -> core.ForceScore:
    """The wrench-based baseline: engaging score plus sticking score minus distance, each with its
    weight.

    weights: by default the problem's. Raises ValueError on a bad problem, or one whose scene has no
    effector.
    """
    return core.force_score(**locals())


def mass_properties(
    shape: core.Plane
    | core.Box
    | core.Sphere
    | core.Cylinder
    | core.Capsule
    | core.ConvexHull
    | core.Compound,
    mass: float = 1.0,
) -> core.MassProperties:
    """Mass properties of a solid shape of a mass [kg], of even density."""
    return core.mass_properties(**locals())


def stream(seed: int, number: int) -> int:
    """The seed of one of a seed's own streams."""
    return core.stream(**locals())


def _counted(progress: Update | None, *factors: int) -> Callable[[int], None] | None:
    """The function of the number done that tells `progress` the total too. What is no function is
    the core's to refuse."""
    if not callable(progress):
        return progress
    return lambda done: progress(done, max(done, math.prod(factors)))


check_doors(globals(), __all__)
