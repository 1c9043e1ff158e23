"""A new program: the targets of a motion, one after the other, for every robot language to write down.

The first target is gone to by a joint motion, and says in which posture the arm begins. The others follow by joint
motions, or in straight lines. Every number has the decimals that the language's own targets have.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.compensation.programs.numbers import written
from truearm.compensation.programs.program import Form
from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.inverse.branches import BRANCHES

#: What a program may be called in every language: FANUC's controllers allow the fewest characters.
NAME: Final = r"[A-Za-z][A-Za-z0-9_]{0,31}"
#: What stands in a program that was written corrected, in a comment of its own.
MARK: Final = "corrected by truearm"
#: Languages that have no words for the time of a joint motion.
_UNTIMED: Final = ("KRL", "INFORM", "VAL3")
#: Controllers take no shorter time than this for a move [s], and no lower speed [m/s].
_SHORTEST: Final = 1e-3
_SLOWEST: Final = 1e-4


@dataclass(frozen=True, eq=False)
class NewProgram:
    """The targets of a program to write.

    Attributes
    ----------
    name
        Of the program.
    robot
        For whom it is, for a comment.
    joints
        Joint positions as the controller shows them [rad; m for sliding joints], ``(n, joints)``.
    sliding
        Which joints slide.
    poses
        Of the controller's flange in its base frame, ``(n, 4, 4)`` [m]: targets are these. None for targets that are
        joint positions.
    branches
        Number of the branch of each pose, as in :data:`truearm.modeling.inverse.branches.BRANCHES`; None where they
        are not known.
    durations
        Time of the move to each target [s], ``(n,)``; that to the first is of no meaning.
    speeds
        Mean speed of the tip in that move [m/s], ``(n,)``.
    spacing
        Distance of the tip from the target before [m], ``(n,)``.
    corrected
        Whether the targets are corrected for one robot, which then must not be done again.
    beside
        How far the tip leaves the path between the targets [m].
    """

    name: str
    robot: str
    joints: Array
    sliding: tuple[bool, ...]
    poses: Array | None
    branches: tuple[int, ...] | None
    durations: Array
    speeds: Array
    spacing: Array
    corrected: bool
    beside: float

    def __len__(self) -> int:
        return len(self.joints)

    def untimed(self, language: str) -> bool:
        """Return whether a language has no words for the time of these moves."""
        return self.poses is None and language in _UNTIMED

    @property
    def comments(self) -> tuple[str, ...]:
        """What a person should know who opens the program, in ASCII, 32 characters at most."""
        kind = "joint positions" if self.poses is None else "poses of the flange"
        text = [f"Path for {ascii_only(self.robot)[:20]}", f"{len(self)} targets: {kind}"]
        return (*text, *((MARK, "do not correct it again") if self.corrected else ()))

    def seconds(self, row: int) -> float:
        """Return the time of the move to a target [s]."""
        return max(float(self.durations[row]), _SHORTEST)

    def speed(self, row: int) -> float:
        """Return the speed of the tip in the move to a target [m/s]."""
        return max(float(self.speeds[row]), _SLOWEST)

    def blend(self, row: int) -> float:
        """Return how far from a target its neighbours' moves may be rounded off into each other [m]; 0 at the ends."""
        if row == 0 or row == len(self) - 1:
            return 0.0
        return float(min(1e-3, 0.4 * min(self.spacing[row], self.spacing[row + 1])))

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

        Parameters
        ----------
        form
            What the language's numbers mean.
        least
            How many numbers the language writes at least.
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
