"""Calibration in every convention, and the figures of the guide's page on them."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.simulated import more_of

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import Fit, Status, identify
from truearm.engine.fit.models import MODELS
from truearm.engine.fit.problem import Redundancy
from truearm.engine.fit.rounds import Redundant
from truearm.engine.robot import dh_table
from truearm.engine.robot.conversion import CONVERSIONS, converted
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

GEOMETRIC = {m.name: m for m in MODELS}["geometric"]
GUIDE = Path(__file__).parents[3] / "docs" / "guide" / "conventions.md"
TILTS = (0.1, 0.01, 0.001)
COMMON_NORMALS = ("standard-dh", "modified-dh", "s-model")


def campaign_of(robot: Robot, truth: str, poses: int, seed: int) -> tuple[Twin, Dataset]:
    rng = np.random.default_rng(seed)
    twin = truth_twin(robot, truth, rng)
    return twin, measure(twin, robot.random_configurations(poses, rng), 0.0, rng)


@pytest.mark.parametrize("name", CONVERSIONS)
def test_without_noise_every_convention_finds_its_truth(name: str) -> None:
    robot = converted(load_robot("irb120"), name)
    twin, data = campaign_of(robot, "random", 60, 11)
    unseen = more_of(twin, 100, 0.0, 12)
    ways: tuple[Redundant, ...] = ("prior", "drop")
    for redundancy in ways:
        fit = identify(robot, data, GEOMETRIC, redundancy=redundancy)
        assert fit.status is Status.CONVERGED
        assert errors_of(fit.robot, unseen).position_norms.max() < 1e-9, redundancy


@cache
def another_truth(name: str) -> tuple[Fit, float]:
    """A robot drawn in its own convention, with beta, calibrated in another one; the largest error left [m]."""
    twin, data = campaign_of(load_robot("irb120"), "random", 60, 3)
    fit = identify(converted(load_robot("irb120"), name), data, GEOMETRIC, redundancy="drop")
    return fit, float(errors_of(fit.robot, more_of(twin, 100, 0.0, 12)).position_norms.max())


def test_conventions_that_can_tilt_parallel_axes_find_the_same_robot_and_common_normals_do_not() -> None:
    for name in CONVERSIONS:
        fit, left = another_truth(name)
        if name in COMMON_NORMALS:
            assert left > 1e-3, name
            continue
        assert left < 1e-9, name
        # Base, links and three targets: 4 numbers a joint, 6 to place what is seen in the instrument's frame, and 3
        # for the triangle of the targets.
        assert len(fit.free.names) == 4 * 6 + 6 + 3, name


def test_zeros_of_the_joints_are_among_what_twists_say_twice() -> None:
    """A joint's zero turns all axes beyond it, which their own slides and tilts can do as well."""
    redundancies: tuple[Redundancy, ...] = another_truth("product-of-exponentials")[0].redundancies
    involved = {member for r in redundancies for member in r.members}
    assert {f"theta_offset_{i}" for i in range(1, 7)} <= involved


# -- the guide's table -----------------------------------------------------------------------------------


def length(metres: float) -> str:
    return f"{metres:.0f} m" if metres > 1 else f"{metres * 1e3:.3f} mm"


def largest_changes(nominal: Robot, tilted: Robot) -> tuple[float, float]:
    """Largest change of a length [m] and of an angle or a direction [deg] in the rows of two robots."""
    lengths, angles = [0.0], [0.0]
    for first, other in zip(nominal.joints, tilted.joints, strict=True):
        for column, unit in nominal.convention.row_units(first.kind).items():
            change = abs(other.row.get(column, 0.0) - first.row.get(column, 0.0))
            (lengths if unit == "m" else angles).append(change if unit == "m" else math.degrees(change))
    return max(lengths), max(angles)


@pytest.mark.parametrize(
    "name", ["modified-dh", "s-model", "modified-hayati", "cpc", "mcpc", "zero-reference", "product-of-exponentials"]
)
def test_the_guide_shows_what_a_tilt_does_to_the_numbers(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dh_table, "_NEARLY_PARALLEL", 0.0)  # write down what is refused otherwise
    robot = load_robot("irb120")
    nominal = converted(robot, name)
    q = robot.random_configurations(50, np.random.default_rng(0))
    cells = []
    for tilt in TILTS:
        real = robot.with_values({"beta_3": math.radians(tilt)})
        tilted = converted(real, name)
        for first, other in zip(tilted.world_poses(q), real.world_poses(q), strict=True):
            np.testing.assert_allclose(first, other, rtol=0, atol=1e-9)
        twin, data = campaign_of(real, "nominal", 50, 0)
        fit = identify(nominal, data, GEOMETRIC)
        left = errors_of(fit.robot, more_of(twin, 100, 0.0, 12)).position_norms.mean()
        cells.append((*largest_changes(nominal, tilted), float(left)))
    lengths, angles, left_over = zip(*cells, strict=True)
    columns = [f"`{name}`"]
    columns += [length(change) for change in lengths]
    columns += [f"{change:.3g}" for change in angles]
    columns += [f"{left * 1e3:.3f}" for left in left_over]
    assert f"| {' | '.join(columns)} |" in GUIDE.read_text()
