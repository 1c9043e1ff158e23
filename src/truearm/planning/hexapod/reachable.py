"""Which poses of the device a robot can take, on which branches, for a given place of the base fixture."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError, did_you_mean
from truearm.measurement.hexapod.geometry import DEVICE, SIDES, Device, triangle
from truearm.measurement.hexapod.poses import HexapodPose
from truearm.measurement.hexapod.sheet import PlannedRow
from truearm.modeling.chain import Array
from truearm.modeling.inverse import PoseStatus, inverse
from truearm.modeling.inverse.branches import BRANCHES
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform
from truearm.planning.choosing.ordering import all_moving_order
from truearm.planning.hexapod.clearance import ARM_RADIUS, clearance

#: Why a branch of a pose is left out, in the order in which it is asked.
OUT_OF_REACH: Final = "out of reach"
BEYOND_LIMITS: Final = "beyond joint limits"
TOO_NEAR: Final = "arm at the bars"
NOT_WANTED: Final = "another branch"


@dataclass(frozen=True, eq=False)
class Reachable:
    """What a robot can measure with the device at one place.

    Attributes
    ----------
    rows
        Configurations, in the order in which to measure them.
    clearance
        Room between arm and bars at each [m], ``(rows,)``.
    left_out
        How many branches of poses were left out, by reason.
    poses
        How many poses were asked for.
    """

    rows: tuple[PlannedRow, ...]
    clearance: Array
    left_out: Mapping[str, int]
    poses: int

    @property
    def poses_reached(self) -> int:
        """How many different poses the configurations take."""
        return len({row.pose for row in self.rows})


def reachable(
    robot: Robot,
    fixture: Transform,
    wanted: Sequence[HexapodPose],
    *,
    device: Device = DEVICE,
    largest_turn: float = math.pi,
    arm_radius: float = ARM_RADIUS,
    branches: Sequence[str] = (),
) -> Reachable:
    """Return the configurations in which a robot can be measured.

    Parameters
    ----------
    robot
        With six joints that are solved in closed form, see :mod:`truearm.modeling.inverse`.
    fixture
        Of the base fixture in the robot's base frame.
    wanted
        Poses of the device for the robot's tool.
    device
        Nominal lengths.
    largest_turn
        No joint that turns is used beyond this, whatever its limits [rad]; Nubiola (4.4) takes 180 deg, for the
        cables.
    arm_radius
        Of the arm's links [m], see :mod:`truearm.planning.hexapod.clearance`.
    branches
        Only branches whose names begin so, such as ``front-up``; all of them if empty.

    Raises
    ------
    InputError
        If the robot has no closed form, there is no such branch, or nothing is left; with the reasons.
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
    turned = fixture.rotation
    position = np.array([turned @ pose.position for pose in wanted]) + np.array(fixture.translation)
    rotation = np.array([turned @ pose.rotation for pose in wanted])
    found = inverse(robot, position, rotation, branch="all")
    usable = np.array([status.usable for status in found.status])
    beyond = np.array([status is PoseStatus.BEYOND_LIMIT for status in found.status])
    turns = [joint.kind == "revolute" for joint in robot.joints]
    wide = (np.abs(found.joints[:, turns]) > largest_turn + 1e-9).any(axis=1)
    starts, ends = _bars(fixture, wanted, found.pose, device)
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
            f"{robot.name} can reach none of the {len(wanted)} poses with the fixture at this place",
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
            pose=wanted[found.pose[row]].number,
            design=wanted[found.pose[row]].design,
            solution=wanted[found.pose[row]].solution,
            joints=found.joints[row],
        )
        for number, row in enumerate(order.tolist(), 1)
    )
    return Reachable(planned, room[order], dict(left_out), len(wanted))


def _bars(
    fixture: Transform, wanted: Sequence[HexapodPose], of_row: NDArray[np.intp], device: Device
) -> tuple[Array, Array]:
    """Return both ends of the six bars of each row's pose and of the base fixture's edges, ``(9, 3, rows)``."""
    base = triangle([device.base] * 3, "B")
    edges = [[base[end] for end in ends] for ends in SIDES]
    bars = [
        [*([base[foot], pose.cups[cup]] for foot, cup in pose.design.legs), *edges] for pose in wanted
    ]  # (poses, bars, ends, 3)
    placed = np.array(bars) @ fixture.rotation.T + np.array(fixture.translation)
    of_rows = np.moveaxis(placed[of_row], 0, -1)
    return of_rows[:, 0], of_rows[:, 1]
