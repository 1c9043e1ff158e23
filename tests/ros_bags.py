"""Bags as a cell records them, written by rosbags: joint states, and a target that an instrument sees."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import quaternion_from_rotation

NAMES = tuple(f"joint_{number}" for number in range(1, 7))
#: The five configurations [deg].
STOPS = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 30.0, 0.0],
        [20.0, 10.0, -10.0, 15.0, 40.0, 30.0],
        [-30.0, 20.0, 5.0, -40.0, 60.0, -20.0],
        [10.0, -15.0, 20.0, 60.0, -30.0, 45.0],
        [35.0, 5.0, 15.0, -20.0, 50.0, 0.0],
    ]
)
_START = 1_700_000_000.0

Message = tuple[str, str, float, dict[str, Any]]


def recorded(
    *,
    stand: float = 2.0,
    move: float = 1.0,
    joint_rate: float = 100.0,
    pose_rate: float = 20.0,
    noise: float = 2e-5,
    late: float = 0.0,
    seed: int = 3,
) -> tuple[Array, Array, Array, Array, Array]:
    """Return times [s] and joints [rad], and times, positions [m] and quaternions of the flange.

    `late` is how far the clock of the instrument is behind [s].
    """
    rng = np.random.default_rng(seed)
    stops = np.radians(STOPS)

    def joints_at(times: Array) -> Array:
        part = times / (stand + move)
        number = np.minimum(part.astype(int), len(stops) - 1)
        after = np.minimum(number + 1, len(stops) - 1)
        share = np.clip((times - number * (stand + move) - stand) / move, 0.0, 1.0)[:, None]
        smooth = share * share * (3.0 - 2.0 * share)
        return np.asarray(stops[number] + smooth * (stops[after] - stops[number]))

    whole = len(stops) * (stand + move) - move
    times = np.arange(0.0, whole, 1.0 / joint_rate)
    seen = np.arange(0.0, whole, 1.0 / pose_rate) + 1e-3
    joints = joints_at(times) + rng.normal(0.0, 1e-5, (len(times), 6))
    places, R = load_robot("irb120").forward(joints_at(np.minimum(seen + late, whole)))
    positions = places + rng.normal(0.0, noise, (len(seen), 3))
    turns = Rotation.from_rotvec(rng.normal(0.0, 1e-4, (len(seen), 3))).as_matrix() @ R
    return times, joints, seen, positions, quaternion_from_rotation(turns)


def joint_messages(
    times: Array,
    joints: Array,
    names: Sequence[str] = NAMES,
    order: Sequence[int] = range(6),
    topic: str = "/joint_states",
) -> list[Message]:
    """Return joint states; `order` is that of the joints in the messages."""
    return [
        (
            topic,
            "sensor_msgs/msg/JointState",
            time,
            {
                "name": [names[i] for i in order],
                "position": row[list(order)],
                "velocity": np.zeros(0),
                "effort": np.zeros(0),
            },
        )
        for time, row in zip(times.tolist(), joints, strict=True)
    ]


def target_messages(
    times: Array,
    positions: Array,
    quaternions: Array | None = None,
    topic: str = "/tracker/pose",
    kind: str = "PoseStamped",
    frame: str = "tracker",
) -> list[Message]:
    """Return what an instrument sees."""
    rows = np.column_stack([positions, np.zeros((len(times), 0)) if quaternions is None else quaternions])
    return [
        (topic, f"geometry_msgs/msg/{kind}", time, {"row": row.tolist(), "frame": frame})
        for time, row in zip(times.tolist(), rows, strict=True)
    ]


def write_ros2(folder: Path, messages: Sequence[Message], *, mcap: bool = False, stamped: bool = True) -> Path:
    """Write a bag of ROS 2."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    plugin = StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
    with Writer2(folder, version=9, storage_plugin=plugin) as writer:
        _write(writer, store, messages, store.serialize_cdr, stamped)
    return folder


def write_ros1(file: Path, messages: Sequence[Message], *, stamped: bool = True) -> Path:
    """Write a bag of ROS 1, in the place of an older one."""
    file.unlink(missing_ok=True)
    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer1(file) as writer:
        _write(writer, store, messages, store.serialize_ros1, stamped)
    return file


def _write(writer: Any, store: Any, messages: Sequence[Message], serialize: Callable[..., Any], stamped: bool) -> None:
    topics: dict[str, Any] = {}
    for topic, kind, time, content in sorted(messages, key=lambda message: message[2]):
        if topic not in topics:
            topics[topic] = writer.add_connection(topic, kind, typestore=store)
        at = round((_START + time) * 1e9)
        message = _message(store, kind, content, at if stamped else 0)
        writer.write(topics[topic], at, serialize(message, kind))


def _message(store: Any, kind: str, content: dict[str, Any], at: int) -> Any:
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=at // 10**9, nanosec=at % 10**9)
    header_type = types["std_msgs/msg/Header"]
    more = {"seq": 0} if "seq" in header_type.__dataclass_fields__ else {}
    header = header_type(stamp=stamp, frame_id=content.get("frame", ""), **more)
    if kind == "sensor_msgs/msg/JointState":
        return types[kind](header=header, **content)
    if kind == "std_msgs/msg/String":
        return types[kind](data="words")
    row = content["row"]
    point = types["geometry_msgs/msg/Point"](*row[:3])
    if kind == "geometry_msgs/msg/PointStamped":
        return types[kind](header=header, point=point)
    w, x, y, z = row[3:]
    turn = types["geometry_msgs/msg/Quaternion"](x, y, z, w)
    if kind == "geometry_msgs/msg/TransformStamped":
        moved = types["geometry_msgs/msg/Transform"](types["geometry_msgs/msg/Vector3"](*row[:3]), turn)
        return types[kind](header=header, child_frame_id="tip", transform=moved)
    pose = types["geometry_msgs/msg/Pose"](position=point, orientation=turn)
    if kind == "geometry_msgs/msg/PoseWithCovarianceStamped":
        pose = types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36))
    return types[kind](header=header, pose=pose)
