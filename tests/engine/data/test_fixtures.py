"""Fixtures: where they stand, by 4x4 matrices multiplied here; what a robot file keeps of them and what it refuses."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from ruamel.yaml import YAML
from tests.expecting import refusing

from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Fixture, FixtureKind
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform

TURNED = (math.cos(0.4), math.sin(0.4) * 0.6, 0.0, math.sin(0.4) * 0.8)
IRB120 = load_robot("irb120")
PLACE = Transform((0.4, -0.3, 0.2), TURNED)


def slide(axis: int, way: float) -> Array:
    T = np.eye(4)
    T[axis, 3] = way
    return T


def turn(axis: int, angle: float) -> Array:
    T, (i, j) = np.eye(4), [(1, 2), (2, 0), (0, 1)][axis]
    T[i, i] = T[j, j] = math.cos(angle)
    T[j, i], T[i, j] = math.sin(angle), -math.sin(angle)
    return T


def fixed(q: tuple[float, float, float, float]) -> Array:
    T = np.eye(4)
    w, v = q[0], np.array(q[1:])
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    T[:3, :3] = (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * cross
    return T


def product(*parts: Array) -> Array:
    T = np.eye(4)
    for part in parts:
        T = T @ part
    return T


def beside(kind: FixtureKind, place: Transform = PLACE, name: str = "table") -> Robot:
    return IRB120.with_fixtures({name: (kind, place)})


def matrix_of(robot: Robot, name: str) -> Array:
    kinematics = robot.fixture_kinematics(name)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = kinematics.matrix()[0], kinematics.position[:, 0]
    return T


MOVES = {"x": 0.01, "y": -0.02, "z": 0.03, "rx": 0.04, "ry": -0.05, "rz": 0.06}


def moved(robot: Robot, name: str) -> Robot:
    fixture = robot.fixture(name)
    there = {fixture.parameter(axis): by for axis, by in MOVES.items()}
    values = robot.values
    return robot.with_values({n: values[n] + by for n, by in there.items() if n in values})


def test_a_point_stands_where_it_was_put_and_has_three_parameters() -> None:
    robot = beside("point")
    assert [p.name for p in robot.parameters.values() if p.group == "fixture"] == [
        "fixture_table_x", "fixture_table_y", "fixture_table_z"
    ]  # fmt: skip
    assert matrix_of(moved(robot, "table"), "table")[:3, 3] == pytest.approx([0.41, -0.32, 0.23], abs=1e-15)


def test_a_frame_slides_and_then_turns() -> None:
    robot = moved(beside("frame"), "table")
    assert len([p for p in robot.parameters.values() if p.group == "fixture"]) == 6
    x, y, z, rx, ry, rz = MOVES.values()
    expected = product(
        slide(0, 0.4 + x), slide(1, -0.3 + y), slide(2, 0.2 + z), fixed(TURNED), turn(0, rx), turn(1, ry), turn(2, rz)
    )
    np.testing.assert_allclose(matrix_of(robot, "table"), expected, atol=1e-15)


def test_a_plane_is_two_turns_and_a_distance_along_its_normal() -> None:
    T = matrix_of(beside("plane"), "table")
    assert (np.array(PLACE.translation) - T[:3, 3]) @ T[:3, 2] == pytest.approx(0.0, abs=1e-15)  # its place is in it
    robot = moved(beside("plane"), "table")
    own = ["fixture_table_rx", "fixture_table_ry", "fixture_table_z"]
    assert [p.name for p in robot.parameters.values() if p.group == "fixture"] == own
    away = float(fixed(TURNED)[:3, 2] @ np.array(PLACE.translation))
    expected = product(fixed(TURNED), turn(0, MOVES["rx"]), turn(1, MOVES["ry"]), slide(2, away + MOVES["z"]))
    np.testing.assert_allclose(matrix_of(robot, "table"), expected, atol=1e-15)


def test_many_trials_at_once_are_each_alone() -> None:
    for kind in get_args(FixtureKind):
        robot, rng = beside(kind), np.random.default_rng(0)
        own = {n: v for n, v in robot.values.items() if n.startswith("fixture_")}
        trials = {n: v + 0.05 * rng.standard_normal((4, 1)) for n, v in own.items()}
        together = robot.fixture_kinematics("table", {**robot.values, **trials})
        assert together.position.shape == (3, 4, 1)
        for k in range(4):
            trial = {n: float(v[k, 0]) for n, v in trials.items()}
            alone = robot.fixture_kinematics("table", {**robot.values, **trial})
            np.testing.assert_allclose(together.position[:, k], alone.position, atol=1e-15, err_msg=kind)


def test_other_fixtures_take_the_place_of_those_before_and_forget_their_values() -> None:
    robot = moved(beside("frame"), "table")
    again = robot.with_fixtures({"table": ("frame", PLACE), "wall": ("plane", Transform())})
    assert [f.name for f in again.fixtures] == ["table", "wall"]
    assert again.values["fixture_table_rx"] == 0.0
    assert again.values["fixture_table_x"] == 0.4
    assert dict(robot.with_fixtures({}).values) == dict(IRB120.values)


def test_a_fixture_called_fixture_is_not_called_so_twice_and_may_share_a_targets_name() -> None:
    assert Fixture("fixture_7", "point").parameter("x") == "fixture_7_x"
    assert Fixture("7", "point").parameter("x") == "fixture_7_x"
    robot = IRB120.with_frames(Transform(), {"ball": (0.0, 0.0, 0.1)}).with_fixtures({"ball": ("point", PLACE)})
    assert {"target_ball_x", "fixture_ball_x"} <= set(robot.parameters)


def test_an_unknown_fixture_and_two_of_one_name_are_refused() -> None:
    for name in ("tabel", "wall"):
        with refusing(f"no fixture of this name; got '{name}'; allowed: table"):
            beside("plane").fixture_kinematics(name)
    with refusing("none: the robot has no fixtures"):
        IRB120.fixture("wall")
    with refusing("fixture_7_x: two parameters ", "same name", "Rename the target or fixture"):
        IRB120.with_fixtures({"7": ("point", PLACE), "fixture_7": ("point", PLACE)})


# -- robot files -----------------------------------------------------------------------------------------


def reread(robot: Robot, folder: Path) -> Robot:
    path = folder / "robot.yaml"
    path.write_text(robot_text(robot), encoding="utf-8")
    return read_robot(path)


#: As data may call them: any one line of text.
NAMES = ("table", "7", "the left cup", "Größe: [x]", "yes", "'quoted'", "# no comment", "fixture", "null")


@pytest.mark.parametrize("kind", get_args(FixtureKind))
def test_a_robot_file_keeps_fixtures_and_what_was_identified_of_them(tmp_path: Path, kind: FixtureKind) -> None:
    robot = IRB120.with_fixtures(dict.fromkeys(NAMES, (kind, PLACE)))
    for name in NAMES:
        robot = moved(robot, name)
    z = replace(robot.parameters["fixture_table_z"], value=0.123, deviation=2e-6, informed=0.99)
    robot = robot.with_parameters([z])
    again = reread(robot, tmp_path)
    assert [(f.name, f.kind) for f in again.fixtures] == [(name, kind) for name in NAMES]
    assert again.values == pytest.approx(robot.values, rel=1e-14, abs=1e-18)
    found = again.parameters["fixture_table_z"]
    assert (found.deviation, found.informed) == pytest.approx((2e-6, 0.99), rel=1e-14)
    for name in NAMES:
        np.testing.assert_allclose(matrix_of(again, name), matrix_of(robot, name), atol=1e-14)
    assert robot_text(again) == robot_text(robot)


def test_a_robot_file_refuses_what_is_no_fixture(tmp_path: Path) -> None:
    changes: list[tuple[dict[str, object], list[str]]] = [
        ({"kind": "line"}, ["kind", "allowed: point, plane, frame"]),
        ({"kind": None}, ["kind"]),
        ({"quaternion": [1.0, 1.0, 0.0, 0.0]}, ["quaternion", "length 1"]),
        ({"name": ""}, ["name", "one line"]),
        ({"name": "two\nlines"}, ["name", "one line"]),
        ({"place": [0, 0, 0]}, ["place"]),
    ]
    path = tmp_path / "robot.yaml"
    text = robot_text(beside("plane"))
    for changed, said in changes:
        content = YAML(typ="safe").load(text)
        content["fixtures"][0] |= changed
        content["fixtures"][0] = {k: v for k, v in content["fixtures"][0].items() if v is not None}
        content.pop("parameters")
        with path.open("w", encoding="utf-8") as stream:
            YAML(typ="safe").dump(content, stream)
        with refusing("robot.yaml, fixtures", *said, of=changed):
            read_robot(path)
    text = robot_text(beside("point", Transform()))
    line = next(line for line in text.splitlines() if "kind: point" in line)
    path.write_text(text.replace(line, f"{line}\n{line}"), encoding="utf-8")
    with refusing("two parameters of the robot would have the same name"):
        read_robot(path)
