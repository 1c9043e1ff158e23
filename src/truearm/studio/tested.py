"""Tests by ISO 9283 in the project: planned, simulated and evaluated, each as its command does it in the folder."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from truearm.engine.base.files import confined_reads
from truearm.engine.base.units import with_mark, without_mark
from truearm.engine.document.document import lines_of
from truearm.studio.tasks import Outcome, Progress, done, given


def plan_tests(folder: Path, robot: str, out: str, progress: Progress, **options: Any) -> Outcome:
    """Plan tests: :func:`truearm.iso9283_plan`.

    Args:
        options: Of the job, by its names of parameters; None where nothing is said.
    """
    from truearm.iso9283.jobs import PlanTests

    os.chdir(folder)
    progress("finding poses and paths")
    with confined_reads(folder):
        made = done(PlanTests(robot, out=out, **given(options)))
    return Outcome(tuple(made.lines()), made.warnings, tuple(made.written))


def simulate_tests(folder: Path, robot: str, plan: str, out: str, progress: Progress, **options: Any) -> Outcome:
    """Simulate the tests of a plan: :func:`truearm.iso9283_simulate`."""
    from truearm.iso9283.jobs import SimulateTests

    os.chdir(folder)
    with confined_reads(folder):
        made = done(SimulateTests(robot, plan, out=out, progress=progress, **given(options)))
    return Outcome(tuple(made.lines()), (), tuple(made.written))


def evaluate_tests(folder: Path, plan: str, out: str, progress: Progress, **options: Any) -> Outcome:
    """Evaluate what was measured: :func:`truearm.iso9283_evaluate`; the table is in what it wrote."""
    from truearm.iso9283.jobs import EvaluateTests

    os.chdir(folder)
    with confined_reads(folder):
        made = done(EvaluateTests(plan, out=out, progress=progress, **given(options)))
    beside = () if made.comparison is None else lines_of(made.comparison.blocks())
    said = without_mark(made.lines())
    absent = [line for line in said if line.startswith("Not measured:")]
    shown = with_mark((*said[:2], *absent, *beside), made.simulated_from)
    return Outcome(tuple(shown), made.warnings, tuple(made.contents()))
