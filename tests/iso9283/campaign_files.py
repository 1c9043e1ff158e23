"""Files of a small campaign of tests by ISO 9283, and what tests do with them."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

import truearm
from truearm.engine.base.errors import InputError, Notice
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.iso9283.evaluating.evaluate import Iso9283Evaluation
from truearm.iso9283.planning.criteria import PerformancePlan
from truearm.iso9283.planning.plan_file import PLAN, ROBOT, plan_text

Arguments = dict[str, Any]
Row = dict[str, str]
FILES = ("poses", "paths", "settling", "forces")
CUBE = "truearm: truearm-cube/1\nunits: {length: mm}\ncentre: [350, 0, 350]\nside: 200\n"


def arguments_in(folder: Path, texts: Mapping[str, str]) -> Arguments:
    """Write the files of a campaign, and return the arguments with which it is evaluated."""
    for name, text in texts.items():
        (folder / name).write_text(text)
    read = {name: folder / f"{name}.csv" for name in FILES}
    return {"plan": folder / PLAN, **read, "alignment": folder / "alignment.yaml"}


def planned_in(folder: Path, plan: PerformancePlan, **options: Any) -> Arguments:
    """Write a plan and what the twin reads for it."""
    arguments = arguments_in(folder, {PLAN: plan_text(plan), ROBOT: robot_text(plan.robot)})
    truearm.iso9283_simulate("irb120", plan, seed=1, out=folder, **options)
    return arguments


def evaluated(arguments: Arguments, *files: str, **more: Any) -> Iso9283Evaluation:
    """Evaluate some files of a campaign, by its plan and its tie to the base."""
    return truearm.iso9283_evaluate(**{name: arguments[name] for name in ("plan", "alignment", *files)}, **more)


def refusal_of(arguments: Arguments, *files: str, **more: Any) -> InputError:
    with pytest.raises(InputError) as refusal:
        evaluated(arguments, *(files or FILES), **more)
    return refusal.value


def notices(result: Iso9283Evaluation) -> dict[str, Notice]:
    return {notice.code: notice for notice in result.warnings}


def each_row(path: Path, change: Callable[[Row], object]) -> Path:
    """Change every row of a file; one of which the change says False is left out."""
    rows = list(csv.DictReader(io.StringIO(path.read_text())))
    remaining = [row for row in rows if change(row) is not False]
    with path.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(remaining)
    return path
