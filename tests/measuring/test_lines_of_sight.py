"""Fixed points that an arm or a box hides from an instrument: what is told is what points along the line show."""

from __future__ import annotations

import numpy as np

from truearm.engine.motion.arm_capsules import ArmCapsules
from truearm.engine.motion.cell import KeepOut
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import Transform
from truearm.measuring.lines_of_sight import BEAM, hidden

BASE = Transform((2.0, 0.5, -0.4), (np.cos(0.2), 0.0, 0.0, np.sin(0.2)))
ROBOT = load_robot("irb120").with_frames(BASE, {"tip": [0.0, 0.0, 0.1]})


def in_world(place: Array) -> Array:
    return np.asarray(ROBOT.base.rotation @ place + np.array(ROBOT.base.translation))


def test_the_arm_hides_what_lies_behind_a_link() -> None:
    rng = np.random.default_rng(0)
    joints = ROBOT.random_configurations(25, rng)
    arm, eye = ArmCapsules(ROBOT), np.zeros(3)
    points = {f"n{k}": 1.3 * in_world(np.array([0.0, 0.0, 0.35]) + rng.uniform(-0.2, 0.2, 3)) for k in range(8)}
    result = hidden(ROBOT, joints, eye, points)
    at = arm.points(joints)
    counts = [0, 0]
    for name, point in points.items():
        line = np.linspace(eye, point, 500)
        inside = (line - np.array(ROBOT.base.translation)) @ ROBOT.base.rotation
        for k in range(len(joints)):
            least = np.inf
            for link in (*arm.links, *arm.tools):
                along = at[link.start][:, k] + np.linspace(0, 1, 30)[:, None] * (at[link.end] - at[link.start])[:, k]
                far = np.linalg.norm(inside[:, None] - along, axis=2).min() - link.radius - BEAM
                least = min(least, far)
            if abs(least) > 0.01:  # of what is nearly so, points along lines do not tell
                assert (name in result[k]) == (least < 0)
                counts[int(least < 0)] += 1
    assert min(counts) > 10
    assert {words for reasons in result for words in reasons.values()} == {"the arm"}


def test_a_box_hides_what_lies_behind_it_and_is_named() -> None:
    joints = ROBOT.random_configurations(2, np.random.default_rng(1))
    eye = in_world(np.array([3.0, 0.0, 0.1]))
    points = {"behind": in_world(np.array([1.0, 0.0, 0.1])), "before": in_world(np.array([2.5, 0.0, 0.1]))}
    wall = KeepOut("wall", np.array([1.9, -0.1, -np.inf]), np.array([2.0, 0.1, np.inf]))
    assert hidden(ROBOT, joints, eye, points, [wall]) == [{"behind": "the box 'wall'"}] * 2
    assert hidden(ROBOT, joints, eye, points) == [{}, {}]
