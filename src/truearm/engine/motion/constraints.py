"""Where an arm may be measured: limits, loads, places, lines of sight (Nubiola, section 2.5)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from truearm.engine.base.errors import InputError, is_one_line, refusals_at
from truearm.engine.base.files import read_yaml
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.units import sized_si
from truearm.engine.motion.cell import refuse_clearance, smallest_clearance
from truearm.engine.robot.chain import Array
from truearm.engine.robot.loads import joint_loads
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot

Allowed = NDArray[np.bool_]
_Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
_Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)]
_Range = tuple[_Number, _Number]
_Vector = tuple[_Number, _Number, _Number]
_JointNumber = Annotated[int, Field(strict=True, ge=1)]
_CLOSED: Final = ConfigDict(extra="forbid", frozen=True)


def _one_line(name: str) -> str:
    if not is_one_line(name):
        raise InputError("a name belongs here", came=name, allowed="one line of text without control characters")
    return name


_Name = Annotated[str, Field(strict=True), AfterValidator(_one_line)]


class _Units(BaseModel):
    model_config = _CLOSED
    length: Literal["mm", "m", "um", "in"]
    angle: Literal["deg", "rad"]


class Box(BaseModel):
    """Where the flange or all targets must be, in the base frame."""

    model_config = _CLOSED
    of: Literal["flange", "targets"]  #: What must be in it.
    x: _Range | None = None  #: x, y, z: lowest and highest coordinate; any if left out.
    y: _Range | None = None
    z: _Range | None = None


class KeptOut(BaseModel):
    """A box that the arm stays out of, in the base frame."""

    model_config = _CLOSED
    x: _Range | None = None  #: x, y, z: lowest and highest coordinate; without end if left out.
    y: _Range | None = None
    z: _Range | None = None


class Visibility(BaseModel):
    """Which way targets must look: all that are named, into the instrument."""

    model_config = _CLOSED
    within: _Positive  #: How far a target may look past the instrument.
    #: Direction in which each target looks, in the flange frame.
    targets: Annotated[dict[str, _Vector], Field(min_length=1)]
    #: Place of the instrument in the base frame; the origin of the world for a robot with its own targets.
    instrument: _Vector | None = None

    @model_validator(mode="after")
    def _directions(self) -> Visibility:
        for name, direction in self.targets.items():
            if not any(direction):
                raise InputError("a direction cannot be zero", came=f"{name}: {list(direction)}")
        return self


class Constraints(BaseModel):
    """Schema ``truearm-constraints/1``."""

    model_config = _CLOSED
    truearm: Literal["truearm-constraints/1"]
    units: _Units
    #: Lowest and highest joint position by joint number, within the robot's own limits.
    limits: dict[_JointNumber, _Range] = {}
    #: Sign of the moment of the load about a joint's axis, by joint number.
    moments: dict[_JointNumber, Literal["positive", "negative"]] = {}
    box: Box | None = None  #: A box for the flange or the targets.
    floor: _Number | None = None  #: Lowest height of targets, flange and joints from the third on, in the base frame.
    visibility: Visibility | None = None  #: Which way the targets must look.
    clearance: _Positive | None = None  #: Smallest distance between the middle lines of links that are not neighbours.
    keep_out: dict[_Name, KeptOut] = {}  #: Boxes that the arm stays out of, by name.


def read_constraints(path: Path) -> Constraints:
    """Read a constraints file."""
    return read_yaml(path, Constraints)


def allowed(
    robot: Robot, postures: Postures, constraints: Constraints | None, where: str, *, seen_from_the_origin: bool
) -> Mapping[str, Allowed]:
    """Return for each constraint at which postures it is kept, ``(n,)``; every one is asked about all postures.

    Args:
        robot: With targets.
        constraints: None leaves the robot's own limits alone.
        where: The constraints file, for messages.
        seen_from_the_origin: Whether the instrument stands at the origin of the robot's world, unless the constraints
            say where.

    Raises:
        InputError: For a joint or target that the robot does not have, a range the wrong way round, a moment of a robot
            without masses, or an instrument whose place nobody knows.
    """
    q = postures.joints
    world = robot.base
    robot = at_the_origin(robot)
    low, high = limits_of(robot, constraints, where)
    masks: dict[str, Allowed] = {"limits": np.asarray(((q >= low) & (q <= high)).all(axis=1))}
    if constraints is None:
        return masks
    length = constraints.units.length
    if constraints.moments:
        if not robot.masses and not robot.payload.mass:
            raise InputError(
                "the robot has no masses, so its joints carry no loads",
                where=f"{where}, moments",
                cure="Give the masses of its links in the robot file, or a payload.",
            )
        loads = joint_loads(robot, robot.variables(postures, robot.values), wrench=_columns(postures.wrench))
        for number, sign in constraints.moments.items():
            joint = _joint(robot, number, f"{where}, moments")
            row = 5 if robot.joints[joint].kind == "revolute" else 2
            masks[f"moment_{number}"] = np.asarray(loads[joint, row] * (1.0 if sign == "positive" else -1.0) > 0.0)
    targets = [robot.world_poses(postures, target.name)[0] for target in robot.targets]
    if constraints.box is not None:
        if constraints.box.of == "targets" and not targets:
            raise InputError(
                "the box is for targets, and the robot has none",
                where=f"{where}, box",
                allowed="of: flange",
                cure="Write of: flange, or give a robot file that has the targets.",
            )
        points = targets if constraints.box.of == "targets" else [robot.world_poses(postures)[0]]
        masks["box"] = _in_box(constraints.box, points, length, f"{where}, box")
    if constraints.floor is not None:
        height = sized_si(constraints.floor, length, f"{where}, floor")
        kinematics = robot.forward_kinematics(postures)
        joints = [kinematics.origin(element).T for element in robot.moving[2 : len(robot.joints)]]
        masks["floor"] = np.all(
            [points[:, 2] >= height for points in (*joints, kinematics.position.T, *targets)], axis=0
        )
    if constraints.visibility is not None:
        origin = -world.rotation.T @ np.array(world.translation) if seen_from_the_origin else None
        masks |= _visible(robot, postures, constraints.visibility, constraints.units, f"{where}, visibility", origin)
    if constraints.clearance is not None:
        least = sized_si(constraints.clearance, length, f"{where}, clearance")
        masks["clearance"] = smallest_clearance(robot, postures, least) >= least
    return masks


def refuse_clearance_of(robot: Robot, constraints: Constraints | None, where: str) -> None:
    """Refuse a clearance of the constraints that would say nothing of links that can meet.

    See :func:`.refuse_clearance` of the cell; `robot` has its targets, `where` names the constraints file.
    """
    if constraints is not None and constraints.clearance is not None:
        place = f"{where}, clearance"
        least = sized_si(constraints.clearance, constraints.units.length, place)
        refuse_clearance(at_the_origin(robot), least, *limits_of(robot, constraints, where), place)


def limits_of(robot: Robot, constraints: Constraints | None, where: str) -> tuple[Array, Array]:
    """Return lowest and highest joint positions that the robot and the constraints allow, each ``(joints,)``.

    They are infinite where nothing is said.

    Raises:
        InputError: For a joint that the robot does not have, or a range the wrong way round.
    """
    low, high = np.array([joint.limits or (-np.inf, np.inf) for joint in robot.joints]).T
    if constraints is None:
        return low, high
    for number, limits in constraints.limits.items():
        joint = _joint(robot, number, f"{where}, limits")
        unit = constraints.units.angle if robot.joints[joint].kind == "revolute" else constraints.units.length
        first, last = _range(limits, unit, f"{where}, limits, {number}")
        low[joint], high[joint] = max(low[joint], first), min(high[joint], last)
    return low, high


def keep_out(constraints: Constraints, where: str) -> dict[str, tuple[Array, Array]]:
    """Return lowest and highest corner of each box that the arm stays out of [m], infinite where it does not end.

    Raises:
        InputError: For a range the wrong way round, and for a box without any.
    """
    refuse_beyond("keep_out", len(constraints.keep_out), where=f"{where}, keep_out")
    corners = {}
    for name, box in constraints.keep_out.items():
        ranges = (box.x, box.y, box.z)
        if all(span is None for span in ranges):
            raise InputError(
                "a box to keep out of that has no end leaves no room",
                where=f"{where}, keep_out, {name}",
                allowed="x, y or z: [lowest, highest]",
            )
        ends = [
            (-np.inf, np.inf)
            if span is None
            else _range(span, constraints.units.length, f"{where}, keep_out, {name}, {'xyz'[axis]}")
            for axis, span in enumerate(ranges)
        ]
        low, high = np.array(ends).T
        corners[name] = (low, high)
    return corners


def _joint(robot: Robot, number: int, where: str) -> int:
    if number > len(robot.joints):
        raise InputError("the robot has no such joint", where=where, came=number, allowed=f"1 to {len(robot.joints)}")
    return number - 1


def _range(ends: tuple[float, float], unit: str, where: str) -> tuple[float, float]:
    low, high = (sized_si(value, unit, where) for value in ends)
    if low > high:
        raise InputError("the range is empty", where=where, cure="The lower one comes first.")
    return low, high


def _columns(wrench: Array | None) -> Array | None:
    return None if wrench is None else wrench.T


def _in_box(box: Box, points: list[Array], length: str, where: str) -> Allowed:
    inside = np.ones(len(points[0]), dtype=bool)
    for axis, span in enumerate((box.x, box.y, box.z)):
        if span is not None:
            low, high = _range(span, length, f"{where}, {'xyz'[axis]}")
            for point in points:
                inside &= (point[:, axis] >= low) & (point[:, axis] <= high)
    return inside


def _visible(
    robot: Robot, postures: Postures, rule: Visibility, units: _Units, where: str, origin: Array | None
) -> dict[str, Allowed]:
    """Ask each target; `origin` is that of the world in the base frame, where the instrument may stand."""
    if rule.instrument is not None:
        instrument = np.array([sized_si(v, units.length, f"{where}, instrument") for v in rule.instrument])
    elif origin is not None:
        instrument = origin
    else:
        raise InputError(
            "the position of the instrument is not known",
            where=where,
            cure="Add instrument: [x, y, z] in the robot's base frame, or take a calibrated robot.",
        )
    within = sized_si(rule.within, units.angle, f"{where}, within")
    rotation = robot.world_poses(postures)[1]
    by_target = {}
    for name, direction in rule.targets.items():
        with refusals_at(f"{where}, targets"):
            robot.target(name)
        looks = rotation @ (np.array(direction) / np.linalg.norm(direction))
        sight = instrument - robot.world_poses(postures, name)[0]
        cosine = np.einsum("ni,ni->n", looks, sight) / np.linalg.norm(sight, axis=1)
        by_target[f"visibility_{name}"] = np.asarray(cosine >= np.cos(within))
    return by_target


def at_the_origin(robot: Robot) -> Robot:
    """Return the robot in a world that is its base frame."""
    places = {f"base_{axis}": 0.0 for axis in ("x", "y", "z", "rx", "ry", "rz")}
    return replace(robot, base_quaternion=(1.0, 0.0, 0.0, 0.0)).with_values(places)


def joint_window(
    robot: Robot, constraints: Constraints | None = None, where: str = "constraints"
) -> tuple[Array, Array]:
    """Return lowest and highest joint positions to draw from [rad or m], each ``(joints,)``.

    A joint that can turn further than once is kept to one turn, from -180 to 180 deg where its limits have that: the
    arm reaches the same poses, and cables and hoses are not wound up.

    Raises:
        InputError: If the constraints leave a joint nothing, or name one that the robot does not have.
    """
    first, last = limits_of(robot, constraints, where)
    low, high = np.empty_like(first), np.empty_like(last)
    for k, joint in enumerate(robot.joints):
        lowest, highest = joint.range
        low[k], high[k] = max(lowest, first[k]), min(highest, last[k])
        if low[k] > high[k]:
            assert constraints is not None
            unit, size = ("deg", math.degrees(1.0)) if joint.kind == "revolute" else ("mm", 1e3)
            limits = constraints.limits[k + 1]
            own_unit = constraints.units.angle if joint.kind == "revolute" else constraints.units.length
            raise InputError(
                f"the limits of joint {k + 1} leave nothing of what the robot has",
                parameter="constraints",
                where=f"{where}, limits",
                came=f"{limits[0]:g} to {limits[1]:g} {own_unit}",
                allowed=f"within {size * lowest:.6g} to {size * highest:.6g} {unit}",
                cure="Check the number of the joint, and the sign and the unit of its limits.",
            )
        if joint.kind == "revolute":
            low[k] = float(np.clip(-math.pi, low[k], max(low[k], high[k] - 2.0 * math.pi)))
            high[k] = min(high[k], low[k] + 2.0 * math.pi)
    return low, high


def on_principal_turn(robot: Robot, joints: Array) -> Array:
    """Return joint positions ``(n, joints)`` with every joint that turns on its turn of :func:`joint_window`."""
    low, high = joint_window(robot)
    turned = low + np.mod(joints - low, 2.0 * math.pi)
    turns = np.array([joint.kind == "revolute" for joint in robot.joints])
    return np.where(turns & (turned <= high) & ((joints < low) | (joints > high)), turned, joints)
