"""Where a robot stands at joint positions, as its controller and its model say it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.modeling.controller import AS_THE_MODEL
from truearm.modeling.frames import Frame
from truearm.modeling.orientations import (
    FIXED_XYZ_ANGLES,
    MOVING_XYZ_ANGLES,
    QUATERNION,
    ROTATION_VECTOR,
    ZYX_ANGLES,
    Orientation,
)
from truearm.modeling.robot import Robot
from truearm.results.record import Record
from truearm.units import from_si

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
