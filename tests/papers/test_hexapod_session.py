"""Sessions on a twin: drift, the tool changer, and a fourth cup."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.data.hexapod import CUPS, DEVICE, Device, poses, triangle
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import JointTruth
from truearm.hexapod.places import plain_frame
from truearm.hexapod.rehearsal import SetUp, ToolChanger, ballbar, cups_dataset, joined, measure_poses, with_fourth
from truearm.hexapod.sheet import SIDES_OF_FOUR, PlannedRow, four_cups, side_frames

EXACT = Device(sigma=0.0)
FIXTURE = Transform((0.2, -0.15, 0.1))


@pytest.fixture(scope="module")
def arm() -> Robot:
    robot = load_robot("lrmate200ic")
    return robot.with_frames(IDENTITY, {str(n + 1): cup.tolist() for n, cup in enumerate(CUPS)})


@pytest.fixture(scope="module")
def plan(arm: Robot) -> tuple[list[PlannedRow], Array]:
    """A few poses and readings that take them."""
    wanted = poses()[::5]
    position = np.array([pose.position for pose in wanted]) + np.array(FIXTURE.translation)
    found = inverse(arm, position, np.array([pose.rotation for pose in wanted]))
    rows = [
        PlannedRow(str(n), "", pose.number, pose.design, pose.solution, found.joints[n])
        for n, pose in enumerate(wanted)
        if found.status[n].usable
    ]
    assert len(rows) > 5
    return rows, np.array([row.joints for row in rows])


def fixture(tool: float = DEVICE.tool) -> SetUp:
    cups = triangle([DEVICE.base] * 3, "B") + np.array(FIXTURE.translation)
    return SetUp(cups, np.full(3, DEVICE.base), np.full(3, tool))


def seen(twin: Twin, joints: Array) -> Array:
    at = [twin.target_frames(q) for q in joints]
    world = np.array([[frames[name][:3, 3] for name in "123"] for frames in at])
    return np.asarray(world - np.array(FIXTURE.translation))


def test_without_noise_the_cups_are_where_they_are(arm: Robot, plan: tuple[list[PlannedRow], Array]) -> None:
    rows, joints = plan
    found = measure_poses(Twin(arm), fixture(), rows, joints, ballbar(np.random.default_rng(0), EXACT))
    assert found == pytest.approx(seen(Twin(arm), joints), abs=1e-12)
    data = cups_dataset(arm, [str(row) for row in range(len(rows))], joints, found)
    twice = joined(data, data)
    assert twice.configurations == 2 * len(rows)
    assert twice.position[3 * len(rows) :] == pytest.approx(data.position)
    assert (twice.configuration == np.repeat(np.arange(2 * len(rows)), 3)).all()


def test_sessions_that_do_not_fit_are_refused(arm: Robot) -> None:
    data = cups_dataset(arm, ["a"], np.zeros((1, 6)), np.zeros((1, 3, 3)))
    told = replace(data, sigma=np.full(3, 1e-5), temperature=np.array([20.0]))
    both = joined(told, told)
    assert both.sigma == pytest.approx(np.full(6, 1e-5))
    assert both.temperature == pytest.approx([20.0, 20.0])
    with pytest.raises(InputError, match="only one of the sessions has sigma"):
        joined(data, told)
    with pytest.raises(InputError, match="not of one robot with one tool"):
        joined(data, replace(data, targets=("a", "b", "c")))
    with pytest.raises(InputError, match="sessions with quaternion cannot be joined"):
        joined(data, replace(data, quaternion=np.full((3, 4), 0.5)))


def test_a_bar_that_is_not_initialised_errs_more_and_more(arm: Robot, plan: tuple[list[PlannedRow], Array]) -> None:
    rows, joints = plan
    true = seen(Twin(arm), joints)

    def errors(initialise: bool) -> Array:
        bar = ballbar(np.random.default_rng(0), EXACT, drift=1e-7)
        found = measure_poses(Twin(arm), fixture(), rows, joints, bar, initialise=initialise)
        return np.asarray(np.linalg.norm(found - true, axis=2).max(axis=1))

    always, never = errors(True), errors(False)
    assert always.max() < 5 * 5e-7  # five steps at the last leg, times what a cup makes of a length
    assert never[0] == always[0]
    # at the last pose all legs are longer by about 6 (n - 1) steps
    grown = 6e-7 * (len(rows) - 1)
    assert 0.7 * grown < never[-1] < 3.4 * grown


def test_every_attachment_moves_the_tool_as_one_body(arm: Robot) -> None:
    changer = ToolChanger(np.random.default_rng(1), shift=1e-4, turn=1e-3)
    places = np.array([seen(changer.attached(Twin(arm)), np.zeros((1, 6)))[0] for _ in range(300)])
    for a, b in combinations(range(3), 2):
        assert np.linalg.norm(places[:, a] - places[:, b], axis=1) == pytest.approx(np.full(300, 0.15), abs=1e-12)
    # variance of a point: that of the shift, and of the turn times its squared distance from the axis
    for cup, place in enumerate(CUPS):
        expected = 3 * 1e-4**2 + 1e-3**2 * 2 * (place @ place)
        assert places[:, cup].var(axis=0).sum() == pytest.approx(expected, rel=0.15)


def test_a_tool_attached_anew_before_every_pose_scatters(arm: Robot, plan: tuple[list[PlannedRow], Array]) -> None:
    rows, joints = plan
    changer = ToolChanger(np.random.default_rng(2))
    bar = ballbar(np.random.default_rng(3), EXACT)
    found = measure_poses(Twin(arm), fixture(), rows, joints, bar, changer=changer)
    away = np.linalg.norm(found - seen(Twin(arm), joints), axis=2)
    assert 1e-5 < away.mean() < 1e-4
    assert np.abs(found - found.mean(axis=0)).max() > 1e-2  # poses, not one place


def test_lag_comes_from_the_side_of_visit(arm: Robot, plan: tuple[list[PlannedRow], Array]) -> None:
    rows, joints = plan
    lag = 1e-4
    twin = Twin(arm, {1: JointTruth(hysteresis=lag)})
    bar = ballbar(np.random.default_rng(0), EXACT)
    came = np.ones(joints.shape)
    forward, back = (measure_poses(twin, fixture(), rows, joints, bar, approach=d) for d in (came, -came))
    radius = np.linalg.norm(seen(Twin(arm), joints)[..., :2] + np.array(FIXTURE.translation)[:2], axis=2)
    assert np.linalg.norm(forward - back, axis=2) == pytest.approx(2 * lag * radius, rel=1e-3)


# -- a fourth cup ---------------------------------------------------------------------------------------------


def test_four_cups_are_a_tetrahedron_with_the_tool_outside() -> None:
    cups = four_cups(np.full(3, 0.3), np.full(3, 0.3))
    for a, b in combinations(range(4), 2):
        assert np.linalg.norm(cups[a] - cups[b]) == pytest.approx(0.3)
    assert cups[3, 2] < 0
    frames = side_frames(cups)
    for side, frame in zip(SIDES_OF_FOUR, frames, strict=True):
        inside = (cups.mean(axis=0) - np.array(frame.translation)) @ frame.rotation
        assert inside[2] < 0  # the tool is at positive z
        places = (cups[list(side)] - np.array(frame.translation)) @ frame.rotation
        assert places == pytest.approx(triangle([0.3] * 3, "B"), abs=1e-12)
    assert frames[0].rotation == pytest.approx(np.eye(3), abs=1e-12)


def test_measured_sides_lie_where_the_true_ones_do() -> None:
    rng = np.random.default_rng(5)
    cups = four_cups(np.full(3, 0.3), np.full(3, 0.3)) + rng.normal(0, 1e-4, (4, 3))
    first = plain_frame(cups[:3])
    base = np.array([np.linalg.norm(cups[a] - cups[b]) for a, b in ((0, 1), (1, 2), (2, 0))])
    three = SetUp(cups[:3], base, np.full(3, 0.15))
    for (fixtures, frame), side in zip(with_fourth(three, cups[3], ballbar(rng, EXACT)), SIDES_OF_FOUR, strict=True):
        assert fixtures.base_cups == pytest.approx(cups[list(side)])
        in_side = triangle(fixtures.base, "B")
        in_first = in_side @ frame.rotation.T + np.array(frame.translation)
        true = (cups[list(side)] - np.array(first.translation)) @ first.rotation
        assert in_first == pytest.approx(true, abs=1e-11)


def test_a_fourth_cup_out_of_range_is_refused() -> None:
    three = fixture()
    with pytest.raises(InputError, match="the distance B1-B4 is beyond the range"):
        with_fourth(three, np.array([0.0, 0.0, -1.0]), ballbar(np.random.default_rng(0)))
