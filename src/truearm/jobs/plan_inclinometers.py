"""Which configurations to read inclinometers in, under which loads."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from truearm.arrays import finite_number
from truearm.errors import InputError, refusals_of
from truearm.jobs.arguments import (
    command_argument,
    count_argument,
    deviation_argument,
    file_for,
    files_of,
    gravity_argument,
    joints_argument,
    payload_argument,
    progress_argument,
    python_call,
    robot_argument,
    whole_argument,
)
from truearm.jobs.driving import cell_argument, finder_argument
from truearm.jobs.plans_replaced import plan_files_for, replaced_notices
from truearm.measurement.inclinometer import deviation_of_change
from truearm.modeling.controller import JointsOf
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.planning.choosing.inclinometer import CANDIDATES, TiltingPlan, plan_tilting
from truearm.planning.driving.touring import tour_of
from truearm.planning.driving.ways import WayFinder
from truearm.results.inclinometer_plan import InclinometerPlan
from truearm.results.tour_files import ways_beside

#: Of a two-axis inclinometer (Patel, section 4.4.1) [rad]. It has the axes x and y of its link.
RESOLUTION: Final = math.radians(0.001)
AXES: Final = (0, 1)
#: Standard deviation of a coordinate of the poses under loads [m]: the document's cameras (Patel, section 4.4.2).
POSE_DEVIATION: Final = 1e-5
#: How far joints move within a pair without a pull [rad], and pairs of poses under pulls.
_MOVE: Final = math.radians(20.0)
_POSED: Final = 8
_STRONGEST: Final = 1e4  # N


def plan_inclinometers(
    robot: Robot | str | Path,
    *,
    poses: int,
    out: str | Path | None = None,
    pull: float = 20.0,
    candidates: int = CANDIDATES,
    noise: float = POSE_DEVIATION,
    seed: int = 0,
    payload: Payload | str | None = None,
    gravity: Sequence[float] | None = None,
    joints: JointsOf | None = None,
    floor: float | None = None,
    no_floor: bool = False,
    clearance: float | None = None,
    home: Sequence[float] | None = None,
    command: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> InclinometerPlan:
    """Choose pairs of configurations in which two-axis inclinometers on all links tell most of the joints.

    Poses under sideways pulls are chosen beside, for joints whose axes stand upright.

    Parameters
    ----------
    robot
        Nominal or calibrated, or what :func:`truearm.load_robot` takes, with masses.
    poses
        How many configurations for the inclinometers, an even number.
    out
        CSV file to write; None writes nothing, see :meth:`InclinometerPlan.save`.
    pull
        Force of a string or a weight on the flange [N], along or against an axis of the base; 0 for gravity alone:
        joints then move within a pair, and no poses are chosen.
    candidates
        Pairs to draw and to choose from.
    noise
        Standard deviation of a coordinate of a pose [m].
    seed
        Of the random configurations.
    payload, gravity
        What the robot carries (an object, or a text such as ``2.7kg,50mm,25mm,100mm``) and free fall in its base frame
        [m/s^2].
    joints
        Whose joint positions the file holds: the ``model``'s, or as the ``controller`` shows them; None for the
        controller's where the robot file says that they differ.
    floor, no_floor, clearance, home
        What is kept clear, and where the arm starts and ends, as for :func:`plan`.
    command
        How to run it again; None writes the call in Python.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        For anything that cannot be used, with a message that says what to do.
    """
    progress_argument(progress)
    table = None if out is None else file_for(out, robot)
    if table is not None:
        plan_files_for((table.name, ways_beside(table).name), table, robot)
    count, force = even_argument(poses), pull_argument(pull)
    number, deviation = count_argument(candidates, "candidates"), deviation_argument(noise, "noise")
    rng = np.random.default_rng(whole_argument(seed, "seed"))
    carried, fall = payload_argument(payload), gravity_argument(gravity)
    call = command_argument(command) or python_call(
        "plan_inclinometers",
        robot,
        poses=poses,
        pull=pull,
        candidates=candidates,
        noise=noise,
        seed=seed,
        payload=carried,
        gravity=fall,
        joints=joints,
        floor=floor,
        no_floor=no_floor,
        clearance=clearance,
        home=home,
    )
    progress("reading the robot")
    carrying = robot_argument(robot).with_payload(carried, fall)
    joints_are = joints_argument(joints, carrying)
    progress("looking where the arm keeps clear")
    cell = cell_argument(carrying, None, "", floor, no_floor, clearance)
    finder = finder_argument(carrying, None, "", cell, home)
    progress("choosing pairs of configurations")
    made = planned_pairs(carrying, count, rng, force, number, deviation, finder)
    progress("looking for ways that keep clear")
    at = np.concatenate([pairs.joints_in_turn()[0] for pairs in (made.inclined, made.posed) if len(pairs)])
    tour = tour_of(finder, at, [str(k + 1) for k in range(len(at))])
    planned = InclinometerPlan(carrying, made, force, call, tour, files_of(robot), joints_are)
    if table is not None:
        replaced = replaced_notices(table.parent, table.name, planned.csv_text())
        planned.save(table)
        planned = replace(planned, replaced=replaced)
    return planned


def even_argument(poses: object) -> int:
    """Return how many configurations there shall be, two for each pair."""
    count = count_argument(poses, "poses", 2)
    if count % 2:
        raise InputError(
            "inclinations are compared two by two",
            parameter="poses",
            came=count,
            allowed="an even number",
            cure=f"Use `poses={count + 1}`.",
        )
    return count


def pull_argument(pull: object) -> float:
    """Return the force on the flange that inclinometers are read under [N]."""
    force = finite_number(pull, "pull", lowest=0.0)
    if force > _STRONGEST:
        raise InputError("no flange is pulled so hard", parameter="pull", came=force, allowed=f"0 to {_STRONGEST:g} N")
    return force


def planned_pairs(
    robot: Robot,
    count: int,
    rng: np.random.Generator,
    pull: float,
    candidates: int,
    pose_deviation: float,
    finder: WayFinder | None = None,
) -> TiltingPlan:
    """Choose the postures that inclinometers are read in, `count` of them, and poses under pulls if there is one."""
    if not robot.layout.turning:
        raise InputError("no joint of this robot turns, so no link leans", parameter="robot", where=robot.name)
    with refusals_of("poses"):
        return plan_tilting(
            robot,
            rng,
            inclined=count // 2,
            posed=_POSED if pull else 0,
            force=pull,
            move=0.0 if pull else _MOVE,
            axes=AXES,
            candidates=candidates,
            deviation=deviation_of_change(RESOLUTION),
            pose_deviation=pose_deviation,
            finder=finder,
        )
