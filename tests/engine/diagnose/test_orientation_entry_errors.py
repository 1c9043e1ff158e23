"""Orientations that were read by another convention: it is named, and those of honest campaigns are left alone."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.checking.check import check
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.mapping import AnglesEntry
from truearm.engine.data.readers.row_values import quaternions_of_angles
from truearm.engine.diagnose.entry_error_trials import orientation_entry_errors
from truearm.engine.diagnose.entry_errors import entry_errors_in_positions
from truearm.engine.diagnose.wrong_robot import implausible
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import (
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_vector,
    rotation_vector,
    turned_about,
)

ROBOT = "irb120"


def with_orientations(robot: str, poses: int, seed: int) -> Dataset:
    """Return poses of a target that is turned on the flange, with 0.1 mrad of noise."""
    twin, data = campaign(robot, poses, 0.05e-3, seed)
    rng = np.random.default_rng(seed)
    _, R = twin.robot.world_poses(data.joints)
    noise = rotation_from_vector(rng.normal(0.0, 1e-4, (len(data.configuration), 3)))
    turned = R[data.configuration] @ rotation_from_vector(rng.normal(0.0, 1.0, (1, 3))) @ noise
    return replace(data, quaternion=quaternion_from_rotation(turned), sigma=None)


@cache
def sound() -> Dataset:
    return with_orientations(ROBOT, 20, 5)


def angles(R: np.ndarray) -> np.ndarray:
    """Return KUKA's A, B, C [rad]."""
    b = np.arcsin(-R[:, 2, 0])
    return np.column_stack([np.arctan2(R[:, 1, 0], R[:, 0, 0]), b, np.arctan2(R[:, 2, 1], R[:, 2, 2])])


def about(numbers: np.ndarray, order: str) -> np.ndarray:
    """Return rotations about moving axes."""
    one, two, three = (turned_about("xyz".index(axis), column) for axis, column in zip(order, numbers.T, strict=True))
    return one @ two @ three


def read_otherwise(way: str) -> Dataset:
    data = sound()
    R = rotation_from_quaternion(np.asarray(data.quaternion))
    numbers = angles(R)
    computed = {
        "columns reversed": about(numbers[:, ::-1], "zyx"),
        "fixed for moving": about(numbers, "xyz"),
        "zyz": about(numbers, "zyz"),
        "degrees": about(np.radians(numbers), "zyx"),
        "rotation vector": rotation_from_vector(numbers),
        "angles for a vector": about(rotation_vector(R), "zyx"),
        "transposed": np.swapaxes(R, 1, 2),
        "from the wrong end": rotation_from_quaternion(np.asarray(data.quaternion)[:, [3, 0, 1, 2]]),
        "from the other end": rotation_from_quaternion(np.asarray(data.quaternion)[:, [1, 2, 3, 0]]),
    }[way]
    return replace(data, quaternion=quaternion_from_rotation(computed))


@pytest.mark.parametrize(
    ("way", "code", "words"),
    [
        ("columns reversed", "orientation-order", "not angles about zyx of moving axes but angles about xyz of fixed"),
        ("fixed for moving", "orientation-order", "not angles about xyz of moving axes but angles about zyx of moving"),
        ("zyz", "orientation-order", "not angles about zyz of moving axes but angles about zyx of moving"),
        ("degrees", "orientation-order", "angles about zyx of moving axes, but in radians that were called degrees"),
        ("rotation vector", "orientation-order", "not a rotation vector but angles about zyx of moving axes"),
        ("angles for a vector", "orientation-order", "not angles about zyx of moving axes but a rotation vector"),
        ("transposed", "orientation-order", "they turn the other way round, as transposed matrices do"),
        ("from the wrong end", "orientation-order", "w, x, y, z were taken for x, y, z, w"),
        ("from the other end", "orientation-order", "in the order x, y, z, w"),
    ],
)
def test_the_convention_that_was_meant_is_named(way: str, code: str, words: str) -> None:
    (notice,) = orientation_entry_errors(load_robot(ROBOT), read_otherwise(way))
    assert (notice.code, notice.level) == (code, "error")
    assert words in notice.message


def test_a_rotation_vector_that_was_read_as_angles_is_named() -> None:
    for robot, order, axes in (("ur10e", "xyz", "fixed"), ("gp7", "zyx", "fixed"), ("ur10e", "zyz", "moving")):
        data = with_orientations(robot, 8, 3)
        vectors = rotation_vector(rotation_from_quaternion(np.asarray(data.quaternion)))
        entry = AnglesEntry.model_validate({"columns": ["A", "B", "C"], "about": order, "axes": axes, "unit": "rad"})
        read = replace(data, quaternion=quaternions_of_angles(vectors, entry))
        (notice,) = orientation_entry_errors(load_robot(robot), read)
        assert notice.code == "orientation-order"
        assert f"not angles about {order} of {axes} axes but a rotation vector" in notice.message


def test_a_check_says_it_too_and_nothing_of_sound_orientations() -> None:
    for data, codes in ((sound(), []), (read_otherwise("from the other end"), ["orientation-order"])):
        assert [n.code for n in check(ROBOT, data).warnings if n.level == "error"] == codes


def test_inverted_poses_of_any_instrument_are_named() -> None:
    data = sound()
    R = rotation_from_quaternion(np.asarray(data.quaternion))
    position = -np.einsum("nji,nj->ni", R, data.position)
    inverted = replace(data, position=position, quaternion=quaternion_from_rotation(np.swapaxes(R, 1, 2)))
    (notice,) = check(ROBOT, inverted).warnings
    assert (notice.code, notice.level) == ("orientation-order", "error")
    assert notice.message.startswith("The poses are inverted: each is that of the instrument, seen from the target.")


def test_poses_of_another_robot_or_of_other_rows_are_not_called_inverted() -> None:
    data = with_orientations("irb120", 20, 0)
    others = replace(data, joints=np.random.default_rng(0).permutation(data.joints))
    for robot, poses in (("ur5", data), ("irb120", others)):
        codes = {notice.code for notice in entry_errors_in_positions(load_robot(robot), poses)}
        assert "orientation-order" not in codes, robot


def test_the_fit_says_the_cause() -> None:
    run = calibrate(ROBOT, read_otherwise("fixed for moving"))
    assert run.warnings[0].code == "orientation-order"
    (warning,) = [notice for notice in run.warnings if notice.code == "implausible"]
    assert "The cause is most likely what orientation-order says" in warning.message


def test_honest_orientations_are_left_alone() -> None:
    for robot, seed in product(("irb120", "ur10", "katana450"), range(20)):
        assert not orientation_entry_errors(load_robot(robot), with_orientations(robot, 12, seed)), (robot, seed)


def test_orientations_that_nothing_explains_are_given_no_name() -> None:
    for seed in range(3):
        drawn = np.random.default_rng(seed).normal(size=(len(sound().target), 4))
        data = replace(sound(), quaternion=drawn / np.linalg.norm(drawn, axis=1, keepdims=True))
        assert not orientation_entry_errors(load_robot(ROBOT), data.of_configurations(np.arange(6))), seed


# -- single rows ---------------------------------------------------------------------------------------------


@cache
def one_target() -> Dataset:
    return replace((data := with_orientations(ROBOT, 20, 5)).of_readings(data.target == 0), targets=("1",))


def turned(rows: list[int], R: np.ndarray) -> Dataset:
    """Return the data with other orientations at some rows."""
    data = one_target()
    quaternion = np.array(data.quaternion)
    quaternion[rows] = quaternion_from_rotation(R)
    return replace(data, quaternion=quaternion)


def orientations(rows: list[int]) -> np.ndarray:
    return np.asarray(rotation_from_quaternion(np.asarray(one_target().quaternion)[rows]))


def test_a_single_orientation_that_is_off_is_doubted_and_not_its_position() -> None:
    data = turned([4], orientations([4]) @ rotation_from_vector(np.radians([[1.0, 2.0, -2.0]])))
    result = check(ROBOT, data)
    (notice,) = result.warnings
    assert (notice.code, notice.level) == ("orientation-outliers", "warning")
    assert notice.message.startswith(
        "1 orientation is far off, and the positions are not (configuration/target): 5/1 (2.99 deg)"
    )
    assert [step.code for step in result.next] == ["see-warning", "calibrate"]
    run = calibrate(ROBOT, data, train=15, model="geometric")
    codes = {notice.code for notice in run.warnings}
    assert "orientation-outliers" in codes
    assert not codes & {"narrow-data", "residuals-exceed-sigma"}
    assert [step.code for step in run.next] == ["see-warning"]


def test_a_turn_about_the_axis_of_a_joint_through_the_target_may_be_the_joint() -> None:
    robot = load_robot(ROBOT)
    joints = robot.random_configurations(20, np.random.default_rng(0))
    position, R = robot.forward(joints)
    noise = np.random.default_rng(1).normal(0.0, 1e-4, (2, 20, 3))
    R[3] = R[3] @ rotation_from_vector(np.array([[0.0, 0.0, 0.2]]))[0]
    quaternion = quaternion_from_rotation(R @ rotation_from_vector(noise[1]))
    (notice,) = check(ROBOT, Dataset.of(joints, position + noise[0], quaternions=quaternion)).warnings
    assert notice.code == "orientation-outliers"
    assert "(11.5 deg, as if joint 6 were)" in notice.message


def test_rows_of_another_convention_are_named_beside_one_that_is_off() -> None:
    rows = [2, 5, 9]
    numbers = about(angles(orientations(rows)), "xyz")
    off = orientations([12]) @ rotation_from_vector(np.radians([[10.0, -20.0, 5.0]]))
    order, single = check(ROBOT, turned([*rows, 12], np.concatenate([numbers, off]))).warnings
    assert (order.code, order.level) == ("orientation-order", "error")
    assert "(configuration/target): 3/1, 6/1, 10/1." in order.message
    assert "not angles about xyz of moving axes but angles about zyx of moving axes" in order.message
    assert single.code == "orientation-outliers"
    assert "13/1" in single.message
    (inverse,) = check(ROBOT, turned([7], np.swapaxes(orientations([7]), 1, 2))).warnings
    assert (inverse.code, inverse.level) == ("orientation-order", "error")


def test_noise_of_orientations_that_was_declared_is_allowed() -> None:
    data, rng = one_target(), np.random.default_rng(3)
    noise = rotation_from_vector(rng.normal(0.0, 0.1, (20, 3)))
    noisy = turned([*range(20)], orientations([*range(20)]) @ noise)
    declared = replace(noisy, sigma_rot=np.full(20, 0.1))
    assert not check(ROBOT, declared).warnings
    fit = identify(load_robot(ROBOT), replace(data, quaternion=noisy.quaternion), named_model("geometric"))
    assert "half of the orientations are off" in str(implausible(fit, noisy))
    assert implausible(fit, declared) is None
