"""What noise makes of figures that are the largest of many samples: overshoots, corners and weaves."""

from __future__ import annotations

import numpy as np
import pytest
from tests.moving_tip import ACROSS, ALONG, CENTRE, HERE, plan_of, samples_of, the, times

from truearm.iso9283.criteria.corners import corner_values, weaving_values
from truearm.iso9283.criteria.rows import Instrument
from truearm.iso9283.criteria.settling import settling_values
from truearm.iso9283.criteria.streams import largest_top, top_of
from truearm.iso9283.planning.records import Samples

PLAN = plan_of()


# -- the way to rest -----------------------------------------------------------------------------------


def creeping(seed: int, sigma: float, rate: float = 1000.0) -> Samples:
    """Return cycles of a tip that comes to its pose without an overshoot, slowly at the end."""
    rng = np.random.default_rng(seed)
    t = times(1.2, rate)
    tau = np.maximum(t - 0.2, 0.0) / 0.02
    x = -0.1 * (1.0 + tau + 0.5 * tau**2) * np.exp(-tau)
    rows = [(k, t, CENTRE + np.outer(x, ALONG) + rng.normal(0.0, sigma, (len(t), 3))) for k in (1, 2, 3)]
    return samples_of("t", "P1", rows)


def test_a_tip_without_an_overshoot_has_none_that_is_not_marked() -> None:
    marked = 0
    for seed in range(8):
        values, curves = settling_values(PLAN, creeping(seed, 2e-5), HERE, Instrument(2e-5))
        furthest = max(float(curve.distance[curve.time > curve.entry].max()) for curve in curves)
        assert the(values, "OV").value <= 1.1 * furthest + 6e-5
        for id_ in ("t", "OV"):
            assert the(values, id_).value == 0.0 or the(values, id_).status == "instrument-too-coarse"
        marked += the(values, "OV").status == "instrument-too-coarse"
    assert marked


def test_a_top_is_not_far_beyond_the_largest_sample() -> None:
    # a parabola through three samples of which the last is far higher would have its top far beyond
    time = np.arange(3.0) / 1000.0
    away = np.outer([0.60e-3, 1.0e-3, 0.999e-3], ALONG)
    assert 1.0e-3 < top_of(time, away, 1, 0.0)[0] <= 1.1e-3


# -- corners -------------------------------------------------------------------------------------------


def overshooting(beyond: float, sigma: float, seed: int = 0) -> Samples:
    """Return cycles of the rectangle with a half sine of a height beyond each second side, over 30 mm."""
    rng = np.random.default_rng(seed)
    points, way = PLAN.paths["rectangle"].points, []
    for k in range(4):
        begin, end = points[k], points[k + 1]
        u = (end - begin) / np.linalg.norm(end - begin)
        s = np.arange(0.0, float(np.linalg.norm(end - begin)), 5e-5)
        side = begin + np.outer(s, u)
        if k:
            came = (begin - points[k - 1]) / np.linalg.norm(begin - points[k - 1])
            side += np.outer(np.where(s < 0.03, beyond * np.sin(np.pi * s / 0.03), 0.0), came)
        way.append(side)
    line = np.concatenate(way)
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    rows = []
    for k in (1, 2, 3):
        t = times(run[-1] / PLAN.rated_velocity * 1.02, 500.0)
        p = np.column_stack([np.interp(PLAN.rated_velocity * t, run, line[:, axis]) for axis in range(3)])
        rows.append((k, t, p + rng.normal(0.0, sigma, p.shape)))
    return samples_of("CR", "rectangle", rows)


@pytest.mark.parametrize("beyond", [0.1e-3, 0.5e-3])
def test_noise_makes_an_overshoot_of_a_corner_little_larger(beyond: float) -> None:
    values, _ = corner_values(PLAN, overshooting(beyond, 1e-5), HERE, Instrument(1e-5))
    found = [value for value in values if value.id == "CO"]
    assert np.mean([value.value for value in found]) == pytest.approx(beyond, rel=0.05)
    assert {value.status for value in found} == {"measured"}


def test_an_overshoot_that_noise_would_make_is_marked() -> None:
    values, curves = corner_values(PLAN, overshooting(0.03e-3, 6e-6), HERE, Instrument(6e-6))
    found = [value for value in values if value.id == "CO"]
    assert all(0.25 * value.value > 6e-6 for value in found)  # a reading is good enough, the largest of many is not
    assert {v.status for v, c in zip(found, curves, strict=True) if c.noise > 0.25 * v.value} <= {
        "instrument-too-coarse"
    }
    assert "instrument-too-coarse" in {value.status for value in found}


def test_nothing_beyond_a_side_has_no_top() -> None:
    time = np.arange(10.0) / 1000.0
    assert largest_top(time, np.zeros((10, 3)), np.ones(10, bool), 1e-6) == (0.0, 0.0)
    assert largest_top(time, np.ones((10, 3)), np.zeros(10, bool), 1e-6) == (0.0, 0.0)


# -- weaving -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("rate", "sigma"), [(500.0, 1e-5), (1000.0, 5e-5), (2000.0, 5e-5)])
def test_noise_makes_a_weave_no_wider(rate: float, sigma: float) -> None:
    rng = np.random.default_rng(9)
    path = PLAN.paths["weave"]
    strokes = []
    for _ in range(4):
        rows = []
        for k in (1, 2, 3):
            t = times(0.4 / PLAN.rated_velocity, rate)
            swing = 0.0095 * np.sin(2 * np.pi * PLAN.rated_velocity / path.wavelength * t)
            p = path.points[0] + np.outer(PLAN.rated_velocity * t, ALONG) + np.outer(swing, ACROSS)
            rows.append((k, t, p + rng.normal(0.0, sigma, p.shape)))
        values, _ = weaving_values(PLAN, samples_of("WS", "weave", rows), HERE, Instrument(sigma))
        value = the(values, "WS")
        strokes.append(value.value)
        noise = 0.5 * sigma / path.stroke
        assert (value.least or 0.0) - noise <= -0.05 <= (value.largest or 0.0) + noise
    # the largest samples would be three standard deviations beyond, on either side
    assert np.mean(strokes) == pytest.approx(-0.05, abs=0.5 * sigma / path.stroke)
