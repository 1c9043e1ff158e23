"""Orientations that were read by another convention: it is named, and those of honest campaigns are left alone."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Literal

import numpy as np
import pytest
from tests.simulated import campaign

from truearm.identification.judging.orientation_slips import orientation_slips
from truearm.jobs.calibrate import calibrate
from truearm.library import load_robot
from truearm.measurement.dataset import Dataset
from truearm.measurement.readers.mapping_entries import AnglesEntry
from truearm.measurement.readers.orientation_columns import quaternions_of_angles
from truearm.modeling.orientations import turned_about
from truearm.modeling.transform import (
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_vector,
    rotation_vector,
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
    made = {
        "columns reversed": about(numbers[:, ::-1], "zyx"),
        "fixed for moving": about(numbers, "xyz"),
        "zyz": about(numbers, "zyz"),
        "degrees": about(np.radians(numbers), "zyx"),
        "rotation vector": rotation_from_vector(numbers),
        "angles for a vector": about(rotation_vector(R), "zyx"),
        "transposed": np.swapaxes(R, 1, 2),
    }[way]
    return replace(data, quaternion=quaternion_from_rotation(made))


@pytest.mark.parametrize(
    ("way", "code", "words"),
    [
        ("columns reversed", "orientation-order", "not angles about zyx of moving axes but angles about xyz of fixed"),
        ("fixed for moving", "orientation-order", "not angles about xyz of moving axes but angles about zyx of moving"),
        ("zyz", "orientation-order", "not angles about zyz of moving axes but angles about zyx of moving"),
        ("degrees", "orientation-order", "angles about zyx of moving axes, but in radians that were called degrees"),
        ("rotation vector", "orientation-order", "not a rotation vector but angles about zyx of moving axes"),
        ("angles for a vector", "orientation-order", "not angles about zyx of moving axes but a rotation vector"),
        ("transposed", "quaternion-order", "they turn the other way round, as transposed matrices do"),
    ],
)
def test_the_convention_that_was_meant_is_named(way: str, code: str, words: str) -> None:
    (notice,) = orientation_slips(load_robot(ROBOT), read_otherwise(way))
    assert (notice.code, notice.level) == (code, "error")
    assert words in notice.message


@pytest.mark.parametrize(
    ("robot", "order", "axes"), [("ur10e", "xyz", "fixed"), ("gp7", "zyx", "fixed"), ("ur10e", "zyz", "moving")]
)
def test_a_rotation_vector_that_was_read_as_angles_is_named(
    robot: str, order: str, axes: Literal["fixed", "moving"]
) -> None:
    data = with_orientations(robot, 8, 3)
    vectors = rotation_vector(rotation_from_quaternion(np.asarray(data.quaternion)))
    entry = AnglesEntry(columns=["A", "B", "C"], about=order, axes=axes, unit="rad")
    (notice,) = orientation_slips(load_robot(robot), replace(data, quaternion=quaternions_of_angles(vectors, entry)))
    assert notice.code == "orientation-order"
    assert f"not angles about {order} of {axes} axes but a rotation vector" in notice.message


def test_a_quaternion_read_from_the_wrong_end() -> None:
    data = sound()
    (notice,) = orientation_slips(
        load_robot(ROBOT), replace(data, quaternion=np.asarray(data.quaternion)[:, [3, 0, 1, 2]])
    )
    assert notice.code == "quaternion-order"
    assert "w, x, y, z were taken for x, y, z, w" in notice.message


def test_the_fit_says_the_cause() -> None:
    run = calibrate(ROBOT, read_otherwise("fixed for moving"))
    assert run.warnings[0].code == "orientation-order"
    (told,) = [notice for notice in run.warnings if notice.code == "implausible"]
    assert "The cause is most likely what orientation-order says" in told.message


@pytest.mark.parametrize("robot", ["irb120", "ur10", "katana450"])
def test_honest_orientations_are_left_alone(robot: str) -> None:
    nominal = load_robot(robot)
    for seed in range(20):
        assert not orientation_slips(nominal, with_orientations(robot, 12, seed))


def test_orientations_that_nothing_explains_are_given_no_name() -> None:
    nominal, data = load_robot(ROBOT), sound()
    for seed in range(3):
        drawn = np.random.default_rng(seed).normal(size=(len(data.target), 4))
        few = replace(data, quaternion=drawn / np.linalg.norm(drawn, axis=1, keepdims=True)).of_configurations(
            np.arange(6)
        )
        assert not orientation_slips(nominal, few)
