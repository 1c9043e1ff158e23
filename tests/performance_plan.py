"""A small plan of tests by ISO 9283 for an IRB 120, for whoever needs one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from truearm.engine.motion.cube import Cube
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import rotation_from_vector
from truearm.iso9283.planning.criteria import TESTS, PerformancePlan, PlannedPath, PlannedPose, PlannedTest

#: z of the tip down.
DOWN = np.diag([1.0, -1.0, -1.0])
_CUBE = Cube((0.35, 0.0, 0.35), 0.2)


def small_plan(
    tests: Sequence[str] = tuple(TESTS),
    *,
    cycles: Mapping[str, int] | None = None,
    velocities: Sequence[float] = (1.0,),
    loads: Sequence[float] = (1.0,),
    hours: float = 1.0,
    rated_velocity: float = 0.5,
) -> PerformancePlan:
    """Return a plan of some tests in a cube of 200 mm."""
    robot = load_robot("irb120")
    plane = _CUBE.plane("C1-C2-C7-C8")
    points = plane.measuring_points
    places = {f"P{k}": p for k, p in enumerate(points, 1)}
    begin = {(p, a): places[p] - 0.02 * np.eye(3)["xyz".index(a)] for p in ("P1", "P2", "P4") for a in "xyz"}
    outwards = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    distances = {f"D{d}": points[0] + 1e-3 * d * outwards for d in (10, 50)}
    position = np.array([*places.values(), *distances.values(), *begin.values()])
    found = inverse(
        robot, position, np.broadcast_to(DOWN, (len(position), 3, 3)), seed=np.radians([0, 20, 0, 0, 60, 0])
    )
    joints = found.without_unreached().joints
    poses = [PlannedPose(name, p, DOWN, q) for name, p, q in zip([*places, *distances], position, joints, strict=False)]
    starts = {
        key: PlannedPose(f"{key[0]} from {key[1]}", p, DOWN, q)
        for (key, p), q in zip(begin.items(), joints[len(poses) :], strict=True)
    }
    centre, reach = plane.centre, 0.08 * plane.along
    other = rotation_from_vector(np.radians([[10.0, 0.0, 0.0]]))[0] @ DOWN

    def path(name: str, kind: str, along: list[Array], **more: object) -> PlannedPath:
        return PlannedPath(name, kind, np.array(along), plane.normal, DOWN, **more)  # type: ignore[arg-type]

    paths = [
        path("line", "polyline", [points[1], points[3]], other=other),
        path("rectangle", "polyline", [*points[1:], points[1]]),
        path("large-circle", "circle", [centre, centre + reach]),
        path("small-circle", "circle", [centre, centre + reach / 8]),
        path("weave", "weave", [centre - reach, centre + reach], stroke=0.01, wavelength=0.02),
    ]
    approaches = {
        "vAP": ("x", "y", "z"),
        "posing-time": tuple(distances),
        "compliance": ("+x", "-x", "+y", "-y", "+z", "-z"),
    }
    planned = [
        PlannedTest(
            name,
            TESTS[name].places,
            (cycles or {}).get(name, TESTS[name].cycles),
            tuple(velocities),
            tuple(loads),
            approaches.get(name, ()),
        )
        for name in tests
    ]
    return PerformancePlan(
        replace(robot, targets=()),
        None,
        _CUBE,
        plane.name,
        {p.name: p for p in poses},
        {p.name: p for p in paths},
        starts,
        tuple(planned),
        3.0,
        rated_velocity,
        hours=hours,
    )
