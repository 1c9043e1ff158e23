"""What a model leaves over on the measured IRB 120, divided into what may have caused it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from truearm.identification.solving.fit import identify
from truearm.identification.solving.models import Model
from truearm.measurement.checks import clean_references, constellation
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import errors_of
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.studies.study import Row, Table

FOLDS: Final = 5
_ARRIVAL: Final = "direction of arrival of each joint"
_ANGLE: Final = "angle of each joint, three harmonics"
_WHOLE: Final = "steady drift of the whole robot"
_EACH: Final = "steady drift of each joint"
_CAUSES: Final = {
    _ARRIVAL: "What differs between a joint that comes from below and one that comes from above.",
    _ANGLE: "Gears and encoders that run out of true.",
    _WHOLE: "The robot creeps against the reflectors on its table, from the first configuration to the last.",
    _EACH: "Joint zeros that creep.",
}


@dataclass(frozen=True, eq=False)
class Remainder:
    """What is left over at every configuration by a robot that has not seen it [mm].

    Attributes
    ----------
    mean
        Mean length.
    whole
        Root mean square of the length, as are the next three.
    common
        Of the part that all reflectors share.
    turning
        Of the part by which the reflectors turn together as a rigid tool.
    rest
        Of what no motion of the tool explains.
    follows
        Correlation of the common part with that of the configuration measured before.
    without
        Mean length if one more cause, fitted to what the training part leaves over, is taken out too.
    """

    mean: float
    whole: float
    common: float
    turning: float
    rest: float
    follows: float
    without: Mapping[str, float]


def left_over(robot: Robot, data: Dataset, model: Model, seed: int) -> Remainder:
    """Return what a model leaves over, each of five parts predicted by a fit to the others.

    Parameters
    ----------
    data
        With every target read at every configuration, in the order of measurement.
    seed
        Of the parts.
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
        for name, columns in _causes(jacobian, there, data.joints).items():
            amounts = np.linalg.lstsq(columns[fitted].reshape(-1, columns.shape[-1]), every[fitted].reshape(-1))[0]
            explained.setdefault(name, np.zeros_like(residual))[part] = (columns @ amounts)[part]
    common = residual.mean(axis=1, keepdims=True)
    turned = _turned(residual - common, points - points.mean(axis=1, keepdims=True))
    before, after = common[:-1, 0].reshape(-1), common[1:, 0].reshape(-1)
    return Remainder(
        mean=_mean(residual),
        whole=_rms(residual),
        common=_rms(np.broadcast_to(common, residual.shape)),
        turning=_rms(turned),
        rest=_rms(residual - common - turned),
        follows=float(before @ after / np.sqrt((before @ before) * (after @ after))),
        without={name: _mean(residual - part) for name, part in explained.items()},
    )


def _mean(errors: Array) -> float:
    return float(np.linalg.norm(errors, axis=2).mean())


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=2))))


def _turned(errors: Array, arms: Array) -> Array:
    """Return the part of errors ``(n, targets, 3)`` that a turn of the tool explains: w x arm, that is -[arm] w."""
    turns = -_crossing(arms).reshape(len(arms), -1, 3)
    amounts = np.linalg.pinv(turns) @ errors.reshape(len(arms), -1, 1)
    return np.asarray((turns @ amounts).reshape(errors.shape))


def _causes(jacobian: Array, points: Array, joints: Array) -> dict[str, Array]:
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
        _ARRIVAL: turning(moves),
        _ANGLE: turning(*harmonics),
        _WHOLE: rigid * time[:, None, None, None],
        _EACH: turning(steady),
    }


def _crossing(vectors: Array) -> Array:
    """Return the matrices of ``vector x``, ``(..., 3, 3)``."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    return np.stack(
        [np.stack([zero, -z, y], axis=-1), np.stack([z, zero, -x], axis=-1), np.stack([-y, x, zero], axis=-1)], axis=-2
    )


# -- tables ------------------------------------------------------------------------------------------------


def instrument_table(raw: Dataset, table_motion: Sequence[Sequence[float]]) -> Table:
    """Return what tracker and table contribute.

    Parameters
    ----------
    raw
        The data with the table's motion.
    table_motion
        Mean held-out errors of every seed [mm], with the table's motion left in, and without it.
    """
    points = constellation(raw) * 1e3
    spreads = [
        float(np.nanstd(np.linalg.norm(points[:, i] - points[:, j], axis=1), ddof=1))
        for i, j in combinations(range(points.shape[1]), 2)
    ]
    noise = float(np.sqrt(np.mean(np.square(spreads)) / 2))
    rows = [
        Row("distance between two reflectors of the tool, deviation", "mm", spreads, explanation="One value a pair."),
        Row(
            "tracker noise: deviation of a coordinate",
            "mm",
            [noise],
            explanation="From those distances, equal in all directions. The mean length of such an error is 1.6 times"
            " as much. A slow error of the tracker that moves all reflectors alike does not show here.",
        ),
    ]
    references = clean_references(raw)
    if references is not None:
        away = np.linalg.norm(references - np.nanmedian(references, axis=0), axis=2) * 1e3
        rows += [
            Row("table: mean distance of its reflectors from their usual place", "mm", [float(np.nanmean(away))]),
            Row("table: largest", "mm", [float(np.nanmax(away))]),
        ]
    left_in, out = np.array(table_motion[0]), np.array(table_motion[1])
    rows.append(
        Row(
            "held-out mean that taking the table's motion out gains, elastic",
            "mm",
            (left_in - out).tolist(),
            explanation=f"{np.median(left_in):.4f} mm with the motion left in, {np.median(out):.4f} mm without.",
        )
    )
    turned = np.degrees(raw.joints)
    nearest = np.abs(turned[:, None] - turned[None]).max(axis=2) + 1e9 * np.eye(len(turned))
    rows.append(
        Row(
            "two configurations nearest to each other: largest difference of a joint",
            "deg",
            [float(nearest.min())],
            explanation="No configuration was measured twice, or nearly so: these data cannot tell the robot's"
            " repeatability.",
        )
    )
    return Table(
        "Error budget: tracker, table, repeatability", "What the data say without a model of the robot.", tuple(rows)
    )


def remainder_table(remainders: Mapping[str, Sequence[Remainder]]) -> Table:
    """Return how the rest divides between motions of the tool and what no motion explains."""
    lines = (
        ("mean length", "mean", ""),
        ("root mean square", "whole", ""),
        ("shared by all three reflectors", "common", "The robot, or the tracker as a whole."),
        ("turn of the tool about their middle", "turning", "The robot's orientation."),
        ("what no motion of the tool explains", "rest", "Tracker noise, and the tool itself."),
    )
    return Table(
        "Error budget: what the model leaves over",
        f"Each of {FOLDS} parts of the configurations is predicted by a fit to the others. Root mean squares are of the"
        " length of a reading's error; the squares of the last three add up to that of all.",
        tuple(
            Row(f"{name}: {what}", "mm", [float(getattr(one, key)) for one in found], explanation=why)
            for name, found in remainders.items()
            for what, key, why in lines
        ),
    )


def cause_table(remainders: Mapping[str, Sequence[Remainder]]) -> Table:
    """Return what the rest goes along with."""
    rows = []
    for name, found in remainders.items():
        rows.append(Row(f"{name}: nothing more", "mm", [one.mean for one in found]))
        for cause in found[0].without:
            rows.append(
                Row(
                    f"{name}: {cause}",
                    "mm",
                    [one.without[cause] for one in found],
                    explanation=_CAUSES[cause] if len(rows) <= len(_CAUSES) else "",
                )
            )
        rows.append(
            Row(
                f"{name}: correlation with the configuration before",
                "1",
                [one.follows for one in found],
                explanation="Of the part that all reflectors share; chance alone makes about 0.03.",
            )
        )
    return Table(
        "Error budget: what the rest goes along with",
        "Mean error if one more cause is taken out, too. It is fitted to what the training parts leave over, as small"
        " turns of the joints or of the whole robot, and judged on the part that was left out. A cause that takes"
        " nothing more is not there, or in the model already.",
        tuple(rows),
    )
