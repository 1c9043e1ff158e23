"""Kinematics files of Universal Robots: read, placed on a robot of their type, and written."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
from pydantic import BaseModel

from truearm.engine.base.errors import InputError, counted, refusals_at
from truearm.engine.base.files import read_text, read_yaml
from truearm.engine.base.units import as_number, sized_si
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import ControllerKinematics
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.lines import at_zero, joint_axes
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.entries import STRICT, Number, checksum
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.robot.urdf_tree import product, roll_pitch_yaw
from truearm.engine.robot.urdf_writing import masses_left_out

# ``calibration.conf`` lies in the folder .urcontrol of the controller. Its section ``mounting`` has six numbers each
# that are added to theta, a, d and alpha of the type's table [rad and m] (forum.universal-robots.com, threads 538 and
# 18921). Axes 2, 3 and 4 are nearly parallel, so their common normals may lie anywhere: delta_d of tens of metres
# cancel.
#
# The ROS driver's file has the frame of each joint in that of the one before, its z along the joint's axis. The program
# that writes it gives angles of ``Rx(roll) Ry(pitch) Rz(yaw)`` (Universal_Robots_ROS2_Driver, ur_calibration,
# calibration.cpp), while a URDF, which they are put into, means ``Rz(yaw) Ry(pitch) Rx(roll)``. Which of them a file
# means shows: by the first, the pitch of three frames is that of a DH link, which is none.

#: Joints of an arm, and numbers of a list.
JOINTS: Final = 6
#: Columns of the table, the names of their lists and the units.
_DELTAS: Final = {
    "theta_offset": ("delta_theta", "rad"),
    "a": ("delta_a", "m"),
    "d": ("delta_d", "m"),
    "alpha": ("delta_alpha", "rad"),
}
_SECTION: Final = re.compile(r"\[(\w+)\]")
_ENTRY: Final = re.compile(r"(\w++)\s*+=\s*+(.*)")
#: What only the controller's own file has. It stands on one line: blank ones would be read again from each of them.
_CONF: Final = re.compile(r"^[ \t]*+(?:\[mounting\]|delta_\w++[ \t]*+=)", re.M)
#: What a controller says of its calibration: 2 is what it computes with.
_IN_USE: Final = "2"
#: Entries that say whose kinematics these are; how their values come about is not published.
_IDENTITY: Final[tuple[str, ...]] = ("joint_checksum", "calibration_status", "joint_selftest_data_crc")
#: Below this angle [rad] a frame is not pitched.
_NO_PITCH: Final = 1e-9
_CURE: Final = "Copy the file from the controller again, whole."
_ROS_CURE: Final = "Let the driver's program write the file again, and copy it whole."


@dataclass(frozen=True)
class FactoryKinematics:
    """What stands in a kinematics file."""

    path: Path  #: Of the file.
    #: What is added to a column of the type's table, six numbers each [rad and m]; empty if `frames` are given.
    deltas: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    #: Of each joint in the one before at zero joint positions, ``(6, 4, 4)`` [m]; None if `deltas` are given.
    frames: Array | None = None
    #: By what its maker knows it: checksums as they were read.
    identity: Mapping[str, str] = field(default_factory=dict)


def read_kinematics(path: Path) -> FactoryKinematics:
    """Read a ``calibration.conf``, or a kinematics file of the ROS driver.

    Raises:
        InputError: If it is neither, a part of it is missing or no number, or the controller does not use it.
    """
    text = read_text(path, "yaml_size")
    return _conf(text, path) if _CONF.search(text) else _ros(path)


def _conf(text: str, path: Path) -> FactoryKinematics:
    section, entries = "", dict[str, tuple[int, str]]()
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].strip()
        head, entry = _SECTION.fullmatch(words), _ENTRY.fullmatch(words)
        if head is not None:
            section = head[1]
        elif section in ("", "mounting") and entry is not None:
            if entry[1] in entries:
                raise InputError("an entry is given twice", where=f"{path}, line {number}", came=entry[1], cure=_CURE)
            entries[entry[1]] = (number, entry[2].strip())
    deltas = {}
    for column, (name, unit) in _DELTAS.items():
        if name not in entries:
            raise InputError(
                "a list is missing, so the file is not whole",
                where=str(path),
                came=", ".join(entries) or "no entries",
                allowed=f"{', '.join(listed for listed, _ in _DELTAS.values())}, of {JOINTS} numbers each",
                cure=_CURE,
            )
        deltas[column] = _numbers(*entries[name], name, unit, path)
    status = entries.get("calibration_status", (0, _IN_USE))
    if status[1] != _IN_USE:
        raise InputError(
            "the controller does not compute with these kinematics as they stand",
            where=f"{path}, line {status[0]}",
            came=f"calibration_status = {status[1]}",
            allowed=f"{_IN_USE}, linearised",
            cure="Let the arm be calibrated by its maker, and copy the file again.",
        )
    identity = {name: entries[name][1].strip("[] ") for name in _IDENTITY if name in entries}
    _check_identity(identity, path)
    return FactoryKinematics(path, deltas, None, identity)


def _numbers(line: int, text: str, name: str, unit: str, path: Path) -> tuple[float, ...]:
    where = f"{path}, line {line}, {name}"
    words = [word.strip() for word in text[1:-1].split(",")] if text[:1] == "[" and text[-1:] == "]" else []
    numbers = [as_number(word) for word in words]
    known = [number for number in numbers if number is not None]
    if len(words) != JOINTS or len(known) != JOINTS:
        raise InputError(
            "six numbers in brackets belong here",
            where=where,
            came=text,
            allowed="[joint 1, joint 2, ..., joint 6], in rad or m",
            cure=_CURE,
        )
    return tuple(sized_si(number, unit, where) for number in known)


class _Link(BaseModel):
    model_config = STRICT
    x: Number
    y: Number
    z: Number
    roll: Number
    pitch: Number
    yaw: Number


class _Chain(BaseModel):
    model_config = STRICT
    shoulder: _Link
    upper_arm: _Link
    forearm: _Link
    wrist_1: _Link
    wrist_2: _Link
    wrist_3: _Link
    hash: str = ""


class _RosFile(BaseModel):
    model_config = STRICT
    kinematics: _Chain


def _ros(path: Path) -> FactoryKinematics:
    chain = read_yaml(path, _RosFile).kinematics
    if not chain.hash:  # it is written last, and the driver compares it with that of the controller
        raise InputError(
            "the hash is missing, so the file is not whole",
            where=f"{path}, kinematics",
            allowed="hash: TEXT, as the driver's program writes it after the six links",
            cure=_ROS_CURE,
        )
    links = [chain.shoulder, chain.upper_arm, chain.forearm, chain.wrist_1, chain.wrist_2, chain.wrist_3]
    as_dh_links = all(abs(math.sin(link.pitch)) < _NO_PITCH for link in (links[1], links[4], links[5]))
    frames = np.tile(np.eye(4), (JOINTS, 1, 1))
    for frame, link in zip(frames, links, strict=True):
        x, y, z = _about(0, link.roll), _about(1, link.pitch), _about(2, link.yaw)
        frame[:3, :3] = x @ y @ z if as_dh_links else z @ y @ x
        frame[:3, 3] = [sized_si(value, "m", f"{path}, kinematics") for value in (link.x, link.y, link.z)]
    identity = {"hash": chain.hash}
    _check_identity(identity, path)
    return FactoryKinematics(path, {}, frames, identity)


def _about(axis: int, angle: float) -> Array:
    """Return the turn about an axis of a frame, ``(3, 3)``."""
    c, s = math.cos(angle), math.sin(angle)
    rotation = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    rotation[i, i] = rotation[j, j] = c
    rotation[i, j], rotation[j, i] = -s, s
    return rotation


def _check_identity(identity: Mapping[str, str], path: Path) -> None:
    for name, value in identity.items():
        with refusals_at(f"{path}, {name}"):
            checksum(value)


# Measured kinematics placed on the table of a robot's type, with every frame beside the nominal one.
#
# Masses, the capsules that keep an arm out of itself, and bearings are given in the frames of links. A DH table of a
# measured arm may have frames kilometres away, because the common normals of nearly parallel axes lie anywhere. So the
# frames are slid and turned along their joint axes until each stands where the next axis meets the plane through the
# frame before (Hayati and Mirmirani 1985), which is beside the nominal one. No pose changes by that.

#: An arm whose flange is farther from the nominal one on average [m] is of another type: measured ones are 1 to 3 mm.
MOST_APART: Final = 0.02
#: A flange that is turned more from the nominal one on average [rad] is that of no arm: measured ones are 0.3 to 0.41
#: deg, four of them.
MOST_TURNED: Final = math.radians(1.0)
#: Configurations at which flanges are compared.
_CONFIGURATIONS: Final = 300
#: Frames of links so near [m] and so little turned [rad] are the nominal ones with the errors of an arm: measured ones
#: are up to 4 mm and 0.6 deg.
_BESIDE: Final = (0.05, math.radians(2.0))
#: Conventions whose rows are the controller's own.
_TABLES: Final = ("standard-dh", "hayati")
#: Smaller [m, rad] is rounding.
_SAME: Final = 1e-9


def controller_robot(robot: Robot) -> Robot:
    """Return the robot that the controller computes with, where its rows are known; else `robot` itself.

    Its nominal values stay those of `robot`, and its values are the controller's: so it has a closed form to start
    from where `robot` has one.
    """
    rows = robot.controller.kinematics.rows
    return _with_rows(replace(robot, known={}), rows) if rows else robot


def with_kinematics(type_: Robot, factory: FactoryKinematics) -> Robot:
    """Return the robot of a type with the kinematics of a file as its values, and as those of its controller.

    The nominal values, masses, tools and limits are those of the type. The frames of links lie beside the type's.

    Raises:
        InputError: If the type is no arm of this maker's kind, its frames are not the controller's, or the file is of
            an arm with other joints.
    """
    plain = _plain(type_)
    if factory.frames is None:
        if any(joint.row.get("beta") for joint in plain.joints):
            raise InputError(
                "the file has differences to the table of a type, and this robot's table is no such one",
                where=type_.name,
                came="a table with a beta other than zero",
                cure="Give the type as the library has it.",
            )
        table = [
            {column: joint.row.get(column, 0.0) + factory.deltas[column][number] for column in factory.deltas}
            for number, joint in enumerate(plain.joints)
        ]
        measured = replace(plain, convention_name="standard-dh", joints=_joints(plain, table))
    else:
        measured = replace(plain, convention_name="urdf", joints=_joints(plain, [_origin(f) for f in factory.frames]))
    placed = converted(measured, "hayati")
    offset = np.abs(placed.base.matrix - np.eye(4)).max()
    if offset > _SAME or placed.flange != IDENTITY:
        raise InputError(
            "the first axis is not the z axis of the base frame, as it is in every arm of this kind",
            where=str(factory.path),
            cure="Take the file that the controller or its ROS driver wrote.",
        )
    rows = tuple({column: float(value) for column, value in joint.row.items()} for joint in placed.joints)
    kinematics = ControllerKinematics("own", rows, factory.path.name, factory.identity)
    return replace(
        _with_rows(replace(type_, known={}, proof=None), rows),
        title=f"{type_.title}, with the kinematics of its controller",
        controller=replace(type_.controller, kinematics=kinematics),
        history=(*type_.history, f"kinematics of the controller from {factory.path.name}"),
    )


def _with_rows(robot: Robot, rows: Sequence[Mapping[str, float]]) -> Robot:
    """Return a robot in nominal values with rows of the convention ``hayati`` as its values."""
    joints = tuple(
        replace(joint, row={**dict.fromkeys(row, 0.0), **joint.row})
        for joint, row in zip(robot.joints, rows, strict=True)
    )
    result = replace(robot, convention_name="hayati", joints=joints, truths={})
    return result.with_values(
        {f"{column}_{number}": value for number, row in enumerate(rows, 1) for column, value in row.items()}
    )


def refuse_far(robot: Robot, type_: Robot, where: str) -> None:
    """Refuse kinematics of an arm of another type than `type_`, or of none.

    Raises:
        InputError: With how far the flange is from the nominal one on average, or how far it is turned; or a link.
    """
    apart, turned = mean_distance(robot, type_), mean_angle(robot, type_)
    if not apart <= MOST_APART:
        raise InputError(
            "these are the kinematics of another type of robot",
            where=where,
            came=f"a flange {apart * 1e3:.4g} mm from that of {type_.name} on average",
            allowed=f"{MOST_APART * 1e3:g} mm",
            cure="Give the type that stands on the arm.",
        )
    if not turned <= MOST_TURNED:
        raise InputError(
            "the flange is turned as that of no arm of this type, so a number is wrong",
            where=where,
            came=f"a flange turned by {np.degrees(turned):.3g} deg from that of {type_.name} on average",
            allowed=f"{np.degrees(MOST_TURNED):.2g} deg",
            cure="Copy the file from the controller again, whole.",
        )
    pairs = zip(_link_frames(_bare(robot)), _link_frames(_plain(type_)), strict=True)
    for number, (ours, theirs) in enumerate(pairs, 1):
        gap = float(np.linalg.norm(ours[:3, 3] - theirs[:3, 3]))
        turned = float(_angles(ours[:3, :3], theirs[:3, :3]))
        if gap > _BESIDE[0] or turned > _BESIDE[1]:
            raise InputError(
                "the frame of a link does not come to lie beside the nominal one",
                where=f"{where}, link {number}",
                came=f"{gap * 1e3:.4g} mm and {np.degrees(turned):.3g} deg from that of {type_.name}",
                allowed=f"{_BESIDE[0] * 1e3:g} mm, {np.degrees(_BESIDE[1]):.2g} deg",
                cure="Give the type with the table that its maker publishes, as the library has it.",
            )


def mean_distance(robot: Robot, type_: Robot) -> float:
    """Return how far the flange of an arm is from that of a type on average, at random joint positions [m]."""
    (ours, _), (theirs, _) = _flanges(robot, type_)
    return float(np.linalg.norm(ours - theirs, axis=1).mean())


def mean_angle(robot: Robot, type_: Robot) -> float:
    """Return how far the flange of an arm is turned from that of a type on average, at random joint positions [rad]."""
    (_, ours), (_, theirs) = _flanges(robot, type_)
    return float(_angles(ours, theirs).mean())


def _flanges(own: Robot, type_: Robot) -> list[tuple[Array, Array]]:
    """Return positions ``(n, 3)`` [m] and rotations ``(n, 3, 3)`` of the flange of both, at random joint positions."""
    joints = np.random.default_rng(0).uniform(-np.pi, np.pi, (_CONFIGURATIONS, JOINTS))
    plain = _plain(type_)  # refuses a type of another kind before anything is compared
    return [robot.world_poses(joints) for robot in (_bare(own), plain)]


def _angles(ours: Array, theirs: Array) -> Array:
    """Return the angles between rotations ``(..., 3, 3)`` [rad]."""
    traces = np.einsum("...ij,...ij->...", ours, theirs)
    return np.asarray(np.arccos(np.clip((traces - 1.0) / 2.0, -1.0, 1.0)), float)


def _plain(type_: Robot) -> Robot:
    """Return the bare table of a type: nominal, at the origin, without masses and effects."""
    if len(type_.joints) != JOINTS or any(joint.kind != "revolute" for joint in type_.joints):
        raise InputError(
            "an arm of another kind is given as the type",
            where=type_.name,
            came=counted(len(type_.joints), "joint"),
            allowed="six joints that turn",
        )
    frames = (type_.controller.base, type_.controller.flange, type_.flange)
    if type_.convention_name not in _TABLES or any(frame != IDENTITY for frame in frames):
        raise InputError(
            "the type must have the table and the frames of its controller",
            where=type_.name,
            came=f"convention {type_.convention_name}"
            + (", with frames of its own" if type_.convention_name in _TABLES else ""),
            allowed=f"{' or '.join(_TABLES)}, base and flange as the controller has them",
            cure="Give the type as the library has it.",
        )
    return _bare(replace(type_, known={}))


def _bare(robot: Robot) -> Robot:
    """Return the geometry of an arm as it is: at the origin, without masses, effects and what is beside it."""
    return replace(
        robot,
        effect_names=(),
        base_quaternion=IDENTITY.quaternion,
        known={name: p for name, p in robot.known.items() if p.group in ("geometry", "joint zero")},
        targets=(),
        fixtures=(),
        masses=(),
        truths={},
        proof=None,
    )


def _joints(robot: Robot, rows: list[dict[str, float]]) -> tuple[Joint, ...]:
    return tuple(replace(joint, row=row) for joint, row in zip(robot.joints, rows, strict=True))


def _origin(frame: Array) -> dict[str, float]:
    angles = zip(("roll", "pitch", "yaw"), roll_pitch_yaw(frame[:3, :3]), strict=True)
    x, y, z = (float(value) for value in frame[:3, 3])
    return {"x": x, "y": y, "z": z, **dict(angles)}


def _link_frames(robot: Robot) -> list[Array]:
    passed = list(robot.base_elements)
    frames = []
    for link in robot.link_elements:
        passed += link
        frames.append(at_zero(robot, passed))
    return frames


#: The links of the file, from the base on; each has the frame of the joint before it.
LINKS: Final = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
#: Angles between neighbouring axes [deg] of an arm of this kind, and by how much they may differ.
_BETWEEN: Final = (90.0, 0.0, 0.0, 90.0, 90.0)
_WITHIN: Final = 10.0
#: A flange less than this [m, rad] beside the last frame is there.
_SAME_WRITING: Final = 1e-7
#: What the file is, as a sentence begins.
KINEMATICS_FILE: Final = "A kinematics file"


def kinematics_text(robot: Robot) -> tuple[str, list[str]]:
    """Return the geometry of a robot as it is now, joint zeros included, as a file of the ROS driver.

    Args:
        robot: With its base frame as the world.

    Returns:
        text, left_out: The file without comments, and in words what it cannot hold beside what no table of an arm can.

    Raises:
        InputError: If the robot is no arm of this kind.
    """
    _refuse_other_arm(robot)
    frames, behind = _frames(robot)
    lines = ["kinematics:"]
    for link, frame in zip(LINKS, frames, strict=True):
        numbers = [*frame[:3, 3], *roll_pitch_yaw(frame[:3, :3])]
        entries = zip(("x", "y", "z", "roll", "pitch", "yaw"), numbers, strict=True)
        lines += [f"  {link}:", *(f"    {name}: {_number(value)}" for name, value in entries)]
    messages = [
        *masses_left_out(robot, KINEMATICS_FILE),
        *_flange_left_out(behind),
        f"{KINEMATICS_FILE} of the factory has the hash of what the controller has. The hash of this one is that of "
        "its own numbers: the driver says that they are not the controller's, which is true.",
    ]
    text = "\n".join(lines)
    return f"{text}\n  hash: truearm_{hashlib.sha256(text.encode()).hexdigest()[:16]}\n", messages


def _refuse_other_arm(robot: Robot) -> None:
    axes = joint_axes(robot) if all(joint.kind == "revolute" for joint in robot.joints) else []
    between = [float(np.degrees(axis.angle(other))) for axis, other in pairwise(axes)]
    if len(axes) == JOINTS and all(abs(a - b) < _WITHIN for a, b in zip(between, _BETWEEN, strict=True)):
        return
    raise InputError(
        "this is no arm of the kind that the format describes",
        where=robot.name,
        came=counted(len(robot.joints), "joint")
        + (f", axes {', '.join(f'{angle:.0f}' for angle in between)} deg apart" if between else ""),
        allowed="six joints that turn, axes 90, 0, 0, 90, 90 deg apart, as arms of Universal Robots have them",
        cure="Take another format, such as urdf.",
    )


def _frames(robot: Robot) -> tuple[list[Array], Array]:
    """Return the frame of each joint in the one before, and of the controller's flange in the last, ``(4, 4)`` each.

    A joint's frame is slid along its axis by d, to where the next link begins.
    """
    table = converted(robot, "hayati")
    frames, behind = [], np.linalg.inv(robot.controller.base.matrix) @ table.base.matrix
    for link in table.link_elements:  # Rz(theta) Tz(d), and then what leads to the next axis
        turn, slide, *rest = (replace(element, variable=None) for element in link)
        frames.append(behind @ product([turn, slide], table.values))
        behind = product(rest, table.values)
    return frames, behind @ table.flange.matrix @ robot.controller.flange.matrix


def _flange_left_out(behind: Array) -> list[str]:
    gap = float(np.linalg.norm(behind[:3, 3]))
    turned = float(np.arccos(np.clip((np.trace(behind[:3, :3]) - 1.0) / 2.0, -1.0, 1.0)))
    if gap < _SAME_WRITING and turned < _SAME_WRITING:
        return []
    return [
        f"{KINEMATICS_FILE} cannot hold a flange beside the last axis; left out: {gap * 1e3:.4g} mm and "
        f"{np.degrees(turned):.4g} deg, which belong to the tool."
    ]


def _number(value: float) -> str:
    """Return a number as YAML has it; the roundings of right angles are written as the zeros they stand for."""
    return repr(0.0 if abs(value) < 1e-15 else float(value))
