"""What a set of poses is asked for."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from truearm.engine.base.errors import InputError
from truearm.engine.command.groups import AtTip, Drawn, InBox, InCube, JointsWritten, OfRobot, Repeatable
from truearm.engine.command.kinds import Choice, File, Given, Number, Whole
from truearm.engine.command.request import job, option, required

if TYPE_CHECKING:
    from truearm.planning.posing import PlannedPoses


class _Orientation(Given):
    """How a tip is turned: a name, or a quaternion."""

    _allowed = "free, down, or a quaternion w,x,y,z"

    def check(self, value: Any, name: str) -> Any:
        """Return a name or a quaternion of length 1."""
        from truearm.engine.command.arguments import choice_argument, numbers_argument
        from truearm.engine.data.readers.rows import QUATERNION_TOLERANCE

        if isinstance(value, str):
            return choice_argument(value, name, {"free": "free", "down": "down"}, "orientation")
        quaternion = numbers_argument(value, name, 4, self._allowed)
        size = math.hypot(*quaternion)
        if abs(size - 1.0) > QUATERNION_TOLERANCE:
            raise InputError(
                "a quaternion (w, x, y, z) has length 1",
                parameter=name,
                came=f"length {size:.6g}",
                allowed=f"1 within {QUATERNION_TOLERANCE:g}",
                cure="Divide its numbers by that length, or correct them.",
            )
        return quaternion

    def read(self, typed: Any, name: str) -> Any:
        """Return numbers where the text has them."""
        from truearm.engine.command.texts import read_numbers

        return read_numbers(typed, name, self._allowed) if "," in typed else typed

    def typed_again(self, value: Any) -> list[str]:
        """Return the name, or the numbers with commas between."""
        return [value] if isinstance(value, str) else [",".join(map(str, value))]


def _sets() -> Collection[str]:
    from truearm.planning.pose_sets import POSE_SETS

    return POSE_SETS


class PosesOfSet(OfRobot, InBox, InCube, AtTip, Drawn, JointsWritten, Repeatable):
    """Write a set of poses: those of ISO 9283 in a cube, or those of a ballbar on a sphere.

    SET.csv has their joint positions, and room for readings; SET-poses.csv has the poses, for truearm ik.
    """

    job = "poses"
    refuses = "If there is no such set, the cube is given by halves, or the robot can go to none of the poses."
    set: str = required(
        Choice("NAME", _sets, "set of poses"), "p1-p5, iso-cube, diagonal, 118 or sphere.", kw_only=False, word="set"
    )
    out: str | Path | None = option(
        File("SET.csv"),
        "File to write, with SET-poses.csv and SET.html beside it.",
        default=None,
        needed=True,
        repeated=False,
        more="None writes nothing.",
    )
    side: float | None = option(
        Number("mm"), "Of the cube; the diameter of the sphere.", default=None, shown="the largest cube"
    )
    count: int | None = option(Whole(low=1), "Poses of diagonal, 118 and sphere.", default=None, shown="25, 118 and 50")
    tip_orientation: Literal["free", "down"] | Sequence[float] = option(
        _Orientation("free|down|QW,QX,QY,QZ"),
        "Of the tip in the base frame.",
        default="free",
        more="``down``: its z axis against that of the base, its x axis along the base's.",
        formerly="orientation",
    )

    def check(self) -> None:
        """Refuse a cube that is given by halves, and a sphere without a place."""
        halved = (self.centre is None) != (self.side is None)
        if halved or (self.set == "sphere" and self.centre is None):
            sphere = self.set == "sphere"
            raise InputError(
                "the sphere needs its centre and its size"
                if sphere
                else "a cube needs its centre and its side, or neither of them",
                parameter="centre, side",
                came="only one of them" if halved else "neither",
                cure="Give both." if sphere else "Give both, or leave both out for the largest cube.",
            )

    def run(self) -> PlannedPoses:
        """Find the poses."""
        from truearm.planning.posing import posed

        return posed(self)


poses = job(PosesOfSet)
