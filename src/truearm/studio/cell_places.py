"""Where base, targets and fixtures of a robot stand, in mm and deg, and a robot with another of them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, get_args

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.schemas import validated
from truearm.engine.base.units import sized_si
from truearm.engine.robot.parts import FixtureKind
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import robot_from_file
from truearm.engine.robot.robot_file.schema import RobotFile
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import FIXED_XYZ_ANGLES, Transform

Numbers = tuple[float, float, float]
#: What can stand somewhere: on the flange what is measured, in the instrument's frame what is measured against.
ThingKind = Literal["target", "target with axes", "point", "plane", "frame"]
THINGS: Final[tuple[ThingKind, ...]] = get_args(ThingKind)
_TARGETS: Final = ("target", "target with axes")
#: What a robot file with a cell's places is called.
_CELL: Final = "-cell"


@dataclass(frozen=True)
class Thing:
    """A target or a fixture."""

    name: str  #: As data call it.
    kind: ThingKind  #: What it is.
    #: x, y and z [mm]: of a target on the flange, of a fixture in the instrument's frame.
    place: Numbers = (0.0, 0.0, 0.0)
    #: About the fixed axes x, y and z in turn [deg]; z of a plane is its normal. A point and a target have none.
    turns: Numbers = (0.0, 0.0, 0.0)

    @property
    def turned(self) -> bool:
        """Whether turns say anything of it."""
        return self.kind not in ("target", "point")


def numbers_of(place: Transform) -> tuple[Numbers, Numbers]:
    """Return where a frame is [mm], and its turns about the fixed axes x, y and z [deg]."""
    angles = FIXED_XYZ_ANGLES.numbers(place.rotation[None], np.zeros((1, 3)))[0]
    # Rounded to what nobody measures, so that no -0 and no 89.99999999 is shown.
    x, y, z = (round(value * 1e3, 6) + 0.0 for value in place.translation)
    a, b, c = (np.round(np.rad2deg(angles), 6) + 0.0).tolist()
    return (x, y, z), (a, b, c)


def place_of(place: Numbers, turns: Numbers, where: str) -> Transform:
    """Return the frame that such numbers say.

    Raises:
        InputError: If one is none, or out of all bounds.
    """
    metres = np.array([sized_si(value, "mm", where) for value in place])
    angles = np.array([[sized_si(value, "deg", where) for value in turns]])
    return Transform.from_matrix(FIXED_XYZ_ANGLES.matrices(angles)[0], metres)


def things_of(robot: Robot) -> list[Thing]:
    """Return the targets and fixtures of a robot."""
    found = []
    for target in robot.targets:
        place, turns = numbers_of(robot.tool_place(target.name))
        if target.quaternion is None:
            found.append(Thing(target.name, "target", place))
        else:
            found.append(Thing(target.name, "target with axes", place, turns))
    for name, (kind, frame) in _fixtures(robot).items():
        place, turns = numbers_of(frame)
        found.append(Thing(name, kind, place, (0.0, 0.0, 0.0) if kind == "point" else turns))
    return found


def with_base(robot: Robot, place: Numbers, turns: Numbers) -> Robot:
    """Return a robot whose base stands elsewhere in the instrument's frame [mm, deg]."""
    return robot.with_frames(place_of(place, turns, "base"), _targets(robot))


def with_thing(robot: Robot, thing: Thing | None, before: str | None = None) -> Robot:
    """Return a robot with another target or fixture.

    Args:
        thing: The new one; None where one is taken away.
        before: What is changed or taken away, by its name; None for nothing.

    Raises:
        InputError: If its name is taken, or a number is none.
    """
    targets, fixtures = _targets(robot), _fixtures(robot)
    for known in (targets, fixtures):
        if before in known and (thing is None or (thing.kind in _TARGETS) != (known is targets)):
            del known[before]  # type: ignore[arg-type]
    if thing is not None:
        if thing.name != before and (thing.name in targets or thing.name in fixtures):
            raise InputError("there is a target or fixture of this name already", parameter="name", came=thing.name)
        frame = place_of(thing.place, thing.turns if thing.turned else (0.0, 0.0, 0.0), thing.name)
        if thing.kind in _TARGETS:
            _put(targets, before, thing.name, frame if thing.turned else frame.translation)
        else:
            _put(fixtures, before, thing.name, (thing.kind, frame))
    return robot.with_frames(robot.base, targets).with_fixtures(fixtures)


def placed_text(robot: Robot, where: str) -> str:
    """Return the robot file of a robot, after reading it again.

    Raises:
        InputError: If a name could not stand in it, or the robot was calibrated: where that stands was measured.
    """
    from ruamel.yaml import YAML

    if robot.proof is not None:
        raise InputError(
            "this robot was calibrated, and stands where it was measured", where=where, cure="Choose the nominal robot."
        )
    text = robot_text(robot)
    robot_from_file(validated(YAML(typ="safe", pure=True).load(text), RobotFile, where), where)
    return text


def file_for_places(robot: str, name: str, taken: list[str]) -> str:
    """Return the name of the robot file with a cell's places: the robot's own if it is one, else a new one.

    Args:
        robot, name: Library id or file, and the robot's name.
        taken: Files that are there.
    """
    stem = Path(robot.partition("#")[0]).stem
    if robot in taken and (stem.endswith(_CELL) or stem.rpartition("-")[0].endswith(_CELL)):
        return robot
    stem = stem if robot in taken else name
    names = [f"{stem}{_CELL}.yaml", *(f"{stem}{_CELL}-{k}.yaml" for k in range(2, len(taken) + 3))]
    return next(one for one in names if one not in taken)


def free_name(kind: str, taken: Collection[str]) -> str:
    """Return a name for a new target or fixture, whose parameters have other names than those of the ones there are.

    The parameters of a target ``1`` are called as those of a target ``target_1`` are; with fixtures likewise.
    """
    used = {f"{prefix}{name}" for name in taken for prefix in ("", "target_", "fixture_")}
    names = (f"{kind}_{k}" for k in range(1, len(used) + 2))
    return next(name for name in names if not {name, f"fixture_{name}"} & used)


def _targets(robot: Robot) -> dict[str, Any]:
    places = {target.name: robot.tool_place(target.name) for target in robot.targets}
    return {t.name: places[t.name] if t.quaternion is not None else places[t.name].translation for t in robot.targets}


def _fixtures(robot: Robot) -> dict[str, tuple[FixtureKind, Transform]]:
    found = {}
    for fixture in robot.fixtures:
        kinematics = robot.fixture_kinematics(fixture.name)
        place = Transform.from_matrix(kinematics.matrix()[0], kinematics.position[:, 0])
        found[fixture.name] = (fixture.kind, place)
    return found


def _put(known: dict[str, Any], before: str | None, name: str, value: Any) -> None:
    """Put an entry into a mapping, where one of another name was if there is such."""
    entries = [(name, value) if key == before else (key, old) for key, old in known.items()]
    known.clear()
    known.update(entries)
    known[name] = value
