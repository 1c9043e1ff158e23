"""One model for every robot: all joint effects that robot and data say something of, each as large as the data tell.

Nothing is chosen: what the data do not support shrinks to nothing by itself (:mod:`truearm.engine.fit.relevance`).
Errors that repeat with the angle of a joint are looked for in what is left over, and join in.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, listed
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import Fit, fit_of, refit_draws
from truearm.engine.fit.fixed_places import NOTHING_FIXED, FixedPlaces
from truearm.engine.fit.known_before import with_proof_of_its_values
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import Model, named_model
from truearm.engine.fit.rounds import Redundant, Solved, evaluated, factors_of, find_parameters, informed_rows
from truearm.engine.fit.transmission import LARGEST_CHANCE, PeriodicError, lines_of, pulls_of
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.effects.balancing import Balancing
from truearm.engine.robot.effects.effect import MATTERS
from truearm.engine.robot.effects.linear_contact import LinearContactClearance
from truearm.engine.robot.effects.transmission import TransmissionError
from truearm.engine.robot.loads import has_weight
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot

#: Name of the model.
AUTO: Final = "auto"
#: Effects that are left to those who ask for them: forms of others.
_ASKED_FOR: Final = frozenset({LinearContactClearance.name})
#: Numbers of periods that a joint may have.
_LINES: Final = 8
#: Periods in a turn up to which a joint's curve is looked for; lines begin below that.
_HIGHEST: Final = 30
#: How many lines as strong as the weakest chance would show: those that are not there shrink as all else does.
_CHANCE: Final = 1.0
#: How often they are looked for at most, each time in what the fit before left.
_SEARCHES: Final = 2
#: What an effect moves the targets by, a root mean square, from which it is said to follow the campaign's order [m].
_WORTH_SAYING: Final = 5e-6


@dataclass(frozen=True)
class EffectShare:
    """What an effect does in a fit."""

    effect: str  #: Its name.
    #: By how much it moves the targets at the training configurations, a root mean square [m]; None where it is not in
    #: the model.
    moves: float | None
    known: float  #: How many of its parameters' worth the data tell.
    parameters: int  #: How many parameters it has.
    reason: str = ""  #: Why it is not in the model; empty if it is.

    @property
    def taken(self) -> bool:
        """Whether it moves the targets by more than next to nothing."""
        return self.moves is not None and self.moves >= MATTERS


@dataclass(frozen=True)
class Shares:
    """What every effect does in a fit, and the periodic errors that were found."""

    effects: tuple[EffectShare, ...]  #: Every joint effect, the largest first.
    lines: tuple[PeriodicError, ...] = ()  #: Errors that repeat with the angle of a joint, and nobody had given.


def closed_because(robot: Robot, data: Dataset, name: str) -> str | None:
    """Return why robot and data say nothing of an effect, None if they may."""
    effect = next(effect for effect in EFFECTS if effect.name == name)
    if not effect(robot.layout).parameters:
        if name == TransmissionError.name and any(joint.kind == "revolute" for joint in robot.joints):
            return "no number of periods is known"
        return "the robot has nothing that it moves"
    if effect.ordered and (data.approach is None or data.number is None):
        return "the order of measurement is not known"
    if effect.warmed and data.temperature is None:
        return "no temperature was recorded"
    if name == Balancing.name and not _load_changes(data):
        return "all configurations carry one load"
    if effect.loaded and not loads_bend(robot, data):
        return "nothing loads the joints"
    return None


def open_effects(robot: Robot, effects: Sequence[str], data: Dataset) -> list[str]:
    """Return the effects that are not there yet and that the robot and the data say something about."""
    return [
        effect.name
        for effect in EFFECTS
        if effect.selectable and effect.name not in effects and closed_because(robot, data, effect.name) is None
    ]


def loads_bend(robot: Robot, data: Dataset) -> bool:
    """Return whether there are loads that elastic joints could give way to."""
    return has_weight(robot) or data.wrench is not None


def every_effect(robot: Robot, data: Dataset) -> Model:
    """Return the model with every effect that robot and data may say something of."""
    possible = [effect.name for effect in EFFECTS if effect.name not in _ASKED_FOR]
    names = tuple(name for name in possible if closed_because(robot, data, name) is None)
    groups = named_model("geometric").groups
    summary = "geometric, and every joint effect as large as the data tell"
    closed = tuple(name for name in possible if name not in names)
    return Model(AUTO, summary, groups, names, closed, weighed=True, highest=_HIGHEST)


def identify_every_effect(
    robot: Robot,
    data: Dataset,
    *,
    loss: Loss = "linear",
    redundancy: Redundant = "prior",
    bounds: Bounds | None = None,
    bounds_file: str = "bounds",
    fixed: FixedPlaces = NOTHING_FIXED,
    bootstrap: int = 0,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[Robot, Fit, Shares]:
    """Identify a robot with every joint effect.

    Args:
        robot, data, loss, redundancy, bounds, bounds_file, fixed, bootstrap, seed, progress: As
            :func:`truearm.engine.fit.fit.identify` takes them.

    Returns:
        robot: The robot before, with the periods that were found.
        fit: Of it.
        shares: What every effect does.
    """
    progress(f"identifying every joint effect on {data.configurations} configurations")
    lines: tuple[PeriodicError, ...] = ()
    robot = with_proof_of_its_values(robot)
    find = partial(
        find_parameters,
        data=data,
        loss=loss,
        redundancy=redundancy,
        bounds=bounds,
        bounds_file=bounds_file,
        fixed=fixed,
    )
    solved = find(robot, model=every_effect(robot, data), rough=True)
    for _ in range(_SEARCHES):
        more = _lines_left(solved)
        if not more:
            break
        lines, robot = (*lines, *more), with_lines(robot, more)
        progress("identifying errors that repeat with the joints' angles")
        solved = find(with_lines(solved.start, more), model=every_effect(robot, data), near=solved, rough=True)
    solved = find(solved.start, model=every_effect(robot, data), near=solved)
    draws = refit_draws(solved, loss, bootstrap, seed, progress) if bootstrap else None
    fit = fit_of(solved, every_effect(robot, data), loss, draws)
    return robot, fit, _shares(robot, fit, data, lines)


def _lines_left(solved: Solved) -> tuple[PeriodicError, ...]:
    """Return the periodic errors in what a solution leaves."""
    problem, solution = solved.problem, solved.solution
    joint_error, larger = np.zeros(len(solved.start.joints)), None
    if solved.components is not None:
        likeliest = solved.components.likeliest
        joint_error, larger = np.sqrt(likeliest.joints), np.sqrt(likeliest.factors[factors_of(problem)[1]])
    pulls = pulls_of(evaluated(problem, solution), joint_error, informed_rows(problem, solution), larger)
    return () if pulls is None else lines_of(solved.robot, pulls, _LINES, _CHANCE)


def with_lines(robot: Robot, lines: Sequence[PeriodicError]) -> Robot:
    """Return a robot whose gears also err as often in a turn as was found."""
    joints = tuple(
        replace(joint, transmission_periods=(*joint.periods, *(n.periods for n in lines if n.joint == number)))
        for number, joint in enumerate(robot.joints, 1)
    )
    return replace(robot, joints=joints) if lines else robot


def _shares(robot: Robot, fit: Fit, data: Dataset, lines: tuple[PeriodicError, ...]) -> Shares:
    """Return what every effect does at the readings of a fit."""
    identified, shares = fit.robot, list[EffectShare]()
    at = identified.loaded(data.postures)
    whole = _places(identified, at, data)
    for effect in EFFECTS:
        names = [n for n in (*fit.free.names, *fit.unfitted) if identified.parameters[n].group == effect.name]
        if effect.name not in fit.model.effects:
            if effect.name not in _ASKED_FOR:
                reason = closed_because(robot, data, effect.name) or "the data do not tell it"
                shares.append(EffectShare(effect.name, None, 0.0, 0, reason))
            continue
        parameters = [identified.parameters[name] for name in names]
        known = sum(p.informed or 0.0 for p in parameters)
        moved = whole - _places(identified.with_values({p.name: p.nominal for p in parameters}), at, data)
        moves = float(np.sqrt(np.mean(np.sum(moved**2, axis=1)))) if len(moved) else 0.0
        shares.append(EffectShare(effect.name, moves, known, len(names)))
    return Shares(tuple(sorted(shares, key=lambda share: -(share.moves or 0.0))), lines)


def _places(robot: Robot, at: Postures, data: Dataset) -> Array:
    """Return where the target of each reading is predicted at postures with their loads [m], ``(readings, 3)``."""
    places = np.array([robot.world_poses(at, name)[0] for name in data.targets])
    return np.asarray(places[data.target, data.configuration])


# Whether readings can tell how strong a balancer is.
#
# A balancer moves its joint by compliance times a moment that depends on that joint's position alone, as a periodic
# error of the joint does. Under one load its strength is then one guess among several. Another load shows the
# compliance by itself, and with it the moment. Beside a free curve of the same joint no load tells the two apart; the
# informed share of the strength says so.

#: Configurations under another load that are worth it; fewer may be a data-entry error.
_ENOUGH: Final = 5
#: Forces and moments that differ by less are the same load [N, N m].
_SAME: Final = 1.0


def refuse_balancers_that_are_not_there(robot: Robot, effects: Sequence[str]) -> None:
    """Refuse to identify balancers of a robot that has none.

    Raises:
        InputError: Naming the robot.
    """
    if Balancing.name in effects and not robot.balancers:
        raise InputError(
            f"{robot.name} has no balancer whose strength could be identified",
            parameter="effects",
            came=Balancing.name,
            cure="Enter balancers in the robot file: anchors, length, force and stiffness as the maker states them.",
        )


BALANCER_HELD: Final = Rule(
    "balancer-held",
    "note",
    "all configurations carry one load, which does not tell how strong a [balancer](models.md#balancers) is",
)


def without_unseen_balancers(model: Model, data: Dataset) -> tuple[Model, list[Notice]]:
    """Return a model without balancers where all readings were taken under one load, and what to know of that.

    Args:
        data: The training part.
    """
    if Balancing.name not in model.effects or _load_changes(data):
        return model, []
    kept = replace(model, effects=tuple(name for name in model.effects if name != Balancing.name))
    words = (
        "All training configurations carry one load. A balancer then looks like a periodic error of the joint that it "
        "relieves, so its strength is held at what the robot file states. Measure some configurations with another "
        "weight or a pull at the flange, and enter that in the columns force_x [N] to force_z [N]."
    )
    return kept, [BALANCER_HELD(words)]


def _load_changes(data: Dataset) -> bool:
    """Return whether enough configurations carry another load at the flange than most do."""
    if data.wrench is None:
        return False
    usual = np.median(data.wrench, axis=0)
    other = int((np.abs(data.wrench - usual).max(axis=1) > _SAME).sum())
    return min(other, len(data.wrench) - 1) >= _ENOUGH


ORDER_IN_THE_MODEL: Final = Rule(
    "order-in-the-model",
    "note",
    "`auto` found warm-up or approach: predictions without an order are those of the middle of the session",
)
PERIODS_FOUND: Final = Rule(
    "periods-found",
    ("note", "warning"),
    "errors that repeat with the joints' angles, which `auto` found; a warning where other numbers of periods would "
    "look the same",
)


def check_shares(shares: Shares) -> list[Notice]:
    """Return what to know of a model with every effect."""
    notices = []
    of_order = {effect.name for effect in EFFECTS if effect.ordered}
    ordered = [s.effect for s in shares.effects if s.effect in of_order and (s.moves or 0.0) >= _WORTH_SAYING]
    if ordered:
        notices.append(
            ORDER_IN_THE_MODEL(
                f"The model follows the order of this campaign ({listed(ordered)}). That cleans the other parameters. "
                "Predictions of other sessions and of programs are those of the middle of this one. What the order "
                "does is in the expected error, and not in the held-out error."
            )
        )
    certain = [line for line in shares.lines if line.chance < LARGEST_CHANCE]
    if certain:
        notices.append(
            PERIODS_FOUND(
                f"Errors that repeat with the joints' angles were found and taken out: "
                f"{'; '.join(line.words for line in certain)}. The numbers of periods stand in the calibrated "
                "robot as transmission_periods.",
                "warning" if any(line.aliases for line in certain) else "note",
            )
        )
    return notices
