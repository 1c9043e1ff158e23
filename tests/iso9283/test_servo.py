"""Joints follow commands as damped springs: closed forms of the linear oscillator, and limits that are kept."""

from __future__ import annotations

import math

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.iso9283.simulating.moving_arm import Servo

STEP = 2e-3


def test_a_step_overshoots_as_the_closed_form_says() -> None:
    w, d = 40.0, 0.3
    time = STEP * np.arange(600.0)
    position, velocity = Servo(w, d).follow(np.ones((600, 2)), STEP, np.zeros(2))
    turn = w * math.sqrt(1 - d * d)
    expected = 1 - np.exp(-d * w * time) * (np.cos(turn * time) + d * w / turn * np.sin(turn * time))
    np.testing.assert_allclose(position, np.stack([expected] * 2, axis=1), atol=1e-13)
    np.testing.assert_allclose(velocity[:, 0], w * w / turn * np.exp(-d * w * time) * np.sin(turn * time), atol=1e-11)
    peak = int(np.argmax(position[:, 0]))
    assert abs(time[peak] - math.pi / turn) <= STEP
    assert position[peak, 0] - 1 == pytest.approx(math.exp(-math.pi * d / math.sqrt(1 - d * d)), rel=5e-3)


@pytest.mark.parametrize("damping", [0.2, 1.0, 2.5])
def test_steps_added_up_and_step_by_step_are_one_motion(damping: float) -> None:
    command = np.cumsum(np.random.default_rng(0).normal(0.0, 1e-3, (500, 3)), axis=0)
    servo = Servo(30.0, damping, feedforward=0.6)
    at_once = servo.follow(command, STEP, np.array([0.1, 0.0, -0.1]))
    one_by_one = servo._limited(command, STEP, np.array([0.1, 0.0, -0.1]))
    np.testing.assert_allclose(at_once, one_by_one, atol=1e-12)


@pytest.mark.parametrize(("share", "lag"), [(0.0, 2 * 0.7 / 60.0), (1.0, 0.0)])
def test_a_steady_motion_lags_by_what_is_not_fed_forward(share: float, lag: float) -> None:
    command = 0.5 * STEP * np.arange(1000.0)[:, None]
    position, velocity = Servo(60.0, 0.7, feedforward=share).follow(command, STEP)
    assert command[-1, 0] - position[-1, 0] == pytest.approx(0.5 * lag, abs=1e-12)
    assert velocity[-1, 0] == pytest.approx(0.5, abs=1e-12)


def test_limits_are_kept_and_the_end_is_reached() -> None:
    servo = Servo(60.0, 0.9, velocity=1.0, acceleration=8.0)
    position, velocity = servo.follow(np.full((1500, 2), [1.0, -0.5]), STEP, np.zeros(2))
    change = np.diff(velocity, axis=0) / STEP
    assert np.abs(velocity).max() == pytest.approx(1.0, abs=1e-12)
    assert np.abs(change).max() <= 8.0 + 1e-9
    np.testing.assert_allclose(np.abs(change[0]), 8.0, atol=1e-9)
    np.testing.assert_allclose(position[-1], [1.0, -0.5], atol=1e-6)


@pytest.mark.parametrize("wrong", [{"frequency": 0.0}, {"damping": -1.0}, {"frequency": math.inf}, {"velocity": 0.0}])
def test_a_servo_that_cannot_be_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match="must be a positive number"):
        Servo(**{"frequency": 10.0, "damping": 0.7, **wrong})
