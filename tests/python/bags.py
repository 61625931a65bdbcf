"""Bags of ROS 2 that tests write, with the writer of mcap-ros2-support."""

import numpy as np

TIME = "builtin_interfaces/Time"
BORDER = "=" * 80
PARTS = {
    "std_msgs/Header": f"{TIME} stamp\nstring frame_id",
    TIME: "int32 sec\nuint32 nanosec",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/Transform": (
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation"
    ),
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance",
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform"
    ),
}
WHOLE = {
    "geometry_msgs/msg/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose",
    "geometry_msgs/msg/PoseWithCovarianceStamped": (
        "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose"
    ),
    "geometry_msgs/msg/TransformStamped": PARTS["geometry_msgs/TransformStamped"],
    "nav_msgs/msg/Odometry": (
        "std_msgs/Header header\nstring child_frame_id\n"
        "geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist"
    ),
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "std_msgs/msg/String": "string data",
}
EPOCH = 1_700_000_000  # s


def definition(kind):
    """Of a message and of all that may be in it."""
    return "\n".join(
        [WHOLE[kind], *(f"{BORDER}\nMSG: {name}\n{text}" for name, text in PARTS.items())]
    )


def header(time, frame="world"):
    nanoseconds = round(time * 1e9)
    stamp = {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}
    return {"stamp": stamp, "frame_id": frame}


def turned(yaw, hanging=False):
    """A turn about the vertical, perhaps of a tool that points down."""
    half = yaw / 2
    x, y, z, w = 0.0, 0.0, np.sin(half), np.cos(half)
    if hanging:  # first half a turn about x
        x, y, z, w = w, z, 0.0, 0.0
    return {"x": x, "y": y, "z": z, "w": w}


def pose(x, y, yaw, z=0.0, **how):
    return {"position": {"x": x, "y": y, "z": z}, "orientation": turned(yaw, **how)}


def message(kind, time, x, y, yaw, *, frame="world", child="", **how):
    """A message with this pose."""
    own = pose(x, y, yaw, **how)
    head = header(time, frame)
    if kind == "geometry_msgs/msg/PoseStamped":
        return {"header": head, "pose": own}
    if kind == "geometry_msgs/msg/PoseWithCovarianceStamped":
        return {"header": head, "pose": {"pose": own, "covariance": [0.0] * 36}}
    if kind == "nav_msgs/msg/Odometry":
        zero = {"x": 0.0, "y": 0.0, "z": 0.0}
        twist = {"twist": {"linear": zero, "angular": zero}, "covariance": [0.0] * 36}
        return {
            "header": head,
            "child_frame_id": child,
            "pose": {"pose": own, "covariance": [0.0] * 36},
            "twist": twist,
        }
    transform = {
        "header": head,
        "child_frame_id": child,
        "transform": {"translation": own["position"], "rotation": own["orientation"]},
    }
    return {"transforms": [transform]} if kind == "tf2_msgs/msg/TFMessage" else transform


def write_bag(path, messages):
    """A bag of (topic, kind, time of the log [s], message)."""
    from mcap_ros2.writer import Writer

    with path.open("wb") as stream:
        writer, schemas = Writer(stream), {}
        for topic, kind, time, content in messages:
            if kind not in schemas:
                schemas[kind] = writer.register_msgdef(kind, definition(kind))
            nanoseconds = round(time * 1e9)
            writer.write_message(topic, schemas[kind], content, nanoseconds, nanoseconds)
        writer.finish()
    return path
