"""Everything a fit is judged by: what may be wrong with it, how accurate it leaves the robot, what to do next."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from truearm.engine.base.errors import Notice, counted, has_error
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import Errors
from truearm.engine.diagnose.advice import check_fit
from truearm.engine.diagnose.arrivals import (
    check_arrival_lag,
    check_separate_visits,
    check_sigma,
    check_sigma_beside_joints,
    joints_as_far_off,
)
from truearm.engine.diagnose.changes import notices_of_change
from truearm.engine.diagnose.curves import check_curves, check_curves_of_loads, check_one_sided
from truearm.engine.diagnose.expected_error import ExpectedError, as_residuals_allow, expected_error
from truearm.engine.diagnose.external_force import check_payload
from truearm.engine.diagnose.far_off import ORIENTATION_OUTLIERS
from truearm.engine.diagnose.narrow_data import (
    FEW_READINGS,
    check_few_readings,
    check_narrow_data,
    check_narrow_data_without_geometry,
)
from truearm.engine.diagnose.next_step import NextStep
from truearm.engine.diagnose.next_steps import Judged, steps_after_fit, what_moved
from truearm.engine.diagnose.off_configurations import off_configurations
from truearm.engine.diagnose.slip_trials import ORIENTATION_SLIPS
from truearm.engine.diagnose.unmodelled import LeftOver
from truearm.engine.diagnose.wrong_robot import WRONG_ROBOT, check_plausible, check_robot, judges_lengths
from truearm.engine.fit.fit import Fit, Status
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.transmission import check_transmission

# Is what a fit leaves more than joints miss by, where no deviation is declared that would say so.
#
# Without a declared deviation all that is left counts as noise or as errors of the joints, however large it is. What
# joints of sound arms miss by is known: makers state a pose repeatability (RP of ISO 9283) of 0.01 mm for the ABB IRB
# 120, which reaches 0.58 m, and of 0.1 mm for the UR5, which reaches 0.85 m. If one joint did all of that, it would
# miss by 0.001 and 0.007 deg.

#: Errors of every joint, as the readings are left off, from which something else than repeatability is looked for.
_LARGEST: Final = math.radians(0.02)


def check_remainder(left: LeftOver) -> list[Notice]:
    """Return a notice if readings without declared deviations are left farther off than joints miss by.

    Nothing is said of models that leave the geometry alone: they leave it by design.
    """
    fit = left.fit
    if "geometry" not in fit.model.groups or any(block.declared for block in left.problem.blocks):
        return []
    seeming = joints_as_far_off(left)
    if seeming <= _LARGEST:
        return []
    off, more = math.degrees(seeming), "" if fit.model.tried else " (try `model=auto`)"
    return [
        Notice(
            "large-remainder",
            f"The readings are left as far off as if every joint missed by {off:.2g} deg at each arrival. Arms repeat "
            "to less than 0.01 deg. No deviation is declared, so all of that counts as noise and errors of the joints. "
            f"Look for what the {fit.model.name} model lacks{more}, for joint positions that were rounded "
            "or taken before the arm stood still, for an instrument or a base that moved, and for readings of another "
            "robot. If the instrument is no better, declare its deviation as sigma.",
        )
    ]


#: Codes of wrong readings that pull a fit away.
_PULLING: Final = frozenset({ORIENTATION_OUTLIERS, *ORIENTATION_SLIPS, "joints-mistaken", "unit-angle"})
#: The same, and single readings that are far off: what is left is not the robot's.
_DOUBTING: Final = _PULLING | {"outliers"}
#: Readings under the name of another point. A fit that they pull must not be used, and their names can be put right.
_MISNAMED: Final = frozenset({"targets-swapped", "target-mistaken"})
#: Readings that pull a fit, whatever is wrong with them.
DOUBTED: Final = _DOUBTING | _MISNAMED | {"joints-repeated"}
#: Losses with which a fit is pulled.
PULLED: Final = frozenset({"linear", "huber"})


@dataclass(frozen=True)
class Judgement:
    """What is said of a fit."""

    expected: ExpectedError  #: How accurate the robot is where it was not measured.
    warnings: tuple[Notice, ...]  #: What speaks against it, worst first.
    next: tuple[NextStep, ...]  #: What to do next.


def judge(
    fit: Fit,
    data: Dataset,
    training: Dataset,
    errors: Errors,
    noticed: Sequence[Notice],
    of_split: Sequence[Notice],
    loss: Loss,
    *,
    held_out: bool,
) -> Judgement:
    """Judge a fit.

    Args:
        data: All readings, training and held out.
        errors: By which it is judged: of what was held out, if `held_out`, of the training readings otherwise.
        noticed: What was said of the data before they were fitted.
        of_split: What speaks against the split.
        loss: Of the fit.
    """
    # What the robust fit of the check could not explain, the fit itself may.
    # How many readings it is made from, it knows itself.
    noticed = tuple(n for n in noticed if n.code not in (Status.IMPLAUSIBLE.value, FEW_READINGS))
    left_over = LeftOver.of(fit, data)
    off = off_configurations(left_over)
    moved_then = what_moved(left_over, off)
    changes = [] if moved_then is None else notices_of_change(*moved_then)
    told = [notice for notice in noticed if notice.code == WRONG_ROBOT]
    noticed = tuple(
        replace(notice, level="error") if notice.code in _MISNAMED and loss in PULLED else notice
        for notice in noticed
        if notice.code != WRONG_ROBOT
    )
    # A fit that these pull away leaves much and expects much, whatever the model and wherever was measured. Of its
    # lengths the robust fit of the check knows more.
    bent = loss in PULLED and any(notice.code in _PULLING for notice in noticed)
    wrong_robot = check_robot(fit, training) if judges_lengths(fit) and not bent else told
    if has_error([*noticed, *changes]):  # what is wrong with the data bends the robot too
        wrong_robot = []
    unlike = check_plausible(fit, training, (*noticed, *wrong_robot, *told))
    if unlike:
        wrong_robot = wrong_robot or told
    readings_doubted = has_error([*noticed, *changes]) or any(notice.code in _DOUBTING for notice in noticed)
    expected = expected_error(as_residuals_allow(fit, training), plausible=not unlike, doubted=readings_doubted)
    wrong_sigma = check_sigma(left_over)
    hidden = [] if unlike or has_error(wrong_sigma) else check_sigma_beside_joints(left_over)
    explained = [*changes, *check_arrival_lag(left_over)]
    doubted = has_error([*unlike, *wrong_robot, *noticed])
    if not explained and not doubted and not any(notice.code == "joints-rounded" for notice in noticed):
        explained = check_remainder(left_over)
    narrow: list[Notice] = []
    few = check_few_readings(fit)
    eaten = bool(few) and not held_out  # then the error of the readings says nothing of the fit
    if not bent and not unlike and not eaten and (hidden or not wrong_sigma):  # more configurations do not mend these
        if fit.model.groups and "geometry" not in fit.model.groups:
            narrow = check_narrow_data_without_geometry(fit, training, errors, loss, held_out=held_out)
        narrow = narrow or check_narrow_data(fit, expected, training, errors, held_out=held_out)
    warnings = (
        *(notice for notice in noticed if notice.level == "error"),
        *unlike,
        *wrong_robot,
        *of_split,
        *check_payload(fit.start),
        *few,
        *(n for n in check_fit(fit, expected, doubted=doubted) if not bent or n.code != "residuals-exceed-sigma"),
        *narrow,
        *(notice for notice in noticed if notice.level != "error"),
        *check_one_sided(fit, training),
        *(hidden or wrong_sigma),
        *([] if doubted else check_separate_visits(left_over)),
        *explained,
        *check_transmission(fit, training),
        *check_curves(fit, training),
        *([] if doubted else check_curves_of_loads(left_over)),
        *_in_part(left_over),
    )
    status = Status.IMPLAUSIBLE if unlike else fit.status
    judged = Judged(left_over, status, warnings, off, moved_then, errors, held_out, expected, training, bent)
    return Judgement(expected, warnings, steps_after_fit(judged))


def _in_part(left: LeftOver) -> list[Notice]:
    """Say if what the fit leaves was looked at in part of the configurations alone."""
    if len(left.chosen) == left.given.configurations:
        return []
    return [
        Notice(
            "judged-in-part",
            f"The data are large for so many parameters: what the fit leaves was looked at in {len(left.chosen)} of "
            f"{counted(left.given.configurations, 'configuration')}, evenly spaced. What is off or changed at others "
            "alone is not told. Parameters and errors are those of all configurations.",
            "note",
        )
    ]
