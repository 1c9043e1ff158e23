"""Tests by ISO 9283 in the project: planned, simulated and evaluated, each as its command does it in the folder."""

from __future__ import annotations

import math
import os
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from truearm.engine.base.files import confined_reads
from truearm.engine.base.units import with_mark, without_mark
from truearm.studio.tasks import Outcome, Progress, option_words


def plan_tests(folder: Path, robot: str, out: str, progress: Progress, **options: Any) -> Outcome:
    """Plan tests: :func:`truearm.iso9283_plan`.

    Args:
        options: Of the job, by its names of parameters; None where nothing is said.
    """
    from truearm.iso9283.jobs import iso9283_plan

    os.chdir(folder)
    progress("finding poses and paths")
    given = _given(options)
    command = _command("plan", [robot], {**given, **_in_mm(given, "velocity", "tip")})
    with confined_reads(folder):
        made = iso9283_plan(robot, out=out, command=command, **given)
    return Outcome(tuple(made.lines()), made.warnings, tuple(made.written))


def simulate_tests(folder: Path, robot: str, plan: str, out: str, progress: Progress, **options: Any) -> Outcome:
    """Simulate the tests of a plan: :func:`truearm.iso9283_simulate`."""
    from truearm.iso9283.jobs import iso9283_simulate

    os.chdir(folder)
    given = _given(options)
    command = _command("simulate", [robot], {"plan": plan, **given})
    with confined_reads(folder):
        made = iso9283_simulate(robot, plan, out=out, command=command, progress=progress, **given)
    return Outcome(tuple(made.lines()), (), tuple(made.written))


def evaluate_tests(folder: Path, plan: str, out: str, progress: Progress, **options: Any) -> Outcome:
    """Evaluate what was measured: :func:`truearm.iso9283_evaluate`; the table is in what it wrote."""
    from truearm.iso9283.jobs import iso9283_evaluate

    os.chdir(folder)
    given = _given(options)
    turned = {"noise_rot": math.degrees(given["noise_rot"])} if "noise_rot" in given else {}
    command = _command("evaluate", [plan], {**given, **_in_mm(given, "noise"), **turned})
    with confined_reads(folder):
        made = iso9283_evaluate(plan, out=out, command=command, progress=progress, **given)
    beside = () if made.comparison is None else made.comparison.lines()
    said = without_mark(made.lines())
    absent = [line for line in said if line.startswith("Not measured:")]
    shown = with_mark((*said[:2], *absent, *beside), made.simulated_from)
    return Outcome(tuple(shown), made.warnings, tuple(made.contents()))


def _given(options: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if value is not None}


def _in_mm(given: Mapping[str, Any], *names: str) -> dict[str, Any]:
    """Return lengths and speeds as their commands take them."""
    return {name: (np.array(given[name]) * 1e3).tolist() for name in names if name in given}


def _command(name: str, words: list[str], options: Mapping[str, Any]) -> str:
    """Return the command that does the same in the project's folder, as reports show it."""
    said = {
        name: ",".join(map(_shown, value)) if isinstance(value, list | tuple) else _shown(value)
        for name, value in options.items()
    }
    return shlex.join(["truearm", "iso9283", name, *words, *option_words(said), "--out", "DIR"])


def _shown(value: object) -> str:
    return f"{value:.15g}" if isinstance(value, float) else str(value)
