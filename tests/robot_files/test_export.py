"""Exported files give the poses of the robot, and say what they cannot hold."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.arms import ARMS
from tests.engine.robot.test_chain import random_frame, random_robot
from tests.robot_files.dh_reading import read_dh

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.conventions import CONVENTIONS
from truearm.engine.robot.conventions.convention import Convention
from truearm.engine.robot.dh_table import TableConvention
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint, LinkMass, Payload, Tool
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.robot_files import python_template
from truearm.robot_files.formats import FORMATS, exported

TABLES: Mapping[str, TableConvention] = {"dh": "standard-dh", "mdh": "modified-dh", "hayati": "hayati"}
ELASTIC = ("compliance",)
FULL = ("gain", "fourier", "transmission-error", "compliance", "hardening", "backlash")
TILTING = ("compliance", "bearing-compliance", "clearance")
CURVED = ("joint-curve", "compliance")
BENT = ("compliance", "link-bending", "run-out")
EFFECTS = [(), ELASTIC, FULL, TILTING, CURVED, BENT]
#: What parameters of a real robot are away from nominal, by group: each a standard deviation in SI units.
AWAY = {
    "base": 0.1,
    "geometry": 1e-3,
    "joint zero": 2e-3,
    "target": 0.05,
    "gain": 1e-3,
    "fourier": 3e-4,
    "transmission-error": 1e-4,
    "joint-curve": 1e-5,
    "compliance": 1e-5,
    "hardening": 1e-7,
    "backlash": 3e-4,
    "bearing-compliance": 5e-6,
    "clearance": 2e-4,
    "clearance-linear-contact": 2e-4,
    "link-bending": 5e-5,
    "run-out": 2e-5,
    "approach": 2e-4,
}


def calibrated(robot: Robot, effects: tuple[str, ...] = (), seed: int = 1) -> Robot:
    """A robot as a calibration leaves it, in an instrument's frame and with something in its hand."""
    rng = np.random.default_rng(seed)
    robot = robot.with_effects(effects).with_frames(random_frame(rng), {"tip": (0.01, 0.02, 0.1)})
    robot = robot.with_payload(Payload(2.7, (0.05, 0.025, 0.1)), (0.5, -0.3, -9.7))
    away = {
        n: p.value + AWAY[p.group] * (rng.normal() if p.group != "compliance" else rng.uniform())
        for n, p in robot.parameters.items()
    }
    return robot.with_values(away)


def in_base(robot: Robot, q: Array) -> tuple[Array, Array]:
    position, rotation = robot.world_poses(q)
    base = robot.base
    return (position - base.translation) @ base.rotation, base.rotation.T @ rotation


def check_poses(poses: tuple[Array, Array], robot: Robot, q: Array) -> None:
    for actual, expected in zip(poses, in_base(robot, q), strict=True):
        assert_allclose(actual, expected, rtol=0, atol=1e-9)


def configurations(robot: Robot, count: int = 30) -> Array:
    return robot.random_configurations(count, np.random.default_rng(5))


def says(robot: Robot, format_: str, part: str) -> bool:
    """Whether an export says something, in print and in its own text."""
    export = exported(robot, format_)
    heard = [sentence for sentence in export.left_out if part in sentence]
    text = " ".join(export.text.replace("\\", "").split())
    return bool(heard) and all(" ".join(sentence.split()) in text for sentence in heard)


# -- tables ----------------------------------------------------------------------------------------------------


def check_table(robot: Robot, format_: str) -> None:
    table = read_dh(exported(robot, format_).text, TABLES[format_])
    robot_read = Robot("read", "", "", table.convention_name, table.joints(), table.flange).with_frames(table.base, {})
    q = configurations(robot)
    assert [joint.kind for joint in robot_read.joints] == [joint.kind for joint in robot.joints]
    for actual, expected in zip(robot_read.world_poses(q), in_base(robot.rigid, q), strict=True):
        assert_allclose(actual, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_tables_of_any_convention_read_back(convention: Convention) -> None:
    for format_ in TABLES:
        check_table(random_robot(convention, ("gain",), np.random.default_rng(3)), format_)


def test_a_table_says_where_it_starts() -> None:
    assert exported(load_robot("irb120"), "dh").frames.endswith("The table starts at the base frame.")
    moved = exported(calibrated(load_robot("irb120")), "hayati")
    assert "a frame on the first axis, which in the base frame stands at x " in moved.frames
    assert f"# {moved.frames}\n" in moved.text


# -- URDF ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("robot_id", ARMS)
def test_pinocchio_reads_the_urdf(robot_id: str) -> None:
    pin = pytest.importorskip("pinocchio")
    robot = calibrated(load_robot(robot_id), ("gain",))
    model = pin.buildModelFromXML(exported(robot, "urdf").text)
    data = model.createData()
    tool, q = model.getFrameId("tool0"), configurations(robot, 10)
    poses = []
    for readings in q:
        pin.framesForwardKinematics(model, data, pin.integrate(model, pin.neutral(model), readings))
        poses.append((data.oMf[tool].translation.copy(), data.oMf[tool].rotation.copy()))
    check_poses((np.array([p for p, _ in poses]), np.array([R for _, R in poses])), robot.rigid, q)


# -- JSON ------------------------------------------------------------------------------------------------------


def frame_of(elements: list[dict[str, Any]], q: Array) -> Array:
    """The product of elements as the guide describes them, ``(4, 4)``."""
    frame = np.eye(4)
    for element in elements:
        amount = element["value"] + (q[element["joint"] - 1] if "joint" in element else 0.0)
        axis = np.array(element.get("axis") or [float(a == element["motion"][1]) for a in "xyz"])
        step = np.eye(4)
        if element["motion"][0] == "T":
            step[:3, 3] = amount * axis
        else:
            K = np.cross(np.eye(3), axis)
            step[:3, :3] += np.sin(amount) * K + (1 - np.cos(amount)) * K @ K
        frame = frame @ step
    return frame


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_json_is_enough_to_compute_poses(convention: Convention) -> None:
    robot = random_robot(convention, ("gain",), np.random.default_rng(2))
    model = json.loads(exported(robot, "json").text)
    links = [element for joint in model["joints"] for element in joint["elements"]]
    target = model["targets"][0]
    for readings in configurations(robot, 3):
        flange = frame_of([*model["base"]["elements"], *links, *model["flange"]["elements"]], readings)
        tip = flange @ frame_of(target["elements"], readings)
        for frame, name in ((flange, None), (tip, target["name"])):
            position, rotation = robot.rigid.world_poses(readings[None], name)
            assert_allclose(frame[:3, 3], position[0], rtol=0, atol=1e-12)
            assert_allclose(frame[:3, :3], rotation[0], rtol=0, atol=1e-12)


def test_json_holds_what_is_known_of_every_parameter() -> None:
    robot = calibrated(load_robot("irb120"), FULL)
    known = replace(robot.parameters["a_3"], deviation=2e-5, informed=0.9)
    model = json.loads(exported(replace(robot.with_parameters([known]), history=("one", "twö")), "json").text)
    assert list(model) == [
        *("truearm", "name", "title", "source", "units", "frames", "left_out", "convention", "base", "joints"),
        *("flange", "targets", "fixtures", "effects", "curves", "masses", "balancers"),
        *("payload", "gravity", "parameters", "history"),
    ]
    assert model["truearm"] == "truearm-model/1"
    assert model["history"] == ["one", "twö"]
    rows = {row["name"]: row for row in model["parameters"]}
    assert list(rows) == list(robot.parameters)
    row = {"name": "a_3", "unit": "m", "group": "geometry", "nominal": 0.27, "deviation": 2e-5, "informed": 0.9}
    assert rows["a_3"] == {**row, "value": known.value, "prior": known.prior}
    assert {effect["name"] for effect in model["effects"]} == set(FULL)
    assert all(name in rows for effect in model["effects"] for name in effect["parameters"])
    assert model["payload"] == {"mass": 2.7, "cog": [0.05, 0.025, 0.1]}
    assert model["gravity"] == [0.5, -0.3, -9.7]
    assert model["joints"][0]["limits"] == list(robot.joints[0].limits or ())
    assert [joint["transmission_periods"] for joint in model["joints"]] == [240, 240, 200, 100, 100, 100]
    several = exported(with_lines(robot, {2: (), 3: (200, 400, 101)}), "json").text
    assert [joint["transmission_periods"] for joint in json.loads(several)["joints"][1:3]] == [None, [200, 400, 101]]


def test_json_holds_curves_as_arrays() -> None:
    robot = calibrated(load_robot("irb120"), CURVED)
    known = replace(robot.parameters["curve_cos7_2"], deviation=2e-6, informed=0.5)
    robot = robot.with_parameters([known])
    text = exported(robot, "json").text
    assert len([line for line in text.splitlines() if '"joint": ' in line and '"value": {' in line]) == 6
    model = json.loads(text)
    assert not [row for row in model["parameters"] if row["name"].startswith("curve_")]
    assert {"name": "joint-curve", "parameters": []} in model["effects"]
    assert [curve["joint"] for curve in model["curves"]] == [1, 2, 3, 4, 5, 6]
    q = configurations(robot, 5)
    moved = np.zeros_like(q)
    for curve in model["curves"]:
        for k, (s, c) in enumerate(zip(*(curve["value"][part] for part in ("sin", "cos")), strict=True), 1):
            angle = k * q[:, curve["joint"] - 1]
            moved[:, curve["joint"] - 1] += s * np.sin(angle) + c * np.cos(angle)
    plain = robot.with_effects(("compliance",))
    assert_allclose(plain.rigid.world_poses(q + moved)[0], rigid_with_curves(robot).world_poses(q)[0], atol=1e-12)
    second = model["curves"][1]
    assert (second["deviation"]["cos"][6], second["informed"]["cos"][6]) == (2e-6, 0.5)
    assert second["deviation"]["sin"][6] is None
    assert exported(load_robot("irb120"), "json").text.count('"curves": []') == 1


def rigid_with_curves(robot: Robot) -> Robot:
    """The arm without weight: nothing but curves moves its joints."""
    return replace(robot, masses=(), payload=Payload(0.0))


def with_lines(robot: Robot, lines: Mapping[int, tuple[int, ...]]) -> Robot:
    """The same robot with other numbers of periods of some gears; joints count from 1."""
    joints = (replace(j, transmission_periods=lines.get(i, j.periods)) for i, j in enumerate(robot.joints, 1))
    return replace(robot, joints=tuple(joints))


def test_gears_that_err_at_several_numbers_are_in_the_python_file() -> None:
    robot = calibrated(with_lines(load_robot("irb120"), {2: (), 3: (200, 400, 101), 4: (100, 300)}), FULL)
    made = module(robot)
    assert [[line[0] for line in gear] for gear in made["TRANSMISSION"]] == [
        *([240], [], [200, 400, 101], [100, 300], [100], [100]),
    ]
    check_poses(made["forward"](configurations(robot)), robot, configurations(robot))
    assert module(calibrated(load_robot("irb120"), ELASTIC))["TRANSMISSION"] == ((),) * 6  # known, but no part of it


def test_curves_are_arrays_of_the_python_file() -> None:
    robot = calibrated(load_robot("ur5"), CURVED)
    short = robot.with_values({f"curve_{part}{k}_2": 0.0 for part in ("sin", "cos") for k in range(4, 61)})
    short = short.with_values({f"curve_{part}{k}_3": 0.0 for part in ("sin", "cos") for k in range(1, 61)})
    text = exported(short, "python").text
    names = module(short)
    assert [len(curve) for curve in names["CURVES"]] == [120, 6, 0, 120, 120, 120]
    curves = text[text.index("CURVES: ") : text.index("#: By the moment M")]
    assert max(map(len, curves.splitlines())) <= 120
    assert len(curves.splitlines()) < 180
    q = configurations(robot, 200)
    for arm in (robot, short):
        for actual, expected in zip(module(arm)["forward"](q), in_base(arm, q), strict=True):
            assert_allclose(actual, expected, rtol=0, atol=1e-12)
    assert module(load_robot("ur5"))["CURVES"] == ((),) * 6


def test_the_python_file_is_tested_with_poses_that_it_can_compute() -> None:
    """Warm-up is left out of it, and so it is of the poses that it compares itself with."""
    cold = load_robot("irb120").with_effects(["compliance"])
    warm = cold.with_effects(["warm-up"]).with_values({"warm_up_3": 1e-3, "warm_up_left": 0.5})
    of_cold, of_warm = (exported(robot, "python").text.split("POSITIONS")[1] for robot in (cold, warm))
    assert of_warm == of_cold


# -- Python ----------------------------------------------------------------------------------------------------


def module(robot: Robot) -> dict[str, Any]:
    """What the exported file defines."""
    space: dict[str, Any] = {"__name__": "exported"}
    exec(compile(exported(robot, "python").text, "exported.py", "exec"), space)
    return space


@pytest.mark.parametrize("effects", EFFECTS, ids=["geometric", "elastic", "full", "tilting", "curved", "bent"])
@pytest.mark.parametrize("robot_id", ARMS)
def test_the_python_file_gives_the_poses(robot_id: str, effects: tuple[str, ...]) -> None:
    robot = calibrated(load_robot(robot_id), effects)
    check_poses(module(robot)["forward"](q := configurations(robot)), robot, q)


@pytest.mark.parametrize("effects", [("gain", "compliance"), ("clearance-linear-contact", "backlash"), BENT])
@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda c: c.name)
def test_the_python_file_of_any_convention(convention: Convention, effects: tuple[str, ...]) -> None:
    robot = random_robot(convention, (), np.random.default_rng(4))
    places = ((1, 3.0, (0.1, -0.05, 0.02)), (3, 2.0, (0.0, 0.1, 0.1)), (3, 1.0, (0.1, 0.0, 0.0)))
    robot = calibrated(replace(robot, masses=tuple(LinkMass(*place) for place in places)), effects)
    straight = in_base(robot.rigid, q := configurations(robot))
    assert np.abs(straight[0] - in_base(robot, q)[0]).max() > 1e-5
    check_poses(module(robot)["forward"](q), robot, q)


@pytest.mark.parametrize("effects", EFFECTS, ids=["geometric", "elastic", "full", "tilting", "curved", "bent"])
@pytest.mark.parametrize("robot_id", ["irb120", "ur10", "katana450", "li3"])
def test_forward_of_inverse(robot_id: str, effects: tuple[str, ...]) -> None:
    robot = calibrated(load_robot(robot_id), effects)
    names = module(robot)
    q = configurations(robot)
    position, rotation = names["forward"](q)
    joints, within = names["inverse"](position, rotation, q + 0.03 * np.sin(np.arange(q.size)).reshape(q.shape))
    check_poses((position, rotation), robot, joints)
    assert within.shape == q.shape
    assert within.mean() > 0.9


def test_inverse_stays_on_the_branch_of_the_seed() -> None:
    robot = calibrated(load_robot("irb120"), ELASTIC)
    names = module(robot)
    q = np.radians([[10.0, 20.0, -30.0, 40.0, 50.0, 60.0], [-60.0, 30.0, 10.0, -80.0, -40.0, 300.0]])
    joints, within = names["inverse"](*names["forward"](q), q.round(1))
    assert_allclose(joints, q, rtol=0, atol=1e-8)
    assert within.all()


def test_inverse_takes_the_turn_within_the_limits_and_reports_the_others() -> None:
    robot = load_robot("irb120")  # joint 6 turns to 400 deg either way, joint 5 to 120 deg
    names = module(robot)
    q = np.radians([[10.0, 20.0, -30.0, 40.0, 50.0, 100.0]])
    seed = q + np.radians([0.0, 0.0, 0.0, 0.0, 0.0, 330.0])
    joints, within = names["inverse"](*names["forward"](q), seed)
    assert_allclose(np.degrees(joints[0, 5]), 100.0, rtol=0, atol=1e-6)  # 460 deg would be nearer
    assert within.all()
    q[0, 4] = np.radians(125.0)
    joints, within = names["inverse"](*names["forward"](q), q[0])
    assert within.tolist() == [[True, True, True, True, False, True]]


def test_inverse_names_what_was_not_reached() -> None:
    names = module(load_robot("irb120"))
    position, rotation = names["forward"](np.zeros((15, 6)) + 0.3)
    position[[2, 4]] += [1.0, 0.0, 0.0]
    with pytest.raises(ValueError, match=r"not reached: pose 2 \(.* mm and .* deg are missing\), 4 \(") as refusal:
        names["inverse"](position, rotation, np.full(6, 0.3))
    assert "nearer seed" in str(refusal.value)
    with pytest.raises(ValueError, match=r"pose 0 .*, 9 \(.* and 5 more;"):
        names["inverse"](np.add(position, [1.0, 0.0, 0.0]), rotation, np.full(6, 0.3))


def test_inverse_finds_its_way_from_half_a_turn_away() -> None:
    names = module(load_robot("ur5"))
    q = np.array([[0.4, -1.0, 1.2, 0.3, 1.0, -0.5]])
    position, rotation = names["forward"](q)
    for half in ((1, -1, -1), (-1, 1, -1), (-1, -1, 1)):
        joints, _ = names["inverse"](position, rotation @ np.diag(half), q[0])
        back = names["forward"](joints)
        assert_allclose(back[0], position, rtol=0, atol=1e-9, err_msg=str(half))
        assert_allclose(back[1], rotation @ np.diag(half), rtol=0, atol=1e-9, err_msg=str(half))


def test_the_python_file_refuses_what_has_no_shape() -> None:
    names = module(load_robot("irb120"))
    position, rotation = names["forward"](np.zeros((2, 6)))
    calls: tuple[tuple[str, Callable[[], object]], ...] = (
        ("readings have shape .*needed: .n, 6.", lambda: names["forward"](np.zeros((2, 5)))),
        ("readings are not all finite", lambda: names["forward"](np.full((1, 6), np.nan))),
        ("positions have shape", lambda: names["inverse"](position[0], rotation, np.zeros(6))),
        ("rotations have shape .*2, 3, 3", lambda: names["inverse"](position, rotation[:1], np.zeros(6))),
        ("not all rotation matrices", lambda: names["inverse"](position, -rotation, np.zeros(6))),
        ("not all rotation matrices", lambda: names["inverse"](position, 1.001 * rotation, np.zeros(6))),
    )
    for words, call in calls:
        with pytest.raises(ValueError, match=words):
            call()
    none = names["inverse"](np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(6))
    assert [part.shape for part in none] == [(0, 6), (0, 6)]


def test_another_payload_is_one_constant() -> None:
    robot = calibrated(load_robot("irb120"), ELASTIC)
    other = Payload(1.1, (0.0, 0.04, 0.02))
    names = module(robot)
    names["PAYLOAD"] = (other.mass, other.cog)
    check_poses(names["forward"](q := configurations(robot)), robot.with_payload(other), q)


ALONE = """
import sys
class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("truearm", "scipy"):
            raise ImportError(f"{name} is not to be had here")
sys.meta_path.insert(0, Refuse())
import runpy
runpy.run_path(sys.argv[1], run_name="__main__")
"""


def run_alone(path: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", ALONE, path], capture_output=True, text=True)


def test_the_python_file_tests_itself_with_numpy_alone(tmp_path: Path) -> None:
    robot = calibrated(load_robot("kr5"), FULL)
    path = tmp_path / "kinematics.py"
    path.write_text(exported(robot, "python").text, encoding="utf-8")
    run = run_alone(path)
    assert (run.returncode, run.stderr) == (0, "")
    assert "3 stored poses" in run.stdout
    places = str(module(robot)["PLACES"][1][0][0])
    path.write_text(path.read_text().replace(places, str(float(places) + 1e-6)))
    assert run_alone(path).returncode == 1


def test_the_template_is_the_export_of_its_toy_arm() -> None:
    shoulder = Joint("shoulder", "revolute", {"roll": np.pi / 2, "axis_z": 1.0}, (-2.0, 2.0))
    elbow = Joint("elbow", "revolute", {"x": 0.4, "axis_z": 1.0})
    toy = Robot(
        *("toy", "", "", "urdf", (shoulder, elbow), Transform((0.3, 0.0, 0.0))),
        masses=(LinkMass(1, 2.0, (0.2, 0.0, 0.0)),),
        payload=Payload(1.0),
        effect_names=("compliance",),
    ).with_values({"compliance_1": 2e-5, "compliance_2": 4e-5})
    names = module(toy)
    for name in python_template.__annotations__:
        if name.isupper() and name not in ("READINGS", "POSITIONS", "ROTATIONS"):
            assert names[name] == getattr(python_template, name), name
    assert max(python_template.self_test()) < 1e-12
    check_poses(python_template.forward(python_template.READINGS), toy, np.array(python_template.READINGS))


# -- what is said ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("format_", [*TABLES, "urdf", "python"])
def test_what_a_file_cannot_hold_is_said(format_: str) -> None:
    robot = calibrated(load_robot("ur5" if format_ == "python" else "kr5"), ("approach", "compliance"))
    if format_ in ("dh", "mdh"):
        robot = replace(load_robot("kr5").with_effects(["approach", "compliance"]), targets=robot.targets)
        robot = robot.with_values({"approach_2": 1e-4, "compliance_3": 1e-5, "base_x": 1.0}).with_payload(Payload(1.0))
    assert says(robot, format_, "cannot hold the joint effect approach; left out: approach_")
    assert says(robot, format_, "cannot hold where the base stands in the instrument's frame")
    assert says(robot, format_, "cannot hold the targets on the flange; left out: tip.")
    assert any("compliance" in sentence for sentence in exported(robot, format_).left_out) == (format_ != "python")
    if format_ in TABLES:
        assert says(robot, format_, "cannot hold masses; left out: ")
        assert says(robot, format_, "cannot hold the limits of joints.")


def test_what_is_left_out_is_named_and_what_does_nothing_is_not_missed() -> None:
    loaded = load_robot("irb120").with_payload(Payload(1.0))
    assert says(loaded, "dh", "masses; left out: those of link 2, 4 and the payload.")
    tooled = replace(load_robot("li3"), tools={"pin": Tool({"1": (0.0, 0.0, 0.1)})}, truths={})
    assert says(tooled, "json", "Left out, because it is for simulation alone: tools.")
    assert exported(load_robot("ur5").with_effects(["approach", "thermal-growth"]), "python").left_out == ()
    for turned, missed in ((1e-9, False), (1e-5, True)):
        approaching = load_robot("ur5").with_effects(["approach"]).with_values({"approach_6": turned})
        assert says(approaching, "urdf", "cannot hold the joint effect approach; left out: approach_6.") is missed
    robot = calibrated(load_robot("irb120"), (*FULL, "approach"))
    check_poses(module(robot)["forward"](q := configurations(robot)), robot, q)  # at rest, coming from nowhere known


def test_comments_cannot_break_the_xml_and_slides_need_limits() -> None:
    pin = pytest.importorskip("pinocchio")
    robot = replace(load_robot("li3"), title="a --> b --- & < c -", history=("first --", "second\nline \x07 -->"))
    text = exported(robot, "urdf").text
    assert pin.buildModelFromXML(text).nv == 3
    assert "second line - ->" in text
    slide = Joint("J1", "prismatic", {"a": 0.1})
    with pytest.raises(InputError, match="limits of a prismatic joint"):
        exported(Robot("slide", "", "", "standard-dh", (slide, Joint("J2", "revolute", {}))), "urdf")
    limited = Robot("slide", "", "", "standard-dh", (replace(slide, limits=(0.0, 0.5)), Joint("J2", "revolute", {})))
    for format_ in FORMATS:
        assert format_ == "ur-kinematics" or len(exported(limited, format_).text) > 100


@pytest.mark.parametrize("format_", FORMATS)
def test_history_and_frames_go_along(format_: str) -> None:
    arm = "ur5" if format_ == "ur-kinematics" else "kr5"
    robot = replace(load_robot(arm), title='Ünlike """ \\u "others"', history=('by "x"\n\\ """ #',))
    export = exported(robot, format_)
    assert "Poses are those of the flange in the base frame" in export.text
    assert "Ünlike" in export.text
    if format_ == "python":
        assert 'by "x" \\ """ #' in module(robot)["__doc__"]
        assert robot.title in module(robot)["__doc__"]


def test_unknown_formats_offer_the_nearest() -> None:
    with pytest.raises(InputError, match="there is no such format; got 'pyton'; allowed: dh, mdh, hayati") as refusal:
        exported(load_robot("li3"), "pyton")
    assert "Did you mean python?" in str(refusal.value)
    assert load_robot("li3").base == IDENTITY


@pytest.mark.parametrize("robot_id", ARMS)
def test_tables_of_robots_read_back(robot_id: str) -> None:
    robot = load_robot(robot_id)
    for format_ in TABLES:
        check_table(robot, format_)
        check_table(robot.with_frames(random_frame(np.random.default_rng(0)), {}), format_)
    check_table(calibrated(robot, ELASTIC), "hayati")
