"""The tool's cups from lengths that were measured with the hexapod device."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from truearm.errors import InputError, refusals_of
from truearm.files import path_argument
from truearm.jobs.arguments import file_for, files_of, length_argument, lengths_argument, whole_argument
from truearm.measurement.hexapod.geometry import DEVICE, Device, side_names, triangle
from truearm.measurement.hexapod.kinematics import tool_cups
from truearm.measurement.hexapod.poses import poses
from truearm.measurement.hexapod.sheet import Sheet
from truearm.measurement.hexapod.sheet_reading import read_sheet
from truearm.measurement.hexapod.sheets_together import together
from truearm.results.hexapod import HexapodSolution, SolvedPose
from truearm.writing import same_place


def hexapod_solve(
    sheet: Sheet | str | Path | Sequence[Sheet | str | Path] | None = None,
    *,
    pose: int | None = None,
    legs: Sequence[float] | None = None,
    base: Sequence[float] = (DEVICE.base,) * 3,
    tool: Sequence[float] = (DEVICE.tool,) * 3,
    reach: float = DEVICE.reach,
    out: str | Path | None = None,
) -> HexapodSolution:
    """Find the tool's cups from measured lengths, in the frame of the base fixture.

    Parameters
    ----------
    sheet
        A sheet that ``truearm.hexapod_plan`` wrote, filled in; or several, of one robot with one tool.
    pose, legs
        Instead of a sheet: which of the 72 poses, and its six lengths [m] in the order of the pose's legs.
    base, tool
        With `pose`: the distances B1-B2, B2-B3, B3-B1 and T1-T2, T2-T3, T3-T1 [m].
    reach
        How far a length may be from its nominal one to be measured [m].
    out
        CSV file for the cups of a sheet as measurements, for ``truearm.calibrate``; None writes nothing.

    Raises
    ------
    InputError
        If neither a sheet nor a pose is given, or both; if a length is beyond the ballbar's range, or legs do not meet;
        if sheets are not of one robot and tool, or a fixture did not stand still.
    """
    device = replace(DEVICE, reach=length_argument(reach, "reach", 0.0))
    if (sheet is None) == (legs is None) or (legs is None) != (pose is None):
        raise InputError(
            "a sheet, or a pose and its six legs, belong here",
            parameter="sheet, pose, legs",
            allowed="a sheet, or `pose` and `legs`",
        )
    if legs is not None:
        if out is not None:
            raise InputError(
                "one pose without joint positions is no data file",
                parameter="out",
                cure="Use a sheet, or leave it out.",
            )
        return HexapodSolution((_one_pose(pose, legs, base, tool, device),), (), None)
    given = _sheets_argument(sheet)
    inputs = files_of(*given)
    path = None if out is None else file_for(out, *inputs)
    with refusals_of("sheet"):
        whole = together(
            [one if isinstance(one, Sheet) else read_sheet(path_argument(one, "sheet"), device) for one in given]
        )
    measured, cups = whole.measured.tolist(), whole.cups()
    with_data = whole.configurations is not None and bool(measured)
    with refusals_of("sheet"):
        data = whole.dataset() if with_data or path is not None else None
    found = HexapodSolution(
        tuple(
            SolvedPose(
                whole.labels[row],
                whole.designs[row],
                whole.solutions[row],
                cups[row],
                place=whole.places[row] if whole.places else "",
                side=whole.sides[row],
            )
            for row in measured
        ),
        tuple(label for row, label in enumerate(whole.labels) if row not in measured),
        data,
        inputs,
        whole.attached(),
    )
    if path is not None:
        found.save(path)
    return found


def _sheets_argument(sheet: object) -> tuple[object, ...]:
    if isinstance(sheet, Sheet | str | Path) or not isinstance(sheet, Sequence):
        return (sheet,)
    if not sheet:
        raise InputError("there is no sheet", parameter="sheet", allowed="one or more")
    files = [one.absolute() for one in files_of(*sheet)]
    twice = [file for number, file in enumerate(files) if any(same_place(file, other) for other in files[:number])]
    if twice:
        raise InputError("the sheet is given twice", parameter="sheet", came=str(twice[0]), cure="Give it once.")
    return tuple(sheet)


def _one_pose(
    pose: object, legs: Sequence[float], base: Sequence[float], tool: Sequence[float], device: Device
) -> SolvedPose:
    known = poses()
    chosen = known[whole_argument(pose, "pose", 1, len(known)) - 1]
    lengths = np.array(lengths_argument(legs, "legs", 6))
    sides = {name: lengths_argument(given, name, 3) for name, given in (("base", base), ("tool", tool))}
    for names, values, nominal, parameter in (
        (chosen.design.leg_names, lengths.tolist(), device.leg, "legs"),
        (side_names("B"), sides["base"], device.base, "base"),
        (side_names("T"), sides["tool"], device.tool, "tool"),
    ):
        with refusals_of(parameter):
            for name, value in zip(names, values, strict=True):
                device.check(nominal, value, name, None)
    with refusals_of("base"):
        triangle(sides["base"], "B")
    with refusals_of("legs"):
        cups = tool_cups(chosen.design, chosen.solution, sides["base"], sides["tool"], lengths)
    return SolvedPose("", chosen.design, chosen.solution, cups)
