"""The cycles of a path under one condition, taken from samples: in the base frame, and tied to the plan."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, nearest_names
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.rows import Conditions, Status, refuse_far_orientations
from truearm.iso9283.criteria.streams import (
    Clock,
    CommandedPath,
    Cycle,
    FoundStream,
    along_path,
    clock_of,
    found_in,
    refuse_other_times,
)
from truearm.iso9283.planning.criteria import PerformancePlan
from truearm.iso9283.planning.records import Samples

# Samples that no robot can have passed: a beam that was broken, a reflection, a row that was written wrongly.

#: No tip is accelerated so much [m/s^2] while its velocity changes by so many times the commanded one, or the one about
#: it, between two samples.
_IMPOSSIBLE = ((500.0, 3.0), (100.0, 5.0), (50.0, 20.0))
#: No tip is faster [m/s].
_FASTEST = 20.0
#: So many standard deviations of noise are no outlying sample.
_NOISE = 14.0
#: So many samples in a row may be outlying and the tip be back where it was; and so many steps tell how fast it goes
#: there.
_GROUP, _ABOUT = 20, 7
#: Median length of a vector of three standard normal numbers.
_MEDIAN = 1.538
#: So many places are named in a refusal.
_NAMED = 3
#: More steps than this share that no tip takes are no matter of single samples.
_SINGLE = 0.05


@dataclass(frozen=True, eq=False)
class OutlyingSteps:
    """Steps from one sample to the next that no tip can take."""

    before: NDArray[np.intp]  #: The sample from which each goes, ``(k,)``.
    pace: Array  #: Velocity of the steps about it [m/s], ``(k, 3)``.
    count: int  #: So many steps there are in all.

    @property
    def single(self) -> bool:
        """Whether they are so few that the other samples can be trusted."""
        return len(self.before) <= max(4.0, _SINGLE * self.count)


def scatter_of(position: Array) -> float:
    """Return the standard deviation of the noise of each coordinate [m], whatever a few samples do.

    From the median length of third differences, in which little of a motion is left.
    """
    if len(position) < 8:
        return 0.0
    return float(np.median(np.linalg.norm(np.diff(position, n=3, axis=0), axis=1)) / (_MEDIAN * np.sqrt(20.0)))


def outlying_steps(time: Array, position: Array, velocity: float | None) -> OutlyingSteps:
    """Return the steps from one sample to the next for which the tip would have to do what no tip can.

    A step counts if it differs from what the steps about it say by so much that it takes an acceleration of
    500 m/s^2 and a change of velocity by three times the commanded one; or of 100 m/s^2 and five times; or of 50 m/s^2
    and twenty times.

    Args:
        time, position: Of a record in its order [s], [m], ``(n,)`` and ``(n, 3)``.
        velocity: Commanded [m/s]; None where it is not known: then no change by less than 20 m/s counts below 500
            m/s^2.
    """
    if len(time) < 2 * _ABOUT:
        return OutlyingSteps(np.empty(0, dtype=np.intp), np.empty((0, 3)), max(len(time) - 1, 0))
    lasts = np.diff(time)
    lasts = np.maximum(lasts, 0.5 * float(np.median(lasts) or lasts.mean()))
    step = np.diff(position, axis=0)
    # what is far beyond every tip is sought alone: medians about all of a million steps would take their time
    size = np.linalg.norm(step, axis=1)
    noise = _NOISE * scatter_of(position)
    likely = np.flatnonzero((size > noise) & (size > 0.3 * _IMPOSSIBLE[-1][0] * lasts**2))
    about = np.clip(likely - _ABOUT // 2, 0, len(step) - _ABOUT)[:, None] + np.arange(_ABOUT)
    about = about[about != likely[:, None]].reshape(len(likely), _ABOUT - 1)
    pace = np.median(step[about] / lasts[about][..., None], axis=1)
    fast = np.linalg.norm(pace, axis=1)
    jump = np.linalg.norm(step[likely] - pace * lasts[likely, None], axis=1)
    change, force = jump / lasts[likely], jump / lasts[likely] ** 2
    usual = np.maximum(fast, velocity or 0.0)
    impossible = np.zeros(len(likely), dtype=bool)
    for row, (most, times) in enumerate(_IMPOSSIBLE):
        least = _FASTEST if velocity is None and row else 0.0
        impossible |= (force > most) & (change > np.maximum(times * usual, least))
    impossible &= jump > noise
    return OutlyingSteps(likely[impossible], pace[impossible], len(step))


def refuse_outlying(
    samples: Samples, rows: NDArray[np.intp], position: Array, steps: OutlyingSteps, cycle: int, clock: Clock
) -> None:
    """Refuse a record with samples that no tip can have passed, naming them.

    Args:
        rows: Of the record in `samples`, in its order.
        position: Of these [m], ``(n, 3)``.
        steps: What no tip can do there.
        cycle: Its number; 0 for a stream.
        clock: Of the record.

    Raises:
        InputError: If there are such steps; of times that are rounded too coarsely to tell, this is said instead.
    """
    if not len(steps.before):
        return
    if clock.is_coarse:
        raise InputError(
            "times of samples are rounded too coarsely to say how fast the tip moves",
            where=f"{samples.source}, line {samples.line[rows[steps.before[0]]]}, column time",
            came=f"times to {clock.resolution:g} s, samples {float(np.diff(clock.time).mean()):.4g} s apart",
            allowed="a tenth of the time between two samples, or less",
            cure="Write the times with more decimals.",
        )
    line, name = samples.line[rows], _name(samples, int(rows[0]), cycle)
    outlying, jumps = _groups(clock.time, position, steps)
    if outlying:
        shown = [_lines(line[first : last + 1].tolist()) for first, last, _ in outlying[:_NAMED]]
        more = f" and {len(outlying) - _NAMED} more such places" if len(outlying) > _NAMED else ""
        raise InputError(
            f"{name} has samples where no tip can have been",
            where=f"{samples.source}, {', '.join(shown)}{more}",
            came=f"{1e3 * max(off for _, _, off in outlying):.4g} mm from the samples about them",
            allowed="steps that a robot can take from one sample to the next",
            cure="Remove these lines: samples may be missing.",
        )
    first, off = jumps[0]
    raise InputError(
        f"{name} jumps",
        where=f"{samples.source}, lines {line[first - 1]} and {line[first]}",
        came=f"{1e3 * off:.4g} mm from one sample to the next, and on from there",
        allowed="steps that a robot can take from one sample to the next",
        cure="Check that times are in seconds. Otherwise the instrument lost the target and found it elsewhere: "
        "measure the cycle again, or leave it out.",
    )


def _groups(
    time: Array, position: Array, steps: OutlyingSteps
) -> tuple[list[tuple[int, int, float]], list[tuple[int, float]]]:
    """Return first, last and distance of outlying samples in a row, and where the record goes on elsewhere."""
    outlying: list[tuple[int, int, float]] = []
    jumps: list[tuple[int, float]] = []
    last = -1
    for before, pace in zip(steps.before.tolist(), steps.pace, strict=True):
        first = before + 1
        if first <= last + 1 and outlying:
            continue
        later = np.arange(first, min(first + _GROUP + 1, len(time)))
        expected = position[before] + (time[later] - time[before])[:, None] * pace
        away = np.linalg.norm(position[later] - expected, axis=1)
        back = np.flatnonzero(away < 0.5 * away[0])
        if len(back):
            last = first + int(back[0]) - 1
            outlying.append((first, last, float(away[: int(back[0])].max())))
        elif before == 0 or first == len(time) - 1:
            last = 0 if before == 0 else first
            outlying.append((last, last, float(away[0])))
        else:
            jumps.append((first, float(away[0])))
    return outlying, jumps


def _name(samples: Samples, row: int, cycle: int) -> str:
    test, place = (names.names[int(names.code[row])] for names in (samples.criterion, samples.place))
    of = f"{test} on {place}" if test not in ("t", "posing-time") else f"{test} at {place}"
    return f"cycle {cycle} of {of}" if cycle else f"the stream of {of}"


def _lines(lines: Sequence[int]) -> str:
    return f"line {lines[0]}" if len(lines) == 1 else f"lines {lines[0]} to {lines[-1]}"


#: Further from its command than this no orientation is on the way, where the servo lags behind [rad].
_FAR_TURNED = np.radians(30.0)
#: Fewer samples than this are no cycle.
LEAST_SAMPLES = 20


@dataclass(frozen=True, eq=False)
class Run:
    """All cycles of a path under one condition."""

    test: str  #: Id of the test.
    path: CommandedPath  #: What was commanded.
    velocity: float  #: Commanded along the path [m/s].
    conditions: Conditions  #: As shares.
    cycles: tuple[Cycle, ...]  #: In their order.
    planned: int  #: How many there should be.
    stream: FoundStream | None  #: What was found in the stream from which they are; None where the file numbers them.

    def status(self, *, coarse: bool) -> Status:
        """Return whether a value of it can be relied on."""
        if coarse:
            return "instrument-too-coarse"
        return "too-few-cycles" if len(self.cycles) < self.planned else "measured"


@dataclass(frozen=True, eq=False)
class Part:
    """Rows of one place under one condition."""

    place: str  #: Name of the path or of the pose.
    conditions: Conditions  #: As shares.
    rows: NDArray[np.intp]  #: Indices in the order of the file.
    cycle: NDArray[np.intp]  #: Of each of these rows.

    def cycles(self) -> Iterator[tuple[int, NDArray[np.intp]]]:
        """Yield the number and the rows of each cycle, in their order."""
        order = np.argsort(self.cycle, kind="stable")
        numbers, starts = np.unique(self.cycle[order], return_index=True)
        for number, rows in zip(numbers.tolist(), np.split(self.rows[order], starts[1:]), strict=True):
            yield int(number), rows


def parts_of(samples: Samples, test: str, known: tuple[str, ...]) -> Iterator[Part]:
    """Yield the rows of each place and condition of a test.

    Args:
        known: Places that the plan has.

    Raises:
        InputError: If a place is not in the plan.
    """
    rows = np.flatnonzero(samples.criterion.are(test))
    if not len(rows):
        return
    velocities, of_velocity = np.unique(samples.velocity[rows], return_inverse=True)
    loads, of_load = np.unique(samples.load[rows], return_inverse=True)
    key = (samples.place.code[rows] * len(velocities) + of_velocity) * len(loads) + of_load
    order = np.argsort(key, kind="stable")
    _, starts = np.unique(key[order], return_index=True)
    parts = np.split(rows[order], starts[1:])
    for _, part in sorted(zip((int(part[0]) for part in parts), parts, strict=True), key=lambda both: both[0]):
        place = samples.place.names[int(samples.place.code[part[0]])]
        if place not in known:
            near = nearest_names(place, known, 1, 0.6)
            raise InputError(
                f"the plan has no such place for {test}",
                where=f"{samples.source}, line {samples.line[part[0]]}",
                came=place,
                allowed=", ".join(known) or f"nothing: {test} is not planned",
                cure=f"Did you mean {near[0]}?" if near else "Name it as the plan does.",
            )
        conditions = Conditions(float(samples.velocity[part[0]]), float(samples.load[part[0]]))
        yield Part(place, conditions, part, samples.cycle[part])


def in_base(transform: Array, position: Array) -> Array:
    """Return positions in the base frame, ``(n, 3)``, of those in the instrument's."""
    return np.asarray(position @ transform[:3, :3].T + transform[:3, 3])


def runs_of(plan: PerformancePlan, samples: Samples, transform: Array, test: str) -> Iterator[Run]:
    """Yield the runs of a test, one after the other.

    A cycle that the file numbers is taken from the last dwell before it to the first behind it, where it has such.

    Args:
        transform: The instrument's frame in the robot's base, ``(4, 4)``.
        test: Its id.

    Raises:
        InputError: If the path is not planned, samples are too few or not near it, or no cycle is in a stream.
    """
    planned = plan.test(test)
    known = () if planned is None else planned.places
    for part in parts_of(samples, test, known):
        assert planned is not None
        path = CommandedPath.of(plan.paths[part.place], reoriented=test == "AT-reorientation")
        velocity = plan.rated_velocity * (part.conditions.velocity or 1.0)
        cycles: list[Cycle] = []
        stream = None
        for number, rows in part.cycles():
            location = f"{samples.source}, lines {samples.line[rows[0]]} to {samples.line[rows[-1]]}"
            if len(rows) < LEAST_SAMPLES:
                raise InputError(
                    "there are too few samples of this cycle",
                    where=location,
                    came=f"{len(rows)} samples",
                    allowed=f"{LEAST_SAMPLES} or more",
                    cure="Sample faster, or leave the cycle out.",
                )
            position = in_base(transform, samples.position[rows])
            clock = clock_of(samples.time[rows])
            outlying = outlying_steps(clock.time, position, velocity)
            if outlying.single:
                refuse_outlying(samples, rows, position, outlying, number, clock)
            record_stream = found_in(test, path, clock.time, position, velocity)
            spans = record_stream.cycles
            if number:
                if len(spans) > 1:
                    raise InputError(
                        f"cycle {number} of {part.place} runs the path {len(spans)} times",
                        where=location,
                        came=f"{len(spans)} cycles under one number",
                        allowed="one run of the path",
                        cure="Number the cycles, or leave the cells of the column cycle empty: then they are found.",
                    )
                spans = spans if len(spans) == 1 else ((0, len(rows) - 1),)
            else:
                stream = record_stream
                if not spans:
                    raise InputError(
                        f"no cycle of the path {part.place} is found in the stream",
                        where=location,
                        came=f"{len(record_stream.motions)} motions, {len(record_stream.dwells)} dwells",
                        allowed="motions from the begin of the path to its end, near the plan",
                        cure="Check the name of the path, the unit, and how the instrument is tied to the robot's "
                        "base, or number the cycles.",
                    )
            for count, (first, last) in enumerate(spans, 1):
                chosen = rows[first : last + 1]
                place = f"{samples.source}, lines {samples.line[chosen[0]]} to {samples.line[chosen[-1]]}"
                rotation = None if samples.rotation is None else transform[:3, :3] @ samples.rotation[chosen]
                along = along_path(path, position[first : last + 1], place)
                time = clock.time[first : last + 1]
                refuse_other_times(path, time, along, velocity, place)
                if rotation is not None:
                    commanded = path.rotations(along)
                    refuse_far_orientations(
                        rotation, commanded, transform[:3, :3], samples.line[chosen], samples.source, _FAR_TURNED
                    )
                cycles.append(
                    Cycle(
                        number or count, time, position[first : last + 1], rotation, along, samples.line[chosen], clock
                    )
                )
            refuse_outlying(samples, rows, position, outlying, number, clock)
        yield Run(test, path, velocity, part.conditions, tuple(cycles), planned.cycles, stream)
