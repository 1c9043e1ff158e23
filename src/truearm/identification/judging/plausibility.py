"""Is the data believable for this robot: units, joint order and signs, limits, and readings far off.

The nominal robot is placed by the closed form. Where that fails badly, the slips that people make are tried one by
one; one that makes the same data fit several times better is what happened.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.identification.solving.fit import Fit, identify
from truearm.identification.solving.models import MODELS
from truearm.identification.solving.problem import Problem
from truearm.identification.start_values.frames import initial_frames
from truearm.identification.start_values.from_readings import start_from_readings
from truearm.measurement.dataset import Dataset
from truearm.measurement.observations import OBSERVATIONS
from truearm.measurement.places import places_of
from truearm.measurement.rigid_tool import Suspect, Suspicion, fixed_points, suspect
from truearm.measurement.statistics import Errors, errors_of
from truearm.modeling.chain import Array
from truearm.modeling.parameters import FreeParameters
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.units import from_si

#: A nominal robot that is placed better than this needs no explanation [m].
_PLACED_WITHIN: Final = 3e-3
_PLACED_WITHIN_BY_FIXTURES: Final = 6e-3
#: A slip explains the data if they fit this many times better with it mended.
_LEAST_IMPROVEMENT: Final = 4.0
#: Configurations looked at; more tell nothing new.
_CONFIGURATIONS_TRIED: Final = 60
#: A reading is doubted beyond this many median residuals, and at least so far off [m].
_OUTLIER_RATIO: Final = 20.0
_LEAST_OUTLIER: Final = 1e-3
#: A campaign moves some joint by more than this [rad or m].
_LEAST_TRAVEL: Final = 0.3
#: What is said of a fixture is doubted beyond this many deviations.
_FIXTURE_OUTLIER: Final = 8.0
#: A joint may be this far beyond its limit by rounding [rad or m].
_LIMIT_ROUNDING: Final = math.radians(0.05)


@dataclass(frozen=True, eq=False)
class _Slip:
    code: str
    words: str
    data: Dataset


def check_against(robot: Robot, data: Dataset) -> tuple[list[Notice], list[Suspect]]:
    """Return what is wrong with a dataset if it was measured on this robot, and the readings that are far off.

    Parameters
    ----------
    robot
        The nominal robot, with as many joints as the data; its base and targets are left out of account.
    """
    found = _beyond_limits(robot, data)
    if data.fixture is not None:
        try:
            start_from_readings(robot, data)
        except InputError as error:
            return [Notice("fixtures-unlikely", str(error)), *found], []
        slips = _fixture_slips(robot, data)
        if slips:
            return [*slips, *found], []
        unlike, suspects = _far_from_fixtures(robot, data)
        return [*unlike, *found], suspects
    if not data.has_position.any():
        return found, []
    slips = _slips(robot, data)
    if slips:
        return [*slips, *found], []
    return found, _far_off(robot, data)


def _beyond_limits(robot: Robot, data: Dataset) -> list[Notice]:
    words, count = [], 0
    for i, joint in enumerate(robot.joints):
        if joint.limits is None:
            continue
        low, high = joint.limits
        out = (data.joints[:, i] < low - _LIMIT_ROUNDING) | (data.joints[:, i] > high + _LIMIT_ROUNDING)
        if out.any():
            count += int(out.sum())
            unit = "deg" if joint.kind == "revolute" else "mm"
            worst = data.joints[np.argmax(np.maximum(data.joints[:, i] - high, low - data.joints[:, i])), i]
            first = data.labels[int(np.argmax(out))]
            words.append(
                f"joint {i + 1} at {int(out.sum())} configurations (first: {first}; farthest {from_si(worst, unit):.1f}"
                f" {unit}; limits {from_si(low, unit):g} to {from_si(high, unit):g})"
            )
    if not words:
        return []
    return [
        Notice(
            "beyond-limits",
            f"Joint positions are beyond the limits of {robot.name}: {'; '.join(words)}. Check units, joint order and "
            "the limits in the robot file.",
        )
    ]


def _slips(robot: Robot, data: Dataset) -> list[Notice]:
    some = _some(data)
    misfit = {t: _misfit(robot, _only(some, t)) for t in range(len(some.targets)) if _seen(some, t)}
    least = min(misfit.values())
    bad = [t for t, size in misfit.items() if size > max(_PLACED_WITHIN, _LEAST_IMPROVEMENT * least)]
    if not bad:
        if least <= _PLACED_WITHIN:
            return []
        best = _best(robot, some, [*_joint_slips(some), *_length_slips(some)])
        return [] if best is None else [Notice(best.code, f"{best.words}.")]
    # The other targets fit with the same joints, so these are right.
    found = []
    for t in bad:
        best = _best(robot, _only(some, t), list(_length_slips(_only(some, t))))
        if best is not None:
            found.append(Notice(best.code, f"Target {some.targets[t]}: {best.words}."))
    return found


def _best(robot: Robot, data: Dataset, slips: list[_Slip]) -> _Slip | None:
    """Return the slip that explains the data, None if none does."""
    shares = [_misfit(robot, slip.data) / _spread(slip.data) for slip in slips]
    best = int(np.argmin(shares))
    return slips[best] if shares[best] * _LEAST_IMPROVEMENT < _misfit(robot, data) / _spread(data) else None


def _fixture_slips(robot: Robot, data: Dataset) -> list[Notice]:
    """Return the first slip that explains readings against fixtures: turned about, several may fit alike."""
    size = _misfit(robot, data)
    if size <= _PLACED_WITHIN_BY_FIXTURES:
        return []
    for slip in (*_length_slips(data), *_joint_slips(data, at_once=1)):
        if np.ptp(slip.data.joints, axis=0).max() < _LEAST_TRAVEL:
            continue  # an arm that hardly moves fits any fixture
        mended = _misfit(robot, slip.data)
        if mended <= _PLACED_WITHIN_BY_FIXTURES and _LEAST_IMPROVEMENT * mended / _spread(slip.data) < size / _spread(
            data
        ):
            return [Notice(slip.code, f"{slip.words}.")]
    return [
        Notice(
            "fixtures-unlikely",
            "The nominal robot does not fit the readings against fixtures. Half of them are off by more than "
            f"{size * 1e3:.3g} mm, with base, targets and fixtures where they fit best. Check that the rows name the "
            "right fixtures, and the places in the rows of the role fixture.",
        )
    ]


def _far_from_fixtures(robot: Robot, data: Dataset) -> tuple[list[Notice], list[Suspect]]:
    """Doubt readings against fixtures that a robust geometric fit leaves far off, and what is said of fixtures."""
    geometric = next(m for m in MODELS if m.name == "geometric")
    fit = identify(robot, data, geometric, loss="cauchy")
    errors = errors_of(fit.robot, data)
    off = _off(errors)
    allowed = max(_LEAST_OUTLIER, _OUTLIER_RATIO * float(np.nanmedian(off)))
    doubted = np.flatnonzero(np.nan_to_num(off) > allowed).tolist()
    where = [(data.labels[data.configuration[r]], data.targets[data.target[r]]) for r in doubted]
    suspects = [Suspect("outliers", *at, f"{off[r] * 1e3:.3g} mm off") for r, at in zip(doubted, where, strict=True)]
    return _unlike_its_readings(fit, data), suspects


def _unlike_its_readings(fit: Fit, data: Dataset) -> list[Notice]:
    """Say where fixtures are not where, or not as far apart as, the file says."""
    if data.setup is None:
        return []
    problem = Problem(fit.robot, data, FreeParameters(()), {observation.name: 1.0 for observation in OBSERVATIONS})
    residual, first = problem.residual(np.zeros(0)), 0
    found = []
    for block in problem.blocks:
        rows = residual[first : first + block.rows].reshape(len(block.readings), -1)
        first += block.rows
        if block.data is data:
            continue
        for off, sigma in zip(np.linalg.norm(rows, axis=1).tolist(), block.sigma.tolist(), strict=True):
            if off > _FIXTURE_OUTLIER:
                beside = "" if block.fixture is None else f" against {block.fixture}"
                found.append(f"{block.target}{beside} by {off * sigma * 1e3:.3g} mm, {off:.0f} times its deviation")
    if not found:
        return []
    return [
        Notice(
            "fixture-misplaced",
            f"Fixtures are not where, or not as far apart, as the file says: {', '.join(found)}. "
            "Check the names, units and numbers of these rows.",
        )
    ]


def _off(errors: Errors) -> Array:
    """Return how far off each position, distance or height is [m], NaN where there is none."""
    off: Array = np.linalg.norm(errors.position_errors, axis=1)
    return off if errors.length_errors is None else np.where(np.isfinite(off), off, np.abs(errors.length_errors))


def _misfit(robot: Robot, data: Dataset) -> float:
    """Return the median distance that the placed nominal robot leaves [m]; infinite if it cannot be placed."""
    if data.fixture is None:
        return float(np.median(errors_of(initial_frames(robot, data), data).position_norms))
    try:
        return float(np.nanmedian(_off(errors_of(start_from_readings(robot, data), data))))
    except InputError:
        return math.inf


def _spread(data: Dataset) -> float:
    """Return how far the readings lie apart [m]: positions that shrink fit better, but not in proportion."""
    if data.fixture is not None:
        counted = [data.position, *(v[:, None] for v in (data.distance, data.height) if v is not None)]
        return float(np.sqrt(np.nanmean(np.concatenate([v.reshape(-1) for v in counted]) ** 2))) + 1e-3
    return float(np.sqrt(np.mean(np.var(data.position[data.has_position], axis=0)))) + 1e-12


def _length_slips(data: Dataset) -> Iterator[_Slip]:
    for factor, words in (
        (1e-3, "a thousand times too large, as if mm were called m"),
        (1e3, "a thousand times too small, as if m were called mm"),
        (25.4, "25.4 times too small, as if inches were called mm"),
        (1 / 25.4, "25.4 times too large, as if mm were called inches"),
    ):
        what = "positions" if data.fixture is None else "lengths"
        words = f"The {what} are {words}. Mend the unit in the header"
        yield _Slip("unit-length", words, _scaled(data, factor))


def _scaled(data: Dataset, factor: float) -> Dataset:
    """Return the data with all measured lengths so many times as large."""

    def scaled(values: Array | None) -> Array | None:
        return None if values is None else values * factor

    setup = None if data.setup is None else _scaled(data.setup, factor)
    more = {"distance": scaled(data.distance), "height": scaled(data.height), "setup": setup}
    return replace(data, position=data.position * factor, **more)  # type: ignore[arg-type]


def _joint_slips(data: Dataset, at_once: int = 3) -> Iterator[_Slip]:
    """Try joints in other units, with other signs, as many of these `at_once`, and in another order."""
    count = data.joints.shape[1]
    turning = [i for i in range(count) if data.joint_kinds[i] == "revolute"]

    def with_joints(joints: Array) -> Dataset:
        return replace(data, joints=joints)

    groups = [turning, *([i] for i in turning)]
    for factor, words in (
        (math.pi / 180, "degrees are called rad"),
        (180 / math.pi, "radians are called deg"),
    ):
        for group in groups:
            joints = data.joints.copy()
            joints[:, group] *= factor
            which = "The joints" if len(group) > 1 else f"Joint {group[0] + 1}"
            yield _Slip("unit-angle", f"{which}: {words}. Mend the unit in the header", with_joints(joints))
    for size in range(1, at_once + 1):
        for group in map(list, combinations(range(count), size)):
            joints = data.joints.copy()
            joints[:, group] *= -1
            which = " and ".join(str(i + 1) for i in group)
            words = f"The sign of joint {which} is opposite to the robot's: the data fit with it changed. "
            yield _Slip("joint-sign", words + "Change it in the data, or correct the robot file", with_joints(joints))
    for a, b in combinations(range(count), 2):
        joints = data.joints.copy()
        joints[:, [a, b]] = joints[:, [b, a]]
        words = f"Joints {a + 1} and {b + 1} are in the wrong order: the data fit with the columns exchanged. "
        yield _Slip("joint-sign", words + "Exchange their columns", with_joints(joints))


def _some(data: Dataset) -> Dataset:
    if data.configurations <= _CONFIGURATIONS_TRIED:
        return data
    return data.of_configurations(np.linspace(0, data.configurations - 1, _CONFIGURATIONS_TRIED).astype(np.intp))


def _only(data: Dataset, target: int) -> Dataset:
    kept = (data.target == target) & data.has_position

    some = data.of_readings(kept)
    return replace(some, target=np.zeros(len(some.target), dtype=np.intp), targets=(data.targets[target],))


def _seen(data: Dataset, target: int) -> bool:
    return bool((data.has_position & (data.target == target)).any())


def _far_off(robot: Robot, data: Dataset) -> list[Suspect]:
    """Doubt readings that a robust geometric fit leaves far off."""
    geometric = next(m for m in MODELS if m.name == "geometric")
    fit = identify(robot, data, geometric, loss="cauchy")
    errors = errors_of(fit.robot, data)
    off = np.linalg.norm(errors.position_errors, axis=1)
    allowed = max(_LEAST_OUTLIER, _OUTLIER_RATIO * float(np.nanmedian(off)))
    doubted = np.flatnonzero(np.nan_to_num(off) > allowed)
    if len(doubted) == 0:
        return []
    predicted = np.stack([fit.robot.world_poses(data.postures, name)[0] for name in data.targets], axis=1)
    points = places_of(data)
    known = fixed_points(data)
    suspects = []
    for c in dict.fromkeys(data.configuration[doubted].tolist()):
        mine = [r for r in doubted.tolist() if data.configuration[r] == c]
        label = data.labels[c]
        for reading in mine:
            t = int(data.target[reading])
            at = data.position[reading]
            gaps = np.linalg.norm(predicted[c] - at, axis=1)
            nearest = int(np.argmin(gaps))
            name = data.targets[t]
            if nearest != t and gaps[nearest] <= allowed:
                other = data.targets[nearest]
                there = points.of(c, nearest)
                exchanged = there is not None and np.linalg.norm(there - predicted[c, t]) <= allowed
                code: Suspicion = "targets-swapped" if exchanged else "target-mistaken"
                suspects.append(Suspect(code, label, name, f"is target {other}"))
                continue
            before = points.of(c - 1, t)
            before_it = {} if before is None else {f"target {name} at the configuration before": before}
            suspects.append(suspect(at, label, name, float(off[reading]), before_it | known))
    return suspects
