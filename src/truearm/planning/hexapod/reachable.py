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

from truearm.errors import InputError, did_you_mean, refusals_at
from truearm.measurement.hexapod.four_cups import four_cups, side_frames
from truearm.measurement.hexapod.geometry import DEVICE, Device, triangle
from truearm.measurement.hexapod.poses import HexapodPose
from truearm.measurement.hexapod.sheet import PlannedRow
from truearm.modeling.chain import Array
from truearm.modeling.inverse import PoseStatus, inverse
from truearm.modeling.inverse.branches import BRANCHES
from truearm.modeling.robot import Robot
from truearm.modeling.transform import IDENTITY, Transform
from truearm.planning.choosing.ordering import all_moving_order
from truearm.planning.hexapod.clearance import ARM_RADIUS, clearance

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
        robot: With six joints that are solved in closed form, see :mod:`truearm.modeling.inverse`.
        fixture: Of the base fixture in the robot's base frame.
        wanted: Poses of the device for the robot's tool.
        device: Nominal lengths.
        largest_turn: No joint that turns is used beyond this, whatever its limits [rad]; Nubiola (4.4) takes 180 deg,
            for the cables.
        arm_radius: Of the arm's links [m], see :mod:`truearm.planning.hexapod.clearance`.
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
    found = inverse(robot, position, rotation, branch="all")
    usable = np.array([status.usable for status in found.status])
    beyond = np.array([status is PoseStatus.BEYOND_LIMIT for status in found.status])
    turns = [joint.kind == "revolute" for joint in robot.joints]
    wide = (np.abs(found.joints[:, turns]) > largest_turn + 1e-9).any(axis=1)
    cups = (corners if fourth_cup else corners[:3]) @ fixture.rotation.T + np.array(fixture.translation)
    starts, ends = _bars(cups, on_sides, found.pose, device)
    base = robot.base
    inside = (np.moveaxis(part, 1, -1) @ base.rotation.T + np.array(base.translation) for part in (starts, ends))
    starts, ends = (np.moveaxis(part, -1, 1) for part in inside)
    room = clearance(robot, found.joints, starts, ends, arm_radius)
    meant = np.array([not branches or branch.startswith(tuple(branches)) for branch in found.branch])
    kept = usable & ~wide & meant & (room > 0)
    reasons = np.select(
        [~(usable | beyond), ~(usable & ~wide), ~meant], [OUT_OF_REACH, BEYOND_LIMITS, NOT_WANTED], TOO_NEAR
    )
    left_out = Counter(reasons[~kept].tolist())
    if not kept.any():
        raise InputError(
            f"{robot.name} can reach none of the {len(on_sides)} poses with the fixture at this place",
            parameter="fixture" if arm_radius == ARM_RADIUS else "fixture, arm_radius",
            came=", ".join(f"{count} {reason}" for reason, count in left_out.items()),
            cure="Move the fixture; it is given in the robot's base frame.",
        )
    rows = np.flatnonzero(kept)
    order = rows[all_moving_order(found.joints[rows], 0.0)]
    planned = tuple(
        PlannedRow(
            configuration=str(number),
            branch=found.branch[row],
            pose=on_sides[found.pose[row]][1].number,
            design=on_sides[found.pose[row]][1].design,
            solution=on_sides[found.pose[row]][1].solution,
            joints=found.joints[row],
            side=1 + int(found.pose[row]) // len(wanted),
        )
        for number, row in enumerate(order.tolist(), 1)
    )
    return Reachable(planned, room[order], dict(left_out), len(on_sides))


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
    found = []
    for number, fixture in enumerate(fixtures, 1):
        with refusals_at(f"fixture_{number}") if len(fixtures) > 1 else nullcontext():
            found.append(
                reachable(robot, fixture, wanted, arm_radius=arm_radius, branches=branches, fourth_cup=fourth_cup)
            )
    if len(found) == 1:
        return found[0]
    rows = [replace(row, place=f"fixture_{number}") for number, part in enumerate(found, 1) for row in part.rows]
    return Reachable(
        tuple(replace(row, configuration=str(number)) for number, row in enumerate(rows, 1)),
        np.concatenate([part.clearance for part in found]),
        dict(sum((Counter(part.left_out) for part in found), Counter())),
        sum(part.poses for part in found),
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
    room = np.concatenate([plan.clearance, np.tile(plan.clearance[chosen], attachments - 1)])
    return replace(plan, rows=numbered, clearance=room)


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
