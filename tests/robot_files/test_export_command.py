from __future__ import annotations

import json
from itertools import product
from pathlib import Path

import pytest
from tests.commanding import Truearm

from truearm.engine.robot.library import load_robot
from truearm.robot_files.formats import FORMATS, read_dh_csv


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from truearm.engine.robot.robot_file.writing import robot_text

    robot = load_robot("irb120").with_effects(["gain", "approach"])
    away = {n: p.value + 1e-3 for n, p in robot.parameters.items() if p.group in ("geometry", "gain", "approach")}
    path = tmp_path_factory.mktemp("robot") / "calibrated.yaml"
    path.write_text(robot_text(robot.with_values({**away, "base_x": 1.5})))
    return path


#: Formats that hold any arm.
GENERAL = [format_ for format_ in FORMATS if format_ != "ur-kinematics"]


@pytest.mark.parametrize(("robot", "format_"), [*product(["irb120", "li3"], GENERAL), ("ur5e", "ur-kinematics")])
def test_nominal_robots_go_into_every_format(truearm: Truearm, robot: str, format_: str, tmp_path: Path) -> None:
    out = tmp_path / "new" / f"{robot}.{format_}"
    run = truearm("export", robot, "--format", format_, "--out", out)
    assert run.code == 0, run.err
    assert run.out.startswith(f"{out}: {robot} as {format_}. Poses are those of the flange in the base frame")
    assert out.stat().st_size > 300


def test_what_is_left_out_is_told(truearm: Truearm, calibrated: Path, tmp_path: Path) -> None:
    run = truearm("export", calibrated, "--format", "hayati", "--details", "--out", tmp_path / "table.csv")
    assert run.code == 0
    assert "A table cannot hold the joint effect gain; left out: gain_1, gain_2" in run.out
    assert "A table cannot hold masses" in run.out
    assert len(read_dh_csv(tmp_path / "table.csv", "hayati").rows) == 6


def test_json_prints_one_object(truearm: Truearm, calibrated: Path, tmp_path: Path) -> None:
    out = tmp_path / "irb120.py"
    run = truearm("export", calibrated, "--format", "python", "--out", out, "--json")
    assert run.code == 0
    assert run.err == ""
    printed = json.loads(run.out)
    assert list(printed) == ["file", "format", "frames", "warnings"]
    assert (printed["file"], printed["format"]) == (str(out), "python")
    assert [warning["code"] for warning in printed["warnings"]] == ["left-out", "left-out"]
    assert "joint effect approach" in printed["warnings"][0]["message"]
    assert "gain" not in " ".join(warning["message"] for warning in printed["warnings"])


@pytest.mark.parametrize("format_", ["dh", "mdh"])
def test_nearly_parallel_axes_are_refused(truearm: Truearm, calibrated: Path, format_: str, tmp_path: Path) -> None:
    run = truearm("export", calibrated, "--format", format_, "--out", tmp_path / "table.csv")
    assert (run.code, run.out) == (2, "")
    message = " ".join(run.err.split())
    for part in ("irb120: the axes of two joints are nearly parallel", "axis_2 and axis_3", "convention hayati"):
        assert part in message
    assert not (tmp_path / "table.csv").exists()


@pytest.mark.parametrize("format_", FORMATS)
def test_nothing_is_overwritten(truearm: Truearm, format_: str, tmp_path: Path) -> None:
    out = tmp_path / "mine"
    out.write_text("mine")
    run = truearm("export", "irb120", "--format", format_, "--out", out)
    assert run.code == 2
    assert "exists already and is not overwritten" in " ".join(run.err.split())
    assert out.read_text() == "mine"


def test_a_slide_without_limits_goes_into_no_urdf(truearm: Truearm, tmp_path: Path) -> None:
    robot = tmp_path / "slide.yaml"
    lines = ["truearm: truearm-robot/1", "name: slide", "units: {length: mm, angle: deg}", "convention: standard-dh"]
    joints = ["joints:", "  - {name: J1, a: 10}", "  - {name: J2, type: prismatic, alpha: 90}"]
    robot.write_text("\n".join([*lines, *joints]))
    run = truearm("export", robot, "--format", "urdf", "--out", tmp_path / "slide.urdf")
    assert run.code == 2
    assert "a prismatic joint must have limits" in " ".join(run.err.split())
    robot.write_text(robot.read_text().replace("prismatic", "prismatic, limits: [0, 500]"))
    for format_ in GENERAL:
        run = truearm("export", robot, "--format", format_, "--out", tmp_path / f"slide.{format_}")
        assert run.code == 0, run.err
