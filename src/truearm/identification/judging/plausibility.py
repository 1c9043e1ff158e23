"""Is the data believable for this robot: slips with units, signs and orders, limits, and readings far off."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from itertools import combinations
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.identification.judging.exchanged_names import exchanged_names
from truearm.identification.judging.far_off import allowed_off, far_off, often_off
from truearm.identification.judging.few_readings import check_few_to_doubt
from truearm.identification.judging.implausible import check_plausible
from truearm.identification.judging.joint_rounding import check_rounding
from truearm.identification.judging.orientation_slips import ORIENTATION_SLIPS
from truearm.identification.judging.orientations_off import check_orientations, orientations_off, without_orientations
from truearm.identification.judging.slips import off_by, slips_by_fit, slips_in_lengths, slips_in_positions
from truearm.identification.judging.wrong_robot import check_robot, other_robot
from truearm.identification.solving.fit import Fit, identify, place
from truearm.identification.solving.models import named_model
from truearm.identification.solving.problem import Problem
from truearm.identification.start_values.from_readings import start_from_readings
from truearm.measurement.dataset import Dataset
from truearm.measurement.observations import OBSERVATIONS
from truearm.measurement.rigid_tool import Suspect
from truearm.measurement.statistics import errors_of
from truearm.modeling.chain import Array
from truearm.modeling.parameters import FreeParameters
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.units import from_si

#: Two targets are one point if they are nearer each other than this [m], or than so many deviations.
_SAME_TARGET: Final = 5e-5
_SAME_DEVIATIONS: Final = 4.0
#: How like names are that a slip takes for each other, and among how many targets they are looked for.
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
    found = _beyond_limits(robot, data)
    if data.fixture is not None:
        try:
            start_from_readings(robot, data)
        except InputError as error:
            return Comparison([Notice("fixtures-unlikely", str(error), "error"), *found])
        slips = slips_in_lengths(robot, data)
        if slips:
            return Comparison([*slips, *found])
        fit = identify(robot, data, named_model("geometric"), loss="cauchy")
        unlike, off_fixtures = _far_from_fixtures(fit, data)
        return Comparison([*check_robot(fit, data), *unlike, *found], off_fixtures, fit, data)
    if not data.has_position.any():
        return Comparison(found)
    slips = slips_in_positions(robot, data)
    if slips and all(slip.code in ORIENTATION_SLIPS for slip in slips):  # the positions are this robot's
        return Comparison([*slips, *found])
    if slips:
        return Comparison([*(other_robot(robot, data) or slips), *found])
    fit = identify(robot, data, named_model("geometric"), loss="cauchy")
    errors = errors_of(fit.robot, data)
    off = off_by(errors)
    if np.nanmedian(off) > _FITTED_WITHIN:
        slips = slips_by_fit(robot, data)
        if slips:
            return Comparison([*(other_robot(robot, data) or slips), *found])
    wrong = check_robot(fit, data)
    unlike_robot = check_plausible(fit, data, wrong)
    exchanged = exchanged_names(fit, data)
    if unlike_robot:
        return Comparison([*unlike_robot, *wrong, *found], exchanged)
    doubted = check_few_to_doubt(fit)
    suspects: list[Suspect] = []
    turned = np.zeros(len(off), dtype=bool)
    if not doubted:
        turned = orientations_off(errors)
        alone = turned & ~(np.nan_to_num(off) > allowed_off(off))
        mistaken, suspects = far_off(fit, data, off, turned)
        suspects += exchanged
        doubted = [*mistaken, *check_orientations(fit, data, errors, alone), *often_off(data, off)]
        turned = alone
    return Comparison(
        [
            *wrong,
            *found,
            *doubted,
            *_one_point(fit, data),
            *check_rounding(fit, data),
            *_computed(robot, data, off),
        ],
        suspects,
        fit,
        without_orientations(data, turned),
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
        Notice(
            "positions-computed",
            f"{robot.name} misses the readings by {spread.rms * 1e3:.2g} mm before any calibration (root mean square). "
            "No real arm and no instrument is as good: a controller computes such positions from its joints. Give "
            "what an instrument measured.",
        )
    ]


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
        Notice(
            "beyond-limits",
            f"Joint positions are beyond the limits of {robot.name}: {'; '.join(words)}. Check units, joint order and "
            "the limits in the robot file.",
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


def _one_point(fit: Fit, data: Dataset) -> list[Notice]:
    """Say if two targets with like names are the same point, each read where the other one is missing."""
    robot, found = fit.robot, []
    seen = {name: set(data.configuration[data.has_reading & (data.target == t)].tolist()) for t, name in _some(data)}
    for (one, at), (other, there) in combinations(seen.items(), 2):
        if not at or not there or at & there or not _like(one, other):
            continue
        axes = [(robot.target(one).parameter(axis), robot.target(other).parameter(axis)) for axis in "xyz"]
        apart = math.dist([robot.values[a] for a, _ in axes], [robot.values[b] for _, b in axes])
        deviation = math.hypot(*(robot.parameters[name].deviation or 0.0 for pair in axes for name in pair))
        if apart <= max(_SAME_TARGET, _SAME_DEVIATIONS * deviation):
            found.append(f"{one} and {other} are {apart * 1e3:.2g} mm apart, and never read together")
    if not found:
        return []
    return [
        Notice(
            "target-misspelt",
            f"Targets with like names are the same point on the flange: {'; '.join(found)}. If one name is misspelt, "
            "correct it: a misspelt name is a target of its own.",
            "error",
        )
    ]


def _some(data: Dataset) -> list[tuple[int, str]]:
    return list(enumerate(data.targets))[:_MOST_TARGETS]


def _like(one: str, other: str) -> bool:
    """Return whether names differ by a slip: not by a number, as those of a row of targets do."""
    same_numbers = re.findall("[0-9]+", one) == re.findall("[0-9]+", other)
    return same_numbers and SequenceMatcher(None, one.casefold(), other.casefold()).ratio() >= _LIKE
