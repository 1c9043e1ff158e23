"""What is commanded over time: velocity, acceleration and zones are kept, corners are cut as known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.robot.transform import rotation_from_vector, rotation_vector
from truearm.iso9283.simulating.moving_arm import Commands, Pace, along_circle, along_lines, joint_move

STEP = 1e-3
CORNER = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.3, 0.2, 0.0]])


def kept(points: np.ndarray) -> np.ndarray:
    return np.broadcast_to(np.eye(3), (len(points), 3, 3))


def rates(commands: Commands) -> tuple[float, float]:
    """Return the largest speed and acceleration."""
    velocity = np.diff(commands.position, axis=0) / STEP
    change = np.diff(velocity, axis=0) / STEP
    return float(np.linalg.norm(velocity, axis=1).max()), float(np.linalg.norm(change, axis=1).max())


@pytest.mark.parametrize("zone", [0.001, 0.01])
def test_a_corner_is_cut_within_its_zone_at_the_known_distance(zone: float) -> None:
    commands = along_lines(CORNER, kept(CORNER), Pace(0.5, 10.0, zone), 1e-4)
    away = np.linalg.norm(commands.position - CORNER[1], axis=1)
    assert away.min() == pytest.approx(zone * math.sqrt(2) / 4, rel=1e-3)
    off = np.minimum(np.abs(commands.position[:, 1]), np.abs(commands.position[:, 0] - 0.3))
    assert off[away > zone + 1e-9].max() < 1e-15
    speed = np.linalg.norm(np.diff(commands.position, axis=0), axis=1) / 1e-4
    assert speed[int(np.argmin(away)) - 1] == pytest.approx(math.sqrt(zone * 10.0 * math.sqrt(2) / 2), rel=1e-2)


def test_velocity_and_acceleration_are_kept_and_the_ends_met() -> None:
    commands = along_lines(CORNER, kept(CORNER), Pace(0.5, 10.0, 0.005), STEP)
    speed, change = rates(commands)
    assert speed == pytest.approx(0.5, abs=1e-9)
    assert change <= 10.0 + 1e-6
    np.testing.assert_allclose(commands.position[[0, -1]], CORNER[[0, -1]], atol=1e-12)


def test_without_a_zone_it_stops_in_the_corner() -> None:
    commands = along_lines(CORNER, kept(CORNER), Pace(0.5, 10.0), 1e-4)
    away = np.linalg.norm(commands.position - CORNER[1], axis=1)
    assert away.min() < 1e-6
    duration = sum(length / 0.5 + 0.5 / 10.0 for length in (0.3, 0.2))
    assert commands.time[-1] == pytest.approx(duration, abs=1e-4)


def test_many_short_lines_are_slowed_down_for_ahead() -> None:
    points = np.column_stack([0.002 * np.arange(40), 0.002 * (np.arange(40) % 2), np.zeros(40)])
    speed, change = rates(along_lines(points, kept(points), Pace(1.0, 5.0, 0.0005), STEP))
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
        along_lines(twice, kept(twice), Pace(0.5), STEP)
    with pytest.raises(InputError, match="a circle must have a radius"):
        along_circle(np.zeros(3), np.zeros(3), np.array([0.0, 0.0, 1.0]), np.eye(3), Pace(0.5), STEP)
    with pytest.raises(InputError, match="it must be a positive number"):
        Pace(0.0)
    with pytest.raises(InputError, match="a radius cannot be negative"):
        Pace(1.0, zone=-1.0)
