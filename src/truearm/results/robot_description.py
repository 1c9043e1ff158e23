"""What is known about a robot, as a person reads it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from truearm.modeling.formats.balancer_entry import balancer_entry
from truearm.modeling.formats.controller_entry import controller_entry
from truearm.modeling.formats.reach_entry import reach_summary
from truearm.modeling.formats.robot_file import is_intact
from truearm.modeling.parts import GRAVITY
from truearm.modeling.robot import Robot
from truearm.results.record import Record
from truearm.results.shown_pose import ShownPose
from truearm.simulation.truths import truth_names
from truearm.units import SHOWN_AS, from_si, written


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
            "payload": {
                "mass_kg": robot.payload.mass,
                "cog_mm": [written(v, "mm") for v in robot.payload.cog],
            },
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
