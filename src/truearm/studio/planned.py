"""A plan of measurements in the project, and what of it is drawn."""

from __future__ import annotations

import os
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from truearm.files import confined_reads
from truearm.modeling.chain import Array
from truearm.studio.tasks import Outcome, Progress, option_words


@dataclass(frozen=True, eq=False)
class Planned:
    """What a plan says, and where.

    Attributes
    ----------
    outcome
        What its command prints, and the files.
    chosen
        Where the flange is at the chosen configurations, in the base frame [m], ``(n, 3)``.
    places, errors
        Where the accuracy was predicted, in the base frame, ``(m, 3)``, and the error to expect there, ``(m,)`` [m].
    enough
        How the error falls with the number of poses: the picture of the plan's page.
    """

    outcome: Outcome
    chosen: Array
    places: Array
    errors: Array
    enough: dict[str, Any]


def planned(folder: Path, robot: str, poses: int | str, out: str, progress: Progress, **options: Any) -> Planned:
    """Choose configurations and write the plan: :func:`truearm.plan`.

    Parameters
    ----------
    options
        Of the job, by its names of parameters; None where nothing is said.
    """
    from truearm.jobs.plan import plan
    from truearm.reporting.plan_report import number_figure

    os.chdir(folder)
    given = {name: value for name, value in options.items() if value is not None}
    with confined_reads(folder):
        found = plan(
            robot,
            poses=poses,  # type: ignore[arg-type]
            out=out,
            command=plan_command(robot, poses, out, given),
            progress=progress,
            **given,
        )
    made, base, page = found.made, found.made.robot.base, Path(out).with_suffix(".html").name
    return Planned(
        Outcome(tuple(found.lines()), (), (out, page)),
        made.robot.forward(made.joints)[0],
        (made.prediction.places - np.array(base.translation)) @ base.rotation,
        made.prediction.error,
        number_figure(made.prediction, len(made.joints)),
    )


def plan_command(robot: str, poses: int | str, out: str, options: dict[str, Any]) -> str:
    """Return the command that does the same in the project's folder, as the page shows it."""
    said = {**options, **({"noise": f"{options['noise'] * 1e3:.15g}"} if "noise" in options else {})}
    return shlex.join(["truearm", "plan", robot, "--poses", str(poses), *option_words(said), "--out", out])
