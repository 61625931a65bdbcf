"""A node of ROS 2: publishes 30 times a second how likely the object is to stay captured, and an
alarm.

It is not run by the tests, as ROS is not here. The twist of an Odometry message is in the body's
own frame where a driver keeps to the convention: turn it into the world's first.
python examples/06_ros_node.py --ros-args -p problem:=problem.json
"""

import numpy as np
import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Bool, Float64

import energymargin as em
from energymargin.monitor import Alarm


class RobustnessNode(Node):
    """Monitors the object of a problem file."""

    def __init__(self):
        """Starts the monitor and the subscriptions."""
        super().__init__("robustness")
        path = self.declare_parameter("problem", "problem.json").value
        self.problem = em.Problem.load(path)  # with a horizon
        self.bodies = {}
        self.value = self.create_publisher(Float64, "~/capture_probability", 10)
        self.alarm = self.create_publisher(Bool, "~/alarm", 10)
        self.monitor = em.Monitor(
            self.question,
            alarm=Alarm(0.5, 0.8),
            period=1 / 30,
            rollouts=(8, 100),
            on_reading=self.publish,
        )
        for body in ("object", "effector"):
            self.create_subscription(
                Odometry,
                f"/{body}/odom",
                lambda m, b=body: self.keep(b, m),
                qos_profile_sensor_data,
            )
        self.create_timer(1 / 30, self.push)

    def keep(self, body, message):
        """The last pose and velocity of a body, both in the world's frame."""
        pose, twist = message.pose.pose, message.twist.twist
        self.bodies[body] = {
            "position": (pose.position.x, pose.position.y, pose.position.z),
            "orientation": (
                pose.orientation.x,
                pose.orientation.y,
                pose.orientation.z,
                pose.orientation.w,
            ),
            "velocity": (twist.linear.x, twist.linear.y, twist.linear.z),
            "angular_velocity": (twist.angular.x, twist.angular.y, twist.angular.z),
        }

    def push(self):
        """Gives the monitor the newest state."""
        if len(self.bodies) == 2:
            now = self.get_clock().now().nanoseconds * 1e-9
            self.monitor.push(now, self.problem.scene.pack(**self.bodies))

    def question(self, state, time):
        """The robot goes on as it moves; better is the plan of its controller."""
        problem = self.problem.with_state(state)
        return problem.replace(plan=em.Plan.hold(problem.scene, state, problem.horizon))

    def publish(self, reading):
        """A reading of the monitor, as messages."""
        if reading.error is not None:
            self.get_logger().error(str(reading.error), throttle_duration_sec=1.0)
        if np.isnan(reading.value):
            return
        self.value.publish(Float64(data=reading.value))
        self.alarm.publish(Bool(data=reading.alarm))

    def destroy_node(self):
        """Ends the monitor first."""
        self.monitor.close()
        super().destroy_node()


if __name__ == "__main__":
    rclpy.init()
    node = RobustnessNode()
    try:
        rclpy.spin(node)
    finally:
        node.destroy_node()
