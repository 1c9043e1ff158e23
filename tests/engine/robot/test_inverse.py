"""Inverse kinematics against forward kinematics, homotopies and minimisers that it shares no code with."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares
from tests.engine.robot.test_effects import NAMES, loaded_arm
from tests.expecting import refusing

from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branches import BRANCHES, BranchRule, branch_rule
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.inverse.pose_solver import PoseStatus
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint, LinkMass, Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rotation_vector

SIX = ["irb120", "irb1600", "lrmate200ic", "kr5", "puma560", "ur5", "ur10"]


def calibrated(robot: Robot, seed: int, gain: bool = False) -> Robot:
    """Return the robot with geometry, joint zeros and gains drawn from their priors."""
    rng = np.random.default_rng(seed)
    robot = robot.with_effects(["gain"]) if gain else robot
    groups = ("geometry", "joint zero", "gain")
    return robot.with_values(
        {p.name: p.value + p.prior * rng.standard_normal() for p in robot.parameters.values() if p.group in groups}
    )


def seven_axes() -> Robot:
    alpha = np.radians([0, -90, 90, 90, -90, -90, 90])
    d = [0.36, 0, 0.42, 0, 0.4, 0, 0.126]
    limits = np.radians([170, 120, 170, 120, 170, 120, 175])
    joints = [
        Joint(f"j{i}", "revolute", {"alpha": al, "a": 0.0, "d": di, "theta_offset": 0.0}, (-lim, lim))
        for i, (al, di, lim) in enumerate(zip(alpha, d, limits, strict=True), 1)
    ]
    return Robot("seven", "Seven axes", "invented", "modified-dh", tuple(joints))


def sliding() -> Robot:
    """Two parallel turning joints and a slide, as a SCARA without its last axis."""
    rows = [
        ("revolute", {"alpha": 0.0, "a": 0.0, "d": 0.4, "theta_offset": 0.0}, (-2.5, 2.5)),
        ("revolute", {"alpha": 0.0, "a": 0.3, "d": 0.0, "theta_offset": 0.0}, (-2.5, 2.5)),
        ("prismatic", {"alpha": np.pi, "a": 0.25, "d": 0.0, "theta_offset": 0.0}, (0.0, 0.2)),
    ]
    joints = tuple(Joint(f"j{i}", kind, row, limits) for i, (kind, row, limits) in enumerate(rows, 1))  # type: ignore[arg-type]
    return Robot("sliding", "Sliding", "invented", "modified-dh", joints)


def pose_errors(robot: Robot, joints: Array, p: Array, R: Array) -> tuple[float, float]:
    got_p, got_R = robot.world_poses(joints)
    turned = rotation_vector(np.swapaxes(R, 1, 2) @ got_R)
    return float(np.abs(got_p - p).max()), float(np.abs(turned).max())


def rule_of(robot: Robot) -> BranchRule:
    rule = branch_rule(robot)
    assert rule is not None
    return rule


def branches_of(robot: Robot, q: Array) -> list[str]:
    return [BRANCHES[int(n)] for n in rule_of(robot).numbers(robot.forward_kinematics(q))]


@pytest.mark.parametrize("name", SIX)
def test_forward_of_inverse_is_the_pose_on_the_branch_asked_for(name: str) -> None:
    for gain in (False, True):
        robot = calibrated(load_robot(name), 5, gain)
        rule = rule_of(robot)
        q = robot.random_configurations(150, np.random.default_rng(6))
        p, R = robot.world_poses(q)
        number = rule.numbers(robot.forward_kinematics(q))
        for k in np.unique(number):
            chosen = number == k
            solution = inverse(robot, p[chosen], R[chosen], frame="world", branch=BRANCHES[k])
            usable = np.array([status.usable for status in solution.status])
            for row in np.flatnonzero(~usable):
                assert solution.status[row] is PoseStatus.BEYOND_LIMIT
                assert solution.singular_value[row] < 0.05
            assert {solution.branch[row] for row in np.flatnonzero(usable)} == {BRANCHES[k]}
            errors = pose_errors(robot, solution.joints[usable], p[chosen][usable], R[chosen][usable])
            assert max(errors) < 1e-9, (gain, BRANCHES[k])


@pytest.mark.parametrize("name", ["irb120", "kr5", "ur5"])
def test_every_nominal_branch_is_found_again_where_it_exists(name: str) -> None:
    """Whether it exists is known from a homotopy of the parameters, followed by plain Newton steps."""
    nominal = load_robot(name)
    robot = calibrated(nominal, 5)
    rule = rule_of(robot)
    p, R = nominal.world_poses(nominal.random_configurations(60, np.random.default_rng(3)))
    before = inverse(nominal, p, R, frame="world", branch="all")
    after = inverse(robot, p, R, frame="world", branch="all")
    have = {*zip(after.pose.tolist(), after.branch, strict=True)}
    lost = [
        row
        for row, key in enumerate(zip(before.pose.tolist(), before.branch, strict=True))
        if key not in have and before.status[row] is not PoseStatus.UNREACHABLE
    ]
    assert len(lost) < 0.04 * len(before.pose)
    assert len(have) > 360
    if not lost:
        return
    # The others: follow them from the nominal to the calibrated arm.
    q, pose = before.joints[lost], before.pose[lost]
    reached = np.ones(len(lost), dtype=bool)
    for share in np.linspace(0, 1, 41)[1:]:
        between = robot.with_values(
            {n: v + share * (robot.values[n] - v) for n, v in nominal.values.items()},
        )
        for _ in range(8):
            got_p, got_R = between.world_poses(q)
            turn = np.einsum("nij,nj->ni", got_R, rotation_vector(np.swapaxes(got_R, 1, 2) @ R[pose]))
            error = np.concatenate([p[pose] - got_p, turn], axis=1)
            J = between.joint_jacobian(q)
            q = q + np.stack([np.linalg.lstsq(j, e, rcond=1e-9)[0] for j, e in zip(J, error, strict=True)])
        reached &= np.linalg.norm(error, axis=1) < 1e-8
    number = rule.numbers(robot.forward_kinematics(q))
    same = [reached[i] and BRANCHES[number[i]] == before.branch[row] for i, row in enumerate(lost)]
    assert not any(same)


def test_words_of_the_branches() -> None:
    q = np.radians(
        [
            [0, 0, 0, 0, 30, 0],  # at rest: upper arm up, forearm forward, hand down
            [0, 0, 0, 0, -30, 0],
            [0, 100, -100, 0, 30, 0],  # upper arm low in front, forearm up
            [0, -80, 0, 0, 30, 0],  # leaning back, hand behind
        ]
    )
    words = ["front-up-noflip", "front-up-flip", "front-down-noflip", "back-down-noflip"]
    assert branches_of(load_robot("irb120"), q) == words


def test_joints_keep_their_branch_when_the_arm_is_calibrated_or_moved() -> None:
    for name in SIX:
        nominal = load_robot(name)
        robot = calibrated(nominal, 8).with_frames(Transform((2.0, 1.0, -0.5), (0.5, 0.5, 0.5, 0.5)), {})
        rule = rule_of(nominal)
        assert rule == rule_of(robot)
        q = nominal.random_configurations(2000, np.random.default_rng(1))
        clear = np.linalg.svd(nominal.joint_jacobian(q), compute_uv=False)[:, -1] > 0.03
        assert clear.sum() > 1000
        agree = rule.numbers(nominal.forward_kinematics(q)) == rule.numbers(robot.forward_kinematics(q))
        assert agree[clear].all(), name


def test_angles_rounded_to_four_digits_as_in_urdf_files_still_have_named_branches() -> None:
    robot = load_robot("ur5")
    joints = tuple(replace(j, row={c: round(v, 4) for c, v in j.row.items()}) for j in robot.joints)
    robot = replace(robot, joints=joints)
    p, R = robot.world_poses(robot.random_configurations(50, np.random.default_rng(0)))
    solution = inverse(robot, p, R, frame="world", branch="all")
    assert solution.complete
    assert len(solution.pose) > 300


def test_branches_that_have_no_names() -> None:
    for robot in (load_robot("katana450"), seven_axes()):
        assert branch_rule(robot) is None
        p, R = robot.world_poses(np.zeros((1, len(robot.joints))))
        with refusing("have no names", of=robot.name):
            inverse(robot, p, R, branch="front-up-noflip")


# -- joint effects under load -----------------------------------------------------------------------------

ELASTIC = ("compliance",)
FULL = ("compliance", "hardening", "fourier", "backlash", "approach")
TILTING = ("compliance", "bearing-compliance", "clearance", "backlash")


@pytest.mark.parametrize("effects", [ELASTIC, FULL, TILTING, NAMES], ids="+".join)
def test_under_load_forward_of_inverse_is_the_pose_on_every_branch(effects: tuple[str, ...]) -> None:
    robot = calibrated(loaded_arm(effects, 11), 5)
    assert np.abs(robot.world_poses(np.zeros((1, 6)))[0] - robot.rigid.world_poses(np.zeros((1, 6)))[0]).max() > 1e-5
    q = robot.random_configurations(40, np.random.default_rng(12))
    p, R = robot.world_poses(q, "tip")
    branches = branches_of(robot, q)
    every = inverse(robot, p, R, frame="world", target="tip", branch="all")
    position, rotation = robot.world_poses(every.joints, "tip")
    assert np.abs(position - p[every.pose]).max() < 1e-9
    assert np.abs(rotation - R[every.pose]).max() < 1e-9
    assert len(every.pose) > 250
    assert {*zip(every.pose.tolist(), every.branch, strict=True)} >= {*enumerate(branches)}
    for branch in sorted(set(branches)):
        rows = [row for row, own in enumerate(branches) if own == branch]
        solution = inverse(robot, p[rows], R[rows], frame="world", target="tip", branch=branch)
        assert set(solution.branch) == {branch}
        assert max(solution.position_error.max(), solution.orientation_error.max()) < 1e-9, branch


@pytest.mark.parametrize("effects", [("gain",), ELASTIC, FULL, TILTING, NAMES], ids="+".join)
def test_the_seed_gives_the_same_joints_back(effects: tuple[str, ...]) -> None:
    robot = calibrated(loaded_arm(effects, 13), 1)
    q = robot.random_configurations(200, np.random.default_rng(2))
    p, R = robot.world_poses(q)
    solution = inverse(robot, p, R, frame="world", seed=q)
    assert solution.complete
    regular = solution.singular_value > 0.05
    assert regular.sum() > 90
    assert np.abs(solution.joints - q)[regular].max() < 1e-9


@pytest.mark.parametrize(
    ("name", "orientation"), [("katana450", "axis"), ("katana450", "free"), ("irb120", "free"), ("ur5", "full")]
)
def test_under_load_other_arms_and_tasks(name: str, orientation: Any) -> None:
    plain = calibrated(load_robot(name), 3)
    masses = tuple(LinkMass(i, 2.0, (0.05, 0.02, -0.03)) for i in range(1, len(plain.joints) + 1))
    robot = replace(plain, masses=masses, payload=Payload(2.0, (0.02, 0.03, 0.1))).with_effects([*FULL, *TILTING])
    own = {p.name: 0.3 * p.prior for effect in robot.effects for p in effect.parameters}
    robot = robot.with_values(own)
    q = robot.random_configurations(60, np.random.default_rng(1))
    p, R = robot.world_poses(q)
    seed = q + 0.02 * np.random.default_rng(2).standard_normal(q.shape)
    solution = inverse(robot, p, R, frame="world", orientation=orientation, seed=seed)
    assert solution.complete
    check_task(robot, solution.joints, p, R, orientation)


def test_a_shaft_that_nothing_lays_to_a_side_is_no_obstacle() -> None:
    """The tool hangs straight down from the last axis: the load has no moment and no side to lay the shaft to."""
    robot = replace(loaded_arm(("clearance",), 1), payload=Payload(2.7, (0.0, 0.0, 0.1)))
    robot = replace(robot, masses=robot.masses[:-1])
    down = np.diag([1.0, -1.0, -1.0])
    solution = inverse(robot, [[0.35, 0.05, 0.35]], down[None])
    assert solution.complete
    position, rotation = robot.world_poses(solution.joints)
    np.testing.assert_allclose(position, [[0.35, 0.05, 0.35]], rtol=0, atol=1e-9)
    np.testing.assert_allclose(rotation[0], down, rtol=0, atol=1e-9)


# -- frames, tools, gauge ---------------------------------------------------------------------------------


def test_an_offset_shared_between_base_and_joint_is_no_error_of_the_start() -> None:
    robot = load_robot("irb120")
    robot = robot.with_values(robot.truths["tracker-triangular"].values)  # d_1 is 0: it stands in base_z
    q = robot.random_configurations(200, np.random.default_rng(0))
    p, R = robot.world_poses(q)
    solution = inverse(robot, p, R, frame="world", seed=q)
    assert solution.complete
    assert (np.abs(solution.joints - q).max(axis=1) < 1e-6).sum() >= 198


# -- limits, turns, statuses ------------------------------------------------------------------------------


@pytest.mark.parametrize("gain", [False, True])
def test_the_turn_nearest_to_the_seed_within_the_limits(gain: bool) -> None:
    robot = calibrated(load_robot("irb120"), 2, gain)
    p, R = robot.world_poses(np.radians([[10, 20, -30, 40, 50, 300.0]]))
    # The last seed is beyond the limits: 300 is the last turn before 400.
    for turn, seed in ((300.0, 310.0), (-60.0, 0.0), (-60.0, -200.0), (300.0, 700.0)):
        solution = inverse(robot, p, R, frame="world", branch="front-up-noflip", seed=np.radians([0, 0, 0, 0, 0, seed]))
        assert solution.complete
        assert np.degrees(solution.joints[0, 5]) == pytest.approx(turn, abs=1.0)
        assert pose_errors(robot, solution.joints, p, R)[0] < 1e-9


def test_beyond_limit_names_the_joints() -> None:
    robot = load_robot("irb120")
    q = np.radians([[10, 20, 80, 40, 50, 0.0]])  # axis 3 ends at 70
    p, R = robot.world_poses(q)
    solution = inverse(robot, p, R, frame="world", branch=branches_of(robot, q)[0])
    assert solution.status == (PoseStatus.BEYOND_LIMIT,)
    assert solution.beyond.tolist() == [[False, False, True, False, False, False]]
    assert np.abs(solution.joints - q).max() < 1e-9
    assert solution.advice(0).startswith("Beyond its limits: axis_3.")
    assert not solution.complete


def test_near_singular_is_reached_with_a_warning() -> None:
    robot = calibrated(load_robot("irb120"), 2)
    q = np.radians([[10, 20, 30, 40, 0.05, 0.0], [10, 20, 30, 40, 50, 0.0]])
    p, R = robot.world_poses(q)
    solution = inverse(robot, p, R, frame="world")
    assert solution.status == (PoseStatus.NEAR_SINGULAR, PoseStatus.REACHED)
    assert solution.complete
    assert solution.singular_value[0] < 5e-3 < solution.singular_value[1]
    assert "singular posture" in solution.advice(0)


def test_a_pose_out_of_reach_comes_with_the_nearest_joints() -> None:
    robot = calibrated(load_robot("li3"), 2)
    stretched = robot.world_poses(np.radians([[20, 40, 0]]))[0]
    aim = np.vstack([1.5 * stretched, 0.7 * stretched])
    solution = inverse(robot, aim, orientation="free")

    def miss(q: Array) -> Array:
        return np.asarray(robot.world_poses(q[None])[0][0] - aim[0])

    low, high = np.array([joint.limits for joint in robot.joints], float).T
    best = min(
        np.linalg.norm(least_squares(miss, s, bounds=(low, high), xtol=1e-12).fun)
        for s in robot.random_configurations(10, np.random.default_rng(0))
    )
    assert solution.status == (PoseStatus.UNREACHABLE, PoseStatus.REACHED)
    assert solution.position_error[0] == pytest.approx(best, rel=1e-6)
    assert np.linalg.norm(robot.world_poses(solution.joints)[0][0] - aim[0]) == pytest.approx(best, rel=1e-6)
    assert solution.advice(0).startswith(f"{best * 1e3:.4g} mm are missing.")


def test_out_of_reach_on_all_branches_has_one_row() -> None:
    robot = calibrated(load_robot("irb120"), 2)
    p, R = robot.world_poses(np.radians([[10, 20, 30, 40, 50, 0.0]]))
    solution = inverse(robot, np.vstack([p, 3 * p]), np.vstack([R, R]), frame="world", branch="all")
    assert Counter(solution.pose.tolist())[1] == 1
    assert solution.status[-1] is PoseStatus.UNREACHABLE
    assert solution.position_error[-1] > 0.3
    assert "mm and" in solution.advice(len(solution.pose) - 1)
    assert not solution.complete
    assert solution.rows(PoseStatus.UNREACHABLE).tolist() == [len(solution.pose) - 1]


def test_a_branch_that_does_not_reach_the_pose_is_lost_and_another_one_given() -> None:
    robot = calibrated(load_robot("irb1600"), 2)
    q = np.radians([[10, 80, -70, 40, 50, 0.0]])  # far in front: no reaching over the back
    p, R = robot.world_poses(q)
    solution = inverse(robot, p, R, frame="world", branch="back-up-noflip")
    assert solution.status == (PoseStatus.BRANCH_LOST,)
    assert solution.branch[0].startswith("front")
    assert solution.position_error[0] < 1e-9
    assert solution.advice(0).startswith(f"Reached on {solution.branch[0]}.")


# -- other arms and tasks ---------------------------------------------------------------------------------

Case = tuple[Robot, Any]
CASES: list[Case] = [
    (load_robot("katana450"), "axis"),
    (load_robot("katana450"), "free"),
    (load_robot("katana450"), "full"),
    (load_robot("li3"), "free"),
    (load_robot("irb120"), "free"),
    (load_robot("ur5"), "axis"),
    (seven_axes(), "full"),
    (sliding(), "free"),
]


@pytest.mark.parametrize(("nominal", "orientation"), CASES, ids=lambda c: c if isinstance(c, str) else c.name)
def test_arms_and_tasks_without_closed_form(nominal: Robot, orientation: Any) -> None:
    robot = calibrated(nominal, 3)
    q = robot.random_configurations(100, np.random.default_rng(1))
    p, R = robot.world_poses(q)
    seed = q + 0.05 * np.random.default_rng(2).standard_normal(q.shape)
    near = inverse(robot, p, R, frame="world", orientation=orientation, seed=seed)
    assert near.complete
    assert set(near.branch) == {""}
    solution = inverse(robot, p, R, frame="world", orientation=orientation)
    reached = [status is not PoseStatus.UNREACHABLE for status in solution.status]
    assert np.mean(reached) >= 0.97
    for solutions in (near, solution):
        rows = solutions.rows(PoseStatus.REACHED, PoseStatus.NEAR_SINGULAR, PoseStatus.BEYOND_LIMIT)
        check_task(robot, solutions.joints[rows], p[rows], R[rows], orientation)
        assert np.isnan(solutions.orientation_error).all() == (orientation == "free")


def check_task(robot: Robot, joints: Array, p: Array, R: Array, orientation: str) -> None:
    """Check that joints reach what is asked of poses: the point, and all, one axis or nothing of the orientation."""
    got_p, got_R = robot.world_poses(joints)
    asked = {"full": slice(None), "axis": slice(2, 3), "free": slice(0)}[orientation]
    assert np.abs(got_p - p).max() < 1e-9
    assert np.abs(got_R - R)[:, :, asked].max(initial=0.0) < 1e-9


def test_same_question_same_answer_and_no_poses_none() -> None:
    robot = calibrated(seven_axes(), 3)
    p, R = robot.world_poses(robot.random_configurations(20, np.random.default_rng(1)))
    one, two = (inverse(robot, p, R, frame="world").joints for _ in range(2))
    assert (one == two).all()
    for robot in (load_robot("irb120"), load_robot("katana450")):
        solution = inverse(robot, np.zeros((0, 3)), np.zeros((0, 3, 3)))
        assert solution.complete
        assert solution.joints.shape == (0, len(robot.joints))


# -- refusals ---------------------------------------------------------------------------------------------

P, R = np.array([[0.3, 0.0, 0.5]]), np.eye(3)[None]
NAN = float("nan")


def test_refusals() -> None:
    wrong: list[tuple[str, Array, Array | None, dict[str, Any]]] = [
        ("not orthonormal", P, 1.001 * R, {}),
        ("not a rotation", P, -R, {}),
        ("wrong shape", P, np.eye(4), {}),
        ("not as many rotations", P, np.vstack([R, R]), {}),
        ("NaN and infinity cannot be used here", P, R * NAN, {}),
        ("the poses have no orientation", P, None, {}),
        ("not as many seeds", P, R, {"seed": np.zeros((2, 6))}),
        ("no such branch", P, R, {"branch": "front-up-flop"}),
        ("no frame of this name", P, R, {"frame": "tool"}),
        ("no such choice", P, R, {"orientation": "half"}),
        ("no target of this name", P, R, {"target": "gripper"}),
        ("have no names", P, R, {"branch": "all", "orientation": "free"}),
    ]
    for words, p, r, options in wrong:
        with refusing(words, of=options):
            inverse(load_robot("irb120"), p, r, **options)
    short = replace(sliding(), joints=sliding().joints[:2])
    with refusing("three joints or more"):
        inverse(short, P, orientation="free")


def test_next_to_a_singular_wrist_branches_are_found_that_the_nominal_arm_has_not() -> None:
    nominal = load_robot("ur5")
    for seed in range(3):
        robot = calibrated(nominal, seed)
        q = nominal.random_configurations(10_000, np.random.default_rng(seed))
        q = q[abs(np.sin(q[:, 4])) < 0.02]
        assert len(q) > 50
        position, rotation = robot.world_poses(q)
        number = rule_of(robot).numbers(robot.forward_kinematics(q))
        lost = 0
        for k in sorted(set(number.tolist())):
            rows = number == k
            solution = inverse(robot, position[rows], rotation[rows], branch=BRANCHES[k])
            lost += sum(status is PoseStatus.BRANCH_LOST for status in solution.status)
        assert lost <= 1, seed
