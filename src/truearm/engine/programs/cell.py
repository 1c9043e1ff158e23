"""The tools and frames of a program, as its controller has them and where they really are.

A program's poses are those of a tool in a frame: a work object, a base, a user frame. Its controller knows both by
numbers that refer to the nominal flange and the nominal base. Where they really are, on the flange and in the base that
calibration has identified, somebody has to measure; a file says it::

    truearm: truearm-cell/1
    units: {length: mm, angle: deg}
    tools:
      tGripper: {of: flange, translation: [0.1, -0.2, 150.3], quaternion: [1, 0, 0, 0]}
    frames:
      wobjTable: {of: world, translation: [812.4, 3.1, 250.0], quaternion: [1, 0, 0, 0]}
      "2":
        of: world
        translation: [1312.0, 4.0, 251.2]
        wpr: [0, 0, 90.1]
        controller: {translation: [500, 0, 0], wpr: [0, 0, 90]}
      "3": {of: controller, translation: [500, 0, 0], wpr: [0, 0, 90]}

What acts on the tool at targets, by name or pattern, or with tools::

    units: {length: mm, angle: deg, force: N, moment: N m}
    wrenches:
      - {targets: ["pHole*"], force: [0, 0, 80], moment: [0, 0, 1.5], frame: tool}
      - {tools: [tSpindle], force: [12, 0, 0]}

What only the user knows can be kept there too, as :func:`truearm.compensate` takes it::

    taught: [none]
    controller_kinematics: nominal

``world`` is the instrument's frame, in which the robot was calibrated; ``base`` and ``flange`` are the identified base
and flange; ``controller`` says what the controller has where the program does not define it. No measured place says
that: the controller's numbers are in its own base and flange. The robot's own base and flange are called ``base`` and
``flange``, or as the language of the programs calls them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, model_validator

from truearm.engine.base.errors import InputError, refusals_at, refusals_of
from truearm.engine.base.files import read_yaml
from truearm.engine.base.units import sized_si
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.entries import STATED, STRICT, Number, Triple
from truearm.engine.robot.transform import (
    FIXED_XYZ_ANGLES,
    MOVING_XYZ_ANGLES,
    QUATERNION,
    ROTATION_VECTOR,
    ZYX_ANGLES,
    Orientation,
    Transform,
)
from truearm.engine.robot.wrench import FORCE_UNITS, MOMENT_UNITS, Wrench

SCHEMA: Final = "truearm-cell/1"

#: The ways to give an orientation, by the entry's name.
_ORIENTATIONS: Final[dict[str, Orientation]] = {
    "quaternion": QUATERNION,
    "abc": ZYX_ANGLES,
    "wpr": FIXED_XYZ_ANGLES,
    "rxryrz": MOVING_XYZ_ANGLES,
    "rotation_vector": ROTATION_VECTOR,
}


def _unit_length(q: tuple[float, ...]) -> tuple[float, ...]:
    length = math.hypot(*q)
    if abs(length - 1.0) > 1e-3:
        raise InputError(
            f"a quaternion (w, x, y, z) must have length 1, this one has {length:.6g}",
            came=list(q),
            cure="Divide its numbers by that length, or correct them.",
        )
    return q


#: No tool has a number of so many digits.
_NO_NUMBER: Final = 10**18


def _number_as_name(name: object) -> object:
    """Return the name of a tool that has a number, which YAML reads as one without quotes."""
    return str(name) if type(name) is int and abs(name) < _NO_NUMBER else name


Name = Annotated[str, BeforeValidator(_number_as_name)]


class _Entry(BaseModel):
    model_config = STRICT


class _Units(_Entry):
    length: Literal["mm", "m", "in"]
    angle: Literal["deg", "rad"]
    force: Literal["N", "kN", "lbf"] | None = None
    moment: Literal["N m", "N mm"] | None = None


class _Place(_Entry):
    translation: Triple = (0.0, 0.0, 0.0)
    quaternion: Annotated[tuple[Number, Number, Number, Number], AfterValidator(_unit_length)] | None = None
    abc: Triple | None = None
    wpr: Triple | None = None
    rxryrz: Triple | None = None
    rotation_vector: Triple | None = None

    @model_validator(mode="after")
    def _one_orientation(self) -> _Place:
        forms = [name for name in _ORIENTATIONS if getattr(self, name) is not None]
        if len(forms) > 1:
            raise InputError("one orientation belongs here", came=" and ".join(forms), allowed=", ".join(_ORIENTATIONS))
        return self


class _Tool(_Place):
    of: Literal["flange", "controller"]
    target: str | None = None
    controller: _Place | None = None


class _Frame(_Place):
    of: Literal["world", "base", "controller"]
    controller: _Place | None = None


class _Wrench(_Entry):
    targets: list[Name] = []
    tools: list[Name] = []
    force: Triple = (0.0, 0.0, 0.0)
    moment: Triple = (0.0, 0.0, 0.0)
    frame: str = "base"


class CellFile(_Entry):
    """Schema ``truearm-cell/1``."""

    truearm: Literal["truearm-cell/1"]
    units: _Units
    tools: dict[Name, _Tool] = {}
    frames: dict[Name, _Frame] = {}
    wrenches: list[_Wrench] = []
    taught: list[str] | None = None
    controller_kinematics: str | None = None


@dataclass(frozen=True)
class Placed:
    """A tool or a frame."""

    #: What its controller has, in its flange or base frame; None if only the program can say.
    controller: Transform | None
    identified: Transform | None  #: Where it really is, in the identified flange or base; None if it is not known.


@dataclass(frozen=True)
class Cell:
    """Tools and frames by name, in small letters; the flange and the base themselves are ``""``."""

    tools: dict[str, Placed]
    frames: dict[str, Placed]


@dataclass(frozen=True)
class TargetWrench:
    """What acts on the tool at some targets of programs."""

    #: targets, tools: names or patterns of targets, and names of tools at whose targets it acts; those of both if there
    #: are both, all targets if there are none.
    targets: tuple[str, ...]
    tools: tuple[str, ...]
    wrench: Wrench  #: What acts, at the tool's point.
    where: str = ""  #: Where that was said, for messages.


#: No tool and no frame was given.
EMPTY_CELL: Final = Cell({}, {})


def read_tools(robot: Robot, path: Path | None, flange: Sequence[str] = ()) -> dict[str, Placed]:
    """Read where a program's tools are.

    Args:
        robot: Calibrated; ``target`` refers to its targets.
        path: File of the schema above, of which the tools are taken; None for none.
        flange: What the language of the programs calls the robot's own flange, in small letters.

    Raises:
        InputError: If the file is not of the schema, or has no tools.
    """
    return {} if path is None else _tools(robot, path, _file(path, "tools"), ("flange", *flange))


def read_frames(robot: Robot, path: Path | None, base: Sequence[str] = ()) -> dict[str, Placed]:
    """Read where a program's frames are.

    Args:
        robot: Calibrated; ``world`` refers to its base.
        path: File of the schema above, of which the frames are taken; None for none.
        base: What the language of the programs calls the robot's own base, in small letters.

    Raises:
        InputError: If the file is not of the schema, or has no frames.
    """
    return {} if path is None else _frames(robot, path, _file(path, "frames"), ("base", *base))


def read_wrenches(path: Path) -> tuple[TargetWrench, ...]:
    """Read what acts on the tool at targets.

    Args:
        path: File of the schema above, of which the wrenches are taken.

    Raises:
        InputError: If the file is not of the schema, or has no wrenches; one has no unit, acts nowhere, or is in no
            known frame.
    """
    content, wrenches = _file(path, "wrenches"), []
    units = content.units
    for number, entry in enumerate(content.wrenches, 1):
        where = f"{path}, wrenches[{number}]"
        if not entry.targets and not entry.tools:
            raise InputError("targets or tools belong here", where=where, cure="Name those at which the force acts.")
        parts = {}
        for name, unit, known in (("force", units.force, FORCE_UNITS), ("moment", units.moment, MOMENT_UNITS)):
            components = getattr(entry, name)
            if any(components) and unit is None:
                raise InputError(
                    f"no unit of a {name} is given",
                    where=f"{path}, units.{name}",
                    allowed="N, kN, lbf" if name == "force" else "N m, N mm",
                    cure=f"Write units: {{.., {name}: {next(iter(known))}}}.",
                )
            x, y, z = (value * (1.0 if unit is None else known[unit]) for value in components)
            parts[name] = (x, y, z)
        with refusals_at(where):
            wrench = Wrench(parts["force"], parts["moment"], entry.frame)  # type: ignore[arg-type]
        wrenches.append(TargetWrench(tuple(entry.targets), tuple(entry.tools), wrench, where))
    return tuple(wrenches)


def refuse_wrenches_left_out(path: Path | None, parameter: str) -> None:
    """Refuse a file of tools or frames that has wrenches, which nobody would take."""
    if path is None or not read_yaml(path, CellFile).wrenches:
        return
    raise InputError(
        "the file has wrenches, and nothing takes them",
        parameter=parameter,
        where=str(path),
        cure="Give the file as `wrench`, too, or take the entry out.",
    )


@dataclass(frozen=True)
class Answers:
    """What cell files answer of the programs and their controller; None where they do not."""

    taught: tuple[str, ...] | None = None  #: What was taught with the robot.
    #: With what the controller computes poses: a word, or the path of its kinematics file.
    controller_kinematics: str | None = None


def read_answers(files: Mapping[str, Path | None]) -> Answers:
    """Read what cell files answer; a kinematics file is named from the folder of the file that names it.

    Args:
        files: By the parameters that name them.

    Raises:
        InputError: If one is not of the schema, or two answer differently.
    """
    taught: dict[tuple[str, ...], Path] = {}
    kinematics: dict[str, Path] = {}
    for parameter, path in files.items():
        if path is None:
            continue
        with refusals_of(parameter):
            content = read_yaml(path, CellFile)
        if content.taught is not None:
            taught[tuple(content.taught)] = path
        if (stated := content.controller_kinematics) is not None:
            kinematics[stated if stated in STATED else str(path.parent / stated)] = path
    for name, path_by_answer in (("taught", taught), ("controller_kinematics", kinematics)):
        if len(path_by_answer) > 1:
            raise InputError(
                "two files answer this differently",
                where=f"{list(path_by_answer.values())[1]}, {name}",
                came=list(path_by_answer)[1],
                allowed=f"{next(iter(path_by_answer))}, as {next(iter(path_by_answer.values()))} says",
                cure="Take one of the entries out.",
            )
    return Answers(next(iter(taught), None), next(iter(kinematics), None))


def _file(path: Path, part: str) -> CellFile:
    content = read_yaml(path, CellFile)
    answers = content.taught is not None or content.controller_kinematics is not None
    if not getattr(content, part) and not (answers and part != "wrenches"):
        raise InputError(f"the file has no {part}", where=str(path), cure=f"Name them under {part}:.")
    return content


def _tools(robot: Robot, path: Path, content: CellFile, flange: Sequence[str]) -> dict[str, Placed]:
    tools: dict[str, Placed] = {}
    keys = _keys(content.tools, flange, f"{path}, tools")
    for name, entry in content.tools.items():
        where = f"{path}, tools.{name}"
        if entry.target is not None and entry.of == "controller":
            raise InputError("a target is on the identified flange", where=where, came="of: controller")
        place, _ = _tool_place(robot, entry, content.units, where)
        tools[keys[name]] = _placed(entry.of, place, entry.controller, content.units, where)
        _refuse_moved(keys[name], tools[keys[name]], "flange", where)
    return tools


def _frames(robot: Robot, path: Path, content: CellFile, base: Sequence[str]) -> dict[str, Placed]:
    frames: dict[str, Placed] = {}
    keys = _keys(content.frames, base, f"{path}, frames")
    for name, entry in content.frames.items():
        where = f"{path}, frames.{name}"
        place = _transform(entry, content.units, where)
        if entry.of == "world":
            in_base = np.linalg.inv(robot.base.matrix) @ place.matrix
            place = Transform.from_matrix(in_base[:3, :3], in_base[:3, 3])
        frames[keys[name]] = _placed(entry.of, place, entry.controller, content.units, where)
        _refuse_moved(keys[name], frames[keys[name]], "base", where)
    return frames


def _keys(names: Iterable[str], own: Sequence[str], where: str) -> dict[str, str]:
    """Return the key of each name: the name in small letters, and nothing for the names of the flange or the base."""
    keys: dict[str, str] = {}
    called: dict[str, str] = {}
    for name in names:
        key = "" if name.lower() in own else name.lower()
        before = called.setdefault(key, name)
        if before != name:
            alike = before.lower() == name.lower()
            raise InputError(
                "this name is given twice" if alike else f"the robot's own {own[0]} is given twice",
                where=f"{where}.{name}",
                came=f"{before} and {name}",
                cure="Large and small letters are the same here." if alike else "Both names mean it: keep one entry.",
            )
        keys[name] = key
    return keys


def _refuse_moved(key: str, placed: Placed, own: str, where: str) -> None:
    """Refuse numbers that the controller had for its own flange or base."""
    if key == "" and placed.controller is not None:
        raise InputError(f"the controller has its own {own} at zero, and nowhere else", where=where)


def _placed(of: str, place: Transform, controller: _Place | None, units: _Units, where: str) -> Placed:
    if of == "controller":
        if controller is not None:
            raise InputError("the entry itself says what the controller has", where=f"{where}.controller")
        return Placed(place, None)
    return Placed(None if controller is None else _transform(controller, units, f"{where}.controller"), place)


def _tool_place(robot: Robot, entry: _Tool, units: _Units, where: str) -> tuple[Transform, bool]:
    """Return where a tool is, and whether it is known how it is turned: by a target, or by the entry's numbers."""
    place, turned = _transform(entry, units, where), bool(entry.model_fields_set & {*_ORIENTATIONS})
    if entry.target is None:
        return place, turned
    with refusals_at(f"{where}.target"):
        target = robot.target(entry.target)
    of_target = target.quaternion is not None
    if "translation" in entry.model_fields_set or (turned and of_target):
        raise InputError("the target says where the tool is", where=where, cure="Leave its numbers out.")
    kinematics = target.chain.forward_kinematics(np.zeros((0, 1)), robot.values)
    x, y, z = kinematics.position[:, 0].tolist()
    if not of_target:
        return Transform((x, y, z), place.quaternion), turned
    return Transform.from_matrix(kinematics.matrix()[0], kinematics.position[:, 0]), True


def _transform(place: _Place, units: _Units, where: str) -> Transform:
    x, y, z = (sized_si(v, units.length, f"{where}.translation") for v in place.translation)
    for name, orientation in _ORIENTATIONS.items():
        parts = getattr(place, name)
        if parts is not None:
            numbers = parts if name == "quaternion" else [sized_si(v, units.angle, f"{where}.{name}") for v in parts]
            return Transform.from_matrix(orientation.matrices(np.array([numbers]))[0], np.array([x, y, z]))
    return Transform((x, y, z))


@dataclass(frozen=True)
class KnownPlace:
    """Where something was found to be by whoever wrote the file."""

    of: str  #: What the place is in: ``flange``, ``world`` or ``base``.
    place: Transform  #: The place.
    turned: bool  #: Whether the entry says how it is turned; otherwise the rotation of `place` is none.
    where: str  #: The entry, for messages.


def read_known_places(robot: Robot, path: Path) -> tuple[dict[str, KnownPlace], dict[str, KnownPlace]]:
    """Read where tools and frames really are, by their names as the file has them.

    Args:
        robot: ``target`` refers to its targets.
        path: File of the schema above.

    Raises:
        InputError: If the file is not of the schema. What the controller has is no place: such entries are refused.
    """
    content = read_yaml(path, CellFile)
    tools: dict[str, KnownPlace] = {}
    frames: dict[str, KnownPlace] = {}
    for part, entries, places in (("tools", content.tools, tools), ("frames", content.frames, frames)):
        for name, entry in entries.items():
            where = f"{path}, {part}.{name}"
            if entry.of == "controller":
                raise InputError(
                    "where the controller has it does not say where it is",
                    where=where,
                    came="of: controller",
                    allowed="of: flange" if part == "tools" else "of: world, of: base",
                    cure="Leave the entry out, or say where it was measured.",
                )
            if isinstance(entry, _Tool):
                place, turned = _tool_place(robot, entry, content.units, where)
            else:
                place = _transform(entry, content.units, where)
                turned = bool(entry.model_fields_set & {*_ORIENTATIONS})
            places[name] = KnownPlace(entry.of, place, turned, where)
    return tools, frames
