"""Inclinometer readings against a plumb line drawn by hand; their model against the twin and central differences."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.tilting import JOINTS, TRUTH, tilting_katana

from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint, Payload
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import JointTruth
from truearm.inclinometers.fit import inclination_derivatives, inclinations_of, link_ends
from truearm.inclinometers.pairs import inclinations

RNG = np.random.default_rng


def tilting_model(truth: Mapping[str, float] = TRUTH) -> Robot:
    return tilting_katana().robot.with_effects(("compliance", "backlash", "clearance")).with_values(truth)


@pytest.mark.parametrize("tilts", [False, True])
def test_readings_are_the_twins(tilts: bool) -> None:
    """To rounding without tilts; the model's loads are those before the shafts tilt, which turns them a little."""
    joints = {i: joint if tilts else replace(joint, clearance=0.0) for i, joint in JOINTS.items()}
    twin, rng = replace(tilting_katana(), joints=joints), RNG(0)
    robot = tilting_model({name: getattr(joints[int(name[-1])], name[:-2]) for name in TRUTH})
    q = robot.random_configurations(60, rng)
    wrench = np.pad(rng.normal(0.0, 20.0, (60, 3)), ((0, 0), (0, 3)))
    at = robot.loaded(Postures(q, wrench=wrench))
    assert at.loads is not None
    seated = np.abs(at.loads[:, 5]).min(axis=0) > 0.5  # else the model takes up less than all of the play
    assert seated.sum() > 20
    read = inclinations(twin, q, 0.0, rng, wrench=wrench)
    assert_allclose(inclinations_of(robot, at)[seated], read[seated], atol=5e-6 if tilts else 1e-8)
    assert np.abs(inclinations_of(load_robot("katana450"), q) - read).max() > 1e-3


def test_readings_of_other_robots_are_the_twins() -> None:
    rng = RNG(1)
    for name in ("irb120", "ur5", "puma560"):
        robot = load_robot(name)
        q = robot.random_configurations(5, rng)
        assert_allclose(inclinations_of(robot, q), inclinations(Twin(robot), q, 0.0, rng), atol=1e-7)
        assert link_ends(robot)[-1] <= len(robot.trunk.elements)


def test_derivatives_are_central_differences() -> None:
    rng, h = RNG(2), 1e-6
    robot = tilting_model()
    names = [*TRUTH, *(p.name for p in robot.parameters.values() if p.group in ("joint zero", "geometry"))]
    at = robot.loaded(Postures(robot.random_configurations(20, rng)))
    seats = np.zeros((5, 3))
    derivatives = inclination_derivatives(robot, at, names, seats)
    assert derivatives.shape == (20, 5, 3, len(names) + 15)
    usual = np.abs(inclinations_of(robot, at)) < 1.4

    def check(column: int, plus: Array, minus: Array) -> None:
        assert_allclose(derivatives[..., column][usual], ((plus - minus) / (2 * h))[usual], atol=3e-8, rtol=1e-6)

    for column, name in enumerate(names):
        value = robot.values[name]
        check(column, *(inclinations_of(robot.with_values({name: value + s * h}), at) for s in (1, -1)))
    for seat in range(15):
        turn = np.zeros(15)
        turn[seat] = h
        check(
            len(names) + seat,
            inclinations_of(robot, at, turn.reshape(5, 3)),
            inclinations_of(robot, at, -turn.reshape(5, 3)),
        )
    assert np.isfinite(derivatives).all()


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
