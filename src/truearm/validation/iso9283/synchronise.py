"""Where on the commanded path the tip was at each sample: found from the geometry, without a trigger."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.validation.iso9283.commanded import CommandedPath

#: Samples and places of the path that are compared with each other.
_SAMPLES, _PLACES = 500, 400
#: Farther from the path than this share of its extent, in the middle of all samples, it is another path.
_FAR = 0.2
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
    line
        Of the first sample in the file.
    """

    number: int
    time: Array
    position: Array
    rotation: Array | None
    along: Array
    line: int


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
