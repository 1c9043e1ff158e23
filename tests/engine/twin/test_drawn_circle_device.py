"""The drawn circle as a device: what it reads of a twin, and what a calibration makes of that."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from papers.katana.robot import katana, published
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import MODELS
from truearm.engine.fit.problem import gauge_freedoms
from truearm.engine.fit.start_values import start_from_readings
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.devices.pencil import DRAWN_CIRCLE
from truearm.engine.twin.twin import Twin

GEOMETRIC = next(model for model in MODELS if model.name == "geometric")
STANDS = Transform((1.0, -0.4, 0.3), (0.8, 0.0, 0.6, 0.0))


def drawn(robot: Twin, count: int, seed: int = 0, sigma: float | None = 0.0) -> Dataset:
    return measured_with(DRAWN_CIRCLE, katana(), robot, count, np.random.default_rng(seed), sigma)


@cache
def exactly_drawn(seed: int) -> tuple[Twin, Dataset]:
    """Return a robot and what it drew, without noise."""
    truth = Twin(published("standard").with_frames(STANDS, {}))
    return truth, drawn(truth, 72, seed)


def test_a_perfect_robot_draws_the_circle_on_every_page() -> None:
    assert named_device("drawn-circle") is DRAWN_CIRCLE
    perfect = drawn(Twin(katana().with_frames(STANDS, {})), 30)
    others = [load_robot(name) for name in ("ur5", "kr5", "irb120")]
    rng = np.random.default_rng(0)
    for data in (perfect, *(measured_with(DRAWN_CIRCLE, robot, Twin(robot), 12, rng, 0.0) for robot in others)):
        assert data.distance is not None
        assert data.height is not None
        assert data.distance[::2] == pytest.approx(DRAWN_CIRCLE.radius, abs=1e-9)
        assert data.height[1::2] == pytest.approx(0.0, abs=1e-9)
        assert np.isnan(data.distance[1::2]).all()
        assert np.isnan(data.height[::2]).all()
    assert perfect.configurations == 30


def test_each_circle_is_one_way_round_a_page_in_one_posture() -> None:
    """Places of the pencil by the nominal robot: six circles of twelve points, two on each of three slopes."""
    robot = katana().with_frames(STANDS, {"pencil": (0.02, 0.01, 0.15)})
    data = drawn(Twin(robot), 72)
    places = robot.world_poses(data.joints, "pencil")[0].reshape(6, 12, 3)
    opposite = np.linalg.norm(places - np.roll(places, 1, axis=1), axis=2)
    assert opposite == pytest.approx(2 * DRAWN_CIRCLE.radius * np.sin(np.pi / 12), abs=1e-9)
    up = STANDS.rotation[:, 2]
    normals = np.array([np.cross(p[1] - p[0], p[2] - p[0]) for p in places])
    slopes = np.arccos(normals @ up / np.linalg.norm(normals, axis=1))
    assert slopes == pytest.approx(np.tile(DRAWN_CIRCLE.slopes, 2))
    moves = np.abs(np.diff(data.joints.reshape(6, 12, -1), axis=1))
    assert moves.max() < 1.5
    assert np.abs(data.joints[0] - data.joints[36]).max() > 0.05  # the second circle of the page: another posture
    low, high = np.array([joint.limits for joint in robot.joints]).T
    assert ((data.joints > low) & (data.joints < high)).all()


def test_what_is_read_is_where_the_true_pencil_is() -> None:
    """Distance and height of the twin's tip over the first page, by hand."""
    truth = Twin(published("standard").with_frames(STANDS, {"pencil": (0.02, 0.01, 0.15)}))
    device = replace(DRAWN_CIRCLE, centre=(0.0, -0.3, 0.14), slopes=(np.deg2rad(45.0),), circles=1)
    nominal = katana().with_frames(STANDS, {"pencil": (0.02, 0.01, 0.15)})
    data = device.campaign(nominal, truth, 12, 0.0, np.random.default_rng(1))
    tip = (truth.frames(data.joints)["pencil"][:, :3, 3] - STANDS.translation) @ STANDS.rotation - (0.0, -0.3, 0.14)
    height = tip @ np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0)  # rises away from the robot, which is towards -y
    assert data.distance is not None
    assert data.height is not None
    assert data.height[1::2] == pytest.approx(height, abs=1e-12)
    assert data.distance[::2] == pytest.approx(np.linalg.norm(tip, axis=1), abs=1e-12)
    assert np.abs(height).max() > 5e-5


def test_a_file_keeps_that_the_middle_of_each_circle_is_in_its_page(tmp_path: Path) -> None:
    data = drawn(Twin(katana().with_frames(STANDS, {})), 24)
    path = tmp_path / "drawn.csv"
    path.write_text(csv_text(data))
    again = read_csv(path)
    assert again.setup is not None
    assert again.setup.height is not None
    assert again.setup.height == pytest.approx(0.0)
    assert [again.setup.fixtures[f] for f in again.setup.against.tolist()] == ["paper_1", "paper_2"]
    assert [again.setup.targets[t] for t in again.setup.target.tolist()] == ["centre_1", "centre_2"]
    assert again.distance is not None
    assert again.distance[::2] == pytest.approx(DRAWN_CIRCLE.radius)


def test_readings_scatter_as_they_declare() -> None:
    robot = Twin(katana().with_frames(STANDS, {}))
    data = drawn(robot, 300, sigma=None)
    assert data.distance is not None
    assert data.height is not None
    assert data.sigma == pytest.approx(DRAWN_CIRCLE.sigma)
    off = (data.distance[::2] - DRAWN_CIRCLE.radius, data.height[1::2])
    assert [float(np.std(o)) for o in off] == pytest.approx([DRAWN_CIRCLE.sigma] * 2, rel=0.15)


def test_without_noise_the_true_robot_is_found() -> None:
    """Up to a rigid motion; seed 3 has pages whose heights alone would be explained from below as well."""
    for seed in (0, 3):
        truth, data = exactly_drawn(seed)
        fit = identify(katana(), data, GEOMETRIC, redundancy="drop")
        assert fit.unobservable == ()
        assert max(fit.sigma.values()) < 1e-8
        for name in ("a_3", "a_4", "theta_offset_2", "theta_offset_3", "beta_3"):
            assert fit.robot.values[name] == pytest.approx(truth.robot.values[name], abs=1e-7), (seed, name)
        assert gauge_freedoms(data) == ("base",)


def test_pages_start_with_the_pencil_above_them() -> None:
    """Heights of a robot that was led along a page are its errors: they say nothing of which side it is on."""
    for seed in (1, 3):
        start = start_from_readings(katana(), exactly_drawn(seed)[1])
        up = [float(start.fixture_kinematics(f"paper_{k}").matrix()[0][2, 2]) for k in (1, 2, 3)]
        assert up == pytest.approx(np.cos(DRAWN_CIRCLE.slopes), abs=0.1), seed
        middles = np.array([[start.values[f"fixture_centre_{k}_{a}"] for a in "xyz"] for k in range(1, 7)])
        assert np.abs(middles - middles.mean(axis=0)).max() < 0.02, seed


def test_a_circle_that_no_arm_comes_round_is_refused() -> None:
    robot = Twin(katana())
    device = replace(DRAWN_CIRCLE, radius=0.45, circles=1)
    with pytest.raises(InputError, match=r"katana450 (cannot follow|does not reach)"):
        measured_with(device, katana(), robot, 3, np.random.default_rng(0))
