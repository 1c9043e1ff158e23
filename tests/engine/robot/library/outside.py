"""Poses from outside that the arms of the library are held against, and how far an arm reaches.

A file of ``outside`` holds poses of a public URDF, computed once with Pinocchio by outside_poses.py.
Where the URDF counts joints or has frames otherwise than the library's model:

``joints``
    ``signs`` and ``zeros`` [deg]: the URDF's joint is sign times the model's, plus zero.
``model_base``
    The model's base frame, seen in the URDF's link ``base``.
``model_flange``
    The URDF's link ``tip``, seen in the model's flange frame.
``limits_differ``
    Why the library has other limits than the URDF.
``reason``
    Why joints or frames differ.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

FOLDER = Path(__file__).with_name("outside")


@dataclass(frozen=True)
class Outside:
    """What a file says: joint positions of the model (n, joints) [rad], and poses (n, 4, 4) of its flange [m].

    `urdf_poses` are as the URDF has them, of its link `tip` in its link `base`.
    """

    robot: str
    source: dict[str, str]
    base: str
    tip: str
    signs: tuple[int, ...]
    limits: Array
    limits_differ: str
    reason: str
    differs: bool
    joints: Array
    poses: Array
    urdf_poses: Array


def known() -> list[str]:
    """Return the ids of the arms that have a file."""
    return sorted(path.name.removesuffix(".yaml") for path in FOLDER.glob("*.yaml"))


def read(robot_id: str) -> Outside:
    """Read a file, in joints and frames of the model."""
    content: dict[str, Any] = YAML(typ="safe").load((FOLDER / f"{robot_id}.yaml").read_text("utf-8"))
    entries = {"robot", "source", "base", "tip", "joints", "model_base", "model_flange", "reason", "limits", "poses"}
    assert content.keys() <= entries | {"limits_differ"}
    counted = np.array([pose["joints"] for pose in content["poses"]], float)
    count = counted.shape[1]
    signs = np.array(content.get("joints", {}).get("signs", [1] * count), float)
    zeros = np.array(content.get("joints", {}).get("zeros", [0] * count), float)
    assert set(signs.tolist()) <= {1.0, -1.0}
    limits = np.sort(signs[:, None] * (np.array(content["limits"], float) - zeros[:, None]), axis=1)
    base, flange = (_matrix(content.get(name, {})) for name in ("model_base", "model_flange"))
    places = [{"translation": pose["position"], "quaternion": pose["quaternion"]} for pose in content["poses"]]
    stored = np.array([_matrix(place) for place in places])
    return Outside(
        robot=content["robot"],
        source=content["source"],
        base=content["base"],
        tip=content["tip"],
        signs=tuple(int(sign) for sign in signs),
        limits=np.radians(limits),
        limits_differ=content.get("limits_differ", ""),
        reason=content.get("reason", ""),
        differs=bool({"joints", "model_base", "model_flange"} & content.keys()),
        joints=np.radians(signs * (counted - zeros)),
        poses=np.linalg.inv(base) @ stored @ np.linalg.inv(flange),
        urdf_poses=stored,
    )


def _matrix(place: dict[str, list[float]]) -> Array:
    x, y, z = (v / 1e3 for v in place.get("translation", (0.0, 0.0, 0.0)))
    q = np.array(place.get("quaternion", (1.0, 0.0, 0.0, 0.0)), float)
    w, i, j, k = (q / np.linalg.norm(q)).tolist()
    matrix = np.eye(4)
    matrix[:3, :3] = Transform((0.0, 0.0, 0.0), (w, i, j, k)).rotation
    matrix[:3, 3] = x, y, z
    return matrix


def largest_reach(robot: Robot) -> float:
    """Return how far from the line of its axis the point of a robot's reach comes within the limits [m].

    The best of configurations drawn within the limits are moved along each joint and along directions drawn at random,
    in steps that are halved where none leads further.
    """
    joints = robot.random_configurations(1000, np.random.default_rng(0))
    best = np.argsort(-_distances(robot, joints))[:4]
    return max(_climbed(robot, q) for q in joints[best])


def _climbed(robot: Robot, q: Array) -> float:
    low, high = np.array([joint.range for joint in robot.joints]).T
    rng = np.random.default_rng(1)
    each = np.vstack([np.eye(len(low)), -np.eye(len(low))])
    furthest, step = 0.0, np.radians(20.0)
    while step > 1e-3:
        tried = np.clip(q + step * np.vstack([each, rng.normal(size=(40, len(low)))]), low, high)
        distances = _distances(robot, tried)
        if distances.max() > furthest + 1e-6:
            q, furthest = tried[distances.argmax()], float(distances.max())
        else:
            step /= 2.0
    return furthest


def _distances(robot: Robot, joints: Array) -> Array:
    """Return how far the point of the reach is from the line of its axis (n,) [m]."""
    reach = robot.reach
    assert reach is not None
    assert reach.axis is not None
    flange, _ = robot.world_poses(joints)
    jacobian = robot.joint_jacobian(joints)
    directions = jacobian[:, 3:].transpose(2, 0, 1)
    # A turn about an axis moves the flange by axis x (flange - origin): so this point is on the axis.
    origins = flange + np.cross(directions, jacobian[:, :3].transpose(2, 0, 1))
    point = flange if reach.point == "flange" else _nearest(origins[-1], directions[-1], origins[-2], directions[-2])
    away = point - origins[reach.axis - 1]
    along = directions[reach.axis - 1]
    across: Array = away - (away * along).sum(axis=-1, keepdims=True) * along
    return np.array(np.linalg.norm(across, axis=-1))


def _nearest(origin: Array, direction: Array, other: Array, other_direction: Array) -> Array:
    """Return the point of a line that is nearest to another one (n, 3), which must not be parallel to it."""
    normal = np.cross(direction, other_direction)
    square = (normal * normal).sum(axis=-1, keepdims=True)
    assert (square > 1e-6).all()
    along = (np.cross(other - origin, other_direction) * normal).sum(axis=-1, keepdims=True) / square
    return np.array(origin + along * direction)
