"""The KR5 paper's off-line compensation, on twins whose errors are only known from noisy circles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.engine.robot.test_conventions import about, slid
from tests.engine.robot.test_joint_errors import TABLE_1, TABLE_3, error, with_table_3

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.motion.cube import DIRECTIONS, SevenLines, seven_lines, usable_joints
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.engine.twin.twin import Twin, measure
from truearm.validation.lines import (
    CONVENTION,
    LineErrors,
    LineTest,
    design,
    fake_targets,
    from_data,
    inverted,
    on_twin,
    reduction,
)


@pytest.fixture(scope="module")
def lines() -> SevenLines:
    return seven_lines([0.85, 0.0, 0.6], [0.6, 0.8, 0.4])


@pytest.mark.parametrize("seed", range(3))
def test_it_is_equation_11(seed: int) -> None:
    q = np.random.default_rng(seed).uniform(-3, 3, 6)
    T = np.eye(4)
    for i, ((axis, angle), translation) in enumerate(TABLE_1):
        if i:
            T = T @ np.linalg.inv(error(*TABLE_3[i - 1])) @ about("z", q[i - 1])
        T = T @ slid(*(np.array(translation) / 1e3)) @ about(axis, np.radians(angle))
    position, rotation = inverted(with_table_3()).world_poses(q[None])
    assert_allclose(position[0], T[:3, 3], rtol=0, atol=1e-13)
    assert_allclose(rotation[0], T[:3, :3], rtol=0, atol=1e-13)


def test_a_joint_zero_is_an_error_too() -> None:
    robot = with_table_3()
    off = robot.with_values({"theta_offset_2": 0.01})
    q = np.array([[0.1, -1.0, 1.2, 0.3, 0.5, -0.2]])
    back = q - np.array([0, 0.01, 0, 0, 0, 0])
    alone = inverted(replace(off, known={"theta_offset_2": off.parameters["theta_offset_2"]}))
    assert_allclose(alone.world_poses(q)[0], design(robot).world_poses(back)[0], rtol=0, atol=1e-12)


def test_the_fake_target_mirrors_the_error(lines: SevenLines) -> None:
    robot, joints = with_table_3(), lines.joints(load_robot("kr5"))
    miss = robot.world_poses(joints)[0] - lines.position
    mirrored = fake_targets(robot, joints).position - lines.position
    assert np.linalg.norm(miss, axis=1).max() > 3e-3
    assert_allclose(mirrored, -miss, rtol=0, atol=2e-5)


def test_joints_for_it_bring_the_robot_there(lines: SevenLines) -> None:
    robot, joints = with_table_3(), lines.joints(load_robot("kr5"))
    commanded = usable_joints(fake_targets(robot, joints).solutions, lines.labels, "lines")
    left = np.linalg.norm(robot.world_poses(commanded)[0] - lines.position, axis=1)
    before = np.linalg.norm(robot.world_poses(joints)[0] - lines.position, axis=1)
    assert left.max() < 5e-6  # second order
    # Solving the inverse kinematics of the inverted model would double the error.
    doubled = np.linalg.norm(robot.world_poses(2 * joints - commanded)[0] - lines.position, axis=1)
    assert_allclose(doubled, 2 * before, rtol=0.02)


def test_it_does_not_matter_where_the_robot_stands(lines: SevenLines) -> None:
    robot, joints = with_table_3(), lines.joints(load_robot("kr5"))
    moved = robot.with_frames(Transform((1.0, 2.0, 3.0), (0.6, 0.0, 0.8, 0.0)), {"a": (0.0, 0.0, 0.1)})
    assert_allclose(fake_targets(moved, joints).position, fake_targets(robot, joints).position, atol=1e-12)


def test_other_robots_are_refused() -> None:
    with pytest.raises(InputError, match=r"kr5: the robot is not described by joint errors.*truearm axes"):
        inverted(load_robot("kr5"))
    with pytest.raises(InputError, match="not described by joint errors"):
        design(load_robot("kr5"))


# -- the line test ---------------------------------------------------------------------------------------


def test_lines_are_those_of_the_box(lines: SevenLines) -> None:
    assert len(lines.labels) == 77
    assert (lines.labels[0], lines.labels[-1]) == ("x-1", "xyz-11")
    lengths = {d: np.ptp(lines.position[lines.rows(d)], axis=0) for d in DIRECTIONS}
    assert_allclose(lengths["x"], [0.6, 0, 0], atol=1e-12)
    assert_allclose(lengths["yz"], [0, 0.8, 0.4], atol=1e-12)
    assert_allclose(lengths["xyz"], [0.6, 0.8, 0.4], atol=1e-12)
    for d in DIRECTIONS:
        assert_allclose(lines.position[lines.rows(d)][5], [0.85, 0.0, 0.6], atol=1e-12)


def test_joints_reach_the_poses_without_jumps(lines: SevenLines) -> None:
    robot = load_robot("kr5")
    joints = lines.joints(robot)
    assert_allclose(robot.world_poses(joints)[0], lines.position, rtol=0, atol=1e-9)
    for d in DIRECTIONS:
        assert np.abs(np.diff(joints[lines.rows(d)], axis=0)).max() < np.radians(25)


def test_a_box_out_of_reach_is_refused_with_the_pose() -> None:
    with pytest.raises(InputError, match=r"line test, .*cannot go to a pose"):
        seven_lines([1.4, 0, 0.6], [0.6, 0.8, 0.4]).joints(load_robot("kr5"))
    with pytest.raises(InputError, match="three sizes above zero"):
        seven_lines([1, 0, 0], [0.6, 0.0, 0.4])
    with pytest.raises(InputError, match="two poses or more"):
        seven_lines([1, 0, 0], [0.6, 0.1, 0.4], 1)


def test_twin_and_data_show_the_same_errors(lines: SevenLines) -> None:
    joints = lines.joints(load_robot("kr5"))
    placed = with_table_3().with_frames(Transform((2.0, 1.0, -0.5), (0.8, 0.0, 0.0, 0.6)), {"smr": (0.0, 0.0, 0.0)})
    rng = np.random.default_rng(0)
    shown = on_twin(lines, Twin(placed), joints, 0.0, 1, rng)
    expected = np.linalg.norm(with_table_3().world_poses(joints)[0] - lines.position, axis=1)
    assert_allclose(shown.error, expected, rtol=0, atol=1e-12)
    data = replace(measure(Twin(placed), joints, 0.0, rng), labels=lines.labels)
    stands = load_robot("kr5").with_frames(placed.base, {"smr": (0.0, 0.0, 0.0)})
    assert_allclose(from_data(lines, stands, data).error, expected, rtol=0, atol=1e-12)
    part = from_data(lines, stands, data.of_configurations(range(0, 77, 2)))
    assert part.largest("x") == pytest.approx(expected[0:11:2].max())
    with pytest.raises(InputError, match=r"no pose of line xyz"):
        from_data(lines, stands, data.of_configurations(range(60)))
    with pytest.raises(InputError, match=r"not a pose of the line test; got 'lift'"):
        from_data(lines, stands, replace(data, labels=("lift", *data.labels[1:])))


def test_summary_says_by_how_much_the_largest_error_fell(lines: SevenLines) -> None:
    before, after = (LineErrors(lines, np.full(77, error)) for error in (4e-3, 1e-3))
    assert reduction(before, after, "xy") == pytest.approx(75.0)
    robot = load_robot("kr5")
    joints = lines.joints(robot)
    words = LineTest(robot, lines, joints, True, before, after).summary()
    assert words["poses"] == 77
    assert [line["direction"] for line in words["lines"]] == list(DIRECTIONS)
    assert words["lines"][0]["after_mm"] == pytest.approx({"mean": 1.0, "max": 1.0})
    assert "after_mm" not in LineTest(robot, lines, joints, False, before, None).summary()["lines"][0]


def test_scatter_is_what_a_perfect_robot_shows(lines: SevenLines) -> None:
    robot = load_robot("kr5").with_frames(IDENTITY, {"smr": (0.0, 0.0, 0.1)})
    shown = on_twin(lines, Twin(robot), lines.joints(robot), 2e-5, 200, np.random.default_rng(1))
    assert np.mean(shown.error) == pytest.approx(2e-5 * np.sqrt(8 / np.pi), rel=0.02)


# -- the job ---------------------------------------------------------------------------------------------

CENTRE = (0.85, 0.0, 0.6)


def test_the_job_compensates_on_a_twin_and_writes_what_to_command(lines: SevenLines, tmp_path: Path) -> None:
    errors, nominal = with_table_3(), load_robot("kr5")
    plan = truearm.lines("kr5", CENTRE)
    assert (plan.before, plan.after, plan.lines()) == (None, None, ["The robot can go to all 77 poses."])
    assert_allclose(plan.joints, lines.joints(nominal), atol=1e-12)
    result = truearm.lines("kr5", CENTRE, joint_errors=errors, truth=errors, repeats=1, out=tmp_path / "plan.csv")
    assert result.before is not None
    assert result.after is not None
    assert_allclose(result.before.error, np.linalg.norm(errors.world_poses(plan.joints)[0] - lines.position, axis=1))
    assert result.after.error.max() < 5e-6
    for line, words in zip(result.summary()["lines"], result.lines()[1:], strict=True):
        rows = lines.rows(line["direction"])
        before, after = result.before.error[rows] * 1e3, result.after.error[rows] * 1e3
        assert (line["before_mm"]["mean"], line["after_mm"]["max"]) == pytest.approx((before.mean(), after.max()))
        assert line["reduction_percent"] == pytest.approx(100 * (1 - after.max() / before.max()))
        assert f"mean {before.mean():.3f}  max {before.max():.3f} mm   compensated mean {after.mean():.3f}" in words
    table = [row.split(",") for row in (tmp_path / "plan.csv").read_text().splitlines()]
    assert table[0] == ["configuration", *(f"joint_{k} [deg]" for k in range(1, 7))]
    assert [row[0] for row in table[1:]] == list(lines.labels)
    assert_allclose(np.array([row[1:] for row in table[1:]], float), np.degrees(result.joints), atol=1e-9)
    assert result.written_at("x").endswith("77 configurations, compensated joint positions.")
    assert plan.written_at("x").endswith("77 configurations, nominal joint positions.")


def test_the_job_judges_what_was_measured_in_the_frame_of_one_of_its_robots(lines: SevenLines) -> None:
    places = {"smr": (0.0, 0.0, 0.1)}
    placed = with_table_3().with_frames(Transform((2.0, 1.0, -0.5), (0.8, 0.0, 0.0, 0.6)), places)
    joints = lines.joints(load_robot("kr5"))
    data = replace(measure(Twin(placed), joints, 0.0, np.random.default_rng(0)), labels=lines.labels)
    by_errors = truearm.lines("kr5", CENTRE, joint_errors=placed, data=data).before
    nominal = load_robot("kr5").with_frames(placed.base, places)
    by_nominal = truearm.lines(nominal, CENTRE, joint_errors=with_table_3(), data=data).before
    fitted = truearm.lines("kr5", CENTRE, joint_errors=with_table_3(), data=data).before
    assert by_errors is not None
    assert by_nominal is not None
    assert fitted is not None
    assert_allclose(by_errors.error, by_nominal.error, atol=1e-12)
    # found from the lines themselves, base and target take a part of the errors away
    assert fitted.error.mean() < 0.8 * by_errors.error.mean()


def test_the_job_refuses_what_does_not_go_together() -> None:
    for value, parameter, words in (
        ({"truth": "random", "data": "x.csv"}, "truth, data", "only one of them"),
        ({"joint_errors": "kr5"}, "joint_errors", "not described by joint errors"),
        ({"joint_errors": converted(load_robot("irb1600"), CONVENTION)}, "joint_errors", "another robot than kr5"),
        ({"size": (0.6, 0.0, 0.4)}, "size", "three sizes above zero"),
        ({"centre": (2.85, 0.0, 0.6)}, "centre", "cannot go to a pose"),
    ):
        with pytest.raises(InputError, match=words) as refusal:
            truearm.lines("kr5", **{"centre": CENTRE, **value})  # type: ignore[arg-type]
        assert refusal.value.parameter == parameter
