"""``axes``, ``tolerance`` and ``lines`` as jobs and commands: records, files, and refusals that name the parameter."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.axis_circles.test_axes import runs
from tests.commanding import Truearm
from tests.expecting import known, refused

import truearm as package
from truearm import Dataset
from truearm.axis_circles.result import AXIS_FILES, AxisCalibration
from truearm.engine.base.manifest import MANIFEST
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.validation.tolerances import AllowedErrors, UsedTolerances

CENTRE = (0.85, 0.0, 0.6)


def stands() -> Robot:
    true = truth_twin(package.load_robot("kr5"), "axis-tests", np.random.default_rng(0)).robot
    return true.with_frames(IDENTITY, {"smr": (0.1, 0.05, 0.03)})


@pytest.fixture(scope="module")
def data() -> Dataset:
    """Axis by axis on the KR5 of Table 3, in its own frame."""
    return measure(Twin(stands()), runs(10.0, (0, -90, 90, 0, 30, 0)), 2e-5, np.random.default_rng(0))


@pytest.fixture(scope="module")
def calibration(data: Dataset) -> AxisCalibration:
    return package.axes("kr5", data, measurement_frame="robot")


def test_axes_are_the_same_from_objects_and_from_files(
    calibration: AxisCalibration, data: Dataset, tmp_path: Path
) -> None:
    (tmp_path / "axes.csv").write_text(csv_text(data))
    read = package.axes("kr5", tmp_path / "axes.csv", measurement_frame="robot", out=tmp_path / "out")
    assert {p.name for p in (tmp_path / "out").iterdir()} == {*AXIS_FILES, MANIFEST}
    assert json.loads((tmp_path / "out" / "axes.json").read_text()) == read.summary()
    values = calibration.robot_with_errors.values
    assert read.robot_with_errors.values == pytest.approx(values, abs=1e-9)
    assert package.load_robot(tmp_path / "out" / "joint-errors.yaml").values == pytest.approx(values, abs=1e-9)


def test_axes_say_what_circles_do_not_observe(calibration: AxisCalibration) -> None:
    summary = calibration.summary()
    assert [c["joint"] for c in summary["circles"]] == [1, 2, 3, 4, 5, 6]
    assert len(summary["joint_errors"]["found"]) == 24
    assert [e["name"] for e in summary["joint_errors"]["unseen"] if e["moves_flange"]] == ["ez_6"]
    errors = {e["name"]: e for e in summary["joint_errors"]["found"]}
    assert errors["ebeta_2"]["value"] == pytest.approx(0.1813, abs=0.005)
    assert errors["ebeta_2"]["interval"][0] < errors["ebeta_2"]["value"] < errors["ebeta_2"]["interval"][1]
    text = calibration.lines()
    fixed = text[text.index("Unobservable with circles, and held at their nominal values:") + 1 :]
    assert [line.strip() for line in fixed if line.endswith("(moves the flange)")] == ["ez_6 (moves the flange)"]
    assert len(repr(calibration)) <= 2000


def test_tolerances_of_one_depth_are_those_of_the_same_depth_each(calibration: AxisCalibration) -> None:
    robot = calibration.robot_with_errors
    single, each = package.tolerance(robot, 0.05), package.tolerance(robot, [0.05] * 6)
    assert isinstance(single, UsedTolerances)
    assert single.summary() == each.summary()
    assert known(single.leans[1].used).delta == pytest.approx(0.05 * np.tan(np.radians(0.1814)), abs=1e-5)
    allowed = package.tolerance(robot, 0.05, lean=2e-5, position=(1e-4, 0, 0, 0, 0, 0))
    assert isinstance(allowed, AllowedErrors)
    worst, root = allowed.errors.together
    assert worst > root > 1e-4
    assert f"all at their worst {worst * 1e3:.3f} mm" in repr(allowed)


def test_lines_are_planned_tried_and_judged(calibration: AxisCalibration, tmp_path: Path) -> None:
    plan = package.lines("kr5", CENTRE, out=tmp_path / "plan.csv")
    assert plan.summary() == {"poses": 77, "lines": []}
    assert plan.lines() == ["The robot can go to all 77 poses."]
    assert plan.written_at("plan.csv") == "plan.csv: 77 configurations, nominal joint positions."
    rows = (tmp_path / "plan.csv").read_text().splitlines()
    assert rows[0].startswith("configuration,joint_1 [deg],")
    assert np.radians([float(cell) for cell in rows[1].split(",")[1:]]) == pytest.approx(plan.joints[0])
    tried = package.lines("kr5", CENTRE, joint_errors=calibration.robot_with_errors, truth="axis-tests", noise=1e-5)
    assert tried.compensated
    assert np.abs(tried.joints - plan.joints).max() > 1e-4
    assert min(line["reduction_percent"] for line in tried.summary()["lines"]) > 95.0
    assert len(tried.lines()) == 8


def test_measured_lines_are_judged_by_the_frames_of_the_joint_errors(calibration: AxisCalibration) -> None:
    plan = package.lines("kr5", CENTRE)
    position = stands().world_poses(plan.joints, "smr")[0]
    data = Dataset.of(plan.joints, position, targets=["smr"], configurations=plan.poses.labels)
    judged = package.lines("kr5", CENTRE, joint_errors=calibration.robot_with_errors, data=data)
    largest = known(judged.before).largest("xyz")
    assert judged.after is None
    assert judged.summary()["lines"][0].keys() >= {"direction", "before_mm"}
    assert largest == pytest.approx(3.7e-3, abs=0.6e-3)
    placed = package.lines("kr5", CENTRE, data=data)  # base and target fitted to the lines themselves
    assert known(placed.before).largest("xyz") < largest


def test_the_commands_take_millimetres_and_say_the_same(truearm: Truearm, data: Dataset, tmp_path: Path) -> None:
    file, out = tmp_path / "axes.csv", tmp_path / "out"
    file.write_text(csv_text(data))
    words = ("axes", "kr5", file, "--measurement-frame", "robot", "--out", out)
    run = truearm(*words, "--json")
    assert run.code == 0, run.err
    assert json.loads(run.out) == json.loads((out / "axes.json").read_text())
    assert "ez_6 (moves the flange)" in truearm(*words, "--details").out
    errors = out / "joint-errors.yaml"
    tolerances = json.loads(truearm("tolerance", errors, "--depth", "50", "--json").out)
    assert tolerances["leans"][1]["lean_mm"] == pytest.approx(50 * np.tan(np.radians(0.1814)), abs=0.01)
    allowed = json.loads(truearm("tolerance", "kr5", "--depth", "50", "--lean", "0.02", "--json").out)
    assert allowed["together"]["worst_mm"] > allowed["together"]["root_of_squares_mm"] > 0.3
    lines = ("lines", "kr5", "--centre", "850,0,600", "--joint-errors", errors, "--truth", "axis-tests")
    assert len(json.loads(truearm(*lines, "--out", tmp_path / "plan.csv", "--json").out)["lines"]) == 7
    assert len((tmp_path / "plan.csv").read_text().splitlines()) == 78
    assert "xyz" in truearm(*lines).out
    refusal = truearm("tolerance", "kr5", "--depth", "50", "--lean", "-1")
    assert (refusal.code, "--lean: the length is out of range; got '-1 mm'" in refusal.err) == (2, True)
    truearm("convert", "irb120", "--convention", "joint-errors", "--out", tmp_path / "other.yaml")
    other = truearm("lines", "kr5", "--centre", "850,0,600", "--joint-errors", tmp_path / "other.yaml")
    assert "--joint-errors: these joint errors belong to another robot than kr5" in other.err


axes: Callable[..., Any] = partial(package.axes, "kr5")
tolerance: Callable[..., Any] = partial(package.tolerance, "kr5")
lines: Callable[..., Any] = partial(package.lines, "kr5")


def test_refusals_name_the_parameter(calibration: AxisCalibration, data: Dataset, tmp_path: Path) -> None:
    some = data.of_configurations(range(30))
    refused(None, "there is no frame of this name", axes, some, measurement_frame="table")
    refused("depth", "6 numbers belong here", tolerance, "deep")
    refused("depth", "a hole needs a depth", tolerance, 0.0)
    refused("depth", "the number cannot be used", tolerance, float("nan"))
    refused("depth", "got 5", tolerance, [0.05] * 5)
    refused("depth", r"the length is out of range; got '1e\+12 mm'", tolerance, 1e9)
    refused("robot", "not described by joint errors", tolerance, 0.05)
    refused("lean", r"got '-1 mm'; allowed: 0 mm to 1e\+09 mm", tolerance, 0.05, lean=-1e-3)
    refused("position", "the length is out of range", tolerance, 0.05, position=[1e-3, -1e-3, 0, 0, 0, 0])
    refused("centre", "3 numbers belong here", lines, (0.85, 0.0))
    refused("centre", "cannot go to a pose", lines, (2.85, 0.0, 0.6))
    refused("size", "three sizes above zero", lines, CENTRE, size=(0.6, 0.0, 0.4))
    refused("truth, data", "only one of them", lines, CENTRE, truth="nominal", data="x.csv")
    refused("truth", "Did you mean axis-tests", lines, CENTRE, truth="axis-test")
    refused("truth", "a truth belongs here", lines, CENTRE, truth=4)
    refused("joint_errors", "not described by joint errors", lines, CENTRE, joint_errors="kr5")
    other = replace(data, joints=data.joints[:, :5], joint_kinds=data.joint_kinds[:5], approach=None)
    refused("data", "joints", axes, other, measurement_frame="robot")
    refused("data", "joints", lines, CENTRE, data=other)
    shifted = np.column_stack([data.position[:, :2], np.roll(data.position[:, 2], -1)])  # heights a row off
    refused(
        None, "axes determine nothing of the robot", axes, replace(data, position=shifted), measurement_frame="robot"
    )
    calibration.save(tmp_path)
    errors = tmp_path / "joint-errors.yaml"
    before = errors.read_bytes()
    refused("out", "this file is read", lines, CENTRE, joint_errors=errors, out=errors)
    refused(None, "this file is read", package.axes, tmp_path / "calibrated.yaml", "missing.csv", out=tmp_path)
    assert errors.read_bytes() == before
