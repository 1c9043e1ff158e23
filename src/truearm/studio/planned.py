"""A plan of measurements in the project, and what of it is drawn."""

from __future__ import annotations

import os
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.files import confined_reads
from truearm.modeling.chain import Array
from truearm.studio.plan_fields import PlanFields, plan_arguments
from truearm.studio.tasks import Outcome, Progress, option_words

#: Options that are not called as their parameters.
_OPTIONS: Final = {"candidates_from": "from", "accurate_at": "for"}


@dataclass(frozen=True, eq=False)
class Planned:
    """What a plan says, and where.

    Attributes
    ----------
    outcome
        What its command prints, and the files.
    chosen, candidates
        Where the flange is at the chosen configurations and at those that it chose from, in the base frame [m],
        ``(n, 3)`` each.
    places, errors
        Where the accuracy was predicted, in the base frame, ``(m, 3)``, and the error to expect there, ``(m,)`` [m].
    enough
        How the error falls with the number of poses: the picture of the plan's page.
    """

    outcome: Outcome
    chosen: Array
    candidates: Array
    places: Array
    errors: Array
    enough: dict[str, Any]


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

    Parameters
    ----------
    fields
        What the page says.
    cell, constraints, payload
        Of the project.
    """
    from truearm.jobs.plan import plan
    from truearm.jobs.texts import read_poses
    from truearm.reporting.plan_report import number_figure

    os.chdir(folder)
    said, poses = fields.said(cell, constraints, payload), fields.poses.strip()
    with confined_reads(folder):
        found = plan(
            robot,
            poses=read_poses(poses),
            out=fields.place,
            command=plan_command(robot, poses, said),
            progress=progress,
            **plan_arguments(robot, said),
        )
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
        number_figure(made.prediction, len(made.joints)),
    )


def plan_command(robot: str, poses: str, said: dict[str, Any]) -> str:
    """Return the command that does the same in the project's folder, as the page shows it."""
    options = {_OPTIONS.get(name, name): value for name, value in said.items()}
    return shlex.join(["truearm", "plan", robot, "--poses", poses, *option_words(options), "--out", "PLAN"])
