"""A whole campaign of tests by ISO 9283 on a twin that moves: what the instrument would have read, row by row.

A path is followed once for each velocity and load. From cycle to cycle the joints are a little elsewhere, the run is a
little slower or faster, and the instrument reads with noise. The drift is measured first, from cold; where it is not
planned, the arm has warmed up before. The criteria have no part in this: how they are evaluated is not known here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.planning.iso9283.planned import PerformancePlan, PlannedTest
from truearm.simulation.moving.arm import DRIVES, WARMING, Drives, Warming
from truearm.validation.iso9283.simulated_cell import Cell, Corrected, TrueRobot
from truearm.validation.iso9283.simulated_motions import run_paths, run_settling
from truearm.validation.iso9283.simulated_poses import run_approaches, run_drift, run_poses
from truearm.validation.iso9283.simulated_pushes import run_pushes
from truearm.validation.iso9283.simulated_readings import SimulatedCampaign, Tracker

#: What is done in each test; in the others paths are run.
_RUNS: Final[Mapping[str, Callable[[Cell, PlannedTest], None]]] = {
    **dict.fromkeys(("AP", "AD", "E"), run_poses),
    "vAP": run_approaches,
    "dAP": run_drift,
    **dict.fromkeys(("t", "posing-time"), run_settling),
    "compliance": run_pushes,
}


def simulated_campaign(
    plan: PerformancePlan,
    robots: Sequence[TrueRobot],
    base: Array,
    tracker: Tracker,
    rng: np.random.Generator,
    *,
    corrected: Corrected | None = None,
    drives: Drives = DRIVES,
    warming: Warming = WARMING,
    progress: Callable[[str], None] = lambda _: None,
) -> SimulatedCampaign:
    """Run every test of a plan on twins.

    Args:
        plan: What is commanded.
        robots: The robot under test; where the exchange of robots is tested, all that are exchanged.
        base: The robot's base frame in the instrument's, ``(4, 4)`` [m]: pushes are along its axes.
        tracker: What reads the tip.
        rng: For what is drawn.
        corrected: Joint positions to command in place of the nominal robot's.
        drives, warming: What the truths do not say.
        progress: Called with a few words at each test.

    Raises:
        InputError: If a truth has other joints than the plan's robot, a pose or path cannot be commanded, or there
            would be too many samples.
    """
    cell = Cell(plan, robots, base, tracker, rng, corrected, drives, warming)
    drift = plan.test("dAP")
    ordered = [*([drift] if drift else []), *(test for test in plan.tests if test.id != "dAP")]
    for number, test in enumerate(ordered, 1):
        cell.say = partial(_say, progress, f"test {number} of {len(ordered)}")
        cell.say(test.id)
        _RUNS.get(test.id, run_paths)(cell, test)
    return cell.read()


def _say(progress: Callable[[str], None], test: str, words: str) -> None:
    progress(f"{test}: {words}")
