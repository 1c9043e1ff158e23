"""Is the data believable for this robot: data-entry errors, joint limits, and readings far off."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from itertools import combinations
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, has_error
from truearm.engine.base.units import from_si
from truearm.engine.data.checks import TARGET_MISSPELT
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.data.rigid_tool import OUTLIERS, TARGETS_SWAPPED, Suspect, places_of
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.entry_error_trials import ORIENTATION_ORDER
from truearm.engine.diagnose.entry_errors import (
    FIXTURES_UNLIKELY,
    entry_errors_by_fit,
    entry_errors_in_lengths,
    entry_errors_in_positions,
    off_by,
)
from truearm.engine.diagnose.far_off import (
    allowed_off,
    check_orientations,
    far_off,
    often_off,
    orientations_off,
    without_orientations,
)
from truearm.engine.diagnose.narrow_data import check_few_to_doubt
from truearm.engine.diagnose.unmodelled import HIDING, LeftOver, explanation
from truearm.engine.diagnose.visits import VisitLikelihood, joints_as_far_off
from truearm.engine.diagnose.wrong_robot import check_plausible, check_robot, other_robot
from truearm.engine.fit.fit import Fit, identify, place
from truearm.engine.fit.models import named_model
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.start_values import start_from_readings
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot

# Targets whose names were exchanged at some configurations, however many.
#
# Where names are exchanged, the line from one target to the other points the opposite way on the flange. Nothing else
# turns it round: neither noise nor an error of the robot does. So no majority is needed, as it is where readings are
# compared with a fit or with the usual distances, which half of the configurations pull half the way.

#: Among so many targets exchanged names are looked for.
_MOST: Final = 6
#: Fewer configurations with both targets tell nothing.
_LEAST: Final = 4
#: Lines are alike whose directions differ by a cosine of at least so much, and whose lengths by at most such a share.
_PARALLEL: Final = 0.95
_SAME_LENGTH: Final = 0.1
#: Share of the lines that must be alike: else they are no lines of a rigid tool.
_ALIKE: Final = 0.9


def exchanged_names(fit: Fit, data: Dataset) -> list[Suspect]:
    """Doubt readings of two targets that lie the other way round than at most configurations.

    Args:
        fit: Of the robot; it need not be a good one.
    """
    names = data.targets
    if not 2 <= len(names) <= _MOST:
        return []
    places = places_of(data)
    at = np.full((data.configurations, len(names), 3), np.nan)
    at[places.configuration, places.target] = places.position
    turned = fit.robot.world_poses(data.postures, names[0])[1]
    on_flange = np.einsum("cji,ctj->cti", turned, at)  # but for one shift at each configuration
    lines = {pair: on_flange[:, pair[1]] - on_flange[:, pair[0]] for pair in combinations(range(len(names)), 2)}
    suspects: dict[tuple[int, int], Suspect] = {}
    for (a, b), line in sorted(lines.items(), key=lambda item: -_length(item[1])):
        for c in _turned_round(line):
            if (c, a) not in suspects and (c, b) not in suspects:
                for first, other in ((a, b), (b, a)):
                    word = f"is target {names[other]}"
                    suspects[c, first] = Suspect(TARGETS_SWAPPED, data.labels[c], names[first], word)
    return [*suspects.values()]


def _length(line: Array) -> float:
    """Return the usual length of a line [m], 0 if it was never read."""
    read = np.isfinite(line).all(axis=1)
    return float(np.median(np.linalg.norm(line[read], axis=1))) if read.any() else 0.0


def _turned_round(line: Array) -> list[int]:
    """Return the configurations at which a line from one target to another points the opposite way.

    Args:
        line: In axes of the flange [m], ``(configurations, 3)``, NaN where one of the targets was not read.
    """
    read = np.flatnonzero(np.isfinite(line).all(axis=1))
    if len(read) < _LEAST:
        return []
    positions, usual = line[read], _length(line)
    along = positions @ np.linalg.svd(positions, full_matrices=False)[2][0]
    length = np.linalg.norm(positions, axis=1)
    alike = (np.abs(along) >= _PARALLEL * length) & (np.abs(length - usual) <= _SAME_LENGTH * usual)
    if alike.mean() < _ALIKE:
        return []
    mostly = 1.0 if np.sum(along[alike] > 0.0) > alike.sum() / 2.0 else -1.0
    return [int(c) for c in read[alike & (mostly * along < 0.0)]]


# Were the joint positions rounded: all of them multiples of a coarse step, and what is left as large as that makes it.
#
# A plan in whole degrees is honest, and its joint positions are multiples too: so the joints must also err as a
# rounding to that step makes them, by the step over the square root of 12, evenly spread.

#: Steps that positions are rounded to, by the unit of the file, the largest first; smaller ones do nothing to a fit.
_STEPS: Final = {"deg": (10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05), "rad": (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)}
#: Share of a step within which a position is a multiple of it.
_EXACT: Final = 1e-4
#: Share of the positions that are multiples, at least.
_MOST_JOINT_ROUNDING: Final = 0.99
#: Turning joints that move, and positions, without which nothing is said.
_LEAST_JOINTS: Final = 2
_LEAST_POSITIONS: Final = 30
#: What the joints seem to err by, over what rounding to the step makes them.
_ALIKE_JOINT_ROUNDING: Final = (0.6, 1.6)
#: Twice the gain in likelihood by errors of that size.
_LEAST_GAIN: Final = 20.0


def step_of(data: Dataset) -> tuple[float, str] | None:
    """Return the coarsest step, and its unit, that the positions of all turning joints are multiples of; None if fine.

    Joints that stand still say nothing.
    """
    moving = [i for i, kind in enumerate(data.joint_kinds) if kind == "revolute" and np.ptp(data.joints[:, i]) > 0.0]
    joints = data.joints[:, moving]
    if len(moving) < _LEAST_JOINTS or joints.size < _LEAST_POSITIONS:
        return None
    for unit, steps in _STEPS.items():
        shown = np.degrees(joints) if unit == "deg" else joints
        for step in steps:
            many = shown / step
            if np.mean(np.abs(many - np.round(many)) <= _EXACT) >= _MOST_JOINT_ROUNDING:
                return step, unit
    return None


JOINTS_ROUNDED: Final = Rule(
    "joints-rounded",
    "warning",
    "joint positions that are all multiples of 0.05 deg or 0.001 rad, or of a coarser step, and joints that err as "
    "rounding to it makes them",
    cure="Give them with all digits that the controller shows. If they were commanded like that, something else errs "
    "by as much.",
)


def check_rounding(fit: Fit, data: Dataset) -> list[Notice]:
    """Return a notice if joint positions are multiples of a step and are off as rounding to it makes them.

    Args:
        fit: Of the data, or of a part of them.
    """
    rounding = step_of(data)
    if rounding is None or not data.has_position.any():
        return []
    step, unit = rounding
    by_rounding = (math.radians(step) if unit == "deg" else step) / math.sqrt(12.0)
    left = LeftOver.of(fit, data)
    seeming = joints_as_far_off(left)
    if not _ALIKE_JOINT_ROUNDING[0] * by_rounding <= seeming <= _ALIKE_JOINT_ROUNDING[1] * by_rounding:
        return []
    readings = VisitLikelihood.of(left)
    turning = np.array([joint.kind == "revolute" for joint in fit.robot.joints], dtype=float)
    rounded = readings.largest(joints=by_rounding**2 * turning)[1]
    if 2.0 * (rounded - readings.largest(joints=0.0 * turning)[1]) < _LEAST_GAIN:
        return []
    return [
        JOINTS_ROUNDED(
            f"The joint positions are multiples of {step:g} {unit}, and the joints seem to err by "
            f"{math.degrees(seeming):.2g} deg, where rounding to that step makes {math.degrees(by_rounding):.2g} deg."
        )
    ]


#: Two targets are one point if they are nearer each other than this [m], or than so many deviations.
_SAME_TARGET: Final = 5e-5
_SAME_DEVIATIONS: Final = 4.0
#: How like names are that a data-entry error takes for each other, and among how many targets they are looked for.
_LIKE: Final = 0.75
_MOST_TARGETS: Final = 40
#: A fit whose median reading is off by less than this needs no explanation [m].
_FITTED_WITHIN: Final = 3e-4
#: No uncalibrated arm is as good as this, and no instrument at an arm's distance [m].
_COMPUTED_WITHIN: Final = 2e-5
#: Fewer configurations say nothing of that.
_LEAST_COMPUTED: Final = 10
#: What is said of a fixture is doubted beyond this many deviations.
_FIXTURE_OUTLIER: Final = 8.0
#: A joint may be this far beyond its limit by rounding [rad or m].
_LIMIT_ROUNDING: Final = math.radians(0.05)


@dataclass(frozen=True, eq=False)
class Comparison:
    """What is said of a dataset if it was measured on a robot."""

    notices: list[Notice]  #: notices, suspects: what is wrong with it, and the readings far off.
    suspects: list[Suspect] = field(default_factory=list)
    fit: Fit | None = None  #: A robust one; None where none was made, or where it is of no use.
    believed: Dataset | None = None  #: The readings without the orientations that are doubted; None without a fit.


def check_against(robot: Robot, data: Dataset) -> Comparison:
    """Compare a dataset with the robot that it was measured on.

    Args:
        robot: The nominal robot, with as many joints as the data; its base and targets are left out of account.
    """
    notices = _beyond_limits(robot, data)
    if data.fixture is not None:
        try:
            start_from_readings(robot, data)
        except InputError as error:
            return Comparison([FIXTURES_UNLIKELY(str(error)), *notices])
        entries = entry_errors_in_lengths(robot, data)
        if entries:
            return Comparison([*entries, *notices])
        fit = identify(robot, data, named_model("geometric"), loss="cauchy")
        unlike, off_fixtures = _far_from_fixtures(fit, data)
        return Comparison([*check_robot(fit, data), *unlike, *notices], off_fixtures, fit, data)
    if not data.has_position.any():
        return Comparison(notices)
    entries = entry_errors_in_positions(robot, data)
    if entries and all(entry.code == ORIENTATION_ORDER.code for entry in entries):  # the positions are this robot's
        return Comparison([*entries, *notices])
    if entries:
        return Comparison([*(other_robot(robot, data) or entries), *notices])
    fit = identify(robot, data, named_model("geometric"), loss="cauchy")
    errors = errors_of(fit.robot, data)
    off = off_by(errors)
    if np.nanmedian(off) > _FITTED_WITHIN:
        entries = entry_errors_by_fit(robot, data)
        if entries:
            return Comparison([*(other_robot(robot, data) or entries), *notices])
    wrong = check_robot(fit, data)
    exchanged = exchanged_names(fit, data)
    unlike_robot = check_plausible(fit, data, [*(n.code for n in wrong), *(s.rule.code for s in exchanged)])
    if unlike_robot:
        return Comparison([*wrong, *([] if has_error(wrong) else unlike_robot), *notices], exchanged)
    doubted = check_few_to_doubt(fit)
    suspects: list[Suspect] = []
    turned = np.zeros(len(off), dtype=bool)
    if not doubted:
        turned = orientations_off(errors)
        alone = turned & ~(np.nan_to_num(off) > allowed_off(off))
        mistaken, suspects = far_off(fit, data, off, turned)
        known = {label for notice in mistaken for label, _ in notice.at}  # the flange is not turned as it says there
        suspects += [suspect for suspect in exchanged if suspect.configuration not in known]
        doubted = [*mistaken, *check_orientations(fit, data, errors, alone)]
        often = often_off(data, off)
        if often and not _gives_way(fit, data):
            doubted += often
        turned = alone
    return Comparison(
        [*wrong, *notices, *doubted, *_one_point(fit, data), *check_rounding(fit, data), *_computed(robot, data, off)],
        suspects,
        fit,
        without_orientations(data, turned),
    )


POSITIONS_COMPUTED: Final = Rule(
    "positions-computed",
    "warning",
    "positions that the uncalibrated robot meets within 0.02 mm, as a controller computes them and no arm attains",
    cure="Give what an instrument measured.",
    gravity=2,
)


def _computed(robot: Robot, data: Dataset, off: Array) -> list[Notice]:
    """Return a notice if the uncalibrated robot fits better than any arm is: somebody computed the positions.

    Args:
        off: By how much each reading is off after a calibration [m].
    """
    if robot.proof is not None or data.configurations < _LEAST_COMPUTED or np.nanmedian(off) > _COMPUTED_WITHIN:
        return []
    spread = errors_of(place(robot, data), data).position
    if spread is None or spread.rms > _COMPUTED_WITHIN:
        return []
    return [
        POSITIONS_COMPUTED(
            f"{robot.name} misses the readings by {spread.rms * 1e3:.2g} mm before any calibration (root mean square). "
            "No real arm and no instrument is as good: a controller computes such positions from its joints."
        )
    ]


BEYOND_LIMITS: Final = Rule(
    "beyond-limits",
    "warning",
    "joint positions outside the robot's limits",
    cure="Check units, joint order and the limits in the robot file.",
)


def _gives_way(fit: Fit, data: Dataset) -> bool:
    """Return whether an effect explains much of what a robust fit leaves, which meets half of the readings."""
    found = explanation(LeftOver.of(fit, data))
    return found is not None and found.left < HIDING


def _beyond_limits(robot: Robot, data: Dataset) -> list[Notice]:
    words, beyond = [], np.zeros(data.configurations, dtype=bool)
    for i, joint in enumerate(robot.joints):
        if joint.limits is None:
            continue
        low, high = joint.limits
        out = (data.joints[:, i] < low - _LIMIT_ROUNDING) | (data.joints[:, i] > high + _LIMIT_ROUNDING)
        if out.any():
            beyond |= out
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
        BEYOND_LIMITS(
            f"Joint positions are beyond the limits of {robot.name}: {'; '.join(words)}.",
            at=tuple((data.labels[c], "") for c in np.flatnonzero(beyond).tolist()),
        )
    ]


def _far_from_fixtures(fit: Fit, data: Dataset) -> tuple[list[Notice], list[Suspect]]:
    """Doubt readings against fixtures that a robust geometric fit leaves far off, and what is said of fixtures."""
    few = check_few_to_doubt(fit)
    if few:
        return [*_unlike_its_readings(fit, data), *few], []
    errors = errors_of(fit.robot, data)
    off = off_by(errors)
    doubted = np.flatnonzero(np.nan_to_num(off) > allowed_off(off)).tolist()
    places = [(data.labels[data.configuration[r]], data.targets[data.target[r]]) for r in doubted]
    suspects = [Suspect(OUTLIERS, *at, f"{off[r] * 1e3:.3g} mm off") for r, at in zip(doubted, places, strict=True)]
    unlike = _unlike_its_readings(fit, data)
    return [] if unlike and _gives_way(fit, data) else unlike, suspects


FIXTURE_MISPLACED: Final = Rule(
    "fixture-misplaced",
    "warning",
    "fixtures that are not where, or not as far apart, as the file says",
    cure="Check the names, units and numbers of these rows.",
    gravity=2,
)


def _unlike_its_readings(fit: Fit, data: Dataset) -> list[Notice]:
    """Say where fixtures are not where, or not as far apart as, the file says."""
    if data.setup is None:
        return []
    problem = Problem(fit.robot, data, FreeParameters(()), {observation.name: 1.0 for observation in OBSERVATIONS})
    residual, first = problem.residual(np.zeros(0)), 0
    unlike = []
    for block in problem.blocks:
        rows = residual[first : first + block.rows].reshape(len(block.readings), -1)
        first += block.rows
        if block.data is data:
            continue
        for off, sigma in zip(np.linalg.norm(rows, axis=1).tolist(), block.sigma.tolist(), strict=True):
            if off > _FIXTURE_OUTLIER:
                beside = "" if block.fixture is None else f" against {block.fixture}"
                unlike.append(f"{block.target}{beside} by {off * sigma * 1e3:.3g} mm, {off:.0f} times its deviation")
    if not unlike:
        return []
    return [FIXTURE_MISPLACED(f"Fixtures are not where, or not as far apart, as the file says: {', '.join(unlike)}.")]


def _one_point(fit: Fit, data: Dataset) -> list[Notice]:
    """Say if two targets with like names are the same point, each read where the other one is missing."""
    robot, pairs = fit.robot, []
    seen = {name: set(data.configuration[data.has_reading & (data.target == t)].tolist()) for t, name in _some(data)}
    for (target, at), (other, other_at) in combinations(seen.items(), 2):
        if not at or not other_at or at & other_at or not _like(target, other):
            continue
        axes = [(robot.target(target).parameter(axis), robot.target(other).parameter(axis)) for axis in "xyz"]
        apart = math.dist([robot.values[a] for a, _ in axes], [robot.values[b] for _, b in axes])
        deviation = math.hypot(*(robot.parameters[name].deviation or 0.0 for pair in axes for name in pair))
        if apart <= max(_SAME_TARGET, _SAME_DEVIATIONS * deviation):
            pairs.append(f"{target} and {other} are {apart * 1e3:.2g} mm apart, and never read together")
    if not pairs:
        return []
    return [
        TARGET_MISSPELT(
            f"Targets with like names are the same point on the flange: {'; '.join(pairs)}. If one name is misspelt, "
            "correct it: a misspelt name is a target of its own."
        )
    ]


def _some(data: Dataset) -> list[tuple[int, str]]:
    return list(enumerate(data.targets))[:_MOST_TARGETS]


def _like(name: str, other: str) -> bool:
    """Return whether names differ by a data-entry error: not by a number, as those of a row of targets do."""
    same_numbers = re.findall("[0-9]+", name) == re.findall("[0-9]+", other)
    return same_numbers and SequenceMatcher(None, name.casefold(), other.casefold()).ratio() >= _LIKE
