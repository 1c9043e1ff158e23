"""A calibration with the device in two steps, simulated on a twin (Nubiola, 4.4).

The robot, with its nominal model, brings one cup of its tool to three places that it takes to be the nominal distances
apart; there the base cups are locked. Then it takes every pose that it can reach, and what lies beyond the ballbar's
range is skipped. A preliminary calibration from the poses that could be measured brings more of them into range, and
the final calibration is made from all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.hexapod import HexapodPose, triangle
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import Model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rigid_motion
from truearm.engine.twin.twin import Twin
from truearm.hexapod.places import WorldFrame, world_frame
from truearm.hexapod.rehearsal import Ballbar, cups_dataset, joined, measure_poses, set_up
from truearm.hexapod.sheet import PlannedRow


@dataclass(frozen=True, eq=False)
class Campaign:
    """Both steps."""

    touches: Array  #: Joint positions at the three base cups [rad or m], ``(3, joints)``.
    base_cups: Array  #: True places of the base cups in the twin's world [m], ``(3, 3)``.
    sides: Array  #: Measured distances 12, 23, 31 of the base [m].
    first: tuple[int, ...]  #: first, second: which rows were measured in each step.
    second: tuple[int, ...]
    out_of_range: tuple[int, ...]  #: Rows that no step could measure.
    data: Dataset  #: All readings, those of the first step first; the frame is that of the base fixture.
    preliminary: Fit  #: preliminary, final: fits of the first step's readings and of all.
    final: Fit

    def frame_by(self, robot: Robot, target: str) -> WorldFrame:
        """Return the fixture's frame in the robot's world by a model, from the touches at the cups (Nubiola, 4.3)."""
        return world_frame(robot.world_poses(self.touches, target)[0], self.sides)


def touching(robot: Robot, target: str, fixture: Transform, side: float, towards: Array) -> Array:
    """Return joint positions that bring a target to the three base cups by the robot's own model, ``(3, joints)``.

    Args:
        robot: With the target.
        target: The cup of the tool with which the robot touches.
        fixture: Of the base fixture in the robot's base frame.
        side: Distance between the cups [m].
        towards: Orientation of the flange in the robot's base frame, ``(3, 3)``.

    Raises:
        InputError: If the robot does not reach a cup.
    """
    cups = triangle([side] * 3, "B") @ fixture.rotation.T + np.array(fixture.translation)
    found = inverse(robot, cups, np.broadcast_to(towards, (3, 3, 3)), target=target)
    for cup, status in enumerate(found.status):
        if not status.usable:
            raise InputError(
                f"{robot.name} cannot bring its cup {target} to B{cup + 1}",
                where="fixture",
                came=status.value,
                cure=f"{found.advice(cup)} Move the fixture.",
            )
    return found.joints


def two_steps(
    robot: Robot,
    twin: Twin,
    touches: Array,
    wanted: Sequence[HexapodPose],
    rows: Sequence[PlannedRow],
    model: Model,
    bar: Ballbar,
) -> Campaign:
    """Simulate both steps.

    Args:
        robot: The nominal robot, with the tool's three cups as targets.
        twin: The true one; its targets are the cups, in the same order.
        touches: Joint positions at the base cups, from :func:`touching` with the first target.
        wanted: The device's poses for this tool.
        rows: Configurations to measure, planned with the nominal robot.
        model: What both calibrations free.
        bar: The ballbar; it is initialised before every pose.

    Raises:
        InputError: If a distance of a fixture, or every pose, is beyond the ballbar's range.
    """
    by_number = {pose.number: pose for pose in wanted}
    fixtures = set_up(twin, touches, bar)

    def measured(tried: Sequence[int], joints: Array) -> dict[int, Array]:
        """Return the tool's cups in the fixture's frame at each row of which all legs were in range."""
        cups = measure_poses(twin, fixtures, [rows[row] for row in tried], joints, bar)
        return {row: at for row, at in zip(tried, cups, strict=True) if np.isfinite(at).all()}

    nominal = np.array([row.joints for row in rows])
    first = measured(range(len(rows)), nominal)
    if not first:
        raise InputError(
            "not one pose is within the ballbar's range",
            where=robot.name,
            came=f"{len(rows)} poses beyond +/- {bar.device.reach * 1e3:g} mm",
            cure="Calibrate the joint zeros by other means first.",
        )
    data = _data(robot, first, nominal)
    preliminary = identify(robot, data, model)
    left = [row for row in range(len(rows)) if row not in first]
    again = nominal.copy()
    if left:
        again[left] = _corrected(preliminary.robot, [by_number[rows[row].pose] for row in left], nominal[left])
    second = measured(left, again[left])
    if second:
        more = _data(robot, second, again)
        data = joined(data, more)
    return Campaign(
        touches=touches,
        base_cups=fixtures.base_cups,
        sides=fixtures.base,
        first=tuple(first),
        second=tuple(second),
        out_of_range=tuple(row for row in left if row not in second),
        data=data,
        preliminary=preliminary,
        final=identify(robot, data, model) if second else preliminary,
    )


def _corrected(robot: Robot, poses: Sequence[HexapodPose], near: Array) -> Array:
    """Return joint positions near `near` at which the calibrated cups are those of the poses."""
    on_flange = np.array([robot.world_poses(near[:1], target.name)[0][0] for target in robot.targets])
    position, rotation = robot.world_poses(near[:1])
    on_flange = (on_flange - position[0]) @ rotation[0]
    R, p = rigid_motion(on_flange, np.array([pose.cups for pose in poses]))
    found = inverse(robot, p, R, frame="world", seed=near)
    usable = np.array([status.usable for status in found.status])
    return np.where(usable[:, None], found.joints, near)


def _data(robot: Robot, cups: Mapping[int, Array], joints: Array) -> Dataset:
    labels = [str(row + 1) for row in cups]
    return cups_dataset(robot, labels, joints[list(cups)], np.array(list(cups.values())))
