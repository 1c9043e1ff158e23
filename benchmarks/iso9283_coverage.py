"""How often the intervals of criteria of poses hold the truth, and how wide they are, over simulated campaigns.

30 cycles; scatter in several shapes, alone and with an instrument that scatters a third as much; AP from zero to far
above the scatter, in several directions. `oracle` is the width beside that of an interval that knows how the poses
scatter: for AP the same test with the true covariance, for the others the central 95 % of the estimate's own
distribution. `estimate` is for AP too the width beside the central 95 % of the estimate's own distribution, which only
one who also knows the direction of the true error could have.

Arguments: campaigns (1000), and those of vAP, E, dAP and dRP (300). Writes benchmarks/iso9283_coverage.json.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.drift import drift_values
from truearm.iso9283.criteria.intervals import (
    Interval,
    largest_difference,
    mean_interval,
    norm_interval,
    repeatability,
    repeatability_interval,
    spread_interval,
)
from truearm.iso9283.criteria.rows import Cycles, Instrument
from truearm.iso9283.planning.criteria import PlannedTest

CYCLES = 30
MANY = 300_000
#: Campaigns of which the oracle is asked.
ORACLES = 100
NOTHING = np.zeros((3, 3))
Draw = Callable[[np.random.Generator, tuple[int, ...]], Array]


def gaussian(*deviations: float) -> Draw:
    """Return a Gaussian scatter."""
    return lambda rng, size: rng.standard_normal((*size, 3)) * np.array(deviations)


def ball(rng: np.random.Generator, size: tuple[int, ...]) -> Array:
    """Draw points of a ball."""
    way = rng.standard_normal((*size, 3))
    made: Array = way / np.linalg.norm(way, axis=-1, keepdims=True) * rng.random((*size, 1)) ** (1 / 3)
    return made


def with_noise(draw: Draw) -> Draw:
    """Add an instrument that scatters a third as much."""
    rms = float(np.sqrt((draw(np.random.default_rng(0), (100_000,)) ** 2).mean()))
    return lambda rng, size: draw(rng, size) + rms / 3 * rng.standard_normal((*size, 3))


PLAIN: dict[str, Draw] = {
    "isotropic": gaussian(1, 1, 1),
    "10:1:1": gaussian(10, 1, 1),
    "3:1:0.3": gaussian(3, 1, 0.3),
    "flat": gaussian(1, 1, 0.02),
    "ball": ball,
}
SCATTERS = PLAIN | {f"{name} + noise": with_noise(draw) for name, draw in PLAIN.items()}
DIRECTIONS = {"x": (1, 0, 0), "xyz": (3**-0.5, 3**-0.5, 3**-0.5), "z": (0, 0, 1)}
#: AP over the scatter in all directions together.
SIZES = (0.1, 0.3, 0.6, 1.0, 5.0)


def judged(intervals: list[Interval | None], truth: float, widths: dict[str, float | list[float]]) -> dict[str, float]:
    """Return how often intervals hold, and their mean width over others."""
    low, high = np.array(intervals, float).T
    made = {
        "holds": float(np.mean((low <= truth) & (truth <= high))),
        "below": float(np.mean(truth < low)),
        "above": float(np.mean(truth > high)),
    }
    return made | {name: float((high - low).mean() / np.mean(width)) for name, width in widths.items()}


def central(estimates: Array) -> float:
    """Return the width of the central 95 %."""
    low, high = np.quantile(estimates, (0.025, 0.975))
    return float(high - low)


def accuracy(draw: Draw, covariance: Array, true: Array, campaigns: int, rng: np.random.Generator) -> dict[str, float]:
    """Judge intervals of AP."""
    own = central(np.linalg.norm(draw(rng, (4000, CYCLES)).mean(axis=1) + true, axis=1))
    found, oracles = [], []
    for points in draw(rng, (campaigns, CYCLES)) + true:
        mean = points.mean(axis=0)
        found.append(norm_interval(mean, np.cov(points.T), CYCLES, NOTHING))
        if len(oracles) == ORACLES:
            continue
        oracle = norm_interval(mean, covariance * MANY, CYCLES * MANY, NOTHING)
        assert oracle is not None
        oracles.append(oracle[1] - oracle[0])
    return judged(found, float(np.linalg.norm(true)), {"oracle": oracles, "estimate": own})


def repeatabilities(draw: Draw, campaigns: int, rng: np.random.Generator) -> dict[str, float]:
    """Judge intervals of RP."""
    length = np.linalg.norm(draw(rng, (MANY,)), axis=1)
    own = central(repeatability(draw(rng, (8000, CYCLES))))
    found = [repeatability_interval(points) for points in draw(rng, (campaigns, CYCLES))]
    return judged(found, float(length.mean() + 3 * length.std()), {"oracle": own})


def distances(draw: Draw, way: Array, campaigns: int, rng: np.random.Generator) -> dict[str, dict[str, float]]:
    """Judge intervals of AD and RD, at a distance of 2000 times the scatter."""
    scale = float(draw(rng, (10_000,)).std())

    def lengths(*size: int) -> Array:
        return np.asarray(np.linalg.norm(2000 * scale * way + draw(rng, size) - draw(rng, size), axis=-1))

    population, samples, read = lengths(MANY), lengths(8000, CYCLES), lengths(campaigns, CYCLES)
    mean = [mean_interval(row) for row in read]
    spread = [spread_interval(float(row.std(ddof=1)), CYCLES) for row in read]
    return {
        "AD": judged(mean, float(population.mean()), {"oracle": central(samples.mean(axis=1))}),
        "RD": judged(spread, 3 * float(population.std()), {"oracle": central(3 * samples.std(axis=1, ddof=1))}),
    }


def differences(draw: Draw, places: Array, campaigns: int, rng: np.random.Generator) -> dict[str, float]:
    """Judge intervals of the largest difference between some places, such as vAP and E."""
    pairs = [(i, j) for i in range(len(places)) for j in range(i)]
    truth = max(float(np.linalg.norm(places[i] - places[j])) for i, j in pairs)
    found, values = [], []
    for points in draw(rng, (campaigns, len(places), CYCLES)) + places[:, None]:
        value, interval = largest_difference(list(points), pairs)
        found.append(interval)
        values.append(value)
    return judged(found, truth, {"estimate": central(np.array(values))})


def drifts(change: Array, growth: Array, campaigns: int, rng: np.random.Generator) -> dict[str, dict[str, float]]:
    """Judge intervals of dAP and dRP: groups of ten cycles, AP 5 and a change along it, a scatter that grows."""
    test = PlannedTest("dAP", ("P1",), 10)
    k = len(change)
    per: dict[str, list[Any]] = {"dAP": [], "dRP": []}
    sizes: dict[str, list[float]] = {"dAP": [], "dRP": []}
    unit = float(np.sqrt(8 / np.pi) + 3 * np.sqrt(3 - 8 / np.pi))
    truth = {"dAP": float(np.abs(change - change[0]).max()), "dRP": unit * float(np.abs(growth - growth[0]).max())}
    for _ in range(campaigns):
        points = rng.standard_normal((k, 10, 3)) * growth[:, None, None]
        points[..., 0] += 5 + change[:, None]
        flat, cycle = points.reshape(-1, 3), np.tile(np.arange(1, 11), k)
        time, lines = np.full(10 * k, np.nan), np.arange(10 * k)
        one = Cycles("dAP", "", "P1", "", 1.0, 1.0, cycle, time, flat, None, np.zeros(3), lines)
        for value in drift_values(test, [one], Instrument(1e-6))[0]:
            if value.component == "position":
                per[value.id].append(value.interval)
                sizes[value.id].append(value.value)
    return {id: judged(per[id], truth[id], {"estimate": central(np.array(sizes[id]))}) for id in per}


def main(campaigns: int = 1000, fewer: int = 300) -> dict[str, Any]:
    """Return all figures."""
    made: dict[str, Any] = {"campaigns": campaigns, "AP": {}, "RP": {}, "AD": {}, "RD": {}}
    for number, (name, draw) in enumerate(SCATTERS.items()):
        rng = np.random.default_rng((9283, number))
        covariance = np.cov(draw(rng, (MANY,)).T)
        size = float(np.sqrt(np.trace(covariance)))
        made["AP"][f"{name}, 0"] = accuracy(draw, covariance, np.zeros(3), campaigns, rng)
        made["RP"][name] = repeatabilities(draw, campaigns, rng)
        for way, unit in DIRECTIONS.items():
            for share in SIZES:
                made["AP"][f"{name}, {share} along {way}"] = accuracy(
                    draw, covariance, share * size * np.array(unit), campaigns, rng
                )
            both = distances(draw, np.array(unit), campaigns, rng)
            for id, figures in both.items():
                made[id][f"{name}, along {way}"] = figures
        worst = {
            id: min(v["holds"] for k, v in made[id].items() if k.split(",")[0] == name) for id in ("AP", "AD", "RD")
        }
        sys.stderr.write(f"{name} {made['RP'][name]} {worst}\n")
    rng = np.random.default_rng(9283)
    shapes = {
        "three equal": np.zeros((3, 3)),
        "three, one away": np.array([[0, 0, 0], [0, 0, 0], [1.0, 0, 0]]),
        "three apart": np.eye(3),
        "five equal": np.zeros((5, 3)),
        "five apart": np.vstack([np.eye(3), -np.eye(3)])[:5],
        "five, one far": np.vstack([np.zeros((4, 3)), [[5.0, 0, 0]]]),
    }
    made["largest differences"] = {
        f"{scatter}, {name}": differences(PLAIN[scatter], places, fewer, rng)
        for scatter in ("isotropic", "3:1:0.3", "ball")
        for name, places in shapes.items()
    }
    time = np.linspace(0, 3, 9)
    warm, none = 1 - np.exp(-time), np.zeros(9)
    made["drift"] = {
        "none": drifts(none, none + 1, fewer, rng),
        "slight": drifts(0.5 * warm, none + 1, fewer, rng),
        "large": drifts(3 * warm, 1 + 0.5 * warm, fewer, rng),
    }
    made["worst"] = {
        id: {
            "holds": min(one["holds"] for one in made[id].values()),
            "oracle": max(one["oracle"] for one in made[id].values()),
        }
        for id in ("AP", "RP", "AD", "RD")
    }
    return made


if __name__ == "__main__":
    result = main(*map(int, sys.argv[1:]))
    path = Path(__file__).with_suffix(".json")
    path.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    sys.stderr.write(json.dumps(result["worst"], indent=1) + "\n")
