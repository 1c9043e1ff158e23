"""What is stated of robots that nothing locates, against their true errors up to the place of the base.

A touched point tells the shape of an arm and not its scale. Whoever uses the robot notices the scale all the same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from truearm.engine.data.dataset import Dataset
from truearm.engine.diagnose.advice import check_fit
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rigid_motion
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import in_view_of, measured_with, seen_by
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin

IRB120 = load_robot("irb120")
GEOMETRIC = named_model("geometric")


def made_to(rng: np.random.Generator) -> Robot:
    """Return an arm whose parameters are all wrong, by 0.1 to 0.5 mm and 0.02 to 0.1 deg."""
    wrong = {}
    for p in IRB120.parameters.values():
        if p.group in ("geometry", "joint zero"):
            low, high = (1e-4, 5e-4) if p.unit == "m" else np.radians([0.02, 0.1])
            wrong[p.name] = p.value + float(rng.choice([-1, 1]) * rng.uniform(low, high))
    return IRB120.with_values(wrong)


def measured(device: str, truth: str, poses: int, seed: int) -> tuple[Twin, Dataset]:
    """Return a twin and what a device reads of it."""
    rng, instrument = np.random.default_rng((poses, seed)), named_device(device)
    twin = truth_twin(IRB120, made_to(rng) if truth == "made" else truth, rng)
    twin = replace(twin, robot=in_view_of(instrument, twin.robot))
    data = measured_with(instrument, IRB120, twin, poses, rng)
    return seen_by(instrument, IRB120, twin)[0], data


def true_error(fit: Fit, twin: Twin) -> float:
    """Return the mean error all over the limits [m], behind the best rigid motion where nothing locates the robot."""
    q = IRB120.random_configurations(200, np.random.default_rng(99))
    frames = twin.frames(q)
    values = np.concatenate([fit.robot.world_poses(q, t.name)[0] for t in fit.robot.targets])
    true = np.concatenate([frames[t.name][:, :3, 3] for t in fit.robot.targets])
    if fit.gauge_freedoms:
        R, t = rigid_motion(values, true)
        values = values @ R.T + t
    return float(np.linalg.norm(values - true, axis=1).mean())


def stated_and_true(device: str, truth: str) -> Array:
    """Return the stated mean, the ends of its interval and the true error of twelve robots, ``(4, robots)`` [m]."""
    pairs = []
    for seed in range(12):
        twin, data = measured(device, truth, 60, seed)
        fit = identify(IRB120, data, GEOMETRIC)
        stated = expected_error(fit).overall
        pairs.append([stated.mean, *stated.interval_90, true_error(fit, twin)])
    return np.array(pairs).T


@pytest.mark.parametrize("device", ["point", "plane", "two-sockets", "ballbar", "strings", "tracker"])
def test_the_error_stated_over_the_workspace_holds(device: str) -> None:
    """Of twelve intervals of 90 % seven hold or more, with a probability of 0.9995, whatever sees the robot."""
    mean, low, high, true = stated_and_true(device, "random")
    assert np.sum((low <= true) & (true <= high)) >= 7
    assert 0.4 < np.median(true / mean) < 1.6


@pytest.mark.parametrize("device", ["point", "two-sockets"])
def test_no_more_than_stated_is_wrong_where_the_arm_is_better_than_its_priors(device: str) -> None:
    mean, _, high, true = stated_and_true(device, "made")
    assert np.sum(true <= high) >= 10
    assert np.median(true / mean) < 1.2


@pytest.mark.parametrize("device", ["point", "plane", "strings"])
def test_a_robot_is_not_shrunk_by_many_readings_that_do_not_tell_its_size(device: str) -> None:
    twin, data = measured(device, "nominal", 250, 0)
    assert true_error(identify(IRB120, data, GEOMETRIC), twin) < 0.1e-3


def test_priors_hold_the_size_that_nothing_tells() -> None:
    twin, data = measured("point", "random", 60, 0)
    fit = identify(IRB120, data, GEOMETRIC)
    lengths = [p for p in (fit.robot.parameters[name] for name in fit.free.names) if p.unit == "m"]
    grown = np.array([p.value / p.prior for p in lengths])
    off = np.array([(p.value - p.nominal) / p.prior for p in lengths])
    assert abs(grown @ off) / np.linalg.norm(grown) < 0.05  # in deviations of the size that the priors allow
    assert true_error(fit, twin) < 4e-3


def test_the_note_says_what_the_error_is_with_the_scale_and_without() -> None:
    for device, has_note in (("point", True), ("two-sockets", False)):
        _, data = measured(device, "random", 60, 1)
        fit = identify(IRB120, data, GEOMETRIC)
        expected = expected_error(fit)
        (note,) = (n.message for n in check_fit(fit, expected) if n.code == "closed-loop")
        assert (
            f"accurate to about {expected.overall.mean * 1e3:.2g} mm on average, up to the unknown base pose." in note
        )
        assert ("No length was measured either" in note) is has_note
        assert expected.frame == "the robot's base frame, up to its pose"
        if has_note:
            assert f"would be {expected.without_scale.mean * 1e3:.2g} mm" in note
            assert expected.without_scale.mean < 0.2 * expected.overall.mean
        else:
            assert expected.without_scale == expected.overall
