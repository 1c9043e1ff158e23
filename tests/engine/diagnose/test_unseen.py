"""What readings that a fit has not seen say of how uncertain its parameters are."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.diagnose.position_errors import covariance_root, uncertain_names
from truearm.engine.diagnose.unseen import as_unseen_shows
from truearm.engine.fit.every_effect import identify_every_effect
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure

NOISE = 2e-5
IRB120 = load_robot("irb120")


@cache
def campaign() -> tuple[Dataset, Fit]:
    """Return readings of a twin, and the fit of every effect to half of them."""
    rng = np.random.default_rng(4)
    data = measure(truth_twin(IRB120, "random", rng), IRB120.random_configurations(40, rng), NOISE, rng)
    data = replace(data, sigma=np.full((len(data.target), 3), NOISE) if data.sigma is None else data.sigma)
    return data, identify_every_effect(IRB120, data.of_configurations(np.arange(20)))[1]


def read(times: float, seed: int) -> Dataset:
    """Return readings of a robot that is off from the fit by so many times what the covariance says."""
    data, fit = campaign()
    rng = np.random.default_rng(seed)
    root = covariance_root(fit, np.sum([part.covariance for part in fit.covariance_parts], axis=0))
    errors = times * root @ rng.standard_normal(root.shape[1])
    names = uncertain_names(fit)
    robot = fit.robot.with_values({n: fit.robot.values[n] + e for n, e in zip(names, errors.tolist(), strict=True)})
    unseen = data.of_configurations(np.arange(20, 40))
    places = np.array([robot.world_poses(unseen.joints, name)[0] for name in unseen.targets])
    where = places[unseen.target, unseen.configuration]
    return replace(unseen, position=where + NOISE * rng.standard_normal(where.shape))


def level(unseen: Dataset) -> float:
    """Return how much larger the variances of a fit become."""
    _, fit = campaign()
    shown = as_unseen_shows(fit, unseen)
    return float(shown.covariance_parts[0].covariance[0, 0] / fit.covariance_parts[0].covariance[0, 0])


def test_parameters_are_as_uncertain_as_unseen_readings_show() -> None:
    levels = {times: np.median([level(read(times, seed)) for seed in range(9)]) for times in (0.3, 1.0, 3.0)}
    assert levels[0.3] < 0.6
    assert levels[1.0] == pytest.approx(1.0, abs=0.4)
    assert 4.0 < levels[3.0] < 14.0


def test_deviations_of_parameters_follow() -> None:
    _, fit = campaign()
    shown = as_unseen_shows(fit, read(3.0, 0))
    name = fit.free.names[0]
    before, after = (one.robot.parameters[name].deviation for one in (fit, shown))
    assert before is not None
    assert after == pytest.approx((shown.covariance[0, 0] / fit.covariance[0, 0]) ** 0.5 * before)
    assert shown.robot.values == fit.robot.values


@pytest.mark.parametrize("times", [0.5, 1.0, 2.0])
def test_draws_that_contradict_unseen_readings_do_not_count(times: float) -> None:
    _, fit = campaign()
    wide, narrow = [], []
    for seed in range(5):
        unseen = read(times, seed)
        shown = as_unseen_shows(fit, unseen)
        wide.append(expected_error(shown).overall)
        narrow.append(expected_error(shown, unseen=unseen).overall)
    for all_draws, agreeing in zip(wide, narrow, strict=True):
        assert np.diff(agreeing.interval_90) < 0.9 * np.diff(all_draws.interval_90)
    off = [np.median(errors_of(fit.robot, read(times, seed)).position_norms) for seed in range(5)]
    assert np.corrcoef(off, [of.mean for of in narrow])[0, 1] > 0.8


def test_a_few_wrong_readings_say_nothing() -> None:
    unseen = read(1.0, 0)
    wrong = unseen.position.copy()
    wrong[::10] += 0.1
    assert level(replace(unseen, position=wrong)) == pytest.approx(level(unseen), rel=0.3)


def test_of_named_models_nothing_changes() -> None:
    data, _ = campaign()
    fit = identify(IRB120, data.of_configurations(np.arange(20)), named_model("geometric"))
    assert as_unseen_shows(fit, data.of_configurations(np.arange(20, 40))) is fit


def test_noise_alone_says_nothing() -> None:
    """Where an instrument is so coarse that errors do not show, the level stays what is believed."""
    _, fit = campaign()
    coarse = replace(fit, sigma={**fit.sigma, "position": 1e-3})
    unseen = read(1.0, 0)
    noisy = replace(unseen, position=unseen.position + 1e-3 * np.random.default_rng(1).standard_normal((60, 3)))
    shown = as_unseen_shows(coarse, noisy)
    assert shown.covariance[0, 0] == pytest.approx(coarse.covariance[0, 0], rel=0.2)
    all_draws, agreeing = (expected_error(shown, unseen=one).overall.interval_90 for one in (None, noisy))
    assert agreeing == pytest.approx(all_draws, rel=0.15)
