"""What is checked of readings against fixtures: every check fires on a corrupted copy and is silent on clean data."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.expecting import known, refused

from truearm.calibration.calibrate import calibrate
from truearm.checking.check import check
from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.advice import check_fit
from truearm.engine.diagnose.entry_errors import quick_misfit
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
    return replace(twin, robot=twin.robot.with_frames(twin.robot.base, tool.targets if tool else {})), data


def codes(data: Dataset) -> dict[str, str]:
    return {notice.code: notice.message for notice in check(ROBOT, data).warnings}


def test_clean_data_are_believed() -> None:
    for device in ("ballbar", "strings", "plane", "two-spheres", "point", "gauges", "drawn-circle"):
        assert codes(campaign(device)[1]) == {}, device


def with_a_misspelled_fixture(data: Dataset) -> Dataset:
    fixture = data.against.copy()
    fixture[7] = len(data.fixtures)
    return replace(data, fixture=fixture, fixtures=(*data.fixtures, "cup1"))


def test_mistakes_of_a_ballbar_are_named() -> None:
    data = campaign("ballbar")[1]
    length, some = known(data.distance), data.of_configurations(range(0, data.configurations, 2))
    for wrong, code, words in (
        (replace(data, distance=length / 1e3), "unit-length", "The lengths are a thousand times too small"),
        (replace(data, distance=length + np.where(np.arange(len(length)) == 17, 5e-3, 0.0)), "outliers", "18/ball (5"),
        (replace(some, joints=some.joints * [1, -1, 1, 1, 1, 1]), "joint-sign", "sign of joint 2"),
        (
            with_a_misspelled_fixture(data),
            "fixtures-unlikely",
            "fixture cup1: a fixture was measured too few times",
        ),
    ):
        assert words in codes(wrong)[code]


def test_a_misspelled_fixture_is_refused_with_its_likeness() -> None:
    data = with_a_misspelled_fixture(campaign("ballbar")[1])
    words = r"fixture cup1.*got '1 reading among 60.*Did you mean cup_1"
    refused(None, words, calibrate, ROBOT, data, train="all")


def test_rows_in_another_order_are_not_called_a_joint_in_another_unit() -> None:
    """A joint that would hardly move lets any sphere fit a little better."""
    data = campaign("ballbar")[1]
    messages = codes(replace(data, joints=data.joints[::-1].copy()))
    assert ("unit-angle" in messages, "fixtures-unlikely" in messages) == (False, True)


def test_right_signs_fit_and_a_wrong_one_does_not() -> None:
    for device in ("ballbar", "two-spheres"):
        data = campaign(device)[1]
        mirrored = replace(data, joints=data.joints * [1, -1, 1, 1, 1, 1])
        assert known(quick_misfit(ROBOT, data)) < 2e-3, device
        assert known(quick_misfit(ROBOT, mirrored)) > 15e-3, device
    for device in ("tracker", "plane", "point", "strings"):
        assert quick_misfit(ROBOT, campaign(device)[1]) is None, device


def test_anchors_that_stand_elsewhere_are_named() -> None:
    _, data = campaign("strings")
    setup = known(data.setup)
    moved = setup.position.copy()
    moved[3, 0] += 5e-3
    messages = codes(replace(data, setup=replace(setup, position=moved)))
    assert list(messages) == ["fixture-misplaced"]
    assert "string_4 by 5.0" in messages["fixture-misplaced"]
    swapped = replace(setup, position=setup.position[[0, 1, 3, 2]])
    assert list(codes(replace(data, setup=swapped))) == ["fixtures-unlikely"]


def test_strings_from_unknown_points_are_a_closed_loop() -> None:
    """Four strings in turn: whatever part of the readings a search looks at, every string must be in it."""
    for count in (40, 80):
        fit = identify(ROBOT, replace(campaign("strings", count)[1], setup=None), GEOMETRIC)
        assert (fit.gauge_freedoms, fit.excess) == (("base",), 1.0), count


def test_targets_read_by_one_of_several_instruments_are_not_missing() -> None:
    _, data = campaign("ballbar")
    extra = replace(data, target=np.r_[data.target[:-5], np.ones(5, dtype=np.intp)], targets=("ball", "other"))
    assert "missing" not in {notice.code for notice in check(extra).warnings}


def test_a_robot_of_a_closed_loop_does_not_know_where_an_instrument_stands() -> None:
    _, data = campaign("ballbar")
    calibrated = calibrate(ROBOT, data, train=45).robot
    assert validate(calibrated, data).length is not None
    frames = replace(data, distance=None, fixture=None, fixtures=(), position=np.zeros((len(data.target), 3)))
    refused(None, r"calibrated without the frame of an instrument.*`model=frames`", validate, calibrated, frames)


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


def test_readings_beyond_the_range_of_a_device_are_named() -> None:
    assert check(campaign("plane")[1], device="plane").warnings == ()  # which has no range
    for device in ("ballbar", "gauges", "five-lasers", "stereo", "measurement-arm"):
        _, data = campaign(device)
        assert check(data, device=device).warnings == (), device
        if data.distance is not None:
            far = replace(data, distance=data.distance + np.where(np.arange(len(data.distance)) == 4, 2.5e-3, 0.0))
        else:
            moved = np.where(np.arange(len(data.target))[:, None] == 4, 4.0, 0.0)
            far = replace(data, position=data.position + moved)
        (message,) = (notice.message for notice in check(far, device=device).warnings if notice.code == "beyond-range")
        assert f"1 reading is beyond what the device {device} can read (configuration/target): 5/" in message


def test_stereo_cameras_read_a_sphere_larger_than_the_cube_that_is_used_of_it() -> None:
    _, data = campaign("stereo")
    for away, named in ((1.9e-3, 0), (2.1e-3, 1)):
        position = data.position.copy()
        position[3] = (0.0, away, 0.0)
        assert len(check(replace(data, position=position), device="stereo").warnings) == named
