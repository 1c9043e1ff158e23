"""Fake targets: what to write into a program so that the real robot goes where it says (Nubiola, 1.5).

The controller believes in the nominal robot. It is sent to another pose: the one the nominal robot would have with the
joint positions with which the calibrated robot reaches the wanted one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branches import BRANCHES, BranchRule, branch_rule
from truearm.engine.robot.inverse.kinematics import inverse, inverse_beside
from truearm.engine.robot.inverse.pose_solver import JointSolutions, PoseStatus
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import homogeneous
from truearm.engine.robot.ur_kinematics import controller_robot

#: Poses looked at together: what is computed of them on the way stays in the processor's cache.
AT_ONCE: Final = 5000
#: Where a joint moves farther from the nominal position [rad or m], the answer is looked for everywhere.
_BESIDE: Final = 0.1

_OnBranch = Callable[[JointSolutions, NDArray[np.intp]], NDArray[np.bool_]]


def nominal_robot(robot: Robot) -> Robot:
    """Return the robot that the controller believes in: the table of the robot file, no joint effects, no base.

    However often the robot was calibrated, the rows of its joints stay what they were; what was identified stands in
    its parameters. A controller that computes with kinematics of its own, which are known, believes in those. The world
    of the nominal robot is its base frame.

    Raises:
        InputError: If the robot is its nominal self, so that there is nothing to correct.
    """
    nominal = _nominal(robot)
    controllers = controller_robot(nominal)
    if not robot.effect_names and (_same_arm(robot, nominal) or _same_arm(robot, controllers)):
        raise InputError(
            "this robot is not calibrated: all its parameters are nominal, or those of its controller",
            where=robot.name,
            cure="Give the calibrated.yaml of truearm calibrate; a converted robot has lost its nominal values.",
        )
    return controllers


def controllers_robot(robot: Robot) -> Robot:
    """Return the robot that the controller believes in, also of one that was not calibrated."""
    return controller_robot(_nominal(robot))


def _nominal(robot: Robot) -> Robot:
    return replace(
        robot, effect_names=(), wrench=None, base_quaternion=(1.0, 0.0, 0.0, 0.0), known={}, targets=(), fixtures=()
    )


def _same_arm(robot: Robot, other: Robot) -> bool:
    """Return whether an arm has the values of another one, wherever both stand."""
    inside = (name for name, p in other.parameters.items() if p.group != "base")
    return all(robot.values.get(name) == other.values[name] for name in inside)


@dataclass(frozen=True, eq=False)
class FakeTargets:
    """Fake targets, one a pose."""

    flange: Array  #: Where the nominal robot would have its flange in its base frame, ``(n, 4, 4)``: what to write.
    #: Joint positions of the calibrated robot for the wanted poses, one row a pose, and how each was found.
    solutions: JointSolutions

    @property
    def joints(self) -> Array:
        """Joint positions with which the calibrated robot reaches the wanted poses [rad or m], ``(n, joints)``."""
        return self.solutions.joints


def fake_targets(robot: Robot, flange: Array, near: Array) -> FakeTargets:
    """Return the fake targets of wanted poses.

    Args:
        robot: The calibrated robot, with its joint effects and payload.
        flange: Wanted poses of the flange in the identified base frame, ``(n, 4, 4)`` [m], at least one.
        near: Joint positions of the nominal robot at the wanted poses, ``(n, joints)`` [rad or m]: the answers are on
            the same branch and in the same turns.

    Raises:
        InputError: If the robot is not calibrated or an array has the wrong shape.
    """
    nominal, rule = nominal_robot(robot), branch_rule(robot)
    parts = []
    for first in range(0, len(flange), AT_ONCE):
        rows = np.arange(first, min(first + AT_ONCE, len(flange)))
        solutions = inverse_beside(robot, flange[rows, :3, 3], flange[rows, :3, :3], near[rows])
        if rule is not None:
            names = rule.numbers(nominal.forward_kinematics(solutions.joints))
            solutions = replace(solutions, branch=tuple(BRANCHES[number] for number in names.tolist()))
        parts.append((rows, solutions))
    solutions = _merged(parts, len(flange))
    far = np.abs(solutions.joints - near).max(axis=1) > _BESIDE
    if rule is not None:
        far |= solutions.branch != np.array(BRANCHES)[rule.numbers(nominal.forward_kinematics(near))]
    left = np.flatnonzero(far | [status is not PoseStatus.REACHED for status in solutions.status])
    parts = [(np.arange(len(flange)), solutions)]
    for first in range(0, len(left), AT_ONCE):
        rows = left[first : first + AT_ONCE]
        parts.append((rows, _looked_for(robot, nominal, rule, flange[rows], near[rows])))
    solutions = _merged(parts, len(flange))
    return FakeTargets(matrices(nominal, solutions.joints), solutions)


def _looked_for(robot: Robot, nominal: Robot, rule: BranchRule | None, flange: Array, near: Array) -> JointSolutions:
    """Return joint positions for poses that are not reached beside those of the nominal robot, or all but singular."""
    position, rotation = flange[:, :3, 3], flange[:, :3, :3]
    joint_solutions = inverse(robot, position, rotation, seed=near)
    if rule is None:
        return joint_solutions
    # The branch that counts is the controller's, of the nominal arm: next to a singular posture the calibrated arm may
    # call the same joints by another name. So the nearest joints are taken, and all branches looked through where they
    # are on another one.
    wanted_branch = rule.numbers(nominal.forward_kinematics(near))

    def on_branch(solutions: JointSolutions, rows: NDArray[np.intp]) -> NDArray[np.bool_]:
        return np.asarray(rule.numbers(nominal.forward_kinematics(solutions.joints)) == wanted_branch[rows])

    everyone = np.arange(len(flange))
    # What is out of reach was looked for on all branches already.
    reached = np.array([status is not PoseStatus.UNREACHABLE for status in joint_solutions.status], dtype=bool)
    missed = np.flatnonzero((~on_branch(joint_solutions, everyone) | ~joint_solutions.usable) & reached)
    if len(missed):
        again = inverse(robot, position[missed], rotation[missed], branch="all", seed=near[missed])
        joint_solutions = _better(joint_solutions, again, missed[again.pose], near, on_branch)
    reached = np.array([status is not PoseStatus.UNREACHABLE for status in joint_solutions.status], dtype=bool)
    lost = np.flatnonzero(~on_branch(joint_solutions, everyone) & reached)
    for number in np.unique(wanted_branch[lost]).tolist():
        rows = lost[wanted_branch[lost] == number]
        again = inverse(robot, position[rows], rotation[rows], branch=BRANCHES[number], seed=near[rows])
        joint_solutions = _better(joint_solutions, again, rows, near, on_branch)
    same = on_branch(joint_solutions, everyone)
    status = []
    for row, pose_status in enumerate(joint_solutions.status):
        if pose_status.usable and not same[row]:
            status.append(PoseStatus.BRANCH_LOST)
        elif pose_status is PoseStatus.BRANCH_LOST and same[row]:  # only the calibrated arm calls it otherwise
            status.append(PoseStatus.BEYOND_LIMIT if joint_solutions.beyond[row].any() else PoseStatus.NEAR_SINGULAR)
        else:
            status.append(pose_status)
    branch = tuple(
        BRANCHES[number] for number in rule.numbers(nominal.forward_kinematics(joint_solutions.joints)).tolist()
    )
    return replace(joint_solutions, status=tuple(status), branch=branch)


def fake_targets_of(robots: Sequence[Robot], robot_of_row: NDArray[np.intp], flange: Array, near: Array) -> FakeTargets:
    """Return the fake targets of wanted poses, for one calibrated robot with several loads.

    Args:
        robots: The robot with each load.
        robot_of_row: Index of the robot of each pose, ``(n,)``; `flange` and `near` as for :func:`fake_targets`.
    """
    fakes, parts = np.empty_like(flange), []
    for number in np.unique(robot_of_row).tolist():
        rows = np.flatnonzero(robot_of_row == number)
        fake = fake_targets(robots[number], flange[rows], near[rows])
        fakes[rows] = fake.flange
        parts.append((rows, fake.solutions))
    return FakeTargets(fakes, _merged(parts, len(flange)))


def _better(
    solutions: JointSolutions, again: JointSolutions, rows: NDArray[np.intp], near: Array, on_branch: _OnBranch
) -> JointSolutions:
    """Return solutions with others in their place that are on the branch where they are not, or can be used.

    Args:
        solutions: One solution a pose.
        again, rows: Others, and the pose of each.
        near: Joints to be near to, of every pose.
        on_branch: Whether solutions of poses are on the branch of these.
    """
    agrees, usable = on_branch(again, rows), again.usable
    away = np.abs(again.joints - near[rows]).max(axis=1)
    order = np.lexsort((away, ~usable, ~agrees, rows))
    best = order[np.unique(rows[order], return_index=True)[1]]
    current = _picked(solutions, rows[best])
    known, worked = on_branch(current, rows[best]), current.usable
    best = best[agrees[best] & ~(known & worked) & (usable[best] | ~known)]
    return _merged([(np.arange(len(near)), solutions), (rows[best], _picked(again, best))], len(near))


def _picked(solutions: JointSolutions, rows: NDArray[np.intp]) -> JointSolutions:
    """Return some solutions, one a pose."""
    return replace(
        solutions,
        poses=len(rows),
        pose=np.arange(len(rows)),
        joints=solutions.joints[rows],
        status=tuple(solutions.status[row] for row in rows.tolist()),
        branch=tuple(solutions.branch[row] for row in rows.tolist()),
        position_error=solutions.position_error[rows],
        orientation_error=solutions.orientation_error[rows],
        beyond=solutions.beyond[rows],
        singular_value=solutions.singular_value[rows],
    )


def _merged(parts: list[tuple[NDArray[np.intp], JointSolutions]], count: int) -> JointSolutions:
    """Return solutions ``(rows, solution of each)`` as those of all poses in their order; a later part counts more."""
    place, offset = np.zeros(count, dtype=int), 0
    for rows, _ in parts:
        place[rows] = offset + np.arange(len(rows))
        offset += len(rows)
    every = [solutions for _, solutions in parts]

    def joined(arrays: list[Array]) -> Array:
        return np.asarray(np.concatenate(arrays)[place])

    return JointSolutions(
        poses=count,
        pose=np.arange(count),
        joints=joined([s.joints for s in every]),
        status=tuple(np.concatenate([np.array(s.status, object) for s in every])[place].tolist()),
        branch=tuple(np.concatenate([np.array(s.branch, object) for s in every])[place].tolist()),
        position_error=joined([s.position_error for s in every]),
        orientation_error=joined([s.orientation_error for s in every]),
        beyond=np.concatenate([s.beyond for s in every])[place],
        singular_value=joined([s.singular_value for s in every]),
        joint_names=every[0].joint_names,
    )


def matrices(robot: Robot, joints: Array) -> Array:
    """Return poses ``(n, 4, 4)`` [m] of the flange of a robot whose base is the world."""
    position, rotation = robot.world_poses(joints)
    return homogeneous(rotation, position)
