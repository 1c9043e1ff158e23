"""A simulated campaign has the rows that its plan asks for, and they follow from the truth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.performance_plan import DOWN, small_plan

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import IDENTITY, rotation_vector
from truearm.engine.twin.truths import truth_twin
from truearm.iso9283.planning.criteria import TURNS, PerformancePlan
from truearm.iso9283.planning.records import AttainedPoses
from truearm.iso9283.simulating.cell import SimulatedCampaign, Tracker, TrueRobot, simulated_campaign
from truearm.iso9283.simulating.moving_arm import DRIVES, WARMING, ZONE, Drives, Servo

#: Of poses several, which are quick; of streams, which are not, two of one test and one of all others.
CYCLES = {"AP": 3, "vAP": 2, "AD": 2, "dAP": 4, "E": 2}
CYCLES |= {"t": 1, "posing-time": 1, "AT": 2, "AT-reorientation": 1, "CR": 1, "AV": 1, "WS": 1}
EXACT = Tracker(0.0, 0.0, 250.0)
#: Drives that do what they are told: what is then read are the commands.
IDEAL = Drives(servo=Servo(3000.0, 1.0, feedforward=1.0), scatter=0.0, play=0.0, pace=0.0)
AT_ONCE = replace(WARMING, rise=0.0)


def run(
    plan: PerformancePlan, truth: str = "nominal", tracker: Tracker = EXACT, drives: Drives = IDEAL, seed: int = 1
) -> tuple[SimulatedCampaign, Array]:
    """Return what is read, and the base in the instrument's frame."""
    twin = truth_twin(plan.robot, truth, np.random.default_rng(0))
    warming = WARMING if drives.play else AT_ONCE
    base = twin.robot.base.matrix
    robots = [TrueRobot(twin, IDENTITY)] * 5
    return simulated_campaign(
        plan, robots, base, tracker, np.random.default_rng(seed), drives=drives, warming=warming
    ), base


def in_base(position: Array, base: Array) -> Array:
    return np.asarray((position - base[:3, 3]) @ base[:3, :3])


def poses_of(campaign: SimulatedCampaign) -> AttainedPoses:
    assert campaign.poses is not None
    return campaign.poses


def stream(simulated: tuple[SimulatedCampaign, Array], test: str, place: str) -> tuple[Array, Array, Array | None]:
    """Return time, position and orientation of the first cycle in the base frame."""
    campaign, base = simulated
    samples = campaign.settling if test in ("t", "posing-time") else campaign.paths
    assert samples is not None
    rows = samples.criterion.are(test) & samples.place.are(place) & (samples.cycle == 1)
    turned = None if samples.rotation is None else base[:3, :3].T @ samples.rotation[rows]
    return samples.time[rows], in_base(samples.position[rows], base), turned


@pytest.fixture(scope="module")
def whole() -> SimulatedCampaign:
    tracker = Tracker(1e-5, 1e-4, 250.0)
    return run(small_plan(cycles=CYCLES, velocities=(1.0, 0.5)), "tracker-triangular", tracker, DRIVES)[0]


@pytest.fixture(scope="module")
def ideal() -> tuple[SimulatedCampaign, Array]:
    return run(small_plan(["AP", "t", "posing-time", "AT", "AT-reorientation", "CR", "AV", "WS"], cycles=CYCLES))


def test_poses_are_read_as_often_as_planned(whole: SimulatedCampaign) -> None:
    poses = poses_of(whole)
    assert set(poses.robot.rows(poses.criterion.are("E")).names) >= {"r1", "r2", "r3", "r4", "r5"}
    counts = {name: int(poses.criterion.are(name).sum()) for name in ("AP", "vAP", "AD", "E", "dAP")}
    groups = 3  # at once, after half an hour and after an hour
    assert counts == {"AP": 2 * 3 * 5, "vAP": 2 * 2 * 9, "AD": 2 * 2 * 2, "E": 2 * 2 * 5 * 5, "dAP": 4 * groups}
    assert (np.diff(poses.time) > 0).all()
    drift = poses.criterion.are("dAP")
    assert poses.cycle[drift].tolist() == list(range(1, 13))
    assert np.diff(poses.time[drift][::4]) == pytest.approx([1800.0, 1800.0], abs=1e-6)


def test_streams_have_their_places_cycles_and_rising_times(whole: SimulatedCampaign) -> None:
    paths, settling = whole.paths, whole.settling
    assert paths is not None
    assert settling is not None
    assert set(paths.criterion.names) == {"AT", "AT-reorientation", "CR", "AV", "WS"}
    places = {paths.place.names[k] for k in paths.place.code[paths.criterion.are("AT")]}
    assert places == {"line", "rectangle", "large-circle", "small-circle"}
    assert set(settling.place.names) == {"P1", "D10", "D50"}
    for samples in (paths, settling):
        assert (np.diff(samples.time) > 0).all()
        assert set(samples.velocity.tolist()) == {0.5, 1.0}
    assert paths.rotation is not None
    assert settling.rotation is None


def test_pushes_are_in_both_senses_of_each_axis_in_tenths_of_the_load(whole: SimulatedCampaign) -> None:
    forces = whole.forces
    assert forces is not None
    assert forces.direction.names == ("+x", "-x", "+y", "-y", "+z", "-z")
    chosen = forces.direction.are("+z") & (forces.cycle == 2)
    np.testing.assert_allclose(forces.force[chosen], np.arange(11) * 0.1 * 3.0 * 9.80665)


def test_the_same_seed_gives_the_same_readings_and_another_one_others() -> None:
    plan = small_plan(["AP", "AV"], cycles=CYCLES)
    tracker = Tracker(1e-5, 1e-4, 100.0)
    first, again, other = (run(plan, "tracker-triangular", tracker, DRIVES, seed) for seed in (1, 1, 2))
    assert np.array_equal(poses_of(first[0]).position, poses_of(again[0]).position)
    assert not np.array_equal(poses_of(first[0]).position, poses_of(other[0]).position)
    assert np.array_equal(stream(first, "AV", "line")[0], stream(again, "AV", "line")[0])


def test_a_perfect_robot_attains_its_commands(ideal: tuple[SimulatedCampaign, Array]) -> None:
    (campaign, base), plan = ideal, small_plan(["AP"])
    poses = poses_of(campaign)
    assert poses.rotation is not None
    for name in ("P1", "P2", "P3", "P4", "P5"):
        rows = poses.pose.are(name)
        np.testing.assert_allclose(in_base(poses.position[rows], base), [plan.poses[name].position] * 3, atol=1e-8)
        np.testing.assert_allclose(base[:3, :3].T @ poses.rotation[rows], [DOWN] * int(rows.sum()), atol=1e-8)


def test_joints_that_come_to_rest_elsewhere_scatter_the_tip_by_the_jacobian() -> None:
    plan = small_plan(["AP"], cycles={"AP": 400})
    plan = replace(plan, tests=(replace(plan.tests[0], places=("P1",)),))
    campaign, base = run(plan, drives=replace(IDEAL, scatter=1e-5))
    J = plan.robot.jacobian(plan.poses["P1"].joints[None])[0, :3]
    expected = 1e-10 * J @ J.T
    covariance = np.cov(in_base(poses_of(campaign).position, base).T)
    np.testing.assert_allclose(covariance, expected, atol=0.2 * expected.max())


def test_the_middle_of_a_line_is_run_at_the_commanded_velocity(ideal: tuple[SimulatedCampaign, Array]) -> None:
    time, position, _ = stream(ideal, "AV", "line")
    speed = np.linalg.norm(np.diff(position, axis=0), axis=1) / np.diff(time)
    assert speed.max() == pytest.approx(0.5, rel=1e-4)
    assert np.median(speed[speed > 0.4]) == pytest.approx(0.5, rel=1e-6)


def test_a_rectangle_stops_at_its_corners_where_accuracy_is_tested_and_cuts_them_where_corners_are(
    ideal: tuple[SimulatedCampaign, Array],
) -> None:
    corners = small_plan(["CR"]).paths["rectangle"].points[1:4]
    cut = ZONE * math.sqrt(2) / 4
    for test, least, most in (("AT", 0.0, 0.1e-3), ("CR", 0.9 * cut, 1.3 * cut)):
        _, position, _ = stream(ideal, test, "rectangle")
        nearest = np.linalg.norm(position[:, None] - corners, axis=2).min(axis=0)
        assert (nearest >= least).all()
        assert (nearest <= most).all()


def test_circles_keep_their_radius_and_close(ideal: tuple[SimulatedCampaign, Array]) -> None:
    for name in ("large-circle", "small-circle"):
        centre, first = small_plan(["AT"]).paths[name].points
        _, position, _ = stream(ideal, "AT", name)
        away = np.linalg.norm(position - centre, axis=1)
        np.testing.assert_allclose(away, np.linalg.norm(first - centre), atol=5e-6)
        np.testing.assert_allclose(position[[0, -1]], [first, first], atol=1e-6)


def test_the_orientation_alternates_on_the_way(ideal: tuple[SimulatedCampaign, Array]) -> None:
    _, _, rotation = stream(ideal, "AT-reorientation", "line")
    assert rotation is not None
    angle = np.degrees(rotation_vector(rotation @ DOWN.T)[:, 0])
    peaks = (angle[1:-1] > angle[:-2]) & (angle[1:-1] >= angle[2:]) & (angle[1:-1] > 5.0)
    assert int(peaks.sum()) == TURNS // 2
    assert angle.max() == pytest.approx(10.0, abs=0.6)
    assert abs(angle[-1]) < 1e-3


def test_a_weave_goes_from_side_to_side_as_planned() -> None:
    plan = small_plan(["WS"], cycles={"WS": 1}, rated_velocity=0.01)
    path = plan.paths["weave"]
    time, position, _ = stream(run(plan), "WS", "weave")
    along = (path.points[1] - path.points[0]) / np.linalg.norm(path.points[1] - path.points[0])
    aside = (position - path.points[0]) @ np.cross(path.normal, along)
    # Corners are blended: each is cut by a quarter of the zone times the change of direction.
    cut = 0.05 * path.stroke * 2 * math.sin(math.atan2(path.stroke, path.wavelength / 2)) / 4
    assert np.ptp(aside) == pytest.approx(path.stroke - 2 * cut, rel=1e-3)
    through = np.flatnonzero((aside[1:] > 0) & (aside[:-1] <= 0))
    assert np.diff(time[through])[1:-1] == pytest.approx(path.wavelength / 0.01, rel=2e-2)


def test_a_weak_servo_overshoots_and_the_tip_comes_to_rest_at_its_pose() -> None:
    plan = small_plan(["t", "posing-time"], cycles={"t": 1, "posing-time": 1})
    simulated = run(plan, drives=replace(IDEAL, servo=Servo(60.0, 0.3, feedforward=1.0)))
    away = np.linalg.norm(stream(simulated, "t", "P1")[1] - plan.poses["P1"].position, axis=1)
    assert away[-1] < 1e-6
    assert away[int(np.argmax(away < plan.limit_band)) :].max() > plan.limit_band
    _, begun, _ = stream(simulated, "posing-time", "D50")
    np.testing.assert_allclose(begun[0], plan.poses["P1"].position, atol=1e-8)
    np.testing.assert_allclose(begun[-1], plan.poses["D50"].position, atol=1e-6)


def test_the_arm_drifts_while_it_warms_up_and_a_heavier_load_lowers_the_tip() -> None:
    plan = small_plan(["dAP"], cycles={"dAP": 1}, hours=8.0)
    place = poses_of(run(plan, drives=replace(DRIVES, scatter=0.0))[0]).position
    moved = np.linalg.norm(place - place[0], axis=1)
    assert (np.diff(moved) > -1e-7).all()
    assert 2e-5 < moved[-1] < 2e-4
    poses = poses_of(run(small_plan(["AP"], cycles={"AP": 1}, loads=(0.1, 1.0)), "tracker-triangular")[0])
    light, heavy = (float(poses.position[poses.pose.are("P1") & (poses.load == load), 2][0]) for load in (0.1, 1.0))
    assert 0.2e-3 < light - heavy < 0.6e-3


def test_plans_that_cannot_be_run_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, lines = small_plan(["AP"], cycles={"AP": 1}), small_plan(["AT-reorientation"])
    line = lines.paths["line"]
    alone = replace(plan, poses={"P1": plan.poses["P1"]}, tests=(replace(plan.tests[0], places=("P1",)),))
    for wrong, words in (
        (replace(plan, tests=(replace(plan.tests[0], places=("P9", "P1")),)), "the plan has no such pose; got 'P9'"),
        (alone, "one pose alone"),
        (replace(lines, paths={}), "the plan has no such path; got 'line'"),
        (replace(lines, paths={"line": replace(line, other=None)}), "this path has one orientation"),
        (
            replace(lines, paths={"line": replace(line, points=line.points + 2.0)}),
            "the robot cannot come to a commanded pose",
        ),
    ):
        with pytest.raises(InputError, match=words):
            run(wrong)
    monkeypatch.setenv("TRUEARM_LIMITS", "samples_read=100")
    with pytest.raises(InputError, match="too many samples"):
        run(lines)
