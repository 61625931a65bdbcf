"""Scores of beliefs."""

import numpy as np
import pytest
from boxes import problem
from scipy import stats
from scipy.stats import norm

import energymargin as em

DRIFT = 0.2  # m/s, deviation of a speed
RADIUS, HORIZON = 0.05, 0.5


def drifting(horizon=HORIZON):
    """A ball in space that leaves a ball of 5 cm if it drifts faster than 0.1 m/s along x."""
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("ball", em.Sphere(0.05), mass=1, role="object")
    own = em.Problem(
        scene,
        scene.pack(),
        force=(1e-9, 0, 0),  # which moves nothing
        torque=(0, 0, 0),
        duration=0.1,
        captured=em.regions.Ball("ball", (0, 0, 0), RADIUS),
        horizon=horizon,
    )
    return em.Belief(own, velocity=(DRIFT, 0, 0, 0, 0, 0), friction=0.1)


def test_a_probability_of_a_drift_that_is_not_known_is_the_one_on_paper():
    asked = {"rollouts": 256, "threads": 1}
    score = em.score_belief(drifting(), ["probability"], **asked)["probability"]
    known = norm.cdf(RADIUS / HORIZON / DRIFT) - norm.cdf(-RADIUS / HORIZON / DRIFT)
    assert score.mean == pytest.approx(known, abs=0.02)
    low, high = score.interval()
    assert low < known < high and high - low > 0.1
    assert set(score.values) == {0.0, 1.0}
    times, curve = score.curve
    assert curve[0] == 1 and curve[-1] == score.mean and (np.diff(curve) <= 0).all()
    at = np.searchsorted(times, HORIZON / 2)
    reach = RADIUS / times[at] / DRIFT
    assert curve[at] == pytest.approx(norm.cdf(reach) - norm.cdf(-reach), abs=0.03)


def test_the_drift_matters_and_the_friction_in_space_does_not():
    score = em.score_belief(drifting(), ["probability"], rollouts=128, threads=1)["probability"]
    drift, friction = score.shares["velocity of ball"], score.shares["friction of ball"]
    assert drift.value > 0.5 > 10 * abs(friction.value)
    assert 0 < drift.stderr < 0.2


def test_one_particle_of_a_known_model_has_the_score_of_the_problem():
    known = em.Belief(problem(), friction=0)
    metrics = ["capture", "effort/est", "force"]
    ours = em.score_belief(known, metrics, particles=1, nodes=30, seed=4, threads=1)
    table = em.score([problem()], metrics, nodes=30, seed=4, threads=1)
    for metric in metrics:
        assert ours[metric].mean == table[metric][0]
        assert ours[metric].stderr is None and len(ours[metric].values) == 1


def test_nodes_are_shared_out_among_the_particles():
    belief = em.Belief(problem(), friction=0.1)
    ours = em.score_belief(belief, ["capture"], particles=4, nodes=41, threads=1)["capture"]
    indices = [j * 2**32 for j in range(4)]
    table = em.score(ours.particles.problems, ["capture"], nodes=10, indices=indices, threads=1)
    assert ours.values.tolist() == table["capture"].tolist()
    assert ours.mean == table["capture"].mean() and ours.worst == table["capture"].min()
    assert ours.stderr == pytest.approx(table["capture"].std(ddof=1) / 2)
    assert ours.quantile(0) == ours.worst and ours.quantile(1) == table["capture"].max()
    assert ours.quantile(0.5) == np.sort(table["capture"])[1]
    half = stats.t.ppf(0.975, 3) * ours.stderr
    assert ours.interval() == pytest.approx((ours.mean - half, ours.mean + half))


@pytest.mark.parametrize("executor", [em.executors.Threads(2), em.executors.Processes(1)])
def test_scores_depend_on_no_executor(executor):
    belief = em.Belief(problem(horizon=0.2), friction=0.1, pose=(0.01, 0.01, 0, 0, 0, 0.1))
    asked = {"metrics": ["probability", "effort/est"], "particles": 3, "rollouts": 5, "nodes": 30}
    one = em.score_belief(belief, threads=1, **asked)
    other = em.score_belief(belief, executor=executor, **asked)
    assert list(one) == list(other) == asked["metrics"]
    for metric in one:
        assert one[metric].values.tobytes() == other[metric].values.tobytes()
    assert len(one["probability"].values) == 5 and len(one["effort/est"].values) == 3


def test_an_effort_that_some_particle_does_not_have_is_infinite_in_the_mean():
    belief = em.Belief(problem(), friction=stats.uniform(0.05, 0.5))
    asked = {"particles": 8, "nodes": 800, "threads": 1}
    effort = em.score_belief(belief, ["effort/est"], **asked)["effort/est"]
    assert np.isinf(effort.values).any() and np.isfinite(effort.worst)
    assert effort.mean == np.inf and effort.stderr is None
    assert np.isnan([share.value for share in effort.shares.values()]).all()
    infinite = int(np.isinf(effort.values).sum())
    with pytest.raises(
        ValueError, match=rf"inf in {infinite} of 8 .*: quantile\(0\.5\) is the med"
    ):
        effort.interval()
    assert effort.worst <= effort.quantile(0.1) <= effort.quantile(0.5)


def test_one_particle_has_no_interval():
    belief = em.Belief(problem(), friction=stats.uniform(0.05, 0.5))
    score = em.score_belief(belief, ["force"], particles=1)["force"]
    with pytest.raises(ValueError, match="inf in 0 of 1 particles, expected several finite"):
        score.interval()


def test_progress_counts_particles_and_a_cancel_keeps_those_that_are_done():
    belief, seen = em.Belief(problem(), friction=0.1), []
    cancel = em.Cancel()

    def tell(done, total):
        seen.append((done, total))
        if done >= 3:
            cancel.set()

    asked = {"metrics": ["capture"], "particles": 400, "nodes": 40000, "threads": 1}
    part = em.score_belief(belief, progress=tell, cancel=cancel, **asked)
    assert not part.complete and seen[-1][1] == 400
    count = len(part["capture"].values)
    assert 3 <= count < 400 and len(part["capture"].particles) == count
    few = belief.particles(count, seed=em.stream(0, 0)).problems
    indices = [j * 2**32 for j in range(count)]
    whole = em.score(few, ["capture"], nodes=100, indices=indices, threads=1)["capture"]
    assert part["capture"].values.tolist() == whole.tolist()
    with pytest.raises(em.Cancelled):
        em.score_belief(belief, cancel=cancel, **asked)


def test_what_cannot_be_asked_is_refused():
    belief = em.Belief(problem(), friction=0.1)
    for asked, words in (
        ({"belief": problem()}, "expected a Belief"),
        ({"particles": 0}, "particles is 0"),
        ({"particles": 20, "nodes": 10}, "nodes is 10, expected one at least for each of 20"),
        ({"metrics": ["luck"]}, "metrics is 'luck'"),
        ({"metrics": ["probability"]}, "horizon"),
        ({"threads": 1, "executor": em.executors.Threads(1)}, "threads is 1"),
    ):
        with pytest.raises(ValueError, match=words):
            em.score_belief(**{"belief": belief, **asked})
    timed = em.Belief(problem(horizon=0.1), friction=0.1)
    with pytest.raises(ValueError, match="common_random_numbers is True"):
        em.score_belief(timed, ["probability"], common_random_numbers=True)
    score = em.score_belief(timed, ["probability"], rollouts=2, threads=1)
    with pytest.raises(KeyError, match="'capture' was not computed; there are: probability"):
        score["capture"]
    for wrong, words in ((1.5, "confidence is 1.5"), (0, "confidence is 0")):
        with pytest.raises(ValueError, match=words):
            score["probability"].interval(wrong)
    with pytest.raises(ValueError, match="share is 2"):
        score["probability"].quantile(2)


def test_a_probability_has_no_quantiles_but_its_particles_have():
    belief = em.Belief(problem(horizon=1.0), friction=stats.uniform(0.0, 0.1))
    own = em.score_belief(belief, ["probability"], rollouts=20, threads=1)["probability"]
    assert set(own.values) <= {0.0, 1.0} and own.mean == own.values.mean()
    way_out = r"expected that of scores, such as \[em.capture_probability\(p\).captured for p in "
    for asked in (lambda: own.worst, lambda: own.quantile(0.1)):
        with pytest.raises(ValueError, match=way_out):
            asked()
    each = [em.capture_probability(p).captured for p in belief.particles(4).problems]
    assert any(0 < one < 1 for one in each)
    (legend,) = [ax.get_legend() for ax in em.plots.figure_belief(belief, own).axes[1:2]]
    assert [text.get_text().split(":")[0] for text in legend.get_texts()] == ["mean"]


def test_a_figure_shows_particles_scores_and_shares():
    belief = em.Belief(problem(), friction=0.1, pose=(0.01, 0.01, 0, 0, 0, 0))
    score = em.score_belief(belief, ["capture"], particles=20, nodes=100, threads=1)["capture"]
    figure = em.plots.figure_belief(belief, score, known=0.5)
    where, how_much, why = figure.axes[:3]
    assert where.get_title() == "20 particles"
    assert any("worst" in text.get_text() for text in how_much.get_legend().get_texts())
    assert [t.get_text() for t in why.get_yticklabels()] == [
        "friction\nof object",
        "pose\nof object",
    ]
    with pytest.raises(ValueError, match=r"score is 0\.5, expected a BeliefScore"):
        em.plots.figure_belief(belief, 0.5)


class Light(stats.rv_continuous):
    """A mass of 1 kg, of which this share of the draws has a tenth."""

    def _ppf(self, q, share):
        return np.where(q > 1 - share, 0.1, 1.0)


def damped(share):
    """A belief about a body whose controller damps 1 kg, and makes .1 kg diverge."""
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("object", em.Sphere(0.05), mass=0.1, position=(1, 1, 1), role="object")
    scene.add_body("hand", em.Sphere(0.05), mass=1.0, role="effector")
    gains, named = [[1.2 / scene.step]], {"observed": ["hand.vx"], "corrected": ["hand.fx"]}
    plan = em.Feedback(gains, period=scene.step, **named)
    inside = em.regions.Ball("object", (1, 1, 1), 1.5)
    own = em.Problem(
        scene,
        scene.pack(hand={"velocity": (0.1, 0, 0)}),
        **{"captured": inside, "force": (0.1,) * 3, "torque": (0, 0, 0), "duration": 0.1},
        **{"horizon": 8.0, "plan": plan},
    )
    return em.Belief(own, mass={"hand": Light(a=0, shapes="share")(share)})


def test_one_rollout_that_diverges_is_left_out_and_counted():
    with np.errstate(all="raise"):
        score = em.score_belief(damped(1 / 30), ["probability"], rollouts=30)["probability"]
        assert score.diverged == 1 and np.isnan(score.values).sum() == 1
        assert score.mean == np.nanmean(score.values) == score.kept.sum() / 29
        assert score.curve[1][-1] == score.mean
        known = stats.binomtest(round(score.kept.sum()), 29).proportion_ci()
        assert score.interval() == pytest.approx((known.low, known.high))
        assert np.isfinite([score.stderr, score.shares["mass of hand"].value]).all()


@pytest.mark.parametrize(("share", "words"), [(0.1, r"[2-5] of 30"), (0.5, r"1[0-9] of 30")])
def test_a_belief_of_which_more_than_one_in_a_hundred_diverges_has_no_probability(share, words):
    with pytest.raises(em.ScoreError, match=rf"{words} rollouts of the belief's probability div"):
        em.score_belief(damped(share), ["probability"], rollouts=30)


def test_draws_are_prepared_in_pieces_and_the_clock_is_looked_at(monkeypatch):
    """The limit comes while the first of a hundred thousand draws are made."""
    cancel, drawn = em.Cancel(), []
    made = em.Belief.particle

    def particle(self, point):
        drawn.append(point)
        if len(drawn) == 200:
            cancel.set()
        return made(self, point)

    monkeypatch.setattr(em.Belief, "particle", particle)
    keywords = {"rollouts": 100_000, "threads": 1, "cancel": cancel}
    try:
        found = em.score_belief(drifting(), ["probability"], **keywords)
        assert not found.complete and 0 < len(found["probability"].values) <= len(drawn)
    except em.Cancelled:
        pass  # before the first rollout was finished
    assert len(drawn) < 2000
    monkeypatch.undo()
    whole = drifting().particles(40, seed=em.stream(0, 0))
    assert np.array_equal(np.array(drawn[:40]), whole.points)
