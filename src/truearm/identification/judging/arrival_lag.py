"""Were the joints at rest when they were read: residuals explained by the direction each joint arrived from.

If joints were read before the robot settled, or if a joint stops short by friction, the true joint position differs
from the recorded one by a small lag with the sign of the last move. These lags, one a joint, are fitted to the
residuals of the identified model, after removing what its own parameters could still take.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.identification.judging.left_over import LeftOver, chi_squared_tail
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.notices import Notice
from truearm.units import from_si

#: Part of the residuals that the direction of arrival must explain, and of the joints that must lag with one sign.
_LEAST_EXPLAINED: Final = 0.05
_LEAST_OF_ONE_SIGN: Final = 2 / 3
#: Noise alone must show a direction of arrival that explains as much less often than this.
_LARGEST_CHANCE: Final = 1e-3


@dataclass(frozen=True, eq=False)
class ArrivalLag:
    """What the arrival direction explains."""

    share: float  #: Part of the residual's root mean square that it explains, corrected for the number of joints.
    #: Probability that noise alone shows as much. The targets of a configuration share what the model leaves, so it
    #: counts as one reading of three coordinates.
    chance: float
    #: True minus recorded position of each joint, times the sign of the last move [rad; m for sliding joints].
    lags: Array

    @property
    def fires(self) -> bool:
        """Whether it explains at least 5 %, more than chance, with one sign on most joints."""
        positive = int((self.lags > 0).sum())
        same = max(positive, len(self.lags) - positive)
        told = self.share >= _LEAST_EXPLAINED and self.chance < _LARGEST_CHANCE
        return told and same > _LEAST_OF_ONE_SIGN * len(self.lags)


def arrival_lag(left_over: LeftOver) -> ArrivalLag | None:
    """Return what arrival directions explain of the residuals of a fit.

    None where too few readings are left, or where the order of measurement is not known.
    """
    data, problem = left_over.problem.data, left_over.problem
    given = left_over.given
    if data.number is None or given.number is None:
        return None
    here = problem.at(np.array([problem.robot.values[name] for name in problem.free.names]))
    H = here.by_joints * _last_moves(given, given.number)[left_over.chosen][left_over.configuration]
    free = left_over.freedom
    if free < 4 * H.shape[1]:
        return None
    left, moved = left_over.without_parameters(left_over.residual), left_over.without_parameters(H)
    lags = np.asarray(np.linalg.lstsq(moved, left, rcond=1e-10)[0], dtype=np.float64)
    before = float(left @ left) / free
    after = float(np.sum((left - moved @ lags) ** 2)) / (free - H.shape[1])
    share = 1.0 - after * (free - H.shape[1]) / (before * free) if before > 0 else 0.0
    effective = max(3 * data.configurations - left_over.basis.shape[1], 0)
    chance = chi_squared_tail(effective * share, H.shape[1])
    return ArrivalLag(1.0 - float(np.sqrt(after / before)) if before > 0 else 0.0, chance, -lags)


def _last_moves(data: Dataset, number: Array) -> Array:
    """Return the sign of each joint's move from the configuration measured before, ``(configurations, joints)``.

    It is 0 where that one is not in the data.
    """
    order = np.argsort(number, kind="stable")
    moves = np.zeros_like(data.joints)
    follows = np.diff(number[order])[:, None] == 1
    moves[order[1:]] = np.where(follows, np.sign(np.diff(data.joints[order], axis=0)), 0.0)
    return moves


def check_arrival_lag(left_over: LeftOver) -> list[Notice]:
    """Return a notice if the joints were not at rest."""
    found = arrival_lag(left_over)
    if found is None or not found.fires:
        return []
    units = ["deg" if kind == "revolute" else "mm" for kind in left_over.problem.data.joint_kinds]
    shown = ", ".join(f"{from_si(lag, unit):+.3f} {unit}" for lag, unit in zip(found.lags.tolist(), units, strict=True))
    return [
        Notice(
            "joints-not-settled",
            f"The direction from which each joint arrived explains {found.share:.0%} of the residuals. The true joint "
            f"positions differ from the recorded ones by {shown}, times the sign of the last move. Either the joints "
            "were read before the robot had settled: use the commanded joints, or read later. Or the joints have "
            "hysteresis: arrive from one side only.",
        )
    ]
