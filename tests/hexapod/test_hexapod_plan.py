"""Measuring with the hexapod device: reach, room, the printed plan, and a calibration in two steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import reduce

import numpy as np
import pytest
from scipy.optimize import minimize

from papers.campaign import Campaign, touching, two_steps
from papers.placements import identify_placements, in_one_frame
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.hexapod import DEVICE, HexapodPose, leg_lengths, poses, triangle
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import MODELS
from truearm.engine.motion.cell import segment_distance
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import JointTruth
from truearm.hexapod.reachable import Reachable, arm_links, clearance, reachable, steps_text, with_cups
from truearm.hexapod.rehearsal import ballbar, joined

HALF, DOWN = np.radians(-15.0), np.diag([1.0, -1.0, -1.0])
#: B1 of a fixture that stands before the robot, turned by -30 deg.
FIXTURE = Transform((0.2268, 0.0, 0.1), (float(np.cos(HALF)), 0.0, 0.0, float(np.sin(HALF))))
Arm = tuple[Robot, tuple[HexapodPose, ...]]


@pytest.fixture(scope="module")
def arm() -> Arm:
    robot, cups = with_cups(load_robot("lrmate200ic"))
    return robot, poses(cups)


@pytest.fixture(scope="module")
def plan(arm: Arm) -> Reachable:
    return reachable(arm[0], FIXTURE, arm[1], branches=("front-up", "back-down"))


# -- room -----------------------------------------------------------------------------------------------------


def test_the_distance_of_segments_is_the_smallest_there_is() -> None:
    rng = np.random.default_rng(0)
    ends = rng.uniform(-1, 1, (4, 3, 40))
    ends[1, :, :5] = ends[0, :, :5] + 2 * (ends[3, :, :5] - ends[2, :, :5])  # parallel
    ends[1, :, 5] = ends[0, :, 5]  # a point
    distances = segment_distance(*ends)
    for n in range(40):
        p1, q1, p2, q2 = ends[:, :, n]

        def apart(x: Array, p1: Array = p1, q1: Array = q1, p2: Array = p2, q2: Array = q2) -> float:
            return float(np.sum((p1 + x[0] * (q1 - p1) - p2 - x[1] * (q2 - p2)) ** 2))

        starts = [(0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
        best = min(minimize(apart, start, bounds=[(0, 1), (0, 1)]).fun for start in starts)
        assert distances[n] == pytest.approx(np.sqrt(best), abs=2e-5)
    crossing = np.array([[[-1], [0], [0]], [[1], [0], [0]], [[0], [-1], [0.25]], [[0], [1], [0.25]]], float)
    assert segment_distance(*crossing) == pytest.approx([0.25], abs=1e-15)


def test_a_bar_through_the_forearm_has_no_room(arm: Arm) -> None:
    joints = np.radians([[10.0, 20.0, 10.0, 0.0, 40.0, 0.0]])
    first, last = arm_links(arm[0], joints)
    middle = (first[3] + last[3]) / 2  # between wrist and elbow
    across = np.array([[0.0], [0.3], [0.0]])
    through = (middle - across)[None], (middle + across)[None]
    assert clearance(arm[0], joints, *through, arm_radius=0.05)[0] == pytest.approx(-0.06, abs=1e-3)
    far = (through[0] + 5.0, through[1] + 5.0)
    assert clearance(arm[0], joints, *far, arm_radius=0.05)[0] > 5


# -- reach ----------------------------------------------------------------------------------------------------


def test_every_planned_configuration_makes_all_legs_nominal(arm: Arm, plan: Reachable) -> None:
    robot, _ = arm
    twin = Twin(robot)
    base = triangle([0.3] * 3, "B") @ FIXTURE.rotation.T + np.array(FIXTURE.translation)
    low, high = np.array([joint.limits for joint in robot.joints]).T
    assert plan.poses_reached > 40
    assert len(plan.rows) > plan.poses_reached
    assert len(plan.rows) + sum(plan.left_out.values()) >= 72
    for row, gap in zip(plan.rows, plan.clearance, strict=True):
        frames = twin.target_frames(row.joints)
        cups = np.array([frames[name][:3, 3] for name in ("1", "2", "3")])
        assert leg_lengths(row.design, base, cups) == pytest.approx(np.full(6, 0.3), abs=2e-5)  # 93.7, not 93.675 mm
        assert ((row.joints >= low) & (row.joints <= high) & (np.abs(row.joints) <= np.pi + 1e-9)).all()
        assert row.branch.startswith(("front-up", "back-down"))
        assert gap > 0


def test_the_plan_does_not_depend_on_where_the_robot_stands(arm: Arm, plan: Reachable) -> None:
    robot, wanted = arm
    cups = {target.name: [robot.values[target.parameter(a)] for a in "xyz"] for target in robot.targets}
    moved = robot.with_frames(Transform((1.0, 2.0, 3.0), (0.8, 0.0, 0.6, 0.0)), cups)
    again = reachable(moved, FIXTURE, wanted, branches=("front-up", "back-down"))
    assert [row.pose for row in again.rows] == [row.pose for row in plan.rows]
    assert again.clearance == pytest.approx(plan.clearance, abs=1e-9)


def test_the_steps_name_every_leg(arm: Arm, plan: Reachable) -> None:
    text = steps_text(plan, arm[0])
    assert text.count("[ ] Attach the bar between") == 6 * len(plan.rows)
    assert "Attach the bar between B1 and T1." in text
    assert max(len(line) for line in text.splitlines()) <= 120


def test_refusals(arm: Arm) -> None:
    robot, wanted = arm
    calls: list[tuple[Callable[[], object], str]] = [
        (lambda: reachable(robot, Transform((5.0, 0.0, 0.0)), wanted), "can reach none of the 72 poses.*out of reach"),
        (lambda: reachable(robot, FIXTURE, wanted, branches=("left",)), "there is no such branch"),
        (lambda: reachable(robot, FIXTURE, wanted, arm_radius=1.0), "arm at the bars"),
        (lambda: with_cups(load_robot("lrmate200ic"), "gripper"), "no such tool"),
        (lambda: with_cups(load_robot("ur5")), "three cups"),
        (lambda: touching(robot, "1", Transform((2.0, 0.0, 0.0)), 0.3, DOWN), "cannot bring its cup 1 to B1"),
        (lambda: identify_placements(robot, [], ELASTIC), "at least one place"),
    ]
    for call, words in calls:
        with pytest.raises(InputError, match=words):
            call()


# -- two steps ------------------------------------------------------------------------------------------------

ELASTIC = next(model for model in MODELS if model.name == "elastic")


def wrong(robot: Robot, share: float, seed: int) -> Twin:
    """Return an invented LR Mate: chapter 4 prints no parameters. Gears err by 0.1 mrad, which no model here has."""
    rng = np.random.default_rng(seed)
    true = {
        p.name: p.value + share * p.prior * float(rng.standard_normal())
        for p in robot.parameters.values()
        if p.group in ("geometry", "joint zero")
    }
    compliances = {2: 0.04e-3, 3: 0.13e-3, 4: 0.6e-3, 5: 0.5e-3, 6: 0.6e-3}

    def gear() -> tuple[tuple[int, float, float], ...]:
        return tuple((k, 1e-4 * float(rng.normal()), float(rng.uniform(0, 6))) for k in (1, 2))

    joints = {n: JointTruth(compliance=c, cubic=-1e-4 * c, gear=gear()) for n, c in compliances.items()}
    return Twin(robot.with_values(true), joints)


@pytest.fixture(scope="module")
def campaign(arm: Arm, plan: Reachable) -> tuple[Twin, Campaign]:
    robot, wanted = arm
    twin = wrong(robot, 0.3, 3)
    touches = touching(robot, "1", FIXTURE, DEVICE.base, DOWN)
    bar = ballbar(np.random.default_rng(3))
    return twin, two_steps(robot, twin, touches, wanted, plan.rows[::2], ELASTIC, bar)


def test_what_is_beyond_the_range_is_skipped_until_the_first_calibration(
    arm: Arm, plan: Reachable, campaign: tuple[Twin, Campaign]
) -> None:
    twin, measured = campaign
    rows = plan.rows[::2]
    assert sorted((*measured.first, *measured.second, *measured.out_of_range)) == list(range(len(rows)))
    assert 8 < len(measured.first) < len(rows)
    assert len(measured.second) > 8
    assert measured.data.configurations == len(measured.first) + len(measured.second)
    inside = 0
    for row, planned in enumerate(rows):
        frames = twin.target_frames(planned.joints)
        cups = np.array([frames[name][:3, 3] for name in ("1", "2", "3")])
        inside += bool(np.abs(leg_lengths(planned.design, measured.base_cups, cups) - 0.3).max() < 1e-3) == (
            row in measured.first
        )
    assert inside >= len(rows) - 1  # the noise may decide for one at the very edge


def test_the_final_calibration_sees_all_and_a_tracker_is_better_away_from_the_fixture(
    arm: Arm, campaign: tuple[Twin, Campaign]
) -> None:
    robot, _ = arm
    twin, measured = campaign
    rng = np.random.default_rng(11)
    seen = measure(twin, robot.random_configurations(150, rng), 0.0, rng)
    frame = Transform.from_matrix(*_frame_of(measured.base_cups))
    from_fixture = replace(seen, position=(seen.position - np.array(frame.translation)) @ frame.rotation)
    tracker = identify(robot, measure(twin, robot.random_configurations(50, rng), 2e-5, rng), ELASTIC)
    away = np.linalg.norm(from_fixture.position - [0.15, 0.087, 0.245], axis=1) > 0.25
    by_tracker = np.linalg.norm(errors_of(tracker.robot, seen).position_errors[away], axis=1)
    by_device = np.linalg.norm(errors_of(measured.final.robot, from_fixture).position_errors[away], axis=1)
    nominal = np.linalg.norm(errors_of(robot, seen).position_errors, axis=1)
    assert by_tracker.mean() < by_device.mean() < nominal.mean() / 3
    # the frame by the readings at the cups, as the document finds it
    touched = measured.frame_by(measured.final.robot, "1").frame
    assert touched.translation == pytest.approx([0, 0, 0], abs=5e-4)  # the fit's world is the fixture's frame


def _frame_of(cups: Array) -> tuple[Array, Array]:
    x = (cups[1] - cups[0]) / np.linalg.norm(cups[1] - cups[0])
    z = np.cross(x, cups[2] - cups[0])
    z /= np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z]), cups[0]


def test_a_robot_that_is_too_wrong_is_refused(arm: Arm, plan: Reachable) -> None:
    robot, wanted = arm
    touches = touching(robot, "1", FIXTURE, DEVICE.base, DOWN)
    bar = ballbar(np.random.default_rng(0))
    with pytest.raises(InputError, match=r"the distance B1-B2 is beyond"):
        two_steps(robot, Twin(robot.with_values({"a_3": 0.33})), touches, wanted, plan.rows[:3], ELASTIC, bar)
    twisted = Twin(robot.with_values({"theta_offset_6": np.radians(3.0)}))
    with pytest.raises(InputError, match=r"not one pose is within the ballbar's range.*3 poses"):
        two_steps(robot, twisted, touches, wanted, plan.rows[:3], ELASTIC, bar)


# -- several places -------------------------------------------------------------------------------------------


def at_places(twin: Twin, counts: tuple[int, ...], noise: float) -> tuple[list[Transform], list[Dataset]]:
    """Return frames and what is measured in them, with a little more noise than the ballbar has."""
    rng = np.random.default_rng(5)
    frames, data = [], []
    for count in counts:
        q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
        frame = Transform.from_matrix(q * np.linalg.det(q), rng.uniform(-0.5, 0.5, 3))
        seen = measure(twin, twin.robot.random_configurations(count, rng), noise, rng)
        position = (seen.position - np.array(frame.translation)) @ frame.rotation
        frames.append(frame)
        data.append(replace(seen, position=position, sigma=None, approach=None, number=None))
    return frames, data


def test_places_come_into_one_frame_by_the_model(arm: Arm) -> None:
    robot, _ = arm
    cups = {target.name: [robot.values[target.parameter(a)] for a in "xyz"] for target in robot.targets}
    frames, data = at_places(Twin(robot), (4, 6, 5), 0.0)
    known = robot.with_frames(_inverse_of(frames[0]), cups)
    together = in_one_frame(known, data)
    for frame, before, after in zip(frames, data, together, strict=True):
        world = before.position @ frame.rotation.T + np.array(frame.translation)
        expected = (world - np.array(frames[0].translation)) @ frames[0].rotation
        assert after.position == pytest.approx(expected, abs=1e-12)


def _inverse_of(frame: Transform) -> Transform:
    return Transform.from_matrix(frame.rotation.T, -frame.rotation.T @ np.array(frame.translation))


def test_more_places_tell_more(arm: Arm) -> None:
    robot, _ = arm
    true = wrong(robot, 0.3, 8)
    twin = Twin(true.robot, {n: JointTruth(compliance=t.compliance) for n, t in true.joints.items()})
    frames, data = at_places(twin, (14, 30, 30), 1e-4)
    unseen = measure(twin, robot.random_configurations(60, np.random.default_rng(9)), 0.0, np.random.default_rng(0))
    in_first = (unseen.position - np.array(frames[0].translation)) @ frames[0].rotation
    unseen = replace(unseen, position=in_first)
    left = []
    for places in (data[:1], data):
        fit = identify_placements(robot, places, ELASTIC)
        left.append(errors_of(fit.robot, unseen).position_norms.mean())
    assert left[1] < 0.7 * left[0]
    # as many readings in one frame would tell about as much
    world = [
        replace(part, position=part.position @ frame.rotation.T + np.array(frame.translation))
        for frame, part in zip(frames, data, strict=True)
    ]
    best = identify(robot, reduce(joined, world), ELASTIC)
    back = replace(unseen, position=in_first @ frames[0].rotation.T + np.array(frames[0].translation))
    assert left[1] < 2.0 * errors_of(best.robot, back).position_norms.mean()
