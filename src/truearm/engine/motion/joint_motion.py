"""From the motion of the tip to the motion of the joints.

The joint positions follow the path sample by sample with Newton's steps, on the branch on which they begin. Where the
arm has more joints than the task has rows, they stay as near to the starting posture as the path lets them
(:mod:`truearm.engine.robot.inverse.redundancy_resolution`), so that a closed path ends with the joint positions it
began with. Velocities and accelerations are exact derivatives of the joint positions, not differences of samples.

The robot's geometry counts, its joint effects do not: the motion is what is commanded, and what effects make of it is
for compensation to correct.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from truearm.engine.base.errors import InputError, counted
from truearm.engine.base.units import SHOWN_AS, from_si
from truearm.engine.motion.paths import Trajectory
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branch_search import beyond_limits
from truearm.engine.robot.inverse.kinematics import NEAR_SINGULAR, inverse, reach
from truearm.engine.robot.inverse.pose_solver import Orientation, PoseStatus
from truearm.engine.robot.inverse.redundancy_resolution import chosen_rows, step, velocity_and_acceleration
from truearm.engine.robot.postures import Postures, approach_of
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rotation_vector


@dataclass(frozen=True, eq=False)
class TipState:
    """Where the tip is at some configurations, in the robot's base frame."""

    position: Array  #: [m], ``(n, 3)``.
    rotation: Array  #: ``(n, 3, 3)``.
    #: Linear and then angular velocity by the true joint variables [m, rad per rad or m], ``(n, 6, joints)``.
    jacobian: Array


class Tip:
    """The flange of a robot, or a target on it.

    Args:
        robot: With the parameter values and effects that shall hold.
        target: Name of the target; the flange if None.
    """

    def __init__(self, robot: Robot, target: str | None = None) -> None:
        if target is not None:
            robot.target(target)  # refuses an unknown one
        self.robot, self.target = robot, target
        base = robot.base
        self._rotation, self._origin = base.rotation, np.array(base.translation)

    def at(self, q: Array | Postures) -> TipState:
        """Return where the tip is with joint positions ``(n, joints)`` [rad or m], or in postures."""
        kinematics = self.robot.forward_kinematics(q, self.target)
        linear, angular = kinematics.jacobians(self.robot.moving[: len(self.robot.joints)])  # (joints, 3, n)
        to_base = self._rotation.T
        return TipState(
            (kinematics.position.T - self._origin) @ self._rotation,
            to_base @ kinematics.matrix(),
            np.concatenate([to_base @ part.transpose(2, 1, 0) for part in (linear, angular)], axis=1),
        )

    def moved(self, q: Array) -> tuple[Array, Array]:
        """Return positions ``(n, 3)`` [m] and their derivatives by the joint positions ``(n, 3, joints)`` alone."""
        position, linear = self.robot.moved_point(q, self.target)
        return (position - self._origin) @ self._rotation, self._rotation.T @ linear

    def positions(self, q: Array | Postures) -> Array:
        """Return positions alone, ``(n, 3)`` [m]."""
        position = self.robot.forward_kinematics(q, self.target).position
        return np.asarray((position.T - self._origin) @ self._rotation)


#: The steps at one sample end when one is this short [rad, reach lengths]: the next would be its square.
_SHORT: Final = 1e-8
_MOST_STEPS: Final = 20
#: Between two samples no joint goes further beside its course than this [rad, reach lengths].
_JUMP: Final = 0.3


@dataclass(frozen=True, eq=False)
class JointMotion:
    """Joint positions over time."""

    time: Array  #: [s], ``(n,)``.
    joints: Array  #: joints, velocity, acceleration: [rad or m], per s and per s^2, ``(n, joints)``.
    velocity: Array
    acceleration: Array
    #: How little the tip moves with a joint motion of norm 1, positions in reach lengths, ``(n,)``; 0 in a singular
    #: posture.
    singular_value: Array
    joint_names: tuple[str, ...]  #: As the robot has them.

    def postures(self, joints: Array | None = None) -> Postures:
        """Return the postures of this motion, or of other joint positions ``(n, joints)`` with the same rates."""
        approach = approach_of(self.joints, np.arange(len(self.time)))
        return Postures(self.joints if joints is None else joints, self.velocity, self.acceleration, approach)


def joint_motion(
    robot: Robot,
    trajectory: Trajectory,
    *,
    target: str | None = None,
    orientation: Orientation = "free",
    rotation: ArrayLike | None = None,
    seed: ArrayLike | None = None,
) -> JointMotion:
    """Return the joint motion that brings the flange, or a target, along a trajectory.

    Args:
        robot: Its geometry counts, its joint effects do not.
        trajectory: In the robot's base frame.
        target: Name of the target that shall move so; the flange if None.
        orientation: ``free`` if only the position counts, ``axis`` if the tip's z axis shall keep its direction,
            ``full`` if the tip shall keep its whole orientation.
        rotation: The orientation to keep, in the base frame, ``(3, 3)``; not needed where it is free.
        seed: Joint positions ``(joints,)`` [rad or m] near which the motion shall begin; zero if None.

    Raises:
        InputError: If the motion cannot start, leaves the reach or the limits, or comes to a singular posture: with the
            place on the path, the time, and the joint.
    """
    return _Follower(robot, trajectory, target, orientation, rotation).motion(seed)


class _Follower:
    def __init__(
        self,
        robot: Robot,
        trajectory: Trajectory,
        target: str | None,
        orientation: Orientation,
        rotation: ArrayLike | None,
    ) -> None:
        self._robot, self._path, self._orientation = replace(robot, effect_names=()), _checked(trajectory), orientation
        self._tip = Tip(self._robot, target)
        self._travelled = trajectory.distance
        self._rotation = _orientation_to_keep(orientation, rotation)
        length = reach(self._robot, target)
        self._rows = chosen_rows(orientation, self._rotation, length)
        self._scale = np.array([length if joint.kind == "prismatic" else 1.0 for joint in robot.joints])
        self._names = tuple(joint.name for joint in robot.joints)
        self._spare = len(robot.joints) > len(self._rows)
        if len(self._rows) > len(robot.joints):
            raise InputError(
                "the arm has too few joints to keep this orientation along a path",
                where=robot.name,
                came=f"{counted(len(robot.joints), 'joint')}, orientation '{orientation}'",
                cure="Leave the orientation free, or keep the axis alone.",
            )

    def motion(self, seed: ArrayLike | None) -> JointMotion:
        """Return the motion that begins near `seed`."""
        joints = self._followed(self._start(seed))
        J = self._tip.at(joints).jacobian * self._scale
        away = (joints - joints[0]) / self._scale
        still = np.zeros((len(joints), 3))
        twist, change = (
            np.concatenate([part, still], axis=1) for part in (self._path.velocity, self._path.acceleration)
        )
        velocity, acceleration = velocity_and_acceleration(self._rows, J, away, twist, change)
        weakest = np.linalg.svd(self._rows @ J, compute_uv=False)[:, -1]
        return JointMotion(
            self._path.time, joints, velocity * self._scale, acceleration * self._scale, weakest, self._names
        )

    def _start(self, seed: ArrayLike | None) -> Array:
        """Return joint positions for the first sample."""
        joint_solutions = inverse(
            self._robot,
            self._path.position[:1],
            None if self._orientation == "free" else self._rotation[None],
            target=self._tip.target,
            orientation=self._orientation,
            seed=seed,
        )
        if joint_solutions.status[0] in (PoseStatus.UNREACHABLE, PoseStatus.BEYOND_LIMIT):
            raise InputError(
                "the motion cannot start",
                where=self._place(0),
                came=joint_solutions.advice(0).rstrip("."),
                cure=None
                if self._orientation == "free"
                else "With a free orientation the arm has fewer conditions to meet.",
            )
        return np.asarray(joint_solutions.joints[0])

    def _followed(self, start: Array) -> Array:
        """Return joint positions for every sample, or refuse the first one that has none."""
        scaled = np.empty((len(self._path.time), len(start)))
        scaled[0] = start / self._scale
        side = 0.0
        for k, time in enumerate(self._path.time):
            guess = scaled[max(k - 1, 0)]
            if k > 1:
                last, before = self._path.time[k - 1], self._path.time[k - 2]
                guess = guess + (scaled[k - 1] - scaled[k - 2]) * (time - last) / (last - before)
            solution = self._solved(k, guess, scaled[0])
            if solution is None:
                raise InputError(
                    "the arm cannot follow the path any further: it leaves the reach, or comes to a singular posture"
                    + (", or, with joints to spare, to the end of the postures near the first" if self._spare else ""),
                    where=self._place(k),
                    came=f"orientation '{self._orientation}'",
                    cure=self._cure("Move the path towards the arm", "start elsewhere (`seed_joints`)"),
                )
            scaled[k], A = solution
            self._check_limits(k, scaled[k] * self._scale)
            side = self._check_regular(k, A, side)
            jump = np.abs(scaled[k] - guess)
            if k and jump.max() > _JUMP:
                raise InputError(
                    "a joint would have to jump",
                    where=self._place(k),
                    came=f"{self._names[int(jump.argmax())]} by {math.degrees(jump.max()):.3g} deg",
                    cure="Take shorter steps in time. If it still jumps, move the path away from singular postures.",
                )
        return np.asarray(scaled * self._scale)

    def _solved(self, k: int, guess: Array, posture: Array) -> tuple[Array, Array] | None:
        """Return scaled joint positions for a sample, and the rows of its Jacobian; None if the steps do not end."""
        q = guess.copy()
        for _ in range(_MOST_STEPS):
            state = self._tip.at((q * self._scale)[None])
            J = state.jacobian * self._scale
            turn = np.zeros(3)
            if self._orientation == "axis":
                turn = np.cross(state.rotation[0, :, 2], self._rotation[:, 2])
            elif self._orientation == "full":
                turn = rotation_vector(self._rotation @ state.rotation[0].T)
            missing = self._rows @ np.concatenate([self._path.position[k] - state.position[0], turn])
            try:
                move = step(self._rows, J, (q - posture)[None], missing[None])[0]
            except np.linalg.LinAlgError:
                return None
            longest = float(np.abs(move).max())
            q = q + move * min(1.0, _JUMP / max(longest, _JUMP))
            if longest < _SHORT:
                return q, self._rows @ J[0]
        return None

    def _check_limits(self, k: int, joints: Array) -> None:
        beyond = np.flatnonzero(beyond_limits(self._robot, joints))
        if not len(beyond):
            return
        joint = self._robot.joints[beyond[0]]
        unit = SHOWN_AS["m" if joint.kind == "prismatic" else "rad"]
        low, high = (from_si(limit, unit) for limit in joint.limits or (-math.inf, math.inf))
        raise InputError(
            "the path takes a joint beyond its limits",
            where=self._place(k),
            came=f"{joint.name} at {from_si(float(joints[beyond[0]]), unit):.5g} {unit}",
            allowed=f"{low:g} to {high:g} {unit}",
            cure="Start on another branch (`seed_joints`), or move the path.",
        )

    def _check_regular(self, k: int, A: Array, side: float) -> float:
        """Refuse a singular posture at or before sample `k`; return the side of it on which the arm is."""
        _, values, motions = np.linalg.svd(A, full_matrices=False)
        sign = float(np.sign(np.linalg.det(A))) if A.shape[0] == A.shape[1] else 0.0
        if values[-1] >= NEAR_SINGULAR and sign * side >= 0:
            return sign
        fastest = int(np.abs(motions[-1]).argmax())
        raise InputError(
            "the path passes a singular posture",
            where=self._place(k),
            came=f"{self._names[fastest]} would have to move fastest",
            cure=self._cure("Move the path", "start on another branch (`seed_joints`)"),
        )

    def _cure(self, *ways: str) -> str:
        """Return what to do; an orientation that is free already cannot be freed more."""
        ways = ways if self._orientation == "free" else (*ways, "free more of the orientation")
        return f"{', '.join(ways[:-1])}, or {ways[-1]}."

    def _place(self, k: int) -> str:
        return f"{self._travelled[k] * 1e3:.1f} mm along the path, at {self._path.time[k]:.4g} s (sample {k})"


def _checked(trajectory: Trajectory) -> Trajectory:
    count = len(trajectory.time)
    if count == 0 or not (np.isfinite(trajectory.time).all() and (np.diff(trajectory.time) > 0).all()):
        raise InputError("times do not rise, or there are none", where="trajectory", came=counted(count, "sample"))
    for name in ("position", "velocity", "acceleration"):
        values = getattr(trajectory, name)
        if values.shape != (count, 3) or not np.isfinite(values).all():
            raise InputError(
                "a trajectory needs three finite coordinates for every time",
                where=f"trajectory, {name}",
                came=f"an array of shape {values.shape}" if values.shape != (count, 3) else "NaN or infinity",
                allowed=f"({count}, 3)",
            )
    return trajectory


def _orientation_to_keep(orientation: Orientation, rotation: ArrayLike | None) -> Array:
    if orientation not in ("free", "axis", "full"):
        raise InputError("there is no such choice", where="orientation", came=orientation, allowed="free, axis, full")
    if rotation is None:
        if orientation != "free":
            raise InputError(
                "no orientation is given to keep",
                where="rotation",
                allowed="a rotation matrix, (3, 3)",
                cure="Give it, or leave the orientation free.",
            )
        return np.eye(3)
    R = np.asarray(rotation, float)
    if R.shape != (3, 3):
        raise InputError("the array has the wrong shape", where="rotation", came=str(R.shape), allowed="(3, 3)")
    return R
