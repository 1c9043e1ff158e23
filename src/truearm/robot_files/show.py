"""The robots of the library, what is known about a robot, and where it stands at joint positions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from truearm.engine.base.errors import InputError, nearest_names
from truearm.engine.base.units import SHOWN_AS, from_si, written
from truearm.engine.command.arguments import array_argument, joints_argument, robot_argument
from truearm.engine.command.texts import positions_of
from truearm.engine.document.records import Record
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import AS_THE_MODEL
from truearm.engine.robot.frames import Frame
from truearm.engine.robot.library import close_names, letters, library, load_robot
from truearm.engine.robot.parts import GRAVITY
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

    def summary(self) -> dict[str, Any]:
        """Return what is known of each, as JSON holds it."""
        rows = [
            {
                "id": robot.name,
                "maker": robot.maker or None,
                "title": robot.title,
                "joints": len(robot.joints),
                **reach_summary(robot.reach),
                "controller_known": robot.controller != AS_THE_MODEL,
                "source": robot.source,
            }
            for robot in self.robots
        ]
        return {"robots": rows}

    def lines(self) -> list[str]:
        """Return one line a robot, below what its columns are."""
        rows = [("id", "maker", "joints", "reach", "controller", "robot")]
        for robot in self.robots:
            reach = "-" if robot.reach is None else f"{robot.reach.distance * 1e3:.6g} mm"
            known = "-" if robot.controller == AS_THE_MODEL else "known"
            title = robot.title.removeprefix(robot.maker).strip()
            rows.append((robot.name, robot.maker or "-", str(len(robot.joints)), reach, known, title))
        widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
        return ["  ".join(f"{c:{w}}" for c, w in zip(row, widths, strict=True)).rstrip() for row in rows]


def listed_robots(asked: ListRobots) -> RobotList:
    """List the robots of the library."""
    found = [load_robot(robot_id) for robot_id in library()]
    if asked.maker is not None:
        found = _of_maker(found, asked.maker)
    if asked.axes is not None:
        found = _with_axes(found, asked.axes)
    if asked.text is not None:
        found = _named(found, asked.text)
    return RobotList(tuple(found))


def _of_maker(robots: list[Robot], maker: str) -> list[Robot]:
    makers = sorted({robot.maker for robot in robots if robot.maker})
    found = [robot for robot in robots if letters(maker) and _begins(robot.maker, maker)]
    if not found:
        near = nearest_names(maker, makers)
        raise InputError(
            "the library has no robot of this maker",
            parameter="maker",
            came=maker,
            allowed=", ".join(makers),
            cure=f"Did you mean {' or '.join(near)}?" if near else None,
        )
    return found


def _begins(maker: str, text: str) -> bool:
    """Return whether a maker's name, a word of it, or the initials of its words begin with a text."""
    words = [letters(word) for word in maker.split()]
    return any(name.startswith(letters(text)) for name in (letters(maker), *words, "".join(word[:1] for word in words)))


def _with_axes(robots: list[Robot], axes: int) -> list[Robot]:
    found = [robot for robot in robots if len(robot.joints) == axes]
    if not found:
        known = sorted({len(robot.joints) for robot in robots})
        raise InputError(
            "none of these robots has so many joints",
            parameter="axes",
            came=axes,
            allowed=", ".join(str(count) for count in known),
        )
    return found


def _named(robots: list[Robot], text: str) -> list[Robot]:
    words = [letters(word) for word in text.split()]
    # Words by themselves, as of one maker and type, or together, as a type is written with blanks.
    found = [robot for robot in robots if all(words) and words and _holds(robot, words, letters(text))]
    if not found:
        near = [name for name in close_names(text) if any(robot.name == name for robot in robots)]
        raise InputError(
            "none of these robots is called so",
            parameter="text",
            came=text,
            cure=f"Did you mean {' or '.join(near)}?" if near else "Run 'truearm robots' for all.",
        )
    return found


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

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, lengths in mm and angles in deg, rotation vectors in rad."""
        robot = self.robot
        frames: dict[str, Frame] = {"model": "base"}
        if robot.controller != AS_THE_MODEL:
            frames["controller"] = "controller"
        joints = {"model": self._joints(self.joints)}
        if robot.controller.counts_known:
            joints["controller"] = self._joints(robot.controller.from_model(self.joints[None])[0])
        return {"joints": joints, "flange": {whose: self._pose(frame) for whose, frame in frames.items()}}

    def lines(self) -> list[str]:
        """Return the joint positions of both kinds and the pose, as every maker writes it."""
        said = self.summary()
        joints, flange = said["joints"], said["flange"]
        units = "deg" if all(joint.kind == "revolute" for joint in self.robot.joints) else "deg, mm"
        text = []
        if "controller" in joints:
            text.append(f"Joint positions on the controller (axis_i): {_row(joints['controller'], 4)} {units}")
        text.append(f"Joint positions of the model (joint_i): {_row(joints['model'], 4)} {units}")
        if "controller" in flange:
            text.append("The controller, with the tool and the user frame all zeros, shows the pose:")
        else:
            text.append(
                "The robot file does not say where its controller has its frames. Flange of the model, from the base:"
            )
        shown = flange.get("controller", flange["model"])
        x, y, z = _row(shown["position_mm"], 3).split()
        text.append(f"  x {x}  y {y}  z {z} mm")
        for name, way, unit, who in _WRITTEN:
            digits = 6 if not unit else 4
            text.append(f"  {name}  {_row(shown[way.name], digits)}{' ' * bool(unit)}{unit}  ({who})")
        if "controller" in flange and flange["controller"] != flange["model"]:
            x, y, z = _row(flange["model"]["position_mm"], 3).split()
            q = _row(flange["model"][QUATERNION.name], 6)
            text.append(f"Flange of the model, from its base: x {x}  y {y}  z {z} mm, quaternion {q}")
        return text

    def _joints(self, joints: Array) -> list[float]:
        units = ["deg" if joint.kind == "revolute" else "mm" for joint in self.robot.joints]
        return [from_si(value, unit) for value, unit in zip(joints.tolist(), units, strict=True)]

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


def _row(values: list[float], digits: int) -> str:
    """Return numbers in a row, without the sign of a zero."""
    return "  ".join(f"{round(value, digits) + 0.0:.{digits}f}" for value in values)


@dataclass(frozen=True, eq=False, repr=False)
class RobotDescription(Record):
    """What is known about a robot."""

    robot: Robot  #: The robot.
    at: ShownPose | None = None  #: Where it stands, if joint positions were given.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it, lengths in mm and angles in deg."""
        robot = self.robot
        base = robot.base
        position, _ = robot.world_poses(np.zeros((1, len(robot.joints))))
        joints = []
        for number, joint in enumerate(robot.joints, 1):
            values = {
                p.name: from_si(p.value, SHOWN_AS[p.unit])
                for element in robot.link_elements[number - 1]
                if element.parameter is not None
                for p in [robot.parameters[element.parameter]]
            }
            unit = "deg" if joint.kind == "revolute" else "mm"
            limits = [from_si(v, unit) for v in joint.limits] if joint.limits else None
            bearing = None if joint.bearing is None else written(joint.bearing, "mm")
            speed = None if joint.max_speed is None else written(joint.max_speed, unit)
            made = {"name": joint.name, "type": joint.kind, "values": values, "limits": limits, "bearing": bearing}
            joints.append({**made, "max_speed": speed})
        return {
            "name": robot.name,
            "title": robot.title,
            "maker": robot.maker or None,
            "source": robot.source,
            "convention": robot.convention_name,
            "units": {"length": "mm", "angle": "deg"},
            "joints": joints,
            "flange_at_zero_mm": [
                round(float(v) * 1e3, 9) for v in base.rotation.T @ (position[0] - np.array(base.translation))
            ],
            "effects": list(robot.effect_names),
            "masses_kg": {f"link {m.joint}": m.mass for m in robot.masses},
            "balancers": [balancer_entry(balancer) for balancer in robot.balancers],
            "payload": {"mass_kg": robot.payload.mass, "cog_mm": [written(v, "mm") for v in robot.payload.cog]},
            "rated_load_kg": robot.rated_load,
            **reach_summary(robot.reach),
            "gravity": list(robot.gravity),
            "controller": controller_entry(robot.controller, robot.joints),
            "tools": list(robot.tools),
            "truths": list(truth_names(robot)),
            "targets": [target.name for target in robot.targets],
            "proof": None if robot.proof is None else {**robot.proof.summary(), "intact": is_intact(robot)},
            "history": list(robot.history),
            "at": None if self.at is None else self.at.summary(),
        }

    def lines(self) -> list[str]:
        """Return its joints, its reach at zero, and what else is known about it."""
        robot, content = self.robot, self.summary()
        text = [f"{robot.title} ({robot.name})", f"Source: {robot.source}"]
        text.append(f"Convention: {robot.convention_name}, lengths in mm, angles in deg")
        for joint in content["joints"]:
            row = "  ".join(f"{name} {value:g}" for name, value in joint["values"].items())
            limits = "  limits {:g} to {:g}".format(*joint["limits"]) if joint["limits"] else ""
            bearing = "" if joint["bearing"] is None else f"  bearing at {joint['bearing']:g}"
            text.append(f"  {joint['name']} ({joint['type']})  {row}{limits}{bearing}{_speed(joint)}")
        x, y, z = content["flange_at_zero_mm"]
        text.append(f"Flange at zero joint positions, from the base: x {x:.3f}  y {y:.3f}  z {z:.3f} mm")
        if content["masses_kg"]:
            text.append(f"Link masses: {', '.join(f'{k} {v:g} kg' for k, v in content['masses_kg'].items())}")
        for b in content["balancers"]:
            pull = f"{b['force']:g} N at {b['length']:g} mm" if "force" in b else f"free at {b['free_length']:g} mm"
            ends = f"from link {b['fixed']['link']} to link {b['moving']['link']}"
            text.append(f"Balancer {b['name']}: {ends}, {pull}, {b['stiffness']:g} N/mm")
        payload = content["payload"]
        if payload["mass_kg"]:
            x, y, z = payload["cog_mm"]
            text.append(f"Payload: {payload['mass_kg']:g} kg at x {x:g}  y {y:g}  z {z:g} mm of the flange")
        if robot.rated_load is not None:
            text.append(f"Rated load: {robot.rated_load:g} kg")
        if robot.reach is not None:
            text.append(f"Reach: {robot.reach.text}")
        if robot.gravity != GRAVITY:
            text.append("Free fall: {:g}, {:g}, {:g} m/s^2 in the base frame".format(*robot.gravity))
        if content["controller"]:
            text.append(f"Controller: {content['controller'].get('source', 'as its file says')}")
            text += [f"  {line}" for line in _controller_lines(content["controller"], content["joints"])]
        for key, label in (("effects", "Joint effects"), ("truths", "Truths for simulation"), ("targets", "Targets")):
            if content[key]:
                text.append(f"{label}: {', '.join(content[key])}")
        if self.robot.proof is not None:
            words = ", ".join(dict.fromkeys([content["proof"]["status"], *content["proof"]["errors"]]))
            known = f"; held at known places: {', '.join(self.robot.proof.held)}" if self.robot.proof.held else ""
            text.append(
                f"Calibration: {words}{known}{'' if content['proof']['intact'] else '; values were changed since'}"
            )
        text += [f"History: {line}" for line in robot.history]
        return text if self.at is None else [*text, *self.at.lines()]


#: What the words of robot files say of a controller's kinematics.
_KINEMATICS: Final = {
    "unknown": "not said: the nominal values, or what its maker measured of this arm (every arm of Universal Robots)",
    "nominal": "the nominal values",
    "proprietary": "a calibration of its maker that nobody else can read",
}


def _speed(joint: dict[str, Any]) -> str:
    """Say how fast a joint goes at 100 %, if that is known."""
    if joint["max_speed"] is None:
        return ""
    return f"  up to {joint['max_speed']:g} {'deg' if joint['type'] == 'revolute' else 'mm'}/s"


def _controller_lines(entry: dict[str, Any], joints: list[dict[str, Any]]) -> Iterator[str]:
    """Say what of a controller differs from the model; `entry` is what a robot file would say of it."""
    units = {joint["name"]: "deg" if joint["type"] == "revolute" else "mm" for joint in joints}
    number = {joint["name"]: place for place, joint in enumerate(joints, 1)}
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
    given = array_argument(joints, "joint_positions", (count,), f"{count} numbers, one for each joint of {arm.name}")
    if whose == "controller" and not isinstance(asked.joint_positions, str):
        given = arm.controller.to_model(given[None])[0]
    return RobotDescription(arm, ShownPose(arm, np.array(given)))
