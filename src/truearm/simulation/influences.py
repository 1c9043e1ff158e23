"""How far each parameter moves the tip, and identification by that at one pose after the other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.solver import solve
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot

# How far each parameter moves the tip, configuration by configuration (Patel, section 3.5).
#
# Every parameter is really moved, one at a time, and the tip is where the chain then puts it: no derivative, so what
# bends is in it. The perturbations are the trials of one computation over all configurations.

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
    robot: Robot, names: Sequence[str], by_unit: Mapping[str, float], by_name: Mapping[str, float], quantity: str
) -> Array:
    """Return a size for each of the named parameters [m, rad or its own unit], ``(parameters,)``.

    Args:
        by_unit: Sizes by SI unit.
        by_name: Sizes by parameter name, which come first.
        quantity: What the size is, for messages.

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
    for name, size in by_name.items():
        if name not in names:
            raise InputError(f"the {quantity} is of a parameter that is not named", where=robot.name, came=name)
        if not (math.isfinite(size) and size > 0):
            raise InputError(f"the {quantity} is no size", where=name, came=size, allowed="above 0")
    sizes = []
    for name in names:
        unit = robot.parameters[name].unit
        if name not in by_name and unit not in by_unit:
            raise InputError(
                f"the document has no {quantity} for a parameter of this unit",
                where=name,
                came=unit,
                allowed=", ".join(by_unit),
                cure=f"Give its {quantity}.",
            )
        sizes.append(by_name[name] if name in by_name else by_unit[unit])
    return np.array(sizes)


#: ``mean`` of the sets; ``scaled-mean``: the mean step times the one number that fits all readings best, because
#: a mean of smallest steps is too short; ``best-pose``: the one set with the smallest mean error at all poses.
Combination = Literal["mean", "scaled-mean", "best-pose"]

#: What a parameter is counted in where steps are compared: rad and mm, by SI unit.
UNIT: Final[Mapping[str, float]] = {"rad": 1.0, "m": 1e-3}
#: What the document's instrument can see [m]: a pose is met when its error is below.
TOLERANCE: Final = 1e-5
#: The document prints no value for C.
DAMPING: Final = 0.5

_ITERATIONS: Final = 1000
_LOADINGS: Final = 3  # a problem holds the loads of the robot that it starts from
_RANK: Final = 1e-9  # of the largest singular value
_BLOCK: Final = 9_000  # positions swept together


# Identification at one pose after the other, as the Katana thesis does it (Patel, section 3.6), beside least squares.
#
# At a single pose the measured position gives three equations for all parameters, so infinitely many sets of them
# explain it. Both methods of the document start every pose from the robot as it is and step until the tip is where it
# was measured:
#
# - minimum norm (equation 3.6): the smallest step that does it, ``J^T (J J^T)^-1 dP``. "Smallest" depends on the units
#   in which parameters are counted; they are rad and mm, as in the document, so lengths hardly move.
# - influence-based (equations 3.7 and 3.8): that step times C < 1, each parameter then times its share in the influence
#   vector k, and again from where that leads. It converges, because ``J diag(k) J^T (J J^T)^-1`` has eigenvalues
#   between min(k) and 1. All steps lie in the span of ``diag(k) J^T``, so for small errors the set ends where ``dE^T
#   diag(k)^-1 dE`` is smallest, whatever C is.
#
# Each set explains its own pose only: of what is wrong with the robot it holds the three combinations that this pose
# sees. The document does not say how "a set of kinematics parameters is calculated that best fit the accuracy to all
# measured poses" from them; see :data:`Combination`. With more poses than parameters the linear combination of the sets
# that fits best is least squares over all poses itself, and going through the poses again from their mean, again and
# again, comes closer to it.
#
# Base and targets are held where the robot has them, unless their parameters are named: this is for readings taken in
# a known frame.
@dataclass(frozen=True, eq=False)
class PoseByPose:
    """What poses say one at a time, and the robot made of it."""

    robot: Robot  #: With the combined set.
    names: tuple[str, ...]  #: The parameters that were identified.
    sets: Array  #: Their values at each pose [SI], ``(n, parameters)``.
    iterations: NDArray[np.intp]  #: Steps taken at each pose, ``(n,)``.
    left: Array  #: Position error of each pose with its own set [m], ``(n,)``.
    #: Whether that came below the tolerance, ``(n,)``. A pose where it did not counts in the combination as it is.
    converged: NDArray[np.bool_]


def minimum_norm(
    robot: Robot,
    data: Dataset,
    names: Sequence[str],
    target: str,
    *,
    combination: Combination = "mean",
    tolerance: float = TOLERANCE,
    units: Mapping[str, float] | None = None,
) -> PoseByPose:
    """Identify parameters with the smallest step at each pose (Patel, equation 3.6).

    Args:
        robot: Its values are the start; what is not named, joint effects included, is held.
        data: Position readings in the frame that the robot stands in.
        names: Parameters of the robot.
        target: The one whose readings are used.
        combination: See :data:`Combination`.
        tolerance: Position error that counts as none [m].
        units: What a parameter is counted in, by its name [m, rad or its own unit], instead of :data:`UNIT`. A slide
            that stands for a turn with an arm of 0.2 m counts like it in units of 0.2 m.

    Raises:
        InputError: For parameters or a target that the robot does not have, no position reading of the target, or a
            tolerance or unit that is not above zero.
    """
    poses = _poses(robot, data, names, target, tolerance, units)
    return _result(robot, poses, np.ones((len(poses.postures), len(names))), tolerance, combination, "minimum norm")


def influence_based(
    robot: Robot,
    data: Dataset,
    names: Sequence[str],
    target: str,
    *,
    damping: float = DAMPING,
    combination: Combination = "mean",
    tolerance: float = TOLERANCE,
    units: Mapping[str, float] | None = None,
    perturbations: Mapping[str, float] | None = None,
) -> PoseByPose:
    """Identify parameters at each pose by their influence there (Patel, equations 3.7 and 3.8).

    Args:
        damping: C, above 0 and at most 1. It sets the number of iterations.
        perturbations: As for :func:`~truearm.simulation.influences.influence`, which gives k once, at the
            start.
        Other parameters and errors are those of :func:`minimum_norm`.:
    """
    if not 0.0 < damping <= 1.0:
        raise InputError("the damping coefficient C is out of range", came=damping, allowed="above 0, at most 1")
    poses = _poses(robot, data, names, target, tolerance, units)
    k = influence(robot, poses.postures, names, target, perturbations).vector
    return _result(robot, poses, damping * k.T, tolerance, combination, f"influence-based, C = {damping:g}")


def least_squares(robot: Robot, data: Dataset, names: Sequence[str], target: str) -> Robot:
    """Identify the same parameters from all poses at once, with their priors, for comparison.

    Readings that declare no standard deviation count with :data:`TOLERANCE`. Parameters and errors are those of
    :func:`minimum_norm`.
    """
    poses = _poses(robot, data, names, target, TOLERANCE, dict.fromkeys(names, 1.0))
    centres = [p.restarted(p.value) for p in (robot.parameters[name] for name in names)]
    fitted = robot
    for _ in range(_LOADINGS if robot.bends else 1):
        free = FreeParameters(tuple(replace(p, value=fitted.values[p.name]) for p in centres))
        vector = solve(Problem(fitted, poses.data, free, {"position": TOLERANCE})).vector
        fitted = robot.with_values(dict(zip(names, vector, strict=True)))
    return _with_set(robot, names, vector, "least squares over all poses")


@dataclass(frozen=True, eq=False)
class _Poses:
    """The readings of one target, as poses to be explained one at a time."""

    robot: Robot
    data: Dataset
    names: tuple[str, ...]
    target: str
    unit: Array

    @cached_property
    def postures(self) -> Postures:
        """How the arm stood at each reading, with the loads of `robot` at its own parameter values."""
        return self.robot.loaded(self.data.postures.at(self.data.configuration))

    def compared(self, sets: Array) -> tuple[Array, Array]:
        """Return measured minus predicted positions ``(n, 3)`` [m] and Jacobians, each pose with its own of `sets`."""
        # One trial that has other values at every configuration: the chain broadcasts (1, n) as it does (trials, 1).
        values = {**self.robot.values, **dict(zip(self.names, sets.T[:, None, :], strict=True))}
        kinematics = self.robot.forward_kinematics(self.postures, self.target, values)
        J = self.robot.position_jacobian(kinematics, self.postures, self.names, values)[:, :, 0, :]
        return self.data.position - kinematics.position[:, 0, :].T, np.moveaxis(J, -1, 0).swapaxes(1, 2)

    def mean_errors(self, sets: Array) -> Array:
        """Return the mean position error over all poses with each of `sets` [m], ``(sets,)``."""
        means = np.empty(len(sets))
        size = max(1, _BLOCK // len(self.postures))
        for block in (slice(first, first + size) for first in range(0, len(sets), size)):
            values = {**self.robot.values, **dict(zip(self.names, sets[block].T[:, :, None], strict=True))}
            apart = (
                self.robot.forward_kinematics(self.postures, self.target, values).position
                - self.data.position.T[:, None, :]
            )
            means[block] = np.linalg.norm(apart, axis=0).mean(axis=1)
        return means


def _poses(
    robot: Robot, data: Dataset, names: Sequence[str], target: str, tolerance: float, units: Mapping[str, float] | None
) -> _Poses:
    robot.target(target)
    unit = sizes_of(robot, names, UNIT, units or {}, "unit")
    if not (np.isfinite(tolerance) and tolerance > 0):
        raise InputError("the tolerance is no size", came=tolerance, allowed="above 0 m")
    index = data.targets.index(target) if target in data.targets else -1
    if not ((data.target == index) & data.has_position).any():
        raise InputError(
            "there is no position reading of this target",
            where=data.source,
            came=target,
            allowed=", ".join(data.targets),
        )
    return _Poses(robot, positions_of(data, target), tuple(names), target, unit)


def positions_of(data: Dataset, target: str) -> Dataset:
    """Return the position readings of one target alone, those in the instrument's own frame."""
    rows = (data.target == data.targets.index(target)) & data.has_position
    return replace(
        data,
        targets=(target,),
        configuration=data.configuration[rows],
        target=np.zeros(int(rows.sum()), dtype=np.intp),
        position=data.position[rows],
        quaternion=None,
        distance=None,
        height=None,
        fixtures=(),
        fixture=None,
        setup=None,
        sigma=None if data.sigma is None else data.sigma[rows],
        sigma_rot=None,
        visit=None,
        references=None,
    )


def _result(
    robot: Robot, poses: _Poses, factor: Array, tolerance: float, combination: Combination, method: str
) -> PoseByPose:
    """Step at every pose, each parameter's step times its `factor`, ``(n, parameters)``, and combine."""
    start = np.array([robot.values[name] for name in poses.names])
    sets = np.tile(start, (len(poses.postures), 1))
    iterations = np.zeros(len(sets), dtype=np.intp)
    for _ in range(_ITERATIONS):
        error, J = poses.compared(sets)
        unmet = np.linalg.norm(error, axis=1) >= tolerance
        if not unmet.any():
            break
        iterations += unmet
        smallest = poses.unit * (np.linalg.pinv(J * poses.unit, rcond=_RANK) @ error[:, :, None])[:, :, 0]
        sets = sets + np.where(unmet[:, None], factor * smallest, 0.0)
    left = np.asarray(np.linalg.norm(poses.compared(sets)[0], axis=1))
    combined = _combined(poses, start, sets, combination)
    corrected = _with_set(robot, poses.names, combined, f"{len(sets)} poses one at a time, {method}, {combination}")
    return PoseByPose(corrected, poses.names, sets, iterations, left, left < tolerance)


def _combined(poses: _Poses, start: Array, sets: Array, combination: Combination) -> Array:
    if combination == "best-pose":
        return np.asarray(sets[np.argmin(poses.mean_errors(sets))])
    along, scale = (sets - start).mean(axis=0), 1.0
    if combination == "scaled-mean" and along.any():
        for _ in range(5):  # nearly linear in the scale
            error, J = poses.compared(np.tile(start + scale * along, (len(sets), 1)))
            moved = J @ along
            scale += float(np.sum(moved * error) / np.sum(moved**2))
    return np.asarray(start + scale * along)


def _with_set(robot: Robot, names: Sequence[str], vector: Array, remark: str) -> Robot:
    known = (
        replace(robot.parameters[n], value=float(v), deviation=None, informed=None)
        for n, v in zip(names, vector, strict=True)
    )
    return replace(robot.with_parameters(known), history=(*robot.history, remark), proof=None)
