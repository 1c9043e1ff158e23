"""What goes to poses: a target of the robot file by its name, or a place in the flange frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from truearm.errors import InputError
from truearm.jobs.arguments import choice_argument, lengths_argument
from truearm.modeling.robot import Robot

#: What the tip of a robot is called whose target is given by its place alone.
TIP: Final = "tip"


def tip_argument(arm: Robot, target: str | None, tip: Sequence[float] | None, what: str) -> tuple[Robot, str | None]:
    """Return the robot with what goes to poses, and its name; None for the flange.

    Args:
        target, tip: As the job was given them: the name of a target, or a place in the flange frame [m]; None for
            neither.
        what: What one of them alone can do, for the refusal.

    Raises:
        InputError: If both are given, or there is no such target.
    """
    if target is not None and tip is not None:
        raise InputError(f"only one of them can {what}", parameter="target, tip", came=target, cure="Leave one out.")
    if target is not None:
        choice_argument(target, "target", {known.name: known for known in arm.targets})
    if tip is None:
        return arm, target
    return arm.with_frames(arm.base, {TIP: lengths_argument(tip, "tip", 3)}), TIP
