"""Tilt, backlash and stiffness of the joints from inclinometers first, then the geometry from poses."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from truearm import __version__
from truearm.errors import InputError, name_parameter, refusals_of, wrong_kind
from truearm.files import path_argument, read_bytes
from truearm.identification.inclinometers.fit import TILTING, TiltingFit, calibrate_tilting
from truearm.identification.inclinometers.judging import check_tilting, seen
from truearm.identification.inclinometers.mounting import find_mounting
from truearm.identification.solving.models import MODELS
from truearm.jobs.arguments import (
    choice_argument,
    command_argument,
    files_of,
    folder_for,
    gravity_argument,
    notes_argument,
    payload_argument,
    progress_argument,
    python_call,
    readings_argument,
    refuse_swapped,
    robot_argument,
    whole_argument,
)
from truearm.jobs.calibrate import Train, calibrate
from truearm.jobs.split import train_count
from truearm.library import is_robot, urdf_source
from truearm.measurement.checks import check_joints
from truearm.measurement.dataset import Dataset
from truearm.measurement.inclinometer import Inclinations
from truearm.measurement.readers.inclinations import read_inclinations
from truearm.modeling.chain import Array
from truearm.modeling.formats.robot_file import sealed
from truearm.modeling.parts import Payload
from truearm.modeling.proof import Proof
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.results.calibration import Calibration
from truearm.results.tilting import GEOMETRY, TILTING_FILES, Tilting
from truearm.shown import counted

#: Models that leave tilt, backlash and stiffness as the inclinometers told them.
_MODELS: Final = {model.name: model for model in MODELS if not set(model.effects) & set(TILTING)}


def tilting(
    robot: Robot | str | Path,
    inclinations: Inclinations | str | Path,
    poses: Dataset | str | Path | None = None,
    *,
    pushed: Dataset | str | Path | None = None,
    out: str | Path | None = None,
    model: str = "geometric",
    train: Train = None,
    seed: int = 0,
    payload: Payload | str | None = None,
    gravity: Sequence[float] | None = None,
    notes: Mapping[str, str] | None = None,
    command: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Tilting:
    """Find tilt, backlash and stiffness of every joint by inclinometers, then the geometry with these held.

    Parameters
    ----------
    robot
        Nominal, or what :func:`truearm.load_robot` takes. Tilt, backlash and compliance are looked for anew.
    inclinations
        What inclinometers on the links read, or a CSV file of it.
    poses
        Readings of targets for the geometry, or a canonical CSV file; None ends after the first stage.
    pushed
        Readings of targets in pairs of configurations at the same joint positions under two forces, which tell what
        inclinometers cannot see: a joint whose axis stands upright. They are not used for the geometry.
    out
        Folder for calibrated.yaml, result.json, report.html, calibrated.urdf and, with poses, geometry.html; None
        writes nothing, see :meth:`Tilting.save`.
    model
        What the poses are to tell: ``offsets``, ``joints`` or ``geometric``.
    train, seed
        Split of the poses, as in :func:`truearm.calibrate`.
    payload, gravity
        What the robot carried (an object, or a text such as ``2.7kg,50mm,25mm,100mm``), beside what the file of
        inclinations says of single configurations, and free fall in its base frame [m/s^2].
    notes
        What to write on the report and into result.json, by its name.
    command
        How to run it again, for the report; None writes the call in Python.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        For anything that cannot be used, with a message that says what to do.
    """
    progress_argument(progress)
    choice_argument(model, "model", _MODELS)
    seed, notes = whole_argument(seed, "seed"), notes_argument(notes)
    carried, fall = payload_argument(payload), gravity_argument(gravity)
    call = command_argument(command) or python_call(
        "tilting",
        robot,
        inclinations,
        poses,
        pushed=pushed,
        model=model,
        train=train,
        seed=seed,
        payload=carried,
        gravity=fall,
        notes=notes or None,
    )
    refuse_swapped(robot, inclinations, "tilting")
    given = robot, inclinations, poses, pushed
    inputs = files_of(*given)
    folder = None if out is None else folder_for((*TILTING_FILES, GEOMETRY), out, *given, ours=True)
    progress("reading the robot")
    source = urdf_source(robot) if isinstance(robot, str | Path) else None
    start = robot_argument(robot).with_payload(carried, fall)
    if not start.layout.turning:
        raise InputError("no joint of this robot turns, so no link leans", parameter="robot", where=start.name)
    progress("reading the data")
    read = _inclinations(start, inclinations)
    pairs = None if pushed is None else readings_argument(start, pushed, "pushed")
    measured = None if poses is None else readings_argument(start, poses, "poses")
    start = start.marked(any(one is not None and one.simulated for one in (read, pairs)))
    if measured is None:
        if train is not None:
            raise InputError("there are no poses to split", parameter="train", cure="Give `poses`, or leave it out.")
    else:
        with refusals_of("train"):
            train_count(train, measured.configurations, measured.source)
    with refusals_of("inclinations"):
        progress("finding how the instruments sit")
        mounting = find_mounting(start, read)
        changes = read.changes(start, mounting.mounts)
        if not len(changes.pairs):
            raise InputError(
                "no two configurations can be compared",
                where=read.source,
                came=counted(len(read.labels), "configuration"),
                allowed="those of the orders 1 and 2, 3 and 4 and so on",
            )
    progress(f"identifying tilt, backlash and stiffness from {counted(len(changes.pairs), 'pair')}")
    try:
        fit = calibrate_tilting(start, changes, pairs)
    except InputError as error:
        of_poses = pairs is not None and error.where == pairs.source
        name_parameter(error, "pushed" if of_poses else "inclinations")
        raise
    told = (*check_tilting(start, fit, read, pushed=pairs is not None), *mounting.notices)
    found = _proven(start, fit, read, changes.pairs.in_turn.joints, told)
    geometry = alone = None
    if measured is not None:
        with refusals_of("poses"):
            progress("identifying the geometry with these held")
            options = {"model": model, "train": train, "seed": seed, "notes": notes, "command": call}
            geometry = _with_constants(calibrate(found, measured, **options), fit)  # type: ignore[arg-type]
            progress("identifying the geometry alone, for comparison")
            alone = calibrate(start, measured, **options)  # type: ignore[arg-type]
        told = (*told, *_compared(geometry, alone))
    made = Tilting(
        fit=fit,
        robot=found if geometry is None else geometry.robot,
        read=read,
        changes=changes,
        mounting=mounting,
        pushed=0 if pairs is None else pairs.configurations,
        geometry=geometry,
        geometry_alone=alone,
        notices=told,
        command=call,
        urdf=None if source is None else read_bytes(source[0]),
        inputs=inputs,
        notes=notes,
    )
    if folder is not None:
        made.save(folder, progress)
    return made


def _inclinations(robot: Robot, given: object) -> Inclinations:
    """Return what inclinometers read, at the joint positions of the robot's model."""
    if isinstance(given, Inclinations):
        read = given
    elif isinstance(given, str | Path):
        path = path_argument(given, "inclinations")
        if is_robot(given):
            raise InputError(
                "this is a robot, and what inclinometers read belongs here",
                parameter="inclinations",
                came=str(given),
                allowed="a CSV file of inclinations",
            )
        with refusals_of("inclinations"):
            read = read_inclinations(path)
    else:
        raise wrong_kind("inclinations belong here", given, "inclinations", "Inclinations, or a CSV file of them")
    with refusals_of("inclinations"):
        check_joints(robot, read)
        if read.joints_are != "controller":
            return read
        robot.controller.check_counts(robot.name, f"{read.source}, column axis_1")
        return replace(read, joints=robot.controller.to_model(read.joints), joints_are="converted")


def _proven(robot: Robot, fit: TiltingFit, read: Inclinations, joints: Array, told: Sequence[Notice]) -> Robot:
    """Return the robot of the first stage with what is known of its constants."""
    history = (
        f"tilt, backlash and compliance by inclinometers with truearm {__version__}:"
        f" {counted(len(read.pairs), 'pair')} of {Path(read.source).name}"
    )
    parameters = [fit.robot.parameters[name] for name in fit.names]
    region = list(zip(joints.min(axis=0).tolist(), joints.max(axis=0).tolist(), strict=True))
    proof = Proof.of(
        "converged" if fit.converged else "not-converged",
        [notice for notice in told if notice.level == "error"],
        region,
        np.zeros(len(robot.joints)),
        parameters,
        fit.covariance,
        lower_bound=not all(map(seen, parameters)),
    )
    made = replace(fit.robot, history=(*fit.robot.history, history), tools={}, truths={}, proof=None)
    return sealed(made, proof)


def _compared(geometry: Calibration, alone: Calibration) -> list[Notice]:
    """Say if the constants do not help the poses."""
    errors = [one.validation or one.train for one in (geometry, alone)]
    after, before = (error.position or error.length for error in errors)
    if after is None or before is None or after.mean < before.mean:
        return []
    return [
        Notice(
            "tilting-not-better",
            f"With tilt, backlash and compliance of the joints the poses are missed by {after.mean * 1e3:.3f} mm, by "
            f"the geometry alone by {before.mean * 1e3:.3f} mm: the joints of this robot tilt less than is known of "
            "them, or something else is wrong with it or with the inclinations. Calibrate without them.",
        )
    ]


def _with_constants(geometry: Calibration, fit: TiltingFit) -> Calibration:
    """Return the second stage with what is known of the constants that it held."""
    known = [fit.robot.parameters[name] for name in fit.names]
    return replace(geometry, fit=replace(geometry.fit, robot=geometry.fit.robot.with_parameters(known)))
