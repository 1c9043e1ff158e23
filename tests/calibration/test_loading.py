"""Models of joints that give way: payload, mounting, every effect at once, refusals; and a spring at joint 2."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.engine.robot.test_balancers import ARM, PULL
from tests.expecting import known
from tests.expecting import refused as said_of
from tests.house.test_refusals import refused

import truearm
from truearm.calibration.result import Calibration
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.effects import EFFECTS as REGISTERED
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.reading import read_robot
from truearm.engine.twin.truths import joint_truths
from truearm.engine.twin.twin import Twin, measure

#: The tool of the truth `tracker-triangular`.
PAYLOAD = "2.7kg,50mm,25mm,100mm"
LIGHT = "0.3kg,50mm,25mm,100mm"
NOISE = 0.03  # mm


def simulated(truearm: Truearm, out: Path, *words: object, poses: int = 40) -> Path:
    base = ["simulate", "irb120", "--truth", "tracker-triangular", "--poses", poses, "--noise", NOISE, "--out", out]
    assert truearm(*base, *words).code == 0
    return out


def judged(truearm: Truearm, robot: Path, data: Path, *words: object, code: int = 0) -> float:
    run = truearm("validate", robot, data, "--json", *words)
    assert run.code == code, run.err
    return float(json.loads(run.out)["position_mm"]["mean"])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("loading")


@pytest.fixture
def data(truearm: Truearm, folder: Path) -> Path:
    """Measurements of a robot that gives way under its tool of 2.7 kg."""
    path = folder / "data.csv"
    return path if path.exists() else simulated(truearm, path)


@pytest.fixture
def elastic(truearm: Truearm, folder: Path, data: Path) -> Path:
    """The robot calibrated from them."""
    out = folder / "elastic"
    if not out.exists():
        words = ["--model", "elastic", "--payload", PAYLOAD, "--out", out]
        assert truearm("calibrate", "irb120", data, *words).code == 0
    return out / "calibrated.yaml"


def result(out: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((out / "result.json").read_text())
    return content


EFFECTS = {
    "elastic": ["compliance"],
    "tilting": ["compliance", "clearance", "backlash"],
    "full": ["compliance", "hardening", "fourier", "backlash", "approach"],
}


@pytest.mark.parametrize("model", EFFECTS)
def test_every_model_with_joint_effects(truearm: Truearm, data: Path, tmp_path: Path, model: str) -> None:
    for redundancy in ("prior", "drop"):
        words = ["--model", model, "--redundancy", redundancy, "--payload", PAYLOAD, "--out", tmp_path, "--json"]
        run = truearm("calibrate", "irb120", data, *words)
        assert run.code == 0, (redundancy, run.err)
        summary, outcome = json.loads(run.out), result(tmp_path)
        assert outcome["model"] == {"name": model, "effects": EFFECTS[model]}
        assert "selection" not in outcome
        assert json.loads(truearm("show", tmp_path / "calibrated.yaml", "--json").out)["effects"] == EFFECTS[model]
        compliance = next(row for row in outcome["parameters"] if row["name"] == "compliance_3")
        assert compliance["unit"] == "mrad/(N m)"
        if model == "elastic":
            assert compliance["value"] == pytest.approx(0.130, abs=0.01), redundancy
        assert summary["validation"]["position_mm"]["mean"] < summary["nominal"]["position_mm"]["mean"] / 5, redundancy
        codes = {warning["code"]: warning["message"] for warning in summary["warnings"]}
        in_order = [effect.name for effect in REGISTERED if effect.name in EFFECTS[model]]
        assert summary["not_in_urdf"] == in_order
        assert "compliance_1" in codes["effects-uninformed"]
        assert "compliance_2" not in codes["effects-uninformed"]
        again = json.loads(truearm("validate", tmp_path / "calibrated.yaml", data, "--json").out)["position_mm"]
        parts = [(summary[part]["position_mm"], summary[part]["configurations"]) for part in ("train", "validation")]
        assert again["mean"] == pytest.approx(sum(part["mean"] * n for part, n in parts) / 40, rel=1e-9), redundancy
        assert again["max"] == pytest.approx(max(part["max"] for part, _ in parts), rel=1e-9), redundancy


def test_auto_tells_what_every_effect_does(truearm: Truearm, data: Path, tmp_path: Path) -> None:
    run = truearm("calibrate", "irb120", data, "--model", "auto", "--payload", PAYLOAD, "--out", tmp_path)
    assert run.code == 0, run.err
    outcome = result(tmp_path)
    model, shares = outcome["model"], outcome["selection"]
    assert model["name"] == "auto"
    assert list(shares) == ["candidates", "lines"]
    rows = shares["candidates"]
    assert list(rows[0]) == ["effect", "taken", "moves_mm", "known", "parameters", "reason"]
    assert {row["effect"] for row in rows if row["moves_mm"] is not None} == set(model["effects"])
    assert all(bool(row["reason"]) is (row["moves_mm"] is None) for row in rows)
    moving = [f"{row['effect']} {row['moves_mm']:.3f}" for row in rows if row["taken"]]
    more = f", and {len(moving) - 4} smaller" if len(moving) > 4 else ""
    assert f"Effects that move the targets [mm]: {', '.join(moving[:4])}{more}\n" in run.out
    assert (rows[0]["effect"], rows[0]["moves_mm"] > 0.5) == ("compliance", True)
    assert outcome["validation"]["position_mm"]["mean"] < 0.08
    assert outcome["command"].endswith(f"data.csv --model auto --payload {PAYLOAD} --out DIR")
    report = (tmp_path / "report.html").read_text()
    for row in rows:
        moves = "–" if row["moves_mm"] is None else f"{row['moves_mm']:.4f}"
        assert f'<td>{row["effect"]}</td><td class="n">{moves}</td>' in report
    payload = "Payload</dt><dd>2.7 kg at (50, 25, 100) mm"
    for words in ("What every effect does", 'id="shares"', payload):
        assert words in report
    assert "Free fall" not in report


def test_a_robot_predicts_another_payload_and_another_mounting(truearm: Truearm, elastic: Path, folder: Path) -> None:
    own = result(elastic.parent)["validation"]["position_mm"]["mean"]
    light = simulated(truearm, folder / "light.csv", "--payload", LIGHT, "--seed", 5, poses=60)
    assert judged(truearm, elastic, light, code=3) > 10 * own  # with the 2.7 kg that the file says
    outcome = judged(truearm, elastic, light, "--payload", LIGHT)
    assert outcome == pytest.approx(own, rel=0.2)
    assert judged(truearm, elastic, light, "--payload", "300g,0.05m,25 mm,100mm") == outcome
    hanging = simulated(truearm, folder / "hanging.csv", "--gravity", "0,0,9.81", "--seed", 6)
    assert judged(truearm, elastic, hanging, code=3) > 10 * own
    assert judged(truearm, elastic, hanging, "--gravity", "0,0,9.81") == pytest.approx(own, rel=0.25)


def test_a_wall_loads_the_first_axis(truearm: Truearm, folder: Path, tmp_path: Path) -> None:
    words = ["--gravity", "-9.81,0,0"]
    data = simulated(truearm, folder / "wall.csv", *words, "--seed", 7)
    run = truearm("calibrate", "irb120", data, "--model", "elastic", "--payload", PAYLOAD, *words, "--out", tmp_path)
    assert (run.code, "effects-uninformed" in run.out) == (0, False)
    shown = truearm("show", tmp_path / "calibrated.yaml").out
    for words_of in (
        "Free fall: -9.81, 0, 0 m/s^2 in the base frame",
        "Payload: 2.7 kg at x 50  y 25  z 100 mm of the flange",
        "Joint effects: compliance",
    ):
        assert words_of in shown
    assert "Free fall</dt><dd>(-9.81, 0, 0) m/s²" in (tmp_path / "report.html").read_text()
    assert result(tmp_path)["command"].endswith(f"--payload {PAYLOAD} --gravity -9.81,0,0 --out DIR")


def test_inverse_kinematics_lift_what_is_heavier(truearm: Truearm, elastic: Path, tmp_path: Path) -> None:
    poses, out = tmp_path / "poses.csv", tmp_path / "joints.csv"
    poses.write_text("pose,x [mm],y [mm],z [mm],qw,qx,qy,qz\nA,400,100,300,0,0,1,0\n")

    def joints(*words: object) -> np.ndarray[Any, np.dtype[np.float64]]:
        assert truearm("ik", elastic, poses, *words, "--branch", "front-up-noflip", "--out", out).code == 0
        with out.open() as stream:
            (row,) = csv.DictReader(stream)
        return np.radians([[float(row[f"joint_{number} [deg]"]) for number in range(1, 7)]])

    robot = load_robot(elastic)
    base = robot.base

    def height(q: np.ndarray[Any, np.dtype[np.float64]]) -> float:
        """Where the flange would be if nothing gave way [m]."""
        stiff = robot.with_values({name: 0.0 for name in robot.parameters if name.startswith("compliance")})
        return float((base.rotation.T @ (stiff.world_poses(q)[0][0] - np.array(base.translation)))[2])

    none, own, heavy = joints("--payload", "0kg,0mm,0mm,0mm"), joints(), joints("--payload", "5.4kg,50mm,25mm,100mm")
    assert np.array_equal(own, joints("--payload", PAYLOAD))
    assert 0.3 < height(none) < height(own) < height(heavy)
    assert height(joints("--gravity", "0,0,9.80665")) < 0.3
    reached = robot.world_poses(own)[0][0]
    assert base.rotation.T @ (reached - np.array(base.translation)) == pytest.approx([0.4, 0.1, 0.3], abs=1e-9)


def test_a_calibrated_robot_can_be_calibrated_again(
    truearm: Truearm, elastic: Path, data: Path, tmp_path: Path
) -> None:
    text = elastic.read_text()
    start = text.index("compliance_1: {unit: mrad/(N m), nominal: 0.0, value: ") + len("compliance_1: ")
    line = text[start : text.index("\n", start)]
    slack = tmp_path / "slack.yaml"  # what is not identified may come out a hair below zero
    slack.write_text(text.replace(line, "{unit: mrad/(N m), nominal: 0.0, value: -1.0e-06, prior: 1.0}"))
    for model in ("geometric", "elastic"):
        assert truearm("calibrate", slack, data, "--model", model, "--out", tmp_path / model).code == 0
        assert judged(truearm, tmp_path / model / "calibrated.yaml", data) < 0.06


# -- refusals ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("option", "text", "part"),
    [
        ("--payload", "2.7,50,25,100", "no unit that fits is given; got '2.7'; allowed: 2.7kg or 2.7g"),
        ("--payload", "2.7kg,50cm,25mm,100mm", "got '50cm'; allowed: 50mm or 50m. Units are never guessed"),
        ("--payload", "2.7kg,50mm,25mm", "a mass and the three coordinates of its centre of gravity belong here"),
        ("--payload", "heavy,0mm,0mm,0mm", "a number with its unit belongs here; got 'heavy'"),
        ("--payload", "nankg,0mm,0mm,0mm", "a number with its unit belongs here; got 'nankg'"),
        ("--payload", "-1kg,0mm,0mm,0mm", "a mass cannot be negative; got '-1kg'"),
        ("--payload", "1e300kg,0mm,0mm,0mm", "the number is too large to be plausible; got '1e300kg'"),
        ("--gravity", "0,0,0", "this cannot be the acceleration of free fall; got '0 m/s^2'; allowed: about 9.81"),
        ("--gravity", "0,-9.81", "three numbers belong here; got '0,-9.81'; allowed: 0,0,-9.81"),
        ("--gravity", "0,0,nan", "three numbers belong here; got '0,0,nan'"),
    ],
)
def test_payload_and_gravity_that_nothing_has(
    truearm: Truearm, tmp_path: Path, option: str, text: str, part: str
) -> None:
    words = ("--truth", "nominal", "--poses", 3, "--noise", 0, "--out", tmp_path / "out")
    message = refused(truearm, "simulate", "irb120", *words, option, text)
    assert (f"{option}: " in message, part in message) == (True, True), message
    assert not (tmp_path / "out").exists()


def test_what_a_model_needs_of_the_data_is_said(truearm: Truearm, data: Path, tmp_path: Path) -> None:
    header, *rows = (line.split(",", 1) for line in data.read_text().splitlines())
    named, out = tmp_path / "named.csv", ("--out", tmp_path / "out")
    for labels in ("P{}", "{}.5", "-{}"):
        named.write_text("\n".join([",".join(header), *(f"{labels.format(n)},{cells}" for n, cells in rows)]) + "\n")
        message = refused(truearm, "calibrate", "irb120", named, "--model", "full", *out)
        assert "the effect approach needs the order in which the configurations were measured" in message
        assert "got 'configurations that are not numbered'. Number the configurations 1, 2, 3" in message
    for redundancy in ("drop", "none"):
        words = ("--model", "auto", "--redundancy", redundancy)
        message = refused(truearm, "calibrate", "irb120", data, *words, *out)
        assert "the data tell how large joint effects are, which needs priors" in message
        assert "Leave out --redundancy, or name a model" in message


def test_a_robot_calibrated_with_its_temperature_asks_for_it(truearm: Truearm, data: Path, tmp_path: Path) -> None:
    lines = data.read_text().splitlines()
    warm = [f"{lines[0]},temperature [degC]", *(f"{line},{20 + int(line.split(',')[0]) / 4}" for line in lines[1:])]
    (tmp_path / "warm.csv").write_text("\n".join(warm) + "\n")
    robot = tmp_path / "robot.yaml"
    truearm("convert", "irb120", "--convention", "modified-hayati", "--out", robot)
    robot.write_text(robot.read_text() + "effects: [thermal-growth]\n")
    assert "the effect thermal-growth needs the temperature of the arm" in refused(
        truearm, "calibrate", robot, data, "--out", tmp_path / "out", "--model=geometric"
    )
    assert truearm("calibrate", robot, tmp_path / "warm.csv", "--out", tmp_path / "out", "--model=geometric").code == 0
    message = refused(truearm, "validate", tmp_path / "out" / "calibrated.yaml", data)
    assert "the robot was calibrated with its temperature, and the data hold no temperature" in message
    assert "Add the column temperature [degC]" in message
    assert truearm("validate", tmp_path / "out" / "calibrated.yaml", tmp_path / "warm.csv").code == 0


def test_an_effect_can_be_added_to_any_model(truearm: Truearm, data: Path, tmp_path: Path) -> None:
    arguments = ("calibrate", "irb120", data, "--payload", PAYLOAD, "--out", tmp_path / "out", "--model")
    run = truearm(*arguments, "elastic", "--effect", "bearing-compliance", "--effect", "compliance")
    assert run.code == 0
    outcome = result(tmp_path / "out")
    assert outcome["model"]["effects"] == ["compliance", "bearing-compliance"]
    assert "--effect bearing-compliance" in outcome["command"]
    misspelt = refused(truearm, *arguments, "elastic", "--effect", "bearing-complience")
    assert "Did you mean bearing-compliance" in misspelt
    assert "the model auto has every joint effect" in refused(truearm, *arguments, "auto", "--effect", "fourier")
    twice = refused(truearm, *arguments, "tilting", "--effect", "clearance-linear-contact")
    assert "two joint effects of the robot have the same parameter" in twice
    assert "clearance, clearance-linear-contact" in twice


def test_what_is_simulated_has_the_effects_of_its_robot(truearm: Truearm, elastic: Path, tmp_path: Path) -> None:
    words = ["simulate", elastic, "--truth", "nominal", "--poses", 5, "--noise", 0, "--out"]
    assert truearm(*words, tmp_path / "bent.csv").code == 0
    assert truearm(*words, tmp_path / "stiff.csv", "--payload", "0kg,0mm,0mm,0mm").code == 0
    assert (tmp_path / "bent.csv").read_text() != (tmp_path / "stiff.csv").read_text()


# -- a large arm with a spring at joint 2, under two weights -------------------------------------------------------


#: Of joints 1 to 6 [rad/(N m)], as stiff as such arms are.
COMPLIANCE = (3.8e-6, 3e-7, 4e-7, 3e-6, 3.3e-6, 2.4e-6)
STRENGTH = 0.93
WEIGHT = 150.0 * 9.81


@cache
def campaign(folder: Path, *, two_loads: bool) -> tuple[Robot, Dataset]:
    """The nominal arm, and 60 configurations of one whose spring has aged, half of them with 150 kg at the flange."""
    path = folder / "arm.yaml"
    path.write_text(ARM.replace("PULL", PULL))
    arm, rng = read_robot(path), np.random.default_rng(0)
    true = arm.with_effects(["compliance", "balancer"]).with_frames(arm.base, {"ball": (0.0, 0.0, 0.1)})
    drawn = {
        p.name: p.value + 0.3 * p.prior * rng.standard_normal()
        for p in true.parameters.values()
        if p.group in ("geometry", "joint zero")
    }
    soft = {f"compliance_{i}": c for i, c in enumerate(COMPLIANCE, 1)}
    true = true.with_values({**drawn, **soft, "balancer_1": STRENGTH})
    wrench = np.zeros((60, 6))
    wrench[::2, 2] = -WEIGHT if two_loads else 0.0
    q = arm.random_configurations(60, rng)
    return arm, measure(Twin(true, joint_truths(true)), q, 1e-5, rng, wrench=wrench)


def codes(calibration: Calibration) -> dict[str, str]:
    return {notice.code: notice.message for notice in calibration.warnings}


def test_spring_brings_the_held_out_error_to_a_fifth(tmp_path_factory: pytest.TempPathFactory) -> None:
    arm, data = campaign(tmp_path_factory.mktemp("arm"), two_loads=True)
    without = truearm.calibrate(replace(arm, balancers=()), data, model="elastic")
    with_it = truearm.calibrate(arm, data, model="elastic", effects=["balancer"])
    before, after = (known(known(each.validation).position) for each in (without, with_it))
    assert after.mean < before.mean / 10.0
    assert after.max < before.max / 10.0
    factor = with_it.robot.parameters["balancer_1"]
    deviation = known(factor.deviation)
    assert factor.value == pytest.approx(STRENGTH, abs=4.0 * deviation)
    assert deviation < 0.01
    assert "residuals-exceed-sigma" not in codes(with_it)
    assert "balancer-held" not in codes(with_it)
    assert "model elastic + balancer" in with_it.robot.history[-1]


def test_strength_is_held_where_all_readings_carry_one_load(tmp_path_factory: pytest.TempPathFactory) -> None:
    arm, data = campaign(tmp_path_factory.mktemp("arm"), two_loads=False)
    outcome = truearm.calibrate(arm, data, model="elastic", effects=["balancer"])
    assert "balancer_1" not in outcome.robot.values
    assert "force_x [N]" in codes(outcome)["balancer-held"]
    assert next(n.level for n in outcome.warnings if n.code == "balancer-held") == "note"
    assert "+ balancer" not in outcome.robot.history[-1]
    known = arm.with_effects(["balancer"]).with_values({"balancer_1": STRENGTH})
    fixed = truearm.calibrate(known, data, model="elastic", effects=["balancer"])
    assert fixed.robot.values["balancer_1"] == STRENGTH


def test_balancer_of_a_robot_that_has_none_is_refused() -> None:
    calibrate = partial(truearm.calibrate, "irb120", "nowhere.csv", model="elastic")
    said_of("effects", "irb120.*no balancer.*Enter balancers", calibrate, effects=["balancer"])
