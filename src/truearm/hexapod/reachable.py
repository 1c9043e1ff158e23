"""Which poses of the device a robot can take, on which branches, for given places of the base fixture."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, counted, did_you_mean, refusals_at
from truearm.engine.base.units import from_si
from truearm.engine.data.hexapod import DEVICE, Device, HexapodPose, side_names, triangle
from truearm.engine.motion.cell import segment_distance
from truearm.engine.motion.ordering import all_moving_order
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import Controller
from truearm.engine.robot.inverse.branches import BRANCHES
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.inverse.pose_solver import PoseStatus
from truearm.engine.robot.parts import NO_PAYLOAD, Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.hexapod.sheet import TO_FOURTH, PlannedRow, four_cups, side_frames

# Room between the arm and what stands around the device, with capsules.
#
# The arm is a row of capsules from joint to joint as its model has them, all of one radius; the bars and the edges of
# the base fixture are thin ones. Whether the arm hits itself, the table or a cable is not looked at.

#: Radius of a ballbar, and of an edge of the base fixture [m].
BAR_RADIUS: Final = 0.010
#: Radius of an arm the size of those in the document [m].
ARM_RADIUS: Final = 0.050


def arm_links(robot: Robot, joints: Array) -> tuple[Array, Array]:
    """Return both ends of the arm's links in the world [m], each ``(links, 3, n)``, from the base to the flange."""
    kinematics = robot.forward_kinematics(joints)
    origins = [
        np.broadcast_to(kinematics.origin(place), kinematics.position.shape)
        for place in robot.moving[: len(robot.joints)]
    ]
    points = np.array([*origins, kinematics.position])
    return points[:-1], points[1:]


def clearance(robot: Robot, joints: Array, starts: Array, ends: Array, arm_radius: float = ARM_RADIUS) -> Array:
    """Return the smallest room between the arm and bars [m], ``(n,)``; below zero they touch.

    Args:
        robot: The arm; its world is the frame of the bars.
        joints: Joint positions ``(n, joints)`` [rad or m].
        starts, ends: Both ends of every bar at each configuration [m], ``(bars, 3, n)``.
        arm_radius: Of the arm's links [m].
    """
    first, last = arm_links(robot, joints)
    apart = segment_distance(first[:, None], last[:, None], starts[None], ends[None])
    return np.asarray(apart.min(axis=(0, 1)) - arm_radius - BAR_RADIUS)


#: Why a branch of a pose is left out, in the order in which it is asked.
OUT_OF_REACH: Final = "out of reach"
BEYOND_LIMITS: Final = "beyond joint limits"
TOO_NEAR: Final = "arm at the bars"
NOT_WANTED: Final = "another branch"

#: How many configurations are measured again with every attachment of the tool.
_AGAIN: Final = 5


@dataclass(frozen=True, eq=False)
class Reachable:
    """What a robot can measure with the device at one place or several."""

    rows: tuple[PlannedRow, ...]  #: Configurations, in the order in which to measure them.
    clearance: Array  #: Room between arm and bars at each [m], ``(rows,)``.
    left_out: Mapping[str, int]  #: How many branches of poses were left out, by reason.
    poses: int  #: How many poses were asked for, on all sides and at all places.

    @property
    def poses_reached(self) -> int:
        """How many different poses the configurations take."""
        return len({(row.place, row.side, row.pose) for row in self.rows})


def reachable(
    robot: Robot,
    fixture: Transform,
    wanted: Sequence[HexapodPose],
    *,
    device: Device = DEVICE,
    largest_turn: float = math.pi,
    arm_radius: float = ARM_RADIUS,
    branches: Sequence[str] = (),
    fourth_cup: bool = False,
) -> Reachable:
    """Return the configurations in which a robot can be measured.

    Args:
        robot: With six joints that are solved in closed form, see :mod:`truearm.engine.robot.inverse`.
        fixture: Of the base fixture in the robot's base frame.
        wanted: Poses of the device for the robot's tool.
        device: Nominal lengths.
        largest_turn: No joint that turns is used beyond this, whatever its limits [rad]; Nubiola (4.4) takes 180 deg,
            for the cables.
        arm_radius: Of the arm's links [m].
        branches: Only branches whose names begin so, such as ``front-up``; all of them if empty.
        fourth_cup: Whether there is a fourth cup, and the poses are taken on all four sides.

    Raises:
        InputError: If the robot has no closed form, there is no such branch, or nothing is left; with the reasons.
    """
    for begin in branches:
        if not any(branch.startswith(begin) for branch in BRANCHES):
            raise InputError(
                "there is no such branch",
                parameter="branches",
                came=begin,
                allowed=", ".join(BRANCHES),
                cure=did_you_mean(begin, [*BRANCHES, *(name.split("-")[0] for name in BRANCHES)]),
            )
    corners = four_cups([device.base] * 3, [device.base] * 3)
    sides = [_in_frame(fixture, side) for side in (side_frames(corners) if fourth_cup else (IDENTITY,))]
    on_sides = [(side, pose) for side in sides for pose in wanted]
    position = np.array([side.rotation @ pose.position + np.array(side.translation) for side, pose in on_sides])
    rotation = np.array([side.rotation @ pose.rotation for side, pose in on_sides])
    joint_solutions = inverse(robot, position, rotation, branch="all")
    usable = np.array([status.usable for status in joint_solutions.status])
    beyond = np.array([status is PoseStatus.BEYOND_LIMIT for status in joint_solutions.status])
    turns = [joint.kind == "revolute" for joint in robot.joints]
    wide = (np.abs(joint_solutions.joints[:, turns]) > largest_turn + 1e-9).any(axis=1)
    cups = (corners if fourth_cup else corners[:3]) @ fixture.rotation.T + np.array(fixture.translation)
    starts, ends = _bars(cups, on_sides, joint_solutions.pose, device)
    base = robot.base
    inside = (np.moveaxis(part, 1, -1) @ base.rotation.T + np.array(base.translation) for part in (starts, ends))
    starts, ends = (np.moveaxis(part, -1, 1) for part in inside)
    gaps = clearance(robot, joint_solutions.joints, starts, ends, arm_radius)
    meant = np.array([not branches or branch.startswith(tuple(branches)) for branch in joint_solutions.branch])
    measurable = usable & ~wide & meant & (gaps > 0)
    reasons = np.select(
        [~(usable | beyond), ~(usable & ~wide), ~meant], [OUT_OF_REACH, BEYOND_LIMITS, NOT_WANTED], TOO_NEAR
    )
    left_out = Counter(reasons[~measurable].tolist())
    if not measurable.any():
        raise InputError(
            f"{robot.name} can reach none of the {len(on_sides)} poses with the fixture at this place",
            parameter="fixture" if arm_radius == ARM_RADIUS else "fixture, arm_radius",
            came=", ".join(f"{count} {reason}" for reason, count in left_out.items()),
            cure="Move the fixture; it is given in the robot's base frame.",
        )
    rows = np.flatnonzero(measurable)
    order = rows[all_moving_order(joint_solutions.joints[rows], 0.0)]
    planned = tuple(
        PlannedRow(
            configuration=str(number),
            branch=joint_solutions.branch[row],
            pose=on_sides[joint_solutions.pose[row]][1].number,
            design=on_sides[joint_solutions.pose[row]][1].design,
            solution=on_sides[joint_solutions.pose[row]][1].solution,
            joints=joint_solutions.joints[row],
            side=1 + int(joint_solutions.pose[row]) // len(wanted),
        )
        for number, row in enumerate(order.tolist(), 1)
    )
    return Reachable(planned, gaps[order], dict(left_out), len(on_sides))


def reachable_at_places(
    robot: Robot,
    fixtures: Sequence[Transform],
    wanted: Sequence[HexapodPose],
    *,
    arm_radius: float = ARM_RADIUS,
    branches: Sequence[str] = (),
    fourth_cup: bool = False,
) -> Reachable:
    """Return the configurations in which a robot can be measured with the base fixture at one place after the other.

    Args:
        fixtures: Of the base fixture in the robot's base frame; several are called ``fixture_1``, ``fixture_2`` and so
            on.
        robot, wanted, arm_radius, branches, fourth_cup: As for :func:`reachable`.

    Raises:
        InputError: As :func:`reachable`, if nothing is left at one of the places.
    """
    parts = []
    for number, fixture in enumerate(fixtures, 1):
        with refusals_at(f"fixture_{number}") if len(fixtures) > 1 else nullcontext():
            parts.append(
                reachable(robot, fixture, wanted, arm_radius=arm_radius, branches=branches, fourth_cup=fourth_cup)
            )
    if len(parts) == 1:
        return parts[0]
    rows = [replace(row, place=f"fixture_{number}") for number, part in enumerate(parts, 1) for row in part.rows]
    return Reachable(
        tuple(replace(row, configuration=str(number)) for number, row in enumerate(rows, 1)),
        np.concatenate([part.clearance for part in parts]),
        dict(sum((Counter(part.left_out) for part in parts), Counter())),
        sum(part.poses for part in parts),
    )


def attached_anew(plan: Reachable, attachments: int) -> Reachable:
    """Return a plan in which, after each attachment of the tool but the first, a few configurations come again.

    They are spread over those of the last place. Their numbers go on, so that the order of measurement stays known.
    """
    if attachments == 1:
        return plan
    last = [number for number, row in enumerate(plan.rows) if row.place == plan.rows[-1].place]
    chosen = np.unique(np.linspace(last[0], last[-1], _AGAIN).round().astype(int)).tolist()
    rows = [replace(row, attachment="1") for row in plan.rows]
    for attachment in range(2, attachments + 1):
        rows += [replace(rows[number], attachment=str(attachment)) for number in chosen]
    numbered = tuple(replace(row, configuration=str(number)) for number, row in enumerate(rows, 1))
    gaps = np.concatenate([plan.clearance, np.tile(plan.clearance[chosen], attachments - 1)])
    return replace(plan, rows=numbered, clearance=gaps)


def _in_frame(outer: Transform, inner: Transform) -> Transform:
    R = outer.rotation
    return Transform.from_matrix(R @ inner.rotation, R @ np.array(inner.translation) + np.array(outer.translation))


def _bars(
    cups: Array, on_sides: Sequence[tuple[Transform, HexapodPose]], of_row: NDArray[np.intp], device: Device
) -> tuple[Array, Array]:
    """Return both ends of the six bars of each row's pose and of the base fixture's edges, ``(bars, 3, rows)``.

    `cups` are those of the base fixture ``(cups, 3)`` in the robot's base frame [m], as are the bars.
    """
    nominal = triangle([device.base] * 3, "B")
    edges = [[cups[a], cups[b]] for a, b in combinations(range(len(cups)), 2)]
    bars = []  # (poses, bars, ends, 3)
    for side, pose in on_sides:
        R, p = side.rotation, np.array(side.translation)
        bars.append([*([R @ nominal[foot] + p, R @ pose.cups[cup] + p] for foot, cup in pose.design.legs), *edges])
    of_rows = np.moveaxis(np.array(bars)[of_row], 0, -1)
    return of_rows[:, 0], of_rows[:, 1]


# The plan in words, to print and to work through with the bar in hand (Nubiola, 3.5 and 4.4).
_FOURTH: Final = (
    "   Set the fourth cup below the three others in the same way, at the fourth corner of a tetrahedron. It must be",
    "   as far from each of them as they are from each other, to the range of the bar.",
)
_ANEW: Final = (
    "   Before the first configuration of every place, set the base fixture up there and repeat steps 2 and 3. The",
    "   distances of the base go into the first row of the place.",
)


def steps_text(plan: Reachable, robot: Robot, controller: Controller | None = None, device: Device = DEVICE) -> str:
    """Return the plan step by step; figures go into the sheet.

    Args:
        controller: Who shows the joint positions; None for the model's.
    """
    base, tool, leg = (f"{length * 1e3:g} mm" for length in (device.base, device.tool, device.leg))
    with_sides, places = any(row.side > 1 for row in plan.rows), any(row.place for row in plan.rows)
    fourth = TO_FOURTH if with_sides else ()
    lines = [
        f"Measuring {robot.name} with one ballbar: {len(plan.rows)} configurations, {plan.poses_reached} poses.",
        f"The bar reads only within +/- {device.reach * 1e3:g} mm of the nominal length. If one of the six legs is",
        "beyond, leave its cell empty and go on. Plan again with the robot that a first calibration gives.",
        "",
        f"1. Set the bar to {tool} on its calibrator. Measure {', '.join(side_names('T'))}.",
        "2. Loosen the base cups. Bring the setting ball in cup T1 to the three places of the base cups by programme,",
        f"   {base} apart. Let each cup snap on and lock it. Note the joint positions.",
        *(_FOURTH if with_sides else ()),
        f"3. Set the bar to {base} on its calibrator. Measure {', '.join((*side_names('B'), *fourth))}.",
        f"4. For every configuration below: move, set the bar to {leg} on its calibrator, then measure six legs.",
        *(_ANEW if places else ()),
        "",
    ]
    joints = np.array([row.joints for row in plan.rows])
    shown = joints if controller is None else controller.from_model(joints)
    called = "joints" if controller is None else "joints as the controller shows them"
    previous_place, attached = "", plan.rows[0].attachment
    for row, at, gap in zip(plan.rows, shown.tolist(), plan.clearance.tolist(), strict=True):
        positions = " ".join(
            f"{from_si(value, 'deg' if joint.kind == 'revolute' else 'mm'):.3f}"
            for joint, value in zip(robot.joints, at, strict=True)
        )
        if row.place != previous_place:
            lines += [f"Place {row.place}: set the base fixture up there; steps 2 and 3.", ""]
            previous_place = row.place
        if row.attachment != attached:
            lines += [f"Attachment {row.attachment}: take the tool off, and attach it again.", ""]
            attached = row.attachment
        pose = f"pose {row.pose} on side {row.side}" if with_sides else f"pose {row.pose}"
        lines.append(f"Configuration {row.configuration}  ({pose}, {row.branch}, {gap * 1e3:.0f} mm of room)")
        lines.append(f"   {called} {positions}")
        lines += [f"   [ ] Attach the bar between {' and '.join(name.split('-'))}." for name in row.leg_names]
    return "\n".join(lines) + "\n"


def with_cups(robot: Robot, tool: str | None = None) -> tuple[Robot, Array]:
    """Return a robot that has the three cups as its targets, and their places on the flange.

    A calibrated robot has them already. Any other robot takes them from a tool of its file, with the tool's mass if it
    carries nothing yet, and stands in the origin.

    Args:
        robot: The arm.
        tool: Name of the tool; the first one if None.

    Returns:
        robot, cups: Cups T1, T2, T3 in the flange frame [m], ``(3, 3)``.

    Raises:
        InputError: If the robot has no such tool, or it has not three targets.
    """
    if tool is not None or not robot.targets:
        if tool is not None and tool not in robot.tools:
            raise InputError(
                "the robot has no such tool",
                where=robot.name,
                came=tool,
                allowed=", ".join(robot.tools) or "none",
                cure=did_you_mean(tool, robot.tools),
            )
        if robot.tools:
            chosen = robot.tools[tool] if tool is not None else next(iter(robot.tools.values()))
            robot = robot.with_frames(IDENTITY, chosen.targets)
            if robot.payload == NO_PAYLOAD:
                robot = replace(robot, payload=Payload(chosen.mass, chosen.cog))
    if len(robot.targets) != 3:
        raise InputError(
            "the device needs a tool with three cups",
            where=robot.name,
            came=counted(len(robot.targets), "target"),
            cure="Describe the tool under 'tools' in the robot file, its cups as three targets.",
        )
    values = robot.values
    cups = [[values[target.parameter(axis)] for axis in "xyz"] for target in robot.targets]
    return robot, np.array(cups)
