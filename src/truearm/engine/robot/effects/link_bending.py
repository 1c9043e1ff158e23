"""Link bending: what gravity does to an arm whose masses and stiffness nobody knows.

Weight bends links, bearings and gears. Behind each turning joint the arm therefore turns by a small vector. To first
order that vector is linear in the direction in which gravity falls, seen from the joint's own axes: the nine numbers of
the matrix between them are the first harmonics of gravity in the joint's frame. No mass, lever or stiffness has to be
known, and none is found: the numbers are right for what the arm carried while it was measured, and for nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

from truearm.engine.robot.effects.effect import LinearEffect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures

AXES: Final = ("x", "y", "z")
#: What stiff arms are found to bend by in one joint [rad]: 0.05 mm a metre.
_PRIOR: Final = 5e-5


@dataclass(frozen=True)
class LinkBending(LinearEffect):
    """Parameters ``bending_ab_i`` [rad]: how far all behind joint i turns about its axis a if gravity falls along b.

    Both are axes of the joint behind its own turn, as those of loads are. What it carries does not matter to the
    effect, which is therefore right for the load that was measured only. Where gravity never falls along an axis of a
    joint, or always does (z of an upright first joint), the data do not tell that column from geometry.
    """

    name: ClassVar[str] = "link-bending"
    falls: ClassVar[bool] = True
    tilts: ClassVar[bool] = True
    selectable: ClassVar[bool] = False
    exportable: ClassVar[bool] = True

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Nine a turning joint: about x along x, y and z; about y; about z."""
        return tuple(self.parameter(name, "rad", _PRIOR) for i in self.layout.turning for name, *_ in _terms(i))

    def shapes(self, at: Postures) -> Rates:
        """Return the components of the direction in which gravity falls."""
        variables = {i: (*self.layout.tilt(i), i) for i in self.layout.turning}
        return {
            name: {moved[about]: at.free_fall[i, along]}
            for i, moved in variables.items()
            for name, about, along in _terms(i)
        }


def bending_names(number: int) -> tuple[str, ...]:
    """Return the names of a joint's parameters, row by row of the matrix; `number` from 1."""
    return tuple(name for name, *_ in _terms(number - 1))


def _terms(joint: int) -> Iterator[tuple[str, int, int]]:
    """Give each parameter of a joint (from 0): its name, the axis turned about, and the component of gravity."""
    for about, first in enumerate(AXES):
        for along, second in enumerate(AXES):
            yield f"bending_{first}{second}_{joint + 1}", about, along
