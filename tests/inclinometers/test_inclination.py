"""The model of inclinometer readings against the twin's own computation and against central differences."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.tilting import JOINTS, TRUTH, tilting_katana

from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import Twin
from truearm.inclinometers.fit import inclination_derivatives, inclinations_of, link_ends
from truearm.inclinometers.pairs import inclinations

RNG = np.random.default_rng


def tilting_model(truth: Mapping[str, float] = TRUTH) -> Robot:
    return tilting_katana().robot.with_effects(("compliance", "backlash", "clearance")).with_values(truth)


@pytest.mark.parametrize("tilts", [False, True])
def test_readings_are_the_twins(tilts: bool) -> None:
    """To rounding without tilts; the model's loads are those before the shafts tilt, which turns them a little."""
    kept = {i: joint if tilts else replace(joint, clearance=0.0) for i, joint in JOINTS.items()}
    twin, rng = replace(tilting_katana(), joints=kept), RNG(0)
    robot = tilting_model({name: getattr(kept[int(name[-1])], name[:-2]) for name in TRUTH})
    q = robot.random_configurations(60, rng)
    wrench = np.pad(rng.normal(0.0, 20.0, (60, 3)), ((0, 0), (0, 3)))
    at = robot.loaded(Postures(q, wrench=wrench))
    assert at.loads is not None
    seated = np.abs(at.loads[:, 5]).min(axis=0) > 0.5  # else the model takes up less than all of the play
    assert seated.sum() > 20
    read = inclinations(twin, q, 0.0, rng, wrench=wrench)
    assert_allclose(inclinations_of(robot, at)[seated], read[seated], atol=5e-6 if tilts else 1e-8)
    assert np.abs(inclinations_of(load_robot("katana450"), q) - read).max() > 1e-3


def test_readings_of_other_robots_are_the_twins() -> None:
    rng = RNG(1)
    for name in ("irb120", "ur5", "puma560"):
        robot = load_robot(name)
        q = robot.random_configurations(5, rng)
        assert_allclose(inclinations_of(robot, q), inclinations(Twin(robot), q, 0.0, rng), atol=1e-7)
        assert link_ends(robot)[-1] <= len(robot.trunk.elements)


def test_derivatives_are_central_differences() -> None:
    rng, h = RNG(2), 1e-6
    robot = tilting_model()
    names = [*TRUTH, *(p.name for p in robot.parameters.values() if p.group in ("joint zero", "geometry"))]
    at = robot.loaded(Postures(robot.random_configurations(20, rng)))
    seats = np.zeros((5, 3))
    found = inclination_derivatives(robot, at, names, seats)
    assert found.shape == (20, 5, 3, len(names) + 15)
    usual = np.abs(inclinations_of(robot, at)) < 1.4

    def check(column: int, plus: Array, minus: Array) -> None:
        assert_allclose(found[..., column][usual], ((plus - minus) / (2 * h))[usual], atol=3e-8, rtol=1e-6)

    for column, name in enumerate(names):
        value = robot.values[name]
        check(column, *(inclinations_of(robot.with_values({name: value + s * h}), at) for s in (1, -1)))
    for seat in range(15):
        turn = np.zeros(15)
        turn[seat] = h
        check(
            len(names) + seat,
            inclinations_of(robot, at, turn.reshape(5, 3)),
            inclinations_of(robot, at, -turn.reshape(5, 3)),
        )
    assert np.isfinite(found).all()
