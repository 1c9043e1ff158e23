"""Measurements of performance as records of arrays, and as the text of their files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.units import COLUMN as SIMULATED
from truearm.engine.base.units import YES
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import quaternion_from_rotation


# A test has up to a million samples, so texts are numbers into a list of names.
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

    criterion: Names  #: Id of the test: a key of :data:`truearm.iso9283.planning.criteria.TESTS`.
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


#: Decimals that are looked for; numbers with more are not rounded by anything that matters.
_DECIMALS: Final = 7
#: So many rows tell which decimals there are, and all rows are asked whether they have no more.
_FIRST: Final = 200
#: So many differences between rows tell the step; of fewer it is that of the decimals.
_LEAST: Final = 6


def resolution_of(numbers: Array, group: NDArray[np.intp]) -> float:
    """Return the step of which all differences within groups are multiples; 0 where there is none, or nothing differs.

    Args:
        numbers: As written, in the unit of the file, ``(n, d)``: all columns are those of one instrument.
        group: Rows of one group differ by scatter alone, ``(n,)``; of rows over time all are one group.
    """
    order = np.argsort(group, kind="stable")
    same = np.diff(group[order]) == 0
    for decimals in range(_DECIMALS + 1):
        power = 10.0**decimals
        if not (_whole(numbers[:_FIRST] * power) and _whole(numbers * power)):
            continue
        steps = np.abs(np.diff(np.round(numbers[order] * power).astype(np.int64), axis=0)[same]).ravel()
        steps = steps[steps > 0]
        if not len(steps):
            return 0.0
        return float(np.gcd.reduce(steps) if len(steps) >= _LEAST else 1) / power
    return 0.0


def _whole(scaled: Array) -> bool:
    return bool((np.abs(scaled - np.round(scaled)) < 1e-6 + 1e-13 * np.abs(scaled)).all())


_PLACE: Final = ("x [mm]", "y [mm]", "z [mm]")
_TURN: Final = ("qw", "qx", "qy", "qz")
_SHARES: Final = ("velocity [%]", "load [%]")
#: Of a row that is written: a nanometre, a nanoradian, a microsecond.
_LENGTH: Final = "%.6f"
_QUATERNION: Final = "%.9f"
_TIME: Final = "%.6f"
#: Rows that are written at a time.
_BLOCK: Final = 20_000


def poses_text(read: AttainedPoses) -> str:
    """Return attained poses as ``poses.csv`` holds them."""
    heading = ["criterion", "robot", "pose", "cycle", "approach", *_SHARES, "time [s]", *_PLACE]
    names = (read.criterion, read.robot, read.pose, read.approach)
    columns = [1e3 * read.position]
    if read.rotation is not None:
        heading += _TURN
        columns.append(quaternion_from_rotation(read.rotation))
    mark = [YES] if read.simulated else []
    heading += [SIMULATED] if mark else []
    criterion, robot, pose, approach = (_texts(name) for name in names)
    rows = zip(
        criterion,
        robot,
        pose,
        read.cycle.tolist(),
        approach,
        read.velocity.tolist(),
        read.load.tolist(),
        read.time.tolist(),
        np.concatenate(columns, axis=1).tolist(),
        strict=True,
    )
    lines = [",".join(heading)]
    for c, r, p, cycle, a, velocity, load, time, numbers in rows:
        words = [c, r, p, str(cycle), a, _percent(velocity), _percent(load), "" if np.isnan(time) else _TIME % time]
        lines.append(",".join([*words, *_numbers(numbers), *mark]))
    return "\n".join(lines) + "\n"


def samples_text(read: Samples, place: str, *, conditions: bool = True) -> str:
    """Return samples as ``paths.csv`` or ``settling.csv`` holds them.

    Args:
        place: Heading of the column of places: ``path`` or ``pose``.
        conditions: Whether there are columns of velocity and load.
    """
    mark = [SIMULATED] if read.simulated else []
    heading = ["criterion", place, "cycle", *(_SHARES if conditions else ()), "time [s]", *_PLACE]
    if read.rotation is not None:
        heading += _TURN
    heading += mark
    return "\n".join([",".join(heading), *_sample_lines(read, conditions=conditions)]) + "\n"


def _sample_lines(read: Samples, *, conditions: bool) -> Iterator[str]:
    """Give the rows in blocks of lines: what is the same in many rows is written into their format once."""
    oriented = read.rotation is not None
    mark = [YES] if read.simulated else []
    numbers = ",".join([_TIME, *[_LENGTH] * 3, *([_QUATERNION] * 4 if oriented else []), *mark])
    shares = np.stack([read.velocity, read.load], axis=1)
    keys = np.column_stack([read.criterion.code, read.place.code, read.cycle, shares])
    new = np.flatnonzero((keys[1:] != keys[:-1]).any(axis=1)) + 1
    bounds = [0, *new.tolist(), len(keys)]
    for first, end in pairwise(bounds):
        words = [read.criterion.names[read.criterion.code[first]], read.place.names[read.place.code[first]]]
        words.append(str(int(read.cycle[first])))
        if conditions:
            words += [_percent(float(read.velocity[first])), _percent(float(read.load[first]))]
        row = ",".join(words).replace("%", "%%") + "," + numbers
        for start in range(first, end, _BLOCK):
            rows = slice(start, min(start + _BLOCK, end))
            columns = [read.time[rows, None], 1e3 * read.position[rows]]
            if read.rotation is not None:
                columns.append(quaternion_from_rotation(read.rotation[rows]))
            table = np.concatenate(columns, axis=1)
            yield "\n".join([row] * len(table)) % tuple(table.ravel().tolist())


def forces_text(read: Pushes) -> str:
    """Return pushes as ``forces.csv`` holds them."""
    mark = [YES] if read.simulated else []
    lines = [",".join(["direction", "force [N]", "cycle", *_PLACE, *([SIMULATED] if mark else [])])]
    places = (1e3 * read.position).tolist()
    rows = zip(_texts(read.direction), read.force.tolist(), read.cycle.tolist(), places, strict=True)
    lines += [",".join([way, f"{force:.6g}", str(cycle), *_numbers(at), *mark]) for way, force, cycle, at in rows]
    return "\n".join(lines) + "\n"


def _texts(names: Names) -> list[str]:
    return [names.names[code] for code in names.code.tolist()]


def _percent(share: float) -> str:
    return f"{1e2 * share:.10g}"


def _numbers(values: list[float]) -> list[str]:
    """Return a place in mm, and a quaternion where there is one."""
    return [*(_LENGTH % value for value in values[:3]), *(_QUATERNION % value for value in values[3:])]
