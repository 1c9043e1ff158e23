"""The targets of a program that is written from scratch: joint positions, and poses with their postures.

Every number has the decimals that the language's own targets have.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from truearm.compensation.programs.numbers import written
from truearm.compensation.programs.program import Form
from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.inverse.branches import BRANCHES


@dataclass(frozen=True, eq=False)
class NewTargets:
    """Targets to write."""

    name: str  #: Of the program.
    robot: str  #: For whom it is, for a comment.
    joints: Array  #: Joint positions as the controller shows them [rad; m for sliding joints], ``(n, joints)``.
    sliding: tuple[bool, ...]  #: Which joints slide.
    #: Of the controller's flange in its base frame, ``(n, 4, 4)`` [m]; None where all targets are joint positions.
    poses: Array | None
    #: Number of the branch of each pose, as in :data:`truearm.modeling.inverse.branches.BRANCHES`; None where they are
    #: not known.
    branches: tuple[int, ...] | None

    def words(self, row: int) -> tuple[str, str, str]:
        """Return shoulder, elbow and wrist of the posture of a pose."""
        if self.branches is None:
            raise InputError(
                "the postures of this arm have no names, and this language asks for them",
                where=self.robot,
                allowed="an arm of six joints whose wrist crosses",
                cure="Write joint positions instead of poses.",
            )
        shoulder, elbow, wrist = BRANCHES[self.branches[row]].split("-")
        return shoulder, elbow, wrist

    def axes(self, row: int, form: Form, least: int = 6) -> list[str]:
        """Return the joint positions of a target as a language writes them, zeros for those that the arm does not have.

        Args:
            form: What the language's numbers mean.
            least: How many numbers the language writes at least.
        """
        units = [form.length if slides else form.angle for slides in self.sliding]
        decimals = [form.decimals[0] if slides else form.decimals[1] for slides in self.sliding]
        values = self.joints[row].tolist()
        axes = [written(v / unit, d) for v, unit, d in zip(values, units, decimals, strict=True)]
        return axes + [written(0.0, form.decimals[1])] * (least - len(axes))

    def pose(self, row: int, form: Form) -> list[str]:
        """Return the numbers of the pose of a target as a language writes them."""
        assert self.poses is not None
        assert form.orientation is not None
        matrix = self.poses[row]
        orientation = form.orientation
        start = np.zeros((1, orientation.count))
        start[0, 0] = float(orientation.count == 4)
        numbers = orientation.nearest(matrix[None, :3, :3], start)[0]
        scale = 1.0 if orientation.count == 4 else form.angle
        turned = [written(float(v) / scale, form.decimals[1]) for v in numbers]
        return [written(float(v) / form.length, form.decimals[0]) for v in matrix[:3, 3]] + turned


def ascii_only(text: str) -> str:
    """Return a text with a question mark for what controllers may not read."""
    return re.sub(r"[^ -~]", "?", text)
