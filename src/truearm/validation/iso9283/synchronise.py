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


def along_path(path: CommandedPath, position: Array, where: str) -> Array:
    """Return the arc length of the foot of each sample on the commanded path [m], ``(n,)``.

    The samples of a cycle are matched with places of the path so that the sum of squared distances is least and no
    later sample lies before an earlier one (dynamic programming, as in dynamic time warping: Sakoe and Chiba 1978).
    That tells the begin of a closed path from its end, and one passing of a crossing from the other. The foot of each
    sample is then sought near its match.

    Args:
        position: Samples of one cycle in the base frame [m], ``(n, 3)``, in the order of time.
        where: File and lines, for the refusal.

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
    _refuse_other_path(path, few[moving], points, float(np.median(distance[moving])), where)
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

    Args:
        time, along: Of the samples [s], and the arc lengths of their feet [m], ``(n,)``.
        velocity: Commanded [m/s].
        where: File and lines.

    Raises:
        InputError: If the pace is above twice the commanded velocity, or below a fiftieth of it.
    """
    pace = pace_along(path, time, along)
    if _SLOWEST * velocity <= pace <= _FASTER * velocity:
        return
    raise InputError(
        f"the path {path.path.name} was run much {'faster' if pace > velocity else 'slower'} than commanded",
        where=where,
        came=f"{_apart(pace, _FASTER * velocity if pace > velocity else _SLOWEST * velocity)[0]} mm/s in the middle "
        "half",
        allowed=f"{1e3 * _SLOWEST * velocity:.4g} to {1e3 * _FASTER * velocity:.4g} mm/s; commanded are "
        f"{1e3 * velocity:.4g}",
        cure="Name the unit of the times in the header (s, ms, us), and check the column velocity [%] and the rated "
        "velocity of the plan.",
    )


def _moving(few: Array, step: float) -> NDArray[np.intp]:
    """Return samples of which each is at least `step` from the one before it [m]."""
    kept = [0]
    for k, apart in enumerate(np.linalg.norm(np.diff(few, axis=0), axis=1).tolist(), 1):
        if apart >= step or np.linalg.norm(few[k] - few[kept[-1]]) >= step:
            kept.append(k)
    return np.array(kept, dtype=np.intp)


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


def _refuse_other_path(path: CommandedPath, few: Array, points: Array, distance: float, where: str) -> None:
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
            where=where,
            cure="Run it in the direction of the plan.",
        )
    if distance <= allowed:
        return
    beside, most = float(np.linalg.norm(offset)), _BESIDE * path.extent
    if ahead <= allowed and beside <= most:
        return
    if ahead <= allowed and beside <= path.extent:
        came, most_came = _apart(beside, most)
        raise InputError(
            f"the samples run the path {path.path.name} too far beside it for planes through it to tell anything",
            where=where,
            came=f"{came} mm beside it as a whole",
            allowed=f"{most_came} mm",
            cure="Check how the instrument is tied to the robot's base; or plan in a larger cube.",
        )
    least = float(np.median(np.sqrt(((few[:, None] - points[None]) ** 2).sum(axis=2)).min(axis=1)))
    other_order = least <= allowed
    came, most_came = _apart(distance if other_order else max(least, allowed), allowed)
    raise InputError(
        f"the samples run the path {path.path.name} in another order"
        if other_order
        else f"the samples never come near the path {path.path.name}",
        where=where,
        came=f"{came} mm from it, half of the samples further",
        allowed=f"{most_came} mm",
        cure="Run it as the plan says."
        if other_order
        else "Check the name of the path, the unit, and how the instrument is tied to the robot's base.",
    )


def _apart(came: float, allowed: float) -> tuple[str, str]:
    """Return two lengths in mm, or velocities in mm/s, with as many decimals as it takes to see that they differ."""
    for decimals in range(1, 7):
        both = f"{1e3 * came:.{decimals}f}", f"{1e3 * allowed:.{decimals}f}"
        if both[0] != both[1]:
            break
    return both
