from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.engine.robot.test_conventions import about
from tests.engine.robot.test_joint_errors import TABLE_3, with_table_3

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.robot.conversion import converted
from truearm.validation.lines import CONVENTION
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
    result = joint_tolerances(with_table_3(), [0.05] * 6)
    for tolerance, (ebeta, egamma, *place) in zip(result, TABLE_3, strict=True):
        assert tolerance.delta == pytest.approx(0.05 * math.radians(math.hypot(ebeta, egamma)), rel=1e-4)
        assert_allclose(np.array(tolerance.position) * 1e3, place, atol=1e-12)


def test_no_draw_within_the_tolerances_does_more_than_the_worst() -> None:
    robot = with_table_3()
    rng = np.random.default_rng(0)
    q = robot.random_configurations(30, rng)
    leans, places = np.full(6, 1e-4), np.full(6, 5e-5)
    result = flange_error(robot, leans.tolist(), places.tolist(), q)
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
    assert max(seen) < result.together[0] * 1.001
    assert max(seen) > 0.5 * result.together[1]


def test_the_worst_side_of_one_joint_is_met() -> None:
    robot = with_table_3()
    q = robot.random_configurations(10, np.random.default_rng(1))
    result = flange_error(robot, [0, 1e-5, 0, 0, 0, 0], [0.0] * 6, q)
    moved = []
    for towards in np.linspace(0, 2 * np.pi, 361):
        ebeta, egamma = errors_of_tolerance(1e-5, float(towards), 1.0)
        values = {"ebeta_2": robot.values["ebeta_2"] + ebeta, "egamma_2": robot.values["egamma_2"] + egamma}
        moved.append(
            np.linalg.norm(robot.with_values(values).world_poses(q)[0] - robot.world_poses(q)[0], axis=1).max()
        )
    assert result.leaning[1] == pytest.approx(max(moved), rel=1e-4)
    assert result.leaning[[0, 2, 3, 4, 5]].max() == 0.0


def test_the_job_says_what_errors_use_in_millimetres_and_degrees() -> None:
    robot, depths = with_table_3(), [0.05, 0.06, 0.05, 0.05, 0.05, 0.07]
    result = truearm.tolerance(robot, depths)
    content = result.summary()
    assert content["robot"] == robot.name
    rows = [line.split() for line in result.lines() if line.split()[0].isdigit()]
    for row, shown, depth, used in zip(content["joints"], rows, depths, joint_tolerances(robot, depths), strict=True):
        assert row["depth_mm"] == pytest.approx(1e3 * depth)
        assert row["lean_mm"] == pytest.approx(1e3 * used.delta)
        assert row["towards_deg"] == pytest.approx(math.degrees(used.towards))
        assert row["position_mm"] == pytest.approx(1e3 * np.array(used.position))
        place = ", ".join(f"{1e3 * v:.4f}" for v in used.position)
        figures = [f"{1e3 * depth:.1f}", f"{1e3 * used.delta:.4f}", f"{math.degrees(used.towards):.1f}"]
        assert shown == [str(row["joint"]), *figures, *place.split()]


def test_the_job_says_what_tolerances_allow_at_the_flange() -> None:
    result = truearm.tolerance("kr5", 0.05, lean=[0, 2e-5, 0, 0, 0, 1e-5], position=1e-5)
    robot = converted(truearm.load_robot("kr5"), CONVENTION)
    angles = [math.atan(lean / 0.05) for lean in (0, 2e-5, 0, 0, 0, 1e-5)]
    q = robot.random_configurations(2000, np.random.default_rng(0))
    expected = flange_error(robot, angles, [1e-5] * 6, q)
    content = result.summary()
    assert content["configurations"] == 2000
    assert [row["angle_deg"] for row in content["joints"]] == pytest.approx(np.degrees(angles))
    assert [row["by_lean_mm"] for row in content["joints"]] == pytest.approx(1e3 * expected.leaning)
    assert [row["by_position_mm"] for row in content["joints"]] == [pytest.approx(0.01)] * 6
    worst, root = content["together"]["worst_mm"], content["together"]["root_of_squares_mm"]
    assert (worst, root) == pytest.approx((1e3 * expected.together[0], 1e3 * expected.together[1]))
    # places count for all joints alike, and leaning adds to them at one and the same configuration
    assert 0.06 + content["joints"][1]["by_lean_mm"] < worst <= 0.06 + content["joints"][1]["by_lean_mm"] + 1e-2
    assert f"  joint 2: {content['joints'][1]['by_lean_mm']:.4f} mm by leaning 0.0229 deg, 0.0100 mm" in "\n".join(
        result.lines()
    )
    assert f"  all at their worst {worst:.3f} mm, root of the sum of squares {root:.3f} mm" in "\n".join(result.lines())
    places = truearm.tolerance("kr5", 0.05, position=1e-5).summary()["together"]
    assert (places["worst_mm"], places["root_of_squares_mm"]) == pytest.approx((0.06, 0.01 * 6**0.5))


def test_what_no_tolerance_is_is_refused() -> None:
    for call in (lambda: tolerance_of(0.0, 0.0, 0.0), lambda: errors_of_tolerance(1e-3, 0.0, -0.01)):
        with pytest.raises(InputError, match=r"a hole needs a depth.*above 0 mm"):
            call()
    cases: list[tuple[dict[str, Any], str, str]] = [
        ({"depth": 0.0}, "depth", "a hole needs a depth"),
        ({"depth": [0.05] * 5}, "depth", "6 lengths, or one for all"),
        ({"lean": -1e-3}, "lean", "out of range"),
        ({"position": -1e-3}, "position", "out of range"),
        ({}, "robot", "not described by joint errors"),
    ]
    for value, parameter, words in cases:
        with pytest.raises(InputError, match=words) as refusal:
            truearm.tolerance("kr5", **{"depth": 0.05, **value})
        assert refusal.value.parameter == parameter
