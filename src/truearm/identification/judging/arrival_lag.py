"""Were the joints at rest when they were read: residuals explained by the direction each joint arrived from.

If readings were taken before the robot settled, or if a joint stops short by friction, the true joint differs from
the reading by a small angle with the sign of the last move. These angles, one a joint, are fitted to what the
identified model leaves over, after removing what its own parameters could still take.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.identification.solving.fit import Fit
from truearm.identification.solving.problem import Block, Problem
from truearm.measurement.dataset import Dataset
from truearm.measurement.observations import OBSERVATIONS
from truearm.measurement.sighting import Sighting
from truearm.modeling.chain import Array
from truearm.notices import Notice

_SHARE: Final = 0.05
_MOST: Final = 2 / 3


@dataclass(frozen=True, eq=False)
class ArrivalLag:
    """What the arrival direction explains.

    Attributes
    ----------
    share
        Part of the residual's root mean square that it explains, corrected for the number of joints.
    angles
        Angle by which each joint lags behind its reading, with the sign of the last move [rad; m].
    """

    share: float
    angles: Array

    @property
    def fires(self) -> bool:
        """Whether it explains at least 5 % with one sign on most joints."""
        positive = int((self.angles > 0).sum())
        same = max(positive, len(self.angles) - positive)
        return self.share >= _SHARE and same > _MOST * len(self.angles)


def arrival_lag(fit: Fit, data: Dataset) -> ArrivalLag | None:
    """Return what arrival directions explain of the residuals of a fit; None where too few readings are left.

    Parameters
    ----------
    data
        All readings, with the configurations in the order in which they were measured.
    """
    noise = {observation.name: fit.sigma.get(observation.name, 1.0) for observation in OBSERVATIONS}
    problem = Problem(fit.robot, replace(data, setup=None), fit.free, noise)
    r, J = problem.linearised(np.array([fit.robot.values[name] for name in fit.free.names]))
    arrived = np.sign(np.diff(data.joints, axis=0, prepend=data.joints[:1])).T[:, None, :]
    H = np.concatenate([_by_arrival(fit, block, arrived) for block in problem.blocks], axis=1).T
    U, s, _ = np.linalg.svd(J * fit.free.prior, full_matrices=False)
    basis = U[:, s > 1e-8 * s[0]]
    free = len(r) - basis.shape[1]
    if free < 4 * H.shape[1]:
        return None
    left, moved = r - basis @ (basis.T @ r), H - basis @ (basis.T @ H)
    angles = np.linalg.lstsq(moved, left, rcond=1e-10)[0]
    before = float(left @ left) / free
    after = float(np.sum((left - moved @ angles) ** 2)) / (free - H.shape[1])
    return ArrivalLag(1.0 - float(np.sqrt(after / before)) if before > 0 else 0.0, -angles)


def _by_arrival(fit: Fit, block: Block, arrived: Array) -> Array:
    """Return how the whitened readings of a block move with the lag of each joint, ``(joints, rows)``."""
    robot = fit.robot
    kinematics = robot.forward_kinematics(block.data.postures, block.target)
    seen = Sighting(
        kinematics, block.configurations, None if block.fixture is None else robot.fixture_kinematics(block.fixture)
    )
    by_joint, turned = (
        (kinematics.position_jacobian, seen.position_jacobian)
        if block.observation.velocity == "linear"
        else (kinematics.orientation_jacobian, seen.orientation_jacobian)
    )
    velocity = turned(by_joint(robot.moving[: len(robot.joints)]) * arrived, ())
    residual = block.observation.residual(seen, block.data, block.readings)
    moved = block.observation.jacobian(seen, residual, velocity) / block.sigma[:, None]
    return np.asarray(moved.reshape(len(moved), -1))


def check_arrival_lag(fit: Fit, data: Dataset) -> list[Notice]:
    """Return a notice if the joints were not at rest."""
    found = arrival_lag(fit, data)
    if found is None or not found.fires:
        return []
    shown = ", ".join(f"{np.rad2deg(a):+.3f}" for a in found.angles)
    return [
        Notice(
            "joints-not-settled",
            f"The direction from which each joint arrived explains {found.share:.0%} of the residuals (true joint "
            f"against reading, times the sign of the last move: {shown} deg). Either the joints were read before "
            "the robot had settled (use the commanded joints, or read later), or the joints have hysteresis "
            "(arrive from one side only).",
        )
    ]
