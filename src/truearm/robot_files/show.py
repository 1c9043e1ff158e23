"""The robots of the library, what is known about a robot, and where it stands at joint positions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from truearm.engine.base.errors import InputError, nearest_names
from truearm.engine.base.units import SHOWN_AS, from_si, written
from truearm.engine.command.arguments import array_argument, joints_argument, robot_argument
from truearm.engine.command.texts import positions_of
from truearm.engine.document.document import Block, Table, Words, each, say, under
from truearm.engine.document.records import Record
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import AS_THE_MODEL
from truearm.engine.robot.frames import Frame
from truearm.engine.robot.library import close_names, letters, library, load_robot
from truearm.engine.robot.parts import GRAVITY, Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.entries import balancer_entry, controller_entry, reach_summary
from truearm.engine.robot.robot_file.seal import is_intact
from truearm.engine.robot.transform import (
    FIXED_XYZ_ANGLES,
    MOVING_XYZ_ANGLES,
    QUATERNION,
    ROTATION_VECTOR,
    ZYX_ANGLES,
    Orientation,
)
from truearm.engine.twin.truths import truth_names

if TYPE_CHECKING:
    from truearm.robot_files.jobs import ListRobots, ShowRobot


@dataclass(frozen=True, eq=False, repr=False)
class RobotList(Record):
    """The robots of the library."""

    robots: tuple[Robot, ...]  #: In the order of their ids.
    is_list: ClassVar = True

    def blocks(self) -> Iterator[Block]:
        """Give one line a robot, below what its columns are."""
        rows, entries = list[tuple[str, ...]](), list[dict[str, Any]]()
        for robot in self.robots:
            known = robot.controller != AS_THE_MODEL
            reach = "-" if robot.reach is None else f"{robot.reach.distance * 1e3:.6g} mm"
            title = robot.title.removeprefix(robot.maker).strip()
            count = len(robot.joints)
            rows.append((robot.name, robot.maker or "-", str(count), reach, "known" if known else "-", title))
            entries.append(
                {
                    "id": robot.name,
                    "maker": robot.maker or None,
                    "title": robot.title,
                    "joints": count,
                    **reach_summary(robot.reach),
                    "controller_known": known,
                    "source": robot.source,
                }
            )
        yield Table(("id", "maker", "joints", "reach", "controller", "robot"), rows, in_json={"robots": entries})


def listed_robots(asked: ListRobots) -> RobotList:
    """List the robots of the library."""
    robots = [load_robot(robot_id) for robot_id in library()]
    if asked.maker is not None:
        robots = _of_maker(robots, asked.maker)
    if asked.axes is not None:
        robots = _with_axes(robots, asked.axes)
    if asked.text is not None:
        robots = _named(robots, asked.text)
    return RobotList(tuple(robots))


def _of_maker(robots: list[Robot], maker: str) -> list[Robot]:
    makers = sorted({robot.maker for robot in robots if robot.maker})
    matching = [robot for robot in robots if letters(maker) and _begins(robot.maker, maker)]
    if not matching:
        near = nearest_names(maker, makers)
        raise InputError(
            "the library has no robot of this maker",
            parameter="maker",
            came=maker,
            allowed=", ".join(makers),
            cure=f"Did you mean {' or '.join(near)}?" if near else None,
        )
    return matching


def _begins(maker: str, text: str) -> bool:
    """Return whether a maker's name, a word of it, or the initials of its words begin with a text."""
    words = [letters(word) for word in maker.split()]
    return any(name.startswith(letters(text)) for name in (letters(maker), *words, "".join(word[:1] for word in words)))


def _with_axes(robots: list[Robot], axes: int) -> list[Robot]:
    matching = [robot for robot in robots if len(robot.joints) == axes]
    if not matching:
        known = sorted({len(robot.joints) for robot in robots})
        raise InputError(
            "none of these robots has so many joints",
            parameter="axes",
            came=axes,
            allowed=", ".join(str(count) for count in known),
        )
    return matching


def _named(robots: list[Robot], text: str) -> list[Robot]:
    words = [letters(word) for word in text.split()]
    # Words by themselves, as of one maker and type, or together, as a type is written with blanks.
    matching = [robot for robot in robots if all(words) and words and _holds(robot, words, letters(text))]
    if not matching:
        near = [name for name in close_names(text) if any(robot.name == name for robot in robots)]
        raise InputError(
            "none of these robots is called so",
            parameter="text",
            came=text,
            cure=f"Did you mean {' or '.join(near)}?" if near else "Run 'truearm robots' for all.",
        )
    return matching


def _holds(robot: Robot, words: list[str], together: str) -> bool:
    """Return whether id or full name hold words."""
    names = (letters(robot.name), letters(robot.title))
    return any(together in name or all(word in name for word in words) for name in names)


#: How controllers write an orientation, the unit of its numbers, and whose do.
_WRITTEN: Final[tuple[tuple[str, Orientation, str, str], ...]] = (
    ("q1 q2 q3 q4", QUATERNION, "", "ABB"),
    ("A B C", ZYX_ANGLES, "deg", "KUKA"),
    ("W P R", FIXED_XYZ_ANGLES, "deg", "FANUC, as Rx Ry Rz Yaskawa"),
    ("Rx Ry Rz", MOVING_XYZ_ANGLES, "deg", "Staubli"),
    ("rx ry rz", ROTATION_VECTOR, "rad", "Universal Robots"),
)

#: A turn is half a turn within this [deg, rad or parts of a quaternion]: it has two signs.
_HALF_A_TURN: Final = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class ShownPose(Record):
    """Where a robot stands."""

    robot: Robot  #: The robot.
    joints: Array  #: Joint positions of its model [rad; m for prismatic joints], ``(joints,)``.

    def blocks(self) -> Iterator[Block]:
        """Give joint positions and the pose, as every maker writes it, in mm and deg, rotation vectors in rad."""
        robot = self.robot
        units = "deg" if all(joint.kind == "revolute" for joint in robot.joints) else "deg, mm"
        joints = {"model": self._joints(self.joints)}
        text = [f"Joint positions of the model (joint_i): {_row(joints['model'], 4)} {units}"]
        if robot.controller.counts_known:
            joints["controller"] = self._joints(robot.controller.from_model(self.joints[None])[0])
            text.insert(0, f"Joint positions on the controller (axis_i): {_row(joints['controller'], 4)} {units}")
        yield say(*text, joints=joints)
        flange = {"model": self._pose("base")}
        words = "The robot file does not say where its controller has its frames. Flange of the model, from the base:"
        if robot.controller != AS_THE_MODEL:
            flange["controller"] = self._pose("controller")
            words = "The controller, with the tool and the user frame all zeros, shows the pose:"
        shown = flange.get("controller", flange["model"])
        yield say(words, f"  {_place(shown)}", flange=flange)
        for name, way, unit, who in _WRITTEN:
            digits = 6 if not unit else 4
            yield say(f"  {name}  {_row(shown[way.name], digits)}{' ' * bool(unit)}{unit}  ({who})")
        if shown != flange["model"]:
            q = _row(flange["model"][QUATERNION.name], 6)
            yield say(f"Flange of the model, from its base: {_place(flange['model'])}, quaternion {q}")

    def _joints(self, joints: Array) -> list[float]:
        return [from_si(value, _unit(joint)) for value, joint in zip(joints.tolist(), self.robot.joints, strict=True)]

    def _pose(self, frame: Frame) -> dict[str, list[float]]:
        position, rotation = self.robot.forward(self.joints, frame=frame)
        pose = {"position_mm": (1e3 * position[0]).tolist()}
        for _, way, unit, _ in _WRITTEN:
            numbers = way.nearest(rotation, np.zeros((1, way.count)))[0]
            pose[way.name] = _usual(np.degrees(numbers) if unit == "deg" else numbers, way)
        return pose


def _usual(numbers: Array, way: Orientation) -> list[float]:
    """Return numbers of an orientation with the signs that pendants prefer, where rounding decides between two."""
    if way.count == 3 and way is not ROTATION_VECTOR:
        return [float(v) + 360.0 * (v <= -180.0 + _HALF_A_TURN) for v in numbers]
    half = abs(numbers[0]) if way is QUATERNION else np.pi - np.linalg.norm(numbers)
    first = next((v for v in numbers.tolist() if abs(v) > _HALF_A_TURN), 0.0)
    sign = -1.0 if abs(half) <= _HALF_A_TURN and first < 0.0 else 1.0
    return [sign * float(v) for v in numbers]


def _place(pose: dict[str, list[float]]) -> str:
    x, y, z = _row(pose["position_mm"], 3).split()
    return f"x {x}  y {y}  z {z} mm"


def _row(values: list[float], digits: int) -> str:
    """Return numbers in a row, without the sign of a zero."""
    return "  ".join(f"{round(value, digits) + 0.0:.{digits}f}" for value in values)


@dataclass(frozen=True, eq=False, repr=False)
class RobotDescription(Record):
    """What is known about a robot."""

    robot: Robot  #: The robot.
    at: ShownPose | None = None  #: Where it stands, if joint positions were given.
    is_list: ClassVar = True

    def blocks(self) -> Iterator[Block]:
        """Give its joints, its reach at zero, and what else is known about it, lengths in mm and angles in deg."""
        robot = self.robot
        yield say(f"{robot.title} ({robot.name})", name=robot.name, title=robot.title, maker=robot.maker or None)
        yield say(f"Source: {robot.source}", source=robot.source)
        yield say(
            f"Convention: {robot.convention_name}, lengths in mm, angles in deg",
            convention=robot.convention_name,
            units={"length": "mm", "angle": "deg"},
        )
        yield each("joints", (self._joint(number) for number in range(len(robot.joints))))
        position, _ = robot.world_poses(np.zeros((1, len(robot.joints))))
        flange = robot.base.rotation.T @ (position[0] - np.array(robot.base.translation))
        x, y, z = at_zero = [round(float(v) * 1e3, 9) for v in flange]
        words = f"Flange at zero joint positions, from the base: x {x:.3f}  y {y:.3f}  z {z:.3f} mm"
        yield say(words, flange_at_zero_mm=at_zero)
        yield from self._masses()
        reach = () if robot.reach is None else (f"Reach: {robot.reach.text}",)
        yield say(*reach, **reach_summary(robot.reach))
        fall = "Free fall: {:g}, {:g}, {:g} m/s^2 in the base frame".format(*robot.gravity)
        yield say(fall if robot.gravity != GRAVITY else "", gravity=list(robot.gravity))
        yield self._controller()
        targets = [target.name for target in robot.targets]
        yield say(*_named_list("Joint effects", robot.effect_names), effects=list(robot.effect_names))
        yield say(*_named_list("Truths for simulation", truth_names(robot)), truths=list(truth_names(robot)))
        yield say(*_named_list("Targets", targets), targets=targets, tools=list(robot.tools))
        yield self._proof()
        yield say(*(f"History: {line}" for line in robot.history), history=list(robot.history))
        yield say(at=None) if self.at is None else under("at", self.at.blocks())

    def _joint(self, number: int) -> Words:
        """Return what is known of a joint, numbered from zero."""
        robot, joint = self.robot, self.robot.joints[number]
        values = {
            p.name: from_si(p.value, SHOWN_AS[p.unit])
            for element in robot.link_elements[number]
            if element.parameter is not None
            for p in [robot.parameters[element.parameter]]
        }
        unit = _unit(joint)
        limits = [from_si(v, unit) for v in joint.limits] if joint.limits else None
        bearing = None if joint.bearing is None else written(joint.bearing, "mm")
        speed = None if joint.max_speed is None else written(joint.max_speed, unit)
        row = "  ".join(f"{name} {value:g}" for name, value in values.items())
        row += "  limits {:g} to {:g}".format(*limits) if limits else ""
        row += "" if bearing is None else f"  bearing at {bearing:g}"
        row += "" if speed is None else f"  up to {speed:g} {unit}/s"
        return say(
            f"  {joint.name} ({joint.kind})  {row}",
            name=joint.name,
            type=joint.kind,
            values=values,
            limits=limits,
            bearing=bearing,
            max_speed=speed,
        )

    def _masses(self) -> Iterator[Words]:
        """Give what is known of masses, springs and loads."""
        robot = self.robot
        masses = {f"link {m.joint}": m.mass for m in robot.masses}
        yield say(*_named_list("Link masses", [f"{k} {v:g} kg" for k, v in masses.items()]), masses_kg=masses)
        text, balancers = [], [balancer_entry(balancer) for balancer in robot.balancers]
        for b in balancers:
            pull = f"{b['force']:g} N at {b['length']:g} mm" if "force" in b else f"free at {b['free_length']:g} mm"
            ends = f"from link {b['fixed']['link']} to link {b['moving']['link']}"
            text.append(f"Balancer {b['name']}: {ends}, {pull}, {b['stiffness']:g} N/mm")
        yield say(*text, balancers=balancers)
        mass, (x, y, z) = robot.payload.mass, (written(v, "mm") for v in robot.payload.cog)
        words = f"Payload: {mass:g} kg at x {x:g}  y {y:g}  z {z:g} mm of the flange"
        yield say(words if mass else "", payload={"mass_kg": mass, "cog_mm": [x, y, z]})
        load = robot.rated_load
        yield say("" if load is None else f"Rated load: {load:g} kg", rated_load_kg=load)

    def _controller(self) -> Words:
        entry = controller_entry(self.robot.controller, self.robot.joints)
        if not entry:
            return say(controller=entry)
        lines = (f"  {line}" for line in _controller_lines(entry, self.robot.joints))
        return say(f"Controller: {entry.get('source', 'as its file says')}", *lines, controller=entry)

    def _proof(self) -> Words:
        proof = self.robot.proof
        if proof is None:
            return say(proof=None)
        summary = {**proof.summary(), "intact": is_intact(self.robot)}
        words = ", ".join(dict.fromkeys([summary["status"], *summary["errors"]]))
        words += f"; held at known places: {', '.join(proof.held)}" if proof.held else ""
        return say(f"Calibration: {words}{'' if summary['intact'] else '; values were changed since'}", proof=summary)


def _named_list(label: str, names: Sequence[str]) -> list[str]:
    return [f"{label}: {', '.join(names)}"] if names else []


def _unit(joint: Joint) -> str:
    return "deg" if joint.kind == "revolute" else "mm"


#: What the words of robot files say of a controller's kinematics.
_KINEMATICS: Final = {
    "unknown": "not said: the nominal values, or what its maker measured of this arm (every arm of Universal Robots)",
    "nominal": "the nominal values",
    "proprietary": "a calibration of its maker that nobody else can read",
}


def _controller_lines(entry: dict[str, Any], joints: Sequence[Joint]) -> Iterator[str]:
    """Say what of a controller differs from the model; `entry` is what a robot file would say of it."""
    units = {joint.name: _unit(joint) for joint in joints}
    number = {joint.name: place for place, joint in enumerate(joints, 1)}
    kinematics = entry.get("kinematics", "unknown")
    if not isinstance(kinematics, str):
        kinematics = f"{kinematics['kind']}, from {kinematics.get('source') or 'the robot file'}"
    yield f"computes poses with: {_KINEMATICS.get(kinematics, kinematics)}"
    for row in entry.get("joints", []):
        others = row.get("coupling", {}).items()
        counted = [f"joint_{number[row['joint']]}", *(_share(v, f"joint_{number[name]}") for name, v in others)]
        text = " + ".join(counted).replace("+ -", "- ")
        if "sign" in row:
            text = f"-({text})" if len(counted) > 1 else f"-{text}"
        if "zero" in row:
            text += f" {'-' if row['zero'] < 0 else '+'} {abs(row['zero']):g} {units[row['joint']]}"
        text += "".join(
            f", {row[f'pulses_per_{unit}']:.9g} pulses per {unit}"
            for unit in ("degree", "mm")
            if f"pulses_per_{unit}" in row
        )
        yield f"axis_{number[row['joint']]} = {text}"
    for name in ("base", "flange"):
        if name in entry:
            x, y, z = entry[name]["translation"]
            quaternion = " ".join(f"{v:g}" for v in entry[name]["quaternion"])
            yield f"{name} frame at x {x:g}  y {y:g}  z {z:g} mm of the model's, quaternion {quaternion}"
    if entry.keys() <= {"source"}:
        yield "joints and frames are the model's"


def _share(value: float, name: str) -> str:
    return {1.0: name, -1.0: f"-{name}"}.get(value, f"{value:g} {name}")


def described(asked: ShowRobot) -> RobotDescription:
    """Say what is known about a robot, and where it stands at joint positions."""
    arm = robot_argument(asked.robot)
    whose = joints_argument(asked.joints_are, arm, "joints_are")
    if asked.joint_positions is None:
        return RobotDescription(arm)
    count = len(arm.joints)
    joints = positions_of(asked.joint_positions, arm, whose, "joint_positions")
    positions = array_argument(
        joints, "joint_positions", (count,), f"{count} numbers, one for each joint of {arm.name}"
    )
    if whose == "controller" and not isinstance(asked.joint_positions, str):
        positions = arm.controller.to_model(positions[None])[0]
    return RobotDescription(arm, ShownPose(arm, np.array(positions)))
