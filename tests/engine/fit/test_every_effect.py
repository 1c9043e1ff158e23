"""One model with every joint effect, held against twins whose effects are known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.engine.robot.test_balancers import arm as sprung_arm
from tests.expecting import known, refused

from truearm.calibration.calibrate import calibrate
from truearm.engine.base.errors import Notice
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.advice import check_fit
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.document.document import json_of
from truearm.engine.document.summaries import joint_error_text, noise_blocks
from truearm.engine.document.tables import parameter_lines
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.every_effect import (
    EffectShare,
    Shares,
    _shares,
    check_shares,
    closed_because,
    every_effect,
    identify_every_effect,
    open_effects,
)
from truearm.engine.fit.fit import Fit, Status, identify
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import Model, named_model
from truearm.engine.fit.transmission import LARGEST_CHANCE
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import LinkMass, Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import JointTruth
from truearm.validation.jobs import validate

NOISE = 2e-5
#: What joints of an IRB 120 give way by [rad/(N m)].
SOFT = {2: 3e-5, 3: 1.3e-4, 5: 4e-4}
ELASTIC = named_model("elastic")
GEOMETRIC = named_model("geometric")
#: No effect but compliance does anything on the plain twin; these do not stand in for geometry either.
ABSENT = ("backlash", "approach", "bearing-compliance", "clearance", "fourier", "warm-up")


def without_periods(robot: Robot) -> Robot:
    return replace(robot, joints=tuple(replace(joint, transmission_periods=None) for joint in robot.joints))


@cache
def irb120() -> Robot:
    return without_periods(load_robot("irb120").with_payload(Payload(2.7, (0.05, 0.025, 0.1))))


@cache
def arm() -> Robot:
    """An arm of three joints, loaded enough to bend."""
    masses = (LinkMass(2, 8.0, (0.2, 0.0, 0.0)), LinkMass(3, 6.0, (0.0, 0.0, 0.2)))
    return replace(load_robot("li3"), masses=masses, payload=Payload(3.0, (0.02, 0.01, 0.05)))


def seen(
    robot: Robot,
    count: int,
    seed: int,
    *,
    soft: bool = True,
    warm_up: float = 0.0,
    compliances: Mapping[int, float] | None = None,
    **truths: float,
) -> Dataset:
    """Return readings of a twin whose joints 2 and 3 do what the truths say."""
    rng = np.random.default_rng(seed)
    twin = truth_twin(robot, "random", np.random.default_rng(1))
    compliance = compliances or (SOFT if robot is irb120() else {2: 1e-5, 3: 1e-5})
    joints = {
        n: JointTruth(compliance=compliance.get(n, 0.0) if soft else 0.0, **(truths if n in (2, 3) else {}))  # type: ignore[arg-type]
        for n in range(1, len(robot.joints) + 1)
    }
    if warm_up:
        warming = twin.robot.with_effects(["warm-up"]).with_values({"warm_up_rate": 0.05})
        twin = replace(twin, robot=warming)
        joints = {n: replace(truth, warm_up=warm_up if n in (2, 3) else 0.0) for n, truth in joints.items()}
    return measure(replace(twin, joints=joints), robot.random_configurations(count, rng), NOISE, rng)


def one_target(data: Dataset) -> Dataset:
    return replace(data.of_readings(data.target == 0), targets=data.targets[:1])


def unordered(data: Dataset) -> Dataset:
    return replace(data, approach=None, number=None)


def mean_error(robot: Robot, unseen: Dataset) -> float:
    return float(errors_of(robot, unseen).position_norms.mean())


def share(shares: Shares, effect: str) -> EffectShare:
    return next(one for one in shares.effects if one.effect == effect)


def moves(shares: Shares, effect: str) -> float:
    return known(share(shares, effect).moves)


def found_in(shares: Shares, code: str) -> Notice:
    return next(notice for notice in check_shares(shares) if notice.code == code)


@cache
def worn() -> tuple[Dataset, Fit, Shares]:
    """Return readings of an arm that has backlash, and what is found."""
    data = seen(irb120(), 60, 2, backlash=math.radians(0.05))
    return data, *identify_every_effect(irb120(), data)[1:]


@cache
def plain() -> tuple[Dataset, Fit, Shares]:
    """Return readings of an arm that only bends, and what is found."""
    data = seen(irb120(), 60, 3)
    return data, *identify_every_effect(irb120(), data)[1:]


# -- what is there is found, and what is not shrinks -------------------------------------------------------


def test_backlash_is_found_where_there_is_some() -> None:
    _, fit, shares = worn()
    assert fit.status is Status.CONVERGED
    assert moves(shares, "backlash") > 2e-4
    for number in (2, 3):
        assert math.degrees(fit.robot.values[f"backlash_{number}"]) == pytest.approx(0.05, rel=0.1)
    unseen = seen(irb120(), 200, 20, backlash=math.radians(0.05))
    assert mean_error(fit.robot, unseen) < 1.1 * NOISE * math.sqrt(8.0 / math.pi)
    assert mean_error(identify(irb120(), worn()[0], ELASTIC).robot, unseen) > 1e-4


def test_masses_that_the_file_states_wrongly_are_made_up_for() -> None:
    """Links and payload are 1.4 times as heavy, and lie elsewhere."""
    rng = np.random.default_rng(0)
    heavy = tuple(
        replace(m, mass=1.4 * m.mass, cog=tuple((np.array(m.cog) + rng.normal(0.0, 0.03, 3)).tolist()))
        for m in irb120().masses
    )
    true = replace(irb120(), masses=heavy)
    data, unseen = (unordered(seen(true, count, seed, compliances=SOFT)) for count, seed in ((60, 4), (200, 20)))
    told, knows = (mean_error(identify(robot, data, ELASTIC).robot, unseen) for robot in (irb120(), true))
    assert told > 1.5 * knows
    assert mean_error(identify_every_effect(irb120(), data)[1].robot, unseen) < 1.1 * knows


def test_of_few_readings_it_is_as_good_as_the_elastic_model() -> None:
    data = unordered(one_target(seen(irb120(), 16, 30)))
    unseen = unordered(one_target(seen(irb120(), 200, 20)))
    elastic = mean_error(identify(irb120(), data, ELASTIC).robot, unseen)
    assert mean_error(identify_every_effect(irb120(), data)[1].robot, unseen) < 1.05 * elastic


def test_the_direction_of_approach_is_found_where_it_matters() -> None:
    _, _, shares = identify_every_effect(arm(), seen(arm(), 50, 3, hysteresis=math.radians(0.02)))
    assert moves(shares, "approach") > 1e-4
    assert [notice.code for notice in check_shares(shares)] == ["order-in-the-model"]


def test_which_error_programs_see_is_said_where_the_order_of_measurement_makes_a_difference() -> None:
    late, steady = (
        calibrate(arm(), seen(arm(), 40, 3, hysteresis=math.radians(size)), model="auto") for size in (0.02, 0.0)
    )
    (line,) = [line for line in late.lines() if "programs see" in line]
    unseen = late.data.of_configurations(late.held_out)
    apart = errors_of(late.fit.robot, unordered(unseen)).position_errors - known(late.validation).position_errors
    size = 1e3 * math.sqrt(float(np.mean(np.sum(apart**2, axis=1))))
    assert float(line.split(" by ")[1].split(" mm")[0]) == pytest.approx(size, rel=0.02)
    assert not any("programs see" in line for line in steady.lines())


def test_what_is_not_there_shrinks() -> None:
    _, fit, shares = plain()
    assert fit.status is Status.CONVERGED
    assert moves(shares, "compliance") > 5e-4
    for effect in ABSENT:
        assert moves(shares, effect) < 5e-6, effect
    for number, soft in SOFT.items():
        assert fit.robot.values[f"compliance_{number}"] == pytest.approx(soft, rel=0.1)


def test_what_is_only_elastic_stays_as_good() -> None:
    data, fit, _ = plain()
    unseen = seen(irb120(), 200, 20)
    assert mean_error(fit.robot, unseen) < 1.03 * mean_error(identify(irb120(), data, ELASTIC).robot, unseen)


def test_shares_tell_what_the_data_know() -> None:
    """What the data know of an effect that is not there is that it is not there."""
    _, fit, shares = plain()
    assert {one.effect for one in shares.effects} == {effect.name for effect in EFFECTS} - {"clearance-linear-contact"}
    sizes = [one.moves or 0.0 for one in shares.effects]
    assert sizes == sorted(sizes, reverse=True)
    for one in shares.effects:
        assert (one.moves is None) == bool(one.reason), one
        assert 0.0 <= one.known <= one.parameters + 1e-9, one
        assert (one.effect in fit.model.effects) == (one.moves is not None), one
    assert share(shares, "fourier").known < 6.0  # there is none
    assert 3.5 < share(shares, "compliance").known < 5.05  # gravity cannot turn axis 1


def test_each_joint_has_an_error_of_its_own_and_it_is_told() -> None:
    _, fit, _ = plain()
    erring = replace(fit, joint_error=np.radians([0.0, 0.002, 0.002, 0.0, 0.01, 0.0]))
    rows = json_of(noise_blocks(erring, None))["joint_error"]
    assert {tuple(row["joints"]): row["deviation"] for row in rows} == {
        (1, 4, 6): 0.0,
        (2, 3): pytest.approx(0.002),
        (5,): pytest.approx(0.01),
    }
    assert joint_error_text(erring) == "up to 0.01 deg"
    assert joint_error_text(replace(fit, joint_error=np.radians(np.full(6, 0.01)))) == "0.01 deg"


# -- the same, however it is asked -------------------------------------------------------------------------


def test_the_order_of_parameters_and_configurations_makes_no_difference() -> None:
    data = seen(arm(), 20, 5, backlash=math.radians(0.05))
    model = every_effect(arm(), data)
    fit = identify(arm(), data, model)
    turned = replace(model, effects=model.effects[::-1])
    shuffled = data.of_configurations(np.random.default_rng(0).permutation(data.configurations))
    for other in (identify(arm(), data, turned), identify(arm(), shuffled, model)):
        for p in fit.free.parameters:
            assert other.robot.values[p.name] == pytest.approx(fit.robot.values[p.name], abs=1e-3 * p.prior), p.name
        unseen = seen(arm(), 50, 6)
        ours, theirs = (errors_of(one.robot, unseen).position_norms for one in (fit, other))
        assert ours == pytest.approx(theirs, abs=1e-6)


def test_one_call_gives_one_answer() -> None:
    data = seen(arm(), 15, 5)
    first, second = (identify_every_effect(arm(), data) for _ in range(2))
    assert first[2] == second[2]
    assert first[1].robot.values == second[1].robot.values


# -- what is not in the model ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("effect", "reason"),
    [
        ("approach", "the order of measurement is not known"),
        ("warm-up", "the order of measurement is not known"),
        ("thermal-growth", "no temperature was recorded"),
        ("transmission-error", "no number of periods is known"),
        ("balancer", "the robot has nothing that it moves"),
        ("compliance", "nothing loads the joints"),
        ("hardening", "nothing loads the joints"),
    ],
)
def test_what_the_data_say_nothing_of_is_left_out_for_a_reason(effect: str, reason: str) -> None:
    weightless = replace(arm(), masses=(), payload=Payload())
    silent = unordered(seen(arm(), 12, 6))
    assert closed_because(weightless, silent, effect) == reason
    assert effect not in every_effect(weightless, silent).effects
    assert effect in every_effect(weightless, silent).tried
    assert effect not in open_effects(weightless, (), silent)


def test_what_the_data_tell_of_is_in_the_model() -> None:
    geared = replace(arm(), joints=tuple(replace(joint, transmission_periods=100) for joint in arm().joints))
    data = replace(seen(arm(), 12, 6), temperature=np.linspace(18.0, 25.0, 12))
    every = {effect.name for effect in EFFECTS} - {"balancer", "clearance-linear-contact"}
    assert set(every_effect(geared, data).effects) == every
    assert set(every_effect(arm(), data).effects) == every - {"transmission-error"}
    weightless = replace(arm(), masses=(), payload=Payload())
    pulled = replace(data, wrench=np.full((12, 6), 5.0))
    assert closed_because(weightless, pulled, "hardening") is None
    loaded = {effect.name for effect in EFFECTS if effect.loaded}
    assert not loaded & set(every_effect(weightless, data).effects)


def test_a_balancer_needs_two_loads(tmp_path: Path) -> None:
    sprung, data = sprung_arm(tmp_path), seen(irb120(), 12, 6)
    assert closed_because(sprung, data, "balancer") == "all configurations carry one load"
    weights = np.zeros((12, 6))
    weights[::2, 2] = -50.0
    assert closed_because(sprung, replace(data, wrench=weights), "balancer") is None


def test_an_unknown_order_leaves_ordered_effects_out() -> None:
    _, fit, shares = identify_every_effect(arm(), unordered(seen(arm(), 20, 5)))
    for effect in ("approach", "warm-up"):
        assert effect not in fit.model.effects
        assert share(shares, effect) == EffectShare(effect, None, 0.0, 0, "the order of measurement is not known")
    assert check_shares(shares) == []


# -- few configurations ------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [4, 8, 12])
def test_few_configurations_end_in_an_answer(count: int) -> None:
    robot = irb120()
    data = unordered(one_target(seen(robot, count, 9, soft=False)))
    weightless = replace(robot, masses=(), payload=Payload())
    _, fit, shares = identify_every_effect(weightless, data)
    assert fit.status is Status.CONVERGED
    assert bool(fit.unobservable) == (count < 12)
    assert all(math.isfinite(value) for value in fit.robot.values.values())
    assert np.all(np.isfinite(fit.covariance))
    assert all(one.reason for one in shares.effects if one.effect in ("compliance", "approach", "warm-up"))


def test_one_joint_that_never_moves_gets_a_model_as_good_as_the_geometric_one() -> None:
    robot = without_periods(load_robot("irb120"))
    rng = np.random.default_rng(0)
    joints = robot.random_configurations(25, rng)
    joints[:, 2] = 0.0
    twin = truth_twin(robot, "random", rng)
    data, unseen = (measure(twin, joints, NOISE, rng) for _ in range(2))
    _, fit, _ = identify_every_effect(robot, data)
    assert fit.status is Status.CONVERGED
    assert "theta_offset_3" in fit.unobservable
    found = {notice.code: notice for notice in check_fit(fit, expected_error(fit))}
    assert "theta_offset_3" in found["priors-decide"].message
    assert "rank-loss" not in found
    assert mean_error(fit.robot, unseen) <= 1.05 * mean_error(identify(robot, data, GEOMETRIC).robot, unseen)


def test_a_target_seen_once_is_no_obstacle() -> None:
    data = seen(arm(), 20, 8)
    hidden = (data.target == data.targets.index("3")) & (data.configuration != 4)
    data = replace(data, position=np.where(hidden[:, None], np.nan, data.position))
    assert identify_every_effect(arm(), data)[1].status is Status.CONVERGED


# -- what may be asked of it -------------------------------------------------------------------------------


def test_bounds_may_name_effects_that_are_not_in_the_model() -> None:
    data = unordered(seen(arm(), 30, 9, backlash=math.radians(0.05)))
    entries = {"truearm": "truearm-bounds/1", "units": {"length": "mm", "angle": "deg"}}
    bounds = Bounds.model_validate({**entries, "within": {"backlash_2": 0.02, "approach": 0.1}})
    _, fit, _ = identify_every_effect(arm(), data, bounds=bounds)
    assert abs(math.degrees(fit.robot.values["backlash_2"])) <= 0.02 + 1e-9
    unknown = Bounds.model_validate({**entries, "within": {"transmision": 0.1}})
    words = r"mine\.yaml, within: no free parameter of this model has this name"
    refused(None, words, identify_every_effect, arm(), data, bounds=unknown, bounds_file="mine.yaml")


@pytest.mark.parametrize("redundancy", ["drop", "none"])
def test_without_priors_it_is_refused(redundancy: Any) -> None:
    words = "the data tell how large joint effects are, which needs priors.*Leave out `redundancy`, or name a model"
    refused("redundancy", words, identify_every_effect, arm(), seen(arm(), 12, 6), redundancy=redundancy)


@pytest.mark.parametrize("loss", ["huber", "l1"])
def test_mistaken_readings_weigh_little_where_the_loss_says_so(loss: Loss) -> None:
    data = seen(arm(), 30, 4, backlash=math.radians(0.05))
    position = data.position.copy()
    position[::15] += 5e-3
    spoiled, unseen = replace(data, position=position), seen(arm(), 100, 14, backlash=math.radians(0.05))
    _, fit, _ = identify_every_effect(arm(), spoiled, loss=loss)
    assert fit.status is Status.CONVERGED
    squares = mean_error(identify_every_effect(arm(), spoiled)[1].robot, unseen)
    assert mean_error(fit.robot, unseen) < 0.5 * squares


def test_deviations_may_come_from_configurations_drawn_anew() -> None:
    data = seen(arm(), 15, 5)
    one, two = (identify_every_effect(arm(), data, bootstrap=count)[1] for count in (0, 20))
    assert two.robot.values == one.robot.values
    ratio = np.sqrt(np.diag(two.covariance) / np.diag(one.covariance))
    assert np.all(np.isfinite(ratio))
    assert 0.3 < np.median(ratio) < 3.0


def test_the_held_out_part_has_no_say() -> None:
    data = seen(arm(), 16, 12, backlash=math.radians(0.05))
    order = np.random.default_rng(3).permutation(16)
    spoiled = data.position.copy()
    spoiled[np.isin(data.configuration, order[10:])] += 1e-3 * np.random.default_rng(0).normal(size=3)
    runs = [calibrate(arm(), d, model="auto", train=10, seed=3) for d in (data, replace(data, position=spoiled))]
    assert runs[0].shares == runs[1].shares is not None
    assert runs[0].fit.robot.values == runs[1].fit.robot.values


# -- errors that repeat, and the order of a campaign -------------------------------------------------------


def geared(gear: tuple[int, float, float], joints: Array, rng: np.random.Generator) -> Dataset:
    twin = truth_twin(without_periods(load_robot("irb120")), "random", rng)
    return measure(replace(twin, joints={3: JointTruth(gear=(gear,))}), joints, NOISE, rng)


def test_periods_that_nobody_gave_are_found_and_taken_out() -> None:
    unknown, rng = without_periods(load_robot("irb120")), np.random.default_rng(1)
    data = geared((200, 2e-4, 0.7), unknown.random_configurations(90, rng), rng)
    robot, fit, shares = identify_every_effect(unknown, data)
    certain, *by_chance = sorted(shares.lines, key=lambda line: line.chance)
    assert (certain.joint, certain.periods, certain.aliases) == (3, 200, ())
    assert certain.chance < 1e-6 < LARGEST_CHANCE < min((line.chance for line in by_chance), default=1.0)
    assert robot.joints[2].periods[0] == 200
    sine, cosine = (fit.robot.values[f"transmission_{part}_3"] for part in ("sin", "cos"))
    assert np.hypot(sine, cosine) == pytest.approx(2e-4, rel=0.1)
    notice = found_in(shares, "periods-found")
    assert notice.level == "note"
    assert "joint 3 200 times in a turn, by" in notice.message
    assert "joint 4" not in notice.message


def test_positions_on_whole_steps_cannot_tell_periods_apart_and_it_is_said() -> None:
    unknown, rng = without_periods(load_robot("irb120")), np.random.default_rng(5)
    joints = np.radians(np.round(np.degrees(unknown.random_configurations(90, rng))))
    _, _, shares = identify_every_effect(unknown, geared((200, 3e-4, 0.7), joints, rng))
    line = min(shares.lines, key=lambda line: line.chance)
    assert {line.periods, *line.aliases} >= {200, 160}
    notice = found_in(shares, "periods-found")
    assert notice.level == "warning"
    assert "would look the same" in notice.message


def test_warm_up_stays_in_the_fit_and_other_sessions_get_its_middle() -> None:
    data = seen(arm(), 60, 15, warm_up=4e-4)
    _, fit, shares = identify_every_effect(arm(), data)
    assert moves(shares, "warm-up") > 2e-5
    rate, left = fit.robot.values["warm_up_rate"], fit.robot.values["warm_up_left"]
    assert left == pytest.approx(np.exp(-rate * known(data.number)).mean(), rel=1e-12)
    notice = found_in(shares, "order-in-the-model")
    assert (notice.level, "middle" in notice.message) == ("note", True)
    told = validate(fit.robot, data)
    assert [notice.level for notice in told.warnings if notice.code == "other-session"] == ["note"]
    blind = unordered(data)
    elastic = mean_error(identify(arm(), data, ELASTIC).robot, blind)
    assert mean_error(fit.robot, data) < mean_error(fit.robot, blind) < 1.05 * elastic


# -- what an effect moves ----------------------------------------------------------------------------------


def test_what_compliance_moves_is_what_gravity_and_levers_say() -> None:
    """Two links of 220 and 230 mm carry 3 kg at the flange, and joint 2 gives way by c in each N m.

    It turns by ``c m g x``, with the load x [m] before its axis, and moves the flange by that times its distance.
    """
    bare = replace(load_robot("li3"), masses=(), payload=Payload(3.0, (0.0, 0.0, 0.0)))
    soft, joints = 1e-4, bare.random_configurations(30, np.random.default_rng(7))
    before = 0.22 * np.cos(joints[:, 1]) + 0.23 * np.cos(joints[:, 1] + joints[:, 2])
    above = 0.22 * np.sin(joints[:, 1]) + 0.23 * np.sin(joints[:, 1] + joints[:, 2])
    turned = soft * 3.0 * 9.80665 * before
    true = (
        bare.with_effects(["compliance"])
        .with_values({"compliance_2": soft})
        .with_frames(bare.base, {"tip": (0.0, 0.0, 0.0)})
    )
    data = measure(Twin(true, {2: JointTruth(compliance=soft)}), joints, 1e-7, np.random.default_rng(0))
    fit = identify(bare, data, Model("springs", "compliance alone", (), ("compliance",)))
    assert fit.robot.values["compliance_2"] == pytest.approx(soft, rel=1e-3)
    (one,) = (one for one in _shares(bare, fit, data, ()).effects if one.taken)
    assert one.effect == "compliance"
    assert one.parameters == 3
    assert one.moves == pytest.approx(float(np.sqrt(np.mean((turned * np.hypot(before, above)) ** 2))), rel=5e-3)


def test_what_the_data_do_not_tell_is_counted_and_not_listed() -> None:
    fit = plain()[1]
    *lines, last = parameter_lines(fit)
    assert any(line.startswith("compliance_2 ") for line in lines)
    hidden = [name for name in fit.free.names if not any(line.startswith(f"{name} ") for line in lines)]
    assert last == f"and {len(hidden)} of joint effects of which the data tell next to nothing"
    assert hidden
    for name in hidden:
        assert fit.parameter_status(name) == "uninformed"
        assert fit.robot.parameters[name].group in fit.model.effects


def test_readings_without_noise_are_no_trouble() -> None:
    rng = np.random.default_rng(0)
    robot = irb120()
    twin = truth_twin(robot, "random", rng)
    data = measure(twin, robot.random_configurations(30, rng), 0.0, rng)
    fit = identify_every_effect(robot, data)[1]
    assert fit.status is Status.CONVERGED
    assert expected_error(fit).overall.mean < 1e-4
