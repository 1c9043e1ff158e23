"""Link bending: what gravity does to an arm whose masses and stiffness nobody knows.

Weight bends links, bearings and gears. Behind each turning joint the arm therefore turns by a small vector. To first
order that vector is linear in the direction in which gravity falls, seen from the joint's own axes: the nine numbers of
the matrix between them are the first harmonics of gravity in the joint's frame. About the joint's own axis each link
further out adds three numbers: its first moment in its own frame, times what the joint gives way by. No mass, lever or
stiffness has to be known, and none is found: the numbers are right for what the arm carried while it was measured, and
for nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final

from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.effect import LinearEffect, Rates
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.postures import Postures, pairs

AXES: Final = ("x", "y", "z")
#: What stiff arms are found to bend by in one joint [rad]: 0.05 mm a metre.
_PRIOR: Final = 5e-5


@dataclass(frozen=True)
class LinkBending(LinearEffect):
    """Parameters ``bending_ab_i`` [rad]: how far all behind joint i turns about its axis a if gravity falls along b.

    ``moment_ak_i`` [rad]: how far joint i turns under a first moment of link k along its axis a, if gravity falls
    across both that and the axis of joint i.

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
        """Nine a turning joint: about x along x, y and z; about y; about z. And three for each joint behind it."""
        count = len(self.layout.kinds)
        names = (
            name
            for i in self.layout.turning
            for name in (*bending_names(i + 1), *(n for k in range(i + 1, count) for n in moment_names(i + 1, k + 1)))
        )
        return tuple(self.parameter(name, "rad", _PRIOR) for name in names)

    def shapes(self, at: Postures) -> Rates:
        """Return the components of the direction in which gravity falls."""
        variables = {i: (*self.layout.tilt(i), i) for i in self.layout.turning}
        shapes: dict[str, dict[int, Array]] = {
            name: {moved[about]: at.free_fall[i, along]}
            for i, moved in variables.items()
            for name, about, along in _terms(i)
        }
        count = len(self.layout.kinds)
        for (i, k), pull in zip(pairs(count), at.free_fall[count:], strict=True):
            if i in variables:
                shapes |= {name: {i: row} for name, row in zip(moment_names(i + 1, k + 1), pull, strict=True)}
        return shapes


def bending_names(number: int) -> tuple[str, ...]:
    """Return the names of a joint's parameters, row by row of the matrix; `number` from 1."""
    return tuple(name for name, *_ in _terms(number - 1))


def moment_names(number: int, link: int) -> tuple[str, ...]:
    """Return the names of what first moments of a link do to a joint, along x, y and z; both from 1."""
    return tuple(f"moment_{axis}{link}_{number}" for axis in AXES)


def _terms(joint: int) -> Iterator[tuple[str, int, int]]:
    """Give each parameter of a joint (from 0): its name, the axis turned about, and the component of gravity."""
    for about, first in enumerate(AXES):
        for along, second in enumerate(AXES):
            yield f"bending_{first}{second}_{joint + 1}", about, along
