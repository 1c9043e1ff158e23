"""What inclinometers would read of a robot whose truth is known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from truearm.errors import refusals_of, wrong_kind
from truearm.files import path_argument
from truearm.jobs.arguments import (
    JOINTS_OF,
    choice_argument,
    file_for,
    gravity_argument,
    joints_argument,
    payload_argument,
    progress_argument,
    robot_argument,
    whole_argument,
)
from truearm.jobs.plan_inclinometers import (
    AXES,
    POSE_DEVIATION,
    RESOLUTION,
    even_argument,
    planned_pairs,
    pull_argument,
)
from truearm.measurement.controller_joints import in_controller_joints
from truearm.modeling.controller import JointsOf
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.planning.choosing.inclinometer import CANDIDATES
from truearm.results.inclinometer_plan import InclinometerSimulation, pushed_file
from truearm.simulation.inclinometer import measure_pairs, read_pairs
from truearm.simulation.truths import truth_twin
from truearm.writing import write_files


def simulate_inclinometers(
    robot: Robot | str | Path,
    *,
    truth: Robot | str | Path,
    poses: int,
    out: str | Path | None = None,
    pull: float = 20.0,
    seed: int = 0,
    payload: Payload | str | None = None,
    gravity: Sequence[float] | None = None,
    joints: JointsOf = "model",
    progress: Callable[[str], None] = lambda _: None,
) -> InclinometerSimulation:
    """Read two-axis inclinometers on all links of a digital twin, and its poses under sideways pulls.

    Configurations are those of :func:`truearm.plan_inclinometers`. Angles are rounded to 0.001 deg, poses have 0.01 mm
    of noise a coordinate.

    Parameters
    ----------
    robot
        The nominal robot, or what :func:`truearm.load_robot` takes.
    truth
        ``nominal``; ``random``, geometry and joint zeros drawn from their priors; ``gear-errors`` or ``tooth-errors``,
        the same with errors of encoders and gears; the name of a truth in the robot's file; or another robot or its
        file, with its own base and targets if it has targets.
    poses
        How many configurations for the inclinometers, an even number.
    out
        CSV file of inclinations to write, and one that ends in ``-pushed`` for the poses beside it; None writes
        nothing.
    pull
        Force of a string or a weight on the flange [N]; 0 for gravity alone, without poses.
    seed
        Of configurations, noise and a random truth.
    payload, gravity
        What the robot truly carries (an object, or a text such as ``2.7kg,50mm,25mm,100mm``) and free fall in its base
        frame [m/s^2]; None for what its file says.
    joints
        Whose joint positions the data hold: the ``model``'s, or as the ``controller`` shows them.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        For anything that cannot be used, with a message that says what to do.
    """
    progress_argument(progress)
    count, force = even_argument(poses), pull_argument(pull)
    if not isinstance(truth, Robot):
        if not isinstance(truth, str | Path):
            raise wrong_kind(
                "a truth belongs here",
                truth,
                "truth",
                "nominal, random, gear-errors, tooth-errors, a truth's name, or a robot",
            )
        path_argument(truth, "truth")
    file = None if out is None else file_for(out, robot, truth)
    if file is not None:
        file_for(pushed_file(file), robot, truth)
    rng = np.random.default_rng(whole_argument(seed, "seed"))
    carried, fall = payload_argument(payload), gravity_argument(gravity)
    nominal = robot_argument(robot)
    joints_are = joints_argument(choice_argument(joints, "joints", JOINTS_OF), nominal)
    with refusals_of("truth"):
        twin = truth_twin(nominal, truth, rng)
    twin = replace(twin, robot=twin.robot.with_payload(carried, fall))
    progress("choosing pairs of configurations")
    pairs = planned_pairs(nominal.with_payload(carried, fall), count, rng, force, CANDIDATES, POSE_DEVIATION)
    progress(f"reading {count} configurations")
    read = read_pairs(twin, pairs.inclined, RESOLUTION, rng, AXES)
    pushed = measure_pairs(twin, pairs.posed, POSE_DEVIATION, rng) if len(pairs.posed) else None
    if joints_are == "controller":
        read = replace(read, joints=nominal.controller.from_model(read.joints), joints_are="controller")
        pushed = None if pushed is None else in_controller_joints(nominal, pushed)
    named = truth.name if isinstance(truth, Robot) else str(truth)
    made = InclinometerSimulation(nominal.name, named, read, pushed, file)
    if file is not None:
        write_files(file.parent, made.texts())
    return made
