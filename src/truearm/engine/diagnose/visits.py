"""Joint errors at visits: lag, separate visits, and declared deviations that are far too large."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import Notice, Rule
from truearm.engine.base.units import from_si
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.unmodelled import WRONG_DATA, LeftOver, chi_squared_tail, without_bending
from truearm.engine.fit.likelihood import Linearised, Visits
from truearm.engine.fit.rounds import DECLARED, factors_of
from truearm.engine.fit.variance_components import Variances, largest_likelihood
from truearm.engine.robot.chain import Array

# How likely the readings are if visits, their noise or the errors of the joints were others than the fit took.
#
# The fit groups readings by configuration and takes declared deviations as they are. What it leaves can be asked
# whether something else is more likely: by the same restricted likelihood, with the parameters integrated out at the
# solution (:mod:`truearm.engine.fit.variance_components`). Twice the gain of a free variance is chi squared of one
# degree of freedom (Wilks 1938).

#: Readings that are left so many times farther off than half of them are outliers: no variance is made of these.
_OUTLIER: Final = 6.0
_LEAST: Final = 1e-12
#: Configurations that are looked at, evenly spaced; more would tell no more, and take longer than the fit.
_CONFIGURATIONS: Final = 100


@dataclass(frozen=True, eq=False)
class VisitLikelihood:
    """The likelihood of what a fit leaves."""

    left: LeftOver  #: What it leaves.
    at: Linearised  #: The fit linearised there, with visits as they are taken; outliers left out.
    factors: tuple[str, ...]  #: What the variances of readings are counted under.

    @classmethod
    def of(cls, left: LeftOver, *, each_reading: bool = False) -> VisitLikelihood:
        """Take the visits of the data, or every reading as one of its own."""
        problem, free = left.problem, left.fit.free
        values = np.array([left.fit.robot.values[name] for name in free.names])
        names, factor = factors_of(problem)
        of_reading = _readings(left)
        visits = of_reading if each_reading else problem.visits
        used = _no_outliers(left.residual, of_reading) & _some(left)
        return cls(
            left,
            Linearised(
                residual=left.residual[used],
                by_parameters=left.jacobian[used] * free.prior,
                by_joints=problem.at(values).by_joints[used],
                offset=(values - free.nominal) / free.prior,
                priors=True,
                visits=Visits(np.unique(visits[used], return_inverse=True)[1].reshape(-1)),
                factor=factor[used],
            ),
            tuple(names),
        )

    def largest(self, known: tuple[str, ...] = (), joints: Array | None = None) -> tuple[Variances, float]:
        """Return the likeliest variances, by those that the fit took, and the logarithm of their likelihood.

        Args:
            known: Factors whose variance is what the fit took.
            joints: Variances of the joints' errors where they are known, ``(joints,)``.
        """
        kinds = np.array([joint.kind for joint in self.left.fit.robot.joints])
        alike = [np.flatnonzero(kinds == kind) for kind in dict.fromkeys(kinds.tolist())]
        free = [name not in known for name in self.factors]
        return largest_likelihood(self.at, free, np.full(len(free), _LEAST), alike, joints)

    def share_of_joints(self, variances: Variances) -> float:
        """Return what errors of the joints do to the readings, by what noise does: a ratio of variances."""
        by_joints = float(np.sum(self.at.by_joints**2 @ variances.joints))
        return by_joints / max(float(np.sum(variances.factors[self.at.factor])), _LEAST)


def lever_of(left: LeftOver) -> float:
    """Return how far targets move if every turning joint errs by one, as a root mean square [m/rad]; 0 if by nothing.

    The squares of the joints add up.
    """
    problem = left.problem
    turning = np.array([joint.kind == "revolute" for joint in left.fit.robot.joints])
    values = np.array([left.fit.robot.values[name] for name in left.fit.free.names])
    by_joints, first, squares, count = problem.at(values).by_joints[:, turning], 0, 0.0, 0
    for block in problem.blocks:
        rows = by_joints[first : first + block.rows].reshape(len(block.readings), -1)
        first += block.rows
        if block.observation.name == "position":
            squares += float(np.sum((rows * block.sigma[:, None]) ** 2))
            count += len(block.readings)
    return float(np.sqrt(squares / max(count, 1)))


def joints_as_far_off(left: LeftOver) -> float:
    """Return the error of every turning joint that would move targets as far as they are left off [rad]; 0 if none can.

    As a root mean square, with the share that parameters have taken given back, and what is declared as noise taken
    out.
    """
    off = errors_of(left.fit.robot, left.problem.data).position_norms
    lever = lever_of(left)
    if not len(off) or lever <= 0.0:
        return 0.0
    off = off[off <= _OUTLIER * np.median(off)]
    spent = sum(left.fit.robot.parameters[name].informed or 0.0 for name in left.fit.free.names)
    square = float(np.mean(off**2)) / max(1.0 - spent / (3 * len(off)), 0.1)
    if any(block.declared for block in left.problem.blocks):
        square -= 3.0 * left.fit.sigma.get("position", 0.0) ** 2
    return float(np.sqrt(max(square, 0.0))) / lever


def _readings(left: LeftOver) -> NDArray[np.intp]:
    """Return the reading that each equation is of, ``(rows,)``."""
    blocks = left.problem.blocks
    return np.concatenate([np.repeat(block.readings, block.observation.components) for block in blocks])


def _some(left: LeftOver) -> NDArray[np.bool_]:
    """Return which equations are of configurations that are looked at, ``(rows,)``."""
    count = left.problem.data.configurations
    chosen = np.linspace(0, count - 1, min(count, _CONFIGURATIONS)).round().astype(np.intp)
    return np.asarray(np.isin(left.configuration, chosen))


def _no_outliers(residual: Array, of_reading: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return which equations are of readings that are not far off, ``(rows,)``."""
    squares = np.bincount(of_reading, weights=residual**2)
    rows = np.maximum(np.bincount(of_reading), 1)
    size = np.sqrt(squares / rows)
    present = np.bincount(of_reading) > 0
    return np.asarray((size <= _OUTLIER * float(np.median(size[present])))[of_reading])


# Were the joints at rest when they were read: residuals explained by the direction each joint arrived from.
#
# If joints were read before the robot settled, or if a joint stops short by friction, the true joint position differs
# from the recorded one by a small lag with the sign of the last move. These lags, one a joint, are fitted to the
# residuals of the identified model, after removing what its own parameters could still take.

#: Part of the residuals that the direction of approach must explain, and of the joints that must lag with one sign.
_LEAST_EXPLAINED: Final = 0.05
_LEAST_OF_ONE_SIGN: Final = 2 / 3
#: Noise alone must show a direction of approach that explains as much less often than this.
_LARGEST_CHANCE: Final = 1e-3


#: A joint that moves the readings by a smaller share than others do has no lag that could be told.
_HARDLY_SEEN: Final = 1e-3


@dataclass(frozen=True, eq=False)
class ApproachLag:
    """What the approach direction explains."""

    share: float  #: Part of the residual's root mean square that it explains, corrected for the number of joints.
    #: Probability that noise alone shows as much. The targets of a configuration share what the model leaves, so it
    #: counts as one reading of three coordinates.
    chance: float
    #: True minus recorded position of each joint, times the sign of the last move [rad; m for sliding joints].
    lags: Array

    @property
    def fires(self) -> bool:
        """Whether it explains at least 5 %, more than chance, with one sign on most joints."""
        same = max(int((self.lags > 0).sum()), int((self.lags < 0).sum()))
        is_large = self.share >= _LEAST_EXPLAINED and self.chance < _LARGEST_CHANCE
        return is_large and same > _LEAST_OF_ONE_SIGN * len(self.lags)


def approach_lag(left_over: LeftOver) -> ApproachLag | None:
    """Return what approach directions explain of the residuals of a fit, beyond what joints that give way could.

    None where too few readings are left, or where the order of measurement is not known.
    """
    data, problem = left_over.problem.data, left_over.problem
    asked = left_over.asked
    if data.number is None or asked.number is None:
        return None
    left_over = without_bending(left_over)
    evaluation = problem.at(np.array([problem.robot.values[name] for name in problem.free.names]))
    H = evaluation.by_joints * _last_moves(asked, asked.number)[left_over.chosen][left_over.configuration]
    free = left_over.freedom
    if free < 4 * H.shape[1]:
        return None
    left, moved = left_over.without_parameters(left_over.residual), left_over.without_parameters(H)
    lags = np.asarray(np.linalg.lstsq(moved, left, rcond=_HARDLY_SEEN)[0], dtype=np.float64)
    before = float(left @ left) / free
    after = float(np.sum((left - moved @ lags) ** 2)) / (free - H.shape[1])
    share = 1.0 - after * (free - H.shape[1]) / (before * free) if before > 0 else 0.0
    effective = max(3 * data.configurations - left_over.basis.shape[1], 0)
    chance = chi_squared_tail(effective * share, H.shape[1])
    return ApproachLag(1.0 - float(np.sqrt(after / before)) if before > 0 else 0.0, chance, -lags)


def _last_moves(data: Dataset, number: Array) -> Array:
    """Return the sign of each joint's move from the configuration measured before, ``(configurations, joints)``.

    It is 0 where that one is not in the data.
    """
    order = np.argsort(number, kind="stable")
    moves = np.zeros_like(data.joints)
    follows = np.diff(number[order])[:, None] == 1
    moves[order[1:]] = np.where(follows, np.sign(np.diff(data.joints[order], axis=0)), 0.0)
    return moves


JOINTS_NOT_SETTLED: Final = Rule(
    "joints-not-settled", "warning", "residuals that depend on the direction from which each joint arrived"
)


def check_approach_lag(left_over: LeftOver) -> list[Notice]:
    """Return a notice if the joints were not at rest."""
    approach = approach_lag(left_over)
    if approach is None or not approach.fires:
        return []
    units = ["deg" if kind == "revolute" else "mm" for kind in left_over.problem.data.joint_kinds]
    shown = ", ".join(
        f"{from_si(lag, unit):+.3f} {unit}" for lag, unit in zip(approach.lags.tolist(), units, strict=True)
    )
    return [
        JOINTS_NOT_SETTLED(
            f"The direction from which each joint arrived explains {approach.share:.0%} of what the "
            f"{left_over.fit.model.name} model leaves. The true joint positions differ from the recorded ones by "
            f"{shown}, times the sign of the last move. Either the joints were read before the robot had settled: use "
            "the commanded joints, or read later. Or the joints have hysteresis: arrive from one side only."
        )
    ]


# Were the targets of a configuration read on separate visits, although the data call it one visit.
#
# The robot then stopped anew for every target, and what the joints missed by differs from reading to reading. It still
# looks like errors of joints: it grows with the distance from their axes. So the likelihood in which all readings of a
# configuration share the errors of the joints is compared with the one in which each reading has its own.

#: Twice the difference of the logarithms of both likelihoods from which separate visits are believed. They have the
#: same parameters, so it is the difference of their Bayesian information criteria; beyond 10 it is very strong (Kass
#: and Raftery 1995, "Bayes factors", section 3.2), and noise that is no sphere has given 15.
_LEAST_GAIN: Final = 20.0
#: Variance that errors of the joints make of that of the noise, at least: below it nothing depends on visits.
_LEAST_SHARE: Final = 0.5
#: Configurations with two readings or more, without which nothing is said.
_LEAST_SHARED: Final = 8


SEPARATE_VISITS: Final = Rule(
    "separate-visits",
    "warning",
    "readings of a configuration err as joints err, but each by itself: the robot left and came back between them",
    cure="Add the column `visit`, with the number of the visit on which each reading was taken; without it the "
    "expected error and all intervals are too small.",
    unless=frozenset({WRONG_DATA}),
)


def check_separate_visits(left: LeftOver) -> list[Notice]:
    """Return a notice if the readings of a configuration do not share the errors of the joints that they show."""
    data = left.problem.data
    several = np.bincount(data.configuration[data.has_reading]) > 1
    if data.visit is not None or int(several.sum()) < _LEAST_SHARED:
        return []
    together, apart = VisitLikelihood.of(left), VisitLikelihood.of(left, each_reading=True)
    variances, each = apart.largest()
    if apart.share_of_joints(variances) < _LEAST_SHARE:
        return []
    shared = max(together.largest()[1], together.largest(together.factors)[1])
    if 2.0 * (each - shared) < _LEAST_GAIN:
        return []
    return [
        SEPARATE_VISITS(
            "The readings of a configuration err as joints err, but each by itself, where readings of one visit "
            "share the errors of the joints. So the targets were read on separate visits: the robot left and came back "
            "between them."
        )
    ]


#: Declared deviations are called too large if a fit agrees with itself at less than half of them, by more than chance:
#: instruments are stated with some reserve, never with that much.
_LARGEST_RATIO: Final = 0.5
#: The priors hold the parameters back if the declared deviations leave so many times more than those that agree.
_PRIORS_WIN: Final = 1.5
#: Equations beyond the parameters without which nothing is said.
_LEAST_FREEDOM: Final = 10.0
#: Lower quantile of the normal distribution of 1 in 1000, as in the judgement of residuals that are too large.
_QUANTILE: Final = 3.09
_ROUNDS: Final = 30
#: Where joints err too: largest share of the declared deviations that the noise is, and twice the gain in likelihood by
#: that noise, which chance exceeds in 1 of 1000 cases at most.
_LARGEST_SHARE: Final = 1.0 / 1.5
_LEAST_GAIN_SIGMA: Final = 10.83
#: Errors of the joints must move readings by this part of the declared deviations, or the first judgement holds.
_LEAST_MOVED: Final = 0.1
#: One target hardly tells noise from errors of the joints: beyond so many times no number is given.
_LARGEST_STATED: Final = 10.0
_SMALLEST_RATIO: Final = 1e-7


SIGMA_TOO_LARGE: Final = Rule(
    "sigma-too-large",
    ("warning", "error"),
    "the declared deviations are more than twice what the readings scatter by, or 1.5 times the noise that they show "
    "beside errors of the joints: [more](results.md#standard-deviations)",
    gravity=2,
)


# Residuals alone may not show a sigma that is too large. Where sigma is so large that the priors hold the parameters
# back, the residuals are as large as the robot's own errors. So the deviation is sought with which a fit agrees with
# itself: its residuals, per degree of freedom, are as large as it was told. Near the solution a fit is linear, and in
# the directions of the singular value decomposition of its Jacobian per prior each parameter is found alone, so no fit
# is repeated.
#
# Where joints err at every visit the residuals are large for that reason, and a sigma that is too large takes a part
# of it for noise. So the likelihood with that sigma is compared with the one in which the noise is free.
def check_sigma(left: LeftOver) -> list[Notice]:
    """Return a notice if the declared deviations of the readings are far too large."""
    fit = left.fit
    blocks = left.problem.blocks
    if fit.excess > 1.0 or not any(block.declared for block in blocks):
        return []
    prior = left.turns @ ((np.array([fit.robot.values[n] for n in fit.free.names]) - fit.free.nominal) / fit.free.prior)
    along = left.basis.T @ left.residual
    beyond = max(float(left.residual @ left.residual - along @ along), 0.0)

    def ratio(assumed: float) -> tuple[float, float]:
        """Return residuals over declared deviations, and degrees of freedom, of a fit told so small a part of these."""
        pull = 1.0 / assumed**2
        step = -(pull * left.strength * along + prior) / (pull * left.strength**2 + 1.0)
        squares = beyond + float(np.sum((left.strength * step + along) ** 2))
        freedom = len(left.residual) - float(np.sum(pull * left.strength**2 / (pull * left.strength**2 + 1.0)))
        return float(np.sqrt(squares / max(freedom, 1.0))), freedom

    estimate, freedom = ratio(1.0)
    declared = float(np.sqrt(left.residual @ left.residual / max(freedom, 1.0)))
    for _ in range(_ROUNDS):
        before = estimate
        estimate, freedom = ratio(max(min(estimate, 1.0), _SMALLEST_RATIO))
        if abs(estimate - before) < 1e-3 * before:
            break
    k = 2.0 / (9.0 * max(freedom, 1.0))
    chance = max(1.0 - k - _QUANTILE * np.sqrt(k), 0.0) ** 1.5
    if freedom < _LEAST_FREEDOM or estimate >= _LARGEST_RATIO * chance:
        return []
    times = 1.0 / max(estimate, _SMALLEST_RATIO)
    size = _size(left)
    words = f"The declared deviations{size} are about {_rounded(times)} times larger than what the readings scatter by"
    if declared > _PRIORS_WIN * estimate:
        return [
            SIGMA_TOO_LARGE(
                f"{words}. So the priors hold the robot near its nominal values, and it is "
                f"{_rounded(declared / estimate)} times farther from the readings than it need be. Fix sigma or its "
                "unit, or leave it out: the noise is then estimated.",
                "error",
            )
        ]
    return [
        SIGMA_TOO_LARGE(
            f"{words}. The deviations of the parameters are too large by about as much. Fix sigma or its unit, or "
            "leave it out: the noise is then estimated."
        )
    ]


def check_sigma_beside_joints(left: LeftOver) -> list[Notice]:
    """Return a notice if the noise beside errors of the joints is far below the declared deviations."""
    if left.fit.excess > 1.0 or not any(block.declared for block in left.problem.blocks):
        return []
    if len(left.residual) - float(np.sum(left.strength**2 / (left.strength**2 + 1.0))) < _LEAST_FREEDOM:
        return []
    readings = VisitLikelihood.of(left)
    free, gained = readings.largest()
    largest, before = readings.largest((DECLARED,))
    share = float(np.sqrt(free.factors[readings.factors.index(DECLARED)]))
    if 2.0 * (gained - before) < _LEAST_GAIN_SIGMA or share > _LARGEST_SHARE:
        return []
    if readings.share_of_joints(free) * share**2 < _LEAST_MOVED:
        return []
    smaller = min(float(np.sqrt(largest.joints.sum() / free.joints.sum())), 1.0)
    part = f"{_rounded(100.0 * smaller)} %" if smaller > 0.0 else "none"
    times = f"about {_rounded(1.0 / share)}" if share > 1.0 / _LARGEST_STATED else f"more than {_LARGEST_STATED:g}"
    return [
        SIGMA_TOO_LARGE(
            f"The declared deviations{_size(left)} are {times} times larger than the noise that the readings show "
            f"beside errors of the joints. So the fit takes errors of the joints for noise: it finds {part} of them, "
            "and the expected error and the intervals may be too small. Declare one standard deviation "
            "of a coordinate, not a maximum permissible error or two deviations; or leave sigma out: the noise is then "
            "estimated."
        )
    ]


def _size(left: LeftOver) -> str:
    """Return the declared deviations of lengths in words, empty if there are none."""
    blocks = left.problem.blocks
    sigma = np.array([s for b in blocks if b.declared and b.observation.unit == "m" for s in b.sigma.tolist()])
    return f" ({np.sqrt(np.mean(sigma**2)) * 1e3:.3g} mm)" if len(sigma) else ""


def _rounded(value: float) -> str:
    """Return a number with two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):.10g}"
