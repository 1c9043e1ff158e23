"""A program whose targets are poses and joints of the nominal robot, and how they are corrected."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.programs.cell import Cell
from truearm.engine.programs.chosen_targets import Kept
from truearm.engine.programs.correction import LIKELY, Correction, kept_targets, paths_of
from truearm.engine.programs.expected_errors import ExpectedErrors, Start, TargetsReached
from truearm.engine.programs.fake_targets import FakeTargets, fake_targets_of, matrices
from truearm.engine.programs.program import Configuration, Edit, Program, Skipped
from truearm.engine.programs.program_poses import (
    Places,
    Shift,
    edits_of,
    joint_numbers,
    joints_of,
    offsets_in_order,
    place,
    pose_numbers,
    poses_of,
)
from truearm.engine.programs.resolved_configurations import (
    ON_EDGE,
    ResolvedConfigurations,
    agrees,
    resolved_configurations,
)
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.pose_solver import PoseStatus
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.robot.wrench import Wrench

_NOT_BETTER: Final[Kept] = "not better corrected"
#: A joint within this of a bound [rad] is on it: the numbers of programs are rounded.
_ROUNDING: Final = float(np.radians(0.01))

#: For targets ``(m,)``, poses ``(m, 4, 4)`` of their tools in their frames and joints ``(m, joints)`` near the answer:
#: fake targets ``(m, 4, 4)``, and whether each was found ``(m,)``.
Between = Callable[[NDArray[np.intp], Array, Array], tuple[Array, NDArray[np.bool_]]]
#: For joint positions that are commanded, ``(n, joints)``, or None for those of the program as it is: see
#: :meth:`ResolvedProgram.real_tips`.
RealTips = Callable[[Array | None], tuple[Array, Array]]


def _straight(program: Program) -> frozenset[int]:
    """Return the targets to which the first move that goes there is straight or circular."""
    first: dict[int, str] = {}
    for move in program.moves:
        for index in (move.via, move.target):
            if index is not None:
                first.setdefault(index, move.kind)
    return frozenset(index for index, kind in first.items() if kind != "joint")


@dataclass(frozen=True, eq=False)
class TipsFound:
    """Tips of targets for which joint positions were found."""

    rows: NDArray[np.intp]  #: Of the targets, ``(n,)``.
    joints: Array  #: The joint positions, ``(n, joints)`` [rad or m].
    #: before, after: tips without and with the correction, in the controller's base frame, ``(n, 4, 4)``.
    before: Array
    after: Array


class ResolvedProgram:
    """A program whose targets are poses and joints of the nominal robot.

    Args:
        robot: Calibrated.
        nominal: What the controller computes with.
        arms: The calibrated robot as it carries each tool, by the tool's name.
        kept: Targets that stay, by their index. Those that are offsets from them go along with the real robot.
        wrenches: What acts on the tool at each target; None of nothing.
        flange: Where the nominal flange is in the identified one: there are the points of tools that were not measured,
            on which it acts.
    """

    def __init__(
        self,
        robot: Robot,
        nominal: Robot,
        program: Program,
        cell: Cell,
        arms: Mapping[str, Robot] | None = None,
        kept: Mapping[int, Kept] | None = None,
        wrenches: Sequence[Wrench | None] | None = None,
        flange: Shift | None = None,
    ) -> None:
        self._robot, self._nominal, self._program = robot, nominal, program
        self._kept = {} if kept is None else kept
        by_tool = {} if arms is None else arms
        controller = robot.controller
        targets = program.targets
        self._base = Places(program, cell.frames, "frame", controller.base.matrix)
        self._tool = Places(program, cell.tools, "tool", controller.flange.matrix)
        carried = [by_tool.get(target.tool, robot) for target in targets]
        pushed = carried
        if wrenches is not None:
            pushed = self._pushed(carried, wrenches, np.eye(4) if flange is None else flange)
        self._arms, self._arm = _each_once(pushed)
        #: The same without what acts on the tool: bases are found by what the arm does at rest.
        self._free_arms, self._free_arm = _each_once(carried)
        known = joints_of(nominal, program)
        self._by_joints: NDArray[np.bool_] = np.asarray(~np.isnan(known).any(axis=1))
        poses = poses_of(program)
        flange = np.zeros((len(targets), 4, 4))
        by_pose, by_joints = ~self._by_joints, self._by_joints
        back = np.linalg.inv(self._tool.nominal)
        flange[by_pose] = self._base.nominal[by_pose] @ poses[by_pose] @ back[by_pose]
        flange[by_joints] = matrices(nominal, known[by_joints])
        #: Tips of the targets in their frames.
        self._poses = np.where(
            by_pose[:, None, None], poses, np.linalg.inv(self._base.nominal) @ flange @ self._tool.nominal
        )
        configurations = [target.configuration for target in targets]
        order = [index for move in program.moves for index in (move.via, move.target) if index is not None]
        self._resolved: ResolvedConfigurations = resolved_configurations(
            nominal, flange, configurations, known, order, [target.parent for target in targets], _straight(program)
        )
        resolved = self._resolved
        self.guess = "" if resolved.guessed is None else place(program, targets[resolved.guessed])
        self.joints = resolved.joints
        stays = np.isin(np.arange(len(targets)), list(self._kept))
        self._has_joints: NDArray[np.bool_] = np.asarray(~np.isnan(resolved.joints).any(axis=1))
        self._usable: NDArray[np.bool_] = self._has_joints & ~stays
        first = np.array([self._first(row) for row in range(len(targets))], dtype=np.intp)
        self._firsts = first
        #: Which are offsets from targets that stay.
        self._anchored: NDArray[np.bool_] = ~stays & stays[first] & (first != np.arange(len(targets)))
        self._usable &= ~self._anchored | self._has_joints[first]

    def _pushed(self, carried: Sequence[Robot], wrenches: Sequence[Wrench | None], flange: Shift) -> list[Robot]:
        """Return the robot of each target with what acts on the tool there, one for all that have the same."""
        places = self._tool.real(np.arange(len(carried)), flange)
        known: dict[tuple[int, str, Wrench | None], Robot] = {}
        robots = []
        for target, arm, wrench, at in zip(self._program.targets, carried, wrenches, places, strict=True):
            key = (id(arm), target.tool.lower(), wrench)
            if key not in known:
                tool = Transform.from_matrix(at[:3, :3], at[:3, 3])
                known[key] = arm if wrench is None else arm.with_wrench(wrench, tool)
            robots.append(known[key])
        return robots

    @property
    def forces(self) -> int:
        """How many robots with something that acts on their tools there are."""
        return sum(arm.wrench is not None for arm in self._arms)

    def pushed(self, correction: Correction) -> list[tuple[Robot, Array]]:
        """Return the robots on whose tool something acts, and the joint positions ``(n, joints)`` at which it does."""
        some = [(arm, correction.corrected & (self._arm == number)) for number, arm in enumerate(self._arms)]
        return [(arm, correction.joints[rows]) for arm, rows in some if arm.wrench is not None and rows.any()]

    @property
    def frames(self) -> tuple[str, ...]:
        """The names of the frames that its targets are in."""
        return self._base.names

    def tools_apart(self, flange: Array) -> dict[str, float]:
        """Return how far tools that were measured are from where the program has them [m], by their names.

        Args:
            flange: Where the nominal flange agrees best with the identified one.
        """
        return self._tool.apart(flange)

    @property
    def measured_base(self) -> Array | None:
        """``T_base_nominalbase`` by the first frame that was measured; None if none was."""
        return self._base.measured

    def some(self, count: int, frames: Collection[str]) -> NDArray[np.intp]:
        """Return up to `count` targets that are corrected, in some frames, evenly along the program."""
        usable = np.flatnonzero(self._usable & ~self._anchored & self._base.among(frames))
        evenly = np.linspace(0, len(usable) - 1, min(count, len(usable))).astype(int)
        return np.asarray(usable[np.unique(evenly)])

    def keep(self, rows: NDArray[np.intp], why: Kept) -> None:
        """Let targets stay from which no others are offsets."""
        self._kept = {**self._kept, **dict.fromkeys(rows.tolist(), why)}
        self._usable[rows] = False

    def joints_near(self, rows: NDArray[np.intp]) -> Array:
        """Return the joint positions of the nominal robot at targets, ``(n, joints)`` [rad or m]."""
        return np.asarray(self._resolved.joints[rows])

    def tips_with(self, rows: NDArray[np.intp], near: Array, base: Shift, flange: Array) -> TipsFound:
        """Return tips of targets in the controller's base frame, before and after correction, where found.

        Args:
            near: Joint positions that the answers are near to, on their branch, ``(n, joints)`` [rad or m].
        """
        if not len(rows):
            return TipsFound(rows, near, np.zeros((0, 4, 4)), np.zeros((0, 4, 4)))
        fake_targets = self._fake_targets(rows, base, flange, near, pushed=False)
        good = fake_targets.solutions.usable
        tips = self._base.nominal[rows] @ self._poses[rows]
        after = fake_targets.flange @ self._tool.nominal[rows]
        return TipsFound(rows[good], fake_targets.joints[good], tips[good], after[good])

    @property
    def tips(self) -> Array:
        """Tips of the targets in the base frame of the nominal robot, ``(n, 4, 4)`` [m]."""
        return np.asarray(self._base.nominal @ self._poses)

    def real_tips(self, base: Shift, flange: Array, joints: Array | None = None) -> tuple[Array, Array]:
        """Return where tips shall be and where the real robot takes them, in its base frame, ``(n, 3)`` [m] each.

        Args:
            joints: Joint positions that the controller commands ``(n, joints)`` [rad or m]; None for those of the
                program as it is. Where they are NaN, so is the tip.
        """
        rows = np.arange(len(self._program.targets))
        at = self._resolved.joints if joints is None else joints
        tips, tools = np.full((len(rows), 3), np.nan), self._tool.real(rows, flange)
        for number, arm in enumerate(self._arms):
            members = np.flatnonzero((self._arm == number) & np.isfinite(at).all(axis=1))
            position, rotation = arm.forward(at[members])
            tips[members] = position + np.einsum("nij,nj->ni", rotation, tools[members, :3, 3])
        return (self._base.real(rows, base) @ self._meant(base, flange))[:, :3, 3], tips

    def correction(self, base: Shift, flange: Array) -> Correction:
        """Return the corrected program, with what was taken for the real base and flange."""
        program, count = self._program, len(self._program.targets)
        rows = np.flatnonzero(self._usable)
        after, joints = self._poses.copy(), self._resolved.joints.copy()
        reasons: dict[int, str] = {}
        on_edge: tuple[int, ...] = ()
        for row in np.flatnonzero(~self._usable).tolist():
            if row not in self._kept:
                reasons[row] = self._why_not(row)
        if len(rows):
            fake_targets = self._fake_targets(rows, base, flange, self.joints_near(rows))
            joints[rows] = fake_targets.joints
            for at, row in enumerate(rows.tolist()):
                if not fake_targets.solutions.status[at].usable:
                    reasons[row] = _reason(fake_targets, at)
            reasons |= self._changed_turns(rows, joints, reasons)
            on_edge = self._on_edge(rows, joints, reasons)
            after[rows] = np.linalg.inv(self._base.nominal[rows]) @ fake_targets.flange @ self._tool.nominal[rows]
        # An offset that cannot be corrected goes along with the point that it begins at, where that stays on purpose.
        along = {row: self._kept[self._first(row)] for row in reasons if self._first(row) in self._kept}
        reasons = {row: reason for row, reason in reasons.items() if row not in along}
        unchanged = {**self._kept, **along}
        corrected = np.ones(count, dtype=bool)
        corrected[[*reasons, *unchanged]] = False
        after[~corrected], joints[~corrected] = self._poses[~corrected], self._resolved.joints[~corrected]
        targets = program.targets
        left = [Skipped(targets[row].source, targets[row].line, reason) for row, reason in reasons.items()]
        return Correction(
            program=program,
            edits=self._edits(after, joints, corrected),
            corrected=corrected,
            skipped=tuple(sorted((*program.skipped, *left), key=lambda s: (s.source, s.line))),
            before=self._poses,
            after=after,
            tips=self.tips,
            joints=joints,
            on_edge=on_edge,
            kept=unchanged,
        )

    def _why_not(self, row: int) -> str:
        """Return why a target that shall be corrected cannot be computed."""
        if self._has_joints[row]:
            return "the nominal robot does not reach the point that it is an offset from: check its tool and frame"
        if self._resolved.reachable[row]:
            return (
                "the nominal robot reaches it in no posture of the configuration that the program states, or only in a "
                "singular one: check its configuration data, tool and frame"
            )
        return "out of reach of the nominal robot: check its tool and frame"

    def _edits(self, after: Array, joints: Array, corrected: NDArray[np.bool_]) -> tuple[Edit, ...]:
        program, by_joints = self._program, self._by_joints
        numbers = pose_numbers(program, self._poses, after, np.flatnonzero(corrected & ~by_joints))
        numbers |= joint_numbers(self._nominal, program, joints, np.flatnonzero(corrected & by_joints))
        return tuple(edits_of(program, numbers))

    def reached(self, correction: Correction, flange: Array, frames: Sequence[str]) -> TargetsReached:
        """Return the corrected targets as the real robot shall reach them; `frames` are those of all programs."""
        rows = np.flatnonzero(correction.corrected)
        shift = (correction.after - correction.before)[rows, :3, 3:]
        return TargetsReached(
            joints=correction.joints[rows],
            tips=self._tool.real(rows, flange)[:, :3, 3],
            shifts=(self._base.nominal[rows, :3, :3] @ shift)[:, :, 0],
            groups=paths_of(self._program)[rows],
            frames=self._base.numbers(frames)[rows],
            arms=self._arms,
            arm=self._arm[rows],
            start=self._start(rows),
        )

    def judged(self, correction: Correction, expected: ExpectedErrors, *, every: bool) -> Correction:
        """Return a correction with what is expected of it, without the targets that would rather get worse."""
        rows = np.flatnonzero(correction.corrected)
        known = expected.of_some(rows, len(correction.corrected))
        worse = np.nan_to_num(known.worse) > LIKELY
        unchanged = np.zeros_like(worse) if every else kept_targets(self._program, correction.moved, known)
        corrected = correction.corrected & ~unchanged
        after = np.where(unchanged[:, None, None], correction.before, correction.after)
        joints = np.where(unchanged[:, None], self._resolved.joints, correction.joints)
        left = np.flatnonzero(unchanged & correction.corrected).tolist()
        return replace(
            correction,
            kept={**correction.kept, **dict.fromkeys(left, _NOT_BETTER)},
            edits=self._edits(after, joints, corrected) if unchanged.any() else correction.edits,
            corrected=corrected,
            after=after,
            joints=joints,
            on_edge=tuple(row for row in correction.on_edge if corrected[row]),
            expected=known,
            not_better=tuple(np.flatnonzero(worse | unchanged).tolist()),
        )

    def between(
        self, base: Shift, flange: Array, rows: NDArray[np.intp], poses: Array, near: Array
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return fake targets for poses in the frames, and with the tools, of targets; see :data:`Between`."""
        wanted = self._base.real(rows, base) @ poses @ np.linalg.inv(self._tool.real(rows, flange))
        fake_targets = fake_targets_of(self._arms, self._arm[rows], wanted, near)
        fakes = np.linalg.inv(self._base.nominal[rows]) @ fake_targets.flange @ self._tool.nominal[rows]
        return fakes, fake_targets.solutions.usable

    def _fake_targets(
        self, rows: NDArray[np.intp], base: Shift, flange: Array, near: Array, *, pushed: bool = True
    ) -> FakeTargets:
        poses = self._meant(base, flange)
        wanted = self._base.real(rows, base) @ poses[rows] @ np.linalg.inv(self._tool.real(rows, flange))
        arms, arm = (self._arms, self._arm) if pushed else (self._free_arms, self._free_arm)
        return fake_targets_of(arms, arm[rows], wanted, near)

    def _first(self, row: int) -> int:
        """Return the target that the offsets up to this one begin at."""
        while (parent := self._program.targets[row].parent) is not None:
            row = parent
        return row

    def _meant(self, base: Shift, flange: Array) -> Array:
        """Return where tips shall be in the real frames, ``(n, 4, 4)``: as the program says, but for offsets that stay.

        A target that stays is where the real robot is when it is sent there. What is an offset from it has to be that
        far from there.
        """
        anchored = self._usable & self._anchored
        if not anchored.any():
            return self._poses
        program, poses, before = self._program, self._poses.copy(), self._poses
        firsts = np.unique(self._firsts[anchored])
        flanges = np.zeros((len(firsts), 4, 4))
        for number, arm in enumerate(self._arms):
            in_arm = self._arm[firsts] == number
            flanges[in_arm] = np.linalg.inv(arm.base.matrix) @ matrices(arm, self._resolved.joints[firsts[in_arm]])
        poses[firsts] = np.linalg.inv(self._base.real(firsts, base)) @ flanges @ self._tool.real(firsts, flange)
        for row in offsets_in_order(program):
            target = program.targets[row]
            if target.parent is not None and self._anchored[row]:
                poses[row] = poses[target.parent] @ np.linalg.inv(before[target.parent]) @ before[row]
                if not target.turned:
                    poses[row, :3, 3] = poses[target.parent, :3, 3] + before[row, :3, 3] - before[target.parent, :3, 3]
        return poses

    def _start(self, rows: NDArray[np.intp]) -> Start | None:
        """Return the targets that stay and that others are offsets from; None if there are none."""
        anchored = self._anchored[rows]
        if not anchored.any():
            return None
        firsts = np.where(anchored, self._firsts[rows], rows)
        turned = np.array([self._program.targets[row].turned for row in rows.tolist()], dtype=bool)
        return Start(self._resolved.joints[firsts], turned, anchored)

    def _changed_turns(self, rows: NDArray[np.intp], joints: Array, reasons: Mapping[int, str]) -> dict[int, str]:
        """Return the targets that would leave the ranges of their configuration, with the reason."""
        changed: dict[int, str] = {}
        for configuration, members in self._configured(rows, reasons):
            slack = _ROUNDING if configuration.literal else ON_EDGE
            for row in members[~agrees(self._robot, joints[members], configuration, slack)].tolist():
                shown = self._robot.controller.from_model(joints[row][None])[0]
                words = ", ".join(
                    f"{math.degrees(value):.2f} deg" if joint.kind == "revolute" else f"{value * 1e3:.2f} mm"
                    for value, joint in zip(shown.tolist(), self._robot.joints, strict=True)
                )
                changed[row] = f"it would leave the configuration in the program: the joints would have to read {words}"
        return changed

    def _on_edge(self, rows: NDArray[np.intp], joints: Array, reasons: Mapping[int, str]) -> tuple[int, ...]:
        """Return the targets that leave the ranges of their configuration and did not before."""
        beyond: list[int] = []
        for configuration, members in self._configured(rows, reasons):
            before = agrees(self._robot, self._resolved.joints[members], configuration, _ROUNDING)
            after = agrees(self._robot, joints[members], configuration, _ROUNDING)
            beyond += members[before & ~after].tolist()
        return tuple(sorted(beyond))

    def _configured(
        self, rows: NDArray[np.intp], reasons: Mapping[int, str]
    ) -> Iterator[tuple[Configuration, NDArray[np.intp]]]:
        """Return the targets without a reason against them by their configuration, where it gives ranges."""
        groups: dict[Configuration, list[int]] = {}
        for row in rows.tolist():
            configuration = self._program.targets[row].configuration
            if row not in reasons and (configuration.ranges or configuration.outside):
                groups.setdefault(configuration, []).append(row)
        for configuration, members in groups.items():
            yield configuration, np.array(members)


def _each_once(arms: Sequence[Robot]) -> tuple[tuple[Robot, ...], NDArray[np.intp]]:
    """Return robots each once, and which of them each is."""
    once = tuple({id(arm): arm for arm in arms}.values())
    number = {id(arm): index for index, arm in enumerate(once)}
    return once, np.array([number[id(arm)] for arm in arms], dtype=np.intp)


def _reason(fakes: FakeTargets, at: int) -> str:
    status, solutions = fakes.solutions.status[at], fakes.solutions
    if status is PoseStatus.BRANCH_LOST:
        return f"the posture would change: it is reached as {solutions.branch[at]} only"
    return solutions.advice(at).rstrip(".")
