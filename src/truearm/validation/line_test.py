"""The line test before and after compensation, on a twin or from data (KR5 paper, section 4.2 and equation 21)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from truearm.errors import InputError
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.parts import Target
from truearm.modeling.robot import Robot
from truearm.planning.poses.seven_lines import DIRECTIONS, SevenLines
from truearm.simulation.twin import Twin


@dataclass(frozen=True, eq=False)
class LineErrors:
    """How far a robot is from the poses of a line test."""

    lines: SevenLines  #: The poses.
    error: Array  #: Distance from each pose ``(7 k,)`` [m], the mean over repetitions; NaN where it was not measured.

    def largest(self, direction: str) -> float:
        """Return the largest error on a line [m]."""
        return float(np.nanmax(self.error[self.lines.rows(direction)]))

    def mean(self, direction: str) -> float:
        """Return the mean error on a line [m]."""
        return float(np.nanmean(self.error[self.lines.rows(direction)]))


def on_twin(
    lines: SevenLines, twin: Twin, joints: Array, scatter: float, repeats: int, rng: np.random.Generator
) -> LineErrors:
    """Let a twin go to joint positions and see how far its flange is from the poses, in its own base frame.

    Args:
        joints: Joint positions that are commanded, ``(7 k, joints)`` [rad].
        scatter: Standard deviation of each coordinate of a repetition: the robot's and the instrument's [m].
        repeats: How often each pose is measured.
    """
    base = twin.robot.base
    base_frame = np.eye(4)
    base_frame[:3, :3], base_frame[:3, 3] = base.rotation, base.translation
    rest = _flange_of(twin, joints)
    true = np.array([(np.linalg.inv(base_frame) @ T)[:3, 3] for T in rest])
    seen = true + rng.normal(0.0, 1.0, (repeats, *true.shape)) * scatter
    return LineErrors(lines, np.asarray(np.linalg.norm(seen - lines.position, axis=2).mean(axis=0)))


def _flange_of(twin: Twin, joints: Array) -> list[Array]:
    """Return ``T_world_flange`` ``(4, 4)`` of a twin at joint positions ``(n, joints)``."""
    flange = replace(twin, robot=replace(twin.robot, targets=(Target("flange", (1.0, 0.0, 0.0, 0.0)),)))
    return [posture.targets["flange"] for posture in flange.postures(joints)]


def from_data(lines: SevenLines, robot: Robot, data: Dataset) -> LineErrors:
    """Return errors that were measured.

    Args:
        robot: Where it stands before the instrument, with the targets on its flange: the poses are taken there.
        data: Configurations called as the poses are, ``x-1`` to ``xyz-11``; a repetition is another reading of the
            same.

    Raises:
        InputError: If a configuration has another name, a target is not known, or a line was not measured at all.
    """
    base = robot.base
    of = {label: i for i, label in enumerate(lines.labels)}
    unknown = [label for label in data.labels if label not in of]
    if unknown:
        raise InputError(
            "the configuration is not a pose of the line test",
            where=data.source,
            came=unknown[0],
            allowed=f"{lines.labels[0]} to {lines.labels[-1]}",
            cure="Name configurations as the plan of 'truearm lines' does.",
        )
    sums, counts = np.zeros(len(lines.labels)), np.zeros(len(lines.labels))
    for index, name in enumerate(data.targets):
        at = robot.target(name)
        offset = np.array([robot.values[at.parameter(axis)] for axis in "xyz"])
        wanted = (lines.position + lines.rotation @ offset) @ base.rotation.T + base.translation
        for reading in np.flatnonzero((data.target == index) & data.has_position):
            pose = of[data.labels[int(data.configuration[reading])]]
            sums[pose] += float(np.linalg.norm(data.position[reading] - wanted[pose]))
            counts[pose] += 1
    for direction in DIRECTIONS:
        if not counts[lines.rows(direction)].any():
            raise InputError(
                "a line was not measured", where=data.source, came=f"no pose of line {direction}", allowed="all seven"
            )
    with np.errstate(invalid="ignore"):
        return LineErrors(lines, sums / counts)


def reduction(before: LineErrors, after: LineErrors, direction: str) -> float:
    """Return by how much the largest error of a line fell [percent]."""
    return 100.0 * (1.0 - after.largest(direction) / before.largest(direction))
