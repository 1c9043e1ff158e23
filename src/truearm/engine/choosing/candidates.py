"""What could be added to a fit: the columns of every joint effect, evaluated once at its solution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Notice, Rule
from truearm.engine.base.limits import limit, refuse_beyond
from truearm.engine.choosing.cross_validation import FOLDS, Folds, LinearFit
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.thinning import PARAMETERS_OF_A_PLACE, equations_of, evenly
from truearm.engine.fit.curves import BANDS, LARGEST, curve_variances, moments_without
from truearm.engine.fit.likelihood import Visits, Whitening
from truearm.engine.fit.models import Model
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.rounds import Solved, bound_by, in_the_middle
from truearm.engine.fit.transmission import Pulls
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.effects.balancing import Balancing
from truearm.engine.robot.effects.joint_curve import JointCurve
from truearm.engine.robot.effects.transmission import TransmissionError
from truearm.engine.robot.loads import has_weight
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot

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


#: Joint effects that are tried, in this order.
SELECTABLE: Final = tuple(effect.name for effect in EFFECTS if effect.selectable or effect is JointCurve)
#: What keeps a problem without priors solvable, per prior.
_HARDLY: Final = 1e-6
#: A reading that a loss left no weight counts as if it had left this much, in the ranking.
_LEAST_WEIGHT: Final = 1e-6


def open_effects(
    robot: Robot, effects: Sequence[str], data: Dataset, candidates: Sequence[str] = SELECTABLE
) -> list[str]:
    """Return the effects that are not there yet and that the robot and the data say something about."""
    return [name for name in candidates if name not in effects and closed_because(robot, data, name) is None]


def closed_because(robot: Robot, data: Dataset, name: str) -> str | None:
    """Return why an effect cannot be tried, None if it can."""
    effect = next(effect for effect in EFFECTS if effect.name == name)
    if not effect(robot.layout).parameters:
        if name == TransmissionError.name and any(joint.kind == "revolute" for joint in robot.joints):
            return "the robot file gives no joint a number of periods"
        return "the robot has nothing that it moves"
    if effect.ordered and (data.approach is None or data.number is None):
        return "the order of measurement is not known"
    if effect.warmed and data.temperature is None:
        return "no temperature was recorded"
    if effect.loaded and not (has_weight(robot) or data.wrench is not None):
        return "nothing loads the joints"
    return None


def compared_with(robot: Robot, data: Dataset, candidates: Sequence[str] = SELECTABLE) -> Dataset:
    """Return the data that effects are chosen by: as many configurations as the derivatives by all have room for."""
    wanted = robot.with_effects([name for name in candidates if closed_because(robot, data, name) is None])
    places = PARAMETERS_OF_A_PLACE * (1 + len(data.targets) + len(data.fixtures))
    parameters = len(wanted.parameters) + places
    part = evenly(data, parameters, limit("derivatives"))
    if part.configurations < min(2 * FOLDS, data.configurations):
        refuse_beyond("derivatives", equations_of(data) * parameters, where=data.source)
    return part


def loads_bend(robot: Robot, data: Dataset) -> bool:
    """Return whether there are loads that elastic joints could give way to."""
    return has_weight(robot) or data.wrench is not None


@dataclass(frozen=True, eq=False)
class CurveColumns:
    """The columns of the joints' curves, and what is needed to find how stiff these are without a fold."""

    columns: Array  #: Weighed derivatives by the coefficients [1/rad], ``(rows, k)``.
    joint: NDArray[np.intp]  #: joint, period: of each coefficient: the index of its joint, and its periods in a turn.
    period: NDArray[np.intp]
    #: Products of the derivatives by other parameters and by the coefficients and of the residuals, for rows of no fold
    #: and then fold by fold.
    moments: Array
    rows: NDArray[np.intp]  #: How many rows those are.
    others: int  #: How many other parameters there are.

    def scaled(self, without: int | None = None) -> Array | None:
        """Return the columns per prior, ``(rows, k)``; None where the data show no curve, or not how large it is.

        The priors are the likeliest ones, band by band: so few numbers say little of the readings that they were found
        from. Those of single lines would be praised for what they took from the folds that are held out.

        Args:
            without: A fold that has no say in the priors.
        """
        found = self._variance if without is None else self._found(without)
        bands = np.stack([self.joint, np.searchsorted(BANDS, self.period, side="right")])
        of = np.unique(bands, axis=1, return_inverse=True)[1].reshape(-1)
        variance = (np.bincount(of, found) / np.bincount(of))[of]
        used = variance > 0.0
        return np.asarray(self.columns[:, used] * np.sqrt(variance[used])) if used.any() else None

    @cached_property
    def _variance(self) -> Array:
        """The likeliest variance of each coefficient from all rows [rad^2], ``(k,)``."""
        return self._found(None)

    def _found(self, without: int | None) -> Array:
        kept = np.ones(len(self.rows), dtype=bool)
        if without is not None:
            kept[without + 1] = False
        moments = moments_without(self.moments[kept].sum(axis=0), self.others)
        rows = float(self.rows[kept].sum())
        try:
            return curve_variances(moments, rows, self.joint, self.period, most=LARGEST).variance
        except np.linalg.LinAlgError:  # the likelihood has no maximum: what is left over is next to nothing
            return np.zeros(len(self.joint))


@dataclass(frozen=True, eq=False)
class Ground:
    """A fit with the linear loss' view of it, and folds: what candidates are added to."""

    solved: Solved  #: The fit.
    folds: Folds  #: Which configurations are held out together.

    @property
    def problem(self) -> Problem:
        """The problem at whose deviations and loads the fit is a solution."""
        return self.solved.problem

    @cached_property
    def configuration(self) -> NDArray[np.intp]:
        """Configuration of each row, ``(rows,)``; -1 for what is known of fixtures."""
        found = []
        for block in self.problem.blocks:
            own = block.data is self.problem.data
            of = block.data.configuration[block.readings] if own else np.full(len(block.readings), -1)
            found.append(np.repeat(of, block.observation.components))
        return np.concatenate(found).astype(np.intp)

    @cached_property
    def fold(self) -> NDArray[np.intp]:
        """Fold of each row, ``(rows,)``; -1 for those that every fold trains on."""
        return np.where(self.configuration < 0, -1, self.folds.of[self.configuration])

    @cached_property
    def _whitening(self) -> Whitening | None:
        components = self.solved.components
        if components is None or not components.weighing.joints.any():
            return None
        return Whitening(Visits(self.problem.visits), self._by_joints * np.sqrt(components.weighing.joints))

    @cached_property
    def _root_weight(self) -> Array:
        """Square root of what the loss left of each row, ``(rows,)``."""
        weight = np.maximum(self.solved.solution.weight, _LEAST_WEIGHT)
        return np.asarray(np.sqrt(np.repeat(weight, self.problem.components)))

    def _weighed(self, rows: Array) -> Array:
        rows = np.asarray(rows * (self._root_weight[:, None] if rows.ndim == 2 else self._root_weight))
        return np.asarray(rows if self._whitening is None else self._whitening.applied(rows))

    def in_metres(self, rows: Array) -> Array:
        """Return weighed rows as differences of what was read [m or rad], ``(rows,)`` or ``(rows, columns)``."""
        plain = rows if self._whitening is None else self._whitening.undone(rows)
        scale = self._sigma / self._root_weight
        return np.asarray(plain * (scale[:, None] if plain.ndim == 2 else scale))

    def pulls(self, rows: Array, spent: float, among: NDArray[np.bool_] | None = None) -> Pulls | None:
        """Return what weighed residuals ``(rows,)`` say of errors of the joints; None where no position was read.

        Args:
            spent: How many equations' worth of residual the fit used up.
            among: Rows that are looked at, ``(rows,)``; all if None.
        """
        compared, components = self.compared
        if components != 3:
            return None
        mine = compared if among is None else compared[among[compared]]
        used, of = np.unique(self.configuration[mine], return_inverse=True)
        sigma = self._sigma[mine]
        r = self.in_metres(rows)[mine]
        J = self._by_joints[mine] * sigma[:, None]
        n, k = len(used), J.shape[1]
        pull, weight = np.zeros((n, k)), np.zeros((n, k, k))
        np.add.at(pull, of, -J * r[:, None])
        np.add.at(weight, of, J[:, :, None] * J[:, None, :])
        # The targets of a configuration share its errors, so that it counts as one reading of three coordinates.
        free = 3 * n - round(spent)
        return Pulls(self.problem.data.joints[used], pull, weight, float(r @ r), max(free, 1))

    @cached_property
    def _by_joints(self) -> Array:
        return self.problem.at(self.solved.solution.vector).by_joints

    @cached_property
    def _sigma(self) -> Array:
        return np.concatenate([np.repeat(b.sigma, b.observation.components) for b in self.problem.blocks])

    @cached_property
    def compared(self) -> tuple[NDArray[np.intp], int]:
        """Rows by which models are compared, those of a reading together, and how many a reading has.

        Positions; where there are none, lengths. Without readings of targets and places that one fold alone knows.
        """
        for kinds, components in ((("position",), 3), (("distance", "height"), 1), (("orientation",), 3)):
            rows, first = [], 0
            for block in self.problem.blocks:
                mine = first + np.arange(block.rows)
                first += block.rows
                if block.data is not self.problem.data or block.observation.name not in kinds:
                    continue
                if len(np.unique(self.fold[mine])) > 1:
                    rows.append(mine)
            if rows:
                return np.concatenate(rows), components
        return np.zeros(0, dtype=np.intp), 1

    def by_configuration(self, left: Array) -> Array:
        """Return the mean error of each configuration [m], NaN where nothing is compared, ``(n,)``.

        Args:
            left: Of the rows that are compared [m], ``(compared rows,)``.
        """
        rows, components = self.compared
        of = self.configuration[rows][::components]
        count = np.bincount(of, minlength=len(self.folds.of))
        sizes = np.sqrt(np.sum(left.reshape(-1, components) ** 2, axis=1))
        total = np.bincount(of, sizes, minlength=len(self.folds.of))
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)

    def errors(self, held_out: Array) -> Array:
        """Return the same for the weighed residual of every row, ``(rows,)``."""
        return self.by_configuration(self.in_metres(held_out)[self.compared[0]])

    def linear(self, without: Sequence[str] = ()) -> tuple[Array, Array, Array, Array]:
        """Return the fit, linearised, without some joint effects: what :meth:`LinearFit.of` takes, but the folds."""
        free, solution = self.problem.free, self.solved.solution
        offset = (solution.vector - free.nominal) / free.prior
        out = np.array([p.group in without for p in free.parameters], dtype=bool)
        fixed = bound_by(solution, free, self.solved.limits)
        columns = solution.jacobian * free.prior
        residual = solution.residual - columns[:, out] @ offset[out]
        kept = ~out & ~fixed
        penalty = np.full(int(kept.sum()), 1.0 if self.problem.priors else _HARDLY)
        return self._weighed(residual), self._weighed(columns[:, kept]), offset[kept], penalty

    def start(self, without: Sequence[str] = ()) -> LinearFit:
        """Return the fit, linearised, without some joint effects."""
        return LinearFit.of(*self.linear(without), self.fold)

    @cached_property
    def _curve(self) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
        """Columns of the joints' curves [1/rad], and the joint and the periods of each coefficient."""
        robot = self.solved.robot.with_effects([JointCurve.name])
        free = FreeParameters(tuple(p for p in robot.parameters.values() if p.group == JointCurve.name))
        terms = JointCurve(robot.layout).terms
        joint = np.concatenate([np.full(len(names), i) for i, names in terms.items()])
        period = np.concatenate([np.arange(len(names)) // 2 + 1 for names in terms.values()])
        return self.columns([JointCurve.name])[JointCurve.name] / free.prior, joint, period

    def curves(self, without: Sequence[str], beside: Array) -> CurveColumns:
        """Return the columns of the joints' curves.

        Args:
            without: Effects of the fit that are left out of account.
            beside: Columns of what the curves shall not say themselves, ``(rows, m)``.
        """
        columns, joint, period = self._curve
        residual, base, offset, _ = self.linear(without)
        others = np.concatenate([base, beside], axis=1)
        every = np.column_stack([others, columns, base @ offset - residual])
        parts = [every[self.fold == number] for number in range(-1, FOLDS)]
        moments = np.stack([part.T @ part for part in parts])
        rows = np.array([len(part) for part in parts])
        return CurveColumns(columns, joint, period, moments, rows, others.shape[1])

    def columns(self, names: Sequence[str], robot: Robot | None = None, *, ordered: bool = True) -> dict[str, Array]:
        """Return the columns of joint effects per prior, weighed as the fit is, ``(rows, parameters)`` each.

        Args:
            names: Effects; those that the fit has already, too.
            robot: The fitted robot with other facts about its joints, if not itself.
            ordered: Whether the order of the configurations is known.
        """
        robot = in_the_middle((robot or self.solved.robot).with_effects(names), self.problem.data)
        grouped = {name: [p for p in robot.parameters.values() if p.group == name] for name in names}
        free = FreeParameters(tuple(p for group in grouped.values() for p in group))
        if not free.parameters:
            return {}
        problem = replace(self.problem, robot=robot, free=free)
        if self.problem.postures.loads is not None:  # effects that do nothing yet leave the loads as they are
            problem.__dict__["postures"] = self.problem.postures
        if not ordered:
            problem.__dict__["postures"] = replace(problem.postures, number=None, approach=None)
        J = self._weighed(problem.at(free.start).jacobian * free.prior)
        found, first = {}, 0
        for name, group in grouped.items():
            found[name] = J[:, first : first + len(group)]
            first += len(group)
        return {name: columns for name, columns in found.items() if columns.shape[1]}
