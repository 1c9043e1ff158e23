"""Readings and orientations that a robust fit leaves far off."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import Notice, Rule, degrees, listed, millimetres
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.rigid_tool import (
    OUTLIERS,
    TARGET_MISTAKEN,
    TARGETS_SWAPPED,
    Places,
    Suspect,
    factors_of,
    fixed_points,
    length_notice,
    places_of,
    suspect,
)
from truearm.engine.data.statistics import Errors
from truearm.engine.data.thinning import repeated_joints
from truearm.engine.diagnose.entry_error_trials import (
    ORIENTATION_ORDER,
    ROWS_SHIFTED,
    UNIT_ANGLE,
    EntryError,
    angle_entry_errors,
    as_noted,
    entry_errors_in_rows,
    sign_entry_errors,
)
from truearm.engine.fit.fit import Fit
from truearm.engine.robot.chain import Array

# Readings that a robust fit leaves far off, and whose fault it is: one reading's, or the joint positions' of a row.
#
# Where all readings of a configuration are off and keep their distances to each other, none of them was taken from a
# wrong point: the tool stood elsewhere than the joint positions say.

#: A reading is doubted beyond this many median residuals, and at least so far off [m].
OUTLIER_RATIO: Final = 20.0
_LEAST_OUTLIER: Final = 1e-3
#: Many readings are doubted together beyond so many median residuals, and at least so far off [m]; at least so many
#: readings, and this share of them.
_OFTEN_RATIO: Final = 6.0
_LEAST_OFTEN: Final = 5e-5
_FEWEST_OFTEN: Final = 4
_OFTEN_SHARE: Final = 0.05
#: Configurations whose joint positions are looked for among the others'.
_MOST_LOOKED_AT: Final = 50
#: Another unit explains readings that it brings so many times nearer: a target on the axis of a joint hardly moves.
_LEAST_IMPROVEMENT: Final = 10.0
#: Distances tell that readings hang together where some are so many times as long as a reading may be off.
_LONG: Final = 3.0


def far_off(fit: Fit, data: Dataset, off: Array, turned: NDArray[np.bool_]) -> tuple[list[Notice], list[Suspect]]:
    """Doubt readings that a robust geometric fit leaves far off, and joint positions that do not belong to theirs.

    Args:
        off: How far off each reading is [m], ``(readings,)``.
        turned: Which orientations are far off, ``(readings,)``.
    """
    allowed = allowed_off(off)
    doubted = np.flatnonzero(np.nan_to_num(off) > allowed)
    if len(doubted) == 0:
        return [], []
    predicted = np.stack([fit.robot.world_poses(data.postures, name)[0] for name in data.targets], axis=1)
    data, lengths = _in_another_length(data, predicted, doubted, allowed)
    doubted = np.setdiff1d(doubted, np.flatnonzero(lengths != 1.0))
    scaled = [length_notice(data, lengths)] if (lengths != 1.0).any() else []
    mistaken = _joints_of_others(data, predicted, doubted, allowed)
    angled, entries = _in_another_unit(fit, data, off, doubted, allowed, [*mistaken])
    turned_round = _of_another_sign(fit, data, off, doubted, allowed, [*mistaken, *angled])
    points, known = places_of(data), fixed_points(data)
    repeated = {label for pair in repeated_joints(data) for label in pair}
    suspects: list[Suspect] = []
    unlike: dict[int, float] = {}
    for c in dict.fromkeys(data.configuration[doubted].tolist()):
        if c in mistaken or c in angled or c in turned_round or data.labels[c] in repeated:
            continue
        rows = [r for r in doubted.tolist() if data.configuration[r] == c]
        of_this = [_doubted(data, r, predicted[c], points, known, float(off[r]), allowed) for r in rows]
        if all(doubt.rule == OUTLIERS for doubt in of_this) and _hang_together(
            data, c, rows, predicted, turned, allowed
        ):
            unlike[c] = float(off[rows].max())
        else:
            suspects += of_this
    copied, exchanged = _exchanged(data, mistaken)
    return [*scaled, *entries, *exchanged, *_joints_mistaken(data, copied, turned_round, unlike)], suspects


def _doubted(
    data: Dataset, reading: int, predicted: Array, points: Places, known: dict[str, Array], size: float, allowed: float
) -> Suspect:
    """Say what a single reading is that is far off.

    Args:
        predicted: Places of the targets at its configuration [m], ``(targets, 3)``.
        points, known: Where targets were read, and other points that could have been.
    """
    c, t = int(data.configuration[reading]), int(data.target[reading])
    label, name, at = data.labels[c], data.targets[t], data.position[reading]
    gaps = np.linalg.norm(predicted - at, axis=1)
    nearest = int(np.argmin(gaps))
    if nearest != t and gaps[nearest] <= allowed:
        measured = points.of(c, nearest)
        exchanged = measured is not None and np.linalg.norm(measured - predicted[t]) <= allowed
        rule = TARGETS_SWAPPED if exchanged else TARGET_MISTAKEN
        return Suspect(rule, label, name, f"is target {data.targets[nearest]}")
    before = points.of(c - 1, t)
    before_it = {} if before is None else {f"target {name} at the configuration before": before}
    return suspect(at, label, name, size, before_it | known)


def _hang_together(
    data: Dataset, c: int, doubted: list[int], predicted: Array, turned: NDArray[np.bool_], allowed: float
) -> bool:
    """Return whether all readings of a configuration are far off and keep their distances, or are turned as well.

    Args:
        predicted: Places of the targets [m], ``(configurations, targets, 3)``.
    """
    rows = np.flatnonzero((data.configuration == c) & data.has_position)
    if len(rows) != len(doubted):
        return False
    if turned[rows].all():
        return True
    read, expected = data.position[rows], predicted[c, data.target[rows]]
    apart = [np.linalg.norm(points[:, None] - points, axis=2) for points in (read, expected)]
    return bool(apart[1].max() > _LONG * allowed and np.abs(apart[0] - apart[1]).max() <= allowed)


def _in_another_length(data: Dataset, predicted: Array, doubted: IntArray, allowed: float) -> tuple[Dataset, Array]:
    """Return the data with positions in another unit of length corrected, and by what factors, ``(readings,)``.

    Args:
        predicted: Places of the targets [m], ``(configurations, targets, 3)``.
        doubted: The readings that are far off.
    """
    factors = np.ones(len(data.target))
    expected = predicted[data.configuration[doubted], data.target[doubted]]
    factors[doubted] = factors_of(data.position[doubted], expected, allowed)
    return replace(data, position=data.position * factors[:, None]), factors


def _in_another_unit(
    fit: Fit, data: Dataset, off: Array, doubted: IntArray, allowed: float, left_out: list[int]
) -> tuple[set[int], list[Notice]]:
    """Return the configurations whose readings fit their joint positions in the other unit of angle, and say so.

    Args:
        off: How far off each reading is [m], ``(readings,)``.
        doubted: The readings that are far off.
        left_out: Configurations that are explained.
    """
    by_unit: dict[str, list[int]] = {}
    explained: set[int] = set()
    for entry, fitting in _explained_by(fit, data, off, doubted, allowed, left_out, angle_entry_errors):
        new = [c for c in fitting if c not in explained]
        explained.update(new)
        if new:
            by_unit.setdefault(entry.words.partition(".")[0], []).extend(new)
    return explained, [
        UNIT_ANGLE(
            f"{words}, at some configurations alone ({listed([data.labels[c] for c in sorted(cs)])}).",
            at=tuple((data.labels[c], "") for c in sorted(cs)),
        )
        for words, cs in by_unit.items()
    ]


def _of_another_sign(
    fit: Fit, data: Dataset, off: Array, doubted: IntArray, allowed: float, left_out: list[int]
) -> dict[int, int]:
    """Return the configurations whose readings fit with the opposite sign of one joint alone, and its number from 1."""
    candidates: dict[int, list[int]] = {}
    entries = _explained_by(fit, data, off, doubted, allowed, left_out, sign_entry_errors)
    for number, (_, fitting) in enumerate(entries, 1):
        for c in fitting:
            candidates.setdefault(c, []).append(number)
    return {c: numbers[0] for c, numbers in candidates.items() if len(numbers) == 1}


def _explained_by(
    fit: Fit,
    data: Dataset,
    off: Array,
    doubted: IntArray,
    allowed: float,
    left_out: list[int],
    entries: Callable[[Dataset], Iterator[EntryError]],
) -> Iterator[tuple[EntryError, list[int]]]:
    """Return data-entry errors with joint positions, and the configurations whose readings each of them explains."""
    read = np.bincount(data.configuration[data.has_position], minlength=data.configurations)
    wrong = np.bincount(data.configuration[doubted], minlength=data.configurations)
    some = np.setdiff1d(np.flatnonzero((wrong > 0) & (wrong == read)), left_out)[:_MOST_LOOKED_AT]
    if not len(some):
        return
    part = data.of_configurations(some)
    off_most = [float(np.nanmax(off[data.configuration == c])) for c in some.tolist()]
    for entry in as_noted(fit.robot, part, entries):
        places = [fit.robot.world_poses(entry.data.postures, name)[0] for name in part.targets]
        gaps = np.linalg.norm(np.stack(places, axis=1)[part.configuration, part.target] - part.position, axis=1)
        gap = [float(gaps[(part.configuration == i) & part.has_position].max()) for i in range(len(some))]
        least = [min(allowed, most / _LEAST_IMPROVEMENT) for most in off_most]
        yield entry, [c for i, c in enumerate(some.tolist()) if gap[i] <= least[i]]


JOINTS_MISTAKEN: Final = Rule(
    "joints-mistaken",
    "warning",
    "joint positions of another configuration, with the wrong sign of one joint, or that [do not belong to their "
    "readings](check.md#wrong-joint-positions)",
)


def _joints_mistaken(
    data: Dataset, others: dict[int, int], signs: dict[int, int], unlike: dict[int, float]
) -> list[Notice]:
    """Say which joint positions do not belong to their readings.

    Args:
        others: Configurations whose readings fit the joint positions of another one, and which.
        signs: Those whose readings fit with the opposite sign of a joint, and of which.
        unlike: Those whose readings hang together and are elsewhere, and how far [m].
    """
    sentences = []
    if others:
        words = _of_others(data, others)
        subject = "readings of a configuration fit" if len(words) == 1 else "readings of configurations fit"
        sentences.append(
            f"The {subject} the joint positions of another one: {listed(words)}. Their rows were copied: fix the joint "
            "positions, or leave them out."
        )
    if signs:
        words = [f"{data.labels[c]} (joint {number})" for c, number in signs.items()]
        subject = f"configuration{'' if len(words) == 1 else 's'} {listed(words)}"
        sentences.append(
            f"The readings of {subject} fit with the opposite sign of this joint: fix it in these rows, or leave them "
            "out."
        )
    if unlike:
        words = [f"{data.labels[c]} ({millimetres(size)} mm off)" for c, size in unlike.items()]
        subject = f"configuration{'' if len(words) == 1 else 's'} {listed(words)}"
        sentences.append(
            f"The joint positions of {subject} do not belong to their readings: all of these are off, and stand to "
            "each other as they should. The joint positions are wrong, or the row is another one's, or the robot or "
            "the instrument was moved for it. Fix the joint positions, or leave these rows out."
        )
    at = tuple((data.labels[c], "") for c in (*others, *signs, *unlike))
    return [JOINTS_MISTAKEN(" ".join(sentences), at=at)] if sentences else []


def _of_others(data: Dataset, others: dict[int, int]) -> list[str]:
    return [f"{data.labels[c]} (those of {data.labels[k]})" for c, k in others.items()]


def _exchanged(data: Dataset, others: dict[int, int]) -> tuple[dict[int, int], list[Notice]]:
    """Return configurations that have each other's joint positions, taken out of `others`, and say so."""
    among = dict(others)
    while lost := [c for c, k in among.items() if k not in among]:
        for c in lost:
            del among[c]
    if not among:
        return others, []
    return {c: k for c, k in others.items() if c not in among}, [
        ROWS_SHIFTED(
            f"Configurations have each other's joint positions: {listed(_of_others(data, among))}. Their rows were "
            "exchanged or shifted: put the joint positions back.",
            "warning",
            at=tuple((data.labels[c], "") for c in among),
        )
    ]


def allowed_off(off: Array) -> float:
    """Return how far off a reading may be, before it is doubted alone [m]."""
    return max(_LEAST_OUTLIER, OUTLIER_RATIO * float(np.nanmedian(off)))


def often_off(data: Dataset, off: Array) -> list[Notice]:
    """Say if many readings are far off by the measure of the others, though none so far as to be doubted alone.

    Of normal errors one in a billion is six medians off. Where errors of the joints move some targets more than others
    few are: of the measured IRB 120 two in a hundred, at two configurations that went wrong.
    """
    size = np.nan_to_num(off)
    usual = float(np.nanmedian(off))
    far = np.flatnonzero((size > max(_OFTEN_RATIO * usual, _LEAST_OFTEN)) & (size <= allowed_off(off)))
    read = int(np.isfinite(off).sum())
    if len(far) < max(_FEWEST_OFTEN, _OFTEN_SHARE * read):
        return []
    at = tuple((data.labels[data.configuration[r]], data.targets[data.target[r]]) for r in far.tolist())
    return [
        OUTLIERS(
            f"{len(far)} of {read} readings ({len(far) / read:.0%}) are more than {_OFTEN_RATIO:g} times farther off "
            f"than half of all, up to {float(size[far].max()) * 1e3:.2g} mm (configuration/target): "
            f"{listed(['/'.join(pair) for pair in at])}. "
            "Errors of instruments and joints are not so uneven.",
            at=at,
        )
    ]


def _joints_of_others(data: Dataset, predicted: Array, doubted: IntArray, allowed: float) -> dict[int, int]:
    """Return the configurations all of whose readings fit the joint positions of another one, and which.

    Args:
        predicted: Places of the targets [m], ``(configurations, targets, 3)``.
    """
    off = np.zeros(len(data.target), dtype=bool)
    off[doubted] = True
    others = {}
    for c in np.unique(data.configuration[doubted]).tolist()[:_MOST_LOOKED_AT]:
        rows = np.flatnonzero((data.configuration == c) & data.has_position)
        if not off[rows].all():
            continue
        gaps = np.linalg.norm(predicted[:, data.target[rows]] - data.position[rows], axis=2).max(axis=1)
        nearest = int(np.argmin(gaps))
        if gaps[nearest] <= allowed:
            others[c] = nearest
    return others


ORIENTATION_OUTLIERS: Final = Rule(
    "orientation-outliers",
    "warning",
    "[orientations far off](check.md#single-orientations-that-are-off) whose positions are not",
)
#: Codes of wrong readings that pull a fit away.
PULLING: Final = frozenset(
    rule.code for rule in (ORIENTATION_OUTLIERS, ORIENTATION_ORDER, JOINTS_MISTAKEN, ROWS_SHIFTED, UNIT_ANGLE)
)
#: An orientation is doubted if it is at least so far off [rad].
_LEAST_TURNED: Final = math.radians(0.5)
#: A joint turns a reading alike if the turn is about its axis but for this share, and hardly moves it if the target is
#: so near the axis [m].
_ALIKE: Final = 0.05
_ON_THE_AXIS: Final = 5e-3


def orientations_off(errors: Errors) -> NDArray[np.bool_]:
    """Return which orientations are so far off that they are doubted, ``(readings,)``.

    Args:
        errors: Of a robust fit.
    """
    turned = errors.orientation_errors
    if turned is None or not len(errors.orientation_norms):
        return np.zeros(len(errors.position_errors), dtype=bool)
    allowed = max(_LEAST_TURNED, OUTLIER_RATIO * float(np.median(errors.orientation_norms)))
    return np.asarray(np.nan_to_num(np.linalg.norm(turned, axis=1)) > allowed)


def check_orientations(fit: Fit, data: Dataset, errors: Errors, doubted: NDArray[np.bool_]) -> list[Notice]:
    """Say which orientations are far off, and which of them would not be if their numbers were read otherwise.

    Args:
        errors: Of the fit.
        doubted: The orientations that are far off, where the positions are not, ``(readings,)``.
    """
    if data.quaternion is None or errors.orientation_errors is None or not doubted.any():
        return []
    rows = np.flatnonzero(doubted)
    predicted = np.empty((len(rows), 3, 3))
    for t in np.unique(data.target[rows]).tolist():
        of_target = data.target[rows] == t
        predicted[of_target] = fit.robot.world_poses(data.postures, data.targets[t])[1][
            data.configuration[rows[of_target]]
        ]
    corrected, words = entry_errors_in_rows(data.quaternion[rows], predicted)
    at = [(data.labels[data.configuration[r]], data.targets[data.target[r]]) for r in rows.tolist()]
    labels = ["/".join(pair) for pair in at]
    notices = []
    if corrected.any():
        some = listed([name for name, is_corrected in zip(labels, corrected.tolist(), strict=True) if is_corrected])
        notices.append(
            ORIENTATION_ORDER(
                f"Some orientations do not turn as the robot does (configuration/target): {some}. They would if their "
                f"numbers were read otherwise: {words}. Those of the other readings are right. Fix these rows.",
                "error",
                at=tuple(pair for pair, known in zip(at, corrected.tolist(), strict=True) if known),
            )
        )
    if not corrected.all():
        size = np.linalg.norm(errors.orientation_errors[rows], axis=1).tolist()
        joint = [_as_if_turned(fit, data, r, errors.orientation_errors[r]) for r in rows.tolist()]
        others = [f"{labels[i]} ({degrees(size[i])} deg{joint[i]})" for i in np.flatnonzero(~corrected).tolist()]
        is_single = len(others) == 1
        subject, them = ("orientation is", "it") if is_single else ("orientations are", "them")
        quaternions = "its quaternion" if is_single else "their quaternions"
        notices.append(
            ORIENTATION_OUTLIERS(
                f"{len(others)} {subject} far off, and the positions are not (configuration/target): {listed(others)}. "
                f"Measure {them} again, or leave {quaternions} empty; `loss=cauchy` lets {them} count little.",
                at=tuple(at[i] for i in np.flatnonzero(~corrected).tolist()),
            )
        )
    return notices


def _as_if_turned(fit: Fit, data: Dataset, reading: int, by: Array) -> str:
    """Say if a joint that were off would turn a reading alike, and hardly move it; nothing if none would.

    Args:
        by: What the orientation is off by, as a rotation vector [rad], ``(3,)``.
    """
    single = data.of_configurations(data.configuration[[reading]])
    moves = fit.robot.joint_jacobian(single.postures, data.targets[data.target[reading]])[0]
    for number, (linear, angular) in enumerate(zip(moves[:3].T, moves[3:].T, strict=True), 1):
        angle = float(by @ angular)
        if np.linalg.norm(by - angle * angular) < _ALIKE * abs(angle) and np.linalg.norm(linear) < _ON_THE_AXIS:
            return f", as if joint {number} were"
    return ""


def without_orientations(data: Dataset, doubted: NDArray[np.bool_]) -> Dataset:
    """Return the data without some orientations.

    Args:
        doubted: Which, ``(readings,)``.
    """
    if data.quaternion is None or not doubted.any():
        return data
    return replace(data, quaternion=np.where(doubted[:, None], np.nan, data.quaternion))
