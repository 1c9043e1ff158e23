"""Data-entry errors with units, signs, orders, axes and orientations, each as the data would be with it corrected."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations, permutations, product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import Notice, Rule
from truearm.engine.data.controller_joints import in_controller_joints, in_model_joints
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.rigid_tool import FARTHEST, LENGTH_FACTORS, UNIT_LENGTH
from truearm.engine.fit.frames import initial_frames
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import (
    Transform,
    rotation_from_quaternion,
    rotation_from_vector,
    rotation_vector,
    turned_about,
)

#: Largest ratio of the stretches along three axes that is still called a scale.
_MOST_UNEVEN: Final = 1.2
#: Cosine between two axes of an instrument that are still called square.
_SQUARE: Final = 0.1
#: So many configurations are named.
_MOST_NAMED: Final = 5
#: No joint turns farther to one side, in turns.
_MOST_TURNS: Final = 1.5
#: Units that lengths are given in [m], and how far a factor found by the nominal robot may be from that of two of them.
_LENGTHS: Final = (1e-6, 1e-3, 1e-2, 1.0, 0.0254, 0.3048)
_SAME_FACTOR: Final = 0.02


UNIT_ANGLE: Final = Rule(
    "unit-angle",
    "error",
    "joint positions that fit in the other unit of angle, of all joints or of one, at all configurations or [at "
    "some](check.md#wrong-joint-positions)",
)
MIRRORED: Final = Rule(
    "mirrored", "error", "positions that fit their mirror image: two columns exchanged, or a wrong sign"
)
JOINTS_OF_CONTROLLER: Final = Rule(
    "joints-of-controller",
    "error",
    "joint positions that fit as what the [controller shows](robots.md#joint-positions-and-frames-of-the-pendant), "
    "and came as the model's",
)
JOINTS_OF_MODEL: Final = Rule(
    "joints-of-model", "error", "joint positions that fit as the model's, and came as what the controller shows"
)
JOINT_SIGN: Final = Rule(
    "joint-sign",
    "error",
    "joint positions that fit with the opposite sign of up to three joints, with one or two counted otherwise (a zero "
    "that is 90 or 180 deg off, joint 3 from joint 2 or from the ground), or with two columns exchanged",
)
ROWS_SHIFTED: Final = Rule(
    "rows-shifted",
    ("error", "warning"),
    "joint positions that fit one row earlier or later; or, at some configurations, that were exchanged among these: a "
    "warning, and an error where they pull the fit, with the losses `linear` and `huber`",
)


@dataclass(frozen=True, eq=False)
class EntryError:
    """One data-entry error, corrected."""

    rule: Rule  #: Of the notice.
    words: str  #: What happened and what to do about it, without a full stop.
    data: Dataset  #: The data as they should be.
    #: Configuration and target of the readings that it is about; empty if it is about all.
    at: tuple[tuple[str, str], ...] = ()

    @property
    def notice(self) -> Notice:
        """What is said if it explains the data."""
        return self.rule(f"{self.words}.", at=self.at)


# -- lengths -----------------------------------------------------------------------------------------------


def length_entry_errors(data: Dataset) -> Iterator[EntryError]:
    """Try lengths in another unit."""
    for factor, words in LENGTH_FACTORS:
        if factor > 1.0 and np.nanmax(np.abs(data.position), initial=0.0) * factor > FARTHEST:
            continue
        quantity = "positions" if data.fixture is None else "lengths"
        words = f"The {quantity} are {words}. Fix the unit in the header"
        yield EntryError(UNIT_LENGTH, words, _scaled(data, factor))


def _scaled(data: Dataset, factor: float) -> Dataset:
    """Return the data with all measured lengths so many times as large."""

    def scaled(values: Array | None) -> Array | None:
        return None if values is None else values * factor

    setup = None if data.setup is None else _scaled(data.setup, factor)
    more = {"distance": scaled(data.distance), "height": scaled(data.height), "setup": setup}
    return replace(data, position=data.position * factor, **more)  # type: ignore[arg-type]


def scale_entry_errors(robot: Robot, data: Dataset) -> Iterator[EntryError]:
    """Try the factor by which readings are larger than the robot, from the linear map that takes them onto it.

    Of ``B y = R_c t + p_c + u`` the map B, the targets t and u are found by least squares. Where B stretches all axes
    alike, its inverse is a turn times the factor. A factor between no two units is that of another robot.
    """
    p, R = robot.with_frames(Transform(), {}).world_poses(data.postures)
    readings = np.flatnonzero(data.has_position)
    configuration, target = data.configuration[readings], data.target[readings]
    y = data.position[readings] - data.position[readings].mean(axis=0)
    seen = np.unique(target)
    unknowns = 9 + 3 * len(seen) + 3
    if 3 * len(readings) < 2 * unknowns:
        return
    rows = np.zeros((len(readings), 3, unknowns))
    for i in range(3):
        rows[:, i, 3 * i : 3 * i + 3] = y
    for column, t in enumerate(seen.tolist()):
        of_target = target == t
        rows[of_target, :, 9 + 3 * column : 12 + 3 * column] = -R[configuration[of_target]]
    rows[:, :, -3:] = -np.eye(3)
    solution = np.linalg.lstsq(rows.reshape(-1, unknowns), p[configuration].reshape(-1), rcond=1e-10)[0]
    onto = np.asarray(solution[:9].reshape(3, 3), dtype=float)
    stretch = np.linalg.svd(onto, compute_uv=False)
    if stretch[2] <= 0.0:
        return
    if stretch[0] > _MOST_UNEVEN * stretch[2]:
        yield from _column_entry_errors(data, onto)
        return
    factor = float(np.prod(stretch)) ** (1 / 3)
    if all(abs(factor * a / b - 1.0) > _SAME_FACTOR for a, b in permutations(_LENGTHS, 2)):
        return
    size = f"{1 / factor:.4g} times too large" if factor < 1 else f"{factor:.4g} times too small"
    yield EntryError(
        UNIT_LENGTH, f"The positions are {size} for this robot. Fix them or their unit", _scaled(data, factor)
    )


def _column_entry_errors(data: Dataset, onto: Array) -> Iterator[EntryError]:
    """Try single columns of positions in another unit, from the linear map that takes readings onto the robot."""
    stretch = np.linalg.norm(onto, axis=0)
    turned = onto / stretch
    off = np.abs(stretch - 1.0) > _MOST_UNEVEN - 1.0
    if np.abs(turned.T @ turned - np.eye(3)).max() > _SQUARE or off.all():
        return
    sizes = [f"{1 / by:.4g} times too large" if by < 1 else f"{by:.4g} times too small" for by in stretch.tolist()]
    words = " and ".join(f"the column {axis} of the positions is {sizes[i]}" for i, axis in enumerate("xyz") if off[i])
    corrected = data.position * np.where(off, stretch, 1.0)
    words = f"For this robot {words}. Fix the unit in the header, or the numbers"
    yield EntryError(UNIT_LENGTH, words, replace(data, position=corrected))


def mirrored(data: Dataset) -> Iterator[EntryError]:
    """Try the mirror image of the positions."""
    words = (
        "The positions are mirrored: two of the columns x, y and z are exchanged, the sign of one is wrong, or a "
        "camera mirrored its pictures. The data fit with their mirror image. Fix that; an instrument's axes are "
        "right-handed"
    )
    yield EntryError(MIRRORED, words, replace(data, position=data.position * np.array([1.0, 1.0, -1.0])))


# -- joints ------------------------------------------------------------------------------------------------


def _turning(data: Dataset) -> list[int]:
    return [i for i in range(data.joints.shape[1]) if data.joint_kinds[i] == "revolute"]


def angle_entry_errors(data: Dataset) -> Iterator[EntryError]:
    """Try joint positions in the other unit of angle, of all joints or of one."""
    turning = _turning(data)
    for factor, words in ((math.pi / 180, "degrees are called rad"), (180 / math.pi, "radians are called deg")):
        for group in [turning, *([i] for i in turning)]:
            if not group:
                continue
            joints = data.joints.copy()
            joints[:, group] *= factor
            subject = "The joints" if len(group) > 1 else f"Joint {group[0] + 1}"
            words_of = f"{subject}: {words}. Fix the unit in the header"
            yield EntryError(UNIT_ANGLE, words_of, replace(data, joints=joints))


def mixed_angle_entry_errors(data: Dataset) -> Iterator[EntryError]:
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
        configurations = np.flatnonzero(mask)
        if not 0 < len(configurations) < data.configurations:
            continue
        joints = data.joints.copy()
        joints[np.ix_(configurations, np.array(turning))] *= factor
        first = ", ".join(data.labels[c] for c in configurations[:_MOST_NAMED].tolist())
        some = f"{first} and others" if len(configurations) > _MOST_NAMED else first
        words_of = f"The joints: {words}, at some configurations alone ({some}). Fix the numbers of these rows"
        yield EntryError(UNIT_ANGLE, words_of, replace(data, joints=joints))


def controller_entry_errors(robot: Robot, data: Dataset) -> Iterator[EntryError]:
    """Try joint positions as those that the controller shows, and the other way round."""
    controller = robot.controller
    if not controller.counts_otherwise:
        return
    if data.joints_are == "model":
        words = (
            "The joints look like the controller's: the data fit with them as the robot file says that its controller "
            "counts. Name the columns axis_1, axis_2 and so on, or import them with `joints_are=controller`"
        )
        yield EntryError(JOINTS_OF_CONTROLLER, words, replace(data, joints=controller.to_model(data.joints)))
        return
    words = (
        "The joints look like the model's, and came as the controller's: the data fit with them as they are. Name the "
        "columns joint_1, joint_2 and so on, or import them with `joints_are=model`"
    )
    yield EntryError(JOINTS_OF_MODEL, words, replace(data, joints=controller.from_model(data.joints)))


def as_noted(robot: Robot, data: Dataset, entries: Callable[[Dataset], Iterator[EntryError]]) -> Iterator[EntryError]:
    """Try data-entry errors on joint positions as they were noted: on the controller's, where they came as such."""
    if data.joints_are != "converted":
        yield from entries(data)
        return
    for entry in entries(in_controller_joints(robot, data)):
        yield replace(entry, data=in_model_joints(robot, entry.data))


def sign_entry_errors(data: Dataset, size: int = 1) -> Iterator[EntryError]:
    """Try the opposite signs of so many joints at once."""
    for group in map(list, combinations(range(data.joints.shape[1]), size)):
        joints = data.joints.copy()
        joints[:, group] *= -1
        numbers = " and ".join(str(i + 1) for i in group)
        words = f"The sign of joint {numbers} is opposite to the robot's: the data fit with it changed. "
        yield EntryError(
            JOINT_SIGN, words + "Change it in the data, or correct the robot file", replace(data, joints=joints)
        )


def count_entry_errors(data: Dataset, size: int = 1) -> Iterator[EntryError]:
    """Try so many joints at once that are counted otherwise: another zero, from the ground, or the other way round.

    What :func:`sign_entry_errors` tries is left out.
    """
    for group in combinations(list(_other_counts(data)), size):
        places = [i for i, _, _ in group]
        if len({*places}) < size or all(how == f"-joint {i + 1}" for i, _, how in group):
            continue
        joints = data.joints.copy()
        for i, positions, _ in group:
            joints[:, i] = positions
        subject = f"Joint {places[0] + 1} is" if size == 1 else f"Joints {' and '.join(str(i + 1) for i in places)} are"
        instead = " and ".join(f"{how} instead of joint {i + 1}" for i, _, how in group)
        words = f"{subject} counted otherwise than in the robot file: the data fit with {instead}. "
        words += "Change that in the data, or correct the robot file"
        yield EntryError(JOINT_SIGN, words, replace(data, joints=joints))


def _other_counts(data: Dataset) -> Iterator[tuple[int, Array, str]]:
    """Return ways to count joints otherwise: which joint from 0, its positions, and how in words.

    The zeros of the first and of the last joint are no more than turns of the base and of the targets.
    """
    turning, last = _turning(data), data.joints.shape[1] - 1
    for i in turning:
        for sign, quarters in product((1.0, -1.0), (0, 1, -1, 2, -2)):
            if (quarters and i in (0, last)) or (sign > 0.0 and not quarters):
                continue
            zero = "" if not quarters else f" {'+' if quarters > 0 else '-'} {abs(quarters) * 90} deg"
            how = f"{'-' if sign < 0.0 else ''}joint {i + 1}{zero}"
            yield i, sign * data.joints[:, i] + quarters * math.pi / 2, how
    if 1 in turning and 2 in turning:
        for sign, by in product((1.0, -1.0), repeat=2):
            how = f"{'-' if sign < 0.0 else ''}joint 3 {'+' if by > 0.0 else '-'} joint 2"
            yield 2, sign * data.joints[:, 2] + by * data.joints[:, 1], how


def order_entry_errors(data: Dataset) -> Iterator[EntryError]:
    """Try two joints exchanged."""
    for a, b in combinations(range(data.joints.shape[1]), 2):
        joints = data.joints.copy()
        joints[:, [a, b]] = joints[:, [b, a]]
        words = f"Joints {a + 1} and {b + 1} are in the wrong order: the data fit with the columns exchanged. "
        yield EntryError(JOINT_SIGN, words + "Exchange their columns", replace(data, joints=joints))


def shifted(data: Dataset) -> Iterator[EntryError]:
    """Try the joint positions of the row before, and of the row after."""
    for by, words in ((1, "before"), (-1, "after")):
        joints = np.roll(data.joints, by, axis=0)
        message = f"The readings of each configuration fit the joint positions of the one {words} it: the columns are "
        yield EntryError(ROWS_SHIFTED, message + "shifted by one row. Shift them back", replace(data, joints=joints))


# Data-entry errors with orientations: quaternions in another order, turns the other way round, angles of another
# convention.
#
# Readings hold quaternions alone. What three angles they came from is not known, so every way to write three numbers is
# tried as the one that was taken, with every other one as the one that was meant: the numbers are found again from the
# orientations by the first, and read by the second. Twelve orders of axes that move along and the same twelve about
# fixed axes (Craig, Introduction to Robotics, appendix B), and rotation vectors; in radians, and in radians that were
# called degrees.

ORIENTATION_ORDER: Final = Rule(
    "orientation-order",
    "error",
    "orientations, all or some, that would turn as the robot does if their numbers were read otherwise: [angles by "
    "another convention](check.md#orientations-read-by-another-convention), quaternions in another order, or their "
    "inverse, as of transposed matrices; or [inverted poses](hand-eye.md#a-table-that-is-wrong)",
    cure="Fix the mapping, or whatever made quaternions of them.",
    formerly="quaternion-order",
)
#: Orientations of a nominal robot agree better than this [rad]; a wrong order of a quaternion leaves 1 rad and more.
_TURNED_WITHIN: Final = 0.1
#: A data-entry error explains orientations that it leaves so near to the robot's [rad], and so many times nearer than
#: they came.
_EXPLAINED_WITHIN: Final = 0.03
_LEAST_IMPROVEMENT: Final = 4.0
#: Data-entry errors that leave so little more than the best one are as good.
_AS_GOOD: Final = 1.5
#: So many ways that are as good are told one by one.
_MOST_LISTED: Final = 3
#: Fewer orientations agree with one of so many ways by chance.
_FEWEST: Final = 6
#: Of single rows, where it is known how they should turn, so few.
_FEWEST_ROWS: Final = 2
#: And so many times nearer than they came.
_IMPROVEMENT_OF_ROWS: Final = 10.0
_ORDERS: Final = tuple("".join(axes) for axes in product("xyz", repeat=3) if axes[0] != axes[1] != axes[2])
#: Conventions that controllers and instruments write most often; None is a rotation vector.
_COMMON: Final = frozenset({"zyx moving", "xyz moving", "zyz moving", "zxz moving", "xyz fixed", "zyx fixed", None})
_INVERSE: Final = np.array([1.0, -1.0, -1.0, -1.0])
#: Orders of a quaternion's numbers that programs write, beside w, x, y, z: in words, and where w, x, y and z stand.
_NUMBERS: Final = (
    ("their numbers are in the order x, y, z, w", [3, 0, 1, 2]),
    ("w, x, y, z were taken for x, y, z, w", [1, 2, 3, 0]),
)


def orientation_entry_errors(robot: Robot, data: Dataset) -> list[Notice]:
    """Return which data-entry error makes orientations agree with the robot; nothing if they do, or if none does.

    Args:
        robot: The nominal robot, which is placed by the positions.
    """
    if data.quaternion is None or not data.has_orientation.any():
        return []
    placed = initial_frames(robot, replace(data, quaternion=None, sigma_rot=None))
    readings = _Readings.of(placed, data)
    if not readings.rows:
        return []
    read = data.quaternion[readings.taken]
    as_given = readings.left(rotation_from_quaternion(read))
    if as_given <= _TURNED_WITHIN:
        return []
    left, words = min(
        (readings.left(rotation_from_quaternion(corrected)), words) for words, corrected in _of_numbers(read)
    )
    if left * _LEAST_IMPROVEMENT <= as_given:
        return [ORIENTATION_ORDER(f"The quaternions do not turn as the robot does: {words}.")]
    if readings.rows < _FEWEST:
        return []
    return _of_angles(readings, rotation_from_quaternion(read), as_given)


def pose_entry_errors(data: Dataset) -> Iterator[EntryError]:
    """Try poses that are inverted, and quaternions in another order that have bent the places too.

    Of a camera on the flange the poses that come are inverted before they are measurements. So where the instrument is,
    seen from the target, stays right whatever is wrong with the quaternion.
    """
    if data.quaternion is None or not data.has_orientation[data.has_position].all():
        return
    inverse = data.quaternion * _INVERSE
    seen = np.einsum("nij,nj->ni", rotation_from_quaternion(inverse), data.position)
    words = (
        "The poses are inverted: each is that of the instrument, seen from the target. Invert them. Of a camera and a "
        "board either the other one is on the flange, or the table has the camera in the board"
    )
    yield EntryError(ORIENTATION_ORDER, words, replace(data, position=-seen, quaternion=inverse))
    for words, order in _NUMBERS:
        turned = inverse[:, order] * _INVERSE
        position = np.einsum("nij,nj->ni", rotation_from_quaternion(turned), seen)
        words = f"The quaternions do not turn as the robot does: {words}. Exchange the columns"
        yield EntryError(ORIENTATION_ORDER, words, replace(data, position=position, quaternion=turned))


def _of_numbers(read: Array) -> Iterator[tuple[str, Array]]:
    """Return the quaternions as they would be with their numbers in another order, or turning the other way round."""
    yield "they turn the other way round, as transposed matrices do. Change the sign of qw", read * _INVERSE
    for words, order in _NUMBERS:
        yield f"{words}. Exchange the columns", read[:, order]
        yield f"{words}, and they turn the other way round. Fix the columns", read[:, order] * _INVERSE


@dataclass(frozen=True, eq=False)
class _Readings:
    """Orientations of targets that have several, and those of the flange at the same configurations."""

    flange: Array  #: Of the placed robot, transposed, ``(rows, 3, 3)``.
    taken: IntArray  #: Which readings of the data they are, target by target, ``(rows,)``.
    ends: tuple[int, ...]  #: Behind the last row of each target.

    @classmethod
    def of(cls, placed: Robot, data: Dataset) -> _Readings:
        """Return those of some data."""
        groups = [np.flatnonzero(data.has_orientation & (data.target == t)) for t in range(len(data.targets))]
        groups = [group for group in groups if len(group) > 1]
        taken = np.concatenate([*groups, np.zeros(0, dtype=np.intp)]).astype(np.intp)
        _, R = placed.world_poses(data.postures)
        ends = tuple(np.cumsum([len(group) for group in groups]).tolist())
        return cls(np.swapaxes(R[data.configuration[taken]], 1, 2), taken, ends)

    @property
    def rows(self) -> int:
        """How many there are."""
        return len(self.taken)

    def left(self, *ways: Array) -> float:
        """Return how far targets' orientations on the flange differ from their means, as a root mean square [rad].

        Args:
            ways: What was read, ``(rows, 3, 3)``. Of two ways that wins in each row that is nearer to the other rows.
        """
        squares, start = 0.0, 0
        on_flange = [self.flange @ turned for turned in ways]
        for end in self.ends:
            groups = [turned[start:end] for turned in on_flange]
            start = end
            squares += min(_squares_off(_nearest(groups, first[0])) for first in groups)
        return float(np.sqrt(squares / self.rows))


def _nearest(ways: list[Array], to: Array) -> Array:
    """Return of each row the way that is nearest to a rotation."""
    if len(ways) == 1:
        return ways[0]
    near = [np.einsum("nij,ij->n", turned, to) for turned in ways]
    return np.where((near[0] >= near[1])[:, None, None], ways[0], ways[1])


def _squares_off(R: Array) -> float:
    """Return the sum of squares of the angles between rotations and their mean."""
    U, _, Vt = np.linalg.svd(R.mean(axis=0))
    mean = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    return float(np.sum(rotation_vector(mean.T @ R) ** 2))


# -- angles ------------------------------------------------------------------------------------------------


def _of_angles(readings: _Readings, turned: Array, as_given: float) -> list[Notice]:
    """Say as what the numbers of the orientations agree with the robot's, if they do as another convention's."""
    tried = []
    for rare, words, ways in _other_conventions(turned):
        left = readings.left(*ways)
        if left <= _EXPLAINED_WITHIN and left * _LEAST_IMPROVEMENT <= as_given:
            tried.append((rare, left, words))
    least = min((left for _, left, _ in tried), default=0.0)
    alternatives = [words for _, left, words in sorted(tried) if left <= _AS_GOOD * least]
    if not alternatives:
        return []
    return [
        ORIENTATION_ORDER(
            "The orientations do not turn as the robot does, and would if their three numbers were read otherwise: "
            f"{_first_of(alternatives)}."
        )
    ]


def entry_errors_in_rows(read: Array, predicted: Array) -> tuple[NDArray[np.bool_], str]:
    """Return which single orientations turn as they should when they are read otherwise, and how in words.

    Of all ways the one is taken that explains most of them: it must explain two, or one by the order of a quaternion.

    Args:
        read: Quaternions as they came, ``(rows, 4)``.
        predicted: How they should turn, ``(rows, 3, 3)``.
    """
    turned = rotation_from_quaternion(read)
    allowed = np.minimum(_EXPLAINED_WITHIN, _angles_between([turned], predicted) / _IMPROVEMENT_OF_ROWS)
    of_numbers = [(0, words, [rotation_from_quaternion(corrected)]) for words, corrected in _of_numbers(read)]
    for fewest, ways in ((1, of_numbers), (_FEWEST_ROWS, _other_conventions(turned))):
        tried = []
        for rare, words, turns in ways:
            off = _angles_between(turns, predicted)
            explained = off <= allowed
            if explained.sum() >= fewest:
                left = float(np.sqrt(np.mean(off[explained] ** 2)))
                tried.append((-int(explained.sum()), rare, left, words, explained))
        if tried:
            most = [trial for trial in tried if trial[0] == min(count for count, *_ in tried)]
            least = min(left for _, _, left, _, _ in most)
            likely = sorted((rare, left, words) for _, rare, left, words, _ in most if left <= _AS_GOOD * least)
            rows = next(explained for *_, words, explained in most if words == likely[0][2])
            return rows, _first_of([words for *_, words in likely])
    return np.zeros(len(read), dtype=bool), ""


def _other_conventions(turned: Array) -> Iterator[tuple[int, str, list[Array]]]:
    """Try each way to write three numbers as the one that was taken with each other one as the one that was meant.

    Yields:
        How many of both are rare, what happened in words, and the rotations that were meant, ``(rows, 3, 3)``: one way,
        or two of which one is right in each row.
    """
    for taken in (*_ORDERS, None):
        ways = _vectors(turned) if taken is None else _moving_angles(turned, taken)
        for factor in (1.0, 180.0 / np.pi):
            for meant in (*(f"{order} {axes}" for order in _ORDERS for axes in ("moving", "fixed")), None):
                if taken is None and meant is None and factor == 1.0:
                    continue
                alike = taken is not None and meant is not None and _is_proper(taken) == _is_proper(meant)
                for read in _as_read(taken, meant):
                    columns = slice(None, None, -1) if read is not None and read.endswith("fixed") else slice(None)
                    rare = (read not in _COMMON, meant not in _COMMON)
                    numbers = [n[:, columns] * factor for n in (ways[:1] if alike else ways)]
                    yield sum(rare), _in_words(read, meant, factor != 1.0), [_rotations(n, meant) for n in numbers]


def _first_of(alternatives: list[str]) -> str:
    """Return the first ways in words, and how many more there are."""
    more = len(alternatives) - _MOST_LISTED
    beyond = f"; or in {more} other ways, which these configurations do not tell apart" if more > 0 else ""
    return f"{'; or '.join(alternatives[:_MOST_LISTED])}{beyond}"


def _angles_between(ways: list[Array], predicted: Array) -> Array:
    """Return how far rotations are from those predicted [rad], ``(rows,)``; of several ways by the nearest."""
    gaps = [np.linalg.norm(rotation_vector(np.swapaxes(predicted, 1, 2) @ turned), axis=1) for turned in ways]
    return np.asarray(np.min(gaps, axis=0))


def _as_read(taken: str | None, meant: str | None) -> list[str | None]:
    """Return the ways in which numbers may have been read that are angles about moving axes in an order.

    Turns about fixed axes are those about moving ones in the opposite order, with the columns in that order. As what
    angles were meant, both ways to have read them tell the same; a rotation vector's numbers stand in their own order.
    """
    if taken is None:
        return [None]
    return [f"{taken} moving", *([f"{taken[::-1]} fixed"] if meant is None else [])]


def _rotations(numbers: Array, meant: str | None) -> Array:
    """Return the rotations that numbers mean, ``(rows, 3, 3)``; None for a rotation vector."""
    if meant is None:
        return rotation_from_vector(numbers)
    order, _, axes = meant.partition(" ")
    first, second, third = (turned_about("xyz".index(a), column) for a, column in zip(order, numbers.T, strict=True))
    return np.asarray(first @ second @ third if axes == "moving" else third @ second @ first)


def _vectors(R: Array) -> list[Array]:
    """Return the two shortest rotation vectors of rotations [rad], ``(n, 3)`` each."""
    short = rotation_vector(R)
    angle = np.linalg.norm(short, axis=1, keepdims=True)
    return [short, short * (1.0 - 2.0 * np.pi / np.maximum(angle, 1e-9))]


def _is_proper(order: str) -> bool:
    """Return whether the first axis comes again, so that the middle angle is from 0 to 180 deg, and not within 90."""
    return order[0] == order[2]


def _moving_angles(R: Array, order: str) -> list[Array]:
    """Return the two ways to write rotations as angles about three axes that move along [rad], ``(n, 3)`` each.

    The usual one is first: its middle angle is within 90 deg of 0, or from 0 to 180 deg where an axis comes again.
    """
    i, j = "xyz".index(order[0]), "xyz".index(order[1])
    k = 3 - i - j
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    if _is_proper(order):
        middle = np.arccos(np.clip(R[:, i, i], -1.0, 1.0))
        first = np.arctan2(R[:, j, i], -sign * R[:, k, i])
        last = np.arctan2(R[:, i, j], sign * R[:, i, k])
    else:
        middle = np.arcsin(np.clip(sign * R[:, i, k], -1.0, 1.0))
        first = np.arctan2(-sign * R[:, j, k], R[:, k, k])
        last = np.arctan2(-sign * R[:, i, j], R[:, i, i])
    other = -middle if _is_proper(order) else np.pi - middle
    second = np.column_stack([first + np.pi, other, last + np.pi])
    return [np.column_stack([first, middle, last]), (second + np.pi) % (2.0 * np.pi) - np.pi]


def _in_words(read: str | None, meant: str | None, degrees: bool) -> str:
    """Say as what numbers were read, and as what they agree, by the entries of a mapping.

    Turns about moving axes are those about fixed ones in the opposite order, with the columns in that order.
    """
    unit = ", and as radians that were called degrees" if degrees else ""
    if read is None or meant is None:
        return f"not {_way(read)} but {_way(meant)}{unit}"
    if meant == read:
        return f"{_way(meant)}, but in radians that were called degrees"
    order, _, axes = meant.partition(" ")
    opposite = {"moving": "fixed", "fixed": "moving"}[axes]
    other = f" (of the columns from right to left: not {_way(f'{read[2::-1]} fixed')} but "
    other += f"{_way(f'{order[::-1]} {opposite}')})"
    return f"not {_way(read)} but {_way(meant)}{other}{unit}"


def _way(way: str | None) -> str:
    if way is None:
        return "a rotation vector"
    order, _, axes = way.partition(" ")
    return f"angles about {order} of {axes} axes"
