"""Does a robot miss new readings by far more than its calibration said that it may.

The calibration's proof holds the covariance of the parameters and the errors of the joints at an arrival. Both moved to
the new configurations, with the noise of the new readings, say how far these may be off.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.identification.solving.problem import Problem
from truearm.measurement.dataset import Dataset
from truearm.measurement.observations import OBSERVATIONS
from truearm.measurement.statistics import Errors
from truearm.modeling.formats.robot_file import is_intact
from truearm.modeling.parameters import FreeParameters
from truearm.modeling.robot import Robot
from truearm.notices import Notice

#: Errors over what the proof lets expect, as root mean squares, from which the proof does not hold here: of one draw
#: that moves all readings alike it is exceeded with a probability of 6e-5. And from which the robot is another one.
_WARNING: Final = 4.0
_ERROR: Final = 10.0
#: Noise of readings that declare none [m]: of a camera. Trackers are better.
_NOISE: Final = 1e-4


def check_proof(robot: Robot, data: Dataset, errors: Errors) -> list[Notice]:
    """Return a notice if positions are off by many times what the proof of the robot lets expect.

    Nothing is said of robots without a proof, or whose values were changed since, nor of readings against fixtures. A
    proof that is a lower bound is doubted later.

    Args:
        robot: With base and targets.
        data: Readings of those.
        errors: Of the robot on them.
    """
    proof = robot.proof
    if proof is None or not is_intact(robot) or not proof.names or not len(errors.position_norms):
        return []
    if data.fixture is not None:
        return []
    free = FreeParameters(tuple(robot.parameters[name] for name in proof.names if name in robot.parameters))
    if len(free.names) < len(proof.names):
        return []
    plain = replace(data, sigma=None, sigma_rot=None, quaternion=None, setup=None)
    problem = Problem(robot, plain, free, {observation.name: 1.0 for observation in OBSERVATIONS})
    here = problem.at(np.array([robot.values[name] for name in free.names]))
    by_model = here.jacobian @ proof.root
    by_joints = here.by_joints * np.array(proof.joint_error)
    count = max(int(data.has_position.sum()), 1)
    model = float(np.sum(by_model**2) + np.sum(by_joints**2)) / count
    sigma = np.full(len(data.target), _NOISE) if data.sigma is None else data.sigma
    noise = 3.0 * float(np.nanmean(sigma[data.has_position] ** 2))
    off, expected = math.sqrt(float(np.mean(errors.position_norms**2))), math.sqrt(model + noise)
    if off <= (_ERROR if proof.lower_bound else _WARNING) * expected:
        return []
    assumed = f", with {_NOISE * 1e3:g} mm of noise, since no sigma is declared" if data.sigma is None else ""
    return [
        Notice(
            "beyond-proof",
            f"The positions are off by {off * 1e3:.2g} mm (root mean square), {off / expected:.2g} times the "
            f"{expected * 1e3:.2g} mm that the robot's own calibration lets expect here{assumed}. The robot changed "
            "since, carries another payload, or does what its model lacks: calibrate it again, and do not rely on its "
            "expected errors.",
            "error" if off > _ERROR * expected and not proof.lower_bound else "warning",
        )
    ]
