"""What to know of what a plan is made with: its load, and the load and targets that nobody said."""

from __future__ import annotations

from typing import Final

from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.simulation.truths import DEFAULT_TOOL

#: A message names no more targets.
_MOST_NAMED: Final = 6


def load_notices(robot: Robot) -> list[Notice]:
    """Return what to know of a load above that for which the arm is rated, or of an arm whose rating is not known."""
    mass = robot.payload.mass
    if robot.rated_load is None:
        if mass <= 0.0:
            return []
        return [
            Notice(
                "rating-unknown",
                f"The flange carries {mass:g} kg, and the robot file does not say for how much {robot.name} is rated "
                "(rated_load): see that it may carry that.",
                "note",
            )
        ]
    if mass <= robot.rated_load:
        return []
    return [
        Notice(
            "overload",
            f"The flange carries {mass:g} kg, and {robot.name} is rated for {robot.rated_load:g} kg. "
            "Check the unit and the tool of `payload` before anything is driven.",
        )
    ]


def targets_notices(robot: Robot, given: Robot, device: str = "") -> list[Notice]:
    """Return what to know of targets that a plan without a program has assumed.

    Args:
        robot: With the targets.
        given: The robot as the user has it.
        device: What measures, where that was said.
    """
    if given.targets:
        return []
    return [
        Notice(
            "tool-assumed",
            "Nobody said the targets of the flange: what is measured, and kept clear, is assumed, "
            f"{_taken(robot, given, device, weighed=True)}. State the targets in the robot file.",
            "note",
        )
    ]


def assumed_notices(robot: Robot, given: Robot, device: str = "", *, weighed: bool) -> list[Notice]:
    """Return what to know of the load and the targets that a program has taken for those that nobody said.

    Args:
        robot: With the targets, and what it carries.
        given: The robot as the user has it.
        device: What measures, where that was said.
        weighed: Whether the user said what it carries.
    """
    unsaid = [word for word, said in (("the load", weighed), ("the targets", bool(given.targets))) if not said]
    if not unsaid:
        return []
    cures = ["A wrong load can stop the robot or let it give way: state `payload`."] if not weighed else []
    cures += [] if given.targets else ["State the targets in the robot file."]
    return [
        Notice(
            "tool-assumed",
            f"Nobody said {' and '.join(unsaid)} of the flange: the program tells the controller of what is "
            f"assumed, {_taken(robot, given, device, weighed=weighed)}. {' '.join(cures)}",
        )
    ]


def _taken(robot: Robot, given: Robot, device: str, *, weighed: bool) -> str:
    """Say which load and targets a plan has taken for those that nobody said, and whence."""
    said = [] if weighed else [f"{robot.payload.mass:g} kg at {_at(robot.payload.cog)} mm"]
    if given.targets:
        return said[0]
    there = {one.name: robot.tool_place(one.name).translation for one in robot.targets}
    name, tool = next(iter(given.tools.items()), ("", DEFAULT_TOOL))
    said += [f"target {target} at {_at(place)} mm" for target, place in [*there.items()][:_MOST_NAMED]]
    whence = f"the first tool of the robot file, {name}" if name else "three reflectors about 150 mm apart"
    if there != dict(tool.targets):
        whence = f"as of the device {device}" if device else "targets where the readings have them"
    return f"{', '.join(said)}{', and others' if len(there) > _MOST_NAMED else ''} ({whence})"


def _at(point: tuple[float, float, float]) -> str:
    return f"({', '.join(f'{1e3 * v:.4g}' for v in point)})"
