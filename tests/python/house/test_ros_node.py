"""The answers of examples/06_ros_node.py, asked with ROS 2's own messages (of rosbags)."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

import energymargin as em

rosbags = pytest.importorskip("rosbags.typesys")
TYPES = rosbags.get_typestore(rosbags.Stores.ROS2_HUMBLE).types
NODE = Path(__file__).parents[3] / "examples" / "06_ros_node.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("ros_node", NODE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def answers(example):
    """A tool pushes a box on a table; a bar is what is gripped."""
    scene = em.Scene()
    scene.add_plane("table", friction=0.5)
    box = {"shape": em.Box((0.1, 0.06, 0.04)), "mass": 0.2, "position": (0, 0, 0.02)}
    scene.add_body("object", role="object", **box)
    scene.add_body(
        "effector", em.Cylinder(0.01, 0.04), mass=0.5, position=(0, -0.042, 0.02), role="effector"
    )
    near = em.regions.Ball("object", center=(0, 0.04, 0), radius=0.05, frame="effector")
    bounds = {"force": (0.5, 0.5, 0), "torque": (0, 0, 0.01), "duration": 0.2}
    problem = em.Problem(scene, scene.pack(), captured=near, horizon=0.25, **bounds)
    bar = em.grasps.GraspObject(em.Box((0.04, 0.18, 0.03)), mass=0.4, friction=0.7)
    hand = em.grasps.ParallelGripper(opening=0.08, pad=(0.02, 0.02), force=6)
    return example.Robustness(problem, hand, bar, rollouts=6)


def message(name, **fields):
    return TYPES[name](**fields)


def pose(x, y, z, turn=(0.0, 0.0, 0.0, 1.0)):
    point = message("geometry_msgs/msg/Point", x=x, y=y, z=z)
    names = dict(zip("xyzw", turn, strict=True))
    quaternion = message("geometry_msgs/msg/Quaternion", **names)
    return message("geometry_msgs/msg/Pose", position=point, orientation=quaternion)


def header():
    stamp = message("builtin_interfaces/msg/Time", sec=0, nanosec=0)
    return message("std_msgs/msg/Header", stamp=stamp, frame_id="world")


def poses(*places):
    return message("geometry_msgs/msg/PoseArray", header=header(), poses=list(places))


def odometry(place, velocity):
    vectors = [
        message("geometry_msgs/msg/Vector3", **dict(zip("xyz", v, strict=True)))
        for v in (velocity, (0.0, 0.0, 0.0))
    ]
    twist = message("geometry_msgs/msg/Twist", linear=vectors[0], angular=vectors[1])
    covariance = np.zeros(36)
    return message(
        "nav_msgs/msg/Odometry",
        header=header(),
        child_frame_id="body",
        pose=message("geometry_msgs/msg/PoseWithCovariance", pose=place, covariance=covariance),
        twist=message("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=covariance),
    )


def test_the_monitor_is_asked_about_the_newest_poses(answers):
    assert answers.state() is None
    answers.keep("object", odometry(pose(0.1, 0.2, 0.02), (0.0, 0.0, 0.0)))
    assert answers.state() is None
    answers.keep("effector", odometry(pose(0.1, 0.158, 0.02), (0.0, 0.1, 0.0)))
    state = answers.problem.scene.unpack(answers.state())
    assert state["object"]["position"] == pytest.approx((0.1, 0.2, 0.02))
    assert state["effector"]["velocity"] == pytest.approx((0.0, 0.1, 0.0))
    asked = answers.question(answers.state(), 0.0)
    assert asked.plan is not None and asked.plan.duration >= asked.horizon
    with em.Monitor(answers.question, rollouts=8) as monitor:
        monitor.push(0.0, answers.state())
        assert monitor.wait(120.0) and 0.0 <= monitor.latest.value <= 1.0


def test_each_grasp_has_its_quality_and_the_middle_holds_better_than_the_end(answers):
    down = (1.0, 0.0, 0.0, 0.0)
    middle, end = answers.grasps(poses(pose(0.0, 0.0, 0.01, down), pose(0.0, 0.09, 0.01, down)))
    assert middle == 1.0 > end


def test_each_place_has_its_quality_and_the_air_has_none(answers):
    table, air = answers.places(poses(pose(0.3, 0.0, 0.02), pose(0.3, 0.0, 0.3)))
    assert table > 0.5 > air == 0.0
