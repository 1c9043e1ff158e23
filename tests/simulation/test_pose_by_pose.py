from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.katana import UNIT, drawn, katana, readings, values

from papers.katana.robot import NAMES, PERTURBATIONS, UNITS
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import Twin
from truearm.simulation.influences import (
    Combination,
    PoseByPose,
    influence,
    influence_based,
    least_squares,
    minimum_norm,
)

NOISE = 1e-5
Method = Callable[..., PoseByPose]


def standard(robot: Robot, data: Dataset, **options: Any) -> PoseByPose:
    return minimum_norm(robot, data, NAMES, "tip", units=UNITS, **options)


def by_influence(robot: Robot, data: Dataset, **options: Any) -> PoseByPose:
    return influence_based(robot, data, NAMES, "tip", units=UNITS, perturbations=PERTURBATIONS, **options)


BOTH = pytest.mark.parametrize("method", [standard, by_influence])


def tilting(robot: Robot) -> Robot:
    """Return the robot with tables 4.3 and 4.4 and a softness of 1e-4 rad/(N m)."""
    tilt, gap = (0.022, 0.024, 0.017, 0.015, 0.018), (0.063, 0.061, 0.057, 0.046, 0.051)
    effects = robot.with_effects(["compliance", "clearance", "backlash"])
    known = {f"compliance_{i}": 1e-4 for i in range(1, 6)}
    known |= {f"clearance_{i}": math.radians(a) for i, a in enumerate(tilt, 1)}
    known |= {f"backlash_{i}": math.radians(a) / 2 for i, a in enumerate(gap, 1)}
    return effects.with_values(known)


def with_set(robot: Robot, vector: Array) -> Robot:
    return robot.with_values(dict(zip(NAMES, vector, strict=True)))


def mean_error(robot: Robot, data: Dataset) -> float:
    spread = errors_of(robot, data).position
    assert spread is not None
    return spread.mean


@BOTH
def test_each_set_explains_its_own_pose(method: Method) -> None:
    """Judged by the twin, whose frames are products of matrices."""
    data = readings(drawn(1.0, 1), 12, NOISE, 1)
    identified = method(katana(), data)
    assert identified.converged.all()
    assert identified.sets.shape == (12, 17)
    assert (identified.iterations >= 1).all()
    for reading, position, vector, left in zip(
        data.joints, data.position, identified.sets, identified.left, strict=True
    ):
        tip = Twin(with_set(katana(), vector)).target_frames(reading)["tip"][:3, 3]
        assert np.linalg.norm(tip - position) < 1e-5
        assert np.linalg.norm(tip - position) == pytest.approx(left, abs=1e-12)


@BOTH
def test_poses_together_are_what_each_pose_gives_alone(method: Method) -> None:
    """The poses are one trial with other values at each configuration, through joint effects too."""
    robot = tilting(katana())
    data = readings(drawn(1.0, 2), 8, NOISE, 2)
    together = method(robot, data)
    for pose in range(8):
        alone = method(robot, data.of_configurations([pose]))
        np.testing.assert_allclose(together.sets[pose], alone.sets[0], rtol=0, atol=1e-13)
        assert together.iterations[pose] == alone.iterations[0]


def position_jacobian(robot: Robot, data: Dataset) -> tuple[Array, Array]:
    """Return position errors ``(n, 3)`` and Jacobians ``(n, 3, 17)`` by central differences of the twin."""
    J = np.empty((len(data.joints), 3, len(NAMES)))
    start, step = values(robot), 1e-5
    for column in range(len(NAMES)):
        ends = [Twin(with_set(robot, start + sign * step * np.eye(17)[column])) for sign in (1, -1)]
        for pose, reading in enumerate(data.joints):
            after, before = (twin.target_frames(reading)["tip"][:3, 3] for twin in ends)
            J[pose, :, column] = (after - before) / (2 * step)
    tips = [Twin(robot).target_frames(reading)["tip"][:3, 3] for reading in data.joints]
    return data.position - tips, J


def test_small_errors_are_given_the_smallest_step_in_rad_and_mm() -> None:
    data = readings(drawn(1e-3, 3), 5, 0.0, 3)
    identified = standard(katana(), data, tolerance=1e-13)
    for error, J, vector in zip(*position_jacobian(katana(), data), identified.sets, strict=True):
        counted = J * UNIT
        expected = UNIT * (counted.T @ np.linalg.solve(counted @ counted.T, error))
        np.testing.assert_allclose((vector - values(katana())) / UNIT, expected / UNIT, rtol=0, atol=1e-9)
        assert np.abs(expected / UNIT).max() > 1e-7


@pytest.mark.parametrize("damping", [0.2, 0.5, 1.0])
def test_small_errors_end_where_steps_weighted_by_influence_are_smallest(damping: float) -> None:
    """And C changes the number of iterations only."""
    data = readings(drawn(1e-3, 4), 5, 0.0, 4)
    identified = by_influence(katana(), data, tolerance=1e-13, damping=damping)
    k = influence(katana(), data.joints, NAMES, "tip", PERTURBATIONS).vector.T
    for error, J, weight, vector in zip(*position_jacobian(katana(), data), k, identified.sets, strict=True):
        counted = J * UNIT
        expected = weight * (counted.T @ np.linalg.solve((counted * weight) @ counted.T, error))
        np.testing.assert_allclose((vector - values(katana())) / UNIT, expected, rtol=0, atol=1e-9)
        assert np.abs(expected).max() > 1e-7


def test_more_damping_takes_more_iterations() -> None:
    data = readings(drawn(1.0, 4), 10, NOISE, 4)
    slow, fast = (by_influence(katana(), data, damping=C).iterations for C in (0.2, 0.8))
    assert (slow > 2 * fast).all()


def test_lengths_hardly_move_in_rad_and_mm_and_do_in_units_of_their_priors() -> None:
    """The explanation of tables 3.2 and 3.3, where lengths change by 0.000 to 0.010 mm."""
    data = readings(drawn(1.0, 5), 30, NOISE, 5)
    lengths = [NAMES.index(name) for name in ("a_3", "a_4", "d_5", "target_tip_z")]
    start = values(katana())
    priors = {
        n: 1e-3 if i in lengths else math.radians(0.1) * u for i, (n, u) in enumerate(zip(NAMES, UNIT, strict=True))
    }
    in_rad_and_mm = np.abs(standard(katana(), data).sets - start)[:, lengths]
    as_machined = np.abs(minimum_norm(katana(), data, NAMES, "tip", units=priors).sets - start)[:, lengths]
    assert in_rad_and_mm.max() < 1.5e-5
    assert as_machined.mean() > 2e-4


@BOTH
def test_the_robot_has_the_mean_of_the_sets(method: Method) -> None:
    start = katana()
    known = replace(start.parameters["a_3"], deviation=1e-5, informed=0.5)
    identified = method(start.with_parameters([known]), readings(drawn(1.0, 6), 9, NOISE, 6))
    np.testing.assert_allclose(values(identified.robot), identified.sets.mean(axis=0), rtol=0, atol=1e-15)
    assert identified.robot.parameters["a_3"].deviation is None
    assert identified.robot.parameters["a_3"].informed is None
    fixed = set(identified.robot.parameters) - set(NAMES)
    assert all(identified.robot.values[name] == start.values[name] for name in fixed)
    assert "9 poses one at a time" in identified.robot.history[-1]


@BOTH
def test_the_best_pose_is_the_one_whose_set_fits_all_poses_best(method: Method) -> None:
    data = readings(drawn(1.0, 7), 9, NOISE, 7)
    identified = method(katana(), data, combination="best-pose")
    errors = [mean_error(with_set(katana(), vector), data) for vector in identified.sets]
    np.testing.assert_array_equal(values(identified.robot), identified.sets[int(np.argmin(errors))])
    assert mean_error(identified.robot, data) == min(errors)


@BOTH
def test_the_scale_of_the_mean_is_the_one_that_fits_best(method: Method) -> None:
    data = readings(drawn(1.0, 8), 20, NOISE, 8)
    identified = method(katana(), data, combination="scaled-mean")
    start, mean = values(katana()), identified.sets.mean(axis=0)
    along, taken = mean - start, values(identified.robot) - start
    scale = float(along @ taken / (along @ along))
    np.testing.assert_allclose(taken, scale * along, rtol=0, atol=1e-15)
    assert scale > 1.2
    best = np.sum(errors_of(identified.robot, data).position_errors ** 2)
    for other in (0.99 * scale, 1.01 * scale, 1.0):
        assert np.sum(errors_of(with_set(katana(), start + other * along), data).position_errors ** 2) > best


@pytest.mark.parametrize("combination", ["mean", "scaled-mean", "best-pose"])
@BOTH
def test_least_squares_beats_one_pose_at_a_time_on_unseen_poses(method: Method, combination: Combination) -> None:
    for seed in range(3):
        true = drawn(1.0, seed)
        data, unseen = readings(true, 118, NOISE, seed), readings(true, 100, NOISE, 100 + seed)
        before = mean_error(katana(), unseen)
        one_at_a_time = mean_error(method(katana(), data, combination=combination).robot, unseen)
        together = mean_error(least_squares(katana(), data, NAMES, "tip"), unseen)
        assert one_at_a_time < before
        assert together < 0.1 * one_at_a_time
        assert together < 1.15 * math.sqrt(8 / math.pi) * NOISE  # the mean norm of the noise alone


@BOTH
def test_again_from_the_mean_comes_closer(method: Method) -> None:
    true = drawn(1.0, 0)
    data, unseen = readings(true, 60, NOISE, 0), readings(true, 60, NOISE, 9)
    robot, errors = katana(), [mean_error(katana(), unseen)]
    for _ in range(5):
        robot = method(robot, data).robot
        errors.append(mean_error(robot, unseen))
    assert (np.diff(errors) < 0).all()
    assert errors[-1] < 0.6 * errors[1]


@BOTH
def test_what_is_not_named_is_held_at_what_is_known(method: Method) -> None:
    """Tilting is compensated by starting from a robot that has it."""
    known = tilting(katana())
    q = known.random_configurations(10, np.random.default_rng(1))
    data = replace(readings(katana(), 10, 0.0, 1), joints=q, position=known.world_poses(q, "tip")[0])
    compensated = method(known, data, combination="scaled-mean")
    assert (compensated.iterations == 0).all()
    np.testing.assert_array_equal(values(compensated.robot), values(katana()))
    assert compensated.robot.values["clearance_2"] == known.values["clearance_2"] != 0.0
    assert (method(katana(), data).iterations > 0).all()


@BOTH
def test_geometry_is_found_beneath_known_tilting(method: Method) -> None:
    true = tilting(drawn(1.0, 3))
    rng = np.random.default_rng(3)
    q, unseen = true.random_configurations(60, rng), true.random_configurations(60, rng)
    data = replace(readings(katana(), 60, 0.0, 1), joints=q, position=true.world_poses(q, "tip")[0])
    judged = replace(data, joints=unseen, position=true.world_poses(unseen, "tip")[0])
    starts = katana(), tilting(katana())
    without, compensated = (mean_error(method(r, data, combination="scaled-mean").robot, judged) for r in starts)
    assert compensated < without
    without, compensated = (mean_error(least_squares(r, data, NAMES, "tip"), judged) for r in starts)
    assert compensated < 1e-6
    assert without > 3e-4


def test_only_positions_of_the_target_count() -> None:
    true = drawn(1.0, 2)
    data = readings(true, 6, NOISE, 2)
    position = np.concatenate([data.position, data.position + 1.0])
    position[1] = np.nan
    both = replace(
        data,
        targets=("tip", "other"),
        configuration=np.tile(data.configuration, 2),
        target=np.repeat([0, 1], 6),
        position=position,
        sigma=np.full(12, NOISE),
    )
    identified = standard(katana(), both)
    np.testing.assert_array_equal(identified.sets, standard(katana(), data.of_configurations([0, 2, 3, 4, 5])).sets)
    alone = least_squares(katana(), data.of_configurations([0, 2, 3, 4, 5]), NAMES, "tip")
    np.testing.assert_array_equal(values(least_squares(katana(), both, NAMES, "tip")), values(alone))


def test_readings_without_declared_deviation_count_with_that_of_the_document() -> None:
    data = readings(drawn(1.0, 3), 20, NOISE, 3)
    undeclared = least_squares(katana(), replace(data, sigma=None), NAMES, "tip")
    np.testing.assert_array_equal(values(undeclared), values(least_squares(katana(), data, NAMES, "tip")))


def test_a_pose_that_the_parameters_cannot_explain_says_so() -> None:
    data = readings(drawn(1.0, 4), 3, 0.0, 4)
    identified = minimum_norm(katana(), data, ["theta_offset_1"], "tip")
    assert not identified.converged.any()
    assert (identified.left > 1e-5).all()
    for reading, position, (theta,), left in zip(
        data.joints, data.position, identified.sets, identified.left, strict=True
    ):
        for other in (theta - 1e-4, theta, theta + 1e-4):  # as close as the parameter gets
            tip = Twin(katana().with_values({"theta_offset_1": other})).target_frames(reading)["tip"][:3, 3]
            assert np.linalg.norm(tip - position) > left - 1e-9


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"damping": 0.0}, "damping coefficient C.*got 0.0.*allowed: above 0, at most 1"),
        ({"damping": 1.01}, "damping coefficient C"),
        ({"damping": math.nan}, "damping coefficient C"),
        ({"tolerance": 0.0}, "tolerance is no size"),
        ({"tolerance": math.inf}, "tolerance is no size"),
        ({"units": {"a_3": -1e-3}}, "a_3: the unit is no size"),
        ({"units": {"a_2": 1e-3}}, "the unit is of a parameter that is not named.*a_2"),
        ({"perturbations": {"a_2": 1e-3}}, "the perturbation is of a parameter that is not named"),
        ({"names": ["a_3", "gain_1"]}, "gain_1: the document has no unit"),
        ({"names": ["a3"]}, "no such parameter.*Did you mean a_3"),
        ({"names": []}, "no parameter is named"),
        ({"target": "top"}, "no target of this name.*tip"),
    ],
)
def test_what_cannot_be_identified_is_refused(options: dict[str, Any], message: str) -> None:
    robot = katana().with_effects(["gain"])
    data = readings(katana(), 3, NOISE, 0)
    with pytest.raises(InputError, match=message):
        influence_based(robot, data, **{"names": ["a_3", "theta_offset_1", "alpha_2"], "target": "tip"} | options)


@pytest.mark.parametrize("method", [minimum_norm, influence_based, least_squares])
def test_a_target_without_positions_is_refused(method: Callable[..., object]) -> None:
    data = readings(katana(), 3, NOISE, 0)
    elsewhere = katana().with_frames(katana().base, {"tip": (0, 0, 0), "second": (0.1, 0, 0)})
    for unseen in (data, replace(data, targets=("second",), position=np.full((3, 3), np.nan))):
        with pytest.raises(InputError, match=r"no position reading of this target.*second"):
            method(elsewhere, unseen, ["a_3", "a_4", "d_5"], "second")
