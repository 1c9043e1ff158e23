"""What the robot carries at the targets of programs: the masses of the tools that the programs define."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from truearm.compensation.programs.program import Program
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot

#: Programs write a gram where a mass has to be and is not known [kg].
_NOT_GIVEN: Final = 0.01


def loads_of_tools(robot: Robot, programs: Sequence[Program]) -> dict[str, Payload | None]:
    """Return what the programs say of the load of each tool in use, in the robot's own flange frame.

    By the name of the tool as targets write it; None for a tool without a mass, and for one to which two programs give
    different ones.
    """
    found: dict[str, Payload | None] = {}
    for tool, load in _said(programs):
        here = None if load is None or load.mass < _NOT_GIVEN else _in_flange(robot, load)
        found[tool] = here if found.get(tool, here) == here else None
    return found


def arms_of_tools(robot: Robot, loads: Mapping[str, Payload | None]) -> dict[str, Robot]:
    """Return the robot as it carries each tool; as it is where the load is not known."""
    if not any(effect.loaded for effect in robot.effects):
        return dict.fromkeys(loads, robot)
    arms = {load: robot.with_payload(load) for load in dict.fromkeys(loads.values())}
    return {tool: arms[load] for tool, load in loads.items()}


def _said(programs: Sequence[Program]) -> Iterator[tuple[str, Payload | None]]:
    for program in programs:
        loads = {name.lower(): load for name, load in program.loads.items()}
        for tool in dict.fromkeys(target.tool for target in program.targets):
            yield tool, loads.get(tool.lower())


def _in_flange(robot: Robot, load: Payload) -> Payload:
    """Return a load whose centre is given in the controller's flange frame."""
    flange = robot.controller.flange.matrix
    x, y, z = (flange[:3, :3] @ np.array(load.cog) + flange[:3, 3]).tolist()
    return Payload(load.mass, (x, y, z))
