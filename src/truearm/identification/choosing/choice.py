"""What was chosen, and why: the record of a choice among joint effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from truearm.identification.choosing.candidates import SELECTABLE
from truearm.identification.choosing.search import Gain
from truearm.identification.judging.transmission import PeriodicError
from truearm.identification.solving.models import Model, named_model
from truearm.modeling.effects import EFFECTS
from truearm.modeling.effects.fourier import Fourier
from truearm.modeling.effects.joint_curve import JointCurve
from truearm.modeling.robot import Robot

AUTO: Final = "auto"
COMPLIANCE: Final = "compliance"
TRANSMISSION: Final = "transmission-error"
#: Effects that follow the order of a campaign.
ORDERED: Final = frozenset(effect.name for effect in EFFECTS if effect.ordered)


@dataclass(frozen=True)
class Candidate:
    """A joint effect that could have been chosen."""

    effect: str  #: Its name.
    taken: bool  #: Whether it was.
    gain: Gain | None  #: What the chosen model gains by it, or would; None if it was not tried.
    reason: str = ""  #: Why it was left out; empty if it was not.


@dataclass(frozen=True)
class Confirmation:
    """A model that was fitted in every fold, held against a smaller one."""

    effects: tuple[str, ...]  #: effects, smaller: the effects of both.
    smaller: tuple[str, ...]
    error: float  #: error, smaller_error: mean held-out errors [m].
    smaller_error: float
    gain: Gain  #: Of the paired differences.


@dataclass(frozen=True)
class Selection:
    """How a model was chosen."""

    model: Model  #: What was chosen.
    #: layout, blocks: how the configurations lie, see :data:`truearm.identification.choosing.folds.Layout`, and in how
    #: many blocks of neighbours they were held out; 0 where one by one.
    layout: str
    blocks: int
    #: geometric, elastic, error: mean held-out errors of these models and of the chosen one, in closed form [m]; the
    #: second is None where no loads bend the joints.
    geometric: float
    elastic: float | None
    error: float
    candidates: tuple[Candidate, ...]  #: Every joint effect that can be chosen.
    confirmations: tuple[Confirmation, ...] = ()  #: What was fitted in every fold.
    #: Periodic errors that were found, whose numbers of periods nobody had given.
    lines: tuple[PeriodicError, ...] = ()
    smaller: tuple[Model, ...] = ()  #: Smaller models, the next one first.
    #: Models that were chosen first and whose fits were not sound, with the statuses.
    passed_over: tuple[tuple[tuple[str, ...], str], ...] = ()

    def prepared(self, robot: Robot) -> Robot:
        """Return the robot with the numbers of periods that were found, if the chosen model needs them."""
        return with_lines(robot, self.lines) if TRANSMISSION in self.model.effects else robot

    def instead(self, status: str) -> Selection:
        """Return the choice of the next smaller model, because a fit of this one ended so."""
        model, *smaller = self.smaller
        out = set(self.model.effects) - set(model.effects)
        candidates = tuple(
            replace(one, taken=False, reason=f"the fit with it ended in {status}") if one.effect in out else one
            for one in self.candidates
        )
        passed_over = (*self.passed_over, (self.model.effects, status))
        return replace(self, model=model, smaller=tuple(smaller), candidates=candidates, passed_over=passed_over)

    def without_curves(self) -> Selection:
        """Return the choice without joint curves, because a fit to all readings gave no joint one."""
        curve, fourier = JointCurve.name, Fourier.name
        model = model_with([name for name in self.model.effects if name != curve], (*self.model.tried, curve))
        reasons = {
            curve: "the fit to all training readings gave no joint a curve",
            fourier: "it was not looked at apart from the curves",
        }
        candidates = tuple(
            replace(one, taken=False, reason=reasons[one.effect])
            if one.effect == curve or (one.effect == fourier and not one.taken and one.gain is None)
            else one
            for one in self.candidates
        )
        return replace(self, model=model, candidates=candidates)


def with_lines(robot: Robot, lines: Sequence[PeriodicError]) -> Robot:
    """Return a robot whose gears err as often in a turn as was found."""
    periods = {line.joint: line.periods for line in lines}
    joints = tuple(
        replace(joint, transmission_periods=periods.get(number, joint.transmission_periods))
        for number, joint in enumerate(robot.joints, 1)
    )
    return replace(robot, joints=joints) if periods else robot


def model_with(effects: Sequence[str], candidates: Sequence[str] = SELECTABLE) -> Model:
    """Return the model with some joint effects, which bounds may name the others of."""
    names = tuple(effect.name for effect in EFFECTS if effect.name in effects)
    added = [name for name in names if name != COMPLIANCE]
    rigid = "" if COMPLIANCE in names else "geometric"
    start = rigid or "elastic"
    summary = f"{start}, and what cross-validation added: {', '.join(added) or 'nothing'}"
    groups = named_model("geometric").groups
    return Model(AUTO, summary, groups, names, tuple(name for name in candidates if name not in names))
