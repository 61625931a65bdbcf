"""Grasps that are scored: closed forms, draws, what is lost and how, files of scores."""

import re
import threading
import warnings
from contextlib import suppress
from dataclasses import replace
from time import monotonic

import numpy as np
import pytest
import trimesh
from mesh_files import written
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin.grasps import (
    GraspBelief,
    GraspObject,
    GraspSet,
    HandFile,
    Motion,
    ObjectFacts,
    ParallelGripper,
    Protocol,
    score,
)
from energymargin.grasps.belief import lab
from energymargin.grasps.hands import PRESETS, preset
from energymargin.grasps.protocols import LIFT
from energymargin.grasps.scores import grasp_of
from energymargin.grasps.scoring import score_grasps
from energymargin.grasps.trials import GraspTrials

GRIPPER = ParallelGripper(opening=0.08, force=10.0, palm=(0.1, 0.04, 0.04))
AGAIN = {"colliding": "redraw"}
STILL = em.disturbances.Uniform(0.0)
SIDE = 0.04
HOLD = Protocol([Motion("hold", 1.0)])
DOWN = np.diag([1.0, -1.0, -1.0, 1.0])  # the approach points down, the fingers open along x
POSE = [0.004] * 3 + [0.05] * 3


def cube(mass=0.2, friction=0.5):
    return GraspObject(em.Box((SIDE, SIDE, SIDE)), mass, friction)


def moved(x=0.0, y=0.0, z=0.0):
    """The grasp from above, moved in the object's frame."""
    pose = DOWN.copy()
    pose[:3, 3] = x, y, z
    return pose


def grasps(*poses, **given):
    return GraspSet(np.array(poses or (moved(),)), **given)


# Physics


@pytest.mark.parametrize(("share", "held"), [(0.5, 1.0), (0.9, 1.0), (0.95, 1.0), (1.05, 0.0)])
def test_a_cube_is_held_up_to_coulomb_s_limit(share, held):
    heaviest = 2 * 0.5 * GRIPPER.force / 9.81
    scores = score(grasps(), GRIPPER, cube(share * heaviest), disturbance=STILL, rollouts=1)
    assert scores.probabilities[0] == held


@pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")
@pytest.mark.parametrize("name", sorted(PRESETS))
@pytest.mark.parametrize(("share", "held"), [(0.93, 1.0), (1.07, 0.0)])
def test_each_preset_holds_what_its_force_does(name, share, held):
    mass = share * 2 * 0.3 * PRESETS[name].force / 9.81
    one = score(grasps(), name, cube(mass, 0.3), disturbance=STILL, rollouts=1)
    assert one.probabilities[0] == held


def test_a_shake_needs_the_force_of_its_acceleration():
    # 5 cm at 3 Hz: 17.8 m/s2 at most along the fingers' plane, beside gravity.
    shaken = Protocol([Motion("shake", 1.5, 0.05, (0, 1, 0), frequency=3.0)])
    most = np.hypot(9.81, 0.05 * (6 * np.pi) ** 2)
    for share, held in ((0.9, 1.0), (1.2, 0.0)):
        mass = share * 2 * 0.5 * GRIPPER.force / most
        found = score(grasps(), GRIPPER, cube(mass), shaken, disturbance=STILL, rollouts=1)
        assert found.probabilities[0] == held


def test_a_cube_is_lifted_off_a_table_and_a_heavy_one_is_left_there():
    scores = [score(grasps(), GRIPPER, cube(mass), "lift", rollouts=3) for mass in (0.2, 1.5)]
    assert [one.probabilities[0] for one in scores] == [1.0, 0.0]
    assert set(scores[1].losses(0)) == {"slipped"}


def test_a_long_bar_that_is_gripped_at_its_end_turns_in_the_hand():
    bar = GraspObject(em.Box((0.02, 0.2, 0.02)), 0.3, 0.5)
    strict = Protocol([Motion("hold", 0.5)], angle=0.2, radius=1.0)
    center, end = grasps(moved(), moved(y=0.09))[0], grasps(moved(), moved(y=0.09))[1]
    firm = replace(GRIPPER, force=15.0)
    assert score(center, firm, bar, strict, disturbance=STILL, rollouts=1).probabilities[0] == 1
    assert score(end, firm, bar, strict, disturbance=STILL, rollouts=1).losses(0) == {"turned": 1}


def test_a_hand_that_closes_on_nothing_does_not_grip_and_one_inside_the_object_collides():
    wide = GraspObject(em.Box((0.1, 0.04, 0.04)), 0.2)
    scores = score(grasps(moved(y=0.06)), GRIPPER, cube(), rollouts=2)
    assert scores.losses(0) == {"not gripped": 2}
    assert scores.steps[0] > 0  # those in which the hand closes
    assert np.isnan(scores.times).all()
    for colliding in ("lost", "redraw", "retreat"):
        with pytest.warns(
            em.PlausibilityWarning,
            match=r"order of .*0.1 x 0.04 x 0.04 m, fit into an opening of 0.08 m\?",
        ):
            inside = score(grasps(), GRIPPER, wide, rollouts=2, colliding=colliding)
        assert set(inside.losses(0)) <= {"collided", "not gripped"}


def test_a_hand_in_the_table_is_moved_back_along_its_approach_or_lost():
    low = grasps(moved(z=-0.018))  # fingertips reach 1 cm below the frame, the table is 2 cm below
    with pytest.warns(em.PlausibilityWarning, match="in 2 of 2 trials the hand was inside"):
        back = score(low, GRIPPER, cube(), "lift", rollouts=2, colliding="retreat")
    assert back.probabilities[0] == 1
    assert np.allclose(back.back, 0.008, atol=1e-9)
    with pytest.warns(em.PlausibilityWarning, match="in 2 of 2 trials the hand was inside"):
        lost = score(low, GRIPPER, cube(), "lift", rollouts=2)
    assert lost.losses(0) == {"collided": 2}
    assert (back.colliding[0], lost.colliding[0]) == (2, 2)


@pytest.mark.parametrize(("gap", "back"), [(6e-3, 0.0), (3e-3, 0.0), (-2e-3, 0.018)])
def test_only_a_hand_that_is_in_the_object_where_it_is_collides(gap, back):
    # The drives would close a gap of 6 mm within a step. Fingers 40 mm from the axis are 1 mm deep
    # in a ball of 42 mm where they end 9 mm before its middle, and reach 8.8 mm beyond it.
    thing = GraspObject(em.Sphere(0.04 - gap), 0.05)
    trials = GraspTrials(preset("panda"), thing, HOLD, colliding="retreat")
    start = trials.start(grasp_of(grasps(), 0), trials.draw(-1))
    assert start.back == pytest.approx(back)


@pytest.mark.parametrize(("depth", "sunk"), [(0.99e-3, False), (1.01e-3, True)])
def test_a_closed_hand_that_is_so_deep_that_no_problem_starts_there_has_collided(depth, sunk):
    # Half of the half extent of what is 4 mm thick; the second part is thinner, and turned.
    corners = np.array(np.meshgrid([-1, 1], [-5, 5], [-20, 20])).reshape(3, -1).T * 1e-3
    turn = Rotation.from_euler("xyz", (0.3, 0.5, 0.7)).as_matrix()
    hull = em.ConvexHull((corners @ turn).tolist())
    plate = em.Part(em.Box((4e-3, 0.04, 0.04)))
    lath = em.Part(hull, (0, 0.1, 0), (0, 0, 0.6, 0.8))
    trials = GraspTrials(GRIPPER, GraspObject(em.Compound([plate, lath]), 0.02), HOLD)
    scene, hand = trials.scene(np.nan, trials.draw(-1), gravity=False)
    state = scene.pack(joints={"left": 2e-3 - depth})
    ending = trials.ending(em.World(scene), hand, state, {"left", "right", "object"})
    assert ending == ("collided" if sunk else "")
    closed = trials.closed(scene, hand, state, ending)
    if sunk:
        with pytest.raises(ValueError, match="penetrate each other"):
            trials.problem(closed, trials.draw(-1))
    else:
        assert trials.problem(closed, trials.draw(-1)).plan is not None


def test_a_hand_that_diverges_as_it_closes_says_so_and_one_that_is_stopped_does_not():
    weightless = GraspTrials(replace(GRIPPER, mass=1e-300, force=1e300), cube(), HOLD)
    grasp, stopped = grasp_of(grasps(), 0), em.Cancel()
    assert weightless.run(grasp, 0).ending == "diverged"
    with pytest.raises(ValueError, match="diverges as it closes"):
        weightless.likely_problem(grasp)
    stopped.set()
    with pytest.raises(em.Cancelled):
        weightless.run(grasp, 0, stopped)


def test_draws_that_collide_are_lost_or_drawn_again_and_counted_either_way():
    wide = GraspObject(em.Box((0.07, 0.04, 0.04)), 0.2)
    asked = {"belief": GraspBelief(pose=[0.005, 0, 0, 0, 0, 0]), "rollouts": 8}
    lost, drawn = (score(grasps(), GRIPPER, wide, **asked, **k) for k in ({}, AGAIN))
    assert drawn.redrawn.any() and not drawn.back.any() and "collided" not in drawn.losses(0)
    assert lost.losses(0)["collided"] == lost.colliding[0] == drawn.colliding[0] > 0
    assert lost.probabilities[0] <= 1 - lost.colliding[0] / 8 < drawn.probabilities[0]
    assert lost.table()["colliding"] == drawn.table()["colliding"] == [str(lost.colliding[0])]
    assert drawn.table()["redrawn"] == [str(drawn.redrawn.sum())] and "redrawn" not in lost.table()
    assert f"{lost.colliding[0]},0" in lost.to_csv() and f",{drawn.redrawn.sum()}" in drawn.to_csv()
    assert "got another pose" in drawn.to_markdown() and "got another" not in lost.to_markdown()


@pytest.mark.parametrize("position", [0.0, 0.002, 0.005, 0.01])
def test_a_grasp_that_begins_in_the_object_holds_no_better_the_less_well_it_is_known(position):
    # A finger begins 1 cm in the cube; 1 mm is no collision, so 9 mm to the other side free it.
    aside, belief = grasps(moved(x=0.03)), GraspBelief(pose=[position, 0, 0, 0, 0, 0])
    with pytest.warns(em.PlausibilityWarning, match="trials the hand was inside"):
        scores = score(aside, GRIPPER, cube(), belief=belief, rollouts=20, step=1 / 240)
    free = [next(belief.poses(k, 0))[0] < -0.009 for k in range(20)]
    assert scores.colliding[0] == 20 - sum(free)
    assert scores.probabilities[0] <= np.mean(free) < 0.5


# Draws


def test_trial_k_of_each_grasp_has_the_same_draw_and_its_own_bits_on_any_executor():
    known = {"belief": GraspBelief(pose=POSE, friction=0.1, mass=0.02, force=2.0), "rollouts": 5}
    four = grasps(moved(), moved(z=0.01), moved(), moved(y=0.018))
    one = score(four, GRIPPER, cube(0.3), "shake", threads=1, **known)
    two = score(four, GRIPPER, cube(0.3), "shake", threads=2, **known)
    apart = score(four, GRIPPER, cube(0.3), "shake", executor=em.executors.Processes(2), **known)
    alone = score(four[1], GRIPPER, cube(0.3), "shake", **known)
    for other in (two, apart):
        assert np.array_equal(one.endings, other.endings)
        assert np.array_equal(one.times, other.times, equal_nan=True)
    assert np.array_equal(one.times[0], one.times[2], equal_nan=True)
    assert np.array_equal(one.times[1], alone.times[0], equal_nan=True)
    assert 0 < one.probabilities.mean() < 1


def test_an_error_of_the_pose_turns_about_the_grasp_or_the_centre_of_mass():
    high, turns = moved(z=0.01), [0, 0, 0, 0.2, 0.2, 0.2]

    def starts(about):
        belief = GraspBelief(pose=turns, about=about)
        trials = GraspTrials(GRIPPER, cube(), HOLD, belief)
        grasp = grasp_of(grasps(high), 0)
        scene, _ = trials.scene(np.nan, trials.draw(0), gravity=False)
        state = trials.start(grasp, trials.draw(0)).state
        hand = scene.unpack(state)["hand"]
        return hand["position"], hand["orientation"]

    position, turned = starts("grasp")
    assert np.allclose(position, high[:3, 3])
    assert not np.allclose(turned, (1, 0, 0, 0), atol=0.02)
    position, _ = starts("center_of_mass")
    assert not np.allclose(position, high[:3, 3], atol=1e-4)
    assert np.linalg.norm(position) == pytest.approx(0.01)


def test_a_lighter_grip_by_belief_loses_more():
    firm = score(grasps(), GRIPPER, cube(0.9), rollouts=10, disturbance=STILL)
    vague = GraspBelief(force=3.0)
    unsure = score(grasps(), GRIPPER, cube(0.9), rollouts=10, disturbance=STILL, belief=vague)
    assert firm.probabilities[0] == 1
    assert 0 < unsure.probabilities[0] < 1
    for time in (float("nan"), -1.0):
        with pytest.raises(ValueError, match=r"time is .*, expected a finite number of at least 0"):
            unsure.held_until(time)
    low, high = unsure.interval()[0]
    assert low < unsure.probabilities[0] < high


# Files of scores


def test_scores_go_on_where_they_ended(tmp_path):
    three = grasps(moved(), moved(z=0.01), moved(y=0.018))
    asked = {"protocol": "hold", "rollouts": 3, "belief": GraspBelief(pose=POSE), "threads": 1}
    whole = score(three, GRIPPER, cube(0.8), **asked)
    path, cancel = tmp_path / "scores.db", em.Cancel()

    def stop(done, total):
        cancel.set()

    part = score(three, GRIPPER, cube(0.8), **asked, store=path, progress=stop, cancel=cancel)
    assert not part.complete
    assert np.isnan(part.probabilities).any()
    calls = []
    known = {**asked, "store": path}
    rest = score(three, GRIPPER, cube(0.8), **known, progress=lambda *a: calls.append(a))
    assert np.array_equal(rest.endings, whole.endings)
    assert calls[-1] == (3, 3)
    assert 1 <= calls[0][0] < 3
    calls.clear()
    again = score(three, GRIPPER, cube(0.8), **known, progress=lambda *a: calls.append(a))
    assert np.array_equal(again.endings, whole.endings)
    assert calls == [(3, 3)]
    other = score(three, GRIPPER, cube(0.7), **asked, store=path)  # one file has both
    assert np.array_equal(other.times, score(three, GRIPPER, cube(0.7), **asked).times)
    more = grasps(moved(z=0.01), moved(x=0.001), moved())
    calls.clear()
    score(more, GRIPPER, cube(0.8), **known, progress=lambda *a: calls.append(a))
    assert calls == [(2, 3), (3, 3)]  # it knows grasps wherever they stand
    path.with_name("text.db").write_text("no scores")
    with pytest.raises(ValueError, match="is not a file of scores"):
        score(three, GRIPPER, cube(0.8), **asked, store=path.with_name("text.db"))


PUSHED = Protocol([Motion("hold", 1.0)], radius=0.01, force=4.0, torque=4.0)
SEARCHED = {"protocol": PUSHED, "rollouts": 1, "effort": 200, "step": 1 / 240, "threads": 2}


@pytest.mark.parametrize("shares", [(0.05, 0.3), (0.15, 0.6), (0.4, 0.8)])
def test_efforts_that_were_stopped_half_way_are_searched_again(tmp_path, shares):
    four, path = grasps(*(moved(y=0.004 * k) for k in range(4))), tmp_path / "scores.db"
    begun = monotonic()
    whole = score(four, GRIPPER, cube(), **SEARCHED)
    took = monotonic() - begun
    for share in shares:
        cancel = em.Cancel()
        timer = threading.Timer(share * took, cancel.set)
        timer.start()
        with suppress(em.Cancelled):
            score(four, GRIPPER, cube(), **SEARCHED, store=path, cancel=cancel)
        timer.join()
    rest = score(four, GRIPPER, cube(), **SEARCHED, store=path)
    assert rest.complete and np.isfinite(whole.efforts).all()
    for name in ("efforts", "times", "endings", "likely", "steps"):
        assert np.array_equal(getattr(rest, name), getattr(whole, name), equal_nan=True), name


def test_a_grasp_that_is_stopped_in_its_search_has_no_row():
    cancel, trials = em.Cancel(), GraspTrials(GRIPPER, cube(), PUSHED, step=1 / 240)
    timer = threading.Timer(1.0, cancel.set)  # trials take less, so many nodes more
    timer.start()
    assert score_grasps(trials, 1, 10**7, [grasp_of(grasps(), 0)], cancel) == []
    timer.join()


class Failing(ParallelGripper):
    """A hand that cannot be made for an opening of 7 cm, for a while."""

    fails = True

    def add_to(self, scene, *, force, opening):
        if self.fails and opening == 0.07:
            raise RuntimeError("out of memory")
        return super().add_to(scene, force=force, opening=opening)


def test_an_error_that_is_cured_is_gone_from_the_file(tmp_path, monkeypatch):
    three = grasps(moved(), moved(z=0.01), moved(y=0.005), openings=np.array([0.08, 0.07, 0.08]))
    asked = {"rollouts": 2, "store": tmp_path / "scores.db", "step": 1 / 240}
    with pytest.warns(em.PlausibilityWarning, match="1 grasps"):
        failed = score(three, Failing(0.08), cube(), **asked)
    assert failed.errors == {1: "out of memory"} and failed.complete
    monkeypatch.setattr(Failing, "fails", False)
    cured = score(three, Failing(0.08), cube(), **asked)
    again = score(three, Failing(0.08), cube(), **asked)
    for one in (cured, again):
        assert one.errors == {} and one.complete and not np.isnan(one.probabilities).any()
        assert "not complete" not in one.to_markdown()


def test_an_error_of_before_does_not_make_a_resumed_file_complete(tmp_path):
    three = grasps(moved(), moved(z=0.01), moved(y=0.005), openings=np.array([0.07, 0.08, 0.08]))
    asked = {"rollouts": 2, "store": tmp_path / "scores.db", "step": 1 / 240, "threads": 1}
    with pytest.warns(em.PlausibilityWarning, match="1 grasps"):
        score(three, Failing(0.08), cube(), **asked)
    stopped = em.Cancel()
    stopped.set()
    assert not score(three, Failing(0.08), cube(), **asked, cancel=stopped).complete


def test_a_file_with_a_bit_that_has_changed_is_refused_or_changes_nothing(tmp_path):
    path, asked = tmp_path / "scores.db", {"rollouts": 2, "step": 1 / 240}
    whole = score(grasps(), GRIPPER, cube(), **asked, store=path)
    image, refused = path.read_bytes(), 0
    for place in np.random.default_rng(0).integers(0, 8 * len(image), 60).tolist():
        changed = bytearray(image)
        changed[place // 8] ^= 1 << place % 8
        path.write_bytes(changed)
        try:
            found = score(grasps(), GRIPPER, cube(), **asked, store=path)
            assert np.array_equal(found.times, whole.times)
        except ValueError as error:
            refused += "scores.db" in str(error)
    assert refused


@pytest.mark.parametrize("protocol", ["hold", "shake"])
def test_trials_that_close_once_end_as_each_alone(protocol):
    trials = GraspTrials(
        GRIPPER, cube(2.0), em.grasps.protocols.protocol_of(protocol), step=1 / 240
    )
    for number, pose in enumerate((moved(), moved(z=0.012), moved(y=0.018))):
        grasp = grasp_of(grasps(pose), 0)
        together = trials.outcomes(grasp, range(6))
        alone = [trials.run(grasp, k) for k in range(6)]
        assert [o[:4] for o in together] == [o[:4] for o in alone], number
        assert sum(o.steps for o in together) < sum(o.steps for o in alone)


def test_trials_that_no_memory_could_hold_take_none_before_they_are_made():
    with pytest.raises(TimeoutError, match="before a grasp has its score"):
        score(grasps(), GRIPPER, cube(), rollouts=2 * 10**9, timeout=0.3, threads=1)


# Hands of files

FINGERS = """<robot name="two">
  <link name="palm"><inertial><mass value="1"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3"
    ixy="0" ixz="0" iyz="0"/></inertial></link>
  {}
</robot>"""
FINGER = """<link name="{side}"><inertial><origin xyz="{x} 0 0"/><mass value=".05"/>
    <inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="{x} 0 -.0125"/><geometry><box size=".01 .02 .045"/></geometry>
    </collision>
  </link>
  <joint name="{side}_slide" type="prismatic"><parent link="palm"/><child link="{side}"/>
    <axis xyz="{sign} 0 0"/><limit lower="0" upper=".04" effort="10" velocity="1"/></joint>"""


@pytest.fixture
def two_fingers(tmp_path):
    sides = (("left", -0.005, -1), ("right", 0.005, 1))
    links = [FINGER.format(side=side, x=x, sign=sign) for side, x, sign in sides]
    path = tmp_path / "two.urdf"
    path.write_text(FINGERS.format("".join(links)))
    drive = {"stiffness": 1e4, "damping": 40}
    return HandFile(
        path,
        close={"left_slide": (0.04, 0), "right_slide": (0.04, 0)},
        fingers=["left", "right"],
        closing=0.4,
        options={"joints": {"left_slide": drive, "right_slide": drive}, "friction": 1.0},
    )


@pytest.mark.parametrize(("share", "held"), [(0.9, 1.0), (1.05, 0.0)])
def test_a_hand_of_a_file_holds_what_coulomb_says(two_fingers, share, held):
    mass = share * 2 * 0.5 * 10 / 9.81
    scores = score(grasps(), two_fingers, cube(mass), disturbance=STILL, rollouts=1)
    assert scores.errors == {}
    assert scores.probabilities[0] == held


def test_links_of_a_hand_of_a_file_have_the_pads_that_are_named(two_fingers):
    soft, scene = replace(two_fingers, pads={"left": em.Pad()}), em.Scene()
    soft.add_to(scene, force=1.0, opening=np.nan)
    surfaces = {body.name: body.surface for body in scene.bodies}
    assert surfaces["left"].patch_radius == em.Pad().radius
    assert surfaces["right"] is None
    assert soft.text["pads"]["left"]["load"] == 20
    assert "pads" not in two_fingers.text
    with pytest.raises(ValueError, match="pads has 'thumb', expected one of"):
        score(grasps(), replace(two_fingers, pads={"thumb": em.Pad()}), cube())


def test_a_hand_of_a_file_has_its_grasp_frame_where_a_link_is_and_closes_with_its_efforts(
    two_fingers, tmp_path
):
    text = two_fingers.path.read_text().replace(
        "</robot>",
        """<link name="tool0"/><joint name="tool" type="fixed"><parent link="palm"/>
        <child link="tool0"/><origin xyz="0 0 .05" rpy="0 0 .5"/></joint></robot>""",
    )
    (tmp_path / "tool.urdf").write_text(text)
    hand = replace(two_fingers, path=tmp_path / "tool.urdf", frame="tool0", options={})
    scene = em.Scene()
    fitted = hand.add_to(scene, force=1.0, opening=np.nan)
    half = np.cos(0.5), np.sin(0.5)
    np.testing.assert_allclose(fitted.frame[:2, :2], [[half[0], -half[1]], half[::-1]], atol=1e-12)
    np.testing.assert_allclose(fitted.frame[:3, 3], (0, 0, 0.05), atol=1e-12)
    drives = {joint.name: (joint.stiffness, joint.torque_limit) for joint in scene.joints}
    assert drives == {side: (pytest.approx(1e4), 10.0) for side in ("left_slide", "right_slide")}
    assert hand.text["frame"] == "tool0"
    assert replace(hand, frame=0.05)._frame(scene, "palm")[2, 3] == 0.05
    with pytest.raises(ValueError, match=r"frame is 'tcp', expected a link .*tool0, a name of .*"):
        replace(hand, frame="tcp").add_to(em.Scene(), force=1.0, opening=np.nan)
    (tmp_path / "tool.urdf").write_text(text.replace('effort="10"', 'effort="0"'))
    with pytest.raises(ValueError, match=r"close names 'left_slide', .*'torque_limit': 20.0"):
        replace(hand).add_to(em.Scene(), force=1.0, opening=np.nan)


def test_a_hand_of_a_file_is_another_one_once_a_mesh_of_it_has_changed(two_fingers):
    def finger(width):
        trimesh.creation.box((0.01, width, 0.04)).export(two_fingers.path.parent / "finger.obj")
        return two_fingers.text["file"]

    text = re.sub("<box [^>]*>", '<mesh filename="finger.obj"/>', two_fingers.path.read_text())
    two_fingers.path.write_text(text)
    assert finger(0.02) == finger(0.02) != finger(0.01)


def test_the_lab_s_belief_leaves_the_force_of_a_hand_of_a_file(two_fingers):
    asked = {"belief": "lab", "rollouts": 2, "disturbance": STILL, "threads": 1}
    scores = score(grasps(), two_fingers, cube(), **asked)
    assert scores.errors == {} and scores.trials.draw(0).force == 1.0
    assert scores.trials.draw(0).mass != 0.2


def test_what_a_hand_of_a_file_does_not_have_is_refused(two_fingers):
    with pytest.raises(
        ValueError, match=r"hand is 'a.urdf', .* em.grasps.HandFile\('a.urdf', close="
    ):
        score(grasps(), "a.urdf", cube())
    with pytest.raises(ValueError, match=r"joints has 'thumb', expected one of left_slide"):
        score(grasps(), replace(two_fingers, close={"thumb": (0, 1)}), cube())
    with pytest.raises(ValueError, match=r"fingers names 'pad'"):
        score(grasps(), replace(two_fingers, fingers=["pad"]), cube())
    with pytest.raises(ValueError, match=r"force is .*torque_limit"):
        score(grasps(), two_fingers, cube(), belief=GraspBelief(force=0.1), rollouts=2)


def test_an_object_of_a_urdf_is_that_of_its_link(two_fingers, tmp_path):
    path = tmp_path / "cube.urdf"
    path.write_text(
        f'''<robot name="cube"><link name="cube"><inertial><origin xyz="0 0 .01"/><mass value=".3"/>
        <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision><geometry><box size="{SIDE} {SIDE} {SIDE}"/></geometry></collision>
        <contact><lateral_friction value=".7"/></contact></link></robot>'''
    )
    thing = GraspObject.load(path)
    assert (thing.mass, thing.friction) == (0.3, 0.7)
    assert np.allclose(thing.center, (0, 0, 0.01))
    other = GraspObject.load(path, mass=0.2, friction=0.5)
    assert (other.mass, other.friction, other.inertial) == (0.2, 0.5, None)
    assert score(grasps(), GRIPPER, thing, rollouts=1, disturbance=STILL).probabilities[0] == 1
    with pytest.raises(ValueError, match="3 links that move, expected one"):
        GraspObject.load(two_fingers.path)


@pytest.mark.parametrize("com", [None, (0.01, 0.0, 0.005)])
@pytest.mark.parametrize("inertia", [None, ((2e-4, 0, 0), (0, 3e-4, 0), (0, 0, 4e-4))])
def test_what_a_file_does_not_say_of_centre_and_inertia_is_that_of_the_shape(
    tmp_path, com, inertia
):
    size = (0.04, 0.06, 0.02)
    path = written(tmp_path, trimesh.creation.box(size))
    thing = GraspObject.of(ObjectFacts(mesh=path, mass=0.3, com=com, inertia=inertia))
    x, y, z = (0.3 * side**2 / 12 for side in size)
    found = thing.inertial or em.mass_properties(thing.shape, 0.3)
    assert np.allclose(thing.center, com or (0, 0, 0), atol=1e-9)
    expected = (y + z, x + z, x + y) if inertia is None else (2e-4, 3e-4, 4e-4)
    assert np.allclose(np.sort(found.moments), np.sort(expected))


# What is refused


def test_wrong_units_frames_and_openings_are_named():
    large = GraspObject(em.Box((40, 40, 40)), 0.2)
    with pytest.raises(ValueError, match=r"object is 40 m large, .* scale=0.001"):
        score(grasps(), GRIPPER, large)
    with pytest.raises(ValueError, match=r"from the object's centre of mass .* frame or unit"):
        score(grasps(moved(x=0.9)), GRIPPER, cube())
    with pytest.raises(ValueError, match=r"opening is 0.12 m, .* a wider hand, or another unit"):
        score(grasps(openings=np.array([0.12])), GRIPPER, cube())
    with pytest.raises(ValueError, match=r"mass is 200 kg.*grams"):
        cube(200.0)
    with pytest.warns(em.PlausibilityWarning, match=r"mass is 30 kg.*grams"):
        cube(30.0)
    with pytest.warns(em.PlausibilityWarning, match="closed beside the object: are frame, unit"):
        score(grasps(moved(y=0.05)), GRIPPER, cube(), rollouts=2)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"hand": "claw"}, "hand is 'claw', expected 'panda' or 'robotiq_2f85' or "),
        ({"protocol": "jump"}, "protocol is 'jump'"),
        ({"rollouts": 0}, "rollouts is 0"),
        ({"colliding": "never"}, "colliding is 'never'"),
        ({"object": 3}, "object is 3, expected an em.grasps.GraspObject"),
        ({"grasps": np.eye(4)}, "expected an em.grasps.GraspSet"),
        ({"belief": 0.1}, "belief is 0.1"),
        ({"seed": -1}, "seed is -1"),
        ({"effort": 0}, "effort is 0"),
    ],
)
def test_what_cannot_be_is_refused(given, message):
    asked = {"grasps": grasps(), "hand": GRIPPER, "object": cube(), "protocol": "hold"} | given
    with pytest.raises(ValueError, match=message):
        score(asked.pop("grasps"), asked.pop("hand"), asked.pop("object"), **asked)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: GraspBelief(force=-1.0), "force is -1"),
        (lambda: GraspBelief(pose=[0.1] * 3), "pose is .* six"),
        (lambda: GraspBelief(pose=POSE, about="origin"), "about is 'origin'"),
        (lambda: GraspSet(np.zeros((0, 4, 4))), "^there are no grasps, expected one at least"),
        (lambda: Protocol([]), "motions is empty"),
        (lambda: Protocol([Motion("hold", 1)], gravity="up"), "gravity is 'up'"),
        (
            lambda: Protocol([Motion("hold", 1)], gravity="closed", table=True),
            "gravity is 'closed', expected 'always' with a table",
        ),
        (lambda: Motion("shake", 0.1, 0.05, frequency=2.0), "two periods, 1 s"),
        (lambda: Motion("turn", 1.0, 1.0, (0, 0, 0)), "axis is .* length"),
        (lambda: replace(GRIPPER, opening=80.0), "lengths are in metres"),
    ],
)
def test_parts_of_a_question_that_cannot_be_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


# Results


def test_a_table_ranks_the_grasps_and_says_how_each_is_lost():
    three = grasps(moved(y=0.06), moved(), moved(y=0.015), labels=np.array([0.0, 1.0, np.nan]))
    scores = score(three, GRIPPER, cube(0.2), "shake", rollouts=6, effort=50)
    table = scores.table()
    assert (table["grasp"][0], table["label"][0]) == ("1", "1")
    assert (table["grasp"][-1], table["lost"][-1]) == ("0", "6 not gripped")
    assert scores.table([2])["rank"] == ["3"]
    assert scores.efforts[1] > 0
    assert np.isnan(scores.efforts[0])
    assert scores.to_csv().count("\n") == 4
    assert (scores.best, scores.worst) == (1, 0)
    with warnings.catch_warnings():  # from above is a half turn, and meant
        warnings.simplefilter("error")
        assert scores.problem(1).plan.duration == pytest.approx(scores.horizon)
        assert scores.shown(1)[1] == ""
    with pytest.raises(ValueError, match="does not close on the object"):
        scores.problem(0)


def test_grasps_none_of_which_has_a_score_have_no_best():
    with pytest.warns(em.PlausibilityWarning, match="4 of 4 trials diverged"):
        scores = score(
            grasps(moved(), moved(z=0.01)),
            replace(GRIPPER, mass=1e-300, force=1e300),
            cube(),
            rollouts=2,
        )
    for which in ("best", "doubtful", "worst"):
        with pytest.raises(ValueError, match="none of the 2 grasps has a trial that counts"):
            getattr(scores, which)
    assert scores.ranked.tolist() == [] and np.isnan(scores.probabilities).all()
    assert "2 grasps, 2 trials" in scores.to_markdown()
    with pytest.raises(ValueError, match="scores is empty"):
        em.grasps.compare({})


# Motions


def test_motions_end_where_they_should():
    step = em.motions.STEP
    assert np.allclose(em.motions.lift(0.2, 1.0).sum(axis=0) * step, [0, 0, 0.2, 0, 0, 0])
    turned = em.motions.turn((0, 2, 0), 0.5, 1.0)
    assert np.allclose(turned.sum(axis=0) * step, [0, 0, 0, 0, 0.5, 0])
    shaken = em.motions.shake((1, 0, 0), 0.05, 2.0, 2.0)
    assert np.allclose(shaken.sum(axis=0), 0, atol=1e-9)
    assert (np.cumsum(shaken[:, 0]) * step).max() == pytest.approx(0.05, rel=0.02)
    assert not em.motions.hold(0.5).any()
    turned = em.motions.shake((0, 0, 1), 0.3, 2.0, 2.0, about=True)
    assert turned[:, 5].any()
    assert not turned[:, :5].any()


def test_axes_of_the_hand_turn_with_it():
    quarter = Motion("turn", 1.0, np.pi / 2, (1, 0, 0), "hand")
    along = Motion("lift", 1.0, 0.1, (0, 0, 1), "hand")
    rows = Protocol([quarter, along]).rows(np.eye(3), em.motions.STEP)
    assert np.allclose(rows[240:].sum(axis=0) * em.motions.STEP, [0, -0.1, 0, 0, 0, 0])


@pytest.mark.parametrize("deep", [0.0, 4e-4, 9e-4])
def test_a_hand_that_begins_a_little_in_the_table_is_lifted_out_of_it(deep):
    thing = em.grasps.GraspObject(em.Box((0.04, 0.04, 0.03)), mass=0.2)
    hand = em.grasps.ParallelGripper(opening=0.08, pad=(0.02, 0.02), force=40.0)
    down = np.diag([1.0, -1.0, -1.0, 1.0])
    down[2, 3] = -0.015 + 0.01 - deep
    found = em.grasps.score(em.grasps.GraspSet(down[None]), hand, thing, "lift", rollouts=3)
    assert found.probabilities[0] == 1.0 and found.lost_time[0] == 0.0
    grasp, draw = grasp_of(found.grasps, 0), found.trials.draw(-1)
    world = em.World(found.trials.scene(np.nan, draw, gravity=False)[0])
    start = found.trials.start(grasp, draw).state
    assert world.distance(start, "left", "table") == pytest.approx(0.0, abs=1e-9)


# What is not measured, and the way to a grasp


def test_the_lab_s_belief_is_about_the_hand_and_the_object_that_are_asked():
    heavy = {"friction": 0.6, "mass": 0.9, "force": GRIPPER.force}
    known = lab()
    draws = [known.draw(k, 0, **heavy) for k in range(400)]
    assert 0.3 <= min(one.friction for one in draws) <= max(one.friction for one in draws) <= 0.9
    assert np.std([one.mass for one in draws]) == pytest.approx(0.09, rel=0.15)
    assert np.std([one.force for one in draws]) == pytest.approx(2.0, rel=0.15)
    asked = {"hand": GRIPPER, "object": cube(0.9, 0.6), "rollouts": 40, "disturbance": STILL}
    named, given = (score(grasps(), belief=belief, **asked) for belief in ("lab", known))
    assert (named.endings == given.endings).all()
    borne = [2 * one.friction * one.force > 9.81 * one.mass for one in draws[:40]]
    assert 0.5 < np.mean(borne) < 0.9
    assert named.probabilities[0] == pytest.approx(np.mean(borne), abs=0.1)
    with pytest.raises(ValueError, match=r"belief is 'labs', expected .*lab"):
        score(grasps(), belief="labs", **asked)


@pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")
@pytest.mark.parametrize(
    ("side", "ending"),
    [(0.0, "held"), (0.018, "held"), (0.024, "collided")],
)
def test_a_hand_that_comes_down_collides_if_a_finger_lands_on_the_object(side, ending):
    # 8 cm open about 4 cm: a finger lands on the cube if the hand is more than 2 cm off.
    coming = replace(LIFT, approach=0.08)
    found = score(grasps(moved(x=side)), GRIPPER, cube(), coming, disturbance=STILL, rollouts=1)
    assert found.losses(0) == {ending: 1}


@pytest.mark.filterwarnings("ignore::energymargin.PlausibilityWarning")
def test_a_hand_that_comes_from_the_side_pushes_what_is_in_its_way():
    # The approach is along x, the fingers open along y: one of them meets the front.
    pose = np.eye(4)
    tall = GraspObject(em.Box((SIDE, SIDE, 0.16)), 0.2, 0.5)
    pose[:3, :3] = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    straight, aside = pose.copy(), pose.copy()
    aside[1, 3] = 0.025
    small = replace(GRIPPER, palm=(0.1, 0.04, 0.04))
    coming = replace(LIFT, approach=0.08)
    found = score(grasps(straight, aside), small, tall, coming, disturbance=STILL, rollouts=1)
    assert found.losses(0) == {"held": 1}
    assert found.losses(1) == {"not gripped": 1}
    there = score(grasps(aside), small, tall, "lift", disturbance=STILL, rollouts=1)
    assert there.losses(0) == {"collided": 1}


def test_an_approach_needs_a_table():
    with pytest.raises(ValueError, match=r"approach is 0.1 m, expected 0 without a table"):
        replace(HOLD, approach=0.1)
