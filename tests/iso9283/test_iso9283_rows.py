"""Rows of poses that do not fit the plan or one another: refused or named, and in whatever order they come."""

from __future__ import annotations

import dataclasses
import math
import re
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.performance_plan import small_plan

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import (
    Transform,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_vector,
)
from truearm.iso9283.criteria.alignment import Alignment
from truearm.iso9283.criteria.outlying_rows import UnusualRows, alike_cycles, unusual_rows
from truearm.iso9283.criteria.rows import Cycles, Instrument, cycles_of, refuse_copied_poses, refuse_far_orientations
from truearm.iso9283.evaluating.evaluation import Evaluation, Measurements, evaluated
from truearm.iso9283.evaluating.table import row_notices
from truearm.iso9283.planning.criteria import PerformancePlan
from truearm.iso9283.planning.records import AttainedPoses, Names

Rows = NDArray[np.intp]
TIE = Alignment("base-features", Transform(), 1e-5, 1e-5)
TRACKER = Instrument(1e-6, 1e-6)
TESTS = ("AP", "vAP", "AD", "dAP", "E")
CYCLES = {"AP": 30, "vAP": 6, "AD": 10, "dAP": 6, "E": 6}
SCATTER = 2e-5


@cache
def campaign(seed: int = 1, tests: tuple[str, ...] = TESTS) -> tuple[PerformancePlan, AttainedPoses]:
    """Return a plan of tests of poses at two velocities, and what was read for it."""
    plan = small_plan(tests, cycles=CYCLES, velocities=(1.0, 0.5))
    rng = np.random.default_rng(seed)
    keys = []
    for test in plan.tests:
        robots = [f"r{k}" for k in range(5)] if test.id == "E" else [""]
        velocities = test.velocities if test.id in ("AP", "AD") else (1.0,)
        keys += [
            (test.id, robot, pose, cycle, approach, velocity, 1e4 * group + cycle)
            for robot in robots
            for pose in test.places
            for approach in (test.approaches if test.id == "vAP" else ("",))
            for velocity in velocities
            for group in range(4 if test.id == "dAP" else 1)
            for cycle in range(1, test.cycles + 1)
        ]
    plan = dataclasses.replace(
        plan, tests=tuple(t if t.id in ("AP", "AD") else dataclasses.replace(t, velocities=(1.0,)) for t in plan.tests)
    )
    criterion, robot, pose, cycle, approach, velocity, time = zip(*keys, strict=True)
    n = len(keys)
    commanded = np.array([plan.poses[name].position for name in pose])
    turned = rotation_from_vector([1e-3, 0, 2e-3] + 1e-4 * rng.standard_normal((n, 3)))
    return plan, AttainedPoses(
        criterion=Names.of(criterion),
        robot=Names.of(robot),
        pose=Names.of(pose),
        approach=Names.of(approach),
        cycle=np.array(cycle, dtype=np.intp),
        velocity=np.array(velocity),
        load=np.ones(n),
        time=np.array(time, dtype=float),
        position=commanded + [4e-4, 0, -2e-4] + SCATTER * rng.standard_normal((n, 3)),
        rotation=turned @ np.array([plan.poses[name].rotation for name in pose]),
        line=np.arange(2, n + 2),
        source="poses.csv",
    )


def in_order(read: AttainedPoses, order: Rows) -> AttainedPoses:
    """Return rows in another order, or some of them, with names met in that order."""
    names: dict[str, Any] = {
        name: Names.of([column.names[code] for code in column.code[order]])
        for name in ("criterion", "robot", "pose", "approach")
        for column in [getattr(read, name)]
    }
    columns = ("cycle", "velocity", "load", "time", "position", "rotation", "line")
    arrays: dict[str, Any] = {name: getattr(read, name)[order] for name in columns}
    return dataclasses.replace(read, **names, **arrays)


def rows_of(read: AttainedPoses, **named: Any) -> Rows:
    """Return which rows are of a test, pose, cycle .."""
    chosen = np.ones(len(read.cycle), dtype=bool)
    for name, value in named.items():
        column = getattr(read, name)
        chosen &= column.are(str(value)) if isinstance(column, Names) else column == value
    return np.flatnonzero(chosen)


def evaluation_of(plan: PerformancePlan, read: AttainedPoses, tie: Alignment | None = TIE) -> Evaluation:
    return evaluated(plan, Measurements(poses=read), tie, TRACKER)


def unusual(plan: PerformancePlan, read: AttainedPoses) -> UnusualRows:
    return unusual_rows(cycles_of(plan, read, TIE), TRACKER)


def moved(read: AttainedPoses, rows: Rows, by: Array | list[float]) -> AttainedPoses:
    position = read.position.copy()
    position[rows] += by
    return dataclasses.replace(read, position=position)


@pytest.mark.parametrize("tie", [TIE, None], ids=["tied", "best fit"])
def test_no_figure_depends_on_the_order_of_the_rows(tie: Alignment | None) -> None:
    plan, read = campaign()
    plain = evaluation_of(plan, read, tie).values
    assert {value.id for value in plain} == {"AP", "RP", "vAP", "AD", "RD", "dAP", "dRP", "E"}
    rng = np.random.default_rng(3)
    for order in (np.arange(len(read.cycle))[::-1], rng.permutation(len(read.cycle))):
        other = evaluation_of(plan, in_order(read, order), tie).values
        for first, second in zip(plain, other, strict=True):
            assert first == second or math.isnan(first.value)
            assert (first.id, first.component, first.where) == (second.id, second.component, second.where)


def test_clean_campaigns_are_silent() -> None:
    plan, read = campaign()
    rng = np.random.default_rng(8)
    for _ in range(20):
        rows = unusual(
            plan, moved(read, np.arange(len(read.cycle)), SCATTER * rng.standard_normal(read.position.shape))
        )
        assert (rows.outlying, rows.two_places) == ((), ())
    assert evaluation_of(plan, read).missing == ()


@pytest.mark.parametrize(
    ("test", "criteria"),
    [("AP", ("AP", "RP")), ("vAP", ("vAP",)), ("AD", ("AD", "RD")), ("dAP", ("dAP", "dRP")), ("E", ("E",))],
)
def test_an_outlying_row_is_named_with_what_it_changes(test: str, criteria: tuple[str, ...]) -> None:
    plan, read = campaign(1, (test,))
    conditions: dict[str, dict[str, Any]] = {
        "AP": {"pose": "P3", "velocity": 0.5},
        "AD": {"pose": "P4"},
        "E": {"pose": "P2", "robot": "r3"},
    }
    of: dict[str, Any] = {"criterion": test, "cycle": 4} | conditions.get(test, {})
    row = int(rows_of(read, **of)[0])
    spoilt = moved(read, np.array([row]), [0, 5e-3, 0])
    (outlying,) = evaluation_of(plan, spoilt).unusual.outlying
    assert (outlying.of.test, outlying.kind, int(outlying.of.cycle[0]), int(outlying.of.line[0])) == (
        test,
        "position",
        4,
        row + 2,
    )
    assert outlying.away == pytest.approx(5e-3, rel=0.1)
    assert {value.id for value, _ in outlying.changes} == {*criteria}
    assert np.isfinite([other.value for _, other in outlying.changes]).all()
    if test == "AP":
        clean = {
            (v.id, v.where, v.conditions): v.value
            for v in evaluation_of(plan, read).values
            if v.component == "position"
        }
        for value, without in outlying.changes:
            assert without.value == pytest.approx(clean[value.id, value.where, value.conditions], rel=0.2)
            assert without.cycles == value.cycles - 1
        rp, rp_without = outlying.changes[0]
        assert rp.id == "RP"
        assert rp.value > 2.5e-3
        assert rp_without.value < 2e-4


def test_an_outlying_orientation_is_named() -> None:
    plan, read = campaign(1, ("AP",))
    row = int(rows_of(read, criterion="AP", pose="P2", cycle=9)[0])
    assert read.rotation is not None
    rotation = read.rotation.copy()
    rotation[row] = rotation_from_vector(np.array([0, 0.02, 0])) @ rotation[row]
    (outlying,) = evaluation_of(plan, dataclasses.replace(read, rotation=rotation)).unusual.outlying
    assert (outlying.kind, int(outlying.of.line[0])) == ("orientation", row + 2)
    assert outlying.away == pytest.approx(0.02, rel=0.1)
    assert outlying.changes[0][0].component == "b"


def test_several_outlying_rows_are_named_and_ten_times_the_scatter_is_enough() -> None:
    plan, read = campaign(2, ("AP",))
    rows = np.array([rows_of(read, pose=f"P{k}", cycle=7)[0] for k in (1, 3, 5)])
    away = 10 * math.sqrt(3) * SCATTER * np.array([[1, 0, 0], [0, -1, 0], [0, 0.6, 0.8]])
    assert {int(row.of.line[0]) for row in unusual(plan, moved(read, rows, away)).outlying} == {*(rows + 2)}


def test_three_cycles_of_a_pose_have_a_outlying_row_where_others_show_the_scatter() -> None:
    plan, read = campaign(2, ("AP",))
    few = in_order(read, np.flatnonzero(read.cycle <= 3))
    assert unusual(plan, few).outlying == ()
    row = int(rows_of(few, pose="P4", cycle=2)[0])
    (outlying,) = unusual(plan, moved(few, np.array([row]), [0, 5e-3, 0])).outlying
    assert int(outlying.of.line[0]) == int(few.line[row])


def test_two_places_of_rest_are_told_and_their_rows_are_not_outlying() -> None:
    plan, read = campaign(4, ("AP",))
    rows = np.concatenate([rows_of(read, pose="P2", velocity=1.0, cycle=c) for c in (3, 4, 9, 15, 20, 21, 27)])
    result = unusual(plan, moved(read, rows, [0, 15 * SCATTER, 0]))
    (places,) = result.two_places
    assert (places.of.pose, places.rows, result.outlying) == ("P2", (7, 23), ())
    assert places.apart == pytest.approx(15 * SCATTER, rel=0.1)
    assert places.lines == tuple(sorted(read.line[rows].tolist()))


def test_rows_of_several_groups_that_are_off_alike_are_a_second_place() -> None:
    plan, read = campaign(4, ("dAP",))
    plan = dataclasses.replace(plan, tests=tuple(dataclasses.replace(t, cycles=6) for t in plan.tests))
    rows = np.array([rows_of(read, time=1e4 * group + 3)[0] for group in (0, 1, 3)])
    result = unusual(plan, moved(read, rows, [0, 40 * SCATTER, 0]))
    assert (len(result.two_places), result.outlying) == (1, ())
    assert result.two_places[0].rows == (3, 21)
    assert result.two_places[0].lines == tuple(read.line[rows].tolist())


def changed(read: AttainedPoses, name: str, row: int, value: float | str) -> AttainedPoses:
    column = getattr(read, name)
    if isinstance(column, Names):
        texts = [column.names[code] for code in column.code]
        texts[row] = str(value)
        column = Names.of(texts)
    else:
        column = column.copy()
        column[row] = value
    new: dict[str, Any] = {name: column}
    return dataclasses.replace(read, **new)


@pytest.mark.parametrize(
    ("column", "value", "text"),
    [
        ("velocity", 0.01, "line 5, column velocity: 1 row of the test AP"),
        ("velocity", 0.995, "99.5 %"),
        ("load", 0.5, "line 5, column load: 1 row of the test AP"),
        ("robot", "irb12O", "line 5, column robot: the robot is named in some rows of the test AP and in others not"),
    ],
)
def test_rows_under_conditions_that_were_not_planned_are_refused(column: str, value: float | str, text: str) -> None:
    plan, read = campaign(1, ("AP",))
    with pytest.raises(InputError, match=re.escape(text)):
        evaluation_of(plan, changed(read, column, 3, value))


def test_rounded_velocities_are_those_of_the_plan() -> None:
    plan, read = campaign(1, ("AP",))
    third = dataclasses.replace(plan.tests[0], velocities=(1.0, 1 / 3))
    plan = dataclasses.replace(plan, tests=(third,))
    read = dataclasses.replace(read, velocity=np.where(read.velocity == 1.0, 1.0 + 1e-9, 0.3333))
    assert {value.conditions.velocity for value in evaluation_of(plan, read).values} == {1.0, 1 / 3}


def test_a_robot_with_a_few_rows_alone_is_refused() -> None:
    plan, read = campaign(1, ("E",))
    with pytest.raises(InputError, match="the robot r11 has few rows in the test E: 1, where r1 has 30"):
        evaluation_of(plan, changed(read, "robot", 0, "r11"))
    remaining = np.setdiff1d(np.arange(len(read.cycle)), rows_of(read, robot="r0")[20:])
    assert evaluation_of(plan, in_order(read, remaining)).missing == ("E: P5 of r0",)


def test_a_row_that_was_copied_is_refused() -> None:
    plan, read = campaign(1, ("AP",))
    read = dataclasses.replace(read, time=np.arange(len(read.cycle), dtype=float))
    first, second = (int(rows_of(read, pose="P2", velocity=1.0, cycle=cycle)[0]) for cycle in (4, 5))
    copied = changed(
        moved(read, np.array([second]), read.position[first] - read.position[second]), "time", second, read.time[first]
    )
    copied.position[second] = copied.position[first]
    with pytest.raises(InputError, match=f"lines {first + 2} and {second + 2}: 1 row with the time and the place"):
        evaluation_of(plan, copied)


def test_two_cycles_with_one_position_are_copies_unless_readings_are_rounded() -> None:
    plan, read = campaign(1, ("AP",))
    first, second = (int(rows_of(read, pose="P2", velocity=1.0, cycle=cycle)[0]) for cycle in (4, 5))
    copied = moved(read, np.array([second]), np.zeros(3))
    copied.position[second] = copied.position[first]
    with pytest.raises(
        InputError, match=f"lines {first + 2} and {second + 2}: 1 row with the position of another cycle"
    ):
        evaluation_of(plan, copied)
    repeated = dataclasses.replace(read, position=read.position.copy())
    rows = rows_of(read, pose="P2", velocity=1.0)
    repeated.position[rows] = repeated.position[rows[0]]
    with pytest.raises(InputError, match=f"{len(rows) - 1} rows with the position of another cycle of the same pose"):
        evaluation_of(plan, repeated)
    rounded = dataclasses.replace(read, position=np.round(read.position, 5))
    assert len(np.unique(rounded.position, axis=0)) < len(rounded.position)
    refuse_copied_poses(rounded)
    refuse_copied_poses(
        dataclasses.replace(repeated, position=repeated.position[rows[0]] + np.zeros_like(repeated.position))
    )


def test_two_poses_that_were_swapped_are_refused() -> None:
    plan, read = campaign(1, ("AD",))
    position = read.position.copy()
    first, second = (rows_of(read, pose=pose) for pose in ("P2", "P4"))
    position[first], position[second] = position[second], position[first]
    with pytest.raises(InputError, match=rf"{len(position)} poses at another place than the plan has it"):
        evaluation_of(plan, dataclasses.replace(read, position=position))
    position = read.position.copy()
    pair = [int(rows_of(read, pose=pose, cycle=5, velocity=1.0)[0]) for pose in ("P2", "P4")]
    position[pair] = position[pair[::-1]]
    with pytest.raises(InputError, match=rf"line {min(pair) + 2}, column pose: 2 poses at another place") as refusal:
        evaluation_of(plan, dataclasses.replace(read, position=position))
    assert re.search(rf"got 'P., and it lies at P.,.*; so also line {max(pair) + 2}'", str(refusal.value))


def test_quaternions_in_another_order_are_refused() -> None:
    plan, read = campaign(1, ("AP",))
    assert read.rotation is not None
    tilt = rotation_from_vector(np.array([0.4, 0.5, -0.3]))
    tie = dataclasses.replace(TIE, T_base_instrument=Transform.from_matrix(tilt, np.zeros(3)))
    turned = dataclasses.replace(read, position=read.position @ tilt, rotation=tilt.T @ read.rotation)
    assert len(evaluation_of(plan, turned, tie).values) > 50
    wrong = rotation_from_quaternion(np.roll(quaternion_from_rotation(tilt.T @ read.rotation), -1, axis=1))
    with pytest.raises(InputError, match="in the order x, y, z, w"):
        evaluation_of(plan, dataclasses.replace(turned, rotation=wrong), tie)


def test_places_without_a_row_are_told() -> None:
    plan, read = campaign()
    drop = [
        rows_of(read, criterion="AP", pose="P3"),
        rows_of(read, criterion="AP", pose="P4", velocity=1.0),
        rows_of(read, criterion="vAP", pose="P2", approach="y"),
        rows_of(read, criterion="E", robot="r2"),
    ]
    remaining = np.setdiff1d(np.arange(len(read.cycle)), np.concatenate(drop))
    result = evaluation_of(plan, in_order(read, remaining))
    assert result.missing == ("AP: P3", "AP: P4 at 100 %", "vAP: P2 from y", "E: 1 of 5 robots")


def group(points: Array, pose: str = "P1", test: str = "AP") -> Cycles:
    n = len(points)
    number = np.arange(1, n + 1)
    return Cycles(
        test, "", pose, "", 1.0, 1.0, number, np.full(n, np.nan), 1e-5 * points, None, np.zeros(3), number + 1
    )


def creeping_campaign(rng: np.random.Generator, share: float, common: float = 0.0, test: str = "AP") -> list[Cycles]:
    """Return five poses of thirty cycles; each is a share of the one before, and moves with the others by an amount."""
    together = common * rng.standard_normal((30, 3))
    groups = []
    for k in range(1, 6):
        points = rng.standard_normal((30, 3)) * [3.0, 1.0, 0.3] + together
        for row in range(1, 30):
            points[row] = share * points[row - 1] + np.sqrt(1 - share**2) * points[row]
        groups.append(group(points, f"P{k}", test))
    return groups


def test_cycles_that_creep_are_said_with_their_correlation() -> None:
    rng = np.random.default_rng(0)
    unusual = unusual_rows(creeping_campaign(rng, 0.8), Instrument(1e-6))
    (alike,) = unusual.alike
    assert 0.5 < alike.correlation < 0.95
    evaluation = Evaluation((), Alignment.__new__(Alignment), unusual=unusual)
    (notice,) = (notice for notice in row_notices(evaluation) if notice.code == "cycles-alike")
    assert notice.level == "warning"
    assert f"AP, 100 %, load 100 % (correlation {alike.correlation:.2f}" in notice.message


def test_independent_cycles_are_seldom_said_even_if_all_poses_move_together() -> None:
    rng = np.random.default_rng(1)
    for common in (0.0, 3.0):
        alarms = sum(bool(alike_cycles(creeping_campaign(rng, 0.0, common))) for _ in range(300))
        assert alarms <= 8  # 1 %, and what chance adds to it


def test_few_cycles_drift_and_points_without_scatter_are_not_judged() -> None:
    rng = np.random.default_rng(2)
    creeping = creeping_campaign(rng, 0.9)
    assert alike_cycles([cycles.rows(slice(0, 9)) for cycles in creeping]) == ()
    assert alike_cycles([replace(cycles, test="dAP") for cycles in creeping]) == ()
    assert alike_cycles([group(np.ones((30, 3)))]) == ()
    # cycles that only some poses have are left aside
    assert len(alike_cycles([creeping[0].rows(slice(3, None)), *creeping[1:]])) == 1


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
