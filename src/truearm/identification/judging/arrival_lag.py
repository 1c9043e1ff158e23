"""Were the joints at rest when they were read: residuals explained by the direction each joint arrived from.

If joints were read before the robot settled, or if a joint stops short by friction, the true joint position differs
from the recorded one by a small lag with the sign of the last move. These lags, one a joint, are fitted to the
residuals of the identified model, after removing what its own parameters could still take.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.identification.solving.fit import Fit
from truearm.identification.solving.problem import Problem
from truearm.measurement.dataset import Dataset
from truearm.measurement.observations import OBSERVATIONS
from truearm.modeling.chain import Array
from truearm.notices import Notice
from truearm.units import from_si

#: Part of the residuals that the direction of arrival must explain, and of the joints that must lag with one sign.
_LEAST_EXPLAINED: Final = 0.05
_LEAST_OF_ONE_SIGN: Final = 2 / 3


@dataclass(frozen=True, eq=False)
class ArrivalLag:
    """What the arrival direction explains.

    Attributes
    ----------
    share
        Part of the residual's root mean square that it explains, corrected for the number of joints.
    lags
        True minus recorded position of each joint, times the sign of the last move [rad; m for sliding joints].
    """

    share: float
    lags: Array

    @property
    def fires(self) -> bool:
        """Whether it explains at least 5 % with one sign on most joints."""
        positive = int((self.lags > 0).sum())
        same = max(positive, len(self.lags) - positive)
        return self.share >= _LEAST_EXPLAINED and same > _LEAST_OF_ONE_SIGN * len(self.lags)


def arrival_lag(fit: Fit, data: Dataset) -> ArrivalLag | None:
    """Return what arrival directions explain of the residuals of a fit; None where too few readings are left.

    Parameters
    ----------
    data
        All readings. Without the number of each configuration in the campaign, they are taken to be in measuring order.
    """
    noise = {observation.name: fit.sigma.get(observation.name, 1.0) for observation in OBSERVATIONS}
    problem = Problem(fit.robot, replace(data, setup=None), fit.free, noise)
    here = problem.at(np.array([fit.robot.values[name] for name in fit.free.names]))
    r, J = here.residual, here.jacobian
    of_row = [np.repeat(data.configuration[b.readings], b.observation.components) for b in problem.blocks]
    H = here.by_joints * _last_moves(data)[np.concatenate(of_row)]
    U, s, _ = np.linalg.svd(J * fit.free.prior, full_matrices=False)
    basis = U[:, s > 1e-8 * s[0]]
    free = len(r) - basis.shape[1]
    if free < 4 * H.shape[1]:
        return None
    left, moved = r - basis @ (basis.T @ r), H - basis @ (basis.T @ H)
    lags = np.asarray(np.linalg.lstsq(moved, left, rcond=1e-10)[0], dtype=np.float64)
    before = float(left @ left) / free
    after = float(np.sum((left - moved @ lags) ** 2)) / (free - H.shape[1])
    return ArrivalLag(1.0 - float(np.sqrt(after / before)) if before > 0 else 0.0, -lags)


def _last_moves(data: Dataset) -> Array:
    """Return the sign of each joint's move from the configuration measured before, ``(configurations, joints)``."""
    order = np.arange(data.configurations) if data.number is None else np.argsort(data.number, kind="stable")
    moves = np.zeros_like(data.joints)
    moves[order[1:]] = np.sign(np.diff(data.joints[order], axis=0))
    return moves


def check_arrival_lag(fit: Fit, data: Dataset) -> list[Notice]:
    """Return a notice if the joints were not at rest."""
    found = arrival_lag(fit, data)
    if found is None or not found.fires:
        return []
    units = ["deg" if kind == "revolute" else "mm" for kind in data.joint_kinds]
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
