"""Bags of ROS 1 and ROS 2 that tests write, with the writers of rosbags."""

import tempfile
from pathlib import Path

import numpy as np

EPOCH = 1_700_000_000  # s


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
    """A bag of (topic, kind, time of the log [s], message): a file of ROS 2 (.mcap, .db3) or ROS 1
    (.bag), or else the folder of a bag."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    if path.suffix == ".bag":
        store = get_typestore(Stores.ROS1_NOETIC)
        path.unlink(missing_ok=True)
        _write(Writer1(path), store, store.serialize_ros1, messages)
        return path
    store = get_typestore(Stores.LATEST)
    plugin = StoragePlugin.SQLITE3 if path.suffix == ".db3" else StoragePlugin.MCAP
    with tempfile.TemporaryDirectory() as parent:
        folder = Path(parent) / path.stem
        writer = Writer(folder, version=9, storage_plugin=plugin)
        _write(writer, store, store.serialize_cdr, messages)
        (folder if not path.suffix else folder / path.name).replace(path)
    return path


def _write(writer, store, serialize, messages):
    connections = {}
    with writer:
        for topic, kind, time, content in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            data = serialize(_filled(store, kind, content), kind)
            writer.write(connections[topic], round(time * 1e9), data)


def _filled(store, kind, content):
    """A message of this type, from a table of its fields; a `seq` of ROS 1 is 0."""
    fields = {}
    for name, (_, of_field) in store.fielddefs[kind][1]:
        value = content.get(name, 0)
        if isinstance(value, dict):
            value = _filled(store, of_field, value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            value = [_filled(store, of_field[0][1], one) for one in value]
        elif isinstance(value, list):
            value = np.array(value)
        fields[name] = value
    return store.types[kind](**fields)
