"""What the library says of controllers, held against the public URDFs that have the makers' joints and frames."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.library import outside

from truearm.library import library, load_robot
from truearm.modeling.chain import Array
from truearm.modeling.controller import AS_THE_MODEL
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform

KNOWN = [robot_id for robot_id in library() if load_robot(robot_id).controller != AS_THE_MODEL]
#: Arms whose URDF counts otherwise than the controller, or has no link where the controller has its base frame or
#: flange, and what tells of them instead.
ELSEWHERE = {
    "irb1100_4_0.58": "RobotComponents; the URDF was drawn from CAD",
    "meca500": "the maker's manual; the URDF's base is behind axis 1, its last link on its side",
    "rs007l": "RobotKinematicsCatalogue; the URDF's base is the floor",
}
HELD = [robot_id for robot_id in KNOWN if robot_id in outside.known() and robot_id not in ELSEWHERE]


def _matrix(place: Transform) -> Array:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = place.rotation, place.translation
    return made


def _shown(robot: Robot, counted: Array) -> Array:
    """Return what the pendant shows: FANUC's J3 includes J2, which its driver takes out of the URDF's joint."""
    shown = counted.copy()
    if robot.maker == "FANUC":
        shown[:, 2] -= shown[:, 1]
    return shown


@pytest.mark.parametrize("robot_id", KNOWN)
def test_a_controller_has_a_source(robot_id: str) -> None:
    assert len(load_robot(robot_id).controller.source) > 10


@pytest.mark.parametrize("robot_id", HELD)
def test_it_counts_as_the_public_urdf_does(robot_id: str) -> None:
    robot, stored = load_robot(robot_id), outside.read(robot_id)
    assert_allclose(robot.controller.from_model(stored.joints), _shown(robot, stored.counted), rtol=0, atol=1e-12)


@pytest.mark.parametrize("robot_id", HELD)
def test_its_frames_are_those_of_the_public_urdf(robot_id: str) -> None:
    robot, stored = load_robot(robot_id), outside.read(robot_id)
    its = robot.controller
    positions, rotations = robot.forward(its.to_model(_shown(robot, stored.counted)))
    for position, rotation, seen in zip(positions, rotations, stored.seen, strict=True):
        flange = np.eye(4)
        flange[:3, :3], flange[:3, 3] = rotation, position
        shown = np.linalg.inv(_matrix(its.base)) @ flange @ _matrix(its.flange)
        assert_allclose(shown[:3, 3], seen[:3, 3], rtol=0, atol=1e-5)  # 0.01 mm
        assert_allclose(shown[:3, :3], seen[:3, :3], rtol=0, atol=1e-6)
