"""What every check of a fit looks at: the fit, its data, and what follows from them once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from truearm.engine.base.errors import Notice, has_error
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.rigid_tool import OUTLIERS, TARGET_MISTAKEN, TARGETS_SWAPPED
from truearm.engine.data.statistics import Errors
from truearm.engine.data.thinning import JOINTS_REPEATED
from truearm.engine.diagnose.changes import Change, notices_of_change, what_moved
from truearm.engine.diagnose.entry_error_trials import ROWS_SHIFTED
from truearm.engine.diagnose.expected_error import ExpectedError, expected_error, moved_by_order
from truearm.engine.diagnose.far_off import PULLING
from truearm.engine.diagnose.narrow_data import FEW_READINGS, check_few_readings
from truearm.engine.diagnose.off_configurations import Off, off_configurations
from truearm.engine.diagnose.position_errors import as_residuals_allow
from truearm.engine.diagnose.unmodelled import PULLED_AWAY, WRONG_DATA, Explanation, LeftOver, explanation
from truearm.engine.diagnose.unseen import Unseen
from truearm.engine.diagnose.visits import check_sigma, check_sigma_beside_joints
from truearm.engine.diagnose.wrong_robot import (
    IMPLAUSIBLE,
    WRONG_ROBOT,
    check_plausible,
    check_robot,
    judges_lengths,
)
from truearm.engine.fit.fit import Fit, Status, identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.effects.compliance import Compliance

#: Readings that pull a fit, and single ones that are far off: what is left is not the robot's.
_DOUBTING: Final = PULLING | {OUTLIERS.code}
#: Readings under the name of another point or row. A fit that they pull must not be used, and they can be put right.
MISNAMED: Final = frozenset({TARGETS_SWAPPED.code, TARGET_MISTAKEN.code, ROWS_SHIFTED.code})
#: All readings that may pull a fit, whatever is wrong with them.
DOUBTED: Final = _DOUBTING | MISNAMED | {JOINTS_REPEATED.code}
#: Losses with which a fit is pulled.
PULLED: Final = frozenset({"linear", "huber"})


@dataclass(frozen=True, eq=False)
class Case:
    """A fit, its data, and what follows from them: what every check looks at."""

    fit: Fit
    data: Dataset  #: All readings, training and held out.
    training: Dataset
    unseen: Unseen | None  #: What was held out, where it says how uncertain the parameters are.
    errors: Errors  #: By which it is judged: of what was held out, if `held_out`, of the training readings otherwise.
    noticed: tuple[Notice, ...]  #: What was said of the data before they were fitted.
    of_split: tuple[Notice, ...]  #: What speaks against the split.
    held_out: bool

    @cached_property
    def left(self) -> LeftOver:
        """What the fit leaves of all readings."""
        return LeftOver.of(self.fit, self.data)

    @cached_property
    def left_by_few(self) -> LeftOver:
        """What the fit leaves; where every effect is in it, what one leaves whose joints give way at most.

        Every effect together takes up much of what is wrong with data, too.
        """
        fit = self.fit
        if not fit.model.weighed:
            return self.left
        model = named_model("elastic" if Compliance.name in fit.model.effects else "geometric")
        few = identify(fit.start, self.training, model, loss=fit.loss, fixed=fit.fixed)
        return LeftOver.of(few, self.data)

    @cached_property
    def off(self) -> Off:
        """The configurations that are off one by one."""
        return off_configurations(self.left)

    @cached_property
    def lacking(self) -> Explanation | None:
        """What would explain what the fit leaves."""
        return explanation(self.left, self.off.indices)

    @cached_property
    def moved(self) -> tuple[LeftOver, Change] | None:
        """What moved during the campaign; nothing is looked for where the data have an error."""
        return None if has_error(self.of_data) else what_moved(self.left_by_few)

    @cached_property
    def changes(self) -> list[Notice]:
        """What is said of that."""
        return [] if self.moved is None else notices_of_change(*self.moved)

    @cached_property
    def biased(self) -> bool:
        """Whether wrong readings pulled the fit away: it leaves much and expects much, whatever the model."""
        return self.fit.loss in PULLED and any(notice.code in PULLING for notice in self.noticed)

    @cached_property
    def of_data(self) -> list[Notice]:
        """What was said of the data and still holds.

        What the robust fit of the check could not explain, the fit itself may, and how many readings it is made from it
        knows itself. Of its lengths the robust fit knows more where this one was pulled away, or had none to choose.
        """
        return [
            replace(notice, level="error") if notice.code in MISNAMED and self.fit.loss in PULLED else notice
            for notice in self.noticed
            if notice.code not in (IMPLAUSIBLE.code, FEW_READINGS.code, WRONG_ROBOT.code)
        ]

    @cached_property
    def of_robot(self) -> list[Notice]:
        """Whether it can be this robot at all, and whether its lengths are this one's."""
        noticed = [notice for notice in self.noticed if notice.code == WRONG_ROBOT.code]
        other = check_robot(self.fit, self.training) if judges_lengths(self.fit) and not self.biased else noticed
        if has_error([*self.of_data, *self.changes]):  # what is wrong with the data bends the robot too
            other = []
        unlike = check_plausible(self.fit, self.training, [n.code for n in (*self.of_data, *other, *noticed)])
        return [*(other or noticed), *unlike] if unlike else other

    @property
    def implausible(self) -> bool:
        """Whether it cannot be this robot."""
        return any(notice.code == IMPLAUSIBLE.code for notice in self.of_robot)

    @cached_property
    def expected(self) -> ExpectedError:
        """How accurate the robot is where it was not measured."""
        doubted = has_error([*self.of_data, *self.changes]) or any(n.code in _DOUBTING for n in self.of_data)
        allowed, before = as_residuals_allow(self.fit, self.training), self.fit.before
        if before is not None and before.joint_error:
            allowed = replace(allowed, joint_error=np.maximum(allowed.joint_error, before.joint_error))
        by_order = moved_by_order(self.fit.robot, self.training)
        return expected_error(
            allowed, unseen=self.unseen, by_order=by_order, plausible=not self.implausible, doubted=doubted
        )

    @property
    def status(self) -> Status:
        """How it ended: a fit that cannot be this robot is implausible, however well it converged."""
        return Status.IMPLAUSIBLE if self.implausible else self.fit.status

    @cached_property
    def few(self) -> list[Notice]:
        """Whether hardly more was read than the parameters take up."""
        return check_few_readings(self.fit)

    @cached_property
    def sigma(self) -> tuple[list[Notice], list[Notice]]:
        """Whether declared deviations are too large; and whether they hide errors of the joints."""
        too_large = check_sigma(self.left)
        if self.implausible or has_error(too_large):
            return too_large, []
        return too_large, check_sigma_beside_joints(self.left)

    def unsilenced(self, notices: Sequence[Notice]) -> list[Notice]:
        """Return the notices but those that say nothing beside the others, by what their rules say."""
        silencing = {notice.code for notice in notices}
        silencing |= {WRONG_DATA} if has_error([*self.of_data, *self.of_robot]) else set()
        silencing |= {PULLED_AWAY} if self.biased else set()
        return [notice for notice in notices if notice.rule is None or notice.rule.unless.isdisjoint(silencing)]
