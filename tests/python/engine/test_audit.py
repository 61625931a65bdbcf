"""The energy audit of a rollout, and its measurement on the tasks."""

import numpy as np
import pytest

import energymargin as em

WORKS = (
    *("wrench", "plan", "friction", "contacts", "joints", "damping", "drives", "overlap"),
    "integration",
)
TASKS = ("push", "balance", "topple", "grasp", "push-multi", "scoop")


def sliding_block() -> tuple[em.World, np.ndarray]:
    scene = em.Scene()
    scene.add_plane("table", friction=1.0)
    scene.add_body(
        "block", em.Box((0.2, 0.2, 0.05)), mass=2.0, position=(0, 0, 0.025), role="object"
    )
    return em.World(scene), scene.pack(block={"velocity": (1.0, 0, 0)})


def test_there_is_no_audit_unless_it_is_asked_for_and_it_changes_no_bit():
    world, state = sliding_block()
    plain = world.rollout(state, (1, 2, 0, 0, 0, 0.01), 0.3)
    audited = world.rollout(state, (1, 2, 0, 0, 0, 0.01), 0.3, audit=True)
    assert plain.audit is None
    assert audited.audit is not None
    assert plain.state.tobytes() == audited.state.tobytes()
    assert (plain.effort, plain.work, plain.energy) == (
        audited.effort,
        audited.work,
        audited.energy,
    )


def test_the_entries_add_up_and_are_those_of_the_rollout():
    world, state = sliding_block()
    rollout = world.rollout(state, (1, 2, 0, 0, 0, 0.01), 0.3, audit=True)
    audit = rollout.audit
    assert audit.energy_change == rollout.energy - world.energy(state)
    assert audit.wrench == rollout.work
    works = [getattr(audit, name) for name in WORKS]
    assert sum(works) + audit.leftover == pytest.approx(audit.energy_change, abs=1e-14)
    assert audit.turnover == pytest.approx(abs(audit.energy_change) + np.abs(works).sum())
    assert audit.friction < -0.5


def test_the_repr_is_the_balance_as_a_table():
    world, state = sliding_block()
    audit = world.rollout(state, np.zeros(6), 1.0, audit=True).audit
    rows = [line.split() for line in repr(audit).splitlines()]
    assert [row[0] for row in rows] == [*WORKS, "leftover", "energy_change"]
    for name, value, unit in rows:
        assert float(value) == pytest.approx(getattr(audit, name), rel=1e-6)
        assert unit == "J"


# Bounds of docs/engineering/energy_audit.md.
@pytest.mark.parametrize("task", TASKS)
def test_little_is_left_over_on_the_tasks(task: str) -> None:
    """Of random wrenches within the bounds, on random recorded states."""
    random = np.random.default_rng(0)
    recorded = em.datasets.generate(task, trajectories=2, seed=0).problems()
    shares = []
    for problem in (recorded[i] for i in random.integers(len(recorded), size=20)):
        most = np.concatenate([problem.force, problem.torque])
        objects = sum(body.role == "object" for body in problem.scene.bodies)
        wrench = random.uniform(-most, most, (objects, 6) if objects > 1 else (6,))
        rollout = em.World(problem.scene).rollout(
            problem.state, wrench, problem.duration, audit=True
        )
        assert rollout.audit.turnover > 0.0
        shares.append(abs(rollout.audit.leftover) / rollout.audit.turnover)
    assert np.median(shares) < 0.002
    assert max(shares) < 0.03


def robot_and_box() -> em.Scene:
    """A box on a floor; a hand that floats and turns a finger."""
    scene = em.Scene()
    scene.add_body("floor", em.Box((5, 5, 0.1)), mass=0, position=(0, 0, -0.05))
    scene.add_body("object", em.Box((0.1,) * 3), mass=1, position=(0, 0, 0.05), role="object")
    scene.add_body("hand", em.Box((0.1,) * 3), mass=1, position=(-0.3, 0, 0.2), force=(0, 0, 9.81))
    scene.add_body("finger", em.Box((0.2, 0.02, 0.02)), mass=0.2, position=(-0.15, 0, 0.2))
    scene.add_joint(
        *("hinge",),
        parent="hand",
        child="finger",
        origin=(0.05, 0, 0),
        child_origin=(-0.1, 0, 0),
        axis=(0, 1, 0),
        stiffness=2.0,
        damping=0.05,
        torque_limit=5.0,
        target=0.0,
    )
    return scene


PLANS = {
    "servo": {"velocities": {"hand": np.tile([0.2, 0, 0, 0, 0, 0.1], (60, 1))}},
    "targets": {"targets": {"hinge": np.linspace(0, 0.8, 60)}},
    "wrenches": {"wrenches": {"hand": np.tile([2.0, 0, 1.0, 0, 0, 0.01], (60, 1))}},
    "wrench on a link": {"wrenches": {"finger": np.tile([1.0, 0, 0.5, 0, 0, 0], (60, 1))}},
}


@pytest.mark.parametrize("what", PLANS)
def test_the_work_of_a_plan_closes_the_balance(what: str) -> None:
    scene = robot_and_box()
    rests = em.World(scene).rollout(scene.pack(), np.zeros(6), 0.25, audit=True).audit
    world = em.World(scene, em.Plan(step=1 / 240, **PLANS[what]))
    plain = world.rollout(scene.pack(), (0.5, 0, 0, 0, 0, 0), 0.25)
    audited = world.rollout(scene.pack(), (0.5, 0, 0, 0, 0, 0), 0.25, audit=True)
    assert rests.plan == 0
    assert plain.state.tobytes() == audited.state.tobytes()
    audit = audited.audit
    assert abs(audit.plan) > 0.01
    # links swing on arcs and are moved along chords: the balance is no exact one
    assert abs(audit.leftover) < 0.02 * audit.turnover
    assert abs(audit.leftover) < 0.05 * abs(audit.plan)
    assert audit.joints == pytest.approx(0, abs=1e-9)


def test_an_audit_goes_on_in_the_plan_where_the_time_is() -> None:
    scene = robot_and_box()
    rows = np.linspace(0, 0.4, 60)[:, None] * np.eye(6)[0]
    world = em.World(scene, em.Plan(step=1 / 240, velocities={"hand": rows}))
    plain = world.rollout(scene.pack(), np.zeros(6), 0.1, time=0.125)
    audited = world.rollout(scene.pack(), np.zeros(6), 0.1, time=0.125, audit=True)
    assert plain.state.tobytes() == audited.state.tobytes()
    early = world.rollout(scene.pack(), np.zeros(6), 0.1, audit=True)
    assert audited.audit.plan > 1.5 * early.audit.plan > 0


def test_the_work_of_a_plan_on_free_bodies_closes_it_to_the_last_digits() -> None:
    scene = em.Scene(gravity=(0, 0, 0))
    scene.add_body("object", em.Sphere(0.05), mass=1, role="object")
    scene.add_body("tool", em.Sphere(0.05), mass=0.5, position=(-0.2, 0, 0))
    rows = np.tile([0.5, 0, 0, 0, 0, 0], (120, 1))
    world = em.World(scene, em.Plan(step=1 / 240, velocities={"tool": rows}))
    audit = world.rollout(scene.pack(), np.zeros(6), 0.5, audit=True).audit
    assert audit.plan > 0.06  # of a tool of 0.5 kg at 0.5 m/s
    assert abs(audit.leftover) < 1e-12
