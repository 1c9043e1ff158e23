"""Orientations as controllers write them, against examples worked by hand and rotations composed by SciPy.

The worked examples are right-angled turns followed on paper: which base axis each tool axis points along.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from truearm.engine.robot.transform import (
    FIXED_XYZ_ANGLES,
    MOVING_XYZ_ANGLES,
    QUATERNION,
    ROTATION_VECTOR,
    ZYX_ANGLES,
    Orientation,
)

EVERY = [QUATERNION, ZYX_ANGLES, FIXED_XYZ_ANGLES, MOVING_XYZ_ANGLES, ROTATION_VECTOR]
ANGLES = [ZYX_ANGLES, FIXED_XYZ_ANGLES, MOVING_XYZ_ANGLES]
#: The order that SciPy calls each by: small letters turn about fixed axes, capitals about moving ones.
ORDER = {ZYX_ANGLES.name: "ZYX", FIXED_XYZ_ANGLES.name: "xyz", MOVING_XYZ_ANGLES.name: "XYZ"}
names = pytest.mark.parametrize("orientation", EVERY, ids=lambda o: o.name)

# Columns: where x, y and z of the tool point.
TOOL_DOWN = np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]])  # half a turn about x: a tool on a table below
FLANGE_AHEAD = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])  # a quarter turn about y: the ABB flange at zero
X_THEN_Z = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])  # 90 about x, then 90 about the new z


@pytest.mark.parametrize(
    ("orientation", "numbers", "matrix"),
    [
        # ABB: the tool straight down is [0, 1, 0, 0], the flange of an upright arm ahead [0.7071, 0, 0.7071, 0].
        (QUATERNION, [0, 1, 0, 0], TOOL_DOWN),
        (QUATERNION, [np.sqrt(0.5), 0, np.sqrt(0.5), 0], FLANGE_AHEAD),
        # KUKA: A 0, B 90, C 0 is the flange of a robot in its cannon position, A 0, B 0, C 180 a tool down.
        (ZYX_ANGLES, [0, 90, 0], FLANGE_AHEAD),
        (ZYX_ANGLES, [0, 0, 180], TOOL_DOWN),
        (ZYX_ANGLES, [90, -90, 0], np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])),
        # FANUC: W 180, P 0, R 0 is a tool down; W 180, P -90, R 0 the faceplate of a robot at zero, its x up.
        (FIXED_XYZ_ANGLES, [180, 0, 0], TOOL_DOWN),
        (FIXED_XYZ_ANGLES, [180, -90, 0], np.array([[0.0, 0, 1], [0, -1, 0], [1, 0, 0]])),
        # Turns about fixed axes: 90 about x, then 90 about the base's z.
        (FIXED_XYZ_ANGLES, [90, 0, 90], np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])),
        # Staubli: the same numbers about moving axes.
        (MOVING_XYZ_ANGLES, [90, 0, 90], X_THEN_Z),
        (MOVING_XYZ_ANGLES, [0, 180, 0], np.diag([-1.0, 1.0, -1.0])),
    ],
)
def test_examples_worked_by_hand(orientation: Orientation, numbers: list[float], matrix: np.ndarray) -> None:
    numbers_read = np.array([numbers], float)
    turned = numbers_read if orientation is QUATERNION else np.radians(numbers_read)
    np.testing.assert_allclose(orientation.matrices(turned)[0], matrix, atol=1e-15)


def test_the_rotation_vector_of_a_tool_down() -> None:
    # Universal Robots, script manual: [0, pi, 0] turns half about y, and [2.2214, 2.2214, 0] about the diagonal.
    np.testing.assert_allclose(ROTATION_VECTOR.matrices(np.array([[0, np.pi, 0]]))[0], np.diag([-1, 1, -1]), atol=1e-15)
    diagonal = np.pi / np.sqrt(2.0)
    swapped = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
    np.testing.assert_allclose(ROTATION_VECTOR.matrices(np.array([[diagonal, diagonal, 0]]))[0], swapped, atol=1e-15)


@given(arrays(float, 3, elements=st.floats(-7, 7)))
def test_angles_and_vectors_are_those_of_scipy(numbers: np.ndarray) -> None:
    for orientation in ANGLES:
        expected = Rotation.from_euler(ORDER[orientation.name], numbers).as_matrix()
        np.testing.assert_allclose(orientation.matrices(numbers[None])[0], expected, atol=1e-12)
    expected = Rotation.from_rotvec(numbers).as_matrix()
    np.testing.assert_allclose(ROTATION_VECTOR.matrices(numbers[None])[0], expected, atol=1e-12)


def numbers_of(orientation: Orientation, seed: int, count: int = 200) -> np.ndarray:
    rng = np.random.default_rng(seed)
    if orientation is QUATERNION:
        q = rng.standard_normal((count, 4))
        return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))
    if orientation is ROTATION_VECTOR:
        return np.asarray(rng.uniform(-3.5, 3.5, (count, 3)))
    return np.asarray(rng.uniform([-4, -2.5, -4], [4, 2.5, 4], (count, 3)))


@names
def test_a_small_turn_changes_the_numbers_little_and_the_same_rotation_not_at_all(orientation: Orientation) -> None:
    """The writing stays: signs of quaternions, whole turns, and which of two triples of angles."""
    near = numbers_of(orientation, 1)
    same = orientation.matrices(near) @ Rotation.from_rotvec([0, 0, 1e-10]).as_matrix()
    assert (orientation.numbers(same, near) == near).all()
    if orientation in ANGLES:
        near = near[np.abs(np.cos(near[:, 1])) > 0.2]
    if orientation is ROTATION_VECTOR:  # at whole turns every axis is as good
        near = near[np.abs(np.linalg.norm(near, axis=1) % (2 * np.pi) - 2 * np.pi) > 0.3]
    turn = Rotation.from_rotvec(1e-3 * np.random.default_rng(2).standard_normal((len(near), 3))).as_matrix()
    R = turn @ orientation.matrices(near)
    numbers = orientation.numbers(R, near)
    np.testing.assert_allclose(orientation.matrices(numbers), R, atol=1e-12)
    assert np.abs(numbers - near).max() < 0.06


def test_a_quaternion_may_have_either_sign_and_be_rounded() -> None:
    near = np.array([[-0.707, 0, -0.707, 0], [0.707, 0, 0.707, 0], [0, -1, 0, 0]])
    R = QUATERNION.matrices(near) @ Rotation.from_rotvec([0, 0, 1e-3]).as_matrix()
    numbers = QUATERNION.numbers(R, near)
    assert (np.sign(numbers[:, :1]) == [[-1], [1], [np.sign(numbers[2, 0])]]).all()
    assert ((numbers * near).sum(axis=1) > 0.999).all()
    np.testing.assert_allclose(np.linalg.norm(numbers, axis=1), 1.0, atol=1e-15)


def test_gimbal_lock_keeps_the_angle_that_is_free() -> None:
    """Where the middle angle is 90 deg only a sum of the others counts: one stays, the other takes all."""
    for orientation in ANGLES:
        for side in (1, -1):
            near = np.array([[0.3, side * np.pi / 2, -1.1]])
            free_angle = {ZYX_ANGLES.name: 0, FIXED_XYZ_ANGLES.name: 2, MOVING_XYZ_ANGLES.name: 2}[orientation.name]
            locked = near.copy()
            locked[0, 2 - free_angle] += 0.2
            R = orientation.matrices(locked)
            numbers = orientation.numbers(R, near)
            np.testing.assert_allclose(orientation.matrices(numbers), R, atol=1e-9)
            np.testing.assert_allclose(numbers, locked, atol=1e-7, err_msg=f"{orientation.name}, {side}")


def test_a_rotation_vector_beyond_half_a_turn_stays_there() -> None:
    near = np.array([[0.0, 3.5, 0.0], [0.0, -3.5, 0.0], [0, 0, 0], [2 * np.pi, 0, 0]])
    R = ROTATION_VECTOR.matrices(near) @ Rotation.from_rotvec([0, 1e-3, 0]).as_matrix()
    numbers = ROTATION_VECTOR.numbers(R, near)
    np.testing.assert_allclose(ROTATION_VECTOR.matrices(numbers), R, atol=1e-12)
    np.testing.assert_allclose(numbers[:3], near[:3] + np.array([0, 1e-3, 0]), atol=1e-12)
