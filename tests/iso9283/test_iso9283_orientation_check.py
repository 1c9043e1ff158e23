"""Orientations that no robot attains are refused, with what was probably written instead."""

from __future__ import annotations

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion, rotation_from_vector
from truearm.iso9283.criteria.rows import refuse_far_orientations

N = 40
TURN = rotation_from_vector(np.array([0.3, -1.2, 0.8]))
_RNG = np.random.default_rng(1)
COMMANDED = rotation_from_vector([0.0, 2.5, 0.4] + 0.2 * _RNG.standard_normal((N, 3)))
ATTAINED = rotation_from_vector(2e-3 * _RNG.standard_normal((N, 3))) @ COMMANDED
#: What the instrument reads.
READ = TURN.T @ ATTAINED


def refused(read: Array, commanded: Array = COMMANDED) -> str:
    with pytest.raises(InputError) as refusal:
        refuse_far_orientations(TURN @ read, commanded, TURN, np.arange(2, N + 2), "poses.csv")
    return str(refusal.value)


def test_what_robots_attain_passes_for_many_commands_and_for_one() -> None:
    refuse_far_orientations(ATTAINED, COMMANDED, TURN, np.arange(N), "poses.csv")
    nine = rotation_from_vector(np.radians([9.0, 0, 0])) @ COMMANDED[:1]
    refuse_far_orientations(nine, COMMANDED[0], TURN, np.arange(1), "poses.csv")
    far = rotation_from_vector(np.radians([11.0, 0, 0])) @ COMMANDED[:1]
    with pytest.raises(InputError, match=r"11\.0 deg off"):
        refuse_far_orientations(far, COMMANDED[0], TURN, np.arange(1), "poses.csv")


def test_quaternions_in_the_order_x_y_z_w_are_recognised() -> None:
    q = quaternion_from_rotation(READ)
    text = refused(rotation_from_quaternion(np.roll(q, -1, axis=1)))
    assert "in the order x, y, z, w" in text
    assert f"{N} of {N} orientations" in text
    assert "line 2, columns qw to qz" in text


def test_inverse_rotations_and_frames_taken_for_others_are_recognised() -> None:
    assert "The inverse rotations fit" in refused(READ.swapaxes(1, 2))
    assert "All are turned alike" in refused(READ @ rotation_from_vector(np.radians([0, 0, 90.0])))
    assert "Check that the columns" in refused(rotation_from_vector(_RNG.standard_normal((N, 3))) @ READ)


def test_a_single_row_is_named() -> None:
    read = READ.copy()
    read[7] = rotation_from_vector(np.radians([0, 40.0, 0])) @ read[7]
    text = refused(read)
    assert f"1 of {N} orientations" in text
    assert "line 9" in text
    assert "Look at the record" in text
