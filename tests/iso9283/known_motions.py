"""Motions whose criteria are known in closed form, as samples of several cycles, and what is said of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from tests.moving_tip import ALONG, CENTRE, HERE, TRACKER, along, duration_of, plan_of, ramp, samples_of, times

from truearm.engine.base.errors import Notice
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.alignment import Alignment
from truearm.iso9283.criteria.paths import path_values
from truearm.iso9283.evaluating.data_notices import stream_notices
from truearm.iso9283.evaluating.evaluation import Evaluation
from truearm.iso9283.planning.criteria import PerformancePlan, Way
from truearm.iso9283.planning.records import Samples

PLAN = plan_of()
V = PLAN.rated_velocity
LENGTH = Way(PLAN.paths["line"]).length


def runs(*, rate: float = 100.0, cycles: int = 5, sigma: float = 0.02e-3, shape: str = "line") -> Samples:
    """Return cycles of a path with noise, each from rest to rest."""
    rng = np.random.default_rng(4)
    length = Way(PLAN.paths[shape]).length
    t = times(length / V + 0.4, rate)
    p = along(PLAN, shape, ramp(t - 0.1, length, V))
    return samples_of("AT", shape, [(k + 1, t, p + rng.normal(0.0, sigma, p.shape)) for k in range(cycles)])


def part(samples: Samples, chosen: NDArray[np.bool_]) -> Samples:
    """Return some of the rows of one test at one place."""
    test, place = samples.criterion.names[0], samples.place.names[0]
    rows = [(k, chosen & (samples.cycle == k)) for k in sorted({*samples.cycle.tolist()})]
    return samples_of(test, place, [(k, samples.time[of_cycle], samples.position[of_cycle]) for k, of_cycle in rows])


def to_rest(
    away: Array,
    t: Array,
    *,
    test: str = "t",
    place: str = "P1",
    sigma: float = 0.0,
    seed: int = 0,
    cycles: int = 3,
    way: Array = ALONG,
) -> Samples:
    """Return cycles of a tip that is so far from its pose over time."""
    rng = np.random.default_rng(seed)
    p = CENTRE + np.outer(away, way)
    return samples_of(test, place, [(k, t, p + rng.normal(0.0, sigma, p.shape)) for k in range(1, cycles + 1)])


def damped(tau: Array, amplitude: float, hertz: float, damping: float) -> Array:
    """Return a damped oscillation that begins at time 0."""
    own = 2 * np.pi * hertz
    turn, tau = own * np.sqrt(1 - damping**2), np.maximum(tau, 0.0)
    x = np.exp(-damping * own * tau) * (np.cos(turn * tau) + damping * own / turn * np.sin(turn * tau))
    return np.asarray(amplitude * x)


def cornering(
    radius: float = 0.0,
    beyond: float = 0.0,
    *,
    plan: PerformancePlan = PLAN,
    rate: float = 500.0,
    sigma: float = 0.0,
    seed: int = 0,
    apart: float = 0.0,
) -> Samples:
    """Return cycles of the rectangle: corners cut by an arc, or a half sine of a height beyond each second side.

    Each cycle is sampled later than the one before, by a share of the interval between samples.
    """
    rng = np.random.default_rng(seed)
    points = plan.paths["rectangle"].points
    sides = np.diff(points, axis=0)
    lengths = np.linalg.norm(sides, axis=1)
    ways = sides / lengths[:, None]
    drawn = []
    for k in range(4):
        s = np.linspace(radius if k else 0.0, lengths[k] - (radius if k < 3 else 0.0), int(lengths[k] / 5e-5))
        side = points[k] + np.outer(s, ways[k])
        if k:
            side += np.outer(np.where(s < 0.03, beyond * np.sin(np.pi * s / 0.03), 0.0), ways[k - 1])
        drawn.append(side)
        if k < 3 and radius:
            angle = np.linspace(0.0, np.pi / 2, 400)
            arc = np.outer(np.sin(angle) - 1.0, ways[k]) + np.outer(1.0 - np.cos(angle), ways[k + 1])
            drawn.append(points[k + 1] + radius * arc)
    line = np.concatenate(drawn)
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    rows = []
    for k in (1, 2, 3):
        t = times(duration_of(run[-1], plan.rated_velocity) + 0.05, rate) + k * apart / rate
        gone = ramp(t, run[-1], plan.rated_velocity)
        p = np.column_stack([np.interp(gone, run, line[:, axis]) for axis in range(3)])
        rows.append((k, t, p + rng.normal(0.0, sigma, p.shape)))
    return samples_of("CR", "rectangle", rows)


def evaluation_of(**parts: object) -> Evaluation:
    """Return an evaluation of which nothing is known but some parts."""
    return Evaluation((), Alignment.__new__(Alignment), **parts)  # type: ignore[arg-type]


def notices_of(**parts: object) -> dict[str, Notice]:
    """Return what is said of curves of some criteria, by its code."""
    return {notice.code: notice for notice in stream_notices(evaluation_of(**parts))}


def notices_of_paths(samples: Samples) -> dict[str, Notice]:
    return notices_of(deviations=tuple(path_values(PLAN, samples, HERE, TRACKER)[1]))
