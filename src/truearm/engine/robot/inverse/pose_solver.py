"""Damped Newton for many poses at once: joint variables that bring the tip of a robot to given poses.

The step is Levenberg's, with a damping that follows the squared error (Sugihara, "Solvability-unconcerned inverse
kinematics by the Levenberg-Marquardt method", IEEE Trans. Robotics 27, 2011): far away or beyond the reach it is a
careful descent that ends at the nearest pose, and near a solution it is Newton's own step. Every pose has a damping of
its own, and those that are done leave the computation.

The steps are in the true joint variables, by which the joints turn and not what they read. The loads follow from them,
so that what turns a joint about its own axis need not be known here: the arm is rigid. Tilts across the axes are found
anew where a step has led, from the loads of the arm as it was tilted before. How they change is foreseen only by late
steps: near singular postures, where it matters, the others would not end.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import as_html, counted, short_text
from truearm.engine.robot.chain import Array, ForwardKinematics
from truearm.engine.robot.loads import settled
from truearm.engine.robot.transform import cross, dot

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot


#: ``full``; ``axis``, the direction of the tip's z axis alone; ``free``, the position alone.
Orientation = Literal["full", "axis", "free"]
ORIENTATIONS: Final = ("full", "axis", "free")

#: Where a pose counts as met and the steps end [reach lengths, rad].
CONVERGED: Final = 1e-12
#: A gradient this small beside the error is that of a nearest pose.
_LEVEL_GRADIENT: Final = 1e-6
#: Largest change of a joint in one step [rad, reach lengths].
_LONGEST_STEP: Final = 0.5
#: Keeps the normal matrix of a singular arm invertible; what it takes from a step is far below a tenth.
_FLOOR: Final = 1e-15
#: Steps at most, and where many starts are tried for one branch: what comes near at all is there in half as many.
MOST_STEPS: Final = 60
BOLD_STEPS: Final = 20
STEPS_OF_MANY: Final = 30
#: Steps before the change of tilts is foreseen; without tilts nearly all poses are met by then.
_STEPS_WITHOUT_TILTS: Final = 8
#: Of joints, to find how the tilts follow them [rad, m].
_DIFFERENCE: Final = 1e-6
_DAMPING: Final = (1e-6, 1e12)


@dataclass(frozen=True, eq=False)
class PoseTask:
    """Poses the tip of a robot shall have, in the world."""

    robot: Robot  #: With its parameter values and joint effects.
    target: str | None  #: Name of the target that is the tip; the flange if None.
    orientation: Orientation  #: How much of the orientation counts.
    position: Array  #: [m], ``(3, n)``.
    rotation: tuple[Array, Array, Array]  #: Columns of the rotation matrix, each ``(3, n)``.
    length: float  #: Reach of the arm [m]: an error as long as this weighs as much as one of 1 rad.

    def of(self, rows: NDArray[np.intp]) -> PoseTask:
        """Return the task of some poses, which may be repeated."""
        x, y, z = (column[:, rows] for column in self.rotation)
        return replace(self, position=self.position[:, rows], rotation=(x, y, z))

    def error(self, kinematics: ForwardKinematics) -> Array:
        """Return what is missing in position [reach lengths] and orientation [rad], ``(n, 3, 5 or 6)``."""
        away = (self.position - kinematics.position) / self.length
        if self.orientation == "free":
            return away.T
        x, y, z = kinematics.rotation
        if self.orientation == "axis":
            turn = _turned(cross(z, self.rotation[2]), dot(z, self.rotation[2]), x)
            return np.concatenate([away, dot(turn, x)[None], dot(turn, y)[None]]).T
        pairs = list(zip(kinematics.rotation, self.rotation, strict=True))
        sine = 0.5 * sum((cross(reached, wanted) for reached, wanted in pairs), np.zeros(()))
        cosine = 0.5 * (sum((dot(reached, wanted) for reached, wanted in pairs), np.zeros(())) - 1.0)
        return np.concatenate([away, _turned(sine, cosine, x)]).T

    def distances(self, error: Array) -> tuple[Array, Array]:
        """Return the size of errors in position [m] and in orientation [rad], which is 0 if it is free."""
        position, angle = (np.linalg.norm(part, axis=1) for part in (error[:, :3], error[:, 3:]))
        return np.asarray(position * self.length), np.asarray(angle)

    def jacobian(self, kinematics: ForwardKinematics, tilting: Array | None = None) -> Array:
        """Return how position and orientation follow the true joint variables, ``(n, 3, 5 or 6, joints)``.

        A sliding joint is counted in reach lengths, a turning one in rad. Tilts are held, or follow as `tilting` says.
        """
        joints = self.robot.joints
        linear, angular = kinematics.jacobians(self.robot.moving[: len(joints)])  # (joints, 3, n)
        if tilting is not None:
            across = self.robot.moving[len(joints) : 3 * len(joints)]
            for by_joint, by_tilt in zip((linear, angular), kinematics.jacobians(across), strict=True):
                by_joint += np.einsum("tjn,tcn->jcn", tilting, by_tilt)
        rows = [linear / self.length]
        if self.orientation == "full":
            rows.append(angular)
        elif self.orientation == "axis":
            x, y, _ = kinematics.rotation
            rows.append(np.stack([(angular * x).sum(1), (angular * y).sum(1)], axis=1))
        whole = np.concatenate(rows, axis=1)
        sliding = [i for i, joint in enumerate(joints) if joint.kind == "prismatic"]
        whole[sliding] *= self.length
        return np.ascontiguousarray(whole.transpose(2, 1, 0))

    def variables(self, joints: Array) -> Array:
        """Return the variables ``(joints or more, n)`` of the arm with its joints ``(n, joints)`` turned so."""
        return self.standing(joints)[0]

    def standing(self, joints: Array) -> tuple[Array, Array]:
        """Return these variables, and the joint positions behind them ``(joints, n)``."""
        straight = self.robot.without_deflections(joints.T)
        if not self.robot.tilts:
            return straight, joints.T
        count = len(straight)

        def tilted(_: NDArray[np.intp], both: Array) -> Array:
            return np.concatenate(self.robot.tilted(both[:count], both[count:]))

        both = settled(tilted, np.concatenate([straight, joints.T]))
        return both[:count], both[count:]

    def tilting(self, variables: Array, behind: Array) -> Array | None:
        """Return how the tilts follow the joints, ``(tilts, joints, n)``, by differences; None if nothing tilts."""
        count = len(self.robot.joints)
        if len(variables) == count:
            return None
        moved, joints = (np.repeat(part[:, None, :], count + 1, axis=1) for part in (variables, behind))
        for i in range(count):
            moved[i, i] += _DIFFERENCE
            joints[i, i] += _DIFFERENCE
        tilted, _ = self.robot.tilted(moved.reshape(len(variables), -1), joints.reshape(count, -1))
        tilts = tilted.reshape(moved.shape)[count : 3 * count]
        return np.asarray((tilts[:, :count] - tilts[:, count:]) / _DIFFERENCE)

    def forward_kinematics(self, variables: Array) -> ForwardKinematics:
        """Run through the chain to the tip."""
        return self.robot.forward_kinematics_of(variables, self.target)

    def advanced(self, variables: Array, behind: Array, step: Array) -> tuple[Array, Array]:
        """Return variables, and joint positions behind, after a step ``(n, joints)``, a sliding one's in reach lengths.

        Without tilts nothing is asked of what is behind.
        """
        way = step.T.copy()
        way[[joint.kind == "prismatic" for joint in self.robot.joints]] *= self.length
        moved = variables.copy()
        moved[: len(way)] += way
        return self.robot.tilted(moved, behind + way) if self.robot.tilts else (moved, behind)


@dataclass(frozen=True, eq=False)
class Solved:
    """Where the steps of many poses ended."""

    variables: Array  #: [rad or m], ``(joints or more, n)``.
    error: Array  #: As :meth:`PoseTask.error` gives it.

    @property
    def size(self) -> Array:
        """Norm of the error, ``(n,)``."""
        return np.asarray(np.linalg.norm(self.error, axis=1))


def solve(task: PoseTask, starts: Array, *, bold: bool = False, most: int = MOST_STEPS) -> Solved:
    """Go from starts to the poses of a task, or as near to them as can be.

    Args:
        starts: What the joints have turned by, for each pose [rad or m], ``(n, joints)``.
        bold: Whether a step is taken even if the error grows, undamped. Along a bent valley near a singular posture
            that is faster by far, and it ends anywhere if there is no solution.
        most: Steps at most.
    """
    part = task
    current, behind = task.standing(starts)
    solution, damping = current.copy(), np.ones(len(starts))
    kinematics = part.forward_kinematics(current)
    e, jacobian = part.error(kinematics), part.jacobian(kinematics)
    error, active = e.copy(), np.arange(len(starts))
    for number in range(most):
        size = np.linalg.norm(e, axis=1)
        gradient = np.linalg.norm((jacobian * e[:, :, None]).sum(1), axis=1)
        going = (
            (size > CONVERGED) & (gradient > _LEVEL_GRADIENT * size * np.minimum(size, 1.0)) & (damping < _DAMPING[1])
        )
        if not going.all():
            active, current, behind = active[going], current[:, going], behind[:, going]
            e, jacobian = e[going], jacobian[going]
            damping, size, part = damping[going], size[going], part.of(np.flatnonzero(going))
        if not len(active):
            break
        step = _step(jacobian, e, _FLOOR + (0.0 if bold else damping) * size**2)
        tried, tried_behind = part.advanced(current, behind, step)
        kinematics = part.forward_kinematics(tried)
        tried_error = part.error(kinematics)
        better = (np.linalg.norm(tried_error, axis=1) < size) | bold
        damping = np.where(better, np.maximum(damping / 5, _DAMPING[0]), damping * 10)
        current, behind = np.where(better, tried, current), np.where(better, tried_behind, behind)
        e = np.where(better[:, None], tried_error, e)
        tilting = part.tilting(tried, tried_behind) if number >= _STEPS_WITHOUT_TILTS else None
        jacobian = np.where(better[:, None, None], part.jacobian(kinematics, tilting), jacobian)
        solution[:, active], error[active] = current, e
    return Solved(solution, error)


def smallest_singular_value(task: PoseTask, variables: Array) -> Array:
    """Return, for each pose, how little it moves with a joint motion of norm 1 [reach lengths or rad], ``(n,)``.

    The motion of a redundant arm that leaves the pose as it is does not count.
    """
    if not variables.shape[1]:
        return np.zeros(0)
    return np.asarray(np.linalg.svd(task.jacobian(task.forward_kinematics(variables)), compute_uv=False)[:, -1])


def weakest_motion(task: PoseTask, variables: Array) -> tuple[Array, Array]:
    """Return the :func:`smallest_singular_value` of each pose and its joint motion ``(n, joints)``."""
    if not variables.shape[1]:
        return np.zeros(0), np.zeros((0, len(task.robot.joints)))
    _, values, motions = np.linalg.svd(task.jacobian(task.forward_kinematics(variables)), full_matrices=False)
    return values[:, -1], motions[:, -1]


def _step(jacobian: Array, error: Array, damping: Array) -> Array:
    """Return the damped least-squares step, by the smaller of the two normal matrices, and not too long."""
    transposed = jacobian.swapaxes(1, 2)
    rows, columns = jacobian.shape[1:]
    if rows <= columns:
        normal = jacobian @ transposed + damping[:, None, None] * np.eye(rows)
        step = (transposed @ np.linalg.solve(normal, error[:, :, None]))[:, :, 0]
    else:
        normal = transposed @ jacobian + damping[:, None, None] * np.eye(columns)
        step = np.linalg.solve(normal, transposed @ error[:, :, None])[:, :, 0]
    longest = np.abs(step).max(axis=1, keepdims=True)
    shortened: Array = step * np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, _LONGEST_STEP))
    return shortened


def _turned(sine: Array, cosine: Array, across: Array) -> Array:
    """Return the rotation vector [rad] ``(3, n)`` from its axis times the sine and the cosine of its angle.

    Half a turn away the axis is lost, and `across` serves: any way will do from there.
    """
    size = np.sqrt(dot(sine, sine))
    angle = np.arctan2(size, cosine)
    lost = (size < 1e-9) & (cosine < 0)
    vector = sine * np.where(size > 1e-9, angle / np.maximum(size, 1e-9), 1.0)
    return np.where(lost, np.pi * across, vector)


#: Poses explained one by one where a person looks at the solutions.
_EXPLAINED: Final = 5


class PoseStatus(Enum):
    """How the search for a pose ended; the value is the word in files, `advice` what to do."""

    REACHED = "reached"
    NEAR_SINGULAR = "near-singular"
    BEYOND_LIMIT = "beyond-limit"
    BRANCH_LOST = "branch-lost"
    UNREACHABLE = "unreachable"

    @property
    def usable(self) -> bool:
        """Whether the robot can go there with these joints."""
        return self in (PoseStatus.REACHED, PoseStatus.NEAR_SINGULAR)

    @property
    def advice(self) -> str:
        """What it means and what to do about it."""
        return {
            PoseStatus.REACHED: "The joints give the pose.",
            PoseStatus.NEAR_SINGULAR: "The joints give the pose, but near a singular posture, where a small change "
            "of the pose takes a large motion of the joints: go there by joint motion, or move the pose.",
            PoseStatus.BEYOND_LIMIT: "The joints give the pose, but a joint is beyond its limits: take another branch, "
            "or move the pose.",
            PoseStatus.BRANCH_LOST: "The pose is reached on another branch, whose joints are given, and not on the one "
            "asked for: take that one, or move the pose.",
            PoseStatus.UNREACHABLE: "No joints give the pose; the joints given are the nearest that were found: move "
            "the pose, and check its frame, its units and the target.",
        }[self]


@dataclass(frozen=True, eq=False, repr=False)
class JointSolutions:
    """Joint positions for poses, one row a pose, or one a pose and branch where all branches were asked for."""

    poses: int  #: How many poses were asked for.
    pose: NDArray[np.intp]  #: Index of each row's pose, ascending, ``(rows,)``. Every pose has at least one row.
    joints: Array  #: Joint positions [rad or m], ``(rows, joints)``.
    status: tuple[PoseStatus, ...]  #: How each search ended.
    branch: tuple[str, ...]  #: Name of the branch of each row; empty where the robot's branches have no names.
    position_error: Array  #: Distance from the pose asked for [m], ``(rows,)``.
    #: Angle from it [rad], ``(rows,)``; between the z axes where only those count, NaN where no orientation does.
    orientation_error: Array
    beyond: NDArray[np.bool_]  #: Which joint positions are beyond their limits, ``(rows, joints)``.
    #: How little the pose moves with a joint motion of norm 1, positions in reach lengths, ``(rows,)``. It is 0 in a
    #: singular posture.
    singular_value: Array
    joint_names: tuple[str, ...]  #: As the robot has them.

    def __repr__(self) -> str:
        counts = Counter(status.value for status in self.status)
        usable = len(set(self.pose[self.usable].tolist()))
        of_each = ", ".join(f"{count} {status}" for status, count in counts.items())
        lines = [f"{usable} of {counted(self.poses, 'pose')} can be reached ({of_each or 'none'})"]
        rows = np.flatnonzero(~self.usable)
        lines += [f"pose {self.pose[row]}: {self.advice(row)}" for row in rows[:_EXPLAINED]]
        lines += [f"and {len(rows) - _EXPLAINED} more"] if len(rows) > _EXPLAINED else []
        return short_text(lines)

    def _repr_html_(self) -> str:
        return as_html(repr(self))

    def without_unreached(self) -> JointSolutions:
        """Return the solutions with NaN for the joints of poses that are out of reach."""
        out = self.rows(PoseStatus.UNREACHABLE)
        joints = self.joints.copy()
        joints[out] = np.nan
        return replace(self, joints=joints)

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Which rows the robot can go to, ``(rows,)``."""
        return np.array([status.usable for status in self.status], dtype=bool)

    @property
    def complete(self) -> bool:
        """Whether every pose has a row the robot can go to."""
        return len(set(self.pose[self.usable].tolist())) == self.poses

    def rows(self, *wanted: PoseStatus) -> NDArray[np.intp]:
        """Return the rows that have one of these statuses."""
        return np.flatnonzero([status in wanted for status in self.status])

    def advice(self, row: int) -> str:
        """Say of one row what it means and what to do about it, with its figures."""
        status = self.status[row]
        if status is PoseStatus.UNREACHABLE:
            angle = self.orientation_error[row]
            turn = "" if math.isnan(angle) else f" and {math.degrees(angle):.4g} deg"
            missing = f"{self.position_error[row] * 1e3:.4g} mm{turn} are missing."
            if not np.isfinite(self.joints[row]).all():  # only answers that can be sent are given
                return f"{missing} No joints give the pose: move it, and check its frame, its units and the target."
            return f"{missing} {status.advice}"
        if status is PoseStatus.BEYOND_LIMIT:
            names = [name for name, beyond in zip(self.joint_names, self.beyond[row], strict=True) if beyond]
            return f"Beyond its limits: {', '.join(names)}. {status.advice}"
        if status is PoseStatus.BRANCH_LOST:
            return f"Reached on {self.branch[row]}. {status.advice}"
        return status.advice
