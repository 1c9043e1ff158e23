"""What readings say of the joints' curves, and readings on one side that a loss holds back."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from truearm.engine.base.errors import Notice, Rule, counted
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.unmodelled import WRONG_DATA, LeftOver
from truearm.engine.fit.fit import Fit
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.compliance import Compliance
from truearm.engine.robot.effects.joint_curve import HIGHEST, JointCurve, curve_names, curve_waves
from truearm.engine.robot.loads import has_weight
from truearm.engine.robot.parameters import FreeParameters

#: A joint that turned through less [rad] can hardly tell a curve from geometry.
_LITTLE: Final = math.radians(30.0)
#: What is not measured of a turn, from which it is said that the curve is not known there [rad].
_GAP: Final = math.radians(20.0)
#: Training configurations from which on errors that follow the joints' angles are told from others.
ENOUGH: Final = 200


def has_curves(fit: Fit) -> bool:
    """Return whether a fit found a curve of any joint."""
    return any(parameter.group == JointCurve.name for parameter in fit.free.parameters)


def about_curves(fit: Fit, configurations: int) -> str:
    """Say what is not known of joint curves, where a fit has none; empty where they are known to be none.

    Args:
        configurations: That the fit was made from.
    """
    if has_curves(fit) or not JointCurve(fit.robot.layout).parameters:
        return ""
    looked_for = JointCurve.name in fit.model.effects
    if configurations < ENOUGH:
        compare = "" if looked_for else f", and compare with `effects={JointCurve.name}`"
        words = (
            f"errors that follow a joint's angle, as those of gears and encoders do, cannot be told from "
            f"{counted(configurations, 'training configuration')}: measure about {ENOUGH}{compare}"
        )
    elif looked_for:
        return ""
    else:
        words = (
            f"errors that follow a joint's angle in more than two periods a turn were not looked for: compare with "
            f"`effects={JointCurve.name}`"
        )
    return words[0].upper() + words[1:] + "."


CURVE_LEFT_OUT: Final = Rule(
    "curve-left-out",
    "note",
    "joints for which the data show no [curve](joint-curves.md), or that turned too little to tell one from geometry",
)
CURVE_RANGE: Final = Rule(
    "curve-range",
    "note",
    "curves of joints that were measured through a part of the turn only: known there, and uncertain elsewhere",
)


def check_curves(fit: Fit, training: Dataset) -> list[Notice]:
    """Say which joints got no curve, and where the others are known.

    Args:
        training: The readings that were fitted.
    """
    if JointCurve.name not in fit.model.effects:
        return []
    robot, joints = fit.robot, training.postures.joints
    effect = next(effect for effect in robot.effects if isinstance(effect, JointCurve))
    free = set(fit.free.names)
    little, none, partly = list[str](), list[str](), list[str]()
    for i, names in effect.terms.items():
        low, high = float(joints[:, i].min()), float(joints[:, i].max())
        name = robot.joints[i].name
        if free.isdisjoint(names):
            (little if high - low < _LITTLE else none).append(f"{name} ({np.rad2deg(high - low):.0f} deg)")
        elif high - low < 2.0 * math.pi - _GAP:
            partly.append(f"{name} from {np.rad2deg(low):.0f} to {np.rad2deg(high):.0f} deg")
    notices = []
    if (little or none) and not fit.model.weighed:
        words = []
        if none:
            words.append(f"these readings show no error that follows the angle of {', '.join(none)}")
        if little:
            words.append(f"{', '.join(little)} turned too little to tell such an error from geometry")
        sentence = "; ".join(words)
        notices.append(
            CURVE_LEFT_OUT(
                f"Joints without a curve (in brackets how far each turned): {sentence}. More configurations, through "
                "more of the turn, may show one."
            )
        )
    if partly:
        notices.append(
            CURVE_RANGE(
                f"Curves of joints are known where these were measured: {'; '.join(partly)}. Outside they are what "
                "was found there, continued. The expected error over the workspace contains what that may be off by, "
                "as far as other joints and ordinary encoders tell."
            )
        )
    return notices


# Whether curves of joints stand in for joints that give way.
#
# Gravity turns joint 2 by something that depends on its angle, nearly, so that a model without compliance finds a curve
# instead. That curve predicts readings under the same load, and no others.

#: Share of the squares of what the curves do to the readings, from which on compliance is the simpler cause.
_MOST: Final = 0.6


CURVES_OF_LOADS: Final = Rule(
    "curves-of-loads",
    "warning",
    "no `compliance` in the model, and it would do most of what the [curves](models.md#curves) do: they are right "
    "for one payload only",
    cure="Compare with `effects=compliance` beside them, or with `model=auto`.",
    unless=frozenset({WRONG_DATA}),
)


def check_curves_of_loads(left: LeftOver) -> list[Notice]:
    """Say if joints that give way would do most of what the curves of a fit do.

    What geometry can take is taken out of both first (Frisch and Waugh 1933).
    """
    share = share_of_loads(left)
    if share < _MOST:
        return []
    return [
        CURVES_OF_LOADS(
            f"Joints that give way under their loads would do {share:.0%} of what the curves of the joints do, with "
            "one number a joint. The curves are then right for this payload and mounting only."
        )
    ]


def share_of_loads(left: LeftOver) -> float:
    """Return how much of what curves do to the readings compliance would do, 0 to 1; 0 where it is no rival."""
    fit, free = left.fit, left.fit.free
    curved = np.array([p.group == JointCurve.name for p in free.parameters], dtype=bool)
    loaded = has_weight(fit.robot) or left.problem.data.wrench is not None
    if not curved.any() or not loaded or Compliance.name in fit.model.effects:
        return 0.0
    if any(effect.name == Compliance.name for effect in fit.robot.effects):  # it is known, and held
        return 0.0
    values = np.array([fit.robot.values[name] for name in free.names])
    others = left.jacobian[:, ~curved] * free.prior[~curved]
    U, s, _ = np.linalg.svd(others, full_matrices=False)
    Q = U[:, s > 1.0]
    robot = fit.robot.with_effects([Compliance.name])
    springs = FreeParameters(tuple(p for p in robot.parameters.values() if p.group == Compliance.name))
    columns = replace(left.problem, robot=robot, free=springs).at(springs.start).jacobian * springs.prior
    deflection = left.jacobian[:, curved] @ values[curved]
    columns, deflection = columns - Q @ (Q.T @ columns), deflection - Q @ (Q.T @ deflection)
    total = float(deflection @ deflection)
    if total <= float(len(deflection)) * 1e-6:
        return 0.0
    amounts = np.linalg.solve(columns.T @ columns + np.eye(columns.shape[1]), columns.T @ deflection)
    residual = deflection - columns @ amounts
    return max(1.0 - float(residual @ residual) / total, 0.0)


#: Weight below which a reading counts as held back.
_OUTLYING: Final = 0.5
#: Configurations with such readings, at least.
_LEAST: Final = 8
#: Chi squared of three degrees of freedom that chance exceeds in 1 of 10 000 cases.
_BEYOND_CHANCE: Final = 21.1


OUTLIERS_ONE_SIDED: Final = Rule(
    "outliers-one-sided",
    "warning",
    "readings that a loss holds back lie to one side",
    cure="Find the cause and leave these readings out.",
)


# Readings that a robust loss holds back, and that lie to one side.
#
# Losses such as Huber's are right on average where outliers scatter to all sides. Outliers that lie to one side pull
# the fit along, by less than they would pull least squares, and no interval contains that bias. The sides are compared
# by visit with what chance does to directions in space (Rayleigh's test; Mardia and Jupp 2000, "Directional
# statistics", section 10.4.1).
def check_one_sided(fit: Fit, data: Dataset) -> list[Notice]:
    """Return a notice if positions that a loss holds back lie to one side.

    Args:
        data: What the fit was made from.
    """
    outlying = (np.nan_to_num(fit.weight, nan=1.0) < _OUTLYING) & data.has_position
    if not outlying.any():
        return []
    off = -errors_of(fit.robot, data).position_errors[outlying]
    towards = off / np.maximum(np.linalg.norm(off, axis=1, keepdims=True), 1e-300)
    visits = np.unique(data.configuration[outlying], return_inverse=True)[1].reshape(-1)
    count = np.bincount(visits)
    if len(count) < _LEAST:
        return []
    mean = np.stack([np.bincount(visits, weights=axis) / count for axis in towards.T], axis=1)
    together = mean.sum(axis=0)
    if 3.0 * float(together @ together) / float(np.sum(mean**2)) < _BEYOND_CHANCE:
        return []
    shift = ", ".join(f"{v * 1e3:+.2g}" for v in np.median(off, axis=0).tolist())
    return [
        OUTLIERS_ONE_SIDED(
            f"{int(outlying.sum())} readings at {len(count)} configurations are held back as outliers, and they lie to "
            f"one side: by ({shift}) mm in the instrument's axes, in the median. Outliers to one side pull the fit "
            "along, and the deviations of the parameters do not contain that bias."
        )
    ]


#: Angles without a training configuration that are wider than this are outside the measured range [rad].
_LARGEST_GAP: Final = math.radians(20.0)
#: Steps of a grid on which a curve is looked at [rad]: a twelfth of the shortest period.
_STEP: Final = math.radians(0.5)
#: A neighbour belongs to a group of periods if its square is at least this share of the group's largest.
_BELONGS: Final = 0.5
#: Groups of periods that are told.
_GROUPS: Final = 3
#: Curves smaller than this everywhere are none [rad].
_NOTHING: Final = 1e-9


@dataclass(frozen=True)
class Periods:
    """Neighbouring numbers of periods in a turn at which a curve is strong."""

    lowest: int  #: lowest, highest: periods in a turn, both included.
    highest: int
    amplitude: float  #: Root of the sum of the squares of their amplitudes [rad].

    @property
    def range(self) -> str:
        """Such as ``1`` or ``19 to 22``."""
        return f"{self.lowest}" if self.lowest == self.highest else f"{self.lowest} to {self.highest}"


@dataclass(frozen=True, eq=False)
class FittedCurve:
    """The curve of one joint, as a fit found it."""

    number: int  #: Of the joint, from 1.
    name: str  #: Of the joint.
    amounts: Array  #: Sine and cosine of 1, 2 .. periods in turns [rad], ``(2 periods,)``.
    covariance: Array  #: Of them [rad^2], ``(2 periods, 2 periods)``.
    #: From where to where the joint is looked at [rad]: its limits, or one turn where they are wider or there are none.
    shown: tuple[float, float]
    #: Where it was in the training part [rad], in order, ``(n,)``; moved by whole turns into `shown` if that is one.
    places: Array

    @property
    def whole_turn(self) -> bool:
        """Whether the last angle that is looked at is the first one again."""
        return self.shown[1] - self.shown[0] > 2.0 * math.pi - 1e-9

    @cached_property
    def angles(self) -> Array:
        """Angles on which the curve is looked at [rad], ``(n,)``."""
        return np.linspace(*self.shown, max(2, math.ceil((self.shown[1] - self.shown[0]) / _STEP) + 1))

    def at(self, angles: Array) -> tuple[Array, Array]:
        """Return the curve and its standard deviation [rad] at angles ``(n,)``, each ``(n,)``."""
        waves = curve_waves(np.asarray(angles, float), len(self.amounts) // 2)
        variance = np.sum(waves * (self.covariance @ waves), axis=0)
        return np.asarray(self.amounts @ waves), np.sqrt(np.maximum(variance, 0.0))

    @cached_property
    def measured(self) -> tuple[tuple[float, float], ...]:
        """The ranges in which there are training configurations [rad], in order; gaps of 20 deg part them."""
        if not len(self.places):
            return ()
        ends = np.flatnonzero(np.diff(self.places) > _LARGEST_GAP)
        first, last = self.places[[0, *(ends + 1)]], self.places[[*ends, -1]]
        low, high = self.shown
        if (
            self.whole_turn and self.places[0] + high - low - self.places[-1] <= _LARGEST_GAP
        ):  # across the end of the turn
            first, last = np.r_[low, first[1:]], np.r_[last[:-1], high]
        return tuple(zip(first.tolist(), last.tolist(), strict=True))

    @cached_property
    def rms(self) -> float:
        """Root mean square about its mean in the measured ranges [rad]; in all that is shown if there are none."""
        return float(np.std(self.at(self._looked_at)[0]))

    @cached_property
    def rms_deviation(self) -> float:
        """Standard deviation of the root mean square [rad], by its derivatives."""
        waves = curve_waves(self._looked_at, len(self.amounts) // 2)
        waves -= waves.mean(axis=1, keepdims=True)
        slope = waves @ (self.amounts @ waves) / (waves.shape[1] * max(self.rms, _NOTHING))
        return math.sqrt(max(float(slope @ self.covariance @ slope), 0.0))

    @cached_property
    def _looked_at(self) -> Array:
        inside = np.zeros(len(self.angles), dtype=bool)
        for low, high in self.measured:
            inside |= (self.angles >= low) & (self.angles <= high)
        return self.angles[inside] if inside.any() else self.angles

    @cached_property
    def strongest(self) -> tuple[Periods, ...]:
        """Where it is strong, the strongest first; neighbours share what a range shorter than a turn cannot part."""
        squares = self.amounts[0::2] ** 2 + self.amounts[1::2] ** 2
        left = squares.copy()
        groups: list[Periods] = []
        while len(groups) < _GROUPS and left.max() > 0.01 * squares.max():
            top = low = high = int(np.argmax(left))
            while low > 0 and left[low - 1] > _BELONGS * left[top]:
                low -= 1
            while high + 1 < len(left) and left[high + 1] > _BELONGS * left[top]:
                high += 1
            groups.append(Periods(low + 1, high + 1, math.sqrt(float(left[low : high + 1].sum()))))
            left[low : high + 1] = 0.0
        return tuple(groups)


def fitted_curves(fit: Fit, training: Dataset) -> tuple[FittedCurve, ...]:
    """Return the curves that a fit found, joint by joint; none of joints whose curve is zero.

    Args:
        training: The readings that it was made from.
    """
    return tuple(_curves(fit, training))


def _curves(fit: Fit, training: Dataset) -> Iterator[FittedCurve]:
    place = {name: i for i, name in enumerate((*fit.free.names, *fit.unfitted))}
    uncertain = fit.covariance_with_unfitted
    for number, joint in enumerate(fit.robot.joints, 1):
        names = curve_names(number)
        known = [i for i, name in enumerate(names) if name in place]
        if not known:
            continue
        amounts = np.array([fit.robot.values[name] for name in names])
        if not (np.abs(amounts) > _NOTHING).any():
            continue
        covariance, rows = np.zeros((2 * HIGHEST, 2 * HIGHEST)), [place[names[i]] for i in known]
        covariance[np.ix_(known, known)] = uncertain[np.ix_(rows, rows)]
        turn = 2.0 * math.pi
        shown = joint.limits
        places = training.joints[:, number - 1]
        if shown is None or shown[1] - shown[0] >= turn:
            shown = (-math.pi, math.pi)
            places = (places + math.pi) % turn - math.pi
        else:
            shown = (min(shown[0], float(places.min())), max(shown[1], float(places.max())))
        yield FittedCurve(number, joint.name, amounts, covariance, shown, np.sort(places))
