"""The slips that people make with units, signs, orders and axes, each as the data would be with it mended."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np

from truearm.measurement.controller_joints import in_controller_joints, in_model_joints
from truearm.measurement.dataset import Dataset
from truearm.measurement.mixed_lengths import FARTHEST, LENGTH_FACTORS
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform
from truearm.notices import Notice

#: Largest ratio of the stretches along three axes that is still called a scale.
_MOST_UNEVEN: Final = 1.2
#: Cosine between two axes of an instrument that are still called square.
_SQUARE: Final = 0.1
#: So many configurations are named.
_MOST_NAMED: Final = 5
#: No joint turns farther to one side, in turns.
_MOST_TURNS: Final = 1.5


@dataclass(frozen=True, eq=False)
class Slip:
    """One slip, mended."""

    code: str  #: Of the notice.
    words: str  #: What happened and what to do about it, without a full stop.
    data: Dataset  #: The data as they should be.
    #: Configuration and target of the readings that it is about; empty if it is about all.
    at: tuple[tuple[str, str], ...] = ()

    @property
    def notice(self) -> Notice:
        """What is said if it explains the data."""
        return Notice(self.code, f"{self.words}.", "error", at=self.at)


# -- lengths -----------------------------------------------------------------------------------------------


def length_slips(data: Dataset) -> Iterator[Slip]:
    """Try lengths in another unit."""
    for factor, words in LENGTH_FACTORS:
        if factor > 1.0 and np.nanmax(np.abs(data.position), initial=0.0) * factor > FARTHEST:
            continue
        what = "positions" if data.fixture is None else "lengths"
        words = f"The {what} are {words}. Mend the unit in the header"
        yield Slip("unit-length", words, _scaled(data, factor))


def _scaled(data: Dataset, factor: float) -> Dataset:
    """Return the data with all measured lengths so many times as large."""

    def scaled(values: Array | None) -> Array | None:
        return None if values is None else values * factor

    setup = None if data.setup is None else _scaled(data.setup, factor)
    more = {"distance": scaled(data.distance), "height": scaled(data.height), "setup": setup}
    return replace(data, position=data.position * factor, **more)  # type: ignore[arg-type]


def scale_slips(robot: Robot, data: Dataset) -> Iterator[Slip]:
    """Try the factor by which readings are larger than the robot, from the linear map that takes them onto it.

    Of ``B y = R_c t + p_c + u`` the map B, the targets t and u are found by least squares. Where B stretches all axes
    alike, its inverse is a turn times the factor.
    """
    p, R = robot.with_frames(Transform(), {}).world_poses(data.postures)
    readings = np.flatnonzero(data.has_position)
    where, what = data.configuration[readings], data.target[readings]
    y = data.position[readings] - data.position[readings].mean(axis=0)
    seen = np.unique(what)
    unknowns = 9 + 3 * len(seen) + 3
    if 3 * len(readings) < 2 * unknowns:
        return
    rows = np.zeros((len(readings), 3, unknowns))
    for i in range(3):
        rows[:, i, 3 * i : 3 * i + 3] = y
    for column, t in enumerate(seen.tolist()):
        mine = what == t
        rows[mine, :, 9 + 3 * column : 12 + 3 * column] = -R[where[mine]]
    rows[:, :, -3:] = -np.eye(3)
    found = np.linalg.lstsq(rows.reshape(-1, unknowns), p[where].reshape(-1), rcond=1e-10)[0]
    onto = np.asarray(found[:9].reshape(3, 3), dtype=float)
    stretch = np.linalg.svd(onto, compute_uv=False)
    if stretch[2] <= 0.0:
        return
    if stretch[0] > _MOST_UNEVEN * stretch[2]:
        yield from _column_slips(data, onto)
        return
    factor = float(np.prod(stretch)) ** (1 / 3)
    size = f"{1 / factor:.4g} times too large" if factor < 1 else f"{factor:.4g} times too small"
    yield Slip(
        "unit-length", f"The positions are {size} for this robot. Mend them or their unit", _scaled(data, factor)
    )


def _column_slips(data: Dataset, onto: Array) -> Iterator[Slip]:
    """Try single columns of positions in another unit, from the linear map that takes readings onto the robot."""
    stretch = np.linalg.norm(onto, axis=0)
    turned = onto / stretch
    off = np.abs(stretch - 1.0) > _MOST_UNEVEN - 1.0
    if np.abs(turned.T @ turned - np.eye(3)).max() > _SQUARE or off.all():
        return
    sizes = [f"{1 / by:.4g} times too large" if by < 1 else f"{by:.4g} times too small" for by in stretch.tolist()]
    words = " and ".join(f"the column {axis} of the positions is {sizes[i]}" for i, axis in enumerate("xyz") if off[i])
    mended = data.position * np.where(off, stretch, 1.0)
    words = f"For this robot {words}. Mend the unit in the header, or the numbers"
    yield Slip("unit-length", words, replace(data, position=mended))


def mirrored(data: Dataset) -> Iterator[Slip]:
    """Try the mirror image of the positions."""
    words = (
        "The positions are mirrored: two of the columns x, y and z are exchanged, or the sign of one is wrong. The "
        "data fit with their mirror image. Mend the columns; an instrument's axes are right-handed"
    )
    yield Slip("mirrored", words, replace(data, position=data.position * np.array([1.0, 1.0, -1.0])))


# -- joints ------------------------------------------------------------------------------------------------


def _turning(data: Dataset) -> list[int]:
    return [i for i in range(data.joints.shape[1]) if data.joint_kinds[i] == "revolute"]


def angle_slips(data: Dataset) -> Iterator[Slip]:
    """Try joint positions in the other unit of angle, of all joints or of one."""
    turning = _turning(data)
    for factor, words in ((math.pi / 180, "degrees are called rad"), (180 / math.pi, "radians are called deg")):
        for group in [turning, *([i] for i in turning)]:
            if not group:
                continue
            joints = data.joints.copy()
            joints[:, group] *= factor
            which = "The joints" if len(group) > 1 else f"Joint {group[0] + 1}"
            words_of = f"{which}: {words}. Mend the unit in the header"
            yield Slip("unit-angle", words_of, replace(data, joints=joints))


def mixed_angle_slips(data: Dataset) -> Iterator[Slip]:
    """Try the other unit of angle at those configurations whose joint positions are of its size, and not at the others.

    No joint turns farther than one and a half turns to one side. Radians that are called degrees lie within 9.4 deg in
    all joints; degrees that are called radians lie beyond 9.4 rad in some joint.
    """
    turning = _turning(data)
    if not turning:
        return
    largest, most = np.abs(data.joints[:, turning]).max(axis=1), _MOST_TURNS * 2.0 * math.pi
    for mask, factor, words in (
        (largest > most, math.pi / 180, "degrees are called rad"),
        (largest <= most * (math.pi / 180), 180 / math.pi, "radians are called deg"),
    ):
        which = np.flatnonzero(mask)
        if not 0 < len(which) < data.configurations:
            continue
        joints = data.joints.copy()
        joints[np.ix_(which, np.array(turning))] *= factor
        first = ", ".join(data.labels[c] for c in which[:_MOST_NAMED].tolist())
        some = f"{first} and others" if len(which) > _MOST_NAMED else first
        words_of = f"The joints: {words}, at some configurations alone ({some}). Mend the numbers of these rows"
        yield Slip("unit-angle", words_of, replace(data, joints=joints))


def controller_slips(robot: Robot, data: Dataset) -> Iterator[Slip]:
    """Try joint positions as those that the controller shows, and the other way round."""
    controller = robot.controller
    if not controller.counts_otherwise:
        return
    if data.joints_are == "model":
        words = (
            "The joints look like the controller's: the data fit with them as the robot file says that its controller "
            "counts. Name the columns axis_1, axis_2 and so on, or import them with `joints_are=controller`"
        )
        yield Slip("joints-of-controller", words, replace(data, joints=controller.to_model(data.joints)))
        return
    words = (
        "The joints look like the model's, and came as the controller's: the data fit with them as they are. Name the "
        "columns joint_1, joint_2 and so on, or import them with `joints_are=model`"
    )
    yield Slip("joints-of-model", words, replace(data, joints=controller.from_model(data.joints)))


def as_noted(robot: Robot, data: Dataset, slips: Callable[[Dataset], Iterator[Slip]]) -> Iterator[Slip]:
    """Try slips with joint positions on those that were noted: on the controller's, where they came as such."""
    if data.joints_are != "converted":
        yield from slips(data)
        return
    for slip in slips(in_controller_joints(robot, data)):
        yield replace(slip, data=in_model_joints(robot, slip.data))


def sign_slips(data: Dataset, size: int = 1) -> Iterator[Slip]:
    """Try the opposite signs of so many joints at once."""
    for group in map(list, combinations(range(data.joints.shape[1]), size)):
        joints = data.joints.copy()
        joints[:, group] *= -1
        which = " and ".join(str(i + 1) for i in group)
        words = f"The sign of joint {which} is opposite to the robot's: the data fit with it changed. "
        yield Slip(
            "joint-sign", words + "Change it in the data, or correct the robot file", replace(data, joints=joints)
        )


def order_slips(data: Dataset) -> Iterator[Slip]:
    """Try two joints exchanged."""
    for a, b in combinations(range(data.joints.shape[1]), 2):
        joints = data.joints.copy()
        joints[:, [a, b]] = joints[:, [b, a]]
        words = f"Joints {a + 1} and {b + 1} are in the wrong order: the data fit with the columns exchanged. "
        yield Slip("joint-sign", words + "Exchange their columns", replace(data, joints=joints))


def shifted(data: Dataset) -> Iterator[Slip]:
    """Try the joint positions of the row before, and of the row after."""
    for by, words in ((1, "before"), (-1, "after")):
        joints = np.roll(data.joints, by, axis=0)
        said = f"The readings of each configuration fit the joint positions of the one {words} it: the columns are "
        yield Slip("rows-shifted", said + "shifted by one row. Shift them back", replace(data, joints=joints))
