"""Whether a robot still has the values that its calibration is about."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from truearm.engine.robot.parameters import PLACES
from truearm.engine.robot.proof import Proof
from truearm.engine.robot.robot_file.curve_entry import digits_of
from truearm.engine.robot.robot_file.writing import file_content

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot

#: Entries of a robot file that say nothing of where the robot goes.
_BESIDE: Final = (
    "truearm",
    "name",
    "title",
    "maker",
    "source",
    "rated_load",
    "reach",
    "priors",
    "tools",
    "truths",
    "history",
)
#: How a calibration ends that nothing speaks against.
_SOUND: Final = "converged"


def sealed(robot: Robot, proof: Proof) -> Robot:
    """Return a robot with what is known of its calibration, which is about the values that it has now."""
    unsigned = replace(robot, proof=proof)
    return replace(unsigned, proof=replace(proof, digest=_digest(unsigned)))


def is_intact(robot: Robot) -> bool:
    """Return whether a robot has the values that its proof is about, and the proof is as it was written."""
    return robot.proof is not None and robot.proof.digest == _digest(robot)


def arm_is_known(robot: Robot) -> bool:
    """Return whether it is known how uncertain the arm of a robot is, and not its place alone."""
    if robot.proof is None or not is_intact(robot):
        return False
    return any(robot.parameters[name].group not in PLACES for name in robot.proof.names)


def calibrated_soundly(robot: Robot) -> bool:
    """Return whether a robot has the arm of an earlier calibration that nothing spoke against."""
    proof = robot.proof
    return proof is not None and proof.status == _SOUND and not proof.errors and arm_is_known(robot)


def _digest(robot: Robot) -> str:
    """Return the SHA-256 of all that a robot file says of where the robot goes, and of its proof.

    The numbers are those of files: what was written and read again has the same.
    """
    content = {name: entry for name, entry in file_content(robot).items() if name not in _BESIDE}
    # With what the controller computes and how fast joints are says nothing of where the arm goes, and may be told
    # after the calibration.
    controller = {name: entry for name, entry in content.pop("controller", {}).items() if name != "kinematics"}
    content |= {"controller": controller} if controller else {}
    content["joints"] = [{key: v for key, v in joint.items() if key != "max_speed"} for joint in content["joints"]]
    content["parameters"] = {name: entry["value"] for name, entry in content.get("parameters", {}).items()}
    proof = {name: entry for name, entry in content.get("proof", {}).items() if name != "sha256"}
    if robot.proof is not None and "correlations" in proof:  # in digits, whichever way they are written
        proof["correlations"] = digits_of(robot.proof.factor)
    content["proof"] = proof
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
