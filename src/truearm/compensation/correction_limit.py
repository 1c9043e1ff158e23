"""How far a correction may take targets: no farther than the errors of the robot explain.

A frame that was measured elsewhere, another tool's target, a controller's number or a unit that is wrong: each makes a
large correction, and the error that is then expected is small. So what a correction does is held against the robot. Its
nominal and its calibrated self are compared all over the workspace, at the targets of the calibration and with the base
that it found: nothing that a cell file, a wrench or another payload says has a part in that. A correction is allowed to
be twice the largest deviation, in position and in orientation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.compensation.fake_targets import matrices, nominal_robot
from truearm.compensation.gauge import turns_between
from truearm.errors import InputError, Words, wrong_kind
from truearm.modeling.chain import Array
from truearm.modeling.inverse.kinematics import reach
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.units import ANGLE_UNITS, LENGTH_UNITS, quantity_si

#: Configurations at which the two robots are compared.
_CONFIGURATIONS: Final = 1000
#: How many times the largest deviation a correction may be.
_TIMES: Final = 2.0
_EXAMPLE: Final = "95mm,3deg"


@dataclass(frozen=True)
class CorrectionLimit:
    """How far targets may be moved and turned."""

    moved: float  #: [m].
    turned: float  #: [rad].
    words: str = "as accepted"  #: Where it comes from.

    @classmethod
    def of(cls, text: object, parameter: str) -> CorrectionLimit:
        """Read a limit such as ``95mm,3deg``.

        Raises:
            InputError: If it is not a length and an angle, with their units and above zero.
        """
        if not isinstance(text, str):
            raise wrong_kind("a length and an angle belong here", text, parameter, f'a text such as "{_EXAMPLE}"')
        parts = text.split(",")
        if len(parts) != 2:
            raise InputError(
                "a length and an angle belong here, with a comma between",
                parameter=parameter,
                came=text,
                allowed=f"numbers with their units, such as {_EXAMPLE}",
            )
        moved = quantity_si(parts[0], LENGTH_UNITS, parameter, "95", _EXAMPLE)
        turned = quantity_si(parts[1], ANGLE_UNITS, parameter, "3", _EXAMPLE)
        if moved < 0.0 or turned < 0.0:
            raise InputError("a limit is not negative", parameter=parameter, came=text, allowed=_EXAMPLE)
        return cls(moved, turned)

    @property
    def text(self) -> str:
        """In words, in mm and deg."""
        return f"{self.moved * 1e3:.2f} mm and {math.degrees(self.turned):.2f} deg"

    def beside(self, turned: float) -> CorrectionLimit:
        """Return it for targets that a base which had to be assumed turns by so much with itself [rad]."""
        return CorrectionLimit(self.moved, self.turned + turned, f"{self.words}, and the turn of the assumed base")

    def allows(self, other: CorrectionLimit) -> bool:
        """Return whether what moves and turns so far is within it."""
        return other.moved <= self.moved and other.turned <= self.turned


def correction_limit(robot: Robot) -> CorrectionLimit:
    """Return twice the largest deviation of a calibrated robot from the nominal one over the workspace.

    Args:
        robot: Calibrated, as its calibration left it: with the payload that it carried there, and nothing that acts on
            its tool. The deviation is that of its targets, or of its flange if there are none, in the identified base.
            An angle that moves a point by as much at the length of the arm counts as much: frames that were located at
            points turn by that, also where lengths alone are wrong.
    """
    joints = robot.random_configurations(_CONFIGURATIONS, np.random.default_rng(0))
    believed = nominal_robot(robot)
    nominal, real = matrices(believed, joints), np.linalg.inv(robot.base.matrix) @ matrices(robot, joints)
    points = [[*(robot.values[target.parameter(axis)] for axis in "xyz"), 1.0] for target in robot.targets]
    apart = (real - nominal)[:, :3] @ np.array(points or [[0.0, 0.0, 0.0, 1.0]]).T
    moved = float(np.linalg.norm(apart, axis=1).max())
    turned = float(np.linalg.norm(turns_between(nominal, real), axis=1).max())
    words = "twice the largest deviation of the calibrated from the nominal robot in its workspace"
    return CorrectionLimit(_TIMES * moved, _TIMES * max(turned, moved / reach(believed, None)), words)


def check_size(
    moved: Array,
    turned: Array,
    limit: CorrectionLimit,
    accepted: CorrectionLimit | None,
    *,
    where: Callable[[int], str],
    check: str,
    parameter: str,
) -> list[Notice]:
    """Refuse a correction that is larger than the robot explains, or than was accepted in place of that.

    Args:
        moved, turned: By how much it moves [m] and turns [rad] each target, ``(n,)``.
        limit: Of the robot, :func:`correction_limit`.
        accepted: What the user allows in its place; None if nothing was said.
        where: Where the target of a number is written, for the message.
        check: What to look at, in a sentence.
        parameter: What is refused, of the job.

    Returns:
        Notice: What is said of a correction that was accepted and is beyond the limit of the robot; none otherwise.

    Raises:
        InputError: With the largest move and turn, and both limits.
    """
    largest = CorrectionLimit(float(moved.max(initial=0.0)), float(turned.max(initial=0.0)))
    holds = limit if accepted is None else accepted
    if holds.allows(largest):
        said = (
            f"Targets are moved and turned by up to {largest.text}, which was accepted. Errors of this robot explain "
            f"{limit.text}: {limit.words}. {check}"
        )
        return [] if limit.allows(largest) else [Notice("corrections-large", said)]
    worst = int((moved if largest.moved > holds.moved else turned).argmax())
    enough = f"{_up(largest.moved * 1e3)}mm,{_up(math.degrees(largest.turned))}deg"
    raise InputError(
        "the correction is larger than the errors of this robot explain"
        if accepted is None
        else "the correction is larger than what was accepted",
        parameter=parameter,
        where=where(worst),
        came=Words(f"up to {largest.text}"),
        allowed=f"up to {holds.text}, {holds.words}",
        cure=f"{check} If it is right all the same, `accept_correction={enough}` allows it.",
    )


def _up(value: float) -> str:
    """Return a number of two digits or so that is not below a value."""
    if value <= 0.0:
        return "0"
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{math.ceil(value / step) * step:.6g}"
