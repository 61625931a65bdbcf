import os
import pickle
import signal
from copy import copy

import known_losses
import numpy as np
import pytest
from mujoco_wells import MujocoWell

import energymargin as em

mujoco = pytest.importorskip("mujoco")

REAL = os.environ.get("ENERGYMARGIN_REAL", "")
CUP = """
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <geom name="table" type="plane" size="1 1 0.1" friction="0.4 0.005 0.0001"/>
    <body name="cup" pos="0 0 0.0499">
      <freejoint/>
      <geom type="cylinder" size="0.03 0.05" mass="0.3" pos="0 0 0.01"/>
    </body>
    <body name="pusher" pos="-0.08 0 0.05">
      <joint name="way" type="slide" axis="1 0 0" damping="5"/>
      <geom type="box" size="0.02 0.04 0.04" mass="0.5"/>
    </body>
  </worldbody>
  <actuator><position name="way" joint="way" kp="200"/></actuator>
</mujoco>
"""
SOFT = """
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <body name="ball" pos="0 0 0.3"><freejoint/><geom type="sphere" size="0.03" mass="0.1"/></body>
    <flexcomp name="cloth" type="grid" dim="2" count="5 5 1" spacing="0.05 0.05 0.05" mass="0.1"
              radius="0.005" pos="0 0 0.2"><edge equality="true"/><pin id="0 4 20 24"/></flexcomp>
  </worldbody>
</mujoco>
"""


def model_of(xml):
    return mujoco.MjModel.from_xml_string(xml)


def cup(**question):
    inside = em.regions.Ball("cup", center=(0, 0, 0.05), radius=0.02)
    defaults = {"force": (3, 3, 0), "duration": 0.2, "horizon": 0.5, "check": 0.02}
    return em.mujoco.problem(
        model_of(CUP), objects="cup", effector="pusher", captured=inside, **{**defaults, **question}
    )


def test_engine_keeps_the_contract():
    problem = cup(torque=(0.05, 0.05, 0.05))
    em.engines.check(problem.scene.engine, problem)


def test_a_problem_is_made_from_a_model_in_one_line():
    asked = {"objects": "cup", "captured": em.regions.Ball("cup", (0, 0, 0.05), 0.02)}
    asked |= {"force": (3, 3, 0), "horizon": 0.2}
    model = model_of(CUP)
    problem = em.Problem.from_mujoco(model, mujoco.MjData(model), **asked)
    other = em.mujoco.problem(model, **asked)
    assert isinstance(problem, em.Problem) and isinstance(problem.scene.engine, em.mujoco.Engine)
    one, two = (em.capture_probability(p, rollouts=8).exit_times for p in (problem, other))
    np.testing.assert_array_equal(one, two)
    with pytest.raises(ValueError, match=r"model is 'cup\.xml', expected a mujoco\.MjModel"):
        em.Problem.from_mujoco("cup.xml", **asked)
    with pytest.raises(TypeError, match="captured"):
        em.Problem.from_mujoco(model, objects="cup", force=(3, 3, 0))


def test_rollouts_are_those_of_a_plain_loop_to_the_last_digit():
    problem = cup()
    model = problem.scene.engine.model
    wrench = np.array([1.0, -0.5, 0.2, 0.01, 0.0, 0.02])
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for _ in range(150):
        data.xfrc_applied[1] = wrench
        mujoco.mj_step(model, data)
    rollout = em.World(problem.scene).rollout(problem.state, wrench, 0.3)
    np.testing.assert_array_equal(rollout.state[:3], data.qpos[:3])
    np.testing.assert_array_equal(rollout.state[7:10], data.qvel[:3])
    at = problem.scene.joint_slice("way")
    np.testing.assert_array_equal(rollout.state[at], [data.qpos[7], data.qvel[6]])


def test_losses_are_those_of_a_plain_loop_whatever_the_threads():
    problem = cup()
    draws = np.random.default_rng(0).uniform(-2, 2, (12, 250, 2)).round(1)
    draws = np.repeat(draws[:, ::50], 50, axis=1)

    def push(random, times):
        wrench = np.zeros((250, 6))
        wrench[:, :2] = draws[int(random.integers(12))]
        return wrench

    model, exits = problem.scene.engine.model, []
    chosen = []

    def remembered(random, times):
        wrench = push(random, times)
        chosen.append(wrench)
        return wrench

    p = em.capture_probability(problem, disturbance=remembered, rollouts=20, seed=5)
    for wrench in chosen[:20]:
        data = mujoco.MjData(model)
        exit_time = np.inf
        for step in range(250):
            data.xfrc_applied[1] = wrench[step]
            mujoco.mj_step(model, data)
            outside = np.linalg.norm(data.qpos[:3] - [0, 0, 0.05]) > 0.02
            if (step + 1) % 10 == 0 and outside:
                exit_time = (step + 1) * 0.002
                break
        exits.append(exit_time)
    np.testing.assert_allclose(p.exit_times, exits)
    assert 0 < np.isfinite(exits).sum() < 20


def test_effort_is_the_work_of_a_plain_loop():
    problem = cup()
    model, data = problem.scene.engine.model, None
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    effort, work = 0.0, 0.0
    for _ in range(100):
        before = _speed(model, data)
        data.xfrc_applied[1] = [2, 0, 0, 0, 0.02, 0]
        mujoco.mj_step(model, data)
        power = np.array([2, 0, 0, 0, 0.02, 0]) @ (before + _speed(model, data)) / 2
        effort, work = effort + abs(power) * 0.002, work + power * 0.002
    rollout = em.World(problem.scene).rollout(problem.state, [2, 0, 0, 0, 0.02, 0], 0.2)
    assert rollout.effort == pytest.approx(effort, rel=1e-9)
    assert rollout.work == pytest.approx(work, rel=1e-9)


def _speed(model, data):
    now = copy(data)
    mujoco.mj_forward(model, now)
    twist = np.empty(6)
    mujoco.mj_objectVelocity(model, now, mujoco.mjtObj.mjOBJ_BODY, 1, twist, 0)
    return np.roll(twist, 3)


def test_plan_and_policy_set_the_controls():
    plan = em.Plan(step=0.25, targets={"way": [0.0, 0.06]})
    problem = cup(plan=plan, force=(1e-6, 0, 0), horizon=0.5)
    model = problem.scene.engine.model
    data = mujoco.MjData(model)
    for step in range(250):
        data.ctrl[0] = 0.0 if step < 125 else 0.06
        mujoco.mj_step(model, data)
    run = em.World(problem.scene, plan).simulate(problem.state, 250, record=[250])
    np.testing.assert_array_equal(run.states[0][:3], data.qpos[:3])

    def act(seen, memory, time):
        return np.full((len(seen), 1), 0.0 if time < 0.245 else 0.06)

    policy = em.Policy(act, period=0.05, command=["way"])
    run = em.World(problem.scene, policy).simulate(problem.state, 250, record=[250])
    np.testing.assert_array_equal(run.states[0][:3], data.qpos[:3])
    p = em.capture_probability(problem.replace(plan=policy), rollouts=40)
    assert p.captured == 0.0


PUSHED = """<mujoco><worldbody><geom type="plane" size="1 1 .1"/>
<body name="box" pos="0 0 .05"><freejoint/><geom type="box" size=".05 .05 .05" mass=".5"/></body>
<body name="pusher" pos="-.08 0 .03"><freejoint/><geom type="sphere" size=".03" mass="1"/></body>
</worldbody></mujoco>"""


def test_a_plan_pushes_bodies_of_the_robot_by_forces():
    model = model_of(PUSHED)
    engine = em.mujoco.Engine(model, objects="box", effector="pusher")
    assert engine.commands["pusher.fx"] == 0.0
    forces = np.linspace(5.0, 9.0, 100)
    plan = em.Plan(engine.step, targets={"pusher.fx": forces, "pusher.tz": 0.01 * forces})
    inside = em.regions.Ball("box", (0, 0, 0.05), 1.0)
    asked = {"captured": inside, "force": (0, 0, 0), "horizon": 100 * engine.step, "plan": plan}
    problem = em.engines.problem(engine, **asked)
    end = em.World(problem.scene, plan).simulate(problem.state, 100).states[-1]
    data = mujoco.MjData(model)
    for force in forces:
        data.xfrc_applied[2, [0, 5]] = force, 0.01 * force
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(end, em.mujoco.state(engine.scene, model, data), rtol=1e-12)
    assert data.body("box").xpos[0] > 0.002


def test_effort_and_score_are_found_in_mujoco():
    found = em.escape_effort(cup(), nodes=300, threads=2)
    # Friction 0.4 of 0.3 kg over 2 cm takes 24 mJ, and more until it is out at a check.
    assert 0.02 < found.effort < 0.06


def test_rare_loss_takes_a_twentieth_of_the_steps_of_counting():
    well = MujocoWell(known_losses.STRONG, 0.03)
    rare = em.capture_probability(
        well.problem, disturbance=well.disturbance, rare=True, rollouts=1000, seed=2
    )
    loss = well.loss()
    assert 2e-5 < loss < 1e-4
    low, high = rare.interval(0.95, "lost")
    assert low < loss < high
    width = (high - low) / loss
    counting = 16 / loss / width**2 * 120  # steps of as many rollouts as make it as narrow
    assert rare.steps < counting / 20


def test_model_that_no_scene_expresses_is_simulated():
    problem = em.mujoco.problem(
        model_of(SOFT),
        objects="ball",
        captured=em.regions.HalfSpace("ball", normal=(0, 0, -1), offset=-0.1),
        force=(0.2, 0.2, 0),
        horizon=0.5,
        check=0.02,
    )
    assert [body.name for body in problem.scene.bodies] == ["ball"]
    em.engines.check(problem.scene.engine, problem)
    assert 0.0 <= em.capture_probability(problem, rollouts=20).captured <= 1.0


def test_engine_goes_to_another_process():
    problem = cup()
    again = pickle.loads(pickle.dumps(problem))
    assert again.scene.engine.digest() == problem.scene.engine.digest()
    one, other = (em.capture_probability(p, rollouts=10) for p in (problem, again))
    np.testing.assert_array_equal(one.exit_times, other.exit_times)


def test_simulation_that_diverges_is_counted():
    problem = cup(force=(1e9, 1e9, 0))
    with pytest.raises(RuntimeError, match="10 of 10 rollouts diverged"):
        em.capture_probability(problem, rollouts=10)


def test_engines_are_compared_on_the_same_draws():
    scene = em.Scene(step=0.002)
    scene.add_body("table", em.Box((2, 2, 0.1)), mass=0.0, position=(0, 0, -0.05))
    scene.add_body("box", em.Box((0.1, 0.1, 0.1)), mass=0.5, position=(0, 0, 0.05), role="object")
    inside = em.regions.Ball("box", center=(0, 0, 0.05), radius=0.03)
    problem = em.Problem(
        scene,
        scene.pack(),
        captured=inside,
        force=(6, 6, 0),
        torque=(0, 0, 0),
        duration=0.2,
        horizon=0.6,
        check=0.02,
    )
    engine = em.mujoco.Engine(em.mujoco.model_of(scene), scene=scene)
    comparison = em.compare_engines(problem, ["native", "bullet", engine], rollouts=60)
    assert comparison.exit_times.shape == (3, 60)
    assert (comparison.agreement > 0.8).all()
    assert comparison.distances.max() < 1e-3
    assert "| mujoco |" in str(comparison) == em.summary.summary(comparison).to_markdown()
    assert ">mujoco</td>" in comparison._repr_html_()
    pytest.importorskip("matplotlib")
    above, below = em.plots.figure_engines(comparison).axes
    assert len(below.lines) == 3
    assert above.get_ylim()[1] > 1


def test_data_of_another_model_are_refused_wherever_they_are_taken():
    scene, other = cup().scene, mujoco.MjData(model_of(SOFT))
    model = scene.engine.model
    takers = (
        lambda data: em.mujoco.Engine(model, data, objects="cup"),
        lambda data: em.mujoco.doctor(model, data),
        lambda data: em.mujoco.state(scene, model, data),
        lambda data: em.mujoco.set_state(model, data, scene, scene.pack()),
    )
    for take in takers:
        with pytest.raises(ValueError, match=r"data is of a model with nq = \d+, expected"):
            take(other)
        with pytest.raises(ValueError, match=r"data is 3, expected a mujoco\.MjData"):
            take(3)
    with pytest.raises(ValueError, match=r"model is 'x\.xml', expected a mujoco\.MjModel"):
        em.mujoco.doctor("x.xml")


def test_engines_of_another_scene_are_not_compared():
    other = em.mujoco.Engine(model_of(CUP.replace('"cup"', '"mug"')), objects="mug")
    with pytest.raises(ValueError, match="of another scene: 'cup' is not in both"):
        em.compare_engines(cup(), ["native", other], rollouts=4)


TRAY = """<mujoco><option timestep="0.004"/><worldbody><body name="tray" pos="0 0 .3">
<joint name="x" type="slide" axis="1 0 0" damping="20"/>
<joint name="tilt" axis="0 1 0" damping="2"/>
<geom type="box" size=".15 .15 .01" mass="2"/></body>
<body name="mug" pos="0 0 .3598"><freejoint/><geom type="cylinder" size=".03 .05" mass=".3"/></body>
</worldbody><actuator><position name="x" joint="x" kp="400"/>
<position name="tilt" joint="tilt" kp="300"/></actuator></mujoco>"""


def tray(**question):
    inside = em.regions.Ball("mug", (0, 0, 0.06), 0.03, frame="tray")
    asked = {"captured": inside, "force": (1.2, 1.2, 0.3), "horizon": 0.4, "check": 0.02}
    bodies = {"objects": "mug", "effector": "tray"}
    return em.Problem.from_mujoco(model_of(TRAY), **bodies, **{**asked, **question})


def test_an_effector_on_several_joints_goes_to_another_process():
    engine = tray().scene.engine
    again = pickle.loads(pickle.dumps(engine))
    assert again.digest() == engine.digest()
    assert [body.role for body in again.scene.bodies] == [b.role for b in engine.scene.bodies]


def test_what_placements_need_of_an_engine_is_said_before_they_are_asked():
    scene = tray().scene
    with pytest.raises(ValueError, match="pushed is 3 with the engine 'mujoco'"):
        em.placements(scene, "mug", on=["tray"], pushed=3)
    for asked in (em.settle, em.stack_robustness):
        with pytest.raises(ValueError, match=f"{asked.__name__} is asked with the engine 'mujoco'"):
            asked(scene)
    found = em.placements(scene, "mug", on=["tray"], spacing=0.2, pushed=0, rollouts=4)
    assert found.complete and len(found.poses)


class Interrupted(em.mujoco.Engine):
    """Ctrl-C comes in its third piece."""

    pieces = 0

    def _control(self, *piece):
        self.pieces += 1
        if self.pieces == 3:
            os.kill(os.getpid(), signal.SIGINT)
        return super()._control(*piece)


@pytest.mark.parametrize("threads", [1, 2])
def test_an_interrupt_ends_a_long_batch_between_two_pieces_of_it(threads):
    engine = Interrupted(model_of(CUP), objects="cup", threads=threads)
    rows, pieces = 4, 200
    steps = 500 * pieces
    state, memory = (np.tile(row, (rows, 1)) for row in (engine.state, engine.home))
    pushes = np.broadcast_to(np.zeros(6), (rows, steps, 1, 6))
    with pytest.raises(KeyboardInterrupt):
        engine.play(em.engines.Batch(state, memory, pushes, {}, steps, steps))
    assert engine.pieces < rows * pieces
    again, _, _ = engine.play(em.engines.Batch(state, memory, pushes[:, :20], {}, 20, 20))
    assert np.isfinite(again).all()


def test_engine_with_a_scene_of_its_own_goes_to_processes():
    scene = em.Scene(step=0.002)
    scene.add_plane("table", friction=0.4)
    box = {"mass": 0.5, "position": (0, 0, 0.05), "role": "object"}
    scene.add_body("box", em.Box((0.1, 0.1, 0.1)), **box)
    engine = em.mujoco.Engine(em.mujoco.model_of(scene), scene=scene)
    again = pickle.loads(pickle.dumps(engine))
    assert again.digest() == engine.digest()
    np.testing.assert_array_equal(again.state, engine.state)
    inside = em.regions.Ball("box", center=(0, 0, 0.05), radius=0.01)
    asked = {"captured": inside, "horizon": 0.2, "check": 0.02}
    starts = [engine.state + 0.005 * k * np.eye(13)[0] for k in (0, 1)]
    problem = em.engines.problem(engine, **asked, force=(6, 6, 0))
    problems = [problem.with_state(state) for state in starts]
    given = {"rollouts": 16, "race": False}
    there = em.rank(problems, executor=em.executors.Processes(2), **given)
    assert there.to_csv() == em.rank(problems, threads=1, **given).to_csv()


SLIDING = """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1" friction=".1"/>
<body name="cup" pos="0 0 .05"><freejoint/>
<geom type="box" size=".04 .04 .05" mass=".3" friction=".5"/></body>
<body name="hammer" pos="-.5 0 .5"><joint name="way" type="slide" axis="1 0 0"/>
<geom type="box" size=".02 .02 .02" mass=".2"/></body></worldbody>
<actuator><position name="way" joint="way" kp="80"/></actuator></mujoco>"""


def slides(**question):
    """A cup on a floor; a force of 1 N slides it from a friction of 0.34 on down."""
    place = em.regions.Ball("cup", (0, 0, 0.05), 0.02)
    asked = {"force": (2, 2, 0), "torque": (0, 0, 0), "duration": 0.2, "horizon": 0.5}
    return em.mujoco.problem(model_of(SLIDING), objects="cup", captured=place, **asked, **question)


def test_how_much_it_can_take_is_asked_in_mujoco_and_what_cannot_be_varied_there_is_named():
    found = em.critical_values(slides(), {"push": (0, 20)}, draws=80)
    assert found[0].side == "below" and "engine mujoco" in found.question
    with pytest.raises(ValueError, match=r"vary is 'colour\.BODY'"):
        em.critical_values(slides(), {"colour.cup": (0.05, 1.0)}, draws=80)
    for name in ("friction.cup,world", "friction.table", "force.way"):  # which the scene may have
        with pytest.raises(ValueError, match=f"'mujoco' does not vary '{name}', but friction"):
            em.critical_values(slides(), {name: (0.05, 1.0)})


def test_an_object_that_no_joint_moves_is_refused():
    """No push moves it, so it would be held for sure."""
    xml = '<mujoco><worldbody><body name="cup" {}><geom size=".1"/></body></worldbody></mujoco>'
    for text in (xml.format(""), xml.format('mocap="true"')):
        with pytest.raises(ValueError, match="objects has 'cup', which no joint lets move"):
            em.mujoco.Engine(model_of(text), objects="cup")


def test_friction_and_mass_are_varied_in_mujoco_and_the_rest_stays():
    """The friction that holds against 1 N: a = F / m - mu g moves it by 2 cm in half a second."""
    engine = slides().scene.engine
    assert engine.varies["friction.cup"] == 0.5 and engine.varies["gain.way"] == 80.0
    heavy = engine.varied({"mass.cup": 0.6, "gain.way": 40.0})
    assert heavy.model.body("cup").mass[0] == 0.6 and engine.model.body("cup").mass[0] == 0.3
    assert heavy.model.actuator_biasprm[0, 1] == -40.0 and heavy.digest() != engine.digest()

    def push(random, times):
        return np.tile([1.0, 0, 0, 0, 0, 0], (len(times), 1))

    asked = {"friction.cup": (0.1, 1.0), "mass.cup": (0.05, 2.0)}
    friction, mass = em.critical_values(slides(), asked, disturbance=push, draws=40)
    way = 2 * 0.02 / 0.5**2
    assert friction.side == "above"
    assert friction.value == pytest.approx((1.0 / 0.3 - way) / 9.81, rel=0.05)
    assert mass.side == "above" and mass.value == pytest.approx(1.0 / (0.5 * 9.81 + way), rel=0.05)


def test_what_is_varied_takes_the_same_commands_and_has_the_same_roles():
    engine = cup().scene.engine
    varied = engine.varied({"mass.cup": 0.5})
    assert varied.commands == engine.commands and "pusher.fx" in varied.commands
    assert pickle.loads(pickle.dumps(varied)).commands == engine.commands


def test_a_pair_without_friction_has_no_ratio_to_keep():
    body = '<geom name="t" type="plane" size="1 1 .1"/><body name="cup" pos="0 0 .05"><freejoint/>'
    geom = '<geom name="g" type="box" size=".05 .05 .05" friction="0 .005 .0001"/></body>'
    pair = '<contact><pair geom1="g" geom2="t" friction="0 0 .005 .0001 .0001"/></contact>'
    model = model_of(f"<mujoco><worldbody>{body}{geom}</worldbody>{pair}</mujoco>")
    with pytest.raises(ValueError, match=r"friction\.cup is 0 in the model, and its contact pairs"):
        em.mujoco.Engine(model, objects="cup").varied({"friction.cup": 0.5})


def test_a_belief_over_what_mujoco_varies_is_that_of_the_closed_form():
    """Half of the frictions about the critical one hold."""

    def push(random, times):
        return np.tile([1.0, 0, 0, 0, 0, 0], (len(times), 1))

    critical = (1.0 / 0.3 - 2 * 0.02 / 0.5**2) / 9.81
    at = slides().scene.engine.varied({"friction.cup": critical})
    problem = slides().with_engine(at)
    known = em.beliefs.Uncertainty(friction={"cup": 0.05}, engine={"gain.way": 5.0})
    assert em.beliefs.Uncertainty.from_json(known.to_json()) == known
    belief = em.beliefs.Belief(problem, uncertainty=known)
    assert [source.name for source in belief.sources] == [
        "friction.cup of the engine",
        "gain.way of the engine",
    ]
    given = {"disturbance": push, "rollouts": 60, "race": False}
    (held,) = em.rank([problem], uncertainty=known, **given)
    assert 0.3 < held.score < 0.7
    with pytest.raises(ValueError, match=r"does not vary 'damping\.way'"):
        em.beliefs.Belief(problem, uncertainty=em.beliefs.Uncertainty(engine={"damping.way": 1.0}))
    with pytest.raises(ValueError, match=r"engine is .*, which the engine 'native' does not vary"):
        known.sources(em.Scene())


@pytest.mark.skipif(not REAL, reason="ENERGYMARGIN_REAL is not set")
def test_a_bowl_of_libero_is_asked_in_mujoco():
    """How robust is this state? 15 lines."""
    model = mujoco.MjModel.from_xml_path(f"{REAL}/libero_bowl/bowl_on_ramekin.xml")
    data = mujoco.MjData(model)
    data.joint("ramekin").qpos[2] = 0.902
    data.joint("bowl").qpos[:3] = np.add(data.joint("ramekin").qpos[:3], [0, 0, 0.034])
    mujoco.mj_step(model, data, 1000)
    assert data.body("bowl").xpos[2] - data.body("ramekin").xpos[2] == pytest.approx(
        0.0316, abs=1e-3
    )
    seat = em.regions.Ball("bowl", (0, 0, 0.0316), 0.02, frame="ramekin")
    problem = em.mujoco.problem(
        model,
        data,
        objects="bowl",
        effector="ramekin",
        captured=seat,
        force=(0.1, 0.1, 0),
        horizon=0.3,
        check=0.02,
    )
    assert em.capture_probability(problem, rollouts=20).captured == 1.0
    (push,) = em.critical_values(problem, {"push": (0.1, 10)}, draws=20, probability=0.5)
    assert push.side == "below" and 0.2 < push.value < 10


CARRIED = """<mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody>
<body name="hand" mocap="true" pos=".3 .2 .3"><geom type="sphere" size=".02" contype="0"/>
<body name="drawer" pos=".1 0 0"><joint name="way" type="slide" axis="1 0 0"/>
<geom type="box" size=".05 .05 .05" mass=".5"/>
<body name="flap" pos=".1 0 0"><joint name="flap" axis="0 0 1"/>
<geom type="box" pos=".05 0 0" size=".05 .02 .05" mass=".1"/></body></body></body>
<body name="ball" pos="1 0 .5"><freejoint/>
<geom type="box" pos=".02 0 0" size=".05 .04 .03" mass=".5"/></body>
<body name="post" pos="2 0 .5" euler="0 30 20">
<body name="arm" pos="0 .1 0" euler="10 0 0"><joint pos=".1 .02 0" axis="0 .6 .8" ref=".3"/>
<joint type="slide" axis="1 .2 0" ref=".1"/><joint pos="0 .05 .1" axis="1 0 0"/>
<geom type="box" pos=".02 .01 0" size=".05 .04 .03" mass=".5"/>
<body name="tip" pos=".1 0 .1" quat=".9 .1 .2 .3"><joint type="ball" pos=".01 .02 .03"/>
<geom type="box" pos="0 .03 .01" size=".05 .02 .03" mass=".2"/></body></body></body>
</worldbody></mujoco>"""


@pytest.mark.parametrize("body", ["drawer", "flap", "ball", "arm", "tip"])
def test_works_and_states_are_those_of_a_plain_loop_whatever_carries_the_body(body):
    """A hand that is turned by 90 degrees carries a drawer with a flap; a post has a chain of all
    joints."""
    model = model_of(CARRIED)
    data = mujoco.MjData(model)
    data.mocap_quat[0] = np.sqrt([0.5, 0, 0, 0.5])
    mujoco.mj_forward(model, data)
    engine = em.mujoco.Engine(model, data, objects=body, effector="hand")
    push = np.array([0.3, 1.0, -0.2, 0.01, 0.02, 0.05])
    pushes = np.tile(push, (1, 50, 1, 1))
    rows = engine.state[None], engine.home[None], pushes
    states, _, work = engine.play(em.engines.Batch(*rows, {}, 50, 50))
    here, number, done = np.empty(6), model.body(body).id, []
    for _ in range(51):
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, number, here, 0)
        done.append(push @ np.roll(here, 3))
        state = em.mujoco.state(engine.scene, model, data)
        data.xfrc_applied[number] = push
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(states[0, -1], state, rtol=1e-12, atol=1e-13)
    mean = 0.002 * (np.array(done[1:]) + done[:-1]) / 2
    np.testing.assert_allclose(work[0, :, 0], mean, rtol=1e-12, atol=1e-15)
    assert abs(mean).max() > 1e-5
