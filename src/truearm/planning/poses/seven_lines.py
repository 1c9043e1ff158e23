"""The seven-direction line test: poses along the axes and diagonals of a box (KR5 paper, sections 3.1 and 4.2).

The document does not say where its lines lie in their box of 600 x 800 x 400 mm. Here all of them go through the middle
of the box, from side to side, from edge to edge and from corner to corner.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.inverse import inverse
from truearm.modeling.inverse.solutions import JointSolutions
from truearm.modeling.robot import Robot

DIRECTIONS: Final = ("x", "y", "z", "xy", "yz", "xz", "xyz")
#: Poses on each line, as in the document.
POSES_EACH: Final = 11
#: The tool points down: flange x along the base's x, flange z against its z.
DOWN: Final = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True, eq=False)
class SevenLines:
    """Poses of the line test, line after line."""

    position: Array  #: Of the flange in the robot's base frame [m], ``(7 k, 3)``.
    rotation: Array  #: ``(3, 3)``, the same everywhere.
    labels: tuple[str, ...]  #: ``x-1`` to ``xyz-k``.

    @property
    def poses_each(self) -> int:
        """Poses on each line."""
        return len(self.labels) // len(DIRECTIONS)

    def rows(self, direction: str) -> slice:
        """Return which poses lie on a line."""
        first = DIRECTIONS.index(direction) * self.poses_each
        return slice(first, first + self.poses_each)

    def joints(self, robot: Robot) -> Array:
        """Return the nominal robot's joint positions ``(7 k, joints)``.

        Raises:
            InputError: If it cannot go to one of the poses, with its label.
        """
        rotation = np.broadcast_to(self.rotation, (len(self.position), 3, 3))
        return usable_joints(inverse(robot, self.position, rotation, seed=self._seed(robot)), self.labels, "line test")

    def _seed(self, robot: Robot) -> Array:
        """Return joint positions at the middle of the box, near which all others shall lie."""
        middle = self.position.mean(axis=0)
        found = inverse(robot, middle[None], self.rotation[None])
        return np.asarray(usable_joints(found, ("the middle of the box",), "line test")[0])


def seven_lines(centre: ArrayLike, size: ArrayLike, poses_each: int = POSES_EACH, rotation: Array = DOWN) -> SevenLines:
    """Return the poses of the line test.

    Args:
        centre, size: Of the box in the robot's base frame [m], three numbers each.
        poses_each: On each line, 2 or more.
        rotation: Of the flange.

    Raises:
        InputError: If the box has no size.
    """
    middle, lengths = np.asarray(centre, float), np.asarray(size, float)
    if lengths.shape != (3,) or not (lengths > 0.0).all():
        raise InputError("the box needs three sizes above zero", where="size", came=lengths.tolist())
    if poses_each < 2:
        raise InputError("a line needs two poses or more", where="poses on each line", came=poses_each)
    along = np.linspace(-0.5, 0.5, poses_each)[:, None]
    lines = [middle + along * lengths * [float(axis in direction) for axis in "xyz"] for direction in DIRECTIONS]
    labels = tuple(f"{direction}-{i}" for direction in DIRECTIONS for i in range(1, poses_each + 1))
    return SevenLines(np.concatenate(lines), rotation, labels)


def usable_joints(solutions: JointSolutions, labels: tuple[str, ...], where: str) -> Array:
    """Return the joint positions of solutions, one a pose, or refuse the first that cannot be gone to."""
    for row, status in enumerate(solutions.status):
        if not status.usable:
            raise InputError(
                "the robot cannot go to a pose",
                where=f"{where}, {labels[int(solutions.pose[row])]}",
                came=solutions.advice(row),
                cure="Move the box, or make it smaller.",
            )
    return solutions.joints
