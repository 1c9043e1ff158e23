"""``truearm.axes``, ``tolerance`` and ``lines`` from Python: records, files, and refusals that name the parameter."""

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
from tests.house.examples import EXAMPLES

import truearm
from truearm import Dataset, InputError
from truearm.axis_circles.result import AxisCalibration
from truearm.engine.base.manifest import MANIFEST
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure
from truearm.validation.tolerances import AllowedErrors, UsedTolerances

CENTRE = (0.85, 0.0, 0.6)


@pytest.fixture(scope="module")
def data() -> Dataset:
    """Axis by axis on the KR5 of Table 3, in its own frame."""
    rng = np.random.default_rng(0)
    twin = truth_twin(truearm.load_robot("kr5"), "axis-tests", rng)
    robot = twin.robot.with_frames(IDENTITY, {"smr": (0.1, 0.05, 0.03)})
    return measure(type(twin)(robot), runs(10.0, (0, -90, 90, 0, 30, 0)), 2e-5, rng)


@pytest.fixture(scope="module")
def found(data: Dataset) -> AxisCalibration:
    return truearm.axes("kr5", data, measurement_frame="robot")


def test_axes_are_the_same_from_objects_and_from_files(found: AxisCalibration, data: Dataset, tmp_path: Path) -> None:
    (tmp_path / "axes.csv").write_text(csv_text(data))
    read = truearm.axes("kr5", tmp_path / "axes.csv", measurement_frame="robot", out=tmp_path / "out")
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "axes.json",
        "calibrated.yaml",
        "joint-errors.yaml",
        MANIFEST,
    ]
    assert json.loads((tmp_path / "out" / "axes.json").read_text()) == read.summary()
    values = found.robot_with_errors.values
    assert read.robot_with_errors.values == pytest.approx(values, abs=1e-9)
    assert truearm.load_robot(tmp_path / "out" / "joint-errors.yaml").values == pytest.approx(values, abs=1e-9)


def test_axes_say_what_circles_do_not_observe(found: AxisCalibration) -> None:
    text = found.lines()
    held = text[text.index("Unobservable with circles, and held at their nominal values:") + 1 :]
    assert [line.strip() for line in held if line.endswith("(moves the flange)")] == ["ez_6 (moves the flange)"]
    assert len(repr(found)) <= 2000


def test_tolerances_of_one_depth_are_those_of_the_same_depth_each(found: AxisCalibration) -> None:
    robot = found.robot_with_errors
    one, each = truearm.tolerance(robot, 0.05), truearm.tolerance(robot, [0.05] * 6)
    assert isinstance(one, UsedTolerances)
    assert one.summary() == each.summary()
    assert one.joints[1].delta == pytest.approx(0.05 * np.tan(np.radians(0.1814)), abs=1e-5)
    allowed = truearm.tolerance(robot, 0.05, lean=2e-5, position=(1e-4, 0, 0, 0, 0, 0))
    assert isinstance(allowed, AllowedErrors)
    worst, root = allowed.errors.together
    assert worst > root > 1e-4
    assert f"all at their worst {worst * 1e3:.3f} mm" in repr(allowed)


def test_lines_are_planned_tried_and_judged(found: AxisCalibration, tmp_path: Path) -> None:
    plan = truearm.lines("kr5", CENTRE, out=tmp_path / "plan.csv")
    assert plan.summary() == {"poses": 77, "lines": []}
    assert plan.lines() == ["The robot can go to all 77 poses."]
    assert plan.written_at("plan.csv") == "plan.csv: 77 configurations, nominal joint positions."
    rows = (tmp_path / "plan.csv").read_text().splitlines()
    assert rows[0].startswith("configuration,joint_1 [deg],")
    assert np.radians([float(cell) for cell in rows[1].split(",")[1:]]) == pytest.approx(plan.joints[0])
    tried = truearm.lines("kr5", CENTRE, joint_errors=found.robot_with_errors, truth="axis-tests", noise=1e-5)
    assert tried.compensated
    assert np.abs(tried.joints - plan.joints).max() > 1e-4
    assert min(line["reduction_percent"] for line in tried.summary()["lines"]) > 95.0
    assert len(tried.lines()) == 8


def test_measured_lines_are_judged_by_the_frames_of_the_joint_errors(found: AxisCalibration) -> None:
    plan = truearm.lines("kr5", CENTRE)
    true = truth_twin(truearm.load_robot("kr5"), "axis-tests", np.random.default_rng(1)).robot
    stands = true.with_frames(IDENTITY, {"smr": (0.1, 0.05, 0.03)})
    data = Dataset(
        source="lines",
        labels=plan.poses.labels,
        joints=plan.joints,
        joint_kinds=("revolute",) * 6,
        targets=("smr",),
        configuration=np.arange(77),
        target=np.zeros(77, dtype=np.intp),
        position=stands.world_poses(plan.joints, "smr")[0],
    )
    judged = truearm.lines("kr5", CENTRE, joint_errors=found.robot_with_errors, data=data)
    assert judged.before is not None
    assert judged.after is None
    assert judged.before.largest("xyz") == pytest.approx(3.7e-3, abs=0.6e-3)


axes: Callable[..., Any] = partial(truearm.axes, "kr5")
tolerance: Callable[..., Any] = partial(truearm.tolerance, "kr5")
lines: Callable[..., Any] = partial(truearm.lines, "kr5")


@pytest.mark.parametrize(
    ("call", "parameter", "words"),
    [
        (lambda: truearm.axes(42, "a.csv"), "robot", "a robot belongs here"),  # type: ignore[arg-type]
        (lambda: axes("missing.csv"), "data", "there is no such file"),
        (lambda: tolerance("deep"), "depth", "6 numbers belong here"),
        (lambda: tolerance(True), "depth", "a number belongs here"),
        (lambda: tolerance(0.0), "depth", "a hole needs a depth"),
        (lambda: tolerance(float("nan")), "depth", "the number cannot be used"),
        (lambda: tolerance([0.05] * 5), "depth", "got 5"),
        (lambda: tolerance(1e9), "depth", "the length is out of range; got '1e+12 mm'"),
        (lambda: tolerance(0.05), "robot", "not described by joint errors"),
        (lambda: tolerance(0.05, lean=-1e-3), "lean", "got '-1 mm'; allowed: 0 mm to 1e+09 mm"),
        (lambda: tolerance(0.05, position=[1e-3, -1e-3, 0, 0, 0, 0]), "position", "the length is out of range"),
        (lambda: lines((0.85, 0.0)), "centre", "3 numbers belong here"),
        (lambda: lines((0.85, float("inf"), 0.0)), "centre", "the number cannot be used"),
        (lambda: lines((2.85, 0.0, 0.6)), "centre", "cannot go to a pose"),
        (lambda: lines(CENTRE, size=(0.6, 0.0, 0.4)), "size", "three sizes above zero"),
        (lambda: lines(CENTRE, truth="nominal", data="x.csv"), "truth, data", "only one of them"),
        (lambda: lines(CENTRE, truth="axis-test"), "truth", "Did you mean axis-tests?"),
        (lambda: lines(CENTRE, truth=4), "truth", "a truth belongs here"),
        (lambda: lines(CENTRE, joint_errors="kr5"), "joint_errors", "not described by joint errors"),
    ],
)
def test_refusals_name_the_parameter(call: Callable[[], Any], parameter: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        call()
    assert refused.value.parameter == parameter
    assert words in str(refused.value)


def test_data_of_other_joints_are_refused(data: Dataset) -> None:
    other = replace(data, joints=data.joints[:, :5], joint_kinds=data.joint_kinds[:5], approach=None)
    for job in (partial(axes, other, measurement_frame="robot"), partial(lines, CENTRE, data=other)):
        with pytest.raises(InputError, match="joints") as refused:
            job()
        assert refused.value.parameter == "data"


def test_nothing_that_is_read_is_overwritten(found: AxisCalibration, tmp_path: Path) -> None:
    found.save(tmp_path)
    before = (tmp_path / "joint-errors.yaml").read_bytes()
    with pytest.raises(InputError, match="this file is read") as refused:
        truearm.lines("kr5", CENTRE, joint_errors=tmp_path / "joint-errors.yaml", out=tmp_path / "joint-errors.yaml")
    assert refused.value.parameter == "out"
    with pytest.raises(InputError, match="this file is read"):
        truearm.axes(tmp_path / "calibrated.yaml", "missing.csv", out=tmp_path)
    assert (tmp_path / "joint-errors.yaml").read_bytes() == before


def test_readings_whose_heights_are_a_row_off_are_refused(tmp_path: Path) -> None:
    given = EXAMPLES["axes"](tmp_path)
    data = truearm.load_data(given["data"])
    shifted = replace(data, position=np.column_stack([data.position[:, :2], np.roll(data.position[:, 2], -1)]))
    with pytest.raises(InputError, match="the measured axes determine nothing of the robot"):
        truearm.axes(**{**given, "data": shifted})
