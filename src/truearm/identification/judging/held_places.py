"""Whether places that were held agree with the readings: beside the same fit with all of them found.

Two things speak against them. The readings may not fit: with the places held much more is left than without, as the
comparison of two nested fits says (F test). Or they fit, but only by a robot that is none: with the height of the base
held, a wrong number goes whole into ``d_1``, and only the prior of ``d_1`` says that no robot is like that. The places
that are found have deviations that contain the priors, so their distance from the places held tells (Wald test).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.identification.judging.left_over import chi_squared_tail
from truearm.identification.solving.bounds import Bounds
from truearm.identification.solving.fit import Fit, identify
from truearm.identification.solving.losses import Loss
from truearm.identification.solving.rounds import Redundant
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Errors, errors_of
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform, rotation_from_quaternion, rotation_from_vector, rotation_vector
from truearm.notices import Notice
from truearm.shown import listed

#: How many times more is left with the places held, from which they do not fit the readings, and the least F.
_MORE: Final = 1.5
_LEAST_F: Final = 10.0
_LEAST_FREEDOM: Final = 10
#: Below this no instrument sees the difference [m].
_NEGLIGIBLE: Final = 2e-6
#: Chance below which a place found is not the one held, and how far apart they are then at least [m, rad].
_CHANCE: Final = 1e-6
_APART: Final = (1e-3, math.radians(0.1))


def check_held(
    robot: Robot,
    fit: Fit,
    data: Dataset,
    *,
    loss: Loss,
    redundancy: Redundant,
    bounds: Bounds | None = None,
    bounds_file: str = "bounds",
) -> list[Notice]:
    """Return a notice if the places that a fit holds contradict its readings.

    Parameters
    ----------
    robot
        The nominal robot.
    data
        The training readings.
    loss, redundancy, bounds, bounds_file
        Of the fit.
    """
    if not fit.held:
        return []
    priors = redundancy == "prior"
    try:
        found = identify(
            robot,
            data,
            fit.model,
            loss=loss,
            redundancy="prior" if priors else "none",
            bounds=bounds,
            bounds_file=bounds_file,
        )
    except InputError:  # nothing but the places held makes a fit possible
        return []
    with_held, without = _left(errors_of(fit.robot, data)), _left(errors_of(found.robot, data))
    apart = list(_apart(fit, found)) if data.anchored else []
    far = [words for words, size, chance in apart if size >= 1.0 and chance < _CHANCE] if priors else []
    added = len(found.free.names) - len(fit.free.names)
    rows = 3 * with_held[1]
    freedom = rows - len(found.free.names)
    misfit = (
        freedom >= _LEAST_FREEDOM
        and with_held[0] > max(_MORE * without[0], _NEGLIGIBLE)
        and (with_held[0] ** 2 - without[0] ** 2) * rows / added > _LEAST_F * without[0] ** 2 * rows / freedom
    )
    if not misfit and not far:
        return []
    message = "The places that are held contradict the readings"
    if misfit:
        message += (
            f": with them the fit leaves {with_held[0] * 1e3:.3g} mm of the training readings, with all of them found "
            f"{without[0] * 1e3:.3g} mm (root mean square)"
        )
    told = far or ([words for words, size, _ in apart if size >= 1.0] if priors else [])
    if told:
        message += f"{'. Found' if misfit else ': found'} from the readings, {listed(told)} from where it is held"
    message += (
        ". Check the numbers, their units and what they refer to: the base is the frame of the robot's table, whose z "
        "axis is axis 1 in most conventions, and a tool is given in the flange's frame. Or do not hold them."
    )
    return [Notice("hold-contradicts", message, "error")]


def _left(errors: Errors) -> tuple[float, int]:
    """Return the root mean square of what is left [m], and of how many readings."""
    parts = [e.ravel() for e in (errors.position_norms, errors.length_errors) if e is not None]
    every = np.concatenate(parts) if parts else np.zeros(0)
    every = every[np.isfinite(every)]
    return (float(np.sqrt(np.mean(every**2))) if len(every) else 0.0), len(every)


def _apart(fit: Fit, found: Fit) -> Iterator[tuple[str, float, float]]:
    """Yield what is held: how far it is found from there, in words and by what is far, and how likely that is."""
    index = {name: i for i, name in enumerate(found.free.names)}
    if fit.held.base is not None:
        yield _difference("the base", _base(found.robot), fit.held.base, found, index, "base", turned=True)
    for target in found.robot.targets:
        if target.name in fit.held.targets:
            quaternion = target.quaternion
            place = _place(found.robot, target.parameter("x")[:-2], quaternion)
            yield _difference(
                f"target {target.name}",
                place,
                fit.held.targets[target.name],
                found,
                index,
                target.parameter("x")[:-2],
                turned=quaternion is not None,
            )


def _base(robot: Robot) -> Transform:
    return _place(robot, "base", robot.base_quaternion)


def _place(robot: Robot, prefix: str, quaternion: tuple[float, float, float, float] | None) -> Transform:
    """Return a place by its parameters; small turns come behind the reference orientation."""
    position = np.array([robot.values[f"{prefix}_{axis}"] for axis in "xyz"])
    if quaternion is None:
        return Transform.from_matrix(np.eye(3), position)
    small = np.array([robot.values[f"{prefix}_{axis}"] for axis in ("rx", "ry", "rz")])
    return Transform.from_matrix(rotation_from_quaternion(np.array(quaternion)) @ rotation_from_vector(small), position)


def _difference(
    what: str, place: Transform, held: Transform, found: Fit, index: dict[str, int], prefix: str, *, turned: bool
) -> tuple[str, float, float]:
    """Return how far a place is found from where it is held: in words, in what counts as far, and its chance."""
    shift = np.array(place.translation) - np.array(held.translation)
    names = [f"{prefix}_{axis}" for axis in "xyz"]
    off: Array = shift
    words, size = f"{what} is {np.linalg.norm(shift) * 1e3:.3g} mm", float(np.linalg.norm(shift)) / _APART[0]
    if turned:
        turn = rotation_vector((held.rotation.T @ place.rotation)[None])[0]
        names += [f"{prefix}_{axis}" for axis in ("rx", "ry", "rz")]
        off = np.concatenate([shift, turn])
        words += f" and {math.degrees(float(np.linalg.norm(turn))):.2g} deg"
        size = max(size, float(np.linalg.norm(turn)) / _APART[1])
    own = [index[name] for name in names if name in index]
    if len(own) < len(names):
        return words, size, 1.0
    scale = found.free.prior[own]
    covariance = found.covariance[np.ix_(own, own)] / np.outer(scale, scale)
    known = (off / scale) @ np.linalg.pinv(covariance, rcond=1e-12, hermitian=True) @ (off / scale)
    return words, size, chi_squared_tail(float(known), len(names))
