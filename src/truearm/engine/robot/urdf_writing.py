"""A new URDF of a robot, whatever its convention, and what files say beside their numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import Final
from xml.sax.saxutils import quoteattr

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import mark_lines, written
from truearm.engine.robot.chain import Array, Element
from truearm.engine.robot.controller import Controller, JointsOf
from truearm.engine.robot.effects.balancing import Balancing
from truearm.engine.robot.effects.effect import MATTERS, Effect
from truearm.engine.robot.parts import NO_PAYLOAD, Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.robot.urdf_tree import Triple, product, roll_pitch_yaw

#: Two frames less than this apart [m, rad] are the same to any instrument.
_SAME_FRAME: Final = 1e-9
#: Where it is looked at whether an effect matters: a tip that far from the flange [m], at so many joint positions.
_TIP: Final = 0.1
_TRIED: Final = 50


def left_out(robot: Robot, format_: str, supported: Collection[str] = ()) -> list[str]:
    """Say what of a robot a file cannot hold: joint effects, balancers, the place of the base, targets.

    Args:
        format_: What the file is, as a sentence begins: ``A URDF``.
        supported: Names of the joint effects that it holds after all; with that of balancers the balancers themselves.
    """
    messages = []
    for effect in robot.effects:
        names = [plain.name for plain in effect.parameters if robot.values[plain.name] != plain.value]
        if names and effect.name not in supported and _matters(robot, effect):
            messages.append(f"{format_} cannot hold the joint effect {effect.name}; left out: {', '.join(names)}.")
    if robot.balancers and Balancing.name not in supported:
        names = [balancer.name for balancer in robot.balancers]
        messages.append(f"{format_} cannot hold balancers; left out: {', '.join(names)}.")
    base = [name for name, p in robot.parameters.items() if p.group == "base" and p.value != 0.0]
    if base or robot.base_quaternion != Transform().quaternion:
        names = [*(["base_quaternion"] if robot.base_quaternion != Transform().quaternion else []), *base]
        messages.append(
            f"{format_} cannot hold where the base stands in the instrument's frame; left out: {', '.join(names)}."
        )
    if robot.targets:
        names = [target.name for target in robot.targets]
        messages.append(f"{format_} cannot hold the targets on the flange; left out: {', '.join(names)}.")
    return messages


def _matters(robot: Robot, effect: Effect) -> bool:
    """Return whether an effect moves the tip by more than next to nothing; what follows the temperature always does."""
    if effect.warmed:
        return True
    at = robot.loaded(robot.random_configurations(_TRIED, np.random.default_rng(0)))
    at = replace(at, approach=np.ones_like(at.joints), number=np.zeros(_TRIED))
    without = robot.with_values({p.name: p.value for p in effect.parameters})
    place, turn = (with_it - bare for with_it, bare in zip(robot.world_poses(at), without.world_poses(at), strict=True))
    squares = np.sum(place**2, axis=1) + _TIP**2 * np.sum(turn**2, axis=(1, 2))
    return bool(np.mean(squares) >= MATTERS**2)


def masses_left_out(robot: Robot, format_: str) -> list[str]:
    """Say which masses a file cannot hold."""
    links = [str(number) for number in sorted({mass.joint for mass in robot.masses if mass.mass})]
    names = [
        *([f"those of link {', '.join(links)}"] if links else []),
        *(["the payload"] if robot.payload != NO_PAYLOAD else []),
    ]
    return [f"{format_} cannot hold masses; left out: {' and '.join(names)}."] if names else []


def frames(robot: Robot) -> str:
    """Say which frames, and whose joint positions, all numbers of a file refer to."""
    counted = " Joint positions are the model's, not those that the controller shows."
    return (
        f"Poses are those of the flange in the base frame, both as in the robot file of {robot.name}."
        f"{counted if robot.controller.counts_otherwise else ''}"
    )


def first_frame_remark(base: Transform) -> str:
    """Say where the frame that a table starts from stands in the base frame."""
    turned = 2.0 * math.atan2(math.hypot(*base.quaternion[1:]), abs(base.quaternion[0]))
    if math.hypot(*base.translation) < _SAME_FRAME and turned < _SAME_FRAME:
        return "The table starts at the base frame."
    x, y, z = (f"{1e3 * v:.6g}" for v in base.translation)
    return (
        f"The table starts at a frame on the first axis, which in the base frame stands at x {x}, y {y}, z {z} mm, "
        f"turned by {math.degrees(turned):.6g} deg."
    )


def comments(robot: Robot, frame: str, left: Sequence[str]) -> list[str]:
    """Return what the head of a file says in its comments, each one line without control characters."""
    title = robot.title if robot.title == robot.name else f"{robot.name}: {robot.title}"
    remarks = [
        *mark_lines(robot.simulated_from),
        f"{title}, written by truearm",
        frame,
        *left,
        *(f"History: {line}" for line in robot.history),
    ]
    return [" ".join("".join(c if c.isprintable() else " " for c in line).split()) for line in remarks]


#: What columns are called, before their numbers.
COLUMN: Final[dict[JointsOf, str]] = {"model": "joint", "controller": "axis"}

#: A column of joint positions, with its number.
JOINT_COLUMN: Final = re.compile(r"(joint|axis)_([1-9][0-9]{0,3})")


def joint_names(names: Iterable[str], where: str) -> tuple[JointsOf, list[str]]:
    """Return whose joint positions the columns of a file hold, and those columns in their order.

    Raises:
        InputError: If there are columns of both kinds, or none, or a number is missing.
    """
    numbered = sorted((int(match[2]), match[1]) for name in names if (match := JOINT_COLUMN.fullmatch(name)))
    kinds = dict.fromkeys(kind for _, kind in numbered)
    if len(kinds) > 1:
        raise InputError(
            "a file has joint positions of one kind",
            where=where,
            came=", ".join(f"{kind}_{number}" for number, kind in numbered),
            allowed="axis_1, axis_2, .. as the controller shows them, or joint_1, joint_2, .. of the robot's model",
            cure="Keep the columns of one kind.",
        )
    kind = next(iter(kinds), COLUMN["model"])
    there_are = {number for number, _ in numbered}
    for number in range(1, max(there_are, default=1) + 1):
        if number not in there_are:
            raise InputError(
                f"the column {kind}_{number} is missing",
                where=where,
                came=", ".join(f"{kind}_{n}" for n, _ in numbered) or None,
                allowed=f"{kind}_1, {kind}_2, .. without a gap",
                cure=f"Add {kind}_{number} [deg], or with the unit it has, or renumber.",
            )
    return next(whose for whose, name in COLUMN.items() if name == kind), [f"{kind}_{number}" for number, _ in numbered]


def counting(robot: Robot, joints_are: JointsOf) -> Controller | None:
    """Return the controller whose joint positions are meant; None for the model's."""
    return robot.controller if joints_are == "controller" else None


def joint_headings(joints: Sequence[Joint], controller: Controller | None = None, name: str | None = None) -> list[str]:
    """Return the names of the columns of joint positions, with their units.

    Args:
        joints: Of the robot.
        controller: Who shows them; None for the model's.
        name: What they are called before their numbers, ``joint`` or ``axis`` if None.
    """
    called = name or COLUMN["model" if controller is None else "controller"]
    return [f"{called}_{number} [{unit}]" for number, unit in enumerate(_units(joints), 1)]


def joint_cells(values: Array, joints: Sequence[Joint], controller: Controller | None = None) -> list[list[str]]:
    """Return the cells of joint positions of the model ``(n, joints)`` [rad or m], in deg or mm, row by row."""
    shown = values if controller is None else controller.from_model(values)
    units = _units(joints)
    return [[repr(written(value, unit)) for value, unit in zip(row, units, strict=True)] for row in shown.tolist()]


def _units(joints: Sequence[Joint]) -> list[str]:
    return ["deg" if joint.kind == "revolute" else "mm" for joint in joints]


def collapsed(robot: Robot) -> tuple[list[Array], list[Array]]:
    """Return the constant transforms around the joint variables of `robot`, each ``(4, 4)``.

    Returns:
        origins: From one joint variable to the next, from the base on and to the flange at last. A joint's own value
            (its zero) belongs to the one before it, because the joint turns about that very axis.
        behind: From each joint variable to the end of its link, in whose frame its centre of gravity is given.
    """
    origins, behind = [], []
    pending: list[Element] = []
    for link in robot.link_elements:
        moving = next(i for i, element in enumerate(link) if element.variable is not None)
        own_zero = replace(link[moving], variable=None)
        origins.append(product([*pending, *link[:moving], own_zero], robot.values))
        pending = list(link[moving + 1 :])
        behind.append(product(pending, robot.values))
    return [*origins, product([*pending, *robot.flange_elements], robot.values)], behind


def urdf_text(robot: Robot) -> tuple[str, list[str]]:
    """Return a new URDF with the kinematics of `robot` as it is now, whatever its convention.

    Links are ``base_link``, ``link_1`` ... and ``tool0``. The constant transforms between two joint variables
    are multiplied into one origin. The base link is the base frame: where it stands in the world is left out.

    Returns:
        text, left_out: The file, and in words what a URDF cannot hold or the robot does not say.
    """
    names = [*(joint.name for joint in robot.joints), "tool0_joint"]
    for name in names:
        if names.count(name) > 1:
            raise InputError("a URDF cannot have two joints of one name", where=robot.name, came=name)
    origins, behind = collapsed(robot)
    messages = left_out(robot, "A URDF")
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        *(f"<!-- {line} -->" for line in mark_lines(robot.simulated_from)),
        f"<robot name={quoteattr(robot.name)}>",
        '  <link name="base_link"/>',
    ]
    for number, (joint, place) in enumerate(zip(robot.joints, origins[:-1], strict=True), 1):
        parent = f"link_{number - 1}" if number > 1 else "base_link"
        lines += _link_lines(robot, number, behind[number - 1])
        moving = next(e for e in robot.link_elements[number - 1] if e.variable is not None)
        lines += _joint_lines(joint, parent, f"link_{number}", place, _limit(robot.name, joint), moving.axis)
    lines += ['  <link name="tool0"/>']
    lines += _joint_lines(None, f"link_{len(robot.joints)}", "tool0", origins[-1], [])
    messages += _unknown_limits(robot.joints)
    if robot.masses:
        messages.append("Inertia tensors are not written and stand as 0.")
    return "\n".join([*lines, "</robot>", ""]), messages


def _joint_lines(
    joint: Joint | None, parent: str, child: str, origin: Array, limit: list[str], axis: Triple | None = None
) -> list[str]:
    """Return the lines of one joint, its axis z if None; None is the fixed one at the end."""
    if joint is None:
        head = '  <joint name="tool0_joint" type="fixed">'
    else:
        type_ = joint.kind if joint.limits else "continuous"
        limit = [f'    <axis xyz="{_written(axis or (0.0, 0.0, 1.0))}"/>', *limit]
        head = f'  <joint name={quoteattr(joint.name)} type="{type_}">'
    place = f'xyz="{_written(origin[:3, 3])}" rpy="{_written(roll_pitch_yaw(origin[:3, :3]))}"'
    ends = [f'    <parent link="{parent}"/>', f'    <child link="{child}"/>']
    return [head, f"    <origin {place}/>", *ends, *limit, "  </joint>"]


def _limit(where: str, joint: Joint) -> list[str]:
    speed = "0" if joint.max_speed is None else repr(joint.max_speed)
    if joint.limits is None:
        if joint.kind == "prismatic":
            raise InputError(
                "a URDF must have the limits of a prismatic joint",
                where=f"{where}, joint {joint.name}",
                cure="Give the joint its limits in the robot file.",
            )
        return [] if joint.max_speed is None else [f'    <limit effort="0" velocity="{speed}"/>']
    low, high = joint.limits
    return [f'    <limit lower="{low!r}" upper="{high!r}" effort="0" velocity="{speed}"/>']


def _unknown_limits(joints: Iterable[Joint]) -> list[str]:
    """Say which numbers of a ``<limit>`` stand as 0."""
    limited = [joint for joint in joints if joint.limits or joint.max_speed is not None]
    if not limited:
        return []
    unknown = [joint.name for joint in limited if joint.max_speed is None]
    if not unknown:
        return ["Effort limits are not known and stand as 0."]
    if len(unknown) == len(limited):
        return ["Effort and velocity limits are not known and stand as 0."]
    return [f"Effort limits, and velocity limits of {', '.join(unknown)}, are not known and stand as 0."]


def _link_lines(robot: Robot, number: int, behind: Array) -> list[str]:
    masses = [m for m in robot.masses if m.joint == number and m.mass > 0]
    if not masses:
        return [f'  <link name="link_{number}"/>']
    weights = [m.mass for m in masses]
    cog = behind[:3, :3] @ np.average([m.cog for m in masses], axis=0, weights=weights) + behind[:3, 3]
    return [
        f'  <link name="link_{number}">',
        "    <inertial>",
        f'      <origin xyz="{_written(cog)}"/>',
        f'      <mass value="{sum(weights)!r}"/>',
        '      <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>',
        "    </inertial>",
        "  </link>",
    ]


def _written(values: Iterable[float]) -> str:
    """Return numbers as text; the roundings of right angles are written as the zeros they stand for."""
    return " ".join(repr(0.0 if abs(v) < 1e-15 else float(v)) for v in values)
