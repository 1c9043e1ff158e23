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
from truearm.measurement.hexapod.sheet import Sheet, read_sheet
from truearm.results.hexapod import HexapodSolution, SolvedPose


def hexapod_solve(
    sheet: Sheet | str | Path | None = None,
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
        A sheet that ``truearm.hexapod_plan`` wrote, filled in.
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
        If neither a sheet nor a pose is given, or both; if a length is beyond the ballbar's range, or legs do not meet.
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
    inputs = files_of(sheet)
    path = None if out is None else file_for(out, *inputs)
    if not isinstance(sheet, Sheet):
        with refusals_of("sheet"):
            sheet = read_sheet(path_argument(sheet, "sheet"), device)
    measured, cups = sheet.measured.tolist(), sheet.cups()
    with_data = sheet.configurations is not None and bool(measured)
    with refusals_of("sheet"):
        data = sheet.dataset() if with_data or path is not None else None
    found = HexapodSolution(
        tuple(SolvedPose(sheet.labels[r], sheet.designs[r], sheet.solutions[r], cups[r]) for r in measured),
        tuple(label for row, label in enumerate(sheet.labels) if row not in measured),
        data,
        inputs,
    )
    if path is not None:
        found.save(path)
    return found


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
