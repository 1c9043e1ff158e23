"""Tilt, backlash and stiffness of the joints from inclinometers first, then the geometry from poses."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.engine.base.errors import (
    InputError,
    Notice,
    Rule,
    counted,
    has_error,
    name_parameter,
    refusals_of,
    wrong_kind,
)
from truearm.engine.base.files import path_argument, read_bytes
from truearm.engine.base.units import SHOWN_AS, from_si
from truearm.engine.base.version import __version__
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.command.arguments import (
    files_of,
    folder_for,
    readings_argument,
    refuse_swapped,
    robot_argument,
)
from truearm.engine.command.split import train_count
from truearm.engine.data.checks import check_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.inclinations import Inclinations, InclinometerReadings
from truearm.engine.document.document import Block, detail, say
from truearm.engine.document.records import Record, notice_summaries
from truearm.engine.document.summaries import error_line
from truearm.engine.fit.models import MODELS as EVERY_MODEL
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import is_robot, urdf_source
from truearm.engine.robot.proof import Proof
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.seal import sealed
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.inclinometers.fit import TILTING, TiltingFit, calibrate_tilting, check_tilting, seen
from truearm.inclinometers.mounting import Mounting, find_mounting
from truearm.inclinometers.reading import read_inclinations

if TYPE_CHECKING:
    from truearm.inclinometers.jobs import FindTilting

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
    def written(self) -> tuple[str, ...]:
        """Names of the files that hold it."""
        return TILTING_FILES if self.geometry is None else (*TILTING_FILES, GEOMETRY)

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

    def blocks(self) -> Iterator[Block]:
        """Give what was found of every joint, then what that does to the errors of poses."""
        changed, left = (math.degrees(size) for size in self.sizes)
        beside = f" and {counted(self.pushed, 'configuration')} of poses under loads" if self.pushed else ""
        over = f"{self.fit.excess:.2f} times" if self.fit.excess > 1.0 else "no more than"
        # Without poses this is the answer.
        tell = say if self.geometry is None else detail
        yield tell(
            f"From {counted(self.used, 'change')} of inclination in {counted(len(self.read.pairs), 'pair')}{beside}:",
            f"  rms {changed:.4f} deg, left {left:.5f} deg, {over} what is declared",
            status="converged" if self.fit.converged else "not-converged",
            inclinations={
                "pairs": len(self.read.pairs),
                "changes": self.used,
                "rms_deg": changed,
                "left_deg": left,
                "excess": self.fit.excess,
                "pushed": self.pushed,
            },
        )
        rows = self.constants()
        joints = dict.fromkeys(row["joint"] for row in rows)
        words = {joint: ", ".join(_words(row) for row in rows if row["joint"] == joint) for joint in joints}
        yield tell(*(f"  joint {joint}: {text}" for joint, text in words.items()), constants=rows)
        after, alone = self.geometry, self.geometry_alone
        yield say(
            geometry=None if after is None else after.summary(),
            geometry_alone=None if alone is None else alone.summary(),
        )
        if after is not None and alone is not None:
            part = "the fit has not seen" if after.validation is not None else "it was trained on"
            judged = after.validation or after.train
            yield say(
                f"On {counted(judged.configurations, 'configuration')} {part}:",
                f"  nominal          {error_line(alone.nominal)}",
                f"  geometry alone   {error_line(alone.validation or alone.train)}",
                f"  tilting first    {error_line(judged)}",
                f"Status of the geometry: {after.status.value}. {after.advice}".rstrip(),
                *(step.line for step in after.next if step.code not in _OF_CALIBRATE),
            )

    def summary(self) -> dict[str, Any]:
        """Return the figures as ``result.json`` begins with them; the geometry holds its own notices."""
        return {**super().summary(), "warnings": notice_summaries(self.notices)}

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
MODELS: Final = tuple(model.name for model in EVERY_MODEL if not set(model.effects) & set(TILTING))


@dataclass(frozen=True, eq=False)
class _Read:
    robot: Robot  #: With its loads.
    urdf: bytes | None  #: The user's own, if that is where the robot came from.
    inclinations: Inclinations
    pushed: Dataset | None
    poses: Dataset | None


@dataclass(frozen=True, eq=False)
class _First:
    """What inclinometers told."""

    fit: TiltingFit
    robot: Robot  #: With what is known of its constants.
    changes: InclinometerReadings
    mounting: Mounting
    notices: tuple[Notice, ...]


def tilting_identified(asked: FindTilting) -> Tilting:
    """Read, find tilt, backlash and stiffness, then the geometry, and write both."""
    refuse_swapped(asked.robot, asked.inclinations, "tilting")
    sources = asked.robot, asked.inclinations, asked.poses, asked.pushed
    inputs = files_of(*sources)
    if asked.out is not None:
        folder_for((*TILTING_FILES, GEOMETRY), asked.out, *sources, ours=True)
    read = _read(asked)
    first = _first(asked, read)
    geometry = alone = None
    notices = first.notices
    if read.poses is not None:
        geometry, alone = _geometry(asked, read, first)
        notices = (*notices, *_compared(geometry, alone))
    tilting = Tilting(
        fit=first.fit,
        robot=first.robot if geometry is None else geometry.robot,
        read=read.inclinations,
        changes=first.changes,
        mounting=first.mounting,
        pushed=0 if read.pushed is None else read.pushed.configurations,
        geometry=geometry,
        geometry_alone=alone,
        notices=notices,
        command=asked.again,
        urdf=read.urdf,
        inputs=inputs,
        notes=dict(asked.notes or {}),
    )
    if asked.out is not None:
        tilting.save(asked.out, asked.progress)
    return tilting


def _read(asked: FindTilting) -> _Read:
    """Read robot and data."""
    asked.progress("reading the robot")
    source = urdf_source(asked.robot) if isinstance(asked.robot, str | Path) else None
    robot = asked.loads.on(robot_argument(asked.robot))
    if not robot.layout.turning:
        raise InputError("no joint of this robot turns, so no link leans", parameter="robot", where=robot.name)
    asked.progress("reading the data")
    inclinations = _inclinations(robot, asked.inclinations)
    pushed = None if asked.pushed is None else readings_argument(robot, asked.pushed, "pushed")
    poses = None if asked.poses is None else readings_argument(robot, asked.poses, "poses")
    robot = robot.marked(any(data is not None and data.simulated for data in (inclinations, pushed)))
    if poses is not None:
        with refusals_of("train"):
            train_count(asked.train, poses.configurations, poses.source)
    return _Read(robot, None if source is None else read_bytes(source[0]), inclinations, pushed, poses)


def _first(asked: FindTilting, read: _Read) -> _First:
    """Find tilt, backlash and stiffness of the joints."""
    start, inclinations = read.robot, read.inclinations
    with refusals_of("inclinations"):
        asked.progress("finding how the instruments sit")
        mounting = find_mounting(start, inclinations)
        changes = inclinations.changes(start, mounting.mounts)
        if not len(changes.pairs):
            raise InputError(
                "no two configurations can be compared",
                where=inclinations.source,
                came=counted(len(inclinations.labels), "configuration"),
                allowed="those of the orders 1 and 2, 3 and 4 and so on",
            )
    asked.progress(f"identifying tilt, backlash and stiffness from {counted(len(changes.pairs), 'pair')}")
    try:
        fit = calibrate_tilting(start, changes, read.pushed)
    except InputError as error:
        of_poses = read.pushed is not None and error.where == read.pushed.source
        name_parameter(error, "pushed" if of_poses else "inclinations")
        raise
    notices = (*check_tilting(start, fit, inclinations, pushed=read.pushed is not None), *mounting.notices)
    proven = _proven(start, fit, inclinations, changes.pairs.in_turn.joints, notices)
    return _First(fit, proven, changes, mounting, notices)


def _geometry(asked: FindTilting, read: _Read, first: _First) -> tuple[Calibration, Calibration]:
    """Identify the geometry with what was found held, and alone."""
    options: Any = {
        "model": asked.model,
        "train": asked.train,
        "seed": asked.seed,
        "notes": asked.notes,
        "command": asked.again,
    }
    assert read.poses is not None
    with refusals_of("poses"):
        asked.progress("identifying the geometry with these held")
        geometry = _with_constants(calibrate(first.robot, read.poses, **options), first.fit)
        asked.progress("identifying the geometry alone, for comparison")
        return geometry, calibrate(read.robot, read.poses, **options)


def _inclinations(robot: Robot, source: object) -> Inclinations:
    """Return what inclinometers read, at the joint positions of the robot's model."""
    if isinstance(source, Inclinations):
        read = source
    elif isinstance(source, str | Path):
        path = path_argument(source, "inclinations")
        if is_robot(source):
            raise InputError(
                "this is a robot, and what inclinometers read belongs here",
                parameter="inclinations",
                came=str(source),
                allowed="a CSV file of inclinations",
            )
        with refusals_of("inclinations"):
            read = read_inclinations(path)
    else:
        raise wrong_kind("inclinations belong here", source, "inclinations", "Inclinations, or a CSV file of them")
    with refusals_of("inclinations"):
        check_joints(robot, read)
        if read.joints_are != "controller":
            return read
        robot.controller.check_counts(robot.name, f"{read.source}, column axis_1")
        return replace(read, joints=robot.controller.to_model(read.joints), joints_are="converted")


def _proven(robot: Robot, fit: TiltingFit, read: Inclinations, joints: Array, notices: Sequence[Notice]) -> Robot:
    """Return the robot of the first stage with what is known of its constants."""
    history = (
        f"tilt, backlash and compliance by inclinometers with truearm {__version__}:"
        f" {counted(len(read.pairs), 'pair')} of {Path(read.source).name}"
    )
    parameters = [fit.robot.parameters[name] for name in fit.names]
    region = list(zip(joints.min(axis=0).tolist(), joints.max(axis=0).tolist(), strict=True))
    proof = Proof.of(
        "converged" if fit.converged else "not-converged",
        [notice for notice in notices if notice.level == "error"],
        region,
        np.zeros(len(robot.joints)),
        parameters,
        fit.covariance,
        lower_bound=not all(map(seen, parameters)),
    )
    identified = replace(fit.robot, history=(*fit.robot.history, history), tools={}, truths={}, proof=None)
    return sealed(identified, proof)


TILTING_NOT_BETTER: Final = Rule(
    "tilting-not-better",
    "warning",
    "geometry alone leaves no more of the poses: the joints tilt less than is known of them, or something else is "
    "wrong",
    cure="Calibrate without them.",
    gravity=2,
)


def _compared(geometry: Calibration, alone: Calibration) -> list[Notice]:
    """Say if the constants do not help the poses."""
    errors = [calibration.validation or calibration.train for calibration in (geometry, alone)]
    after, before = (error.position or error.length for error in errors)
    if after is None or before is None or after.mean < before.mean:
        return []
    return [
        TILTING_NOT_BETTER(
            f"With tilt, backlash and compliance of the joints the poses are missed by {after.mean * 1e3:.3f} mm, by "
            f"the geometry alone by {before.mean * 1e3:.3f} mm: the joints of this robot tilt less than is known of "
            "them, or something else is wrong with it or with the inclinations."
        )
    ]


def _with_constants(geometry: Calibration, fit: TiltingFit) -> Calibration:
    """Return the second stage with what is known of the constants that it held."""
    known = [fit.robot.parameters[name] for name in fit.names]
    return replace(geometry, fit=replace(geometry.fit, robot=geometry.fit.robot.with_parameters(known)))
