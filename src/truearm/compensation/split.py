"""Moves split where the correction between targets would deviate.

The controller interpolates between corrected targets with the nominal robot's kinematics, and between targets the real
robot's errors are others than at them. A straight or circular move gets more targets in between, each corrected, until
what the controller interpolates is nowhere farther from the right correction than was asked for.

Only a move is split whose start is sure: the move before it in the text, with nothing in between that could come from
elsewhere, move the robot or jump.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.compensation.correction import Correction
from truearm.compensation.program_poses import numbers_of
from truearm.compensation.programs.program import Edit, Language, Move, Program, Split
from truearm.compensation.resolved_program import Between
from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.transform import homogeneous, rotation_from_vector, rotation_vector

#: Where a segment is checked, as shares of it.
_CHECKED: Final = np.array([0.25, 0.5, 0.75])
#: A move is split into so many segments at most.
MOST_SEGMENTS: Final = 64
#: Smallest and largest tolerance [m].
_TOLERANCES: Final = (1e-6, 0.1)


@dataclass(frozen=True, eq=False)
class ProgramSplit:
    """How the moves of a program are split."""

    edits: tuple[Edit, ...]  #: What changes in the text.
    moves: int  #: How many moves are split.
    added: int  #: How many targets are added.
    #: Lines of straight and circular moves that stay whole: of those whose start is not sure, or one of their targets
    #: was not corrected or is no pose of its own; of those that need more segments than allowed; and of those with
    #: options that segments cannot have.
    unsplit: tuple[int, ...]


def split_program(language: Language, correction: Correction, between: Between, tolerance: float) -> ProgramSplit:
    """Split the moves of a program.

    Args:
        language: Of the program.
        correction: Of the program.
        between: What finds fake targets between those of the program.
        tolerance: How far the correction between targets may deviate [m].

    Raises:
        InputError: If moves in this language cannot be split, or the tolerance is out of range.
    """
    if language.split is None:
        raise InputError(
            f"moves in {language.name} cannot be split", parameter="split", cure="Leave it out, or add targets."
        )
    check_tolerance(tolerance)
    program = correction.program
    unsplit: list[int] = []
    open_moves: list[_SplitMove] = []
    for index, move in enumerate(program.moves):
        if move.kind != "joint":
            before = _start(program, index)
            if before is None or not _sound(correction, move, before):
                unsplit.append(move.line)
            else:
                open_moves.append(_SplitMove(correction, index, before))
    done: list[_SplitMove] = []
    while open_moves:
        shares = [one.shares for one in open_moves]
        rows = np.repeat([one.end for one in open_moves], [len(s) for s in shares])
        wanted = np.concatenate([one.path.at(s) for one, s in zip(open_moves, shares, strict=True)])
        near = np.concatenate([one.near(s) for one, s in zip(open_moves, shares, strict=True)])
        fakes, found = between(rows, wanted, near)
        again: list[_SplitMove] = []
        given_up: list[_SplitMove] = []
        at = 0
        for one, asked in zip(open_moves, shares, strict=True):
            part = slice(at, at + len(asked))
            at += len(asked)
            if not found[part].all():
                unsplit.append(program.moves[one.index].line)
            elif one.deviates(fakes[part], tolerance):
                (again if one.split_further(tolerance) else given_up).append(one)
            else:
                done.append(one)
        unsplit += [program.moves[one.index].line for one in given_up]
        open_moves = again
    several = sorted((one for one in done if one.segments > 1), key=lambda one: one.index)
    edits, whole = language.split(program, [one.split() for one in several])
    unsplit += [program.moves[index].line for index in whole]
    split = [one for one in several if one.index not in whole]
    return ProgramSplit(tuple(edits), len(split), sum(one.segments - 1 for one in split), tuple(sorted(unsplit)))


def check_tolerance(tolerance: float) -> None:
    """Refuse a tolerance [m] by which no move can be split."""
    if not _TOLERANCES[0] <= tolerance <= _TOLERANCES[1]:
        raise InputError(
            "moves cannot be split by this distance",
            parameter="split",
            came=f"{tolerance * 1e3:g} mm",
            allowed=f"{_TOLERANCES[0] * 1e3:g} to {_TOLERANCES[1] * 1e3:g} mm",
        )


class _SplitMove:
    """A move that is split into more segments until they are straight or round enough.

    Args:
        correction: Of the program.
        index: Of the move.
        before: Index of the target that it starts from.
    """

    def __init__(self, correction: Correction, index: int, before: int) -> None:
        move = correction.program.moves[index]
        self.index, self.end, self.segments = index, move.target, 1
        self._target = correction.program.targets[move.target]
        self._circular = move.via is not None
        poses = correction.before
        self.path = _Path(poses[before], poses[move.target], None if move.via is None else poses[move.via])
        self._ends = correction.after[[before, move.target]]
        self._joints = correction.joints[[before, move.target]]
        self._fakes, self._deviation = correction.after[:0], 0.0

    @property
    def shares(self) -> Array:
        """Where fake targets are needed: four in each segment, the last at its end."""
        return np.arange(1, 4 * self.segments) / (4 * self.segments)

    def near(self, shares: Array) -> Array:
        """Return joints to be near to at shares of the path."""
        start, end = self._joints
        return np.asarray(start + shares[:, None] * (end - start))

    def deviates(self, fakes: Array, tolerance: float) -> bool:
        """Return whether what the controller interpolates is too far from the correction."""
        self._fakes = np.concatenate([self._ends[:1], fakes, self._ends[1:]])
        self._deviation = 0.0
        for segment in range(self.segments):
            one = self._fakes[4 * segment : 4 * segment + 5]
            gone = _Path(one[0], one[4], one[2] if self._circular else None).at(_CHECKED)
            away = float(np.linalg.norm(gone[:, :3, 3] - one[1:4, :3, 3], axis=1).max())
            self._deviation = max(self._deviation, away)
        return self._deviation > tolerance

    def split_further(self, tolerance: float) -> bool:
        """Return whether there are more segments from now on; not where the posture changes on the way."""
        if self.segments == MOST_SEGMENTS:
            return False
        # The deviation falls with the square of a segment's length.
        needed = math.ceil(self.segments * math.sqrt(self._deviation / tolerance))
        self.segments = min(max(self.segments + 1, needed), MOST_SEGMENTS)
        return True

    def split(self) -> Split:
        """Return the segments as numbers."""
        near = np.tile(self._target.values, (len(self._fakes), 1))
        numbers = [tuple(row) for row in numbers_of(self._target.form, self._fakes, near).tolist()]
        vias = [numbers[4 * segment + 2] if self._circular else None for segment in range(self.segments)]
        ends = [numbers[4 * segment + 4] for segment in range(self.segments)]
        return Split(self.index, tuple(zip(ends[:-1], vias[:-1], strict=True)), vias[-1])


def _start(program: Program, index: int) -> int | None:
    """Return the target that a move starts from, None if it is not sure."""
    move, before = program.moves[index], program.moves[index - 1] if index else None
    if before is None or before.routine != move.routine or before.source != move.source:
        return None
    if (0, 0) in (move.target_text, move.statement):
        return None
    return before.target


def _sound(correction: Correction, move: Move, before: int) -> bool:
    """Return whether all targets of a move were corrected, are poses of their own, and have one tool and frame."""
    targets = correction.program.targets
    every = [before, move.target, *([] if move.via is None else [move.via])]
    end = targets[move.target]
    own = [targets[row] for row in every[1:]]
    if move.kind == "circular" and move.via is None:
        return False
    return (
        all(correction.corrected[row] for row in every)
        and all(t.form.kind == "pose" and t.form.orientation is not None and t.parent is None for t in own)
        and all((targets[row].tool, targets[row].frame) == (end.tool, end.frame) for row in every)
    )


class _Path:
    """The way of a move: positions on a line or a circle, turned evenly from its start to its end."""

    def __init__(self, start: Array, end: Array, via: Array | None) -> None:
        self._start, self._end = start, end
        self._turn = rotation_vector(end[:3, :3] @ start[:3, :3].T)
        self._circle = None if via is None else _circle(start[:3, 3], via[:3, 3], end[:3, 3])

    def at(self, shares: Array) -> Array:
        """Return poses ``(m, 4, 4)`` at shares of the way ``(m,)``."""
        along = shares[:, None]
        if self._circle is None:
            position = self._start[:3, 3] + along * (self._end[:3, 3] - self._start[:3, 3])
        else:
            centre, spin, radius = self._circle
            position = centre + rotation_from_vector(along * spin) @ radius
        return homogeneous(rotation_from_vector(along * self._turn) @ self._start[:3, :3], position)


def _circle(a: Array, b: Array, c: Array) -> tuple[Array, Array, Array] | None:
    """Return centre, rotation vector from the first to the last point, and first radius; None for no circle."""
    u, v = b - a, c - a
    normal = np.cross(u, v)
    size = float(normal @ normal)
    if size <= 1e-12 * float(u @ u) * float(v @ v):
        return None
    centre = a + (np.cross(normal, u) * (v @ v) + np.cross(v, normal) * (u @ u)) / (2.0 * size)
    axis = normal / math.sqrt(size)
    first, last = a - centre, c - centre
    angle = math.atan2(float(axis @ np.cross(first, last)), float(first @ last)) % (2.0 * math.pi)
    return centre, angle * axis, first
