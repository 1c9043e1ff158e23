"""Programs for a controller of which nobody said how it counts the joints: what is refused, and what is said.

FANUC's controllers count the third joint together with the second (:mod:`truearm.modeling.controller`), which no table
of link parameters can say: there the model's joint positions are wrong by the second joint, often by tens of degrees.
"""

from __future__ import annotations

from typing import Final

from truearm.errors import InputError
from truearm.modeling.robot import Robot
from truearm.notices import Notice

#: Languages of controllers that are known to count joints together.
_COUNTED_TOGETHER: Final = ("FANUC LS",)
#: What stands in a program with joint positions of the model, in comments of 32 characters at most.
ASSUMED: Final = ("Joint counting is not known:", "compare joints with the pendant")


def refuse_unknown_counts(robot: Robot, language: str) -> None:
    """Refuse a program with joint positions for controllers that are known to count otherwise than a model can.

    Raises:
        InputError: If the robot file does not say how its controller counts, and the language is of such controllers.
    """
    if robot.controller.counts_known or language not in _COUNTED_TOGETHER:
        return
    raise InputError(
        f"it is not known how the controller of {robot.name} counts its joints, and controllers that run "
        f"{language} count joint 3 together with joint 2: the model's joint positions would drive the arm elsewhere",
        parameter="program",
        where=robot.name,
        allowed="a robot file with the entry controller",
        cure="State under controller, joints, how it counts, as {joint: axis_3, sign: -1, coupling: {axis_2: 1}}, "
        "and compare with the pendant; or, under controller, the source that says it counts as the model does.",
    )


def counts_notices(robot: Robot) -> list[Notice]:
    """Return what is to be said of a program for a robot whose controller's counting is not known."""
    if robot.controller.counts_known:
        return []
    return [
        Notice(
            "controller-counts-assumed",
            f"It is not known how the controller of {robot.name} counts its joints: the program has the model's "
            "joint positions. Compare them with the pendant before anything moves, and say under controller in "
            "the robot file how it counts.",
        )
    ]


def counts_comments(robot: Robot) -> tuple[str, ...]:
    """Return the same for the comments of a program."""
    return () if robot.controller.counts_known else ASSUMED
