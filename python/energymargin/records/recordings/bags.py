"""Bags of ROS 1 and ROS 2, without ROS: poses of bodies, from their topics.

A topic has a pose a message, or many as /tf does; then the frame's name follows a colon, as in
"/tf:box". The object and the effector move in the plane, so they may turn about the vertical alone,
and stay at their height; other bodies move in space.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from energymargin.base.aliases import AnyPath, Floats, Mask
from energymargin.base.checks import check_type
from energymargin.base.errors import needs_extra
from energymargin.base.plausibility import warn
from energymargin.records.recordings import formats, poses as se3
from energymargin.records.recordings.cleaning import LooseRules, Rules, cleaned
from energymargin.records.recordings.recording import Recording
from energymargin.records.recordings.smoothing import gap_limits, interpolated, lost, usual_step
from energymargin.records.recordings.table import BODIES, PLANAR, SPATIAL, FileSource

if TYPE_CHECKING:
    import pandas as pd
    from rosbags.highlevel import AnyReader
    from typing_extensions import Unpack

MOST_TILT = 0.2  # rad, of a body that moves in a plane; 11 deg, more than a camera's error
MOST_RISE = 0.05  # m, the same of its height
FLAT = 0.1  # length of the x axis seen from above, from which on its heading is known
CLEARLY = 1.1  # times as rare; else the frames are the first body's
NANOSECONDS = 1_000_000_000
LATE = 3.0  # usual steps between a stamp of 0 and the next one, up to which 0 is a time
MOST_LAG = 0.5  # s, by which two topics' messages may differ in how late they were recorded
HINT = "Poses are in m and quaternions (REP 103)"

TRANSFORM = "geometry_msgs/msg/TransformStamped"
SEVERAL = "tf2_msgs/msg/TFMessage"  # has TransformStamped
POSES = {
    "geometry_msgs/msg/PoseStamped": "pose",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "pose.pose",
    TRANSFORM: "transform",
    SEVERAL: "transform",
    "nav_msgs/msg/Odometry": "pose.pose",
}
"""By the message's type: where it has its position and orientation, in this order."""
POSE = list(SPATIAL[0])
MESSAGE = ["topic", "number", "logged", "time", "parent", "frame", *POSE]
"""Columns of messages: the topic, the number on it from 1 on, the times of the log and of the
header [ns], 0 if that has none, and the frames of the pose and of the body."""


def read_bag(
    path: AnyPath,
    *,
    object: str | None = None,
    effector: str | None = None,
    bodies: Mapping[str, str] | None = None,
    **rules: Unpack[LooseRules],
) -> Recording:
    """The recording in a bag: poses of bodies, from a topic each.

    The frames are those of the body that is seen most rarely. Where another one then was lies on
    the line between its messages before and after. Velocities are those of a smoothing spline.
    Times are those of the headers, or of the log if a topic's have none. Messages whose stamp is 0
    before a simulation's clock begins are left out with a warning. Needs the extra [ros].

    Args:
        path: a file of ROS 2 (MCAP or sqlite3) or ROS 1 (.bag), or the folder of a bag.
        object: the topic of the object's poses, as "/box/pose", or a topic and a frame of it, as
            "/tf:box". Its type is PoseStamped, PoseWithCovarianceStamped, TransformStamped,
            Odometry or TFMessage. The object moves in the plane.
        effector: the same of the robot's tool.
        bodies: topics of bodies that move in space, by their names.
        rules: as of `read_csv`. The origin is that of the poses' frame. The longest gap is also one
            between two messages of a body. A causal body that is interpolated is known between two.

    Raises OSError, ImportError without the extra, and ValueError that names the file: on a topic
    that is not there (it lists those that are), poses in different frames or out of the plane, and
    all that `read_csv` refuses.
    """
    check_type("path", path, (str, os.PathLike), "a path")
    checked, source = Rules(**rules), FileSource(Path(path), "message", HINT)
    given = {"object": object, "effector": effector, **(bodies or {})}
    if bodies:
        given = {body: topic for body, topic in given.items() if topic is not None}
    wanted = {body: _topic(body, topic) for body, topic in given.items()}
    for topic in given.values():
        if len(same := [body for body, own in given.items() if own == topic]) > 1:
            raise ValueError(f"{' and '.join(same)} are both {topic!r}, expected two bodies")
    flat = set(BODIES).difference(bodies or {})
    return cleaned(_table(source, wanted, flat, checked), source, checked)


def bag_topics(path: AnyPath) -> dict[str, str]:
    """The topics of a bag with their types, those with poses first. Errors as `read_bag`."""
    with _reader(FileSource(Path(path))) as reader:
        found = {connection.topic: connection.msgtype for connection in reader.connections}
    return dict(sorted(found.items(), key=lambda one: (one[1] not in POSES, one[0])))


def _topic(name: str, given: str | None) -> tuple[str, str]:
    """A topic and a frame, which may be empty."""
    if not isinstance(given, str) or not given.partition(":")[0]:
        raise ValueError(f"{name} is {given!r}, expected a topic, as '/box/pose' or '/tf:box'")
    topic, _, frame = given.partition(":")
    return topic, frame


@contextmanager
def _reader(source: FileSource) -> Iterator[AnyReader]:
    """Reads a bag; what cannot be read is a ValueError."""
    with needs_extra("a bag", "ros"):
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    formats.require_recording(source.path)
    if source.path.is_dir():
        formats.require_own_files(source.path)
    paths = [source.path]
    if source.path.is_dir() and not (source.path / "metadata.yaml").exists():
        paths = [file for file in source.path.iterdir() if formats.is_bag(file)]
        if not paths:
            raise source.error("has no metadata.yaml and no file of a bag, expected a bag's folder")
    try:
        latest = get_typestore(Stores.LATEST)  # of bags without definitions of their messages
        with AnyReader(paths, default_typestore=latest) as reader:
            yield reader
    except FileNotFoundError:
        raise
    except Exception as error:  # of a damaged file, the library raises whatever it meets
        raise source.error(f"cannot be read ({error}), expected a whole bag") from error


def _table(
    source: FileSource, wanted: Mapping[str, tuple[str, str]], flat: set[str], rules: Rules
) -> pd.DataFrame:
    """A row for each message of the body that is seen most rarely; `flat` are in the plane."""
    messages = _read(source, wanted)
    import pandas as pd

    tracks = {}
    for body, (topic, frame) in wanted.items():
        own = _of_frame(source, topic, frame, messages[messages["topic"] == topic])
        tracks[body] = _timed(source, topic, own, repair=rules.repair)
    _require_one_clock(source, {wanted[body][0]: own for body, own in tracks.items()})
    parents = sorted(set(pd.concat(tracks.values())["parent"]))
    if len(parents) > 1:
        raise source.error(
            f"its poses are in the frames {', '.join(map(repr, parents))}, expected those of "
            f"{'both' if len(tracks) == 2 else 'all'} bodies in the same"
        )
    begin = min(own["time"].iloc[0] for own in tracks.values())
    times, poses = {}, {}
    for body, own in tracks.items():
        times[body] = (own["time"] - begin).to_numpy() / NANOSECONDS
        source.require_rising(f"the time of the {body}", times[body], own["number"].to_numpy())
        poses[body] = _seen(source, body, own, rules, planar=body in flat)
    steps = {body: usual_step(own) for body, own in times.items()}
    slower, first = max(steps, key=steps.__getitem__), next(iter(steps))
    if steps[slower] <= CLEARLY * steps[first]:
        slower = first
    table = pd.DataFrame({"time": times[slower]}, index=tracks[slower]["number"].to_numpy())
    for body, found in poses.items():
        names = [f"{body}_{axis}" for axis in (PLANAR if body in flat else SPATIAL)[0]]
        at = (times[slower], times[body], found, rules.longest_gap)
        table[names] = found if body == slower else _between(*at)
    return table


def _read(source: FileSource, wanted: Mapping[str, tuple[str, str]]) -> pd.DataFrame:
    """All poses of these topics; one that is sent again, as on /tf, counts once."""
    topics = bag_topics(source.path)
    for topic, _ in wanted.values():
        kind = topics.get(topic)
        if kind not in POSES:
            known = ", ".join(f"{name} ({kind})" for name, kind in topics.items()) or "none"
            what = f"topic {topic!r} is of {kind}" if kind else f"there is no topic {topic!r}"
            text = f"{what}, expected one of {', '.join(POSES)}; its topics are {known}"
            raise source.error(text)
    with needs_extra("a bag", "ros"):
        import pandas as pd
    numbers, rows = dict.fromkeys((topic for topic, _ in wanted.values()), 0), []
    with _reader(source) as reader:
        connections = [one for one in reader.connections if one.topic in numbers]
        for connection, logged, data in reader.messages(connections):
            kind, topic = connection.msgtype, connection.topic
            numbers[topic] += 1  # from 1 on
            message: Any = reader.deserialize(data, kind)
            for one in message.transforms if kind == SEVERAL else [message]:
                place, turn, *_ = vars(attrgetter(POSES[kind])(one)).values()
                pose = (place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w)
                time = one.header.stamp.sec * NANOSECONDS + one.header.stamp.nanosec
                frame = one.child_frame_id if kind in (TRANSFORM, SEVERAL) else ""
                told = (topic, numbers[topic], logged, time, one.header.frame_id, frame)
                rows.append((*told, *pose))
    found = pd.DataFrame(rows, columns=MESSAGE)
    once = found.assign(time=found["time"].where(found["time"] != 0, found["logged"]))
    return found[~once.duplicated(["topic", "time", "frame", *POSE])]


def _of_frame(source: FileSource, topic: str, frame: str, messages: pd.DataFrame) -> pd.DataFrame:
    """Those of one frame; ValueError if there is none, or no frame is named among several."""
    frames = sorted(set(messages["frame"]))
    own = frame or (frames[0] if len(frames) == 1 else None)
    if own not in frames:
        text = f"topic {topic!r} has the frames {', '.join(frames) or 'none'}, expected one of them"
        raise source.error(f"{text}, as '{topic}:{frames[0] if frames else 'box'}'")
    return messages[messages["frame"] == own]


def _timed(source: FileSource, topic: str, messages: pd.DataFrame, *, repair: bool) -> pd.DataFrame:
    """Messages with the time of their header, or all with that of the log if no header has one.

    A stamp of 0 that the others go on from is a time. Other stamps of 0 are of messages before a
    simulation's clock began: they are left out with a warning, or refused without `repair`.
    """
    stamped = messages[messages["time"] != 0]
    if stamped.empty:
        return messages.assign(time=messages["logged"])
    times, count = stamped["time"].to_numpy(), len(messages) - len(stamped)
    usual = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    if count == 1 and not messages["time"].iloc[0] and times[0] <= LATE * usual:
        return messages
    if count:
        text = f"{count} messages of {topic!r} have a stamp of 0, as before a simulation's clock "
        if not repair:
            raise source.error(f"{text}begins, and repair=False forbids to leave them out")
        warn([(topic, f"{source.path}: {text}begins: they are left out.")], str(source.path))
    return stamped


def _require_one_clock(source: FileSource, seen: Mapping[str, pd.DataFrame]) -> None:
    """Raises ValueError if the times of two topics have nothing in common, and warns if they were
    recorded with clocks that differ."""
    first = next(iter(seen))
    for other in [topic for topic in seen if topic != first]:
        pair = {topic: seen[topic]["time"] / NANOSECONDS for topic in (first, other)}
        span = "those of {!r} are from {:.10g} to {:.10g} s"
        spans = [span.format(topic, own.min(), own.max()) for topic, own in pair.items()]
        told = f"{' and '.join(spans)}: is one of them in simulated time (use_sim_time)"
        if max(own.min() for own in pair.values()) > min(own.max() for own in pair.values()):
            raise source.error(f"the times of two topics have nothing in common, {told}?")
        lags = [float((seen[t]["logged"] - seen[t]["time"]).median()) / NANOSECONDS for t in pair]
        if abs(lags[0] - lags[1]) > MOST_LAG:
            text = (
                f"{source.path}: messages of {first!r} were recorded {lags[0]:.3g} s after their "
                f"stamps and those of {other!r} {lags[1]:.3g} s: do their clocks differ?"
            )
            warn([(text, text)], str(source.path))


def _seen(
    source: FileSource, body: str, messages: pd.DataFrame, rules: Rules, *, planar: bool
) -> Floats:
    """Poses in the plane, shape (N, 3), or in space, shape (N, 7); NaN where it was not seen."""
    poses, lines = messages[POSE].to_numpy(float, copy=True), messages["number"].to_numpy()
    seen = np.isfinite(poses).all(axis=1)
    if not seen.any():
        raise source.error(f"has no pose of the {body} without a NaN")
    poses[~seen] = np.nan
    yaw, out_of_plane = _headings(poses[seen])
    source.require_poses(body, poses[seen], lines[seen], out_of_plane if planar else ())
    if planar:
        poses = poses[:, :3]
        poses[seen, 2] = yaw
    poses[lost(poses, rules.least_jump)] = np.nan
    return poses


def _headings(poses: Floats) -> tuple[Floats, Sequence[tuple[Mask, str]]]:
    """Yaws [rad] of poses in space, shape (N,), and which are out of a plane, in words.

    The yaw is the heading of the body's x axis, whether it stands or hangs upside down.
    """
    height, (x, y, z, w) = poses[:, 2], poses[:, 3:].T
    tilt = np.arccos(np.clip(1 - 2 * (x * x + y * y), -1, 1))  # of the body's z axis
    ahead = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + z * w)], axis=1)
    in_plane = "expected poses in a plane, turned about the vertical alone"
    tilts = f"tilts by more than {math.degrees(MOST_TILT):.0f} deg, {in_plane}"
    rises = f"is more than {MOST_RISE:g} m above or below its first pose, {in_plane}"
    stands = "has its x axis along the vertical, so its heading is not known"
    wrong = (
        (np.abs(tilt - tilt[0]) > MOST_TILT, f"{tilts}; is w first in its quaternions?"),
        (np.abs(height - height[0]) > MOST_RISE, rises),
        (np.linalg.norm(ahead, axis=1) < FLAT, stands),
    )
    return np.arctan2(ahead[:, 1], ahead[:, 0]), wrong


def _between(at: Floats, times: Floats, poses: Floats, longest_gap: float) -> Floats:
    """Poses at other times, on lines; NaN before the first, behind the last and in a gap."""
    seen = np.isfinite(poses).all(axis=1)
    known = times[seen]
    found = interpolated(at, known, se3.continuous(poses[seen]), outside=np.nan)
    after = np.minimum(np.searchsorted(known, at), len(known) - 1)
    before = np.maximum(np.searchsorted(known, at, side="right") - 1, 0)
    found[known[after] - known[before] > sum(gap_limits(longest_gap, known))] = np.nan
    return se3.units(found)
