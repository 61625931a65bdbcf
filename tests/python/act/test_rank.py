"""Ranking: the order is right, the race loses nothing, and what is said can be relied on."""

import json

import numpy as np
import pytest
from clusters import Cluster
from command_line import run_here
from scipy import stats
from sliding import diverging, problem, still

import energymargin as em
from energymargin.act.draws import Draw, Draws, Question, draw_chunk
from energymargin.act.racing import Duel, beaten, beats, duel, looks
from energymargin.act.ranking import Race

PUSHES = em.disturbances.Gaussian(force=3.0, correlation_time=0.5)
PLACES = (0.0, 0.3, -0.5, 0.7, -0.9, 0.8)


@pytest.fixture(scope="module")
def field():
    """Boxes at rest: the nearer one is to an edge, the sooner it is lost."""
    return {f"at {x:g}": problem(x) for x in PLACES}


@pytest.fixture(scope="module")
def raced(field):
    return em.rank(field, disturbance=PUSHES)


def test_the_order_is_that_of_the_distances_to_the_edge(field):
    ranking = em.rank(field, disturbance=PUSHES, race=False)
    assert ranking.names == ("at 0", "at 0.3", "at -0.5", "at 0.7", "at 0.8", "at -0.9")


def test_draws_are_the_rollouts_of_capture_probability(field):
    ranking = em.rank(field, disturbance=PUSHES, race=False, rollouts=50, seed=3)
    for name, one in field.items():
        alone = em.capture_probability(one, disturbance=PUSHES, rollouts=50, seed=3)
        assert ranking[name].score == pytest.approx(alone.captured, abs=1e-15)
        inside = np.isinf(alone.exit_times)
        assert np.array_equal(ranking[name].values, inside)
        assert (ranking[name].low, ranking[name].high) == pytest.approx(alone.interval())


def test_a_race_chooses_the_same_one_with_fewer_steps(field, raced):
    whole = em.rank(field, disturbance=PUSHES, race=False)
    assert raced.best == whole.best == "at 0"
    assert raced.steps < 0.7 * whole.steps
    assert raced["at -0.9"].draws < 50 and not raced["at -0.9"].racing


def test_draws_of_a_race_are_the_first_ones_of_the_whole(field, raced):
    whole = em.rank(field, disturbance=PUSHES, race=False)
    for one in raced:
        assert np.array_equal(one.values, whole[one.name].values[: one.draws])


@pytest.mark.parametrize("workers", [{"threads": 1}, {"executor": em.executors.Processes(2)}])
def test_bits_depend_on_no_executor(field, raced, workers):
    again = em.rank(field, disturbance=PUSHES, **workers)
    assert again.to_csv() == raced.to_csv()
    assert again.decision == raced.decision


def test_the_workers_of_a_cluster_rank_and_improve_to_the_same_bits(field, raced):
    box = {"x": (-0.95, 0.8, 0.95)}
    few = {"budget": 100_000, "rollouts": 8, "disturbance": PUSHES}
    here = em.improve(problem(), box, still, **few)
    with Cluster(workers=1) as cluster:
        there = em.executors.Dask(cluster.address)
        assert em.rank(field, disturbance=PUSHES, executor=there).to_csv() == raced.to_csv()
        assert em.improve(problem(), box, still, executor=there, **few).to_csv() == here.to_csv()


@pytest.mark.parametrize("places", [(0.0, 0.6), (0.0, 0.5, -0.7), PLACES])
def test_who_is_out_is_beaten_and_no_race_that_is_over_is_undecided(places):
    for seed in range(4):
        boxes = {f"{x:g}": problem(x) for x in places}
        ranking = em.rank(boxes, disturbance=PUSHES, rollouts=400, seed=seed)
        out = [one.name for one in ranking if ranking.left(one.name) == "out"]
        assert out and not set(out) & set(ranking.confidence_set)
        if sum(one.racing for one in ranking) == 1:
            assert not ranking.decision.startswith("undecided")


def test_plans_of_one_problem_are_candidates_of_it(field):
    one = problem()
    plans = {
        f"{f} N": em.Plan(1 / 240, wrenches={"object": [[f, 0, 0, 0, 0, 0]] * 240}) for f in (1, 9)
    }
    given = {"rollouts": 16, "race": False}
    named = em.rank(one, plans, **given)
    whole = em.rank({name: one.replace(plan=plan) for name, plan in plans.items()}, **given)
    assert [s.values.tolist() for s in named] == [s.values.tolist() for s in whole]
    assert [s.name for s in named] == [s.name for s in whole]
    with pytest.raises(ValueError, match=r"plans is Plan\(.*expected several, as a list or a dict"):
        em.rank(one, plans["1 N"])
    with pytest.raises(ValueError, match=r"^problems is .* beside plans, expected one Problem"):
        em.rank(field, plans)


def test_success_is_a_metric_of_its_own():
    boxes = {"left": problem(0.0, -0.5), "right": problem(0.0, 0.5)}
    ranking = em.rank(boxes, metric="probability/success", rollouts=30)
    assert ranking.best == "right"
    assert "the best is right" in ranking.decision and ranking.confidence > 0.95


def test_efforts_are_ranked_by_the_work_that_leads_to_the_nearer_edge(field):
    ranking = em.rank(field, metric="effort/est", rollouts=6, nodes=200, race=False)
    assert ranking.names[0] == "at 0" and ranking.names[-1] == "at -0.9"
    efforts = [ranking[name].score for name in ranking.names]
    assert efforts == sorted(efforts, reverse=True)


def _efforts(name, *efforts):
    """Each in a third of 120 searches."""
    values = np.tile(np.array(efforts, dtype=float), 40)
    return em.actions.Standing(name, values, 0.0, float(np.median(values)), 0, 0, 0, racing=True)


def test_efforts_that_beat_each_other_in_a_circle_are_undecided():
    # b beats c in two thirds of the searches, c beats a, and a beats b.
    circle = [_efforts("c", 1, 6, 7), _efforts("b", 3, 9, 5), _efforts("a", 8, 1, 6)]
    circle.sort(key=lambda one: -one.score)
    ranking = em.actions.Ranking("effort/est", tuple(circle), 0.05, 0.95)
    others = {one.name: duel(circle[0].values, one.values) for one in circle[1:]}
    beaten_by = [name for name, one in others.items() if one.losses > one.wins]
    assert len(beaten_by) == 1 and (ranking.best, *beaten_by) == ranking.confidence_set
    assert ranking.decision.startswith(f"undecided: {ranking.best} leads, but {beaten_by[0]} may")


def test_the_best_effort_beats_each_other_one():
    line = (_efforts("far", 5, 6, 9), _efforts("near", 4, 5, 6), _efforts("nearer", 1, 2, 3))
    assert em.actions.Ranking("effort/est", line, 0.05, 0.95).decision.startswith(
        "the best is far, with 99.9 %"
    )


def test_no_effort_is_called_the_best_by_mistake_in_more_than_one_of_twenty():
    """Of three that are alike, or beat each other in a circle."""
    random, wrong = np.random.default_rng(3), np.zeros(2)
    circle = np.array([[3.0, 1, 2], [2, 3, 1], [1, 2, 3]])
    for _ in range(400):
        alike = random.random((3, 200))
        turning = circle[random.integers(3, size=200)].T
        for kind, efforts in enumerate((alike, turning)):
            wrong[kind] += any(
                min(beats(duel(efforts[i][:n], efforts[j][:n]), 3) for j in range(3) if j != i)
                >= 0.95
                for n in looks(200)
                for i in range(3)
            )
    assert (wrong <= 28).all()  # of 400: 0.05, and two standard errors


def test_equal_ones_are_not_told_apart_and_the_decision_says_so():
    ranking = em.rank([problem(0.0), problem(0.0)], disturbance=PUSHES)
    assert ranking.best == "0" and ranking.confidence_set == ("0", "1")
    assert ranking.decision.startswith("choose 0: 1 may be better, by at most 0.05")
    few = em.rank([problem(0.0), problem(0.0)], disturbance=PUSHES, rollouts=10)
    assert few.decision == (
        "undecided: 0 leads, but 1 may be better, by at most 0.33, with 95 % confidence"
    )
    assert few.regret_bound == 0.33


def test_an_uncertainty_gives_every_candidate_the_same_particles():
    unknown = em.beliefs.Uncertainty(velocity=(1.0, 0, 0, 0, 0, 0))
    ranking = em.rank(
        [problem(0.0), problem(0.0), problem(0.6)],
        uncertainty=unknown,
        disturbance=em.disturbances.Uniform(0.0),
        rollouts=1000,
        race=False,
    )
    assert np.array_equal(ranking["0"].values, ranking["1"].values)
    # Without a push a box at 0 is lost beyond 1 m/s, which is a standard deviation.
    assert ranking["0"].score == pytest.approx(0.683, abs=0.03)  # two standard errors
    assert ranking.names[-1] == "2"


def drawn(trial):
    return [trial.draw(number) for number in trial.numbers]


def _friction(trial):
    return np.array([draw.problem.scene.bodies[0].friction for draw in drawn(trial)])


def _rough(friction):
    own = problem()
    return own.replace(scene=own.scene.with_body("object", friction=friction))


def test_a_draw_that_one_candidate_cannot_have_is_made_again_for_all():
    nearly, unknown = (0.4, 0.05), em.beliefs.Uncertainty(friction=0.1)  # often below 0
    boxes = {str(own): _rough(own) for own in nearly}
    candidates = Race(boxes, unknown, Question())
    whole = [candidates.trial(k, 0, 24) for k in (0, 1)]
    errors = [_friction(trial) - own for trial, own in zip(whole, nearly, strict=True)]
    assert errors[0] == pytest.approx(errors[1], abs=1e-12) and errors[0].min() > -0.05
    again = Race(boxes, unknown, Question())
    looks_ = [again.trial(1, first, count) for first, count in ((0, 5), (5, 19))]
    assert np.array_equal(np.concatenate([_friction(one) for one in looks_]), _friction(whole[1]))
    looked = [*drawn(looks_[0]), *drawn(looks_[1])]
    numbers = [[one.particle for one in own] for own in (*map(drawn, whole), looked)]
    assert numbers[0] == numbers[1] == numbers[2] != list(range(24))


def test_draws_that_hardly_can_be_and_other_bodies_are_refused():
    below = em.beliefs.Uncertainty(friction={"object": stats.uniform(-0.2, 0.1)})
    with pytest.raises(ValueError, match=r"1000 of 1000 draws .* in problem number 0, expected sm"):
        em.rank([problem()], uncertainty=below)
    other = em.Scene(gravity=(0, 0, 0))
    other.add_body("wall", em.Box((0.1,) * 3), mass=0, position=(9, 0, 0))
    other.add_body("object", em.Box((0.1,) * 3), mass=2, friction=0, role="object")
    one = em.Scene(gravity=(0, 0, 0))
    one.add_body("object", em.Box((0.1,) * 3), mass=2, friction=0, role="object")
    one.add_body("wall", em.Box((0.1,) * 3), mass=0, position=(9, 0, 0))
    both = em.beliefs.Uncertainty(friction={"object": 0.1, "wall": 0.1})
    boxes = [problem().replace(scene=own) for own in (one, other)]
    with pytest.raises(ValueError, match="in problem number 0, of friction of wall"):
        em.rank(boxes, uncertainty=both)


def test_bets_on_the_draws_of_an_uncertainty_are_lost_as_seldom_as_they_say():
    """Where every second of 32 ranges of the friction wins, quasi-random draws come in runs."""
    wrong, unknown = 0, em.beliefs.Uncertainty(friction=stats.uniform(0, 1))
    for seed in range(300):
        trial = Race({"0": problem()}, unknown, Question(seed=seed)).trial(0, 0, 24)
        wins = np.floor(32 * _friction(trial)) % 2
        seen = [duel(a[:n], 1 - a[:n]).better for n in (16, 24) for a in (wins, 1 - wins)]
        wrong += max(seen) >= 0.99
    assert wrong <= 7  # of 300: 0.01, and two standard errors


def test_a_function_of_ones_own_is_a_disturbance_on_threads_and_refused_elsewhere():
    def kick(random, times):
        wrenches = np.zeros((len(times), 6))
        wrenches[0, 0] = random.normal(scale=500.0)
        return wrenches

    boxes = [problem(0.0), problem(0.9)]
    assert em.rank(boxes, disturbance=kick, rollouts=40).best == "0"
    with pytest.raises(ValueError, match=r"cannot be sent to another process.*use threads"):
        em.rank(boxes, disturbance=kick, rollouts=40, executor=em.executors.Processes(1))


def test_after_a_timeout_the_draws_count_that_all_have(field):
    ranking = em.rank(field, disturbance=PUSHES, race=False, rollouts=100_000, timeout=1.0)
    assert not ranking.complete
    counts = {one.draws for one in ranking}
    assert len(counts) == 1 and 16 <= counts.pop() < 100_000


def test_a_search_that_is_cancelled_is_no_draw():
    cancel, question = em.Cancel(), Question("effort/est", nodes=50)
    assert len(draw_chunk(question, [Draw(0, 3, problem())], cancel)) == 1
    cancel.set()
    with pytest.raises(em.Cancelled):
        draw_chunk(question, [Draw(0, 3, problem())], cancel)


def test_a_cancel_leaves_what_is_decided_or_raises():
    cancel = em.Cancel()
    cancel.set()
    with pytest.raises(em.Cancelled, match="before the candidates were compared"):
        em.rank([problem(0.0), problem(0.5)], cancel=cancel)


@pytest.mark.parametrize(
    ("problems", "arguments", "message"),
    [
        ([], {}, "problems is empty"),
        (problem(), {}, r"problems is .*expected several.* em.rank\(problem, {'left': plan"),
        ([problem(), 3], {}, r"problems\['1'\] is 3, expected a Problem"),
        ([problem().replace(horizon=None)], {}, r"problems\['0'\] is without a horizon"),
        ([problem()], {"metric": "capture"}, "metric is 'capture', expected 'probability'"),
        ([problem()], {"rollouts": 0}, "rollouts is 0"),
        ([problem()], {"disturbance": em.disturbances.Boltzmann(1.0)}, "whose draws have weights"),
        ([problem()], {"confidence": 1.0}, "confidence is 1.0"),
        ([problem()], {"confidence": "a"}, "confidence is 'a'"),
        ([problem()], {"tolerance": None}, "tolerance is None"),
        ([problem()], {"cancel": 5}, "cancel is 5"),
        ([problem()], {"progress": 3}, "progress is 3"),
        ([problem()], {"disturbance": "x"}, "disturbance is 'x'"),
        ([problem()], {"metric": "effort/est", "disturbance": PUSHES}, "expected None: an effort"),
        ({1: problem(), "1": problem()}, {}, "the name '1' twice"),
        ({problem()}, {}, "expected several, as a list or a dict"),
        ([problem()], {"uncertainty": {"mass": 1}}, "uncertainty is .*expected an em.beliefs"),
        ([problem()], {"threads": 1, "executor": em.executors.Threads(1)}, "threads is 1"),
    ],
)
def test_wrong_arguments_are_named(problems, arguments, message):
    with pytest.raises(ValueError, match=message):
        em.rank(problems, **arguments)


def test_a_duel_counts_the_draws_in_which_two_differ():
    first, second = np.array([1.0, 1, 0, 1, 1]), np.array([0.0, 1, 1, 0])
    assert duel(first, second) == Duel(wins=2, losses=1, draws=4)
    # The mean likelihood of all shares of wins is 1 / 21, that of one half 2^-20.
    assert Duel(20, 0, 20).better == pytest.approx(1 - 21 / 2**20)
    assert Duel(3, 0, 80).better == pytest.approx(1 - 4 / 8 / (1 - 2**-4))
    assert Duel(0, 0, 20).better == 0
    assert Duel(0, 3, 80).better == Duel(1, 1, 80).better == 0
    assert Duel(0, 0, 120).as_good(0.05) > 0.99 > Duel(0, 5, 120).as_good(0.05)
    assert Duel(0, 0, 120).as_good(0.0) == Duel(3, 100, 120).as_good(0.05) == 0


@pytest.mark.parametrize(("first", "second"), [(0.5, 0.5), (0.9, 0.9), (0.85, 0.9)])
def test_what_is_no_better_is_called_better_in_one_of_twenty_at_most(first, second):
    """Although a race looks eight times, and either of the two may lead."""
    random, wrong = np.random.default_rng(0), 0
    for _ in range(1000):
        ours = (random.random(200) < first).astype(float)
        theirs = (random.random(200) < second).astype(float)
        pairs = [(ours, theirs), (theirs, ours)] if first == second else [(ours, theirs)]
        seen = [duel(a[:n], b[:n]).better for n in looks(200) for a, b in pairs]
        wrong += max(seen) >= 0.95
    assert wrong <= 65  # of 1000: 0.05, and two standard errors


def test_what_is_worse_by_the_tolerance_is_called_as_good_in_one_of_twenty_at_most():
    random, wrong = np.random.default_rng(1), 0
    for _ in range(1000):
        theirs = (random.random(400) < 0.9).astype(float)
        ours = theirs * (random.random(400) > 0.05 / 0.9)  # worse in one of twenty draws
        wrong += max(duel(ours[:n], theirs[:n]).as_good(0.05) for n in looks(400)) >= 0.95
    assert wrong <= 65


def test_the_best_of_twelve_is_among_those_that_may_be():
    """In 95 of 100 rankings at least, whichever leads."""
    random, missed = np.random.default_rng(2), 0
    shares = np.array([0.9, 0.87, *np.full(5, 0.8), *np.full(5, 0.5)])
    for _ in range(200):
        for n in looks(200)[::3]:
            draws = random.random(n)  # common: the better one holds wherever the other does
            own = (draws[:, None] + 0.2 * random.random((n, 12)) - 0.1 < shares).astype(float).T
            missed += beaten([duel(one, own[0]) for one in own[1:]]) >= 0.95
    assert missed <= 0.05 * 200 * 3


def test_a_tie_is_hardly_ever_decided():
    pair = {"left": problem(-0.5), "right": problem(0.5)}  # mirror images
    decided = [
        em.rank(pair, disturbance=PUSHES, seed=seed).decision.startswith("the best is")
        for seed in range(40)
    ]
    assert sum(decided) <= 5  # 2 are to be expected at most


def test_efforts_without_an_escape_come_first():
    open_ = {"near": problem(0.9), "far": problem(0.0)}
    shut = problem().replace(captured=em.regions.HalfSpace("object", (1, 0, 0), 1e3))
    ranking = em.rank(
        {**open_, "shut": shut}, metric="effort/est", rollouts=3, nodes=60, race=False
    )
    assert ranking.names[0] == "shut" and ranking["shut"].mean_survival == 1.0
    assert ranking["near"].mean_survival < 1.0


def test_rollouts_that_diverge_do_not_count_and_are_told():
    ranking = em.rank([problem()], disturbance=diverging(2), rollouts=200, threads=1)
    (one,) = ranking
    assert one.diverged == 2 and one.draws == 200
    assert "2 of 200 rollouts of 0 diverged" in ranking.to_markdown()
    alone = em.capture_probability(problem(), disturbance=diverging(2), rollouts=200)
    assert one.score == pytest.approx(alone.captured) == np.nanmean(one.values)
    assert (one.low, one.high) == pytest.approx(alone.interval())
    assert one.mean_survival == pytest.approx(alone.mean_time)


@pytest.mark.parametrize(("diverge", "rollouts"), [(3, 200), (2, 16), (16, 16), (1, 1)])
def test_too_many_rollouts_that_diverge_are_an_error_with_the_candidate(diverge, rollouts):
    with pytest.raises(em.DivergedError, match=f"{diverge} of .* rollouts of fast diverged"):
        em.rank({"fast": problem()}, disturbance=diverging(diverge), rollouts=rollouts, threads=1)


def test_a_rollout_that_diverges_decides_no_duel():
    nan = np.nan
    assert duel(np.array([1.0, nan, 1, 0]), np.array([0.0, 0, nan, 0])) == Duel(1, 0, 2)


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (problem(horizon=3.0), r"problems\['1'\] has the horizon 3.0, problems\['0'\] 1.0"),
        (problem(force=(5, 0, 0)), "has the force bounds"),
        (problem(duration=0.1), r"problems\['1'\] has the duration 0.1, problems\['0'\] 0.5"),
    ],
)
def test_candidates_that_would_not_meet_the_same_are_refused(other, message):
    with pytest.raises(ValueError, match=message):
        em.rank([problem(), other])


@pytest.mark.parametrize("metric", ["probability", "effort/est"])
def test_draws_that_a_lost_worker_left_behind_later_ones_keep_their_bits(metric):
    question, one = Question(metric, None if "effort" in metric else PUSHES, nodes=20), problem(0.7)
    draws = [Draw(0, number, one) for number in range(12)] + [Draw(1, 12, one)]

    def values(chunk):
        found = draw_chunk(question, chunk, em.Cancel())
        return [value for part in found if part is not None for value in part.values]

    right = [values([draw]) for draw in draws]
    assert len({tuple(value) for value in right}) > 1
    for order in ([*range(13)], [*range(8, 13), *range(8)], [3, 1, 0, 12, 2]):
        assert values([draws[k] for k in order]) == [right[k][0] for k in order]


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 6, 7, 16])
def test_nineteen_of_twenty_intervals_of_an_effort_hold_its_median(count):
    """Of draws of a uniform law, by the binomial number of those that are below its median."""
    ends = np.arange(1.0, count + 1)
    low, high = Question("effort/est").interval(Draws(ends, ends, 0))
    below = np.arange(count + 1)  # which draws hold the median between them
    held = (low <= below) & (below + 1 <= high)
    assert stats.binom.pmf(below, count, 0.5)[held].sum() >= 0.95
    assert ((low, high) == (0.0, np.inf)) == (count < 6)


def test_looks_end_with_all_draws():
    assert looks(200) == [16, 24, 36, 54, 81, 122, 183, 200]
    assert looks(10) == [10]


def test_the_command_prints_the_table_and_draws_it(tmp_path, field):
    for number, one in enumerate(field.values()):
        one.save(str(tmp_path / f"box_{number}.json"))
    files = [f"box_{number}.json" for number in (0, 3, 4)]
    done = run_here("rank", *files, "--rollouts", 40, "-o", "ranking.png", cwd=tmp_path)
    assert done.returncode == 0
    assert "| 1 | box_0 |" in done.stdout.replace("  ", " ")
    assert (tmp_path / "ranking.png").read_bytes().startswith(b"\x89PNG")
    twice = run_here("rank", *files, "-o", "ranking.png", cwd=tmp_path)
    assert twice.returncode == 2 and "exists" in twice.stderr
    done = run_here("rank", *files, "--rollouts", 40, "-o", "ranking.csv", cwd=tmp_path)
    assert (tmp_path / "ranking.csv").read_text().startswith("candidate,score,low,high")


def test_the_command_says_what_is_wrong_in_one_line(tmp_path):
    problem().save(str(tmp_path / "box.json"))
    belief = json.dumps({"weight": 1})
    for arguments in (["none.json"], ["box.json", "box.json"], ["box.json", "--belief", belief]):
        done = run_here("rank", *arguments, cwd=tmp_path)
        assert done.returncode == 2
        assert done.stderr.startswith("error: ") and done.stderr.count("\n") == 1


def test_a_notebook_shows_the_candidates_and_the_decision(raced):
    html = raced._repr_html_()
    assert "at -0.9" in html and ">out<" in html and raced.decision[1:] in html
