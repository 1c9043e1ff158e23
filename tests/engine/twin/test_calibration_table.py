"""A tip jogged onto points of a tilted table is there, the reading is the known point, and bad tables are refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.engine.robot.refusing import refused

from truearm.engine.fit.fit import place
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.engine.twin.devices.calibration_table import CalibrationTable, rectangular_grid
from truearm.engine.twin.twin import Twin, directions, measure
from truearm.engine.twin.twin_joint import JointTruth

GRID = rectangular_grid(4, 3, 0.04)
PLACE = Transform((0.3, 0.02, 0.15))
ELBOW_UP = np.radians((0.0, 60.0, -90.0))
ROLL, PITCH = math.radians(11.7), math.radians(11.8)


def arm() -> Robot:
    return load_robot("li3").with_frames(IDENTITY, {"tip": (0.0, 0.0, 0.0)})


def off(robot: Robot, rng: np.random.Generator) -> Robot:
    """Return the robot with 1 mm and 0.3 deg of error in every parameter of its links."""
    size = {"m": 1e-3, "rad": math.radians(0.3)}
    links = [p for p in robot.parameters.values() if p.group in ("geometry", "joint zero")]
    return robot.with_values({p.name: p.value + size[p.unit] * rng.choice((-1.0, 1.0)) for p in links})


def tips(twin: Twin, joints: Array, approach: Array | None = None) -> Array:
    conditions = {} if approach is None else {"approach": approach}
    return measure(twin, joints, 0.0, np.random.default_rng(0), **conditions).position  # type: ignore[arg-type]


def test_tilt_is_roll_about_x_and_then_pitch_about_the_new_y() -> None:
    points = CalibrationTable(np.array([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]), PLACE).tilted(ROLL, PITCH).in_world
    x = (math.cos(PITCH), math.sin(ROLL) * math.sin(PITCH), -math.cos(ROLL) * math.sin(PITCH))
    y = (0.0, math.cos(ROLL), math.sin(ROLL))
    np.testing.assert_allclose(points, np.array(PLACE.translation) + 0.1 * np.array([x, y]), atol=1e-15)


def test_readings_of_a_perfect_arm_are_those_of_the_triangle() -> None:
    # Shoulder 200 mm up and the arm in a plane 50 mm beside it, links of 220 and 230 mm.
    table = CalibrationTable(GRID, PLACE).tilted(ROLL, 0.0)
    joints = table.touched_by(Twin(arm()), ELBOW_UP, 0.0, np.random.default_rng(0)).joints
    x, y, z = table.in_world.T
    across, up = np.sqrt(x**2 + y**2 - 0.05**2), z - 0.2
    first = np.arctan2(y, x) + np.arctan2(0.05, across)
    third = -np.arccos((across**2 + up**2 - 0.22**2 - 0.23**2) / (2 * 0.22 * 0.23))
    second = np.arctan2(up, across) - np.arctan2(0.23 * np.sin(third), 0.22 + 0.23 * np.cos(third))
    np.testing.assert_allclose(joints, np.stack([first, second, third], axis=1), atol=1e-8)


@pytest.mark.parametrize("name", ["li3", "katana450", "irb120"])
def test_any_arm_touches_though_it_errs_sags_and_plays(name: str) -> None:
    rng = np.random.default_rng(1)
    robot = load_robot(name).with_frames(IDENTITY, {"tip": (0.0, 0.0, 0.02)})
    joints = {number: JointTruth(compliance=1e-4, hysteresis=2e-3) for number in (1, 2, 3)}
    twin = Twin(off(robot, rng), joints)
    start = np.radians((10.0, 60.0, -90.0, 20.0, 30.0, 0.0)[: len(robot.joints)])
    if name == "irb120":
        start = np.radians((10.0, 20.0, 10.0, 20.0, 30.0, 0.0))
    table = CalibrationTable(
        rectangular_grid(3, 2, 0.02), Transform(tuple(robot.world_poses(start[None], "tip")[0][0]))
    )
    data = table.tilted(ROLL, -PITCH).touched_by(twin, start, 0.0, rng)
    assert data.approach is not None
    there = tips(twin, data.joints, data.approach)
    np.testing.assert_allclose(there, table.tilted(ROLL, -PITCH).in_world, atol=2e-10)
    np.testing.assert_array_equal(data.position, table.points)
    assert data.sigma is None


def test_play_lies_as_the_order_of_points_says_or_as_told() -> None:
    play = math.radians(1.0)
    twin = Twin(arm(), {number: JointTruth(hysteresis=play) for number in (1, 2, 3)})
    table, rng = CalibrationTable(GRID, PLACE), np.random.default_rng(0)
    perfect = table.touched_by(Twin(arm()), ELBOW_UP, 0.0, rng).joints
    in_order = table.touched_by(twin, ELBOW_UP, 0.0, rng)
    np.testing.assert_allclose(in_order.joints, perfect - play * directions(perfect), atol=1e-8)
    told = table.touched_by(twin, ELBOW_UP, 0.0, rng, approach=np.ones(perfect.shape))
    np.testing.assert_allclose(told.joints, perfect - play, atol=1e-8)


def test_noise_is_where_the_tip_is_and_is_declared() -> None:
    noise = 2e-4
    table = CalibrationTable(rectangular_grid(12, 12, 0.01), PLACE)
    data = table.touched_by(Twin(arm()), ELBOW_UP, noise, np.random.default_rng(3))
    np.testing.assert_array_equal(data.position, table.points)
    np.testing.assert_array_equal(data.sigma, np.full(144, noise))
    missed = tips(Twin(arm()), data.joints) - table.in_world
    assert missed.std() == pytest.approx(noise, rel=4 / math.sqrt(2 * missed.size))


def test_roll_and_pitch_against_the_robot_are_base_parameters() -> None:
    table = CalibrationTable(GRID, PLACE).tilted(ROLL, PITCH)
    data = table.touched_by(Twin(arm()), ELBOW_UP, 0.0, np.random.default_rng(0))
    base = place(load_robot("li3"), data).base  # T_table_base
    np.testing.assert_allclose(base.rotation.T, table.place.rotation, atol=1e-7)
    np.testing.assert_allclose(-base.rotation.T @ np.array(base.translation), PLACE.translation, atol=1e-7)


def test_points_out_of_reach_or_beyond_limits_are_named() -> None:
    points, rng = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]), np.random.default_rng(0)
    with refused("point 2: the tip does not come to rest", "mm away"):
        CalibrationTable(points, PLACE).touched_by(Twin(arm()), ELBOW_UP, 0.0, rng)
    behind = CalibrationTable(np.array([[-0.55, -0.12, 0.1]]), PLACE)
    with refused("point 1: a joint would leave its limits", "joint_1 at", "-120 to 120 deg"):
        behind.touched_by(Twin(arm()), np.radians((-150.0, 60.0, -90.0)), 0.0, rng)


def test_a_roll_beyond_the_ball_joint_is_refused_and_a_pitch_is_not() -> None:
    table = CalibrationTable(GRID, PLACE)
    for roll in (math.radians(25.0), math.nan):
        with refused("rolled so far", "-20 to 20 deg"):
            table.tilted(roll, 0.0)
    assert table.tilted(0.0, math.radians(60.0)).place != table.place


def test_points_grids_and_targets_that_are_none_are_refused() -> None:
    for points in (np.zeros((0, 3)), np.zeros((4, 2)), np.array([[0.0, math.nan, 0.0]])):
        with refused("calibration table", of=points):
            CalibrationTable(points)
    for columns, rows, spacing in ((0, 3, 0.01), (3, 0, 0.01), (3, 3, 0.0), (3, 3, math.nan)):
        with refused("a grid needs columns, rows and space", of=(columns, rows, spacing)):
            rectangular_grid(columns, rows, spacing)
    twin = Twin(arm().with_frames(IDENTITY, {"1": (0.0, 0.0, 0.0), "2": (0.0, 0.0, 0.1)}))
    with refused("one target touches the table", "2 targets"):
        CalibrationTable(GRID, PLACE).touched_by(twin, ELBOW_UP, 0.0, np.random.default_rng(0))


def test_a_grid_lies_about_its_middle() -> None:
    grid = rectangular_grid(3, 2, 0.01)
    np.testing.assert_allclose(grid[:, 0] * 1e3, [-10, 0, 10, -10, 0, 10], atol=1e-12)
    np.testing.assert_allclose(grid[:, 1] * 1e3, [-5, -5, -5, 5, 5, 5], atol=1e-12)
    assert not grid[:, 2].any()
