"""A path corrected so that the calibrated robot keeps to it, and its program."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import to_si
from truearm.engine.motion.joint_motion import JointMotion, Tip, joint_motion
from truearm.engine.motion.path_file import PlannedPath
from truearm.engine.motion.paths import Trajectory
from truearm.engine.programs.fake_targets import nominal_robot
from truearm.engine.programs.gauge import best_agreement
from truearm.engine.programs.new_program import NAME, NewProgram
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branch_search import beyond_limits
from truearm.engine.robot.inverse.branches import branch_rule
from truearm.engine.robot.inverse.kinematics import NEAR_SINGULAR, reach
from truearm.engine.robot.inverse.pose_solver import Orientation
from truearm.engine.robot.inverse.redundancy_resolution import chosen_rows
from truearm.engine.robot.loads import has_weight, joint_loads
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform, homogeneous, rotation_vector

# Joint positions changed so that the calibrated robot keeps to the wanted path (Patel, equation 5.22).
#
# The calibrated robot predicts where the tip will be with the joint positions of the nominal motion. By how much it is
# beside the path is turned into a change of the joint positions by the step of least norm,
# ``J^T (J J^T)^-1 (P_predicted - P_desired)``. That is subtracted (the document does not say so; added, it would double
# the error), and the prediction is made again until the tip is on the path. The norm counts rad, and m where joints
# slide.
#
# Joint positions are changed by fractions of a degree. The velocities and accelerations of the nominal motion are
# therefore kept for the moments that bend the arm in motion.

#: The tip is on the path within this [m].
AGREED: Final = 1e-9
_MOST_ROUNDS: Final = 20
#: A change of a joint this large corrects no calibration error [rad or m]: something else is wrong.
_LARGEST_CHANGE: Final = math.radians(10.0)


@dataclass(frozen=True, eq=False)
class JointCorrection:
    """Corrected joint positions, and what the calibrated robot predicts of them."""

    joints: Array  #: Joint positions to command [rad or m], ``(n, joints)``.
    change: Array  #: What was added to the joint positions of the nominal motion, ``(n, joints)``.
    #: before, after: predicted distance from the path without and with the correction [m], ``(n,)``. After is zero
    #: within 1e-9 unless an effect jumps (backlash where the moment changes its sign) and no joint position gives the
    #: point.
    before: Array
    after: Array
    rounds: int  #: How often the prediction was made again.


def path_error(robot: Robot, motion: JointMotion, desired: Array, target: str | None = None) -> Array:
    """Return where the robot will be beside the path (Patel, equation 5.21).

    Args:
        robot: Calibrated, or with the effects alone whose part is wanted.
        motion: What is commanded.
        desired: The path in the robot's base frame, ``(n, 3)`` [m].
        target: Name of the target that follows the path; the flange if None.

    Returns:
        error: Predicted less desired position, in the base frame, ``(n, 3)`` [m].
    """
    return Tip(robot, target).positions(motion.postures()) - _desired(motion, desired)


def corrected(
    robot: Robot,
    motion: JointMotion,
    desired: Array,
    target: str | None = None,
    *,
    orientation: Orientation = "free",
    rotation: Array | None = None,
) -> JointCorrection:
    """Return joint positions with which the calibrated robot keeps to the path.

    Args:
        robot: The calibrated robot, with its effects.
        motion: From :func:`truearm.engine.motion.joint_motion.joint_motion` of the nominal robot.
        desired: The path in the base frame, ``(n, 3)`` [m].
        target: Name of the target that follows the path; the flange if None.
        orientation, rotation: How much of the tip's orientation is kept beside its position, and which, ``(3, 3)``. The
            document corrects the position alone.

    Raises:
        InputError: If the arm is singular, has to turn by more than 10 deg, or beyond its limits: with time and joint.
    """
    tip, wanted = Tip(robot, target), _desired(motion, desired)
    length = reach(robot, target)
    planned = np.eye(3) if rotation is None else rotation
    rows = chosen_rows(orientation, planned, length)
    joints = best = motion.joints
    before = after = np.zeros(0)
    rounds = 0
    while True:
        state = tip.at(motion.postures(joints))
        error = state.position - wanted
        distance = np.linalg.norm(error, axis=1)
        if rounds == 0:
            before = after = distance
        nearer = distance < after
        best, after = np.where(nearer[:, None], joints, best), np.where(nearer, distance, after)
        turned = _turned(orientation, planned, state.rotation)
        missed = np.concatenate([error, turned], axis=1) @ rows.T
        if (np.linalg.norm(missed, axis=1) * length <= AGREED).all() or rounds == _MOST_ROUNDS:
            break
        joints = joints - _least_norm(rows @ state.jacobian, missed, motion)
        rounds += 1
        _check_change(joints - motion.joints, motion)
    _check_limits(robot, best, motion)
    return JointCorrection(best, best - motion.joints, before, after, rounds)


def _turned(orientation: Orientation, planned: Array, rotation: Array) -> Array:
    """Return by how much tips ``(n, 3, 3)`` are turned from the orientation to keep, ``(n, 3)`` [rad]."""
    if orientation == "full":
        return rotation_vector(rotation @ planned.T)
    if orientation == "axis":
        return np.asarray(np.cross(np.broadcast_to(planned[:, 2], (len(rotation), 3)), rotation[:, :, 2]))
    return np.zeros((len(rotation), 3))


def _least_norm(A: Array, missed: Array, motion: JointMotion) -> Array:
    """Return ``A^T (A A^T)^-1 missed``, ``(n, joints)``, for rows ``(n, rows, joints)`` in reach lengths."""
    weak = np.linalg.svd(A, compute_uv=False)[:, -1]
    if (weak < NEAR_SINGULAR).any():
        raise InputError(
            "the arm is in a singular posture, where positions cannot be corrected",
            where=_place(motion, int(np.argmax(weak < NEAR_SINGULAR))),
            cure="Move the path.",
        )
    normal = A @ A.swapaxes(1, 2)
    return np.asarray((A * np.linalg.solve(normal, missed[:, :, None])).sum(1))


def _check_change(change: Array, motion: JointMotion) -> None:
    far = np.argwhere(np.abs(change) > _LARGEST_CHANGE)
    if len(far):
        row, joint = far[0]
        raise InputError(
            "the joints would have to change by more than a calibration can account for",
            where=f"{_place(motion, int(row))}, {motion.joint_names[joint]}",
            allowed=f"{math.degrees(_LARGEST_CHANGE):g} deg",
            cure="Check that motion, path and target belong together.",
        )


def _check_limits(robot: Robot, joints: Array, motion: JointMotion) -> None:
    far = np.argwhere(beyond_limits(robot, joints))
    if len(far):
        row, joint = far[0]
        raise InputError(
            "the correction takes a joint beyond its limits",
            where=f"{_place(motion, int(row))}, {motion.joint_names[joint]}",
            cure="Move the path.",
        )


def _place(motion: JointMotion, row: int) -> str:
    return f"at {motion.time[row]:.4g} s (sample {row})"


def _desired(motion: JointMotion, desired: Array) -> Array:
    values = np.asarray(desired, float)
    if values.shape != (len(motion.time), 3) or not np.isfinite(values).all():
        raise InputError(
            "the path has to have a position for every sample of the motion",
            where="desired",
            came=f"an array of shape {values.shape}",
            allowed=f"({len(motion.time)}, 3), finite",
        )
    return values


# A planned path as a controller would follow it, and corrected so that the calibrated robot keeps to it.
#
# The controller knows the nominal robot: it turns the path into joint positions with that. The calibrated robot then
# goes elsewhere, by its geometry, by what its joints give way under weight, and by what motion adds. The correction is
# made in as many steps, so that each part of the error shows (Patel, sections 5.3 and 5.5.1).
#
# A path has a frame. ``base`` is the identified base of the robot, and ``world`` the instrument's frame, in which the
# robot was calibrated. ``nominal`` is the base of the controller's robot. Where that is in the real robot no
# calibration can know (:mod:`truearm.engine.programs.gauge`): it is taken to be where both robots agree best, base and
# flange alike.

#: What the tip is called that follows a path.
TIP: Final = "tip"

#: What a correction knows of the robot.
Knowledge = Literal["nothing", "geometry", "deflection", "motion"]
KNOWLEDGE: Final[tuple[Knowledge, ...]] = ("nothing", "geometry", "deflection", "motion")
#: What each stage of the correction is called.
STAGES: Final[Mapping[Knowledge, str]] = {
    "nothing": "without correction",
    "geometry": "geometry corrected",
    "deflection": "and what gives way at rest",
    "motion": "and what motion adds",
}


@dataclass(frozen=True, eq=False)
class CorrectedPath:
    """A path followed by the nominal robot, and corrected for the calibrated one."""

    planned: PlannedPath  #: The path.
    motion: JointMotion  #: What the controller would command: joint positions of the nominal robot.
    #: Joint positions to command, by what the correction knows, ``(n, joints)`` [rad or m]. ``nothing`` are those of
    #: `motion`; ``geometry`` corrects the identified geometry alone, ``deflection`` also how the joints give way at
    #: rest, ``motion`` also what velocities and accelerations add to the loads. What the robot's model does not have is
    #: not there.
    joints: Mapping[Knowledge, Array]
    #: For each of them the distance from the path that the calibrated robot predicts in motion [m], ``(n,)``.
    errors: Mapping[Knowledge, Array]
    #: For each of them where the tip will be, in the frame of the path, ``(n, 3)`` [m].
    tips: Mapping[Knowledge, Array]
    #: Force and moment of the load at every joint in the corrected motion, ``(joints, 6, n)`` [N, N m], as
    #: :func:`truearm.engine.robot.loads.joint_loads` has them; None for a robot without masses.
    loads: Array | None
    nominal: Robot  #: The robot that the controller knows, with the tip as its target.

    @property
    def best(self) -> Knowledge:
        """What the correction knows that knows most."""
        return [name for name in KNOWLEDGE if name in self.joints][-1]

    @property
    def calibrated(self) -> bool:
        """Whether there is anything to correct."""
        return self.best != "nothing"


def correct_path(robot: Robot, planned: PlannedPath, seed: ArrayLike | None = None) -> CorrectedPath:
    """Return the joint motion along a path, and what corrects it.

    Args:
        robot: Calibrated, with what it carries and what acts on it, which then acts on the tip. For one that is nominal
            there is no correction.
        planned: The path.
        seed: Joint positions ``(joints,)`` [rad or m] near which the motion shall begin; zero if None.

    Raises:
        InputError: If the robot has no such target, cannot follow the path, goes too fast, or cannot be corrected along
            it: with the place on the path.
    """
    try:
        nominal, known = nominal_robot(robot), True
    except InputError:
        nominal, known = replace(robot, effect_names=()), False
    place = _Placed(robot, nominal, planned, known)
    wanted = place.nominal_path
    rotation = place.to_nominal[:3, :3] @ planned.rotation
    motion = joint_motion(
        place.nominal, wanted, target=TIP, orientation=planned.orientation, rotation=rotation, seed=seed
    )
    _check_speeds(robot, motion, planned)
    real = place.real
    desired = _moved(place.to_real, planned.trajectory.position)
    desired_rotation = place.to_real[:3, :3] @ planned.rotation
    joints: dict[Knowledge, Array] = {"nothing": motion.joints}
    if known:
        for name, model, moving in _models(real, motion):
            joints[name] = corrected(
                model, moving, desired, TIP, orientation=planned.orientation, rotation=desired_rotation
            ).joints
    tip = Tip(real, TIP)
    reached = {name: tip.positions(motion.postures(values)) for name, values in joints.items()}
    back = np.asarray(np.linalg.inv(place.to_real), float)
    best = joints[[name for name in KNOWLEDGE if name in joints][-1]]
    return CorrectedPath(
        planned,
        motion,
        joints,
        {name: np.linalg.norm(at - desired, axis=1) for name, at in reached.items()},
        {name: _moved(back, at) for name, at in reached.items()},
        _loads(real, motion, best),
        place.nominal,
    )


class _Placed:
    """The path and its tip in the nominal robot, and in the calibrated one."""

    def __init__(self, robot: Robot, nominal: Robot, planned: PlannedPath, known: bool) -> None:
        #: From the frame of the path to the base of the nominal robot, and to that of the calibrated one.
        self.to_nominal: Array = np.eye(4)
        self.to_real: Array = self.to_nominal
        flange: Array = np.eye(4)
        if planned.frame == "world":
            self.to_nominal = self.to_real = np.asarray(np.linalg.inv(robot.base.matrix))
        elif planned.frame == "nominal" and known:
            self.to_real, flange = best_agreement(robot)
        at = _tip(robot, planned)
        if planned.target is None:  # known on the flange of the controller's robot
            on_nominal, on_real = at, flange @ np.append(at, 1.0)
        else:
            on_nominal, on_real = np.linalg.inv(flange) @ np.append(at, 1.0), at
        turned = Transform.from_matrix(flange[:3, :3], on_real[:3])
        self.nominal = nominal.with_frames(IDENTITY, {TIP: on_nominal[:3].tolist()})
        real = robot.with_frames(robot.base, {TIP: turned})
        self.real = real if robot.wrench is None else real.with_wrench(robot.wrench, TIP)
        self.nominal_path = _trajectory(self.to_nominal, planned.trajectory)


def _tip(robot: Robot, planned: PlannedPath) -> Array:
    """Return where what follows the path is on the flange [m]: by its place, or identified."""
    if planned.target is None:
        return np.zeros(3) if planned.tip is None else np.array(planned.tip)
    target = robot.target(planned.target)
    return np.array([robot.values[target.parameter(axis)] for axis in "xyz"])


def _models(robot: Robot, motion: JointMotion) -> list[tuple[Knowledge, Robot, JointMotion]]:
    """Return models that know more and more, with the motion that each sees."""
    still = replace(motion, velocity=np.zeros_like(motion.velocity), acceleration=np.zeros_like(motion.acceleration))
    models: list[tuple[Knowledge, Robot, JointMotion]] = [("geometry", replace(robot, effect_names=()), still)]
    if robot.effects:
        models.append(("deflection", robot, still))
    if any(effect.loaded for effect in robot.effects) and has_weight(robot):  # a force alone needs no motion
        models.append(("motion", robot, motion))
    return models


def _loads(robot: Robot, motion: JointMotion, joints: Array) -> Array | None:
    if not has_weight(robot) and robot.wrench is None:
        return None
    postures = motion.postures(joints)
    return joint_loads(
        robot,
        robot.variables(postures, robot.values),
        velocity=motion.velocity.T,
        acceleration=motion.acceleration.T,
        wrench=None if postures.wrench is None else postures.wrench.T,
    )


def _check_speeds(robot: Robot, motion: JointMotion, planned: PlannedPath) -> None:
    """Refuse a motion in which a joint is faster than the file allows."""
    if planned.joint_speeds is None:
        return
    if len(planned.joint_speeds) != len(robot.joints):
        raise InputError(
            "there are not as many speeds as joints",
            where=f"{planned.source}, joint_speeds",
            came=len(planned.joint_speeds),
            allowed=f"{len(robot.joints)}, one for each joint of {robot.name}",
        )
    length, angle = planned.units
    units = [angle if joint.kind == "revolute" else length for joint in robot.joints]
    most = np.array([to_si(speed, unit) for speed, unit in zip(planned.joint_speeds, units, strict=True)])
    beyond = np.abs(motion.velocity) / most
    if beyond.max() <= 1.0:
        return
    row, joint = (int(k) for k in np.unravel_index(int(beyond.argmax()), beyond.shape))
    along = planned.trajectory.distance[row] * 1e3
    raise InputError(
        "a joint would have to be faster than the file allows",
        where=f"{planned.source}, section {planned.section[row]}, {along:.1f} mm along the path, "
        f"at {motion.time[row]:.4g} s (sample {row})",
        came=f"{robot.joints[joint].name} at {beyond[row, joint] * planned.joint_speeds[joint]:.4g} {units[joint]}/s",
        allowed=f"up to {planned.joint_speeds[joint]:g} {units[joint]}/s",
        cure="Go slower there (speed of the section), or keep away from singular postures.",
    )


def _trajectory(T: Array, path: Trajectory) -> Trajectory:
    return Trajectory(path.time, _moved(T, path.position), path.velocity @ T[:3, :3].T, path.acceleration @ T[:3, :3].T)


def _moved(T: Array, points: Array) -> Array:
    return np.asarray(points @ T[:3, :3].T + T[:3, 3])


#: What the targets of a program are.
TargetKind = Literal["joints", "poses"]
_AXES: Final = 6


def path_program(path: CorrectedPath, robot: Robot, name: str, *, targets: TargetKind, spacing: float) -> NewProgram:
    """Return the targets of a program that follows a corrected path.

    Args:
        path: With its corrected joint positions.
        robot: For whom it is.
        name: Of the program.
        targets: ``joints``, or ``poses``: those that the controller's robot has with the corrected joint positions.
        spacing: Time from one target to the next [s], or a little less; that of the samples at the least.

    Raises:
        InputError: If the name cannot be one in every language, or the arm has more or fewer than six joints and poses
            are wanted, or more than six.
    """
    if not re.fullmatch(NAME, name):
        raise InputError(
            "a program cannot be called so in every language",
            where="name",
            came=name,
            allowed="a letter, then up to 31 letters, digits and underscores",
        )
    count = len(robot.joints)
    if count > _AXES or (targets == "poses" and count < _AXES):
        raise InputError(
            "programs are written for arms of six joints, or fewer with joint positions as targets",
            where=robot.name,
            came=f"{count} joints, targets: {targets}",
            cure="Take the CSV of the joint positions." if count > _AXES else "Write joint positions.",
        )
    rows = _chosen(path.motion.time, path.planned.section, spacing)
    joints = path.joints[path.best][rows]
    time = path.motion.time[rows]
    apart = np.diff(path.planned.trajectory.distance[rows], prepend=0.0)
    durations = np.concatenate([[0.0], np.diff(time)])
    poses, branches = None, None
    if targets == "poses":
        position, rotation = path.nominal.forward(joints, frame="controller")
        poses = homogeneous(rotation, position)
        rule = branch_rule(path.nominal)
        if rule is not None:
            branches = tuple(rule.numbers(path.nominal.forward_kinematics(joints)).tolist())
    return NewProgram(
        name,
        robot.name,
        robot.controller.from_model(joints),
        tuple(joint.kind == "prismatic" for joint in robot.joints),
        poses,
        branches,
        durations,
        np.divide(apart, durations, out=np.zeros_like(apart), where=durations > 0.0),
        apart,
        path.calibrated,
        _beside(path, rows, straight=targets == "poses"),
        robot.simulated,
    )


def _chosen(time: Array, section: NDArray[np.intp], spacing: float) -> NDArray[np.intp]:
    """Return the samples that become targets: the first, the ends of sections, and others about `spacing` apart."""
    ends = [*np.flatnonzero(np.diff(section)).tolist(), len(time) - 1]
    chosen = [0]
    for end in ends:
        first = chosen[-1]
        pieces = min(max(1, math.ceil(float(time[end] - time[first]) / spacing - 1e-6)), end - first)
        wanted = np.linspace(time[first], time[end], pieces + 1)[1:]
        rows = first + 1 + np.abs(time[first + 1 : end + 1, None] - wanted).argmin(axis=0)
        chosen += np.unique(rows).tolist()
    return np.array(chosen)


def _beside(path: CorrectedPath, rows: NDArray[np.intp], *, straight: bool) -> float:
    """Return how far a program leaves the path between its targets [m], its corners not rounded off.

    Args:
        rows: The samples that are targets.
        straight: Whether the tip goes straight from one to the next, or all joints evenly.
    """
    travelled, position = path.planned.trajectory.distance, path.planned.trajectory.position

    def between(values: Array) -> Array:
        return np.column_stack([np.interp(travelled, travelled[rows], column) for column in values[rows].T])

    if straight:
        went = between(position)
        meant = position
    else:
        joints = path.joints[path.best]
        tip = Tip(path.nominal, TIP)
        went = tip.positions(between(joints))
        meant = tip.positions(joints)
    apart = went - meant
    along = np.gradient(meant, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    return float(np.linalg.norm(apart - (apart * along).sum(axis=1, keepdims=True) * along, axis=1).max())
