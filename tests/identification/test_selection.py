"""The choice of joint effects by cross-validation, held against twins whose effects are known."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, partial
from importlib import import_module

import numpy as np
import pytest

from truearm.errors import InputError
from truearm.identification.choosing.selection import Selection, select
from truearm.identification.solving.bounds import Bounds
from truearm.identification.solving.fit import identify
from truearm.identification.solving.models import MODELS
from truearm.jobs.calibrate import calibrate
from truearm.library import load_robot
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import errors_of
from truearm.modeling.effects import EFFECTS
from truearm.modeling.parts import LinkMass, Payload
from truearm.modeling.robot import Robot
from truearm.simulation.truths import truth_twin
from truearm.simulation.twin import Twin, measure
from truearm.simulation.twin_joint import JointTruth

#: The module, whose name the job of the same name hides.
calibrating = import_module("truearm.jobs.calibrate")
NOISE = 2e-5
ELASTIC = next(model for model in MODELS if model.name == "elastic")


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
    return [attempt.effect for attempt in selection.attempts if attempt.taken]


#: Some effects to choose from, which is quicker.
FEW = ("backlash", "hardening", "approach", "thermal-growth")


def test_backlash_is_found_where_there_is_some() -> None:
    chosen = select(arm(), seen(twin_of(backlash=math.radians(0.05)), 50, 2), candidates=FEW)
    assert taken(chosen)[0] == "backlash"
    assert {"compliance", "backlash"} <= set(chosen.model.effects)
    first = next(attempt for attempt in chosen.attempts if attempt.taken)
    assert first.error < chosen.start / 2
    assert first.gain == pytest.approx(chosen.start - first.error, rel=1e-9)
    assert first.gain > first.standard_error > 0.0


def test_hysteresis_is_found_where_there_is_some() -> None:
    assert taken(select(arm(), seen(twin_of(hysteresis=math.radians(0.02)), 50, 3), candidates=FEW))[0] == "approach"


def test_growth_is_found_where_the_temperature_tells_it() -> None:
    chosen = select(arm(), seen(twin_of(growth=23e-6), 50, 4, warming=15.0), candidates=FEW)
    assert taken(chosen)[0] == "thermal-growth"


def test_what_is_only_elastic_stays_as_good() -> None:
    twin = twin_of()
    data, unseen = seen(twin, 30, 10), seen(twin, 200, 20)
    chosen = select(arm(), data)
    errors = []
    for model in (chosen.model, ELASTIC):
        spread = errors_of(identify(arm(), data, model).robot, unseen).position
        assert spread is not None
        errors.append(spread.mean)
    assert errors[0] <= 1.05 * errors[1]


def test_one_seed_gives_one_answer() -> None:
    data = seen(twin_of(), 15, 5)
    first = select(arm(), data, seed=1, candidates=FEW)
    assert first == select(arm(), data, seed=1, candidates=FEW)
    assert first.start != select(arm(), data, seed=2, candidates=FEW).start


def test_what_the_data_do_not_tell_is_not_tried() -> None:
    told = replace(seen(twin_of(), 12, 6), temperature=np.linspace(18.0, 25.0, 12))
    silent = replace(told, approach=None, number=None, temperature=None)
    tried = [{attempt.effect for attempt in select(arm(), data, candidates=FEW).attempts} for data in (told, silent)]
    assert tried == [set(FEW), {"backlash", "hardening"}]


def test_what_needs_loads_is_not_tried_on_an_arm_that_nothing_loads() -> None:
    weightless = replace(arm(), masses=(), payload=Payload())
    data = seen(Twin(twin_of().robot), 20, 7)
    chosen = select(weightless, data)
    loaded = {effect.name for effect in EFFECTS if effect.loaded}
    assert {"hardening", "backlash"} <= loaded
    assert chosen.attempts
    assert not loaded & {attempt.effect for attempt in chosen.attempts}
    pulled = replace(data, wrench=np.full((20, 6), 5.0))
    assert "hardening" in {attempt.effect for attempt in select(weightless, pulled, candidates=FEW).attempts}


def test_every_selectable_effect_is_tried_where_the_data_tell_it() -> None:
    geared = replace(arm(), joints=tuple(replace(joint, transmission_periods=100) for joint in arm().joints))
    data = seen(twin_of(), 16, 13, warming=5.0)
    for robot, left_out in ((geared, set[str]()), (arm(), {"transmission-error"})):
        first = {attempt.effect for attempt in select(robot, data).attempts if attempt.round == 1}
        assert first == {effect.name for effect in EFFECTS if effect.selectable} - {"compliance"} - left_out


def test_a_target_seen_once_is_no_obstacle() -> None:
    data = seen(twin_of(), 20, 8)
    once = data.targets.index("3")
    hidden = (data.target == once) & (data.configuration != 4)
    data = replace(data, position=np.where(hidden[:, None], np.nan, data.position))
    assert math.isfinite(select(arm(), data, candidates=FEW).start)


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
    assert run.selection is not None
    assert "backlash" in run.fit.model.effects
    assert math.degrees(run.robot.values["backlash_2"]) == pytest.approx(0.04)
    unknown = Bounds.model_validate({**entries, "within": {"gain": 0.1}})
    with pytest.raises(InputError, match=r"mine\.yaml, within: no free parameter of this model has this name"):
        select(arm(), data, bounds=unknown, bounds_file="mine.yaml")


@pytest.mark.parametrize("count", [1, 9])
def test_too_few_configurations_are_refused(count: int) -> None:
    data = seen(twin_of(), 12, 11).of_configurations(np.arange(count))
    with pytest.raises(InputError, match=rf"too few training configurations .* got {count}; allowed: at least 10"):
        select(arm(), data)


@pytest.mark.usefixtures("few")
def test_the_held_out_part_has_no_say() -> None:
    data = seen(twin_of(backlash=math.radians(0.05)), 16, 12)
    order = np.random.default_rng(3).permutation(16)
    spoiled = data.position.copy()
    spoiled[np.isin(data.configuration, order[10:])] += 1e-3 * np.random.default_rng(0).normal(size=3)
    chosen = [calibrate(arm(), d, model="auto", train=10, seed=3) for d in (data, replace(data, position=spoiled))]
    assert chosen[0].selection == chosen[1].selection


def test_effects_with_more_unknowns_than_equations_are_passed_over() -> None:
    # One target: 9 configurations of a fold give 27 equations, and 25 unknowns are elastic already.
    data = seen(twin_of(), 12, 9)
    first = data.target == 0
    one = replace(
        data,
        targets=data.targets[:1],
        configuration=data.configuration[first],
        target=data.target[first],
        position=data.position[first],
        sigma=None if data.sigma is None else data.sigma[first],
    )
    selection = select(arm(), one, redundancy="drop")
    tried = {attempt.effect for attempt in selection.attempts}
    assert "compliance" in selection.model.effects
    assert "fourier" not in tried
