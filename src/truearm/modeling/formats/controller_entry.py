"""The entry `controller` of a robot file: how the robot's controller counts joints, and where it has its frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final

import numpy as np
from pydantic import AfterValidator, BaseModel, Field, PlainValidator

from truearm.errors import InputError, did_you_mean
from truearm.modeling.controller import Controller, ControllerKinematics, KinematicsKind
from truearm.modeling.formats.entries import STRICT, Checksum, Name, Number, Place, place_entry
from truearm.modeling.parts import Joint
from truearm.modeling.transform import IDENTITY
from truearm.shown import counted
from truearm.units import sized_si, to_si, written

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


def _said(said: object) -> str | KinematicsEntry:
    """Return a word, the name of a file or named entries as they are; of a union every fault would name all of them."""
    if isinstance(said, Mapping):
        return KinematicsEntry.model_validate(said)
    if isinstance(said, str) and said.strip():
        return said
    raise InputError("this does not say with what the controller computes", came=said, allowed=ALLOWED)


class ControllerEntry(BaseModel):
    """What differs from the model; all of it may be left out.

    ``kinematics`` is ``nominal``, ``proprietary`` or ``unknown``, the name of a file, or what such a file held.
    """

    model_config = STRICT
    source: str = ""
    kinematics: Annotated[str | KinematicsEntry, PlainValidator(_said)] = "unknown"
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
            here = f"{where}.joints[{place}]"
            number = _number(entry.joint, numbers, here)
            if number in counted:
                raise InputError("a joint appears twice", where=here, came=entry.joint)
            counted[number] = entry
            unit, other = ("degree", "mm") if joints[number - 1].kind == "revolute" else ("mm", "degree")
            if getattr(entry, f"pulses_per_{other}") is not None:
                raise InputError(
                    f"the joint is {joints[number - 1].kind}",
                    where=here,
                    came=f"pulses_per_{other}",
                    allowed=f"pulses_per_{unit}",
                )
            shares = {_number(name, numbers, f"{here}.coupling"): share for name, share in entry.coupling.items()}
            for coupled in shares:
                _check_coupled(joints, number, coupled, f"{here}.coupling")
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
        made = Controller(
            signs=signs if -1 in signs else (),
            zeros=zeros if any(zeros) else (),
            couplings=couplings,
            pulses=known if any(known) else (),
            base=self.base.transform(length, f"{where}.base"),
            flange=self.flange.transform(length, f"{where}.flange"),
            source=self.source,
            kinematics=self._kinematics(joints, length, angle, f"{where}.kinematics"),
        )
        if np.linalg.cond(made.coupling(len(joints))) > _CONDITION:
            raise InputError(
                "the couplings cannot be inverted: other joint positions give the same counts",
                where=f"{where}.joints",
                came="; ".join(f"{e.joint} counts {', '.join(e.coupling)}" for e in self.joints if e.coupling),
            )
        return made

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
    made: dict[str, Any] = {"source": controller.source} if controller.source else {}
    if rows:
        made["joints"] = rows
    if controller.kinematics != STATED["unknown"]:
        made["kinematics"] = _kinematics_entry(controller.kinematics)
    frames = {"base": controller.base, "flange": controller.flange}
    return made | {name: place_entry(place) for name, place in frames.items() if place != IDENTITY}


def _kinematics_entry(kinematics: ControllerKinematics) -> str | dict[str, Any]:
    """Return the entry of what a controller computes with; what is known in a word is one."""
    if kinematics == STATED.get(kinematics.kind):
        return kinematics.kind
    made: dict[str, Any] = {"kind": kinematics.kind}
    made |= {"source": kinematics.source} if kinematics.source else {}
    made |= {"identity": dict(kinematics.identity)} if kinematics.identity else {}
    if kinematics.rows:
        units = {"d": "mm", "a": "mm"}
        made["joints"] = [
            {column: written(value, units.get(column, "deg")) for column, value in row.items()}
            for row in kinematics.rows
        ]
    return made


def controller_summary(kinematics: ControllerKinematics) -> dict[str, Any]:
    """Return in short what a controller computes with, without its numbers."""
    return {"kinematics": kinematics.kind, "source": kinematics.source, "identity": dict(kinematics.identity)}
