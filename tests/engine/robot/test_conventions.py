from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm
from tests.engine.robot.test_chain import random_robot, random_unit
from tests.expecting import refusing

from truearm.engine.robot.chain import Array
from truearm.engine.robot.conventions import CONVENTIONS, convention
from truearm.engine.robot.conventions.convention import JointKind, parallel_joints_without_beta
from truearm.engine.robot.conventions.cpc import published_direction, rotation_to, small_rotations
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text

BOTH: tuple[JointKind, ...] = ("revolute", "prismatic")


def about(axis: str, angle: float) -> Array:
    """The turn about x, y or z as a matrix, ``(4, 4)``."""
    turned = np.eye(4)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    turned[i, i] = turned[j, j] = math.cos(angle)
    turned[i, j], turned[j, i] = -math.sin(angle), math.sin(angle)
    return turned


def slid(x: float, y: float, z: float) -> Array:
    moved = np.eye(4)
    moved[:3, 3] = x, y, z
    return moved


def robot_of(name: str, rows: list[dict[str, float]], kinds: tuple[JointKind, ...]) -> Robot:
    joints = (Joint(f"J{i}", kind, row) for i, (row, kind) in enumerate(zip(rows, kinds, strict=True), 1))
    return Robot("made", "", "", name, tuple(joints))


def random_rows(columns: tuple[str, ...], count: int, rng: np.random.Generator) -> list[dict[str, float]]:
    return [{c: float(rng.uniform(-1, 1)) for c in columns} for _ in range(count)]


def check_against(robot: Robot, links: list[Array]) -> None:
    """Compare the flange at readings of zero with a product of matrices."""
    position, rotation = robot.world_poses(np.zeros((1, len(robot.joints))))
    expected = np.linalg.multi_dot(links)
    assert_allclose(position[0], expected[:3, 3], rtol=0, atol=1e-14)
    assert_allclose(rotation[0], expected[:3, :3], rtol=0, atol=1e-14)


# -- against the published formulas, readings taken into the joint's own zero ------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_s_model_and_mcpc_are_the_published_products(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = random_rows(("theta_offset", "d", "a", "alpha", "gamma", "b"), 4, rng)
    turns = [about("x", r["alpha"]) @ about("z", r["gamma"]) @ slid(0, 0, r["b"]) for r in rows]
    links = [
        about("z", r["theta_offset"]) @ slid(r["a"], 0, r["d"]) @ turn for r, turn in zip(rows, turns, strict=True)
    ]
    check_against(robot_of("s-model", rows, ("revolute",) * 4), links)

    rows = random_rows(("theta_offset", "alpha", "beta", "x", "y"), 3, rng)
    rows += random_rows(("theta_offset", "alpha", "beta", "gamma", "x", "y", "z"), 1, rng)
    turns = [about("x", r["alpha"]) @ about("y", r["beta"]) @ about("z", r.get("gamma", 0.0)) for r in rows]
    slides = [slid(r["x"], r["y"], r.get("z", 0.0)) for r in rows]
    links = [about("z", r["theta_offset"]) @ turn @ by for r, turn, by in zip(rows, turns, slides, strict=True)]
    robot = robot_of("mcpc", rows, ("revolute",) * 4)
    check_against(robot, links)
    assert {"gamma_4", "z_4"} <= set(robot.parameters)
    assert {"gamma_1", "z_3"} & set(robot.parameters) == set()


@pytest.mark.parametrize("seed", range(3))
def test_cpc_is_the_published_product(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = random_rows(("theta_offset", "l_x", "l_y"), 3, rng)
    rows += random_rows(("theta_offset", "beta", "l_x", "l_y", "l_z"), 1, rng)
    links = []
    for r in rows:
        x, y, z = random_unit(rng, 3)
        r |= {"b_x": x, "b_y": y, "b_z": z}
        R = np.eye(4)
        R[0, 0], R[1, 1], R[0, 1] = 1 - x * x / (1 + z), 1 - y * y / (1 + z), -x * y / (1 + z)
        R[1, 0], R[:3, 2], R[2, :2] = R[0, 1], (x, y, z), (-x, -y)
        behind = about("z", r.get("beta", 0.0)) @ slid(r["l_x"], r["l_y"], r.get("l_z", 0.0))
        links.append(about("z", r["theta_offset"]) @ R @ behind)
    check_against(robot_of("cpc", rows, ("revolute",) * 4), links)


@pytest.mark.parametrize("seed", range(3))
def test_product_of_exponentials_is_a_product_of_matrix_exponentials(seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinds: tuple[JointKind, ...] = ("revolute", "prismatic", "revolute", "revolute")
    rows, expected = [], np.eye(4)
    q = rng.uniform(-2, 2, 4)
    for kind, reading in zip(kinds, q, strict=True):
        along, point = np.array(random_unit(rng, 3)), rng.uniform(-1, 1, 3)
        w, v = (along, -np.cross(along, point)) if kind == "revolute" else (np.zeros(3), along)
        named = {f"{n}_{a}": float(c) for n, vector in (("w", w), ("v", v)) for a, c in zip("xyz", vector, strict=True)}
        rows.append({c: named[c] for c in convention("product-of-exponentials").row_units(kind)})
        twist = np.zeros((4, 4))
        twist[:3, :3] = [[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]
        twist[:3, 3] = v
        expected = expected @ expm(reading * twist)
    position, rotation = robot_of("product-of-exponentials", rows, kinds).world_poses(q[None])
    assert_allclose(position[0], expected[:3, 3], rtol=0, atol=1e-13)
    assert_allclose(rotation[0], expected[:3, :3], rtol=0, atol=1e-13)


def test_zero_reference_holds_its_axes_by_any_of_their_points() -> None:
    rng = np.random.default_rng(0)
    axes = [np.array(random_unit(rng, 3)) for _ in BOTH]
    points = [rng.uniform(-1, 1, 3) for _ in BOTH]
    q = rng.uniform(-1, 1, (5, 2))
    poses = []
    for along in (0.0, 0.7):
        rows = [
            dict(zip(("axis_x", "axis_y", "axis_z", "x", "y", "z"), map(float, (*u, *(p + along * u))), strict=True))
            for u, p in zip(axes, points, strict=True)
        ]
        robot = robot_of("zero-reference", rows, BOTH)
        poses.append(robot.world_poses(q))
        assert_allclose(robot.world_poses(np.zeros((1, 2)))[0], 0.0, rtol=0, atol=1e-15)
    for first, other in zip(*poses, strict=True):
        assert_allclose(first, other, rtol=0, atol=1e-14)


# -- CPC's direction vectors -----------------------------------------------------------------------------


def test_small_rotations_and_published_direction_are_inverse() -> None:
    directions = ((0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.36, -0.48, -0.8), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    for b in directions:
        assert_allclose(rotation_to(b)[:, 2], b, rtol=0, atol=1e-15)
        assert_allclose(rotation_to(b) @ rotation_to(b).T, np.eye(3), rtol=0, atol=1e-15)
        for rx, ry in ((0.0, 0.0), (1e-3, -2e-3), (-0.3, 0.2)):
            published = published_direction(b, rx, ry)
            assert math.hypot(*published) == pytest.approx(1.0, abs=1e-15)
            assert_allclose(small_rotations(b, published), (rx, ry), rtol=0, atol=1e-15)
            robot = robot_of("cpc", [dict(zip(("b_x", "b_y", "b_z"), b, strict=True))], ("revolute",))
            _, rotation = robot.with_values({"rx_1": rx, "ry_1": ry}).world_poses(np.zeros((1, 1)))
            assert_allclose(rotation[0][:, 2], published, rtol=0, atol=1e-15, err_msg=f"{b}, {rx}, {ry}")


# -- files -----------------------------------------------------------------------------------------------


def test_robot_of_any_convention_round_trips(tmp_path: Path) -> None:
    for table in CONVENTIONS:
        rng = np.random.default_rng(0)
        result = random_robot(table, ("gain",), rng)
        robot = replace(result, joints=tuple(replace(joint, limits=(-0.25, 0.5)) for joint in result.joints))
        (tmp_path / "robot.yaml").write_text(robot_text(robot), encoding="utf-8")
        again = read_robot(tmp_path / "robot.yaml")
        assert robot_text(again) == robot_text(robot)
        q = robot.random_configurations(5, rng)
        for actual, expected in zip(again.world_poses(q, "tip"), robot.world_poses(q, "tip"), strict=True):
            assert_allclose(actual, expected, rtol=0, atol=1e-14, err_msg=table.name)


HEAD = "truearm: truearm-robot/1\nname: made\nunits: {length: mm, angle: deg}\n"
EXPONENTIALS = "product-of-exponentials"


@pytest.mark.parametrize(
    ("name", "entries", "parts"),
    [
        (EXPONENTIALS, "v: [0, 0, 0]", ["the joint has no twist: give its direction w"]),
        (EXPONENTIALS, "type: prismatic", ["the joint has no twist: give its direction v"]),
        (EXPONENTIALS, "w: [0, 0, 1], v: [0, 0, 5]", ["does not slide", "w . v must be 0, here it is 5 mm"]),
        (EXPONENTIALS, "type: prismatic, w: [0, 0, 1]", ["no such entry", "bearing, max_speed, v"]),
        (EXPONENTIALS, "w: [0, 1, 1]", [".w", "a direction must have length 1"]),
        (EXPONENTIALS, "w: 1", [".w", "three numbers belong here"]),
        (EXPONENTIALS, "w: [0, 0, 1], v: [0, left, 0]", [".v", "a number belongs here", "'left'"]),
        (EXPONENTIALS, "w_z: 1", ["no such entry", "bearing, max_speed, w, v"]),
        ("zero-reference", "x: 1, y: 2, z: 3", ["the joint has no axis"]),
        ("cpc", "b: [0, 0, 2]", [".b", "a direction must have length 1"]),
        ("cpc", "b: [0, 0]", [".b", "three numbers belong here"]),
        ("mcpc", "l_x: 1", ["no such entry", "alpha, beta, gamma, x, y, z"]),
        ("s-model", "beta: 1", ["no such entry", "gamma, b"]),
    ],
)
def test_rows_that_describe_no_joint_are_refused(tmp_path: Path, name: str, entries: str, parts: list[str]) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(f"{HEAD}convention: {name}\njoints:\n  - {{{entries}}}\n", encoding="utf-8")
    with refusing("robot.yaml, joints[1]", *parts):
        read_robot(path)


# -- parallel axes ---------------------------------------------------------------------------------------


def test_parallel_axes_are_found_where_the_convention_cannot_tilt_them() -> None:
    rows: list[dict[str, float]] = [{"alpha": 0.0}, {"alpha": 1.0}, {"alpha": 0.0}]
    named = {c.name: parallel_joints_without_beta(c, list(rows)) for c in CONVENTIONS}
    assert named["s-model"] == named["standard-dh"] == named["hayati"] == [(1, 2)]
    assert named["modified-dh"] == named["modified-hayati"] == [(2, 3)]
    tilting = ("cpc", "mcpc", "zero-reference", EXPONENTIALS, "translations", "urdf")
    assert all(named[name] == [] for name in tilting)
