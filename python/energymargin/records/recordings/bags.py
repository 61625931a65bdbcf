"""Bags of ROS 1 and ROS 2, without ROS: poses of two bodies, from their topics.

A topic has a pose a message, or many as /tf does; then the frame's name follows a colon, as in
"/tf:box". Poses are in space; a recording has them in the plane, so they may turn about the
vertical alone, and stay at their height.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from energymargin.base.errors import needs_extra
from energymargin.base.plausibility import warn
from energymargin.records.recordings import cleaning, reading
from energymargin.records.recordings.folders import require_own_files
from energymargin.records.recordings.reading import FrameTable, Rules, SourceFile
from energymargin.records.recordings.recording import Recording

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

Floats = NDArray[np.float64]


SUFFIXES = (".mcap", ".db3", ".bag")
MOST_TILT = 0.2  # rad, of a body that moves in a plane; 11 deg, more than a camera's error
MOST_RISE = 0.05  # m, the same of its height
UNIT = 1e-3  # by so much a quaternion of single precision is not of length one
FLAT = 0.1  # length of the x axis seen from above, from which on its heading is known
CLEARLY = 1.1  # times as rare; else the frames are the object's
NANOSECONDS = 1_000_000_000
LATE = 3.0  # usual steps between a stamp of 0 and the next one, up to which 0 is a time
MOST_LAG = 0.5  # s, by which two topics' messages may differ in how late they were recorded
HINT = "Poses are in m and quaternions (REP 103)"

TRANSFORM = "geometry_msgs/msg/TransformStamped"
SEVERAL = "tf2_msgs/msg/TFMessage"  # has TransformStamped
# By the message's type: where its position and orientation are.
POSES = {
    "geometry_msgs/msg/PoseStamped": attrgetter("pose.position", "pose.orientation"),
    "geometry_msgs/msg/PoseWithCovarianceStamped": attrgetter(
        "pose.pose.position", "pose.pose.orientation"
    ),
    TRANSFORM: attrgetter("transform.translation", "transform.rotation"),
    SEVERAL: attrgetter("transform.translation", "transform.rotation"),
    "nav_msgs/msg/Odometry": attrgetter("pose.pose.position", "pose.pose.orientation"),
}


class _Sighting(NamedTuple):
    """A pose in space."""

    nanoseconds: int
    """Of the header; 0 if that has none."""
    frame: str
    """The child frame of a transform."""
    pose: tuple[float, ...]
    """x, y, z [m] and the quaternion x, y, z, w."""
    parent: str
    number: int
    """Number of the message on its topic, from 1 on."""
    logged: int
    """When the message was recorded [ns]."""


def read_bag(
    path: str | os.PathLike[str],
    *,
    object: str,
    effector: str,
    repair: bool = True,
    longest_gap: float = reading.LONGEST_GAP,
    least_jump: float = cleaning.LEAST_JUMP,
    least_turn: float = cleaning.LEAST_TURN,
    smoothing: float = cleaning.SMOOTHING,
    smooth_poses: bool = True,
    causal: bool = False,
    origin: Sequence[float] = (0.0, 0.0, 0.0),
) -> Recording:
    """The recording in a bag: poses of two bodies in a plane, from a topic each.

    The frames are those of the body that is seen more rarely. Where the other one then was lies on
    the line between its messages before and after. Velocities are those of a smoothing spline.
    Times are those of the headers, or of the log if a topic's have none. Messages whose stamp is 0
    before a simulation's clock begins are left out with a warning. Needs the extra [ros].

    Args:
        path: a file of ROS 2 (MCAP or sqlite3) or ROS 1 (.bag), or the folder of a bag.
        object: the topic of the object's poses, as "/box/pose", or a topic and a frame of it, as
            "/tf:box". Its type is PoseStamped, PoseWithCovarianceStamped, TransformStamped,
            Odometry or TFMessage.
        effector: the same of the robot's tool.
        repair: as of `read_csv`, as are the other arguments.
        longest_gap: also between two messages of a body.
        least_jump: an outlier jumps by so much at least [m].
        least_turn: the same of its yaw [rad].
        smoothing: the largest time scale of the smoothing spline [s].
        smooth_poses: whether the spline gives the poses, too.
        causal: as of `read_csv`. The body that is interpolated is known between two messages.
        origin: of the poses' frame in the scene's, x, y [m] and yaw [rad].

    Raises OSError, ImportError without the extra, and ValueError that names the file: on a topic
    that is not there (it lists those that are), poses in different frames or out of the plane, and
    all that `read_csv` refuses.
    """
    rules = Rules(repair, longest_gap, least_jump, least_turn, smoothing, smooth_poses, causal)
    place = reading.frame_origin(origin)
    source = SourceFile(Path(path), "message", HINT)
    wanted = {"object": _topic("object", object), "effector": _topic("effector", effector)}
    if wanted["object"] == wanted["effector"]:
        raise ValueError(f"object and effector are both {object!r}, expected two bodies")
    return reading.recording_of(
        _table(source, _sightings(source, wanted, repair=repair), rules), rules, place
    )


def is_bag(path: Path) -> bool:
    """Whether this is the path of a bag, and not that of a CSV file."""
    return path.suffix.lower() in SUFFIXES or path.is_dir()


def bag_topics(path: str | os.PathLike[str]) -> dict[str, str]:
    """The topics of a bag with their types, those with poses first. Errors as `read_bag`."""
    with _reader(SourceFile(Path(path))) as reader:
        found = {connection.topic: connection.msgtype for connection in reader.connections}
    return dict(sorted(found.items(), key=lambda one: (one[1] not in POSES, one[0])))


def _topic(name: str, given: str) -> tuple[str, str]:
    """A topic and a frame, which may be empty."""
    if not isinstance(given, str) or not given.partition(":")[0]:
        raise ValueError(f"{name} is {given!r}, expected a topic, as '/box/pose' or '/tf:box'")
    topic, _, frame = given.partition(":")
    return topic, frame


@contextmanager
def _reader(source: SourceFile) -> Iterator[AnyReader]:
    """Reads a bag; what cannot be read is a ValueError."""
    with needs_extra("a bag", "ros"):
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    if source.path.is_dir():
        require_own_files(source.path)
    paths = [source.path]
    if source.path.is_dir() and not (source.path / "metadata.yaml").exists():
        paths = [file for file in source.path.iterdir() if file.suffix.lower() in SUFFIXES]
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


def _sightings(
    source: SourceFile, wanted: dict[str, tuple[str, str]], *, repair: bool
) -> dict[str, list[_Sighting]]:
    """Those of both bodies, each pose once, in the order of their times and in the same frame."""
    topics = bag_topics(source.path)
    for topic, _ in wanted.values():
        kind = topics.get(topic)
        if kind not in POSES:
            known = ", ".join(f"{name} ({kind})" for name, kind in topics.items()) or "none"
            what = f"topic {topic!r} is of {kind}" if kind else f"there is no topic {topic!r}"
            raise source.error(
                f"{what}, expected one of {', '.join(POSES)}; its topics are {known}"
            )
    seen = _read(source, {topic for topic, _ in wanted.values()})
    found = {
        body: _timed(source, named[0], _of_frame(source, *named, seen[named[0]]), repair=repair)
        for body, named in wanted.items()
    }
    _require_one_clock(source, {wanted[body][0]: own for body, own in found.items()})
    parents = sorted({one.parent for own in found.values() for one in own})
    if len(parents) > 1:
        raise source.error(
            f"its poses are in the frames {', '.join(map(repr, parents))}, expected those of both "
            "bodies in the same"
        )
    return found


def _read(source: SourceFile, topics: set[str]) -> dict[str, list[_Sighting]]:
    """All poses of these topics; one that is sent again, as on /tf, counts once."""
    found: dict[str, dict[Any, _Sighting]] = {topic: {} for topic in topics}
    numbers: Counter[str] = Counter()
    with _reader(source) as reader:
        connections = [one for one in reader.connections if one.topic in topics]
        for connection, logged, data in reader.messages(connections):
            numbers[connection.topic] += 1
            message: Any = reader.deserialize(data, connection.msgtype)
            for one in message.transforms if connection.msgtype == SEVERAL else [message]:
                position, turn = POSES[connection.msgtype](one)
                pose = (position.x, position.y, position.z, turn.x, turn.y, turn.z, turn.w)
                stamp = one.header.stamp.sec * NANOSECONDS + one.header.stamp.nanosec
                frame = one.child_frame_id if connection.msgtype in (TRANSFORM, SEVERAL) else ""
                number = numbers[connection.topic]
                sighting = _Sighting(stamp, frame, pose, one.header.frame_id, number, logged)
                found[connection.topic].setdefault((stamp or logged, frame, pose), sighting)
    return {topic: list(sightings.values()) for topic, sightings in found.items()}


def _of_frame(
    source: SourceFile, topic: str, frame: str, sightings: list[_Sighting]
) -> list[_Sighting]:
    """Those of one frame; ValueError if there is none, or no frame is named among several."""
    frames = sorted({one.frame for one in sightings})
    own = frame or (frames[0] if len(frames) == 1 else None)
    if own not in frames:
        raise source.error(
            f"topic {topic!r} has the frames {', '.join(frames) or 'none'}, expected one of them, "
            f"as '{topic}:{frames[0] if frames else 'box'}'"
        )
    return [one for one in sightings if one.frame == own]


def _timed(
    source: SourceFile, topic: str, seen: list[_Sighting], *, repair: bool
) -> list[_Sighting]:
    """Sightings with the time of their header, or all with that of the log if no header has one.

    A stamp of 0 that the others go on from is a time. Other stamps of 0 are of messages before a
    simulation's clock began: they are left out with a warning, or refused without `repair`.
    """
    stamped = [one for one in seen if one.nanoseconds]
    if not stamped:
        return [one._replace(nanoseconds=one.logged) for one in seen]
    steps = np.diff([one.nanoseconds for one in stamped])
    usual = float(np.median(steps)) if len(steps) else 0.0
    count = len(seen) - len(stamped)
    if count == 1 and not seen[0].nanoseconds and stamped[0].nanoseconds <= LATE * usual:
        return seen
    if count:
        text = f"{count} messages of {topic!r} have a stamp of 0, as before a simulation's clock "
        if not repair:
            raise source.error(f"{text}begins, and repair=False forbids to leave them out")
        warn([(topic, f"{source.path}: {text}begins: they are left out.")], str(source.path))
    return stamped


def _require_one_clock(source: SourceFile, seen: dict[str, list[_Sighting]]) -> None:
    """Raises ValueError if the times of two topics have nothing in common, and warns if they were
    recorded with clocks that differ."""
    if len(seen) < 2:
        return
    times = [[one.nanoseconds / NANOSECONDS for one in own] for own in seen.values()]
    (first, second), topics = times, [*map(repr, seen)]
    spans = [
        f"those of {topic} are from {min(own):.10g} to {max(own):.10g} s"
        for topic, own in zip(topics, times, strict=True)
    ]
    told = f"{' and '.join(spans)}: is one of them in simulated time (use_sim_time)"
    apart = max(min(second) - max(first), min(first) - max(second))
    if apart > 0.0:
        raise source.error(f"the times of two topics have nothing in common, {told}?")
    lags = [
        float(np.median([one.logged - one.nanoseconds for one in own])) / NANOSECONDS
        for own in seen.values()
    ]
    if abs(lags[0] - lags[-1]) > MOST_LAG:
        text = (
            f"{source.path}: messages of {topics[0]} were recorded {lags[0]:.3g} s after their "
            f"stamps and those of {topics[-1]} {lags[-1]:.3g} s: do their clocks differ?"
        )
        warn([(text, text)], str(source.path))


def _table(source: SourceFile, seen: dict[str, list[_Sighting]], rules: Rules) -> FrameTable:
    """A row for each message of the body that is seen more rarely."""
    begin = min(own[0].nanoseconds for own in seen.values())
    stamps, lines, poses = {}, {}, {}
    for body, own in seen.items():
        stamps[body] = np.array([(one.nanoseconds - begin) / NANOSECONDS for one in own])
        lines[body] = np.array([one.number for one in own], dtype=np.int64)
        reading.require_rising(source, f"the time of the {body}", stamps[body], lines[body])
    for body, own in seen.items():
        poses[body] = _planar(source, body, own)
        poses[body][cleaning.lost(poses[body], rules.least_jump)] = np.nan
    steps = {body: cleaning.usual_step(own) for body, own in stamps.items()}
    rarer = steps["effector"] > CLEARLY * steps["object"]
    slower, other = ("effector", "object") if rarer else ("object", "effector")
    times = stamps[slower]
    poses[other] = _between(times, stamps[other], poses[other], rules.longest_gap)
    return FrameTable(source, lines[slower], np.arange(len(times)), times, poses, velocities={})


def _planar(source: SourceFile, body: str, sightings: list[_Sighting]) -> Floats:
    """x, y [m] and yaw [rad], shape (N, 3); NaN where it was not seen.

    The yaw is the heading of the body's x axis, whether it stands or hangs upside down.
    """
    measured = np.array([one.pose for one in sightings], dtype=float)
    rows = np.flatnonzero(np.isfinite(measured).all(axis=1))
    if not len(rows):
        raise source.error(f"has no pose of the {body} without a NaN")
    height, turns = measured[rows, 2], measured[rows, 3:]
    x, y, z, w = turns.T
    tilt = np.arccos(np.clip(1 - 2 * (x * x + y * y), -1, 1))  # of the body's z axis
    ahead = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + z * w)], axis=1)
    unit = np.abs(np.linalg.norm(turns, axis=1) - 1) <= UNIT
    in_plane = "expected poses in a plane, turned about the vertical alone"
    for wrong, text in (
        (~unit, "has an orientation that is no unit quaternion"),
        (
            np.abs(tilt - tilt[0]) > MOST_TILT,
            f"tilts by more than {math.degrees(MOST_TILT):.0f} deg, {in_plane}; is w first in its "
            "quaternions?",
        ),
        (
            np.abs(height - height[0]) > MOST_RISE,
            f"is more than {MOST_RISE:g} m above or below its first pose, {in_plane}",
        ),
        (
            np.linalg.norm(ahead, axis=1) < FLAT,
            "has its x axis along the vertical, so its heading is not known",
        ),
    ):
        if wrong.any():
            k = int(rows[np.argmax(wrong)])
            shown = ", ".join(f"{number:.4g}" for number in sightings[k].pose)
            raise source.error(f"the {body} at ({shown}) {text}", sightings[k].number)
    poses = np.full((len(sightings), 3), np.nan)
    poses[rows] = np.column_stack([measured[rows, :2], np.arctan2(ahead[:, 1], ahead[:, 0])])
    return poses


def _between(at: Floats, times: Floats, poses: Floats, longest_gap: float) -> Floats:
    """Poses at other times, on lines; NaN before the first, behind the last and in a gap."""
    seen = np.isfinite(poses).all(axis=1)
    known, columns = times[seen], poses[seen].copy()
    columns[:, 2] = np.unwrap(columns[:, 2])
    found = cleaning.interpolated(at, known, columns, outside=np.nan)
    last = len(known) - 1
    after = np.minimum(np.searchsorted(known, at), last)
    before = np.maximum(np.searchsorted(known, at, side="right") - 1, 0)
    found[known[after] - known[before] > sum(cleaning.gap_limits(longest_gap, known))] = np.nan
    return found
