"""Improvement of a plan: it finds the best one of a problem whose answer is known."""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from sliding import HORIZON, MASS, problem, still

import energymargin as em
from energymargin.act.evolution import MOST, adapted, scaled
from energymargin.act.parameters import Parameters
from energymargin.disturbances import text_of
from energymargin.model.plans import in_steps

PUSHES = em.disturbances.Gaussian(force=3.0, correlation_time=0.5)
BOX = {"x": (-0.95, 0.8, 0.95)}
SMALL = {"budget": 600_000, "rollouts": 16, "disturbance": PUSHES}


def placed(values):
    return still(values)


@pytest.fixture(scope="module")
def middle():
    return em.improve(problem(), BOX, placed, **SMALL)


def test_the_middle_between_two_edges_holds_best(middle):
    assert abs(middle.values["x"]) < 0.2
    assert middle.after.score > middle.before.score + 0.2
    assert middle.confidence > 0.99
    assert middle.start == {"x": 0.8}


def test_a_plan_is_followed_over_its_own_duration():
    """A force that brakes a box: the best one takes off all of its speed."""
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("object", em.Sphere(0.1), mass=1, position=(0, 5, 0), role="object")
    scene.add_body("effector", em.Box((0.1,) * 3), mass=MASS, position=(0, 0, 0), role="effector")
    asked = em.Problem(
        scene,
        scene.pack(effector={"velocity": (1.0, 0, 0)}),
        force=(0.1, 0, 0),
        torque=(0, 0, 0),
        duration=0.5,
        captured=em.regions.Box("effector", center=(0.5, 0, 0), size=(0.1, np.inf, np.inf)),
        start_outside=True,
    ).replace(succeeded=em.regions.Box("effector", (0.5, 0, 0), (0.02, np.inf, np.inf)))

    def braked(values):
        rows = np.zeros((240, 6))
        rows[:, 0] = values["force"]
        return em.Plan(1 / 240, wrenches={"effector": rows})

    found = em.improve(
        asked,
        {"force": (-4.0, -1.0, 0.0)},
        braked,
        metric="probability/success",
        budget=20_000,
        rollouts=1,
        harden=False,
    )
    # 0.5 m in 1 s: half of the speed is gone in the mean.
    assert found.values["force"] == pytest.approx(-MASS, abs=0.2)
    assert found.problem.horizon == found.plan.duration == 1.0


def test_a_plan_of_50_hz_is_improved_in_steps_of_the_scene():
    def slow(values):
        return em.Plan(0.02, wrenches={"object": np.full((50, 6), [values["x"], 0, 0, 0, 0, 0])})

    def fine(values):
        return in_steps(slow(values), problem().scene.step)

    few = {**SMALL, "budget": 2000}
    assert em.improve(problem(), BOX, slow, **few).to_csv() == (
        em.improve(problem(), BOX, fine, **few).to_csv()
    )


def test_an_effort_is_improved():
    found = em.improve(
        problem(),
        BOX,
        placed,
        metric="effort/est",
        nodes=60,
        rollouts=3,
        budget=2_500_000,
    )
    assert abs(found.values["x"]) < 0.4
    # The cheapest push comes at once: d / T is the least speed over a distance d.
    assert found.after.score > MASS / 2 * (1 - abs(found.values["x"])) ** 2 / HORIZON**2
    assert found.after.score > found.before.score


def test_what_breaks_a_constraint_is_not_simulated():
    asked = []

    def noted(values):
        asked.append(values["x"])
        return still(values)

    found = em.improve(problem(), BOX, noted, constraints=[lambda v: v["x"] - 0.5], **SMALL)
    assert min(asked) >= 0.5 - 1e-12
    assert found.values["x"] == pytest.approx(0.5, abs=0.15)


def test_values_that_cannot_be_are_left_out():
    found = em.improve(problem(), BOX, lambda v: still(v) if v["x"] > 0.5 else None, **SMALL)
    assert found.values["x"] > 0.5


def test_a_search_ends_where_nothing_but_the_start_can_be():
    found = em.improve(
        problem(), BOX, lambda v: still(v) if v["x"] == BOX["x"][1] else None, **SMALL
    )
    assert found.values == found.start and found.ranking.names == ("start",)


def test_the_same_seed_gives_the_same_bits_on_any_number_of_threads(middle):
    again = em.improve(problem(), BOX, placed, threads=1, **SMALL)
    assert again.to_csv() == middle.to_csv() and again.values == middle.values
    assert em.improve(problem(), BOX, placed, seed=1, **SMALL).to_csv() != middle.to_csv()


def test_numpys_own_generator_is_left_alone():
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    em.improve(problem(), BOX, placed, **{**SMALL, "budget": 1000})
    assert np.array_equal(before, np.random.get_state()[1])  # noqa: NPY002


def test_a_search_that_was_stopped_goes_on_to_the_same_result(tmp_path, middle):
    path = tmp_path / "search.db"

    def stop(done, budget):
        if done > budget / 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        em.improve(problem(), BOX, placed, store=path, progress=stop, **SMALL)
    again = em.improve(problem(), BOX, placed, store=path, **SMALL)
    assert again.to_csv() == middle.to_csv() and again.steps == middle.steps
    larger = {**SMALL, "budget": 900_000}
    more = em.improve(problem(), BOX, placed, store=path, **larger)
    assert len(more.generations) > len(middle.generations)
    assert more.to_csv().startswith(middle.to_csv())
    straight = em.improve(problem(), BOX, placed, **larger)
    assert more.values == straight.values
    assert more.ranking.to_csv() == straight.ranking.to_csv()


def test_a_changed_plan_constraint_or_set_is_simulated_anew(tmp_path):
    path, small = tmp_path / "search.db", {**SMALL, "budget": 1000}
    start = BOX["x"][1]

    def aside(values):
        return still({"x": values["x"] if values["x"] == start else 0.93})

    em.improve(problem(), BOX, placed, store=path, **small)
    for changed, constraints in ((aside, []), (placed, [lambda v: v["x"] - 0.5])):
        alone = em.improve(problem(), BOX, changed, constraints=constraints, **small)
        again = em.improve(problem(), BOX, changed, constraints=constraints, store=path, **small)
        assert again.ranking.to_csv() == alone.ranking.to_csv()
        assert again.to_csv() == alone.to_csv()


def pushes_of(force):
    """A disturbance as a closure."""

    def pushes(random, times):
        wrenches = np.zeros((len(times), 6))
        wrenches[:, 0] = random.normal(scale=force)
        return wrenches

    return pushes


def pushes(random, times, force=3.0):
    """A disturbance as a function of a module."""
    return pushes_of(force)(random, times)


@dataclass(frozen=True)
class Pushes:
    """A disturbance as an object, and as a method of one."""

    force: float

    def __call__(self, random, times):
        return pushes(random, times, self.force)


FUNCTIONS = [
    pushes_of(0.1),
    partial(pushes, force=0.1),
    lambda random, times: pushes(random, times, 0.1),
    Pushes(0.1),
    Pushes(0.1).__call__,
    pushes,  # which may read a number that has changed
]


@pytest.mark.parametrize("function", FUNCTIONS)
def test_a_file_refuses_a_function_as_disturbance_which_it_cannot_tell_from_another(
    tmp_path, function
):
    path, small = tmp_path / "search.db", {**SMALL, "budget": 1000, "disturbance": function}
    with pytest.raises(ValueError, match=r"disturbance is .*cannot tell.*or leave store out"):
        em.improve(problem(), BOX, placed, store=path, **small)
    assert not path.exists()


def test_a_function_as_disturbance_is_searched_with_without_a_file():
    small = {**SMALL, "budget": 1000}
    hard, soft = (
        em.improve(problem(), BOX, placed, **{**small, "disturbance": pushes_of(force)})
        for force in (3.0, 0.1)
    )
    assert hard.before.score < 0.9 and soft.before.score == 1.0


def test_a_file_refuses_a_predicate_which_it_cannot_tell_from_another(tmp_path):
    inside = em.regions.Predicate(lambda states: np.ones(len(states), dtype=bool))
    small = {**SMALL, "budget": 1000}

    def anywhere(values):
        return still(values).replace(captured=inside)

    with pytest.raises(ValueError, match=r"store keeps .* a Predicate has no file format.*leave"):
        em.improve(problem(), BOX, anywhere, store=tmp_path / "search.db", **small)
    assert em.improve(problem(), BOX, anywhere, **small).before.score == 1.0


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (em.disturbances.Uniform(), em.disturbances.Uniform(1 + 1e-15)),
        (em.disturbances.Uniform(), em.disturbances.Gaussian(force=1.0)),
        (
            em.disturbances.of_plan(force=(0.1, 0, 0), torque=(0, 0, 0)),
            em.disturbances.of_plan(force=(0.1 + 1e-12, 0, 0), torque=(0, 0, 0)),
        ),
    ],
)
def test_the_text_of_a_disturbance_is_that_of_no_other(one, other):
    assert text_of(one) != text_of(other)


def test_a_file_knows_numpys_numbers(tmp_path):
    path, small = tmp_path / "search.db", {**SMALL, "budget": 1000}
    first = em.improve(problem(), BOX, placed, store=path, seed=np.int64(3), **small)
    kept = path.read_bytes()
    again = em.improve(problem(), BOX, placed, store=path, seed=3, **small)
    assert again.ranking.to_csv() == first.ranking.to_csv() and path.read_bytes() == kept


def test_a_search_ends_where_everything_is_out_at_once():
    far = {"x": (1.5, 2.0, 3.0)}
    found = em.improve(problem(), far, still, budget=100, rollouts=4)
    assert found.after.score == 0 and found.complete


def test_a_draw_is_the_starts():
    calm = em.disturbances.Uniform(0.0)
    near = {"x": (-0.1, 0.05, 0.1)}
    small = {"disturbance": calm, "rollouts": 4, "budget": 50_000}
    found = em.improve(problem(), near, still, harden=False, **small)
    assert found.values == found.start and found.ranking.best == "start"


def test_a_table_of_tries_has_the_values(middle):
    column = np.genfromtxt(middle.to_csv().splitlines(), delimiter=",", names=True)["x"]
    assert BOX["x"][0] <= column.min() < -0.5 and 0.5 < column.max() <= BOX["x"][2]


def test_plans_of_other_lengths_are_compared_for_success_alone():
    def lasting(values):
        return problem(0.0).replace(horizon=1.0 if values["t"] == 1.0 else 0.5)

    times = {"t": (0.5, 1.0, 1.5)}
    with pytest.raises(ValueError, match=r"has the horizon 0.5, the start 1.0, expected the same"):
        em.improve(problem(), times, lasting, **SMALL)
    em.improve(problem(), times, lasting, metric="probability/success", **{**SMALL, "budget": 1000})


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        (lambda v: {"force": (v, 0, 0)}, "the force bounds"),
        (lambda v: {"torque": (v, 0, 0)}, "the torque bounds"),
        (lambda v: {"duration": v / 20}, "the duration"),
    ],
)
def test_a_plan_that_would_meet_weaker_disturbances_is_refused(changed, what):
    def weaker(values):
        return problem(**changed(values["v"]))

    with pytest.raises(ValueError, match=f"makes of {{'v': .*has {what} .*, the start "):
        em.improve(problem(), {"v": (1.0, 10.0, 11.0)}, weaker, **SMALL)


def test_a_timeout_leaves_the_plan_that_is_found_by_then_and_a_cancel_raises(tmp_path):
    large = {**SMALL, "budget": 2 * 10**9}
    found = em.improve(problem(), BOX, placed, timeout=15.0, **large)
    assert not found.complete and len(found.generations) >= 1
    assert found.after.draws >= 16 and found.after.score >= found.before.score
    cancel = em.Cancel()
    cancel.set()
    with pytest.raises(em.Cancelled):
        em.improve(problem(), BOX, placed, cancel=cancel, store=tmp_path / "search.db", **large)


def test_a_file_serves_searches_of_several_seeds(tmp_path):
    path, small = tmp_path / "search.db", {**SMALL, "budget": 1000}
    first = em.improve(problem(), BOX, placed, store=path, **small)
    other = em.improve(problem(), BOX, placed, store=path, seed=1, **small)
    kept = path.read_bytes()
    assert em.improve(problem(), BOX, placed, store=path, **small).to_csv() == first.to_csv()
    assert other.to_csv() == em.improve(problem(), BOX, placed, seed=1, **small).to_csv()
    assert path.read_bytes() == kept


def test_a_file_of_something_else_is_refused(tmp_path):
    path = tmp_path / "search.db"
    for content in (b"no search", b"\xff\xfe\x00\n", b"[1, 2]\n"):
        path.write_bytes(content)
        with pytest.raises(ValueError, match=r"is not a file of scores.* give another name"):
            em.improve(problem(), BOX, placed, store=path, **SMALL)
    with pytest.raises(IsADirectoryError):
        em.improve(problem(), BOX, placed, store=tmp_path, **SMALL)


def test_a_bit_that_has_changed_in_a_file_is_refused_or_changes_nothing(tmp_path):
    path, small = tmp_path / "search.db", {**SMALL, "budget": 1000}
    first = em.improve(problem(), BOX, placed, store=path, **small)
    kept, random, refused = path.read_bytes(), np.random.default_rng(0), 0
    for place in random.integers(len(kept) - 1, size=60):
        changed = bytearray(kept)
        changed[place] ^= 1 << random.integers(8)
        path.write_bytes(changed)
        try:
            assert (
                em.improve(problem(), BOX, placed, store=path, **small).to_csv() == first.to_csv()
            )
        except ValueError as error:
            refused += str(path) in str(error)
    assert refused > 5


@pytest.mark.parametrize("unsure", [None, em.beliefs.Uncertainty(mass=0.1)])
@pytest.mark.parametrize("race", [True, False])
def test_a_ranking_that_was_stopped_goes_on_to_the_same_result(tmp_path, race, unsure):
    path = tmp_path / "ranking.db"
    field = {f"{x}": still({"x": x}) for x in (0.1, 0.8, 0.9)}
    asked = {"rollouts": 60, "race": race, "tolerance": 0.0, "uncertainty": unsure}
    straight = em.rank(field, **asked)

    def stop(done, total):
        if done > total / 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        em.rank(field, store=path, progress=stop, threads=1, **asked)
    again = em.rank(field, store=path, **asked)
    assert again.to_csv() == straight.to_csv()
    kept = path.read_bytes()
    assert em.rank(field, store=path, **asked).to_csv() == straight.to_csv()
    assert path.read_bytes() == kept


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"parameters": {}}, "parameters is {}"),
        ({"parameters": {"x": (1, 0)}}, r"parameters\['x'\] is \(1, 0\), expected \(low, high\)"),
        ({"parameters": {"x": (0, 2, 1)}}, r"parameters\['x'\]"),
        ({"make_plan": lambda values: 3}, "make_plan returned 3 for {'x': 0.8}"),
        ({"make_plan": lambda values: None}, "make_plan returned None for the start"),
        ({"constraints": [lambda v: -1.0]}, r"constraints\[0\] is -1 at the start"),
        ({"constraints": [lambda v: float("nan")]}, r"constraints\[0\] returned nan"),
        ({"constraints": [lambda v: None]}, r"constraints\[0\] returned None"),
        ({"constraints": [lambda v: "x"]}, r"constraints\[0\] returned 'x'"),
        ({"constraints": lambda v: 1.0}, "constraints is .*expected a list of functions"),
        ({"constraints": [1.0]}, r"constraints\[0\] is 1.0"),
        ({"parameters": {"x": "19"}}, r"parameters\['x'\] is '19'"),
        ({"parameters": {1: (0, 1)}}, "parameters has the name 1"),
        ({"make_plan": 3}, "make_plan is 3"),
        ({"problem": "abc"}, "problem is 'abc'"),
        ({"harden": "no"}, "harden is 'no'"),
        ({"uncertainty": "abc"}, "uncertainty is 'abc'"),
        ({"store": 3}, "store is 3"),
        ({"progress": 3}, "progress is 3"),
        ({"metric": "force"}, "metric is 'force'"),
        ({"method": "grid"}, "method is 'grid'"),
        ({"budget": 0}, "budget is 0"),
    ],
)
def test_wrong_arguments_are_named(changes, message):
    arguments = {"problem": problem(), "parameters": BOX, "make_plan": placed, **SMALL, **changes}
    with pytest.raises(ValueError, match=message):
        em.improve(**arguments)


def test_a_disturbance_grows_while_all_withstand_it_and_never_falls_below_the_stated_one():
    assert adapted(1.0, np.array([1.0, 0.95, 0.2])) == 1.25
    assert adapted(1.25, np.array([0.1, 0.2])) == 1.0
    assert adapted(1.0, np.array([0.1, 0.2])) == 1.0
    assert adapted(MOST, np.ones(3)) == MOST
    assert scaled(None, 2.0).strength == 2.0
    assert scaled(PUSHES, 2.0).force == 6.0
    assert scaled(em.disturbances.of_plan((1, 0, 0)), 3.0).force[0] == 3.0
    assert scaled(lambda random, times: np.ones(2), 2.0)(None, None).tolist() == [2.0, 2.0]


def test_parameters_meet_their_start_to_the_bit():
    box = Parameters({"a": (0.1, 0.3, 0.7), "b": (0.0, 1.0)})
    assert box.values(box.start) == {"a": 0.3, "b": 0.5}
    assert box.values(np.array([1.0, 0.0])) == {"a": pytest.approx(0.7), "b": 0.0}


def test_pictures_and_pages_show_the_result(middle):
    from energymargin.plots import figure_improvement

    assert len(figure_improvement(middle).axes) >= 3
    assert "parameter" in middle._repr_html_() and "found" in middle.to_markdown()


@pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")
def test_plans_whose_rollouts_diverge_are_no_plans_but_the_start_has_to_be_one():
    def aside(random, times):
        wrenches = np.zeros((len(times), 6))
        wrenches[:, :2] = random.normal(scale=3.0), 1e150  # far away, but for what has no mass
        return wrenches

    def placed_or_light(values):
        made = placed(values)
        light = made.scene.with_body("object", mass=1e-200)
        return made.replace(scene=light) if values["x"] < 0 else made

    few = SMALL | {"disturbance": aside, "budget": 200_000, "rollouts": 8}
    found = em.improve(problem(), BOX, placed_or_light, **few)
    assert 0 <= found.values["x"] < 0.8
    scores = np.concatenate([one.scores for one in found.generations])
    points = np.concatenate([one.points for one in found.generations])[:, 0]
    assert np.array_equal(np.isnan(scores), points < 0.5) and np.isnan(scores).any()
    with pytest.raises(em.DivergedError, match="8 of 8 rollouts of the start diverged"):
        em.improve(problem(), {"x": (-0.95, -0.8, 0.95)}, placed_or_light, **few)
