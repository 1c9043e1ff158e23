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

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.rows import COARSE, Conditions, Instrument, Status, Value
from truearm.iso9283.criteria.runs import LEAST_SAMPLES, Part, in_base, outlying_steps, parts_of, refuse_outlying
from truearm.iso9283.criteria.streams import TOP, Clock, clock_of, local_lines, noise_of, spans_of, top_of
from truearm.iso9283.planning.criteria import PerformancePlan
from truearm.iso9283.planning.records import Samples

#: The final pose is the mean of this last share of the samples.
_FINAL = 0.1
#: Share of the band that noise may have where the final stay is read.
_QUIET = 0.02
#: Samples outside the band that show how far an overshoot goes.
_LEAST_OUTSIDE = 4
#: Samples that a period of the oscillation has, and the time from the first entry to the final stay, or more.
_LEAST_SAMPLES = 8
#: The begin of a motion is read between these distances, in shares of the band and of the way, and as many standard
#: deviations of the noise: powers of the time that it may grow with.
_EARLY, _LATE, _OF_WAY, _ABOVE_NOISE = 0.25, 4.0, 0.15, 5.0
_POWERS, _LEAST_ROWS = tuple(np.arange(1.75, 3.3, 0.25)), 6
#: After it stood in the band so long [s] the tip goes no further than so many bands: no oscillation of a robot is so
#: slow.
_STOOD, _AGAIN = 0.2, 5.0
#: No tip is faster, and none that goes further than a millimetre is slower at its fastest [m/s]: times of other units.
_FASTEST, _SLOWEST, _FAR = 20.0, 2e-3, 1e-3


@dataclass(frozen=True, eq=False)
class SettlingCurve:
    """How the tip comes to rest in one cycle, for pictures."""

    test: str  #: test, where, conditions, cycle: whose it is.
    where: str
    conditions: Conditions
    cycle: int
    time: Array  #: Since the first sample [s], ``(n,)``.
    distance: Array  #: From the final attained pose [m], ``(n,)``.
    band: float  #: The limit band [m].
    #: start, entry, stay: when the motion begins, the band is first entered, and it is entered for good [s].
    start: float
    entry: float
    stay: float
    overshoot: float  #: [m].
    travelled: float  #: From the first to the final pose [m].
    coarse: tuple[bool, bool]  #: Whether the instrument does not show the time, and the overshoot.
    sparse: tuple[bool, bool]  #: Whether that is because samples are too far apart.
    position: Array  #: In the base frame [m], ``(n, 3)``.
    lines: NDArray[np.intp]  #: Of the samples in the file, ``(n,)``.
    clock: Clock  #: That of the record.


def settling_values(
    plan: PerformancePlan, samples: Samples, transform: Array, instrument: Instrument
) -> tuple[list[Value], list[SettlingCurve]]:
    """Return t and OV of every pose, the posing times of every distance, and what they come from.

    Three cycles give no interval: each value has the least and the largest of the cycles.

    Args:
        transform: The instrument's frame in the robot's base, ``(4, 4)``. Only distances count here.
    """
    values: list[Value] = []
    curves: list[SettlingCurve] = []
    for test in ("t", "posing-time"):
        planned = plan.test(test)
        known = () if planned is None else tuple(dict.fromkeys((*planned.places, *planned.approaches)))
        for part in parts_of(samples, test, known):
            assert planned is not None
            part_curves = [
                _cycle(plan, samples, transform, test, part, number, rows, instrument.sigma)
                for number, rows in part.cycles()
            ]
            curves += part_curves
            values += _values(part_curves, planned.cycles, instrument)
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
    _refuse_few(len(rows), at)
    clock = clock_of(samples.time[rows])
    time = clock.time - clock.time[0]
    position = in_base(transform, samples.position[rows])
    _refuse_other_times(time, position, at)
    refuse_outlying(samples, rows, position, outlying_steps(time, position, None), number, clock)
    band = plan.limit_band
    distance = np.asarray(np.linalg.norm(position - _final(position), axis=1))
    outside = _outside(distance, band, sigma)
    last = max(int(_FINAL * len(rows)), 5)
    _refuse_incomplete(outside, distance, last, band, at)
    passing = _passings(position, _final(position), band)
    entered = int(np.flatnonzero(passing[:, 0] <= 1.0)[0])
    entry = float(time[entered] + (time[entered + 1] - time[entered]) * passing[entered, 0])
    stay = entry
    later = distance[entered + 1 :]
    _refuse_away_again(time, distance, band, at, samples.line[rows])
    overshoot, width, open_ = 0.0, np.inf, 0.0
    step = float(np.median(np.diff(time)))
    if outside[entered + 1 :].any():
        # what is before the first entry is the way to the pose, and no part of an excursion
        since = slice(entered + 1, None)
        overshoot, width = top_of(time[since], (position - _final(position))[since], int(later.argmax()), sigma)
        window = _window(step, 2 * TOP * width, sigma, band)
        left = sigma * np.sqrt(step / max(window, step))
        narrow, stay, wide = (_stay(time, position, band + off, sigma, window) for off in (-2 * left, 0.0, 2 * left))
        stay, open_ = max(stay, entry), narrow - wide
    settles = stay <= entry
    overshoot = 0.0 if settles else overshoot
    speed = (distance[entered] - distance[entered + 1]) / (time[entered + 1] - time[entered])
    start = _start(time, position, band)
    settled, posing, rounded = stay - entry, stay - start, 2.0 * clock.sigma
    if test == "posing-time":
        coarse = sparse = (step > COARSE * posing, False)
        coarse = (coarse[0] or rounded > COARSE * posing, False)
    else:
        crossing = 2 * band / max(float(speed), 1e-12)
        slow = step > COARSE * crossing if settles else _LEAST_SAMPLES * step > min(settled, 3 * width)
        near_end = slice(entered, int(np.searchsorted(time, stay)) + 1)
        slow |= float(np.diff(time[near_end]).max(initial=0.0)) > COARSE * max(settled, crossing)
        few = not settles and _excursion(passing, entered + 1 + int(later.argmax())) < _LEAST_OUTSIDE
        blurred = not settles and overshoot - band < 3 * sigma
        # noise may put an excursion inside the band, or outside of it
        sparse = (slow, slow or few)
        coarse = (
            slow or blurred or (not settles and rounded > COARSE * settled) or open_ > COARSE * settled,
            slow or few or blurred,
        )
    return SettlingCurve(
        test,
        _place(plan, test, part),
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
        sparse,
        position,
        samples.line[rows],
        clock,
    )


def _place(plan: PerformancePlan, test: str, part: Part) -> str:
    """Return the place as values have it: of a posing time with where the way began."""
    if test != "posing-time":
        return part.place
    planned = plan.test(test)
    first = planned.places[0] if planned is not None and planned.places else "P1"
    return part.place if part.place == first else f"{first}-{part.place}"


def _refuse_few(samples: int, place: str) -> None:
    if samples < LEAST_SAMPLES:
        raise InputError(
            "there are too few samples of this cycle",
            where=place,
            came=f"{samples} samples",
            allowed=f"{LEAST_SAMPLES} or more",
            cure="Sample faster and longer, or leave the cycle out.",
        )


def _refuse_incomplete(outside: NDArray[np.bool_], distance: Array, last: int, band: float, place: str) -> None:
    """Refuse a record that ends before the tip stands, or begins when it is within the band already."""
    if outside[-last:].any():
        raise InputError(
            "the record ends before the tip stands",
            where=place,
            came=f"{1e3 * distance[-last:].max():.3f} mm from where it ends, within the last tenth of the samples",
            allowed=f"{1e3 * band:g} mm, the limit band of the plan",
            cure="Record longer, or plan a wider limit band: the instrument's noise must lie well within it.",
        )
    if not outside[0]:
        raise InputError(
            "the record begins when the tip is in the limit band already",
            where=place,
            came=f"{1e3 * distance[0]:.3f} mm from where it ends",
            allowed=f"a first sample further away than {1e3 * band:g} mm",
            cure="Record from before the move on.",
        )


def _refuse_other_times(time: Array, position: Array, place: str) -> None:
    over = max(len(time) // 200, 1)
    size = np.linalg.norm(position[over:] - position[:-over], axis=1)
    pace = float(np.quantile(size / (time[over:] - time[:-over]), 0.995))
    way = float(np.linalg.norm(position[-5:].mean(axis=0) - position[:5].mean(axis=0)))
    if pace > _FASTEST or (pace < _SLOWEST and way > _FAR):
        raise InputError(
            f"the tip would move {'faster than any' if pace > _FASTEST else 'more slowly than any'} robot's",
            where=place,
            came=f"{1e3 * pace:.4g} mm/s at its fastest",
            allowed=f"{1e3 * _SLOWEST:g} to {1e3 * _FASTEST:g} mm/s",
            cure="Write the times in seconds.",
        )


def _refuse_away_again(time: Array, distance: Array, band: float, place: str, lines: NDArray[np.intp]) -> None:
    stood = [last for first, last in spans_of(distance <= band) if time[last] - time[first] > _STOOD]
    if not stood or distance[stood[0] :].max() <= _AGAIN * band:
        return
    again = stood[0] + int(distance[stood[0] :].argmax())
    raise InputError(
        "the tip goes away again after it came to rest",
        where=f"{place}, about line {lines[again]}",
        came=f"{1e3 * distance[again]:.4g} mm from where it ends, after it stood within the limit band",
        allowed="one way to the pose in each cycle",
        cure="Give each way a number of its own in the column cycle; remove samples that the instrument read wrongly.",
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


def _window(step: float, longest: float, sigma: float, band: float) -> float:
    """Return the window over which positions are smoothed before the final stay is read [s], 0 for none.

    Noise makes the tip leave the band later than it does. The window brings it to a fiftieth of the band, and takes a
    ninth of a period at most: that leaves 98 % of an oscillation.
    """
    window = min(step * (sigma / (_QUIET * band)) ** 2, longest)
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
    last = int(np.flatnonzero(_outside(distance, band, sigma))[-1])
    return _crossing(time, distance, band, last + 1) if last + 1 < len(time) else float(time[-1])


def _crossing(time: Array, distance: Array, band: float, first: int) -> float:
    """Return when the band is entered between a sample outside and the next, which is inside."""
    before, after = distance[first - 1], distance[first]
    return float(time[first - 1] + (time[first] - time[first - 1]) * (before - band) / (before - after))


def _start(time: Array, position: Array, band: float) -> float:
    """Return when the motion begins.

    A tip moves off with a power of the time since then: the square with a constant acceleration, the cube where the
    jerk is limited, and between the two behind a servo that lags. A root of the distance is then a straight line over
    time, which begins at the begin. Of several roots that is taken whose line fits the first millimetre best; of a few
    samples the square root.
    """
    away = np.linalg.norm(position - position[0], axis=1)
    gone = int((away > 10 * band).argmax()) or len(away)
    stood = position[: int(np.flatnonzero(away[:gone] <= band)[-1]) + 1]
    rest_position = np.median(stood[: max(len(stood) // 2, 5)], axis=0)
    way = float(np.linalg.norm(position[-5:].mean(axis=0) - rest_position))
    low = max(_EARLY * band, _ABOVE_NOISE * noise_of(position))
    high = max(min(_LATE / _EARLY * low, _OF_WAY * way), 1.5 * low)
    travelled = np.linalg.norm(position - rest_position, axis=1)
    last = int((travelled > high).argmax()) or len(travelled) - 1
    inside = np.flatnonzero(travelled[:last] <= low)
    first = int(inside[-1]) + 1 if len(inside) else 0
    last = min(max(last, first + 1), len(travelled) - 1)
    rows = np.arange(first, last + 1)
    along = np.maximum(
        (position[rows] - rest_position) @ (position[last] - rest_position) / travelled[last], 0.25 * low
    )
    since = time[rows] - time[first]
    begins = []
    for power in _POWERS if len(rows) >= _LEAST_ROWS else (2.0,):
        root, weight = along ** (1 / power), along ** (2 - 2 / power)  # the weight takes its slope from the root
        at, value = np.average(since, weights=weight), np.average(root, weights=weight)
        slope = float((weight * (since - at) * (root - value)).sum() / (weight * (since - at) ** 2).sum())
        left = power**2 * float((weight * (root - value - slope * (since - at)) ** 2).sum())
        begins.append((left, float(at - value / slope) if slope > 0 else 0.0))
    return max(float(time[first]) + min(begins)[1], 0.0)
