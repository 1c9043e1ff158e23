"""How accurate a calibration will be before anything is measured, and where a robot shall be accurate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.arrays import axes
from truearm.engine.base.errors import InputError, counted, listed, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.command.arguments import array_argument
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.data.readers.configurations import read_poses
from truearm.engine.fit.design import O1, most_informative
from truearm.engine.fit.problem import Problem, gauge_motion_removed, independent_columns
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.parameters import PRIOR, FreeParameters
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rotation_from_quaternion

#: Places that are looked at, evenly among all.
_MOST: Final = 500
#: Configurations of a region that are looked at, and how many are drawn to find them.
_IN_REGION, _DRAWN, _AT_ONCE = 200, 400_000, 20_000


@dataclass(frozen=True, eq=False)
class AccuracyGoal:
    """Where a robot shall be accurate."""

    postures: Postures  #: The configurations there.
    words: str  #: What that is: ``at the 40 targets of part.mod``.


def accuracy_goal(
    robot: Robot,
    accurate_at: object,
    region: object,
    tools: str | Path | None,
    frames: str | Path | None,
    rng: np.random.Generator,
) -> AccuracyGoal | None:
    """Return where a robot shall be accurate, None if nothing was said of that.

    Args:
        accurate_at: A program, a CSV file of poses of the flange in the base frame, or joint positions of the model
            ``(n, joints)`` [rad or m].
        region: Lowest and highest x, y and z of the flange in the base frame [m].
        tools, frames: Where tools and frames of a program are, see :mod:`truearm.engine.programs.cell`.

    Raises:
        InputError: If both are given, a file cannot be read, or the robot reaches none of it.
    """
    if accurate_at is not None and region is not None:
        raise InputError(
            "the robot can be planned for places or for a region",
            parameter="accurate_at, region",
            cure="Leave one of them out.",
        )
    if accurate_at is None and (tools is not None or frames is not None):
        raise InputError(
            "only a program needs to know where its tools and frames are",
            parameter="tools" if tools is not None else "frames",
            cure="Give the program, or leave it out.",
        )
    if region is not None:
        return _in_region(robot, _box(region), rng)
    if accurate_at is None:
        return None
    if not isinstance(accurate_at, str | Path):
        count = len(robot.joints)
        configurations = array_argument(
            accurate_at, "accurate_at", ("n", count), f"joint positions, (n, {count}), or a file"
        )
        return _goal(configurations, "at the given configurations")
    path = path_argument(accurate_at, "accurate_at")
    with refusals_of("accurate_at"):
        if path.suffix.lower() == ".csv":
            return _at_poses(robot, path)
        return _at_targets(robot, path, tools, frames)


def _goal(joints: Array, words: str) -> AccuracyGoal:
    some = np.unique(np.linspace(0, len(joints) - 1, min(len(joints), _MOST)).astype(int))
    chosen = joints[some]
    if len(some) < len(joints):
        words += f" (judged at {len(some)} of them)"
    return AccuracyGoal(Postures(chosen, approach=np.ones_like(chosen), number=np.zeros(len(chosen))), words)


def _at_poses(robot: Robot, path: Path) -> AccuracyGoal:
    read = read_poses(path)
    rotations = None if read.quaternion is None else rotation_from_quaternion(read.quaternion)
    joint_solutions = inverse(robot, read.position, rotations, orientation="free" if rotations is None else "full")
    lost = [label for label, usable in zip(read.labels, joint_solutions.usable, strict=True) if not usable]
    if lost:
        raise InputError(
            f"the robot cannot go to {counted(len(lost), 'pose')}",
            where=str(path),
            came=listed(lost),
            cure="Look at them with 'truearm ik', and leave them out.",
        )
    return _goal(joint_solutions.joints, f"at the {counted(len(joint_solutions.joints), 'pose')} of {path.name}")


def _at_targets(robot: Robot, path: Path, tools: str | Path | None, frames: str | Path | None) -> AccuracyGoal:
    from truearm.engine.programs.cell import Cell, read_frames, read_tools
    from truearm.engine.programs.fake_targets import controllers_robot
    from truearm.engine.programs.program_files import language_called, program_files, read_programs
    from truearm.engine.programs.resolved_program import ResolvedProgram

    programs = read_programs(program_files([path], again=True))
    language = language_called(programs[0].language)
    with refusals_of("tools"):
        tool_file = None if tools is None else path_argument(tools, "tools")
        placed = read_tools(robot, tool_file, language.flange)
    with refusals_of("frames"):
        frame_file = None if frames is None else path_argument(frames, "frames")
        cell = Cell(placed, read_frames(robot, frame_file, language.base))
    believed = controllers_robot(robot)
    joints = np.concatenate([ResolvedProgram(robot, believed, program, cell).joints for program in programs])
    reached = joints[~np.isnan(joints).any(axis=1)]
    if not len(reached):
        raise InputError(
            "the robot reaches none of the targets",
            where=str(path),
            came=counted(len(joints), "target"),
            cure="Check that it is this robot's program, and say where its tools and frames are.",
        )
    of = "" if len(reached) == len(joints) else f" of {len(joints)}"
    return _goal(reached, f"at the {len(reached)}{of} targets of {path.name}")


def _box(region: object) -> Array:
    allowed = "lowest and highest x, y and z in m, (3, 2)"
    if isinstance(region, str) or axes(region) != 2:
        raise InputError("a box belongs here", parameter="region", came=str(region), allowed=allowed)
    box = array_argument(region, "region", (3, 2), allowed)
    for name, (low, high) in zip("xyz", box, strict=True):
        if not low < high:
            raise InputError(
                f"the region has no extent along {name}",
                parameter="region",
                came=f"{low * 1e3:g} to {high * 1e3:g} mm",
                cure="The lower one comes first.",
            )
    return box


def _in_region(robot: Robot, box: Array, rng: np.random.Generator) -> AccuracyGoal:
    base = robot.base
    parts: list[Array] = []
    low, high = box.T
    for _ in range(_DRAWN // _AT_ONCE):
        drawn = robot.random_configurations(_AT_ONCE, rng)
        place = (robot.rigid.world_poses(drawn)[0] - np.array(base.translation)) @ base.rotation
        parts.append(drawn[((place >= low) & (place <= high)).all(axis=1)])
        if sum(map(len, parts)) >= _IN_REGION:
            break
    inside = np.concatenate(parts)[:_IN_REGION]
    corners = ", ".join(f"{name} {a * 1e3:g} to {b * 1e3:g}" for name, (a, b) in zip("xyz", box, strict=True))
    if not len(inside):
        raise InputError(
            "the flange does not reach this region",
            parameter="region",
            came=f"{corners} mm in the base frame",
            cure="Move it; 'truearm show' says where the flange is at joint positions.",
        )
    return _goal(inside, f"in the region {corners} mm")


#: Radius at which an angle that is read counts as a length [m].
_LEVER: Final = 0.1


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives of readings by parameters in their sizes."""

    free: FreeParameters  #: The model's parameters, base and targets among them.
    #: Physical size of each parameter [SI]: its prior, and for base, targets and fixtures, whose priors are wide
    #: because nobody measured them beforehand, that of geometry, 1 mm and 0.1 deg.
    size: Array
    #: Derivatives of the readings, in deviations of a reading per size, ``(configurations, rows, parameters)``. Three
    #: rows are a target's coordinates, or a distance or height and two zeros.
    rows: Array
    #: Information of what is known of fixtures, ``(parameters, parameters)``; None if nothing is.
    beside: Array | None = None

    @cached_property
    def known(self) -> Array:
        """Information of the priors and of what is known of fixtures, ``(parameters, parameters)``."""
        priors = np.diag((self.size / self.free.prior) ** 2)
        return priors if self.beside is None else priors + self.beside

    @cached_property
    def squares(self) -> Array:
        """Mean product of the derivatives of a coordinate, ``(configurations, parameters, parameters)``."""
        return np.asarray(self.rows.swapaxes(1, 2) @ self.rows / self.rows.shape[1])

    def identifiable(self, count: int) -> NDArray[np.intp]:
        """Return the indices of parameters that `count` average configurations can tell from all others."""
        R = np.linalg.qr(self.rows.reshape(-1, self.rows.shape[2]), mode="r")
        share = np.sqrt(count / len(self.rows))
        return np.array(sorted(independent_columns(share * R, range(len(self.size)), self.free)), dtype=np.intp)


def sensitivity(
    robot: Robot, postures: Postures, free: FreeParameters, noise: float, gauge: Sequence[str] = ()
) -> Sensitivity:
    """Return what the positions of all targets would tell.

    Args:
        robot: With targets and the model's effects, see :meth:`truearm.engine.fit.models.Model.prepared`.
        postures: Where it is read.
        free: Which parameters are asked about.
        noise: Standard deviation of a coordinate about a well identified model [m].
        gauge: What does not count: where the base is, the size of everything
            (:func:`truearm.engine.fit.problem.gauge_freedoms`).

    Raises:
        InputError: If the robot has no targets, or an effect of the model needs to know more than the postures tell.
    """
    check_known(robot, postures, free)
    refuse_beyond(
        "derivatives", len(postures) * 3 * len(robot.targets) * len(free.parameters), where=f"{robot.name}, candidates"
    )
    loaded = robot.loaded(postures)
    by_target = []
    for target in robot.targets:
        kinematics = robot.forward_kinematics(loaded, target.name)
        moves = robot.position_jacobian(kinematics, loaded, free.names)
        if gauge:
            (flat,) = gauge_motion_removed(gauge, robot, kinematics, [moves.reshape(len(moves), -1).T])
            moves = flat.T.reshape(moves.shape)
        by_target.append(moves)
    size = _size(free)
    derivative = np.concatenate(by_target, axis=1)  # (parameters, rows, configurations)
    return Sensitivity(free, size, np.ascontiguousarray(np.moveaxis(derivative, (0, 2), (2, 0))) * (size / noise))


def sensitivity_of_readings(robot: Robot, data: Dataset, free: FreeParameters, noise: float) -> Sensitivity:
    """Return what the readings of a device would tell, whatever they are.

    Args:
        robot: With its targets and the fixtures of the readings.
        data: Readings; what they say does not matter. What is known of fixtures counts as known.
        free, noise: As for :func:`sensitivity`; an angle counts as what it moves at a radius of 0.1 m.
    """
    check_known(robot, data.postures, free)
    kinds = {observation.name: noise for observation in OBSERVATIONS} | {"orientation": noise / _LEVER}
    plain = replace(data, sigma=None, sigma_rot=None)
    problem = Problem(robot, plain, free, kinds, priors=False)
    J = problem.linearised(free.start)[1]
    of_row = np.concatenate(
        [np.repeat(b.data.configuration[b.readings], b.observation.components) for b in problem.blocks]
    )
    known = np.concatenate([np.full(b.rows, b.data is not plain) for b in problem.blocks])
    part = np.concatenate([np.tile(np.arange(b.observation.components), len(b.readings)) for b in problem.blocks])
    size = _size(free)
    place = np.zeros(len(J), dtype=np.intp)  # of each row among those of its configuration, threes kept together
    seen = np.zeros(data.configurations, dtype=np.intp)
    for row in np.flatnonzero(~known).tolist():
        if part[row] == 0:
            seen[of_row[row]] += 3
        place[row] = seen[of_row[row]] - 3 + part[row]
    rows = np.zeros((data.configurations, int(seen.max()), len(size)))
    read = ~known
    rows[of_row[read], place[read]] = J[read] * size
    fixed = J[known] * size
    return Sensitivity(free, size, rows, fixed.T @ fixed)


def check_known(robot: Robot, postures: Postures, free: FreeParameters) -> None:
    """Refuse a robot that nobody sees, and effects that need to know what no plan knows, if they do anything."""
    if not robot.targets:
        raise InputError("the robot has no targets, so nothing can be measured", where=robot.name)
    for effect in robot.effects:
        grows = any(robot.values[p.name] != 0.0 or p.name in free.names for p in effect.parameters)
        if effect.warmed and grows and postures.temperature is None:
            raise InputError(
                f"the effect {effect.name} needs the temperature of the arm, which a plan does not have",
                where=robot.name,
                cure="Choose another model.",
            )


def _size(free: FreeParameters) -> Array:
    placed = ("base", "target", "fixture")
    return np.array([PRIOR["geometry", p.unit] if p.group in placed else p.prior for p in free.parameters])


# The deviations of the readings give the covariance of the parameters, and that gives the error of predictions
# anywhere. A fit takes readings as independent, but what a model cannot follow moves all targets of a pose alike: on
# the measured IRB 120 three quarters of the variance of the residuals, with every model tried. So the covariance is
# that of a least squares fit to readings that hang together, ``P (J' C J + K) P`` with ``P = (J' J + K)^-1``, where K
# is the information of the priors and C the correlation of the readings.

#: Numbers of poses that are looked at, from as many as the model needs at least.
NUMBERS: Final = (8, 10, 12, 15, 18, 20, 25, 30, 35, 40, 50, 60, 80, 100, 150, 200)
#: More poses are said to be of little use where the error is within this of what no number of poses goes below.
NEAR: Final = 1.1
#: A plan that leaves an error of more than one part in this of what the robot has without it tells little.
_LITTLE: Final = 2.0
#: What is wherever the instrument and the targets were set up, by groups of parameters.
_PLACED: Final = ("base", "target", "fixture")
_POOL: Final = 500
#: Share of a reading's variance that all targets of a pose have in common (irb120-faro, docs/guide/planning.md).
_COMMON_SHARE: Final = 0.75
_DRAWS: Final = 5
#: Mean length of a vector of three normal coordinates, per deviation.
_MEAN_LENGTH: Final = math.sqrt(8.0 / math.pi)


@dataclass(frozen=True, eq=False)
class There:
    """How far the model will be off where the robot is wanted to be accurate [m], without the noise of a reading."""

    places: Array  #: Where the flange is, in the world, ``(k, 3)``.
    error: Array  #: Mean error of the targets there after the plan, ``(k,)``.
    by_o1: Array | None  #: The same after as many configurations that O1 chooses; None where the plan is O1's.


@dataclass(frozen=True, eq=False)
class Prediction:
    """Mean errors of positions that were not measured [m]."""

    floor: float  #: What no number of poses goes below: the noise of the reading that judges.
    planned: float  #: Of the plan.
    numbers: NDArray[np.intp]  #: Numbers of poses.
    chosen: Array  #: chosen, random: error after as many poses, chosen by O1 and drawn at random, ``(numbers,)``.
    random: Array
    places: Array  #: Where the flange is at random configurations, in the world, ``(k, 3)``.
    error: Array  #: Mean error of the targets there, of the model alone, without the noise of a reading, ``(k,)``.
    there: There | None = None  #: The same where the robot is wanted to be accurate; None if nothing was said of that.
    #: Mean error of the robot that is not calibrated, by the priors of what the model identifies of its joints, seen
    #: from where base and targets are known [m].
    nominal: float = 0.0

    @property
    def sufficient_number(self) -> int | None:
        """The smallest of the numbers with an error at most 10 % above the floor; None if all are too small."""
        near = self.numbers[self.chosen <= NEAR * self.floor]
        return int(near[0]) if len(near) else None

    @property
    def tells_little(self) -> bool:
        """Whether the model is left with more than half of the error that the robot has without a calibration."""
        return 0.0 < self.nominal < _LITTLE * float(self.error.mean())


def variances(candidates: Sensitivity, measured: NDArray[np.intp], elsewhere: Sensitivity) -> Array:
    """Return the mean variance of a coordinate at each configuration elsewhere, in variances of the noise, ``(k,)``.

    Args:
        candidates: What could be measured.
        measured: Which of them are.
        elsewhere: Where the model is judged, of the same parameters.
    """
    known = candidates.known
    rows = candidates.rows[measured]
    together = rows.reshape(len(rows), -1, 3, len(known)).sum(axis=1).reshape(-1, len(known))
    rows = rows.reshape(-1, len(known))
    information = rows.T @ rows
    spread = (1.0 - _COMMON_SHARE) * information + _COMMON_SHARE * (together.T @ together) + known
    root = np.linalg.solve(known + information, np.linalg.cholesky(spread))
    return np.tensordot(elsewhere.squares, root @ root.T, 2)


def model_error(candidates: Sensitivity, measured: NDArray[np.intp], elsewhere: Sensitivity, noise: float) -> Array:
    """Return the mean error of a position at each configuration elsewhere [m], of the model alone, ``(k,)``."""
    return np.asarray(_MEAN_LENGTH * noise * np.sqrt(variances(candidates, measured, elsewhere)))


def nominal_error(elsewhere: Sensitivity, noise: float) -> float:
    """Return the mean error of positions elsewhere before anything is measured, base and targets being known [m]."""
    own = np.array([p.group not in _PLACED for p in elsewhere.free.parameters], dtype=bool)
    moved = elsewhere.rows[..., own] * (elsewhere.free.prior / elsewhere.size)[own]
    return float(_MEAN_LENGTH * noise * np.mean(np.sqrt(np.mean(np.sum(moved**2, axis=2), axis=1))))


def predict(
    robot: Robot,
    candidates: Sensitivity,
    chosen: NDArray[np.intp],
    elsewhere: Sensitivity,
    q: Array,
    noise: float,
    rng: np.random.Generator,
) -> Prediction:
    """Predict the error after measuring the chosen candidates, and how it falls with their number.

    Args:
        candidates: What could be measured.
        chosen: What is.
        elsewhere: The same at the configurations `q` where the model is judged.
        noise: Standard deviation of a coordinate [m].
    """
    known = candidates.known

    def mean_error(measured: NDArray[np.intp]) -> float:
        return float(_MEAN_LENGTH * noise * np.mean(np.sqrt(1.0 + variances(candidates, measured, elsewhere))))

    count = len(candidates.rows)
    pool = rng.permutation(count)[:_POOL]
    identified = candidates.identifiable(max(NUMBERS))
    least = len(identified) / candidates.rows.shape[1]
    numbers = np.array([n for n in NUMBERS if least <= n <= len(pool)], dtype=np.intp)
    rows, known_of_identified = candidates.rows[pool][..., identified], known[np.ix_(identified, identified)]
    by_choice = [mean_error(pool[most_informative(rows, int(n), known_of_identified, O1())]) for n in numbers]
    orders = [rng.permutation(count) for _ in range(_DRAWS)]
    by_chance = [float(np.mean([mean_error(order[:n]) for order in orders])) for n in numbers]
    return Prediction(
        floor=_MEAN_LENGTH * noise,
        planned=mean_error(chosen),
        numbers=numbers,
        chosen=np.array(by_choice),
        random=np.array(by_chance),
        places=robot.world_poses(q)[0],
        error=model_error(candidates, chosen, elsewhere, noise),
        nominal=nominal_error(elsewhere, noise),
    )
