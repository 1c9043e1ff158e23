from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from tests.expecting import refusing

from truearm.engine.base.units import SHOWN_AS, to_si, written
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload, Tool
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot, robot_from_file
from truearm.engine.robot.robot_file.schema import RobotFile
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform

PLAIN = """\
truearm: truearm-robot/1
name: plain
title: Plain arm
source: made up for this test
units: {length: mm, angle: deg}
convention: modified-hayati
joints:
  - {name: axis_1, alpha: 0, a: 0, theta_offset: 0, d: 290, limits: [-165, 165]}
  - {name: axis_2, alpha: -90, a: 10, theta_offset: -90, d: 0}
  - {name: axis_3, alpha: 0, beta: 0, a: 270, theta_offset: 0, d: 0}
flange: {translation: [0, 0, 5], quaternion: [1, 0, 0, 0]}
masses:
  - {link: 2, mass: 4.2, cog: [140, 0, 0]}
tools:
  ball: {targets: {"1": [0, 0, 125]}, mass: 2.7, cog: [50, 25, 100]}
truths:
  printed: {source: a table, values: {a_3: 270.2}, compliance: {2: 0.03e-3}}
"""

URDF_LIKE = """\
truearm: truearm-robot/1
name: sliding
units: {length: m, angle: rad}
convention: urdf
joints:
  - {axis: [0, 0, 1]}
  - {type: prismatic, axis: [0.577350269, 0.577350269, 0.577350269], x: 0.1, roll: 0.2, limits: [-0.1, 0.1]}
"""


def read(tmp_path: Path, text: str) -> Robot:
    path = tmp_path / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    return read_robot(path)


def changed(old: str, new: str) -> str:
    assert PLAIN.count(old) == 1
    return PLAIN.replace(old, new)


# -- refusals --------------------------------------------------------------------------------------------

Q = "a: 270"
LIMITS = "limits: [-165, 165]"
COG = "cog: [140, 0, 0]"
#: What is changed in the plain file, what for, and parts of what is said of it.
CHANGES: list[tuple[str, str, list[str]]] = [
    ("title:", "titel:", ["titel", "Did you mean title"]),
    ("axis_2, alpha:", "axis_2, alpa:", ["joints[2]", "modified-hayati", "max_speed, alpha, beta", "mean alpha"]),
    ("mass: 2.7", "weight: 2.7", ["tools.ball.weight", "not known here"]),
    (Q, "a: long", ["joints[3].a", "a number belongs here; got 'long'"]),
    (Q, "a: '270'", ["joints[3].a", "a number belongs here; got '270'"]),
    (Q, "a: true", ["joints[3].a", "a number belongs here; got true"]),
    (Q, "a: .nan", ["joints[3].a", "a number belongs here; got nan"]),
    (Q, f"a: 1{'0' * 400}", ["joints[3].a", "very many digits"]),
    (Q, "a: 1.1e9", ["joints[3].a", "too large to be plausible", "allowed: -1e+09 to 1e+09 mm"]),
    ("alpha: -90", "alpha: -1e9", ["joints[2].alpha", "too large", "5.72958e+07 deg"]),
    ("mass: 4.2", "mass: '4.2'", ["masses[1].mass", "allowed: a number without quotes and unit"]),
    ("mass: 4.2", "mass: true", ["masses[1].mass", "got true"]),
    ("mass: 4.2", "mass: -1", ["masses[1].mass", "too small", "allowed: 0 or more"]),
    ("mass: 4.2", "mass: .nan", ["masses[1].mass", "finite"]),
    ("mass: 4.2", "mass: 1e300", ["masses[1].mass", "too large"]),
    ("[140, 0, 0]", "[1e99, 0, 0]", ["masses[1].cog", "too large"]),
    (COG, f"{COG}, inertia: [1, 2, 3.1, 0, 0, 0]", ["masses[1].inertia", "no body", "sum of the two"]),
    (COG, f"{COG}, inertia: [-1, 1, 1, 0, 0, 0]", ["masses[1].inertia", "none may be negative"]),
    (COG, f"{COG}, inertia: [1, 1, 1, 1.5, 0, 0]", ["masses[1].inertia", "-0.5, 1 and 2.5 kg m^2"]),
    (COG, f"{COG}, inertia: [-1, -1, -1, 0, 0, 0]", ["masses[1].inertia", "none may be negative"]),
    (COG, f"{COG}, inertia: [1e99, 1e99, 1e99, 0, 0, 0]", ["masses[1].inertia", "too large"]),
    (COG, f"{COG}, inertia: [1, 1, .nan, 0, 0, 0]", ["masses[1].inertia", "finite"]),
    (COG, f"{COG}, inertia: [1, 1, 1]", ["masses[1].inertia", "too few entries"]),
    *(
        (LIMITS, f"{LIMITS}, transmission_periods: {n}", ["joints[1].transmission_periods", f"number once; got {n}"])
        for n in (0, 20_000, 40.5, "'40'", "true", "[[100]]")
    ),
    (LIMITS, f"{LIMITS}, transmission_periods: [100, 300, 100]", ["each number once; got 100; allowed: a whole"]),
    (LIMITS, f"{LIMITS}, transmission_periods: [100, -3]", ["got -3; allowed: a whole number from 1 to 10000, or a"]),
    (LIMITS, f"{LIMITS}, transmission_periods: {[*range(1, 22)]}", ["got 21; allowed", "list of up to 20 different"]),
    (LIMITS, f"{LIMITS}, max_speed: 4.36", ["joints[1].max_speed", "10 to 10000 deg/s"]),
    (LIMITS, f"{LIMITS}, max_speed: 0", ["joints[1].max_speed", "take the entry out"]),
    (LIMITS, f"{LIMITS}, max_speed: -250", ["joints[1].max_speed", "got '-250 deg/s'"]),
    (LIMITS, f"{LIMITS}, max_speed: 25000", ["joints[1].max_speed", "got '25000 deg/s'"]),
    (LIMITS, f"{LIMITS}, max_speed: fast", ["joints[1].max_speed", "a number belongs here"]),
    (LIMITS, f"{LIMITS}, max_speed: .nan", ["joints[1].max_speed", "finite"]),
    ("[-165, 165]", "[-.inf, 165]", ["joints[1].limits[1]", "finite"]),
    ("[-165, 165]", "[165, -165]", ["joints[1].limits", "lower limit must be below"]),
    ("-165, 165", "-165, 1e300", ["joints[1].limits", "too large"]),
    ("link: 2", "link: '2'", ["masses[1].link", "a whole number belongs here"]),
    ("link: 2", "link: 4", ["masses", "no such link; got 4; allowed: 1 to 3"]),
    ("{2: 0.03e-3}", "{4: 0.03e-3}", ["truths.printed.compliance", "no such joint; got 4; allowed: 1 to 3"]),
    ("{2: 0.03e-3}", "{2: -0.03e-3}", ["truths.printed.compliance.2", "allowed: 0 or more"]),
    ("0.03e-3", "1e99", ["truths.printed.compliance.2", "too large"]),
    ("270.2", "-2e9", ["truths.printed.values.a_3", "too large"]),
    ("{a_3: 270.2}", "{aa_3: 270.2}", ["truths.printed", "no such parameter", "Did you mean a_3"]),
    ("name: plain\n", "", ["robot.yaml, name", "missing"]),
    ("length: mm, ", "", ["units.length", "missing"]),
    ("length: mm", "length: cm", ["units.length", "allowed: mm, m, um, in"]),
    ("truearm-robot/1", "truearm-robot/2", ["robot.yaml, truearm", "allowed: truearm-robot/1"]),
    ("modified-hayati", "craig", ["convention", "allowed: standard-dh, modified-dh"]),
    ("[1, 0, 0, 0]", "[1, 1, 0, 0]", ["flange.quaternion", "must have length 1", "1.41421"]),
    ("[0, 0, 5]", "[0, 0, 5e9]", ["flange.translation", "too large"]),
    ("[0, 0, 125]", "[0, 0, 1e99]", ["tools.ball.targets.1", "too large"]),
    ("name: axis_2", "name: axis_1", ["joints[2]", "two joints have the same name", "joints[1]"]),
]
#: What is added to it.
ADDITIONS: list[tuple[str, list[str]]] = [
    ("name: other", ["line 18: an entry is given twice; got 'name'"]),
    ("joints: [", ["line 19", "not valid YAML"]),
    ("payload: {mass: -1}", ["payload.mass", "allowed: 0 or more"]),
    ("payload: {mass: 2.7kg}", ["payload.mass", "a number belongs here"]),
    ("payload: {mass: 1e7}", ["payload.mass", "too large to be plausible"]),
    ("payload: {cog: [1, 2, 3]}", ["payload.mass", "missing"]),
    ("payload: {mass: 1, cog: [1, 2]}", ["payload.cog"]),
    ("gravity: [0, 0, 0]", ["gravity", "this one is 0"]),
    ("gravity: [0, -9.81]", ["gravity"]),
    ("gravity: [0, 0, -9810]", ["gravity", "0.1 to 100 m/s^2"]),
    ("effects: [gian]", ["effects[1]", "allowed: gain", "Did you mean gain?"]),
    ("parameters: {gain_1: {nominal: 1, value: 1, prior: 0.1, unit: '1'}}", ["parameters", "no such parameter"]),
    ("parameters: {a_3: {nominal: 270, value: 270, prior: 1, unit: m}}", ["parameters.a_3", "allowed: mm"]),
    ("parameters: {a_3: {nominal: 270, value: 270, prior: 0, unit: mm}}", ["parameters.a_3.prior", "more than 0"]),
    ("parameters: {a_3: {nominal: 270, value: 1e10, prior: 1, unit: mm}}", ["parameters.a_3.value", "too large"]),
    ("base_quaternion: [0, 0, 0, 0]", ["base_quaternion", "must have length 1"]),
    ("targets: [{name: tip, quaternion: [2, 0, 0, 0]}]", ["targets[1].quaternion", "must have length 1"]),
    ("priors: {length: 1e-7}", ["priors.length", "too small", "1e-06 to 1e+06 mm"]),
    ("priors: {angle: 600}", ["priors.angle", "too large", "572.958 deg"]),
    ("targets: [{name: ''}]", ["targets[1].name", "a name belongs here"]),
    ("targets: [{name: '  '}]", ["targets[1].name", "allowed: one line of text"]),
    ('targets: [{name: "a\\nb"}]', ["targets[1].name", r"got 'a\nb'"]),
    ("targets: [{name: 5}]", ["targets[1].name", "a text belongs here"]),
    (
        "effects: [compliance]\nparameters: {compliance_2: {nominal: 0, value: 1, prior: 1, unit: rad/(N m)}}",
        ["parameters.compliance_2", "the unit differs from the file's", "allowed: mrad/(N m)"],
    ),
]
#: Other files.
OTHERS: list[tuple[str, list[str]]] = [
    ("  \n", ["the file is empty"]),
    ("# nothing\n", ["holds no entries, only comments"]),
    ("- a\n- b\n", ["must hold named entries", "allowed: NAME: VALUE"]),
    (  # the second has no name, and is called so
        changed("name: axis_1", "name: joint_2").replace("name: axis_2, ", ""),
        ["joints[2]", "two joints have the same name; got 'joint_2'"],
    ),
    ("a: b\n c: d: e\n", ["line 2", "not valid YAML", "mapping values"]),
    (URDF_LIKE.replace("[0, 0, 1]", "[0, 0, 2]"), ["joints[1].axis", "length 1"]),
    (URDF_LIKE.replace("axis: [0, 0, 1]", "axis_x: 1"), ["joints[1]", "no such entry", "Did you mean axis?"]),
    (URDF_LIKE.replace("[0, 0, 1]", "[0, 1]"), ["joints[1].axis", "three numbers"]),
    (URDF_LIKE.replace("[0, 0, 1]", "[0, 0, up]"), ["joints[1].axis", "a number"]),
    (URDF_LIKE.replace(", limits: [-0.1, 0.1]", ""), ["joints[2]", "a prismatic joint must have limits"]),
]


def test_refused(tmp_path: Path) -> None:
    changes = [(changed(old, new), parts) for old, new, parts in CHANGES]
    for text, parts in [*changes, *((f"{PLAIN}{entry}\n", parts) for entry, parts in ADDITIONS), *OTHERS]:
        with refusing("robot.yaml", *parts, of=parts):
            read(tmp_path, text)


def test_folder_file_that_is_not_there_and_text_that_is_not_utf8_are_refused(tmp_path: Path) -> None:
    with refusing(f"{tmp_path}: this is a folder, a file is needed."):
        read_robot(tmp_path)
    path = tmp_path / "robot.yaml"
    path.write_bytes(PLAIN.replace("Plain arm", "Größe").encode("latin-1"))
    with refusing("not UTF-8"):
        read_robot(path)
    with refusing("robto.yaml: there is no such file", "Did you mean robot.yaml?"):
        read_robot(tmp_path / "robto.yaml")


# -- reading ---------------------------------------------------------------------------------------------


def test_plain_file_is_read(tmp_path: Path) -> None:
    robot = read(tmp_path, PLAIN)
    assert [joint.name for joint in robot.joints] == ["axis_1", "axis_2", "axis_3"]
    assert robot.joints[0].limits == (math.radians(-165), math.radians(165))
    assert robot.joints[1].limits is None
    assert robot.values["a_3"] == 0.27
    assert robot.values["theta_offset_2"] == -math.pi / 2
    assert "beta_3" in robot.parameters
    assert "beta_2" not in robot.parameters
    assert robot.truths["printed"].values == {"a_3": 0.2702}
    assert robot.truths["printed"].compliance == {2: 0.03e-3}
    assert robot.tools["ball"].targets == {"1": (0.0, 0.0, 0.125)}


def test_exponent_is_a_number(tmp_path: Path) -> None:
    for number in ("1e-3", "1E-3", "1.0e-3", "0.001", "+1e-3"):
        assert read(tmp_path, changed("a: 270", f"a: {number}")).values["a_3"] == 1e-6


def test_units_of_the_file_count(tmp_path: Path) -> None:
    in_metres = PLAIN.replace("{length: mm, angle: deg}", "{length: m, angle: rad}")
    robot = read(tmp_path, in_metres)
    assert robot.values["a_3"] == 270
    assert robot.values["alpha_2"] == -90


def test_axis_is_made_a_unit_vector(tmp_path: Path) -> None:
    robot = read(tmp_path, URDF_LIKE)
    _, rotation = robot.with_values({"d_offset_2": 0.05}).world_poses(np.array([[0.3, 0.0]]))
    assert_allclose(rotation[0] @ rotation[0].T, np.eye(3), rtol=0, atol=1e-15)
    moved, _ = robot.world_poses(np.array([[0.0, 0.0], [0.0, 0.1]]))
    assert math.dist(*moved.tolist()) == pytest.approx(0.1, rel=1e-14)


# -- writing ---------------------------------------------------------------------------------------------


def ulps(a: float, b: float) -> float:
    return abs(a - b) / math.ulp(max(abs(a), abs(b)))


@given(st.floats(-1e4, 1e4), st.sampled_from(sorted(SHOWN_AS.values())))
def test_written_number_reads_back_to_2_ulp(value: float, unit: str) -> None:
    once = to_si(written(value, unit), unit)
    assert ulps(once, value) <= 2
    assert written(once, unit) == written(value, unit)


@given(st.floats(1e-12, 1e4), st.sampled_from([-1.0, 0.0, 1.0]))
def test_number_of_a_file_is_written_as_it_stood(size: float, sign: float) -> None:
    for unit in ("mm", "deg"):
        short = sign * float(f"{size:.12g}")
        assert written(to_si(short, unit), unit) == short


@settings(deadline=None, max_examples=20)
@given(
    lengths=st.lists(st.floats(-5, 5), min_size=3, max_size=3),
    angles=st.lists(st.floats(-4, 4), min_size=2, max_size=2),
)
def test_values_of_a_robot_read_back_to_2_ulp(lengths: list[float], angles: list[float]) -> None:
    names = ["a_3", "d_4", "base_x", "theta_offset_5", "alpha_6"]
    robot = load_robot("irb120").with_values(dict(zip(names, lengths + angles, strict=True)))
    again = parsed(robot_text(robot))
    for name in names:
        assert ulps(again.values[name], robot.values[name]) <= 2
    assert robot_text(again) == robot_text(robot)


def parsed(text: str) -> Robot:
    from ruamel.yaml import YAML

    return robot_from_file(RobotFile.model_validate(YAML(typ="safe", pure=True).load(text)), "text")


def test_robot_with_all_that_a_calibration_leaves_round_trips(tmp_path: Path) -> None:
    """With a payload, on a wall, with every joint effect, two targets and a base that is turned."""
    rng = np.random.default_rng(2)
    quaternion = rng.normal(size=4)
    w, x, y, z = (float(v) for v in quaternion / np.linalg.norm(quaternion))
    tool = Transform((0.01, 0.02, 0.123), (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0))
    plain = load_robot("irb120").with_payload(Payload(2.7, (0.05, 1 / 30, -0.1)), (-9.8, 0.1, 1 / 3))
    plain = plain.with_effects([effect.name for effect in EFFECTS if effect.name != "clearance-linear-contact"])
    plain = plain.with_frames(Transform((1.2345678, -0.5, 0.1), (w, x, y, z)), {"tip": tool, "1": (0.0, 0.05, 1 / 3)})
    moved = [
        replace(p, value=p.value + p.prior * float(rng.normal()), deviation=p.prior / 7, informed=float(rng.uniform()))
        for p in plain.parameters.values()
    ]
    history = ("truearm calibrate: 38 poses, 0.146 mm", "a second line: with a colon, and 'quotes' # and more")
    robot = plain.with_parameters(moved)
    robot = replace(robot, priors={"m": 5e-4, "rad": math.radians(0.05)}, history=history)
    text = robot_text(robot)
    again = read(tmp_path, text)
    assert robot_text(again) == text
    for field in ("history", "effect_names", "base_quaternion", "targets", "gravity"):
        assert getattr(again, field) == getattr(robot, field), field
    assert set(again.known) == set(robot.known)
    assert again.payload.mass == 2.7
    assert all(ulps(*pair) <= 2 for pair in zip(again.payload.cog, robot.payload.cog, strict=True))
    assert {p.unit for p in robot.parameters.values()} == set(SHOWN_AS) - {"m/N"}
    for name, parameter in robot.parameters.items():
        other = again.parameters[name]
        assert (other.unit, other.group, other.informed) == (parameter.unit, parameter.group, parameter.informed)
        for key in ("nominal", "value", "prior", "deviation"):
            assert ulps(getattr(other, key), getattr(parameter, key)) <= 2, (name, key)
    q = robot.random_configurations(5, np.random.default_rng(1))
    at = Postures(q, approach=np.sign(q), number=np.arange(5.0), temperature=np.linspace(15, 35, 5))
    for target in (None, "tip", "1"):
        for actual, expected in zip(again.world_poses(at, target), robot.world_poses(at, target), strict=True):
            assert_allclose(actual, expected, rtol=0, atol=1e-14)


def test_a_sliding_joint_gives_way_in_um_per_newton(tmp_path: Path) -> None:
    entry = "compliance_2: {nominal: 0, value: 2.5, prior: 1, unit: um/N}"
    robot = read(tmp_path, f"{URDF_LIKE}effects: [compliance]\nparameters: {{{entry}}}\n")
    assert robot.values["compliance_2"] == pytest.approx(2.5e-6, rel=1e-15)
    assert "compliance_2: {unit: um/N, nominal: 0.0, value: 2.5, prior: 1.0}" in robot_text(robot)


def test_payload_and_gravity_are_written_only_if_there_are_any(tmp_path: Path) -> None:
    text = robot_text(read(tmp_path, PLAIN))
    assert "payload" not in text
    assert "gravity" not in text
    robot = read(tmp_path, PLAIN + "payload: {mass: 3, cog: [10, 20, 30]}\ngravity: [0, 0, 9.81]\n")
    assert robot.payload == Payload(3.0, (0.01, 0.02, 0.03))
    assert "payload: {mass: 3.0, cog: [10.0, 20.0, 30.0]}\ngravity: [0.0, 0.0, 9.81]\n" in robot_text(robot)


def test_what_was_identified_may_be_negative(tmp_path: Path) -> None:
    entry = "compliance_2: {nominal: -0.1, value: -0.2, prior: 1, unit: mrad/(N m)}"
    robot = read(tmp_path, f"{PLAIN}effects: [compliance]\nparameters: {{{entry}}}\nhistory: [calibrated twice]\n")
    assert robot.values["compliance_2"] == pytest.approx(-0.2e-3)


def test_a_gear_errs_at_one_number_of_periods_or_at_several(tmp_path: Path) -> None:
    for entry, periods in (("100", (100,)), ("[100]", (100,)), ("[100, 300]", (100, 300)), ("[]", ()), ("null", ())):
        text = changed(LIMITS, f"{LIMITS}, transmission_periods: {entry}") + "effects: [transmission-error]\n"
        robot = read(tmp_path, text)
        assert robot.joints[0].periods == robot.joints[0].transmission_periods == periods
        assert robot.layout.transmission_periods == (periods, (), ())
        names = [p.name for effect in robot.effects for p in effect.parameters]
        further = ["transmission_sin300_1", "transmission_cos300_1"]
        assert names == ["transmission_sin_1", "transmission_cos_1", *further][: 2 * len(periods)]
        again = robot_text(robot.with_values({name: 1e-4 * n for n, name in enumerate(names, 1)}))
        one = f"transmission_periods: {periods[0] if len(periods) == 1 else list(periods)}"
        assert (one in again) == bool(periods)
        assert robot_text(read(tmp_path, again)) == again
    # The first number keeps the names that files with one have.
    known = "parameters: {transmission_cos_1: {nominal: 0, value: 0.01, prior: 0.1, unit: deg}}\n"
    assert read(tmp_path, text.replace("null", "100") + known).values["transmission_cos_1"] == math.radians(0.01)
    assert read(tmp_path, text.replace("null", "[100, 9]") + known).values["transmission_cos_1"] == math.radians(0.01)


def test_numbers_of_periods_are_refused_in_python_as_in_files() -> None:
    joint = load_robot("irb120").joints[3]
    known: tuple[Any, ...] = (None, 100, np.int64(100), (100, 300))
    assert [replace(joint, transmission_periods=n).periods for n in known] == [(), (100,), (100,), (100, 300)]
    assert replace(joint, transmission_periods=[100, 300]) == replace(joint, transmission_periods=(100, 300))
    wrong: tuple[Any, ...] = (0, 10_001, 10**5000, True, "100", 1.5, (100, 100), [300, None], tuple(range(1, 22)))
    for periods in wrong:
        with refusing("each number once", "from 1 to 10000", parameter="transmission_periods"):
            replace(joint, transmission_periods=periods)


def test_urdf_like_robot_round_trips(tmp_path: Path) -> None:
    robot = read(tmp_path, URDF_LIKE)
    text = robot_text(robot)
    again = read(tmp_path, text)
    assert robot_text(again) == text
    assert again.joints[1].kind == "prismatic"
    assert again.joints[1].limits == (-0.1, 0.1)
    q = np.array([[0.3, 0.05]])
    assert_allclose(again.world_poses(q)[0], robot.world_poses(q)[0], rtol=0, atol=1e-15)


def test_inertia_round_trips(tmp_path: Path) -> None:
    moments = (0.05, 0.0412345678901234, 0.07, -0.001, 0.0, 0.002)
    robot = read(tmp_path, changed("cog: [140, 0, 0]", f"cog: [140, 0, 0], inertia: {list(moments)}"))
    assert robot.masses[0].inertia == moments
    text = robot_text(robot)
    again = read(tmp_path, text)
    assert again.masses == robot.masses
    assert robot_text(again) == text
    assert "inertia" not in robot_text(read(tmp_path, PLAIN))


def test_inertia_of_thin_and_flat_bodies_is_read(tmp_path: Path) -> None:
    for moments in ((0, 2, 2, 0, 0, 0), (0.333333, 0.666667, 1, 0, 0, 0), (0, 0, 0, 0, 0, 0)):
        robot = read(tmp_path, changed("cog: [140, 0, 0]", f"cog: [140, 0, 0], inertia: {list(moments)}"))
        assert robot.masses[0].inertia == moments


def test_two_targets_of_one_name_are_refused(tmp_path: Path) -> None:
    robot = read(tmp_path, PLAIN.split("truths:")[0] + "targets: [{name: '1'}, {name: target_1}]\n")
    with refusing("same name", "target_1_x", "Rename the target"):
        _ = robot.parameters


ONE_LINE = st.text(st.characters(exclude_categories=["Cc", "Cs", "Zl", "Zp"]), min_size=1).filter(str.strip)


@settings(deadline=None, max_examples=30)
@given(st.sampled_from(["smr 1", "?0", "<b>", "Träger", "# 1", "a: b", "- x", "'", '"', "null", "1e3", "~"]) | ONE_LINE)
def test_targets_are_called_what_the_data_call_them(name: str) -> None:
    robot = load_robot("li3").with_frames(Transform(), {name: (0.0, 0.0, 0.1)})
    robot = replace(robot, tools={"ball": Tool({name: (0.0, 0.0, 0.1)})}, title=name, source=name, history=(name,))
    again = parsed(robot_text(robot))
    assert [target.name for target in again.targets] == [name]
    assert list(again.tools["ball"].targets) == [name]
    assert (again.title, again.source, again.history) == (name, name, (name,))
    assert dict(again.values) == dict(robot.values)
