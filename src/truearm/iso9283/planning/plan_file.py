"""Plan files of tests by ISO 9283: ``plan.yaml``, in mm, degrees and percent of the rated values.

::

    truearm: truearm-iso9283/1
    units: {length: mm, angle: deg, time: s, mass: kg}
    robot: robot.yaml
    target: spindle
    rated: {load: 10, velocity: 1000}
    cube: {centre: [900, 0, 700], side: 500, plane: C1-C2-C7-C8}
    limit_band: 0.1
    drift: 8
    poses:
      - {name: P1, position: [900, 0, 700], quaternion: [0, 1, 0, 0], joints: [0, 20, 10, 0, 60, 0]}
    starts: []
    paths: []
    tests:
      - {criterion: AP, places: [P1], cycles: 30, velocities: [100, 50, 10], loads: [100], approaches: []}

The robot file lies beside it. Poses are those of the target, or of the flange, in the robot's base frame; joint
positions are the model's, in degrees, those of sliding joints in mm. Velocities and loads are percent of the rated.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import BaseModel, Field

from truearm.engine.base.errors import InputError, Words, refusals_at
from truearm.engine.base.files import read_yaml
from truearm.engine.base.units import sized_si, written
from truearm.engine.motion.cube import PLANES, Cube
from truearm.engine.motion.joint_motion import Tip
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.entries import STRICT, Name, NotNegative, Number, Positive, Quaternion, Triple
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion
from truearm.iso9283.planning.criteria import TESTS, PerformancePlan, PlannedPath, PlannedPose, PlannedTest

SCHEMA: Final = "truearm-iso9283/1"
PLAN: Final = "plan.yaml"
ROBOT: Final = "robot.yaml"
#: How near the joint positions of a pose bring the tip to it [m], and [rad].
_NEAR: Final = (0.1e-3, 1e-3)
#: Sides of cubes in which robots are tested [m]: another one is in another unit.
_SIDES: Final = (0.01, 20.0)
#: What lies outside the cube by less is on its face [m].
_ON_FACE: Final = 1e-6

Percent = Annotated[float, Field(gt=0, le=100, allow_inf_nan=False, strict=True)]
Share = Annotated[float, Field(ge=0, le=100, allow_inf_nan=False, strict=True)]
Names = tuple[Name, ...]
#: Of a direction of a force: ``+x``.
Approach = Annotated[str, Field(pattern=r"^[+-]?[A-Za-z0-9_.-]{1,40}$", strict=True)]


class _Units(BaseModel):
    model_config = STRICT
    length: Literal["mm"]
    angle: Literal["deg"]
    time: Literal["s"]
    mass: Literal["kg"]


class _LengthUnit(BaseModel):
    model_config = STRICT
    length: Literal["mm", "m", "um", "in"]


class _Rated(BaseModel):
    model_config = STRICT
    load: NotNegative
    velocity: Positive


class _Cube(BaseModel):
    model_config = STRICT
    centre: Triple
    side: Positive
    plane: str


class _Pose(BaseModel):
    model_config = STRICT
    name: Name
    position: Triple
    quaternion: Quaternion
    joints: tuple[Number, ...]


class _Start(BaseModel):
    model_config = STRICT
    pose: Name
    approach: Approach
    position: Triple
    quaternion: Quaternion
    joints: tuple[Number, ...]


class _Path(BaseModel):
    model_config = STRICT
    name: Name
    kind: Literal["polyline", "circle", "weave"]
    points: Annotated[tuple[Triple, ...], Field(min_length=2)]
    normal: Triple
    quaternion: Quaternion
    other: Quaternion | None = None
    stroke: NotNegative = 0.0
    wavelength: NotNegative = 0.0


class _Test(BaseModel):
    model_config = STRICT
    criterion: str
    places: Annotated[Names, Field(min_length=1)]
    cycles: Annotated[int, Field(ge=1, le=1000, strict=True)]
    velocities: Annotated[tuple[Percent, ...], Field(min_length=1)] = (100.0,)
    loads: Annotated[tuple[Share, ...], Field(min_length=1)] = (100.0,)
    approaches: tuple[Approach, ...] = ()


class CubeFile(BaseModel):
    """Schema ``truearm-cube/1``."""

    model_config = STRICT
    truearm: Literal["truearm-cube/1"]
    units: _LengthUnit
    centre: Triple
    side: Positive


class PlanFile(BaseModel):
    """Schema ``truearm-iso9283/1``."""

    model_config = STRICT
    truearm: Literal["truearm-iso9283/1"]
    units: _Units
    robot: str
    target: Name | None = None
    rated: _Rated
    cube: _Cube
    limit_band: Positive
    drift: Positive
    poses: Annotated[tuple[_Pose, ...], Field(min_length=1)]
    starts: tuple[_Start, ...] = ()
    paths: tuple[_Path, ...] = ()
    tests: Annotated[tuple[_Test, ...], Field(min_length=1)]


def plan_text(plan: PerformancePlan) -> str:
    """Return the text of a plan file; the robot's own file, :data:`ROBOT`, goes beside it."""
    cube = plan.cube
    lines = [
        f"truearm: {SCHEMA}",
        "units: {length: mm, angle: deg, time: s, mass: kg}",
        f"robot: {ROBOT}",
        *([] if plan.target is None else [f"target: {plan.target}"]),
        f"rated: {{load: {plan.rated_load!r}, velocity: {written(plan.rated_velocity, 'mm')!r}}}",
        f"cube: {{centre: {_lengths(cube.centre)}, side: {written(cube.side, 'mm')!r}, plane: {plan.plane}}}",
        f"limit_band: {written(plan.limit_band, 'mm')!r}",
        f"drift: {plan.hours * 3600.0!r}",
        "poses:",
        *(f"  - {{name: {pose.name}, {_pose(pose, plan.robot)}}}" for pose in plan.poses.values()),
        *([] if plan.starts else ["starts: []"]),
        *(["starts:"] if plan.starts else []),
        *(
            f"  - {{pose: {name}, approach: {approach}, {_pose(pose, plan.robot)}}}"
            for (name, approach), pose in plan.starts.items()
        ),
        "paths:" if plan.paths else "paths: []",
        *(f"  - {{{_path(path)}}}" for path in plan.paths.values()),
        "tests:",
        *(f"  - {{{_test(test)}}}" for test in plan.tests),
    ]
    return "\n".join(lines) + "\n"


def read_plan(path: Path) -> PerformancePlan:
    """Read a plan, and the robot file beside it.

    Raises:
        InputError: With the entry, if a name occurs twice or is not known, joint positions do not bring the tip to
            their pose, or a pose lies outside the cube.
    """
    content = read_yaml(path, PlanFile)
    beside = path.parent / content.robot
    if Path(content.robot).name != content.robot:
        raise InputError(
            "the robot's file lies beside the plan", where=f"{path}, robot", came=content.robot, allowed="a file's name"
        )
    robot = read_robot(beside)
    if content.target is not None and content.target not in {target.name for target in robot.targets}:
        raise InputError(
            "the robot has no such target",
            where=f"{path}, target",
            came=content.target,
            allowed=", ".join(target.name for target in robot.targets) or "none",
        )
    if content.cube.plane not in PLANES:
        raise InputError(
            "the cube has no such diagonal plane",
            where=f"{path}, cube.plane",
            came=content.cube.plane,
            allowed=", ".join(PLANES),
        )
    cube = Cube(_metres(content.cube.centre), sized_si(content.cube.side, "mm", f"{path}, cube.side"))
    poses: dict[str, PlannedPose] = {}
    tip = Tip(robot, content.target)
    for number, entry in enumerate(content.poses, 1):
        location = f"{path}, poses[{number}]"
        if entry.name in poses:
            raise InputError("two poses have this name", where=location, came=entry.name, cure="Name each once.")
        with refusals_at(location):
            poses[entry.name] = _planned(entry.name, entry, tip, cube)
    starts: dict[tuple[str, str], PlannedPose] = {}
    for number, start in enumerate(content.starts, 1):
        location = f"{path}, starts[{number}]"
        _known(start.pose, poses, location, "pose")
        if (start.pose, start.approach) in starts:
            raise InputError("two approaches of a pose have this name", where=location, came=start.approach)
        with refusals_at(location):
            starts[start.pose, start.approach] = _planned(f"{start.pose} from {start.approach}", start, tip, cube)
    paths: dict[str, PlannedPath] = {}
    for number, way in enumerate(content.paths, 1):
        location = f"{path}, paths[{number}]"
        if way.name in paths:
            raise InputError("two paths have this name", where=location, came=way.name, cure="Name each once.")
        with refusals_at(location):
            paths[way.name] = _planned_path(way)
    tests: list[PlannedTest] = []
    for number, test in enumerate(content.tests, 1):
        location = f"{path}, tests[{number}]"
        _known(test.criterion, TESTS, location, "test")
        if any(planned.id == test.criterion for planned in tests):
            raise InputError("this test is planned twice", where=location, came=test.criterion, cure="Leave one out.")
        for place in test.places:
            _known(place, paths if TESTS[test.criterion].readings == "paths" else poses, location, "place")
        _check_approaches(test, poses, starts, location)
        velocities, loads = (tuple(v / 100.0 for v in shares) for shares in (test.velocities, test.loads))
        tests.append(PlannedTest(test.criterion, test.places, test.cycles, velocities, loads, test.approaches))
    return PerformancePlan(
        robot,
        content.target,
        cube,
        content.cube.plane,
        poses,
        paths,
        starts,
        tuple(tests),
        content.rated.load,
        sized_si(content.rated.velocity, "mm", f"{path}, rated.velocity"),
        sized_si(content.limit_band, "mm", f"{path}, limit_band"),
        content.drift / 3600.0,
    )


def read_cube(path: Path) -> Cube:
    """Read a cube with edges along the axes of the robot's base frame.

    ::

        truearm: truearm-cube/1
        units: {length: mm}
        centre: [350, 0, 350]
        side: 300
    """
    content = read_yaml(path, CubeFile)
    length = content.units.length
    centre = [sized_si(value, length, f"{path}, centre") for value in content.centre]
    with refusals_at(f"{path}, side"):
        side = sized_si(content.side, length, f"{path}, side")
        least, most = _SIDES
        if not least <= side <= most:
            fitting = [unit for unit in ("mm", "m") if least <= sized_si(content.side, unit) <= most]
            raise InputError(
                "no robot is tested in a cube of this side",
                came=Words(f"{content.side:g} {length}"),
                allowed=f"{least * 1e3:g} mm to {most:g} m",
                cure=f"Are these numbers in {fitting[0]}? Then state `units: {{length: {fitting[0]}}}`."
                if fitting
                else "Check the number and its unit.",
            )
        return Cube(centre, side)


def _check_approaches(
    test: _Test, poses: Mapping[str, PlannedPose], starts: Mapping[tuple[str, str], PlannedPose], place: str
) -> None:
    if test.criterion == "vAP":
        missing = [f"{p} from {a}" for p in test.places for a in test.approaches if (p, a) not in starts]
        if missing or len(test.approaches) < 2:
            raise InputError(
                "poses are gone to from two directions or more, each with its start",
                where=place,
                came=f"no start: {missing[0]}" if missing else f"{len(test.approaches)} approaches",
                cure="Add it to starts.",
            )
    elif test.criterion == "compliance":
        for approach in test.approaches:
            _known(approach, ("+x", "-x", "+y", "-y", "+z", "-z"), place, "direction")
    elif test.criterion == "posing-time":
        for approach in test.approaches:
            _known(approach, poses, place, "pose")
    elif test.approaches:
        raise InputError("this test has no approaches", where=place, came=", ".join(test.approaches))


def _known(name: str, known: Mapping[str, object] | Sequence[str], place: str, kind: str) -> None:
    if name not in known:
        raise InputError(f"the plan has no such {kind}", where=place, came=name, allowed=", ".join(known))


def _planned(name: str, entry: _Pose | _Start, tip: Tip, cube: Cube) -> PlannedPose:
    robot = tip.robot
    if len(entry.joints) != len(robot.joints):
        raise InputError(
            "a pose has one position for each joint", came=len(entry.joints), allowed=f"{len(robot.joints)} numbers"
        )
    position = _metres(entry.position)
    rotation = np.asarray(rotation_from_quaternion(np.array([entry.quaternion]))[0])
    beyond = float((np.abs(position - cube.centre) - cube.side / 2).max())
    if beyond > _ON_FACE:
        raise InputError(
            "the pose lies outside the cube",
            came=f"{name}, {beyond * 1e3:.3f} mm outside",
            cure="Move it, or state the cube that it lies in.",
        )
    units = ["mm" if joint.kind == "prismatic" else "deg" for joint in robot.joints]
    joints = np.array([sized_si(v, unit, "joints") for v, unit in zip(entry.joints, units, strict=True)])
    tip_pose = tip.at(joints[None])
    away = float(np.linalg.norm(tip_pose.position[0] - position))
    turned = float(np.linalg.norm(tip_pose.rotation[0] - rotation)) / np.sqrt(2.0)
    if away > _NEAR[0] or turned > _NEAR[1]:
        raise InputError(
            "these joint positions do not bring the tip to the pose",
            came=f"{name}: {away * 1e3:.3f} mm and {np.degrees(turned):.3f} deg away",
            cure="Plan again, or correct the pose.",
        )
    return PlannedPose(name, position, rotation, joints)


def _planned_path(entry: _Path) -> PlannedPath:
    points = np.array([_metres(point) for point in entry.points])
    count = {"polyline": None, "circle": 2, "weave": 2}[entry.kind]
    if count is not None and len(points) != count:
        raise InputError(f"a {entry.kind} has {count} points", came=len(points))
    if not (np.linalg.norm(np.diff(points, axis=0), axis=1) > _NEAR[0]).all():
        raise InputError("two points of the path are one", came=entry.name)
    normal = np.array(entry.normal)
    if abs(float(np.linalg.norm(normal)) - 1.0) > 1e-6:
        raise InputError("the normal has length 1", came=list(entry.normal))
    if (entry.kind == "weave") != (entry.stroke > 0 and entry.wavelength > 0):
        raise InputError("a weave, and no other path, has a stroke and a wavelength", came=entry.kind)
    other = None if entry.other is None else np.asarray(rotation_from_quaternion(np.array([entry.other]))[0])
    rotation = np.asarray(rotation_from_quaternion(np.array([entry.quaternion]))[0])
    stroke, wavelength = (sized_si(v, "mm", entry.name) for v in (entry.stroke, entry.wavelength))
    return PlannedPath(entry.name, entry.kind, points, normal, rotation, other, stroke, wavelength)


def _metres(values: Triple) -> Array:
    return np.array([sized_si(value, "mm", "position") for value in values])


def _lengths(values: Array) -> list[float]:
    return [round(written(v, "mm"), 9) + 0.0 for v in values.tolist()]


def _turned(rotation: Array) -> list[float]:
    return [round(v, 12) + 0.0 for v in quaternion_from_rotation(rotation[None])[0].tolist()]


def _pose(pose: PlannedPose, robot: Robot) -> str:
    units = ["mm" if joint.kind == "prismatic" else "deg" for joint in robot.joints]
    joints = [written(v, unit) for v, unit in zip(pose.joints.tolist(), units, strict=True)]
    return f"position: {_lengths(pose.position)}, quaternion: {_turned(pose.rotation)}, joints: {joints}"


def _path(path: PlannedPath) -> str:
    parts = [
        f"name: {path.name}",
        f"kind: {path.kind}",
        f"points: {[_lengths(point) for point in path.points]}",
        f"normal: {[round(v, 12) + 0.0 for v in path.normal.tolist()]}",
        f"quaternion: {_turned(path.rotation)}",
    ]
    if path.other is not None:
        parts.append(f"other: {_turned(path.other)}")
    if path.kind == "weave":
        parts += [f"stroke: {written(path.stroke, 'mm')!r}", f"wavelength: {written(path.wavelength, 'mm')!r}"]
    return ", ".join(parts)


def _test(test: PlannedTest) -> str:
    def percent(shares: Sequence[float]) -> list[float]:
        return [round(100.0 * share, 9) for share in shares]

    entries: dict[str, Any] = {"velocities": percent(test.velocities), "loads": percent(test.loads)}
    texts = ", ".join(f"{name}: {value}" for name, value in entries.items())
    places = ", ".join(test.places)
    approaches = json.dumps(list(test.approaches))
    return f"criterion: {test.id}, places: [{places}], cycles: {test.cycles}, {texts}, approaches: {approaches}"
