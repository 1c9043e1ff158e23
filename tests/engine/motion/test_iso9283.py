"""The cube of ISO 9283 against its definition, and the largest one against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest

from truearm.engine.base.errors import InputError
from truearm.engine.motion.cube import PLANES, Cube
from truearm.engine.motion.largest_cube import largest_cube
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint
from truearm.engine.robot.robot import Robot

CUBE = Cube((0.4, 0.1, 0.3), 0.2)


def ball(radius: float) -> Robot:
    """Two crossing joints and a slide through their crossing: the tip gets to every point of a ball."""
    rows = [
        ("revolute", {"alpha": 0.0, "a": 0.0, "d": 0.0, "theta_offset": 0.0}, (-np.pi, np.pi)),
        ("revolute", {"alpha": np.pi / 2, "a": 0.0, "d": 0.0, "theta_offset": 0.0}, (-np.pi, np.pi)),
        ("prismatic", {"alpha": np.pi / 2, "a": 0.0, "d": 0.0, "theta_offset": 0.0}, (0.0, radius)),
    ]
    joints = tuple(Joint(f"j{i}", kind, row, limits) for i, (kind, row, limits) in enumerate(rows, 1))  # type: ignore[arg-type]
    robot = Robot("ball", "Ball", "invented", "modified-dh", joints)
    return robot.with_frames(robot.base, {"tip": (0.0, 0.0, 0.0)})


def test_corners_and_planes() -> None:
    corners = CUBE.corners
    assert np.abs(corners - CUBE.centre) == pytest.approx(0.1)
    assert corners[0] == pytest.approx([0.5, 0.2, 0.4])
    assert corners[4:] == pytest.approx(corners[:4] - [0, 0, 0.2])
    assert {tuple(np.sign(c - CUBE.centre)) for c in corners} == {
        (x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)
    }
    for plane in CUBE.planes:
        named = corners[[int(name[1]) - 1 for name in plane.name.split("-")]]
        assert plane.points([1, -1, -1, 1], [1, 1, -1, -1]) == pytest.approx(named)
        assert plane.normal @ (named - CUBE.centre).T == pytest.approx(0)
        assert abs(plane.normal[2]) == pytest.approx(np.sqrt(0.5))  # inclined by 45 deg
        assert plane.across[2] > 0
    assert len({tuple(np.round(np.abs(p.normal) * np.sign(p.normal[2]) * p.normal, 6)) for p in CUBE.planes}) == 4


@pytest.mark.parametrize("name", PLANES)
def test_measuring_points_lie_a_tenth_of_a_diagonal_from_its_ends(name: str) -> None:
    plane = CUBE.plane(name)
    p = plane.measuring_points
    assert p[0] == pytest.approx(CUBE.centre)
    diagonal = 0.2 * np.sqrt(3)
    corners = CUBE.corners[list(PLANES[name])]
    assert np.linalg.norm(p[1:] - corners, axis=1) == pytest.approx(0.1 * diagonal)
    assert np.linalg.norm(p[1:] - CUBE.centre, axis=1) == pytest.approx(0.4 * diagonal)


def test_points_fill_a_plane_evenly() -> None:
    plane = CUBE.planes[1]
    for count in (1, 7, 29, 30, 200):
        points = plane.spread(count)
        u, v = (points - plane.centre) @ plane.along / 0.1, (points - plane.centre) @ plane.across / (0.1 * np.sqrt(2))
        assert (points - plane.centre) @ plane.normal == pytest.approx(0, abs=1e-15)
        assert max(np.abs(u).max(), np.abs(v).max()) < 1
        if count > 1:
            apart = min(float(np.linalg.norm(a - b)) for a, b in combinations(points, 2))
            assert apart > 0.55 * np.sqrt(0.2 * 0.2 * np.sqrt(2) / count)  # a square lattice has 1
        # Every eighth of the plane has its share.
        if count == 200:
            counts = np.histogram2d(u, v, bins=[2, 4], range=[[-1, 1], [-1, 1]])[0]
            assert np.abs(counts - 25).max() <= 3


def test_paths_on_the_plane_of_the_katana_thesis() -> None:
    cube = Cube((0.0, -0.3, 0.1392893), 0.25)
    circle = cube.plane("C3-C4-C5-C6").circle(0.1)
    points = np.array([[-100, -300, 139.2893], [0, -370.7107, 210], [100, -300, 139.2893], [0, -229.2893, 68.5786]])
    went = circle.at(np.arange(4) * circle.length / 4)[0]
    assert min(np.abs(went - order).max() for order in (points * 1e-3, points[[0, 3, 2, 1]] * 1e-3)) < 1e-6
    line = cube.plane("C3-C4-C5-C6").line(0.2)
    assert line.at(np.array([0.0, 0.2]))[0] == pytest.approx(points[[3, 1]] * 1e-3, abs=1e-6)


def test_the_largest_cube_in_a_ball() -> None:
    whole = largest_cube(ball(0.6), target="tip", floor=-1.0)
    assert whole.side == pytest.approx(0.6 * np.sqrt(2 / 3), rel=0.01)  # x to s, y and z to s/2
    assert whole.centre == pytest.approx([whole.side / 2, 0, 0], abs=0.01)


def test_the_largest_cube_in_front_and_above() -> None:
    upper = largest_cube(ball(0.6), target="tip", ahead="-y", nearest=0.1, floor=0.0)
    s = (-0.2 + np.sqrt(0.04 + 9 * 0.35)) * 2 / 9  # (0.1 + s)^2 + s^2/4 + s^2 = 0.6^2
    assert upper.side == pytest.approx(s, rel=0.01)
    assert upper.side < s * (1 + 1e-5)
    assert upper.centre == pytest.approx([0, -0.1 - s / 2, s / 2], abs=0.01)


def test_inverse_kinematics_reaches_the_largest_cube_and_not_one_around_it() -> None:
    robot = load_robot("irb120")
    cube = largest_cube(robot, nearest=0.15)
    corners = cube.corners
    assert corners[:, 0].min() >= 0.15 - 1e-9
    assert corners[:, 2].min() >= -1e-9
    assert inverse(robot, corners, orientation="free").complete
    larger = Cube(cube.centre, 1.05 * cube.side)
    assert not inverse(robot, larger.corners, orientation="free").complete


@pytest.mark.parametrize(
    ("words", "make"),
    [
        ("the side of a cube must be positive; got -5 mm", lambda: Cube((0, 0, 0), -0.005)),
        ("three finite coordinates", lambda: Cube((0, 0, np.inf), 1)),
        ("no such diagonal plane", lambda: CUBE.plane("C1-C3-C5-C7")),
        ("radius of the circle: it does not lie within", lambda: CUBE.planes[0].circle(0.11)),
        ("length of the line: it does not lie within", lambda: CUBE.planes[0].line(0.29)),
        ("no such direction", lambda: largest_cube(ball(1), ahead="up")),  # type: ignore[arg-type]
        ("floor: a bound of the cube", lambda: largest_cube(ball(1), floor=np.nan)),
        ("no target of this name", lambda: largest_cube(ball(1), target="gripper")),
        ("reaches no cube in this", lambda: largest_cube(ball(0.5), floor=2.0)),
    ],
)
def test_refusals(words: str, make: Callable[[], object]) -> None:
    with pytest.raises(InputError, match=words):
        make()
