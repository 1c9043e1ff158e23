"""A plan of measurements in the project, and what of it is drawn."""

from __future__ import annotations

import os
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from truearm.engine.base.files import confined_reads
from truearm.engine.robot.chain import Array
from truearm.studio.corrected import cell_parts
from truearm.studio.plan_fields import PlanFields, plan_arguments
from truearm.studio.tasks import Outcome, Progress, done

#: Options that are not called as their parameters.
_OPTIONS: Final = {"candidates_from": "from", "accurate_at": "for"}
#: Options without a value.
_FLAGS: Final = ("no_floor", "approach")


@dataclass(frozen=True, eq=False)
class Planned:
    """What a plan says, and where."""

    outcome: Outcome  #: What its command prints, and the files.
    #: chosen, candidates: where the flange is at the chosen configurations and at those that it chose from, in the base
    #: frame [m], ``(n, 3)`` each.
    chosen: Array
    candidates: Array
    #: places, errors: where the accuracy was predicted, in the base frame, ``(m, 3)``, and the error to expect there,
    #: ``(m,)`` [m].
    places: Array
    errors: Array


def planned(
    folder: Path,
    robot: str,
    fields: PlanFields,
    cell: str | None,
    constraints: str | None,
    payload: str | None,
    progress: Progress,
) -> Planned:
    """Choose configurations and write the plan: :func:`truearm.plan`.

    Args:
        fields: What the page says.
        cell, constraints, payload: Of the project.
    """
    from truearm.engine.command.texts import read_poses
    from truearm.planning.plan import PlanPoses

    os.chdir(folder)
    poses = fields.poses.strip()
    with confined_reads(folder):
        places = cell_places(folder, fields, cell)
        said = fields.said(places, constraints, payload)
        asked = PlanPoses(robot, poses=read_poses(poses), out=fields.place, progress=progress, **plan_arguments(said))
        found = done(asked)
    made, base = found.made, found.made.robot.base
    if found.program is not None:
        files = tuple(f"{fields.place}/{name}" for name in found.contents())
    else:
        stem = fields.place.removesuffix(Path(fields.place).suffix)
        files = (
            fields.place,
            f"{stem}.html",
            *(() if found.tour is None else (f"{stem}-ways.csv", f"{stem}-sheet.html")),
        )
    return Planned(
        Outcome(tuple(found.lines()), found.warnings, files),
        made.robot.forward(made.joints)[0],
        made.robot.forward(made.among)[0],
        (made.prediction.places - np.array(base.translation)) @ base.rotation,
        made.prediction.error,
    )


def asked_by(command: str) -> dict[str, str] | None:
    """Return what a command of a plan asks for, by the names of parameters; None if it is none of these commands.

    What is true has the text ``True``.
    """
    try:
        given = shlex.split(command)
    except ValueError:
        return None
    if given[:2] != ["truearm", "plan"] or len(given) < 3:
        return None
    parameters = {option: name for name, option in _OPTIONS.items()}
    asked, rest = {"robot": given[2]}, iter(given[3:])
    for option in rest:
        name = option.removeprefix("--").replace("-", "_")
        name = parameters.get(name, name)
        value = "True" if name in _FLAGS else next(rest, None)
        if value is None or not option.startswith("--"):
            return None
        if name != "out":
            asked[name] = value
    return asked


def cell_places(folder: Path, fields: PlanFields, cell: str | None) -> dict[str, str]:
    """Return a file of tools and frames as the job takes it: for what it has, where a program needs it.

    Args:
        cell: Its name in the folder; None for none.
    """
    if cell is None or not fields.at_program:
        return {}
    places: dict[str, str] = dict.fromkeys(cell_parts(folder / cell), cell)
    return places
