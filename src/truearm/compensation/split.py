"""Moves divided where the correction between targets would stray (``--split``).

The controller interpolates between corrected targets with the nominal robot's kinematics, and between targets the real
robot's errors are others than at them. A straight or circular move gets more targets in between, each corrected, until
what the controller interpolates is nowhere farther from the right correction than was asked for.

Only a move is divided whose start is sure: the move before it in the text, with nothing in between that could come from
elsewhere, move the robot or jump.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.compensation.program_correction import Between, Correction
from truearm.compensation.program_poses import numbers_of
from truearm.compensation.programs.program import Division, Edit, Language, Move, Program
from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.transform import homogeneous, rotation_from_vector, rotation_vector

#: Where a piece is looked at, as shares of it.
_LOOKED_AT: Final = np.array([0.25, 0.5, 0.75])
#: A move is divided into so many pieces at most.
MOST: Final = 64
#: What may be asked for [m].
_FARTHEST: Final = (1e-6, 0.1)


@dataclass(frozen=True, eq=False)
class Divided:
    """What was divided in a program.

    Attributes
    ----------
    edits
        What changes in the text.
    moves
        How many moves were divided.
    added
        How many targets were added.
    left
        Lines of straight and circular moves that could not be looked at, because their start is not sure, or one of
        their targets was not corrected or is no pose of its own; of those that stray in the most pieces still; and of
        those whose pieces would be something else in this language.
    """

    edits: tuple[Edit, ...]
    moves: int
    added: int
    left: tuple[int, ...]


def divided(language: Language, correction: Correction, between: Between, farthest: float) -> Divided:
    """Divide the moves of a program.

    Parameters
    ----------
    language
        Of the program.
    correction
        Of the program.
    between
        What finds fake targets between those of the program.
    farthest
        How far the correction between targets may stray [m].

    Raises
    ------
    InputError
        If programs in this language cannot be divided, or the distance is none.
    """
    if language.divide is None:
        raise InputError(
            f"programs in {language.name} cannot be divided", where="--split", cure="Leave it out, or add targets."
        )
    if not _FARTHEST[0] <= farthest <= _FARTHEST[1]:
        raise InputError(
            "this is no distance to divide moves by",
            where="--split",
            came=f"{farthest * 1e3:g} mm",
            allowed=f"{_FARTHEST[0] * 1e3:g} to {_FARTHEST[1] * 1e3:g} mm",
        )
    program = correction.program
    left: list[int] = []
    open_moves: list[_Dividing] = []
    for index, move in enumerate(program.moves):
        if move.kind != "joint":
            before = _start(program, index)
            if before is None or not _sound(correction, move, before):
                left.append(move.line)
            else:
                open_moves.append(_Dividing(correction, index, before))
    done: list[_Dividing] = []
    while open_moves:
        shares = [one.shares for one in open_moves]
        rows = np.repeat([one.end for one in open_moves], [len(s) for s in shares])
        meant = np.concatenate([one.meant.at(s) for one, s in zip(open_moves, shares, strict=True)])
        near = np.concatenate([one.near(s) for one, s in zip(open_moves, shares, strict=True)])
        fakes, found = between(rows, meant, near)
        again: list[_Dividing] = []
        left_over: list[_Dividing] = []
        at = 0
        for one, asked in zip(open_moves, shares, strict=True):
            part = slice(at, at + len(asked))
            at += len(asked)
            if not found[part].all():
                left.append(program.moves[one.index].line)
            elif one.strays(fakes[part], farthest):
                (again if one.divided_further(farthest) else left_over).append(one)
            else:
                done.append(one)
        left += [program.moves[one.index].line for one in left_over]
        open_moves = again
    cut = sorted((one for one in done if one.pieces > 1), key=lambda one: one.index)
    edits, whole = language.divide(program, [one.division() for one in cut])
    left += [program.moves[index].line for index in whole]
    parted = [one for one in cut if one.index not in whole]
    return Divided(tuple(edits), len(parted), sum(one.pieces - 1 for one in parted), tuple(sorted(left)))


class _Dividing:
    """A move on its way into pieces.

    Parameters
    ----------
    correction
        Of the program.
    index
        Of the move.
    before
        Index of the target that it starts from.
    """

    def __init__(self, correction: Correction, index: int, before: int) -> None:
        move = correction.program.moves[index]
        self.index, self.end, self.pieces = index, move.target, 1
        self._target = correction.program.targets[move.target]
        self._round = move.via is not None

        def ways(poses: Array) -> _Path:
            return _Path(poses[before], poses[move.target], None if move.via is None else poses[move.via])

        self.meant = ways(correction.before)
        self._ends = correction.after[[before, move.target]]
        self._joints = correction.joints[[before, move.target]]
        self._fakes, self._far = correction.after[:0], 0.0

    @property
    def shares(self) -> Array:
        """Where fake targets are needed: four in each piece, the last at its end."""
        return np.arange(1, 4 * self.pieces) / (4 * self.pieces)

    def near(self, shares: Array) -> Array:
        """Return joints to be near to at shares of the way."""
        start, end = self._joints
        return np.asarray(start + shares[:, None] * (end - start))

    def strays(self, fakes: Array, farthest: float) -> bool:
        """Return whether what the controller interpolates strays too far."""
        self._fakes = np.concatenate([self._ends[:1], fakes, self._ends[1:]])
        self._far = 0.0
        for piece in range(self.pieces):
            one = self._fakes[4 * piece : 4 * piece + 5]
            gone = _Path(one[0], one[4], one[2] if self._round else None).at(_LOOKED_AT)
            self._far = max(self._far, float(np.linalg.norm(gone[:, :3, 3] - one[1:4, :3, 3], axis=1).max()))
        return self._far > farthest

    def divided_further(self, farthest: float) -> bool:
        """Return whether there are more pieces from now on; there are none where the posture changes on the way."""
        if self.pieces == MOST:
            return False
        # What a piece strays falls with the square of its length.
        self.pieces = min(max(self.pieces + 1, math.ceil(self.pieces * math.sqrt(self._far / farthest))), MOST)
        return True

    def division(self) -> Division:
        """Return the pieces as numbers."""
        near = np.tile(self._target.values, (len(self._fakes), 1))
        numbers = [tuple(row) for row in numbers_of(self._target.form, self._fakes, near).tolist()]
        vias = [numbers[4 * piece + 2] if self._round else None for piece in range(self.pieces)]
        ends = [numbers[4 * piece + 4] for piece in range(self.pieces)]
        return Division(self.index, tuple(zip(ends[:-1], vias[:-1], strict=True)), vias[-1])


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
