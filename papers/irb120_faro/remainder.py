"""What a model leaves over on the measured IRB 120, divided into what may have caused it."""

from __future__ import annotations

from typing import Final

import numpy as np

from papers.seeds import Figures
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import Model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot

FOLDS: Final = 5


def left_over(robot: Robot, data: Dataset, model: Model, seed: int) -> Figures:
    """Return what a model leaves over [mm], each of five parts predicted by a fit to the others.

    Of the table ``remainder`` all but the mean are root mean squares of the length. Those of ``cause`` are mean lengths
    if one more cause, fitted to what the training part leaves over, is taken out too.

    Args:
        data: With every target read at every configuration, in the order of measurement.
        seed: Of the parts.
    """
    n, count = data.configurations, len(data.targets)
    residual = np.zeros((n, count, 3))
    points = np.zeros((n, count, 3))
    explained: dict[str, Array] = {}
    for part in np.array_split(np.random.default_rng(seed).permutation(n), FOLDS):
        fitted = np.setdiff1d(np.arange(n), part)
        found = identify(robot, data.of_configurations(fitted), model).robot
        every = errors_of(found, data).position_errors.reshape(n, count, 3) * 1e3
        there = np.stack([found.world_poses(data.postures, name)[0] for name in data.targets], axis=1)
        jacobian = np.stack([found.joint_jacobian(data.postures, name)[:, :3] for name in data.targets], axis=1)
        residual[part], points[part] = every[part], there[part]
        for cause, columns in _columns(jacobian, there, data.joints).items():
            amounts = np.linalg.lstsq(columns[fitted].reshape(-1, columns.shape[-1]), every[fitted].reshape(-1))[0]
            explained.setdefault(cause, np.zeros_like(residual))[part] = (columns @ amounts)[part]
    common = residual.mean(axis=1, keepdims=True)
    turned = _turned(residual - common, points - points.mean(axis=1, keepdims=True))
    before, after = common[:-1, 0].reshape(-1), common[1:, 0].reshape(-1)
    follows = float(before @ after / np.sqrt((before @ before) * (after @ after)))
    return {
        "remainder": {
            "mean length": _mean(residual),
            "root mean square": _rms(residual),
            "shared by all three reflectors": _rms(np.broadcast_to(common, residual.shape)),
            "turn of the tool about their middle": _rms(turned),
            "what no motion of the tool explains": _rms(residual - common - turned),
        },
        "cause": {
            "nothing more": _mean(residual),
            **{cause: _mean(residual - part) for cause, part in explained.items()},
            "correlation with the configuration before [1]": follows,
        },
    }


def _mean(errors: Array) -> float:
    return float(np.linalg.norm(errors, axis=2).mean())


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=2))))


def _turned(errors: Array, arms: Array) -> Array:
    """Return the part of errors ``(n, targets, 3)`` that a turn of the tool explains: w x arm, that is -[arm] w."""
    turns = -_crossing(arms).reshape(len(arms), -1, 3)
    amounts = np.linalg.pinv(turns) @ errors.reshape(len(arms), -1, 1)
    return np.asarray((turns @ amounts).reshape(errors.shape))


def _columns(jacobian: Array, points: Array, joints: Array) -> dict[str, Array]:
    """Return for each possible cause the columns ``(n, targets, 3, parameters)`` that it would be a sum of."""
    n = len(points)
    time = np.linspace(-1.0, 1.0, n)
    moves = np.sign(np.diff(joints, axis=0, prepend=joints[:1]))
    shifts = np.broadcast_to(np.eye(3), (*points.shape[:2], 3, 3))
    rigid = np.concatenate([shifts, -_crossing(points)], axis=3)
    harmonics = [wave(k * joints) for k in (1, 2, 3) for wave in (np.sin, np.cos)]

    def turning(*signals: Array) -> Array:
        """Let every joint turn by its own signals ``(n, joints)``."""
        return np.concatenate([jacobian * signal[:, None, None, :] for signal in signals], axis=3)

    steady = np.repeat(time[:, None], joints.shape[1], axis=1)
    return {
        "direction of approach of each joint": turning(moves),
        "angle of each joint, three harmonics": turning(*harmonics),
        "steady drift of the whole robot": rigid * time[:, None, None, None],
        "steady drift of each joint": turning(steady),
    }


def _crossing(vectors: Array) -> Array:
    """Return the matrices of ``vector x``, ``(..., 3, 3)``."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    return np.stack(
        [np.stack([zero, -z, y], axis=-1), np.stack([z, zero, -x], axis=-1), np.stack([-y, x, zero], axis=-1)], axis=-2
    )
