"""A tip jogged onto points of a tilted table is there, the reading is the known point, and bad tables are refused."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.expecting import refusing

from papers.katana.robot import katana, published
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.fit.fit import identify, place
from truearm.engine.fit.models import MODELS
from truearm.engine.fit.problem import gauge_freedoms
from truearm.engine.fit.start_values import start_from_readings
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.calibration_table import CalibrationTable, rectangular_grid
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.devices.pencil import DRAWN_CIRCLE
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
    touched = tips(twin, data.joints, data.approach)
    np.testing.assert_allclose(touched, table.tilted(ROLL, -PITCH).in_world, atol=2e-10)
    np.testing.assert_array_equal(data.position, table.points)
    assert data.sigma is None


def test_play_lies_as_the_order_of_points_says_or_as_told() -> None:
    play = math.radians(1.0)
    twin = Twin(arm(), {number: JointTruth(hysteresis=play) for number in (1, 2, 3)})
    table, rng = CalibrationTable(GRID, PLACE), np.random.default_rng(0)
    perfect = table.touched_by(Twin(arm()), ELBOW_UP, 0.0, rng).joints
    in_order = table.touched_by(twin, ELBOW_UP, 0.0, rng)
    np.testing.assert_allclose(in_order.joints, perfect - play * directions(perfect), atol=1e-8)
    stated = table.touched_by(twin, ELBOW_UP, 0.0, rng, approach=np.ones(perfect.shape))
    np.testing.assert_allclose(stated.joints, perfect - play, atol=1e-8)


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
    with refusing("point 2: the tip does not come to rest", "mm away"):
        CalibrationTable(points, PLACE).touched_by(Twin(arm()), ELBOW_UP, 0.0, rng)
    behind = CalibrationTable(np.array([[-0.55, -0.12, 0.1]]), PLACE)
    with refusing("point 1: a joint would leave its limits", "joint_1 at", "-120 to 120 deg"):
        behind.touched_by(Twin(arm()), np.radians((-150.0, 60.0, -90.0)), 0.0, rng)


def test_a_roll_beyond_the_ball_joint_is_refused_and_a_pitch_is_not() -> None:
    table = CalibrationTable(GRID, PLACE)
    for roll in (math.radians(25.0), math.nan):
        with refusing("rolled so far", "-20 to 20 deg"):
            table.tilted(roll, 0.0)
    assert table.tilted(0.0, math.radians(60.0)).place != table.place


def test_points_grids_and_targets_that_are_none_are_refused() -> None:
    for points in (np.zeros((0, 3)), np.zeros((4, 2)), np.array([[0.0, math.nan, 0.0]])):
        with refusing("calibration table", of=points):
            CalibrationTable(points)
    for columns, rows, spacing in ((0, 3, 0.01), (3, 0, 0.01), (3, 3, 0.0), (3, 3, math.nan)):
        with refusing("a grid needs columns, rows and space", of=(columns, rows, spacing)):
            rectangular_grid(columns, rows, spacing)
    twin = Twin(arm().with_frames(IDENTITY, {"1": (0.0, 0.0, 0.0), "2": (0.0, 0.0, 0.1)}))
    with refusing("one target touches the table", "2 targets"):
        CalibrationTable(GRID, PLACE).touched_by(twin, ELBOW_UP, 0.0, np.random.default_rng(0))


def test_a_grid_lies_about_its_middle() -> None:
    grid = rectangular_grid(3, 2, 0.01)
    np.testing.assert_allclose(grid[:, 0] * 1e3, [-10, 0, 10, -10, 0, 10], atol=1e-12)
    np.testing.assert_allclose(grid[:, 1] * 1e3, [-5, -5, -5, 5, 5, 5], atol=1e-12)
    assert not grid[:, 2].any()


# -- the drawn circle: what it reads of a twin, and what a calibration makes of that

GEOMETRIC = next(model for model in MODELS if model.name == "geometric")
STANDS = Transform((1.0, -0.4, 0.3), (0.8, 0.0, 0.6, 0.0))


def drawn(robot: Twin, count: int, seed: int = 0, sigma: float | None = 0.0) -> Dataset:
    return measured_with(DRAWN_CIRCLE, katana(), robot, count, np.random.default_rng(seed), sigma)


@cache
def exactly_drawn(seed: int) -> tuple[Twin, Dataset]:
    """Return a robot and what it drew, without noise."""
    truth = Twin(published("standard").with_frames(STANDS, {}))
    return truth, drawn(truth, 72, seed)


def test_a_perfect_robot_draws_the_circle_on_every_page() -> None:
    assert named_device("drawn-circle") is DRAWN_CIRCLE
    perfect = drawn(Twin(katana().with_frames(STANDS, {})), 30)
    others = [load_robot(name) for name in ("ur5", "kr5", "irb120")]
    rng = np.random.default_rng(0)
    for data in (perfect, *(measured_with(DRAWN_CIRCLE, robot, Twin(robot), 12, rng, 0.0) for robot in others)):
        assert data.distance is not None
        assert data.height is not None
        assert data.distance[::2] == pytest.approx(DRAWN_CIRCLE.radius, abs=1e-9)
        assert data.height[1::2] == pytest.approx(0.0, abs=1e-9)
        assert np.isnan(data.distance[1::2]).all()
        assert np.isnan(data.height[::2]).all()
    assert perfect.configurations == 30


def test_each_circle_is_one_way_round_a_page_in_one_posture() -> None:
    """Places of the pencil by the nominal robot: six circles of twelve points, two on each of three slopes."""
    robot = katana().with_frames(STANDS, {"pencil": (0.02, 0.01, 0.15)})
    data = drawn(Twin(robot), 72)
    places = robot.world_poses(data.joints, "pencil")[0].reshape(6, 12, 3)
    opposite = np.linalg.norm(places - np.roll(places, 1, axis=1), axis=2)
    assert opposite == pytest.approx(2 * DRAWN_CIRCLE.radius * np.sin(np.pi / 12), abs=1e-9)
    up = STANDS.rotation[:, 2]
    normals = np.array([np.cross(p[1] - p[0], p[2] - p[0]) for p in places])
    slopes = np.arccos(normals @ up / np.linalg.norm(normals, axis=1))
    assert slopes == pytest.approx(np.tile(DRAWN_CIRCLE.slopes, 2))
    moves = np.abs(np.diff(data.joints.reshape(6, 12, -1), axis=1))
    assert moves.max() < 1.5
    assert np.abs(data.joints[0] - data.joints[36]).max() > 0.05  # the second circle of the page: another posture
    low, high = np.array([joint.limits for joint in robot.joints]).T
    assert ((data.joints > low) & (data.joints < high)).all()


def test_what_is_read_is_where_the_true_pencil_is() -> None:
    """Distance and height of the twin's tip over the first page, by hand."""
    truth = Twin(published("standard").with_frames(STANDS, {"pencil": (0.02, 0.01, 0.15)}))
    device = replace(DRAWN_CIRCLE, centre=(0.0, -0.3, 0.14), slopes=(np.deg2rad(45.0),), circles=1)
    nominal = katana().with_frames(STANDS, {"pencil": (0.02, 0.01, 0.15)})
    data = device.campaign(nominal, truth, 12, 0.0, np.random.default_rng(1))
    tip = (truth.frames(data.joints)["pencil"][:, :3, 3] - STANDS.translation) @ STANDS.rotation - (0.0, -0.3, 0.14)
    height = tip @ np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0)  # rises away from the robot, which is towards -y
    assert data.distance is not None
    assert data.height is not None
    assert data.height[1::2] == pytest.approx(height, abs=1e-12)
    assert data.distance[::2] == pytest.approx(np.linalg.norm(tip, axis=1), abs=1e-12)
    assert np.abs(height).max() > 5e-5


def test_a_file_keeps_that_the_middle_of_each_circle_is_in_its_page(tmp_path: Path) -> None:
    data = drawn(Twin(katana().with_frames(STANDS, {})), 24)
    path = tmp_path / "drawn.csv"
    path.write_text(csv_text(data))
    again = read_csv(path)
    assert again.setup is not None
    assert again.setup.height == pytest.approx(0.0)
    assert [again.setup.fixtures[f] for f in again.setup.against.tolist()] == ["paper_1", "paper_2"]
    assert [again.setup.targets[t] for t in again.setup.target.tolist()] == ["centre_1", "centre_2"]
    assert again.distance is not None
    assert again.distance[::2] == pytest.approx(DRAWN_CIRCLE.radius)


def test_readings_scatter_as_they_declare() -> None:
    robot = Twin(katana().with_frames(STANDS, {}))
    data = drawn(robot, 300, sigma=None)
    assert data.distance is not None
    assert data.height is not None
    assert data.sigma == pytest.approx(DRAWN_CIRCLE.sigma)
    off = (data.distance[::2] - DRAWN_CIRCLE.radius, data.height[1::2])
    assert [float(np.std(o)) for o in off] == pytest.approx([DRAWN_CIRCLE.sigma] * 2, rel=0.15)


def test_without_noise_the_true_robot_is_found() -> None:
    """Up to a rigid motion; seed 3 has pages whose heights alone would be explained from below as well."""
    for seed in (0, 3):
        truth, data = exactly_drawn(seed)
        fit = identify(katana(), data, GEOMETRIC, redundancy="drop")
        assert fit.unobservable == ()
        assert max(fit.sigma.values()) < 1e-8
        for name in ("a_3", "a_4", "theta_offset_2", "theta_offset_3", "beta_3"):
            assert fit.robot.values[name] == pytest.approx(truth.robot.values[name], abs=1e-7), (seed, name)
        assert gauge_freedoms(data) == ("base",)


def test_pages_start_with_the_pencil_above_them() -> None:
    """Heights of a robot that was led along a page are its errors: they say nothing of which side it is on."""
    for seed in (1, 3):
        start = start_from_readings(katana(), exactly_drawn(seed)[1])
        up = [float(start.fixture_kinematics(f"paper_{k}").matrix()[0][2, 2]) for k in (1, 2, 3)]
        assert up == pytest.approx(np.cos(DRAWN_CIRCLE.slopes), abs=0.1), seed
        middles = np.array([[start.values[f"fixture_centre_{k}_{a}"] for a in "xyz"] for k in range(1, 7)])
        assert np.abs(middles - middles.mean(axis=0)).max() < 0.02, seed


def test_a_circle_that_no_arm_comes_round_is_refused() -> None:
    robot = Twin(katana())
    device = replace(DRAWN_CIRCLE, radius=0.45, circles=1)
    with pytest.raises(InputError, match=r"katana450 (cannot follow|does not reach)"):
        measured_with(device, katana(), robot, 3, np.random.default_rng(0))
