"""Kinematics files of Universal Robots: what stands in them, before it is placed on a robot.

``calibration.conf`` lies in the folder .urcontrol of the controller. Its section ``mounting`` has six numbers each that
are added to theta, a, d and alpha of the type's table [rad and m] (forum.universal-robots.com, threads 538 and 18921).
Axes 2, 3 and 4 are nearly parallel, so their common normals may lie anywhere: delta_d of tens of metres cancel.

The ROS driver's file has the frame of each joint in that of the one before, its z along the joint's axis. The program
that writes it gives angles of ``Rx(roll) Ry(pitch) Rz(yaw)`` (Universal_Robots_ROS2_Driver, ur_calibration,
calibration.cpp), while a URDF, which they are put into, means ``Rz(yaw) Ry(pitch) Rx(roll)``. Which of them a file
means shows: by the first, the pitch of three frames is that of a DH link, which is none.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from pydantic import BaseModel

from truearm.errors import InputError, refusals_at
from truearm.files import read_text, read_yaml
from truearm.modeling.chain import Array
from truearm.modeling.formats.entries import STRICT, Number, checksum
from truearm.units import as_number, sized_si

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
    section, found = "", dict[str, tuple[int, str]]()
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].strip()
        head, entry = _SECTION.fullmatch(words), _ENTRY.fullmatch(words)
        if head is not None:
            section = head[1]
        elif section in ("", "mounting") and entry is not None:
            if entry[1] in found:
                raise InputError("an entry is given twice", where=f"{path}, line {number}", came=entry[1], cure=_CURE)
            found[entry[1]] = (number, entry[2].strip())
    deltas = {}
    for column, (name, unit) in _DELTAS.items():
        if name not in found:
            raise InputError(
                "a list is missing, so the file is not whole",
                where=str(path),
                came=", ".join(found) or "no entries",
                allowed=f"{', '.join(listed for listed, _ in _DELTAS.values())}, of {JOINTS} numbers each",
                cure=_CURE,
            )
        deltas[column] = _numbers(*found[name], name, unit, path)
    status = found.get("calibration_status", (0, _IN_USE))
    if status[1] != _IN_USE:
        raise InputError(
            "the controller does not compute with these kinematics as they stand",
            where=f"{path}, line {status[0]}",
            came=f"calibration_status = {status[1]}",
            allowed=f"{_IN_USE}, linearised",
            cure="Let the arm be calibrated by its maker, and copy the file again.",
        )
    identity = {name: found[name][1].strip("[] ") for name in _IDENTITY if name in found}
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
    made = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    made[i, i] = made[j, j] = c
    made[i, j], made[j, i] = -s, s
    return made


def _check_identity(identity: Mapping[str, str], path: Path) -> None:
    for name, value in identity.items():
        with refusals_at(f"{path}, {name}"):
            checksum(value)
