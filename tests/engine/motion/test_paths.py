"""Paths and time laws against closed forms, finite differences and SciPy's spline and quadrature."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from tests.expecting import refusing
from tests.house.examples import PATH

from truearm.engine.motion.path_file import PlannedPath, read_path
from truearm.engine.motion.paths import Circle, Hermite, Line, TimeLaw, timed
from truearm.engine.motion.paths import Path as Way
from truearm.engine.robot.chain import Array

WAYPOINTS = np.array([[0.3, 0.0, 0.2], [0.4, 0.1, 0.25], [0.35, 0.25, 0.3], [0.2, 0.3, 0.2]])
VELOCITIES = np.array([[0.1, 0.0, 0.0], [0.05, 0.15, 0.05], [-0.1, 0.1, 0.0], [-0.1, 0.0, -0.1]])
PATHS: list[Way] = [
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
def test_direction_and_curvature_are_derivatives_by_the_distance(path: Way) -> None:
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
def test_a_timed_path_runs_from_rest_to_rest(path: Way) -> None:
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


def test_refusals() -> None:
    wrong: list[tuple[str, Callable[[], object]]] = [
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
    ]
    for words, make in wrong:
        with refusing(words, of=words):
            make()


# -- path files: what they describe, and what they cannot be

HEAD = """\
truearm: truearm-path/1
units: {length: mm, angle: deg, time: s}
speed: 100
acceleration: 500
step: 0.05
start: [300, 0, 300]
sections:
"""


def read(folder: Path, sections: str, head: str = HEAD) -> PlannedPath:
    file = folder / "path.yaml"
    file.write_text(head + sections)
    return read_path(file)


def test_sections_follow_each_other_from_rest_to_rest(tmp_path: Path) -> None:
    file = tmp_path / "path.yaml"
    file.write_text(PATH)
    path = read_path(file)
    trajectory = path.trajectory
    assert path.kinds == ("line", "circle", "hermite")
    assert path.tip == pytest.approx((0.0, 0.0, 0.1))
    assert path.orientation == "full"
    assert path.rotation == pytest.approx(np.diag([1.0, -1.0, -1.0]))
    assert (np.diff(trajectory.time) > 0).all()
    ends = [int(np.flatnonzero(path.section == number)[-1]) for number in (1, 2, 3)]
    assert trajectory.position[ends] == pytest.approx(
        np.array([[0.35, 0.06, 0.25], [0.35, 0.06, 0.25], [0.35, 0.0, 0.25]]), abs=1e-12
    )
    assert trajectory.velocity[[0, *ends]] == pytest.approx(0.0, abs=1e-9)
    circle = trajectory.position[path.section == 2] - [0.35, 0.08, 0.25]
    assert np.linalg.norm(circle, axis=1) == pytest.approx(0.02, abs=1e-12)
    speeds = np.linalg.norm(trajectory.velocity, axis=1)
    assert speeds[path.section == 1].max() <= 0.2 + 1e-9
    assert speeds[path.section == 2].max() <= 0.1 + 1e-9
    step = np.diff(trajectory.position, axis=0) / np.diff(trajectory.time)[:, None]
    assert np.linalg.norm(step, axis=1).max() <= 0.2 + 1e-6


def test_units_are_those_of_the_file(tmp_path: Path) -> None:
    metres = HEAD.replace("length: mm", "length: m").replace("[300, 0, 300]", "[0.3, 0, 0.3]")
    metres = metres.replace("speed: 100", "speed: 0.1").replace("acceleration: 500", "acceleration: 0.5")
    one = read(tmp_path, "  - line: [300, 100, 300]\n")
    other = read(tmp_path, "  - line: [0.3, 0.1, 0.3]\n", metres)
    assert other.trajectory.position == pytest.approx(one.trajectory.position, abs=1e-12)


def test_an_axis_to_keep_is_a_rotation_about_it(tmp_path: Path) -> None:
    path = read(
        tmp_path, "  - line: [300, 100, 300]\n", HEAD.replace("speed:", "orientation: {axis: [0, 3, -4]}\nspeed:", 1)
    )
    assert path.orientation == "axis"
    assert path.rotation[:, 2] == pytest.approx([0.0, 0.6, -0.8])
    assert path.rotation @ path.rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(path.rotation) == pytest.approx(1.0)


TWO_ENDS = "  - {hermite: [[300, 50, 300]], "
AT_REST = "velocities: [[0, 0, 0], [0, 0, 0]]"


def test_what_a_section_cannot_be_is_refused_with_its_number(tmp_path: Path) -> None:
    for sections, said in (
        ("  - line: [300, 0, 300]\n", "sections[1]: the line has no length"),
        ("  - line: [300, 50, 300]\n  - hermite: [[300, 50, 300], [300, 0, 300]]\n", "[2]: a waypoint repeats"),
        ("  - circle: [[300, 50, 300], [300, 100, 300]]\n", "three points on a line define no circle"),
        ("  - circle: {centre: [300, 0, 300], normal: [0, 0, 1]}\n", "radius and normal of a circle must not be zero"),
        ("  - circle: {centre: [300, 50, 300], normal: [0, 1, 0]}\n", "does not lie in its plane"),
        ("  - circle: {centre: [300, 50, 300], normal: [0, 0, 0]}\n", "a direction cannot be zero"),
        ("  - {line: [300, 50, 300], speed: -10}\n", "speed"),
        ("  - {line: [300, 50, 300], acceleration: 0}\n", "acceleration"),
        ("  - {line: [300, 50, 300], circle: [[1, 2, 3], [4, 5, 6]]}\n", "a section is of one kind"),
        ("  - {speed: 10}\n", "a section is of one kind"),
        (TWO_ENDS + "times: [0, 1]}\n", "velocities and times belong together"),
        (TWO_ENDS + f"times: [0, -1], {AT_REST}}}\n", "times"),
        (TWO_ENDS + f"times: [1, 0.5], {AT_REST}}}\n", "times do not rise"),
        (TWO_ENDS + "times: [0, 1], velocities: [[0, 9, 0], [0, 0, 0]]}\n", "a section begins and ends at rest"),
        (TWO_ENDS + "times: [0, 1], velocities: [[0, 0, 0]]}\n", "those of all waypoints"),
        (TWO_ENDS + f"times: [0, 1], {AT_REST}, speed: 5}}\n", "has no other time law"),
        ("  - {line: [300, 50, 300], speed: 1.0e-4}\n", "the path has too many samples"),
        ("  - {line: [300, 50]}\n", "sections[1]"),
        ("  - {arc: [300, 50, 300]}\n", "arc"),
        ("  []\n", "sections"),
    ):
        with refusing("path.yaml", said, of=sections):
            read(tmp_path, sections)


def test_what_a_file_cannot_be_is_refused(tmp_path: Path) -> None:
    for old, new, said in (
        ("units: {length: mm, angle: deg, time: s}\n", "", "units"),
        ("length: mm, ", "", "length"),
        ("time: s", "time: ms", "time"),
        ("step: 0.05", "step: -0.05", "step"),
        ("start: [300, 0, 300]\n", "", "start"),
        ("speed:", "tip: [0, 0, 1]\ntarget: a\nspeed:", "only one of them can follow the path"),
        ("speed:", "orientation: {axis: [0, 0, 0]}\nspeed:", "a direction cannot be zero"),
        ("speed:", "orientation: {}\nspeed:", "one orientation belongs here"),
        ("speed:", "orientation: {quaternion: [1, 1, 0, 0]}\nspeed:", "length 1"),
        ("speed:", "frame: tool\nspeed:", "frame"),
        ("speed: 100", "speed: 100\njoint_speeds: [10, 0]", "joint_speeds"),
    ):
        assert old in HEAD
        with refusing("path.yaml", said, of=new):
            read(tmp_path, "  - line: [300, 100, 300]\n", HEAD.replace(old, new, 1))


def test_how_long_a_direction_is_does_not_matter(tmp_path: Path) -> None:
    one = read(tmp_path, "  - circle: {centre: [300, 50, 300], normal: [0, 0, 1]}\n")
    other = read(tmp_path, "  - circle: {centre: [300, 50, 300], normal: [0, 0, 1.0e+300]}\n")
    assert other.trajectory.position == pytest.approx(one.trajectory.position, abs=1e-15)
