"""Springs and gas cylinders that relieve joints, and where bearings lie: by hand, by energy, and the twin's."""

from __future__ import annotations

import json
import math
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.engine.robot.test_chain import random_frame, random_robot
from tests.expecting import refusing

import truearm
from truearm.engine.robot.balancers import Anchor, Balancer
from truearm.engine.robot.chain import Array, Chain, Element
from truearm.engine.robot.conventions import CONVENTIONS
from truearm.engine.robot.conventions.convention import Convention
from truearm.engine.robot.conversion import CONVERSIONS, converted
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.loads import joint_loads
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.twin.truths import joint_truths
from truearm.engine.twin.twin import Twin
from truearm.robot_files.formats import exported


def seesaw(balancer: Balancer) -> Robot:
    """A weightless arm along x that turns about y of the base, downwards where the joint turns forward."""
    row = {"alpha": -math.pi / 2, "a": 0.0, "theta_offset": 0.0, "d": 0.0}
    joints = (Joint("swing", "revolute", row),)
    return Robot("seesaw", "seesaw", "made up", "modified-dh", joints, balancers=(balancer,))


def test_moment_of_a_spring_is_that_by_hand() -> None:
    """Fixed 0.3 m above the axis and moving 0.4 m out on the arm, a spring of 2 N/mm that is free at 0.3 m.

    Level, the anchors are 0.5 m apart (3, 4, 5), and the spring pulls with 2 N/mm times 200 mm = 400 N. The line
    between them passes the axis at 0.3 x 0.4 / 0.5 = 0.24 m, so it lifts the arm with 96 N m. On the arm it pulls
    with 0.8 x 400 = 320 N inwards and 0.6 x 400 = 240 N upwards. Hanging down, the anchors and the axis are in line,
    0.7 m apart: 800 N inwards and no moment. Raised by asin(0.8) the anchors are sqrt(0.09 + 0.16 - 0.24 x 0.8)
    = 0.2408 m apart, where the spring pushes: 2 N/mm times -59.17 mm.
    """
    spring = Balancer("spring", Anchor(0, (0.0, 0.0, 0.3)), Anchor(1, (0.4, 0.0, 0.0)), 0.0, 0.3, 2000.0)
    raised = -math.asin(0.8)
    length = math.sqrt(0.09 + 0.16 - 0.24 * 0.8)
    push = 2000.0 * (length - 0.3)
    robot, q = seesaw(spring), np.array([[0.0, math.pi / 2, raised]])
    loads = joint_loads(robot, q)[0]
    assert_allclose(loads[[0, 1, 2, 5], 0], [-320.0, -240.0, 0.0, -96.0], rtol=0, atol=1e-11)
    assert_allclose(loads[[0, 1, 2, 5], 1], [-800.0, 0.0, 0.0, 0.0], rtol=0, atol=1e-11)
    assert loads[5, 2] == pytest.approx(-push * 0.3 * 0.4 * 0.6 / length, abs=1e-11)
    assert loads[5, 2] > 0.0
    twin = np.array([posture.loads[0] for posture in Twin(robot).postures(q.T)]).T
    assert_allclose(twin, loads, rtol=0, atol=1e-11)


def test_gas_cylinder_that_pushes_lifts_from_below() -> None:
    """Anchored 0.3 m below the axis, with 400 N at 0.5 m: the same moment as the spring from above."""
    gas = Balancer("gas", Anchor(0, (0.0, 0.0, -0.3)), Anchor(1, (0.4, 0.0, 0.0)), -400.0, 0.5, 500.0)
    assert joint_loads(seesaw(gas), np.zeros((1, 1)))[0, 5, 0] == pytest.approx(-96.0, abs=1e-12)


# -- what must hold for every arm --------------------------------------------------------------------------


def balanced(convention: Convention, rng: np.random.Generator) -> Robot:
    """A random arm whose balancers span one joint or several, from the base or from a link."""
    robot = random_robot(convention, (), rng, ("revolute", "revolute", "prismatic", "revolute", "revolute"))

    def point() -> tuple[float, float, float]:
        x, y, z = (float(v) for v in rng.uniform(-0.5, 0.5, 3))
        return x, y, z

    return replace(
        robot.with_frames(random_frame(rng), {}),
        balancers=(
            Balancer("one", Anchor(1, point()), Anchor(2, point()), 300.0, 0.4, 2000.0),
            Balancer("two", Anchor(0, point()), Anchor(4, point()), -200.0, 0.7, 500.0),
        ),
        joints=tuple(replace(j, bearing=0.1) if j.kind == "revolute" else j for j in robot.joints),
    )


def energy(robot: Robot, variables: Array) -> Array:
    """Of the springs [J], by where their anchors are; valid for nominal slides."""

    def place(anchor: Anchor) -> Array:
        x, y, z = anchor.point
        links = [e for link in robot.link_elements[: anchor.link] for e in link]
        way = (*links, Element("Tx", x), Element("Ty", y), Element("Tz", z))
        return np.broadcast_to(Chain(way).forward_kinematics(variables, robot.values).position, (3, variables.shape[1]))

    total = np.zeros(variables.shape[1])
    for b in robot.balancers:
        longer = np.linalg.norm(place(b.fixed) - place(b.moving), axis=0) - b.length
        total += b.force * longer + 0.5 * b.stiffness * longer**2
    return total


def test_moments_are_what_the_energy_of_springs_loses() -> None:
    for convention in CONVENTIONS:
        rng = np.random.default_rng(1)
        robot = balanced(convention, rng)
        robot = robot.with_values({n: p.nominal for n, p in robot.parameters.items() if p.group != "base"})
        q = rng.uniform(-1, 1, (5, 8))
        loads, step = joint_loads(robot, q), 1e-6
        for i, joint in enumerate(robot.joints):
            way = step * (np.arange(5) == i)[:, None]
            lost = (energy(robot, q - way) - energy(robot, q + way)) / (2 * step)
            own = loads[i, 5 if joint.kind == "revolute" else 2]
            assert_allclose(own, lost, rtol=0, atol=1e-5, err_msg=f"{convention.name}, {joint.name}")
        assert np.abs(loads).max() > 10.0


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_all_components_are_those_of_the_twin(convention: Convention) -> None:
    rng = np.random.default_rng(2)
    robot = balanced(convention, rng)
    q = rng.uniform(-1, 1, (6, 5))
    twin = np.array([posture.loads for posture in Twin(robot).postures(q)]).transpose(1, 2, 0)
    model = joint_loads(robot, q.T)
    assert_allclose(model[:, 5], twin[:, 5], rtol=0, atol=1e-8)
    for part in (slice(3), slice(3, 6)):
        ours, theirs = (np.linalg.norm(loads[:, part], axis=1) for loads in (model, twin))
        assert_allclose(ours, theirs, rtol=0, atol=1e-8)
    if convention.name not in ("urdf", "zero-reference", "product-of-exponentials"):  # whose axes across are another's
        assert_allclose(model, twin, rtol=0, atol=1e-8)


# -- files -------------------------------------------------------------------------------------------------

ARM = """truearm: truearm-robot/1
name: arm150
title: an invented arm for 150 kg
source: round dimensions; masses and spring are assumed
units: {length: mm, angle: deg}
convention: modified-hayati
joints:
  - {alpha: 0, a: 0, theta_offset: 0, d: 780, limits: [-170, 170]}
  - {alpha: -90, a: 320, theta_offset: -90, d: 0, limits: [-60, 80]}
  - {alpha: 0, beta: 0, a: 1075, theta_offset: 0, d: 0, limits: [-150, 65]}
  - {alpha: -90, a: 200, theta_offset: 0, d: 1140, limits: [-180, 180]}
  - {alpha: 90, a: 0, theta_offset: 0, d: 0, limits: [-120, 120]}
  - {alpha: -90, a: 0, theta_offset: 180, d: 200, limits: [-180, 180]}
masses:
  - {link: 2, mass: 180, cog: [500, 0, 60]}
  - {link: 3, mass: 220, cog: [80, 120, 0]}
  - {link: 4, mass: 60, cog: [0, 0, -400]}
  - {link: 6, mass: 20, cog: [0, 0, -50]}
balancers:
  - {name: spring, fixed: {link: 1, point: [320, 150, -700]}, moving: {link: 2, point: [-250, 0, 150]}, PULL}
"""
PULL = "length: 450, force: 6000, stiffness: 40"


def arm(tmp_path: Path, text: str = ARM.replace("PULL", PULL)) -> Robot:
    path = tmp_path / "arm.yaml"
    path.write_text(text)
    return read_robot(path)


def test_balancers_are_written_and_read(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    (spring,) = robot.balancers
    assert (spring.name, spring.fixed.link, spring.moving.point) == ("spring", 1, (-0.25, 0.0, 0.15))
    assert (spring.force, spring.length, spring.stiffness) == (6000.0, 0.45, 40e3)
    assert robot_text(arm(tmp_path, robot_text(robot))) == robot_text(robot)
    shown = truearm.show(robot)
    assert "Balancer spring: from link 1 to link 2, 6000 N at 450 mm, 40 N/mm" in shown.lines()
    assert shown.summary()["balancers"][0]["stiffness"] == 40.0
    free = arm(tmp_path, ARM.replace("PULL", "free_length: 300, stiffness: 40"))
    assert (free.balancers[0].force, free.balancers[0].length) == (0.0, 0.3)
    assert robot_text(arm(tmp_path, robot_text(free))) == robot_text(free)
    assert "free at 300 mm" in "\n".join(truearm.show(free).lines())
    gas = arm(tmp_path, ARM.replace("PULL", "length: 450, pressure: 120, area: 500, stiffness: 40"))
    assert gas.balancers[0].force == pytest.approx(6000.0)  # 12 MPa on 500 mm^2


def test_conversions_move_anchors_along(tmp_path: Path) -> None:
    robot = arm(tmp_path).with_effects(["compliance", "balancer"])
    second = Balancer("second", Anchor(0, (1.0, 0.0, 1.0)), Anchor(1, (1.0, 1.0, 0.0)), 900.0, 1.0, 900.0)
    robot = replace(robot, balancers=(*robot.balancers, second))
    robot = robot.with_values({"compliance_2": 1e-6, "balancer_1": 0.9, "d_2": 0.01, "d_3": 0.02})
    q = robot.random_configurations(5, np.random.default_rng(4))
    for name in CONVERSIONS:
        converted_robot = converted(robot, name)
        assert converted_robot.values["balancer_1"] == 0.9
        for actual, expected in zip(converted_robot.world_poses(q), robot.world_poses(q), strict=True):
            assert not converted_robot.masses or np.abs(actual - expected).max() < 1e-10, name


def test_exports_carry_balancers(tmp_path: Path) -> None:
    robot = arm(tmp_path).with_effects(["compliance", "balancer", "bearing-compliance"])
    robot = robot.with_values({"compliance_2": 1e-6, "balancer_1": 0.9, "d_2": 0.01, "bearing_compliance_2": 1e-7})
    path = tmp_path / "arm150.py"
    path.write_text(exported(robot, "python").text)
    q = robot.random_configurations(20, np.random.default_rng(5))
    position, rotation = runpy.run_path(str(path))["forward"](q)
    assert_allclose(position, robot.world_poses(q)[0], rtol=0, atol=1e-10)
    assert_allclose(rotation, robot.world_poses(q)[1], rtol=0, atol=1e-10)
    assert "(1, (" in path.read_text()
    assert any("cannot hold balancers; left out: spring" in words for words in exported(robot, "urdf").left_out)
    assert not any("balancers" in words for words in exported(robot, "python").left_out)
    (entry,) = json.loads(exported(robot, "json").text)["balancers"]
    assert (entry["name"], entry["fixed"]["link"], entry["stiffness"]) == ("spring", 1, 40e3)


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("link: 2, point: [-250", "link: 9, point: [-250", ["moving.link", "no such link"]),
        ("{link: 1,", "{link: -1,", ["fixed.link", "no such link"]),
        ("{link: 1,", "{link: 2,", ["both anchors are on one link"]),
        ("{link: 1,", "{link: 3,", ["farther from the base"]),
        ("[-250, 0, 150]", "[0, 0, 150]", ["moving.point", "lies on the axis"]),
        ("[320, 150, -700]", "[320, 150, -0.5]", ["fixed.point", "lies on the axis"]),
        ("[-250, 0, 150]", "[-700, 0, 150]", ["one point in some posture"]),
        (PULL, "stiffness: 40", ["how hard", "none of them"]),
        (PULL, PULL + ", free_length: 3", ["says it twice", "free_length, length"]),
        (PULL, "length: 450, pressure: 3, stiffness: 40", ["how hard", "area"]),
        (PULL, "length: 0, force: 3, stiffness: 4", ["length", "too small"]),
        (PULL, "free_length: 450, stiffness: -4", ["stiffness", "too small"]),
        (PULL, "free_length: 450, stiffness: 0", ["never pulls"]),
        (PULL, "length: 450, force: 1e9, stiffness: 4", ["so strong"]),
        (PULL, "length: 450, force: .nan, stiffness: 4", ["force", "not a number"]),
        (PULL, PULL + ", colour: red", ["colour", "not known here"]),
    ],
)
def test_balancer_that_cannot_be_is_refused(tmp_path: Path, old: str, new: str, parts: list[str]) -> None:
    with refusing("balancers[1]", *parts):
        arm(tmp_path, ARM.replace("PULL", PULL).replace(old, new, 1))


def test_two_balancers_of_one_name_are_refused(tmp_path: Path) -> None:
    text = ARM.replace("PULL", PULL)
    with refusing("balancers[2]", "same name; got 'spring'", "balancers[1] has it too"):
        arm(tmp_path, text + text.splitlines(keepends=True)[-1])
    assert len(arm(tmp_path, text + text.splitlines()[-1].replace("name: spring, ", "")).balancers) == 2


def test_trial_values_of_a_strength_are_each_what_they_are_alone(tmp_path: Path) -> None:
    robot = arm(tmp_path).with_effects(["compliance", "balancer"]).with_values({"compliance_2": 1e-6})
    at = robot.loaded(robot.random_configurations(6, np.random.default_rng(6)))
    trials = np.array([[0.8], [1.0], [1.3]])
    together = robot.forward_kinematics(at, values={**robot.values, "balancer_1": trials}).position
    for k, factor in enumerate(trials[:, 0]):
        alone = robot.forward_kinematics(at, values={**robot.values, "balancer_1": float(factor)}).position
        assert_allclose(together[:, k], alone, rtol=0, atol=1e-15)
    stronger = robot.with_values({"balancer_1": 1.3}).world_poses(at.at(np.arange(6)))[0]
    assert_allclose(together[:, 2].T, stronger, rtol=0, atol=1e-5)  # the arm stands a little elsewhere then
    assert np.abs(together[:, 1].T - stronger).max() > 1e-4


# == bearings =================================================================================================

G = 9.80665


def test_moments_of_the_katana_are_those_of_table_4_2_by_hand() -> None:
    """Patel, equation 4.21 with Table 4.2, at (0, 0, 0, -60, 90) deg; lengths in m, weights in N, forces down.

    Links 2 and 3 lie level along x of the base, and axes 2, 3 and 4 point along -y. Joint 4 turns its link's y, along
    which it extends, from upwards to (sin 60, 0, cos 60); that is also axis 5. Link 5 extends along -y of frame 5,
    which theta_5 = 90 deg turns to (cos 60, 0, -sin 60). The levers along x are then

        link   mass   weight     centre of gravity from its own joint   next joint
        2      1.03   10.1008495 0.100                                  0.190
        3      0.90    8.825985  0.104                                  0.139
        4      1.00    9.80665   0.080 sin 60 = 0.06928203              0.1473 sin 60 = 0.12756554
        5      0.80    7.84532   0.070 cos 60 = 0.035

    and each weight turns what carries it about +y by weight times lever. Frame 5 stands behind the 147.3 mm:

        joint 5   7.84532 x 0.035                                     = 0.2745862  about x of frame 5, which is +y
        joint 4   9.80665 x 0.06928203 + 7.84532 x 0.16256554         = 1.9548033  about -z of frame 4
        joint 3   8.825985 x 0.104 + 9.80665 x 0.20828203
                  + 7.84532 x 0.30156554                              = 5.3263296  about -z of frame 3
        joint 2   10.1008495 x 0.100 + 8.825985 x 0.294
                  + 9.80665 x 0.39828203 + 7.84532 x 0.49156554       = 11.3672260 about -z of frame 2

    Before the 147.3 mm the moment across joint 5 would be 7.84532 x 0.16256554 = 1.2753787.
    """
    q = np.radians([[0.0, 0.0, 0.0, -60.0, 90.0]])
    by_hand = {2: (0.0, 0.0, -11.3672260), 3: (0.0, 0.0, -5.3263296), 4: (0.0, 0.0, -1.9548033)}
    by_hand[5] = (0.2745862, 0.0, 0.0)
    robot = load_robot("katana450")
    model = joint_loads(robot, q.T)[:, 3:, 0]
    twin = Twin(robot).postures(q)[0].loads[:, 3:]
    for joint, moment in by_hand.items():
        assert_allclose(model[joint - 1], moment, rtol=0, atol=1e-6)
        assert_allclose(twin[joint - 1], moment, rtol=0, atol=1e-6)
    assumed = replace(robot, joints=tuple(replace(joint, bearing=None) for joint in robot.joints))
    assert joint_loads(assumed, q.T)[4, 3, 0] == pytest.approx(1.2753787, abs=1e-6)


# -- slides that can be exchanged --------------------------------------------------------------------------


def tilting(robot_id: str) -> Robot:
    """A robot with tilting joints, some parameters off nominal, whose bearings lie anywhere."""
    rng = np.random.default_rng(0)
    plain = load_robot(robot_id)
    joints = tuple(replace(joint, bearing=float(rng.uniform(-0.2, 0.2))) for joint in plain.joints)
    robot = replace(plain, joints=joints).with_effects(["compliance", "bearing-compliance", "clearance"])
    robot = robot.with_frames(robot.base, {"tip": (0.05, 0.02, 0.1)}).with_payload("2kg,20mm,30mm,80mm")
    sizes = {"compliance": 1e-4, "bearing-compliance": 1e-4, "clearance": 3e-4}
    return robot.with_values({n: sizes[p.group] for n, p in robot.parameters.items() if p.group in sizes})


def test_shifting_one_slide_against_a_parallel_one_leaves_moments_and_tip() -> None:
    for robot_id, first, other, sign in (
        ("katana450", "d_2", "d_3", 1.0),
        ("katana450", "d_3", "d_4", 1.0),
        ("irb120", "d_2", "d_3", 1.0),
        ("ur5", "d_2", "d_4", 1.0),
        ("kr5", "y_2", "z_3", -1.0),
    ):
        robot = tilting(robot_id)
        v, case = robot.values, f"{robot_id}: {first} and {other}"
        shifted = robot.with_values({first: v[first] + 0.02, other: v[other] - sign * 0.02})
        q = robot.random_configurations(50, np.random.default_rng(1))
        assert_allclose(shifted.loaded(q).joint_loads, robot.loaded(q).joint_loads, rtol=0, atol=1e-10, err_msg=case)
        tip, before = (r.world_poses(q, "tip")[0] for r in (shifted, robot))
        assert_allclose(tip, before, rtol=0, atol=1e-12, err_msg=case)


def test_slide_of_the_last_joint_shifted_against_the_tool_leaves_bearings() -> None:
    """The payload hangs on the flange and goes with it; without one nothing feels the shift."""
    robot = tilting("irb120").with_payload("0kg,0mm,0mm,0mm")
    shifted = robot.with_values({"d_6": robot.values["d_6"] + 0.02, "target_tip_z": 0.1 - 0.02})
    q = robot.random_configurations(20, np.random.default_rng(2))
    assert shifted.bearings == robot.bearings
    assert_allclose(shifted.loaded(q).joint_loads, robot.loaded(q).joint_loads, rtol=0, atol=1e-12)
    assert_allclose(shifted.world_poses(q, "tip")[0], robot.world_poses(q, "tip")[0], rtol=0, atol=1e-12)


def test_twin_knows_bearings_of_a_robot_that_is_off() -> None:
    for robot_id in ("katana450", "kr5", "ur5"):
        rng = np.random.default_rng(3)
        robot = tilting(robot_id)
        steps = {"m": 3e-3, "rad": 1e-3}
        links = [p for p in robot.parameters.values() if p.group == "geometry"]
        robot = robot.with_values({p.name: p.value + steps[p.unit] * rng.normal() for p in links})
        assert any(robot.bearings[i] != robot.joints[i].bearing for i in range(len(robot.joints)))
        q = robot.random_configurations(15, rng)
        frames = Twin(robot, joint_truths(robot)).frames(q)["tip"]
        assert_allclose(robot.world_poses(q, "tip")[0], frames[:, :3, 3], rtol=0, atol=1e-10, err_msg=robot_id)


def test_derivatives_by_exchangeable_slides_are_exact() -> None:
    for robot_id in ("katana450", "kr5"):
        robot = tilting(robot_id)
        robot = robot.with_values({n: v + 0.01 for n, v in robot.values.items() if n in ("d_2", "d_3", "y_2", "z_3")})
        at = robot.loaded(robot.random_configurations(10, np.random.default_rng(4)))
        names = [n for n, p in robot.parameters.items() if p.group == "geometry"]
        result = robot.position_jacobian(robot.forward_kinematics(at, "tip"), at, names)
        for row, name in zip(result, names, strict=True):
            ahead, back = (
                robot.forward_kinematics(at, "tip", {**robot.values, name: robot.values[name] + step}).position
                for step in (1e-5, -1e-5)
            )
            assert_allclose(row, (ahead - back) / 2e-5, rtol=0, atol=1e-8, err_msg=f"{robot_id}, {name}")


def test_bearing_of_no_influence_leaves_the_chain_as_it_was() -> None:
    plain = load_robot("irb120").with_effects(["bearing-compliance"])
    zero = replace(plain, joints=tuple(replace(joint, bearing=0.0) for joint in plain.joints))
    assert zero.trunk.elements == plain.trunk.elements


# -- robot files -------------------------------------------------------------------------------------------


def test_bearings_are_written_and_read(tmp_path: Path) -> None:
    text = robot_text(load_robot("katana450"))
    path = tmp_path / "katana.yaml"
    path.write_text(text)
    assert [joint.bearing for joint in read_robot(path).joints] == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.1473])
    assert robot_text(read_robot(path)) == text
    assert "  bearing at 147.3" in "\n".join(truearm.show(path).lines())
    assert truearm.show(path).summary()["joints"][4]["bearing"] == pytest.approx(147.3)


SLIDER = """truearm: truearm-robot/1
name: slider
units: {length: mm, angle: deg}
convention: standard-dh
joints:
  - {name: turn, d: 100, a: 200, alpha: 0, theta_offset: 0, bearing: BEARING}
  - {name: lift, type: prismatic, d: 0, a: 0, alpha: 0, theta_offset: 0, limits: [0, 100]SLIDING}
"""


@pytest.mark.parametrize(
    ("bearing", "sliding", "parts"),
    [
        ("soon", "", ["joints[1].bearing", "a number belongs here"]),
        (".nan", "", ["joints[1].bearing", "not a number"]),
        ("1e12", "", ["joints[1].bearing", "too large"]),
        ("-1e6", "", ["joints[1].bearing", "farther along its axis"]),
        ("5", ", bearing: 3", ["joints[2].bearing", "slides has no bearing"]),
    ],
)
def test_bearing_that_cannot_be_is_refused(tmp_path: Path, bearing: str, sliding: str, parts: list[str]) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(SLIDER.replace("BEARING", bearing).replace("SLIDING", sliding))
    with refusing(*parts):
        read_robot(path)
