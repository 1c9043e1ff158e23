"""From the branches of the nominal arm to those of the calibrated one.

Newton's steps from a nominal solution keep to its branch, unless a singular posture is as near as the calibration
errors move the arm; for random joints that is one pose in a hundred. A branch that the nominal arm lets expect and that
was not found is looked for again, first by fake targets, then across the singular posture.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branches import BRANCHES, BranchRule, ClosedForm
from truearm.engine.robot.inverse.pose_solver import (
    BOLD_STEPS,
    MOST_STEPS,
    STEPS_OF_MANY,
    PoseTask,
    solve,
    weakest_motion,
)
from truearm.engine.robot.transform import homogeneous

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot


_TURN: Final = 2 * np.pi
#: A joint this far beyond a limit still lies on it [rad or m].
_ON_LIMIT: Final = 1e-9


def limits(robot: Robot) -> tuple[Array, Array]:
    """Return lowest and highest position of each joint, ``(joints,)`` each; infinite where not known."""
    pairs = [joint.limits or (-np.inf, np.inf) for joint in robot.joints]
    low, high = np.array(pairs, float).T
    return low, high


def beyond_limits(robot: Robot, joints: Array, slack: float = _ON_LIMIT) -> NDArray[np.bool_]:
    """Return which joint positions ``(..., joints)`` lie beyond the limits by more than `slack` [rad or m]."""
    low, high = limits(robot)
    beyond: NDArray[np.bool_] = (joints < low - slack) | (joints > high + slack)
    return beyond


def nearest_turns(robot: Robot, joints: Array, seed: Array) -> Array:
    """Return the joint positions ``(n, joints)`` with every joint in the turn nearest to the seed within its limits.

    Where no turn lies within the limits, the one that passes them least is taken.

    Args:
        seed: ``(joints,)`` or ``(n, joints)`` [rad or m].
    """
    low, high = limits(robot)
    nearest = np.round((seed - joints) / _TURN)
    fewest = np.ceil((low - _ON_LIMIT - joints) / _TURN)
    most = np.floor((high + _ON_LIMIT - joints) / _TURN)
    # Without a turn within the limits, `most` ends below the lower and `fewest` above the upper limit.
    under, over = low - (joints + most * _TURN), joints + fewest * _TURN - high
    with np.errstate(invalid="ignore"):
        outside = np.where(under < over, most, fewest)
    turns = np.where(fewest <= most, np.clip(nearest, fewest, np.maximum(most, fewest)), outside)
    turning = np.array([joint.kind == "revolute" for joint in robot.joints])
    turned: Array = np.where(turning, joints + _TURN * turns, joints)
    return turned


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
        if len(changed) and any(effect.shifts for effect in robot.effects):  # an axis is elsewhere, if there is a gain
            again = solve(part.of(changed), variables[: joints.shape[1], changed].T, most=most)
            variables[:, changed], error[changed] = again.variables, again.error
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

    def reached_branches(self) -> NDArray[np.bool_]:
        """Return which branches reach which poses, ``(n, 8)``."""
        branches = np.zeros((len(self._seed), len(BRANCHES)), dtype=bool)
        branches[self.pose[self.reached], self.number[self.reached]] = True
        return branches

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
        reached = np.zeros(len(self._seed), dtype=bool)
        reached[self.pose[good]] = True
        return reached


#: A nominal start that misses by more [reach lengths, rad] is no start but for the nearest pose.
_USABLE_START: Final = 0.05
#: A seed may be beside an answer if it misses by less than this [reach lengths, rad] ..
_NEAR_SEED: Final = 0.5
#: .. and was not met if the answer found is further away than this [rad].
_SEED_MISSED: Final = 0.1
#: A nominal start may be this far beyond a limit [rad]: the calibrated arm may reach the pose within it.
_SLACK: Final = 0.02
#: Fake targets tried one after the other.
_FAKE_TARGETS: Final = 6
#: The way to a lost branch leads from a posture with a singular value below this ..
_NEARLY_SINGULAR: Final = 0.1
#: .. along the joint motion that moves the pose least, by one of these amounts [rad]; the last one turns a wrist over.
_AMOUNTS_ACROSS: Final = (
    (True, (0.02, 0.1, 0.4)),
    (False, (0.05, 0.2, 0.9, 1.8, float(np.sqrt(2) * np.pi))),
    (True, (0.05, 0.2, 0.9, 1.8, float(np.sqrt(2) * np.pi))),
)
#: Candidates whose joints differ by less than this are one [rad].
_SAME_PLACE: Final = 1e-4
#: Singular value below which calibration errors decide which branches there are.
_SINGULAR: Final = 0.01


class BranchSearch:
    """The search for the branches of poses on the calibrated arm.

    Args:
        task: The poses, with their whole orientation.
        seed, turned: Joint positions to stay near to, and what they turn the joints by [rad], ``(n, 6)`` each.
        rule, form: Names and closed form of the robot's branches.
    """

    def __init__(self, task: PoseTask, seed: Array, turned: Array, rule: BranchRule, form: ClosedForm) -> None:
        self._task, self._seed, self._turned, self._rule, self._form = task, seed, turned, rule, form
        self._joints, self._number, self._exact = self._nominal(task)
        # A pose without any solution starts at the seed.
        lone = (self._number < 0).all(axis=1)
        self._joints[lone, 0], self._number[lone, 0] = turned[lone], 0
        self._pool = Candidates(task, seed, rule)

    def one_branch(self, wanted: int | None) -> Candidates:
        """Return candidates on one branch, or on the one nearest to the seed within the limits if None."""
        filled = self._number >= 0
        cost = np.where(filled, 1e4 * ~self._exact, np.inf)
        if wanted is not None:
            cost += 1e6 * (self._number != wanted)
        else:
            self._joints = nearest_turns(self._task.robot, self._joints, self._seed[:, None, :])
            away = np.abs(self._joints - self._seed[:, None, :]).max(axis=2)
            cost += 1e2 * beyond_limits(self._task.robot, self._joints, _SLACK).any(axis=2)
            cost += np.where(filled, away, 0.0)
        every = np.arange(len(cost))
        slot = np.argmin(cost, axis=1)
        self._pool.add(every, self._joints[every, slot])
        # A seed that is nearly there is a start of its own: at its end a branch of the nominal arm may be missing. What
        # lies beside it already is what it would lead to.
        usable = np.flatnonzero(_missed(self._task, self._turned) < _USABLE_START)
        if wanted is None:
            usable = usable[self._pool.away()[usable] > _SEED_MISSED]
        self._pool.add(usable, self._turned[usable])
        missing = ~self._pool.satisfied(wanted)
        if missing.any():
            near = self._add_all(missing)
            expected = self._expected(near)
            if wanted is not None:
                # At its end a branch has no side, and the name of a nominal solution is by chance. Next to a singular
                # posture the calibrated arm can have a branch that the nominal one has not.
                possible = expected[:, wanted] | (near & ~self._exact).any(axis=1) | self._singular(missing)
                expected[:] = False
                expected[:, wanted] = possible
            else:
                expected[~missing | self._pool.reached_branches().any(axis=1)] = False
            self._look_again(expected, thorough=True)
        if wanted is None:
            self._add_nearer()
        return self._pool

    def _add_nearer(self) -> None:
        """Start from seeds that are not far from their poses either, where what was found is.

        The nominal solution nearest to the seed may be out of reach, or lead the calibrated arm to another branch.
        """
        away = self._pool.away()
        beside = np.flatnonzero((_missed(self._task, self._turned) < _NEAR_SEED) & (away > _SEED_MISSED))
        tried = Candidates(self._task, self._seed, self._rule)
        tried.add(beside, self._turned[beside])
        nearer = np.flatnonzero(tried.away() < np.minimum(away, _SEED_MISSED))
        self._pool.add(nearer, self._turned[nearer])

    def every_branch(self) -> Candidates:
        """Return candidates on every branch there is."""
        near = self._add_all(np.ones(len(self._seed), dtype=bool))
        self._look_again(self._expected(near), thorough=False)
        return self._pool

    def _nominal(self, task: PoseTask) -> tuple[Array, NDArray[np.intp], NDArray[np.bool_]]:
        """Return the nominal solutions, their branches (-1 for none), and which reach the pose."""
        starts = self._form.starts(task.position.T, np.stack(task.rotation).transpose(2, 1, 0))
        joints = starts.joints
        filled = ~np.isnan(joints[:, :, 0])
        number = np.full(filled.shape, -1)
        number[filled] = self._rule.numbers(task.robot.rigid.trunk.forward_kinematics(joints[filled].T))
        return joints, number, filled & ~starts.nearest

    def _add_all(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Start from every near nominal solution of some poses, or from the nearest one; return which are near."""
        pose, slot = np.nonzero((self._number >= 0) & chosen[:, None])
        size = np.full(self._number.shape, np.inf)
        size[pose, slot] = _missed(self._task.of(pose), self._joints[pose, slot])
        near = np.asarray(size < _USABLE_START)
        nearest = np.isfinite(size) & (size <= size.min(axis=1, keepdims=True))
        pose, slot = np.nonzero(near | nearest)
        self._pool.add(pose, self._joints[pose, slot])
        return near

    def _expected(self, near: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the branches ``(n, 8)`` that near nominal solutions are on; all where nothing reaches the pose yet."""
        expected = np.zeros((len(near), len(BRANCHES)), dtype=bool)
        pose, slot = np.nonzero(near)
        number = self._number[pose, slot]
        expected[pose, number] = True
        # Where the nominal arm just does not reach, the calibrated one may, on both sides of what was the end.
        edge = ~self._exact[pose, slot]
        for side in (2, 4):
            expected[pose[edge], number[edge] ^ side] = True
        expected[near.any(axis=1) & ~self._pool.reached_branches().any(axis=1)] = True
        return expected

    def _singular(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the chosen poses ``(n,)`` of which a nominal solution is all but singular."""
        pose, slot = np.nonzero((self._number >= 0) & chosen[:, None])
        part = self._task.of(pose)
        value, _ = weakest_motion(part, part.variables(self._joints[pose, slot]))
        singular = np.zeros(len(chosen), dtype=bool)
        singular[pose[value < _SINGULAR]] = True
        return singular

    def _lost(self, expected: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return the poses that lack a branch they are expected to have, ``(n,)``."""
        return np.asarray((expected & ~self._pool.reached_branches()).any(axis=1))

    def _look_again(self, expected: NDArray[np.bool_], thorough: bool) -> None:
        """Look for branches ``(n, 8)`` that were expected and not found."""
        pool = self._pool
        pose, number = np.nonzero(expected & ~pool.reached_branches())
        pool.add(pose, self._by_fake_targets(pose, number), bold=True, most=BOLD_STEPS)
        # From candidates that only came near too, where one branch matters: it finds the last few in ten thousand.
        unreached = ~np.asarray(pool.reached_branches().any(axis=1))
        origins = pool.reached | unreached[pool.pose] | thorough
        tried = _once(pool, np.flatnonzero(self._lost(expected)[pool.pose] & origins))
        value, motion = weakest_motion(self._task.of(pool.pose[tried]), pool.variables[:, tried])
        weak = value < _NEARLY_SINGULAR
        pose, origin, motion = pool.pose[tried][weak], pool.variables[:6, tried[weak]].T, motion[weak]
        for bold, amounts in _AMOUNTS_ACROSS:
            left = np.flatnonzero(self._lost(expected)[pose])
            way = np.tile([*amounts, *(-amount for amount in amounts)], len(left))[:, None]
            again = np.repeat(left, 2 * len(amounts))
            most = BOLD_STEPS if bold else STEPS_OF_MANY
            pool.add(pose[again], origin[again] + way * motion[again], bold=bold, most=most)

    def _by_fake_targets(self, pose: NDArray[np.intp], number: NDArray[np.intp]) -> Array:
        """Return joints ``(m, 6)`` for poses on branches, by closed forms of shifted poses alone.

        The pose is shifted by what the calibrated arm misses it by, and the nominal arm solved again (the fake targets
        of Nubiola, section 1.5). The closed form knows a branch up to its very end, where Newton's steps leave it.
        """
        part, joints = self._task.of(pose), self._turned[pose]
        wanted = homogeneous(np.stack(part.rotation).transpose(2, 1, 0), part.position.T)
        shifted, every = wanted, np.arange(len(pose))
        for _ in range(_FAKE_TARGETS):
            x, y, z, position = np.moveaxis(shifted[:, :3, :], 0, -1).transpose(1, 0, 2)
            solutions, numbers, exact = self._nominal(
                PoseTask(part.robot, part.target, "full", position, (x, y, z), part.length)
            )
            slot = np.argmin(np.where(numbers < 0, 1e6, 1e2 * (numbers != number[:, None]) + 1e1 * ~exact), axis=1)
            none = numbers[every, slot] < 0
            joints = np.where(none[:, None], joints, solutions[every, slot])
            kinematics = part.forward_kinematics(part.variables(joints))
            shifted = wanted @ np.linalg.inv(homogeneous(kinematics.matrix(), kinematics.position.T)) @ shifted
        return joints


def _once(pool: Candidates, rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the candidates among `rows` that are not in the same place as another one of their pose before them."""
    places = np.round(np.column_stack([pool.pose[rows], pool.variables[:6, rows].T / _SAME_PLACE]))
    _, first = np.unique(places, axis=0, return_index=True)
    return np.asarray(rows[np.sort(first)])


def _missed(task: PoseTask, joints: Array) -> Array:
    """Return by how much joints turned so miss the poses [reach lengths, rad], ``(n,)``."""
    return np.asarray(np.linalg.norm(task.error(task.forward_kinematics(task.variables(joints))), axis=1))
