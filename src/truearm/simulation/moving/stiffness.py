"""How far joints give way to a push, drawn for robots of which nothing is known about that."""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.modeling.robot import Robot

#: What a joint of the arm turns by under the moment of the rated load at the tip, in the middle of all robots [rad].
#: Joint 2 of an IRB 120 turns by 0.0005, joint 3 by 0.002 (Nubiola, Table 2.7); larger arms are stiffer for their load.
_TURN: Final = 3e-4
#: What a prismatic joint moves by under the rated load [m].
_SHIFT: Final = 2e-5
#: The last three joints have small gears: so much more they give way to the same moment.
_WRIST: Final = 3
_WEAKER: Final = 4.0
#: Standard deviation of the logarithm from joint to joint.
_SPREAD: Final = 0.4


def drawn_compliance(robot: Robot, force: float, lever: float, rng: np.random.Generator) -> tuple[float, ...]:
    """Return the compliance of each joint [rad/(N m), m/N of a prismatic one].

    Args:
        force: Weight of the rated load [N].
        lever: Of the tip from the base [m].
        rng: For what is drawn.
    """
    first = len(robot.joints) - _WRIST
    drawn = np.exp(_SPREAD * rng.standard_normal(len(robot.joints)))
    middle = (
        _SHIFT / force if joint.kind == "prismatic" else (_WEAKER if number >= first else 1.0) * _TURN / (force * lever)
        for number, joint in enumerate(robot.joints)
    )
    return tuple(float(one * share) for one, share in zip(middle, drawn, strict=True))
