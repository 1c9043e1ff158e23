"""Topics of a ROS 1 or ROS 2 bag as arrays: joint positions, and points or poses of targets. No ROS is needed."""

from __future__ import annotations

import re
import stat
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from truearm.engine.base.errors import InputError, listed, nearest_names
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.robot.chain import Array

#: By which clock messages are placed in time: the stamp of their header, or when the recorder got them.
Times = Literal["stamp", "bag"]
TIMES: Final[tuple[Times, ...]] = ("stamp", "bag")
JOINTS: Final = "sensor_msgs/msg/JointState"
#: Kinds of message that hold a point or a pose, and the path to it.
SEEN: Final[Mapping[str, tuple[str, ...]]] = {
    "geometry_msgs/msg/PointStamped": ("point",),
    "geometry_msgs/msg/PoseStamped": ("pose",),
    "geometry_msgs/msg/PoseWithCovarianceStamped": ("pose", "pose"),
    "geometry_msgs/msg/TransformStamped": ("transform",),
}
#: A joint's name that ends in its number: joint_1, joint_a1, axis1, A1, lbr_joint_7.
_NUMBERED: Final = re.compile(r"(?P<stem>.*?[^0-9])(?P<number>[0-9]{1,2})")


@dataclass(frozen=True, eq=False)
class JointStream:
    """Joint positions over time."""

    topic: str  #: Where they were published.
    names: tuple[str, ...]  #: Of the joints, in the order of the robot.
    times: Array  #: When, from the first [s], ``(n,)``, never falling.
    positions: Array  #: ``(n, joints)`` [rad; m for prismatic joints].
    start: int  #: The first time by its clock [ns].


@dataclass(frozen=True, eq=False)
class TargetStream:
    """What an instrument saw of a target over time."""

    target: str  #: target, topic: its name, and where it was published.
    topic: str
    times: Array  #: When, counted as those of the joints [s], ``(n,)``, never falling.
    positions: Array  #: ``(n, 3)`` [m].
    quaternions: Array | None  #: (w, x, y, z), ``(n, 4)``; None for points.
    frame: str  #: In which frame, as the messages say.
    lost: int  #: How many messages hold no number.


def read_streams(
    bag: Path,
    targets: Mapping[str, str] | None,
    joint_topic: str | None,
    joint_names: Sequence[str] | None,
    times: Times,
) -> tuple[JointStream, tuple[TargetStream, ...]]:
    """Read the joints and the targets of a bag.

    Args:
        bag: A ``.bag`` file of ROS 1, or a folder of ROS 2 that holds ``metadata.yaml``.
        targets: The topic of each target by its name; None for the only topic that holds points or poses.
        joint_topic: Topic of the joints; None for the only one.
        joint_names: Names of the joints in the order of the robot; None where numbers at their ends tell it.
        times: By which clock.

    Raises:
        InputError: If the bag cannot be read, or does not hold them.
    """
    with _opened(bag) as reader:
        kinds = {topic: str(info.msgtype) for topic, info in reader.topics.items()}
        of_joints = _joint_topic(bag, kinds, joint_topic)
        of_targets = _target_topics(bag, kinds, targets)
        counts = {topic: reader.topics[topic].msgcount for topic in (of_joints, *of_targets.values())}
        refuse_beyond("samples_read", sum(counts.values()), where=str(bag))
        joints = _read_joints(bag, reader, of_joints, joint_names, times)
        seen = tuple(_read_target(bag, reader, n, t, kinds[t], times, joints.start) for n, t in of_targets.items())
    return joints, seen


@contextmanager
def _opened(bag: Path) -> Iterator[Any]:
    """Open a bag; whatever its library stumbles over is refused."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise InputError(
            "bags are read by rosbags, and it is not installed",
            cure='Install it with truearm: pip install "truearm[ros]".',
        ) from error
    _refuse_no_bag(bag)
    try:
        # messages of bags older than ROS 2 Iron do not say what they hold; those that are read never changed
        with AnyReader([bag], default_typestore=get_typestore(Stores.LATEST)) as reader:
            yield reader
    except InputError:
        raise
    except Exception as error:  # of a damaged bag the library lets out errors of any kind
        message = " ".join(str(error).split())[:200] or type(error).__name__
        raise InputError(
            "the bag cannot be read",
            where=str(bag),
            came="a text that is no UTF-8" if "codec can't decode" in message else message,
            cure="Fix it with the tools of ROS ('rosbag reindex', 'ros2 bag reindex'), or record it again.",
        ) from error


def _refuse_no_bag(bag: Path) -> None:
    try:
        mode = bag.stat().st_mode
    except OSError as error:
        raise InputError("there is no such bag", where=str(bag)) from error
    if stat.S_ISDIR(mode):
        if not (bag / "metadata.yaml").is_file():
            raise InputError(
                "this folder is no bag of ROS 2",
                where=str(bag),
                came="no metadata.yaml in it",
                cure="Name the folder that 'ros2 bag record' wrote, or write metadata.yaml by 'ros2 bag reindex'.",
            )
    elif bag.suffix in (".db3", ".mcap"):
        raise InputError(
            "a bag of ROS 2 is a folder, and this is one of its files",
            where=str(bag),
            cure=f"Name the folder, {bag.resolve().parent}.",
        )
    elif bag.suffix != ".bag" or not stat.S_ISREG(mode):
        raise InputError(
            "this is no bag", where=str(bag), allowed="a file of ROS 1 that ends in .bag, or a folder of ROS 2"
        )


def _joint_topic(bag: Path, kinds: Mapping[str, str], wanted: str | None) -> str:
    topics = [topic for topic, kind in kinds.items() if kind == JOINTS]
    if wanted is not None:
        return _of_kind(bag, kinds, wanted, (JOINTS,), "joint_topic", topics)
    if not topics:
        raise InputError(
            "the bag has no joint positions",
            where=str(bag),
            came=_topics(kinds),
            allowed=f"a topic of {_ros_name(JOINTS)}",
            cure="Record the joint states along with the poses: /joint_states in most cells.",
        )
    if len(topics) > 1:
        raise InputError(
            "several topics hold joint positions",
            parameter="joint_topic",
            where=str(bag),
            came=listed(topics),
            cure="Say with `joint_topic` which of them is what the robot measured, not what it was commanded.",
        )
    return topics[0]


def _target_topics(bag: Path, kinds: Mapping[str, str], wanted: Mapping[str, str] | None) -> dict[str, str]:
    topics = [topic for topic, kind in kinds.items() if kind in SEEN]
    if wanted:
        return {name: _of_kind(bag, kinds, topic, tuple(SEEN), "targets", topics) for name, topic in wanted.items()}
    if not topics:
        raise InputError(
            "the bag has no topic with points or poses of a target",
            where=str(bag),
            came=_topics(kinds),
            allowed=listed([_ros_name(kind) for kind in SEEN]),
            cure="Record what the instrument or camera publishes, in one of these kinds with a header.",
        )
    if len(topics) > 1:
        raise InputError(
            "several topics hold points or poses",
            parameter="targets",
            where=str(bag),
            came=listed(topics),
            cure="Name with `targets` each one that an instrument measured. A pose that the controller "
            "computes from its joints is no measurement.",
        )
    return {topics[0].strip("/"): topics[0]}


def _of_kind(
    bag: Path, kinds: Mapping[str, str], topic: str, allowed: tuple[str, ...], parameter: str, topics: Sequence[str]
) -> str:
    if topic not in kinds:
        near = nearest_names(topic, topics)
        raise InputError(
            "the bag has no such topic",
            parameter=parameter,
            where=str(bag),
            came=topic,
            allowed=listed(topics) if topics else None,
            cure=f"Did you mean {' or '.join(near)}?" if near else None,
        )
    if kinds[topic] not in allowed:
        raise InputError(
            "this topic holds something else",
            parameter=parameter,
            where=f"{bag}, topic {topic}",
            came=_ros_name(kinds[topic]),
            allowed=listed([_ros_name(kind) for kind in allowed]),
        )
    return topic


def _topics(kinds: Mapping[str, str]) -> str:
    names = [f"{topic} ({_ros_name(kind)})" for topic, kind in sorted(kinds.items())]
    return listed(names) if names else "no topic at all"


def _ros_name(kind: str) -> str:
    return kind.replace("/msg/", "/")


def _messages(bag: Path, reader: Any, topic: str, times: Times) -> Iterator[tuple[int, Any]]:
    """Yield time [ns] and message of a topic in the order of recording; times never fall."""
    last = None
    for connection, recorded, raw in reader.messages(connections=reader.topics[topic].connections):
        message = reader.deserialize(raw, connection.msgtype)
        at = int(recorded)
        if times == "stamp":
            at = int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)
            if at == 0:
                raise InputError(
                    "a message has no time in its header",
                    parameter="times",
                    where=f"{bag}, topic {topic}",
                    came="stamp 0",
                    cure="Let the node that publishes it fill the stamp, or take the recorder's times: `times=bag`.",
                )
        if last is not None and at < last:
            raise InputError(
                "the times of the messages go back",
                parameter="times",
                where=f"{bag}, topic {topic}",
                came=f"{(last - at) * 1e-9:.6g} s back",
                cure="Only one node may publish a topic, and its clock must not be set while it is recorded. The "
                "recorder's times can be taken instead: `times=bag`.",
            )
        last = at
        yield at, message


def _read_joints(bag: Path, reader: Any, topic: str, wanted: Sequence[str] | None, times: Times) -> JointStream:
    names: tuple[str, ...] = tuple(wanted or ())
    at: array[int] = array("q")
    values = array("d")
    places: dict[tuple[str, ...], list[int]] = {}
    heard: dict[str, None] = {}
    for time, message in _messages(bag, reader, topic, times):
        named = tuple(message.name)
        if named not in places:
            heard |= dict.fromkeys(named)
            names = names or _in_order(bag, topic, named)
            places[named] = [named.index(name) for name in names] if set(names) <= set(named) else []
        if not places[named]:  # of a gripper, say
            continue
        if len(message.position) != len(named):
            raise InputError(
                "a message has another number of positions than of names",
                where=f"{bag}, topic {topic}",
                came=f"{len(message.position)} positions of {len(named)} joints",
            )
        at.append(time)
        values.extend(float(message.position[place]) for place in places[named])
    if not at:
        raise InputError(
            "no message holds all of these joints" if heard else "the topic of the joints has no message",
            parameter="joint_names" if heard else None,
            where=f"{bag}, topic {topic}",
            came=listed(names) if heard else None,
            allowed=listed(list(heard)) if heard else None,
        )
    positions = np.frombuffer(values).reshape(-1, len(names))
    if not np.isfinite(positions).all():
        row, joint = (int(i) for i in np.argwhere(~np.isfinite(positions))[0])
        raise InputError(
            "a joint position is no number",
            where=f"{bag}, topic {topic}, joint {names[joint]}",
            came=f"{positions[row, joint]} after {(at[row] - at[0]) * 1e-9:.3f} s",
        )
    return JointStream(topic, names, np.asarray(np.frombuffer(at, np.int64) - at[0], float) * 1e-9, positions, at[0])


def _in_order(bag: Path, topic: str, named: tuple[str, ...]) -> tuple[str, ...]:
    """Return the joints in the order of the numbers at their ends; the order in a message means nothing."""
    matches = [_NUMBERED.fullmatch(name) for name in named]
    numbers = {int(match["number"]): match[0] for match in matches if match is not None}
    stems = {match["stem"] for match in matches if match is not None}
    first = min(numbers, default=1)
    if None in matches or len(stems) != 1 or len(numbers) != len(named) or max(numbers) - first + 1 != len(named):
        raise InputError(
            "the joints' names do not tell their order",
            parameter="joint_names",
            where=f"{bag}, topic {topic}",
            came=listed(named),
            cure="Name the robot's joints from base to flange with `joint_names`; others are not read. The order in a "
            "message means nothing: many drivers sort by the alphabet.",
        )
    return tuple(numbers[number] for number in sorted(numbers))


def _read_target(bag: Path, reader: Any, target: str, topic: str, kind: str, times: Times, start: int) -> TargetStream:
    part = _part_of(kind)
    at: array[int] = array("q")
    values = array("d")
    frames: dict[str, None] = {}
    turned = kind != "geometry_msgs/msg/PointStamped"
    for time, message in _messages(bag, reader, topic, times):
        frames.setdefault(f"{message.header.frame_id}".strip() + _child(message))
        at.append(time)
        values.extend(part(message))
    place = f"{bag}, topic {topic}"
    if not at:
        raise InputError("the topic has no message", where=place)
    if len(frames) > 1:
        raise InputError(
            "the messages are of several frames",
            where=place,
            came=listed([repr(name) for name in frames]),
            allowed="one frame, that of the instrument, which stands still",
        )
    numbers = np.frombuffer(values).reshape(len(at), -1)
    seconds = np.asarray(np.frombuffer(at, np.int64) - start, float) * 1e-9
    whole = np.isfinite(numbers).all(axis=1)
    quaternions = _unit(numbers[whole, 3:], place) if turned else None
    frame = next(iter(frames))
    return TargetStream(
        target, topic, seconds[whole], numbers[whole, :3].copy(), quaternions, frame, int((~whole).sum())
    )


def _part_of(kind: str) -> Callable[[Any], tuple[float, ...]]:
    """Return what finds position and quaternion (w, x, y, z) in a message of a kind."""
    path = SEEN[kind]

    def pose_of(message: Any) -> tuple[float, ...]:
        for name in path:
            message = getattr(message, name)
        if kind == "geometry_msgs/msg/PointStamped":
            return message.x, message.y, message.z
        place, turn = (
            (message.translation, message.rotation)
            if kind == "geometry_msgs/msg/TransformStamped"
            else (message.position, message.orientation)
        )
        return place.x, place.y, place.z, turn.w, turn.x, turn.y, turn.z

    return pose_of


def _child(message: Any) -> str:
    child = getattr(message, "child_frame_id", "")
    return f" to {child}" if child else ""


def _unit(quaternions: Array, place: str) -> Array:
    length = np.linalg.norm(quaternions, axis=1)
    bad = np.abs(length - 1.0) > 1e-3
    if bad.any():
        raise InputError(
            "a quaternion does not have length 1",
            where=place,
            came=f"length {length[bad][0]:.6g}",
            allowed="1 within 0.001",
            cure="Publish a point where the instrument measures no orientation.",
        )
    return np.asarray(quaternions / length[:, None])
