"""The whole job: load, check, split, fit, judge, write. The command and a script both call this."""

from __future__ import annotations

import hashlib
import json
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError, nearest_names
from truearm.files import read_bytes, writable_folder, write_files
from truearm.identification.choosing.selection import AUTO, Selection, select
from truearm.identification.judging.advice import check_fit
from truearm.identification.judging.arrival_lag import check_arrival_lag
from truearm.identification.judging.plausibility import check_against
from truearm.identification.judging.transmission import check_transmission
from truearm.identification.solving.bounds import Bounds, read_bounds
from truearm.identification.solving.fit import Fit, Redundant, Status, identify, place
from truearm.identification.solving.losses import LOSSES, Loss
from truearm.identification.solving.models import FRAMES, MODELS, Model
from truearm.measurement.checks import check_data, check_range
from truearm.measurement.dataset import Dataset
from truearm.measurement.readers.canonical import read_csv
from truearm.measurement.statistics import Errors, errors_of
from truearm.measurement.table_motion import without_table_motion
from truearm.modeling.effects import EFFECTS
from truearm.modeling.formats.robot_file import robot_text
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.reporting.summaries import errors_summary, selection_summary
from truearm.robots import load_robot, urdf_source
from truearm.units import SHOWN_AS, from_si
from truearm.version import __version__

Train = int | Literal["all"] | None

#: What a calibration writes into its folder.
RESULT_FILES: Final = ("calibrated.yaml", "result.json", "report.html", "calibrated.urdf")


def load_data(path: str | Path) -> Dataset:
    """Return the dataset in a canonical CSV file.

    Raises
    ------
    InputError
        If the file cannot be used; the message names the line and the column.
    """
    return read_csv(Path(path))


@dataclass(frozen=True, eq=False)
class Calibration:
    """A finished calibration: the fit, and the proof on configurations it has not seen.

    Attributes
    ----------
    fit
        Made from the training part alone.
    nominal
        Errors of the uncalibrated robot on the held-out part, base and targets fitted on the training part. If
        nothing was held out, on the training part.
    train
        Errors of the calibrated robot on the training part.
    validation
        Errors of the calibrated robot on the held-out part; None if nothing was held out.
    warnings
        What to know about the result, in plain words.
    data
        All readings.
    training, held_out
        Indices of the configurations of each part.
    command
        How to run it again.
    urdf
        The user's own URDF, if that is where the robot came from.
    selection
        How the model was chosen; None if it was named.
    """

    fit: Fit
    nominal: Errors
    train: Errors
    validation: Errors | None
    warnings: tuple[Notice, ...]
    data: Dataset
    training: NDArray[np.intp]
    held_out: NDArray[np.intp]
    command: str
    history: str
    urdf: bytes | None = None
    selection: Selection | None = None

    @cached_property
    def robot(self) -> Robot:
        """The calibrated robot, base and targets included."""
        return replace(self.fit.robot, history=(*self.fit.robot.history, self.history), tools={}, truths={})

    @property
    def status(self) -> Status:
        """How the fit ended."""
        return self.fit.status

    def summary(self) -> dict[str, Any]:
        """Return the figures as ``--json`` prints them: errors in mm and mrad."""
        return {
            "status": self.status.value,
            "warnings": [{"code": n.code, "message": n.message} for n in self.warnings],
            "nominal": errors_summary(self.nominal),
            "train": errors_summary(self.train),
            "validation": None if self.validation is None else errors_summary(self.validation),
        }

    def result(self) -> dict[str, Any]:
        """Return what ``result.json`` holds: the summary and every parameter."""
        return {
            "truearm": "truearm-result/1",
            **self.summary(),
            "command": self.command,
            "history": self.history,
            "model": {"name": self.fit.model.name, "effects": list(self.fit.model.effects)},
            "parameters": list(self._parameters()),
            **({} if self.selection is None else {"selection": selection_summary(self.selection)}),
        }

    def _parameters(self) -> Sequence[dict[str, Any]]:
        rows = []
        for p in self.robot.parameters.values():
            unit = SHOWN_AS[p.unit]
            rows.append(
                {
                    "name": p.name,
                    "unit": unit,
                    "nominal": from_si(p.nominal, unit),
                    "value": from_si(p.value, unit),
                    "deviation": None if p.deviation is None else from_si(p.deviation, unit),
                    "informed": p.informed,
                    "status": self.fit.parameter_status(p.name),
                }
            )
        return rows

    def save(self, folder: str | Path, progress: Callable[[str], None] = lambda _: None) -> tuple[Path, ...]:
        """Write ``calibrated.yaml``, ``result.json``, ``report.html`` and ``calibrated.urdf`` into a folder.

        An earlier result stays until the new files are complete on disk; only then are they put in its place.

        Returns
        -------
        The files written.
        """
        from truearm.modeling.formats.urdf import calibrated_urdf, urdf_text
        from truearm.reporting.report import Report, report_html

        folder = writable_folder(Path(folder))
        progress("drawing the report")
        urdf = calibrated_urdf(self.urdf, self.robot)[0] if self.urdf else urdf_text(self.robot)[0]
        report = Report(
            fit=self.fit,
            data=self.data,
            training=self.training,
            held_out=self.held_out,
            nominal=self.nominal,
            train=self.train,
            validation=self.validation,
            warnings=self.warnings,
            command=self.command,
            history=self.history,
            selection=self.selection,
        )
        files: dict[str, str | bytes] = {
            "calibrated.yaml": robot_text(self.robot),
            "result.json": json.dumps(self.result(), indent=2, allow_nan=False) + "\n",
            "report.html": report_html(report),
            "calibrated.urdf": urdf,
        }
        progress("writing the files")
        write_files(folder, files)
        return tuple(folder / name for name in files)


def calibrate(
    robot: Robot | str | Path,
    data: Dataset | str | Path,
    *,
    model: str = "geometric",
    train: Train = None,
    seed: int = 0,
    loss: Loss = "linear",
    redundancy: Redundant = "prior",
    bounds: Bounds | str | Path | None = None,
    payload: Payload | None = None,
    gravity: tuple[float, float, float] | None = None,
    effects: Sequence[str] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Calibration:
    """Calibrate a robot and judge it on configurations the fit has not seen.

    Parameters
    ----------
    robot
        A robot, or what :func:`load_robot` takes. Its parameter values are the start.
    data
        Readings, or a canonical CSV file.
    model
        One of :data:`truearm.identification.solving.models.MODELS` by name; ``frames``, which leaves the robot as it is
        and finds base, targets and fixtures alone, a tool's tip for example; or ``auto``: the joint effects that
        cross-validation on the training part says the data can carry.
    train
        How many configurations to train on, drawn with `seed`; the rest is held out. None is 70 %; ``all`` holds
        nothing out.
    seed
        Of the split: training is the first `train` of ``numpy.random.default_rng(seed).permutation(n)``.
    loss
        ``linear``, ``huber``, ``cauchy`` or ``l1``.
    redundancy
        ``prior`` or ``drop``, see :func:`truearm.identification.solving.fit.identify`.
    bounds
        Limits of parameter values, or a bounds file.
    payload, gravity
        What the robot carried and how it was mounted, see :meth:`truearm.modeling.robot.Robot.with_payload`.
    effects
        Joint effects to add to the model, of :data:`truearm.modeling.effects.EFFECTS` by name.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        For anything that cannot be used, with a message that says what to do.
    """
    urdf = None
    named = _chosen(model, {m.name: m for m in (FRAMES, *MODELS)} | {AUTO: None}, "model")
    for name in effects:
        _chosen(name, {effect.name: effect for effect in EFFECTS}, "effect")
    if effects and named is None:
        raise InputError(
            "the model auto chooses its effects itself", where="--effect", came=effects[0], cure="Name another model."
        )
    _chosen(loss, {name: name for name in LOSSES}, "loss")
    _chosen(redundancy, {name: name for name in get_args(Redundant)}, "redundancy")
    words = ["truearm", "calibrate", str(robot) if isinstance(robot, str | Path) else "ROBOT"]
    if isinstance(robot, str | Path):
        progress("reading the robot")
        source = urdf_source(robot)
        urdf = None if source is None else read_bytes(source[0])
        robot = load_robot(robot)
    robot = robot.with_payload(payload, gravity)
    digest = ""
    if isinstance(data, str | Path):
        progress("reading the data")
        path = Path(data)
        data = load_data(path)
        digest = f" (sha256 {hashlib.sha256(read_bytes(path)).hexdigest()[:12]})"
    bounds_file = "bounds"
    if isinstance(bounds, str | Path):
        bounds_file = str(bounds)
        bounds = read_bounds(Path(bounds))
    check_joints(robot, data)
    n = data.configurations
    count = _train_count(train, n, data.source)
    order = np.random.default_rng(seed).permutation(n)
    training, held_out = order[:count], order[count:]
    if not data.has_reading.any():
        raise InputError("there is no reading at all", where=data.source, cure="Fill in x, y and z, or distance.")
    if data.fixture is None and not data.has_position.any():
        raise InputError("there is no position reading at all", where=data.source, cure="Fill in x, y and z.")
    _check_split(data.of_configurations(training), data.of_configurations(held_out))

    progress("checking the data")
    noticed = check(data, robot)
    data = without_table_motion(data)
    first = data.of_configurations(training)
    second = data.of_configurations(held_out) if len(held_out) else None
    selection = None
    if named is None:
        selection = select(
            robot,
            first,
            loss=loss,
            redundancy=redundancy,
            bounds=bounds,
            bounds_file=bounds_file,
            seed=seed,
            progress=progress,
        )
    chosen: Model = named.also(effects) if selection is None else selection.model
    progress("placing the nominal robot")
    nominal = place(robot, first, loss)
    progress(f"identifying the {chosen.name} model on {count} configurations")
    fit = identify(robot, first, chosen, loss=loss, redundancy=redundancy, bounds=bounds, bounds_file=bounds_file)
    progress("judging it")
    judged = first if second is None else second
    validation = None if second is None else errors_of(fit.robot, second)
    before = errors_of(nominal.robot, judged)
    words += [data.source, "--model", chosen.name, "--train", "all" if second is None else str(count)]
    words += ["--seed", str(seed)]
    words += [word for name in effects for word in ("--effect", name)]
    words += ["--loss", loss] if loss != "linear" else []
    words += ["--redundancy", redundancy] if redundancy != "prior" else []
    words += ["--bounds", bounds_file] if bounds is not None else []
    if payload is not None:
        words += ["--payload", payload.text]
    words += ["--gravity", ",".join(f"{v:.15g}" for v in gravity)] if gravity is not None else []
    history = (
        f"calibrated by truearm {__version__}: model {' + '.join([chosen.name, *effects])},"
        f" {count} of {n} configurations of {Path(data.source).name}{digest}, seed {seed}, loss {loss},"
        f" redundancy {redundancy}"
    )
    return Calibration(
        fit=fit,
        nominal=before,
        train=errors_of(fit.robot, first),
        validation=validation,
        warnings=(
            *_check_proof(before, validation),
            *check_fit(fit),
            *noticed,
            *check_arrival_lag(fit, data),
            *check_transmission(fit, first),
        ),
        data=data,
        training=training,
        held_out=held_out,
        command=shlex.join(words),
        history=history,
        urdf=urdf,
        selection=selection,
    )


def check(
    data: Dataset | str | Path, robot: Robot | str | Path | None = None, device: str | None = None
) -> tuple[Notice, ...]:
    """Say what is wrong with measurements before they are believed.

    Parameters
    ----------
    data
        Readings, or a canonical CSV file.
    robot
        The nominal robot, or what :func:`load_robot` takes. With it, units, joint order and signs, limits and single
        readings are checked too.
    device
        Name of the instrument, of ``truearm devices``; with it, readings beyond its range are named.

    Returns
    -------
    One notice for each kind of fault; none for believable data.
    """
    data = load_data(data) if isinstance(data, str | Path) else data
    ranged: tuple[Notice, ...] = ()
    if device is not None:
        from truearm.simulation.devices import named_device  # with its inverse kinematics, only where it is asked for

        ranged = tuple(check_range(data, named_device(device)))
    if robot is None:
        return (*ranged, *check_data(data))
    robot = load_robot(robot) if isinstance(robot, str | Path) else robot
    check_joints(robot, data)
    against, suspects = check_against(robot, without_table_motion(data))
    return (*ranged, *check_data(data, suspects), *against)


def validate(
    robot: Robot | str | Path,
    data: Dataset | str | Path,
    *,
    payload: Payload | None = None,
    gravity: tuple[float, float, float] | None = None,
) -> Errors:
    """Judge a calibrated robot on new data taken in the same frames.

    Parameters
    ----------
    robot
        A calibrated robot, or its file.
    data
        Readings, or a canonical CSV file.
    payload, gravity
        What the robot carried and how it was mounted this time, if that differs from the calibration.

    Raises
    ------
    InputError
        If the robot has no targets, or the data name others.
    """
    robot = load_robot(robot) if isinstance(robot, str | Path) else robot
    data = load_data(data) if isinstance(data, str | Path) else data
    if not robot.targets:
        raise InputError(
            "the robot has no targets, so it cannot say where the instrument should have seen them",
            where=robot.name,
            cure="Use the calibrated.yaml that 'truearm calibrate' wrote: it holds base and targets.",
        )
    check_joints(robot, data)
    robot = robot.with_payload(payload, gravity)
    if data.temperature is None and any(effect.warmed for effect in robot.effects):
        raise InputError(
            "the robot was calibrated with its temperature, and the data do not say theirs",
            where=data.source,
            cure="Add the column temperature [degC].",
        )
    identified = {p.group for p in robot.parameters.values() if p.deviation is not None}
    if data.anchored and robot.fixtures and identified and "base" not in identified:
        raise InputError(
            "the robot was calibrated without any instrument's frame, so it does not know where this one stands",
            where=data.source,
            cure="Place it first: 'truearm calibrate CALIBRATED.yaml DATA.csv --model frames', or compare distances: "
            "'truearm distances'.",
        )
    for name in data.targets:
        robot.target(name)
    for name in data.fixtures:
        robot.fixture(name)
    if not data.has_reading.any():
        raise InputError("there is no reading at all", where=data.source, cure="Fill in x, y and z, or distance.")
    return errors_of(robot, data)


def check_joints(robot: Robot, data: Dataset) -> None:
    """Refuse data whose joints are not the robot's.

    Raises
    ------
    InputError
        Naming the counts, or the joint whose unit does not fit.
    """
    if data.joints.shape[1] != len(robot.joints):
        raise InputError(
            "the number of joints differs from the robot's",
            where=data.source,
            came=f"{data.joints.shape[1]} joint columns",
            allowed=f"{len(robot.joints)} ({robot.name})",
            cure="Give one column joint_i for each joint of the robot, base first.",
        )
    for number, (joint, kind) in enumerate(zip(robot.joints, data.joint_kinds, strict=True), 1):
        if joint.kind != kind:
            units = {"revolute": "deg or rad", "prismatic": "mm, m, um or in"}
            raise InputError(
                f"joint {number} of {robot.name} is {joint.kind}, but its column has a unit of a {kind} joint",
                where=f"{data.source}, column joint_{number}",
                allowed=units[joint.kind],
            )


def _check_split(training: Dataset, held_out: Dataset) -> None:
    """Refuse a held-out part that holds nothing, or readings of targets that the training part does not place."""
    if held_out.configurations and not held_out.has_reading.any():
        raise InputError(
            "the held-out part has no reading at all",
            where=held_out.source,
            cure="Lower --train, change --seed, or measure again where readings are missing.",
        )
    places = training.has_position if training.fixture is None else training.has_reading
    placed = set(training.target[places].tolist())
    fixtures = set(training.against[training.has_reading].tolist())
    for part, name in ((training, "training"), (held_out, "held-out")):
        for index in dict.fromkeys(part.against[part.has_reading].tolist()):
            if index not in fixtures:
                alone = training.fixtures[index] if index >= 0 else ""
                near = nearest_names(alone, [n for n in training.fixtures if n != alone], 1) if alone else []
                raise InputError(
                    f"a fixture of the {name} part was not measured in the training part",
                    where=training.source,
                    came=alone or "the instrument's own frame",
                    cure=f"Did you mean {near[0]}?" if near else "Raise --train, change --seed, or leave it out.",
                )
        for index in dict.fromkeys(part.target[part.has_reading].tolist()):
            if index not in placed:
                raise InputError(
                    f"a target of the {name} part has no position in the training part",
                    where=training.source,
                    came=training.targets[index],
                    cure="Raise --train, change --seed, or leave the target out.",
                )


def _train_count(train: Train, n: int, where: str) -> int:
    if train == "all":
        return n
    if n < 2:
        raise InputError(
            "one configuration cannot be split into training and held-out parts",
            where=where,
            cure="Measure more, or use --train all.",
        )
    count = round(0.7 * n) if train is None else int(train)
    if not 1 <= count < n:
        raise InputError(
            "the number of training configurations must leave some to judge by",
            where="--train",
            came=count,
            allowed=f"1 to {n - 1}, or all ({where} has {n} configurations)",
        )
    return count


def named_model(name: str) -> Model:
    """Return the model of this name.

    Raises
    ------
    InputError
        If there is none.
    """
    model: Model = _chosen(name, {m.name: m for m in MODELS}, "model")
    return model


def _chosen(name: str, known: Mapping[str, Any], option: str) -> Any:
    if name in known:
        return known[name]
    near = nearest_names(name, known)
    raise InputError(
        f"there is no {option} of this name",
        where=f"--{option}",
        came=name,
        allowed=", ".join(known),
        cure=f"Did you mean {' or '.join(near)}?" if near else None,
    )


def _check_proof(before: Errors, after: Errors | None) -> list[Notice]:
    """Say if there is no proof, or if it speaks against the calibration."""
    if after is None:
        return [
            Notice(
                "nothing-held-out",
                "Nothing was held out: the errors are those of the training readings and flatter the model. "
                "Leave --train out to see the error on configurations the fit has not seen.",
            )
        ]
    old, new = before.position_spread or before.length_spread, after.position_spread or after.length_spread
    if old is None or new is None or new.mean <= old.mean:
        return []
    return [
        Notice(
            "not-better",
            "On configurations the fit has not seen, the calibrated robot is no better than the nominal one: "
            "there are too few readings for this model, or something is wrong with them.",
        )
    ]
