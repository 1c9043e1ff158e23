"""Measured kinematics placed on the table of a robot's type, with every frame beside the nominal one.

Masses, the capsules that keep an arm out of itself, and bearings are given in the frames of links. A DH table of a
measured arm may have frames kilometres away, because the common normals of nearly parallel axes lie anywhere. So the
frames are slid and turned along their joint axes until each stands where the next axis meets the plane through the
frame before (Hayati and Mirmirani 1985), which is beside the nominal one. No pose changes by that.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.controller import ControllerKinematics
from truearm.modeling.conversion import converted
from truearm.modeling.formats.ur_kinematics.reading import JOINTS, FactoryKinematics
from truearm.modeling.formats.urdf_tree import roll_pitch_yaw
from truearm.modeling.lines import at_zero
from truearm.modeling.parts import Joint
from truearm.modeling.robot import Robot
from truearm.modeling.transform import IDENTITY
from truearm.shown import counted

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


def with_kinematics(type_: Robot, found: FactoryKinematics) -> Robot:
    """Return the robot of a type with the kinematics of a file as its values, and as those of its controller.

    The nominal values, masses, tools and limits are those of the type. The frames of links lie beside the type's.

    Raises:
        InputError: If the type is no arm of this maker's kind, its frames are not the controller's, or the file is of
            an arm with other joints.
    """
    plain = _plain(type_)
    if found.frames is None:
        if any(joint.row.get("beta") for joint in plain.joints):
            raise InputError(
                "the file has differences to the table of a type, and this robot's table is no such one",
                where=type_.name,
                came="a table with a beta other than zero",
                cure="Give the type as the library has it.",
            )
        table = [
            {column: joint.row.get(column, 0.0) + found.deltas[column][number] for column in found.deltas}
            for number, joint in enumerate(plain.joints)
        ]
        measured = replace(plain, convention_name="standard-dh", joints=_joints(plain, table))
    else:
        measured = replace(plain, convention_name="urdf", joints=_joints(plain, [_origin(f) for f in found.frames]))
    placed = converted(measured, "hayati")
    offset = np.abs(placed.base.matrix - np.eye(4)).max()
    if offset > _SAME or placed.flange != IDENTITY:
        raise InputError(
            "the first axis is not the z axis of the base frame, as it is in every arm of this kind",
            where=str(found.path),
            cure="Take the file that the controller or its ROS driver wrote.",
        )
    rows = tuple({column: float(value) for column, value in joint.row.items()} for joint in placed.joints)
    kinematics = ControllerKinematics("own", rows, found.path.name, found.identity)
    return replace(
        _with_rows(replace(type_, known={}, proof=None), rows),
        title=f"{type_.title}, with the kinematics of its controller",
        controller=replace(type_.controller, kinematics=kinematics),
        history=(*type_.history, f"kinematics of the controller from {found.path.name}"),
    )


def _with_rows(robot: Robot, rows: Sequence[Mapping[str, float]]) -> Robot:
    """Return a robot in nominal values with rows of the convention ``hayati`` as its values."""
    joints = tuple(
        replace(joint, row={**dict.fromkeys(row, 0.0), **joint.row})
        for joint, row in zip(robot.joints, rows, strict=True)
    )
    made = replace(robot, convention_name="hayati", joints=joints, truths={})
    return made.with_values(
        {f"{column}_{number}": value for number, row in enumerate(rows, 1) for column, value in row.items()}
    )


def refuse_far(made: Robot, type_: Robot, where: str) -> None:
    """Refuse kinematics of an arm of another type than `type_`, or of none.

    Raises:
        InputError: With how far the flange is from the nominal one on average, or how far it is turned; or a link.
    """
    apart, turned = mean_distance(made, type_), mean_angle(made, type_)
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
    pairs = zip(_link_frames(_bare(made)), _link_frames(_plain(type_)), strict=True)
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


def mean_distance(made: Robot, type_: Robot) -> float:
    """Return how far the flange of an arm is from that of a type on average, at random joint positions [m]."""
    (ours, _), (theirs, _) = _flanges(made, type_)
    return float(np.linalg.norm(ours - theirs, axis=1).mean())


def mean_angle(made: Robot, type_: Robot) -> float:
    """Return how far the flange of an arm is turned from that of a type on average, at random joint positions [rad]."""
    (_, ours), (_, theirs) = _flanges(made, type_)
    return float(_angles(ours, theirs).mean())


def _flanges(made: Robot, type_: Robot) -> list[tuple[Array, Array]]:
    """Return positions ``(n, 3)`` [m] and rotations ``(n, 3, 3)`` of the flange of both, at random joint positions."""
    joints = np.random.default_rng(0).uniform(-np.pi, np.pi, (_CONFIGURATIONS, JOINTS))
    plain = _plain(type_)  # refuses a type of another kind before anything is compared
    return [robot.world_poses(joints) for robot in (_bare(made), plain)]


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
