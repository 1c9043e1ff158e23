"""Sets of poses as a job and a command: what they write, and what they refuse."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.commanding import Truearm
from tests.expecting import refused

import truearm as package
from truearm.engine.data.readers.canonical import read_csv
from truearm.engine.data.readers.configurations import read_poses
from truearm.engine.robot.transform import rotation_from_quaternion

CUBE = ("--centre", "350,0,350", "--side", "200")


def test_a_set_is_written_as_other_commands_read_it(truearm: Truearm, tmp_path: Path) -> None:
    out = tmp_path / "set.csv"
    run = truearm("poses", "irb120", "--set", "diagonal", "--count", 6, *CUBE, "--tip", "0,0,50", "--out", out)
    assert run.code == 0, run.err
    assert run.out.startswith("6 poses of the set diagonal in the cube of 200 mm about (350, 0, 350) mm.")
    assert {path.name for path in tmp_path.iterdir()} == {
        *("set.csv", "set-poses.csv", "set.html"),
        "truearm.manifest.json",
    }
    data, read = read_csv(out), read_poses(tmp_path / "set-poses.csv")
    robot = package.load_robot("irb120")
    position, rotation = robot.forward(data.joints)
    assert read.labels == data.labels
    assert read.position == pytest.approx(position, abs=1e-9)
    assert read.quaternion is not None
    assert rotation_from_quaternion(read.quaternion) == pytest.approx(rotation, abs=1e-9)
    again = package.inverse("irb120", tmp_path / "set-poses.csv", seed_joints=data.joints)
    assert again.joints == pytest.approx(data.joints, abs=1e-6)
    measured = tmp_path / "measured.csv"
    run = truearm("simulate", "irb120", "--truth", "random", "--poses", out, "--noise", 0.05, "--out", measured)
    assert run.code == 0, run.err
    assert read_csv(measured).joints == pytest.approx(data.joints, abs=0.0)
    assert read_csv(measured).labels == data.labels
    plan = truearm("plan", "irb120", "--from", out, "--poses", 5, "--model", "offsets", "--out", tmp_path / "plan.csv")
    assert plan.code == 0, plan.err
    template = truearm("calibrate", "irb120", out, "--out", tmp_path / "no", "--model=geometric")
    assert template.code == 2
    assert "no reading" in template.err or "reading" in template.err


def test_a_target_of_the_robot_goes_to_the_poses(tmp_path: Path) -> None:
    robot = package.load_robot("irb120")
    robot = robot.with_frames(robot.base, {"a": (0.0, 0.02, 0.1), "b": (0.0, 0.0, 0.05)})
    poses = package.poses(robot, "p1-p5", centre=(0.35, 0.0, 0.3), side=0.2, target="a", out=tmp_path / "p.csv")
    at, _ = robot.forward(poses.joints, target="a")
    assert at[0] == pytest.approx([0.35, 0.0, 0.3], abs=1e-8)
    assert read_poses(tmp_path / "p-poses.csv").position == pytest.approx(at, abs=1e-9)
    assert read_csv(tmp_path / "p.csv").targets == ("a", "b")


def test_unreachable_poses_end_with_exit_code_3_and_their_names(truearm: Truearm, tmp_path: Path) -> None:
    words = ("--centre", "350,0,350", "--side", 300, "--tip-orientation", "down", "--out", tmp_path / "s.csv", "--json")
    run = truearm("poses", "irb120", "--set", "iso-cube", *words)
    assert run.code == 3
    summary = json.loads(run.out)
    assert summary["missed"] == ["C1", "C4"]
    assert [(w["code"], w["level"]) for w in summary["warnings"]] == [("unreachable-poses", "error")]
    assert read_csv(tmp_path / "s.csv").labels == ("P1", "C2", "C3", "C5", "C6", "C7", "C8")


def test_the_controllers_joint_positions_can_be_asked_for(tmp_path: Path) -> None:
    cube = {"centre": (0.4, 0.0, 0.3), "side": 0.2}
    fanuc = package.poses("lrmate200ic", "p1-p5", out=tmp_path / "c.csv", **cube)  # type: ignore[arg-type]
    assert "axis_1 [deg]" in (tmp_path / "c.csv").read_text().splitlines()[0]
    package.poses("lrmate200ic", "p1-p5", joints="model", out=tmp_path / "m.csv", **cube)  # type: ignore[arg-type]
    assert read_csv(tmp_path / "m.csv").joints == pytest.approx(fanuc.joints, abs=1e-12)
    shown = package.load_data(tmp_path / "c.csv", "lrmate200ic")
    assert shown.joints == pytest.approx(fanuc.joints, abs=1e-9)


def test_what_no_set_can_be_is_refused(tmp_path: Path) -> None:
    cube = {"centre": (0.3, 0, 0.3), "side": 0.2}
    for parameter, options, expected in (
        ("centre, side", {"set": "sphere"}, "the sphere needs its centre and its size"),
        ("centre, side", {"set": "p1-p5", "centre": (0.3, 0, 0.3)}, "a cube needs its centre and its side"),
        ("count", {"set": "p1-p5", **cube, "count": 5}, "has a number of poses of its own"),
        ("plane", {"set": "p1-p5", "plane": "C1"}, "no plane of this name"),
        ("ahead", {"set": "p1-p5", "ahead": "up"}, "no ahead of this name"),
        ("tip_orientation", {"set": "p1-p5", "tip_orientation": "up"}, "no orientation of this name"),
        ("tip_orientation", {"set": "p1-p5", "tip_orientation": (1.0, 1.0, 0.0, 0.0)}, "has length 1"),
        ("target, tip", {"set": "p1-p5", "target": "a", "tip": (0, 0, 0.1)}, "only one of them can go to the poses"),
        ("target", {"set": "p1-p5", "target": "a"}, "there is no target"),
        (None, {"set": "p1-p5", "lowest": 5.0}, "reaches no cube"),
    ):
        refused(parameter, expected, package.poses, "irb120", **options)
    package.poses("irb120", "p1-p5", centre=(0.35, 0.0, 0.35), side=0.2, out=tmp_path / "p.csv")
    words = "a device finds its own configurations"
    asked = {"truth": "nominal", "poses": tmp_path / "p.csv", "device": "tracker"}
    refused(None, words, package.simulate, "irb120", **asked)
