"""Samples that no robot can have passed: a beam that was broken, a reflection, a row that was written wrongly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.measurement.performance.records import Samples
from truearm.modeling.chain import Array
from truearm.validation.iso9283.clock import Clock

#: No tip is accelerated so much [m/s^2] while its velocity changes by so many times the commanded one, or the one about
#: it, between two samples.
_IMPOSSIBLE = ((500.0, 3.0), (100.0, 5.0), (50.0, 20.0))
#: No tip is faster [m/s].
_FASTEST = 20.0
#: So many standard deviations of noise are no wild sample.
_NOISE = 14.0
#: So many samples in a row may be wild and the tip be back where it was; and so many steps tell how fast it goes there.
_GROUP, _ABOUT = 20, 7
#: Median length of a vector of three standard normal numbers.
_MEDIAN = 1.538
#: So many places are named in a refusal.
_NAMED = 3
#: More steps than this share that no tip takes are no matter of single samples.
_SINGLE = 0.05


@dataclass(frozen=True, eq=False)
class WildSteps:
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


def wild_steps(time: Array, position: Array, velocity: float | None) -> WildSteps:
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
        return WildSteps(np.empty(0, dtype=np.intp), np.empty((0, 3)), max(len(time) - 1, 0))
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
    return WildSteps(likely[impossible], pace[impossible], len(step))


def refuse_wild(
    samples: Samples, rows: NDArray[np.intp], position: Array, found: WildSteps, cycle: int, clock: Clock
) -> None:
    """Refuse a record with samples that no tip can have passed, naming them.

    Args:
        rows: Of the record in `samples`, in its order.
        position: Of these [m], ``(n, 3)``.
        found: What no tip can do there.
        cycle: Its number; 0 for a stream.
        clock: Of the record.

    Raises:
        InputError: If there are such steps; of times that are rounded too coarsely to tell, this is said instead.
    """
    if not len(found.before):
        return
    if clock.is_coarse:
        raise InputError(
            "times of samples are rounded too coarsely to say how fast the tip moves",
            where=f"{samples.source}, line {samples.line[rows[found.before[0]]]}, column time",
            came=f"times to {clock.resolution:g} s, samples {float(np.diff(clock.time).mean()):.4g} s apart",
            allowed="a tenth of the time between two samples, or less",
            cure="Write the times with more decimals.",
        )
    line, name = samples.line[rows], _name(samples, int(rows[0]), cycle)
    wild, jumps = _groups(clock.time, position, found)
    if wild:
        shown = [_lines(line[first : last + 1].tolist()) for first, last, _ in wild[:_NAMED]]
        more = f" and {len(wild) - _NAMED} more such places" if len(wild) > _NAMED else ""
        raise InputError(
            f"{name} has samples where no tip can have been",
            where=f"{samples.source}, {', '.join(shown)}{more}",
            came=f"{1e3 * max(off for _, _, off in wild):.4g} mm from the samples about them",
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
    time: Array, position: Array, found: WildSteps
) -> tuple[list[tuple[int, int, float]], list[tuple[int, float]]]:
    """Return first, last and distance of wild samples in a row, and samples from which on the record is elsewhere."""
    wild: list[tuple[int, int, float]] = []
    jumps: list[tuple[int, float]] = []
    last = -1
    for before, pace in zip(found.before.tolist(), found.pace, strict=True):
        first = before + 1
        if first <= last + 1 and wild:
            continue
        later = np.arange(first, min(first + _GROUP + 1, len(time)))
        expected = position[before] + (time[later] - time[before])[:, None] * pace
        away = np.linalg.norm(position[later] - expected, axis=1)
        back = np.flatnonzero(away < 0.5 * away[0])
        if len(back):
            last = first + int(back[0]) - 1
            wild.append((first, last, float(away[: int(back[0])].max())))
        elif before == 0 or first == len(time) - 1:
            last = 0 if before == 0 else first
            wild.append((last, last, float(away[0])))
        else:
            jumps.append((first, float(away[0])))
    return wild, jumps


def _name(samples: Samples, row: int, cycle: int) -> str:
    test, place = (names.names[int(names.code[row])] for names in (samples.criterion, samples.place))
    of = f"{test} on {place}" if test not in ("t", "posing-time") else f"{test} at {place}"
    return f"cycle {cycle} of {of}" if cycle else f"the stream of {of}"


def _lines(lines: Sequence[int]) -> str:
    return f"line {lines[0]}" if len(lines) == 1 else f"lines {lines[0]} to {lines[-1]}"
