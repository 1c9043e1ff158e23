"""Plans of tests by ISO 9283: poses and paths in the cube, with the posture in which the arm reaches all of them.

The standard tests in the largest cube of the workspace, on one of its diagonal planes. Where the cube is left open, the
largest one is shrunk until the arm comes to every pose and runs every path of all tests in one posture, with one
orientation of the tip, so that it does not depend on which of them are planned. The standard prints no orientation; the
tip points down, ahead, or at right angles to the plane, whichever allows the largest cube.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.motion.cube import Cube, DiagonalPlane
from truearm.engine.motion.largest_cube import DIRECTIONS, Direction, largest_cube
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branches import BRANCHES, branch_rule
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rotation_from_vector
from truearm.iso9283.planning.criteria import TESTS, PerformancePlan, PlannedPath, PlannedPose, PlannedTest, Way

#: Of the joints that the arm has at least, so that it keeps an orientation along a path.
_LEAST_JOINTS: Final = 6
#: Shares of the rated velocity that most tests are run at, fastest first.
VELOCITIES: Final = (1.0, 0.5, 0.1)
#: Tests that the standard runs at the rated velocity alone, the others being optional.
_RATED_ONLY: Final = ("vAP", "dAP", "E", "t", "posing-time", "compliance")
#: The large and the small circle, the rectangle and the weave, in sides of the cube.
_LARGE: Final = 0.8
_SMALL: Final = 0.1
#: How far ahead of a pose its approaches begin, in sides of the cube.
_APPROACH: Final = 0.1
#: By how much the orientation alternates on the way, about the direction of the line [rad].
_TURN: Final = math.radians(20.0)
#: Of the weave, in sides of the cube, but no more than this [m].
_WEAVE: Final = 0.05
_LARGEST_WEAVE: Final = 10e-3
#: Distances from P1 to which the shortest time is measured [m].
POSING_DISTANCES: Final = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
#: Each next cube is so much smaller.
_SHRUNK: Final = 0.95
_SMALLEST: Final = 0.05
#: The same where cubes are tried everywhere in the largest.
_SHRUNK_WITHIN: Final = 0.9
_SMALLEST_WITHIN: Final = 0.3
#: No joint turns, or slides, further than this between two neighbouring points of a path [rad or m].
_LARGEST_MOVE: Final = 0.35
_POINTS: Final = 33
#: Of the cube: what lies outside by less is on its face [m].
_ON_FACE: Final = 1e-9


def performance_plan(
    robot: Robot,
    *,
    target: str | None = None,
    tests: Sequence[str] = tuple(TESTS),
    cube: Cube | None = None,
    plane: str = "C1-C2-C7-C8",
    rotation: Array | None = None,
    rated_load: float,
    rated_velocity: float,
    velocities: Sequence[float] = VELOCITIES,
    loads: Sequence[float] = (1.0,),
    limit_band: float = 0.1e-3,
    hours: float = 8.0,
    ahead: Direction = "+x",
    nearest: float = 0.0,
    floor: float = 0.0,
    unclear: Callable[[Array], str] | None = None,
    unsuited: Callable[[PerformancePlan], str] | None = None,
) -> PerformancePlan:
    """Plan the tests of a robot.

    Args:
        robot: The nominal arm.
        target: Name of the target that is measured; the flange if None.
        tests: Keys of :data:`truearm.iso9283.planning.criteria.TESTS`.
        cube: In which the poses lie; None for the largest that the arm can be tested in, by all tests.
        plane: Which of its diagonal planes.
        rotation: Orientation of the tip at all poses, in the base frame, ``(3, 3)``; None for the one that allows most.
        rated_load, rated_velocity: [kg], and of the tip along a path [m/s].
        velocities, loads: Shares of them, 0 to 1, that are tested.
        limit_band: Within which of the final pose the tip is said to stand [m].
        hours: How long the drift is watched.
        ahead, nearest, floor: Where the largest cube is looked for, as
            :func:`truearm.engine.motion.largest_cube.largest_cube` has them.
        unclear: What keeps the arm from standing at joint positions ``(n, joints)`` [rad or m], in words, nothing if it
            may at all of them; None for anywhere.
        unsuited: What of a plan cannot be driven, in words, nothing if all can; None for all. Where one of these two is
            given and the cube is left open, smaller ones everywhere in the largest are tried.

    Raises:
        InputError: If the arm has fewer than six joints, or cannot come to every pose and along every path of the cube,
            or those are not clear or cannot be driven.
    """
    _refuse_unfit(robot, ahead)
    find = cube is None
    whole = cube if cube is not None else largest_cube(robot, target=target, ahead=ahead, nearest=nearest, floor=floor)
    restricted = unclear is not None or unsuited is not None
    missed = ""

    def planned_in(tried: Cube, R: Array, wanted: Sequence[str]) -> PerformancePlan | None:
        """Return the plan of some tests in a cube; None, and what is missed, where there is none."""
        nonlocal missed
        layout = _Layout(robot, target, tried, plane, R, wanted)
        if not layout.reached(unclear):
            missed = layout.missed
            return None
        trial_plan = layout.plan(velocities, loads, rated_load, rated_velocity, limit_band, hours)
        words = "" if unsuited is None else unsuited(trial_plan)
        missed = words or missed
        return None if words else trial_plan

    for tried in [whole] if not find else _within(whole, ahead) if restricted else _shrunk(whole):
        for R in [rotation] if rotation is not None else _orientations(tried.plane(plane), ahead):
            # The cube is that of the robot: the same whichever tests are planned in it.
            if find and set(tests) != set(TESTS) and planned_in(tried, R, tuple(TESTS)) is None:
                continue
            fitting = planned_in(tried, R, tests)
            if fitting is not None:
                return fitting
    raise InputError(
        "the robot cannot come to all poses and along all paths of the cube with one orientation, in one posture"
        + (", and keep clear" if restricted else ""),
        where=robot.name,
        came=f"missed: {missed}",
        cure="See that boxes, floor and limits leave the arm room, lower `clearance`, or look in another direction."
        if find and restricted
        else "Take a smaller cube, another centre, plane or orientation.",
    )


def _refuse_unfit(robot: Robot, ahead: str) -> None:
    if len(robot.joints) < _LEAST_JOINTS:
        raise InputError(
            "tests by ISO 9283 keep the orientation of the tip, and this arm cannot",
            where=robot.name,
            came=f"{len(robot.joints)} joints",
            allowed=f"{_LEAST_JOINTS} joints or more",
        )
    if ahead not in DIRECTIONS:
        raise InputError("there is no such direction", where="ahead", came=ahead, allowed=", ".join(DIRECTIONS))


def _shrunk(whole: Cube) -> Iterator[Cube]:
    """Yield ever smaller cubes about the same centre."""
    side = whole.side
    while side >= _SMALLEST * whole.side:
        yield Cube(whole.centre, side)
        side *= _SHRUNK


def _within(whole: Cube, ahead: str) -> Iterator[Cube]:
    """Yield ever smaller cubes inside another one: in its middle, then where they are away from base, floor and boxes.

    Of each size those that are higher, farther ahead and to the sides of the middle.
    """
    out = np.zeros(3)
    out["xy".index(ahead[1])] = 1.0 if ahead[0] == "+" else -1.0
    up = np.array([0.0, 0.0, 1.0])
    aside = np.cross(up, out)
    share = 1.0
    while share >= _SMALLEST_WITHIN:
        margin = (1.0 - share) * whole.side / 2.0
        for way in (0.0 * up, up, out, up + out, aside, -aside, -up) if margin > 0.0 else (0.0 * up,):
            yield Cube(whole.centre + margin * way, share * whole.side)
        share *= _SHRUNK_WITHIN


def _orientations(plane: DiagonalPlane, ahead: str) -> list[Array]:
    """Return orientations of the tip to try: down, at right angles to the plane, ahead."""
    direction = np.zeros(3)
    direction["xy".index(ahead[1])] = 1.0 if ahead[0] == "+" else -1.0
    through = plane.normal if plane.normal @ direction > 0 else -plane.normal
    orientations = []
    for z in (np.array([0.0, 0.0, -1.0]), through, direction):
        x = plane.along - (plane.along @ z) * z
        if np.linalg.norm(x) < 0.1:
            x = np.array([0.0, 0.0, 1.0]) - z[2] * z
        x = x / np.linalg.norm(x)
        orientations.append(np.stack([x, np.cross(z, x), z], axis=1))
    return orientations


def _test(name: str, velocities: Sequence[float], loads: Sequence[float], layout: _Layout) -> PlannedTest:
    known = TESTS[name]
    speeds = (max(velocities),) if name in _RATED_ONLY else tuple(velocities)
    if name == "WS":  # at the rated velocity its frequency is beyond what an arm follows
        speeds = (min(velocities),)
    approaches: tuple[str, ...] = ()
    if name == "vAP":
        approaches = ("x", "y", "z")
    elif name == "compliance":
        approaches = ("+x", "-x", "+y", "-y", "+z", "-z")
    elif name == "posing-time":
        approaches = tuple(layout.distances)
    carried = (max(loads),) if name == "compliance" else tuple(loads)
    return PlannedTest(name, known.places, known.cycles, speeds, carried, approaches)


class _Layout:
    """Where everything lies in a cube, and in which posture the arm reaches it."""

    def __init__(
        self, robot: Robot, target: str | None, cube: Cube, plane: str, rotation: Array, tests: Sequence[str]
    ) -> None:
        self.robot, self.target, self.cube, self.rotation, self.tests = robot, target, cube, rotation, tests
        self.plane_name, self.plane = plane, cube.plane(plane)
        self.missed = ""
        points = self.plane.measuring_points
        self.places = {f"P{k}": p for k, p in enumerate(points, 1)}
        towards = points[1] - points[0]
        towards = towards / np.linalg.norm(towards)
        half = 0.4 * math.sqrt(3.0) * cube.side
        self.distances: dict[str, Array] = {}
        if "posing-time" in tests:
            self.distances = {
                f"D{round(d * 1e3)}": points[0] + d * towards for d in POSING_DISTANCES if d <= half + _ON_FACE
            }
        self.begin: dict[tuple[str, str], Array] = {}
        if "vAP" in tests:
            for name in TESTS["vAP"].places:
                for k, axis in enumerate("xyz"):
                    inward = -1.0 if self.places[name][k] > cube.centre[k] - _ON_FACE else 1.0
                    start = self.places[name].copy()
                    start[k] += inward * _APPROACH * cube.side
                    self.begin[name, axis] = start
        wanted = {place for test in tests if TESTS[test].readings == "paths" for place in TESTS[test].places}
        self.paths = {name: path for name, path in self._paths().items() if name in wanted}
        if "AT-reorientation" not in tests:
            self.paths = {name: replace(path, other=None) for name, path in self.paths.items()}
        self.joint_positions = np.zeros((0, len(robot.joints)))
        self.names = [*self.places, *self.distances]

    def _paths(self) -> dict[str, PlannedPath]:
        plane, side = self.plane, self.cube.side
        _, P2, P3, P4, P5 = plane.measuring_points
        way = (P4 - P2) / np.linalg.norm(P4 - P2)
        other = rotation_from_vector(_TURN * way[None])[0] @ self.rotation
        stroke = min(_LARGEST_WEAVE, _WEAVE * side)
        reach = _LARGE * side / 2

        def path(name: str, kind: str, points: Sequence[Array], **more: object) -> PlannedPath:
            return PlannedPath(name, kind, np.array(points), plane.normal, self.rotation, **more)  # type: ignore[arg-type]

        centre = plane.centre
        return {
            "line": path("line", "polyline", [P2, P4], other=other),
            "rectangle": path("rectangle", "polyline", [P2, P3, P4, P5, P2]),
            "large-circle": path("large-circle", "circle", [centre, centre + reach * plane.along]),
            "small-circle": path("small-circle", "circle", [centre, centre + _SMALL * side / 2 * plane.along]),
            "weave": path(
                "weave",
                "weave",
                [centre - reach * plane.along, centre + reach * plane.along],
                stroke=stroke,
                wavelength=2.0 * stroke,
            ),
        }

    def reached(self, unclear: Callable[[Array], str] | None = None) -> bool:
        """Find one posture for all, in which nothing is `unclear`; say what is missed where there is none."""
        names: list[str] = [*self.names, *(f"{pose} from {axis}" for pose, axis in self.begin)]
        points = [*self.places.values(), *self.distances.values(), *self.begin.values()]
        turned = [self.rotation] * len(points)
        on_paths: list[tuple[str, slice]] = []
        for path in self.paths.values():
            way = Way(path, reoriented=path.other is not None)
            distance = way.evenly(_POINTS)
            on_paths.append((path.name, slice(len(points), len(points) + len(distance))))
            names += [path.name] * len(distance)
            points += list(way.position(distance))
            turned += list(way.rotation(distance))
        position, rotation = np.array(points), np.array(turned)
        first = slice(0, len(self.names) + len(self.begin))  # far fewer than those of the paths, and farther out
        for seed, branch in self._postures():
            poses = inverse(self.robot, position[first], rotation[first], target=self.target, seed=seed, branch=branch)
            lost = [name for name, status in zip(names, poses.status, strict=False) if not status.usable]
            if lost:
                self.missed = lost[0]
                continue
            words = "" if unclear is None else unclear(poses.joints)
            if words:
                self.missed = f"a posture that keeps clear at every pose ({words})"
                continue
            joint_solutions = inverse(self.robot, position, rotation, target=self.target, seed=seed, branch=branch)
            usable = np.array([status.usable for status in joint_solutions.status])
            if not usable.all():
                self.missed = names[int(np.flatnonzero(~usable)[0])]
                continue
            far = [
                name
                for name, rows in on_paths
                if np.abs(np.diff(joint_solutions.joints[rows], axis=0)).max(initial=0.0) > _LARGEST_MOVE
            ]
            words = "" if unclear is None or far else unclear(joint_solutions.joints)
            if words:
                self.missed = f"a posture that keeps clear on every path ({words})"
                continue
            if not far:
                self.joint_positions = joint_solutions.joints
                return True
            self.missed = f"{far[0]} without a change of posture"
        return False

    def _postures(self) -> list[tuple[Array, str | None]]:
        """Return joint positions that bring the tip to P1, to start from, each with its branch where it has a name."""
        at, turned = self.places["P1"][None], self.rotation[None]
        first = inverse(self.robot, at, turned, target=self.target)
        if not first.status[0].usable:
            self.missed = "P1"
            return []
        if branch_rule(self.robot) is None:
            return [(first.joints[0], None)]
        postures: list[tuple[Array, str | None]] = []
        for name in BRANCHES:
            solution = inverse(self.robot, at, turned, target=self.target, branch=name)
            if solution.status[0].usable:
                postures.append((solution.joints[0], name))
        return sorted(postures, key=lambda posture: float(np.abs(posture[0] - first.joints[0]).max()))

    def plan(
        self,
        velocities: Sequence[float],
        loads: Sequence[float],
        rated_load: float,
        rated_velocity: float,
        limit_band: float,
        hours: float,
    ) -> PerformancePlan:
        """Return the plan of the tests where everything was reached."""
        return PerformancePlan(
            self.robot,
            self.target,
            self.cube,
            self.plane_name,
            self.poses(),
            self.paths,
            self.starts(),
            tuple(_test(test, velocities, loads, self) for test in self.tests),
            rated_load,
            rated_velocity,
            limit_band,
            hours,
        )

    def poses(self) -> Mapping[str, PlannedPose]:
        """Return the poses with their joint positions."""
        rows = [*self.places.items(), *self.distances.items()]
        return {
            name: PlannedPose(name, p, self.rotation, q)
            for (name, p), q in zip(rows, self.joint_positions, strict=False)
        }

    def starts(self) -> Mapping[tuple[str, str], PlannedPose]:
        """Return where each approach begins."""
        first = len(self.names)
        return {
            key: PlannedPose(f"{key[0]} from {key[1]}", p, self.rotation, self.joint_positions[first + k])
            for k, (key, p) in enumerate(self.begin.items())
        }
