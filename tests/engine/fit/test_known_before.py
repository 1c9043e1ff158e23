"""Parameters that a fit leaves as an earlier calibration found them are as uncertain as before."""

from __future__ import annotations

import numpy as np
import pytest
from tests.expecting import known
from tests.simulated import campaign

from truearm.calibration.calibrate import calibrate
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.fit.fit import identify
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import FRAMES, Model, named_model
from truearm.engine.robot.parameters import PLACES
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure

OFFSETS = named_model("offsets")


@pytest.fixture(scope="module")
def before() -> Robot:
    """Return a robot whose geometry is known from few configurations."""
    return calibrate("irb120", campaign("irb120", 16, 1e-4, 1)[1], model="geometric", train="all").robot


@pytest.mark.parametrize(("model", "loss"), [(OFFSETS, "linear"), (OFFSETS, "huber"), (FRAMES, "linear")])
def test_the_error_to_expect_is_that_of_robots_which_are_so_uncertain(before: Robot, model: Model, loss: Loss) -> None:
    """What is found makes up for what was known: neither alone says how far off the robot is."""
    rng, proof = np.random.default_rng(7), known(before.proof)
    left = [n for n in proof.names if before.parameters[n].group not in (*PLACES, *model.groups)]
    errors, expected = [], []
    for _ in range(10):
        off = dict(zip(proof.names, proof.root @ rng.standard_normal(len(proof.names)), strict=True))
        twin = truth_twin(before, before.with_values({n: before.values[n] + off[n] for n in left}), rng)
        fit = identify(before, measure(twin, before.random_configurations(12, rng), 1e-4, rng), model, loss=loss)
        elsewhere = measure(twin, before.random_configurations(60, rng), 0.0, rng)
        errors.append(float(errors_of(fit.robot, elsewhere).position_norms.mean()))
        expected.append(expected_error(fit).overall.mean)
    assert fit.as_before == tuple(left)
    assert 0.75 < np.mean(errors) / np.mean(expected) < 1.33


def test_parameters_are_as_well_known_as_before(before: Robot) -> None:
    again = calibrate(before, campaign("irb120", 12, 1e-4, 1)[1], model="offsets")
    was, now = (dict(zip(p.names, p.deviations, strict=True)) for p in map(known, (before.proof, again.robot.proof)))
    left = [n for n in was if before.parameters[n].group == "geometry"]
    assert left
    assert set(now) == set(was)
    for name in left:
        assert now[name] == pytest.approx(was[name], rel=1e-6)
        assert again.robot.parameters[name].deviation == pytest.approx(was[name], rel=1e-6)
        assert again.robot.values[name] == before.values[name]
        assert again.fit.parameter_status(name) == "fixed"
    assert again.fit.as_before == tuple(n for n in known(before.proof).names if n in left)
    assert again.fit.knows_geometry
    third = calibrate(again.robot, campaign("irb120", 12, 1e-4, 1)[1], model="offsets")
    assert known(third.robot.proof).deviations[known(third.robot.proof).names.index("a_3")] == pytest.approx(was["a_3"])


def test_values_changed_by_hand_are_not_known(before: Robot) -> None:
    data = campaign("irb120", 12, 1e-4, 1)[1]
    edited = identify(before.with_values({"a_3": 0.2703}), data, OFFSETS)
    assert (edited.as_before, edited.knows_geometry) == ((), False)
    assert not edited.found_anew
    assert identify(before, data, named_model("geometric")).found_anew
    assert all(edited.robot.parameters[n].group in (*PLACES, "joint zero") for n in edited.free.names)
