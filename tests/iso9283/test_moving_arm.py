"""The arm in motion stands where the digital twin stands, sags, warms up and gives way as the twin does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.transform import IDENTITY, Transform, homogeneous, rotation_from_vector, rotation_vector
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin
from truearm.iso9283.simulating.moving_arm import (
    DRIVES,
    WARMING,
    Commands,
    MovingArm,
    Pace,
    Servo,
    along_circle,
    along_lines,
    drawn_compliance,
    joint_move,
    last_moves,
)

ROBOT = load_robot("irb120")
TIP = Transform((0.05, 0.02, 0.1))
JOINTS = np.radians([[10.0, 20.0, -10.0, 20.0, 50.0, 30.0], [-20.0, 40.0, 0.0, -30.0, 60.0, 0.0]])
LOAD = Payload(3.0, TIP.translation)
EVER = np.full(2, np.inf)


@pytest.fixture(scope="module")
def twin() -> Twin:
    return truth_twin(ROBOT, "tracker-triangular", np.random.default_rng(0))


@pytest.fixture(scope="module")
def arm(twin: Twin) -> MovingArm:
    return MovingArm(ROBOT, None, twin, TIP, LOAD, replace(DRIVES, play=0.0))


def plain(twin: Twin, payload: Payload) -> Twin:
    robot = twin.robot.with_frames(twin.robot.base, {"tip": TIP, "flange": IDENTITY})
    return replace(twin, robot=replace(robot, payload=payload))


def test_an_arm_at_rest_stands_where_the_twin_stands(arm: MovingArm, twin: Twin) -> None:
    frames = plain(twin, LOAD).frames(JOINTS, approach=np.zeros((2, 6)))["tip"]
    np.testing.assert_allclose(arm.at_rest(JOINTS, np.zeros((2, 6)), EVER), frames, atol=1e-12)


def test_a_load_lowers_the_tip_as_the_twin_says(arm: MovingArm, twin: Twin) -> None:
    empty = replace(arm, payload=Payload())
    none = np.zeros((2, 6))
    sagged = (arm.at_rest(JOINTS, none, EVER) - empty.at_rest(JOINTS, none, EVER))[:, :3, 3]
    of_twin = [plain(twin, load).frames(JOINTS, approach=none)["tip"][:, :3, 3] for load in (LOAD, Payload())]
    np.testing.assert_allclose(sagged, of_twin[0] - of_twin[1], atol=1e-12)
    assert (sagged[:, 2] < -1e-5).all()


def test_a_push_at_the_tip_moves_it_by_the_compliance_of_the_joints(arm: MovingArm, twin: Twin) -> None:
    joints, none = JOINTS[:1], np.zeros((1, 6))
    force = np.array([[0.0, 1.0, 0.0]])
    working = np.array([np.inf])
    moved = (arm.at_rest(joints, none, working, force) - arm.at_rest(joints, none, working, -force))[0, :3, 3] / 2
    base = twin.robot.base.rotation
    J = np.empty((3, 6))
    for j in range(6):
        step = 1e-6 * np.eye(6)[j : j + 1]
        J[:, j] = (arm.at_rest(joints + step, none, working) - arm.at_rest(joints - step, none, working))[0, :3, 3]
    J = base.T @ J / 2e-6
    compliance = np.array([twin.joints[k].compliance if k in twin.joints else 0.0 for k in range(1, 7)])
    expected = base @ (J * compliance) @ J.T @ force[0]
    # What the arm carries turns with it: that is the rest of a few thousandths.
    np.testing.assert_allclose(moved, expected, rtol=5e-3, atol=1e-9)
    assert np.linalg.norm(moved) > 1e-6


def test_a_cold_arm_is_shorter_and_grows_with_its_time_constant(arm: MovingArm) -> None:
    working = np.array([0.0, WARMING.time, np.inf])
    place = arm.at_rest(np.repeat(JOINTS[:1], 3, axis=0), np.zeros((3, 6)), working)[:, :3, 3]
    short, later = (np.linalg.norm(place[k] - place[2]) for k in (0, 1))
    assert 2e-5 < short < 1e-4
    assert later / short == pytest.approx(np.exp(-1.0), rel=2e-3)


def test_play_depends_on_where_the_joints_came_from(arm: MovingArm) -> None:
    loose = replace(arm, drives=replace(DRIVES, play=1e-4))
    ways = np.zeros((2, 6))
    ways[:, 0] = [1.0, -1.0]
    place = loose.at_rest(np.repeat(JOINTS[:1], 2, axis=0), ways, EVER)[:, :3, 3]
    axis = arm.twin.robot.base.rotation[:, 2]
    lever = np.linalg.norm(np.cross(place[0] - np.array(arm.twin.robot.base.translation), axis))
    assert np.linalg.norm(place[0] - place[1]) == pytest.approx(2e-4 * lever, rel=1e-2)


def test_a_motion_ends_where_the_arm_then_stands(arm: MovingArm) -> None:
    share = np.linspace(0.0, 1.0, 400)[:, None]
    command = JOINTS[0] + share * (JOINTS[1] - JOINTS[0])
    ways = np.sign(JOINTS[1:] - JOINTS[:1])
    ends = [arm.at_rest(joints[None], ways, EVER[:1])[0, :3, 3] for joints in JOINTS]
    for rate in (250.0, 2000.0):
        motion = arm.in_motion(command, 1e-3, np.arange(-0.1, 1.5, 1 / rate), np.inf)
        np.testing.assert_allclose(motion.position[[0, -1]], ends, atol=1e-9, err_msg=str(rate))


def test_a_fast_stream_agrees_with_a_slow_one(arm: MovingArm) -> None:
    share = (1 - np.cos(np.linspace(0.0, np.pi, 500)))[:, None] / 2
    command = JOINTS[0] + share * (JOINTS[1] - JOINTS[0])
    slow = arm.in_motion(command, 1e-3, 4e-3 * np.arange(250.0), np.inf)
    fast = arm.in_motion(command, 1e-3, 5e-4 * np.arange(1997.0), np.inf)
    np.testing.assert_allclose(fast.position[::8], slow.position, atol=2e-6)
    np.testing.assert_allclose(fast.quaternion[::8], slow.quaternion, atol=2e-6)


def test_joints_a_little_elsewhere_move_the_tip_as_the_twin_does(arm: MovingArm) -> None:
    command, time = np.repeat(JOINTS[:1], 3, axis=0), np.array([0.0])
    off = 1e-5 * np.array([1.0, -1.0, 0.5, 0.3, -0.2, 0.1])
    position, _ = arm.in_motion(command, 1e-3, time, np.inf).with_offset(off)
    expected = arm.at_rest(JOINTS[:1] + off, np.zeros((1, 6)), EVER[:1])[:, :3, 3]
    # The tip lies beyond the commanded flange, so that its offsets have another lever by a tenth of a metre.
    np.testing.assert_allclose(position, expected, atol=2e-6)


def test_commands_are_those_of_the_nominal_robot(arm: MovingArm) -> None:
    position, rotation = ROBOT.forward(JOINTS)
    frames = homogeneous(rotation, position)
    np.testing.assert_allclose(arm.joints_for(frames, JOINTS), JOINTS, atol=1e-9)
    with pytest.raises(InputError, match="the robot cannot come to a commanded pose"):
        arm.joints_for(homogeneous(rotation, position + np.array([3.0, 0.0, 0.0])), JOINTS)
    with pytest.raises(InputError, match="this truth has other joints than katana450"):
        MovingArm(load_robot("katana450"), None, arm.twin, TIP, LOAD)


def test_the_direction_of_the_last_move_is_kept_at_rest() -> None:
    joints = np.array([[0.0, 1.0], [0.0, 0.5], [0.2, 0.5], [0.2, 0.5], [0.1, 0.6]])
    np.testing.assert_array_equal(last_moves(joints), [[1, -1], [1, -1], [1, -1], [1, -1], [-1, 1]])


SOFT = (2e-5, 3e-5, 4e-5, 2e-4, 2e-4, 3e-4)


def test_a_rigid_truth_gives_way_to_pushes_alone() -> None:
    rigid = MovingArm(ROBOT, None, truth_twin(ROBOT, "nominal", np.random.default_rng(0)), TIP, LOAD)
    soft = replace(rigid, compliance=SOFT)
    still = np.zeros_like(JOINTS)
    np.testing.assert_array_equal(soft.at_rest(JOINTS, still, EVER), rigid.at_rest(JOINTS, still, EVER))
    force = np.array([[0.0, 0.0, 20.0], [15.0, -5.0, 0.0]])
    np.testing.assert_allclose(
        rigid.at_rest(JOINTS, still, EVER, force), rigid.at_rest(JOINTS, still, EVER), atol=1e-12
    )
    moved = soft.at_rest(JOINTS, still, EVER, force) - rigid.at_rest(JOINTS, still, EVER)
    # What the moments of the force turn the joints by, through the Jacobian of the tip.
    J = ROBOT.with_frames(ROBOT.base, {"tip": TIP}).jacobian(JOINTS, frame="base", target="tip")[:, :3]
    expected = np.einsum("nij,j,nkj,nk->ni", J, np.array(SOFT), J, force)
    np.testing.assert_allclose(moved[:, :3, 3] @ soft.twin.robot.base.rotation, expected, rtol=0.02, atol=2e-6)


def test_a_truth_that_gives_way_keeps_its_own_compliance(arm: MovingArm) -> None:
    force = np.array([[0.0, 0.0, 20.0]])
    still = np.zeros((1, 6))
    other = replace(arm, compliance=SOFT)
    first, second = (moving.at_rest(JOINTS[:1], still, EVER[:1], force) for moving in (arm, other))
    np.testing.assert_array_equal(first, second)


def test_joints_give_way_as_those_of_real_robots_do() -> None:
    drawn = np.array([drawn_compliance(ROBOT, 30.0, 0.6, np.random.default_rng(seed)) for seed in range(200)])
    middle = np.exp(np.log(drawn).mean(axis=0))
    np.testing.assert_allclose(middle[:3], 3e-4 / 18.0, rtol=0.1)
    np.testing.assert_allclose(middle[3:], 1.2e-3 / 18.0, rtol=0.1)
    assert drawn.min() > 3e-4 / 18.0 / 5
    # The published ones lie in the same range (Nubiola, Table 2.7: 3e-5 and 1.3e-4, wrist 4e-4 to 6e-4).
    assert drawn[:, :3].max() > 3e-5
    katana = load_robot("katana450")
    assert len(drawn_compliance(katana, 4.0, 0.3, np.random.default_rng(0))) == len(katana.joints)


STEP = 1e-3
CORNER = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.3, 0.2, 0.0]])


def unturned(points: np.ndarray) -> np.ndarray:
    return np.broadcast_to(np.eye(3), (len(points), 3, 3))


def rates(commands: Commands) -> tuple[float, float]:
    """Return the largest speed and acceleration."""
    velocity = np.diff(commands.position, axis=0) / STEP
    change = np.diff(velocity, axis=0) / STEP
    return float(np.linalg.norm(velocity, axis=1).max()), float(np.linalg.norm(change, axis=1).max())


@pytest.mark.parametrize("zone", [0.001, 0.01])
def test_a_corner_is_cut_within_its_zone_at_the_known_distance(zone: float) -> None:
    commands = along_lines(CORNER, unturned(CORNER), Pace(0.5, 10.0, zone), 1e-4)
    away = np.linalg.norm(commands.position - CORNER[1], axis=1)
    assert away.min() == pytest.approx(zone * math.sqrt(2) / 4, rel=1e-3)
    off = np.minimum(np.abs(commands.position[:, 1]), np.abs(commands.position[:, 0] - 0.3))
    assert off[away > zone + 1e-9].max() < 1e-15
    speed = np.linalg.norm(np.diff(commands.position, axis=0), axis=1) / 1e-4
    assert speed[int(np.argmin(away)) - 1] == pytest.approx(math.sqrt(zone * 10.0 * math.sqrt(2) / 2), rel=1e-2)


def test_velocity_and_acceleration_are_kept_and_the_ends_met() -> None:
    commands = along_lines(CORNER, unturned(CORNER), Pace(0.5, 10.0, 0.005), STEP)
    speed, change = rates(commands)
    assert speed == pytest.approx(0.5, abs=1e-9)
    assert change <= 10.0 + 1e-6
    np.testing.assert_allclose(commands.position[[0, -1]], CORNER[[0, -1]], atol=1e-12)


def test_without_a_zone_it_stops_in_the_corner() -> None:
    commands = along_lines(CORNER, unturned(CORNER), Pace(0.5, 10.0), 1e-4)
    away = np.linalg.norm(commands.position - CORNER[1], axis=1)
    assert away.min() < 1e-6
    duration = sum(length / 0.5 + 0.5 / 10.0 for length in (0.3, 0.2))
    assert commands.time[-1] == pytest.approx(duration, abs=1e-4)


def test_many_short_lines_are_slowed_down_for_ahead() -> None:
    points = np.column_stack([0.002 * np.arange(40), 0.002 * (np.arange(40) % 2), np.zeros(40)])
    speed, change = rates(along_lines(points, unturned(points), Pace(1.0, 5.0, 0.0005), STEP))
    assert speed < 0.2
    assert change <= 5.0 + 1e-6


def test_an_orientation_turns_with_the_distance_and_alternates() -> None:
    points = np.column_stack([np.linspace(0.0, 0.4, 5), np.zeros(5), np.zeros(5)])
    turned = rotation_from_vector(np.array([[0.2 * (k % 2), 0.0, 0.0] for k in range(5)]))
    commands = along_lines(points, turned, Pace(0.5, 10.0, 0.002, turning_acceleration=1e4), STEP)
    angle = rotation_vector(commands.rotation)[:, 0]
    x = commands.position[:, 0]
    wanted = 0.2 * (1 - np.abs(1 - x / 0.1 % 2))
    away = np.abs(x[:, None] - points[:, 0]).min(axis=1) > 0.002
    np.testing.assert_allclose(angle[away], wanted[away], atol=1e-12)
    assert np.abs(angle - wanted).max() == pytest.approx(0.002 * 2.0 / 2, rel=0.05)
    assert np.abs(np.diff(angle)).max() / STEP == pytest.approx(1.0, rel=1e-6)


def test_a_turn_too_fast_slows_the_path_down() -> None:
    points = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])
    turned = rotation_from_vector(np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    speed, _ = rates(along_lines(points, turned, Pace(1.0, 10.0, turning=2.0), STEP))
    assert speed == pytest.approx(0.2, rel=1e-6)


def test_a_circle_is_run_once_with_the_acceleration_kept() -> None:
    pace = Pace(2.0, 10.0)
    commands = along_circle(np.zeros(3), np.array([0.1, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.eye(3), pace, STEP)
    np.testing.assert_allclose(np.linalg.norm(commands.position, axis=1), 0.1, atol=1e-14)
    assert rates(commands)[0] == pytest.approx(math.sqrt(10.0 * 0.1), rel=1e-4)
    angle = np.unwrap(np.arctan2(commands.position[:, 1], commands.position[:, 0]))
    assert angle[-1] == pytest.approx(2 * math.pi, abs=1e-12)
    assert (np.diff(angle) >= 0).all()


def test_a_move_of_joints_begins_and_ends_together_within_its_limits() -> None:
    start, end = np.array([0.1, 0.2, 0.3]), np.array([0.7, 0.1, 0.3])
    joints = joint_move(start, end, 1.0, 4.0, STEP)
    np.testing.assert_allclose(joints[[0, -1]], [start, end], atol=1e-12)
    velocity = np.diff(joints, axis=0) / STEP
    assert np.abs(velocity).max() == pytest.approx(1.0, rel=1e-9)
    assert np.abs(np.diff(velocity, axis=0) / STEP).max() <= 4.0 + 1e-6
    np.testing.assert_allclose(velocity[:, 1], velocity[:, 0] * -0.1 / 0.6, atol=1e-9)
    assert joint_move(start, start, 1.0, 4.0, STEP).shape == (1, 3)


def test_paths_and_paces_that_cannot_be_are_refused() -> None:
    twice = CORNER[[0, 0, 1]]
    with pytest.raises(InputError, match="neighbouring points of a path must be apart"):
        along_lines(twice, unturned(twice), Pace(0.5), STEP)
    with pytest.raises(InputError, match="a circle must have a radius"):
        along_circle(np.zeros(3), np.zeros(3), np.array([0.0, 0.0, 1.0]), np.eye(3), Pace(0.5), STEP)
    with pytest.raises(InputError, match="it must be a positive number"):
        Pace(0.0)
    with pytest.raises(InputError, match="a radius cannot be negative"):
        Pace(1.0, zone=-1.0)


PERIOD = 2e-3


def test_a_step_overshoots_as_the_closed_form_says() -> None:
    w, d = 40.0, 0.3
    time = PERIOD * np.arange(600.0)
    position, velocity = Servo(w, d).follow(np.ones((600, 2)), PERIOD, np.zeros(2))
    turn = w * math.sqrt(1 - d * d)
    expected = 1 - np.exp(-d * w * time) * (np.cos(turn * time) + d * w / turn * np.sin(turn * time))
    np.testing.assert_allclose(position, np.stack([expected] * 2, axis=1), atol=1e-13)
    np.testing.assert_allclose(velocity[:, 0], w * w / turn * np.exp(-d * w * time) * np.sin(turn * time), atol=1e-11)
    peak = int(np.argmax(position[:, 0]))
    assert abs(time[peak] - math.pi / turn) <= PERIOD
    assert position[peak, 0] - 1 == pytest.approx(math.exp(-math.pi * d / math.sqrt(1 - d * d)), rel=5e-3)


@pytest.mark.parametrize("damping", [0.2, 1.0, 2.5])
def test_steps_added_up_and_step_by_step_are_one_motion(damping: float) -> None:
    command = np.cumsum(np.random.default_rng(0).normal(0.0, 1e-3, (500, 3)), axis=0)
    servo = Servo(30.0, damping, feedforward=0.6)
    at_once = servo.follow(command, PERIOD, np.array([0.1, 0.0, -0.1]))
    one_by_one = servo._limited(command, PERIOD, np.array([0.1, 0.0, -0.1]))
    np.testing.assert_allclose(at_once, one_by_one, atol=1e-12)


@pytest.mark.parametrize(("share", "lag"), [(0.0, 2 * 0.7 / 60.0), (1.0, 0.0)])
def test_a_steady_motion_lags_by_what_is_not_fed_forward(share: float, lag: float) -> None:
    command = 0.5 * PERIOD * np.arange(1000.0)[:, None]
    position, velocity = Servo(60.0, 0.7, feedforward=share).follow(command, PERIOD)
    assert command[-1, 0] - position[-1, 0] == pytest.approx(0.5 * lag, abs=1e-12)
    assert velocity[-1, 0] == pytest.approx(0.5, abs=1e-12)


def test_limits_are_kept_and_the_end_is_reached() -> None:
    servo = Servo(60.0, 0.9, velocity=1.0, acceleration=8.0)
    position, velocity = servo.follow(np.full((1500, 2), [1.0, -0.5]), PERIOD, np.zeros(2))
    change = np.diff(velocity, axis=0) / PERIOD
    assert np.abs(velocity).max() == pytest.approx(1.0, abs=1e-12)
    assert np.abs(change).max() <= 8.0 + 1e-9
    np.testing.assert_allclose(np.abs(change[0]), 8.0, atol=1e-9)
    np.testing.assert_allclose(position[-1], [1.0, -0.5], atol=1e-6)


def test_a_servo_that_cannot_be_is_refused() -> None:
    for wrong in ({"frequency": 0.0}, {"damping": -1.0}, {"frequency": math.inf}, {"velocity": 0.0}):
        with pytest.raises(InputError, match="must be a positive number"):
            Servo(**{"frequency": 10.0, "damping": 0.7, **wrong})
