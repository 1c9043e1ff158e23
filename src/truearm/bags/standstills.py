"""Standstills of a robot in a stream of joint positions, and what was seen of a target in each of them."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.bags.streams import JointStream, TargetStream
from truearm.engine.base.errors import InputError, counted, listed
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.readers.rows import Configurations, Readings, dataset_of
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf

#: A sample so many times further from the median of its standstill than half of them is no reading of it: for normal
#: noise that is nine standard deviations.
_FAR: Final = 6.0
#: What is nearer to it than this always is one [m].
_NEAR: Final = 2e-5
#: More of them at the ends, as a share, and the target moved; more of them anywhere, and they are no outlying ones.
_MOVED: Final = 0.05
_SET_ASIDE: Final = 0.2
_LEAST_SAMPLES: Final = 5
#: A scatter above this share of the moves between standstills is motion.
_MOVES: Final = 0.1
#: Moves below this are none: a point beside the robot [m].
_STANDS: Final = 1e-3
#: In a whole standstill a joint may move so many times further than in its shortest part.
_CREEP: Final = 3.0
#: Slower than this share of the fast motions is a pause, if it lasts so long [s].
_PAUSE: Final = 0.05
_SHORTEST: Final = 0.3
#: So many usual times between two messages, and no more seconds, may no message come where they are rare.
_MESSAGES_OF_A_GAP: Final = 10.0
_LONGEST_GAP: Final = 1.0
_GAP: Final = 1.5
#: Times are alike by this factor, and compared with this rounding [s].
_ALIKE: Final = 1.1
_ROUNDING: Final = 1e-6
#: Times between messages are multiples of the usual one within this share of it, up to so many, in so many of all.
_EVEN_WITHIN: Final = 0.25
_MOST_IN_A_ROW: Final = 50.0
_MOSTLY_EVEN: Final = 0.9


@dataclass(frozen=True, eq=False)
class Standstill:
    """A time in which no joint moves."""

    start: float  #: start, end: from when to when [s].
    end: float
    joints: Array  #: Mean joint positions [rad; m for prismatic joints], ``(joints,)``.
    span: float  #: How far the joint that moved most went [rad or m].


@dataclass(frozen=True, eq=False)
class Sighting:
    """What was seen of a target in a standstill."""

    position: Array  #: Mean [m], ``(3,)``; NaN where too few samples were seen.
    quaternion: Array | None  #: Mean (w, x, y, z), ``(4,)``; None for points.
    samples: int  #: samples, set_aside: how many samples it is the mean of, and how many were far from the others.
    set_aside: int
    scatter: float  #: scatter, sigma: standard deviation of a coordinate of one sample, and of the mean [m].
    sigma: float
    sigma_rot: float | None  #: Of the mean's orientation, per axis [rad]; None for points.


def find_standstills(stream: JointStream, still: float, hold: float) -> tuple[Standstill, ...]:
    """Return the longest times in which every joint keeps still, in order.

    Messages may be missing: times count, not samples. Where none came for longer than an arm needs to leave a place and
    to come back, which is 0.3 s or ten usual times between messages (1 s at most), a standstill ends.

    Args:
        stream: The joints.
        still: How far a joint may move during `hold` [rad; m for prismatic joints].
        hold: The shortest standstill [s].

    Raises:
        InputError: If there is none, or the joints creep.
    """
    times, positions = stream.times, stream.positions
    place = f"topic {stream.topic}"
    usual = _usual_step(times)
    if usual <= 0.0 or times[-1] < hold:
        raise InputError(
            "the joints were recorded for too short a time",
            where=place,
            came=f"{len(times)} samples in {times[-1]:.3g} s",
            allowed=f"{hold:g} s and more",
        )
    last = np.searchsorted(times, times + hold - _ROUNDING)
    first = np.arange(len(times))
    last = np.maximum(last, first + 2)[last < len(times)]
    last = last[last < len(times)]
    if not len(last):
        raise InputError("there are too few samples of the joints", where=place, came=f"{len(times)}")
    first = first[: len(last)]
    spans = _spans(positions, last)
    gaps = np.concatenate([[0], np.cumsum(np.diff(times) > _longest_gap(usual))])
    whole = gaps[last] == gaps[first]
    quiet = np.concatenate([[False], (spans <= still) & whole, [False]])
    begin, end = (np.flatnonzero(np.diff(quiet.astype(int)) == step) for step in (1, -1))
    if not len(begin):
        least = math.degrees(float(spans[whole].min())) if whole.any() else math.inf
        raise InputError(
            "the robot never stands still",
            parameter="still",
            where=place,
            came=f"no joint moves more than {least:.3g} deg in the quietest {hold:g} s"
            if whole.any()
            else f"no {hold:g} s without a gap",
            allowed=f"{math.degrees(still):g} deg at most for {hold:g} s",
            cure="Let the robot wait at each configuration, or allow more with `still` or a shorter time with "
            "`shortest_dwell` if that was a standstill.",
        )
    standstills = []
    for i, j in _joined(positions, gaps, zip(begin.tolist(), (last[end - 1] + 1).tolist(), strict=True), still):
        part = positions[i:j]
        span = float(np.ptp(part, axis=0).max())
        if span > _CREEP * still:
            raise InputError(
                "the joints creep instead of standing still",
                parameter="still",
                where=f"{place}, {times[i]:.1f} s to {times[j - 1]:.1f} s after its first message",
                came=f"a joint moves {math.degrees(span):.3g} deg in all, {math.degrees(still):g} deg at most in "
                f"{hold:g} s",
                cure="Record stops, not slow motion; a smaller `still` tells them apart.",
            )
        standstills.append(Standstill(float(times[i]), float(times[j - 1]), part.mean(axis=0), span))
    return tuple(standstills)


def _spans(positions: Array, last: IntArray) -> Array:
    """Return how far the joint that moves most goes from each sample to its last one, ``(len(last),)``.

    Extremes of runs of 1, 2, 4, .. samples are made one from the other; two of them cover any run.
    """
    length = last - np.arange(len(last)) + 1
    level = np.frexp(length)[1] - 1
    spans, low, high = np.zeros(len(last)), positions, positions
    for power in range(int(level.max()) + 1):
        rows = np.flatnonzero(level == power)
        other = last[rows] - (1 << power) + 1
        reach = np.maximum(high[rows], high[other]) - np.minimum(low[rows], low[other])
        spans[rows] = reach.max(axis=1)
        low, high = (
            extreme(ends[: -(1 << power)], ends[1 << power :])
            for extreme, ends in ((np.minimum, low), (np.maximum, high))
        )
    return spans


def _joined(positions: Array, gaps: IntArray, parts: Iterable[tuple[int, int]], still: float) -> list[tuple[int, int]]:
    """Return parts of the stream, neighbours as one whose joints agree with no motion and no long gap between.

    Args:
        gaps: How many long gaps there are before each sample, ``(n,)``.
    """
    joined: list[tuple[int, int]] = []
    for i, j in parts:
        if joined and gaps[joined[-1][1] - 1] == gaps[i]:
            before = joined[-1]
            means = [positions[a:b].mean(axis=0) for a, b in (before, (i, j))]
            between = np.concatenate([means, positions[before[1] : i]])
            if float(np.ptp(between, axis=0).max()) <= still:
                joined[-1] = (before[0], max(j, before[1]))
                continue
        joined.append((i, j))
    return joined


def _usual_step(times: Array) -> float:
    """Return the most frequent time between two samples [s], 0 if there is none: it stays as messages are lost."""
    steps = np.diff(times)
    steps = steps[steps > _ROUNDING]
    if not len(steps):
        return 0.0
    bins = np.floor(np.log(steps) / math.log(_ALIKE)).astype(int)
    bins -= bins.min()
    most = int(np.bincount(bins).argmax())
    return float(np.median(steps[np.abs(bins - most) <= 1]))


def _longest_gap(usual: float) -> float:
    """Return how long no message may come in a standstill [s]: an arm that left it and came back takes longer."""
    return max(_SHORTEST, min(_MESSAGES_OF_A_GAP * usual, _LONGEST_GAP), _GAP * usual)


def lost_messages(stream: JointStream) -> int:
    """Return how many messages of the joints are missing between others, 0 where their times are too uneven to tell.

    A time between two messages that is three times the usual one has two of them missing. Gaps in which nobody knows
    what the robot did are not counted (:func:`missed_pauses`).
    """
    usual = _usual_step(stream.times)
    steps = np.diff(stream.times)
    steps = steps[steps <= _longest_gap(usual)]
    if usual <= 0.0 or not len(steps):
        return 0
    multiples = np.round(steps / usual)
    even = (np.abs(steps / usual - multiples) <= _EVEN_WITHIN) & (multiples <= _MOST_IN_A_ROW)
    if float(even.mean()) < _MOSTLY_EVEN:
        return 0
    return max(int((multiples[even] - 1.0).sum()), 0)


def missed_pauses(stream: JointStream, stills: Sequence[Standstill]) -> tuple[float, ...]:
    """Return when the robot paused without standing still: too short, creeping, or the joints were not recorded [s].

    A pause is slower than a twentieth of the fast motions for 0.3 s and longer. A gap in the recording counts as one,
    because nobody knows what the robot did in it.
    """
    times, positions = stream.times, stream.positions
    usual = _usual_step(times)
    span = max(round(_SHORTEST / 3.0 / usual), 1)
    pace = np.abs(positions[span:] - positions[:-span]).max(axis=1) / np.maximum(times[span:] - times[:-span], usual)
    slow = np.concatenate([[False], pace < _PAUSE * np.quantile(pace, 0.95), [False]])
    begin, end = (np.flatnonzero(np.diff(slow.astype(int)) == step) for step in (1, -1))
    pauses = [(float(times[i]), float(times[j - 1 + span])) for i, j in zip(begin, end, strict=True)]
    missed = [a for a, b in pauses if b - a >= _SHORTEST and not any(s.start < b and a < s.end for s in stills)]
    holes = np.flatnonzero(np.diff(times) > _longest_gap(usual))
    return tuple(sorted({*missed, *times[holes].tolist()}))


def seen_at(stills: Sequence[Standstill], stream: TargetStream, settle: float) -> tuple[Sighting, ...]:
    """Return what was seen of a target in each standstill, its first and last `settle` seconds left out.

    The deviation of a mean counts that samples which follow each other are alike: their autocorrelation, of all
    standstills together, tells how many independent ones there are (the sum of its first positive terms, Geyer 1992,
    Practical Markov chain Monte Carlo, section 3.3).

    Raises:
        InputError: If the target moves while the joints stand still, which is a matter of the clocks.
    """
    parts = []
    for still in stills:
        inside = (stream.times >= still.start + settle) & (stream.times <= still.end - settle)
        positions = stream.positions[inside]
        near = np.ones(len(positions), dtype=bool)
        if len(positions) >= _LEAST_SAMPLES:
            distance = np.linalg.norm(positions - np.median(positions, axis=0), axis=1)
            near = distance <= max(_FAR * float(np.median(distance)), _NEAR)
        parts.append((positions[near], None if stream.quaternions is None else stream.quaternions[inside][near], ~near))
    _refuse_motion(stills, stream, parts)
    slow = _correlation_time([part for part, _, _ in parts if len(part) >= _LEAST_SAMPLES])
    return tuple(_mean(part, turns, int(far.sum()), slow) for part, turns, far in parts)


def _refuse_motion(
    stills: Sequence[Standstill], stream: TargetStream, parts: Sequence[tuple[Array, Array | None, NDArray[np.bool_]]]
) -> None:
    whole = [number for number, (part, _, _) in enumerate(parts) if len(part) >= _LEAST_SAMPLES]
    if not whole:
        raise InputError(
            "nothing was seen of a target while the robot stood still",
            where=f"topic {stream.topic}",
            came=f"{max((len(part) for part, _, _ in parts), default=0)} samples at most in a standstill",
            allowed=f"{_LEAST_SAMPLES} and more in each",
            cure="Wait longer at each configuration. If the clocks of the two topics differ, take the recorder's "
            "times: `times=bag`.",
        )
    centres = np.array([np.median(parts[number][0], axis=0) for number in whole])
    moves = float(np.median(np.linalg.norm(np.diff(centres, axis=0), axis=1))) if len(whole) > 1 else 0.0
    for number in whole:
        part, _, far = parts[number]
        scatter = float(np.linalg.norm(part.std(axis=0)))
        inner = np.flatnonzero(~far)
        at_ends = 1.0 - (inner[-1] - inner[0] + 1) / len(far)
        moved = at_ends > max(_MOVED, 1.5 / len(far)) or (moves > _STANDS and scatter > _MOVES * moves)
        if not moved and float(far.mean()) <= max(_SET_ASIDE, 1.5 / len(far)):
            continue
        place = (
            f"topic {stream.topic}, standstill {number + 1}, {stills[number].start:.2f} s to "
            f"{stills[number].end:.2f} s after the first message of the joints"
        )
        outlying = f"{100 * far.mean():.0f} % of the samples far from the others, which are scattered by "
        outlying += f"{1e3 * scatter:.3g} mm"
        if not moved:
            raise InputError(
                "too many samples of a standstill are outlying",
                where=place,
                came=outlying,
                allowed=f"{100 * _SET_ASIDE:.0f} %",
                cure="See what the instrument took for the target, and record that configuration again.",
            )
        raise InputError(
            "the target moves while the joints stand still",
            parameter="times",
            where=place,
            came=outlying,
            cure="If the clocks of the two topics differ, take the recorder's times: `times=bag`. If the arm "
            "still shakes, leave out more of each standstill (`settle`). Record it again if somebody "
            "touched the target.",
        )


def _correlation_time(parts: Sequence[Array]) -> float:
    """Return how many samples in a row count as one, 1 or more."""
    longest = min(len(part) for part in parts) // 2
    sums = np.zeros(longest + 1)
    for part in parts:
        off = part - part.mean(axis=0)
        sums += [float((off[lag:] * off[: len(off) - lag]).sum()) / len(off) for lag in range(longest + 1)]
    if sums[0] <= 0.0:
        return 1.0
    positive = 1.0
    for lag in range(1, longest + 1):
        if sums[lag] <= 0.0:
            break
        positive += 2.0 * sums[lag] / sums[0]
    return positive


def _mean(part: Array, turns: Array | None, set_aside: int, slow: float) -> Sighting:
    n = len(part)
    if n < _LEAST_SAMPLES:
        nothing = None if turns is None else np.full(4, np.nan)
        return Sighting(
            np.full(3, np.nan), nothing, n, set_aside, math.nan, math.nan, None if turns is None else math.nan
        )
    scatter = float(np.sqrt(part.var(axis=0, ddof=1).mean()))
    independent = max(n / slow, 1.0)
    quaternion = sigma_rot = None
    if turns is not None:
        from scipy.spatial.transform import Rotation

        R = Rotation.from_quat(turns[:, [1, 2, 3, 0]])
        mean = R.mean()
        off = (R * mean.inv()).as_rotvec()
        quaternion = mean.as_quat(canonical=True)[[3, 0, 1, 2]]
        sigma_rot = float(np.sqrt((off**2).sum() / (3 * (n - 1)) / independent))
    sigma = scatter / math.sqrt(independent)
    return Sighting(part.mean(axis=0), quaternion, n, set_aside, scatter, sigma, sigma_rot)


#: A smaller deviation is none: all samples are the same [m or rad].
_EXACT: Final = 1e-8


@dataclass(frozen=True, eq=False)
class Recording:
    """What was found in a bag."""

    joints: JointStream  #: joints, targets: its topics.
    targets: tuple[TargetStream, ...]
    standstills: tuple[Standstill, ...]  #: In order, one a configuration.
    missed: tuple[float, ...]  #: When the robot paused, or may have, without a standstill that can be used [s].
    lost: int  #: How many messages of the joints are missing between others.
    sightings: tuple[tuple[Sighting, ...], ...]  #: Of each target in each standstill.
    data: Dataset  #: The measurements.

    @property
    def declares_sigma(self) -> bool:
        """Whether the scatter at standstill could be told everywhere, so that the readings have deviations."""
        return self.data.sigma is not None


def found_in(
    bag: Path,
    joints: JointStream,
    targets: Sequence[TargetStream],
    *,
    references: Collection[str],
    prismatic: Collection[str],
    joints_are: JointsOf,
    still: float,
    hold: float,
    settle: float,
) -> Recording:
    """Return the standstills of a bag as measurements, numbered in the order of measurement.

    A pause that is no standstill takes a number too: where the robot came from is not known after it.

    Args:
        bag: The file, for messages.
        joints, targets: Its topics.
        references: Which targets stand beside the robot.
        prismatic: Which joints slide.
        joints_are: Whose joint positions they are.
        still, hold, settle: See :func:`~truearm.bags.standstills.find_standstills` and
            :func:`~truearm.bags.standstills.seen_at`.
    """
    stills = find_standstills(joints, still, hold)
    missed = missed_pauses(joints, stills)
    if len(missed) > len(stills):
        raise InputError(
            "most pauses of the robot are no standstills",
            parameter="shortest_dwell",
            where=f"{bag}, topic {joints.topic}",
            came=f"{counted(len(stills), 'standstill')} and {counted(len(missed), 'other pause')}, at "
            f"{listed([f'{at:.1f} s' for at in missed])}",
            cure="They are shorter than `shortest_dwell`, a joint moves more than `still` in them, or the joints were "
            "not recorded. Allow more if these were the stops, or wait longer.",
        )
    sightings = tuple(seen_at(stills, target, settle) for target in targets)
    rows = [
        (place, target, row[place])
        for place in range(len(stills))
        for target, row in zip(targets, sightings, strict=True)
    ]
    seen = [sighting for _, _, sighting in rows]
    exact = any(sighting.sigma < _EXACT or (sighting.sigma_rot or _EXACT) < _EXACT for sighting in seen)
    turned = any(sighting.quaternion is not None for sighting in seen)
    nothing = np.full(4, np.nan)
    readings = Readings(
        source=str(bag),
        lines=range(1, len(rows) + 1),
        configuration=np.array([place for place, _, _ in rows], dtype=np.intp),
        targets=[target.target for _, target, _ in rows],
        reference=np.array([target.target in references for _, target, _ in rows]),
        position=np.array([sighting.position for sighting in seen]),
        quaternion=np.array([nothing if sighting.quaternion is None else sighting.quaternion for sighting in seen])
        if turned
        else None,
        sigma=None if exact else np.array([sighting.sigma for sighting in seen]),
        sigma_rot=np.array([np.nan if sighting.sigma_rot is None else sighting.sigma_rot for sighting in seen])
        if turned and not exact
        else None,
    )
    kinds = tuple("prismatic" if name in prismatic else "revolute" for name in joints.names)
    labels = tuple(str(n + sum(at < s.start for at in missed)) for n, s in enumerate(stills, 1))
    positions = np.array([still.joints for still in stills])
    data = dataset_of(readings, Configurations(labels, positions, kinds, readings.configuration, joints_are))
    return Recording(joints, tuple(targets), stills, missed, lost_messages(joints), sightings, data)
