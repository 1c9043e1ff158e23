"""Springs and gas cylinders that relieve joints: by hand, by energy, and the twin's."""

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

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.robot.balancers import Anchor, Balancer
from truearm.engine.robot.chain import Array, Chain, Element
from truearm.engine.robot.conventions import CONVENTIONS
from truearm.engine.robot.conventions.convention import Convention
from truearm.engine.robot.conversion import CONVERSIONS, converted
from truearm.engine.robot.loads import joint_loads
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text
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


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_moments_are_what_the_energy_of_springs_loses(convention: Convention) -> None:
    rng = np.random.default_rng(1)
    robot = balanced(convention, rng)
    robot = robot.with_values({n: p.nominal for n, p in robot.parameters.items() if p.group != "base"})
    q = rng.uniform(-1, 1, (5, 8))
    loads, step = joint_loads(robot, q), 1e-6
    for i, joint in enumerate(robot.joints):
        ahead, back = q.copy(), q.copy()
        ahead[i] += step
        back[i] -= step
        lost = (energy(robot, back) - energy(robot, ahead)) / (2 * step)
        assert_allclose(loads[i, 5 if joint.kind == "revolute" else 2], lost, rtol=0, atol=1e-5)
    assert np.abs(loads).max() > 10.0


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_all_components_are_those_of_the_twin(convention: Convention) -> None:
    rng = np.random.default_rng(2)
    robot = balanced(convention, rng)
    q = rng.uniform(-1, 1, (6, 5))
    twin = Twin(robot).postures(q)
    model = joint_loads(robot, q.T)
    for k, posture in enumerate(twin):
        about = [5, *range(3)] if convention.name in ("urdf", "zero-reference", "product-of-exponentials") else range(6)
        for i in range(5):
            if about == range(6):
                assert_allclose(model[i, :, k], posture.loads[i], rtol=0, atol=1e-8)
            assert np.linalg.norm(model[i, :3, k]) == pytest.approx(np.linalg.norm(posture.loads[i, :3]), abs=1e-8)
            assert np.linalg.norm(model[i, 3:, k]) == pytest.approx(np.linalg.norm(posture.loads[i, 3:]), abs=1e-8)
            assert model[i, 5, k] == pytest.approx(posture.loads[i, 5], abs=1e-8)


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


def test_spring_of_the_large_arm_relieves_joint_2_alone(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    bare = replace(robot, balancers=())
    q = robot.random_configurations(100, np.random.default_rng(3)).T
    with_it, without = joint_loads(robot, q), joint_loads(bare, q)
    assert np.abs(with_it[1, 5]).max() < 0.5 * np.abs(without[1, 5]).max()
    others = [i for i in range(6) if i != 1]
    assert_allclose(with_it[others], without[others], rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", CONVERSIONS)
def test_conversions_move_anchors_along(tmp_path: Path, name: str) -> None:
    robot = arm(tmp_path).with_effects(["compliance", "balancer"])
    second = Balancer("second", Anchor(0, (1.0, 0.0, 1.0)), Anchor(1, (1.0, 1.0, 0.0)), 900.0, 1.0, 900.0)
    robot = replace(robot, balancers=(*robot.balancers, second))
    robot = robot.with_values({"compliance_2": 1e-6, "balancer_1": 0.9, "d_2": 0.01, "d_3": 0.02})
    made = converted(robot, name)
    q = robot.random_configurations(5, np.random.default_rng(4))
    if made.masses:
        for actual, expected in zip(made.world_poses(q), robot.world_poses(q), strict=True):
            assert_allclose(actual, expected, rtol=0, atol=1e-10)
    assert made.values["balancer_1"] == 0.9


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
    assert any("cannot hold balancers; left out: spring" in said for said in exported(robot, "urdf").left_out)
    assert not any("balancers" in said for said in exported(robot, "python").left_out)
    (held,) = json.loads(exported(robot, "json").text)["balancers"]
    assert (held["name"], held["fixed"]["link"], held["stiffness"]) == ("spring", 1, 40e3)


ENTRY = "fixed: {link: 1, point: [320, 150, -700]}, moving: {link: 2, point: [-250, 0, 150]}"


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        pytest.param("link: 2, point: [-250", "link: 9, point: [-250", ["moving.link", "no such link", "9"], id="link"),
        pytest.param("{link: 1,", "{link: -1,", ["fixed.link", "no such link", "to 6"], id="below the base"),
        pytest.param("{link: 1,", "{link: 2,", ["both anchors are on one link", "holds two links"], id="one link"),
        pytest.param("{link: 1,", "{link: 3,", ["farther from the base", "Exchange"], id="exchanged"),
        pytest.param("[-250, 0, 150]", "[0, 0, 150]", ["moving.point", "lies on the axis"], id="on the axis"),
        pytest.param(
            "[320, 150, -700]", "[320, 150, -0.5]", ["fixed.point", "lies on the axis", "0.5 mm"], id="fixed on axis"
        ),
        pytest.param("[-250, 0, 150]", "[-700, 0, 150]", ["one point in some posture", "drawing"], id="one point"),
        pytest.param(PULL, "stiffness: 40", ["how hard", "none of them", "free_length"], id="no force"),
        pytest.param(PULL, PULL + ", free_length: 3", ["says it twice", "free_length, length"], id="twice"),
        pytest.param(PULL, "length: 450, pressure: 3, stiffness: 40", ["how hard", "area"], id="no area"),
        pytest.param(PULL, "length: 0, force: 3, stiffness: 4", ["length", "too small"], id="no length"),
        pytest.param(PULL, "free_length: 450, stiffness: -4", ["stiffness", "too small"], id="negative stiffness"),
        pytest.param(PULL, "free_length: 450, stiffness: 0", ["never pulls"], id="no spring"),
        pytest.param(PULL, "length: 450, force: 1e9, stiffness: 4", ["so strong", "in N"], id="absurd force"),
        pytest.param(PULL, "length: 450, force: .nan, stiffness: 4", ["force", "not a number"], id="nan"),
        pytest.param(PULL, PULL + ", colour: red", ["colour", "not known here"], id="unknown entry"),
    ],
)
def test_balancer_that_cannot_be_is_refused(tmp_path: Path, old: str, new: str, parts: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        arm(tmp_path, ARM.replace("PULL", PULL).replace(old, new, 1))
    for part in ("balancers[1]", *parts):
        assert part in str(caught.value)


def test_two_balancers_of_one_name_are_refused(tmp_path: Path) -> None:
    text = ARM.replace("PULL", PULL)
    twice = text + text.splitlines(keepends=True)[-1]
    with pytest.raises(InputError, match=r"balancers\[2\].*same name; got 'spring'.*balancers\[1\] has it too"):
        arm(tmp_path, twice)
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
