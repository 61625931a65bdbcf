"""Bags of ROS 2 in the MCAP format, without ROS: poses of two bodies, from their topics.

A topic has a pose a message, or many as /tf does; then the frame's name follows a colon, as in
"/tf:box". Poses are in space; a recording has them in the plane, so they may turn about the
vertical alone, and stay at their height.
"""

from __future__ import annotations

import errno
import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from energymargin.plausibility import warn
from energymargin.recordings.cleaning import LEAST_JUMP, LEAST_TURN, SMOOTHING, gap_limits, lost
from energymargin.recordings.csv_files import FrameTable, SourceFile, frame_origin
from energymargin.recordings.reading import LONGEST_GAP, Rules, recording_of
from energymargin.recordings.recording import Recording

if TYPE_CHECKING:
    from mcap.reader import McapReader

__all__ = ["bag_topics", "is_bag", "read_mcap"]

SUFFIX = ".mcap"
MOST_TILT = 0.2  # rad, of a body that moves in a plane; 11 deg, more than a camera's error
MOST_RISE = 0.05  # m, the same of its height
UNIT = 1e-3  # by so much a quaternion of single precision is not of length one
UNTURNED = 0.02  # length of y and z of a quaternion, 2.3 deg of turn about them
ROLLED = 0.1  # the same of x, 11 deg
FLAT = 0.1  # length of the x axis seen from above, from which on its heading is known
CLEARLY = 1.1  # times as rare; else the frames are the object's
NANOSECONDS = 1_000_000_000
UNITS = "Poses are in m and quaternions (REP 103)"

# By the message's type: what has its pose, beside `header`.
POSES: dict[str, Callable[[Any], tuple[Any, Any]]] = {
    "geometry_msgs/msg/PoseStamped": lambda m: (m.pose.position, m.pose.orientation),
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda m: (
        m.pose.pose.position,
        m.pose.pose.orientation,
    ),
    "geometry_msgs/msg/TransformStamped": lambda m: (m.transform.translation, m.transform.rotation),
    "nav_msgs/msg/Odometry": lambda m: (m.pose.pose.position, m.pose.pose.orientation),
}
SEVERAL = "tf2_msgs/msg/TFMessage"  # has TransformStamped
OF_FRAMES = ("geometry_msgs/msg/TransformStamped", SEVERAL)  # a colon and a frame may follow


@dataclass(frozen=True)
class _Sighting:
    """A pose in space."""

    nanoseconds: int
    parent: str
    frame: str
    """The child frame of a transform."""
    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    number: int
    """Of the message on its topic, from 1 on."""
    logged: int
    """When it was recorded [ns]."""


def read_mcap(
    path: str | os.PathLike[str],
    *,
    object: str,
    effector: str,
    repair: bool = True,
    longest_gap: float = LONGEST_GAP,
    least_jump: float = LEAST_JUMP,
    least_turn: float = LEAST_TURN,
    smoothing: float = SMOOTHING,
    smooth_poses: bool = True,
    causal: bool = False,
    origin: Sequence[float] = (0.0, 0.0, 0.0),
) -> Recording:
    """The recording in a bag: poses of two bodies in a plane, from a topic each.

    The frames are those of the body that is seen more rarely. Where the other one then was lies on
    the line between its messages before and after. Velocities are those of a smoothing spline.
    Times are those of the headers, or of the log if they have none. Needs the extra [ros].

    Args:
        path: an MCAP file, or the folder of a bag.
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
    place = frame_origin(origin)
    source = SourceFile(Path(path), "message", UNITS)
    wanted = {"object": _topic("object", object), "effector": _topic("effector", effector)}
    if wanted["object"] == wanted["effector"]:
        raise ValueError(f"object and effector are both {object!r}, expected two bodies")
    seen = _sightings(source, wanted)
    parents = {body: _parent(source, body, own) for body, own in seen.items()}
    if parents["object"] != parents["effector"]:
        raise source.error(
            f"poses of the object are in the frame {parents['object']!r}, those of the effector in "
            f"{parents['effector']!r}, expected the same frame"
        )
    return recording_of(_table(source, seen, rules), rules, origin=place)


def is_bag(path: Path) -> bool:
    """Whether this is the path of a bag, and not that of a CSV file."""
    return path.suffix.lower() == SUFFIX or path.is_dir()


def bag_topics(path: str | os.PathLike[str]) -> dict[str, str]:
    """The topics of a bag with their types, those with poses first. Errors as `read_mcap`."""
    found: dict[str, str] = {}
    for file in _files(SourceFile(Path(path))):
        with _reader(file) as reader:
            summary = reader.get_summary()
            if summary is None:
                for schema, channel, _ in reader.iter_messages():
                    found[channel.topic] = "" if schema is None else schema.name
                continue
            for channel in summary.channels.values():
                schema = summary.schemas.get(channel.schema_id)
                found[channel.topic] = "" if schema is None else schema.name
    return dict(sorted(found.items(), key=lambda one: (not _has_poses(one[1]), one[0])))


def _has_poses(kind: str) -> bool:
    return kind in POSES or kind == SEVERAL


def _topic(name: str, given: str) -> tuple[str, str]:
    """A topic and a frame, which may be empty."""
    if not isinstance(given, str) or not given.partition(":")[0]:
        raise ValueError(f"{name} is {given!r}, expected a topic, as '/box/pose' or '/tf:box'")
    topic, _, frame = given.partition(":")
    return topic, frame


def _files(source: SourceFile) -> list[Path]:
    """The MCAP files of a bag, in their order."""
    path = source.path
    if not path.is_dir():
        return [path]
    files = sorted(path.glob(f"*{SUFFIX}"), key=lambda file: (len(file.name), file.name))
    if not files:
        raise source.error(
            f"has no {SUFFIX} file, expected the folder of a bag in the MCAP format; "
            "`ros2 bag convert` makes one of a bag in another"
        )
    return files


@contextmanager
def _reader(file: Path) -> Iterator[McapReader]:
    """Reads a file; what it cannot read is a ValueError."""
    try:
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory
    except ImportError as error:
        raise ImportError(f"a bag needs pip install 'energymargin[ros]': {error}") from error
    with file.open("rb") as stream:
        try:
            yield make_reader(stream, decoder_factories=[DecoderFactory()])
        except Exception as error:  # of a damaged file, its libraries raise whatever they meet
            if isinstance(error, OSError) and error.errno != errno.EINVAL:  # EINVAL: beyond its end
                raise
            raise SourceFile(file).error(
                f"cannot be read ({error}), expected a whole MCAP file of messages of ROS 2"
            ) from error


def _sightings(
    source: SourceFile, wanted: dict[str, tuple[str, str]]
) -> dict[str, list[_Sighting]]:
    """Of both bodies, in the order of their times. ValueError where a clock goes back."""
    topics = bag_topics(source.path)
    for topic, frame in wanted.values():
        _require_poses(source, topic, frame, topics)
    by_topic: dict[str, list[_Sighting]] = {topic: [] for topic, _ in wanted.values()}
    for file in _files(source):
        with _reader(file) as reader:
            for schema, channel, message, decoded in reader.iter_decoded_messages(list(by_topic)):
                own = by_topic[channel.topic]
                number = own[-1].number + 1 if own else 1
                kind = "" if schema is None else schema.name
                own.extend(_of_message(kind, decoded, message.log_time, number))
    found = {}
    for body, (topic, frame) in wanted.items():
        found[body] = _without_repeats(_of_frame(source, topic, frame, by_topic[topic]))
        _require_order(source, body, found[body])
    return found


def _without_repeats(sightings: list[_Sighting]) -> list[_Sighting]:
    """Each sighting once: /tf has the same one again and again."""
    once = {(one.nanoseconds, one.position, one.orientation): one for one in reversed(sightings)}
    return list(reversed(once.values()))


def _require_order(source: SourceFile, body: str, sightings: list[_Sighting]) -> None:
    """Raises ValueError on a message that is older than the one before it."""
    for before, one in pairwise(sightings):
        back = (before.nanoseconds - one.nanoseconds) / NANOSECONDS
        if back > 0:
            raise source.error(
                f"the time of the {body} goes back by {back:.3g} s after message {before.number}: "
                "was the clock set, or are these several episodes? Cut the bag there, at "
                f"{one.logged / NANOSECONDS:.3f} s of its log",
                one.number,
            )


def _require_poses(source: SourceFile, topic: str, frame: str, topics: dict[str, str]) -> None:
    known = ", ".join(f"{name} ({kind})" for name, kind in topics.items()) or "none"
    if topic not in topics:
        raise source.error(f"there is no topic {topic!r}; its topics are {known}")
    kind = topics[topic]
    if not _has_poses(kind):
        raise source.error(
            f"topic {topic!r} is of {kind}, expected one of {', '.join([*POSES, SEVERAL])}; its "
            f"topics are {known}"
        )
    if frame and kind not in OF_FRAMES:
        raise source.error(f"topic {topic!r} is of {kind}, which has no frame {frame!r}")


def _of_message(kind: str, message: Any, logged: int, number: int) -> Iterator[_Sighting]:
    several = message.transforms if kind == SEVERAL else [message]
    for one in several:
        position, turn = POSES[OF_FRAMES[0] if kind == SEVERAL else kind](one)
        stamp = one.header.stamp.sec * NANOSECONDS + one.header.stamp.nanosec
        yield _Sighting(
            stamp or logged,
            one.header.frame_id,
            one.child_frame_id if kind in OF_FRAMES else "",
            (position.x, position.y, position.z),
            (turn.x, turn.y, turn.z, turn.w),
            number,
            logged,
        )


def _of_frame(
    source: SourceFile, topic: str, frame: str, sightings: list[_Sighting]
) -> list[_Sighting]:
    """Those of one frame; ValueError if there is none, or no frame is named among several."""
    frames = sorted({one.frame for one in sightings})
    if frame and frame not in frames:
        shown = ", ".join(frames) or "none"
        raise source.error(f"topic {topic!r} has no frame {frame!r}; its frames are {shown}")
    if not frame and len(frames) > 1:
        raise source.error(
            f"topic {topic!r} has the frames {', '.join(frames)}, expected one of them, as "
            f"'{topic}:{frames[0]}'"
        )
    return [one for one in sightings if not frame or one.frame == frame]


def _parent(source: SourceFile, body: str, sightings: list[_Sighting]) -> str:
    """The frame of a body's poses."""
    if not sightings:
        raise source.error(f"has no message with a pose of the {body}")
    parents = sorted({one.parent for one in sightings})
    if len(parents) > 1:
        raise source.error(
            f"poses of the {body} are in the frames {', '.join(map(repr, parents))}, expected one"
        )
    return parents[0]


def _table(source: SourceFile, seen: dict[str, list[_Sighting]], rules: Rules) -> FrameTable:
    """A row for each message of the body that is seen more rarely."""
    begin = min(own[0].nanoseconds for own in seen.values())
    stamps = {
        body: np.array([(one.nanoseconds - begin) / NANOSECONDS for one in own])
        for body, own in seen.items()
    }
    rarer = _usual_step(stamps["effector"]) > CLEARLY * _usual_step(stamps["object"])
    slower = "effector" if rarer else "object"
    times = stamps[slower]
    values = {"time": times}
    for body, own in seen.items():
        poses = _planar(source, body, own)
        poses[lost(poses, rules.least_jump)] = np.nan
        if body != slower:
            poses = _between(times, stamps[body], poses, rules.longest_gap)
        for axis, column in zip(("x", "y", "yaw"), poses.T, strict=True):
            values[f"{body}_{axis}"] = column
    lines = np.array([one.number for one in seen[slower]], dtype=np.int64)
    return FrameTable(source, lines, values)


def _usual_step(times: NDArray[np.float64]) -> float:
    """The median [s]; inf of one time alone."""
    return float(np.median(np.diff(times))) if len(times) > 1 else math.inf


def _planar(source: SourceFile, body: str, sightings: list[_Sighting]) -> NDArray[np.float64]:
    """x, y [m] and yaw [rad], shape (N, 3); NaN where it was not seen.

    The yaw is the heading of the body's x axis, whether it stands or hangs upside down.
    """
    places = np.array([one.position for one in sightings], dtype=float)
    turns = np.array([one.orientation for one in sightings], dtype=float)
    seen = np.isfinite(places).all(axis=1) & np.isfinite(turns).all(axis=1)
    if not seen.any():
        raise source.error(f"has no pose of the {body} without a NaN")

    def refuse(wrong: NDArray[np.bool_], text: Callable[[int], str]) -> None:
        if wrong.any():
            k = int(np.flatnonzero(seen)[np.argmax(wrong)])
            raise source.error(f"the {body} {text(k)}", sightings[k].number)

    x, y, z, w = turns[seen].T
    refuse(
        np.abs(np.linalg.norm(turns[seen], axis=1) - 1) > UNIT,
        lambda k: f"has the orientation {tuple(turns[k].tolist())}, expected a unit quaternion",
    )
    upwards = 1 - 2 * (x * x + y * y)  # z of the body's z axis
    tilt = np.arccos(np.clip(upwards, -1, 1))
    rolled = _only_rolled(turns[seen])
    hint = ". Is w first in its quaternions? Expected x, y, z, w" if rolled else ""
    refuse(
        np.abs(tilt - tilt[0]) > MOST_TILT,
        lambda k: (
            f"tilts by more than {math.degrees(MOST_TILT):.0f} deg, expected poses in a plane, "
            f"turned about the vertical alone{hint}"
        ),
    )
    height = places[seen, 2]
    refuse(
        np.abs(height - height[0]) > MOST_RISE,
        lambda k: (
            f"is {places[k, 2]:.3g} m high after {height[0]:.3g} m at first, expected poses in a "
            f"plane, within {MOST_RISE:g} m"
        ),
    )
    ahead = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + z * w)], axis=1)
    refuse(
        np.linalg.norm(ahead, axis=1) < FLAT,
        lambda k: "has its x axis along the vertical, so its heading is not known",
    )
    if rolled:
        shown = ", ".join(f"{number:.4g}" for number in turns[seen][0])
        about = f"{source.path}: the {body} has the orientation ({shown})"
        text = f"{about}, turned about its own x axis, and the yaw 0 throughout. Is w first there? "
        warn([(about, text + "Expected x, y, z, w.")], str(source.path))
    poses = np.full((len(sightings), 3), np.nan)
    poses[seen] = np.column_stack([places[seen, :2], np.arctan2(ahead[:, 1], ahead[:, 0])])
    return poses


def _only_rolled(turns: NDArray[np.float64]) -> bool:
    """Whether quaternions, shape (N, 4), turn about the body's own x axis alone.

    So does a tool that points down and never turns, and each body that stands if w is written
    first.
    """
    x, y, z, _ = turns.T
    return bool(np.median(np.hypot(y, z)) < UNTURNED and np.median(np.abs(x)) > ROLLED)


def _between(
    at: NDArray[np.float64],
    times: NDArray[np.float64],
    poses: NDArray[np.float64],
    longest_gap: float,
) -> NDArray[np.float64]:
    """Poses at other times, on lines; NaN before the first, behind the last and in a gap."""
    seen = np.isfinite(poses).all(axis=1)
    known, columns = times[seen], poses[seen].copy()
    columns[:, 2] = np.unwrap(columns[:, 2])
    found = np.stack([np.interp(at, known, column) for column in columns.T], axis=1)
    after = np.searchsorted(known, at)
    before = np.searchsorted(known, at, side="right") - 1
    outside = (after == len(known)) | (before < 0)
    last = len(known) - 1
    gap = known[np.minimum(after, last)] - known[np.maximum(before, 0)]
    found[outside | (gap > sum(gap_limits(longest_gap, known)))] = np.nan
    return found
