"""Samples of a tip whose motion is known in closed form, and the plan that it follows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from truearm.engine.motion.cube import Cube
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import rotation_from_vector
from truearm.iso9283.criteria.rows import Instrument, Value
from truearm.iso9283.planning.criteria import TESTS, PerformancePlan, PlannedPath, PlannedPose, PlannedTest, Way
from truearm.iso9283.planning.records import Names, Samples

EXACT = Instrument(0.0, 0.0)
TRACKER = Instrument(0.02e-3)
HERE = np.eye(4)
CENTRE = np.array([0.5, 0.0, 0.4])
NORMAL = np.array([0.0, -1.0, 1.0]) / np.sqrt(2.0)
ALONG = np.array([1.0, 0.0, 0.0])
ACROSS = np.cross(NORMAL, ALONG)
#: The orientation with which the line alternates, in the base frame.
TURN = np.array([0.2, -0.1, 0.3])


def plan_of(*, velocity: float = 0.25) -> PerformancePlan:
    """Return a plan with all paths; `velocity` is the rated one [m/s]."""
    u, v = 0.2 * ALONG, 0.15 * ACROSS
    rotation, other = np.eye(3), rotation_from_vector(TURN[None])[0]

    def path(name: str, kind: str, points: list[Array], **more: float | Array) -> PlannedPath:
        return PlannedPath(name, kind, np.array(points), NORMAL, rotation, **more)  # type: ignore[arg-type]

    paths = [
        path("line", "polyline", [CENTRE - u - v, CENTRE + u + v], other=other),
        path(
            "rectangle", "polyline", [CENTRE + a * u + b * v for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
        ),
        path("large-circle", "circle", [CENTRE, CENTRE + u]),
        path("small-circle", "circle", [CENTRE, CENTRE + 0.125 * u]),
        path("weave", "weave", [CENTRE - u, CENTRE + u], stroke=0.02, wavelength=0.04),
    ]
    P1 = PlannedPose("P1", CENTRE, rotation, np.zeros(6))
    D100 = PlannedPose("D100", CENTRE + 0.1 * ALONG, rotation, np.zeros(6))
    tests = [
        PlannedTest(t.id, t.places, t.cycles, approaches=("D100",) if t.id == "posing-time" else ())
        for t in TESTS.values()
    ]
    return PerformancePlan(
        robot=load_robot("irb120"),
        target=None,
        cube=Cube(CENTRE, 0.5),
        plane="C1-C2-C7-C8",
        poses={"P1": P1, "D100": D100},
        paths={one.name: one for one in paths},
        starts={},
        tests=tuple(tests),
        rated_load=3.0,
        rated_velocity=velocity,
    )


def samples_of(
    test: str, place: str, rows: list[tuple[int, Array, Array]], rotation: list[Array] | None = None
) -> Samples:
    """Return samples of cycles, each with its number, times and positions."""
    cycle = np.concatenate([np.full(len(time), number) for number, time, _ in rows])
    n = len(cycle)
    return Samples(
        criterion=Names((test,), np.zeros(n, dtype=np.intp)),
        place=Names((place,), np.zeros(n, dtype=np.intp)),
        cycle=cycle,
        velocity=np.ones(n),
        load=np.ones(n),
        time=np.concatenate([time for _, time, _ in rows]),
        position=np.concatenate([position for _, _, position in rows]),
        rotation=None if rotation is None else np.concatenate(rotation),
        line=np.arange(2, n + 2),
        source="paths.csv",
    )


def times(duration: float, rate: float, rng: np.random.Generator | None = None, lost: float = 0.0) -> Array:
    """Return sample times, some of them lost."""
    made = np.arange(0.0, duration, 1.0 / rate)
    return made if rng is None else made[rng.random(len(made)) >= lost]


def ramp(time: Array, length: float, velocity: float, acceleration: float = 2.5) -> Array:
    """Return the distance travelled from time 0 on, with even acceleration at both ends, ``(n,)``."""
    rise = velocity / acceleration
    whole = length / velocity + rise
    t = np.clip(time, 0.0, whole)
    up = 0.5 * acceleration * np.minimum(t, rise) ** 2
    down = 0.5 * acceleration * np.maximum(t - (whole - rise), 0.0) ** 2
    return np.asarray(up + velocity * np.maximum(t - rise, 0.0) - down)


def duration_of(length: float, velocity: float, acceleration: float = 2.5) -> float:
    return length / velocity + velocity / acceleration


def along(plan: PerformancePlan, name: str, distance: Array) -> Array:
    return Way(plan.paths[name]).position(distance)


def stream_of(
    plan: PerformancePlan,
    name: str,
    rate: float,
    rng: np.random.Generator,
    *,
    cycles: int,
    offset: Callable[[Array], Array],
    velocity: float,
    sigma: float = 0.02e-3,
    lost: float = 0.05,
) -> tuple[Array, Array, list[tuple[float, float]]]:
    """Return time, position and when each cycle begins and ends, of a whole test with dwells and pauses between.

    The tip goes back from the end of an open path to its begin beside the path.
    """
    way = Way(plan.paths[name])
    length, duration = way.length, duration_of(way.length, velocity)
    closed = name != "line"
    begin, motions, now = [], [], rng.uniform(0.5, 1.5)
    back = duration_of(
        float(np.linalg.norm(way.position(np.array([length])) - way.position(np.array([0.0])))), velocity
    )
    for _ in range(cycles):
        begin.append(now)
        now += duration + rng.choice([0.3, 0.8, 3.0])
        if not closed:
            motions.append(now)
            now += back + rng.choice([0.3, 0.8, 3.0])
    time = times(now + 0.5, rate, rng, lost)
    at = np.zeros(len(time))
    aside = np.zeros(len(time))
    for start in begin:
        at = np.where(time >= start, ramp(time - start, length, velocity), at)
    if motions:
        at = np.zeros(len(time))
        for go, ret in zip(begin, motions, strict=True):
            at = np.where((time >= go) & (time < ret), ramp(time - go, length, velocity), at)
            share = ramp(time - ret, length, velocity) / length
            returning = time >= ret
            at = np.where(returning, length * (1.0 - share), at)
            aside = np.where(returning & (share < 1.0), 0.05 * np.sin(np.pi * share), aside)
            aside = np.where(returning & (share >= 1.0), 0.0, aside)
    position = way.position(at) + offset(at) + np.outer(aside, NORMAL) + rng.normal(0.0, sigma, (len(time), 3))
    return time, position, [(start, start + duration) for start in begin]


def the(values: list[Value], id_: str, component: str = "position", where: str | None = None) -> Value:
    """Return the one value of a criterion."""
    (found,) = [
        value for value in values if value.id == id_ and value.component == component and where in (None, value.where)
    ]
    return found
