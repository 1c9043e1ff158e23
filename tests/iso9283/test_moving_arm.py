"""The arm in motion stands where the digital twin stands, sags, warms up and gives way as the twin does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.transform import IDENTITY, Transform, homogeneous
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin
from truearm.iso9283.simulating.moving_arm import DRIVES, WARMING, MovingArm, drawn_compliance, last_moves

ROBOT = load_robot("irb120")
TIP = Transform((0.05, 0.02, 0.1))
JOINTS = np.radians([[10.0, 20.0, -10.0, 20.0, 50.0, 30.0], [-20.0, 40.0, 0.0, -30.0, 60.0, 0.0]])
LOAD = Payload(3.0, TIP.translation)
EVER = np.full(2, np.inf)


@pytest.fixture(scope="module")
def twin() -> Twin:
    return truth_twin(ROBOT, "tracker-triangular", np.random.default_rng(0))


@pytest.fixture(scope="module")
def arm(twin: Twin) -> MovingArm:
    return MovingArm(ROBOT, None, twin, TIP, LOAD, replace(DRIVES, play=0.0))


def plain(twin: Twin, payload: Payload) -> Twin:
    robot = twin.robot.with_frames(twin.robot.base, {"tip": TIP, "flange": IDENTITY})
    return replace(twin, robot=replace(robot, payload=payload))


def test_an_arm_at_rest_stands_where_the_twin_stands(arm: MovingArm, twin: Twin) -> None:
    frames = plain(twin, LOAD).frames(JOINTS, approach=np.zeros((2, 6)))["tip"]
    np.testing.assert_allclose(arm.at_rest(JOINTS, np.zeros((2, 6)), EVER), frames, atol=1e-12)


def test_a_load_lowers_the_tip_as_the_twin_says(arm: MovingArm, twin: Twin) -> None:
    empty = replace(arm, payload=Payload())
    none = np.zeros((2, 6))
    sagged = (arm.at_rest(JOINTS, none, EVER) - empty.at_rest(JOINTS, none, EVER))[:, :3, 3]
    of_twin = [plain(twin, load).frames(JOINTS, approach=none)["tip"][:, :3, 3] for load in (LOAD, Payload())]
    np.testing.assert_allclose(sagged, of_twin[0] - of_twin[1], atol=1e-12)
    assert (sagged[:, 2] < -1e-5).all()


def test_a_push_at_the_tip_moves_it_by_the_compliance_of_the_joints(arm: MovingArm, twin: Twin) -> None:
    joints, none = JOINTS[:1], np.zeros((1, 6))
    force = np.array([[0.0, 1.0, 0.0]])
    working = np.array([np.inf])
    moved = (arm.at_rest(joints, none, working, force) - arm.at_rest(joints, none, working, -force))[0, :3, 3] / 2
    base = twin.robot.base.rotation
    J = np.empty((3, 6))
    for j in range(6):
        step = 1e-6 * np.eye(6)[j : j + 1]
        J[:, j] = (arm.at_rest(joints + step, none, working) - arm.at_rest(joints - step, none, working))[0, :3, 3]
    J = base.T @ J / 2e-6
    compliance = np.array([twin.joints[k].compliance if k in twin.joints else 0.0 for k in range(1, 7)])
    expected = base @ (J * compliance) @ J.T @ force[0]
    # What the arm carries turns with it: that is the rest of a few thousandths.
    np.testing.assert_allclose(moved, expected, rtol=5e-3, atol=1e-9)
    assert np.linalg.norm(moved) > 1e-6


def test_a_cold_arm_is_shorter_and_grows_with_its_time_constant(arm: MovingArm) -> None:
    working = np.array([0.0, WARMING.time, np.inf])
    place = arm.at_rest(np.repeat(JOINTS[:1], 3, axis=0), np.zeros((3, 6)), working)[:, :3, 3]
    short, later = (np.linalg.norm(place[k] - place[2]) for k in (0, 1))
    assert 2e-5 < short < 1e-4
    assert later / short == pytest.approx(np.exp(-1.0), rel=2e-3)


def test_play_depends_on_where_the_joints_came_from(arm: MovingArm) -> None:
    loose = replace(arm, drives=replace(DRIVES, play=1e-4))
    ways = np.zeros((2, 6))
    ways[:, 0] = [1.0, -1.0]
    place = loose.at_rest(np.repeat(JOINTS[:1], 2, axis=0), ways, EVER)[:, :3, 3]
    axis = arm.twin.robot.base.rotation[:, 2]
    lever = np.linalg.norm(np.cross(place[0] - np.array(arm.twin.robot.base.translation), axis))
    assert np.linalg.norm(place[0] - place[1]) == pytest.approx(2e-4 * lever, rel=1e-2)


@pytest.mark.parametrize("rate", [250.0, 2000.0])
def test_a_motion_ends_where_the_arm_then_stands(arm: MovingArm, rate: float) -> None:
    share = np.linspace(0.0, 1.0, 400)[:, None]
    command = JOINTS[0] + share * (JOINTS[1] - JOINTS[0])
    motion = arm.in_motion(command, 1e-3, np.arange(-0.1, 1.5, 1 / rate), np.inf)
    ways = np.sign(JOINTS[1:] - JOINTS[:1])
    stands = arm.at_rest(JOINTS[1:], ways, EVER[:1])[0, :3, 3]
    begins = arm.at_rest(JOINTS[:1], ways, EVER[:1])[0, :3, 3]
    np.testing.assert_allclose(motion.position[-1], stands, atol=1e-9)
    np.testing.assert_allclose(motion.position[0], begins, atol=1e-9)


def test_a_fast_stream_agrees_with_a_slow_one(arm: MovingArm) -> None:
    share = (1 - np.cos(np.linspace(0.0, np.pi, 500)))[:, None] / 2
    command = JOINTS[0] + share * (JOINTS[1] - JOINTS[0])
    slow = arm.in_motion(command, 1e-3, 4e-3 * np.arange(250.0), np.inf)
    fast = arm.in_motion(command, 1e-3, 5e-4 * np.arange(1997.0), np.inf)
    np.testing.assert_allclose(fast.position[::8], slow.position, atol=2e-6)
    np.testing.assert_allclose(fast.quaternion[::8], slow.quaternion, atol=2e-6)


def test_joints_a_little_elsewhere_move_the_tip_as_the_twin_does(arm: MovingArm) -> None:
    command, time = np.repeat(JOINTS[:1], 3, axis=0), np.array([0.0])
    off = 1e-5 * np.array([1.0, -1.0, 0.5, 0.3, -0.2, 0.1])
    position, _ = arm.in_motion(command, 1e-3, time, np.inf).with_offset(off)
    expected = arm.at_rest(JOINTS[:1] + off, np.zeros((1, 6)), EVER[:1])[:, :3, 3]
    # The tip lies beyond the commanded flange, so that its offsets have another lever by a tenth of a metre.
    np.testing.assert_allclose(position, expected, atol=2e-6)


def test_commands_are_those_of_the_nominal_robot(arm: MovingArm) -> None:
    position, rotation = ROBOT.forward(JOINTS)
    frames = homogeneous(rotation, position)
    np.testing.assert_allclose(arm.joints_for(frames, JOINTS), JOINTS, atol=1e-9)
    with pytest.raises(InputError, match="the robot cannot come to a commanded pose"):
        arm.joints_for(frames + _moved(3.0), JOINTS)


def _moved(by: float) -> np.ndarray:
    shift = np.zeros((4, 4))
    shift[0, 3] = by
    return shift


def test_a_truth_with_other_joints_is_refused(twin: Twin) -> None:
    with pytest.raises(InputError, match="this truth has other joints than katana450"):
        MovingArm(load_robot("katana450"), None, twin, TIP, LOAD)


def test_the_direction_of_the_last_move_is_kept_at_rest() -> None:
    joints = np.array([[0.0, 1.0], [0.0, 0.5], [0.2, 0.5], [0.2, 0.5], [0.1, 0.6]])
    np.testing.assert_array_equal(last_moves(joints), [[1, -1], [1, -1], [1, -1], [1, -1], [-1, 1]])


SOFT = (2e-5, 3e-5, 4e-5, 2e-4, 2e-4, 3e-4)


def test_a_rigid_truth_gives_way_to_pushes_alone() -> None:
    rigid = MovingArm(ROBOT, None, truth_twin(ROBOT, "nominal", np.random.default_rng(0)), TIP, LOAD)
    soft = replace(rigid, compliance=SOFT)
    still = np.zeros_like(JOINTS)
    np.testing.assert_array_equal(soft.at_rest(JOINTS, still, EVER), rigid.at_rest(JOINTS, still, EVER))
    force = np.array([[0.0, 0.0, 20.0], [15.0, -5.0, 0.0]])
    np.testing.assert_allclose(
        rigid.at_rest(JOINTS, still, EVER, force), rigid.at_rest(JOINTS, still, EVER), atol=1e-12
    )
    moved = soft.at_rest(JOINTS, still, EVER, force) - rigid.at_rest(JOINTS, still, EVER)
    # What the moments of the force turn the joints by, through the Jacobian of the tip.
    J = ROBOT.with_frames(ROBOT.base, {"tip": TIP}).jacobian(JOINTS, frame="base", target="tip")[:, :3]
    expected = np.einsum("nij,j,nkj,nk->ni", J, np.array(SOFT), J, force)
    np.testing.assert_allclose(moved[:, :3, 3] @ soft.twin.robot.base.rotation, expected, rtol=0.02, atol=2e-6)


def test_a_truth_that_gives_way_keeps_its_own_compliance(arm: MovingArm) -> None:
    force = np.array([[0.0, 0.0, 20.0]])
    still = np.zeros((1, 6))
    other = replace(arm, compliance=SOFT)
    first, second = (one.at_rest(JOINTS[:1], still, EVER[:1], force) for one in (arm, other))
    np.testing.assert_array_equal(first, second)


def test_joints_give_way_as_those_of_real_robots_do() -> None:
    drawn = np.array([drawn_compliance(ROBOT, 30.0, 0.6, np.random.default_rng(seed)) for seed in range(200)])
    middle = np.exp(np.log(drawn).mean(axis=0))
    np.testing.assert_allclose(middle[:3], 3e-4 / 18.0, rtol=0.1)
    np.testing.assert_allclose(middle[3:], 1.2e-3 / 18.0, rtol=0.1)
    assert drawn.min() > 3e-4 / 18.0 / 5
    # The published ones lie in the same range (Nubiola, Table 2.7: 3e-5 and 1.3e-4, wrist 4e-4 to 6e-4).
    assert drawn[:, :3].max() > 3e-5
    katana = load_robot("katana450")
    assert len(drawn_compliance(katana, 4.0, 0.3, np.random.default_rng(0))) == len(katana.joints)
