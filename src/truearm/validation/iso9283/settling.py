"""Position stabilisation time t, overshoot OV and minimum posing time, from the last part of a move.

t goes from the first entry into the limit band round the final attained pose to the final stay in it, the mean of the
cycles; OV is the largest distance from the final attained pose after the first entry, 0 where the tip stays in the
band, the largest of the cycles; the posing time goes from the begin of the motion to the final stay, the mean (the
issue's table and the literature on ISO 9283; the standard's text was not at hand).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.measurement.performance.records import Samples
from truearm.modeling.chain import Array
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.validation.iso9283.runs import LEAST_SAMPLES, Part, in_base, parts_of
from truearm.validation.iso9283.smoothing import local_lines
from truearm.validation.iso9283.values import COARSE, Conditions, Instrument, Status, Value

#: The final pose is the mean of this last share of the samples.
_FINAL = 0.1
#: Share of the band that noise may have, and of the time over which it is taken away, where the final stay is read.
_QUIET = 0.02
#: Samples outside the band that show how far an overshoot goes.
_LEAST_OUTSIDE = 4


@dataclass(frozen=True, eq=False)
class SettlingCurve:
    """How the tip comes to rest in one cycle, for pictures.

    Attributes
    ----------
    test, where, conditions, cycle
        Whose it is.
    time
        Since the first sample [s], ``(n,)``.
    distance
        From the final attained pose [m], ``(n,)``.
    band
        The limit band [m].
    start, entry, stay
        When the motion begins, the band is first entered, and it is entered for good [s].
    overshoot
        [m].
    travelled
        From the first to the final pose [m].
    coarse
        Whether samples come too slowly for the time, and for the overshoot.
    """

    test: str
    where: str
    conditions: Conditions
    cycle: int
    time: Array
    distance: Array
    band: float
    start: float
    entry: float
    stay: float
    overshoot: float
    travelled: float
    coarse: tuple[bool, bool]


def settling_values(
    plan: PerformancePlan, samples: Samples, transform: Array, instrument: Instrument
) -> tuple[list[Value], list[SettlingCurve]]:
    """Return t and OV of every pose, the posing times of every distance, and what they come from.

    Three cycles give no interval: each value has the least and the largest of the cycles.

    Parameters
    ----------
    transform
        The instrument's frame in the robot's base, ``(4, 4)``. Only distances count here.
    """
    values: list[Value] = []
    curves: list[SettlingCurve] = []
    for test in ("t", "posing-time"):
        planned = plan.test(test)
        known = () if planned is None else tuple(dict.fromkeys((*planned.places, *planned.approaches)))
        for part in parts_of(samples, test, known):
            assert planned is not None
            here = [
                _cycle(plan, samples, transform, test, part, number, rows, instrument.sigma)
                for number, rows in part.cycles()
            ]
            curves += here
            values += _values(here, planned.cycles, instrument)
    return values, curves


def _values(curves: list[SettlingCurve], planned: int, instrument: Instrument) -> list[Value]:
    band = curves[0].band
    blurred = instrument.sigma > COARSE * band
    few: Status = "too-few-cycles" if len(curves) < planned else "measured"

    def value(id_: str, numbers: Array, number: float, quantity: str, *, coarse: bool) -> Value:
        return Value(
            id_,
            "position",
            curves[0].where,
            number,
            "time" if quantity == "time" else "length",
            None,
            len(curves),
            curves[0].conditions,
            "instrument-too-coarse" if coarse or blurred else few,
            float(numbers.min()),
            float(numbers.max()),
        )

    slow = any(curve.coarse[0] for curve in curves)
    if curves[0].test == "posing-time":
        times = np.array([curve.stay - curve.start for curve in curves])
        return [value("posing-time", times, float(times.mean()), "time", coarse=slow)]
    times = np.array([curve.stay - curve.entry for curve in curves])
    lengths = np.array([curve.overshoot for curve in curves])
    return [
        value("t", times, float(times.mean()), "time", coarse=slow),
        value("OV", lengths, float(lengths.max()), "length", coarse=any(curve.coarse[1] for curve in curves)),
    ]


def _cycle(
    plan: PerformancePlan,
    samples: Samples,
    transform: Array,
    test: str,
    part: Part,
    number: int,
    rows: NDArray[np.intp],
    sigma: float,
) -> SettlingCurve:
    at = f"{samples.source}, lines {samples.line[rows[0]]} to {samples.line[rows[-1]]}"
    if len(rows) < LEAST_SAMPLES:
        raise InputError(
            "there are too few samples of this cycle",
            where=at,
            came=f"{len(rows)} samples",
            allowed=f"{LEAST_SAMPLES} or more",
            cure="Sample faster and longer, or leave the cycle out.",
        )
    time = samples.time[rows] - samples.time[rows[0]]
    position = in_base(transform, samples.position[rows])
    band = plan.limit_band
    distance = np.asarray(np.linalg.norm(position - _final(position), axis=1))
    outside = _outside(distance, band, sigma)
    last = max(int(_FINAL * len(rows)), 5)
    if outside[-last:].any():
        raise InputError(
            "the record ends before the tip stands",
            where=at,
            came=f"{1e3 * distance[-last:].max():.3f} mm from where it ends, within the last tenth of the samples",
            allowed=f"{1e3 * band:g} mm, the limit band of the plan",
            cure="Record longer, or plan a wider limit band: the instrument's noise must lie well within it.",
        )
    if not outside[0]:
        raise InputError(
            "the record begins when the tip is in the limit band already",
            where=at,
            came=f"{1e3 * distance[0]:.3f} mm from where it ends",
            allowed=f"a first sample further away than {1e3 * band:g} mm",
            cure="Record from before the move on.",
        )
    passing = _passings(position, _final(position), band)
    entered = int(np.flatnonzero(passing[:, 0] <= 1.0)[0])
    entry = float(time[entered] + (time[entered + 1] - time[entered]) * passing[entered, 0])
    stay = entry
    if outside[entered + 1 :].any():
        stay = _stay(time, position, band, sigma, 0.0)
        stay = max(_stay(time, position, band, sigma, _window(time, stay - entry, sigma, band)), entry)
    later = distance[entered + 1 :]
    settles = stay <= entry
    overshoot = 0.0 if settles else float(later.max())
    step = float(np.median(np.diff(time)))
    speed = (distance[entered] - distance[entered + 1]) / (time[entered + 1] - time[entered])
    start = _start(time, position, band)
    settled = stay - entry
    posing = stay - start
    if test == "posing-time":
        coarse = (step > COARSE * posing, False)
    else:
        crossing = 2 * band / max(float(speed), 1e-12)
        slow = step > COARSE * (crossing if settles else settled)
        few = not settles and _excursion(passing, entered + 1 + int(later.argmax())) < _LEAST_OUTSIDE
        blurred = not settles and overshoot - band < 3 * sigma
        coarse = (slow, slow or few or blurred)
    where = part.place
    if test == "posing-time":
        planned = plan.test(test)
        first = planned.places[0] if planned is not None and planned.places else "P1"
        where = part.place if part.place == first else f"{first}-{part.place}"
    return SettlingCurve(
        test,
        where,
        part.conditions,
        number,
        time,
        distance,
        band,
        start,
        entry,
        stay,
        overshoot,
        float(np.linalg.norm(position[-last:].mean(axis=0) - position[:5].mean(axis=0))),
        coarse,
    )


def _final(position: Array) -> Array:
    """Return the final attained position [m], ``(3,)``."""
    return np.asarray(position[-max(int(_FINAL * len(position)), 5) :].mean(axis=0))


def _passings(position: Array, final: Array, band: float) -> Array:
    """Return where, as shares of it, the stretch between each two samples enters and leaves the band, ``(n - 1, 2)``.

    A tip that is fast is in the band between two samples and in none of them. Infinite where the band is not met.
    """
    begin, step = position[:-1] - final, np.diff(position, axis=0)
    a, b, c = (step**2).sum(axis=1), (begin * step).sum(axis=1), (begin**2).sum(axis=1) - band**2
    root = b * b - a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = (-b - np.sqrt(root)) / a, (-b + np.sqrt(root)) / a
    met = (root >= 0.0) & (a > 0.0) & (high >= 0.0) & (low <= 1.0)
    within = c <= 0.0
    ends = np.column_stack([np.where(within, 0.0, low), np.where(within & ~met, 1.0, high)])
    return np.asarray(np.where((met | within)[:, None], ends, np.inf))


def _excursion(passing: Array, peak: int) -> int:
    """Return how many samples the tip is outside the band for, about one of them, before it passes it again."""
    met = np.isfinite(passing[:, 0])
    before = np.flatnonzero(met[:peak])
    after = np.flatnonzero(met[peak:])
    first = int(before[-1]) + 1 if len(before) else 0
    return (peak + int(after[0]) if len(after) else len(met)) - first + 1


def _window(time: Array, settling: float, sigma: float, band: float) -> float:
    """Return the window over which positions are smoothed before the final stay is read [s], 0 for none.

    Noise makes the tip leave the band later than it does. The window brings it to a fiftieth of the band, and takes a
    fiftieth of the time at most, so that an oscillation stays as it is.
    """
    step = float(np.median(np.diff(time)))
    window = min(step * (sigma / (_QUIET * band)) ** 2, _QUIET * settling)
    return window if window >= 3 * step else 0.0


def _outside(distance: Array, band: float, sigma: float) -> NDArray[np.bool_]:
    """Return which samples are outside the band, ``(n,)``; one alone that noise can have put there is not."""
    outside = distance > band
    beside = np.concatenate([[True], outside[:-1]]) | np.concatenate([outside[1:], [False]])
    return np.asarray(outside & (beside | (distance > band + 5 * sigma)))


def _stay(time: Array, position: Array, band: float, sigma: float, window: float) -> float:
    """Return when the band is entered for good [s]."""
    smooth = local_lines(time, position, time, window / 2)[0] if window else position
    distance = np.linalg.norm(smooth - _final(position), axis=1)
    return _crossing(time, distance, band, int(np.flatnonzero(_outside(distance, band, sigma))[-1]) + 1)


def _crossing(time: Array, distance: Array, band: float, first: int) -> float:
    """Return when the band is entered between a sample outside and the next, which is inside."""
    before, after = distance[first - 1], distance[first]
    return float(time[first - 1] + (time[first] - time[first - 1]) * (before - band) / (before - after))


def _start(time: Array, position: Array, band: float) -> float:
    """Return when the motion begins.

    The tip leaves a band round where it stood, and one four times as wide. With a constant acceleration it does so
    after times of which the second is twice the first, so that the begin lies as long before the first as that before
    the second.
    """
    away = np.linalg.norm(position - position[0], axis=1)
    gone = int((away > 10 * band).argmax()) or len(away)
    stood = position[: int(np.flatnonzero(away[:gone] <= band)[-1]) + 1]
    travelled = np.linalg.norm(position - np.median(stood, axis=0), axis=1)[: gone + 1]
    times = []
    for width in (band, 4 * band):
        inside = np.flatnonzero(travelled <= width)
        k = int(inside[-1]) if len(inside) else 0
        after = min(k + 1, len(travelled) - 1)
        rise = max(float(travelled[after] - travelled[k]), 1e-15)
        share = min(max((width - float(travelled[k])) / rise, 0.0), 1.0)
        times.append(float(time[k] + (time[after] - time[k]) * share))
    return max(2 * times[0] - times[1], 0.0)
