from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from truearm.engine.base.errors import InputError
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


def refusal(tmp_path: Path, text: str) -> str:
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    assert "robot.yaml" in message
    return message


def changed(old: str, new: str) -> str:
    assert PLAIN.count(old) == 1
    return PLAIN.replace(old, new)


def with_effect(effect: str, name: str, unit: str, nominal: float = 0.0, value: float = 0.0) -> str:
    entry = f"{{nominal: {nominal}, value: {value}, prior: 1, unit: {unit}}}"
    return f"{PLAIN}effects: [{effect}]\nparameters: {{{name}: {entry}}}\n"


# -- refusals --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        pytest.param(changed("title:", "titel:"), ["titel", "not known here", "Did you mean title"], id="unknown key"),
        pytest.param(
            changed("axis_2, alpha:", "axis_2, alpa:"),
            [
                "joints[2]",
                "modified-hayati",
                "got 'alpa'",
                "allowed: name, type, limits, transmission_periods, bearing, max_speed, alpha, beta",
                "Did you mean alpha",
            ],
            id="unknown column",
        ),
        pytest.param(
            changed("mass: 2.7", "weight: 2.7"),
            ["tools.ball.weight", "not known here"],
            id="unknown in a tool",
        ),
        pytest.param(
            changed("a: 270", "a: long"),
            ["joints[3].a", "a number belongs here", "got 'long'"],
            id="text in a row",
        ),
        pytest.param(changed("a: 270", "a: '270'"), ["joints[3].a", "a number belongs here", "got '270'"], id="quoted"),
        pytest.param(
            changed("a: 270", "a: true"),
            ["joints[3].a", "a number belongs here", "got true"],
            id="true in a row",
        ),
        pytest.param(
            changed("mass: 4.2", "mass: '4.2'"),
            ["masses[1].mass", "a number belongs here", "got '4.2'", "allowed: a number without quotes and unit"],
            id="text mass",
        ),
        pytest.param(
            changed("mass: 4.2", "mass: true"), ["masses[1].mass", "a number belongs here", "got true"], id="true mass"
        ),
        pytest.param(
            changed("mass: 4.2", "mass: -1"),
            ["masses[1].mass", "the number is too small", "got -1", "allowed: 0 or more"],
            id="mass < 0",
        ),
        *(
            pytest.param(
                changed("cog: [140, 0, 0]", f"cog: [140, 0, 0], inertia: {moments}"),
                ["masses[1].inertia", *parts],
                id=f"inertia {moments}",
            )
            for moments, parts in (
                ("[1, 2, 3.1, 0, 0, 0]", ["no body", "1, 2 and 3.1 kg m^2", "sum of the two"]),
                ("[-1, 1, 1, 0, 0, 0]", ["no body", "-1, 1 and 1 kg m^2", "none may be negative"]),
                ("[1, 1, 1, 1.5, 0, 0]", ["no body", "-0.5, 1 and 2.5 kg m^2", "xy, xz, yz"]),
                ("[-1, -1, -1, 0, 0, 0]", ["no body", "none may be negative"]),
                ("[1e99, 1e99, 1e99, 0, 0, 0]", ["too large"]),
                ("[1, 1, .nan, 0, 0, 0]", ["finite", "got nan"]),
                ("[1, 1, 1]", ["masses[1].inertia: there are too few entries", "got 3", "allowed: 6"]),
            )
        ),
        pytest.param(
            changed("limits: [-165, 165]", "limits: [-165, 165], transmission_periods: [40]"),
            ["joints[1].transmission_periods: a whole number belongs here", "got [40]", "allowed: a whole number"],
            id="list of periods",
        ),
        pytest.param(
            changed("limits: [-165, 165]", "limits: [-165, 165], bearing: -1e9"),
            ["joints[1].bearing", "farther along its axis", "got '-1e+06 m'", "up to 10 m either way"],
            id="bearing",
        ),
        *(
            pytest.param(
                changed("limits: [-165, 165]", f"limits: [-165, 165], max_speed: {speed}"),
                ["joints[1].max_speed", *parts],
                id=f"max_speed {speed}",
            )
            for speed, parts in (
                (
                    "4.36",
                    ["no joint is so slow or so fast at 100 %", "got '4.36 deg/s'", "10 to 10000 deg/s", "in deg/s"],
                ),
                ("0", ["got '0 deg/s'", "take the entry out"]),
                ("-250", ["got '-250 deg/s'"]),
                ("25000", ["got '25000 deg/s'"]),
                ("fast", ["a number belongs here", "got 'fast'"]),
                (".nan", ["finite", "got nan"]),
            )
        ),
        pytest.param(
            changed("limits: [-165, 165]", "limits: [-165, 165], transmission_periods: 0"),
            ["joints[1].transmission_periods", "too small", "got 0", "allowed: 1 or more"],
            id="no periods",
        ),
        pytest.param(
            changed("limits: [-165, 165]", "limits: [-165, 165], transmission_periods: 20000"),
            ["joints[1].transmission_periods", "too large", "got 20000", "allowed: 10000 or less"],
            id="many periods",
        ),
        pytest.param(
            changed("link: 2", "link: '2'"),
            ["masses[1].link", "a whole number belongs here", "got '2'"],
            id="text link",
        ),
        pytest.param(
            changed("link: 2", "link: 4"),
            ["masses", "no such link", "got 4", "allowed: 1 to 3"],
            id="no such link",
        ),
        pytest.param(
            changed("{2: 0.03e-3}", "{4: 0.03e-3}"),
            ["truths.printed.compliance", "no such joint", "got 4", "allowed: 1 to 3"],
            id="no such joint",
        ),
        pytest.param(changed("name: plain\n", ""), ["robot.yaml, name", "missing"], id="missing"),
        pytest.param(changed("length: mm, ", ""), ["units.length", "missing"], id="missing unit"),
        pytest.param(
            changed("length: mm", "length: cm"),
            ["units.length", "got 'cm'", "allowed: mm, m, um, in"],
            id="wrong unit",
        ),
        pytest.param(
            changed("truearm-robot/1", "truearm-robot/2"),
            ["robot.yaml, truearm", "got 'truearm-robot/2'", "allowed: truearm-robot/1"],
            id="wrong schema",
        ),
        pytest.param(
            changed("modified-hayati", "craig"),
            ["convention", "got 'craig'", "allowed: standard-dh, modified-dh"],
            id="unknown convention",
        ),
        pytest.param(
            changed("a: 270", "a: .nan"),
            ["joints[3].a", "a number belongs here", "got nan"],
            id="nan in a row",
        ),
        pytest.param(changed("mass: 4.2", "mass: .nan"), ["masses[1].mass", "finite", "got nan"], id="nan mass"),
        pytest.param(
            changed("[-165, 165]", "[-.inf, 165]"),
            ["joints[1].limits[1]", "finite", "got -inf"],
            id="infinite",
        ),
        pytest.param("  \n", ["the file is empty"], id="empty"),
        pytest.param("# nothing\n", ["holds no entries, only comments"], id="comment only"),
        pytest.param("- a\n- b\n", ["must hold named entries", "got [a, b]", "allowed: NAME: VALUE"], id="a list"),
        pytest.param(
            PLAIN + "name: other\n",
            ["line 18: an entry is given twice; got 'name'. Keep one of them."],
            id="duplicate key",
        ),
        pytest.param(PLAIN + "joints: [\n", ["line 19", "not valid YAML"], id="invalid YAML"),
        pytest.param("a: b\n c: d: e\n", ["line 2", "not valid YAML", "mapping values"], id="bad nesting"),
        pytest.param(
            changed("[-165, 165]", "[165, -165]"),
            ["joints[1].limits", "lower limit must be below", "got [165.0, -165.0]"],
            id="limits reversed",
        ),
        pytest.param(
            PLAIN + "payload: {mass: -1}\n", ["payload.mass", "got -1", "allowed: 0 or more"], id="payload < 0"
        ),
        pytest.param(
            PLAIN + "payload: {mass: 2.7kg}\n",
            ["payload.mass", "a number belongs here", "got '2.7kg'"],
            id="payload with a unit",
        ),
        pytest.param(
            PLAIN + "payload: {mass: 1e7}\n", ["payload.mass", "too large to be plausible"], id="heavy payload"
        ),
        pytest.param(PLAIN + "payload: {cog: [1, 2, 3]}\n", ["payload.mass", "missing"], id="payload of no mass"),
        pytest.param(PLAIN + "payload: {mass: 1, cog: [1, 2]}\n", ["payload.cog"], id="flat payload"),
        pytest.param(PLAIN + "gravity: [0, 0, 0]\n", ["gravity", "this one is 0"], id="no gravity"),
        pytest.param(PLAIN + "gravity: [0, -9.81]\n", ["gravity"], id="gravity of two numbers"),
        pytest.param(PLAIN + "gravity: [0, 0, -9810]\n", ["gravity", "0.1 to 100 m/s^2"], id="gravity in mm"),
        *(
            pytest.param(
                with_effect(effect, name, unit, **{key: -0.5}),
                [f"parameters.{name}.{key}", "no joint has a negative one", f"got '-0.5 {unit}'", "allowed: 0 or more"],
                id=f"{name} {key} < 0",
            )
            for effect, name, unit in (
                ("compliance", "compliance_2", "mrad/(N m)"),
                ("backlash", "backlash_1", "deg"),
                ("clearance", "clearance_3", "deg"),
                ("bearing-compliance", "bearing_compliance_2", "mrad/(N m)"),
            )
            for key in ("nominal", "value")
        ),
        pytest.param(
            changed("compliance: {2: 0.03e-3}", "compliance: {2: -0.03e-3}"),
            ["truths.printed.compliance.2", "got -3e-05", "allowed: 0 or more"],
            id="truth of a negative compliance",
        ),
        pytest.param(
            PLAIN
            + "effects: [compliance]\nparameters: {compliance_2: {nominal: 0, value: 1, prior: 1, unit: rad/(N m)}}\n",
            ["parameters.compliance_2", "the unit differs from the file's", "allowed: mrad/(N m)"],
            id="compliance in another unit",
        ),
        pytest.param(
            PLAIN + "effects: [gian]\n",
            ["effects[1]", "got 'gian'", "allowed: gain", "Did you mean gain?"],
            id="unknown effect",
        ),
        pytest.param(
            changed("{a_3: 270.2}", "{aa_3: 270.2}"),
            ["truths.printed", "no such parameter", "got 'aa_3'", "Did you mean a_3"],
            id="unknown parameter of a truth",
        ),
        pytest.param(
            PLAIN + "parameters: {gain_1: {nominal: 1, value: 1, prior: 0.1, unit: '1'}}\n",
            ["parameters", "no such parameter", "got 'gain_1'"],
            id="parameter of an absent effect",
        ),
        pytest.param(
            PLAIN + "parameters: {a_3: {nominal: 270, value: 270, prior: 1, unit: m}}\n",
            ["parameters.a_3", "unit differs", "got 'm'", "allowed: mm"],
            id="other unit",
        ),
        pytest.param(
            PLAIN + "parameters: {a_3: {nominal: 270, value: 270, prior: 0, unit: mm}}\n",
            ["parameters.a_3.prior", "got 0", "allowed: more than 0"],
            id="prior of zero",
        ),
        pytest.param(
            changed("[1, 0, 0, 0]", "[1, 1, 0, 0]"),
            ["flange.quaternion", "must have length 1", "1.41421"],
            id="bad quaternion of the flange",
        ),
        pytest.param(
            PLAIN + "base_quaternion: [0, 0, 0, 0]\n",
            ["base_quaternion", "must have length 1"],
            id="base quaternion zero",
        ),
        pytest.param(
            PLAIN + "targets: [{name: tip, quaternion: [2, 0, 0, 0]}]\n",
            ["targets[1].quaternion", "must have length 1", "has 2"],
            id="bad quaternion of a target",
        ),
        pytest.param(
            URDF_LIKE.replace("[0, 0, 1]", "[0, 0, 2]"),
            ["joints[1].axis", "length 1", "got [0, 0, 2]"],
            id="axis not of length 1",
        ),
        pytest.param(
            URDF_LIKE.replace("axis: [0, 0, 1]", "axis_x: 1"),
            ["joints[1]", "no such entry", "got 'axis_x'", "Did you mean axis?"],
            id="axis in columns",
        ),
        pytest.param(
            URDF_LIKE.replace("[0, 0, 1]", "[0, 1]"),
            ["joints[1].axis", "three numbers", "allowed: [x, y, z]"],
            id="axis of two",
        ),
        pytest.param(
            URDF_LIKE.replace("[0, 0, 1]", "[0, 0, up]"), ["joints[1].axis", "a number", "got 'up'"], id="axis of words"
        ),
        pytest.param(
            URDF_LIKE.replace(", limits: [-0.1, 0.1]", ""),
            ["joints[2]", "a prismatic joint must have limits", "[LOWEST, HIGHEST] in m"],
            id="slide without limits",
        ),
        pytest.param(
            changed("axis_2", "axis_1"),
            ["joints[2]", "two joints have the same name", "got 'axis_1'", "joints[1]", "rename"],
            id="two joints of one name",
        ),
        pytest.param(
            changed("name: axis_1", "name: joint_2").replace("name: axis_2, ", ""),
            ["joints[2]", "two joints have the same name", "got 'joint_2'"],
            id="a joint named like one without a name",
        ),
        pytest.param(
            changed("a: 270", f"a: 1{'0' * 400}"),
            ["joints[3].a", "a number belongs here", "very many digits"],
            id="400 digits",
        ),
        pytest.param(
            changed("a: 270", "a: 1.1e9"),
            ["joints[3].a", "too large to be plausible", "got 1100000000.0", "allowed: -1e+09 to 1e+09 mm", "its unit"],
            id="length of the earth",
        ),
        pytest.param(
            changed("alpha: -90", "alpha: -1e9"), ["joints[2].alpha", "too large", "5.72958e+07 deg"], id="wound up"
        ),
        pytest.param(changed("-165, 165", "-165, 1e300"), ["joints[1].limits", "too large"], id="wide limits"),
        pytest.param(changed("[0, 0, 5]", "[0, 0, 5e9]"), ["flange.translation", "too large"], id="far flange"),
        pytest.param(changed("mass: 4.2", "mass: 1e300"), ["masses[1].mass", "too large"], id="mass of a star"),
        pytest.param(changed("[140, 0, 0]", "[1e99, 0, 0]"), ["masses[1].cog", "too large"], id="far centre"),
        pytest.param(changed("[0, 0, 125]", "[0, 0, 1e99]"), ["tools.ball.targets.1", "too large"], id="far target"),
        pytest.param(changed("270.2", "-2e9"), ["truths.printed.values.a_3", "too large"], id="far truth"),
        pytest.param(changed("0.03e-3", "1e99"), ["truths.printed.compliance.2", "too large"], id="soft joint"),
        pytest.param(
            PLAIN + "priors: {length: 1e-7}\n", ["priors.length", "too small", "1e-06 to 1e+06 mm"], id="small prior"
        ),
        pytest.param(PLAIN + "priors: {angle: 600}\n", ["priors.angle", "too large", "572.958 deg"], id="large prior"),
        pytest.param(
            PLAIN + "parameters: {a_3: {nominal: 270, value: 1e10, prior: 1, unit: mm}}\n",
            ["parameters.a_3.value", "too large"],
            id="absurd value",
        ),
        pytest.param(PLAIN + "targets: [{name: ''}]\n", ["targets[1].name", "a name belongs here"], id="no name"),
        pytest.param(
            PLAIN + "targets: [{name: '  '}]\n",
            ["targets[1].name", "got '  '", "allowed: one line of text"],
            id="blank name",
        ),
        pytest.param(
            PLAIN + 'targets: [{name: "a\\nb"}]\n', ["targets[1].name", "one line", r"got 'a\nb'"], id="two lines"
        ),
        pytest.param(
            PLAIN + "targets: [{name: 5}]\n", ["targets[1].name", "a text belongs here", "got 5"], id="number"
        ),
    ],
)
def test_refused(tmp_path: Path, text: str, parts: list[str]) -> None:
    message = refusal(tmp_path, text)
    for part in parts:
        assert part in message, message


def test_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_robot(tmp_path)
    assert str(caught.value) == f"{tmp_path}: this is a folder, a file is needed."


def test_missing_file_names_the_near_one(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(PLAIN, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_robot(tmp_path / "robto.yaml")
    assert "robto.yaml: there is no such file" in str(caught.value)
    assert "Did you mean robot.yaml?" in str(caught.value)


def test_text_that_is_not_utf8_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_bytes(PLAIN.replace("Plain arm", "Größe").encode("latin-1"))
    with pytest.raises(InputError, match="not UTF-8"):
        read_robot(path)


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


@pytest.mark.parametrize("number", ["1e-3", "1E-3", "1.0e-3", "0.001", "+1e-3"])
def test_exponent_is_a_number(tmp_path: Path, number: str) -> None:
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


def calibrated() -> Robot:
    """A robot with everything that a calibration leaves in its file."""
    rng = np.random.default_rng(0)
    w, x, y, z = (float(v) for v in rng.normal(size=4) / 2)
    size = math.hypot(w, x, y, z)
    base = Transform((1.23456789, -0.5, 0.1), (w / size, x / size, y / size, z / size))
    tool = Transform((0.01, 0.02, 0.123), (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0))
    robot = load_robot("irb120").with_effects(["gain"]).with_frames(base, {"tip": tool, "1": (0.0, 0.05, 1 / 3)})
    moved = [
        replace(
            p,
            value=p.value + p.prior * float(rng.normal()),
            deviation=p.prior * 0.01,
            informed=float(rng.uniform()),
        )
        for p in robot.parameters.values()
    ]
    return replace(
        robot.with_parameters(moved),
        priors={"m": 5e-4, "rad": math.radians(0.05)},
        history=(
            "truearm calibrate: 38 poses, 0.146 mm",
            "a second line: with a colon, and 'quotes' # and more",
        ),
    )


def test_calibrated_robot_round_trips(tmp_path: Path) -> None:
    robot = calibrated()
    text = robot_text(robot)
    again = read(tmp_path, text)
    assert robot_text(again) == text
    assert again.history == robot.history
    assert again.effect_names == ("gain",)
    assert again.base_quaternion == robot.base_quaternion
    assert again.targets == robot.targets
    assert set(again.known) == set(robot.known)
    for name, parameter in robot.parameters.items():
        other = again.parameters[name]
        assert (other.unit, other.group, other.informed) == (
            parameter.unit,
            parameter.group,
            parameter.informed,
        )
        assert other.deviation is not None
        assert parameter.deviation is not None
        assert ulps(other.deviation, parameter.deviation) <= 2
        assert ulps(other.value, parameter.value) <= 2
        assert ulps(other.nominal, parameter.nominal) <= 2
        assert ulps(other.prior, parameter.prior) <= 2
    q = robot.random_configurations(5, np.random.default_rng(1))
    for target in (None, "tip", "1"):
        for actual, expected in zip(again.world_poses(q, target), robot.world_poses(q, target), strict=True):
            assert_allclose(actual, expected, rtol=0, atol=1e-14)


def loaded() -> Robot:
    """A robot with a payload, on a wall, with every joint effect, calibrated."""
    rng = np.random.default_rng(2)
    effects = [effect.name for effect in EFFECTS if effect.name != "clearance-linear-contact"]
    plain = (
        load_robot("irb120").with_payload(Payload(2.7, (0.05, 1 / 30, -0.1)), (-9.8, 0.1, 1 / 3)).with_effects(effects)
    )
    moved = [
        replace(p, value=p.value + p.prior * float(rng.normal()), deviation=p.prior / 7, informed=float(rng.uniform()))
        for p in plain.parameters.values()
    ]
    return replace(plain.with_parameters(moved), history=("calibrated",))


def test_payload_gravity_and_effects_round_trip(tmp_path: Path) -> None:
    robot = loaded()
    text = robot_text(robot)
    again = read(tmp_path, text)
    assert robot_text(again) == text
    assert again.gravity == robot.gravity
    assert again.payload.mass == 2.7
    assert all(ulps(*pair) <= 2 for pair in zip(again.payload.cog, robot.payload.cog, strict=True))
    assert [type(effect) for effect in again.effects] == [type(effect) for effect in robot.effects]
    assert {p.unit for p in robot.parameters.values()} == set(SHOWN_AS) - {"m/N"}
    for name, parameter in robot.parameters.items():
        other = again.parameters[name]
        assert (other.unit, other.group, other.informed) == (parameter.unit, parameter.group, parameter.informed)
        for key in ("nominal", "value", "prior", "deviation"):
            assert ulps(getattr(other, key), getattr(parameter, key)) <= 2, (name, key)
    q = robot.random_configurations(5, np.random.default_rng(1))
    at = Postures(q, approach=np.sign(q), number=np.arange(5.0), temperature=np.linspace(15, 35, 5))
    for actual, expected in zip(again.world_poses(at), robot.world_poses(at), strict=True):
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
    text = with_effect("compliance", "compliance_2", "mrad/(N m)", nominal=-0.1, value=-0.2)
    assert read(tmp_path, f"{text}history: [calibrated twice]\n").values["compliance_2"] == pytest.approx(-0.2e-3)


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


@pytest.mark.parametrize("moments", ["[0, 2, 2, 0, 0, 0]", "[0.333333, 0.666667, 1, 0, 0, 0]", "[0, 0, 0, 0, 0, 0]"])
def test_inertia_of_thin_and_flat_bodies_is_read(moments: str, tmp_path: Path) -> None:
    robot = read(tmp_path, changed("cog: [140, 0, 0]", f"cog: [140, 0, 0], inertia: {moments}"))
    assert str(list(robot.masses[0].inertia)) == str([float(v) for v in moments.strip("[]").split(",")])


def test_two_targets_of_one_name_are_refused(tmp_path: Path) -> None:
    robot = read(tmp_path, PLAIN.split("truths:")[0] + "targets: [{name: '1'}, {name: target_1}]\n")
    with pytest.raises(InputError, match="same name") as caught:
        _ = robot.parameters
    assert "target_1_x" in str(caught.value)
    assert "Rename the target" in str(caught.value)


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
