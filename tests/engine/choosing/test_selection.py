"""The choice of joint effects by cross-validation, held against twins whose effects are known."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, partial
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from tests.expecting import known, refused

from truearm.calibration.calibrate import calibrate
from truearm.engine.base.errors import Notice
from truearm.engine.choosing import chosen_fit
from truearm.engine.choosing.candidates import SELECTABLE
from truearm.engine.choosing.chosen_fit import check_choice, identify_chosen
from truearm.engine.choosing.search import Gain, complete, with_bases, without
from truearm.engine.choosing.selection import Selection, select, with_lines
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import Fit, Status, identify
from truearm.engine.fit.models import named_model
from truearm.engine.fit.transmission import PeriodicError
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import LinkMass, Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import PERFECT, JointTruth
from truearm.validation.jobs import validate

#: The module of the job.
calibrating = import_module("truearm.calibration.calibrating")
NOISE = 2e-5
ELASTIC = named_model("elastic")


@cache
def arm() -> Robot:
    """An arm of three joints, loaded enough to bend."""
    masses = (LinkMass(2, 8.0, (0.2, 0.0, 0.0)), LinkMass(3, 6.0, (0.0, 0.0, 0.2)))
    return replace(load_robot("li3"), masses=masses, payload=Payload(3.0, (0.02, 0.01, 0.05)))


def twin_of(**truths: float) -> Twin:
    """Return a twin whose joints 2 and 3 bend and do what the truths say."""
    twin = truth_twin(arm(), "random", np.random.default_rng(1))
    return replace(twin, joints={number: JointTruth(compliance=1e-5, **truths) for number in (2, 3)})  # type: ignore[arg-type]


def seen(twin: Twin, count: int, seed: int, warming: float = 0.0) -> Dataset:
    rng = np.random.default_rng(seed)
    joints = arm().random_configurations(count, rng)
    if not warming:
        return measure(twin, joints, NOISE, rng)
    return measure(twin, joints, NOISE, rng, temperature=20.0 + warming * rng.uniform(0.0, 1.0, count))


def taken(selection: Selection) -> list[str]:
    return [one.effect for one in selection.candidates if one.taken and one.effect != "compliance"]


def gain_of(selection: Selection, effect: str) -> Gain:
    return known(next(one.gain for one in selection.candidates if one.effect == effect))


def mean_error(robot: Robot, unseen: Dataset) -> float:
    return float(errors_of(robot, unseen).position_norms.mean())


def reason(selection: Selection, effect: str) -> str:
    return next(one.reason for one in selection.candidates if one.effect == effect)


def found_in(selection: Selection, code: str) -> Notice:
    return next(notice for notice in check_choice(selection) if notice.code == code)


def tried(selection: Selection) -> set[str]:
    return {one.effect for one in selection.candidates if one.gain is not None}


#: Some effects to choose from, which is quicker.
FEW = ("backlash", "hardening", "approach", "thermal-growth")


@cache
def with_play() -> tuple[Dataset, Selection]:
    """Return readings of an arm that has backlash, and what is chosen for them."""
    data = seen(twin_of(backlash=math.radians(0.05)), 50, 2)
    return data, select(arm(), data, candidates=FEW)


def test_backlash_is_found_where_there_is_some() -> None:
    _, chosen = with_play()
    assert "backlash" in taken(chosen)
    assert {"compliance", "backlash"} <= set(chosen.model.effects)
    assert chosen.error < known(chosen.elastic) / 2 < chosen.geometric
    assert gain_of(chosen, "backlash").believed
    first = chosen.confirmations[0]
    assert set(first.effects) > set(first.smaller)
    assert first.gain.mean == pytest.approx(first.smaller_error - first.error, rel=1e-9)
    assert first.gain.mean > first.gain.error > 0.0
    assert first.effects == chosen.model.effects
    assert first.error == pytest.approx(chosen.error, rel=0.1)  # the closed form agrees with fits in the folds


def test_hysteresis_and_growth_are_found_where_there_is_some() -> None:
    chosen = select(arm(), seen(twin_of(hysteresis=math.radians(0.02)), 50, 3), candidates=FEW)
    assert taken(chosen) == ["approach"]
    assert [notice.code for notice in check_choice(chosen)] == ["order-in-the-model"]
    chosen = select(arm(), seen(twin_of(growth=23e-6), 50, 4, warming=15.0), candidates=FEW)
    assert "thermal-growth" in taken(chosen)


def test_a_smaller_model_than_the_elastic_one_can_win() -> None:
    chosen = select(arm(), seen(Twin(twin_of().robot), 40, 14), candidates=FEW)
    assert chosen.model.effects == ()
    assert chosen.model.summary == "geometric, and what cross-validation added: nothing"
    assert (chosen.elastic is not None, chosen.error) == (True, chosen.geometric)
    assert reason(chosen, "compliance") in ("it makes held-out errors larger", "it gains no more than chance may")
    assert chosen.confirmations == ()


def test_what_is_only_elastic_stays_as_good() -> None:
    twin = twin_of()
    data, unseen = seen(twin, 30, 10), seen(twin, 200, 20)
    chosen = select(arm(), data)
    ours, plain = (mean_error(identify(arm(), data, model).robot, unseen) for model in (chosen.model, ELASTIC))
    assert ours <= 1.05 * plain


def test_one_seed_gives_one_answer() -> None:
    data = seen(twin_of(), 15, 5)
    first = select(arm(), data, seed=1, candidates=FEW)
    assert first == select(arm(), data, seed=1, candidates=FEW)
    assert first.geometric != select(arm(), data, seed=2, candidates=FEW).geometric


def test_what_the_data_tell_is_tried_and_nothing_else() -> None:
    told = replace(seen(twin_of(), 12, 6), temperature=np.linspace(18.0, 25.0, 12))
    silent = replace(told, approach=None, number=None, temperature=None)
    both = [select(arm(), data, candidates=FEW) for data in (told, silent)]
    assert [tried(one) for one in both] == [{*FEW, "compliance"}, {"compliance", "backlash", "hardening"}]
    assert reason(both[1], "approach") == "the order of measurement is not known"
    assert reason(both[1], "thermal-growth") == "no temperature was recorded"
    geared = replace(arm(), joints=tuple(replace(joint, transmission_periods=100) for joint in arm().joints))
    data = seen(twin_of(), 16, 13, warming=5.0)
    for robot, left_out in ((geared, set[str]()), (arm(), {"transmission-error"})):
        assert tried(select(robot, data)) == set(SELECTABLE) - {"joint-curve"} - left_out


def test_what_needs_loads_is_not_tried_on_an_arm_that_nothing_loads() -> None:
    weightless = replace(arm(), masses=(), payload=Payload())
    data = seen(Twin(twin_of().robot), 20, 7)
    chosen = select(weightless, data)
    loaded = {effect.name for effect in EFFECTS if effect.loaded}
    assert {"hardening", "backlash"} <= loaded
    assert chosen.elastic is None
    assert not loaded & tried(chosen)
    assert not loaded & set(chosen.model.effects)
    assert reason(chosen, "hardening") == "nothing loads the joints"
    pulled = replace(data, wrench=np.full((20, 6), 5.0))
    assert "hardening" in tried(select(weightless, pulled, candidates=FEW))
    # nor is chosen what loads hardly excite
    light = replace(arm(), masses=(), payload=Payload(0.01))
    twin = replace(twin_of().robot, masses=(), payload=Payload(0.01))
    chosen = select(light, seen(Twin(twin), 20, 7), candidates=FEW)
    assert chosen.model.effects == ()
    assert reason(chosen, "hardening") == "the readings tell less of it than is known beforehand"


def test_the_order_of_trials_makes_no_difference_where_there_are_too_many_to_try_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data, every = with_play()
    monkeypatch.setattr("truearm.engine.choosing.search._ALL", 1)
    assert select(arm(), data, candidates=FEW).model.effects == every.model.effects


def without_periods() -> Robot:
    robot = load_robot("irb120")
    return replace(robot, joints=tuple(replace(joint, transmission_periods=None) for joint in robot.joints))


def test_periods_that_nobody_gave_are_found_and_taken_out() -> None:
    unknown, rng = without_periods(), np.random.default_rng(1)
    twin = truth_twin(unknown, "random", rng)
    erring = {3: JointTruth(gear=((200, 2e-4, 0.7),)), 5: JointTruth(gear=((102, 3e-4, 0.2),))}
    data = measure(replace(twin, joints=erring), unknown.random_configurations(90, rng), NOISE, rng)
    chosen = select(unknown, data, candidates=("transmission-error", "fourier"))
    assert [(line.joint, line.periods, line.aliases) for line in chosen.lines] == [(3, 200, ()), (5, 102, ())]
    assert "transmission-error" in chosen.model.effects
    choice, fit = identify_chosen(unknown, data, chosen)
    assert [joint.periods for joint in fit.robot.joints] == [(), (), (200,), (), (102,), ()]
    sine, cosine = (fit.robot.values[f"transmission_{part}_3"] for part in ("sin", "cos"))
    assert np.hypot(sine, cosine) == pytest.approx(2e-4, rel=0.1)
    notice = found_in(choice, "periods-found")
    assert notice.level == "note"
    assert "joint 3 200 times in a turn, by" in notice.message


def test_lines_that_were_found_join_those_that_a_robot_knows() -> None:
    found = [PeriodicError(joint, n, 1e-4, 0.5, 1e-9) for joint, n in ((3, 400), (4, 100), (4, 300))]
    robot = with_lines(with_lines(without_periods(), found[:1]), found[1:])
    assert [joint.periods for joint in robot.joints] == [(), (), (400,), (100, 300), (), ()]
    again = with_lines(robot, [replace(found[0], periods=200)])
    assert again.joints[2].periods == (400, 200)
    assert with_lines(robot, []) is robot


def test_positions_on_whole_steps_cannot_tell_periods_apart_and_it_is_said() -> None:
    unknown, rng = without_periods(), np.random.default_rng(5)
    joints = np.radians(np.round(np.degrees(unknown.random_configurations(90, rng))))
    twin = replace(truth_twin(unknown, "random", rng), joints={3: JointTruth(gear=((200, 3e-4, 0.7),))})
    chosen = select(unknown, measure(twin, joints, NOISE, rng), candidates=("transmission-error",))
    (line,) = chosen.lines
    assert {line.periods, *line.aliases} >= {200, 160}
    notice = found_in(chosen, "periods-found")
    assert notice.level == "warning"
    assert "would look the same" in notice.message


def warming(count: int, seed: int, *, first: int = 0) -> Dataset:
    """Return readings of an arm that warms up while it is measured, from configuration `first` on."""
    rng = np.random.default_rng(seed)
    cold = replace(twin_of(), robot=twin_of().robot.with_effects(["warm-up"]).with_values({"warm_up_rate": 0.05}))
    growing = {number: replace(truth, warm_up=4e-4) for number, truth in cold.joints.items()}
    every = measure(replace(cold, joints=growing), arm().random_configurations(first + count, rng), NOISE, rng)
    return every.of_configurations(np.arange(first, first + count))


def test_warm_up_stays_in_the_fit_and_other_sessions_get_its_middle() -> None:
    data = warming(60, 15)
    chosen = select(arm(), data, candidates=("warm-up", "backlash"))
    assert taken(chosen) == ["warm-up"]
    choice, fit = identify_chosen(arm(), data, chosen)
    rate, left = fit.robot.values["warm_up_rate"], fit.robot.values["warm_up_left"]
    assert left == pytest.approx(np.exp(-rate * known(data.number)).mean(), rel=1e-12)
    (notice,) = check_choice(choice)
    assert (notice.code, notice.level, "middle" in notice.message) == ("order-in-the-model", "note", True)
    told = validate(fit.robot, data)
    assert [(notice.code, notice.level) for notice in told.warnings if notice.code == "other-session"] == [
        ("other-session", "note")
    ]
    assert told.errors.position == known(errors_of(fit.robot, replace(data, number=None)).position)
    # Some of the session without their numbers: better than by the elastic model, worse than with them.
    blind = replace(data, number=None, approach=None)
    elastic = mean_error(identify(arm(), data, ELASTIC).robot, blind)
    assert mean_error(fit.robot, data) < mean_error(fit.robot, blind) < 1.02 * elastic


def test_a_target_seen_once_is_no_obstacle() -> None:
    data = seen(twin_of(), 20, 8)
    once = data.targets.index("3")
    hidden = (data.target == once) & (data.configuration != 4)
    data = replace(data, position=np.where(hidden[:, None], np.nan, data.position))
    assert math.isfinite(select(arm(), data, candidates=FEW).error)


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let calibrations choose from some effects alone."""
    monkeypatch.setattr(calibrating, "select", partial(select, candidates=FEW))


@pytest.mark.usefixtures("few")
def test_bounds_may_name_effects_that_are_not_chosen() -> None:
    data = seen(twin_of(backlash=math.radians(0.05)), 40, 9)
    entries = {"truearm": "truearm-bounds/1", "units": {"length": "mm", "angle": "deg"}}
    bounds = Bounds.model_validate({**entries, "within": {"backlash_2": 0.04, "approach": 0.1}})
    run = calibrate(arm(), data, model="auto", bounds=bounds)
    assert "backlash" in run.fit.model.effects
    assert math.degrees(run.robot.values["backlash_2"]) == pytest.approx(0.04)
    unknown = Bounds.model_validate({**entries, "within": {"gain": 0.1}})
    words = r"mine\.yaml, within: no free parameter of this model has this name"
    refused(None, words, select, arm(), data, bounds=unknown, bounds_file="mine.yaml")
    for count in (1, 9):
        words = rf"too few training configurations .* got {count}; allowed: at least 10"
        refused(None, words, select, arm(), data.of_configurations(np.arange(count)))


@pytest.mark.usefixtures("few")
def test_the_held_out_part_has_no_say() -> None:
    data = seen(twin_of(backlash=math.radians(0.05)), 16, 12)
    order = np.random.default_rng(3).permutation(16)
    spoiled = data.position.copy()
    spoiled[np.isin(data.configuration, order[10:])] += 1e-3 * np.random.default_rng(0).normal(size=3)
    chosen = [calibrate(arm(), d, model="auto", train=10, seed=3) for d in (data, replace(data, position=spoiled))]
    assert chosen[0].selection == chosen[1].selection


def one_target(data: Dataset) -> Dataset:
    return replace(data.of_readings(data.target == 0), targets=data.targets[:1])


def test_effects_with_more_unknowns_than_equations_or_next_to_no_gain_are_not_taken() -> None:
    # 9 configurations of a fold give 27 equations, and 25 unknowns are elastic already.
    chosen = select(arm(), one_target(seen(twin_of(), 12, 9)), redundancy="drop")
    assert "fourier" not in chosen.model.effects
    assert Gain(2e-6, 1e-6, 5e-5).believed
    assert not Gain(2e-6, 1e-6, 5e-4).believed
    assert not Gain(2e-6, 3e-6, 5e-5).believed
    assert not Gain(2e-6, 1.5e-6, 5e-5).clear(2.0)


def test_a_smaller_model_is_taken_where_a_fit_ends_unsound(monkeypatch: pytest.MonkeyPatch) -> None:
    data, chosen = with_play()
    assert "backlash" in chosen.model.effects
    real = identify

    def unsound(*given: Any, **named: Any) -> Fit:
        fit = real(*given, **named)
        return replace(fit, status=Status.RANK_LOSS) if "backlash" in fit.model.effects else fit

    monkeypatch.setattr(chosen_fit, "identify", unsound)
    choice, fit = identify_chosen(arm(), data, chosen)
    assert fit.status is Status.CONVERGED
    assert "backlash" not in choice.model.effects
    assert choice.passed_over[0] == (chosen.model.effects, "rank-loss")
    assert reason(choice, "backlash") == "the fit with it ended in rank-loss"
    assert found_in(choice, "smaller-model").level == "note"
    monkeypatch.setattr(chosen_fit, "identify", lambda *a, **k: replace(real(*a, **k), status=Status.NOT_CONVERGED))
    choice, fit = identify_chosen(arm(), data, chosen)
    assert (choice, fit.status) == (chosen, Status.NOT_CONVERGED)


def test_a_part_of_an_effect_is_chosen_with_the_effect_only() -> None:
    hardened, alone = frozenset({"compliance", "hardening"}), frozenset({"hardening"})
    assert (complete(hardened), complete(alone)) == (True, False)
    assert with_bases(alone) == hardened
    assert without(hardened, "compliance") == frozenset()
    assert without(hardened, "hardening") == {"compliance"}
    for seed in range(2):
        data = one_target(seen(twin_of(quadratic=-2e-7), 16, 30 + seed))
        chosen = select(arm(), data, candidates=(*FEW, "bearing-compliance"), seed=seed)
        for effects in (chosen.model.effects, *(one.effects for one in chosen.confirmations)):
            assert complete(frozenset(effects))


def test_few_configurations_end_no_worse_than_the_better_plain_model() -> None:
    truths: tuple[dict[str, float], ...] = ({"bearing": 8e-6}, {"backlash": 3e-4}, {"quadratic": -1e-7}, {})
    shares = []
    for seed, truth in enumerate(truths):
        twin = twin_of(**truth)
        data, unseen = one_target(seen(twin, 20, 40 + seed)), one_target(seen(twin, 200, 50 + seed))
        chosen = select(arm(), data, seed=seed, candidates=(*FEW, "clearance", "bearing-compliance"))
        plain = (identify(arm(), data, named_model(name)) for name in ("geometric", "elastic"))
        ours = mean_error(identify_chosen(arm(), data, chosen)[1].robot, unseen)
        shares.append(ours / min(mean_error(fit.robot, unseen) for fit in plain))
    assert max(shares) < 1.05


def test_a_choice_is_held_against_the_next_smaller_and_the_better_plain_one() -> None:
    twin = twin_of(backlash=math.radians(0.05), growth=23e-6)
    chosen = select(arm(), seen(twin, 50, 2, warming=15.0), candidates=("backlash", "thermal-growth"))
    effects = frozenset(chosen.model.effects)
    assert {"backlash", "thermal-growth"} < effects
    held = [frozenset(one.smaller) for one in chosen.confirmations if frozenset(one.effects) == effects]
    assert len(held[0]) == len(effects) - 1
    assert held[-1] == {"compliance"}


def test_one_joint_that_never_moves_gets_a_model_as_good_as_the_geometric_one() -> None:
    robot = load_robot("irb120")
    rng = np.random.default_rng(0)
    joints = robot.random_configurations(25, rng)
    joints[:, 2] = 0.0
    twin = truth_twin(robot, "random", rng)
    data, unseen = (measure(twin, joints, NOISE, rng) for _ in range(2))
    chosen = select(robot, data, candidates=("joint-curve", "fourier", "transmission-error"))
    choice, fit = identify_chosen(robot, data, chosen)
    assert "joint zero" in choice.model.groups
    assert "geometry" in choice.model.groups
    assert fit.status is Status.RANK_LOSS
    assert "theta_offset_3" in fit.unobservable
    geometric = identify(robot, data, named_model("geometric"))
    assert mean_error(fit.robot, unseen) <= 1.02 * mean_error(geometric.robot, unseen)
    # Curves, by name, on the same readings: they end as the geometry does, and not in an error of the arithmetic.
    curved = replace(choice.model, effects=("joint-curve",), tried=())
    assert identify(robot, data, curved).status is Status.RANK_LOSS


def test_curves_whose_size_cannot_be_found_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def without_maximum(*_: Any, **__: Any) -> Any:
        raise np.linalg.LinAlgError("Matrix is not positive definite")

    monkeypatch.setattr("truearm.engine.choosing.candidates.curve_variances", without_maximum)
    chosen = select(arm(), seen(twin_of(), 20, 8), candidates=("joint-curve",))
    assert "joint-curve" not in chosen.model.effects
    assert reason(chosen, "joint-curve") == "what is left over does not repeat with the joints' angles"


def test_gears_without_periods_are_left_out_for_the_right_reason() -> None:
    for count, words in (
        (20, "fewer than 60 configurations cannot tell"),
        (60, "no error that repeats with a joint's angle was found"),
    ):
        chosen = select(arm(), seen(twin_of(), count, 8), candidates=("transmission-error",))
        assert reason(chosen, "transmission-error").startswith(words)


def test_curves_that_no_joint_gets_are_no_part_of_the_model() -> None:
    data = seen(twin_of(), 40, 8)
    chosen = select(arm(), data, candidates=("joint-curve",))
    assert "joint-curve" not in chosen.model.effects
    curved = replace(
        chosen,
        model=chosen.model.also(["joint-curve"]),
        candidates=tuple(replace(one, taken=True) if one.effect == "joint-curve" else one for one in chosen.candidates),
    )
    choice, fit = identify_chosen(arm(), data, curved)
    assert choice.model.effects == fit.model.effects == chosen.model.effects
    assert "curve" not in choice.model.summary
    assert reason(choice, "joint-curve") == "the fit to all training readings gave no joint a curve"
    assert "joint-curve" in fit.model.tried


def test_curves_of_few_configurations_are_borne_out_by_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    gears = {1: ((1, 6e-4, 0.3), (13, 4e-4, 1.0)), 2: ((2, 4e-4, 2.0), (20, 4e-4, -1.0))}
    plain = twin_of()
    twin = replace(plain, joints={n: replace(plain.joints.get(n, PERFECT), gear=gear) for n, gear in gears.items()})
    data = seen(twin, 60, 8)
    monkeypatch.setattr(  # as where the weights of the fit without curves hide most of what they gain
        "truearm.engine.choosing.selection._Choice._errors_of_curves",
        lambda self, search, chosen: 0.999 * search.errors(search.best({*self.reasons, "joint-curve"})),
    )
    chosen = select(arm(), data, candidates=("joint-curve",))
    assert "joint-curve" in chosen.model.effects
    last, fitted = chosen.confirmations[-2:]
    assert not last.gain.clear(3.0)
    assert fitted.gain.clear(3.0)
    assert fitted.error < 0.7 * fitted.smaller_error
