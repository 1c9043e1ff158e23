"""What is said of curves of joints: where they were measured, how large they are, how often they err."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from truearm.calibration.parts import curve_block
from truearm.engine.diagnose.curves import FittedCurve, fitted_curves
from truearm.engine.document.document import json_of, lines_of
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.joint_curve import curve_names
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure

TURN = (-math.pi, math.pi)
EVERYWHERE = np.linspace(-180, 180, 90)


def curve(amplitudes: dict[int, float], places: Array, shown: tuple[float, float] = TURN) -> FittedCurve:
    """Return a curve of sines with amplitudes in mdeg, measured at places in deg."""
    amounts = np.zeros(120)
    for periods, amplitude in amplitudes.items():
        amounts[2 * (periods - 1)] = math.radians(amplitude * 1e-3)
    return FittedCurve(2, "J2", amounts, np.eye(120) * 1e-10, shown, np.radians(places))


def ranges(result: FittedCurve) -> list[list[float]]:
    return [[round(math.degrees(end), 3) for end in ends] for ends in result.measured]


def test_its_value_and_deviation_follow_from_its_terms() -> None:
    result = curve({3: 10.0, 20: 4.0}, np.linspace(-180, 180, 100))
    angles = np.linspace(-3, 3, 50)
    value, deviation = result.at(angles)
    assert_allclose(value, math.radians(0.010) * np.sin(3 * angles) + math.radians(0.004) * np.sin(20 * angles))
    assert_allclose(deviation, math.sqrt(60 * 1e-10))  # sine and cosine of a period together are one deviation


def test_a_gap_parts_the_measured_ranges() -> None:
    limited = (math.radians(-90), math.radians(120))
    assert ranges(curve({1: 1.0}, np.r_[-80.0:-20.0:5j, 40.0:100.0:5j], limited)) == [[-80, -20], [40, 100]]
    assert ranges(curve({1: 1.0}, np.array([10.0]), limited)) == [[10, 10]]
    assert ranges(curve({1: 1.0}, np.linspace(-175, 172, 60))) == [[-180, 180]]
    assert ranges(curve({1: 1.0}, np.r_[-175.0:-20.0:30j, 40.0:172.0:30j])) == [[-180, -20], [40, 180]]
    assert ranges(curve({1: 1.0}, np.r_[-160.0:160.0:60j])) == [[-160, 160]]


def test_its_size_is_that_where_it_was_measured() -> None:
    result = curve({4: 10.0}, EVERYWHERE)
    assert result.rms == pytest.approx(math.radians(0.01) / math.sqrt(2), rel=1e-3)
    assert result.rms_deviation == pytest.approx(1e-5 / math.sqrt(2), rel=0.01)
    short = curve({1: 10.0}, np.linspace(-10, 10, 30))  # nearly a straight line of 3.5 mdeg
    assert math.degrees(short.rms) == pytest.approx(0.010 * math.radians(10) / math.sqrt(3), rel=0.02)


def test_the_strongest_periods_are_told_with_their_neighbours() -> None:
    result = curve({1: 3.0, 19: 5.0, 20: 6.0, 21: 5.5, 22: 4.5, 50: 1.0, 58: 0.1}, EVERYWHERE)
    assert [group.range for group in result.strongest] == ["19 to 22", "1", "50"]
    assert math.degrees(result.strongest[0].amplitude) == pytest.approx(1e-3 * math.sqrt(25 + 36 + 30.25 + 20.25))
    assert lines_of([curve_block(result)]) == [
        "Joint 2: curve of 0.0078 +- 0.0004 deg rms, strongest at 19 to 22 periods a turn"
    ]
    several = curve({1: 10.0, 28: 6.0, 58: 5.0, 40: 2.0}, EVERYWHERE)
    (line,) = lines_of([curve_block(several)])
    assert line.endswith("0.0091 +- 0.0004 deg rms, strongest at 1, 28 and 58 periods a turn")
    (line,) = lines_of([curve_block(curve({1: 1.414214}, EVERYWHERE))])
    assert line == "Joint 2: curve of 0.0010 +- 0.0004 deg rms, strongest at 1 period a turn"
    summary = json_of([curve_block(result)])
    assert list(summary) == ["joint", "rms_mdeg", "rms_deviation_mdeg", "strongest", "measured_deg"]
    assert summary["strongest"][1] == {"periods": [1, 1], "amplitude_mdeg": pytest.approx(3.0)}
    assert summary["measured_deg"] == [[-180.0, 180.0]]


def test_curves_of_a_fit_are_those_of_its_parameters() -> None:
    nominal = load_robot("li3")
    twin = truth_twin(nominal, "gear-errors", np.random.default_rng(1))
    rng = np.random.default_rng(2)
    data = measure(twin, nominal.random_configurations(60, rng), 1e-5, rng)
    fit = identify(nominal, data, named_model("geometric").also(["joint-curve"]))
    result = fitted_curves(fit, data)
    q = np.linspace(-1.0, 1.0, 7)
    values, uncertain, covariance = fit.robot.values, (*fit.free.names, *fit.unfitted), fit.covariance_with_unfitted
    for fitted_curve in result:
        expected = sum(
            values[f"curve_sin{k}_{fitted_curve.number}"] * np.sin(k * q)
            + values[f"curve_cos{k}_{fitted_curve.number}"] * np.cos(k * q)
            for k in range(1, 61)
        )
        assert_allclose(fitted_curve.at(q)[0], expected, atol=1e-15)
        for place, name in enumerate(curve_names(fitted_curve.number)):
            index = uncertain.index(name) if name in uncertain else None
            assert fitted_curve.covariance[place, place] == (0.0 if index is None else covariance[index, index])
    assert result
    without = replace(fit, robot=fit.robot.with_values({n: 0.0 for n in fit.free.names if n.startswith("curve_")}))
    assert fitted_curves(without, data) == ()
    assert fitted_curves(identify(nominal, data, named_model("geometric")), data) == ()
