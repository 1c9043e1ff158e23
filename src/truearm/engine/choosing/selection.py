"""Which joint effects the data can carry, chosen by cross-validation on the training part.

One fit is linearised, and every effect that the robot and the data say something about is a few columns more
(:mod:`truearm.engine.choosing.candidates`). Held-out errors of any choice among them then follow in closed form
(:mod:`truearm.engine.choosing.cross_validation`): of all that are not worse than the best one by a
standard error, the choice with the fewest parameters is taken. What is taken has to hold in real fits, whose weights,
penalties and periods are found inside the training folds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.choosing.candidates import SELECTABLE, CurveColumns, Ground, closed_because, loads_bend
from truearm.engine.choosing.cross_validation import FOLDS, Folds, draws_of
from truearm.engine.choosing.search import (
    BASES,
    CLEAR,
    CURVE,
    Choices,
    Gain,
    Search,
    gain,
    mean_over,
    with_bases,
    without,
)
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fixed_places import NOTHING_FIXED, FixedPlaces
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import Model, named_model
from truearm.engine.fit.rounds import Redundant, Solved, find_parameters
from truearm.engine.fit.transmission import FEWEST, LEAST_CONFIGURATIONS, PeriodicError, Pulls, lines_of
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.effects.fourier import Fourier
from truearm.engine.robot.effects.joint_curve import HIGHEST, JointCurve
from truearm.engine.robot.robot import Robot

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
    #: layout, blocks: how the configurations lie, see :data:`truearm.engine.choosing.cross_validation.Layout`, and
    #: in how many blocks of neighbours they were held out; 0 where one by one.
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
            replace(candidate, taken=False, reason=f"the fit with it ended in {status}")
            if candidate.effect in out
            else candidate
            for candidate in self.candidates
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
            replace(candidate, taken=False, reason=reasons[candidate.effect])
            if candidate.effect == curve
            or (candidate.effect == fourier and not candidate.taken and candidate.gain is None)
            else candidate
            for candidate in self.candidates
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


_TOLERANCE: Final = 1e-3  # priors; errors of folds are not compared more closely


@dataclass(frozen=True)
class How:
    """How parameters are identified, as :func:`truearm.engine.fit.rounds.find_parameters` takes it."""

    loss: Loss
    redundancy: Redundant
    bounds: Bounds | None
    bounds_file: str
    held: FixedPlaces

    def find(self, robot: Robot, data: Dataset, model: Model, small: float, near: Solved | None) -> Solved:
        """Return the parameters, as they are found when the search begins near others."""
        return find_parameters(
            robot,
            data,
            model,
            loss=self.loss,
            redundancy=self.redundancy,
            bounds=self.bounds,
            bounds_file=self.bounds_file,
            fixed=self.held,
            small=small,
            near=near,
        )


@dataclass(frozen=True, eq=False)
class Refits:
    """Real fits of models in the folds, each made once."""

    robot: Robot  #: robot, data: the robot and its training data.
    data: Dataset
    draws: tuple[Folds, ...]  #: Which configurations are held out together, as often as that was drawn.
    how: How  #: How parameters are identified.
    model_of: Callable[[Sequence[str]], Model]  #: The model with some joint effects.
    #: The robot as a fold knows it, by the numbers of the draw and of the fold and the effects: with the periods found
    #: without the fold.
    robot_of: Callable[[int, int, Sequence[str]], Robot]
    _known: dict[tuple[str, ...], Array | None] = field(default_factory=dict)

    def errors(self, effects: Sequence[str]) -> Array | None:
        """Return the mean held-out error of each configuration over the draws [m], ``(n,)``, NaN where there is none.

        None if some fold is not enough for the model.
        """
        key = tuple(sorted(effects))
        if key not in self._known:
            self._known[key] = self._over_draws(key)
        return self._known[key]

    def _over_draws(self, effects: tuple[str, ...]) -> Array | None:
        found = []
        for draw in range(len(self.draws)):
            errors = self._found(draw, effects)
            if errors is None:
                return None
            found.append(errors)
        return mean_over(found)

    def _found(self, draw: int, effects: tuple[str, ...]) -> Array | None:
        found = np.full(self.data.configurations, np.nan)
        solved: Solved | None = None
        before: Robot | None = None
        for number in range(FOLDS):
            of = self.draws[draw].of
            inside, outside = np.flatnonzero(of != number), np.flatnonzero(of == number)
            training = self.data.of_configurations(inside)
            robot = self.robot_of(draw, number, effects)
            near = solved if robot == before and self.how.redundancy == "prior" else None
            try:
                solved, before = self.how.find(robot, training, self.model_of(effects), _TOLERANCE, near), robot
            except InputError:  # too few equations in a fold, or a bound that a redundant one cannot keep
                return None
            found[outside] = _errors(solved.robot, training, self.data.of_configurations(outside))
        return found


def _errors(robot: Robot, training: Dataset, held_out: Dataset) -> Array:
    """Return the mean error of each held-out configuration [m], of those positions whose target was trained on."""
    read = training.has_position if training.fixture is None else training.has_reading
    placed = np.isin(held_out.target, training.target[read]) & np.isin(held_out.against, training.against[read])
    judged = replace(held_out.of_readings(placed), quaternion=None)
    errors = errors_of(robot, judged)
    sizes = np.linalg.norm(errors.position_errors, axis=1)
    if not np.isfinite(sizes).any() and errors.length_errors is not None:
        sizes = np.abs(errors.length_errors)
    known = np.isfinite(sizes)
    of = judged.configuration[known]
    count = np.bincount(of, minlength=held_out.configurations)
    total = np.bincount(of, sizes[known], minlength=held_out.configurations)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


#: What a curve contains.
_IN_CURVE: Final = "fourier"
#: Standard errors by which fits in the folds have to be better than those of the better plain model, and of the next
#: smaller choice where configurations are so few that folds are drawn several times.
_SURE: Final = 2.0
#: Choices that are fitted in the folds at most, where they are drawn once, and draws that fits are made in.
_MOST_REFITS: Final = 3
_DRAWS_OF_REFITS: Final = 2
#: Training configurations up to which curves that the linear problem does not bear out are fitted in the folds.
_CURVES_REFITTED: Final = 200
_NOT_BORNE_OUT: Final = "what it gains is not borne out by fits in the folds"


def select(
    robot: Robot,
    data: Dataset,
    *,
    loss: Loss = "linear",
    redundancy: Redundant = "prior",
    bounds: Bounds | None = None,
    bounds_file: str = "bounds",
    held: FixedPlaces = NOTHING_FIXED,
    seed: int = 0,
    candidates: Sequence[str] = SELECTABLE,
    progress: Callable[[str], None] = lambda _: None,
) -> Selection:
    """Choose the joint effects for a robot and its training data.

    Args:
        robot, data, loss, redundancy, bounds, bounds_file, held: As :func:`truearm.engine.fit.fit.identify`
            takes them.
        seed: Of the folds.
        candidates: Joint effects that may be chosen besides compliance.
        progress: Called with a few words at each step.

    Raises:
        InputError: If there are too few configurations for the folds.
    """
    if data.configurations < 2 * FOLDS:
        raise InputError(
            "there are too few training configurations to choose a model by cross-validation",
            where=data.source,
            came=data.configurations,
            allowed=f"at least {2 * FOLDS}",
            cure="Measure more, or name a model.",
        )
    names = tuple(name for name in SELECTABLE if name in candidates or name == COMPLIANCE)
    how = How(loss, redundancy, bounds, bounds_file, held)
    start = (COMPLIANCE,) if loads_bend(robot, data) else ()
    progress("choosing a model: one fit for all")
    solved = find_parameters(
        robot,
        data,
        model_with(start, names),
        loss=loss,
        redundancy=redundancy,
        bounds=bounds,
        bounds_file=bounds_file,
        fixed=held,
    )
    grounds = tuple(Ground(solved, folds) for folds in draws_of(data, seed))
    choice = _Choice(robot, data, names, how, grounds, progress)
    return choice.made()


@dataclass(eq=False)
class _Choice:
    """The way from one fit to a model."""

    robot: Robot
    data: Dataset
    names: tuple[str, ...]
    how: How
    grounds: tuple[Ground, ...]
    progress: Callable[[str], None]
    reasons: dict[str, str] = field(default_factory=dict)
    lines: tuple[PeriodicError, ...] = ()
    curves: tuple[CurveColumns, ...] = ()

    @property
    def ground(self) -> Ground:
        return self.grounds[0]

    @property
    def folds(self) -> Folds:
        return self.ground.folds

    def made(self) -> Selection:
        """Return the choice."""
        self.progress("choosing a model: every choice in closed form")
        search = self._searched()
        chosen = self._settled(search)
        if self._found_lines(search, chosen):
            search = self._searched()
            chosen = self._settled(search)
        chosen, confirmations = self._confirmed(search, chosen)
        return self._selection(search, chosen, confirmations)

    def _searched(self) -> Choices:
        """Return the choices among all effects that robot, data and lines say something about."""
        robot = with_lines(self.robot, self.lines)
        self.reasons = {}
        for name in self.names:
            reason = closed_because(robot, self.data, name)
            if name == CURVE and self.how.redundancy != "prior":
                reason = "it is found with priors only"
            if reason is not None:
                self.reasons[name] = reason
        open_ = [name for name in self.names if name not in self.reasons and name != CURVE]
        there = with_lines(self.ground.solved.robot, self.lines)
        columns = self.ground.columns(open_, there)
        unordered = self.ground.columns([name for name in open_ if name in ORDERED], there, ordered=False)
        plain = Search(self.grounds, self.ground.start((COMPLIANCE,)), columns, unordered)
        for name in columns:
            if not plain.excited(name):
                self.reasons[name] = "the readings tell less of it than is known beforehand"
        for name, base in BASES.items():
            if name in columns and (base in self.reasons or base not in columns):
                self.reasons.setdefault(name, f"it is a part of {base}, which cannot be found")
        return Choices(plain, self._curved(plain))

    def _curved(self, plain: Search) -> Search | None:
        """Return the search among what curves do not contain, if the data show curves."""
        if CURVE not in self.names or CURVE in self.reasons:
            return None
        rest = {name: columns for name, columns in plain.columns.items() if name != _IN_CURVE}
        beside = plain.best([name for name in rest if name not in self.reasons])
        taken = plain.together({name: rest[name] for name in rest if name in beside})
        self.curves = tuple(ground.curves((COMPLIANCE,), taken) for ground in self.grounds)
        columns = self.curves[0].scaled()
        if columns is None:
            self.reasons[CURVE] = "what is left over does not repeat with the joints' angles"
            return None
        return Search(self.grounds, plain.fit.with_columns(columns), rest, plain.unordered)

    def _settled(self, search: Choices) -> frozenset[str]:
        """Return the best choice among effects that the data show and that do not harm predictions without order."""
        while True:
            chosen = search.best(self.reasons)
            ordered = chosen & ORDERED
            now = search.errors_without_order(chosen)
            if not ordered or not gain(search.errors_without_order(chosen - ordered), now, self.folds).harms:
                return chosen
            worst = min(sorted(ordered), key=lambda name: _mean(search.errors_without_order(without(chosen, name))))
            self.reasons[worst] = "it makes predictions worse whose place in the order is not known"

    def _found_lines(self, search: Choices, chosen: frozenset[str]) -> bool:
        """Look for periodic errors in what a choice leaves; return whether there are any."""
        if TRANSMISSION not in self.names:
            return False
        pulls = self.ground.pulls(search.left(chosen), search.spent(chosen))
        self.lines = () if pulls is None else self._lines_of(pulls, chosen)
        if not self.lines and TRANSMISSION in self.reasons:
            self.reasons[TRANSMISSION] = (
                "no position was read in which to look for errors that repeat with a joint's angle"
                if pulls is None
                else f"fewer than {LEAST_CONFIGURATIONS} configurations cannot tell how often a joint's errors repeat"
                if len(pulls.joints) < LEAST_CONFIGURATIONS
                else "no error that repeats with a joint's angle was found"
            )
        return bool(self.lines)

    def _lines_of(self, pulls: Pulls, chosen: frozenset[str]) -> tuple[PeriodicError, ...]:
        """Return the lines that no curve among the chosen effects could take out."""
        return lines_of(self.robot, pulls, HIGHEST + 1 if CURVE in chosen else FEWEST)

    def _refits(self, search: Choices, chosen: frozenset[str]) -> Refits:
        beside = chosen - {TRANSMISSION}

        def robot_of(draw: int, number: int, effects: Sequence[str]) -> Robot:
            if not self.lines or TRANSMISSION not in effects:
                return self.robot
            left, ground = search.left_without(draw, number, beside), self.grounds[draw]
            pulls = ground.pulls(left, search.spent(beside), ground.fold != number)
            return self.robot if pulls is None else with_lines(self.robot, self._lines_of(pulls, beside))

        draws = tuple(ground.folds for ground in self.grounds[:_DRAWS_OF_REFITS])
        return Refits(self.robot, self.data, draws, self.how, lambda effects: model_with(effects, self.names), robot_of)

    def _confirmed(self, search: Choices, chosen: frozenset[str]) -> tuple[frozenset[str], list[Confirmation]]:
        """Return the choice as far as fits in the folds bear it out."""
        confirmations: list[Confirmation] = []
        if CURVE in chosen:
            plain = search.best({*self.reasons, CURVE})
            self.progress("choosing a model: curves in the folds")
            errors, before = self._errors_of_curves(search, chosen), search.errors(plain)
            confirmations.append(_confirmation(chosen, plain, errors, before, self.folds))
            if confirmations[-1].gain.clear(CLEAR):
                return chosen, confirmations
            if confirmations[-1].gain.mean > 0.0 and self.data.configurations <= _CURVES_REFITTED:
                confirmations += self._curves_refitted(search, chosen, plain)
                if confirmations[-1].gain.clear(CLEAR):
                    return chosen, confirmations
            self.reasons[CURVE] = _NOT_BORNE_OUT
            chosen = plain
        refits = self._refits(search, chosen)
        start = self._start(search)
        for _ in range(_MOST_REFITS if len(self.grounds) == 1 else len(self.names)):
            if chosen <= start:
                return start, confirmations
            smaller = self._next_smaller(search, chosen)
            self.progress(f"choosing a model: fits with {', '.join(_listed(chosen))} in the folds")
            reason = self._refuted(refits, chosen, [smaller, start], confirmations)
            if not reason:
                return chosen, confirmations
            for name in chosen - smaller:
                self.reasons[name] = reason
            chosen = smaller
        return start, confirmations

    def _curves_refitted(self, search: Choices, chosen: frozenset[str], plain: frozenset[str]) -> list[Confirmation]:
        """Return how fits with curves in the folds compare with those without; nothing where a fold has too few.

        The linear problem keeps the weights of the fit without curves, which takes what curves explain for errors of
        every visit: of few configurations it then gives curves too little.
        """
        self.progress("choosing a model: fits with curves in the folds")
        refits = self._refits(search, chosen)
        errors, before = refits.errors(tuple(chosen)), refits.errors(tuple(plain))
        if errors is None or before is None:
            return []
        return [_confirmation(chosen, plain, errors, before, self.folds)]

    def _refuted(
        self, refits: Refits, chosen: frozenset[str], others: Sequence[frozenset[str]], found: list[Confirmation]
    ) -> str:
        """Return why fits in the folds do not bear a choice out against others; empty if they do."""
        errors = refits.errors(tuple(chosen))
        if errors is None:
            return "there are too few readings in a fold to find it"
        for other in dict.fromkeys(others):
            before = None if other == chosen else refits.errors(tuple(other))
            if before is None:
                continue
            found.append(_confirmation(chosen, other, errors, before, self.folds))
            few = len(self.grounds) > 1
            if not found[-1].gain.clear(_SURE if few or other == others[-1] else 1.0):
                return _NOT_BORNE_OUT
        return ""

    def _errors_of_curves(self, search: Choices, chosen: frozenset[str]) -> Array:
        """Return held-out errors with curves and lines whose priors and periods are found without each fold.

        It is the linear problem: with hundreds of coefficients real fits would take far longer than all the rest.
        """
        if search.curved is None or not self.curves:
            raise ValueError("there are no curves to choose")
        return mean_over([self._errors_of_draw(search, chosen, draw) for draw in range(len(self.grounds))])

    def _errors_of_draw(self, search: Choices, chosen: frozenset[str], draw: int) -> Array:
        ground, beside = self.grounds[draw], chosen - {TRANSMISSION}
        held_out = np.zeros(len(ground.fold))
        for number in range(FOLDS):
            columns = {name: found for name, found in search.plain.columns.items() if name in chosen}
            if self.lines and TRANSMISSION in columns:
                left = search.left_without(draw, number, beside)
                pulls = ground.pulls(left, search.spent(beside), ground.fold != number)
                lines = () if pulls is None else self._lines_of(pulls, beside)
                there = with_lines(ground.solved.robot, lines)
                columns |= ground.columns([TRANSMISSION], there) if lines else {}
            curve = self.curves[draw].scaled(number)
            fit = search.plain.fit if curve is None else search.plain.fit.with_columns(curve)
            mine = ground.fold == number
            together = np.concatenate([np.zeros((len(mine), 0)), *columns.values()], axis=1)
            held_out[mine] = replace(fit.with_columns(together), fold=ground.fold).held_out(number)[mine]
        return ground.errors(held_out)

    def _start(self, search: Choices) -> frozenset[str]:
        """Return the better one of the geometric and the elastic model; the smaller one if it is hardly worse."""
        elastic = frozenset({COMPLIANCE})
        if COMPLIANCE not in search.names or COMPLIANCE in self.reasons:
            return frozenset()
        return elastic if search.gain(frozenset(), elastic).clear(0.0) else frozenset()

    def _offsets_harm(self, search: Choices) -> bool:
        """Return whether joint zeros alone leave more than the geometric model, by more than chance."""
        fit = self.ground.start((COMPLIANCE, "geometry"))
        return gain(search.errors(frozenset()), self.ground.errors(fit.held_out()), self.folds).harms

    @staticmethod
    def _next_smaller(search: Choices, chosen: frozenset[str]) -> frozenset[str]:
        """Return a choice without the effect that it gains least by."""
        return min((without(chosen, name) for name in chosen), key=lambda one: _mean(search.errors(one)))

    def _selection(self, search: Choices, chosen: frozenset[str], confirmations: list[Confirmation]) -> Selection:
        rows = []
        for name in self.names:
            tried = None
            if name in search.names:
                tried = search.gain(without(chosen, name), with_bases(chosen | {name}))
            reason = "" if name in chosen else self.reasons.get(name, "")
            if name == _IN_CURVE and CURVE in chosen:
                tried, reason = None, "the curves contain it"
            if name not in chosen and not reason and tried is not None:
                harms = "it makes held-out errors larger"
                reason = harms if tried.mean <= 0.0 else "it gains no more than chance may"
                if tried.believed:
                    reason = "it gains too little for all its parameters"
            rows.append(Candidate(name, name in chosen, tried, reason))
        smaller, now = [], chosen
        while now:
            now = self._next_smaller(search, now)
            smaller.append(model_with(tuple(now), self.names))
        if not self._offsets_harm(search):
            smaller.append(replace(named_model("offsets"), name=AUTO))
        elastic = _mean(search.errors(frozenset({COMPLIANCE}))) if COMPLIANCE in search.names else None
        return Selection(
            model_with(tuple(chosen), self.names),
            self.folds.layout,
            self.folds.blocks,
            _mean(search.errors(frozenset())),
            elastic,
            _mean(search.errors(chosen)),
            tuple(rows),
            tuple(confirmations),
            self.lines if TRANSMISSION in chosen else (),
            tuple(smaller),
        )


def _confirmation(
    chosen: frozenset[str], smaller: frozenset[str], errors: Array, before: Array, folds: Folds
) -> Confirmation:
    return Confirmation(_listed(chosen), _listed(smaller), _mean(errors), _mean(before), gain(before, errors, folds))


def _listed(effects: frozenset[str]) -> tuple[str, ...]:
    return tuple(effect.name for effect in EFFECTS if effect.name in effects)


def _mean(errors: Array) -> float:
    known = errors[np.isfinite(errors)]
    return float(known.mean()) if len(known) else float("nan")
