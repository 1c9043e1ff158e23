"""Variables from readings and readings from variables, where loads and deflections depend on each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq
from tests.engine.robot.test_effects import NAMES, loaded_arm

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.effects.backlash import SEATED
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.loads import joint_loads
from truearm.engine.robot.parts import LinkMass, Payload
from truearm.engine.robot.robot import Robot


@pytest.mark.parametrize("effects", [*((effect.name,) for effect in EFFECTS), NAMES], ids="+".join)
@pytest.mark.parametrize("name", ["irb120", "katana450"])
def test_readings_are_those_that_the_variables_came_from(effects: tuple[str, ...], name: str) -> None:
    rng = np.random.default_rng(1)
    plain = replace(load_robot(name), payload=Payload(2.0, (0.05, 0.03, 0.1))).with_effects(effects)
    own = [p for effect in plain.effects for p in effect.parameters]
    robot = plain.with_values({p.name: p.nominal + 0.3 * p.prior * rng.standard_normal() for p in own})
    q = robot.random_configurations(200, rng)
    variables = robot.variables(q, robot.values)
    assert len(variables) == len(robot.moving)
    assert_allclose(robot.joints_of(variables), q, rtol=0, atol=1e-12)


def pendulum(play: float, up: float) -> Robot:
    """An arm whose second joint has play and carries a weight that balances at `up` = 1, and hangs at -1."""
    plain = replace(load_robot("irb120"), masses=(LinkMass(2, 4.0, (0.3 * up, 0.0, 0.0)),))
    return plain.with_effects(["backlash"]).with_values({"backlash_2": play})


def near_balance(width: float) -> Array:
    q = np.zeros((41, 6))
    q[:, 1] = np.linspace(-width, width, 41)
    return q


@pytest.mark.parametrize("up", [1.0, -1.0])
@pytest.mark.parametrize("play", [1e-3, 8e-3, 2e-2])
def test_equilibrium_in_the_play_of_a_joint_is_a_root_of_its_equation(play: float, up: float) -> None:
    """The moment of the weight is m g l sin(v), about an axis that no other deflection moves."""
    robot, q = pendulum(play, up), near_balance(0.02)
    stiffness = up * 4.0 * 0.3 * -robot.gravity[2]

    def sideways(v: float, reading: float) -> float:
        return float(v - reading - 0.5 * play * np.tanh(stiffness * np.sin(v) / SEATED))

    variables = robot.variables(q, robot.values)
    loads = joint_loads(robot, variables)
    assert (np.abs(loads[1, 5]) < SEATED).any()
    assert_allclose(loads[1, 5], stiffness * np.sin(variables[1]), rtol=0, atol=1e-12)
    if up < 0.0:
        roots = [brentq(sideways, -0.1, 0.1, args=(reading,), xtol=1e-15) for reading in q[:, 1]]
        assert_allclose(variables[1], roots, rtol=0, atol=5e-12)
    else:  # above its axis a weight may balance on either side of the play: any root will do
        assert_allclose([sideways(*pair) for pair in zip(variables[1], q[:, 1], strict=True)], 0.0, rtol=0, atol=5e-12)
    assert_allclose(robot.joints_of(variables), q, rtol=0, atol=5e-12)


def test_tilts_under_their_own_loads_are_those_of_the_variables() -> None:
    robot = loaded_arm(("compliance", "bearing-compliance", "clearance"), 3)
    variables = robot.variables(robot.random_configurations(100, np.random.default_rng(4)), robot.values)
    assert np.abs(variables[6:18]).max() > 1e-5
    assert_allclose(robot.tilted(variables), variables, rtol=0, atol=1e-11)


def test_variables_of_another_number_are_refused() -> None:
    robot = load_robot("irb120").with_effects(["bearing-compliance"])
    with pytest.raises(InputError, match=r"wrong number of variables.*\(6, 5\).*allowed: \(23, n\)"):
        robot.joints_of(np.zeros((6, 5)))
    with pytest.raises(InputError, match="wrong number of variables"):
        robot.joints_of(np.zeros(23))
