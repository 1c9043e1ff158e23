"""Planned pairs of postures: what they promise, and that they keep it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.tilting import DEGREE, RESOLUTION

from truearm.engine.base.errors import InputError
from truearm.engine.data.inclinations import deviation_of_change
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.inclinometers.pairs import TiltingPlan, plan_tilting

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
def test_refusals(options: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        planned(**options)


def test_an_arm_that_weighs_nothing_needs_a_force() -> None:
    robot = replace(load_robot("katana450"), masses=())
    with pytest.raises(InputError, match="Give a larger force"):
        plan_tilting(robot, np.random.default_rng(0), deviation=DEVIATION, force=0.0, move=0.3, posed=0)
