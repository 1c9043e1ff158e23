"""Candidates: joints that were found for poses, and the choice among them."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array
from truearm.modeling.inverse.branches import BRANCHES, BranchRule
from truearm.modeling.inverse.pose_solver import MOST_STEPS, PoseTask, solve
from truearm.modeling.inverse.turns import beyond_limits, nearest_turns

#: A pose is reached within this [m, rad].
REACHED: Final = 1e-9


class Candidates:
    """Joints found for the poses of a task, in as many ways as were tried.

    Args:
        task: The poses.
        seed: Joint positions that the answer of each pose shall lie near to [rad or m], ``(n, joints)``.
        rule: Of the robot's branches, where they have names.

    Attributes:
        pose: Index of the pose of each candidate, ``(candidates,)``; the other arrays have the same first axis.
        joints: Joint positions [rad or m], in the turn nearest to the seed within the limits.
        variables: What the joint positions turn the joints by, with tilts [rad or m], ``(joints or more, candidates)``.
        position_error, orientation_error: [m], [rad]; 0 where the orientation is free.
        reached: Whether both are zero within 1e-9.
        beyond: Which joints are beyond their limits.
        number: Of the branch; -1 without names.
    """

    def __init__(self, task: PoseTask, seed: Array, rule: BranchRule | None) -> None:
        self._task, self._seed, self._rule = task, seed, rule
        joints = seed.shape[1]
        self.pose: NDArray[np.intp] = np.zeros(0, dtype=np.intp)
        self.joints: Array = np.zeros((0, joints))
        self.variables: Array = task.robot.without_deflections(np.zeros((joints, 0)))
        self.position_error: Array = np.zeros(0)
        self.orientation_error: Array = np.zeros(0)
        self.reached: NDArray[np.bool_] = np.zeros(0, dtype=bool)
        self.beyond: NDArray[np.bool_] = np.zeros((0, joints), dtype=bool)
        self.number: NDArray[np.intp] = np.zeros(0, dtype=np.intp)

    def add(self, pose: NDArray[np.intp], starts: Array, *, bold: bool = False, most: int = MOST_STEPS) -> None:
        """Solve the poses with these indices and keep what comes out.

        Args:
            starts: What the joints have turned by [rad or m], ``(candidates, joints)``.
            bold: Whether steps need not come nearer.
            most: Steps at most.
        """
        if not len(pose):
            return
        robot, part = self._task.robot, self._task.of(pose)
        solved = solve(part, starts, bold=bold, most=most)
        variables, error = solved.variables, solved.error
        joints = robot.joints_of(variables)
        turns = nearest_turns(robot, joints, self._seed[pose]) - joints
        changed = np.flatnonzero((np.abs(turns) > 1.0).any(axis=1))
        # A whole turn on, the arm stands as it stood; a joint effect (a gain) need not be the same there.
        variables[: joints.shape[1], changed] += turns[changed].T
        joints[changed] = robot.joints_of(variables[:, changed])
        position, angle = part.distances(error)
        number = np.full(len(pose), -1)
        if self._rule is not None:
            number = self._rule.numbers(part.forward_kinematics(variables))
        self.pose = np.concatenate([self.pose, pose])
        self.joints = np.concatenate([self.joints, joints])
        self.variables = np.concatenate([self.variables, variables], axis=1)
        self.position_error = np.concatenate([self.position_error, position])
        self.orientation_error = np.concatenate([self.orientation_error, angle])
        self.reached = np.concatenate([self.reached, (position <= REACHED) & (angle <= REACHED)])
        self.beyond = np.concatenate([self.beyond, beyond_limits(robot, joints)])
        self.number = np.concatenate([self.number, number])

    def satisfied(self, wanted: int | None) -> NDArray[np.bool_]:
        """Return which poses are reached, on the branch wanted, or else within the limits, ``(n,)``."""
        good = self.reached & (~self.beyond.any(axis=1) if wanted is None else self.number == wanted)
        return self._any(good)

    def away(self) -> Array:
        """Return how far the nearest joints that give each pose within the limits are from the seed, ``(n,)``.

        The largest difference of a joint counts [rad or m]; infinite where no joints do.
        """
        good = self.reached & ~self.beyond.any(axis=1)
        nearest = np.full(len(self._seed), np.inf)
        np.minimum.at(nearest, self.pose[good], np.abs(self.joints - self._seed[self.pose]).max(axis=1)[good])
        return nearest

    def found(self) -> NDArray[np.bool_]:
        """Return which branches reach which poses, ``(n, 8)``."""
        found = np.zeros((len(self._seed), len(BRANCHES)), dtype=bool)
        found[self.pose[self.reached], self.number[self.reached]] = True
        return found

    def best(self, wanted: int | None) -> NDArray[np.intp]:
        """Return the one candidate of each pose to answer with, in the order of the poses."""
        return self._first(self.pose, self._order(wanted))

    def every_branch(self) -> NDArray[np.intp]:
        """Return the best candidate of each branch that reaches its pose; of a pose out of reach the nearest one."""
        order = self._order(None)
        reachable = self._any(self.reached)
        group = np.where(self.reached, self.pose * len(BRANCHES) + self.number, self.pose * len(BRANCHES))
        order = order[self.reached[order] | ~reachable[self.pose[order]]]
        return self._first(group, order)

    def _order(self, wanted: int | None) -> NDArray[np.intp]:
        """Return the candidates with the better ones first."""
        away = np.abs(self.joints - self._seed[self.pose]).max(axis=1)
        missed = self.position_error / self._task.length + self.orientation_error
        keys = (
            away,
            np.where(self.reached, 0.0, missed),
            self.beyond.any(axis=1),
            np.zeros(len(away), dtype=bool) if wanted is None else self.number != wanted,
            ~self.reached,
        )
        return np.lexsort(keys)

    @staticmethod
    def _first(group: NDArray[np.intp], order: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return the first of each group in an order, groups ascending."""
        _, index = np.unique(group[order], return_index=True)
        return np.asarray(order[index])

    def _any(self, good: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return which poses have such a candidate, ``(n,)``."""
        found = np.zeros(len(self._seed), dtype=bool)
        found[self.pose[good]] = True
        return found
