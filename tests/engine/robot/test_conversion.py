from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.arms import ARMS
from tests.engine.robot.test_chain import random_frame, random_robot
from tests.expecting import refusing

from truearm.engine.robot.chain import Array, Chain
from truearm.engine.robot.conventions import CONVENTIONS
from truearm.engine.robot.conventions.convention import Convention
from truearm.engine.robot.conversion import CONVERSIONS, converted
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.loads import joint_loads
from truearm.engine.robot.parts import Joint, LinkMass, Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.twin import Twin

COMMON_NORMALS = ("standard-dh", "modified-dh", "s-model")


def drawn(robot: Robot, rng: np.random.Generator) -> Robot:
    """The robot as it might come out of a calibration."""
    return robot.with_values({n: p.value + min(p.prior, 0.3) * rng.normal() for n, p in robot.parameters.items()})


def check_same(result: Robot, robot: Robot, rng: np.random.Generator) -> None:
    q = robot.random_configurations(10, rng)
    for target in (None, *(t.name for t in robot.targets)):
        for actual, expected in zip(result.world_poses(q, target), robot.world_poses(q, target), strict=True):
            assert_allclose(actual, expected, rtol=0, atol=1e-12, err_msg=f"{robot.name}, {result.history}")


def centres(robot: Robot, q: Array) -> Array:
    """Centres of gravity of the links in the world, ``(masses, n, 3)``."""
    points = []
    for mass in robot.masses:
        links = Chain((*robot.base_elements, *(e for link in robot.link_elements[: mass.joint] for e in link)))
        kinematics = links.forward_kinematics(robot.variables(q, robot.values), robot.values)
        centre = robot.axial_slides.stayed(mass.joint, mass.cog, robot.values)
        points.append(kinematics.matrix() @ centre + kinematics.position.T)
    return np.array(points)


def loads_along_axes(robot: Robot, q: Array) -> Array:
    """Moment about, or force along, the axis of each joint in a lively motion, ``(joints, n)``."""
    moving = np.ones((len(robot.joints), len(q)))
    loads = joint_loads(robot, robot.variables(q, robot.values), velocity=3 * moving, acceleration=-5 * moving)
    return np.array([loads[i, 5 if j.kind == "revolute" else 2] for i, j in enumerate(robot.joints)])


# -- same poses ------------------------------------------------------------------------------------------


def test_every_convention_can_be_converted_to_and_no_other() -> None:
    assert set(CONVERSIONS) == {c.name for c in CONVENTIONS}
    with refusing("there is no such convention", "allowed: standard-dh", "Did you mean s-model"):
        converted(load_robot("irb120"), "s_model")


@pytest.mark.parametrize("robot_id", ARMS)
def test_library_robot_goes_into_any_convention_and_calibrated_where_tilts_have_a_place(robot_id: str) -> None:
    plain, rng = load_robot(robot_id), np.random.default_rng(1)
    placed = plain.with_effects(["gain"]).with_frames(random_frame(rng), {"tip": random_frame(rng)})
    robot = drawn(placed, rng)
    for name in CONVERSIONS:
        check_same(converted(plain, name), plain, rng)
        if name not in COMMON_NORMALS:
            converted_robot = converted(robot, name)
            check_same(converted_robot, robot, rng)
            assert all(p.value == p.nominal for p in converted_robot.parameters.values())


def test_gears_keep_every_number_of_periods_in_any_convention() -> None:
    plain, rng = load_robot("irb120"), np.random.default_rng(4)
    many = ((240, 30), (), (200, 400, 101), (100, 300), (100,), ())
    joints = tuple(replace(j, transmission_periods=periods) for j, periods in zip(plain.joints, many, strict=True))
    geared = replace(plain, joints=joints).with_effects(["transmission-error"])
    own = [p.name for p in geared.effects[0].parameters]
    robot = geared.with_values({name: 1e-4 * n for n, name in enumerate(own, 1)})
    for name in CONVERSIONS:
        made = converted(robot, name)
        assert tuple(joint.periods for joint in made.joints) == many
        assert {name: made.values[name] for name in own} == {name: robot.values[name] for name in own}
        check_same(made, robot, rng)


@pytest.mark.parametrize("robot_id", ["irb120", "katana450", "kr5", "ur5"])  # one of each build
def test_library_robot_goes_from_any_convention_to_any(robot_id: str) -> None:
    rng = np.random.default_rng(0)
    robot = load_robot(robot_id)
    for first in CONVERSIONS:
        converted_robot = converted(robot, first)
        for second in CONVERSIONS:
            check_same(converted(converted_robot, second), robot, rng)


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_random_robot_goes_from_its_convention_to_any(convention: Convention) -> None:
    rng = np.random.default_rng(0)
    masses = (
        LinkMass(2, 1.0, (0.1, 0.2, 0.3), (0.05, 0.06, 0.07, 0.01, -0.02, 0.005)),
        LinkMass(4, 2.0, (0.0, 0.0, 1.0)),
    )
    robot = replace(
        random_robot(convention, ("gain",), rng), payload=Payload(1.5, (0.1, 0.0, 0.2)), gravity=(1.0, -2.0, -9.0)
    )
    unladen = robot
    robot = replace(robot, masses=masses)
    q = robot.random_configurations(3, rng)
    for name in CONVERSIONS:
        converted_robot = converted(robot, name)
        check_same(converted_robot, robot, rng)
        if converted_robot.masses:
            assert_allclose(centres(converted_robot, q), centres(robot, q), rtol=0, atol=1e-12)
        else:
            assert "left out: link masses" in converted_robot.history[-1]
        expected = loads_along_axes(robot if converted_robot.masses else unladen, q)
        assert_allclose(loads_along_axes(converted_robot, q), expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("stated", [True, False], ids=["stated", "assumed"])
def test_bearings_stay_where_they_are(stated: bool) -> None:
    rng = np.random.default_rng(4)
    robot = load_robot("katana450").with_effects(["bearing-compliance"])
    joints = [replace(joint, bearing=float(rng.uniform(-0.1, 0.1)) if stated else None) for joint in robot.joints]
    robot = replace(robot, joints=tuple(joints))
    away = {"bearing_compliance": 1e-5, "d": 1e-3, "a": 1e-3, "theta_offset": 1e-3}
    robot = robot.with_values({n: p.value + away.get(n[:-2], 0.0) * rng.normal() for n, p in robot.parameters.items()})
    q = robot.random_configurations(20, rng)
    for name in CONVERSIONS:
        converted_robot = converted(robot, name)
        assert None not in converted_robot.bearings[:5], name
        for ours, theirs in zip(converted_robot.world_poses(q), robot.world_poses(q), strict=True):
            assert not converted_robot.masses or np.abs(ours - theirs).max() < 1e-11, name


# -- what stays ------------------------------------------------------------------------------------------


def test_all_but_the_links_stays() -> None:
    rng = np.random.default_rng(2)
    robot = load_robot("irb120").with_effects(["gain"]).with_frames(random_frame(rng), {"tip": (0.1, 0.0, 0.2)})
    robot = robot.with_values({"gain_2": 1.001, "base_x": 0.4})
    q = robot.random_configurations(3, rng)
    for name in CONVERSIONS:
        converted_robot = converted(robot, name)
        for own, other in zip(converted_robot.joints, robot.joints, strict=True):
            assert (own.name, own.kind, own.limits, own.bearing) == (other.name, other.kind, other.limits, None)
        assert (converted_robot.targets, converted_robot.tools, converted_robot.effect_names) == (
            robot.targets,
            robot.tools,
            robot.effect_names,
        )
        assert converted_robot.base == robot.base
        assert (converted_robot.parameters["gain_2"].nominal, converted_robot.parameters["target_tip_z"].nominal) == (
            1.001,
            0.2,
        )
        words = f"converted from modified-hayati to {name}; left out: truths tracker-triangular"
        assert converted_robot.history[-1].startswith(words)
        assert converted_robot.truths == {}
        for ours, theirs in zip(Twin(converted_robot).postures(q), Twin(robot).postures(q), strict=True):
            assert_allclose(ours.loads[:, 5], theirs.loads[:, 5], rtol=0, atol=1e-12, err_msg=name)


def test_masses_are_left_out_where_the_base_would_turn_under_them() -> None:
    row = {"axis_x": 1.0, "axis_y": 0.0, "axis_z": 0.0, "z": 0.3}
    robot = Robot("arm", "", "", "urdf", (Joint("J1", "revolute", row),), masses=(LinkMass(1, 2.0, (0.1, 0.0, 0.0)),))
    for name in ("mcpc", "standard-dh"):
        converted_robot = converted(robot, name)
        assert converted_robot.masses == ()
        assert converted_robot.history == (
            f"converted from urdf to {name}; the base frame now lies on the first axis; "
            "left out: link masses, because the base's z has turned",
        )
    assert converted(robot, "zero-reference").masses == (LinkMass(1, 2.0, (0.1, 0.0, 0.3)),)


def test_numbers_of_the_textbook() -> None:
    """Twists and MCPC rows of the IRB 120, read off its drawing: axes along z, y, y, x, y, x."""
    twists = converted(load_robot("irb120"), "product-of-exponentials")
    assert [tuple(j.row.values()) for j in twists.joints] == [
        (0, 0, 1, 0, 0, 0),
        (0, 1, 0, -0.29, 0, 0),
        (0, 1, 0, -0.56, 0, 0),
        (1, 0, 0, 0, 0.63, 0),
        (0, 1, 0, -0.63, 0, 0.302),
        (1, 0, 0, 0, 0.63, 0),
    ]
    assert twists.flange.translation == (0.374, 0.0, 0.63)
    mcpc = converted(load_robot("irb120"), "mcpc")
    assert [(j.row["x"], j.row["y"]) for j in mcpc.joints[:4]] == [(0, -0.29), (0, -0.27), (-0.07, 0), (0, -0.302)]
    assert mcpc.joints[-1].row["z"] == 0.072
    assert mcpc.flange == Transform()


def test_rows_survive_their_own_convention() -> None:
    for name in CONVERSIONS:
        once = converted(load_robot("ur5"), name)
        for first, other in zip(once.joints, converted(once, name).joints, strict=True):
            assert list(first.row) == list(other.row)
            assert_allclose(list(other.row.values()), list(first.row.values()), rtol=0, atol=1e-14, err_msg=name)


def test_axes_close_to_parallel_get_a_beta_and_others_a_common_normal() -> None:
    for tilt, close in ((9.0, True), (11.0, False)):
        rows = [{"d": 0.1}, {"alpha": np.radians(tilt), "a": 0.3}, {"alpha": 1.5, "a": 0.1}]
        joints = tuple(Joint(f"J{i}", "revolute", row) for i, row in enumerate(rows))
        robot = Robot("arm", "", "", "modified-dh", joints)
        for name, link in (("hayati", 0), ("modified-hayati", 1)):
            converted_robot = converted(robot, name)
            assert ["beta" in j.row for j in converted_robot.joints] == [close and i == link for i in range(3)], (
                tilt,
                name,
            )
            check_same(converted_robot, robot, np.random.default_rng(0))


# -- refusals --------------------------------------------------------------------------------------------


def test_nearly_parallel_axes_have_no_common_normal_to_write_down() -> None:
    robot = load_robot("irb120").with_values({"beta_3": np.radians(0.01)})
    for name in COMMON_NORMALS:
        with refusing(
            "axes of two joints are nearly parallel", "axis_2 and axis_3, 0.01 deg", "Hayati's beta", of=name
        ):
            converted(robot, name)
