"""What was measured in tests of performance, each file as one record of arrays.

A test has up to a million samples, so texts are numbers into a list of names.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array


@dataclass(frozen=True, eq=False)
class Names:
    """A column of names."""

    names: tuple[str, ...]  #: Those that occur, in the order of their first row.
    code: NDArray[np.intp]  #: Of each row: which of them, ``(n,)``.

    @classmethod
    def of(cls, texts: Iterable[str]) -> Self:
        """Return the column of these texts."""
        seen: dict[str, int] = {}
        code = np.array([seen.setdefault(text, len(seen)) for text in texts], dtype=np.intp)
        return cls(tuple(seen), code)

    def are(self, name: str) -> NDArray[np.bool_]:
        """Return which rows have a name, ``(n,)``."""
        if name not in self.names:
            return np.zeros(len(self.code), dtype=bool)
        return np.asarray(self.code == self.names.index(name))

    def rows(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> Names:
        """Return some rows."""
        return Names(self.names, self.code[rows])


@dataclass(frozen=True, eq=False)
class AttainedPoses:
    """Rows of ``poses.csv``: one attained pose each, in the instrument's frame."""

    criterion: Names  #: Id of the test: a key of :data:`truearm.planning.iso9283.criteria.TESTS`.
    #: robot, pose, approach: names; the robot's is empty where one robot was measured, the approach's where there is
    #: one alone.
    robot: Names
    pose: Names
    approach: Names
    cycle: NDArray[np.intp]  #: From 1, ``(n,)``.
    velocity: Array  #: velocity, load: shares of the rated ones, 0 to 1, ``(n,)``.
    load: Array
    time: Array  #: [s], ``(n,)``; NaN where it is not given.
    position: Array  #: [m], ``(n, 3)``.
    rotation: Array | None  #: ``(n, 3, 3)``; None where the file has no orientations.
    line: NDArray[np.intp]  #: In the file, ``(n,)``.
    source: str  #: The file, for messages.
    resolution: float = 0.0  #: Step to which positions were rounded in the file [m]; 0 where it has enough decimals.
    resolution_rot: float = 0.0  #: The same of the components of quaternions.
    simulated: bool = False  #: Whether a virtual instrument read any of them.


@dataclass(frozen=True, eq=False)
class Samples:
    """Rows of ``paths.csv`` or ``settling.csv``: samples over time, in the instrument's frame."""

    criterion: Names  #: Id of the test.
    place: Names  #: Name of the path, or of the pose.
    cycle: NDArray[np.intp]  #: From 1, ``(n,)``; 0 where a stream of a whole test has no cycles, which then are found.
    velocity: Array  #: velocity, load: shares of the rated ones, 0 to 1, ``(n,)``.
    load: Array
    time: Array  #: [s], ``(n,)``.
    position: Array  #: [m], ``(n, 3)``.
    rotation: Array | None  #: ``(n, 3, 3)``; None where the file has no orientations.
    line: NDArray[np.intp]  #: In the file, ``(n,)``.
    source: str  #: The file, for messages.
    resolution: float = 0.0  #: Step to which positions were rounded in the file [m]; 0 where it has enough decimals.
    simulated: bool = False  #: Whether a virtual instrument read any of them.


@dataclass(frozen=True, eq=False)
class Pushes:
    """Rows of ``forces.csv``: where the tip is while it is pushed, in the instrument's frame."""

    direction: Names  #: Of the force, along the robot's base axes: ``+x``, ``-x`` to ``-z``.
    force: Array  #: [N], ``(n,)``.
    cycle: NDArray[np.intp]  #: From 1, ``(n,)``.
    position: Array  #: [m], ``(n, 3)``.
    line: NDArray[np.intp]  #: In the file, ``(n,)``.
    source: str  #: The file, for messages.
    resolution: float = 0.0  #: Step to which positions were rounded in the file [m]; 0 where it has enough decimals.
    simulated: bool = False  #: Whether a virtual instrument read any of them.
