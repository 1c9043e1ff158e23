"""Resolved configurations: the joints of the nominal robot at a program's targets, as its controller picks them.

A pose can be reached in up to eight postures and several turns. Configuration data in the program say in which; where
they leave a choice, or there are none, it is the posture nearest to where the robot comes from. An offset has the
configuration of the target that it is an offset from, in the posture next to that.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.programs.fake_targets import AT_ONCE
from truearm.engine.programs.program import ANY_POSTURE, Configuration
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branch_search import beyond_limits, limits, nearest_turns
from truearm.engine.robot.inverse.branches import SLOTS, ClosedForm, branch_rule
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.inverse.pose_solver import PoseStatus
from truearm.engine.robot.robot import Robot

_TURN: Final = 2.0 * np.pi
#: Below this sine a wrist is stretched, and which way it bends is by chance.
_STRETCHED: Final = 0.03
#: Turns that a joint may have made.
_TURNS: Final = np.arange(-2.0, 3.0)
#: A joint may be this far [rad] beyond a bound of the configuration. Joints often stand at a bound, as at 0, and
#: controllers then take the posture at hand: KUKA's ignore the turn of a joint within 2 deg of zero.
ON_EDGE: Final = float(np.radians(2.0))
#: A posture may be this far [rad] beyond a limit: the numbers of the program are rounded.
_SLACK: Final = 0.02
#: What a branch's number says, by word and bit.
_WORDS: Final = (
    ("shoulder", 4, {"front": 0, "back": 4}),
    ("elbow", 2, {"up": 0, "down": 2}),
    ("wrist", 1, {"noflip": 0, "flip": 1}),
)


@dataclass(frozen=True, eq=False)
class ResolvedConfigurations:
    """Joints of the nominal robot at poses."""

    joints: Array  #: [rad or m], ``(n, joints)``; NaN where there are none.
    reachable: NDArray[np.bool_]  #: Whether the nominal robot reaches the pose at all, ``(n,)``.
    #: Index of the first pose whose posture is not known, neither by its configuration nor by where the robot comes
    #: from; None if there is none.
    guessed: int | None


def agrees(robot: Robot, joints: Array, configuration: Configuration, slack: float = ON_EDGE) -> NDArray[np.bool_]:
    """Return whether joints ``(n, joints)`` of a robot lie within the ranges of a configuration, ``(n,)``."""
    shown = robot.controller.from_model(joints)
    inside = np.ones(len(joints), dtype=bool)
    for joint in _bound(configuration):
        inside &= _allowed(configuration, joint, shown[:, joint - 1], slack)
    return inside


def _bound(configuration: Configuration) -> tuple[int, ...]:
    """Return the joints, from 1, whose ranges a configuration gives."""
    return tuple(dict.fromkeys(joint for joint, _, _ in (*configuration.ranges, *configuration.outside)))


def _allowed(configuration: Configuration, joint: int, position: Array, slack: float) -> NDArray[np.bool_]:
    """Return which joint positions of a joint a configuration allows, in the shape of `position`."""
    allowed = np.ones(position.shape, dtype=bool)
    with np.errstate(invalid="ignore"):
        for number, low, high in configuration.ranges:
            if number == joint:
                allowed &= (position >= low - slack) & (position < high + slack)
        for number, low, high in configuration.outside:
            if number == joint:
                allowed &= (position < low + slack) | (position >= high - slack)
    return allowed


def resolved_configurations(
    nominal: Robot,
    flange: Array,
    configurations: Sequence[Configuration],
    known: Array,
    order: Iterable[int],
    parents: Sequence[int | None] = (),
    straight: Collection[int] = (),
) -> ResolvedConfigurations:
    """Return the joints at a program's targets.

    Args:
        nominal: The robot that its controller knows, of six joints or more.
        flange: Poses of the flange in its base frame, ``(n, 4, 4)`` [m].
        configurations: What the program says of each.
        known: Joint positions ``(n, joints)`` [rad or m] of the model where the program gives joints, else NaN.
        order: Indices in the order in which the robot goes from one to the next; none of them need be there.
        parents: For each the index of the pose that it is an offset from, None for none; empty if none is an offset. An
            offset without a configuration is in the posture nearest to that of the pose it is an offset from, where
            that has one.
        straight: The poses that the robot comes to on a line or a circle. On its way it stays on the branch where it
            was, unless its wrist was stretched.
    """
    joints = known.copy()
    reachable: NDArray[np.bool_] = np.asarray(~np.isnan(known).any(axis=1))
    wanted = [int(i) for i in np.flatnonzero(~reachable)]
    if not wanted:
        return ResolvedConfigurations(joints, reachable, None)
    rule = branch_rule(nominal)
    form = ClosedForm(nominal, None) if rule is not None else None
    if rule is None or form is None or not form.known:
        return _by_seeds(nominal, flange, configurations, joints, wanted)
    candidates, possible = _every_posture(nominal, flange[wanted], form)
    number, bend = np.full(possible.shape, -1), np.zeros(possible.shape)
    rows, slots = np.nonzero(possible)
    for first in range(0, len(rows), AT_ONCE):
        some = rows[first : first + AT_ONCE], slots[first : first + AT_ONCE]
        kinematics = nominal.forward_kinematics(candidates[some])
        number[some], bend[some] = rule.numbers(kinematics), rule.bend(kinematics)
    known_kinematics = nominal.forward_kinematics(np.nan_to_num(known))
    known_number, known_bend = rule.numbers(known_kinematics), rule.bend(known_kinematics)
    reachable[wanted] = possible.any(axis=1)
    choice = _Candidates(nominal, candidates, possible, number, [configurations[i] for i in wanted])
    guessed = None
    place = {index: row for row, index in enumerate(wanted)}
    before: Array | None = None
    branch: int | None = None

    def parent_of(index: int) -> Array | None:
        """Return the joint positions of what an offset starts from, where the program says them and none of its own."""
        parent = parents[index] if parents and configurations[index] == ANY_POSTURE else None
        while parent is not None and configurations[parent] == ANY_POSTURE and parents[parent] is not None:
            parent = parents[parent]
        if parent is None or configurations[parent] == ANY_POSTURE:
            return None
        solution = choice.chosen(place[parent], before, None)
        return None if solution is None else solution[0]

    for index in dict.fromkeys((*order, *range(len(flange)))):
        row = place.get(index)
        if row is not None:
            near = configurations[index].near
            reference = before if near is None else nominal.controller.to_model(np.array([near]))[0]
            above = parent_of(index)
            reference = reference if above is None else above
            if reference is None and guessed is None and choice.open[row]:
                guessed = index
            wanted_branch = branch if index in straight and near is None and above is None else None
            solution = choice.chosen(row, reference, wanted_branch)
            if solution is None:
                continue
            joints[index], slot = solution
            branch = int(number[row, slot]) if bend[row, slot] > _STRETCHED else None
        else:
            branch = int(known_number[index]) if known_bend[index] > _STRETCHED else None
        before = joints[index]
    return ResolvedConfigurations(joints, reachable, guessed)


def _every_posture(nominal: Robot, flange: Array, form: ClosedForm) -> tuple[Array, NDArray[np.bool_]]:
    """Return the joints with which the controller's arm reaches poses, eight ways a pose, and which of them do."""
    position, rotation = flange[:, :3, 3], flange[:, :3, :3]
    if all(p.value == p.nominal for p in nominal.parameters.values()):
        starts = form.starts(position, rotation)
        return starts.joints, ~np.isnan(starts.joints[:, :, 0]) & ~starts.nearest
    # A controller with kinematics of its own has no closed form, but a nominal arm beside it has.
    joint_solutions = inverse(nominal, position, rotation, branch="all")
    joints = np.full((len(flange), SLOTS, len(nominal.joints)), np.nan)
    possible = np.zeros(joints.shape[:2], dtype=bool)
    slot = np.arange(len(joint_solutions.pose)) - np.searchsorted(joint_solutions.pose, joint_solutions.pose)
    reached = np.array([status is not PoseStatus.UNREACHABLE for status in joint_solutions.status], dtype=bool)
    joints[joint_solutions.pose[reached], slot[reached]] = joint_solutions.joints[reached]
    possible[joint_solutions.pose[reached], slot[reached]] = True
    return joints, possible


class _Candidates:
    """The candidates for each pose that its configuration allows, and the choice among them along the way.

    Args:
        nominal: The robot that the controller knows.
        joints: Candidates, eight a pose, ``(m, 8, joints)`` [rad or m].
        possible: Which of them reach the pose, ``(m, 8)``.
        number: Number of the branch of each, ``(m, 8)``.
        configurations: What the program says of each pose.
    """

    def __init__(
        self,
        nominal: Robot,
        joints: Array,
        possible: NDArray[np.bool_],
        number: NDArray[np.intp],
        configurations: Sequence[Configuration],
    ) -> None:
        self._nominal, self._number = nominal, number
        self._joints, self._possible = joints.copy(), possible.copy()
        #: Joints whose turn is given.
        self._fixed = np.zeros(joints.shape, dtype=bool)
        groups: dict[Configuration, list[int]] = {}
        for row, configuration in enumerate(configurations):
            # The joints to be near to are of every target's own, and of no meaning here.
            shared = configuration if configuration.near is None else replace(configuration, near=None)
            groups.setdefault(shared, []).append(row)
        for configuration, members in groups.items():
            self._allow(configuration, np.array(members))
        self._turn_near_zero()

    def _allow(self, configuration: Configuration, rows: NDArray[np.intp]) -> None:
        """Leave of the candidates of some poses those of their configuration, in the turns that it gives."""
        joints, controller = self._joints, self._nominal.controller
        signs = controller.signs or (1,) * len(self._nominal.joints)
        for word, bit, values in _WORDS:
            name = getattr(configuration, word)
            if name is not None:
                self._possible[rows] &= (self._number[rows] & bit) == values[name]
        for joint in _bound(configuration):
            shown = controller.from_model(joints[rows].reshape(-1, joints.shape[2]))
            position = shown[:, joint - 1].reshape(len(rows), SLOTS, 1) + _TURNS * _TURN
            allowed = _allowed(configuration, joint, position, ON_EDGE)
            # Of the turns that are allowed the one nearest to zero.
            turn = np.argmin(np.where(allowed, np.abs(position), np.inf), axis=2)
            turns = np.where(allowed.any(axis=2), _TURNS[turn], 0.0)
            joints[rows, :, joint - 1] += signs[joint - 1] * turns * _TURN
            self._fixed[rows, :, joint - 1] = True
            self._possible[rows] &= allowed.any(axis=2)

    def _turn_near_zero(self) -> None:
        """Turn joints whose turn is not given near to zero, and prefer candidates within the limits."""
        free = ~self._fixed
        self._low, self._high = limits(self._nominal)
        zero = np.zeros(self._joints.shape[2])
        for first in range(0, len(self._joints), AT_ONCE // SLOTS):
            joints, turning = (values[first : first + AT_ONCE // SLOTS] for values in (self._joints, free))
            np.copyto(joints, nearest_turns(self._nominal, joints, zero), where=turning)
        beyond: NDArray[np.bool_] = np.asarray(beyond_limits(self._nominal, self._joints, _SLACK).any(axis=2))
        within: NDArray[np.bool_] = self._possible & ~beyond
        self._possible = np.asarray(np.where(within.any(axis=1, keepdims=True), within, self._possible))
        with np.errstate(invalid="ignore"):
            turns = np.floor((self._high - self._joints) / _TURN) + np.floor((self._joints - self._low) / _TURN)
        #: Joints that have several turns to choose from.
        self._several: NDArray[np.bool_] = np.asarray(free & (turns > 0))
        turning = np.asarray((self._several & np.expand_dims(self._possible, 2)).any(axis=(1, 2)))
        #: Whether there is a choice.
        self.open: NDArray[np.bool_] = np.asarray((self._possible.sum(axis=1) > 1) | turning)
        self._only = np.argmax(self._possible, axis=1)
        #: The one candidate on each branch, ``(m, 8)``; -1 where there is none, or several are.
        on_branch = self._possible[:, :, None] & (self._number[:, :, None] == np.arange(SLOTS))
        self._on_branch = np.where(on_branch.sum(axis=1) == 1, np.argmax(on_branch, axis=1), -1)
        self._any: NDArray[np.bool_] = np.asarray(self._possible.any(axis=1))

    def chosen(self, row: int, reference: Array | None, branch: int | None) -> tuple[Array, int] | None:
        """Return the joints of a pose nearest to a reference, on its branch if there is one, and which they are.

        None if there are none.
        """
        if not self._any[row]:
            return None
        if not self.open[row]:
            return np.asarray(self._joints[row, self._only[row]]), int(self._only[row])
        if reference is not None and branch is not None and (only := int(self._on_branch[row, branch])) >= 0:
            return self._turned(row, only, reference), only
        joints = self._joints[row]
        if reference is None:
            cost = np.abs(joints).max(axis=1) + 1e3 * self._number[row]
        else:
            joints = self._turned(row, slice(None), reference)
            cost = np.abs(joints - reference).max(axis=1)
        possible = self._possible[row]
        on_branch = possible & (self._number[row] == branch)
        slot = int(np.argmin(np.where(on_branch if on_branch.any() else possible, cost, np.inf)))
        return np.asarray(joints[slot]), slot

    def _turned(self, row: int, slots: int | slice, reference: Array) -> Array:
        """Return joints of candidates of a pose, those with a choice in the turn nearest to a reference."""
        joints = self._joints[row, slots]
        turns = ((reference - joints) / _TURN).round() * self._several[row, slots]
        if turns.any():
            low = np.ceil((self._low - joints) / _TURN)
            high = np.floor((self._high - joints) / _TURN)
            joints = joints + _TURN * np.clip(turns, np.minimum(low, 0.0), np.maximum(high, 0.0))
        return np.asarray(joints)


def _by_seeds(
    nominal: Robot, flange: Array, configurations: Sequence[Configuration], joints: Array, wanted: list[int]
) -> ResolvedConfigurations:
    """Return the joints of an arm whose branches have no names: nearest to what the program says, else to zero."""
    zero = (0.0,) * len(nominal.joints)
    seeds = nominal.controller.to_model(np.array([configurations[i].near or zero for i in wanted]))
    joint_solutions = inverse(nominal, flange[wanted, :3, 3], flange[wanted, :3, :3], seed=seeds)
    reached = np.array([status is not PoseStatus.UNREACHABLE for status in joint_solutions.status])
    joints[np.array(wanted)[reached]] = joint_solutions.joints[reached]
    reachable: NDArray[np.bool_] = np.asarray(~np.isnan(joints).any(axis=1))
    unspecified = [i for i in wanted if configurations[i].near is None]
    return ResolvedConfigurations(joints, reachable, unspecified[0] if unspecified else None)
