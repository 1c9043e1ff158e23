"""Paths and time laws against closed forms, finite differences and SciPy's spline and quadrature."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

from truearm.engine.base.errors import InputError
from truearm.engine.motion.paths import Circle, Hermite, Line, Path, TimeLaw, timed
from truearm.engine.robot.chain import Array

WAYPOINTS = np.array([[0.3, 0.0, 0.2], [0.4, 0.1, 0.25], [0.35, 0.25, 0.3], [0.2, 0.3, 0.2]])
VELOCITIES = np.array([[0.1, 0.0, 0.0], [0.05, 0.15, 0.05], [-0.1, 0.1, 0.0], [-0.1, 0.0, -0.1]])
PATHS: list[Path] = [
    Line((0.1, 0.2, 0.3), (0.4, -0.2, 0.1)),
    Circle((0.1, 0.2, 0.3), (0.1, 0.2, 0.5), (0.0, 3.0, 0.0)),
    Hermite(WAYPOINTS, VELOCITIES, [0.0, 1.0, 1.7, 3.0]),
    Hermite(WAYPOINTS),
]


def slope(function: Callable[[Array], Array], at: Array, step: float) -> Array:
    """Central differences of fourth order."""
    near, far = function(at + step) - function(at - step), function(at + 2 * step) - function(at - 2 * step)
    return np.asarray((8 * near - far) / (12 * step))


@pytest.mark.parametrize("path", PATHS, ids=lambda p: type(p).__name__)
def test_direction_and_curvature_are_derivatives_by_the_distance(path: Path) -> None:
    s = np.random.default_rng(0).uniform(0.01, 0.99, 50) * path.length
    if isinstance(path, Hermite):  # the third derivative jumps at waypoints
        knots = np.array([float(np.abs(path.at(s)[0] - w).sum(1).min()) for w in path.waypoints])
        assert (knots > 1e-3).all()
    _, along, curvature = path.at(s)
    assert np.abs(slope(lambda d: path.at(d)[0], s, 1e-4) - along).max() < 1e-9
    assert np.abs(slope(lambda d: path.at(d)[1], s, 1e-4) - curvature).max() < 1e-6
    assert np.abs(np.linalg.norm(along, axis=1) - 1).max() < 1e-14


def test_the_circle_of_the_katana_thesis() -> None:
    points = np.array([[100, -300, 139.2893], [0, -370.7107, 210], [-100, -300, 139.2893], [0, -229.2893, 68.5786]])
    circle = Circle.through(*points[:3])
    assert circle.radius == pytest.approx(100, abs=1e-4)
    assert circle.centre == pytest.approx([0, -300, 139.2893], abs=1e-4)
    quarters = circle.at(np.arange(4) * circle.length / 4)[0]
    assert np.abs(quarters - points).max() < 2e-4
    assert circle.at(np.array([circle.length]))[0][0] == pytest.approx(points[0], abs=1e-9)
    # Its plane leads outward and up at 45 deg: a diagonal plane of a cube along the axes.
    assert np.abs(circle.normal) == pytest.approx([0, np.sqrt(0.5), np.sqrt(0.5)], abs=1e-6)


def test_hermite_sections_have_the_given_positions_and_velocities() -> None:
    knots = np.array([0.0, 1.0, 1.7, 3.0])
    path = Hermite(WAYPOINTS, VELOCITIES, knots)
    for side in (-1e-12, 1e-12):
        position, velocity, _ = path.by_parameter(np.clip(knots + side, 0, 3))
        assert position == pytest.approx(WAYPOINTS, abs=1e-11)
        assert velocity == pytest.approx(VELOCITIES, abs=1e-10)
    # Each section has four coefficients a coordinate: fourth derivatives vanish.
    x = np.linspace(1.05, 1.65, 5)
    assert np.abs(np.diff(path.by_parameter(x)[0], n=4, axis=0)).max() < 1e-15


def test_length_of_hermite_sections_against_quadrature() -> None:
    knots = [0.0, 1.0, 1.7, 3.0]
    path = Hermite(WAYPOINTS, VELOCITIES, knots)
    whole = sum(
        quad(lambda u: float(np.linalg.norm(path.by_parameter(np.array([u]))[1])), a, b, epsabs=1e-13)[0]
        for a, b in pairwise(knots)
    )
    assert path.length == pytest.approx(whole, rel=1e-11)


def test_without_velocities_it_is_the_natural_spline() -> None:
    knots = np.array([0.0, 0.5, 2.0, 2.4])
    spline = CubicSpline(knots, WAYPOINTS, bc_type="natural")
    x = np.linspace(0, 2.4, 101)
    for derivative, values in enumerate(Hermite(WAYPOINTS, knots=knots).by_parameter(x)):
        assert values == pytest.approx(spline(x, derivative), abs=1e-12)


def test_hermite_over_time_has_its_own_velocities() -> None:
    motion = Hermite(WAYPOINTS, VELOCITIES, [1.0, 2.0, 2.7, 4.0]).trajectory(0.05)
    assert motion.time[[0, -1]] == pytest.approx([0, 3])
    assert motion.position[20] == pytest.approx(WAYPOINTS[1])
    assert motion.velocity[20] == pytest.approx(VELOCITIES[1])


@pytest.mark.parametrize(("length", "peak"), [(0.5, 0.2), (0.05, np.sqrt(0.05 * 0.5 / 1.5))])
def test_the_time_law_reaches_its_speed_and_keeps_its_acceleration(length: float, peak: float) -> None:
    law = TimeLaw(length, speed=0.2, acceleration=0.5)
    t = np.linspace(0, law.duration, 20001)
    s, v, a = law.at(t)
    assert law.peak_speed == pytest.approx(peak)
    assert s[[0, -1]] == pytest.approx([0, length], abs=1e-15)
    assert v[[0, -1]] == pytest.approx([0, 0], abs=1e-15)
    assert a[[0, -1]] == pytest.approx([0, 0], abs=1e-12)
    assert v.max() == pytest.approx(peak, rel=1e-6)
    assert np.abs(a).max() == pytest.approx(0.5, rel=1e-6)
    assert np.abs(np.diff(a)).max() < 10 * 0.5 * (t[1] / law.ramp)  # no jump
    assert (np.diff(s) >= 0).all()
    inner = t[200:-200:97]
    assert slope(lambda x: law.at(x)[0], inner, 1e-4) == pytest.approx(law.at(inner)[1], abs=1e-9)
    assert slope(lambda x: law.at(x)[1], inner, 1e-4) == pytest.approx(law.at(inner)[2], abs=1e-4)


@pytest.mark.parametrize("path", PATHS, ids=lambda p: type(p).__name__)
def test_a_timed_path_runs_from_rest_to_rest(path: Path) -> None:
    motion = timed(path, speed=0.1, acceleration=0.4, step=0.002)
    spline = CubicSpline(motion.time, motion.position)
    inner = slice(50, -50)
    assert motion.velocity[[0, -1]] == pytest.approx(0, abs=1e-15)
    assert np.linalg.norm(motion.velocity, axis=1).max() == pytest.approx(0.1)
    assert motion.distance[-1] == pytest.approx(path.length, rel=1e-5)
    speed_error, error = (
        np.abs(spline(motion.time, order)[inner] - values[inner]).max(axis=1)
        for order, values in ((1, motion.velocity), (2, motion.acceleration))
    )
    assert np.median(speed_error) < 1e-8
    assert np.median(error) < 1e-5
    if not (isinstance(path, Hermite) and path.velocities is VELOCITIES):  # there it jumps at waypoints
        assert speed_error.max() < 1e-6
        assert error.max() < 5e-3
        assert np.abs(np.diff(motion.acceleration, axis=0)).max() < 0.02


@pytest.mark.parametrize(
    ("words", "make"),
    [
        ("the line has no length", lambda: Line((1, 2, 3), (1, 2, 3))),
        ("three finite coordinates", lambda: Line((1, 2), (1, 2, 3))),
        ("three finite coordinates", lambda: Circle((0, 0, np.nan), (1, 0, 0), (0, 0, 1))),
        ("must not be zero", lambda: Circle((1, 0, 0), (1, 0, 0), (0, 0, 1))),
        ("does not lie in its plane", lambda: Circle((0, 0, 0), (1, 0, 0.1), (0, 0, 1))),
        ("three points on a line", lambda: Circle.through((0, 0, 0), (1, 1, 1), (2, 2, 2))),
        ("two waypoints or more", lambda: Hermite(WAYPOINTS[:1])),
        ("does not rise", lambda: Hermite(WAYPOINTS, knots=[0, 1, 1, 2])),
        ("not as many velocities", lambda: Hermite(WAYPOINTS, VELOCITIES[:2])),
        ("NaN or infinite", lambda: Hermite(WAYPOINTS + np.inf, VELOCITIES)),
        ("stands still", lambda: Hermite(WAYPOINTS, 0 * VELOCITIES).length),
        ("speed: it must be a positive number", lambda: timed(PATHS[0], 0, 1, 0.01)),
        ("acceleration: it must be a positive number", lambda: timed(PATHS[0], 1, np.inf, 0.01)),
        ("step: it must be a positive number", lambda: timed(PATHS[0], 1, 1, -1)),
        ("too many samples", lambda: timed(PATHS[0], 1, 1, 1e-9)),
    ],
)
def test_refusals(words: str, make: Callable[[], object]) -> None:
    with pytest.raises(InputError, match=words):
        make()
