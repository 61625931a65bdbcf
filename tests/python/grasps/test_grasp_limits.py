"""How much a grasp can take: the least force by Coulomb, the largest error by the pad's size."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import invoke
from scipy import stats

import energymargin as em
from energymargin.grasps.trials import GraspTrials

G = 9.81
NOTHING = em.disturbances.Uniform(0.0)
MASS, FRICTION, WIDTH = 0.3, 0.5, 0.04
PAD = 0.02


def grip(**changes):
    """A block between two pads, whose grasp frame is in its middle, z down."""
    turned = np.diag([1.0, -1.0, -1.0, 1.0])
    block = em.grasps.GraspObject(em.Box((WIDTH, 0.04, 0.06)), mass=MASS, friction=FRICTION)
    hand = em.grasps.ParallelGripper(opening=0.08, pad=(PAD, PAD), force=20.0)
    poses = np.array([turned, turned])
    poses[1, 0, 3] = 0.15  # far beside the block: no hand closes on it there
    found = em.grasps.GraspSet(poses[: changes.pop("count", 1)])
    asked = {"disturbance": NOTHING, "protocol": "hold"} | changes
    return em.grasps.limits(found, hand, block, asked.pop("protocol"), **asked)


def test_the_least_force_and_the_least_friction_are_those_of_coulomb():
    found = grip(vary={"force": (0.5, 20.0), "friction": (0.02, 1.0), "mass": (0.05, 4.0)})
    force, friction, mass = (one[0] for one in found.limits.values())
    assert force.side == friction.side == "above" and mass.side == "below" and found.complete
    assert force.value == pytest.approx(MASS * G / 2 / FRICTION, rel=0.03) and force.unit == "N"
    assert friction.value == pytest.approx(MASS * G / 2 / 20.0, rel=0.03)
    assert mass.value == pytest.approx(2 * FRICTION * 20.0 / G, rel=0.03)
    assert (found.values("force") == [force.value]).all()
    assert "| grasp | force | friction | mass |" in found.to_markdown()


def test_a_pad_that_is_beside_the_block_holds_nothing():
    """Off along the pad's width by half of the block and the pad, it closes on nothing."""
    found = grip(vary={"y": (0.0, 0.06)}, draws=80)
    one = found.limits["y"][0]
    assert one.side == "below" and 0.02 < one.value <= 0.02 + PAD / 2
    assert one.unit == "m"


def test_an_error_to_both_sides_has_both_its_limits_without_more_draws():
    """The open hand is in the block beyond half of what it is wider, give or take a millimetre."""
    found = grip(vary={"x": (-0.06, 0.06)})
    one, free = found.limits["x"][0], (0.08 - WIDTH) / 2
    assert [side for *_, side in one.crossings] == ["above", "below"]
    assert [value for value, *_ in one.crossings] == pytest.approx([-free, free], abs=0.0015)


def test_a_grasp_without_a_limit_says_so_and_the_others_have_theirs(tmp_path):
    found = grip(vary={"force": (0.5, 20.0)}, count=2, threads=2)
    one, other = found.limits["force"]
    assert one.side == "above" and other.side == "nowhere" and found.complete
    rows = json.loads(found.to_json())
    assert rows[0]["force"]["side"] == "above" and rows[1]["force"]["crossings"] == []
    again = grip(vary={"force": (0.5, 20.0)}, threads=1)
    assert again.limits["force"][0].value == one.value


def test_a_store_has_the_limits_of_grasps_and_nothing_is_asked_again(tmp_path, monkeypatch):
    asked = {"vary": {"force": (0.5, 20.0)}, "store": tmp_path / "limits.db", "threads": 1}
    first, outcomes, made = grip(count=2, **asked), GraspTrials.outcomes, []

    def counted(*given):
        made.append(given)
        return outcomes(*given)

    monkeypatch.setattr(GraspTrials, "outcomes", counted)
    again = grip(count=2, **asked)
    assert not made
    for one, other in zip(first.limits["force"], again.limits["force"], strict=True):
        np.testing.assert_equal(vars(other), vars(one))
    assert again.to_json() == first.to_json()
    grip(count=1, **asked, probability=0.9)
    assert made


def test_a_cancel_keeps_the_grasps_that_are_done():
    cancel = em.Cancel()
    cancel.set()
    with pytest.raises(em.Cancelled, match="before a grasp has its limits"):
        grip(vary={"force": (0.5, 20.0)}, cancel=cancel)


def test_a_grasp_that_is_cut_off_within_its_trials_is_unfinished(monkeypatch):
    run, stop = em.capture_probability, em.Cancel()

    def cut_off(problem, **asked):
        stop.set()
        asked["cancel"].set()
        found = run(problem, **asked | {"rollouts": 3, "cancel": None})
        names = ("exit_times", "steps", "unconverged", "lost_time")
        return SimpleNamespace(complete=False, **{name: getattr(found, name) for name in names})

    monkeypatch.setattr(em, "capture_probability", cut_off)
    with pytest.raises(em.Cancelled, match="before a grasp has its limits"):
        grip(vary={"force": (0.5, 20.0)}, threads=1, cancel=stop)


def test_the_moments_of_an_object_grow_with_its_mass(monkeypatch):
    turned, built = np.diag([1.0, -1.0, -1.0, 1.0]), {}
    shape, known = em.Box((WIDTH, 0.04, 0.06)), em.Inertial((0, 0, 0), inertia=[1e-4, 1e-4, 5e-5])
    block = em.grasps.GraspObject(shape, mass=MASS, friction=FRICTION, inertial=known)
    outcomes = GraspTrials.outcomes

    def seen(trials, *given):
        built[trials.object.mass] = trials.object.inertial.moments
        return outcomes(trials, *given)

    monkeypatch.setattr(GraspTrials, "outcomes", seen)
    asked = {"vary": {"mass": (0.1, 0.9)}, "draws": 16, "probability": 0.5, "tolerance": 0.2}
    em.grasps.limits(em.grasps.GraspSet(turned[None]), "panda", block, threads=1, **asked)
    assert {0.1, 0.9} <= set(built)
    for mass, moments in built.items():
        assert moments == pytest.approx(np.array(known.moments) * mass / MASS)


def test_what_limits_does_not_take_is_named():
    with pytest.raises(TypeError, match=r"limits takes no rollouts, expected .*belief, dist"):
        grip(vary={"force": (0.5, 20.0)}, rollouts=3)


@pytest.mark.parametrize(
    ("vary", "match"),
    [
        ({}, "vary is {}, expected ranges by name"),
        ({"colour": (0, 1)}, "vary is 'colour', expected 'force'"),
        ({"force": (-1.0, -0.5)}, "force is -1"),
        ({"mass": (0.0, 1.0)}, "mass is 0"),
        ({"force": (20.0, 1.0)}, r"range is \(20\.0, 1\.0\), expected \(low, high\)"),
        ({"force": 5.0}, "range is 5"),
    ],
)
def test_what_cannot_be_varied_is_named(vary, match):
    with pytest.raises(ValueError, match=match):
        grip(vary=vary)


@pytest.mark.parametrize("wrong", [{"probability": 1}, {"draws": 5}, {"tolerance": 0}])
def test_what_no_grasp_can_be_asked_is_refused(wrong):
    """It is no error of each grasp."""
    with pytest.raises(ValueError, match=f"{next(iter(wrong))} is {next(iter(wrong.values()))}"):
        grip(vary={"force": (0.5, 20.0)}, **wrong)


def test_the_command_tells_what_each_grasp_of_a_file_takes(tmp_path):
    turned = np.diag([1.0, -1.0, -1.0, 1.0])
    file, card = tmp_path / "grasps.csv", tmp_path / "card.json"
    em.grasps.write(file, em.grasps.GraspSet(turned[None]))
    mesh = tmp_path / "block.obj"
    import trimesh

    trimesh.creation.box((WIDTH, 0.04, 0.06)).export(mesh)
    words = ["limits", str(file), "--hand", '{"opening": 0.08, "force": 20}', "--object", str(mesh)]
    words += ["--mass", "0.3", "--frame", "grasp", "--vary", "force=0.5:20", "-o", str(card)]
    told = invoke(words)
    assert told.exit_code == 0 and "above" in told.output, told.output
    assert json.loads(card.read_text())[0]["force"]["unit"] == "N"


def test_a_belief_of_factors_goes_with_what_is_varied_and_one_of_values_is_refused():
    vary, spread = {"friction": (0.02, 1.0)}, stats.uniform(0.5, 1.0)
    known = em.grasps.GraspBelief(friction=spread, relative=True)
    low, high = grip(vary=vary, belief=known, probability=0.5).limits["friction"][0].interval()
    assert low <= MASS * G / 2 / 20.0 <= high  # the factor's median is 1
    fixed = em.grasps.GraspBelief(friction=spread)
    with pytest.raises(ValueError, match=r"vary is 'friction', which the belief draws .*relative"):
        grip(vary=vary, belief=fixed)
