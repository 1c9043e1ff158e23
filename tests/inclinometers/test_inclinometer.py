"""Inclinometer readings against a plumb line drawn by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint, Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import JointTruth
from truearm.inclinometers.pairs import inclinations

RNG = np.random.default_rng


def planar(payload: float) -> Robot:
    joints = tuple(Joint(f"J{i}", "revolute", {"a": 0.5}) for i in (1, 2))
    arm = Robot("planar", "", "", "standard-dh", joints, payload=Payload(payload), gravity=(0.0, -9.80665, 0.0))
    return arm.with_frames(Transform(), {"tip": (0.0, 0.0, 0.0)})


def test_each_link_reads_how_far_its_axes_point_up() -> None:
    read = inclinations(Twin(planar(0.0)), np.array([[0.3, 0.4], [-0.2, 1.0]]), 0.0, RNG(0))
    x = np.array([[0.3, 0.7], [-0.2, 0.8]])
    assert_allclose(read, np.stack([x, math.pi / 2 - np.abs(x), 0 * x], axis=-1), atol=1e-7)
    assert_allclose(read[..., 0], x, atol=1e-14)


def test_a_turn_of_the_table_is_not_seen_and_neither_is_a_compass() -> None:
    rng = RNG(1)
    robot = load_robot("katana450")
    q = robot.random_configurations(5, rng)
    turned = robot.with_frames(Transform((1.0, 2.0, 3.0), (0.6, 0.0, 0.8, 0.0)), {})
    read = inclinations(Twin(robot), q, 0.0, rng)
    assert np.array_equal(inclinations(Twin(turned), q, 0.0, rng), read)
    assert_allclose(inclinations(Twin(robot), q + np.eye(5)[0], 0.0, rng), read, atol=1e-12)


def test_the_plumb_line_in_each_link_comes_back() -> None:
    rng = RNG(2)
    robot = replace(load_robot("irb120"), gravity=(1.0, -2.0, 9.0))
    q = robot.random_configurations(4, rng)
    plumb = -np.sin(inclinations(Twin(robot), q, 0.0, rng))
    assert_allclose(np.linalg.norm(plumb, axis=-1), 1.0, rtol=1e-12)
    down = np.array(robot.gravity) / math.sqrt(86)
    assert_allclose(plumb[:, 5], robot.world_poses(q)[1].swapaxes(1, 2) @ down, atol=1e-12)


def test_a_reversal_of_the_load_shows_gap_and_stiffness() -> None:
    gap, c = 1e-3, 1e-4
    twin = Twin(planar(2.0), {2: JointTruth(compliance=c, backlash=gap)})
    q = np.array([[0.0, 0.5]])
    lift = np.array([[0.0, 50.0, 0.0, 0.0, 0.0, 0.0]])
    change = inclinations(twin, q, 0.0, RNG(0), wrench=lift) - inclinations(twin, q, 0.0, RNG(0))
    assert_allclose(change[0, 0], 0.0, atol=1e-15)  # the link before the joint stays
    assert change[0, 1, 0] == pytest.approx(gap + c * 50 * 0.5 * math.cos(0.5), rel=1e-3)


def test_resolution_and_noise() -> None:
    robot = load_robot("katana450")
    q = robot.random_configurations(100, RNG(3))
    step = math.radians(0.001)
    exact = inclinations(Twin(robot), q, 0.0, RNG(0))
    coarse = inclinations(Twin(robot), q, 0.0, RNG(0), step)
    assert_allclose(coarse / step, np.round(coarse / step), atol=1e-6)
    assert 0.4 * step < np.abs(coarse - exact).max() <= 0.5 * step * (1 + 1e-9)
    noisy = inclinations(Twin(robot), q, 1e-4, RNG(0)) - exact
    assert noisy.std() == pytest.approx(1e-4, rel=0.1)
