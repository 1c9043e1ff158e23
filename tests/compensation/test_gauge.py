"""Shifts of base and flange that calibration cannot know are found again, and kept out of programs."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from truearm.compensation.fake_targets import fake_targets, matrices, nominal_robot
from truearm.compensation.gauge import base_shift, best_agreement
from truearm.library import load_robot
from truearm.modeling.robot import Robot


def small(motion: list[float]) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = Rotation.from_rotvec(motion[3:]).as_matrix(), motion[:3]
    return made


def shifted() -> Robot:
    """Return an IRB 120 whose errors are all arbitrary: first and last axis moved against base and flange."""
    robot = load_robot("irb120")
    zero = robot.values
    return robot.with_values(
        {
            "d_1": zero["d_1"] + 0.004,
            "base_z": -0.1,
            "theta_offset_1": 0.01,
            "theta_offset_6": zero["theta_offset_6"] - 0.02,
            "d_6": zero["d_6"] + 0.003,
        }
    )


def test_shifts_of_base_and_flange_are_found() -> None:
    robot = shifted()
    base, flange = best_agreement(robot)
    np.testing.assert_allclose(base, small([0, 0, 0.004, 0, 0, 0.01]), atol=1e-9)
    np.testing.assert_allclose(np.linalg.inv(flange), small([0, 0, 0.003, 0, 0, -0.02]), atol=1e-9)


def test_the_mean_correction_is_nothing() -> None:
    """Also where the real robot is another one: by a program's own targets, positions and orientations."""
    robot = shifted().with_values({"a_3": 0.2713, "theta_offset_3": 0.004, "alpha_4": -1.5690})
    nominal = nominal_robot(robot)
    joints = np.random.default_rng(1).uniform(-0.6, 0.6, (40, 6)) + np.array([0, 0.3, 0.1, 0, 0.7, 0])
    meant = matrices(nominal, joints)

    def corrected(base: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return meant, fake_targets(robot, base @ meant @ np.linalg.inv(flange), joints).flange

    start, flange = best_agreement(robot)
    base = base_shift(corrected, start)
    _, written = corrected(base)
    assert np.abs((written - meant)[:, :3, 3].mean(axis=0)).max() < 1e-9
    turned = Rotation.from_matrix(written[:, :3, :3] @ np.swapaxes(meant[:, :3, :3], 1, 2)).as_rotvec()
    assert np.abs(turned.mean(axis=0)).max() < 1e-9
    # What is left is what the errors do differently at different targets.
    assert 2e-4 < np.linalg.norm((written - meant)[:, :3, 3], axis=1).mean() < 2e-3


def test_without_targets_the_base_stays() -> None:
    none = np.zeros((0, 4, 4))
    start = small([1, 2, 3, 0, 0, 0.1])
    assert (base_shift(lambda _: (none, none), start) == start).all()
