from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.axis_circles.test_axes import runs
from tests.engine.robot.test_conventions import about
from tests.engine.robot.test_joint_errors import TABLE_3, with_table_3

import truearm
from truearm.axis_circles.fit import AxisFit, analyse
from truearm.engine.base.errors import InputError
from truearm.engine.fit.problem import in_words
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.twin import Twin, measure
from truearm.validation.lines import CONVENTION
from truearm.validation.tolerances import (
    KnownError,
    UsedLean,
    errors_of_tolerance,
    flange_error,
    known_errors,
    tolerance_of,
)


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
    known = known_errors(with_table_3())
    for i, (ebeta, egamma, *place) in enumerate(TABLE_3, 1):
        used = UsedLean(0.05, (known[f"ebeta_{i}"], known[f"egamma_{i}"])).used
        assert used is not None
        assert used.delta == pytest.approx(0.05 * math.radians(math.hypot(ebeta, egamma)), rel=1e-4)
        assert [known[f"{slide}_{i}"].value for slide in ("ex", "ey", "ez")] == pytest.approx(np.array(place) / 1e3)


@pytest.mark.parametrize("correlation", [-0.95, 0.0, 0.95])
@pytest.mark.parametrize("leaning", [0.0, 1.0, 4.0])
def test_lean_and_side_lie_in_their_intervals_as_often_as_stated(leaning: float, correlation: float) -> None:
    """However the two angles are correlated, which the file does not say."""
    rng, deviations, inside = np.random.default_rng(0), np.array([2e-5, 5e-5]), np.zeros(2)
    true = leaning * deviations * [1.0, -1.0]
    truth = tolerance_of(float(true[0]), float(true[1]), 0.05)
    factor = np.linalg.cholesky(np.array([[1.0, correlation], [correlation, 1.0]]))
    for found in true + rng.standard_normal((1000, 2)) @ factor.T * deviations:
        angles = [KnownError("", (1,), v, d) for v, d in zip(found.tolist(), deviations.tolist(), strict=True)]
        delta, side = UsedLean(0.05, (angles[0], angles[1])).intervals
        assert delta is not None
        inside[0] += delta[0] <= truth.delta <= delta[1]
        inside[1] += side is None or (truth.towards - side[0]) % math.tau <= side[1] - side[0]
    assert inside.min() >= 900
    assert leaning < 2.0 or inside.min() <= 990  # one of them is not wider than it must be


def test_each_figure_says_which_parameters_it_is_the_sum_of(axis_errors: AxisFit) -> None:
    """As the fit itself has the sums; the file knows only which errors were held."""
    known = known_errors(axis_errors.robot)
    everything = FreeParameters(tuple(axis_errors.robot.parameters.values()))
    found = [name for name in axis_errors.free.names if name in known]
    for name in found:
        members = {n: w for n, w in axis_errors.combination(name).items() if abs(w) > 1e-6}
        assert sorted(known[name].words.split(" + ")) == sorted(in_words(members, everything, summed=True).split(" + "))
    assert {name for name, error in known.items() if error.value is None} == set(known) - set(found)


@pytest.fixture(scope="module", params=["robot", "world"])
def axis_errors(request: pytest.FixtureRequest) -> AxisFit:
    """What circles say of joint errors, in the robot's frame and in the instrument's."""
    true = with_table_3().with_values({"ebeta_2": 0.002}).with_frames(IDENTITY, {"smr": (0.1, 0.05, 0.03)})
    data = measure(Twin(true), runs(20.0, (0, -90, 90, 0, 30, 0)), 1e-6, np.random.default_rng(0))
    return analyse(truearm.load_robot("kr5"), data, in_robot_frame=request.param == "robot").errors


def test_the_factors_of_a_sum_are_in_its_own_unit(axis_errors: AxisFit) -> None:
    """A lean of axis 2 shifts it by the 120 mm that its joint is aside of axis 1, where the base takes the lean."""
    is_in_base = axis_errors.robot.parameters["ebeta_2"].deviation is None
    error = known_errors(axis_errors.robot)["ex_2"]
    assert error.words == ("ex_2 + 120 mm/rad·ebeta_2" if is_in_base else "ex_2")
    assert error.value == pytest.approx(-0.4168e-3 + 0.120 * 0.002 * is_in_base, abs=1e-5)


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
    robot = robot.with_parameters(
        replace(p, deviation=1e-5) for p in robot.parameters.values() if p.group == "geometry"
    )
    result = truearm.tolerance(robot, depths)
    content = result.summary()
    assert content["robot"] == robot.name
    for i, (row, depth, (ebeta, egamma, *_)) in enumerate(zip(content["leans"], depths, TABLE_3, strict=True), 1):
        used = tolerance_of(math.radians(ebeta), math.radians(egamma), depth)
        assert (row["is"], row["joints"]) == (f"ebeta_{i}, egamma_{i}", [i])
        figures = (row["depth_mm"], row["lean_mm"], row["towards_deg"])
        assert figures == pytest.approx((1e3 * depth, 1e3 * used.delta, math.degrees(used.towards)))
        least, largest = row["lean_90_mm"]
        assert least < row["lean_mm"] < largest
        shown = f"{figures[0]:.1f} {figures[1]:.4f} {least:.4f} to {largest:.4f} {figures[2]:.1f}"
        assert " ".join(result.lines()[i].split()).startswith(f"ebeta_{i}, egamma_{i} {i} {shown}")
    slides = [value for row in TABLE_3 for value in row[2:]]
    for row, value, line in zip(content["positions"], slides, result.lines()[8:], strict=True):
        assert row["mm"] == pytest.approx(value)
        assert row["90_mm"] == pytest.approx([value - 1.645e-2, value + 1.645e-2], abs=1e-5)
        low, high = row["90_mm"]
        assert line.split() == [row["is"], str(row["joints"][0]), f"{value:.4f}", f"{low:.4f}", "to", f"{high:.4f}"]


def test_without_deviations_intervals_are_not_known_and_without_errors_there_is_nothing_to_say() -> None:
    result = truearm.tolerance(with_table_3(), 0.05)
    assert all(row["lean_90_mm"] is row["towards_90_deg"] is None for row in result.summary()["leans"])
    assert all(row["90_mm"] is None and row["mm"] for row in result.summary()["positions"])
    assert result.lines()[-1] == "The robot file states no deviations: intervals are not known."
    with pytest.raises(InputError, match="the robot file has no joint errors: all of them are zero"):
        truearm.tolerance(converted(truearm.load_robot("kr5"), CONVENTION), 0.05)


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
