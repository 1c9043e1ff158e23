"""Everything a fit is judged by: what may be wrong with it, how accurate it leaves the robot, what to do next."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

from truearm.engine.base.errors import Notice, Rule, counted, has_error, worst_first
from truearm.engine.data.thinning import JUDGED_IN_PART
from truearm.engine.diagnose.advice import check_far_from_nominal, check_fit
from truearm.engine.diagnose.case import Case
from truearm.engine.diagnose.changes import OF_CHANGES
from truearm.engine.diagnose.curves import check_curves, check_curves_of_loads, check_one_sided
from truearm.engine.diagnose.expected_error import ExpectedError
from truearm.engine.diagnose.external_force import check_payload, check_payload_read
from truearm.engine.diagnose.narrow_data import (
    check_narrow_data,
    check_narrow_data_without_geometry,
)
from truearm.engine.diagnose.next_step import NextStep
from truearm.engine.diagnose.next_steps import steps_after_fit
from truearm.engine.diagnose.plausibility import JOINTS_ROUNDED
from truearm.engine.diagnose.unmodelled import HIDING, WRONG_DATA, LeftOver
from truearm.engine.diagnose.visits import (
    JOINTS_NOT_SETTLED,
    check_approach_lag,
    check_separate_visits,
    joints_as_far_off,
)
from truearm.engine.fit.transmission import check_transmission
from truearm.engine.robot.loads import has_weight

# Is what a fit leaves more than joints miss by, where no deviation is declared that would say so.
#
# Without a declared deviation all that is left counts as noise or as errors of the joints, however large it is. What
# joints of sound arms miss by is known: makers state a pose repeatability (RP of ISO 9283) of 0.01 mm for the ABB IRB
# 120, which reaches 0.58 m, and of 0.1 mm for the UR5, which reaches 0.85 m. If one joint did all of that, it would
# miss by 0.001 and 0.007 deg.

#: Errors of every joint, as the readings are left off, from which something else than repeatability is looked for.
#: Where nobody knows the loads as much again is left: they turn joints by some hundredths of a degree.
_LARGEST: Final = math.radians(0.02)
_LARGEST_RIGID: Final = math.radians(0.04)


LARGE_RESIDUAL: Final = Rule(
    "large-residual",
    "warning",
    "no sigma is declared, and a model that fits the geometry leaves the readings farther off than joints miss by",
    unless=OF_CHANGES | {WRONG_DATA, JOINTS_NOT_SETTLED.code, JOINTS_ROUNDED.code},
    formerly="large-remainder",
)


def check_residual(left: LeftOver) -> list[Notice]:
    """Return a notice if readings without declared deviations are left farther off than joints miss by.

    Nothing is said of models that leave the geometry alone: they leave it by design.
    """
    fit = left.fit
    if "geometry" not in fit.model.groups or any(block.declared for block in left.problem.blocks):
        return []
    seeming = joints_as_far_off(left)
    if seeming <= (_LARGEST if fit.model.weighed or has_weight(fit.robot) else _LARGEST_RIGID):
        return []
    off, more = math.degrees(seeming), "" if fit.model.weighed else " (try `model=auto`)"
    return [
        LARGE_RESIDUAL(
            f"The readings are left as far off as if every joint missed by {off:.2g} deg at each visit. Arms repeat "
            "to less than 0.01 deg. No deviation is declared, so all of that counts as noise and errors of the joints. "
            f"Look for what the {fit.model.name} model lacks{more}, for joint positions that were rounded "
            "or taken before the arm stood still, for an instrument or a base that moved, and for readings of another "
            "robot. If the instrument is no better, declare its deviation as sigma."
        )
    ]


@dataclass(frozen=True)
class Diagnosis:
    """What is said of a fit."""

    expected: ExpectedError  #: How accurate the robot is where it was not measured.
    warnings: tuple[Notice, ...]  #: What speaks against it, worst first.
    next: tuple[NextStep, ...]  #: What to do next.


def _check_narrow(case: Case) -> list[Notice]:
    """Say if the workspace is known worse than the readings that judge the fit say.

    Deviations that are too large, and readings that the parameters take up, are not corrected by more configurations.
    """
    too_large, hiding = case.sigma
    if (case.few and not case.held_out) or (too_large and not hiding):
        return []
    fit, narrow = case.fit, list[Notice]()
    if fit.model.groups and not fit.knows_geometry:
        narrow = check_narrow_data_without_geometry(fit, case.training, case.errors, fit.loss, held_out=case.held_out)
    return narrow or check_narrow_data(fit, case.expected, case.training, case.errors, held_out=case.held_out)


def _check_payload(case: Case) -> list[Notice]:
    """Say if the payload cannot be the one that was carried; where the data are wrong, they say nothing of it."""
    unlikely, wrong = check_payload(case.fit.start), has_error([*case.of_data, *case.of_robot, *case.changes])
    if unlikely or wrong or case.biased or not case.fit.model.weighed:
        return unlikely
    return check_payload_read(case.left_by_few)


#: What is asked of every fit. What one tells may silence another, by :attr:`Rule.unless`.
CHECKS: Final[tuple[Callable[[Case], Iterable[Notice]], ...]] = (
    lambda case: case.of_data,
    lambda case: case.of_robot,
    lambda case: check_separate_visits(case.left),
    lambda case: check_curves_of_loads(case.left),
    lambda case: check_far_from_nominal(case.fit),
    lambda case: case.changes,
    lambda case: check_approach_lag(case.left_by_few),
    lambda case: check_residual(case.left),
    _check_narrow,
    lambda case: case.of_split,
    _check_payload,
    lambda case: case.few,
    lambda case: check_fit(case.fit, case.expected, explained=case.lacking is not None and case.lacking.left < HIDING),
    lambda case: check_one_sided(case.fit, case.training),
    lambda case: case.sigma[1] or case.sigma[0],
    lambda case: check_transmission(case.fit, case.training),
    lambda case: check_curves(case.fit, case.training),
    lambda case: _in_part(case.left),
)


def diagnose(case: Case) -> Diagnosis:
    """Judge a fit: ask every check, leave out what others silence, and say what to do next."""
    warnings = worst_first(case.unsilenced([notice for check in CHECKS for notice in check(case)]))
    return Diagnosis(case.expected, warnings, steps_after_fit(case, warnings))


def _in_part(left: LeftOver) -> list[Notice]:
    """Say if what the fit leaves was looked at in part of the configurations alone."""
    if len(left.chosen) == left.asked.configurations:
        return []
    return [
        JUDGED_IN_PART(
            f"The data are large for so many parameters: what the fit leaves was looked at in {len(left.chosen)} of "
            f"{counted(left.asked.configurations, 'configuration')}, evenly spaced. What is off or changed at others "
            "alone is not told. Parameters and errors are those of all configurations."
        )
    ]
