"""Criteria of poses against closed forms, their invariances, and every refusal."""

from __future__ import annotations

import dataclasses
import math
from itertools import product

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.motion.cube import Cube
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import Transform, rotation_from_vector
from truearm.iso9283.criteria.alignment import Alignment
from truearm.iso9283.criteria.compliance import GRAVITY, evaluate_pushes, outlying_pushes
from truearm.iso9283.criteria.drift import groups_of
from truearm.iso9283.criteria.intervals import norm_interval, repeatability
from truearm.iso9283.criteria.poses import PoseCloud, evaluate
from truearm.iso9283.criteria.rows import Instrument, Value, best_fit_of, cycles_of
from truearm.iso9283.evaluating.doubts import other_cube
from truearm.iso9283.planning.criteria import PerformancePlan, PlannedPose, PlannedTest
from truearm.iso9283.planning.records import AttainedPoses, Names, Pushes

CUBE = Cube((0.5, 0.0, 0.5), 0.4)
POINTS = CUBE.plane("C1-C2-C7-C8").measuring_points
NAMES = ("P1", "P2", "P3", "P4", "P5")
TIE = Alignment("base-features", Transform(), 1e-5, 1e-5)
TRACKER = Instrument(1e-6, 1e-6)


def plan(*tests: PlannedTest) -> PerformancePlan:
    poses = {name: PlannedPose(name, point, np.eye(3), np.zeros(6)) for name, point in zip(NAMES, POINTS, strict=True)}
    return PerformancePlan(load_robot("irb120"), None, CUBE, "C1-C2-C7-C8", poses, {}, {}, tests, 3.0, 0.5)


def rows(
    test: str, pose: list[str], cycle: list[int], position: Array, rotation: Array | None = None, **more: list[str]
) -> AttainedPoses:
    n = len(pose)
    robot, approach = (Names.of(more.get(name, [""] * n)) for name in ("robot", "approach"))
    return AttainedPoses(
        criterion=Names.of([test] * n),
        pose=Names.of(pose),
        cycle=np.array(cycle, dtype=np.intp),
        velocity=np.ones(n),
        load=np.ones(n),
        time=np.full(n, np.nan),
        position=position,
        rotation=rotation,
        line=np.arange(2, n + 2),
        source="poses.csv",
        robot=robot,
        approach=approach,
    )


def holds(value: Value, truth: float) -> bool:
    """Return whether the interval of a value holds a truth."""
    assert value.interval is not None
    return value.interval[0] < truth < value.interval[1]


def value_of(values: tuple[Value, ...], id: str, component: str = "position", place: str | None = None) -> Value:
    return next(v for v in values if v.id == id and v.component == component and place in (None, v.where))


def campaign(seed: int = 0, n: int = 30) -> tuple[PerformancePlan, AttainedPoses]:
    """All five poses, a millimetre off, with scatter and orientations."""
    rng = np.random.default_rng(seed)
    pose = [name for name in NAMES for _ in range(n)]
    position = np.repeat(POINTS, n, axis=0) + [1e-3, 0, 0] + 1e-4 * rng.standard_normal((5 * n, 3))
    rotation = rotation_from_vector([1e-3, -2e-3, 3e-3] + 1e-4 * rng.standard_normal((5 * n, 3)))
    return plan(PlannedTest("AP", NAMES, 30)), rows("AP", pose, [*range(1, n + 1)] * 5, position, rotation)


def test_poses_on_a_circle_have_the_radius_as_repeatability() -> None:
    angle = 2 * np.pi * np.arange(30) / 30
    points = POINTS[0] + 2e-4 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1) + [0, 0, 5e-4]
    result = evaluate(
        plan(PlannedTest("AP", ("P1",), 30)), rows("AP", ["P1"] * 30, [*range(1, 31)], points), TIE, TRACKER
    )
    assert value_of(result.values, "RP").value == pytest.approx(2e-4, rel=1e-9)
    assert value_of(result.values, "AP").value == pytest.approx(5e-4, rel=1e-9)
    assert value_of(result.values, "AP", "a").status == "not-measured"
    assert result.clouds[0].rp == value_of(result.values, "RP").value


def test_repeatability_of_printed_numbers() -> None:
    # Barycentre 0; distances 3, 3, 4, 4, 0: mean 2.8, S^2 = (2 0.04 + 2 1.44 + 7.84) / 4 = 2.7.
    points = np.array([[3.0, 0, 0], [-3, 0, 0], [0, 4, 0], [0, -4, 0], [0, 0, 0]])
    assert float(repeatability(points)) == pytest.approx(2.8 + 3 * math.sqrt(2.7), abs=1e-12)


def test_expected_repeatability_of_a_gaussian() -> None:
    # About the barycentre, distances are Maxwell's with n - 1 over n of the variance. S^2 is unbiased but for the
    # correlation of what lies about a common barycentre.
    n, trials = 30, 10_000
    points = np.random.default_rng(1).standard_normal((trials, n, 3))
    length = np.linalg.norm(points - points.mean(axis=1, keepdims=True), axis=2)
    assert length.mean() == pytest.approx(math.sqrt(8 / math.pi * (n - 1) / n), rel=2e-3)
    # Var l - Cov(l, l') with correlation -1 / (n - 1) of coordinates: Cov is about 2 r^2 (4 / 3 pi) of the variance.
    variance = (n - 1) / n * (3 - 8 / math.pi)
    covariance = (n - 1) / n * 8 / (3 * math.pi) / 2 / (n - 1) ** 2
    assert length.var(axis=1, ddof=1).mean() == pytest.approx(variance - covariance, rel=6e-3)


def test_angles_are_means_and_three_deviations() -> None:
    task, read = campaign()
    values = evaluate(task, read, TIE, TRACKER).values
    vectors = cycles_of(task, read, TIE)[2].angles
    assert vectors is not None
    for k, (angle, true) in enumerate(zip("abc", (1e-3, -2e-3, 3e-3), strict=True)):
        accuracy, spread = (value_of(values, id, angle, "P3") for id in ("AP", "RP"))
        assert accuracy.value == pytest.approx(true, abs=1e-4)
        assert holds(accuracy, true)
        assert spread.value == pytest.approx(3 * np.std(vectors[:, k], ddof=1), rel=1e-12)


def test_the_frame_of_the_instrument_does_not_matter() -> None:
    task, read = campaign()
    plain = evaluate(task, read, TIE, TRACKER).values
    assert read.rotation is not None
    R, p = rotation_from_vector(np.array([0.3, -1.2, 0.8])), np.array([2.0, -1.0, 0.4])
    elsewhere = dataclasses.replace(read, position=(read.position - p) @ R, rotation=R.T @ read.rotation)
    tie = dataclasses.replace(TIE, T_base_instrument=Transform.from_matrix(R, p))
    for first, second in zip(plain, evaluate(task, elsewhere, tie, TRACKER).values, strict=True):
        assert (first.id, first.component, first.where) == (second.id, second.component, second.where)
        assert first.value == pytest.approx(second.value, rel=1e-7, abs=1e-12)
        assert first.interval == pytest.approx(second.interval, rel=1e-4, abs=1e-9)


def test_the_tie_widens_pose_accuracy_with_its_lever() -> None:
    task, read = campaign()
    coarse = dataclasses.replace(TIE, sigma=1e-4, sigma_rot=1e-4)
    narrow, wide = (value_of(evaluate(task, read, tie, TRACKER).values, "AP").interval for tie in (TIE, coarse))
    assert narrow is not None
    assert wide is not None
    assert wide[1] - wide[0] > 2.5 * (narrow[1] - narrow[0])
    lever = coarse.covariance_at(np.array([2.0, 0, 0]))
    assert np.diag(lever) == pytest.approx([1e-8, 1e-8 + 4e-8, 1e-8 + 4e-8])


def test_best_fit_hides_a_common_error_and_says_so() -> None:
    task, read = campaign()
    tie = best_fit_of(task, read)
    assert not tie.is_standard
    assert TIE.is_standard
    assert value_of(evaluate(task, read, tie, TRACKER).values, "AP").value < 1e-4
    with pytest.raises(InputError, match="three poses or more"):
        best_fit_of(task, rows("AP", ["P1", "P2"], [1, 1], POINTS[:2]))


def test_variation_between_approaches() -> None:
    rng = np.random.default_rng(5)
    offsets = {"x": [0, 0, 0], "y": [3e-4, 0, 0], "z": [0, 4e-4, 0]}
    names = [name for name in offsets for _ in range(30)]
    points = POINTS[0] + np.array([offsets[name] for name in names]) + 1e-5 * rng.standard_normal((90, 3))
    task = plan(PlannedTest("vAP", ("P1",), 30, approaches=("x", "y", "z")))
    value = value_of(
        evaluate(task, rows("vAP", ["P1"] * 90, [*range(1, 31)] * 3, points, approach=names), TIE, TRACKER).values,
        "vAP",
    )
    assert value.value == pytest.approx(5e-4, abs=1e-5)
    assert holds(value, 5e-4)
    assert value.status == "measured"


def test_distances_by_cycles_and_axes() -> None:
    wave = 1e-4 * np.linspace(-1.0, 1.0, 30)
    way = (POINTS[3] - POINTS[1]) / np.linalg.norm(POINTS[3] - POINTS[1])
    ends = np.concatenate([POINTS[1] + 1e-7 * np.outer(wave, way), POINTS[3] + (2e-4 + wave)[:, None] * way])
    task = plan(PlannedTest("AD", ("P2", "P4"), 30))
    values = evaluate(task, rows("AD", ["P2"] * 30 + ["P4"] * 30, [*range(1, 31)] * 2, ends), TIE, TRACKER).values
    assert value_of(values, "AD").value == pytest.approx(2e-4)
    assert value_of(values, "AD").where == "P2-P4"
    assert value_of(values, "RD").value == pytest.approx(3 * wave.std(ddof=1), rel=1e-6)
    parts = [value_of(values, "AD", axis).value for axis in "xyz"]
    assert parts == pytest.approx(2e-4 * np.abs(way), abs=1e-12)


def test_exchanged_robots() -> None:
    rng = np.random.default_rng(6)
    robots = [f"r{k}" for k in range(5) for _ in range(60)]
    pose = ([*["P1"] * 30, *["P2"] * 30]) * 5
    away = np.array(
        [[1e-4 * int(name[1]) * (2 if at == "P2" else 1), 0, 0] for name, at in zip(robots, pose, strict=True)]
    )
    points = np.array([POINTS[NAMES.index(name)] for name in pose]) + away + 1e-6 * rng.standard_normal((300, 3))
    task = plan(PlannedTest("E", ("P1", "P2"), 30))
    values = evaluate(task, rows("E", pose, [*range(1, 31)] * 10, points, robot=robots), TIE, TRACKER).values
    assert [value_of(values, "E", place=place).value for place in ("P1", "P2", "all poses")] == pytest.approx(
        [4e-4, 8e-4, 8e-4], abs=2e-6
    )
    assert {value.status for value in values} == {"measured"}
    few = evaluate(task, rows("E", pose[:120], [*range(1, 31)] * 4, points[:120], robot=robots[:120]), TIE, TRACKER)
    assert {value.status for value in few.values} == {"too-few-cycles"}


def test_drift_by_groups_of_cycles() -> None:
    rng = np.random.default_rng(7)
    change = np.array([0, 1e-4, 3e-4, 2e-4])
    points = POINTS[0] + [1e-3, 0, 0] + 1e-6 * rng.standard_normal((40, 3)) + np.repeat(change, 10)[:, None] * [1, 0, 0]
    task, read = plan(PlannedTest("dAP", ("P1",), 10)), rows("dAP", ["P1"] * 40, [*range(1, 11)] * 4, points)
    result = evaluate(task, read, TIE, TRACKER)
    assert value_of(result.values, "dAP").value == pytest.approx(3e-4, abs=2e-6)
    assert holds(value_of(result.values, "dAP"), 3e-4)
    assert result.drift[0].ap - result.drift[0].ap[0] == pytest.approx(change, abs=2e-6)
    assert value_of(result.values, "dRP").value < 1e-5
    times = 10.0 * np.arange(40) + np.repeat([0, 3600, 7200, 9000], 10)
    on = dataclasses.replace(read, cycle=np.arange(1, 41), time=times)
    assert [len(group) for group in groups_of(cycles_of(task, on, TIE)[0])] == [10, 10, 10, 10]


def test_statuses() -> None:
    task, read = campaign(n=4)
    values = evaluate(task, read, TIE, TRACKER).values
    few = value_of(values, "AP")
    assert (few.status, few.interval, few.cycles) == ("too-few-cycles", None, 4)
    assert few.least is not None
    assert few.largest is not None
    assert few.least < few.value < few.largest
    task, read = campaign()
    values = evaluate(task, read, TIE, Instrument(3e-4, 1e-6)).values
    assert (value_of(values, "AP").status, value_of(values, "RP").status) == ("instrument-too-coarse",) * 2
    assert value_of(values, "AP", "c").status == "measured"
    whole = plan(*(PlannedTest(id, ("P1", "P2"), 10) for id in ("AP", "vAP", "AD", "dAP", "E")))
    others = [v for v in evaluate(whole, rows("AP", ["P1"], [1], POINTS[:1]), TIE, TRACKER).values if v.where != "P1"]
    assert {v.id for v in others if v.status == "not-measured"} >= {"AP", "RP", "AD", "RD", "E", "dAP", "dRP", "vAP"}


@pytest.mark.parametrize(
    ("test", "pose", "off", "approach", "text"),
    [
        ("RP", "P1", 0.0, "", "RP is evaluated from the rows of AP"),
        ("dRP", "P1", 0.0, "", "dRP is evaluated from the rows of dAP"),
        ("AT", "P1", 0.0, "", "AT is not evaluated from poses"),
        ("AQ", "P1", 0.0, "", "the criterion is not known"),
        ("AD", "P1", 0.0, "", "the plan does not have this test"),
        ("AP", "P9", 0.0, "", "does not have this pose in the test AP"),
        ("AP", "P1", 0.3, "", "1 pose outside the cube, the first 100 mm"),
        ("AP", "P2", 0.0, "", "1 pose at another place than the plan has it"),
        ("vAP", "P1", 0.0, "", "the approach is missing"),
        ("vAP", "P1", 0.0, "w", "the plan does not have this approach"),
        ("E", "P1", 0.0, "", "robots that are exchanged need names"),
    ],
)
def test_rows_that_do_not_fit_the_plan_are_refused(test: str, pose: str, off: float, approach: str, text: str) -> None:
    poses = (PlannedTest("AP", NAMES, 30), PlannedTest("E", NAMES, 30), PlannedTest("dAP", ("P1",), 10))
    task = plan(*poses, PlannedTest("vAP", NAMES, 30, approaches=("x", "y")))
    with pytest.raises(InputError, match=text) as refused:
        evaluate(task, rows(test, [pose], [1], POINTS[:1] + off, approach=[approach]), TIE, TRACKER)
    assert "poses.csv, line 2" in str(refused.value)


def test_a_cycle_with_two_approaches_in_a_test_without_them_is_refused() -> None:
    read = rows("AP", ["P1"] * 2, [1, 1], POINTS[[0, 0]], approach=["x", "y"])
    with pytest.raises(InputError, match="lines 2 and 3: cycle 1 appears twice"):
        evaluate(plan(PlannedTest("AP", NAMES, 30)), read, TIE, TRACKER)


def pushes(stiffness: float = 5e5, most: float = 3.0 * GRAVITY) -> Pushes:
    """A linear spring, which begins at 0.1 mm, seen from an instrument that is turned."""
    keys = [*product((s + a for a in "xyz" for s in "+-"), (1, 2, 3), range(11))]
    force = np.array([most * step / 10 for _, _, step in keys])
    way = np.array([np.eye(3)["xyz".index(d[1])] * (1 if d[0] == "+" else -1) for d, _, _ in keys])
    position = POINTS[0] + 1e-4 * way + way * (force / stiffness)[:, None]
    cycle = np.array([c for _, c, _ in keys], dtype=np.intp)
    return Pushes(Names.of([d for d, _, _ in keys]), force, cycle, position, np.arange(2, 200), "forces.csv")


def test_compliance_of_a_linear_spring() -> None:
    task = plan(PlannedTest("compliance", ("P1",), 3))
    values, lines = evaluate_pushes(task, pushes(), TIE, TRACKER)
    assert [value.where for value in values] == ["+x", "-x", "+y", "-y", "+z", "-z"]
    for value in values:
        assert (value.value, value.least, value.largest) == pytest.approx((2e-6,) * 3, rel=1e-9)
        assert (value.status, value.interval, value.cycles) == ("measured", None, 3)
    assert len(lines) == 18
    assert lines[0].displacement == pytest.approx(lines[0].force * 2e-6, abs=1e-12)


def test_an_outlying_push_is_named_and_no_other() -> None:
    task = plan(PlannedTest("compliance", ("P1",), 3))
    rng = np.random.default_rng(2)
    read = pushes()
    for _ in range(50):
        noisy = dataclasses.replace(read, position=read.position + 3e-6 * rng.standard_normal(read.position.shape))
        assert outlying_pushes(evaluate_pushes(task, noisy, TIE, TRACKER)[1], TRACKER) == ()
    position = noisy.position.copy()
    position[[40, 100]] += [[2e-4, 0, 0], [0, -1e-4, 0]]
    values, lines = evaluate_pushes(task, dataclasses.replace(noisy, position=position), TIE, TRACKER)
    first, second = outlying_pushes(lines, TRACKER)
    assert (first.line, first.direction, second.line, second.direction) == (42, "-x", 102, "-y")
    assert (first.away, second.away) == pytest.approx((2e-4, 1e-4), rel=0.2)
    for named in (first, second):
        value = next(v for v in values if v.where == named.direction)
        assert named.value == pytest.approx(value.value)
        assert named.without == pytest.approx(2e-6, rel=0.1)
        assert abs(named.without - 2e-6) < abs(named.value - 2e-6)
    order = rng.permutation(len(position))
    names = Names.of([noisy.direction.names[code] for code in noisy.direction.code[order]])
    arrays = {name: getattr(noisy, name)[order] for name in ("force", "cycle", "position", "line")}
    shuffled = dataclasses.replace(noisy, direction=names, **arrays)
    assert evaluate_pushes(task, shuffled, TIE, TRACKER)[0] == evaluate_pushes(task, noisy, TIE, TRACKER)[0]


def test_drift_from_a_first_group_at_its_command_is_within_its_interval() -> None:
    rng = np.random.default_rng(5)
    drift = 1e-4 * (1 - np.exp(-np.linspace(0, 3, 9)))
    task = plan(PlannedTest("dAP", ("P1",), 10))
    within = []
    for _ in range(20):
        points = POINTS[0] + np.repeat(drift, 10)[:, None] * [1, 0, 0] + 1e-5 * rng.standard_normal((90, 3))
        values = evaluate(task, rows("dAP", ["P1"] * 90, [*range(1, 11)] * 9, points), TIE, TRACKER).values
        within.append(holds(value_of(values, "dAP"), drift[-1]))
    assert np.mean(within) >= 0.95


def test_pushes_that_cannot_be_used_are_refused() -> None:
    task, read = plan(PlannedTest("compliance", ("P1",), 3)), pushes()
    swapped = {"+x": "-x", "-x": "+x"}
    names = Names(tuple(swapped.get(name, name) for name in read.direction.names), read.direction.code)
    one_way = plan(PlannedTest("compliance", ("P1",), 3, approaches=("+x",)))
    for planned, pushed, text in (
        (
            task,
            dataclasses.replace(read, direction=names),
            r"line 35: the tip moves against the force in cycle 1 of the direction \+x",
        ),
        (one_way, read, "does not have this direction"),
        (task, pushes(most=40.0), "above the weight of the rated load"),
        (task, pushes(most=0.0), "one force alone"),
        (plan(), read, "no test of compliance"),
    ):
        with pytest.raises(InputError, match=text):
            evaluate_pushes(planned, pushed, TIE, TRACKER)


def test_a_perfect_robot_is_seldom_called_inaccurate() -> None:
    rng = np.random.default_rng(11)
    points = rng.standard_normal((300, 30, 3)) * [3, 1, 0.3]
    intervals = [norm_interval(p.mean(axis=0), np.cov(p.T), 30, np.zeros((3, 3))) for p in points]
    assert np.mean([interval is not None and interval[0] == 0.0 for interval in intervals]) > 0.95


def test_a_tie_that_is_as_far_off_as_the_robot_leaves_drift_open() -> None:
    rng = np.random.default_rng(4)
    change = np.repeat([0.0, 3e-5, 6e-5, 9.5e-5], 10)
    true = POINTS[0] + np.outer(5e-5 + change, [1.0, 0.0, 0.0]) + 5e-6 * rng.standard_normal((40, 3))
    off = true - [1e-4, 0.0, 0.0]  # what is read with a tie that is one of its deviations off
    task, read = plan(PlannedTest("dAP", ("P1",), 10)), rows("dAP", ["P1"] * 40, [*range(1, 11)] * 4, off)
    known = Alignment("base-features", Transform(), 1e-4, 1e-6)
    low, high = value_of(evaluate(task, read, known, TRACKER).values, "dAP").interval or (1.0, 0.0)
    assert low < 9.5e-5 < high
    exact = Alignment("base-features", Transform(), 1e-9, 1e-9)
    low, high = value_of(evaluate(task, read, exact, TRACKER).values, "dAP").interval or (0.0, 1.0)
    assert high < 7e-5


def test_poses_of_another_cube_are_told() -> None:
    def clouds(scale: float, shift: float, outlying: float = 0.0) -> tuple[PoseCloud, ...]:
        middle = POINTS.mean(axis=0)
        of_poses = []
        for k, point in enumerate(POINTS):
            at = middle + scale * (point - middle) + np.array([shift, 0.0, outlying * (-1) ** k])
            of_poses.append(PoseCloud("AP", "", NAMES[k], "", 1.0, 1.0, point, at[None], at, 0.0))
        return tuple(of_poses)

    side = 0.2
    larger = other_cube(clouds(1.02, 0.0), side)
    assert larger is not None
    assert larger.test == "AP"
    assert (larger.scale, larger.aside) == pytest.approx((1.02, 0.0), abs=1e-9)
    moved = other_cube(clouds(1.0, 0.011), side)
    assert moved is not None
    assert moved.aside == pytest.approx(0.011)
    pair = other_cube(clouds(0.98, 0.001)[1:4:2], side)
    assert pair is not None
    assert pair.scale == pytest.approx(0.98)
    for ordinary in (clouds(1.009, 0.0), clouds(1.0, 0.009), clouds(1.02, 0.0, outlying=2e-3), clouds(1.02, 0.0)[:1]):
        assert other_cube(ordinary, side) is None
