"""Readings of a campaign in which the instrument, or the robot's base, stood elsewhere from some configuration on.

Each part has a base of its own. The motion between the parts is found by least squares together with the model, from
the training configurations alone: Gauss-Newton on the six parameters of each later base, what the model's own
parameters could take projected out. Then it is taken out of the readings of the later parts, so that all stand in the
frame of the first, and everything else goes on as if nothing had moved. The motion counts as known from there on:
neither the deviations of the parameters nor the held-out error contain what is not known of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Notice, Rule, counted, did_you_mean
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.diagnose.unmodelled import LeftOver
from truearm.engine.fit.fit import identify
from truearm.engine.fit.fixed_places import NOTHING_FIXED, FixedPlaces
from truearm.engine.fit.frames import initial_frames
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import Model
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.start_values import start_from_readings
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import (
    Transform,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_vector,
)

#: Training configurations with a position that each part needs: three fix a frame, and the rest says how well.
_LEAST_CONFIGURATIONS: Final = 5
_ROUNDS: Final = 8
#: Motion of a base that is the last one [m or rad].
_LAST_STEP: Final = 1e-8

Motion = tuple[Array, Array]


def parts_of(data: Dataset, labels: Sequence[str]) -> NDArray[np.intp]:
    """Return the part that each configuration belongs to, ``(configurations,)``, 0 before the first change.

    Args:
        labels: The configuration from which on, in the order of measurement, each next base holds.

    Raises:
        InputError: For a configuration that the data do not have, the first one, or data whose order is not known.
    """
    if data.fixture is not None:
        raise InputError(
            "readings against fixtures do not see the instrument's base", parameter="base_changes", where=data.source
        )
    if data.number is None:
        raise InputError(
            "the order of measurement is not known, so nothing comes after a configuration",
            parameter="base_changes",
            where=data.source,
            cure="Number the configurations 1, 2, 3 .. in the order of measurement.",
        )
    known = {label: i for i, label in enumerate(data.labels)}
    starts = []
    for label in labels:
        if label not in known:
            raise InputError(
                "there is no configuration of this name",
                parameter="base_changes",
                where=data.source,
                came=label,
                cure=did_you_mean(label, data.labels) or "Name configurations of the data.",
            )
        starts.append(float(data.number[known[label]]))
    first = float(np.min(data.number))
    if first in starts:
        raise InputError(
            "nothing was measured before the first configuration",
            parameter="base_changes",
            where=data.source,
            came=labels[starts.index(first)],
            cure="Name the configuration from which on the base is another one.",
        )
    return np.asarray(np.searchsorted(np.sort(np.unique(starts)), data.number, side="right"), dtype=np.intp)


def checked_parts(data: Dataset, training: IntArray, labels: Sequence[str]) -> NDArray[np.intp]:
    """Return the parts as :func:`parts_of`, and refuse one with fewer than five training configurations."""
    part = parts_of(data, labels)
    seen = np.unique(data.configuration[data.has_position])
    for number in range(int(part.max()) + 1):
        configurations = np.intersect1d(training[part[training] == number], seen)
        if len(configurations) < _LEAST_CONFIGURATIONS:
            raise InputError(
                "a part between two changes of the base has too few training configurations",
                parameter="base_changes",
                where=data.source,
                came=f"{counted(len(configurations), 'configuration')} in part {number + 1}",
                allowed=f"{_LEAST_CONFIGURATIONS} or more",
                cure="Raise `train`, measure more, or leave the part out.",
            )
    return part


def with_one_base(
    robot: Robot,
    data: Dataset,
    training: IntArray,
    labels: Sequence[str],
    model: Model,
    loss: Loss = "linear",
    fixed: FixedPlaces = NOTHING_FIXED,
) -> tuple[Dataset, list[Notice]]:
    """Return the data with all readings in the frame of the first part, and how far each part was moved.

    Args:
        robot: The nominal robot.
        training: Configurations from which the motions are found.
        labels: See :func:`parts_of`.
        model: What is identified along with the motions.
        fixed: Places that are known; the base is that of the first part, and found here all the same.

    Raises:
        InputError: As :func:`parts_of`, and for a part with fewer than five training configurations.
    """
    part = checked_parts(data, training, labels)
    moved, tools = data, FixedPlaces(targets=fixed.targets)
    bases = [
        initial_frames(robot, data.of_configurations(training[part[training] == number]), tools).base
        for number in range(int(part.max()) + 1)
    ]
    moved = _moved(moved, part, [_motion(bases[0], base) for base in bases])
    for _ in range(_ROUNDS):
        motions = _steps(robot, moved.of_configurations(training), part[training], model, loss, tools)
        moved = _moved(moved, part, motions)
        if max(max(float(np.abs(p).max()), float(np.abs(rotation_vector(R)).max())) for R, p in motions) < _LAST_STEP:
            break
    return moved, [_notice(data, moved, part)]


def _steps(
    robot: Robot, data: Dataset, part: NDArray[np.intp], model: Model, loss: Loss, fixed: FixedPlaces
) -> list[Motion]:
    """Return the motion that takes each part's readings nearer to the frame of the first, one step of Gauss-Newton."""
    start = start_from_readings(model.prepared(robot), data, fixed)
    problem = Problem(start, data, model.free(start), {observation.name: 1.0 for observation in OBSERVATIONS})
    refuse_beyond("derivatives", problem.rows * len(problem.free.names), where=data.source)  # all are needed at once
    fit = identify(robot, data, model, loss=loss, fixed=fixed)
    left = LeftOver.of(fit, data)
    base = [i for i, p in enumerate(fit.free.parameters) if p.group == "base"]
    parts = int(part.max())
    of_row = part[left.configuration]
    H = np.concatenate([left.jacobian[:, base] * (of_row == number + 1)[:, None] for number in range(parts)], axis=1)
    solution = np.linalg.lstsq(left.without_parameters(H), -left.without_parameters(left.residual), rcond=1e-10)[0]
    names = [fit.free.names[i] for i in base]
    motions: list[Motion] = [(np.eye(3), np.zeros(3))]
    flange = _flange(fit.robot, data)
    for step in solution.reshape(parts, len(base)):
        values = {name: fit.robot.values[name] + float(d) for name, d in zip(names, step, strict=True)}
        motions.append(_motion(flange, _flange(fit.robot.with_values(values), data)))
    return motions


def _flange(robot: Robot, data: Dataset) -> Transform:
    """Return where the flange stands at the first configuration; only the base differs between robots asked."""
    p, R = robot.world_poses(data.postures)
    return Transform.from_matrix(R[0], p[0])


def _motion(to: Transform, of: Transform) -> Motion:
    """Return the rotation and the shift that take readings in one frame into another."""
    R = to.rotation @ of.rotation.T
    return R, np.array(to.translation) - R @ np.array(of.translation)


def _moved(data: Dataset, part: NDArray[np.intp], motions: Sequence[Motion]) -> Dataset:
    position = data.position.copy()
    quaternion = None if data.quaternion is None else data.quaternion.copy()
    of_reading = part[data.configuration]
    for number, (R, shift) in enumerate(motions):
        of_part = of_reading == number
        position[of_part] = position[of_part] @ R.T + shift
        if quaternion is not None:
            turned = of_part & data.has_orientation
            quaternion[turned] = quaternion_from_rotation(R @ rotation_from_quaternion(quaternion[turned]))
    return replace(data, position=position, quaternion=quaternion)


BASE_CHANGED: Final = Rule(
    "base-changed", "note", "readings were moved into the frame of the first base (`base_changes`)"
)


def _notice(before: Dataset, after: Dataset, part: NDArray[np.intp]) -> Notice:
    """Say how far the readings of each part were moved."""
    gaps = np.linalg.norm(after.position - before.position, axis=1)
    words = []
    for number in range(1, int(part.max()) + 1):
        of_part = (part[before.configuration] == number) & np.isfinite(gaps)
        number_of = np.where(part == number, np.asarray(before.number), np.inf)
        label = before.labels[int(np.argmin(number_of))]
        words.append(f"from {label} on by {float(np.sqrt(np.mean(gaps[of_part] ** 2))) * 1e3:.3g} mm")
    return BASE_CHANGED(
        f"Readings were moved into the frame of the first base: {', '.join(words)} (root mean square). The motion was "
        "found along with the model from the training configurations and counts as known: no deviation contains what "
        "is not known of it."
    )
