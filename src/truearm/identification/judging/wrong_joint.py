"""Which joint was written down wrong at one configuration, by turning the joints one by one through all they can.

A wrong sign turns a joint by so much that straight lines tell nothing: another joint whose line happens to lead the
same way would be blamed. So the readings are predicted anew at each position that a joint may have had.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.identification.judging.left_over import LeftOver
from truearm.modeling.chain import Array

#: An error of one joint explains the readings of a configuration if it leaves less than so many times what other
#: configurations leave, or less than this share of the squares.
_AS_WELL: Final = 9.0
_EXPLAINED: Final = 1e-4
#: How much likelier one joint must be than each other one: a thousand times, as twice the logarithm.
_CLEARLY: Final = 2.0 * math.log(1e3)
#: Share of the squares that is left at most where a joint can be met by chance: by three numbers, or by its sign.
_BY_CHANCE: Final = 0.0025
_FEW_NUMBERS: Final = 3
#: Positions tried on a turn, and steps of Gauss and Newton from the best of them, each with so small a difference
#: [rad or m].
_TRIED: Final = 36
_STEPS: Final = 6
_DIFFERENCE: Final = 1e-6


@dataclass(frozen=True)
class WrongJoint:
    """A joint whose position alone explains the readings of a configuration."""

    number: int  #: From 1.
    error: float  #: What it was read too large by [rad or m].
    sign: bool  #: Whether its sign was wrong.


def wrong_joint(left: LeftOver, index: int, shift: Array, scale: float) -> WrongJoint | None:
    """Return the joint that explains what a configuration is off by, clearly better than each other joint does.

    Args:
        index: Of the configuration.
        shift: What its equations are off by from a fit without it, ``(equations,)``.
        scale: Mean square of what the other configurations leave.
    """
    total = float(shift @ shift)
    trials = _Trials(left, index, shift)
    moved = trials.nearest()
    rest, signs = trials.rest(moved), trials.rest(-2.0 * trials.noted)
    usual = _AS_WELL * max(scale, 1e-300)
    noise = max(usual * len(shift), _EXPLAINED * total)
    by_chance = _BY_CHANCE * total
    best = int(np.argmin(signs))
    if signs[best] <= min(noise, by_chance) and _clearly(signs, best, usual, len(shift)):
        return WrongJoint(best + 1, 2.0 * float(trials.noted[best]), sign=True)
    best = int(np.argmin(rest))
    allowed = min(noise, by_chance) if len(shift) <= _FEW_NUMBERS else noise
    if rest[best] > allowed or not _clearly(rest, best, usual, len(shift)):
        return None
    return WrongJoint(best + 1, -float(moved[best]), sign=False)


def _clearly(rest: Array, best: int, usual: float, equations: int) -> bool:
    """Return whether the best explanation is so much likelier than each other one."""
    others = np.delete(rest, best)
    square = max(usual, float(rest[best]) / equations)
    return not len(others) or float(others.min() - rest[best]) > _CLEARLY * square


class _Trials:
    """The equations of one configuration, with its joints elsewhere.

    Attributes:
        noted: Joint positions as they were noted: the controller's where they came as such, ``(joints,)``.
    """

    def __init__(self, left: LeftOver, index: int, shift: Array) -> None:
        self._left, self._shift = left, shift
        self._one = replace(left.problem.data, references=None).of_configurations([index])
        self._vector = np.array([left.fit.robot.values[name] for name in left.fit.free.names])
        joints = self._one.joints
        self._as_noted = self._one.joints_are == "converted"
        self.noted = left.fit.robot.controller.from_model(joints)[0] if self._as_noted else joints[0]
        self._given = self._equations(self.noted[None])[0]

    def rest(self, moved: Array) -> Array:
        """Return the sum of squares that is left with each joint moved by so much, ``(joints,)``.

        Args:
            moved: [rad or m], ``(joints,)``.
        """
        return np.asarray(np.sum(self._left_by(np.arange(len(moved)), moved) ** 2, axis=1))

    def nearest(self) -> Array:
        """Return how far each joint alone must be moved for what fits best [rad or m], ``(joints,)``."""
        kinds = self._left.problem.data.joint_kinds
        joints = np.arange(len(self.noted))
        around = np.arange(_TRIED) * (2.0 * math.pi / _TRIED)
        around[around > math.pi] -= 2.0 * math.pi
        turning = np.flatnonzero([kind == "revolute" for kind in kinds])
        moved = np.zeros(len(joints))
        if len(turning):
            r = self._left_by(np.repeat(turning, _TRIED), np.tile(around, len(turning)))
            moved[turning] = around[np.argmin(np.sum(r**2, axis=1).reshape(len(turning), _TRIED), axis=1)]
        best, least = moved, self.rest(moved)
        for _ in range(_STEPS):
            r = self._left_by(np.tile(joints, 2), np.concatenate([moved, moved + _DIFFERENCE]))
            here, slope = r[: len(joints)], (r[len(joints) :] - r[: len(joints)]) / _DIFFERENCE
            size = np.maximum(np.sum(slope**2, axis=1), 1e-300)
            moved = moved - np.where(size > 1e-300, np.sum(slope * here, axis=1) / size, 0.0)
            moved = np.where(np.abs(moved - best) < 1.0, moved, best)
            rest = self.rest(moved)
            best, least = np.where(rest < least, moved, best), np.minimum(rest, least)
        return best

    def _left_by(self, joints: NDArray[np.intp], moved: Array) -> Array:
        """Return what is left with one joint elsewhere, trial by trial, ``(trials, equations)``."""
        noted = np.tile(self.noted, (len(moved), 1))
        noted[np.arange(len(moved)), joints] += moved
        return np.asarray(self._shift + self._equations(noted) - self._given)

    def _equations(self, noted: Array) -> Array:
        """Return the equations of the configuration at other joint positions, ``(trials, equations)``."""
        problem = self._left.problem
        joints = self._left.fit.robot.controller.to_model(noted) if self._as_noted else noted
        data = self._one.of_configurations(np.zeros(len(noted), dtype=np.intp))
        problem = replace(problem, data=replace(data, joints=joints))
        where = [np.repeat(data.configuration[b.readings], b.observation.components) for b in problem.blocks]
        order = np.argsort(np.concatenate(where), kind="stable")
        return np.asarray(problem.residual(self._vector)[order].reshape(len(noted), -1))
