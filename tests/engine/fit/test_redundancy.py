from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from tests.arms import ARMS
from tests.engine.robot.refusing import refused
from tests.simulated import campaign, more_of

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import Status, identify
from truearm.engine.fit.held import NOTHING_HELD, Held
from truearm.engine.fit.models import MODELS
from truearm.engine.fit.rounds import Redundant
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.twin import Twin

GEOMETRIC = {m.name: m for m in MODELS}["geometric"]


@pytest.mark.parametrize("name", ARMS)
def test_without_noise_dropping_finds_the_truth(name: str) -> None:
    twin, data = campaign(name, 60, 0.0, 11)
    fit = identify(load_robot(name), data, GEOMETRIC, redundancy="drop")
    assert fit.status is Status.CONVERGED
    unseen = more_of(twin, 100, 0.0, 12)
    assert errors_of(fit.robot, unseen).position_norms.max() < 1e-9

    named = {member for r in fit.redundancies for member in r.members}
    # the base's small rotations are stated against the closed form's orientation, so they are judged by the base
    others = [n for n in fit.robot.values if n not in named and not n.startswith("base_r")]
    for parameter in others:
        assert fit.robot.values[parameter] == pytest.approx(twin.robot.values[parameter], abs=1e-9), parameter


def test_enough_parameters_stay_outside_the_named_combinations_and_slides_of_parallel_axes_are_named_together() -> None:
    _, data = campaign("irb120", 60, 0.0, 11)
    fit = identify(load_robot("irb120"), data, GEOMETRIC, redundancy="drop")
    named = {member for r in fit.redundancies for member in r.members}
    assert {"theta_offset_4", "alpha_4", "a_4", "alpha_5", "a_5", "d_5"} <= set(fit.free.names) - named
    words = {r.dropped: r.combination for r in fit.redundancies}
    assert words["d_3"] == "d_3 - d_2"
    assert words["theta_offset_1"] == "theta_offset_1 - base_rz"
    assert words["d_1"] == "d_1 - base_z"


def test_a_combination_changes_no_prediction() -> None:
    twin, data = campaign("lrmate200ic", 60, 0.0, 5)
    robot = identify(load_robot("lrmate200ic"), data, GEOMETRIC, redundancy="drop")
    q = twin.robot.random_configurations(50, np.random.default_rng(0))
    for redundancy in robot.redundancies:
        names = list(redundancy.members)
        direction = np.array([redundancy.members[n] for n in names])
        for target in robot.robot.targets:
            linear, _ = robot.robot.jacobians(robot.robot.forward_kinematics(q, target.name), q, names)
            moved = np.einsum("p,pin->in", direction, linear)
            assert np.abs(moved).max() < 1e-6 * np.abs(direction[:, None, None] * linear).max() + 1e-14


def test_kr5_tilts_stay_free_between_its_nearly_parallel_axes() -> None:
    """Taking columns in one pass would hold ry_3 instead of a slide, and the fit would not reach the truth."""
    _, data = campaign("kr5", 60, 0.0, 11)
    dropped = {r.dropped for r in identify(load_robot("kr5"), data, GEOMETRIC, redundancy="drop").redundancies}
    assert {"rx_3", "ry_3"} & dropped == set()
    assert "z_3" in dropped


def standing_still(twin: Twin, data: Dataset, joints: list[int]) -> Dataset:
    """The readings with joints that never moved."""
    moved = data.joints.copy()
    moved[:, joints] = 0.3
    at = np.stack([twin.robot.world_poses(moved, t)[0] for t in data.targets], axis=1).reshape(-1, 3)
    return replace(data, joints=moved, position=at)


def test_too_few_equations_without_priors_are_refused_and_bounds_that_a_held_parameter_cannot_keep() -> None:
    _, data = campaign("irb120", 4, 0.0, 2)
    with refused("fewer equations than unknowns", "36 equations for 40 unknown", "at least 14", "`redundancy=prior`"):
        identify(load_robot("irb120"), data, GEOMETRIC, redundancy="drop")
    _, data = campaign("irb120", 40, 0.05e-3, 2)
    bounds = Bounds.model_validate(
        {"truearm": "truearm-bounds/1", "units": {"length": "mm", "angle": "deg"}, "between": {"d_3": [1, 2]}}
    )
    with refused("my.yaml, d_3: the bounds exclude the nominal value of a redundant"):
        identify(load_robot("irb120"), data, GEOMETRIC, redundancy="drop", bounds=bounds, bounds_file="my.yaml")


@pytest.mark.parametrize("still", [[0], [5], [3, 4, 5], [1, 2, 3, 4, 5]])
def test_joints_that_never_moved_are_a_loss_of_rank(still: list[int]) -> None:
    twin, data = campaign("irb120", 40, 0.05e-3, 2)
    data = standing_still(twin, data, still)
    for redundancy in get_args(Redundant):
        held = Held(twin.robot.base) if redundancy == "none" else NOTHING_HELD  # it needs something that is known
        fit = identify(load_robot("irb120"), data, GEOMETRIC, redundancy=redundancy, held=held)
        assert fit.status is Status.RANK_LOSS, redundancy
        assert fit.unobservable
        assert all(fit.parameter_status(name) == "not-determined" for name in fit.unobservable)
        if len(still) == 5:
            others = ("base", "target") if redundancy == "prior" else ("theta_offset_2",)
            assert any(name.startswith(others) for name in fit.unobservable), redundancy


def test_a_single_target_on_the_last_axis_leaves_honest_deviations() -> None:
    for seed in range(4):
        twin, data = campaign("irb120", 50, 0.05e-3, seed)
        single = replace(data.of_readings(data.target == 0), targets=("1",))
        fit = identify(load_robot("irb120"), single, GEOMETRIC, redundancy="drop")
        assert fit.status is Status.CONVERGED
        # to first order the held parameters' errors are absorbed by the named members; the others must be honest
        named = {member for r in fit.redundancies for member in r.members}
        for p in fit.robot.parameters.values():
            if p.deviation is not None and p.name not in named and not p.name.startswith("base_r"):
                assert abs(p.value - twin.robot.values[p.name]) < 5 * p.deviation, p.name
