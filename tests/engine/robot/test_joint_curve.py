"""The curve of a joint: its waves, its sum, its lines in a robot file, and its inverse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from tests.engine.robot.refusing import refused

from truearm.engine.robot.effects.effect import LinearEffect
from truearm.engine.robot.effects.joint_curve import HIGHEST, JointCurve, curve_names, curve_waves
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text


def curved(seed: int, size: float = 1e-4, joints: tuple[int, ...] = (1, 2, 5)) -> Robot:
    rng = np.random.default_rng(seed)
    robot = load_robot("irb120").with_effects(["joint-curve"])
    names = [name for number in joints for name in curve_names(number)]
    return robot.with_parameters(
        replace(
            robot.parameters[name],
            value=size * rng.normal() / (1 + n // 2),
            prior=float(rng.uniform(1e-6, 1e-4)),
            deviation=float(rng.uniform(1e-7, 1e-5)),
            informed=float(rng.uniform()),
        )
        for n, name in enumerate(names)
    )


@given(st.floats(-50.0, 50.0), st.integers(1, 200))
def test_waves_are_sines_and_cosines(angle: float, highest: int) -> None:
    waves = curve_waves(np.array([angle]), highest)[:, 0]
    k = np.arange(1, highest + 1)
    assert_allclose(waves[0::2], np.sin(k * angle), atol=1e-12 + 1e-16 * highest * abs(angle) * 8)
    assert_allclose(waves[1::2], np.cos(k * angle), atol=1e-12 + 1e-16 * highest * abs(angle) * 8)


def test_the_sum_is_that_of_parameters_times_shapes() -> None:
    robot, rng = curved(1), np.random.default_rng(2)
    effect = robot.effects[0]
    assert isinstance(effect, JointCurve)
    for count in (0, 1, 7, 5000):
        at = Postures(robot.random_configurations(count, rng))
        plain = LinearEffect.deflection(effect, at, robot.values)
        for joint, part in effect.deflection(at, robot.values).items():
            assert part.shape == (count,)
            assert_allclose(part, plain[joint], rtol=0, atol=1e-17 * 120 + 1e-15)
    trials = {name: value * rng.normal(size=(3, 1)) for name, value in robot.values.items()}
    moved = effect.deflection(at, trials)
    assert sorted(moved) == [0, 1, 4]
    for number in range(3):
        one = effect.deflection(at, {name: float(value[number, 0]) for name, value in trials.items()})
        for joint, part in moved.items():
            assert_allclose(part[number], one[joint], rtol=0, atol=1e-15)


def test_forward_of_inverse_is_the_pose() -> None:
    robot = curved(3, 1e-3).with_effects(["compliance"]).with_values({"compliance_2": 1e-5})
    q = robot.random_configurations(200, np.random.default_rng(4))
    p, R = robot.world_poses(q)
    assert np.abs(p - robot.rigid.world_poses(q)[0]).max() > 1e-4
    found = inverse(robot, p, R, frame="world", seed=q)
    assert found.complete
    assert np.abs(robot.world_poses(found.joints)[0] - p).max() < 1e-9
    regular = found.singular_value > 0.05
    assert regular.sum() > 90
    assert np.abs(found.joints - q)[regular].max() < 1e-9


def test_a_file_holds_a_curve_in_a_few_lines(tmp_path: Path) -> None:
    robot = curved(5)
    one = replace(robot.parameters["curve_sin7_5"], nominal=1e-6)
    for given_robot in (robot, robot.with_parameters([one])):
        text = robot_text(given_robot)
        path = tmp_path / "robot.yaml"
        path.write_text(text)
        again = read_robot(path)
        assert again.known.keys() == given_robot.known.keys()
        for name, p in given_robot.known.items():
            for field in ("nominal", "value", "prior", "deviation"):
                assert getattr(again.known[name], field) == pytest.approx(getattr(p, field), rel=1e-15)
            assert again.known[name].informed == p.informed
        assert robot_text(again) == text
        assert text.count("\n") < robot_text(load_robot("irb120")).count("\n") + 30


def test_terms_that_are_known_differently_stand_one_by_one(tmp_path: Path) -> None:
    robot = curved(6, joints=(1,))
    robot = robot.with_parameters([replace(robot.parameters["curve_cos9_1"], deviation=None)])
    path = tmp_path / "robot.yaml"
    path.write_text(robot_text(robot))
    assert "joint_curves" not in path.read_text()
    assert read_robot(path).known["curve_cos9_1"].deviation is None


ENTRY = '\njoint_curves:\n  - {joint: 2, terms: "sin1 cos3", value: "0.01 0.02", prior: "0.1 0.1"}\n'


def small_file(change: Callable[[str], str]) -> str:
    text = robot_text(load_robot("irb120").with_effects(["joint-curve"]))
    return change(text + ENTRY)


def test_a_curve_may_be_written_by_hand(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(small_file(str))
    robot = read_robot(tmp_path / "robot.yaml")
    q = np.array([[0.0, 0.4, 0.0, 0.0, 0.0, 0.0]])
    expected = np.radians(0.01 * np.sin(0.4) + 0.02 * np.cos(1.2))
    assert robot.variables(q, robot.values)[1, 0] - 0.4 == pytest.approx(expected, rel=1e-12)
    assert_array_equal(robot.variables(q, robot.values)[[0, 2, 3, 4, 5], 0], 0.0)


SINGLE = "parameters: {curve_sin1_2: {unit: deg, nominal: 0, value: VALUE, prior: 1, informed: SHARE}}\n"


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("  - joint-curve\n", "  - gain\n", ["joint_curves[1]", "Add the joint effect joint-curve"]),
        ("joint: 2", "joint: 7", [".joint", "allowed: 1, 2, 3, 4, 5, 6"]),
        ("sin1 cos3", "sin1 cos61", [".terms", f"cos{HIGHEST}"]),
        ("sin1 cos3", "sin1 sin1", [".terms", "twice"]),
        ("0.01 0.02", "0.01", [".value", "one for each term"]),
        ("0.01 0.02", "0.01 nan", [".value"]),
        ("0.01 0.02", "0.01 x", [".value"]),
        ("0.1 0.1", "0.1 -0.1", [".prior", "0 or more"]),
        ("0.1 0.1", "0.1 0.0", [".prior"]),
        ("0.01 0.02", "0.01 -1000", [".value", "allowed: 30 deg or less"]),
        ("0.1 0.1", "0.1 31", [".prior", "too large for a curve"]),
        ('"0.1 0.1"', '"0.1 0.1", nominal: "99 0"', [".nominal", "got '99 deg'"]),
        ('"0.1 0.1"', '"0.1 0.1", informed: "0.5 2"', [".informed", "allowed: 0 to 1"]),
        ('"0.1 0.1"', '"0.1 0.1", informed: "-0.5 1"', [".informed", "got '-0.5'"]),
        (ENTRY, "\n" + SINGLE.replace("VALUE", "31"), ["curve_sin1_2.value", "too large for a curve"]),
        (ENTRY, "\n" + SINGLE.replace("SHARE", "2"), ["curve_sin1_2.informed", "too large"]),
        (ENTRY, ENTRY + SINGLE, ["the parameter stands in joint_curves too; got 'curve_sin1_2'"]),
    ],
)
def test_a_wrong_entry_is_refused(tmp_path: Path, old: str, new: str, told: list[str]) -> None:
    text = small_file(lambda text: text.replace(old, new)).replace("VALUE", "0").replace("SHARE", "0.9")
    (tmp_path / "robot.yaml").write_text(text)
    with refused(*told):
        read_robot(tmp_path / "robot.yaml")


def test_a_term_may_stand_alone(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(
        small_file(lambda text: text.replace(ENTRY, "\n" + SINGLE.replace("VALUE", "0.1").replace("SHARE", "0.9")))
    )
    assert read_robot(tmp_path / "robot.yaml").parameters["curve_sin1_2"].informed == 0.9
