from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import least_squares
from tests.expecting import refusing

from truearm.engine.base.errors import InputError
from truearm.engine.data.circles import Circle, fit_circle
from truearm.engine.robot.chain import Array

CENTRE = np.array([1.0, -2.0, 0.5])


def frame(seed: int) -> Array:
    return np.asarray(np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0])


def on_circle(angle: Array, radius: float, axes: Array) -> Array:
    x, y = axes[:, 0], axes[:, 1]
    return np.asarray(CENTRE + radius * (np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * y))


def test_points_on_a_circle_give_it_back() -> None:
    for arc, axes in ((5.0, frame(1)), (60.0, frame(1)), (200.0, frame(1)), (330.0, frame(1)), (330.0, np.eye(3))):
        circle = fit_circle(on_circle(np.radians(np.linspace(0, arc, 15)), 0.4, axes), 1e-6)
        assert_allclose(circle.centre, CENTRE, rtol=0, atol=1e-9, err_msg=str(arc))
        assert circle.radius == pytest.approx(0.4, abs=1e-9)
        # where the circle is level the document's k = n x z is 0/0
        assert abs(circle.normal @ axes[:, 2]) == pytest.approx(1.0, abs=1e-12)
        assert math.degrees(circle.arc) == pytest.approx(arc, abs=1e-4)
        assert max(np.abs(circle.radial).max(), np.abs(circle.axial).max()) < 1e-9


def test_it_is_the_circle_of_least_distances() -> None:
    """Against SciPy on the distances in space, with plane and circle free together."""
    rng = np.random.default_rng(3)
    axes = frame(2)
    points = on_circle(np.linspace(0, 1.4, 25), 0.5, axes) + rng.normal(0, 2e-4, (25, 3))
    circle = fit_circle(points)

    def distances(v: Array) -> Array:
        tilted = axes[:, 2] + v[3] * axes[:, 0] + v[4] * axes[:, 1]
        normal = tilted / np.linalg.norm(tilted)
        away = points - CENTRE - v[:3]
        axial = away @ normal
        return np.concatenate([np.linalg.norm(away - axial[:, None] * normal, axis=1) - v[5], axial])

    best = least_squares(distances, [0.0, 0.0, 0.0, 0.0, 0.0, 0.5], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    own = float(circle.radial @ circle.radial + circle.axial @ circle.axial)
    assert own == pytest.approx(2 * best.cost, rel=1e-4)
    assert circle.radius == pytest.approx(best.x[5], abs=2e-6)


def errors_in_deviations(circle: Circle, axes: Array, radius: float) -> tuple[float, ...]:
    normal = circle.normal * np.sign(circle.normal @ axes[:, 2])
    lean = axes[:, 2] - normal
    off = CENTRE - circle.centre
    plane = np.array([off @ circle.x, off @ circle.y])
    spread = circle.sigma**2 * circle.shares[:2, :2]
    return (
        float(lean @ circle.x) / (circle.sigma * math.sqrt(circle.tilts[0])),
        float(lean @ circle.y) / (circle.sigma * math.sqrt(circle.tilts[1])),
        float(plane @ np.linalg.solve(spread, plane)),
        (radius - circle.radius) / circle.radius_deviation,
        (circle.residual / circle.sigma) ** 2,
    )


@pytest.mark.parametrize("arc", [40.0, 130.0, 360.0])
def test_stated_deviations_are_those_of_repetitions(arc: float) -> None:
    rng, axes = np.random.default_rng(4), frame(5)
    perfect = on_circle(np.radians(np.linspace(0, arc, 18)), 0.3, axes)
    found = [
        errors_in_deviations(fit_circle(perfect + rng.normal(0, 2e-5, perfect.shape), 2e-5), axes, 0.3)
        for _ in range(1500)
    ]
    tilt_x, tilt_y, centre, radius, residual = np.array(found).T
    for values in (tilt_x, tilt_y, radius):
        assert np.std(values) == pytest.approx(1.0, abs=0.07)
        assert abs(np.mean(values)) < 0.12
    assert np.mean(centre) == pytest.approx(2.0, abs=0.2)
    assert np.mean(residual) == pytest.approx(1.0, abs=0.03)


def test_reversing_turns_axis_and_angles() -> None:
    rng = np.random.default_rng(6)
    circle = fit_circle(on_circle(np.linspace(0, 2, 12), 0.3, frame(6)) + rng.normal(0, 1e-5, (12, 3)))
    other = circle.reversed()
    assert_allclose(other.normal, -circle.normal)
    assert_allclose(np.cross(other.x, other.y), other.normal, atol=1e-12)
    assert_allclose(other.angle, -circle.angle)
    across = np.stack([other.x, other.y], axis=1) @ other.shares[:2, :2] @ np.stack([other.x, other.y])
    assert_allclose(across, np.stack([circle.x, circle.y], 1) @ circle.shares[:2, :2] @ np.stack([circle.x, circle.y]))


def test_an_arc_too_short_is_refused_with_its_uncertainty_and_lines_and_handfuls_are_no_circles() -> None:
    points = on_circle(np.radians(np.linspace(0, 3, 10)), 0.3, frame(7))
    points += np.random.default_rng(7).normal(0, 2e-5, points.shape)
    with pytest.raises(InputError, match=r"joint 3: the arc is too short.*over \d.* deg.*standard deviation of.*mrad"):
        fit_circle(points, 2e-5, "joint 3")
    for points, said in (
        (np.outer(np.arange(5.0), [1.0, 2.0, 3.0]), "straight line"),
        (np.ones((5, 3)), "straight line"),
        (np.eye(3), "got 3"),
    ):
        with refusing(said):
            fit_circle(points)
