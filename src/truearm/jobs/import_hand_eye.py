"""Measurements from a camera and a board, one of them on the flange."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from truearm.arrays import finite_number
from truearm.errors import InputError, refusals_of, wrong_kind
from truearm.files import path_argument
from truearm.jobs.arguments import choice_argument, file_for, length_argument
from truearm.measurement.board.charuco import Charuco
from truearm.measurement.readers.canonical import csv_text
from truearm.measurement.readers.hand_eye import (
    ON_FLANGE,
    OnFlange,
    pictures_named,
    read_hand_eye,
    refuse_wrong_place,
)
from truearm.results.hand_eye import ImportedHandEye
from truearm.writing import write_text


def import_hand_eye(
    file: str | Path,
    *,
    on_flange: OnFlange,
    board: str | None = None,
    scale_sigma: float | None = None,
    ahead: float | None = None,
    out: str | Path | None = None,
) -> ImportedHandEye:
    """Read where a camera saw a board, from poses or from pictures, as poses of what is on the flange.

    Parameters
    ----------
    file
        CSV with the columns ``configuration``, ``joint_1 [deg]`` .. or ``axis_1 [deg]`` .., and either the pose of the
        board in the camera, ``x [mm]``, ``y [mm]``, ``z [mm]``, ``qw``, ``qx``, ``qy``, ``qz`` (and ``sigma [mm]``,
        ``sigma_rot [mrad]``), or ``picture``: files, named from the folder of the table.
    on_flange
        ``camera``, the board standing beside the robot, or ``board``, the camera standing there.
    board
        The ChArUco board that the pictures show: ``14x10,25mm,18mm,5X5_250``, its squares, the sides of a square and of
        a marker, and the dictionary. None for poses.
    scale_sigma
        Standard deviation of how much longer than named the lengths on the board are, or of the poses' own scale: 2e-4
        for 200 ppm. None takes them as exact.
    ahead
        How far before the camera the point is that the data follow [m]; None for where the board was on average. A
        later session of the same camera needs that of the first.
    out
        Canonical CSV file to write; None writes nothing.

    Raises
    ------
    InputError
        If a file cannot be used, or a picture does not show the board.
    """
    table = path_argument(file, "file")
    choice_argument(on_flange, "on_flange", {name: name for name in ON_FLANGE})
    if board is not None and not isinstance(board, str):
        raise wrong_kind("a board belongs here", board, "board", "a text: 14x10,25mm,18mm,5X5_250")
    named = None if board is None else Charuco.of_text(board)
    with refusals_of("file"):
        pictures = pictures_named(table)
    refuse_wrong_place(pictures, board)
    scale = None if scale_sigma is None else finite_number(scale_sigma, "scale_sigma", lowest=0.0)
    if ahead is not None:
        ahead = length_argument(ahead, "ahead", 0.0)
        if on_flange != "camera":
            raise InputError(
                "only a camera on the flange has a point ahead of it",
                parameter="ahead",
                came=f"{ahead * 1e3:g} mm",
                cure="Leave it out.",
            )
    target = None if out is None else file_for(out, table, *pictures)
    with refusals_of("file"):
        read = read_hand_eye(table, on_flange, named, ahead)
    data = replace(read.data, scale_sigma=scale)
    if target is not None:
        write_text(target, csv_text(data))
    return ImportedHandEye(data, on_flange, read.ahead, read.views.lens, target)
