"""The postures that a program means: for every pose the joint readings of the nominal robot, as its controller picks them.

A pose can be reached in up to eight postures and several turns. Configuration data in the program say which is meant;
where they leave a choice, or there are none, it is the posture nearest to where the robot comes from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.compensation.programs.program import Configuration
from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.inverse.branches import BRANCHES, branch_rule
from truearm.modeling.inverse.closed_form import SLOTS, ClosedForm
from truearm.modeling.inverse.kinematics import inverse
from truearm.modeling.inverse.turns import beyond_limits, nearest_turns
from truearm.modeling.robot import Robot

_TURN: Final = 2.0 * np.pi
#: A reading may be this far [rad] beyond a bound of the configuration: programs round, and a joint at 90 deg lies on
#: the edge of a quadrant.
SLACK: Final = np.radians(0.01)
#: A posture may be this far [rad or m] beyond a limit: the program's numbers are rounded.
_BEYOND: Final = 0.02


@dataclass(frozen=True, eq=False)
class MeantPostures:
    """Joint readings of the nominal robot for poses.

    Attributes
    ----------
    joints
        [rad or m], ``(n, joints)``; NaN where there are none.
    reachable
        Whether the nominal robot reaches the pose in any posture, ``(n,)``.
    agreeing
        Whether it does in the configuration that the program states, ``(n,)``.
    """

    joints: Array
    reachable: NDArray[np.bool_]
    agreeing: NDArray[np.bool_]


def meant_postures(nominal: Robot, flange: Array, configurations: Sequence[Configuration], order: Array) -> MeantPostures:
    """Return the postures that a program means.

    Parameters
    ----------
    nominal
        The robot its controller believes in.
    flange
        Poses of its flange in its base frame, ``(n, 4, 4)`` [m].
    configurations
        What the program says of each.
    order
        Joint readings that are known ``(n, joints)``, NaN where they are to be found, in the order in which the robot
        comes from one to the next.

    Raises
    ------
    InputError
        If the arm has fewer than six joints.
    """
