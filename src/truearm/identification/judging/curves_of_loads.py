"""Whether curves of joints stand in for joints that give way.

Gravity turns joint 2 by something that depends on its angle, nearly, so that a model without compliance finds a curve
instead. That curve predicts readings under the same load, and no others.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from truearm.identification.judging.left_over import LeftOver
from truearm.modeling.effects.compliance import Compliance
from truearm.modeling.effects.joint_curve import JointCurve
from truearm.modeling.loads import has_weight
from truearm.modeling.parameters import FreeParameters
from truearm.notices import Notice

#: Share of the squares of what the curves do to the readings, from which on compliance is the simpler cause.
_MOST: Final = 0.6


def check_curves_of_loads(left: LeftOver) -> list[Notice]:
    """Say if joints that give way would do most of what the curves of a fit do.

    What geometry can take is taken out of both first (Frisch and Waugh 1933).
    """
    share = share_of_loads(left)
    if share < _MOST:
        return []
    return [
        Notice(
            "curves-of-loads",
            f"Joints that give way under their loads would do {share:.0%} of what the curves of the joints do, with "
            "one number a joint. The curves are then right for this payload and mounting only. Compare with "
            "`effects=compliance` beside them, or with `model=auto`.",
            "warning",
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
    done = left.jacobian[:, curved] @ values[curved]
    columns, done = columns - Q @ (Q.T @ columns), done - Q @ (Q.T @ done)
    total = float(done @ done)
    if total <= float(len(done)) * 1e-6:
        return 0.0
    amounts = np.linalg.solve(columns.T @ columns + np.eye(columns.shape[1]), columns.T @ done)
    rest = done - columns @ amounts
    return max(1.0 - float(rest @ rest) / total, 0.0)
