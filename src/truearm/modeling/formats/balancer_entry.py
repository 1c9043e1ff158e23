"""The entry `balancers` of a robot file: springs and gas cylinders between two links."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from pydantic import BaseModel, Field

from truearm.errors import InputError
from truearm.modeling.balancers import Anchor, Balancer
from truearm.modeling.chain import Array, Chain, Element
from truearm.modeling.formats.entries import STRICT, Name, NotNegative, Number, Positive, Triple
from truearm.modeling.lines import at_zero
from truearm.units import sized_si, written

if TYPE_CHECKING:
    from truearm.modeling.robot import Robot

#: Anchors nearer to each other, or to the axis that they should relieve, hold nothing [m].
_NEAREST: Final = 1e-3
#: No arm's balancer pulls harder [N].
_STRONGEST: Final = 1e6
#: Steps of a joint through its range.
_STEPS: Final = 361
#: A bar on a square millimetre [N].
_BAR_MM2: Final = 0.1
_HOW: Final = "free_length; or length and force; or length, pressure and area"


class AnchorEntry(BaseModel):
    """A point of a link."""

    model_config = STRICT
    link: Annotated[int, Field(strict=True)]
    point: Triple


class BalancerEntry(BaseModel):
    """A spring or a cylinder; its force grows with the distance of its anchors."""

    model_config = STRICT
    name: Name | None = None
    fixed: AnchorEntry
    moving: AnchorEntry
    stiffness: NotNegative
    free_length: Positive | None = None
    length: Positive | None = None
    force: Number | None = None
    pressure: Positive | None = None
    area: Positive | None = None

    def balancer(self, number: int, links: int, length: str, where: str) -> Balancer:
        """Return the balancer that the entry describes.

        Args:
            number: Of the balancer, from 1.
            links: How many links the robot has.
            length: Unit of the file's lengths. Force is in N, stiffness in N/mm, pressure in bar and area in mm^2,
                always.
            where: Names the entry in messages.

        Raises:
            InputError: If a link is none, both anchors are on one link, or the force is not stated, or stated twice, or
                absurd.
        """
        anchors = []
        for name, entry in (("fixed", self.fixed), ("moving", self.moving)):
            if not 0 <= entry.link <= links:
                raise InputError(
                    "there is no such link",
                    where=f"{where}.{name}.link",
                    came=entry.link,
                    allowed=f"0, the base, to {links}",
                )
            x, y, z = (sized_si(v, length, f"{where}.{name}.point") for v in entry.point)
            anchors.append(Anchor(entry.link, (x, y, z)))
        fixed, moving = anchors
        if fixed.link >= moving.link:
            same = fixed.link == moving.link
            raise InputError(
                "both anchors are on one link" if same else "the fixed anchor is farther from the base",
                where=where,
                came=f"fixed on link {fixed.link}, moving on link {moving.link}",
                allowed="the fixed anchor on a link nearer to the base",
                cure="A balancer holds two links, with the joints that it relieves between them."
                if same
                else "Exchange fixed and moving.",
            )
        given = {
            name for name in ("free_length", "length", "force", "pressure", "area") if getattr(self, name) is not None
        }
        if given not in ({"free_length"}, {"length", "force"}, {"length", "pressure", "area"}):
            raise InputError(
                "this does not say how hard the balancer pulls, or says it twice",
                where=where,
                came=", ".join(sorted(given)) or "none of them",
                allowed=_HOW,
            )
        at = self.free_length if self.length is None else self.length
        force = self.force or 0.0
        if self.pressure is not None and self.area is not None:
            force = self.pressure * self.area * _BAR_MM2
        if abs(force) > _STRONGEST or self.stiffness > _STRONGEST:
            raise InputError(
                "no balancer is so strong",
                where=where,
                came=f"{force:g} N, growing by {self.stiffness:g} N/mm",
                allowed=f"{_STRONGEST:g} N and {_STRONGEST:g} N/mm at most",
                cure="Force is in N, stiffness in N/mm, pressure in bar and area in mm^2.",
            )
        if not force and not self.stiffness:
            raise InputError("this balancer never pulls", where=where, came="no force and no stiffness")
        return Balancer(
            self.name or f"balancer_{number}",
            fixed,
            moving,
            force,
            sized_si(at or 0.0, length, f"{where}.length"),
            self.stiffness * 1e3,
        )


def check_anchors(robot: Robot, where: str) -> None:
    """Refuse a balancer whose anchors are one point, or one of whose anchors lies on the axis it should relieve.

    Args:
        where: Names the robot file in messages.

    Raises:
        InputError: Naming the balancer.
    """
    for number, balancer in enumerate(robot.balancers, 1):
        here = f"{where}, balancers[{number}]"
        lower, upper = balancer.fixed, balancer.moving
        if upper.link == lower.link + 1 and robot.joints[lower.link].kind == "revolute":
            axis, origin = _axis(robot, upper.link)
            for name, anchor in (("fixed", lower), ("moving", upper)):
                away = float(np.linalg.norm(np.cross(_seen(robot, anchor)[:3] - origin, axis)))
                if away < _NEAREST:
                    raise InputError(
                        "the anchor lies on the axis that the balancer should relieve",
                        where=f"{here}.{name}.point",
                        came=f"{away * 1e3:.3g} mm from the axis of {robot.joints[lower.link].name}",
                        allowed=f"{_NEAREST * 1e3:g} mm or more: a force through the axis has no lever",
                        cure="Take both anchors from the maker's drawing, in the frames of their links.",
                    )
        shortest = _shortest(robot, balancer)
        if shortest < _NEAREST:
            raise InputError(
                "both anchors are one point in some posture",
                where=here,
                came=f"{shortest * 1e3:.3g} mm between them",
                allowed=f"{_NEAREST * 1e3:g} mm or more within the limits of the joints",
                cure="Take both anchors from the maker's drawing, in the frames of their links.",
            )


def _shortest(robot: Robot, balancer: Balancer) -> float:
    """Return the shortest distance [m] of two anchors while each joint between them goes through its range alone."""
    links = robot.link_elements[balancer.fixed.link : balancer.moving.link]
    way = Chain((*(e for link in links for e in link), *_slides(balancer.moving.point)))
    shortest = math.inf
    for joint in range(balancer.fixed.link, balancer.moving.link):
        low, high = robot.joints[joint].range
        for _ in range(2):  # the whole range, then the neighbourhood of the shortest
            variables = np.zeros((len(robot.joints), _STEPS))
            variables[joint] = np.linspace(low, high, _STEPS)
            seen = np.broadcast_to(way.forward_kinematics(variables, robot.values).position, (3, _STEPS))
            distances = np.linalg.norm(seen - np.array(balancer.fixed.point)[:, None], axis=0)
            best, step = variables[joint, int(distances.argmin())], (high - low) / _STEPS
            low, high = max(low, best - step), min(high, best + step)
        shortest = min(shortest, float(distances.min()))
    return shortest


def _slides(point: Sequence[float]) -> tuple[Element, ...]:
    x, y, z = point
    return Element("Tx", x), Element("Ty", y), Element("Tz", z)


def _seen(robot: Robot, anchor: Anchor) -> Array:
    """Return an anchor in the world, joints at zero [m], ``(4,)``."""
    elements = [e for link in robot.link_elements[: anchor.link] for e in link]
    return np.asarray(at_zero(robot, [*robot.base_elements, *elements]) @ [*anchor.point, 1.0])


def _axis(robot: Robot, joint: int) -> tuple[Array, Array]:
    """Return direction and a point of a joint's axis in the world, joints at zero; joints count from 1."""
    kinematics = robot.rigid.forward_kinematics(np.zeros((1, len(robot.joints))))
    place = next(i for i, e in enumerate(kinematics.elements) if e.variable == joint - 1)
    return kinematics.axis(place)[:, 0], kinematics.origin(place)[:, 0]


def balancer_entry(balancer: Balancer) -> dict[str, Any]:
    """Return the entry of a balancer, in mm, N and N/mm."""

    def anchor(of: Anchor) -> dict[str, Any]:
        return {"link": of.link, "point": [written(v, "mm") for v in of.point]}

    made: dict[str, Any] = {"name": balancer.name}
    made |= {"fixed": anchor(balancer.fixed), "moving": anchor(balancer.moving)}
    made["stiffness"] = balancer.stiffness / 1e3
    if not balancer.force:
        return made | {"free_length": written(balancer.length, "mm")}
    return made | {"length": written(balancer.length, "mm"), "force": balancer.force}
