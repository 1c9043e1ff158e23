"""What parameters do to the tip, and identification by that: the figures, what is said of them, what is refused."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.simulated import campaign

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.simulation.influence import InfluenceResult
from truearm.simulation.influences import PoseByPose, influence_based

KATANA = load_robot("katana450")


@cache
def measured() -> Dataset:
    return truearm.simulate(KATANA, truth="standard", poses=40, noise=1e-5).data


@cache
def influence_result() -> InfluenceResult:
    return truearm.influence(KATANA, measured())


def codes(result: InfluenceResult) -> dict[str, str]:
    return {notice.code: notice.level for notice in result.notices}


def moved_by(robot: Robot, name: str, change: float, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far the flange moves [m] and turns [rad], from two poses of the robot."""
    changed = robot.with_values({name: robot.values[name] + change})
    (p, R), (p2, R2) = robot.forward(q), changed.forward(q)
    turned = np.einsum("nij,nik->njk", R, R2)
    return np.linalg.norm(p2 - p, axis=1), np.arccos(np.clip((np.trace(turned, axis1=1, axis2=2) - 1) / 2, -1, 1))


def test_every_parameter_is_changed_alone_and_the_flange_moves_and_turns_by_it() -> None:
    robot = load_robot("irb120")
    result = truearm.influence(robot, poses=12, angle=math.radians(0.2), length=3e-4, seed=4)
    assert result.tip == "the flange"
    assert result.made.turn is not None
    q = robot.random_configurations(12, np.random.default_rng(4))
    for name in ("theta_offset_2", "a_3", "alpha_5"):
        index = result.made.names.index(name)
        change = 3e-4 if name == "a_3" else math.radians(0.2)
        size, turn = moved_by(robot, name, change, q)
        assert_allclose(result.made.size[index], size, atol=1e-12)
        assert_allclose(result.made.turn[index], turn, atol=1e-7)
    rows = {row["name"]: row for row in result.rows()}
    assert rows["theta_offset_2"]["mean_deg"] == pytest.approx(0.2)
    assert rows["a_3"]["greatest_mm"] == pytest.approx(0.3)
    assert rows["a_3"]["mean_deg"] == pytest.approx(0.0, abs=1e-9)
    means = [row["mean_mm"] for row in result.rows()]
    assert means == sorted(means, reverse=True)


def test_gains_and_compliances_are_changed_by_their_priors() -> None:
    for model, name in (("joints", "gain_2"), ("elastic", "compliance_2")):
        result = truearm.influence("irb120", model=model, poses=5)
        row = next(row for row in result.rows() if row["name"] == name)
        p = result.robot.parameters[name]
        assert result.made.perturbation[result.made.names.index(name)] == p.prior
        assert row["mean_mm"] > 0.0
        assert row["unit"] == ("1" if model == "joints" else "mrad/(N m)")


def test_what_moves_nothing_is_named() -> None:
    result = truearm.influence("irb120", model="offsets", poses=5)
    assert "no-influence" not in codes(result)  # joint 6 turns the flange, although it does not move it
    free = replace(KATANA, masses=())
    still = truearm.influence(free, model="elastic", poses=5)
    assert codes(still) == {"no-influence": "note"}
    assert "compliance_1, compliance_2" in still.notices[0].message


def test_identification_by_influence_stands_beside_the_standard_one() -> None:
    result = influence_result()
    assert result.identified is not None
    assert result.identified.held_out
    errors = {
        way: errors_of_way.position.mean
        for way, errors_of_way in result.identified.errors.items()
        if errors_of_way.position is not None
    }
    assert list(errors) == ["nominal", "minimum norm", "influence", "least squares", "calibrate"]
    assert errors["calibrate"] < 0.2 * errors["influence"]
    assert errors["least squares"] < errors["influence"] < errors["nominal"]
    assert codes(result) == {"influence-worse": "note"}
    rows = {row["name"]: row for row in result.parameter_rows()}
    truth = math.degrees(KATANA.truths["standard"].values["theta_offset_3"])
    assert rows["theta_offset_3"]["calibrate"] == pytest.approx(truth, abs=0.02)
    assert rows["theta_offset_3"]["deviation"] > 0.0
    calibrated = truearm.calibrate(KATANA, measured(), model="geometric")
    assert calibrated.validation is not None
    assert calibrated.validation.position is not None
    assert errors["calibrate"] == pytest.approx(calibrated.validation.position.mean, rel=1e-6)


def test_a_robot_that_knows_the_readings_is_told() -> None:
    calibrated = truearm.calibrate(KATANA, measured(), model="offsets").robot
    again = truearm.influence(calibrated, measured(), model="offsets", seed=1)
    assert codes(again)["training-data"] == "warning"
    assert "training-data" not in codes(truearm.influence(calibrated, measured(), model="offsets"))


def test_frames_of_the_file_are_held_where_the_readings_are_in_them() -> None:
    own = KATANA.with_frames(KATANA.base, {"tip": (0.0, 0.0, 0.0)})
    truth = own.with_values(KATANA.truths["standard"].values)
    data = truearm.simulate(own, truth=truth, poses=30, noise=1e-5).data
    result = truearm.influence(own, data, placement="robot", combination="scaled-mean")
    assert result.identified is not None
    assert result.identified.frames == "robot"
    errors = {
        way: errors_of_way.position.mean
        for way, errors_of_way in result.identified.errors.items()
        if errors_of_way.position is not None
    }
    assert errors["least squares"] < 0.05e-3 < errors["influence"]
    with pytest.raises(InputError, match="does not say where this target is") as refusal:
        truearm.influence(KATANA, data, placement="robot")
    assert refusal.value.parameter == "placement"


def test_poses_that_cannot_be_met_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    from truearm.simulation import influence as job

    def unmet(*arguments: Any, **options: Any) -> PoseByPose:
        identified = influence_based(*arguments, **options)
        return replace(identified, converged=np.arange(len(identified.converged)) > 1)

    monkeypatch.setattr(job, "influence_based", unmet)
    result = truearm.influence(KATANA, measured(), model="offsets", train=20)
    assert codes(result)["poses-unmet"] == "warning"
    assert "2 poses of 20" in next(n.message for n in result.notices if n.code == "poses-unmet")


def test_an_arm_of_three_joints_is_identified_too() -> None:
    result = truearm.influence("li3", truearm.simulate("li3", truth="random", poses=12, noise=1e-3).data)
    assert result.identified is not None
    assert all(np.isfinite(errors.position_norms).all() for errors in result.identified.errors.values())


@pytest.mark.parametrize(
    ("options", "parameter", "says"),
    [
        ({"data": measured, "poses": 5}, "poses", "those of the readings"),
        ({"train": 5}, "train", "no readings to split"),
        ({"target": "tipp"}, "target", "no target"),
        ({"data": measured, "target": "tipp"}, "target", "Did you mean tip"),
        ({"model": "auto"}, "model", "no model of this name"),
        ({"robot": "irb120", "poses": 50_000}, "poses", "too many readings"),
        ({"data": "distances"}, "data", "there is none"),
        ({"data": "fixtures"}, "data", "there is none"),
        ({"data": "ballbar"}, "data", "number of joints differs"),
    ],
)
def test_refusals(options: dict[str, Any], parameter: str, says: str) -> None:
    arguments = {"robot": KATANA} | options
    if arguments.get("data") is measured:
        arguments["data"] = measured()
    elif arguments.get("data") in ("distances", "ballbar"):
        robot = "irb120" if arguments["data"] == "ballbar" else KATANA
        arguments["data"] = truearm.simulate(robot, truth="nominal", poses=6, device="ballbar").data
    elif arguments.get("data") == "fixtures":
        data = measured()
        arguments["data"] = replace(data, fixtures=("plate",), fixture=np.zeros(len(data.target), dtype=np.intp))
    with pytest.raises(InputError, match=says) as refusal:
        truearm.influence(**arguments)
    assert refusal.value.parameter == parameter


def test_files_hold_every_pose(tmp_path: Path) -> None:
    result = influence_result()
    written = result.save(tmp_path)
    assert [path.name for path in written] == ["influence.csv", "result.json", "report.html"]
    with (tmp_path / "influence.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 40 * len(result.made.names)
    assert {row["configuration"] for row in rows} == set(measured().labels)
    first = rows[0]
    assert float(first["moved [mm]"]) == pytest.approx(1e3 * result.made.size[0, 0], rel=1e-5)
    content = json.loads((tmp_path / "result.json").read_text())
    assert content["truearm"] == "truearm-influence/1"
    assert len(content["parameters"]) == len(result.made.names)
    page = (tmp_path / "report.html").read_text()
    for place in ("influence", "map", "errors"):
        assert f'id="{place}"' in page


def test_too_few_configurations_to_place_anything_are_refused() -> None:
    _, data = campaign("irb120", 20, 5e-5, 1)
    with pytest.raises(InputError, match="not found from so few configurations; got '2 training configurations'"):
        truearm.influence("irb120", data, train=2)


def test_the_folder_of_a_calibration_is_not_taken(tmp_path: Path) -> None:
    _, data = campaign("irb120", 20, 5e-5, 1)
    truearm.calibrate("irb120", data, model="offsets", out=tmp_path)
    before = (tmp_path / "result.json").read_text()
    with pytest.raises(InputError, match=r"result\.json, report\.html there belong to another result"):
        truearm.influence("irb120", data, model="offsets", out=tmp_path)
    assert (tmp_path / "result.json").read_text() == before
