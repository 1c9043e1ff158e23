"""A session with the bar on a twin: the distances of the fixtures, then pose after pose (Nubiola, 3.5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from papers.simulated import Ballbar, measured_legs, measured_sides
from papers.tool_changer import ToolChanger
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.dataset_fields import distinct_labels
from truearm.engine.data.hexapod import side_names, tool_cups
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import Twin
from truearm.hexapod.sheet import PlannedRow


@dataclass(frozen=True, eq=False)
class SetUp:
    """Fixtures that stand fast, and what was measured of them."""

    base_cups: Array  #: True places of B1, B2 and B3 in the twin's world [m], ``(3, 3)``.
    base: Array  #: base, tool: measured distances 12, 23 and 31 [m], ``(3,)``.
    tool: Array


def set_up(twin: Twin, touches: Array, bar: Ballbar, approach: Array | None = None) -> SetUp:
    """Lock the base cups where the robot brings its first cup, and measure both fixtures.

    Args:
        twin: Its targets are the three cups of the tool.
        touches: Joint positions at the base cups [rad or m], ``(3, joints)``.
        bar: The ballbar; it is initialised for each fixture.
        approach: Direction of the last move of each joint, ``(3, joints)``; unknown if None.

    Raises:
        InputError: If a distance is beyond the ballbar's range.
    """
    directions = np.zeros(touches.shape) if approach is None else approach
    at_cups = [_cups(twin, joints, direction) for joints, direction in zip(touches, directions, strict=True)]
    base_cups = np.array([cups[0] for cups in at_cups])
    bar.initialise()
    base = _sides(measured_sides(bar, base_cups, "B"), "B")
    bar.initialise()
    return SetUp(base_cups, base, _sides(measured_sides(bar, at_cups[0], "T"), "T"))


def measure_poses(
    twin: Twin,
    fixtures: SetUp,
    rows: Sequence[PlannedRow],
    joints: Array,
    bar: Ballbar,
    *,
    approach: Array | None = None,
    initialise: bool = True,
    changer: ToolChanger | None = None,
) -> Array:
    """Measure one configuration after the other.

    Args:
        twin: Its targets are the three cups of the tool.
        fixtures: From :func:`set_up`.
        rows: What to measure, in order.
        joints: Joint positions to drive to [rad or m], ``(rows, joints)``; those of the rows, or corrected ones.
        bar: The ballbar.
        approach: Direction of the last move of each joint, ``(rows, joints)``; unknown if None.
        initialise: Whether the bar is put on its calibrator before every pose; else it drifts on.
        changer: If given, the tool is attached anew before every pose.

    Returns:
        cups: T1, T2 and T3 in the frame of the base fixture [m], ``(rows, 3, 3)``; NaN where a leg was beyond the
            range.
    """
    directions = np.zeros(joints.shape) if approach is None else approach
    found = np.full((len(rows), 3, 3), np.nan)
    for number, (row, q, direction) in enumerate(zip(rows, joints, directions, strict=True)):
        if initialise:
            bar.initialise()
        attached = twin if changer is None else changer.attached(twin)
        legs = measured_legs(bar, row.design, fixtures.base_cups, _cups(attached, q, direction))
        if len(legs) == len(row.design.legs):
            lengths = np.array([legs[name] for name in row.design.leg_names])
            found[number] = tool_cups(row.design, row.solution, fixtures.base, fixtures.tool, lengths)
    return found


def cups_dataset(robot: Robot, labels: Sequence[str], joints: Array, cups: Array) -> Dataset:
    """Return cups ``(n, 3, 3)`` [m], measured at joint positions ``(n, joints)``, as positions of a robot's targets."""
    n = len(labels)
    return Dataset(
        source="hexapod",
        labels=tuple(labels),
        joints=joints,
        joint_kinds=tuple(joint.kind for joint in robot.joints),
        targets=tuple(target.name for target in robot.targets),
        configuration=np.repeat(np.arange(n), 3),
        target=np.tile(np.arange(3), n),
        position=cups.reshape(-1, 3),
    )


def joined(a: Dataset, b: Dataset) -> Dataset:
    """Return the positions of two sessions as one, in the frame that both have.

    A configuration of the second that is called as one of the first, ``7``, becomes ``7#2``.

    Raises:
        InputError: If their targets or joints are others, or only one of them declares deviations or the like, or one
            holds more than positions.
    """
    where = f"{a.source} and {b.source}"
    if (a.targets, a.joint_kinds) != (b.targets, b.joint_kinds):
        raise InputError("the sessions are not of one robot with one tool", where=where, cure="Name the cups alike.")
    for name in ("quaternion", "sigma_rot", "visit", "references"):
        if getattr(a, name) is not None or getattr(b, name) is not None:
            raise InputError(f"sessions with {name} cannot be joined", where=where, allowed="positions")

    def part(name: str) -> Array | None:
        one, other = getattr(a, name), getattr(b, name)
        if (one is None) != (other is None):
            raise InputError(
                f"only one of the sessions has {name}", where=where, cure="Leave it out of both, or give it in both."
            )
        return None if one is None else np.concatenate([one, other])

    return replace(
        a,
        labels=distinct_labels(a.labels + b.labels),
        joints=np.vstack([a.joints, b.joints]),
        configuration=np.concatenate([a.configuration, b.configuration + a.configurations]),
        target=np.concatenate([a.target, b.target]),
        position=np.vstack([a.position, b.position]),
        sigma=part("sigma"),
        approach=part("approach"),
        number=part("number"),
        temperature=part("temperature"),
        wrench=part("wrench"),
        simulated=a.simulated or b.simulated,
    )


def _cups(twin: Twin, q: Array, direction: Array) -> Array:
    frames = twin.postures(q[None], approach=direction[None])[0].targets
    return np.array([frames[target.name][:3, 3] for target in twin.robot.targets])


def _sides(read: dict[str, float], fixture: str) -> Array:
    names = side_names(fixture)
    for name in names:
        if name not in read:
            raise InputError(
                f"the distance {name} is beyond the range of the ballbar",
                where="fixture",
                cure="Set the cups nearer to their nominal distance.",
            )
    return np.array([read[name] for name in names])
