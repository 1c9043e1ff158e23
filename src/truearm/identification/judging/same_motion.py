"""Which parameters of the arm move it alike everywhere, whatever was measured.

The lengths along two parallel axes, or a joint zero and the base before it, are correlated in every calibration: only
their sum, or difference, moves anything. That is a property of the convention and not of the data.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.identification.solving.fit import Fit
from truearm.modeling.effects.joint_curve import JointCurve
from truearm.modeling.parameters import PLACES

#: Random configurations at which motions are compared.
_CONFIGURATIONS: Final = 60
#: Cosine of the angle between motions that are the same one.
_ALIKE: Final = 0.9999


def own_parameters(fit: Fit) -> list[int]:
    """Return the indices of the free parameters of the arm itself; of all where the arm was not free.

    The hundreds of numbers of joint curves are left out: each is a part of a curve, and none means anything alone.
    """
    own = [i for i, p in enumerate(fit.free.parameters) if p.group not in (*PLACES, JointCurve.name)]
    return own or list(range(len(fit.free.parameters)))


def same_motion(fit: Fit) -> set[tuple[int, int]]:
    """Return pairs of free parameters that move the targets alike at all configurations, up to base and targets.

    Returns:
        pairs: Indices of the free parameters, the lower one first.
    """
    robot, names = fit.robot, fit.free.names
    own = own_parameters(fit)
    places = [i for i in range(len(names)) if i not in set(own)]
    q = robot.loaded(robot.random_configurations(_CONFIGURATIONS, np.random.default_rng(0)))
    J = np.concatenate(
        [
            np.moveaxis(robot.position_jacobian(robot.forward_kinematics(q, target.name), q, names), 0, -1).reshape(
                -1, len(names)
            )
            for target in robot.targets
        ]
    )
    moved = J[:, own]
    if places:
        frames = J[:, places]
        U, s, _ = np.linalg.svd(frames, full_matrices=False)
        basis = U[:, s > 1e-9 * s[0]]
        moved = moved - basis @ (basis.T @ moved)
    size = np.linalg.norm(moved, axis=0)
    # What base and targets take whole is theirs: such a parameter goes with every other one.
    whole = size <= 1e-6 * np.maximum(np.linalg.norm(J[:, own], axis=0), 1e-12)
    cosine = moved.T @ moved / np.outer(np.where(whole, 1.0, size), np.where(whole, 1.0, size))
    alike = (np.abs(cosine) > _ALIKE) | whole[:, None] | whole
    rows, columns = np.nonzero(np.triu(alike, 1))
    return {(own[i], own[j]) for i, j in zip(rows.tolist(), columns.tolist(), strict=True)}
