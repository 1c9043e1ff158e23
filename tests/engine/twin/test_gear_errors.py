"""Truths whose encoders and gears err: their amplitudes are those stated, and they go a way of their own."""

from __future__ import annotations

import ast
import math
from pathlib import Path

import numpy as np
import pytest

from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.twin import gear_errors
from truearm.engine.twin.gear_errors import DRAWN
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import JointTruth

TURN = np.linspace(-math.pi, math.pi, 7200, endpoint=False)


def curve(joint: JointTruth) -> np.ndarray:
    """Return what a joint turns beyond its position over a turn, 20 places a degree [deg]."""
    rest = np.zeros(len(TURN))
    return np.degrees(joint.turn(TURN, rest, rest))


def strengths(joint: JointTruth) -> np.ndarray:
    """Return the amplitude [deg] of each number of periods in a turn, from 0."""
    return 2.0 * np.abs(np.fft.rfft(curve(joint))) / len(TURN)


def twin(truth: str, seed: int = 0, robot: str = "irb120") -> Twin:
    return truth_twin(load_robot(robot), truth, np.random.default_rng(seed))


def test_gears_err_as_often_and_as_much_as_stated() -> None:
    drawn = twin("gear-errors")
    for number in range(1, 7):
        found = strengths(drawn.joints[number])
        often = np.flatnonzero(found > 1e-9)
        assert len(often) == 5
        assert often[:2].tolist() == [1, 2]
        assert ((often[2:] >= 10) & (often[2:] <= 60)).all()
        assert found[often] == pytest.approx([0.010, 0.004, 0.006, 0.006, 0.006])
        assert curve(drawn.joints[number]).std() == pytest.approx(0.0106, abs=1e-4)
    periods = {tuple(k for k, _, _ in joint.gear) for joint in drawn.joints.values()}
    assert len(periods) == 6  # no joint like another


def test_teeth_and_worn_places_are_no_series_that_ends() -> None:
    for joint in twin("tooth-errors").joints.values():
        found = strengths(joint)
        assert 0.009 < curve(joint).std() < 0.016
        assert np.sqrt((found[61:] ** 2).sum() / 2) > 1e-4  # some is beyond 60 periods


def test_a_triangle_is_straight_between_its_ends() -> None:
    rising = JointTruth(teeth=((4, 2e-4, 0.0),))
    assert [rising.turn(q, 0.0, 0.0) for q in (0.0, math.pi / 16, math.pi / 8, 3 * math.pi / 8)] == pytest.approx(
        [0.0, 1e-4, 2e-4, -2e-4], abs=1e-15
    )


def test_a_worn_place_ends_where_it_is_said_to_and_comes_again_after_a_turn() -> None:
    worn = JointTruth(bumps=((3.0, 0.2, 1e-4),))
    at = {q: worn.turn(q, 0.0, 0.0) for q in (3.0, 3.1, 3.3, 2.79, 3.0 - 2 * math.pi, -math.pi + 0.01)}
    assert at[3.0] == pytest.approx(1e-4)
    assert at[3.1] == pytest.approx(0.5e-4)
    assert at[3.3] == at[2.79] == 0.0
    assert at[3.0 - 2 * math.pi] == pytest.approx(1e-4)
    assert at[-math.pi + 0.01] == pytest.approx(0.5e-4 * (1.0 + math.cos(math.pi * (math.pi + 0.01 - 3.0) / 0.2)))


@pytest.mark.parametrize("name", DRAWN)
def test_the_arm_itself_is_that_of_a_random_truth_and_the_seed_decides_what_is_drawn(name: str) -> None:
    drawn, plain = twin(name, 4), twin("random", 4)
    assert drawn.robot.values == plain.robot.values
    q = plain.robot.random_configurations(50, np.random.default_rng(1))
    away = [drawn.frames(q)[t.name][:, :3, 3] - plain.frames(q)[t.name][:, :3, 3] for t in plain.robot.targets]
    assert 2e-5 < float(np.linalg.norm(away, axis=2).mean()) < 4e-4  # 0.011 deg at half a metre, of six joints
    assert twin(name, 1).joints == twin(name, 1).joints != twin(name, 2).joints


def test_a_joint_that_slides_has_no_gear() -> None:
    joints = (Joint("J1", "revolute", {"a": 0.3}), Joint("J2", "prismatic", {}))
    drawn = truth_twin(Robot("lift", "", "", "standard-dh", joints), "gear-errors", np.random.default_rng(0))
    assert drawn.joints[1].gear
    assert drawn.joints[2] == JointTruth()


def test_errors_are_drawn_without_the_models() -> None:
    text = Path(gear_errors.__file__).read_text()
    imports = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom)]
    names = {alias.name for node in imports if node.module and "engine.robot" in node.module for alias in node.names}
    assert names == {"Robot"}  # whose joints turn
