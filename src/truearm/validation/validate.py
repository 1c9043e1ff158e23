"""The errors of a calibrated robot on new measurements."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

from truearm.engine.base.errors import (
    InputError,
    Notice,
    Rule,
    counted,
    name_parameter,
    name_place,
    refusals_of,
)
from truearm.engine.base.files import path_argument, read_bytes
from truearm.engine.base.manifest import hash_of, sets_in
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.command.arguments import (
    data_argument,
    files_of,
    pushed_at_argument,
    readings_argument,
    refuse_swapped,
    robot_argument,
    wrench_argument,
)
from truearm.engine.command.split import TRAINING_DATA, calibration_errors, changed_since, training_of
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import Errors, Spread, errors_of
from truearm.engine.data.thinning import check_duplicates
from truearm.engine.diagnose.expected_error import error_by_order
from truearm.engine.diagnose.external_force import check_force, check_other_payload, check_payload
from truearm.engine.diagnose.least_error import Kind, LeastError, least_errors
from truearm.engine.diagnose.next_step import NextStep
from truearm.engine.document.document import Block, each, say
from truearm.engine.document.records import Record
from truearm.engine.document.summaries import error_line, errors_summary, least_block, refit_block
from truearm.engine.fit.refit import Refit
from truearm.engine.fit.refit import refit as find_moved
from truearm.engine.fit.zones import ZonedRobot, zoned_robot
from truearm.engine.robot.effects.warm_up import LEFT
from truearm.engine.robot.proof import BASE
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.wrench import Wrench
from truearm.validation.frames import check_frames, check_names, check_proof
from truearm.validation.region import (
    OrientationErrors,
    RegionDistances,
    distance_block,
    orientation_block,
    orientation_errors,
    region_distances,
)

if TYPE_CHECKING:
    from truearm.engine.command.groups import Loads
    from truearm.validation.jobs import Validate

#: What a validation writes into its folder.
VALIDATION_FILES: Final = ("result.json", "report.html")


@dataclass(frozen=True, eq=False, repr=False)
class Validation(Record):
    """Errors of a robot on measurements."""

    source: str  #: The measurements, for messages.
    errors: Errors  #: Predicted minus measured, reading by reading.
    warnings: tuple[Notice, ...] = ()  #: What to know about them, in plain words.
    #: What was found anew from these measurements, if anything was; `errors` then judge each configuration by what is
    #: found without it.
    refit: Refit | None = None
    notes: dict[str, str] = field(default_factory=dict)  #: What the user noted, by its name.
    #: Orientation errors by their parts; None if no orientation was read.
    orientations: OrientationErrors | None = None
    #: How far the readings lie from where the robot was calibrated; None where it does not know.
    distances: RegionDistances | None = None
    next: tuple[NextStep, ...] = ()  #: What to do next.
    robot: Robot | None = None  #: robot, data: what was compared.
    data: Dataset | None = None
    #: For each zone, and for elsewhere by an empty name, how many configurations lie in it and their mean error [m];
    #: None of a robot without zones.
    zones: dict[str, tuple[int, float]] | None = None
    command: str = ""  #: How to run it again.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.

    @property
    def written(self) -> tuple[str, ...]:
        """Names of its files."""
        return VALIDATION_FILES

    @property
    def position(self) -> Spread | None:
        """Statistics of position errors over single readings [m]; None where no position was read."""
        return self.errors.position

    @property
    def orientation(self) -> Spread | None:
        """Statistics of orientation errors over single readings [rad]; None where no orientation was read."""
        return self.errors.orientation

    @property
    def length(self) -> Spread | None:
        """Statistics of errors of distances and heights [m]; None where none was read."""
        return self.errors.length

    @cached_property
    def least(self) -> Mapping[Kind, LeastError]:
        """The mean errors that exact parameters would leave, as far as visits or declared deviations tell them."""
        return {} if self.robot is None or self.data is None else least_errors(self.robot, self.data, self.data)

    def blocks(self) -> Iterator[Block]:
        """Give the errors, their parts, and where the readings lie, in mm and mrad."""
        configurations = counted(self.errors.configurations, "configuration")
        yield say(
            f"On {configurations} of {self.source}:",
            f"  {error_line(self.errors, self.least)}",
            **errors_summary(self.errors),
        )
        if self.orientations is not None:
            yield orientation_block(self.orientations)
        if self.distances is not None:
            yield distance_block(self.distances)
        if self.zones is not None:
            yield each(
                "zones",
                (
                    say(
                        f"  {f'zone {name}' if name else 'elsewhere'}: {mean * 1e3:.3f} mm on "
                        f"{counted(count, 'configuration')}",
                        zone=name or None,
                        configurations=count,
                        mean_mm=mean * 1e3,
                    )
                    for name, (count, mean) in self.zones.items()
                ),
            )
        if self.refit is not None:
            yield refit_block(self.refit)
        yield least_block(self.errors, self.least)
        if self.notes:
            yield say(*(f"{name}: {note}" for name, note in self.notes.items()), notes=self.notes)

    @staticmethod
    def folder(out: str | Path, inputs: Iterable[Path] = (), parameter: str = "folder") -> Path:
        """Return the folder for a validation, or refuse one whose result.json or report.html are of something else."""
        folder = output_folder(out, VALIDATION_FILES, tuple(inputs), parameter, ours=True)
        for file_set in sets_in(folder):
            others = [name for name in file_set.files if name not in VALIDATION_FILES]
            if others and any(name in file_set.files for name in VALIDATION_FILES):
                raise InputError(
                    "result.json and report.html there belong to another result",
                    parameter=parameter,
                    where=str(folder),
                    came=f"the folder of {others[0]}",
                    cure="Choose another folder.",
                )
        return folder

    def save(self, folder: str | Path, progress: Callable[[str], None] = lambda _: None) -> tuple[Path, ...]:
        """Write ``result.json`` and ``report.html`` into a folder.

        Returns:
            The files written.
        """
        from truearm.validation.report import validation_html

        folder = self.folder(folder, self.inputs)
        progress("drawing the report")
        content = {"truearm": "truearm-validation/1", "source": self.source, **self.summary(), "command": self.command}
        files = {
            "result.json": json.dumps(content, indent=2, allow_nan=False) + "\n",
            "report.html": validation_html(self),
        }
        progress("writing the files")
        write_files(folder, files, self.command)
        return tuple(folder / name for name in files)


@dataclass(frozen=True, eq=False)
class _Read:
    robot: Robot  #: With what it carried, and what acted on it.
    as_calibrated: Robot  #: With what acts on it, and the loads of its file.
    data: Dataset
    digest: str | None  #: SHA-256 of the data's file.
    notices: tuple[Notice, ...]  #: What is to be known about the robot's file and what moved.
    other_session: tuple[Notice, ...]  #: What is to be known about its warmth.


@dataclass(frozen=True, eq=False)
class _Judged:
    """Errors, and by which robot."""

    robot: Robot
    errors: Errors
    refit: Refit | None
    mistaken: tuple[Notice, ...]  #: What looks exchanged, moved, or beyond what was promised.


def validated(asked: Validate) -> Validation:
    """Read, judge, write."""
    refuse_swapped(asked.robot, asked.data, "validate")
    zoned = zoned_robot(asked.robot)
    inputs = files_of(asked.robot, asked.data)
    folder = None if asked.out is None else Validation.folder(asked.out, inputs, "out")
    read = _read(asked, zoned)
    _refuse_unplaced(asked, read)
    judged = _judged(asked, read)
    errors, of_zones = judged.errors, None
    if zoned is not None:
        errors = zoned.errors(read.robot, read.data)
        of_zones = zoned.means(read.data, errors)
    warnings = (
        *read.notices,
        *calibration_errors(read.robot),
        *judged.mistaken,
        *check_duplicates(read.data),
        *read.other_session,
        *check_payload(read.robot),
        *check_other_payload(read.as_calibrated, [read.robot.payload]),
        *check_force([(read.robot, read.data.postures)]),
        *_seen_in_training(read.robot, read.data, read.digest),
    )
    distances = region_distances(judged.robot, read.data, errors)
    validation = Validation(
        source=read.data.source,
        errors=errors,
        warnings=warnings,
        refit=judged.refit,
        notes=dict(asked.notes or {}),
        orientations=orientation_errors(judged.robot, read.data, errors),
        distances=distances,
        next=() if any(notice.level != "note" for notice in warnings) else measure_farther(distances),
        robot=judged.robot,
        data=read.data,
        zones=of_zones,
        command=asked.again,
        inputs=inputs,
    )
    if folder is not None:
        validation.save(folder)
    return validation


def _read(asked: Validate, zoned: ZonedRobot | None) -> _Read:
    """Read robot and data, the former with its loads."""
    digest, named = None, asked.robot
    if isinstance(asked.data, str | Path):
        with refusals_of("data"):
            digest = hash_of(read_bytes(path_argument(asked.data, "data")))
    if zoned is not None:
        if asked.refit is not None:
            raise InputError(
                "what moved is found with one robot, not with zones",
                parameter="refit",
                came=asked.refit,
                cure=f"Give {zoned.file.name} instead of the zones.",
            )
        named = zoned.file
    changed = changed_since(named)
    pushed = wrench_argument(asked.wrench, asked.wrench_frame)
    as_calibrated = robot_argument(named)
    robot, data = as_measured(named, asked.data, asked.loads)
    robot = _pushed(robot, data, pushed, asked.wrench_at)
    data, other_session = _of_another_session(robot, data)
    as_calibrated = as_calibrated.with_wrench(robot.wrench)
    return _Read(robot, as_calibrated, data, digest, tuple(changed), tuple(other_session))


def _refuse_unplaced(asked: Validate, read: _Read) -> None:
    """Refuse readings in the frame of an instrument that nobody knows the place of."""
    robot, data = read.robot, read.data
    identified = {p.group for p in robot.parameters.values() if p.deviation is not None}
    is_placed = "base" in identified or (robot.proof is not None and BASE in robot.proof.held)
    if asked.refit != "base" and data.anchored and robot.fixtures and identified and not is_placed:
        raise InputError(
            "the robot was calibrated without the frame of an instrument, so the place of this instrument is unknown",
            parameter="data",
            where=data.source,
            cure="Find its place with `refit=base`, calibrate the calibrated robot with `model=frames`, or compare "
            "distances with 'truearm distances'.",
        )


def _judged(asked: Validate, read: _Read) -> _Judged:
    """Return the errors, of what is found anew if something moved, and what speaks against them."""
    data, moved = read.data, asked.refit
    errors, refit = errors_of(read.robot, data), None
    judged, mistaken = read.robot, list[Notice]()
    if moved is not None:
        # Names that were exchanged would pass for targets that moved.
        mistaken = [] if moved == "base" else check_names(judged, data, errors)
        with refusals_of("refit"):
            refit = find_moved(judged, data, moved)
        judged, errors = refit.robot, refit.errors
    # Configurations that decide much alone err more without themselves: that is no sign of anything else.
    agreed = errors if refit is None else errors_of(judged, data)
    mistaken = (
        mistaken
        or check_names(judged, data, agreed)
        or check_frames(judged, data, agreed, moved)
        or check_proof(read.as_calibrated, data, agreed)
    )
    return _Judged(judged, errors, refit, tuple(mistaken))


#: What warming up moves the targets by, from which it is said [m].
_WARMED: Final = 5e-6
OTHER_SESSION: Final = Rule(
    "other-session",
    "note",
    "the robot warmed up in the session of its calibration, and is judged as in the middle of that",
)


def _of_another_session(robot: Robot, data: Dataset) -> tuple[Dataset, list[Notice]]:
    """Return readings without their numbers, where these would say how warm the arm was in the session of the fit."""
    if data.number is None or LEFT not in robot.parameters:
        return data, []
    if error_by_order(robot, replace(data, approach=None)) < _WARMED:
        return replace(data, number=None), []
    words = (
        "The robot grew while it warmed up in the session that it was calibrated in. How warm it was in this one "
        "nobody knows, so it is judged as in the middle of that session."
    )
    return replace(data, number=None), [OTHER_SESSION(words)]


def measure_farther(distances: RegionDistances | None) -> tuple[NextStep, ...]:
    """Return the advice to measure where errors grow with the distance from where the robot was calibrated."""
    growth = None if distances is None else distances.growth
    if growth is None or not growth[2]:
        return ()
    near, far, _ = growth
    message = (
        f"Calibrate with configurations that reach farther: the third of the readings that is farthest from where the "
        f"robot was calibrated ({far.low * 1e3:.0f} mm or more) is off by {far.mean * 1e3:.2g} mm on average, the "
        f"nearest third by {near.mean * 1e3:.2g} mm."
    )
    return (NextStep("measure-more", message),)


def _pushed(robot: Robot, data: Dataset, wrench: Wrench | None, at: str | None) -> Robot:
    """Return the robot with what acted on it, or refuse data that say that themselves."""
    if wrench is not None and data.wrench is not None:
        raise InputError(
            "the data say what acted on the flange",
            parameter="wrench",
            where=data.source,
            came="the columns force_x to moment_z",
            cure="Leave `wrench` out, or take the columns out.",
        )
    return pushed_at_argument(robot, wrench, at)


def _seen_in_training(robot: Robot, data: Dataset, digest: str | None) -> list[Notice]:
    """Say if the readings are those that the robot was calibrated with, and how many it was trained on."""
    training = training_of(robot, data, digest)
    if training is None:
        return []
    (count, used, _), left_out = training.split, training.left_out
    of = used + left_out
    beside = f"; {left_out} were left out" if left_out else ""
    held_out = (
        f"{beside}; the rest was held out, and its errors are in the result of the calibration"
        if used > count
        else beside
    )
    return [
        TRAINING_DATA(
            f"The robot was calibrated with these readings: {count} of their {of} configurations are those it was "
            f"trained on{held_out}. These errors flatter it. Validate with measurements that were not used."
        )
    ]


def as_measured(robot: object, data: object, loads: Loads) -> tuple[Robot, Dataset]:
    """Return the robot with what it carried when data were measured, and those, or refuse what cannot be judged."""
    measured, robot = data_argument(data), robot_argument(robot)
    if not robot.targets:
        raise InputError(
            "the robot has no targets, so its positions cannot be compared with the readings",
            parameter="robot",
            where=robot.name,
            cure="Use the calibrated.yaml that 'truearm calibrate' wrote: it holds base and targets.",
        )
    data = readings_argument(robot, measured)
    robot = loads.on(robot)
    if data.temperature is None and any(effect.warmed for effect in robot.effects):
        raise InputError(
            "the robot was calibrated with its temperature, and the data hold no temperature",
            parameter="data",
            where=data.source,
            cure="Add the column temperature [degC].",
        )
    refuse_unknown(data, data.targets, robot.target)
    refuse_unknown(data, data.fixtures, robot.fixture)
    if not data.has_reading.any():
        raise InputError(
            "there is no reading", parameter="data", where=data.source, cure="Fill in x, y and z, or distance."
        )
    return robot, data


def refuse_unknown(data: Dataset, names: Iterable[str], look_up: Callable[[str], object]) -> None:
    """Refuse data that name what the robot does not have: its method `look_up` refuses that, and cannot name them."""
    try:
        for name in names:
            look_up(name)
    except InputError as error:
        name_place(error, data.source)
        name_parameter(error, "data")
        raise
