from __future__ import annotations

import math
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from tests.arms import ARMS
from tests.robot_files.dh_reading import read_dh

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.conventions.convention import JointKind
from truearm.engine.robot.dh_table import DHConvention, DHTable, dh_table
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.robot_files.formats import dh_csv

FORMS: tuple[DHConvention, ...] = get_args(DHConvention)
KINDS: tuple[JointKind, ...] = get_args(JointKind)


def rebuilt(table: DHTable) -> Robot:
    """The robot that a table describes."""
    robot = Robot("rebuilt", "", "", table.convention_name, table.joints(), table.flange)
    return robot.with_frames(table.base, {})


def check_same_poses(robot: Robot, table: DHTable, rng: np.random.Generator, atol: float = 1e-9) -> None:
    scale = [math.pi if joint.kind == "revolute" else 0.5 for joint in robot.joints]
    q = rng.uniform(-1, 1, (20, len(scale))) * scale
    for actual, expected in zip(rebuilt(table).world_poses(q), robot.world_poses(q), strict=True):
        assert_allclose(actual, expected, rtol=0, atol=atol)


def plain_robot(convention_name: str, *rows: dict[str, float], kinds: tuple[JointKind, ...] | None = None) -> Robot:
    joints = (Joint(f"J{i + 1}", kinds[i] if kinds else "revolute", row) for i, row in enumerate(rows))
    return Robot("plain", "", "", convention_name, tuple(joints))


def numbers(table: DHTable) -> Array:
    return np.array([(r.a, r.alpha, r.d, r.theta_offset) for r in table.rows])


# -- poses -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("robot_id", ARMS)
def test_table_of_library_robot_gives_its_poses(robot_id: str, form: DHConvention) -> None:
    rng = np.random.default_rng(1)
    robot = load_robot(robot_id).with_frames(Transform((0.3, -2.0, 0.7), (0.1, 0.7, -0.1, 0.7)), {})
    check_same_poses(robot, dh_table(robot, form), rng)


@st.composite
def robots(draw: st.DrawFn) -> Robot:
    """A random robot of any DH convention whose neighbouring axes are parallel or 1 deg apart and more."""
    form = draw(st.sampled_from(FORMS))
    count = draw(st.integers(1, 7))
    tilt = st.sampled_from([0.0, math.pi / 2, -math.pi / 2, math.pi]) | st.floats(0.02, 3.1) | st.floats(-3.1, -0.02)
    length = st.sampled_from([0.0, 0.25]) | st.floats(-0.8, 0.8)
    angle = st.sampled_from([0.0, math.pi / 2]) | st.floats(-math.pi, math.pi)
    rows = [
        {"a": draw(length), "alpha": draw(tilt), "d": draw(length), "theta_offset": draw(angle)} for _ in range(count)
    ]
    return plain_robot(form, *rows, kinds=tuple(draw(st.sampled_from(KINDS)) for _ in range(count)))


@given(robot=robots(), form=st.sampled_from(FORMS), seed=st.integers(0, 2**32 - 1))
def test_table_of_any_dh_robot_gives_its_poses(robot: Robot, form: DHConvention, seed: int) -> None:
    check_same_poses(robot, dh_table(robot, form), np.random.default_rng(seed))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("convention_name", ["urdf", "translations"])
@pytest.mark.parametrize("seed", range(5))
def test_table_of_robot_of_another_convention_gives_its_poses(
    convention_name: str, form: DHConvention, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    units = plain_robot(convention_name, {}).convention.row_units("revolute")
    rows = [
        {column: float(v) for column, v in zip(units, rng.uniform(-0.5, 0.5, len(units)), strict=True)}
        for _ in range(5)
    ]
    robot = plain_robot(convention_name, *rows, kinds=(*KINDS, "revolute", "revolute", "prismatic"))
    check_same_poses(robot, dh_table(robot, form), rng)


@pytest.mark.parametrize("form", FORMS)
def test_calibrated_axes_are_described_although_none_is_square(form: DHConvention) -> None:
    rng = np.random.default_rng(2)
    rows = [{"a": 0.1, "alpha": math.pi / 2 * sign, "d": 0.3, "theta_offset": 0.0} for sign in (1, -1, 1, -1)]
    nominal = plain_robot("standard-dh", *rows)
    robot = nominal.with_values({n: p.value + 1e-3 * rng.normal() for n, p in nominal.parameters.items()})
    check_same_poses(robot, dh_table(robot, form), rng, atol=1e-12)


def test_joint_effects_are_no_part_of_a_table() -> None:
    plain = load_robot("ur5")
    robot = plain.with_effects(["gain"]).with_values({"gain_2": 1.01})
    assert dh_table(robot, "standard-dh") == dh_table(plain, "standard-dh")


# -- published tables ------------------------------------------------------------------------------------------


def test_table_of_ur5_is_the_makers() -> None:
    # Universal Robots, "DH parameters for calculations of kinematics and dynamics", UR5.
    quarter = math.pi / 2
    expected = [
        (0.0, quarter, 0.089159, 0.0),
        (-0.425, 0.0, 0.0, 0.0),
        (-0.39225, 0.0, 0.0, 0.0),
        (0.0, quarter, 0.10915, 0.0),
        (0.0, -quarter, 0.09465, 0.0),
        (0.0, 0.0, 0.0823, 0.0),
    ]
    table = dh_table(load_robot("ur5"), "standard-dh")
    assert_allclose(numbers(table), expected, rtol=0, atol=1e-15)
    assert_allclose([*table.base.translation, *table.flange.translation], 0.0, rtol=0, atol=1e-15)


def test_table_of_modified_robot_is_its_own() -> None:
    robot = load_robot("irb120")  # Nubiola's modified DH table, Table 2.6
    expected = [[joint.row[c] for c in ("a", "alpha", "d", "theta_offset")] for joint in robot.joints]
    table = numbers(dh_table(robot, "modified-dh"))
    turns = (table - expected)[:, [1, 3]] / (2 * math.pi)
    assert_allclose(table[:, [0, 2]], np.array(expected)[:, [0, 2]], rtol=0, atol=1e-15)
    assert_allclose(turns, np.round(turns), rtol=0, atol=1e-15)


def test_last_link_of_a_planar_arm_is_in_its_last_standard_row() -> None:
    arm = plain_robot("standard-dh", {"a": 0.4}, {"a": 0.3, "alpha": 0.2})
    assert_allclose(
        numbers(dh_table(arm, "standard-dh")), np.array([[0.4, 0, 0, 0], [0.3, 0.2, 0, 0]]), rtol=0, atol=1e-15
    )
    modified = dh_table(arm, "modified-dh")
    assert_allclose(numbers(modified), np.array([[0, 0, 0, 0], [0.4, 0, 0, 0]]), rtol=0, atol=1e-15)
    assert_allclose(modified.flange.translation, [0.3, 0, 0], rtol=0, atol=1e-15)


# -- nearly parallel axes --------------------------------------------------------------------------------------


@pytest.mark.parametrize("tilt", [2e-9, 1e-5, math.radians(0.49), -math.radians(0.1), math.pi - 1e-4])
@pytest.mark.parametrize("form", FORMS)
def test_nearly_parallel_axes_are_refused(tilt: float, form: DHConvention) -> None:
    robot = plain_robot("hayati", {"a": 0.3, "alpha": 1.5}, {"a": 0.3, "alpha": 0.0, "beta": tilt}, {"a": 0.1})
    with pytest.raises(InputError, match="nearly parallel") as refusal:
        dh_table(robot, form)
    for part in ("plain", "J2 and J3", "deg apart", "at least 0.5 deg", "Hayati's beta", "write a URDF"):
        assert part in str(refusal.value)


@pytest.mark.parametrize("tilt", [1e-10, math.radians(0.51), math.pi])
@pytest.mark.parametrize("form", FORMS)
def test_parallel_and_clearly_tilted_axes_are_taken(tilt: float, form: DHConvention) -> None:
    robot = plain_robot("hayati", {"a": 0.3, "alpha": 1.5}, {"a": 0.3, "alpha": 0.0, "beta": tilt}, {"a": 0.1})
    check_same_poses(robot, dh_table(robot, form), np.random.default_rng(3))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    "kinds",
    [
        ("revolute", "prismatic", "revolute"),
        ("prismatic", "revolute", "revolute"),
        ("revolute", "revolute", "prismatic"),
    ],
)
def test_slide_nearly_parallel_to_a_neighbour_needs_no_beta(kinds: tuple[JointKind, ...], form: DHConvention) -> None:
    slide = kinds.index("prismatic")
    rows: list[dict[str, float]] = [{"a": 0.3, "alpha": 1.5, "d": 0.2} for _ in kinds]
    rows[max(slide - 1, 0)] |= {"alpha": 0.0, "beta": 1e-4}
    robot = plain_robot("hayati", *rows, kinds=kinds)
    table = dh_table(robot, form)
    check_same_poses(robot, table, np.random.default_rng(4))
    assert max(abs(r.a) + abs(r.d) for r in table.rows) < 2.0


def test_slide_nearly_parallel_to_both_neighbours_is_refused() -> None:
    tilted = {"a": 0.3, "alpha": 0.0, "beta": 1e-3}
    robot = plain_robot("hayati", tilted, tilted, {"a": 0.1}, kinds=("revolute", "prismatic", "revolute"))
    with pytest.raises(InputError, match="J1 and J2"):
        dh_table(robot, "standard-dh")


# -- CSV -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
def test_csv_reads_back(form: DHConvention) -> None:
    table = dh_table(load_robot("kr5"), form)
    read = read_dh(dh_csv(table), form)
    assert [(r.joint, r.kind) for r in read.rows] == [(r.joint, r.kind) for r in table.rows]
    assert_allclose(numbers(read), numbers(table), rtol=1e-15, atol=0)
    assert dh_csv(read) == dh_csv(table)
    assert (read.convention_name, read.base, read.flange) == (form, Transform(), Transform())


def test_csv_is_in_mm_and_degrees() -> None:
    scara = plain_robot("standard-dh", {"a": 0.25}, {"d": 0.1, "alpha": math.pi / 2}, kinds=("revolute", "prismatic"))
    assert dh_csv(dh_table(scara, "standard-dh")).splitlines() == [
        "joint,type,a [mm],alpha [deg],d [mm],theta_offset [deg]",
        "J1,revolute,250.0,0.0,0.0,0.0",
        "J2,prismatic,0.0,90.0,100.0,0.0",
    ]
