"""Attained poses and pushes of performance tests read from CSV, and times of samples that cannot be used."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import LENGTH_UNITS, TIME_UNITS, from_si
from truearm.engine.data.readers.cells import Cells
from truearm.engine.data.readers.rows import unit_quaternions
from truearm.engine.data.readers.sheets import Columns, named_columns, read_named
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import rotation_from_quaternion
from truearm.iso9283.planning.records import AttainedPoses, Names, Pushes, resolution_of

#: Of drift, whose groups have the same cycles again.
DRIFT: Final = "dAP"
_POSITION: Final = ("x", "y", "z")
_QUATERNION: Final = ("qw", "qx", "qy", "qz")
_LENGTHS: Final[dict[str, tuple[str, ...]]] = dict.fromkeys(_POSITION, LENGTH_UNITS)
_POSE_UNITS: Final[dict[str, tuple[str, ...]]] = {"velocity": ("%",), "load": ("%",), "time": TIME_UNITS} | _LENGTHS
_POSES: Final = (
    {name: name for name in ("criterion", "robot", "pose", "cycle", "approach")}
    | {"velocity": "velocity [%]", "load": "load [%]", "time": "time [s]"}
    | {axis: f"{axis} [mm]" for axis in _POSITION}
    | {part: part for part in _QUATERNION}
)
_OPTIONAL: Final = ("robot", "approach", "time")
_PUSH_UNITS: Final[dict[str, tuple[str, ...]]] = {"force": ("N",)} | _LENGTHS
_PUSHES: Final = {"direction": "direction", "force": "force [N]", "cycle": "cycle"} | {
    axis: f"{axis} [mm]" for axis in _POSITION
}
_DIRECTIONS: Final = ("+x", "-x", "+y", "-y", "+z", "-z")
_LARGEST_CYCLE: Final = 10**6


def read_attained_poses(path: Path) -> AttainedPoses:
    """Read ``poses.csv``: a row for each attained pose, in the instrument's frame.

    Columns: ``criterion``, ``robot`` (may be left out), ``pose``, ``cycle``, ``approach`` (may be left out), ``velocity
    [%]``, ``load [%]``, ``time [s]`` (may be left out), ``x [mm]``, ``y [mm]``, ``z [mm]``, and ``qw``, ``qx``,
    ``qy``, ``qz`` or none of them. Cells of columns that may be left out may be empty.

    Raises:
        InputError: If the file cannot be used: a column or unit that is missing or not known, cells that are empty or
            no numbers, cycles that are not whole, velocities or loads that are not between 0 and 100 %, quaternions
            that do not have length 1, or two rows of one cycle. Whether criteria and poses are those of a plan is not
            asked here.
    """
    cells = read_named(path)
    quaternion = () if any(name.startswith("q") for name in cells.names) else _QUATERNION
    columns = named_columns(cells, _POSES, _POSE_UNITS, (*_OPTIONAL, *quaternion))
    criterion, pose = (Names.of(cells.texts(columns[name][0])) for name in ("criterion", "pose"))
    robot, approach = (
        Names.of(cells.texts(columns[name][0], missing=True) if name in columns else [""] * len(cells.lines))
        for name in ("robot", "approach")
    )
    cycle = _cycles(cells, columns)
    velocity = _share(cells, columns, "velocity", "the velocity must be a share of the rated one")
    load = _share(cells, columns, "load", "the load is not between none and the rated one")
    time = np.full(len(cells.lines), np.nan)
    if "time" in columns:
        time = cells.numbers(*columns["time"], missing=True)
    names = (criterion, robot, pose, approach)
    group = _groups(*(column.code for column in names), velocity, load)
    rotation, resolution_rot = None, 0.0
    if "qw" in columns:
        parts = np.column_stack([cells.numbers(*columns[part]) for part in _QUATERNION])
        resolution_rot = resolution_of(parts, group)
        rotation = rotation_from_quaternion(unit_quaternions(parts, str(path), cells.lines))
    read = AttainedPoses(
        criterion=criterion,
        robot=robot,
        pose=pose,
        approach=approach,
        cycle=cycle,
        velocity=velocity,
        load=load,
        time=time,
        position=_positions(cells, columns),
        rotation=rotation,
        line=np.array(cells.lines, dtype=np.intp),
        source=str(path),
        resolution=_resolution(cells, columns, group),
        resolution_rot=resolution_rot,
        simulated=cells.simulated,
    )
    _refuse_repeated(read)
    return read


def read_pushes(path: Path) -> Pushes:
    """Read ``forces.csv``: a row for each force, in the instrument's frame.

    Columns: ``direction`` (``+x`` to ``-z`` of the robot's base), ``force [N]``, ``cycle``, ``x [mm]``, ``y [mm]``,
    ``z [mm]``.

    Raises:
        InputError: If the file cannot be used: a column or unit that is missing or not known, cells that are empty or
            no numbers, a direction that is not known, a force below zero, or cycles that are not whole.
    """
    cells = read_named(path)
    columns = named_columns(cells, _PUSHES, _PUSH_UNITS)
    place = columns["direction"][0]
    directions = cells.texts(place)
    for row, direction in enumerate(directions):
        if direction not in _DIRECTIONS:
            raise InputError(
                "the direction is not known",
                where=cells.place(row, place),
                came=direction,
                allowed=", ".join(_DIRECTIONS),
                cure="Name the axis of the robot's base along which the force acts, with its sign.",
            )
    force = cells.numbers(*columns["force"])
    _refuse_first(
        cells, columns, "force", force < 0, "the force is below zero", "0 N or more", "Its sense is the direction's."
    )
    names = Names.of(directions)
    return Pushes(
        direction=names,
        force=force,
        cycle=_cycles(cells, columns),
        position=_positions(cells, columns),
        line=np.array(cells.lines, dtype=np.intp),
        source=str(path),
        resolution=_resolution(cells, columns, names.code),
        simulated=cells.simulated,
    )


def _groups(*columns: Array | NDArray[np.intp]) -> NDArray[np.intp]:
    """Return rows that are alike in some columns as numbers, ``(n,)``."""
    number = np.unique(np.column_stack(columns), axis=0, return_inverse=True)[1]
    return np.asarray(number, dtype=np.intp).ravel()


def _resolution(cells: Cells, columns: Columns, group: NDArray[np.intp]) -> float:
    """Return the step to which positions were rounded [m]."""
    units = {columns[axis][1] for axis in _POSITION}
    if len(units) > 1:
        return 0.0
    unit = units.pop()
    return resolution_of(_positions(cells, columns) * from_si(1.0, unit), group) / from_si(1.0, unit)


def _positions(cells: Cells, columns: Columns) -> Array:
    return np.column_stack([cells.numbers(*columns[axis]) for axis in _POSITION])


def _cycles(cells: Cells, columns: Columns) -> NDArray[np.intp]:
    cycle = cells.numbers(columns["cycle"][0], "1")
    wrong = (cycle < 1) | (cycle > _LARGEST_CYCLE) | (cycle != np.round(cycle))
    message, allowed = "a cycle is a whole number from 1", "1, 2, 3 and so on"
    _refuse_first(cells, columns, "cycle", wrong, message, allowed, "Number the cycles from 1.")
    return cycle.astype(np.intp)


def _share(cells: Cells, columns: Columns, name: str, message: str) -> Array:
    percent = cells.numbers(columns[name][0], "1")
    lowest_too = name == "velocity"
    wrong = (percent > 100.0) | (percent < 0.0) | ((percent == 0.0) & lowest_too)
    allowed = f"{'above 0' if lowest_too else '0'} to 100 %"
    _refuse_first(
        cells, columns, name, wrong, message, allowed, "Tests go up to the rated one: correct or remove the row."
    )
    return percent / 100.0


def _refuse_first(
    cells: Cells, columns: Columns, name: str, wrong: NDArray[np.bool_], message: str, allowed: str, cure: str
) -> None:
    if wrong.any():
        row, place = int(np.argmax(wrong)), columns[name][0]
        raise InputError(
            message, where=cells.place(row, place), came=cells.columns[place][row], allowed=allowed, cure=cure
        )


def _refuse_repeated(read: AttainedPoses) -> None:
    """Refuse two rows of one cycle; those of drift begin again."""
    codes = (read.criterion.code, read.robot.code, read.pose.code, read.approach.code)
    first: dict[tuple[object, ...], int] = {}
    drift = read.criterion.are(DRIFT)
    keys = zip(
        *(code.tolist() for code in codes), read.cycle.tolist(), read.velocity.tolist(), read.load.tolist(), strict=True
    )
    for row, key in enumerate(keys):
        before = row if drift[row] else first.setdefault(key, row)
        if before != row:
            pose, cycle = read.pose.names[read.pose.code[row]], int(read.cycle[row])
            raise InputError(
                f"cycle {cycle} of pose {pose!r} appears twice under the same conditions",
                where=f"{read.source}, lines {read.line[before]} and {read.line[row]}",
                allowed="one row for each criterion, robot, pose, approach, velocity, load and cycle",
                cure="Correct the cycle, or remove one of the rows.",
            )


#: If more samples than this share have the time of the one before, times are rounded, and nothing is written twice.
_TWICE: Final = 0.02


def refuse_out_of_order(
    source: str, time: Array, code: NDArray[np.intp], order: NDArray[np.intp], lines: NDArray[np.intp]
) -> None:
    """Refuse samples of one cycle, or of one stream, of which a later one has no later time.

    Args:
        source: The file.
        time: Of each sample [s], ``(n,)``.
        code: Whose cycle or stream it is, ``(n,)``.
        order: Samples of one code together, each in the order of the file, ``(n,)``.
        lines: In the file, ``(n,)``.

    Raises:
        InputError: That names the two samples.
    """
    step = np.diff(time[order])
    wrong = np.flatnonzero((np.diff(code[order]) == 0) & (step <= 0.0))
    if not len(wrong):
        return
    before, after = order[wrong[0]], order[wrong[0] + 1]
    twice = time[before] == time[after]
    if twice and len(wrong) > max(_TWICE * len(time), 1) and (step[wrong] == 0.0).all():
        raise InputError(
            "times are rounded so coarsely that samples of a cycle have the same",
            where=f"{source}, lines {lines[before]} and {lines[after]}",
            came=f"{time[before]:.9g} s twice, and so on {len(wrong)} times",
            allowed="times that increase within a cycle, and within a stream without cycles",
            cure="Write the times with more decimals.",
        )
    raise InputError(
        "two samples of a cycle have the same time" if twice else "samples of a cycle are out of order",
        where=f"{source}, lines {lines[before]} and {lines[after]}",
        came=f"{time[before]:.9g} s, then {time[after]:.9g} s",
        allowed="times that increase within a cycle, and within a stream without cycles",
        cure="Remove the sample that was written twice."
        if twice
        else "Sort the rows by time, or give another cycle another number.",
    )
