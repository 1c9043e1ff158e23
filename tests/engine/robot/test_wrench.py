"""A force and a moment at the tool: how they are given, what they do to the joints, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.engine.robot.refusing import refused
from tests.engine.robot.test_chain import random_frame, random_robot
from tests.pinocchio_oracle import PinocchioChain

from truearm import InputError
from truearm.engine.robot.chain import Array, Chain
from truearm.engine.robot.conventions import CONVENTIONS
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.loads import joint_efforts
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.seal import is_intact
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform
from truearm.engine.robot.wrench import WRENCH_FRAMES, Wrench, WrenchFrame
from truearm.engine.twin.twin import Twin, measure, with_wrench_read
from truearm.engine.twin.twin_joint import JointTruth
from truearm.robot_files.jobs import export

FORCE, MOMENT = (11.0, -7.0, 5.0), (0.6, -0.8, 1.1)


def drawn_place(rng: np.random.Generator) -> Transform:
    """A tool that leans, some 0.2 m from the flange."""
    frame = random_frame(rng)
    return Transform((0.05, -0.03, 0.18), frame.quaternion)


def springy(name: str, rng: np.random.Generator) -> tuple[Robot, Twin]:
    """A robot anywhere, all of whose joints give way, as a model and as a twin; turning ones about z lean, too."""
    robot = load_robot(name)
    robot = replace(robot.with_frames(random_frame(rng), {"tip": (0.03, 0.02, 0.1)}), rated_load=None)
    robot = robot.with_payload("0.5kg,10mm,20mm,60mm")
    truths = {i: JointTruth(compliance=c) for i, c in enumerate(rng.uniform(1e-5, 2e-4, len(robot.joints)), 1)}
    made = robot.with_effects(["compliance"])
    return made.with_values({f"compliance_{i}": t.compliance for i, t in truths.items()}), Twin(robot, truths)


# -- how it is given -------------------------------------------------------------------------------------


def test_a_text_is_in_newtons_or_in_the_units_it_says() -> None:
    for text, force, moment in (
        ("1,2,3,4,5,6", (1, 2, 3), (4, 5, 6)),
        (" 0 , -8e1, +3 ,0,0, 1.5", (0, -80, 3), (0, 0, 1.5)),
        ("1N,0.2kN,0N,1Nm,2 N m,30N mm", (1, 200, 0), (1, 2, 0.03)),
        ("0lbf,0,1lbf,0,0,500Nmm", (0, 0, 4.4482216152605), (0, 0, 0.5)),
    ):
        read = Wrench.of(text, "tool")
        assert (*read.force, *read.moment) == pytest.approx((*force, *moment)), text
        assert Wrench.of(read.text, "tool") == read
        assert Wrench.of([*force, *moment]) == replace(read, frame="base")


def test_what_is_no_wrench_is_refused() -> None:
    wrong: list[tuple[object, str]] = [
        ("1,2,3,4,5", "three forces and three moments belong here"),
        ("1,2,3,4,5,6,7", "three forces and three moments belong here"),
        ("1,2,nan,4,5,6", "a number belongs here; got 'nan'"),
        ("1,2,,4,5,6", "a number belongs here; got ''"),
        (
            "1,2,3kg,4,5,6",
            "this is no unit of a force; got '3kg'; allowed: N, kN, lbf",
        ),
        ("1,2,3,4,5,6N", "this is no unit of a moment; got '6N'; allowed: N m, Nm, N mm, Nmm"),
        ("1,2,3Nm,4,5,6", "this is no unit of a force"),
        ("1,2,3e9,4,5,6", "too large to be plausible"),
        ([1, 2, 3, 4, 5], "wrong shape"),
        ([1, 2, 3, 4, 5, math.inf], "NaN and infinity cannot be used"),
        (80, "a wrench belongs here"),
    ]
    for given, said in wrong:
        with refused(said, parameter="wrench", of=given):
            Wrench.of(given)
    with refused("no frame of this name", "allowed: base, tool, world, controller"):
        Wrench(FORCE, MOMENT, "tol")  # type: ignore[arg-type]


# -- by hand ---------------------------------------------------------------------------------------------


def test_a_sideways_force_turns_the_first_joint() -> None:
    """An IRB 120 stretched out to the front: the tip is r from axis 1, and F along y turns it by C F r cos(turn)."""
    compliance = 2e-4
    robot = load_robot("irb120").with_effects(["compliance"]).with_values({"compliance_1": compliance})
    tool = Transform((0.0, 0.0, 0.126))
    r = 0.302 + 0.072 + 0.126  # forearm, wrist and tool; the upper arm is upright
    for force in (0.0, 25.0, -29.0):
        turn = 0.0
        for _ in range(20):
            turn = compliance * force * r * math.cos(turn)
        pushed = robot.with_wrench(Wrench((0.0, force, 0.0)), tool)
        (position,), (rotation,) = pushed.forward(np.zeros((1, 6)))
        tip = position + rotation @ np.array(tool.translation)
        assert_allclose(tip, [r * math.cos(turn), r * math.sin(turn), 0.63], atol=1e-12)
        assert_allclose(joint_efforts(pushed, np.zeros((1, 6)))[0, 0], force * r * math.cos(turn), atol=1e-12)


# -- against Pinocchio and the twin ----------------------------------------------------------------------


@pytest.mark.parametrize("frame", WRENCH_FRAMES)
@pytest.mark.parametrize("name", ["irb120", "katana450", "ur5", "sliding"])
def test_joints_carry_the_transposed_jacobian_times_the_wrench(name: str, frame: WrenchFrame) -> None:
    rng = np.random.default_rng(3)
    if name == "sliding":
        robot = random_robot(CONVENTIONS[0], (), rng, ("revolute", "prismatic", "revolute", "prismatic"))
        robot = replace(robot, controller=replace(robot.controller, base=drawn_place(rng)))
    else:
        robot = load_robot(name)
    robot = replace(robot.with_frames(random_frame(rng), {}), rated_load=None)
    if frame == "controller" and name == "katana450":
        with pytest.raises(InputError, match="not known where the controller of katana450 has its frames"):
            robot.with_wrench(Wrench(FORCE, MOMENT, frame))
        return
    tool, q = drawn_place(rng), robot.random_configurations(5, rng)
    pushed = robot.with_wrench(Wrench(FORCE, MOMENT, frame), tool)
    added = joint_efforts(pushed, q) - joint_efforts(robot, q)
    oracle = PinocchioChain(Chain(robot.arm.elements), robot.values)  # its world is the robot's base
    for row, joints in zip(added, q, strict=True):
        position, R, jacobian = oracle.tip(joints)
        axes = {
            "base": np.eye(3),
            "tool": R @ tool.rotation,
            "world": robot.base.rotation.T,
            "controller": robot.controller.base.rotation,
        }[frame]
        force, moment = axes @ FORCE, axes @ MOMENT
        moment = moment + np.cross(R @ np.array(tool.translation), force)
        assert np.isfinite(position).all()
        assert_allclose(row, jacobian.T @ np.concatenate([force, moment]), atol=1e-10)


@pytest.mark.parametrize("name", ["irb120", "katana450", "puma560"])
def test_the_arm_bends_as_the_twin_does(name: str) -> None:
    frames: tuple[WrenchFrame, ...] = ("base", "tool", "world")
    for frame in frames:
        rng = np.random.default_rng(4)
        model, twin = springy(name, rng)
        tool, q = drawn_place(rng), model.random_configurations(8, rng)
        wrench = Wrench(FORCE, MOMENT, frame)
        found = replace(twin, robot=twin.robot.with_wrench(wrench, tool)).frames(q)["tip"]
        position, rotation = model.with_wrench(wrench, tool).world_poses(q, "tip")
        assert_allclose(found[:, :3, 3], position, rtol=0, atol=1e-9, err_msg=frame)
        assert_allclose(found[:, :3, :3], rotation, rtol=0, atol=1e-9, err_msg=frame)
        assert np.linalg.norm(position - model.world_poses(q, "tip")[0], axis=1).min() > 1e-5


def test_the_data_say_what_acts_on_the_flange() -> None:
    """The model that is told of the flange bends as the one that is told of the tool."""
    for frame in WRENCH_FRAMES:
        rng = np.random.default_rng(5)
        model, twin = springy("irb120", rng)
        wrench = Wrench(FORCE, MOMENT, frame)
        pushed = replace(twin, robot=twin.robot.with_wrench(wrench, "tip"))
        data = with_wrench_read(pushed, measure(pushed, model.random_configurations(6, rng), 0.0, rng))
        assert data.wrench is not None
        at_flange = model.world_poses(data.postures, "tip")[0]
        assert_allclose(at_flange, data.position, atol=1e-9, err_msg=frame)
        assert_allclose(at_flange, model.with_wrench(wrench, "tip").world_poses(data.joints, "tip")[0], atol=1e-9)


# -- inverse kinematics ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["irb120", "ur5"])
def test_poses_are_reached_under_the_force(name: str) -> None:
    frames: tuple[WrenchFrame, ...] = ("base", "tool", "world")
    for frame in frames:
        rng = np.random.default_rng(6)
        model, _ = springy(name, rng)
        pushed = model.with_wrench(Wrench(FORCE, MOMENT, frame), "tip")
        q = rng.uniform(-1.0, 1.0, (6, 6))
        wanted = model.forward(q, target="tip")
        found = pushed.inverse(*wanted, target="tip", seed=q)
        assert found.complete
        for own, pose in zip(pushed.forward(found.joints, target="tip"), wanted, strict=True):
            assert np.abs(own - pose).max() < 2e-9, frame
        assert np.abs(found.joints - q).max() > 1e-5


def test_the_jacobian_is_the_derivative_under_the_force() -> None:
    model, _ = springy("irb120", np.random.default_rng(7))
    pushed = model.with_wrench(Wrench(FORCE, MOMENT, "tool"), "tip")
    q, step = np.full((1, 6), 0.3), 1e-4
    ahead, behind = (pushed.forward(q + way * step * np.eye(6), target="tip")[0] for way in (1, -1))
    assert_allclose(pushed.jacobian(q, target="tip")[0, :3], (ahead - behind).T / (2 * step), atol=1e-7)


# -- what the arm is rated for, and files ----------------------------------------------------------------


def test_more_than_the_rated_load_is_refused() -> None:
    robot = load_robot("irb120")
    assert robot.rated_load == 3.0
    assert robot.with_wrench(Wrench((0.0, 29.4, 0.0))).wrench is not None
    with refused("force is larger than irb120 is rated for; got '29.5 N'", "29.42 N"):
        robot.with_wrench(Wrench((0.0, 29.5, 0.0)))
    with refused("moment is larger than irb120 is rated for; got '40 N m'"):
        robot.with_wrench(Wrench((0.0, 0.0, 0.0), (0.0, 0.0, 40.0)))
    unknown = replace(robot, rated_load=None)
    assert unknown.with_wrench(Wrench((0.0, 500.0, 0.0))).wrench is not None


def test_nothing_is_taken_away_by_none_or_zero() -> None:
    robot = load_robot("irb120").with_wrench(Wrench((0.0, 5.0, 0.0)))
    assert robot.with_wrench(None).wrench is None
    assert robot.with_wrench(Wrench()).wrench is None
    assert "wrench at the tool: 0N,5N,0N,0Nm,0Nm,0Nm, base" in repr(robot)
    with pytest.raises(InputError, match="a wrench belongs here"):
        robot.with_wrench("0,5,0,0,0,0")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="no target of this name"):
        robot.with_wrench(Wrench((0.0, 5.0, 0.0)), "tip")


def test_no_file_holds_what_acts_on_the_tool() -> None:
    robot = load_robot("irb120").with_wrench(Wrench((0.0, 5.0, 0.0)))
    for written in (robot_text, lambda robot: export(robot, "json")):
        with refused("no file of a robot holds an external force"):
            written(robot)


def test_the_rated_load_is_in_the_file_and_says_nothing_of_the_arm(tmp_path: Path, calibrated: Robot) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(robot_text(calibrated))
    assert "rated_load: 3" in file.read_text()
    again = read_robot(file)
    assert again.rated_load == 3.0
    assert is_intact(again)
    assert is_intact(replace(again, rated_load=4.0))
    assert is_intact(again.with_wrench(Wrench((0.0, 5.0, 0.0))))
    for text in ("rated_load: 0", "rated_load: 3kg", "rated_load: -2"):
        file.write_text(robot_text(load_robot("irb120")).replace("rated_load: 3.0", text))
        with pytest.raises(InputError, match="rated_load"):
            read_robot(file)


@pytest.fixture(scope="module")
def calibrated() -> Robot:
    from tests.simulated import campaign

    from truearm.calibration.calibrate import calibrate

    return calibrate("irb120", campaign("irb120", 20, 0.05e-3, 1)[1], model="offsets").robot


def test_a_calibration_keeps_what_loaded_its_joints(tmp_path: Path, calibrated: Robot) -> None:
    assert calibrated.proof is not None
    loads: Array = np.array(calibrated.proof.loads)
    assert loads.shape == (6, 2)
    assert_allclose(loads[0], 0.0, atol=1e-9)  # gravity never turns the upright axis
    assert loads[1, 1] - loads[1, 0] > 5.0
    text = robot_text(calibrated)
    file = tmp_path / "robot.yaml"
    file.write_text(text)
    again = read_robot(file)
    assert again.proof is not None
    assert again.proof.loads == calibrated.proof.loads
    assert robot_text(again) == text
    row = next(line for line in text.splitlines() if line.startswith("  loads:") or "loads:" in line)
    file.write_text(text.replace(row, "  loads:\n    - [0.0, 1.0]"))
    with pytest.raises(InputError, match="one entry belongs here for each joint"):
        read_robot(file)
