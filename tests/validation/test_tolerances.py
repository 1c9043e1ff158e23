from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.engine.robot.test_conventions import about
from tests.engine.robot.test_joint_errors import TABLE_3, with_table_3

from truearm.engine.base.errors import InputError
from truearm.validation.tolerances import errors_of_tolerance, flange_error, joint_tolerances, tolerance_of


@pytest.mark.parametrize("towards", [-3.0, -1.0, 0.0, 0.7, math.pi / 2, 2.5])
def test_the_axis_leans_as_far_and_to_the_side_it_shall(towards: float) -> None:
    """Equation 5's Rx Ry tilts z to a point `delta` aside at the hole's depth; 9 and 10 as printed do not."""
    ebeta, egamma = errors_of_tolerance(0.004, towards, 0.05)
    axis = (about("x", egamma) @ about("y", ebeta))[:3, 2]
    assert_allclose(axis[:2] / axis[2] * 0.05, 0.004 * np.array([math.cos(towards), math.sin(towards)]), atol=1e-15)
    back = tolerance_of(ebeta, egamma, 0.05)
    assert back.delta == pytest.approx(0.004, abs=1e-15)
    assert back.towards == pytest.approx(towards, abs=1e-12)


def test_small_angles_are_equation_20() -> None:
    ebeta, egamma = math.radians(0.1813), math.radians(0.0068)
    delta = tolerance_of(ebeta, egamma, 0.055).delta
    assert delta == pytest.approx(0.055 * math.tan(math.hypot(ebeta, egamma)), rel=1e-5)


def test_tolerances_of_the_kr5_follow_table_3() -> None:
    found = joint_tolerances(with_table_3(), [0.05] * 6)
    for tolerance, (ebeta, egamma, *place) in zip(found, TABLE_3, strict=True):
        assert tolerance.delta == pytest.approx(0.05 * math.radians(math.hypot(ebeta, egamma)), rel=1e-4)
        assert_allclose(np.array(tolerance.position) * 1e3, place, atol=1e-12)


def test_no_draw_within_the_tolerances_does_more_than_the_worst() -> None:
    robot = with_table_3()
    rng = np.random.default_rng(0)
    q = robot.random_configurations(30, rng)
    leans, places = np.full(6, 1e-4), np.full(6, 5e-5)
    found = flange_error(robot, leans.tolist(), places.tolist(), q)
    nominal = robot.world_poses(q)[0]
    seen = []
    for _ in range(300):
        values = dict(robot.values)
        for i in range(1, 7):
            ebeta, egamma = errors_of_tolerance(1e-4, rng.uniform(-np.pi, np.pi), 1.0)
            shift = rng.normal(size=3)
            shift *= 5e-5 / np.linalg.norm(shift)
            for name, step in zip(("ebeta", "egamma", "ex", "ey", "ez"), (ebeta, egamma, *shift), strict=True):
                values[f"{name}_{i}"] += step
        seen.append(np.linalg.norm(robot.with_values(values).world_poses(q)[0] - nominal, axis=1).max())
    assert max(seen) < found.together[0] * 1.001
    assert max(seen) > 0.5 * found.together[1]


def test_the_worst_side_of_one_joint_is_met() -> None:
    robot = with_table_3()
    q = robot.random_configurations(10, np.random.default_rng(1))
    found = flange_error(robot, [0, 1e-5, 0, 0, 0, 0], [0.0] * 6, q)
    moved = []
    for towards in np.linspace(0, 2 * np.pi, 361):
        ebeta, egamma = errors_of_tolerance(1e-5, float(towards), 1.0)
        values = {"ebeta_2": robot.values["ebeta_2"] + ebeta, "egamma_2": robot.values["egamma_2"] + egamma}
        moved.append(
            np.linalg.norm(robot.with_values(values).world_poses(q)[0] - robot.world_poses(q)[0], axis=1).max()
        )
    assert found.leaning[1] == pytest.approx(max(moved), rel=1e-4)
    assert found.leaning[[0, 2, 3, 4, 5]].max() == 0.0


def test_a_hole_without_depth_is_refused() -> None:
    for call in (lambda: tolerance_of(0.0, 0.0, 0.0), lambda: errors_of_tolerance(1e-3, 0.0, -0.01)):
        with pytest.raises(InputError, match=r"a hole needs a depth.*above 0 mm"):
            call()
