"""Joint effects whose parameters are given in the axes of joints: another convention has other axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.engine.robot.chain import Array, across, axis_of
from truearm.engine.robot.effects.link_bending import LinkBending, bending_names, moment_names
from truearm.engine.robot.effects.run_out import RunOut, run_out_names
from truearm.engine.robot.lines import at_zero
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.robot import Robot

#: Axes that are turned by less [rad] are the same.
_SAME: Final = 1e-12


def in_its_axes(before: Robot, after: Robot) -> Robot:
    """Return a converted robot whose effects do to it what they did to the robot before; its known values are those."""
    if not {LinkBending.name, RunOut.name}.intersection(after.effect_names):
        return after
    turned: dict[str, Parameter] = {}
    for i in after.layout.turning:
        here, there = (_own_axes(robot, i) for robot in (before, after))
        behind, ahead = (new.T @ old for old, new in zip(here, there, strict=True))
        turned |= _seen(before, bending_names(i + 1), behind, behind)
        turned |= _seen(before, run_out_names(i + 1), ahead, np.eye(2))
        for k in range(i + 1, len(before.joints)):
            own, new = (_own_axes(robot, k)[0] for robot in (before, after))
            turned |= _seen(before, moment_names(i + 1, k + 1), new.T @ own, np.eye(1))
    return replace(after, known={**after.known, **turned})


def _seen(robot: Robot, names: Sequence[str], rows: Array, columns: Array) -> Mapping[str, Parameter]:
    """Return a matrix of parameters that is seen from other axes, turned by `rows` and by `columns`."""
    by = np.asarray(np.kron(rows, columns), float)
    if names[0] not in robot.parameters or np.abs(by - np.eye(len(by))).max() < _SAME:
        return {}
    values = by @ [robot.values[name] for name in names]
    if not values.any():
        return {}
    return {name: robot.parameters[name].restarted(float(v)) for name, v in zip(names, values, strict=True)}


def _own_axes(robot: Robot, joint: int) -> tuple[Array, Array]:
    """Return the axes of a joint (from 0) in the world, behind its turn and before it, at zero, as columns."""
    link = robot.link_elements[joint]
    place = next(i for i, element in enumerate(link) if element.variable is not None)
    way = [*robot.base_elements, *(e for each in robot.link_elements[:joint] for e in each)]
    own = np.transpose([*across(link[place]), axis_of(link[place])])
    behind, ahead = (at_zero(robot, [*way, *link[:end]])[:3, :3] @ own for end in (place + 1, place))
    return behind, ahead
