"""Tilt, backlash and stiffness from changes of inclination: the twin's constants come back, and how sure they are."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from tests.tilting import DEGREE, RESOLUTION, TRUTH, tilting_katana

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.inclinations import InclinometerReadings, Pairs, deviation_of_change
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import MODELS
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rotation_from_quaternion
from truearm.engine.twin.twin import Twin, measure
from truearm.inclinometers.fit import TiltingFit, calibrate_tilting
from truearm.inclinometers.pairs import TiltingPlan, compare, inclinations, measure_pairs, plan_tilting

KATANA = load_robot("katana450")


@cache
def plan(force: float = 20.0, move: float = 0.0, posed: int = 8) -> TiltingPlan:
    deviation = deviation_of_change(RESOLUTION)
    return plan_tilting(KATANA, np.random.default_rng(1), deviation=deviation, force=force, move=move, posed=posed)


@cache
def campaign(truth: str, seed: int, resolution: float = RESOLUTION) -> tuple[InclinometerReadings, Dataset]:
    twin, rng = tilting_katana(truth), np.random.default_rng(seed)
    return compare(twin, plan().inclined, resolution, rng), measure_pairs(twin, plan().posed, 1e-5, rng)


@cache
def first_stage() -> TiltingFit:
    return calibrate_tilting(KATANA, *campaign("standard", 0))


def away(fit: TiltingFit, names: tuple[str, ...] = tuple(TRUTH)) -> np.ndarray:
    """Return how many deviations each constant is away from its truth."""
    constants = [fit.robot.parameters[name] for name in names]
    return np.array([(p.value - TRUTH[p.name]) / (p.deviation or np.nan) for p in constants])


def test_constants_come_back_within_their_deviations() -> None:
    """With the joint zeros and twists of table 3.2 unknown."""
    z = []
    for seed in range(2):
        fit = calibrate_tilting(KATANA, *campaign("standard", seed))
        assert fit.converged
        assert fit.excess < 1.4
        z.append(away(fit))
    for name, expected in plan().expected.items():
        assert fit.robot.parameters[name].deviation == pytest.approx(expected, rel=0.4)
    assert np.abs(z).max() < 5.0
    assert 0.6 < np.sqrt(np.mean(np.square(z))) < 1.6
    assert fit.robot.values["theta_offset_3"] == KATANA.values["theta_offset_3"]
    assert fit.robot.targets == KATANA.targets


def test_without_geometric_errors_and_with_fine_instruments_they_are_exact() -> None:
    """To what the model leaves out: a thousandth of a play at 0.2 N m, and what tilts do to the loads."""
    fit = calibrate_tilting(KATANA, *campaign("nominal", 0, resolution=0.01 * RESOLUTION))
    for i in range(2, 6):
        assert fit.robot.values[f"compliance_{i}"] == pytest.approx(TRUTH[f"compliance_{i}"], rel=0.01)
        for effect in ("backlash", "clearance"):
            assert fit.robot.values[f"{effect}_{i}"] == pytest.approx(TRUTH[f"{effect}_{i}"], abs=5e-5 * DEGREE)


def test_instruments_may_sit_askew_and_have_a_zero() -> None:
    twin, rng = tilting_katana(), np.random.default_rng(3)
    pairs = plan(0.0, 20 * DEGREE, 0).inclined  # where links turn within a pair
    plumb = -np.sin(inclinations(twin, pairs.in_turn.joints, 0.0, rng))
    seat = np.array([1.0, *(0.5 * DEGREE * np.array([0.5, -0.4, 0.3]))])
    askew = np.arcsin(-plumb @ rotation_from_quaternion(seat / np.linalg.norm(seat))) + rng.normal(0.0, 0.01, (5, 3))
    read = np.round(askew / RESOLUTION) * RESOLUTION
    fit = calibrate_tilting(
        KATANA, InclinometerReadings(pairs, read[1::2] - read[::2], deviation_of_change(RESOLUTION))
    )
    assert np.abs(away(fit)).max() < 5.0
    assert fit.excess < 1.4
    for i in range(2, 6):
        assert (fit.robot.parameters[f"backlash_{i}"].deviation or 1.0) < 0.005 * DEGREE


def test_a_turn_about_the_vertical_stays_unknown_without_poses() -> None:
    alone, both = calibrate_tilting(KATANA, campaign("standard", 0)[0]), first_stage()
    for name in ("backlash_1", "compliance_1"):  # seen a little where the axis may stand 0.1 deg askew
        p = alone.robot.parameters[name]
        assert (p.deviation or 0.0) > 0.5 * p.prior
        assert abs(p.value - TRUTH[name]) < 3.0 * (p.deviation or 0.0)
        assert (both.robot.parameters[name].informed or 0.0) > 0.99
    assert (alone.robot.parameters["clearance_1"].informed or 0.0) > 0.99


def test_missing_readings_cost_certainty_only() -> None:
    readings, poses = campaign("standard", 0)
    change = readings.change.copy()
    change[:, 3] = np.nan
    full, fewer = first_stage(), calibrate_tilting(KATANA, replace(readings, change=change), poses)
    assert np.abs(away(fewer)).max() < 5.0
    wider = np.sqrt(np.diag(fewer.covariance) / np.diag(full.covariance))
    assert wider[full.names.index("backlash_4")] > 1.02


def test_believed_constants_are_priors() -> None:
    fit = first_stage()
    for name in fit.names:
        identified, believed = fit.robot.parameters[name], fit.with_priors.parameters[name]
        assert (believed.nominal, believed.value, believed.prior) == (
            identified.value,
            identified.value,
            identified.deviation,
        )


def mean_error(robot: Robot, twin: Twin, seed: int) -> float:
    q = KATANA.random_configurations(200, np.random.default_rng(seed))
    truth = [posture.targets["tip"][:3, 3] for posture in twin.postures(q)]
    return float(np.linalg.norm(robot.world_poses(q, "tip")[0] - truth, axis=1).mean())


def test_two_stages_and_all_at_once_leave_little_of_what_geometry_alone_leaves() -> None:
    """The published experiment: 118 poses, 0.01 mm (Patel, section 4.5); its own ratio is 0.12 / 0.33."""
    twin, rng = tilting_katana(), np.random.default_rng(5)
    fit = first_stage()
    data = measure(twin, KATANA.random_configurations(118, rng), 1e-5, rng)
    model = {m.name: m for m in MODELS}
    conventional = mean_error(identify(KATANA, data, model["geometric"]).robot, twin, 6)
    two_stages = identify(fit.robot, data, model["geometric"])
    assert two_stages.robot.values["backlash_3"] == fit.robot.values["backlash_3"]
    assert mean_error(two_stages.robot, twin, 6) < 0.15 * conventional
    at_once = identify(fit.with_priors, data, model["tilting"])
    assert mean_error(at_once.robot, twin, 6) < 0.15 * conventional
    assert at_once.robot.values["backlash_3"] != fit.robot.values["backlash_3"]


def test_refusals() -> None:
    twin = tilting_katana()
    readings, poses = campaign("standard", 0)
    with pytest.raises(InputError, match=r"three axes.*\(24, 5, 3\)"):
        InclinometerReadings(readings.pairs, readings.change[:, :4], readings.sigma)
    with pytest.raises(InputError, match="standard deviation"):
        replace(readings, sigma=0.0)
    unread = replace(readings, change=np.full_like(readings.change, np.nan))
    for arguments, says in (
        ((unread,), "no change of inclination"),
        ((readings, poses.of_configurations(range(15))), "not in pairs"),
        ((readings, poses.of_configurations([1, 2, 3, 4])), "not in pairs"),
        ((readings, replace(poses, sigma=None)), "declare no standard deviation"),
    ):
        with pytest.raises(InputError, match=says):
            calibrate_tilting(KATANA, *arguments)
    q = KATANA.random_configurations(4, np.random.default_rng(0))
    unloaded = measure_pairs(twin, Pairs(Postures(q), Postures(q)), 1e-5, np.random.default_rng(0))
    with pytest.raises(InputError, match="no pair of poses"):
        calibrate_tilting(KATANA, readings, unloaded)


DEVIATION = deviation_of_change(RESOLUTION)


def planned(seed: int = 0, **options: Any) -> TiltingPlan:
    return plan_tilting(load_robot("katana450"), np.random.default_rng(seed), deviation=DEVIATION, **options)


def test_loads_tell_every_constant_of_every_joint() -> None:
    plan = planned()
    expected = {name: deviation / DEGREE for name, deviation in plan.expected.items()}
    assert len(plan.expected) == 15
    for i in range(2, 6):
        assert expected[f"backlash_{i}"] < 3e-4
        assert expected[f"clearance_{i}"] < 2e-4
        assert plan.expected[f"compliance_{i}"] < 1e-6  # of about 2e-5
    assert expected["clearance_1"] < 1e-4
    assert expected["backlash_1"] < 2e-3  # of 0.063, by the poses
    assert plan.expected["compliance_1"] < 2e-6


def test_pairs_change_the_load_alone_and_poses_push_the_first_joint_both_ways() -> None:
    plan = planned()
    assert (len(plan.inclined), len(plan.posed)) == (24, 8)
    for pairs in (plan.inclined, plan.posed):
        assert np.array_equal(pairs.first.joints, pairs.second.joints)
        assert pairs.in_turn.wrench is not None
        assert np.all(np.linalg.norm(pairs.in_turn.wrench, axis=1) == 20.0)
    about_z = load_robot("katana450").with_effects(["compliance"]).loaded(plan.posed.in_turn).loads
    assert about_z is not None
    first, second = about_z[0, 5, ::2], about_z[0, 5, 1::2]
    assert np.any(first * second < 0)
    assert np.abs(about_z[0, 5]).min() > 0.2


def test_gravity_alone_turns_links_a_little_and_leaves_the_vertical_joint_unknown() -> None:
    plan = planned(force=0.0, move=20 * DEGREE, posed=0)
    assert len(plan.posed) == 0
    moved = np.abs(plan.inclined.second.joints - plan.inclined.first.joints)
    assert 0 < moved.max() <= 20 * DEGREE * (1 + 1e-9)
    assert plan.expected["backlash_1"] == pytest.approx(0.05 * DEGREE, rel=1e-3)  # its prior
    assert plan.expected["compliance_1"] == pytest.approx(1e-3, rel=1e-3)
    for i in range(2, 6):
        assert plan.expected[f"backlash_{i}"] < 0.005 * DEGREE
        assert plan.expected[f"clearance_{i}"] < 0.001 * DEGREE


def test_chosen_pairs_tell_more_than_twice_as_many_at_random(monkeypatch: pytest.MonkeyPatch) -> None:
    def volume(plan: TiltingPlan) -> float:
        return sum(math.log(deviation) for deviation in plan.expected.values())

    chosen = planned()

    def first_come(rows: Array, count: int, known: Array, interest: int) -> list[int]:
        return list(range(count))

    monkeypatch.setattr("truearm.inclinometers.pairs.most_informative", first_come)
    assert volume(chosen) < volume(planned(inclined=48, posed=16))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"force": 0.0, "posed": 0}, "do not differ"),
        ({"force": -1.0, "move": 0.1}, "do not differ"),
        ({"force": 0.0, "move": 0.1}, "under two loads"),
        ({"inclined": 5000}, "too few postures"),
    ],
)
def test_plans_that_tell_nothing_are_refused(options: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        planned(**options)


def test_an_arm_that_weighs_nothing_needs_a_force() -> None:
    robot = replace(load_robot("katana450"), masses=())
    with pytest.raises(InputError, match="Give a larger force"):
        plan_tilting(robot, np.random.default_rng(0), deviation=DEVIATION, force=0.0, move=0.3, posed=0)
