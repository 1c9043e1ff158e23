"""What noise makes of figures that are the largest of many samples: overshoots, corners and weaves."""

from __future__ import annotations

import numpy as np
from tests.moving_tip import ALONG, CENTRE, HERE, plan_of, samples_of, the, times

from truearm.measurement.performance.records import Samples
from truearm.validation.iso9283.settling import settling_values
from truearm.validation.iso9283.tops import top_of
from truearm.validation.iso9283.values import Instrument

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
    time = np.arange(3) * 1e-3
    away = np.outer([0.60e-3, 1.0e-3, 0.999e-3], ALONG)
    assert 1.0e-3 < top_of(time, away, 1, 0.0)[0] <= 1.1e-3
