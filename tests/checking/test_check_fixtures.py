"""What is checked of readings against fixtures: every check fires on a corrupted copy and is silent on clean data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from truearm.calibration.calibrate import calibrate
from truearm.checking.check import check
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.advice import check_fit
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import MODELS
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import rigid_motion
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import measured_with
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin
from truearm.validation.jobs import validate

ROBOT = load_robot("irb120")
GEOMETRIC = {m.name: m for m in MODELS}["geometric"]


@cache
def campaign(device: str, count: int = 60, seed: int = 0) -> tuple[Twin, Dataset]:
    rng = np.random.default_rng(seed)
    twin = truth_twin(ROBOT, "random", rng)
    data = measured_with(named_device(device), ROBOT, twin, count, rng)
    tool = named_device(device).tool
    assert tool is not None
    return replace(twin, robot=twin.robot.with_frames(twin.robot.base, tool.targets)), data


def codes(data: Dataset) -> dict[str, str]:
    return {notice.code: notice.message for notice in check(ROBOT, data).warnings}


@pytest.mark.parametrize("device", ["ballbar", "strings", "plane", "two-spheres", "point", "gauges", "drawn-circle"])
def test_clean_data_are_believed(device: str) -> None:
    assert codes(campaign(device)[1]) == {}


def in_other_units(data: Dataset) -> Dataset:
    assert data.distance is not None
    return replace(data, distance=data.distance / 1e3)


def with_an_outlier(data: Dataset) -> Dataset:
    assert data.distance is not None
    return replace(data, distance=data.distance + np.where(np.arange(len(data.distance)) == 17, 5e-3, 0.0))


def with_a_joint_turned(data: Dataset) -> Dataset:
    some = data.of_configurations(range(0, data.configurations, 2))
    return replace(some, joints=some.joints * [1, -1, 1, 1, 1, 1])


def with_a_misspelled_fixture(data: Dataset) -> Dataset:
    fixture = data.against.copy()
    fixture[7] = len(data.fixtures)
    return replace(data, fixture=fixture, fixtures=(*data.fixtures, "cup1"))


@pytest.mark.parametrize(
    ("corrupt", "code", "words"),
    [
        (in_other_units, "unit-length", "The lengths are a thousand times too small"),
        (with_an_outlier, "outliers", "18/ball (5"),
        (with_a_joint_turned, "joint-sign", "sign of joint 2"),
        (with_a_misspelled_fixture, "fixtures-unlikely", "fixture cup1: a fixture was measured too few times"),
    ],
)
def test_mistakes_of_a_ballbar_are_named(corrupt: Callable[[Dataset], Dataset], code: str, words: str) -> None:
    found = codes(corrupt(campaign("ballbar")[1]))
    assert code in found
    assert words in found[code]


def test_anchors_that_stand_elsewhere_are_named() -> None:
    _, data = campaign("strings")
    assert data.setup is not None
    moved = data.setup.position.copy()
    moved[3, 0] += 5e-3
    found = codes(replace(data, setup=replace(data.setup, position=moved)))
    assert list(found) == ["fixture-misplaced"]
    assert "string_4 by 5.0" in found["fixture-misplaced"]
    swapped = replace(data.setup, position=data.setup.position[[0, 1, 3, 2]])
    assert list(codes(replace(data, setup=swapped))) == ["fixtures-unlikely"]


def test_a_misspelled_fixture_is_refused_with_its_likeness() -> None:
    data = with_a_misspelled_fixture(campaign("ballbar")[1])
    with pytest.raises(InputError, match=r"fixture cup1.*got '1 reading among 60.*Did you mean cup_1"):
        calibrate(ROBOT, data, train="all")


@pytest.mark.parametrize("count", [40, 80])
def test_strings_from_unknown_points_are_a_closed_loop(count: int) -> None:
    """Four strings in turn: whatever part of the readings a search looks at, every string must be in it."""
    _, data = campaign("strings", count)
    fit = identify(ROBOT, replace(data, setup=None), GEOMETRIC)
    assert fit.gauge_freedoms == ("base",)
    assert fit.excess == 1.0


def test_targets_read_by_one_of_several_instruments_are_not_missing() -> None:
    _, data = campaign("ballbar")
    extra = replace(data, target=np.r_[data.target[:-5], np.ones(5, dtype=np.intp)], targets=("ball", "other"))
    assert "missing" not in {notice.code for notice in check(extra).warnings}


def test_a_robot_of_a_closed_loop_does_not_know_where_an_instrument_stands() -> None:
    _, data = campaign("ballbar")
    calibrated = calibrate(ROBOT, data, train=45).robot
    assert validate(calibrated, data).length is not None
    frames = replace(data, distance=None, fixture=None, fixtures=(), position=np.zeros((len(data.target), 3)))
    with pytest.raises(InputError, match=r"calibrated without the frame of an instrument.*`model=frames`"):
        validate(calibrated, frames)


@pytest.mark.parametrize("device", ["ballbar", "gauges", "two-spheres", "plane"])
def test_the_stated_accuracy_of_positions_is_true(device: str) -> None:
    """The figure of the note against true positions anywhere, best rigid motion taken out: within 3 times.

    Three robots each; what a figure for the mean leaves to chance is in the factor.
    """
    stated, true = [], []
    for seed in (1, 2, 3):
        twin, data = campaign(device, 60, seed)
        fit = identify(ROBOT, data, GEOMETRIC)
        (notice,) = (n for n in check_fit(fit, expected_error(fit)) if n.code == "closed-loop")
        stated.append(float(notice.message.split("accurate to about ")[1].split(" mm")[0]))
        q = ROBOT.random_configurations(150, np.random.default_rng(seed))
        at = twin.frames(q)[data.targets[0]][:, :3, 3]
        got = fit.robot.world_poses(q, data.targets[0])[0]
        R, t = rigid_motion(got, at)
        true.append(1e3 * float(np.linalg.norm(got @ R.T + t - at, axis=1).mean()))
    assert 1 / 3 < np.mean(true) / np.mean(stated) < 3


@pytest.mark.parametrize("device", ["ballbar", "gauges", "five-lasers", "stereo", "measurement-arm"])
def test_readings_beyond_the_range_of_a_device_are_named(device: str) -> None:
    _, data = campaign(device)
    assert check(data, device=device).warnings == ()
    if data.distance is not None:
        far = replace(data, distance=data.distance + np.where(np.arange(len(data.distance)) == 4, 2.5e-3, 0.0))
    else:
        moved = np.where(np.arange(len(data.target))[:, None] == 4, 4.0, 0.0)
        far = replace(data, position=data.position + moved)
    found = [notice.message for notice in check(far, device=device).warnings if notice.code == "beyond-range"]
    assert len(found) == 1
    assert f"1 reading is beyond what the device {device} can read (configuration/target): 5/" in found[0]


def test_a_device_without_a_range_reads_all() -> None:
    _, data = campaign("plane")
    assert check(data, device="plane").warnings == ()


def test_stereo_cameras_read_a_sphere_larger_than_the_cube_that_is_used_of_it() -> None:
    _, data = campaign("stereo")
    for away, named in ((1.9e-3, 0), (2.1e-3, 1)):
        position = data.position.copy()
        position[3] = (0.0, away, 0.0)
        assert len(check(replace(data, position=position), device="stereo").warnings) == named
