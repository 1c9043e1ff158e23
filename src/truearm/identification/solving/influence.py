"""How far each parameter moves the tip, configuration by configuration (Patel, section 3.5).

Every parameter is really moved, one at a time, and the tip is where the chain then puts it: no derivative, so what
bends is in it. The perturbations are the trials of one computation over all configurations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np

from truearm.errors import InputError, did_you_mean
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot

#: How parameters are identified from the same readings.
Way = Literal["nominal", "minimum norm", "influence", "least squares", "calibrate"]
#: What each way is called.
WAYS: Final[Mapping[Way, str]] = {
    "nominal": "nominal",
    "minimum norm": "minimum norm, pose by pose",
    "influence": "influence-based, pose by pose",
    "least squares": "least squares, all poses at once",
    "calibrate": "the same with base and targets free",
}

#: +0.05 deg and +0.1 mm, by SI unit (Patel, section 3.5).
PERTURBATION: Final[Mapping[str, float]] = {"rad": math.radians(0.05), "m": 1e-4}
_ROUNDING: Final = 1e-13  # m: what rounding moves


@dataclass(frozen=True, eq=False)
class Influence:
    """What parameters do to the pose of the tip."""

    names: tuple[str, ...]  #: The parameters.
    perturbation: Array  #: How far each of them was moved [m, rad or its own unit], ``(parameters,)``.
    size: Array  #: How far the tip then moved [m], ``(parameters, n)``.
    turn: Array | None = None  #: By how much it turned [rad], ``(parameters, n)``; None if that was not computed.

    @property
    def mean(self) -> Array:
        """Average influence of each parameter [m], ``(parameters,)``."""
        return np.asarray(self.size.mean(axis=1))

    @property
    def least(self) -> Array:
        """Smallest influence of each parameter [m], ``(parameters,)``."""
        return np.asarray(self.size.min(axis=1))

    @property
    def greatest(self) -> Array:
        """Largest influence of each parameter [m], ``(parameters,)``."""
        return np.asarray(self.size.max(axis=1))

    @cached_property
    def vector(self) -> Array:
        """The influence vector k of each configuration, ``(parameters, n)``: 1 for the most influential parameter.

        Raises:
            InputError: If no parameter moves the tip at some configuration.
        """
        most = self.size.max(axis=0)
        if (most < _ROUNDING).any():
            raise InputError(
                "none of the parameters moves the tip, so none is the most influential",
                where=f"configuration {int(np.argmin(most)) + 1}",
                came=", ".join(self.names),
                cure="Name more parameters, or leave the configuration out.",
            )
        return np.asarray(self.size / most)


def influence(
    robot: Robot,
    q: Array | Postures,
    names: Sequence[str],
    target: str | None,
    perturbations: Mapping[str, float] | None = None,
) -> Influence:
    """Perturb parameters one at a time and see how far the tip moves.

    Parameters
    ----------
    robot
        Perturbed about its current parameter values, with its joint effects; the loads are held.
    q
        Joint positions ``(n, joints)``, or postures, n at least 1.
    names
        Parameters of the robot.
    target
        The tip; the flange if None.
    perturbations
        By parameter name [m, rad or its own unit], instead of :data:`PERTURBATION`.

    Raises
    ------
    InputError
        For parameters that the robot does not have, no configuration, or a perturbation that is no size.
    """
    perturbation = sizes_of(robot, names, PERTURBATION, perturbations or {}, "perturbation")
    at = robot.loaded(q)
    if len(at) == 0:
        raise InputError("there is no configuration", where=robot.name, cure="Give at least one.")
    moved = np.diag(perturbation)[:, :, None]
    values = {**robot.values, **{n: robot.values[n] + steps for n, steps in zip(names, moved, strict=True)}}
    after, before = robot.forward_kinematics(at, target, values), robot.forward_kinematics(at, target)
    apart = np.linalg.norm(after.position - before.position[:, None, :], axis=0)
    turned = np.swapaxes(before.matrix(), -1, -2) @ after.matrix()  # (parameters, n, 3, 3)
    sine = 0.5 * np.linalg.norm(
        [turned[..., (i + 2) % 3, (i + 1) % 3] - turned[..., (i + 1) % 3, (i + 2) % 3] for i in range(3)], axis=0
    )
    cosine = 0.5 * (np.trace(turned, axis1=-2, axis2=-1) - 1.0)
    return Influence(tuple(names), perturbation, np.asarray(apart), np.arctan2(sine, cosine))


def sizes_of(
    robot: Robot, names: Sequence[str], by_unit: Mapping[str, float], given: Mapping[str, float], what: str
) -> Array:
    """Return a size for each of the named parameters [m, rad or its own unit], ``(parameters,)``.

    Args:
        by_unit: Sizes by SI unit.
        given: Sizes by parameter name, which come first.
        what: What the size is, for messages.

    Raises:
        InputError: For a name that is no parameter, occurs twice or has no size, and for a size that is not above zero.
    """
    if not names:
        raise InputError("no parameter is named", where=robot.name, cure="Name at least one.")
    for name in names:
        if name not in robot.parameters:
            cure = did_you_mean(name, robot.parameters)
            raise InputError("the robot has no such parameter", where=robot.name, came=name, cure=cure)
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        raise InputError("a parameter is named twice", where=robot.name, came=twice[0])
    for name, size in given.items():
        if name not in names:
            raise InputError(f"the {what} is of a parameter that is not named", where=robot.name, came=name)
        if not (math.isfinite(size) and size > 0):
            raise InputError(f"the {what} is no size", where=name, came=size, allowed="above 0")
    sizes = []
    for name in names:
        unit = robot.parameters[name].unit
        if name not in given and unit not in by_unit:
            raise InputError(
                f"the document has no {what} for a parameter of this unit",
                where=name,
                came=unit,
                allowed=", ".join(by_unit),
                cure=f"Give its {what}.",
            )
        sizes.append(given[name] if name in given else by_unit[unit])
    return np.array(sizes)
