"""Sphere tests as a job and a command: what they say, and what they refuse."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.expecting import known, refused

import truearm as package
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import Twin


def _bar(robot: Robot, count: int, noise: float) -> Dataset:
    """Lengths from the tool of a robot to a ball, and where it was taught."""
    rng = np.random.default_rng(3)
    joints = robot.random_configurations(count, rng)
    centre = np.array([0.3, 0.1, 0.2])
    at_ball = robot.inverse(centre, np.diag([1.0, -1.0, -1.0]), target="ball", frame="world").joints
    joints = np.concatenate([at_ball, joints])
    places = Twin(robot).frames(joints)["ball"][:, :3, 3]
    lengths = np.linalg.norm(places - centre, axis=1) + noise * rng.standard_normal(len(joints))
    lengths[[0, 5]] = np.nan
    number = np.arange(len(joints))
    return Dataset(
        source="bar.csv",
        labels=("taught", *(str(k) for k in number[1:])),
        joints=joints,
        joint_kinds=("revolute",) * 6,
        targets=("ball",),
        configuration=number,
        target=np.zeros(len(joints), dtype=np.intp),
        position=np.full((len(joints), 3), np.nan),
        distance=lengths,
        fixtures=("cup",),
        fixture=np.zeros(len(joints), dtype=np.intp),
    )


@pytest.fixture(scope="module")
def true() -> Robot:
    robot = package.load_robot("irb120")
    rng = np.random.default_rng(1)
    drawn = {
        p.name: p.value + p.prior * rng.standard_normal() for p in robot.parameters.values() if p.group == "geometry"
    }
    return robot.with_values(drawn).with_frames(robot.base, {"ball": (0.01, 0.0, 0.125)})


def test_a_sphere_is_judged_before_and_after_calibration(true: Robot) -> None:
    data = _bar(true, 40, 1e-6)
    result = package.sphere(true, data)
    (sphere,) = result.spheres
    assert (sphere.target, sphere.fixture, len(sphere.lengths), sphere.left_out) == ("ball", "cup", 39, 2)
    assert sphere.after.largest < 4e-6
    assert known(sphere.before).deviation > 0.2e-3
    assert result.summary()["spheres"][0]["nominal_mm"]["deviation"] > 0.2
    taught = package.sphere(true, data, taught_at="taught")
    assert taught.spheres[0].after.centre == pytest.approx([0.3, 0.1, 0.2], abs=1e-8)
    assert taught.spheres[0].after.largest < 4e-6
    errors, fitted = (known(each).errors for each in (taught.spheres[0].before, sphere.before))
    assert (errors**2).sum() > (fitted**2).sum()  # teaching had errors of its own
    assert "taught at configuration taught" in taught.lines()[0]
    alone = package.sphere("irb120", data, tip=(0.01, 0.0, 0.125))
    assert alone.spheres[0].before is None
    assert alone.spheres[0].after.deviation > 0.2e-3


def test_the_command_says_mean_deviation_and_largest(truearm: Truearm, true: Robot, tmp_path: Path) -> None:
    (tmp_path / "bar.csv").write_text(csv_text(_bar(true, 30, 1e-6)))
    run = truearm("sphere", "irb120", tmp_path / "bar.csv", "--tip", "10,0,125", "--out", tmp_path / "bar.html")
    assert run.code == 0, run.err
    assert "ball about cup, 29 readings, 2 beyond the range of the bar" in run.out
    assert "this robot  mean" in run.out
    assert "mm along" not in run.out
    assert "Measured less predicted distance of each reading" in (tmp_path / "bar.html").read_text()


def test_what_no_sphere_test_is_made_of_is_refused(true: Robot, tmp_path: Path) -> None:
    data = _bar(true, 30, 1e-6)
    refused("taught_at", "no configuration of this name", package.sphere, true, data, taught_at="x")
    without = replace(data, distance=np.full(31, np.nan))
    refused(None, "no distances of a ballbar", package.sphere, true, without)
    refused("data", "no target of this name; got 'ball'", package.sphere, "irb120", data)
    refused(None, "too few lengths", package.sphere, true, data.of_configurations([0, 1, 2, 3]))
    (tmp_path / "bar.csv").write_text(csv_text(data).replace("distance [mm]", "distance"))
    refused(None, "no unit is given", package.sphere, true, tmp_path / "bar.csv")
