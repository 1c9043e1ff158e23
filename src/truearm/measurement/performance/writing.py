"""Measurements of performance as the text of their files: ``poses``, ``paths``, ``settling`` and ``forces.csv``."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Final

import numpy as np

from truearm.measurement.performance.records import AttainedPoses, Names, Pushes, Samples
from truearm.modeling.transform import quaternion_from_rotation
from truearm.simulated import COLUMN as SIMULATED
from truearm.simulated import YES

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
    criterion, robot, pose, approach = (_texts(one) for one in names)
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
