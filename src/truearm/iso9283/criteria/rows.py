"""Rows of attained poses, checked against the plan and put together: the cycles of one pose under one condition."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, nearest_names
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion, rotation_vector
from truearm.iso9283.criteria.alignment import Alignment, best_fit
from truearm.iso9283.criteria.intervals import Interval
from truearm.iso9283.planning.criteria import TEST_OF, TESTS, PerformancePlan
from truearm.iso9283.planning.records import AttainedPoses, Names, Samples

#: ``too-few-cycles``: fewer than planned, the value stands nevertheless. ``instrument-too-coarse``: what the instrument
#: does not know is more than a quarter of the value.
Status = Literal["measured", "not-measured", "too-few-cycles", "instrument-too-coarse"]
#: Of a pose or a path: its position as a whole, an axis of the base, or an angle about one.
Component = Literal["position", "x", "y", "z", "a", "b", "c"]
Quantity = Literal["length", "angle", "time", "ratio", "speed", "compliance"]


@dataclass(frozen=True)
class Conditions:
    """Under what something was measured."""

    velocity: float | None = None  #: velocity, load: shares of the rated ones, 0 to 1; None where it does not matter.
    load: float | None = None
    robot: str = ""  #: Its name where several were measured.


@dataclass(frozen=True)
class Value:
    """A value of a criterion."""

    id: str  #: One of :data:`truearm.iso9283.planning.criteria.CRITERIA`.
    component: Component  #: What of it.
    where: str  #: The pose, the two poses, the path or the corner: ``P1``, ``P2-P4``, ``line``, ``rectangle E2``.
    value: float  #: In SI units (a share for a ratio); NaN where it was not measured.
    quantity: Quantity  #: What kind of number it is.
    #: From where to where the true value lies with a probability of 95 %; None where nothing can be said.
    interval: tuple[float, float] | None
    cycles: int  #: From how many.
    conditions: Conditions  #: Under what.
    status: Status  #: Whether it can be relied on.
    #: least, largest: of the cycles, where there are too few of them for an interval; None otherwise.
    least: float | None = None
    largest: float | None = None
    bandwidth: float | None = None  #: Frequency up to which it tells what fluctuates [Hz]; None of others.


@dataclass(frozen=True)
class Instrument:
    """What is not known of a reading."""

    sigma: float  #: Standard deviation of each coordinate [m].
    sigma_rot: float | None = None  #: Of each angle [rad]; None where no orientation is read.
    #: rounding, rounding_rot: what rounding in the file leaves open of each coordinate [m], and of each angle [rad], as
    #: standard deviations.
    rounding: float = 0.0
    rounding_rot: float = 0.0

    def reading(self, resolution: float, resolution_rot: float = 0.0) -> Instrument:
        """Return the same instrument as its readings stand in a file: what rounding leaves open is not known either.

        A number rounded to q is off by q / sqrt(12), and an angle by twice that of the quaternion's components.

        Args:
            resolution, resolution_rot: Steps to which positions [m] and components of quaternions were rounded.
        """
        rounding, rounding_rot = resolution / math.sqrt(12.0), 2.0 * resolution_rot / math.sqrt(12.0)
        turned = self.sigma_rot if self.sigma_rot is None else max(self.sigma_rot, rounding_rot)
        return Instrument(max(self.sigma, rounding), turned, rounding, rounding_rot)

    def least_scatter(self, share: float) -> tuple[float, float]:
        """Return below what no scatter of coordinates [m] and angles [rad] is taken: a share of sigma, or rounding."""
        return max(share * self.sigma, self.rounding), max(share * (self.sigma_rot or 0.0), self.rounding_rot)


#: What is not known of a reading may be this share of a value.
COARSE = 0.25


AXES: Final[tuple[Literal["x", "y", "z"], ...]] = ("x", "y", "z")
ANGLES: Final[tuple[Literal["a", "b", "c"], ...]] = ("a", "b", "c")


def valued(
    id: str,
    component: Component,
    place: str,
    cycles: int,
    planned: int,
    conditions: Conditions,
    value: float,
    quantity: Quantity,
    interval: Interval | None = None,
    unknown: float = 0.0,
    *,
    enough: bool = True,
    least: float | None = None,
    largest: float | None = None,
) -> Value:
    """Return a value with its status.

    Args:
        value: NaN if it was not measured.
        planned: How many cycles there should be.
        unknown: What instrument and tie do not know of a reading, a standard deviation.
        enough: Whether there is as much of everything but cycles as planned: approaches, robots.
    """
    status: Status
    if math.isnan(value):
        status = "not-measured"
    elif cycles < planned or not enough:
        status = "too-few-cycles"
    elif unknown > COARSE * abs(value):
        status = "instrument-too-coarse"
    else:
        status = "measured"
    return Value(id, component, place, value, quantity, interval, cycles, conditions, status, least, largest)


# Readings that are those of another cycle to the last digit: copied, or held by the instrument.
#
# No robot comes back to where it was to the last digit of a reading that is finer than it scatters. Rounded readings
# may be equal by chance, and how often is known from how finely they are rounded.

#: Equal rows are copies if fewer pairs of them than this are to be expected in a group by chance.
_BY_CHANCE: Final = 1e-3
#: Differences below this are rounding in the computer [m].
_SAME: Final = 1e-11
#: Chance that two Gaussian numbers with a standard deviation of 1 lie within a small width, per width.
_DENSITY: Final = 0.5 / np.sqrt(np.pi)
#: So many samples in a row, each elsewhere than all others, are not passed twice to the last digit.
_BLOCK: Final = 10


@dataclass(frozen=True)
class CopiedBlock:
    """Samples of a cycle that are those of another one to the last digit."""

    test: str  #: test, place: where.
    place: str
    cycles: tuple[int, int]  #: The first one and the one that is like it; 0 in a stream.
    lines: tuple[int, int]  #: Of the first samples of both.
    count: int  #: How many samples.


def refuse_copied_poses(readings: AttainedPoses) -> None:
    """Refuse two cycles of a pose with one and the same position, where rounding cannot explain it.

    Raises:
        InputError: If there are such rows, naming the first two.
    """
    columns = [readings.criterion.code, readings.pose.code, readings.robot.code, readings.approach.code]
    shares = [np.unique(share, return_inverse=True)[1].reshape(-1) for share in (readings.velocity, readings.load)]
    group = np.unique(np.column_stack([*columns, *shares]), axis=0, return_inverse=True)[1].reshape(-1)
    order = np.argsort(group, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(group[order])) + 1)
    scatters = [readings.position[rows].std(axis=0, ddof=1) for rows in groups if len(rows) > 1]
    if not scatters:
        return
    usual = _middle(np.array(scatters))
    step = _resolution(readings.position)
    copies: list[tuple[int, int]] = []
    for rows in groups:
        pairs = _equal(readings.position[rows])
        if not pairs:
            continue
        own = readings.position[rows].std(axis=0, ddof=1)
        scatter = np.where(own > _SAME, np.minimum(own, usual), usual)
        if not (scatter > _SAME).all():
            continue
        chance = float(np.prod(np.minimum(_DENSITY * step / scatter, 1.0))) * len(rows) * (len(rows) - 1) / 2
        if chance < _BY_CHANCE:
            copies += [(int(rows[i]), int(rows[j])) for i, j in pairs]
    if not copies:
        return
    first, second = min(copies, key=lambda pair: pair[1])
    raise InputError(
        f"{len(copies)} row{'s' * (len(copies) != 1)} with the position of another cycle of the same pose, to the last "
        "digit",
        where=f"{readings.source}, lines {int(readings.line[first])} and {int(readings.line[second])}",
        came=f"cycles {int(readings.cycle[first])} and {int(readings.cycle[second])} of {_name(readings.pose, first)}",
        allowed="readings that scatter as those of the other cycles",
        cure="A row was copied, or the instrument held its value: write what was read, or remove the cycle.",
    )


def copied_blocks(samples: Samples) -> tuple[CopiedBlock, ...]:
    """Return samples of a cycle that another one of the same place has too, one block for each two cycles."""
    blocks: dict[tuple[str, str, int, int], CopiedBlock] = {}
    place = np.unique(np.column_stack([samples.criterion.code, samples.place.code]), axis=0, return_inverse=True)[1]
    place = place.reshape(-1)
    bits = np.ascontiguousarray(samples.position).view(np.uint64)
    with np.errstate(over="ignore"):
        mixed = (bits * np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)).sum(axis=1)
    for code in range(int(place.max(initial=-1)) + 1):
        rows = np.flatnonzero(place == code)
        for first, second, count in _blocks(mixed[rows], samples.cycle[rows]):
            row, other = int(rows[first]), int(rows[second])
            if not (samples.position[row] == samples.position[other]).all():
                continue
            cycles = int(samples.cycle[row]), int(samples.cycle[other])
            test, name = _name(samples.criterion, row), _name(samples.place, row)
            block = CopiedBlock(test, name, cycles, (int(samples.line[row]), int(samples.line[other])), count)
            known = blocks.get((test, name, *cycles))
            if known is None or known.count < count:
                blocks[test, name, *cycles] = block
    return tuple(blocks.values())


def _blocks(mixed: NDArray[np.uint64], cycle: NDArray[np.intp]) -> list[tuple[int, int, int]]:
    """Return where samples go on as others before them did: the first of both, and how many."""
    order = np.argsort(mixed, kind="stable")
    equal = mixed[order[1:]] == mixed[order[:-1]]
    before = np.full(len(mixed), -1, dtype=np.intp)
    before[order[1:][equal]] = order[:-1][equal]
    moving = (np.diff(mixed) != 0) & (np.diff(cycle) == 0)
    goes_on = (before[1:] == before[:-1] + 1) & (before[:-1] >= 0) & moving
    edges = np.flatnonzero(np.diff(np.concatenate([[False], goes_on, [False]]).astype(np.int8))).reshape(-1, 2)
    long = [(a, b) for a, b in edges.tolist() if b - a + 1 >= _BLOCK and len(set(mixed[a : b + 1].tolist())) >= _BLOCK]
    return [(int(before[a]), a, b - a + 1) for a, b in long]


def _equal(position: Array) -> list[tuple[int, int]]:
    """Return rows that equal another one, each with the first of them."""
    _, first, inverse = np.unique(position, axis=0, return_index=True, return_inverse=True)
    of = first[inverse.reshape(-1)]
    return [(int(of[row]), row) for row in range(len(position)) if of[row] != row]


def _resolution(position: Array) -> float:
    """Return the smallest difference of two coordinates that are not equal [m]: no coarser were they rounded."""
    steps = np.concatenate([np.diff(np.sort(column)) for column in position.T])
    steps = steps[steps > _SAME]
    return float(steps.min()) if len(steps) else float("inf")


def _middle(scatters: Array) -> Array:
    """Return the middle of the scatters that are not 0, axis by axis; 0 where all are."""
    return np.array([np.median(column[column > _SAME]) if (column > _SAME).any() else 0.0 for column in scatters.T])


def _name(names: Names, row: int) -> str:
    return names.names[int(names.code[row])]


#: In a file that is in order but for a few falls of its times by more than this [s], a clock has begun anew.
_FALLS: Final = 2
_FELL: Final = 3600.0


def drift_order(readings: AttainedPoses, rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the order of the rows of one pose and condition: that of time, that of the file where none has a time.

    Raises:
        InputError: If some rows have no time, a clock began anew within the file, or the numbers of cycles contradict
            the times.
    """
    time = readings.time[rows]
    timed = np.isfinite(time)
    if not timed.any():
        return np.arange(len(rows))
    if not timed.all():
        missing = rows[~timed]
        raise InputError(
            f"{len(missing)} row{'s' * (len(missing) != 1)} of drift without a time beside rows with one",
            where=f"{readings.source}, line {int(readings.line[missing[0]])}, column time",
            allowed="a time in every row of dAP, or in none",
            cure="Write the time, or remove the row.",
        )
    fall = -np.diff(time)
    falls = np.flatnonzero(fall > 0)
    if 0 < len(falls) <= _FALLS and (fall[falls] > _FELL).all():
        before, after = rows[falls[0]], rows[falls[0] + 1]
        raise InputError(
            "the time of drift falls by hours in the order of the file",
            where=f"{readings.source}, lines {int(readings.line[before])} and {int(readings.line[after])}",
            came=f"{readings.time[before]:.9g} s, then {readings.time[after]:.9g} s",
            allowed="times since one begin, from cold on",
            cure="Where the clock passed midnight, add 86400 s to the rows behind it. Otherwise sort the rows by time.",
        )
    order = np.argsort(time, kind="stable")
    cycle = readings.cycle[rows][order]
    down = np.flatnonzero(cycle[1:] <= cycle[:-1])
    most = int(np.unique(cycle, return_counts=True)[1].max())
    if len(down) + 1 > most:
        line, other_line = (int(readings.line[rows[order[down[-1] + k]]]) for k in (0, 1))
        raise InputError(
            "the times of drift contradict the numbers of its cycles",
            where=f"{readings.source}, lines {line} and {other_line}",
            came=f"numbers that begin anew {len(down)} times in the order of time",
            allowed=f"{most - 1} times, as no number is there more than {most} times",
            cure="Check the times, where a clock passed midnight too, and the cycles; number each group from 1.",
        )
    return np.asarray(order)


# Orientations that no robot attains: quaternions in another order, or frames that were taken for others.
#
# A robot that is worth a test misses its orientation by tenths of a degree. What is off by more than ten degrees was
# written, or tied to the base, in another way than it was read.

#: Further from its command than this no robot comes to rest [rad].
LIMIT: Final = math.radians(10.0)
#: So many rows tell whether another reading of the columns fits.
_TRIED: Final = 500


def refuse_far_orientations(
    attained: Array, commanded: Array, turn: Array, line: NDArray[np.intp], source: str, limit: float = LIMIT
) -> None:
    """Refuse orientations that are further from their command than a limit.

    Args:
        attained: In the base frame, ``(n, 3, 3)``.
        commanded: ``(n, 3, 3)``, or one for all, ``(3, 3)``.
        turn: Rotation of the instrument's frame in the base frame, ``(3, 3)``: the attained are this one times what was
            read.
        line: Of each in the file, ``(n,)``.
        source: The file.
        limit: [rad].

    Raises:
        InputError: That names the first row, how many there are, and what was probably written instead, if that fits.
    """
    commanded = np.broadcast_to(commanded, attained.shape)
    off = _angle(attained, commanded)
    far = np.flatnonzero(off > limit)
    if not len(far):
        return
    row = int(far[0])
    few = far[:: max(1, len(far) // _TRIED)]
    raise InputError(
        f"{len(far)} of {len(off)} orientations further from the command than robots are",
        where=f"{source}, line {int(line[row])}, columns qw to qz",
        came=f"{math.degrees(off[row]):.1f} deg off",
        allowed=f"up to {math.degrees(limit):g} deg",
        cure=_cure(attained[few], commanded[few], turn, limit, 2 * len(far) > len(off)),
    )


def _angle(rotation: Array, other: Array) -> Array:
    """Return by how much rotations differ [rad], ``(n,)``."""
    trace = np.einsum("nij,nij->n", rotation, other)
    return np.asarray(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)))


def _cure(attained: Array, commanded: Array, turn: Array, limit: float, most: bool) -> str:
    """Return what was probably written instead of what was read."""
    read = turn.T @ attained
    w, x, y, z = quaternion_from_rotation(read).T

    def fits(rotation: Array) -> bool:
        return bool((_angle(turn @ rotation, commanded) < limit).mean() > 0.9)

    if fits(rotation_from_quaternion(np.stack([z, w, x, y], axis=1))):
        return "The numbers seem to be in the order x, y, z, w: name the columns qx, qy, qz, qw."
    if fits(read.swapaxes(1, 2)):
        return "The inverse rotations fit: write the tip's orientation in the instrument's frame, not the other way."
    if not most:
        return "Look at the record of these rows: correct them, or measure the poses again."
    apart = commanded.swapaxes(1, 2) @ attained
    if (_angle(apart, np.broadcast_to(apart[0], apart.shape)) < limit).all():
        return (
            "All are turned alike: give the orientation of the plan's tip, not of the reflector or probe, and check "
            "the rotation of the alignment."
        )
    return "Check that the columns are the quaternion's w, x, y, z, the frame of the tip, and the alignment."


#: How far outside the cube is rounding [m].
_ROUNDING: Final = 1e-9
#: A row is at another pose if that is nearer than this share of the distance to its own.
_NEARER: Final = 0.5
#: A velocity or load is the plan's if it differs by less, as a share: rounding in a table.
_SAME_SHARE: Final = 5e-4
#: A robot that has less than this share of the rows of another one was not measured, but its name mistyped.
_FEW_ROWS: Final = 0.2
#: So many more lines are named.
_NAMED: Final = 5
_FILES: Final = {"paths": "paths", "settling": "poses over time", "forces": "pushes"}


@dataclass(frozen=True, eq=False)
class Cycles:
    """The cycles of one pose under one condition, in the order of their numbers; those of drift by time."""

    #: test, robot, pose, approach, velocity, load: what they have in common; the approach is empty but in ``vAP``.
    test: str
    robot: str
    pose: str
    approach: str
    velocity: float
    load: float
    cycle: NDArray[np.intp]  #: ``(n,)``.
    time: Array  #: [s], ``(n,)``; NaN where it is not given.
    points: Array  #: In the base frame [m], ``(n, 3)``.
    #: a, b, c: rotation vectors from the commanded to the attained orientation, about the base's axes [rad], ``(n,
    #: 3)``; None where no orientation was read.
    angles: Array | None
    command: Array  #: [m], ``(3,)``.
    line: NDArray[np.intp]  #: In the file, ``(n,)``.

    @property
    def barycentre(self) -> Array:
        """Mean of the points [m], ``(3,)``."""
        return np.asarray(self.points.mean(axis=0))

    def __len__(self) -> int:
        return len(self.points)

    def rows(self, chosen: NDArray[np.intp] | NDArray[np.bool_] | slice) -> Cycles:
        """Return some of the cycles."""
        return replace(
            self,
            cycle=self.cycle[chosen],
            time=self.time[chosen],
            points=self.points[chosen],
            angles=None if self.angles is None else self.angles[chosen],
            line=self.line[chosen],
        )


def best_fit_of(plan: PerformancePlan, readings: AttainedPoses) -> Alignment:
    """Return the tie that brings the barycentres of the test AP nearest to the commanded poses.

    Raises:
        InputError: If rows do not fit the plan, or there are too few poses.
    """
    _check_names(plan, readings)
    rows = readings.criterion.are("AP")
    poses = [name for name in plan.poses if (rows & readings.pose.are(name)).any()]
    # The exact sum, so that the order of the rows does not change the last digit.
    attained = [
        [math.fsum(column) / len(column) for column in readings.position[rows & readings.pose.are(name)].T]
        for name in poses
    ]
    commanded = [plan.poses[name].position for name in poses]
    return best_fit(np.reshape(attained, (-1, 3)), np.reshape(commanded, (-1, 3)))


def cycles_of(plan: PerformancePlan, readings: AttainedPoses, alignment: Alignment) -> tuple[Cycles, ...]:
    """Return the rows of a file by test, robot, pose, approach, velocity and load, in the order of the plan.

    The order of the rows does not matter, but for drift without times.

    Raises:
        InputError: For a test, a pose, an approach, a velocity or a load that the plan does not have, a robot without a
            name where robots are compared, a robot that has a few rows alone, poses outside the cube or at another pose
            of the plan than they are called, a row that is another one's copy, orientations that no robot attains, and
            a cycle that appears twice.
    """
    _check_names(plan, readings)
    position = alignment.in_base(readings.position)
    _check_cube(plan, readings, position)
    _check_nearest(plan, readings, position)
    _check_copies(readings)
    refuse_copied_poses(readings)
    rotation = None if readings.rotation is None else alignment.turned_to_base(readings.rotation)
    if rotation is not None:
        commanded = np.array([plan.poses[name].rotation for name in readings.pose.names])[readings.pose.code]
        turn = alignment.T_base_instrument.rotation
        refuse_far_orientations(rotation, commanded, turn, readings.line, readings.source)
    approaches = readings.approach.code.copy()
    approaches[~readings.criterion.are("vAP")] = -1
    conditions = _planned_conditions(plan, readings)
    _, condition = np.unique(conditions, axis=0, return_inverse=True)
    keys = np.column_stack(
        [readings.criterion.code, readings.robot.code, readings.pose.code, approaches, condition.reshape(-1)]
    )
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    group = group.reshape(-1)
    groups = []
    for number in np.argsort(first, kind="stable"):
        rows = np.flatnonzero(group == number)
        row = int(rows[0])
        test, pose = (_pose_name(names, row) for names in (readings.criterion, readings.pose))
        rows = rows[_order(readings, rows, drift=test == "dAP")]
        command = plan.poses[pose]
        groups.append(
            Cycles(
                test=test,
                robot=_pose_name(readings.robot, row),
                pose=pose,
                approach=_pose_name(readings.approach, row) if test == "vAP" else "",
                velocity=float(conditions[row, 0]),
                load=float(conditions[row, 1]),
                cycle=readings.cycle[rows],
                time=readings.time[rows],
                points=position[rows],
                angles=None if rotation is None else rotation_vector(rotation[rows] @ command.rotation.T),
                command=command.position,
                line=readings.line[rows],
            )
        )
    return tuple(sorted(groups, key=lambda cycles: _place_in(plan, cycles)))


def _place_in(plan: PerformancePlan, group: Cycles) -> tuple[object, ...]:
    """Return by what cycles are ordered: the plan, and names of robots."""
    number, test = next((k, test) for k, test in enumerate(plan.tests) if test.id == group.test)
    approach = test.approaches.index(group.approach) if group.approach else 0
    return number, group.robot, test.places.index(group.pose), approach, -group.velocity, -group.load


def _planned_conditions(plan: PerformancePlan, readings: AttainedPoses) -> Array:
    """Return velocity and load of each row as the plan has them, ``(n, 2)``, or refuse others."""
    conditions = np.empty((len(readings.cycle), 2))
    for planned in plan.tests:
        rows = np.flatnonzero(readings.criterion.are(planned.id))
        pairs = (("velocity", readings.velocity, planned.velocities), ("load", readings.load, planned.loads))
        for column, (name, read, known) in enumerate(pairs):
            apart = np.abs(read[rows, None] - np.array(known))
            conditions[rows, column] = np.array(known)[apart.argmin(axis=1)]
            other = np.flatnonzero(apart.min(axis=1) > _SAME_SHARE)
            if len(other):
                row = int(rows[other[0]])
                raise InputError(
                    f"{len(other)} row{'s' * (len(other) != 1)} of the test {planned.id} at a {name} that is not "
                    "planned for it",
                    where=f"{readings.source}, line {int(readings.line[row])}, column {name}",
                    came=f"{100.0 * read[row]:g} %",
                    allowed=", ".join(f"{100.0 * share:g} %" for share in known),
                    cure="Correct it, or plan and measure the whole test under this condition too.",
                )
    return conditions


def _pose_name(names: Names, row: int) -> str:
    return names.names[int(names.code[row])]


def _order(readings: AttainedPoses, rows: NDArray[np.intp], *, drift: bool) -> NDArray[np.intp]:
    """Return the order of the rows of a group, or refuse a cycle that it has twice."""
    if drift:
        return drift_order(readings, rows)
    order = np.argsort(readings.cycle[rows], kind="stable")
    cycle = readings.cycle[rows][order]
    twice = np.flatnonzero(cycle[1:] == cycle[:-1])
    if len(twice):
        line, other_line = (int(readings.line[rows[order[twice[0] + k]]]) for k in (0, 1))
        raise InputError(
            f"cycle {int(cycle[twice[0]])} appears twice under the same conditions",
            where=f"{readings.source}, lines {line} and {other_line}",
            allowed="approaches in rows of vAP alone",
            cure="Correct the criterion, or the cycle.",
        )
    return order


def _check_names(plan: PerformancePlan, readings: AttainedPoses) -> None:
    """Refuse tests, poses, approaches and robots that do not fit the plan."""
    for test in readings.criterion.names:
        rows = readings.criterion.are(test)
        if not rows.any():
            continue
        planned = plan.test(test)
        if planned is None or TESTS[test].readings != "poses":
            raise _no_such_test(plan, readings, test)
        for pose in readings.pose.names:
            named = rows & readings.pose.are(pose)
            if named.any() and pose not in planned.places:
                raise _refused(
                    readings,
                    named,
                    "pose",
                    f"the plan does not have this pose in the test {test}",
                    pose,
                    planned.places,
                )
        if test == "vAP":
            for approach in readings.approach.names:
                named = rows & readings.approach.are(approach)
                if named.any() and approach not in planned.approaches:
                    message = "the plan does not have this approach" if approach else "the approach is missing"
                    raise _refused(readings, named, "approach", message, approach, planned.approaches)
        nameless = rows & readings.robot.are("")
        if test == "E" and nameless.any():
            raise InputError(
                "robots that are exchanged need names",
                where=f"{readings.source}, line {_first(readings, nameless)}, column robot",
                allowed="a name for each robot",
                cure="Name the robot in every row of the test E.",
            )
        _check_robots(readings, test, rows)


def _check_robots(readings: AttainedPoses, test: str, rows: NDArray[np.bool_]) -> None:
    """Refuse a robot that has a few rows of a test alone, its name probably mistyped, and names in some rows alone."""
    counted = {name: int((rows & readings.robot.are(name)).sum()) for name in readings.robot.names}
    counts = {name: count for name, count in counted.items() if count}
    if len(counts) == 1:
        return
    fewest, most = (chosen(counts, key=lambda name: counts[name]) for chosen in (min, max))
    if "" not in counts and counts[fewest] >= _FEW_ROWS * counts[most]:
        return
    if "" in counts:
        message = f"the robot is named in some rows of the test {test} and in others not"
    else:
        message = (
            f"the robot {fewest} has few rows in the test {test}: {counts[fewest]}, where {most} has {counts[most]}"
        )
    raise InputError(
        message,
        where=f"{readings.source}, line {_first(readings, rows & readings.robot.are(fewest))}, column robot",
        came=fewest or None,
        allowed=", ".join(name or "no name" for name in counts if name != fewest),
        cure="Correct the name; or remove its rows, or measure it too.",
    )


def _first(readings: AttainedPoses, rows: NDArray[np.bool_]) -> int:
    return int(readings.line[np.argmax(rows)])


def _no_such_test(plan: PerformancePlan, readings: AttainedPoses, test: str) -> InputError:
    known = [planned.id for planned in plan.tests if TESTS[planned.id].readings == "poses"]
    rows = readings.criterion.are(test)
    if TEST_OF.get(test, test) != test:
        message = f"{test} is evaluated from the rows of {TEST_OF[test]}"
        return _refused(readings, rows, "criterion", message, test, known, f"Name the test: {TEST_OF[test]}.")
    if test in TESTS and TESTS[test].readings != "poses":
        message = f"{test} is not evaluated from poses"
        cure = f"It belongs in the file of {_FILES[TESTS[test].readings]}."
        return _refused(readings, rows, "criterion", message, test, known, cure)
    if test in TESTS:
        cure = "Plan the test, or remove its rows."
        return _refused(readings, rows, "criterion", "the plan does not have this test", test, known, cure)
    return _refused(readings, rows, "criterion", "the criterion is not known", test, known)


def _refused(
    readings: AttainedPoses,
    rows: NDArray[np.bool_],
    column: str,
    message: str,
    name: str,
    known: Iterable[str],
    cure: str | None = None,
) -> InputError:
    known = tuple(known)
    near = nearest_names(name, known, 1, 0.6)
    return InputError(
        message,
        where=f"{readings.source}, line {_first(readings, rows)}, column {column}",
        came=name or None,
        allowed=", ".join(known) or "nothing: the plan has no tests of poses",
        cure=cure or (f"Did you mean {near[0]}?" if near else "Correct it, or use the plan that was measured."),
    )


def _check_cube(plan: PerformancePlan, readings: AttainedPoses, position: Array) -> None:
    beyond = np.abs(position - plan.cube.centre).max(axis=1) - plan.cube.side / 2.0
    outside = np.flatnonzero(beyond > _ROUNDING)
    if len(outside):
        row = int(outside[0])
        x, y, z = (f"{1e3 * value:.4g}" for value in position[row])
        low, high = (1e3 * (plan.cube.centre + sign * plan.cube.side / 2.0) for sign in (-1, 1))
        raise InputError(
            f"{len(outside)} pose{'s' * (len(outside) != 1)} outside the cube, the first {1e3 * beyond[row]:.4g} mm",
            where=f"{readings.source}, line {int(readings.line[row])}",
            came=f"x {x}, y {y}, z {z} mm in the base frame",
            allowed=", ".join(f"{axis} {a:.4g} to {b:.4g} mm" for axis, a, b in zip("xyz", low, high, strict=True)),
            cure="Check the unit, the pose's name, and how the instrument was tied to the robot's base.",
        )


def _check_nearest(plan: PerformancePlan, readings: AttainedPoses, position: Array) -> None:
    """Refuse rows that lie at another pose than the one they are called."""
    names = [name for test in plan.tests if TESTS[test.id].readings == "poses" for name in test.places]
    places = np.array([plan.poses[name].position for name in dict.fromkeys(names)])
    called = np.array([plan.poses[name].position for name in readings.pose.names])[readings.pose.code]
    own = np.linalg.norm(position - called, axis=1)
    apart = np.linalg.norm(position[:, None] - places, axis=2)
    wrong = np.flatnonzero(apart.min(axis=1) < _NEARER * own)
    if len(wrong):
        row = int(wrong[0])
        nearest = list(dict.fromkeys(names))[int(apart[row].argmin())]
        lines = [str(int(line)) for line in readings.line[wrong[1 : 1 + _NAMED]]]
        also = f"; so also line{'s' * (len(lines) != 1)} {', '.join(lines)}" if lines else ""
        also += " and others" if len(wrong) > 1 + len(lines) else ""
        raise InputError(
            f"{len(wrong)} pose{'s' * (len(wrong) != 1)} at another place than the plan has it",
            where=f"{readings.source}, line {int(readings.line[row])}, column pose",
            came=f"{_pose_name(readings.pose, row)}, and it lies at {nearest}, {1e3 * apart[row].min():.4g} mm from "
            f"it, {1e3 * own[row]:.4g} mm from {_pose_name(readings.pose, row)}{also}",
            cure="Correct the name, take the plan that was measured, or remove the cycle.",
        )


def _check_copies(readings: AttainedPoses) -> None:
    """Refuse rows of one time and one place: a reading that was copied."""
    if not np.isfinite(readings.time).all() or 2 * len(np.unique(readings.time)) < len(readings.time):
        return
    read = np.column_stack([readings.time, readings.position])
    _, first, inverse = np.unique(read, axis=0, return_index=True, return_inverse=True)
    copies = np.flatnonzero(first[inverse.reshape(-1)] != np.arange(len(read)))
    if len(copies):
        row = int(copies[0])
        other = int(first[inverse.reshape(-1)[row]])
        raise InputError(
            f"{len(copies)} row{'s' * (len(copies) != 1)} with the time and the place of another one",
            where=f"{readings.source}, lines {int(readings.line[other])} and {int(readings.line[row])}",
            came=f"{readings.time[row]:g} s",
            cure="Remove the copy, or write what was read in its cycle.",
        )
