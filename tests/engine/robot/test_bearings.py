"""Where bearings lie: the document's moments, and what identified slides must not change."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.loads import joint_loads
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.twin.truths import joint_truths
from truearm.engine.twin.twin import Twin

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


@pytest.mark.parametrize(
    ("robot_id", "one", "other", "sign"),
    [
        ("katana450", "d_2", "d_3", 1.0),
        ("katana450", "d_3", "d_4", 1.0),
        ("irb120", "d_2", "d_3", 1.0),
        ("ur5", "d_2", "d_4", 1.0),
        ("kr5", "y_2", "z_3", -1.0),
    ],
)
def test_shifting_one_slide_against_a_parallel_one_leaves_moments_and_tip(
    robot_id: str, one: str, other: str, sign: float
) -> None:
    robot = tilting(robot_id)
    shift = 0.02
    v = robot.values
    shifted = robot.with_values({one: v[one] + shift, other: v[other] - sign * shift})
    q = robot.random_configurations(50, np.random.default_rng(1))
    assert_allclose(shifted.loaded(q).joint_loads, robot.loaded(q).joint_loads, rtol=0, atol=1e-10)
    assert_allclose(shifted.world_poses(q, "tip")[0], robot.world_poses(q, "tip")[0], rtol=0, atol=1e-12)


def test_slide_of_the_last_joint_shifted_against_the_tool_leaves_bearings() -> None:
    """The payload hangs on the flange and goes with it; without one nothing feels the shift."""
    robot = tilting("irb120").with_payload("0kg,0mm,0mm,0mm")
    shifted = robot.with_values({"d_6": robot.values["d_6"] + 0.02, "target_tip_z": 0.1 - 0.02})
    q = robot.random_configurations(20, np.random.default_rng(2))
    assert shifted.bearings == robot.bearings
    assert_allclose(shifted.loaded(q).joint_loads, robot.loaded(q).joint_loads, rtol=0, atol=1e-12)
    assert_allclose(shifted.world_poses(q, "tip")[0], robot.world_poses(q, "tip")[0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("robot_id", ["katana450", "kr5", "ur5"])
def test_twin_knows_bearings_of_a_robot_that_is_off(robot_id: str) -> None:
    rng = np.random.default_rng(3)
    robot = tilting(robot_id)
    steps = {"m": 3e-3, "rad": 1e-3}
    off = {n: p.value + steps[p.unit] * rng.normal() for n, p in robot.parameters.items() if p.group == "geometry"}
    robot = robot.with_values(off)
    assert any(robot.bearings[i] != robot.joints[i].bearing for i in range(len(robot.joints)))
    q = robot.random_configurations(15, rng)
    frames = Twin(robot, joint_truths(robot)).frames(q)["tip"]
    assert_allclose(robot.world_poses(q, "tip")[0], frames[:, :3, 3], rtol=0, atol=1e-10)


@pytest.mark.parametrize("robot_id", ["katana450", "kr5"])
def test_derivatives_by_exchangeable_slides_are_exact(robot_id: str) -> None:
    robot = tilting(robot_id)
    robot = robot.with_values({n: v + 0.01 for n, v in robot.values.items() if n in ("d_2", "d_3", "y_2", "z_3")})
    at = robot.loaded(robot.random_configurations(10, np.random.default_rng(4)))
    names = [n for n, p in robot.parameters.items() if p.group == "geometry"]
    found = robot.position_jacobian(robot.forward_kinematics(at, "tip"), at, names)

    def position(values: dict[str, float]) -> Array:
        return robot.forward_kinematics(at, "tip", {**robot.values, **values}).position

    for row, name in zip(found, names, strict=True):
        step = 1e-5
        ahead, back = (position({name: robot.values[name] + s * step}) for s in (1.0, -1.0))
        assert_allclose(row, (ahead - back) / (2 * step), rtol=0, atol=1e-8)


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


FILE = """truearm: truearm-robot/1
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
        ("soon", "", ["joints[1].bearing", "a number belongs here", "soon"]),
        (".nan", "", ["joints[1].bearing", "not a number"]),
        ("1e12", "", ["joints[1].bearing", "too large"]),
        ("5", ", bearing: 3", ["joints[2].bearing", "slides has no bearing", "Take the entry out"]),
    ],
)
def test_bearing_that_cannot_be_is_refused(tmp_path: Path, bearing: str, sliding: str, parts: list[str]) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(FILE.replace("BEARING", bearing).replace("SLIDING", sliding))
    with pytest.raises(InputError) as caught:
        read_robot(path)
    for part in parts:
        assert part in str(caught.value)


def test_moment_across_a_joint_follows_its_bearing() -> None:
    """A level axis along y with 2 kg at its end, 0.3 m along it: the lever to the bearing counts."""
    row = {"alpha": -math.pi / 2, "a": 0.0, "theta_offset": 0.0, "d": 0.3}
    for bearing, lever in ((None, 0.3), (0.1, 0.2), (0.3, 0.0), (0.5, -0.2)):
        robot = Robot(
            name="lever",
            title="lever",
            source="made up",
            convention_name="modified-dh",
            joints=(Joint("swing", "revolute", row, bearing=bearing),),
        ).with_payload("2kg,0mm,0mm,0mm")
        assert_allclose(joint_loads(robot, np.zeros((1, 1)))[0, 3:, 0], [-2.0 * G * lever, 0, 0], rtol=0, atol=1e-12)
