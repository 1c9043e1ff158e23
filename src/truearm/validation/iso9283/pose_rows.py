"""Rows of attained poses, checked against the plan and put together: the cycles of one pose under one condition."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError, nearest_names
from truearm.measurement.performance.records import AttainedPoses, Names
from truearm.modeling.chain import Array
from truearm.modeling.transform import rotation_vector
from truearm.planning.iso9283.criteria import TEST_OF, TESTS
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.validation.iso9283.alignment import Alignment, best_fit
from truearm.validation.iso9283.copied import refuse_copied_poses
from truearm.validation.iso9283.drift_order import drift_order
from truearm.validation.iso9283.orientation_check import refuse_far_orientations

#: How far outside the cube is rounding [m].
_ROUNDING: Final = 1e-9
#: A row is at another pose if that is nearer than this share of the distance to its own.
_NEARER: Final = 0.5
#: A velocity or load is the plan's if it differs by less, as a share: rounding in a table.
_SAME_SHARE: Final = 5e-4
#: A robot that has less than this share of the rows of another one was not measured, but its name mistyped.
_FEW_ROWS: Final = 0.2
#: So many more lines are named.
_TOLD: Final = 5
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
    made = []
    for number in np.argsort(first, kind="stable"):
        rows = np.flatnonzero(group == number)
        row = int(rows[0])
        test, pose = (_name(names, row) for names in (readings.criterion, readings.pose))
        rows = rows[_order(readings, rows, drift=test == "dAP")]
        command = plan.poses[pose]
        made.append(
            Cycles(
                test=test,
                robot=_name(readings.robot, row),
                pose=pose,
                approach=_name(readings.approach, row) if test == "vAP" else "",
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
    return tuple(sorted(made, key=lambda one: _place_in(plan, one)))


def _place_in(plan: PerformancePlan, one: Cycles) -> tuple[object, ...]:
    """Return by what cycles are ordered: the plan, and names of robots."""
    number, test = next((k, test) for k, test in enumerate(plan.tests) if test.id == one.test)
    approach = test.approaches.index(one.approach) if one.approach else 0
    return number, one.robot, test.places.index(one.pose), approach, -one.velocity, -one.load


def _planned_conditions(plan: PerformancePlan, readings: AttainedPoses) -> Array:
    """Return velocity and load of each row as the plan has them, ``(n, 2)``, or refuse others."""
    made = np.empty((len(readings.cycle), 2))
    for planned in plan.tests:
        rows = np.flatnonzero(readings.criterion.are(planned.id))
        pairs = (
            ("velocity", readings.velocity, planned.velocities),
            ("load", readings.load, planned.loads),
        )
        for column, (name, read, known) in enumerate(pairs):
            apart = np.abs(read[rows, None] - np.array(known))
            made[rows, column] = np.array(known)[apart.argmin(axis=1)]
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
    return made


def _name(names: Names, row: int) -> str:
    return names.names[int(names.code[row])]


def _order(readings: AttainedPoses, rows: NDArray[np.intp], *, drift: bool) -> NDArray[np.intp]:
    """Return the order of the rows of a group, or refuse a cycle that it has twice."""
    if drift:
        return drift_order(readings, rows)
    order = np.argsort(readings.cycle[rows], kind="stable")
    cycle = readings.cycle[rows][order]
    twice = np.flatnonzero(cycle[1:] == cycle[:-1])
    if len(twice):
        one, other = (int(readings.line[rows[order[twice[0] + k]]]) for k in (0, 1))
        raise InputError(
            f"cycle {int(cycle[twice[0]])} appears twice under the same conditions",
            where=f"{readings.source}, lines {one} and {other}",
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
            here = rows & readings.pose.are(pose)
            if here.any() and pose not in planned.places:
                raise _refused(
                    readings, here, "pose", f"the plan does not have this pose in the test {test}", pose, planned.places
                )
        if test == "vAP":
            for approach in readings.approach.names:
                here = rows & readings.approach.are(approach)
                if here.any() and approach not in planned.approaches:
                    what = "the plan does not have this approach" if approach else "the approach is missing"
                    raise _refused(readings, here, "approach", what, approach, planned.approaches)
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
        what = f"the robot is named in some rows of the test {test} and in others not"
    else:
        what = f"the robot {fewest} has few rows in the test {test}: {counts[fewest]}, where {most} has {counts[most]}"
    raise InputError(
        what,
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
        what = f"{test} is evaluated from the rows of {TEST_OF[test]}"
        return _refused(readings, rows, "criterion", what, test, known, f"Name the test: {TEST_OF[test]}.")
    if test in TESTS and TESTS[test].readings != "poses":
        what = f"{test} is not evaluated from poses"
        cure = f"It belongs in the file of {_FILES[TESTS[test].readings]}."
        return _refused(readings, rows, "criterion", what, test, known, cure)
    if test in TESTS:
        cure = "Plan the test, or remove its rows."
        return _refused(readings, rows, "criterion", "the plan does not have this test", test, known, cure)
    return _refused(readings, rows, "criterion", "the criterion is not known", test, known)


def _refused(
    readings: AttainedPoses,
    rows: NDArray[np.bool_],
    column: str,
    what: str,
    came: str,
    known: Iterable[str],
    cure: str | None = None,
) -> InputError:
    known = tuple(known)
    near = nearest_names(came, known, 1, 0.6)
    return InputError(
        what,
        where=f"{readings.source}, line {_first(readings, rows)}, column {column}",
        came=came or None,
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
        there = list(dict.fromkeys(names))[int(apart[row].argmin())]
        lines = [str(int(line)) for line in readings.line[wrong[1 : 1 + _TOLD]]]
        also = f"; so also line{'s' * (len(lines) != 1)} {', '.join(lines)}" if lines else ""
        also += " and others" if len(wrong) > 1 + len(lines) else ""
        raise InputError(
            f"{len(wrong)} pose{'s' * (len(wrong) != 1)} at another place than the plan has it",
            where=f"{readings.source}, line {int(readings.line[row])}, column pose",
            came=f"{_name(readings.pose, row)}, and it lies at {there}, {1e3 * apart[row].min():.4g} mm from it, "
            f"{1e3 * own[row]:.4g} mm from {_name(readings.pose, row)}{also}",
            cure="Correct the name, take the plan that was measured, or remove the cycle.",
        )


def _check_copies(readings: AttainedPoses) -> None:
    """Refuse rows of one time and one place: a reading that was copied."""
    if not np.isfinite(readings.time).all() or 2 * len(np.unique(readings.time)) < len(readings.time):
        return
    read = np.column_stack([readings.time, readings.position])
    _, first, which = np.unique(read, axis=0, return_index=True, return_inverse=True)
    copies = np.flatnonzero(first[which.reshape(-1)] != np.arange(len(read)))
    if len(copies):
        row = int(copies[0])
        other = int(first[which.reshape(-1)[row]])
        raise InputError(
            f"{len(copies)} row{'s' * (len(copies) != 1)} with the time and the place of another one",
            where=f"{readings.source}, lines {int(readings.line[other])} and {int(readings.line[row])}",
            came=f"{readings.time[row]:g} s",
            cure="Remove the copy, or write what was read in its cycle.",
        )
