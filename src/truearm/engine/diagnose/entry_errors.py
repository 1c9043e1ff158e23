"""Data-entry errors with units, signs, orders and axes, tried one by one on data that the robot does not fit.

The nominal robot is placed by the closed form. Where that fails badly, the same data are tried as they would be with
one data-entry error corrected; the simplest data-entry error that makes them fit several times better is what happened.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Notice, Rule
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.data.rigid_tool import FARTHEST, LENGTH_FACTORS, UNIT_LENGTH, factors_of, lengths_noticed
from truearm.engine.data.statistics import Errors, errors_of
from truearm.engine.diagnose.entry_error_trials import (
    EntryError,
    angle_entry_errors,
    as_noted,
    controller_entry_errors,
    count_entry_errors,
    length_entry_errors,
    mirrored,
    mixed_angle_entry_errors,
    order_entry_errors,
    orientation_entry_errors,
    pose_entry_errors,
    scale_entry_errors,
    shifted,
    sign_entry_errors,
)
from truearm.engine.fit.frames import initial_frames, placed_errors
from truearm.engine.fit.models import named_model
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.start_values import centres_of, start_from_readings
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

# Single rows or blocks of positions in another unit of length, tried before any fit.
#
# Rows in another unit pull a placement by all of them away. Sorted by how far from the instrument they were read, such
# rows are the first or the last ones. So the robot is placed by each half of this order and by its middle, in each
# unit, and that part counts from which most positions follow, in one unit or another.

#: Configurations that the robot is placed by at least, and among how many at most.
_FEWEST_PLACED: Final = 4
_MOST_PLACED: Final = 60
#: What makes positions right, in the unit that they came in first.
_UNITS: Final = (1.0, *(by for by, _ in LENGTH_FACTORS))
#: A position may be so many times as far off the placed nominal robot as half of all are.
_ALLOWED: Final = 20.0
#: Positions follow the robot where half of them are off by less than this share of how far half of those that it
#: predicts lie from their middle. Positions that are made so small that they are one point follow none.
_FOLLOWS: Final = 0.1
#: How often the robot is placed anew by all that it explains.
_ROUNDS: Final = 2


def mixed_length_entry_errors(robot: Robot, data: Dataset) -> Iterator[EntryError]:
    """Try another unit of length of those positions that it explains, where it explains no whole target.

    Args:
        robot: At the origin, with no targets.
    """
    some = data
    if data.configurations > _MOST_PLACED:
        some = data.of_configurations(np.linspace(0, data.configurations - 1, _MOST_PLACED).astype(np.intp))
    placed = _placed(robot, some)
    if placed is None:
        return
    predicted = _predicted(placed, data)
    factor = factors_of(data.position, predicted, _allowed(data, predicted))
    for t in range(len(data.targets)):
        of_target = (data.target == t) & data.has_position
        if len(np.unique(factor[of_target])) == 1:  # the unit of the target, not of rows
            factor[of_target] = 1.0
    if (factor == 1.0).all():
        return
    words, at = lengths_noticed(data, factor)
    yield EntryError(UNIT_LENGTH, words, replace(data, position=data.position * factor[:, None]), at)


def _placed(robot: Robot, data: Dataset) -> Robot | None:
    """Return the robot placed by the part of the data from which most positions follow; None without one."""
    read = np.flatnonzero(data.has_position)
    far = np.linalg.norm(data.position[read], axis=1)
    measured = np.unique(data.configuration[read])
    order = measured[np.argsort([np.median(far[data.configuration[read] == c]) for c in measured], kind="stable")]
    n = len(order)
    best, least = None, _FOLLOWS
    for part in (order[: n // 2], order[n - n // 2 :], order[n // 4 : n - n // 4]):
        if len(part) < _FEWEST_PLACED:
            return None
        readings = data.of_readings(data.has_position & np.isin(data.configuration, part))
        farthest = float(np.abs(readings.position).max())
        for by in (by for by in _UNITS if by * farthest <= FARTHEST or by <= 1.0):
            placed = initial_frames(robot, replace(readings, position=by * readings.position))
            predicted = _predicted(placed, data)[read]
            apart = np.nanmedian(np.linalg.norm(predicted - np.nanmedian(predicted, axis=0), axis=1))
            share = float(np.median(_gaps(data.position[read], predicted)) / apart) if apart > 0.0 else np.inf
            if share < least:
                best, least = placed, share
    if best is None:
        return None
    for _ in range(_ROUNDS):
        predicted = _predicted(best, data)
        factor = factors_of(data.position, predicted, _allowed(data, predicted))
        corrected = replace(data, position=data.position * factor[:, None])
        near = np.linalg.norm(corrected.position - predicted, axis=1) <= _allowed(data, predicted)
        best = initial_frames(robot, corrected.of_readings(near & data.has_position))
    return best


def _predicted(placed: Robot, data: Dataset) -> Array:
    """Return where the placed robot has the target of each reading [m], ``(readings, 3)``; NaN if it has none."""
    predicted = np.full(data.position.shape, np.nan)
    for target in placed.targets:
        of_target = data.target == data.targets.index(target.name)
        predicted[of_target] = placed.world_poses(data.postures, target.name)[0][data.configuration[of_target]]
    return predicted


def _gaps(position: Array, predicted: Array) -> Array:
    """Return how far off positions are in the unit that explains them best [m], ``(readings,)``."""
    gaps = [np.linalg.norm(by * position - predicted, axis=1) for by in _UNITS]
    return np.asarray(np.nan_to_num(np.min(gaps, axis=0), nan=np.inf))


def _allowed(data: Dataset, predicted: Array) -> float:
    read = data.has_position
    return _ALLOWED * float(np.median(_gaps(data.position[read], predicted[read])))


# How well a robot fits distances from points nobody measured, without a fit of the robot: quick enough to try many.
#
# The place t of the target on the flange and the centres c are the only unknowns of ``|p_i + R_i t - c_f| = d_i``.
# Places on a coarse grid around the flange, each with its centres in closed form, are starts; Levenberg's steps go on
# from the best few of them at once.

#: How far from the flange a target is looked for, and in what steps [m].
_REACH: Final = 0.45
_STEP: Final = 0.15
#: Places that are gone on from, and steps.
_MOST_PLACES: Final = 12
_STEPS: Final = 40
#: A weak pull towards the start keeps what nothing determines where it is, beside readings of 1 m.
_PULL: Final = 1e-6


def quick_misfit(robot: Robot, data: Dataset) -> float | None:
    """Return the median size of what the distances are off by [m], where targets and points fit best.

    Each target has points of its own, and what is known of the distances between them does not count: with it they are
    off by more. None unless readings are distances of targets from points nobody measured, and nothing else.

    Args:
        robot: Nominal; its base is the world, and its own targets do not count.
    """
    distance = _distances_alone(data)
    if distance is None:
        return None
    p, R = robot.world_poses(data.postures)
    off = []
    for target in np.unique(data.target).tolist():
        readings = np.flatnonzero(data.target == target)
        _, of = np.unique(data.against[readings], return_inverse=True)
        configuration = data.configuration[readings]
        off.append(_off_by(p[configuration], R[configuration], of, distance[readings]))
    return float(np.median(np.abs(np.concatenate(off))))


def _distances_alone(data: Dataset) -> Array | None:
    """Return the distances if readings are distances of targets from points nobody measured, and nothing else."""
    if (
        data.fixture is not None
        and data.distance is not None
        and data.height is None
        and data.quaternion is None
        and not data.has_position.any()
        and (data.setup is None or not data.setup.has_position.any())
        and bool((np.isfinite(data.distance) & (data.against >= 0)).all())
    ):
        return data.distance
    return None


def _off_by(p: Array, R: Array, of: NDArray[np.intp], d: Array) -> Array:
    """Return what the distances of one target are off by [m], ``(n,)``; `of` is the point of each."""
    steps = np.arange(-_REACH, _REACH + 1e-9, _STEP)
    grid = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    tips = p + np.einsum("nij,gj->gni", R, grid)
    centres, cost = np.empty((len(grid), int(of.max()) + 1, 3)), np.zeros(len(grid))
    for index in range(centres.shape[1]):
        of_fixture = of == index
        centres[:, index] = centres_of(tips[:, of_fixture], d[of_fixture])
        cost += np.sum(
            (np.linalg.norm(tips[:, of_fixture] - centres[:, index, None], axis=2) - d[of_fixture]) ** 2, axis=1
        )
    best = np.argsort(cost)[:_MOST_PLACES]
    settled = np.abs(_settled(p, R, of, d, grid[best], centres[best]))
    return np.asarray(settled[np.argmin(np.median(settled, axis=1))])


def _settled(p: Array, R: Array, of: NDArray[np.intp], d: Array, target: Array, centres: Array) -> Array:
    """Return what is left of the distances ``(starts, n)`` [m] where steps from the starts end."""
    starts, fixtures, _ = centres.shape
    indicator = np.eye(fixtures)[of]
    damping = np.full(starts, 1e-3)

    def seen(target: Array, centres: Array) -> tuple[Array, Array]:
        away = p + np.einsum("nij,gj->gni", R, target) - centres[:, of]
        far = np.linalg.norm(away, axis=2)
        return far - d, away / np.maximum(far, 1e-12)[..., None]

    off, along = seen(target, centres)
    for _ in range(_STEPS):
        by_target = np.einsum("gni,nij->gnj", along, R)
        by_centres = -(indicator[None, :, :, None] * along[:, :, None, :]).reshape(starts, len(d), -1)
        J = np.concatenate([by_target, by_centres], axis=2)
        transposed = J.swapaxes(1, 2)
        normal = transposed @ J
        size = normal.diagonal(axis1=1, axis2=2)
        normal = normal + np.eye(normal.shape[1]) * (damping[:, None] * size + _PULL)[:, None, :]
        step = -np.linalg.solve(normal, transposed @ off[..., None])[..., 0]
        trial, centred = target + step[:, :3], centres + step[:, 3:].reshape(centres.shape)
        now_off, now_along = seen(trial, centred)
        better = (now_off**2).sum(axis=1) < (off**2).sum(axis=1)
        damping = np.where(better, np.maximum(damping / 10, 1e-9), np.minimum(damping * 10, 1e6))
        if not better.any() or np.abs(step).max() < 1e-7:
            break
        target, centres = np.where(better[:, None], trial, target), np.where(better[:, None, None], centred, centres)
        off = np.where(better[:, None], now_off, off)
        along = np.where(better[:, None, None], now_along, along)
    return off


#: A nominal robot that is placed better than this needs no explanation [m].
_PLACED_WITHIN: Final = 3e-3
_PLACED_WITHIN_BY_FIXTURES: Final = 6e-3
#: Distances that are off by so many times that at the least are not looked at more closely.
_PLAINLY_OFF: Final = 2.0
#: Share of the rows that stay, beside others in another unit: fewer of a campaign are about zero by chance.
_MANY_ROWS: Final = 0.05
#: A data-entry error explains the data if they fit this many times better with it corrected.
_LEAST_IMPROVEMENT: Final = 4.0
#: Beside a data-entry error whose correction makes the data fit this many times better, nothing else is wrong.
_PLAIN_IMPROVEMENT: Final = 20.0
#: A simpler data-entry error is preferred to one that fits this many times better: mirrored readings and the opposite
#: signs of joints 1, 4 and 6 are the same for an arm that is its own mirror image, up to its errors.
_AS_GOOD: Final = 1.5
#: Configurations looked at; more tell nothing new.
_CONFIGURATIONS_TRIED: Final = 60
#: Targets looked at, those that were read most often.
_TARGETS_TRIED: Final = 10
#: A campaign moves some joint by more than this [rad or m].
_LEAST_TRAVEL: Final = 0.3
#: Share of the spread of the readings that is left where these do not follow the joints; chance leaves 0.6 or more.
_UNRELATED: Final = 0.3
#: Orders of the rows that are drawn to see how well readings fit that have nothing to do with the joints, and how
#: much better than the best of these data must fit that follow them.
_ORDERS_DRAWN: Final = 19
_ALIKE: Final = 0.8
#: Joints before the wrist, how much those of the wrist count beside them, what is added to the kernel, and how many
#: orders are drawn, where readings are predicted from each other.
_OF_ARM: Final = 3
_OF_WRIST: Final = 0.2
_RIDGE: Final = 0.1
_ORDERS_PREDICTED: Final = 99
#: How many times as far as the flange a target goes at most, or the other way round, and how many times farther from
#: the middle than half of them readings in one unit lie.
_ABOUT: Final = 3.0
_MOST_APART: Final = 8.0
#: A campaign is at least so large, over what an arm lets it be at most.
_LEAST_OF_REACH: Final = 0.02
#: No target is farther from the flange [m].
_LARGEST_TOOL: Final = 2.0
#: Weight of readings against priors where data-entry errors are judged by a fit [m or rad].
_FITTED_NOISE: Final = 1e-4


def entry_errors_in_positions(robot: Robot, data: Dataset) -> list[Notice]:
    """Return which data-entry errors explain positions in the instrument's frame; nothing if all or none fit."""
    data, robot = _few_targets(data), robot.with_frames(Transform(), {})  # made once for all that is tried
    data, of_targets = _in_one_unit(robot, data)
    return [*of_targets, *_entry_errors(robot, data)]


def _entry_errors(robot: Robot, data: Dataset) -> list[Notice]:
    turned = orientation_entry_errors(robot, _some(data))
    poses = [replace(entry, data=_positions(entry.data)) for entry in pose_entry_errors(_some(data))]
    some, positions = _positions(_some(data)), _positions(data)
    seen = [t for t in range(len(some.targets)) if (some.has_position & (some.target == t)).any()]
    errors = placed_errors(robot, [_only(some, t) for t in seen])
    misfit = {t: float(np.median(off)) for t, off in zip(seen, errors, strict=True)}
    least = min(misfit.values())
    bad = [t for t, size in misfit.items() if size > max(_PLACED_WITHIN, _LEAST_IMPROVEMENT * least)]
    if not bad and least <= _PLACED_WITHIN:
        return turned
    rows = _best(
        robot,
        some,
        (replace(entry, data=_some(entry.data)) for entry in mixed_length_entry_errors(robot, positions)),
    )
    if rows is not None:
        return [rows.notice]
    if not bad:
        best = _best(
            robot,
            some,
            [*_simple_entry_errors(robot, positions), *poses],
            lambda: [
                *(entry for size in (2, 3) for entry in as_noted(robot, some, partial(sign_entry_errors, size=size))),
                *as_noted(robot, some, partial(count_entry_errors, size=2)),
            ],
        )
        if best is not None:
            return [best.notice]
        return turned or _two_entry_errors(robot, positions) or _beyond_reach(robot, some) or _unrelated(robot, some)
    # The other targets fit with the same joints, so these are right.
    notices = []
    for t in bad:
        only = _only(some, t)
        best = _best(robot, only, [*length_entry_errors(only), *mirrored(only), *scale_entry_errors(robot, only)])
        if best is not None:
            notices.append(best.rule(f"Target {some.targets[t]}: {best.words}."))
    return [*turned, *notices] or _beyond_reach(robot, some)


def _two_entry_errors(robot: Robot, data: Dataset) -> list[Notice]:
    """Say if lengths in another unit and one data-entry error more explain the data: no size tells a unit alone."""
    some = _some(data)
    if _size_over_reach(robot, some) <= 1.0:
        return []
    for lengths in length_entry_errors(some):
        corrected = next(entry.data for entry in length_entry_errors(data) if entry.words == lengths.words)
        if not _LEAST_OF_REACH < _size_over_reach(robot, lengths.data) <= 1.0:
            continue
        best = _best(robot, lengths.data, _simple_entry_errors(robot, corrected))
        if best is not None:
            return [lengths.notice, best.notice]
    return []


def _simple_entry_errors(robot: Robot, data: Dataset) -> Iterator[EntryError]:
    """Try everything but several data-entry errors at once, the simplest first."""
    some = _some(data)
    yield from length_entry_errors(some)
    yield from _angle_entry_errors(robot, some)
    yield from controller_entry_errors(robot, some)
    yield from mirrored(some)
    yield from as_noted(robot, some, sign_entry_errors)
    yield from as_noted(robot, some, count_entry_errors)
    yield from as_noted(robot, some, order_entry_errors)
    yield from (replace(entry, data=_some(entry.data)) for entry in shifted(data))
    yield from scale_entry_errors(robot, some)


def _angle_entry_errors(robot: Robot, data: Dataset) -> list[EntryError]:
    """Try other units of angle, of some rows first where only these can be in it, and the others are many enough."""
    whole, some = (list(as_noted(robot, data, entries)) for entries in (angle_entry_errors, mixed_angle_entry_errors))
    first = [entry for entry in some if (entry.data.joints == data.joints).all(axis=1).mean() > _MANY_ROWS]
    return [*first, *whole, *(entry for entry in some if entry not in first)]


def _best(
    robot: Robot, data: Dataset, entries: Iterable[EntryError], several: Callable[[], list[EntryError]] = list
) -> EntryError | None:
    """Return the simplest data-entry error that explains the data, None if none does.

    Args:
        several: Several at once, tried where none alone makes the data fit as if nothing else were wrong.
    """
    tried = list(entries)
    if not tried:
        return None
    as_given = _misfit(robot, data) / _spread(data)
    shares = _shares(robot, tried)
    if min(shares) * _PLAIN_IMPROVEMENT > as_given:
        more = several()
        tried += more
        shares += _shares(robot, more)
    least = min(shares)
    if least * _LEAST_IMPROVEMENT >= as_given:
        return None
    good = [entry for entry, share in zip(tried, shares, strict=True) if share <= _AS_GOOD * least]
    return min(good, key=lambda entry: _beyond_limits(robot, entry.data))  # the first of those alike


def _beyond_limits(robot: Robot, data: Dataset) -> int:
    """Return how many joint positions are beyond the limits, to tell a sign from a zero that explains as much."""
    low, high = np.array([joint.limits or (-math.inf, math.inf) for joint in robot.joints]).T
    return int(((data.joints < low) | (data.joints > high)).sum())


def _shares(robot: Robot, entries: Sequence[EntryError]) -> list[float]:
    """Return how badly each data-entry error fits in proportion to how far its readings lie apart."""
    errors = placed_errors(robot, [entry.data for entry in entries])
    return [float(np.median(off)) / _spread(entry.data) for off, entry in zip(errors, entries, strict=True)]


FIXTURES_UNLIKELY: Final = Rule(
    "fixtures-unlikely", ("error", "warning"), "[fixtures](devices.md) that the readings do not fit"
)


def entry_errors_in_lengths(robot: Robot, data: Dataset) -> list[Notice]:
    """Return the first data-entry error that explains readings against fixtures: several may fit alike."""
    size = _misfit(robot, data)
    if size <= _PLACED_WITHIN_BY_FIXTURES:
        return []
    for entry in (
        *length_entry_errors(data),
        *_angle_entry_errors(robot, data),
        *controller_entry_errors(robot, data),
        *as_noted(robot, data, sign_entry_errors),
        *as_noted(robot, data, order_entry_errors),
    ):
        travel, before = (np.ptp(dataset.joints, axis=0) for dataset in (entry.data, data))
        less = travel < 0.5 * before
        if min(travel.max(), travel[less].max(initial=0.0) if less.any() else np.inf) < _LEAST_TRAVEL:
            continue  # an arm that hardly moves fits any fixture, and so does a joint that would hardly move
        quick = quick_misfit(robot, entry.data)
        if quick is not None and quick > _PLAINLY_OFF * _PLACED_WITHIN_BY_FIXTURES:
            continue
        corrected = _misfit(robot, entry.data)
        if corrected <= _PLACED_WITHIN_BY_FIXTURES and _LEAST_IMPROVEMENT * corrected / _spread(
            entry.data
        ) < size / _spread(data):
            return [entry.notice]
    return [
        FIXTURES_UNLIKELY(
            "The nominal robot does not fit the readings against fixtures. Half of them are off by more than "
            f"{size * 1e3:.3g} mm, with base, targets and fixtures where they fit best. Check that the rows name the "
            "right fixtures, and the places in the rows of the role fixture.",
            "warning",
        )
    ]


def entry_errors_by_fit(robot: Robot, data: Dataset) -> list[Notice]:
    """Return the joint whose opposite sign, or the mirror image that, explains what a fit leaves over.

    The targets may be so near the axis of the last joint, or the campaign so narrow, that the placed nominal robot
    hardly sees it. So one step of the geometric fit from there is judged, which takes out what the robot's own errors
    explain.
    """
    some = _some(replace(_few_targets(data), quaternion=None, sigma=None, sigma_rot=None))
    as_given = _fitted_misfit(robot, some)
    tries = [*controller_entry_errors(robot, some), *mirrored(some), *as_noted(robot, some, sign_entry_errors)]
    tried = [(_fitted_misfit(robot, entry.data), entry) for entry in tries]
    least = min(left for left, _ in tried)
    entry = next(entry for left, entry in tried if left <= _AS_GOOD * least)
    return [entry.notice] if least * _LEAST_IMPROVEMENT < as_given else []


def _fitted_misfit(robot: Robot, data: Dataset) -> float:
    """Return the root mean square that one step of the geometric fit from the placed nominal robot leaves [m]."""
    model = named_model("geometric")
    start = initial_frames(model.prepared(robot), data)
    noise = {observation.name: _FITTED_NOISE for observation in OBSERVATIONS}
    problem = Problem(start, data, model.free(start), noise)
    r, J = problem.linearised(problem.free.start)
    prior, weight = problem.prior_rows(problem.free.start)
    step = np.linalg.lstsq(np.concatenate([J, np.diag(weight)]), -np.concatenate([r, prior]), rcond=None)[0]
    return float(np.sqrt(np.mean((r + J @ step) ** 2))) * _FITTED_NOISE


def _misfit(robot: Robot, data: Dataset) -> float:
    """Return the median distance that the placed nominal robot leaves [m]; infinite if it cannot be placed."""
    if data.fixture is None:
        return float(np.median(placed_errors(robot, [data])[0]))
    try:
        return float(np.nanmedian(off_by(errors_of(start_from_readings(robot, data), data))))
    except InputError:
        return math.inf


def off_by(errors: Errors) -> Array:
    """Return how far off each position, distance or height is [m], NaN where there is none."""
    off: Array = np.linalg.norm(errors.position_errors, axis=1)
    return off if errors.length_errors is None else np.where(np.isfinite(off), off, np.abs(errors.length_errors))


def _spread(data: Dataset) -> float:
    """Return how far the readings lie apart [m]: positions that shrink fit better, but not in proportion."""
    if data.fixture is not None:
        counted = [data.position, *(v[:, None] for v in (data.distance, data.height) if v is not None)]
        return float(np.sqrt(np.nanmean(np.concatenate([v.reshape(-1) for v in counted]) ** 2))) + 1e-3
    return float(np.sqrt(np.mean(np.var(data.position[data.has_position], axis=0)))) + 1e-12


def _beyond_reach(robot: Robot, data: Dataset) -> list[Notice]:
    """Say if readings lie so far apart that no arm of this size was read, in whatever frame."""
    if _size_over_reach(robot, data) <= 1.0:
        return []
    return [
        UNIT_LENGTH(
            f"The positions lie up to {_apart(data):.3g} m from the middle of all, where the arm reaches "
            f"{_reach(robot, data):.2g} m. No one unit makes them fit: some of their numbers are in another unit or "
            "lost their decimal point or comma, or more is wrong with the data than that."
        )
    ]


def _size_over_reach(robot: Robot, data: Dataset) -> float:
    """Return how far readings lie apart, over what an arm of this size lets them at most."""
    return _apart(data) / (2.0 * (_reach(robot, data) + _LARGEST_TOOL))


def _apart(data: Dataset) -> float:
    read = data.position[data.has_position]
    return float(np.linalg.norm(read - np.median(read, axis=0), axis=1).max())


def _reach(robot: Robot, data: Dataset) -> float:
    return float(np.linalg.norm(robot.with_frames(Transform(), {}).world_poses(data.postures)[0], axis=1).max())


ROWS_UNRELATED: Final = Rule(
    "rows-unrelated",
    "error",
    "readings that do not follow the joint positions",
    cure="Check that joint positions and readings are of the same campaign, and row by row of the same configuration.",
)


def _unrelated(robot: Robot, data: Dataset) -> list[Notice]:
    """Say if the readings fit the joints no better than in an order that is drawn, neither by the robot nor by any."""
    as_given = _misfit(robot, data)
    if as_given < _UNRELATED * _spread(data):
        return []
    half = data.configurations // 2
    for part in (data.of_configurations(np.arange(half)), data.of_configurations(np.arange(half, data.configurations))):
        if part.has_position.any() and _misfit(robot, part) * _LEAST_IMPROVEMENT < as_given:
            return []  # the robot or the instrument stands elsewhere in the other half
    rng = np.random.default_rng(0)
    drawn = (replace(data, joints=rng.permutation(data.joints)) for _ in range(_ORDERS_DRAWN))
    if any(_ALIKE * _misfit(robot, other) <= as_given for other in drawn) and not _follow(data):
        return [
            ROWS_UNRELATED(
                "The readings do not follow the joint positions: in an order drawn at random they fit the robot as "
                "well."
            )
        ]
    return []


def _follow(data: Dataset) -> bool:
    """Return whether readings follow the joint positions as those of any arm do, whatever its lengths and zeros.

    Where an arm is, is a sum of products of the sines and cosines of its joints. So each configuration is predicted
    from the others by kernel ridge regression with a product of cosines, and in no order drawn may they predict as
    well. The joints of the wrist count less. Of 11 arms of the library with 24 to 60 random configurations each of 220
    campaigns was seen to follow, with 16 configurations 40 of 55; of those whose rows were shuffled 1 of 220.
    """
    read = np.full((data.configurations, len(data.targets), 3), np.nan)
    read[data.configuration, data.target] = data.position
    whole = np.flatnonzero(np.isfinite(read).all(axis=(1, 2)))
    places = read[whole].reshape(len(whole), -1)
    places = places - places.mean(axis=0)
    q = data.joints[whole]
    kernel = np.ones((len(whole), len(whole)))
    for i, kind in enumerate(data.joint_kinds):
        along = q[:, i] if kind == "revolute" else math.pi * q[:, i] / max(float(np.ptp(q[:, i])), 1e-12)
        share = 1.0 if i < _OF_ARM else _OF_WRIST
        kernel *= (1.0 + share * np.cos(along[:, None] - along)) / (1.0 + share)
    inverse = np.linalg.inv(kernel + _RIDGE * np.eye(len(whole)))

    def left(places: Array) -> float:
        """Return the sum of squares of what is left of each place where the others predict it."""
        return float(np.sum((inverse @ places / inverse.diagonal()[:, None]) ** 2))

    rng = np.random.default_rng(0)
    return len(whole) > 1 and all(left(rng.permutation(places)) > left(places) for _ in range(_ORDERS_PREDICTED))


def _in_one_unit(robot: Robot, data: Dataset) -> tuple[Dataset, list[Notice]]:
    """Return the data with targets that are in another unit than the others corrected, and the errors about them.

    A target goes about as far as the flange does, whatever else is wrong with the joints.
    """
    flange = robot.world_poses(data.postures)[0]
    size = float(np.sqrt(np.mean(np.var(flange, axis=0))))
    factor, notices = np.ones(len(data.targets)), list[Notice]()
    for t, name in enumerate(data.targets):
        read = data.position[(data.target == t) & data.has_position]
        away = np.linalg.norm(read - np.median(read, axis=0), axis=1) if len(read) else np.zeros(0)
        if len(away) < _FEWEST_PLACED or away.max() > _MOST_APART * np.median(away):  # single rows in another unit
            continue
        own = float(np.sqrt(np.mean(np.var(read, axis=0)))) / max(size, 1e-12)
        for by, words in LENGTH_FACTORS:
            if 1.0 / _ABOUT < by * own < _ABOUT:
                factor[t] = by
                notices.append(UNIT_LENGTH(f"Target {name}: The positions are {words}. Fix the unit in the header."))
    if (factor == factor[0]).all():  # the unit of all, which is tried beside other errors
        return data, []
    return replace(data, position=data.position * factor[data.target, None]), notices


# -- parts of the data -------------------------------------------------------------------------------------


def _positions(data: Dataset) -> Dataset:
    return replace(data, quaternion=None, sigma_rot=None)


def _some(data: Dataset) -> Dataset:
    if data.configurations <= _CONFIGURATIONS_TRIED:
        return data
    return data.of_configurations(np.linspace(0, data.configurations - 1, _CONFIGURATIONS_TRIED).astype(np.intp))


def _few_targets(data: Dataset) -> Dataset:
    """Return the data of the targets that were read most often."""
    if len(data.targets) <= _TARGETS_TRIED:
        return data
    often = np.argsort(-np.bincount(data.target[data.has_position], minlength=len(data.targets)), kind="stable")
    return data.of_readings(np.isin(data.target, often[:_TARGETS_TRIED]))


def _only(data: Dataset, target: int) -> Dataset:
    chosen = (data.target == target) & data.has_position

    some = data.of_readings(chosen)
    return replace(some, target=np.zeros(len(some.target), dtype=np.intp), targets=(data.targets[target],))
