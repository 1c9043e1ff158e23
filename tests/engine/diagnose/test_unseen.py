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
from truearm.engine.diagnose.unseen import Unseen
from truearm.engine.fit.every_effect import identify_every_effect
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.effects.warm_up import LEFT
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


def told(fit: Fit, data: Dataset) -> Unseen:
    """Return what readings say that a fit has not seen."""
    unseen = Unseen.of(fit, data, campaign()[0].of_configurations(np.arange(20)))
    assert unseen is not None
    return unseen


def shown_by(data: Dataset) -> Fit:
    """Return the fit as readings show it that it has not seen."""
    return told(campaign()[1], data).as_shown(campaign()[1])


def level_of(fit: Fit, shown: Fit) -> float:
    """Return how much larger the variance becomes along the direction that changes most."""
    size = fit.free.prior
    before, after = (one.covariance / np.outer(size, size) for one in (fit, shown))
    times = np.linalg.eigvals(np.linalg.solve(before, after)).real
    return float(times[np.argmax(np.abs(np.log(times)))])


def level(data: Dataset) -> float:
    return level_of(campaign()[1], shown_by(data))


def test_parameters_are_as_uncertain_as_unseen_readings_show() -> None:
    levels = {times: np.median([level(read(times, seed)) for seed in range(5)]) for times in (0.3, 1.0, 3.0)}
    assert levels[0.3] < 0.6
    assert levels[1.0] == pytest.approx(1.0, abs=0.4)
    assert 4.0 < levels[3.0] < 14.0


def test_what_is_known_beforehand_stays_so() -> None:
    """The height of the base and that of the first joint stand in for each other: no reading tells which it is."""
    _, fit = campaign()
    shown = shown_by(read(3.0, 0))
    for name in ("d_1", "d_6"):
        before, after = (one.robot.parameters[name] for one in (fit, shown))
        assert before.informed is not None
        assert before.informed < 0.1
        assert after.deviation == pytest.approx(before.deviation, rel=0.1)


def test_how_warm_the_arm_was_is_known_there() -> None:
    """Readings of the campaign know it; programs do not, however well the readings are met."""
    _, fit = campaign()
    names = (*fit.free.names, *fit.unfitted)
    sized = (np.arange(len(names) + 1) < len(names)).astype(bool)
    robot = fit.robot.with_effects(["warm-up"])
    parts = tuple(part.among(sized) for part in fit.covariance_parts)
    parts[-1].covariance[-1, -1] = 0.09
    warm = replace(fit, robot=robot, start=fit.start.with_effects(["warm-up"]), covariance_parts=parts)
    warm = replace(warm, unfitted=(*fit.unfitted, LEFT))
    shown = told(warm, read(3.0, 0)).as_shown(warm)
    assert shown.covariance_parts[-1].covariance[-1, -1] == pytest.approx(0.09)
    assert level_of(fit, shown) == pytest.approx(level(read(3.0, 0)), rel=0.2)


def test_errors_of_joints_count_as_far_as_residuals_allow() -> None:
    """Larger ones would explain the errors at unseen readings, and the parameters would seem to be known."""
    _, fit = campaign()
    too_large = replace(fit, joint_error=np.full(6, 1e-3), joint_freedom=np.full(6, 20.0))
    unseen = read(3.0, 0)
    shown = told(too_large, unseen).as_shown(too_large)
    assert shown.joint_error is too_large.joint_error
    assert level_of(fit, shown) == pytest.approx(level(unseen), rel=0.2)


def test_deviations_of_parameters_follow() -> None:
    _, fit = campaign()
    shown = shown_by(read(3.0, 0))
    name = fit.free.names[0]
    assert shown.robot.parameters[name].deviation == pytest.approx(shown.covariance[0, 0] ** 0.5)
    assert shown.robot.values == fit.robot.values


@pytest.mark.parametrize("times", [0.5, 2.0])
def test_draws_that_contradict_unseen_readings_do_not_count(times: float) -> None:
    _, fit = campaign()
    wide, narrow = [], []
    for seed in range(5):
        unseen = read(times, seed)
        shown = shown_by(unseen)
        wide.append(expected_error(shown).overall)
        narrow.append(expected_error(shown, unseen=told(shown, unseen)).overall)
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
    assert Unseen.of(fit, data.of_configurations(np.arange(20, 40)), data) is None


def test_noise_alone_says_nothing() -> None:
    """Where an instrument is so coarse that errors do not show, the level stays what is believed."""
    _, fit = campaign()
    coarse = replace(fit, sigma={**fit.sigma, "position": 1e-3})
    rng = np.random.default_rng(1)
    noisy, trained = (
        replace(one, position=one.position + 1e-3 * rng.standard_normal((60, 3)))
        for one in (read(1.0, 0), campaign()[0].of_configurations(np.arange(20)))
    )
    unseen = Unseen.of(coarse, noisy, trained)
    assert unseen is not None
    shown = unseen.as_shown(coarse)
    assert shown.covariance[0, 0] == pytest.approx(coarse.covariance[0, 0], rel=0.2)
    all_draws, agreeing = (expected_error(shown, unseen=one).overall.interval_90 for one in (None, unseen))
    assert agreeing == pytest.approx(all_draws, rel=0.15)
