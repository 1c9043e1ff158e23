"""Tilt, backlash and stiffness of the joints from inclinometers first, then the geometry from poses."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.engine.base.errors import InputError, Notice, counted, has_error, name_parameter, refusals_of, wrong_kind
from truearm.engine.base.files import path_argument, read_bytes
from truearm.engine.base.units import SHOWN_AS, from_si
from truearm.engine.base.version import __version__
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.command.arguments import (
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
from truearm.engine.command.groups import Train
from truearm.engine.command.split import train_count
from truearm.engine.data.checks import check_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.inclinations import Inclinations, InclinometerReadings
from truearm.engine.document.records import Record, notice_lines, notice_summaries
from truearm.engine.document.summaries import error_line
from truearm.engine.fit.models import MODELS
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import is_robot, urdf_source
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.proof import Proof
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.seal import sealed
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.inclinometers.fit import TILTING, TiltingFit, calibrate_tilting, check_tilting, seen
from truearm.inclinometers.mounting import Mounting, find_mounting
from truearm.inclinometers.reading import read_inclinations

#: What tilting writes into its folder, and the report of the geometry where poses were given.
TILTING_FILES: Final = ("calibrated.yaml", "result.json", "report.html", "calibrated.urdf")
GEOMETRY: Final = "geometry.html"

_SHOWN: Final = {"clearance": "tilt", "backlash": "backlash", "compliance": "compliance"}

#: Steps that only a calibration can take: here the effects are chosen.
_OF_CALIBRATE: Final = ("other-model", "give-loads")


@dataclass(frozen=True, eq=False, repr=False)
class Tilting(Record):
    """What inclinometers told of the joints, and what poses told of the geometry with that held."""

    fit: TiltingFit  #: The first stage: tilt, backlash and compliance of every joint.
    robot: Robot  #: With all that was found, and what is known about it.
    read: Inclinations  #: What the inclinometers read.
    changes: InclinometerReadings  #: By how much that changed within pairs.
    mounting: Mounting  #: How the instruments sit on their links.
    pushed: int  #: How many configurations with poses under loads there were beside.
    geometry: Calibration | None  #: The second stage, with tilt, backlash and compliance held; None without poses.
    geometry_alone: Calibration | None  #: The same calibration without them, for comparison; None without poses.
    notices: tuple[Notice, ...]  #: What to know about the first stage.
    command: str  #: How to run it again.
    urdf: bytes | None = None  #: The user's own URDF, if that is where the robot came from.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    notes: dict[str, str] = field(default_factory=dict)  #: What the user noted, by its name.

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about both stages."""
        return self.notices if self.geometry is None else (*self.notices, *self.geometry.warnings)

    @property
    def finished(self) -> bool:
        """Whether the figures of both stages can be believed."""
        return not has_error(self.notices) and (self.geometry is None or self.geometry.finished)

    @property
    def used(self) -> int:
        """How many changes of inclination were used."""
        return int(np.isfinite(self.fit.left).sum())

    @cached_property
    def sizes(self) -> tuple[float, float]:
        """Root mean square of the changes that were used, and of what is left of them [rad]."""
        used = np.isfinite(self.fit.left)
        return tuple(float(np.sqrt(np.mean(values[used] ** 2))) for values in (self.changes.change, self.fit.left))  # type: ignore[return-value]

    def constants(self) -> list[dict[str, Any]]:
        """Return every constant of the joints, as JSON holds it."""
        rows = []
        for name in sorted(self.fit.names, key=lambda name: (_number(name), [*_SHOWN].index(name.rpartition("_")[0]))):
            p = self.fit.robot.parameters[name]
            unit = SHOWN_AS[p.unit]
            rows.append(
                {
                    "name": name,
                    "joint": _number(name),
                    "effect": name.rpartition("_")[0],
                    "unit": unit,
                    "value": from_si(p.value, unit),
                    "deviation": from_si(p.deviation or p.prior, unit),
                    "informed": p.informed,
                    "seen": seen(p),
                }
            )
        return rows

    def summary(self) -> dict[str, Any]:
        """Return the figures as ``result.json`` begins with them."""
        changed, left = (math.degrees(size) for size in self.sizes)
        return {
            "status": "converged" if self.fit.converged else "not-converged",
            "warnings": notice_summaries(self.notices),
            "inclinations": {
                "pairs": len(self.read.pairs),
                "changes": self.used,
                "rms_deg": changed,
                "left_deg": left,
                "excess": self.fit.excess,
                "pushed": self.pushed,
            },
            "constants": self.constants(),
            "geometry": None if self.geometry is None else self.geometry.summary(),
            "geometry_alone": None if self.geometry_alone is None else self.geometry_alone.summary(),
        }

    def result(self) -> dict[str, Any]:
        """Return what ``result.json`` holds: the summary, how the instruments sit, and every parameter."""
        return {
            "truearm": "truearm-tilting/1",
            **self.summary(),
            "command": self.command,
            **({"notes": self.notes} if self.notes else {}),
            "instruments": self.seats(),
            **({} if self.geometry is None else {"calibration": self.geometry.result()}),
        }

    def seats(self) -> list[dict[str, Any]]:
        """Return how far each instrument is turned on its link, and its zeros, as JSON holds them."""
        return [
            {
                "name": name,
                "turned_deg": math.degrees(float(turn)),
                "zero_deg": {axis: math.degrees(z) for axis, z in zip("xyz", zero.tolist(), strict=True) if z == z},
            }
            for name, turn, zero in zip(
                self.read.instruments.names, self.mounting.turns, self.mounting.zeros, strict=True
            )
        ]

    def lines(self) -> list[str]:
        """Return what was found of every joint, then what that does to the errors of poses."""
        changed, left = (math.degrees(size) for size in self.sizes)
        beside = f" and {counted(self.pushed, 'configuration')} of poses under loads" if self.pushed else ""
        over = f"{self.fit.excess:.2f} times" if self.fit.excess > 1.0 else "no more than"
        text = [
            f"From {counted(self.used, 'change')} of inclination in {counted(len(self.read.pairs), 'pair')}{beside}:",
            f"  rms {changed:.4f} deg, left {left:.5f} deg, {over} what is declared",
        ]
        rows = self.constants()
        for joint in dict.fromkeys(row["joint"] for row in rows):
            parts = [_words(row) for row in rows if row["joint"] == joint]
            text.append(f"  joint {joint}: {', '.join(parts)}")
        if self.geometry is not None and self.geometry_alone is not None:
            after, alone = self.geometry, self.geometry_alone
            part = "the fit has not seen" if after.validation is not None else "it was trained on"
            judged = after.validation or after.train
            text.append(f"On {counted(judged.configurations, 'configuration')} {part}:")
            text.append(f"  nominal          {error_line(alone.nominal)}")
            text.append(f"  geometry alone   {error_line(alone.validation or alone.train)}")
            text.append(f"  tilting first    {error_line(judged)}")
            text.append(f"Status of the geometry: {after.status.value}. {after.advice}".rstrip())
            text += [step.line for step in after.next if step.code not in _OF_CALIBRATE]
        return text + notice_lines(self.warnings)

    def save(self, folder: str | Path, progress: Callable[[str], None] = lambda _: None) -> tuple[Path, ...]:
        """Write ``calibrated.yaml``, ``result.json``, ``report.html`` and ``calibrated.urdf`` into a folder.

        Where poses were given, ``geometry.html`` is the full report of the second stage.

        Returns:
            The files written.
        """
        from truearm.calibration.report import report_html
        from truearm.engine.robot.urdf import calibrated_urdf
        from truearm.engine.robot.urdf_writing import urdf_text
        from truearm.inclinometers.report import tilting_html

        folder = output_folder(folder, (*TILTING_FILES, GEOMETRY), self.inputs, ours=True)
        progress("drawing the report")
        files: dict[str, str | bytes] = {
            "calibrated.yaml": robot_text(self.robot),
            "result.json": json.dumps(self.result(), indent=2, allow_nan=False) + "\n",
            "report.html": tilting_html(self),
            "calibrated.urdf": calibrated_urdf(self.urdf, self.robot)[0] if self.urdf else urdf_text(self.robot)[0],
        }
        if self.geometry is not None:
            files[GEOMETRY] = report_html(self.geometry)
        progress("writing the files")
        write_files(folder, files, self.command)
        return tuple(folder / name for name in files)


def _number(name: str) -> int:
    return int(name.rpartition("_")[2])


def _words(row: dict[str, Any]) -> str:
    """Return a constant in words, such as ``backlash 0.0609 deg (0.0001)``."""
    word = _SHOWN[row["effect"]]
    if not row["seen"]:
        return f"{word} not seen"
    places = max(0, 1 - math.floor(math.log10(max(row["deviation"], 1e-9))))
    return f"{word} {row['value']:.{places}f} ({row['deviation']:.{places}f}) {row['unit']}"


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
