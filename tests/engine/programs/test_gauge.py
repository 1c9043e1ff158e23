"""Shifts of base and flange that calibration cannot know are found again, and kept out of programs."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from truearm.engine.programs.fake_targets import fake_targets, matrices, nominal_robot
from truearm.engine.programs.gauge import base_shift, best_agreement, common_motion
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot


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


def worn() -> Robot:
    """Return an IRB 120 that is another one: lengths, angles and joint zeros differ from the nominal ones."""
    return shifted().with_values({"a_3": 0.2713, "theta_offset_3": 0.004, "alpha_4": -1.5690})


def fitted(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the motion ``(4, 4)`` that brings points ``(n, 3)`` nearest to others."""
    found, made = Rotation.align_vectors(other - other.mean(axis=0), one - one.mean(axis=0))[0], np.eye(4)
    made[:3, :3] = found.as_matrix()
    made[:3, 3] = other.mean(axis=0) - made[:3, :3] @ one.mean(axis=0)
    return made


def test_corrections_have_no_common_part() -> None:
    """Also where the real robot is another one: by a program's own targets."""
    robot = worn()
    nominal = nominal_robot(robot)
    joints = np.random.default_rng(1).uniform(-0.6, 0.6, (40, 6)) + np.array([0, 0.3, 0.1, 0, 0.7, 0])
    meant = matrices(nominal, joints)

    def corrected(base: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return meant, fake_targets(robot, base @ meant @ np.linalg.inv(flange), joints).flange

    start, flange = best_agreement(robot)
    _, written = corrected(base_shift(corrected, start))
    np.testing.assert_allclose(fitted(meant[:, :3, 3], written[:, :3, 3]), np.eye(4), atol=2e-6)
    # What is left is what the errors do differently at different targets.
    assert 2e-4 < np.linalg.norm((written - meant)[:, :3, 3], axis=1).mean() < 2e-3


def test_a_work_object_located_by_points_with_the_uncorrected_robot_is_met() -> None:
    """The tool points in a direction of its own at every hole, so that positions and orientations turn differently."""
    robot = worn()
    nominal, rng = nominal_robot(robot), np.random.default_rng(2)
    start, flange = best_agreement(robot)
    holes = np.tile(np.eye(4), (9, 1, 1))
    holes[:, 0, 3], holes[:, 1, 3] = np.repeat([-0.1, 0.0, 0.1], 3), np.tile([-0.1, 0.0, 0.1], 3)
    holes[:, :3, :3] = Rotation.from_euler("zyx", rng.uniform(-0.4, 0.4, (9, 3)) + np.array([0, np.pi, 0])).as_matrix()
    stands = small([0.33, 0.06, 0.15, 0.05, 0.02, 0.4])
    wanted = start @ stands @ holes  # in the identified base
    near = np.tile(np.array([0.2, 0.6, 0.1, 0.0, 0.8, 0.0]), (9, 1))
    touched = fake_targets(robot, wanted @ np.linalg.inv(flange), near).flange
    meant = fitted(holes[:, :3, 3], touched[:, :3, 3]) @ holes

    def corrected(base: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return meant, fake_targets(robot, base @ meant @ np.linalg.inv(flange), near).flange

    def missed(poses: np.ndarray) -> float:
        joints = nominal.inverse(poses[:, :3, 3], poses[:, :3, :3], seed=near).joints
        reached = np.linalg.inv(robot.base.matrix) @ matrices(robot, joints) @ flange
        return float(np.linalg.norm((reached - wanted)[:, :3, 3], axis=1).mean())

    assert missed(meant) > 2e-4
    assert missed(corrected(base_shift(corrected, start))[1]) < 3e-6


def test_orientations_tell_how_targets_in_one_place_are_turned() -> None:
    rng = np.random.default_rng(3)
    turns = rng.normal(0, 1e-3, (6, 3, 1)) + 0.01
    common = common_motion([(np.full((6, 3), 0.4), np.full((6, 3, 1), 2e-4), turns)])
    np.testing.assert_allclose(common.moved, np.full((3, 1), 2e-4), atol=1e-15)
    np.testing.assert_allclose(common.turned, turns.mean(axis=0), atol=1e-12)


def test_the_common_motion_of_parts_is_that_of_all() -> None:
    rng = np.random.default_rng(4)
    places, moved, turned = rng.normal(size=(9, 3)), rng.normal(size=(9, 3, 2)), rng.normal(size=(9, 3, 2))
    whole = common_motion([(places, moved, turned)])
    parts = common_motion([(places[:2], moved[:2], turned[:2]), (places[2:], moved[2:], turned[2:])])
    np.testing.assert_allclose(parts.of(places), whole.of(places), atol=1e-12)
    # What is left has no rigid motion: no mean, and hardly a moment, but for what orientations weigh.
    left = moved - whole.of(places)
    np.testing.assert_allclose(left.mean(axis=0), 0.0, atol=1e-12)
    assert np.abs(np.cross(places[:, :, None], left, axis=1).sum(axis=0)).max() < 1e-4


def test_without_targets_the_base_stays() -> None:
    none = np.zeros((0, 4, 4))
    start = small([1, 2, 3, 0, 0, 0.1])
    assert (base_shift(lambda _: (none, none), start) == start).all()
