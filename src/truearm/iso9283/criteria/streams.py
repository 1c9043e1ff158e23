"""Samples over time: their clock, the commanded path, dwells, motions and cycles found in them."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.iso9283.planning.criteria import PlannedPath, Way

# Times of samples that were written with few decimals: what is not known of them, and an even clock through them.
#
# A time rounded to q is off by up to q / 2, with a standard deviation of q / sqrt(12), and a tip with the velocity v is
# elsewhere by v times that: 0.3 mm at 1 m/s for a millisecond. Instruments sample evenly, so that the times before they
# were rounded lie on a straight line over the number of the sample, if one line leaves no time further off than
# rounding does.

#: Decimals of a second that a file may have; more are no rounding that matters.
_DECIMALS: Final = 6
#: Times are rounded if their resolution is more than this share of the time between two samples.
_ROUNDED: Final = 0.01
#: Steps differ by this share of themselves and more by rounding alone where a time is of no use by itself.
_COARSE: Final = 0.25
#: Of an even clock rounded times are off within a range of one resolution, and a little of its fit.
_RANGE: Final = 1.05
#: So often the range of slopes is cut by a third.
_CUTS: Final = 30
#: Fewer samples do not show that a clock is even.
_LEAST: Final = 10


@dataclass(frozen=True, eq=False)
class Clock:
    """When the samples of a record were taken."""

    time: Array  #: [s], ``(n,)``: on an even clock where rounded times allow for one, otherwise as they were written.
    #: To which they were rounded [s]; 0 where that is nothing beside the time between two samples.
    resolution: float = 0.0
    even: bool = False  #: Whether they are those of an even clock.
    pace: float = 0.0  #: Standard deviation of how much faster or slower that clock is, as a share.

    @property
    def sigma(self) -> float:
        """Standard deviation of the time of a sample among those about it [s]."""
        return 0.0 if self.even else self.resolution / float(np.sqrt(12.0))

    @property
    def is_coarse(self) -> bool:
        """Whether steps from one time to the next say little of how long they took."""
        return self.sigma > 0.0 and self.resolution > _COARSE * float(np.diff(self.time).mean())


def clock_of(time: Array) -> Clock:
    """Return the clock of a record.

    Args:
        time: As written [s], not decreasing, ``(n,)``.
    """
    if len(time) < _LEAST:
        return Clock(time)
    resolution = _resolution(time)
    step = float(time[-1] - time[0]) / (len(time) - 1)
    steps = np.diff(time)
    if not resolution > _ROUNDED * step:
        return Clock(time)
    usual = float(np.median(steps))
    whole = steps / max(usual, resolution)
    if steps.min() > 0.5 * resolution and np.abs(whole - np.round(whole)).max() < 0.01 * resolution / usual:
        return Clock(time, even=True)  # steps of one size: the clock is even as it is written
    single = steps[steps < 1.5 * usual] if usual > 0 else steps
    for size in (step, float(single.mean()) if len(single) else step):
        number = np.arange(len(time)) if size == step else np.concatenate([[0.0], np.cumsum(np.round(steps / size))])
        even = _even(time, number, resolution)
        if even is not None:
            return Clock(even, resolution, True, resolution / (step * len(time) ** 1.5))
    return Clock(time, resolution)


def _resolution(time: Array) -> float:
    """Return the decimal place to which times are written [s]; 0 for more than six decimals."""
    for decimals in range(_DECIMALS):
        scaled = time * 10.0**decimals
        if np.abs(scaled - np.round(scaled)).max() < 1e-9 * max(float(np.abs(scaled).max()), 1e2):
            return float(10.0**-decimals)
    return 0.0


def _even(time: Array, number: NDArray[np.intp] | Array, resolution: float) -> Array | None:
    """Return evenly spaced times within the resolution of those that are written; None if there are none."""
    if len(np.unique(number)) < len(number):
        return None
    off = time - time[0]
    slope, begin = np.polyfit(number, off, 1)
    if float(np.ptp(off - slope * number)) > _RANGE * resolution:  # of all lines the one that leaves the least range
        low, high = (slope + sign * 4.0 * resolution / number[-1] for sign in (-1.0, 1.0))
        for _ in range(_CUTS):
            third = (high - low) / 3.0
            spread, other_spread = (float(np.ptp(off - b * number)) for b in (low + third, high - third))
            low, high = (low, high - third) if spread < other_spread else (low + third, high)
        slope = 0.5 * (low + high)
        left = off - slope * number
        begin = 0.5 * (left.min() + left.max())
    if slope <= 0 or float(np.ptp(off - slope * number)) > _RANGE * resolution:
        return None
    return np.asarray(time[0] + begin + slope * number)


@dataclass(frozen=True, eq=False)
class CommandedPath:
    """A planned path by its arc length, going on before its begin and behind its end, and the feet of points on it.

    A weave is taken along the line in its middle.
    """

    way: Way  #: The path by the distance travelled.

    @classmethod
    def of(cls, path: PlannedPath, *, reoriented: bool = False) -> Self:
        """Return the path of a plan, and whether the orientation alternates on it."""
        return cls(Way(path, reoriented))

    @property
    def path(self) -> PlannedPath:
        """The plan."""
        return self.way.path

    @property
    def length(self) -> float:
        """From begin to end [m]."""
        return self.way.length

    @property
    def starts(self) -> Array:
        """Arc length at each end of a side [m], ``(k,)``. A circle has one side."""
        return self.way.corners

    @cached_property
    def vertices(self) -> Array:
        """Ends of the sides [m], ``(k, 3)``."""
        return self.way.position(self.way.corners)

    @cached_property
    def centre(self) -> Array:
        """Of a circle [m], ``(3,)``."""
        return np.asarray(self.path.points[0])

    @cached_property
    def radius(self) -> float:
        """Of a circle [m]; 0 of others."""
        circle = self.path.kind == "circle"
        return float(np.linalg.norm(self.path.points[1] - self.path.points[0])) if circle else 0.0

    @property
    def closed(self) -> bool:
        """Whether it ends where it begins."""
        return bool(np.linalg.norm(self.vertices[-1] - self.vertices[0]) < 1e-9)

    @property
    def extent(self) -> float:
        """Diameter of a circle, longest distance between two vertices of others [m]."""
        if self.radius:
            return 2 * self.radius
        return float(np.linalg.norm(self.vertices[:, None] - self.vertices[None], axis=2).max())

    def points(self, along: Array) -> Array:
        """Return the points at arc lengths ``(n,)`` [m], ``(n, 3)``.

        Before the begin and after the end it is straight on; round again on a circle.
        """
        if self.radius:
            return self.way.position(along % self.length)
        beyond = along - np.clip(along, 0.0, self.length)
        return np.asarray(self.way.position(along) + beyond[:, None] * self.way.direction(along))

    def tangents(self, along: Array) -> Array:
        """Return unit vectors along the path at arc lengths ``(n,)``, ``(n, 3)``."""
        return self.way.direction(along % self.length if self.radius else along)

    def rotations(self, along: Array) -> Array:
        """Return the commanded orientations at arc lengths ``(n,)``, ``(n, 3, 3)``."""
        return self.way.rotation(along)

    def feet(self, points: Array, near: Array, within: float) -> Array:
        """Return the arc length of the foot of each point ``(n, 3)`` on the path, ``(n,)`` [m].

        Args:
            near: About where the foot is [m], ``(n,)``: what tells apart the begin and the end of a closed path.
            within: So far from there at most [m].
        """
        if self.radius:
            out, onward = (self.vertices[0] - self.centre) / self.radius, self.way.direction(np.zeros(1))[0]
            away = points - self.centre
            turn = 2 * math.pi * self.radius
            arc = self.radius * np.arctan2(away @ onward, away @ out)
            return np.asarray(arc + turn * np.round((near - arc) / turn))
        best, foot = np.full(len(points), np.inf), np.array(near)
        last = len(self.vertices) - 2
        for side in range(last + 1):
            begin, end = self.starts[side], self.starts[side + 1]
            direction = (self.vertices[side + 1] - self.vertices[side]) / (end - begin)
            low = np.full(len(points), -np.inf) if side == 0 else np.maximum(begin, near - within)
            high = np.full(len(points), np.inf) if side == last else np.minimum(end, near + within)
            low, high = np.maximum(low, near - within), np.minimum(high, near + within)
            at = np.clip(begin + (points - self.vertices[side]) @ direction, low, np.maximum(low, high))
            away = points - self.vertices[side] - (at - begin)[:, None] * direction
            distance = np.where(low <= high, (away**2).sum(axis=1), np.inf)
            nearer = distance < best
            best, foot = np.where(nearer, distance, best), np.where(nearer, at, foot)
        return foot


#: So many places at once: sums begin anew with each part, which keeps them short and their rounding small.
_PART = 50_000


def local_lines(at: Array, values: Array, places: Array, half: float) -> tuple[Array, Array, NDArray[np.intp]]:
    """Return value and rate of least-squares lines through the samples within a window about each place.

    The rate of a line is that of a local polynomial of second order where samples lie evenly. Of a value that swings
    with an angular frequency w it returns the share ``3 (sin x - x cos x) / x^3`` with ``x = w half`` of the rate's
    swing (Savitzky and Golay 1964, first derivative, many samples).

    Args:
        at: Where the samples are: times or arc lengths, not decreasing, ``(n,)``.
        values: ``(n, d)``.
        places: Where lines are wanted, not decreasing, ``(m,)``.
        half: Half the window.

    Returns:
        value, rate, count: ``(m, d)``, ``(m, d)`` and how many samples each window has, ``(m,)``. Where the samples of
            a window would not tell the value better than one of them alone, both are those of the straight line between
            the samples before and after the place.
    """
    value, rate = np.empty((len(places), values.shape[1])), np.empty((len(places), values.shape[1]))
    low = np.searchsorted(at, places - half, side="left")
    high = np.searchsorted(at, places + half, side="right")
    count = high - low
    for begin in range(0, len(places), _PART):
        part = slice(begin, min(begin + _PART, len(places)))
        first, last = int(low[part].min()), int(high[part].max())
        if last <= first:
            _between(at, values, places[part], np.ones(part.stop - part.start, bool), value[part], rate[part])
            continue
        origin, offset = at[first], values[first]
        x, y = at[first:last] - origin, values[first:last] - offset
        sums = np.zeros((last - first + 1, 2 + 2 * y.shape[1]))
        sums[1:, 0], sums[1:, 1] = x, x * x
        sums[1:, 2 : 2 + y.shape[1]], sums[1:, 2 + y.shape[1] :] = y, x[:, None] * y
        np.cumsum(sums, axis=0, out=sums)
        inside = sums[high[part] - first] - sums[low[part] - first]
        n = np.maximum(count[part], 1)
        mean = inside[:, 0] / n
        spread = inside[:, 1] - n * mean * mean
        mean_y = inside[:, 2 : 2 + y.shape[1]] / n[:, None]
        along = inside[:, 2 + y.shape[1] :] - mean[:, None] * inside[:, 2 : 2 + y.shape[1]]
        away = places[part] - origin - mean
        # no value is less certain than a single sample: a cluster of samples does not tell what is beside it
        usable = (count[part] >= 2) & (spread > 1e-9 * half**2 * n) & (away**2 <= spread * (1.0 - 1.0 / n))
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = along / spread[:, None]
        value[part] = offset + mean_y + slope * away[:, None]
        rate[part] = slope
        if not usable.all():
            _between(at, values, places[part], ~usable, value[part], rate[part])
    return value, rate, count


def _between(at: Array, values: Array, places: Array, chosen: NDArray[np.bool_], value: Array, rate: Array) -> None:
    """Fill in values and rates between the samples before and after some places."""
    after = np.clip(np.searchsorted(at, places[chosen], side="right"), 1, len(at) - 1)
    step = at[after] - at[after - 1]
    slope = (values[after] - values[after - 1]) / np.where(step > 0, step, np.inf)[:, None]
    value[chosen] = values[after - 1] + slope * (places[chosen] - at[after - 1])[:, None]
    rate[chosen] = slope


#: Half the window over which speed is taken [s], and at least so many samples in it.
_HALF_WINDOW = 0.04
_LEAST_SAMPLES = 5
#: The tip moves where it is faster than this share of the commanded velocity, and stands below half of it.
_MOVES = 0.04
#: So many standard deviations of the speed of noise alone are no motion.
_NOISE = 6.0
#: A dwell or a motion is seen at least so long [s], or it belongs to what is around it. A dwell is seen less long than
#: it takes, by the window of the speed.
_SHORTEST = {False: 0.03, True: 0.1}
#: Within this share of the length of a path from one of its ends the tip is said to be there; of its extent at most.
_AT_END, _AT_END_OF_EXTENT = 0.05, 0.1
#: A robot whose path is off comes no nearer than so; it is at the end within this many times that.
_NEAREST = 1.5
#: A cycle is no further from the path than this share of its extent.
_NEAR = 0.2
#: In so many places between its ends it is seen whether a path was run, and in which direction.
_CHECKED = (0.25, 0.5, 0.75)

Span = tuple[int, int]


@dataclass(frozen=True, eq=False)
class FoundStream:
    """What was found in a stream."""

    test: str  #: test, path: whose stream it is.
    path: str
    time: Array  #: time, speed: [s], [m/s], ``(n,)``; the speed is that of a straight line through a short window.
    speed: Array
    threshold: float  #: Faster is motion [m/s].
    dwells: tuple[Span, ...]  #: dwells, motions, cycles: indices of the first and of the last sample of each.
    motions: tuple[Span, ...]
    cycles: tuple[Span, ...]


def noise_of(position: Array) -> float:
    """Return the standard deviation of the noise of each coordinate [m], from third differences where it is quietest.

    A motion whose acceleration changes little leaves none of itself in third differences.
    """
    if len(position) < 8:
        return 0.0
    differences = np.diff(position, n=3, axis=0)
    length = min(50, len(differences))
    blocks = differences[: len(differences) // length * length].reshape(-1, length * 3)
    return float(np.quantile(np.sqrt((blocks**2).mean(axis=1)), 0.2) / np.sqrt(20.0))


def speeds(time: Array, position: Array) -> tuple[Array, float]:
    """Return the speed at each sample [m/s], ``(n,)``, and the standard deviation that noise alone gives it."""
    step = float(np.median(np.diff(time)))
    half = max(_HALF_WINDOW, _LEAST_SAMPLES / 2 * step)
    _, rate, _ = local_lines(time, position, time, half)
    count = max(2 * half / step, _LEAST_SAMPLES)
    return np.asarray(np.linalg.norm(rate, axis=1)), float(noise_of(position) * np.sqrt(12.0 / count) / (2 * half))


def spans_of(moving: NDArray[np.bool_]) -> list[Span]:
    """Return first and last index of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moving, [False]]).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]


def motion(time: Array, position: Array, velocity: float) -> tuple[Array, float, NDArray[np.bool_]]:
    """Return the speed [m/s], the threshold, and at which samples the tip moves.

    It begins to move where it gets faster than the threshold and stands where it gets slower than half of it.

    Args:
        velocity: Commanded [m/s].
    """
    speed, noise = speeds(time, position)
    threshold = max(_MOVES * velocity, _NOISE * noise)
    above, below = speed > threshold, speed < 0.5 * threshold
    decided = np.where(above, 1, np.where(below, -1, 0))
    last = np.maximum.accumulate(np.where(decided != 0, np.arange(len(speed)), 0))
    moving = decided[last] > 0
    for state in (False, True):  # short dwells first: a motion broken by noise is one
        for first, final in spans_of(moving == state):
            inner = first > 0 and final < len(moving) - 1
            if inner and time[final] - time[first] < _SHORTEST[state]:
                moving[first : final + 1] = not state
    return speed, threshold, moving


def found_in(test: str, path: CommandedPath, time: Array, position: Array, velocity: float) -> FoundStream:
    """Return dwells, motions and cycles in a stream.

    A cycle goes from the begin of the path to its end and passes a quarter, the middle and three quarters of it on its
    way, near the plan; so a way back, and a path run backwards, are none. It begins with the dwell before it, where
    there is one, and ends with the one behind it.

    Args:
        time, position: [s], [m in the base frame], ``(n,)`` and ``(n, 3)``.
        velocity: Commanded [m/s].
    """
    speed, threshold, moving = motion(time, position, velocity)
    dwells, motions = spans_of(~moving), spans_of(moving)
    cycles = tuple(_cycles(path, position, speed, moving))
    return FoundStream(test, path.path.name, time, speed, threshold, tuple(dwells), tuple(motions), cycles)


def _cycles(path: CommandedPath, position: Array, speed: Array, moving: NDArray[np.bool_]) -> list[Span]:
    radius = min(_AT_END * path.length, _AT_END_OF_EXTENT * path.extent)
    begin, end = path.points(np.array([0.0])), path.points(np.array([path.length]))
    at_begin, at_end = (np.linalg.norm(position - point, axis=1) for point in (begin, end))
    most = _NEAR * path.extent
    around = [min(max(radius, _NEAREST * float(distance.min())), most) for distance in (at_begin, at_end)]
    visits = [(*span, "begin") for span in spans_of(at_begin < around[0])]
    visits += [] if path.closed else [(*span, "end") for span in spans_of(at_end < around[1])]
    visits.sort()
    cycles: list[Span] = []
    for before, after in itertools.pairwise(visits):
        if before[2] != "begin" or after[2] != ("begin" if path.closed else "end"):
            continue
        if not _runs(path, position[before[1] : after[0] + 1]):
            continue
        first = _bound(before[:2], at_begin, moving, speed, last=False)
        final = _bound(after[:2], at_end, moving, speed, last=True)
        cycles.append((first, final))
    return cycles


def _runs(path: CommandedPath, way: Array) -> bool:
    """Return whether samples between the two ends of a path run along it, in its direction."""
    if len(way) < 8:
        return False
    near = _NEAR * path.extent + path.path.stroke
    places = path.points(np.array(_CHECKED) * path.length)
    distance = np.linalg.norm(way[:, None] - places[None], axis=2)
    when = distance.argmin(axis=0)
    return bool((distance.min(axis=0) < near).all() and (np.diff(when) > 0).all())


def _bound(visit: Span, distance: Array, moving: NDArray[np.bool_], speed: Array, *, last: bool) -> int:
    """Return where a cycle begins (or ends, `last`) in the samples that are near its end of the path."""
    first, final = visit
    standing = spans_of(~moving[first : final + 1])
    if standing:  # a cycle begins with the end of the last dwell, and ends with the begin of the first
        return first + standing[0][0] if last else first + standing[-1][1]
    return first + int(distance[first : final + 1].argmin())


#: Samples and places of the path that are compared with each other.
_SAMPLES, _PLACES = 500, 400
#: Farther from the path than this share of its extent, in the middle of all samples, it is another path, unless it is
#: this path as a whole beside its place, by no more than the other share. Nearer than the third it is this path.
_FAR, _BESIDE, _SURE = 0.2, 0.4, 0.03
#: Run backwards, samples are so much nearer to the path the other way round.
_REVERSED = 0.5
#: Path, direction and distance are judged by samples that are this share of the extent apart: not by those at rest.
_STEP = 0.01
#: The tip is not faster than so many times the command, and where it is slower than this share, times are in another
#: unit.
_FASTER, _SLOWEST = 2.0, 0.02
#: The middle half of a path is cut into so many stretches, and the tip's pace is that in the middle of theirs.
_STRETCHES = 10
#: From so little of the path a cycle cannot be judged.
_LEAST_RUN = 0.8


@dataclass(frozen=True, eq=False)
class Cycle:
    """A cycle whose samples are tied to the commanded path."""

    number: int  #: Of the cycle.
    time: Array  #: [s], ``(n,)``.
    position: Array  #: In the base frame [m], ``(n, 3)``.
    rotation: Array | None  #: ``(n, 3, 3)``; None where there are no orientations.
    #: Arc length of the foot of each sample on the commanded path [m], ``(n,)``. It swings with the noise.
    along: Array
    lines: NDArray[np.intp]  #: Of the samples in the file, ``(n,)``.
    clock: Clock  #: That of the record in which the cycle is.

    @property
    def line(self) -> int:
        """Of the first sample in the file."""
        return int(self.lines[0])


def along_path(path: CommandedPath, position: Array, place: str) -> Array:
    """Return the arc length of the foot of each sample on the commanded path [m], ``(n,)``.

    The samples of a cycle are matched with places of the path so that the sum of squared distances is least and no
    later sample lies before an earlier one (dynamic programming, as in dynamic time warping: Sakoe and Chiba 1978).
    That tells the begin of a closed path from its end, and one passing of a crossing from the other. The foot of each
    sample is then sought near its match.

    Args:
        position: Samples of one cycle in the base frame [m], ``(n, 3)``, in the order of time.
        place: File and lines, for the refusal.

    Raises:
        InputError: If the samples do not come near the path, or run only a part of it, or run it in the other
            direction.
    """
    chosen = np.unique(np.linspace(0, len(position) - 1, min(_SAMPLES, len(position))).round().astype(np.intp))
    places = np.linspace(0.0, path.length, _PLACES)
    points = path.points(places)
    few = position[chosen]
    match, distance = _matched(few, points)
    moving = _moving(few, _STEP * path.extent)
    _refuse_other_path(path, few[moving], points, float(np.median(distance[moving])), place)
    near = np.interp(np.arange(len(position)), chosen, places[match])
    step = float(np.abs(np.diff(near)).max(initial=0.0))
    along = path.feet(position, near, 0.02 * path.length + 2 * step)
    low, high = np.quantile(along, [0.001, 0.999])
    if high - low < _LEAST_RUN * path.length:
        raise InputError(
            f"the samples run only a part of the path {path.path.name}",
            where=place,
            came=f"{1e3 * max(low, 0.0):.0f} to {1e3 * high:.0f} mm of {1e3 * path.length:.0f} mm, in this direction",
            allowed=f"{100 * _LEAST_RUN:.0f} % of the path or more, from its begin to its end",
            cure="Record the whole cycle, and run the path in the direction of the plan.",
        )
    return along


def pace_along(path: CommandedPath, time: Array, along: Array) -> float:
    """Return how fast the tip goes along the middle half of the path [m/s], pauses and corners left aside."""
    run = np.maximum.accumulate(along)
    places = np.linspace(0.25, 0.75, _STRETCHES + 1) * path.length
    passed = np.interp(places, run, time)
    lasts = float(np.median(np.diff(passed)))
    return float(np.inf) if lasts <= 0.0 else float(places[1] - places[0]) / lasts


def refuse_other_times(path: CommandedPath, time: Array, along: Array, velocity: float, place: str) -> None:
    """Refuse a cycle that is run so fast or so slowly that its times are not seconds, or it is another's.

    A robot is not faster than commanded, and may be slower where joints come to their limits.

    Args:
        time, along: Of the samples [s], and the arc lengths of their feet [m], ``(n,)``.
        velocity: Commanded [m/s].
        place: File and lines.

    Raises:
        InputError: If the pace is above twice the commanded velocity, or below a fiftieth of it.
    """
    pace = pace_along(path, time, along)
    if _SLOWEST * velocity <= pace <= _FASTER * velocity:
        return
    raise InputError(
        f"the path {path.path.name} was run much {'faster' if pace > velocity else 'slower'} than commanded",
        where=place,
        came=f"{_apart(pace, _FASTER * velocity if pace > velocity else _SLOWEST * velocity)[0]} mm/s in the middle "
        "half",
        allowed=f"{1e3 * _SLOWEST * velocity:.4g} to {1e3 * _FASTER * velocity:.4g} mm/s; commanded are "
        f"{1e3 * velocity:.4g}",
        cure="Name the unit of the times in the header (s, ms, us), and check the column velocity [%] and the rated "
        "velocity of the plan.",
    )


def _moving(few: Array, step: float) -> NDArray[np.intp]:
    """Return samples of which each is at least `step` from the one before it [m]."""
    retained = [0]
    for k, apart in enumerate(np.linalg.norm(np.diff(few, axis=0), axis=1).tolist(), 1):
        if apart >= step or np.linalg.norm(few[k] - few[retained[-1]]) >= step:
            retained.append(k)
    return np.array(retained, dtype=np.intp)


def _matched(few: Array, points: Array) -> tuple[NDArray[np.intp], Array]:
    """Return the place of each sample on a path, and how far it is from there [m]."""
    cost = (few**2).sum(axis=1)[:, None] - 2 * few @ points.T + (points**2).sum(axis=1)
    match = _monotone(cost)
    return match, np.sqrt(np.maximum(cost[np.arange(len(few)), match], 0.0))


def _monotone(cost: Array) -> NDArray[np.intp]:
    """Return the column of each row, never decreasing, with the least sum of costs."""
    best = np.empty_like(cost)
    best[0] = cost[0]
    for row in range(1, len(cost)):
        np.add(np.minimum.accumulate(best[row - 1]), cost[row], out=best[row])
    match = np.empty(len(cost), dtype=np.intp)
    place = int(best[-1].argmin())
    for row in range(len(cost) - 1, -1, -1):
        place = int(best[row, : place + 1].argmin())
        match[row] = place
    return match


def _refuse_other_path(path: CommandedPath, few: Array, points: Array, distance: float, place: str) -> None:
    """Refuse samples of another path, in another direction, or so far beside that planes through the path tell nothing.

    Shape and direction are judged once the samples are moved onto the path's middle: a robot that is off by as much as
    a small circle is wide still runs this circle.
    """
    if distance <= _SURE * path.extent:
        return
    allowed = _FAR * path.extent + path.path.stroke / 2
    offset = (few.max(axis=0) + few.min(axis=0) - points.max(axis=0) - points.min(axis=0)) / 2
    moved = few - offset
    ahead, back = (float(np.median(_matched(moved, way)[1])) for way in (points, points[::-1]))
    if back <= min(allowed, _REVERSED * ahead):
        raise InputError(
            f"the samples run the path {path.path.name} backwards",
            where=place,
            cure="Run it in the direction of the plan.",
        )
    if distance <= allowed:
        return
    beside, most = float(np.linalg.norm(offset)), _BESIDE * path.extent
    if ahead <= allowed and beside <= most:
        return
    if ahead <= allowed and beside <= path.extent:
        measured, most_allowed = _apart(beside, most)
        raise InputError(
            f"the samples run the path {path.path.name} too far beside it for planes through it to tell anything",
            where=place,
            came=f"{measured} mm beside it as a whole",
            allowed=f"{most_allowed} mm",
            cure="Check how the instrument is tied to the robot's base; or plan in a larger cube.",
        )
    least = float(np.median(np.sqrt(((few[:, None] - points[None]) ** 2).sum(axis=2)).min(axis=1)))
    other_order = least <= allowed
    measured, most_allowed = _apart(distance if other_order else max(least, allowed), allowed)
    raise InputError(
        f"the samples run the path {path.path.name} in another order"
        if other_order
        else f"the samples never come near the path {path.path.name}",
        where=place,
        came=f"{measured} mm from it, half of the samples further",
        allowed=f"{most_allowed} mm",
        cure="Run it as the plan says."
        if other_order
        else "Check the name of the path, the unit, and how the instrument is tied to the robot's base.",
    )


def _apart(measured: float, allowed: float) -> tuple[str, str]:
    """Return two lengths in mm, or velocities in mm/s, with as many decimals as it takes to see that they differ."""
    for decimals in range(1, 7):
        both = f"{1e3 * measured:.{decimals}f}", f"{1e3 * allowed:.{decimals}f}"
        if both[0] != both[1]:
            break
    return both


#: The parabola goes through the samples within this share of the excursion's width at half its height, which of an
#: oscillation is a third of a period.
TOP: Final = 1 / 6
#: A top is beyond the larger of so few samples by less than this share if a period has eight, and by no more standard
#: deviations of noise besides; of more samples the largest is beyond the top.
_FEW: Final = 4
_BETWEEN: Final = 0.1
_NOISE_TOPS: Final = 3.0
#: The top of a parabola through n samples has the standard deviation of one over sqrt(n), times this.
_GAIN: Final = 1.5


def top_of(time: Array, away: Array, peak: int, sigma: float) -> tuple[float, float]:
    """Return how far an excursion goes [m], and its width at half its height [s].

    Noise makes the largest of many samples too large, and the top may lie between two samples: a parabola through the
    samples about the largest knows both.

    Args:
        time, away: Of the samples [s], ``(n,)``, and from where [m], ``(n, 3)``: of the excursion, and of nothing that
            goes further.
        peak: Which sample is the furthest.
        sigma: Noise of each coordinate [m].
    """
    along = away @ (away[peak] / np.linalg.norm(away[peak]))
    width = _width(time, along, peak)
    return _top(time, along, peak, width, sigma), width


def largest_top(time: Array, away: Array, counted: NDArray[np.bool_], sigma: float) -> tuple[float, float]:
    """Return how far the largest excursion of a record goes [m], and how far noise alone would seem to go there [m].

    Where the excursion is, and how wide, is seen in positions that are smoothed over more and more of its width; how
    far it goes, by a parabola as in :func:`top_of`.

    Args:
        counted: Which samples may be the furthest, ``(n,)``.
    """
    if not counted.any() or len(time) < 3:
        return 0.0, 0.0
    step = float(np.median(np.diff(time)))
    half, smooth = 0.0, away
    while True:
        peak = int(np.where(counted, np.linalg.norm(smooth, axis=1), -1.0).argmax())
        size = float(np.linalg.norm(smooth[peak]))
        if size == 0.0:
            return 0.0, 0.0
        unit = smooth[peak] / size
        width = _width(time, smooth @ unit, peak)
        if 2.0 * half >= TOP * width or TOP * width < 2.0 * step:
            break
        half = min(max(2.0 * half, 1.5 * step), TOP * width)
        smooth = local_lines(time, away, time, half)[0]
    along = away @ unit
    count = max(2.0 * TOP * width / step, 1.0)
    places = max((time[-1] - time[0]) / max(2.0 * TOP * width, step), 2.0)
    noise = sigma * min(_GAIN / count**0.5, 1.0) * float(np.sqrt(2.0 * np.log(places)))
    return max(_top(time, along, peak, width, sigma), 0.0), noise


def _width(time: Array, along: Array, peak: int) -> float:
    """Return how long an excursion is further than half its height [s]."""
    half = 0.5 * along[peak]
    first = int(np.flatnonzero(np.append(True, along[:peak] < half))[-1])
    below = np.flatnonzero(along[peak:] < half)
    last = peak + int(below[0]) if len(below) else len(along) - 1
    first = min(max(first - 1, 0), len(time) - 2)
    last = max(last, first + 1)
    return float(time[last] - time[first] - 0.5 * (time[last] - time[last - 1] + time[first + 1] - time[first]))


def _top(time: Array, along: Array, peak: int, width: float, sigma: float) -> float:
    near = np.flatnonzero(np.abs(time - time[peak]) <= TOP * width)
    near = near if len(near) >= 3 else np.arange(max(peak - 1, 0), min(peak + 2, len(time)))
    largest = float(along[near].max())
    most = largest if len(near) > _FEW else (1.0 + _BETWEEN) * largest + _NOISE_TOPS * sigma
    if len(near) < 3:
        return float(along[peak])
    t = (time[near] - time[peak]) / max(float(np.abs(time[near] - time[peak]).max()), 1e-12)
    a, b, c = np.polyfit(t, along[near], 2)
    if a >= 0 or abs(b) > -2 * a:
        return float(along[near].mean() if len(near) > 3 else along[peak])
    return min(float(c - b * b / (4 * a)), most)
