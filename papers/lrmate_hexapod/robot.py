"""The LR Mate of Nubiola's chapter 4 with its device, and its invented truths."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from papers.campaign import touching
from truearm.engine.data.hexapod import DEVICE
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rotation_from_quaternion
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import JointTruth
from truearm.hexapod.reachable import with_cups

TARGETS: Final = ("1", "2", "3")
#: The cup that touches those of the base.
TOUCHING: Final = TARGETS[0]
#: The base fixture beside the robot, leaning 17 deg on its pivot; the document does not print where it stood. Of a
#: thousand places this one has as many poses and configurations as the document's.
FIXTURE: Final = Transform.from_matrix(
    rotation_from_quaternion(np.array([0.757633, -0.113205, 0.095004, 0.635729])), np.array([0.059, 0.233, 0.246])
)
#: What the document calls front/up and back/down. Its elbow is up or down as seen from the wrist's side; in both of
#: these it is above the line from shoulder to wrist, and below it the arm would meet the table.
FRONT_UP: Final = "front-up"
BACK_DOWN: Final = "back-up"
#: 300 mm from the three base cups and above them, in the fixture's frame [m].
REFERENCE: Final = DEVICE.base * np.array([1 / 2, math.sqrt(3) / 6, math.sqrt(2 / 3)])
#: What no model here contains, all invented: amplitude of a sine of each gear [rad] and how often in a turn, full
#: backlash [rad], tilt of the bearings of joints 1 to 4 per moment [rad/(N m)], and the share by which a joint is
#: stiffer per square of the moment [1/(N m)^2].
_GEAR: Final = math.radians(0.007)
_SINES: Final = (1, 2)
_BACKLASH: Final = math.radians(0.004)
_BEARING: Final = 3e-6
_HARDENING: Final = 1e-4
#: Standard deviations of what is drawn for another robot: lengths [m], twists and joint zeros [rad].
_LENGTHS: Final = 0.15e-3
_TWISTS: Final = math.radians(0.011)
_ZEROS: Final = math.radians(0.09)


def nominal_robot() -> tuple[Robot, Array]:
    """Return the nominal LR Mate with its tool, and the tool's cups in the flange frame [m], ``(3, 3)``."""
    return with_cups(load_robot("lrmate200ic"))


def invented_twin(robot: Robot) -> Twin:
    """Return the twin with the truth of the robot file, and what no model contains."""
    truth = robot.truths["invented"]
    return _twin(robot.with_values(truth.values), [truth.compliance.get(i, 0.0) for i in range(1, 7)], 0)


def drawn_twin(robot: Robot, seed: int) -> Twin:
    """Return another twin of the same kind: errors of the same size, half to one and a half times as compliant."""
    rng = np.random.default_rng([2, seed])
    sizes = {"a": _LENGTHS, "d": _LENGTHS, "alpha": _TWISTS, "beta": _TWISTS, "theta_offset": _ZEROS}
    truth = robot.truths["invented"]
    values = {
        name: robot.values[name] + sizes[name.rpartition("_")[0]] * float(rng.standard_normal())
        for name in truth.values
    }
    compliance = [truth.compliance.get(i, 0.0) * float(rng.uniform(0.5, 1.5)) for i in range(1, 7)]
    return _twin(robot.with_values(values), compliance, seed + 1)


def _twin(true: Robot, compliance: list[float], seed: int) -> Twin:
    rng = np.random.default_rng([1, seed])
    joints = {
        number: JointTruth(
            compliance=of_joint,
            cubic=-_HARDENING * of_joint,
            backlash=_BACKLASH,
            bearing=_BEARING if number <= 4 else 0.0,
            gear=tuple((k, _GEAR * float(rng.normal()), float(rng.uniform(0.0, 2 * math.pi))) for k in _SINES),
        )
        for number, of_joint in enumerate(compliance, 1)
    }
    return Twin(true, joints)


def touches(robot: Robot) -> Array:
    """Return the joints with which the nominal robot brings a cup to those of the base, tool downwards."""
    down = FIXTURE.rotation @ np.diag([1.0, -1.0, -1.0])
    return touching(robot, TOUCHING, FIXTURE, DEVICE.base, down)
