"""Where on the commanded path the tip was at each sample: found from the geometry, without a trigger."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.validation.iso9283.clock import Clock
from truearm.validation.iso9283.commanded import CommandedPath

#: Samples and places of the path that are compared with each other.
_SAMPLES, _PLACES = 500, 400
#: Farther from the path than this share of its extent, in the middle of all samples, it is another path.
_FAR = 0.2
#: The tip is not faster than so many times the command, and where it is slower than this share, times are in another
#: unit.
_FASTER, _SLOWEST = 2.0, 0.02
#: The middle half of a path is cut into so many stretches, and the tip's pace is that in the middle of theirs.
_STRETCHES = 10
#: From so little of the path a cycle cannot be judged.
_LEAST_RUN = 0.8


@dataclass(frozen=True, eq=False)
class Cycle:
    """A cycle whose samples are tied to the commanded path.

    Attributes
    ----------
    number
        Of the cycle.
    time
        [s], ``(n,)``.
    position
        In the base frame [m], ``(n, 3)``.
    rotation
        ``(n, 3, 3)``; None where there are no orientations.
    along
        Arc length of the foot of each sample on the commanded path [m], ``(n,)``. It swings with the noise.
    lines
        Of the samples in the file, ``(n,)``.
    clock
        That of the record in which the cycle is.
    """

    number: int
    time: Array
    position: Array
    rotation: Array | None
    along: Array
    lines: NDArray[np.intp]
    clock: Clock

    @property
    def line(self) -> int:
        """Of the first sample in the file."""
        return int(self.lines[0])


def along_path(path: CommandedPath, position: Array, where: str) -> Array:
    """Return the arc length of the foot of each sample on the commanded path [m], ``(n,)``.

    The samples of a cycle are matched with places of the path so that the sum of squared distances is least and no
    later sample lies before an earlier one (dynamic programming, as in dynamic time warping: Sakoe and Chiba 1978).
    That tells the begin of a closed path from its end, and one passing of a crossing from the other. The foot of each
    sample is then sought near its match.

    Parameters
    ----------
    position
        Samples of one cycle in the base frame [m], ``(n, 3)``, in the order of time.
    where
        File and lines, for the refusal.

    Raises
    ------
    InputError
        If the samples do not come near the path, or run only a part of it, or run it in the other direction.
    """
    chosen = np.unique(np.linspace(0, len(position) - 1, min(_SAMPLES, len(position))).round().astype(np.intp))
    places = np.linspace(0.0, path.length, _PLACES)
    points = path.points(places)
    few = position[chosen]
    cost = (few**2).sum(axis=1)[:, None] - 2 * few @ points.T + (points**2).sum(axis=1)
    match = _monotone(cost)
    distance = np.sqrt(np.maximum(cost[np.arange(len(chosen)), match], 0.0))
    _refuse_far(path, few, distance, where)
    near = np.interp(np.arange(len(position)), chosen, places[match])
    step = float(np.abs(np.diff(near)).max(initial=0.0))
    along = path.feet(position, near, 0.02 * path.length + 2 * step)
    low, high = np.quantile(along, [0.001, 0.999])
    if high - low < _LEAST_RUN * path.length:
        raise InputError(
            f"the samples run only a part of the path {path.path.name}",
            where=where,
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


def refuse_other_times(path: CommandedPath, time: Array, along: Array, velocity: float, where: str) -> None:
    """Refuse a cycle that is run so fast or so slowly that its times are not seconds, or it is another's.

    A robot is not faster than commanded, and may be slower where joints come to their limits.

    Parameters
    ----------
    time, along
        Of the samples [s], and the arc lengths of their feet [m], ``(n,)``.
    velocity
        Commanded [m/s].
    where
        File and lines.

    Raises
    ------
    InputError
        If the pace is above twice the commanded velocity, or below a fiftieth of it.
    """
    pace = pace_along(path, time, along)
    if _SLOWEST * velocity <= pace <= _FASTER * velocity:
        return
    raise InputError(
        f"the path {path.path.name} was run much {'faster' if pace > velocity else 'slower'} than commanded",
        where=where,
        came=f"{1e3 * pace:.4g} mm/s in the middle half",
        allowed=f"{1e3 * _SLOWEST * velocity:.4g} to {1e3 * _FASTER * velocity:.4g} mm/s; commanded are "
        f"{1e3 * velocity:.4g}",
        cure="Write the times in seconds, and check the column velocity [%] and the rated velocity of the plan.",
    )


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


def _refuse_far(path: CommandedPath, few: Array, distance: Array, where: str) -> None:
    allowed = _FAR * path.extent + path.path.stroke / 2
    if np.median(distance) <= allowed:
        return
    dense = path.points(np.linspace(0.0, path.length, _PLACES))
    least = np.sqrt(((few[:, None] - dense[None]) ** 2).sum(axis=2)).min(axis=1)
    reverse = bool(np.median(least) <= allowed)
    raise InputError(
        f"the samples run the path {path.path.name} in another direction or order"
        if reverse
        else f"the samples never come near the path {path.path.name}",
        where=where,
        came=f"{1e3 * float(np.median(distance if reverse else least)):.1f} mm from it, half of the samples further",
        allowed=f"{1e3 * allowed:.1f} mm",
        cure="Run it as the plan says."
        if reverse
        else "Check the name of the path, the unit, and how the instrument is tied to the robot's base.",
    )
