"""Entries of a robot file, checked: places, balancers, controller, reach."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PlainValidator, StringConstraints

from truearm.engine.base.errors import InputError, counted, did_you_mean, is_one_line
from truearm.engine.base.units import sized_si, to_si, written
from truearm.engine.robot.balancers import Anchor, Balancer
from truearm.engine.robot.chain import Array, Chain, Element
from truearm.engine.robot.controller import Controller, ControllerKinematics, KinematicsKind
from truearm.engine.robot.lines import at_zero
from truearm.engine.robot.parts import Joint, Reach, ReachPoint
from truearm.engine.robot.transform import IDENTITY, Transform

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot


#: What a robot and a joint may be called.
NAME: Final = r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}"
NAME_IN_WORDS: Final = "up to 100 letters, digits, _ . and -, starting with a letter or digit"

#: Checksums of a controller have fewer characters: those of six joints about 70.
LONGEST_CHECKSUM: Final = 200

#: Of an entry that has known keys only.
STRICT: Final = ConfigDict(extra="forbid", frozen=True)

Number = Annotated[float, Field(allow_inf_nan=False, strict=True)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=True)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False, strict=True)]
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False, strict=True)]
Triple = tuple[Number, Number, Number]


def _name(text: str) -> str:
    if not re.fullmatch(NAME, text):
        raise InputError("this cannot be a name", came=text, allowed=NAME_IN_WORDS)
    return text


Name = Annotated[str, StringConstraints(strict=True), AfterValidator(_name)]


def checksum(text: str) -> str:
    """Return a text that tells the kinematics of controllers apart, as it is printed: one line, and short.

    Raises:
        InputError: If it is another text.
    """
    if not is_one_line(text) or len(text) > LONGEST_CHECKSUM:
        raise InputError(
            "this is no checksum",
            came=text,
            allowed=f"one line of up to {LONGEST_CHECKSUM} characters",
            cure="Copy it, or the file that it stands in, again.",
        )
    return text


Checksum = Annotated[str, StringConstraints(strict=True), AfterValidator(checksum)]


def _unit_length(q: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    if abs(math.hypot(*q) - 1.0) > 1e-6:
        raise InputError(
            f"a quaternion (w, x, y, z) must have length 1, this one has {math.hypot(*q):.6g}",
            came=list(q),
            cure="Divide its numbers by that length, or correct them.",
        )
    return q


Quaternion = Annotated[tuple[Number, Number, Number, Number], AfterValidator(_unit_length)]


class Place(BaseModel):
    """Where a frame stands in another one."""

    model_config = STRICT
    translation: Triple = (0.0, 0.0, 0.0)
    quaternion: Quaternion | None = None

    def transform(self, length: str, where: str) -> Transform:
        """Return the transform; `length` is the file's unit, `where` names the entry in messages."""
        x, y, z = (sized_si(v, length, f"{where}.translation") for v in self.translation)
        return Transform((x, y, z), self.quaternion or IDENTITY.quaternion)


def place_entry(place: Transform) -> dict[str, list[float]]:
    """Return the entry of a place, in mm."""
    return {"translation": [written(v, "mm") for v in place.translation], "quaternion": list(place.quaternion)}


# The entry `balancers` of a robot file: springs and gas cylinders between two links.

#: Anchors nearer to each other, or to the axis that they should relieve, hold nothing [m].
_NEAREST: Final = 1e-3
#: No arm's balancer pulls harder [N].
_STRONGEST: Final = 1e6
#: Steps of a joint through its range.
_STEPS: Final = 361
#: A bar on a square millimetre [N].
_BAR_MM2: Final = 0.1
_DEFINED_BY: Final = "free_length; or length and force; or length, pressure and area"


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
        keys = {
            name for name in ("free_length", "length", "force", "pressure", "area") if getattr(self, name) is not None
        }
        if keys not in ({"free_length"}, {"length", "force"}, {"length", "pressure", "area"}):
            raise InputError(
                "this does not say how hard the balancer pulls, or says it twice",
                where=where,
                came=", ".join(sorted(keys)) or "none of them",
                allowed=_DEFINED_BY,
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
        location = f"{where}, balancers[{number}]"
        lower, upper = balancer.fixed, balancer.moving
        if upper.link == lower.link + 1 and robot.joints[lower.link].kind == "revolute":
            axis, origin = _axis(robot, upper.link)
            for name, anchor in (("fixed", lower), ("moving", upper)):
                away = float(np.linalg.norm(np.cross(_seen(robot, anchor)[:3] - origin, axis)))
                if away < _NEAREST:
                    raise InputError(
                        "the anchor lies on the axis that the balancer should relieve",
                        where=f"{location}.{name}.point",
                        came=f"{away * 1e3:.3g} mm from the axis of {robot.joints[lower.link].name}",
                        allowed=f"{_NEAREST * 1e3:g} mm or more: a force through the axis has no lever",
                        cure="Take both anchors from the maker's drawing, in the frames of their links.",
                    )
        shortest = _shortest(robot, balancer)
        if shortest < _NEAREST:
            raise InputError(
                "both anchors are one point in some posture",
                where=location,
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

    content: dict[str, Any] = {"name": balancer.name}
    content |= {"fixed": anchor(balancer.fixed), "moving": anchor(balancer.moving)}
    content["stiffness"] = balancer.stiffness / 1e3
    if not balancer.force:
        return content | {"free_length": written(balancer.length, "mm")}
    return content | {"length": written(balancer.length, "mm"), "force": balancer.force}


# The entry `controller` of a robot file: how the robot's controller counts joints, and where it has its frames.

#: Couplings of worse condition leave joints that no float tells apart.
_CONDITION = 1e9
#: What may be stated of the controller's kinematics in a word.
STATED: Final[Mapping[str, ControllerKinematics]] = {
    "nominal": ControllerKinematics("nominal"),
    "proprietary": ControllerKinematics("proprietary"),
    "unknown": ControllerKinematics(),
}
#: What may be said of a controller's kinematics.
ALLOWED: Final = f"{', '.join(STATED)}, or a kinematics file: calibration.conf, or that of the ROS driver"


def _direction(sign: int) -> int:
    if sign not in (1, -1):
        raise InputError("a sign is 1 or -1", came=sign, allowed="1, -1")
    return sign


def _countable(pulses: float) -> float:
    if not 1e-6 <= abs(pulses) <= 1e12:
        raise InputError(
            "the number of pulses is out of range",
            came=pulses,
            allowed="0.000001 to 1e12, negative where the motor counts against the joint",
        )
    return pulses


Sign = Annotated[int, Field(strict=True), AfterValidator(_direction)]
Pulses = Annotated[Number, AfterValidator(_countable)]


class CountedJoint(BaseModel):
    """How the controller counts one joint."""

    model_config = STRICT
    joint: Name
    sign: Sign = 1
    zero: Number = 0.0
    coupling: dict[Name, Number] = {}
    pulses_per_degree: Pulses | None = None
    pulses_per_mm: Pulses | None = None


class KinematicsRow(BaseModel):
    """A row of what the controller computes with, in the convention ``hayati``."""

    model_config = STRICT
    theta_offset: Number
    d: Number
    a: Number
    alpha: Number
    beta: Number | None = None


class KinematicsEntry(BaseModel):
    """With what the controller computes poses: what may be said in a word, with a source, or rows of its own."""

    model_config = STRICT
    kind: KinematicsKind
    source: str = ""
    identity: dict[Name, Checksum] = {}
    joints: list[KinematicsRow] = []


def _stated(value: object) -> str | KinematicsEntry:
    """Return a word, the name of a file or named entries as they are; of a union every fault would name all of them."""
    if isinstance(value, Mapping):
        return KinematicsEntry.model_validate(value)
    if isinstance(value, str) and value.strip():
        return value
    raise InputError("this does not say with what the controller computes", came=value, allowed=ALLOWED)


class ControllerEntry(BaseModel):
    """What differs from the model; all of it may be left out.

    ``kinematics`` is ``nominal``, ``proprietary`` or ``unknown``, the name of a file, or what such a file held.
    """

    model_config = STRICT
    source: str = ""
    kinematics: Annotated[str | KinematicsEntry, PlainValidator(_stated)] = "unknown"
    joints: list[CountedJoint] = []
    base: Place = Place()
    flange: Place = Place()

    def controller(self, joints: Sequence[Joint], length: str, angle: str, where: str) -> Controller:
        """Return the controller that the entry describes.

        Args:
            joints: Of the robot.
            length, angle: Units of the file.
            where: Names the entry in messages.

        Raises:
            InputError: If a joint is not one of the robot's or stands there twice, its pulses are those of another kind
                of joint, it is coupled with itself or with a joint of another kind, or the couplings cannot be undone.
        """
        numbers = {joint.name: number for number, joint in enumerate(joints, 1)}
        counted: dict[int, CountedJoint] = {}
        couplings: dict[int, dict[int, float]] = {}
        for place, entry in enumerate(self.joints, 1):
            location = f"{where}.joints[{place}]"
            number = _number(entry.joint, numbers, location)
            if number in counted:
                raise InputError("a joint appears twice", where=location, came=entry.joint)
            counted[number] = entry
            unit, other = ("degree", "mm") if joints[number - 1].kind == "revolute" else ("mm", "degree")
            if getattr(entry, f"pulses_per_{other}") is not None:
                raise InputError(
                    f"the joint is {joints[number - 1].kind}",
                    where=location,
                    came=f"pulses_per_{other}",
                    allowed=f"pulses_per_{unit}",
                )
            shares = {_number(name, numbers, f"{location}.coupling"): share for name, share in entry.coupling.items()}
            for coupled in shares:
                _check_coupled(joints, number, coupled, f"{location}.coupling")
            if any(shares.values()):
                couplings[number] = {coupled: share for coupled, share in shares.items() if share}

        def zero(number: int) -> float:
            unit = angle if joints[number - 1].kind == "revolute" else length
            return sized_si(counted[number].zero, unit, f"{where}, zero of {counted[number].joint}")

        def pulses(number: int) -> float | None:
            for unit, value in (("1/deg", counted[number].pulses_per_degree), ("1/mm", counted[number].pulses_per_mm)):
                if value is not None:
                    return to_si(value, unit)
            return None

        everyone = range(1, len(joints) + 1)
        signs = tuple(counted[n].sign if n in counted else 1 for n in everyone)
        zeros = tuple(zero(n) if n in counted else 0.0 for n in everyone)
        known = tuple(pulses(n) if n in counted else None for n in everyone)
        result = Controller(
            signs=signs if -1 in signs else (),
            zeros=zeros if any(zeros) else (),
            couplings=couplings,
            pulses=known if any(known) else (),
            base=self.base.transform(length, f"{where}.base"),
            flange=self.flange.transform(length, f"{where}.flange"),
            source=self.source,
            kinematics=self._kinematics(joints, length, angle, f"{where}.kinematics"),
        )
        if np.linalg.cond(result.coupling(len(joints))) > _CONDITION:
            raise InputError(
                "the couplings cannot be inverted: other joint positions give the same counts",
                where=f"{where}.joints",
                came="; ".join(f"{e.joint} counts {', '.join(e.coupling)}" for e in self.joints if e.coupling),
            )
        return result

    def _kinematics(self, joints: Sequence[Joint], length: str, angle: str, where: str) -> ControllerKinematics:
        """Return with what the controller computes; the name of a file says nothing yet."""
        entry = self.kinematics
        if isinstance(entry, str):
            return STATED.get(entry, ControllerKinematics())
        if len(entry.joints) != (len(joints) if entry.kind == "own" else 0):
            raise InputError(
                "one row belongs here for each joint"
                if entry.kind == "own"
                else f"{entry.kind} kinematics have no rows",
                where=f"{where}.joints",
                came=counted(len(entry.joints), "row"),
                allowed=str(len(joints)) if entry.kind == "own" else "none",
            )
        units = {"d": length, "a": length}
        rows = tuple(
            {
                column: sized_si(value, units.get(column, angle), f"{where}.joints[{number}].{column}")
                for column, value in row.model_dump(exclude_none=True).items()
            }
            for number, row in enumerate(entry.joints, 1)
        )
        return ControllerKinematics(entry.kind, rows, entry.source, dict(entry.identity))


def _number(name: str, numbers: dict[str, int], where: str) -> int:
    if name in numbers:
        return numbers[name]
    raise InputError(
        "the robot has no joint of this name",
        where=where,
        came=name,
        allowed=", ".join(numbers),
        cure=did_you_mean(name, numbers),
    )


def _check_coupled(joints: Sequence[Joint], number: int, coupled: int, where: str) -> None:
    if coupled == number:
        raise InputError("a joint cannot be coupled with itself", where=where, came=joints[number - 1].name)
    if joints[coupled - 1].kind != joints[number - 1].kind:
        raise InputError(
            "only joints that both turn, or both slide, can be coupled",
            where=where,
            came=f"{joints[number - 1].kind} {joints[number - 1].name}, "
            f"{joints[coupled - 1].kind} {joints[coupled - 1].name}",
        )


def controller_entry(controller: Controller, joints: Sequence[Joint]) -> dict[str, Any]:
    """Return the entry of a controller, in mm and degrees, without what is as the model has it."""
    rows = []
    for number, joint in enumerate(joints, 1):
        row: dict[str, Any] = {"joint": joint.name}
        turns = joint.kind == "revolute"
        if controller.signs and controller.signs[number - 1] != 1:
            row["sign"] = controller.signs[number - 1]
        if controller.zeros and controller.zeros[number - 1]:
            row["zero"] = written(controller.zeros[number - 1], "deg" if turns else "mm")
        if number in controller.couplings:
            row["coupling"] = {joints[n - 1].name: share for n, share in controller.couplings[number].items()}
        pulses = controller.pulses[number - 1] if controller.pulses else None
        if pulses is not None:
            name, unit = ("pulses_per_degree", "1/deg") if turns else ("pulses_per_mm", "1/mm")
            row[name] = written(pulses, unit)
        if len(row) > 1:
            rows.append(row)
    content: dict[str, Any] = {"source": controller.source} if controller.source else {}
    if rows:
        content["joints"] = rows
    if controller.kinematics != STATED["unknown"]:
        content["kinematics"] = _kinematics_entry(controller.kinematics)
    frames = {"base": controller.base, "flange": controller.flange}
    return content | {name: place_entry(place) for name, place in frames.items() if place != IDENTITY}


def _kinematics_entry(kinematics: ControllerKinematics) -> str | dict[str, Any]:
    """Return the entry of what a controller computes with; what is known in a word is one."""
    if kinematics == STATED.get(kinematics.kind):
        return kinematics.kind
    content: dict[str, Any] = {"kind": kinematics.kind}
    content |= {"source": kinematics.source} if kinematics.source else {}
    content |= {"identity": dict(kinematics.identity)} if kinematics.identity else {}
    if kinematics.rows:
        units = {"d": "mm", "a": "mm"}
        content["joints"] = [
            {column: written(value, units.get(column, "deg")) for column, value in row.items()}
            for row in kinematics.rows
        ]
    return content


def controller_summary(kinematics: ControllerKinematics) -> dict[str, Any]:
    """Return in short what a controller computes with, without its numbers."""
    return {"kinematics": kinematics.kind, "source": kinematics.source, "identity": dict(kinematics.identity)}


class ReachEntry(BaseModel):
    """A distance from the line of an axis to a point; neither is there where the maker says none."""

    model_config = STRICT
    distance: Positive
    axis: Annotated[str, StringConstraints(strict=True, pattern="^axis-[1-9][0-9]{0,2}$")] | None = Field(
        None, alias="from"
    )
    to: ReachPoint | None = None

    def reach(self, joints: int, length: str, where: str) -> Reach:
        """Return the reach that the entry describes.

        Args:
            joints: How many the robot has.
            length: Unit of the file.
            where: Names the entry in messages.

        Raises:
            InputError: If the robot has no such axis, or one of axis and point is missing.
        """
        distance = sized_si(self.distance, length, f"{where}.distance")
        if self.axis is None and self.to is None:
            return Reach(distance)
        if self.axis is None or self.to is None:
            raise InputError(
                "a reach is from an axis to a point",
                where=where,
                came="no `from`" if self.axis is None else "no `to`",
                cure="Give both, or neither if the maker names none.",
            )
        number = int(self.axis.removeprefix("axis-"))
        if number > joints:
            raise InputError(
                "the robot has no such axis",
                where=f"{where}.from",
                came=self.axis,
                allowed=", ".join(f"axis-{place}" for place in range(1, joints + 1)),
            )
        return Reach(distance, number, self.to)


def reach_entry(reach: Reach) -> dict[str, Any]:
    """Return the entry of a reach, in mm."""
    content: dict[str, Any] = {"distance": written(reach.distance, "mm")}
    return content if reach.point is None else content | {"from": f"axis-{reach.axis}", "to": reach.point}


def reach_summary(reach: Reach | None) -> dict[str, Any]:
    """Return a reach as JSON holds it beside other things."""
    entry = {} if reach is None else reach_entry(reach)
    return {"reach_mm": entry.get("distance"), "reach_from": entry.get("from"), "reach_to": entry.get("to")}
