"""The sphere test: a ballbar between the tool and a fixed ball."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truearm.compensation.fake_targets import nominal_robot
from truearm.compensation.gauge import best_agreement
from truearm.errors import InputError, refusals_of
from truearm.jobs.arguments import (
    command_argument,
    file_for,
    files_of,
    gravity_argument,
    lengths_argument,
    name_argument,
    payload_argument,
    python_call,
    readings_argument,
    refuse_swapped,
    robot_argument,
)
from truearm.jobs.proof import changed_since, told_of
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.modeling.transform import IDENTITY
from truearm.results.sphere_tests import OneSphere, SphereTests
from truearm.simulated import parts_of
from truearm.validation.sphere_test import SphereTest, sphere_test


def sphere(
    robot: Robot | str | Path,
    data: Dataset | str | Path,
    *,
    taught: str | None = None,
    tip: Sequence[float] | None = None,
    payload: Payload | str | None = None,
    gravity: Sequence[float] | None = None,
    out: str | Path | None = None,
    command: str | None = None,
) -> SphereTests:
    """Judge a robot by a ballbar between its tool and a fixed ball, before and after calibration.

    Parameters
    ----------
    robot
        Usually calibrated, or what :func:`truearm.load_robot` takes. A calibrated robot is judged beside its nominal
        self.
    data
        Readings of distances, or a canonical CSV file. Each pair of a target and a fixture is a sphere. A
        configuration without a length was beyond the range of the bar and is left out.
    taught
        Name of the configuration at which the target was brought to the ball by hand, so that the centre is where a
        model says it was; errors in teaching then count. It is not judged itself. None takes the centre that fits best.
    tip
        Where the bar is attached in the flange frame [m], if the robot does not know the target.
    payload, gravity
        What the robot carried (an object, or a text such as ``2.7kg,50mm,25mm,100mm``) and free fall in its base frame
        [m/s^2]; None for what its file says.
    out
        HTML file with the error of every reading; None writes nothing.
    command
        How to run it again, for the page; None writes the call in Python.

    Raises
    ------
    InputError
        If there are no distances, too few of them, or the robot does not know where the bar is attached.
    """
    refuse_swapped(robot, data, "sphere")
    page = None if out is None else file_for(out, robot, data)
    call = command_argument(command) or python_call(
        "sphere", robot, data, taught=taught, tip=tip, payload=payload_argument(payload), gravity=gravity
    )
    arm = robot_argument(robot).with_payload(payload_argument(payload), gravity_argument(gravity))
    measured = readings_argument(arm, data)
    if measured.distance is None or not np.isfinite(measured.distance).any():
        raise InputError(
            "there are no distances of a ballbar",
            parameter="data",
            where=measured.source,
            allowed="the columns target, fixture and distance [mm]",
            cure="Give what the bar read, one row a configuration.",
        )
    if tip is not None:
        place = lengths_argument(tip, "tip", 3)
        arm = arm.with_frames(arm.base, dict.fromkeys(measured.targets, place))
    with refusals_of("data"):
        for name in measured.targets:
            arm.target(name)
    nominal = _nominal(arm)
    at_ball = None if taught is None else _taught(measured, name_argument(taught, "taught"))
    spheres = []
    for number, fixture in enumerate(measured.fixtures):
        for index, target in enumerate(measured.targets):
            rows = np.flatnonzero((measured.target == index) & (measured.against == number))
            if at_ball is not None:
                rows = rows[measured.configuration[rows] != at_ball]
            if not len(rows):
                continue
            lengths = measured.distance[rows]
            inside = np.isfinite(lengths)
            before = None if nominal is None else _judged(nominal, measured, rows, target, at_ball)
            after = _judged(arm, measured, rows, target, at_ball)
            spheres.append(OneSphere(target, fixture, lengths[inside], int((~inside).sum()), before, after))
    found = SphereTests(
        arm,
        measured.source,
        tuple(spheres),
        taught,
        call,
        (*changed_since(robot), *told_of(arm)),
        files_of(robot, data),
        parts_of((arm, measured)),
    )
    if page is not None:
        found.save(page)
    return found


def _judged(model: Robot, data: Dataset, rows: NDArray[np.intp], target: str, at_ball: int | None) -> SphereTest:
    """Return the test of some readings by a model."""
    assert data.distance is not None
    centre = None if at_ball is None else _centre(model, data, at_ball)
    with refusals_of("data"):
        return sphere_test(model, data.postures.at(data.configuration[rows]), data.distance[rows], target, centre)


def _nominal(robot: Robot) -> Robot | None:
    """Return the nominal robot with the targets where its own flange has them; None if the robot is nominal itself."""
    try:
        nominal = nominal_robot(robot)
    except InputError:
        return None
    flange = np.linalg.inv(best_agreement(robot)[1])
    places = {}
    for target in robot.targets:
        at = np.array([robot.values[target.parameter(axis)] for axis in "xyz"])
        places[target.name] = flange[:3, :3] @ at + flange[:3, 3]
    return nominal.with_frames(IDENTITY, places)


def _taught(data: Dataset, name: str) -> int:
    """Return which configuration has a name, or refuse one at which it is not clear what was at the ball."""
    if name not in data.labels:
        raise InputError(
            "the measurements have no configuration of this name",
            parameter="taught",
            where=data.source,
            came=name,
            cure="Name the configuration at which the target was brought to the ball.",
        )
    number = data.labels.index(name)
    targets = np.unique(data.target[data.configuration == number])
    if len(targets) > 1:
        raise InputError(
            "it is not clear which target was brought to the ball",
            parameter="taught",
            where=f"{data.source}, configuration {name}",
            came=", ".join(data.targets[k] for k in targets),
            cure="Leave the row of that target alone in this configuration.",
        )
    return number


def _centre(model: Robot, data: Dataset, number: int) -> Array:
    """Return where a model says that the ball is [m], ``(3,)``."""
    target = data.targets[int(data.target[data.configuration == number][0])]
    return np.asarray(model.world_poses(data.postures.at(np.array([number])), target)[0][0])
