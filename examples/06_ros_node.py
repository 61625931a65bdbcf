"""A node of ROS 2: how likely the object stays captured, 30 times a second, with an alarm; and the
quality of grasps and of places that a planner asks about.

| topic | message | |
| --- | --- | --- |
| /object/odom, /effector/odom | nav_msgs/Odometry | in: where both are and how they move |
| ~/grasps, ~/places | geometry_msgs/PoseArray | in: of the hand on the object; of the object |
| ~/capture_probability, ~/alarm | std_msgs/Float64, Bool | out, of the newest state |
| ~/grasp_quality, ~/place_quality | std_msgs/Float64MultiArray | out: a probability for each pose |

`Robustness` knows no ROS: the tests run it with messages of ROS 2. `main` is the node, which is not
run by them, as ROS is not here. The twist of an Odometry message is in the body's own frame where
a driver keeps to the convention: turn it into the world's first.
python examples/06_ros_node.py --ros-args -p problem:=problem.json -p object:=mug.obj -p mass:=0.3
"""

from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

import energymargin as em
from energymargin.monitor import Alarm

PERIOD = 1 / 30  # s


class Robustness:
    """The answers: of a problem with a horizon, for a hand and an object."""

    def __init__(self, problem, hand="panda", thing=None, rollouts=20):
        """`thing`: a GraspObject, for grasps; rollouts: of each grasp and each place."""
        self.problem, self.hand, self.thing, self.rollouts = problem, hand, thing, rollouts
        self.bodies = {}

    def keep(self, body, message):
        """The last pose and velocity of a body, both in the world's frame."""
        twist = message.twist.twist
        self.bodies[body] = pose_of(message.pose.pose) | {
            "velocity": (twist.linear.x, twist.linear.y, twist.linear.z),
            "angular_velocity": (twist.angular.x, twist.angular.y, twist.angular.z),
        }

    def state(self):
        """The newest state; None until both bodies were seen."""
        return self.problem.scene.pack(**self.bodies) if len(self.bodies) == 2 else None

    def question(self, state, time):
        """The robot goes on as it moves; better is the plan of its controller."""
        problem = self.problem.with_state(state)
        return problem.replace(plan=em.Plan.hold(problem.scene, state, problem.horizon))

    def grasps(self, message):
        """How likely each grasp holds while the hand lifts: poses of the hand in the object's
        frame."""
        poses = [pose_of(pose) for pose in message.poses]
        matrices = np.tile(np.eye(4), (len(poses), 1, 1))
        for matrix, pose in zip(matrices, poses, strict=True):
            matrix[:3, :3] = Rotation.from_quat(pose["orientation"]).as_matrix()
            matrix[:3, 3] = pose["position"]
        asked = em.grasps.GraspSet(matrices), self.hand, self.thing, "lift"
        return em.grasps.score(*asked, rollouts=self.rollouts).probabilities.tolist()

    def places(self, message, radius=0.02):
        """How likely the object stays within `radius` [m] of each place where it is put at rest."""
        problem, qualities = self.problem, []
        for pose in message.poses:
            there = pose_of(pose)
            state = problem.scene.pack(object=there)
            near = em.regions.Ball("object", there["position"], radius)
            asked = problem.with_state(state).replace(captured=near, plan=None)
            qualities.append(em.capture_probability(asked, rollouts=self.rollouts).captured)
        return qualities


def pose_of(pose):
    """A geometry_msgs/Pose as the keywords of a body."""
    place, turn = pose.position, pose.orientation
    return {
        "position": (place.x, place.y, place.z),
        "orientation": (turn.x, turn.y, turn.z, turn.w),
    }


def main():
    """Spins the node."""
    import rclpy
    from geometry_msgs.msg import PoseArray
    from nav_msgs.msg import Odometry
    from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
    from rclpy.executors import MultiThreadedExecutor
    from rclpy.qos import qos_profile_sensor_data
    from std_msgs.msg import Bool, Float64, Float64MultiArray

    rclpy.init()
    node = rclpy.create_node("robustness")
    given = {
        name: node.declare_parameter(name, default).value
        for name, default in {
            "problem": "problem.json",
            "hand": "panda",
            "object": "",
            "mass": 0.3,
        }.items()
    }
    thing = em.grasps.GraspObject(given["object"], mass=given["mass"]) if given["object"] else None
    answers = Robustness(em.Problem.load(given["problem"]), given["hand"], thing)

    value = node.create_publisher(Float64, "~/capture_probability", 10)
    alarm = node.create_publisher(Bool, "~/alarm", 10)

    def publish(reading):
        if reading.error is not None:
            node.get_logger().error(str(reading.error), throttle_duration_sec=1.0)
        elif not np.isnan(reading.value):
            value.publish(Float64(data=reading.value))
            alarm.publish(Bool(data=reading.alarm))

    def push():
        if (state := answers.state()) is not None:
            monitor.push(node.get_clock().now().nanoseconds * 1e-9, state)

    def answer(function, publisher, message):
        try:
            publisher.publish(Float64MultiArray(data=function(message)))
        except ValueError as error:  # it names the argument
            node.get_logger().error(str(error))

    for body in ("object", "effector"):
        topic = f"/{body}/odom"
        node.create_subscription(
            Odometry, topic, partial(answers.keep, body), qos_profile_sensor_data
        )
    slow = MutuallyExclusiveCallbackGroup()  # seconds, beside what comes 30 times a second
    for name, function in (("grasp", answers.grasps), ("place", answers.places)):
        publisher = node.create_publisher(Float64MultiArray, f"~/{name}_quality", 10)
        call = partial(answer, function, publisher)
        node.create_subscription(PoseArray, f"~/{name}s", call, 10, callback_group=slow)
    look = {"alarm": Alarm(0.5, 0.8), "period": PERIOD, "rollouts": (8, 100)}
    with em.Monitor(answers.question, on_reading=publish, **look) as monitor:
        node.create_timer(PERIOD, push)
        rclpy.spin(node, executor=MultiThreadedExecutor())


if __name__ == "__main__":
    main()
