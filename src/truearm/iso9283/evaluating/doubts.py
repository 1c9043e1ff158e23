"""Doubts about records: read at another place, for another cube, or samples that lie apart from those about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.poses import PoseCloud
from truearm.iso9283.criteria.runs import scatter_of
from truearm.iso9283.criteria.settling import SettlingCurve
from truearm.iso9283.planning.criteria import PerformancePlan
from truearm.iso9283.planning.records import Pushes

#: A tip may rest beside its command by this share of the cube's side, and in small cubes by this length [m].
_BESIDE: Final = 0.1
_LEAST_BESIDE: Final = 20e-3
#: The way to a pose may differ from the planned one by this length [m], and this share of it.
_OTHER_WAY: Final = 2e-3
_OTHER_SHARE: Final = 0.1
#: The ends of a record of which the mean is taken.
_END: Final = 5


def refuse_other_rests(plan: PerformancePlan, curves: Sequence[SettlingCurve], source: str) -> None:
    """Refuse records whose tip rests at another place than their pose, or made another way than the planned one.

    Raises:
        InputError: Naming the lines of the record.
    """
    for curve in curves:
        planned = plan.test(curve.test)
        assert planned is not None
        names = tuple(dict.fromkeys((*planned.places, *planned.approaches)))
        first = planned.places[0]
        name = curve.where.removeprefix(f"{first}-")
        place = f"{source}, lines {curve.lines[0]} to {curve.lines[-1]}"
        end = curve.position[-_END:].mean(axis=0)
        own = float(np.linalg.norm(end - plan.poses[name].position))
        apart = {other: float(np.linalg.norm(end - plan.poses[other].position)) for other in names}
        near = min(apart, key=lambda other: apart[other])
        if own > _allowed(plan):
            beside = f", {1e3 * apart[near]:.4g} mm from {near}" if near != name else ""
            raise InputError(
                f"the tip comes to rest at another place than {name} in cycle {curve.cycle} of {curve.test}",
                where=place,
                came=f"{1e3 * own:.4g} mm from {name}{beside}",
                allowed=f"up to {1e3 * _allowed(plan):.4g} mm",
                cure="Correct the name in the column pose, check the unit, and how the instrument is tied to the "
                "robot's base.",
            )
        if curve.test != "posing-time" or name == first:
            continue
        way = float(np.linalg.norm(plan.poses[name].position - plan.poses[first].position))
        travelled = float(np.linalg.norm(end - curve.position[:_END].mean(axis=0)))
        if abs(travelled - way) > _OTHER_WAY + _OTHER_SHARE * way:
            raise InputError(
                f"the way to {name} in cycle {curve.cycle} of {curve.test} is not the planned one",
                where=place,
                came=f"{1e3 * travelled:.4g} mm",
                allowed=f"{1e3 * way:.4g} mm within {1e3 * (_OTHER_WAY + _OTHER_SHARE * way):.3g} mm",
                cure=f"Record from rest in {first} on, and check the name in the column pose.",
            )


def refuse_other_push_place(plan: PerformancePlan, pushes: Pushes, position: Array) -> None:
    """Refuse pushes whose tip is not at the pose of the test where the force is least.

    Args:
        position: Of the pushes in the base frame [m], ``(n, 3)``.

    Raises:
        InputError: Naming the line.
    """
    test = plan.test("compliance")
    if test is None:
        return
    name = test.places[0]
    for direction in pushes.direction.names:
        rows = np.flatnonzero(pushes.direction.are(direction))
        for cycle in np.unique(pushes.cycle[rows]).tolist():
            rows_of_cycle = rows[pushes.cycle[rows] == cycle]
            row = int(rows_of_cycle[pushes.force[rows_of_cycle].argmin()])
            away = float(np.linalg.norm(position[row] - plan.poses[name].position))
            if away > _allowed(plan):
                raise InputError(
                    f"the tip is not at {name} where it is pushed least in cycle {cycle} of the direction {direction}",
                    where=f"{pushes.source}, line {int(pushes.line[row])}",
                    came=f"{1e3 * away:.4g} mm from it",
                    allowed=f"up to {1e3 * _allowed(plan):.4g} mm",
                    cure="Check the unit of this file, and that it was read with the instrument where it stood for the "
                    "others.",
                )


def _allowed(plan: PerformancePlan) -> float:
    return max(_BESIDE * plan.cube.side, _LEAST_BESIDE)


#: No robot makes all distances larger or smaller by this share.
_SCALE: Final = 0.01
#: Nor does it bring all poses this share of the cube's side aside; a tie to the base may.
_ASIDE: Final = 0.05
#: What another size and place of the cube leave of the errors, at most.
_LEFT: Final = 0.2


@dataclass(frozen=True)
class OtherCube:
    """How a cube lies that explains where the poses of a test are."""

    test: str  #: Its id.
    scale: float  #: So many times as large as the planned one.
    aside: float  #: How far its middle is from where the planned one has it [m].


def other_cube(clouds: tuple[PoseCloud, ...], side: float) -> OtherCube | None:
    """Return the cube that explains errors of poses which no robot has; None where there is none.

    Args:
        clouds: Attained poses.
        side: Of the planned cube [m].
    """
    groups: dict[tuple[object, ...], list[PoseCloud]] = {}
    for cloud in clouds:
        key = cloud.test, cloud.robot, cloud.approach, cloud.velocity, cloud.load
        groups.setdefault(key, []).append(cloud)
    for (test, *_), members in groups.items():
        if len(members) < 2:
            continue
        commanded, attained = (
            np.array([getattr(member, name) for member in members]) for name in ("command", "barycentre")
        )
        explanation = _explained(commanded, attained - commanded, side)
        if explanation is not None:
            return OtherCube(str(test), *explanation)
    return None


def _explained(commanded: Array, error: Array, side: float) -> tuple[float, float] | None:
    """Return scale and shift that explain errors ``(k, 3)`` of poses, two or more, beside a turn of the frame.

    Two poses have a distance alone, which tells the scale.
    """
    out = commanded - commanded.mean(axis=0)
    shift = error.mean(axis=0)
    moved = error - shift
    if len(out) > 2:
        turns = np.stack([np.cross(axis, out).ravel() for axis in np.eye(3)], axis=1)
        moved = moved - (turns @ np.linalg.lstsq(turns, moved.ravel(), rcond=None)[0]).reshape(-1, 3)
    scale = float((moved * out).sum() / (out**2).sum())
    left = np.linalg.norm(moved - scale * out) if len(out) > 2 else 0.0
    aside = float(np.linalg.norm(shift))
    larger = abs(scale) > _SCALE and left <= _LEFT * abs(scale) * np.linalg.norm(out)
    beside = aside > _ASIDE * side and left <= _LEFT * aside * np.sqrt(len(out))
    return (1.0 + scale, aside) if larger or beside else None


#: A sample is unusual if it lies so many times further from what the samples about it say than is usual in a cycle
#: there, and so many standard deviations of noise further.
_TIMES, _NOISE = 4.0, 7.0
#: With what is the same in all cycles taken away it is besides so many times further than is usual with it.
_OF_WHOLE = 3.0
#: Of so few cycles not each may have a sample in a corner: there it is besides further than this share of how much the
#: steps before and behind it differ, of which a sharp corner makes a quarter.
_FEW, _OF_TURN = 5, 0.3
#: What is usual there is seen in stretches of so many samples, and of so much of the way at least.
_STRETCH, _LEAST_STRETCH = 3.0, 0.0025
#: Beside a longer gap than this many usual steps, samples say too little of one another.
_GAP = 1.6
#: Fewer cycles do not show what is usual.
_LEAST_CYCLES = 3
#: The place jumps by a step so many times as long as the usual one of so many before and behind it, and by so many
#: standard deviations of noise besides.
_JUMP, _ABOUT, _OF_STEP = 1.8, 4, 6.0
#: What is the same in all cycles is seen at so many places at most.
_GRID = 4000
#: Of samples so near to each other the one that lies furthest apart is named.
_NEAR = 3


@dataclass(frozen=True)
class Unusual:
    """A sample that lies apart."""

    cycle: int  #: cycle, sample: which, from 0.
    sample: int
    distance: float  #: From where the two samples before and the two behind it say that it should be [m].


def unusual_samples(
    times: Sequence[Array], positions: Sequence[Array], places: Sequence[Array], rounding: float = 0.0
) -> list[Unusual]:
    """Return samples that lie apart from those about them, as none does there in half of the cycles.

    Each sample is compared with a cubic through the two before it and the two behind it: as it is, and with what is the
    same in all cycles taken away. Where the tip turns a corner or begins to move that is off in every cycle, and
    nothing is unusual.

    Args:
        times, positions: Of each cycle [s], ``(n,)``, and [m], ``(n, 3)``.
        places: What tells where in the cycle a sample is, such as the arc length of its foot, ``(n,)`` each.
        rounding: What rounding in the file leaves open of each coordinate, as a standard deviation [m]: the noise is no
            less.
    """
    if len(times) < _LEAST_CYCLES:
        return []
    low, high = min(float(place.min()) for place in places), max(float(place.max()) for place in places)
    if high <= low:
        return []
    stretches = _stretches(places, low, high)
    noise = max(float(np.median([scatter_of(position) for position in positions])), rounding)
    away, usual = _apart_in_all(times, positions, stretches)
    less, compared = _without_common(positions, places, low, high, noise)
    other, usual_of_other = _apart_in_all(times, less, stretches, compared)
    beyond = [
        distance > np.maximum(_TIMES * usual_distance, usual_distance + _NOISE * noise)
        for distance, usual_distance in zip(away, usual, strict=True)
    ]
    for cycle, (far, level) in enumerate(zip(other, usual_of_other, strict=True)):
        least = np.maximum(_TIMES * level, level + _NOISE * noise)
        beyond[cycle] |= far > np.maximum(least, _OF_WHOLE * usual[cycle])
        if len(positions) < _FEW:
            beyond[cycle] &= np.maximum(away[cycle], far) > _OF_TURN * _turns(positions[cycle])
    unusual = []
    for cycle, rows in enumerate(np.flatnonzero(mask) for mask in beyond):
        if not len(rows):
            continue
        size = np.maximum(away[cycle], other[cycle])
        for group in np.split(rows, np.flatnonzero(np.diff(rows) > _NEAR) + 1):
            worst = int(group[size[group].argmax()])
            unusual.append(Unusual(cycle, worst, float(size[worst])))
    return unusual


def _stretches(places: Sequence[Array], low: float, high: float) -> list[NDArray[np.intp]]:
    """Return in which stretch of the way each sample is, from 1, ``(n,)`` of each cycle."""
    steps = np.concatenate([np.abs(np.diff(place)) for place in places])
    moving = steps[steps > 0.1 * (high - low) / max(map(len, places))]
    width = max(_STRETCH * float(np.median(moving)) if len(moving) else 0.0, _LEAST_STRETCH * (high - low))
    return [1 + ((place - low) / width).astype(np.intp) for place in places]


def _apart_in_all(
    times: Sequence[Array],
    values: Sequence[Array],
    stretches: Sequence[NDArray[np.intp]],
    compared: Sequence[NDArray[np.bool_]] | None = None,
) -> tuple[list[Array], list[Array]]:
    """Return how far each sample is apart, and what half of the cycles do not exceed there, ``(n,)`` of each cycle.

    Those that are not `compared` are not apart.
    """
    away = [_apart(time, value) for time, value in zip(times, values, strict=True)]
    if compared is not None:
        away = [np.where(counted, far, 0.0) for counted, far in zip(compared, away, strict=True)]
    most = np.zeros((len(times), 2 + max(int(stretch.max()) for stretch in stretches)))
    for cycle, stretch in enumerate(stretches):
        np.maximum.at(most[cycle], stretch, away[cycle])
    usual = np.zeros(most.shape[1])
    usual[1:-1] = np.median(np.maximum(np.maximum(most[:, :-2], most[:, 2:]), most[:, 1:-1]), axis=0)
    return away, [usual[stretch] for stretch in stretches]


def _without_common(
    positions: Sequence[Array], places: Sequence[Array], low: float, high: float, noise: float
) -> tuple[list[Array], list[NDArray[np.bool_]]]:
    """Return positions less what half of the cycles have at the same place, ``(n, 3)``, and where that says something.

    Where the place jumps, as that of the foot does when the tip passes the bisector of a corner on an arc, what is
    common to the cycles is not known: a sample tells nothing from which the cubic of its neighbours passes a jump of
    any cycle.
    """
    grid = np.linspace(low, high, int(np.clip(2 * max(map(len, places)), 100, _GRID)))
    drawn = []
    for position, place in zip(positions, places, strict=True):
        order = np.argsort(place, kind="stable")
        drawn.append([np.interp(grid, place[order], position[order, axis]) for axis in range(3)])
    common = np.median(np.array(drawn), axis=0)
    jumps = np.concatenate([_jumps(place, noise) for place in places])
    compared = [_beside(place, jumps) for place in places]
    less = [
        position - np.column_stack([np.interp(place, grid, common[axis]) for axis in range(3)])
        for position, place in zip(positions, places, strict=True)
    ]
    return less, compared


def _jumps(place: Array, noise: float) -> Array:
    """Return between which places a step along the way is much longer than those about it, ``(k, 2)``."""
    steps = np.abs(np.diff(place))
    if len(steps) <= 2 * _ABOUT:
        return np.empty((0, 2))
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(steps, _ABOUT, mode="edge"), 2 * _ABOUT + 1)
    usual = np.maximum(np.median(windows, axis=1), 0.1 * float(np.quantile(steps, 0.9)))
    long = np.flatnonzero(steps > _JUMP * usual + _OF_STEP * noise)
    return np.sort(np.column_stack([place[long], place[long + 1]]), axis=1)


def _beside(place: Array, jumps: Array) -> NDArray[np.bool_]:
    """Return which samples have neighbours none of which lies in a jump, or behind one, ``(n,)``."""
    if not len(jumps):
        return np.ones(len(place), dtype=bool)
    # how many jumps begin before each sample, and how many end: in a jump there are more of the former
    begun, ended = (np.searchsorted(np.sort(jumps[:, k]), place, side="right") for k in (0, 1))
    first = np.searchsorted(np.sort(jumps[:, 0]), place, side="left")
    inside = first > ended
    near = np.pad(inside, 2)
    n = len(place)
    beside = np.any([near[k : k + n] for k in range(5)], axis=0)
    far = np.pad(begun + ended, 2, mode="edge")
    passed = np.ptp(np.array([far[k : k + n] for k in range(5)]), axis=0) > 0
    return np.asarray(~(beside | passed))


def _turns(position: Array) -> Array:
    """Return by how much the last step before the neighbours of a sample and the first behind them differ, ``(n,)``."""
    turns = np.zeros(len(position))
    step = np.diff(position, axis=0)
    turns[3:-3] = np.linalg.norm(step[5:] - step[:-5], axis=1)
    return turns


def _apart(time: Array, position: Array) -> Array:
    """Return how far each sample is from a cubic through its neighbours, over what noise makes of it, ``(n,)``.

    0 beside a gap, and of the two first and last samples.
    """
    n = len(time)
    away = np.zeros(n)
    if n < 8:
        return away
    step = np.diff(time)
    near = step <= _GAP * float(np.median(step))
    rows = 2 + np.flatnonzero(near[:-3] & near[1:-2] & near[2:-1] & near[3:])
    at = [time[rows + k] - time[rows] for k in (-2, -1, 1, 2)]
    expected, gain = np.zeros((len(rows), 3)), np.ones(len(rows))
    for k, shift in enumerate((-2, -1, 1, 2)):
        weight = np.ones(len(rows))
        for j in range(4):
            if j != k:
                weight *= at[j] / (at[j] - at[k])
        expected += weight[:, None] * position[rows + shift]
        gain += weight**2
    away[rows] = np.linalg.norm(position[rows] - expected, axis=1) / np.sqrt(gain)
    return away
