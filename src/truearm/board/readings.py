"""Measurements from a camera and a board, one of them on the flange: poses of the board in the camera, or pictures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from truearm.board.pictures import Charuco, Lens, Views, of_deviations
from truearm.engine.base.errors import InputError, counted, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.base.units import LENGTH_UNITS, SMALL_ANGLE_UNITS
from truearm.engine.base.writing import write_text
from truearm.engine.command.arguments import file_for
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.readers.cells import Cells
from truearm.engine.data.readers.rows import Configurations, in_order, unit_quaternions
from truearm.engine.data.readers.sheets import (
    Columns,
    columns_beside_joints,
    configurations_of,
    read_named,
    refuse_repeated,
)
from truearm.engine.document.document import Block, Words, detail, say
from truearm.engine.document.records import Record
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion

if TYPE_CHECKING:
    from truearm.board.import_hand_eye import ImportHandEye

#: What is on the flange, and what the target is called then.
ON_FLANGE: Final = {"camera": "camera", "board": "board"}
OnFlange = Literal["camera", "board"]

_POSITION: Final = ("x", "y", "z")
_QUATERNION: Final = ("qw", "qx", "qy", "qz")
_DEVIATIONS: Final = ("sigma", "sigma_rot")
_OF_POSES: Final = (
    {"configuration": "configuration"}
    | {axis: f"{axis} [mm]" for axis in _POSITION}
    | {part: part for part in _QUATERNION}
    | {"sigma": "sigma [mm]", "sigma_rot": "sigma_rot [mrad]"}
)
_OF_PICTURES: Final = {"configuration": "configuration", "picture": "picture"}
_UNITS: Final = dict.fromkeys((*_POSITION, "sigma"), LENGTH_UNITS) | {"sigma_rot": SMALL_ANGLE_UNITS}


@dataclass(frozen=True, eq=False)
class HandEyeReadings:
    """What a camera saw of a board, as readings of what is on the flange."""

    data: Dataset  #: Poses of the target ``camera`` in the board's frame, or of the target ``board`` in the camera's.
    views: Views  #: The poses as they came, with the lens if pictures were read.
    ahead: float  #: How far before the camera the target is [m]: a point of its axis; zero for a board on the flange.


def pictures_named(path: Path) -> tuple[Path, ...]:
    """Return the pictures that a table names, none if it holds poses; their names count from its folder."""
    cells = read_named(path)
    if "picture" not in cells.names:
        return ()
    return tuple(path.parent / name for name in cells.texts(cells.names.index("picture")))


def read_hand_eye(
    path: Path, on_flange: OnFlange, board: Charuco | None, ahead: float | None = None
) -> HandEyeReadings:
    """Read a table of poses of a board in a camera, or of pictures of it.

    Args:
        on_flange: What moves with the robot; the other one stands beside it.
        board: What the pictures show; None for a table of poses.
        ahead: How far before a camera on the flange the target is [m]; None for where the board was on average.

    Raises:
        InputError: If a column, a unit or a picture is missing, or a picture does not show the board.
    """
    cells = read_named(path)
    if board is None:
        columns = columns_beside_joints(cells, _OF_POSES, _UNITS, _DEVIATIONS)
        configurations = configurations_of(cells, columns)
        refuse_repeated(cells, configurations, "Each row is a pose of the board: give it a label of its own.")
        views = _poses(cells, columns)
    else:
        from truearm.board.pictures import seen_in_pictures

        columns = columns_beside_joints(cells, _OF_PICTURES, {})
        configurations = configurations_of(cells, columns)
        refuse_repeated(cells, configurations, "Each row is a picture of the board: give it a label of its own.")
        views = seen_in_pictures([path.parent / name for name in cells.texts(columns["picture"][0])], board)
    if on_flange != "camera":
        ahead = 0.0
    elif ahead is None:
        ahead = views.point_ahead()
    if on_flange == "camera":
        places, turns, sigma, sigma_rot = views.camera_in_board(ahead)
    else:
        places, turns, sigma, sigma_rot = views.board_in_camera()
    data = _dataset(str(path), configurations, ON_FLANGE[on_flange])
    quaternion = quaternion_from_rotation(turns)
    return HandEyeReadings(
        replace(data, position=places, quaternion=quaternion, sigma=sigma, sigma_rot=sigma_rot), views, ahead
    )


def _poses(cells: Cells, columns: Columns) -> Views:
    stated = [name for name in _DEVIATIONS if name in columns]
    if len(stated) == 1:
        missing = next(name for name in _DEVIATIONS if name not in stated)
        raise InputError(
            f"the column {missing} is missing",
            where=f"{cells.source}, line {cells.header}",
            came=stated[0],
            allowed="sigma and sigma_rot, or none of them",
            cure=f"Add {_OF_POSES[missing]}, or leave {stated[0]} out.",
        )
    position = np.column_stack([cells.numbers(*columns[axis]) for axis in _POSITION])
    parts = np.column_stack([cells.numbers(*columns[part]) for part in _QUATERNION])
    rotation = rotation_from_quaternion(unit_quaternions(parts, cells.source, cells.lines))
    behind = np.flatnonzero(position[:, 2] <= 0.0)
    if len(behind):
        raise InputError(
            "the board is behind the camera",
            where=cells.place(int(behind[0]), columns["z"][0]),
            came=cells.columns[columns["z"][0]][int(behind[0])],
            allowed="above 0: z points from the camera to what it sees",
            cure="Give poses of the board in the camera, T_camera_board, and not of the camera in the board.",
        )
    deviations = [cells.numbers(*columns[name], deviation=True) for name in stated]
    return of_deviations(rotation, position, *(deviations or (None, None)))


def _dataset(source: str, configurations: Configurations, target: str) -> Dataset:
    """Return the configurations, and a reading of one target at each, still empty."""
    n = len(configurations.labels)
    empty = Dataset(
        source=source,
        labels=configurations.labels,
        joints=configurations.joints,
        joint_kinds=configurations.kinds,
        joints_are=configurations.joints_are,
        targets=(target,),
        configuration=np.arange(n),
        target=np.zeros(n, dtype=np.intp),
        position=np.full((n, 3), np.nan),
        simulated=configurations.simulated,
    )
    return in_order(empty)


def refuse_wrong_place(pictures: Sequence[Path], board: object) -> None:
    """Refuse a board that is named where there are no pictures, and pictures of a board that is not."""
    if pictures and board is None:
        raise InputError(
            "no board is named, and the table names pictures",
            parameter="board",
            allowed="its squares, their side, that of a marker, and the dictionary: 14x10,25mm,18mm,5X5_250",
        )
    if not pictures and board is not None:
        raise InputError(
            "a board is named, and the table names no pictures",
            parameter="board",
            came=board,
            cure="Leave it out, or give a table with the column picture.",
        )


#: The lens as lines show it: what belongs together, and in which unit.
_SHOWN: Final = ((("fx", "fy"), " px"), (("cx", "cy"), " px"), (("k1", "k2", "k3"), ""), (("p1", "p2"), ""))


@dataclass(frozen=True, eq=False, repr=False)
class ImportedHandEye(Record):
    """A camera and a board, one of them on the flange, as poses of that one."""

    data: Dataset  #: The measurements.
    on_flange: str  #: ``camera`` or ``board``.
    ahead: float  #: How far before the camera, on its axis, the target is [m]; zero for a board on the flange.
    lens: Lens | None = None  #: Of the camera, where pictures were read.
    out: Path | None = None  #: The canonical CSV file that holds the measurements; None if none was written.

    @property
    def sigma(self) -> float | None:
        """Standard deviation of a coordinate of the target, root mean square [m]; None if it is not known."""
        return None if self.data.sigma is None else float(np.sqrt(np.mean(self.data.sigma**2)))

    @property
    def sigma_rot(self) -> float | None:
        """The same of a turn about an axis [rad]."""
        return None if self.data.sigma_rot is None else float(np.sqrt(np.mean(self.data.sigma_rot**2)))

    def blocks(self) -> Iterator[Block]:
        """Give what was read, in mm, mrad, ppm and pixels."""
        data, destination = self.data, "" if self.out is None else f": {self.out}"
        mm, mrad = (None if deviation is None else 1e3 * deviation for deviation in (self.sigma, self.sigma_rot))
        yield say(
            f"{counted(data.configurations, 'configuration')}, target {data.targets[0]}{destination}",
            configurations=data.configurations,
            on_flange=self.on_flange,
            ahead_mm=1e3 * self.ahead,
            sigma_mm=mm,
            sigma_rot_mrad=mrad,
        )
        if self.on_flange == "camera":
            yield say(f"  the target is a point on the camera's axis, {1e3 * self.ahead:.1f} mm before it")
        if mm is not None and mrad is not None:
            yield say(f"  deviations {mm:.3f} mm a coordinate, {mrad:.3f} mrad an axis")
        ppm = None if data.scale_sigma is None else 1e6 * data.scale_sigma
        words = "taken as exact" if ppm is None else f"known to {ppm:.3g} ppm"
        yield say(f"  the board's size is {words}", scale_sigma_ppm=ppm)
        if self.lens is not None:
            yield self._lens(self.lens)

    @staticmethod
    def _lens(lens: Lens) -> Words:
        values, deviations = lens.values, lens.deviations
        text = [f"  corners are off by {lens.noise:.2f} px, {min(lens.corners)} or more a picture"]
        for names, unit in _SHOWN:
            digits = 1 if unit else 4
            of = [f"{n} {values[n]:.{digits}f} ({deviations[n]:.{digits}f})" for n in names]
            text.append(f"  lens: {', '.join(of)}{unit}")
        figures = {"values": dict(values), "deviations": dict(deviations)}
        return detail(*text, lens={**figures, "noise_px": lens.noise, "corners": list(lens.corners)})


def of_views(asked: ImportHandEye) -> ImportedHandEye:
    """Read where a camera saw a board, and write it as canonical CSV."""
    table = path_argument(asked.file, "file")
    board = None if asked.board is None else Charuco.of_text(asked.board)
    with refusals_of("file"):
        pictures = pictures_named(table)
    refuse_wrong_place(pictures, asked.board)
    out = None if asked.out is None else file_for(asked.out, table, *pictures)
    with refusals_of("file"):
        read = read_hand_eye(table, asked.on_flange, board, asked.working_distance)
    data = replace(read.data, scale_sigma=asked.scale_sigma)
    if out is not None:
        write_text(out, csv_text(data))
    return ImportedHandEye(data, asked.on_flange, read.ahead, read.views.lens, out)
