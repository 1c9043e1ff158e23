"""From measurements to a calibrated robot: load, check, split, fit, judge, write."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from numbers import Integral
from pathlib import Path
from typing import Final, Literal, get_args

import numpy as np

from truearm.errors import InputError, did_you_mean, nearest_names, refusals_of, wrong_kind
from truearm.files import path_argument, read_bytes
from truearm.identification.base_changes import with_one_base
from truearm.identification.choosing.selection import AUTO, select
from truearm.identification.judging.advice import check_fit
from truearm.identification.judging.arrival_lag import check_arrival_lag
from truearm.identification.judging.changes import notices_of_change
from truearm.identification.judging.expected_error import as_residuals_allow, expected_error
from truearm.identification.judging.implausible import check_plausible
from truearm.identification.judging.large_remainder import check_remainder
from truearm.identification.judging.left_over import LeftOver
from truearm.identification.judging.narrow_data import check_narrow_data, check_narrow_data_without_geometry
from truearm.identification.judging.next_steps import Judged, steps_after_fit, what_moved
from truearm.identification.judging.off_configurations import off_configurations
from truearm.identification.judging.one_sided import check_one_sided
from truearm.identification.judging.payload import check_payload
from truearm.identification.judging.separate_visits import check_separate_visits
from truearm.identification.judging.sigma import check_sigma, check_sigma_beside_joints
from truearm.identification.judging.transmission import check_transmission
from truearm.identification.judging.wrong_robot import WRONG_ROBOT, check_robot, judges_lengths
from truearm.identification.solving.bounds import Bounds, read_bounds
from truearm.identification.solving.fit import Status, identify, place
from truearm.identification.solving.losses import LOSSES, Loss
from truearm.identification.solving.models import FRAMES, MODELS, Model, named_model
from truearm.identification.solving.rounds import Redundant
from truearm.jobs.arguments import (
    choice_argument,
    choices_argument,
    command_argument,
    files_of,
    folder_for,
    gravity_argument,
    names_argument,
    notes_argument,
    payload_argument,
    progress_argument,
    python_call,
    readings_argument,
    refuse_swapped,
    robot_argument,
    whole_argument,
)
from truearm.jobs.check import notices_of
from truearm.jobs.validate import training_of
from truearm.library import urdf_source
from truearm.measurement.dataset import Dataset, IntArray
from truearm.measurement.repeats import copies, readings_digest, revisits
from truearm.measurement.statistics import Errors, errors_of
from truearm.measurement.table_motion import without_table_motion
from truearm.modeling.effects import EFFECTS
from truearm.modeling.formats.robot_file import is_intact
from truearm.modeling.parts import Payload
from truearm.modeling.proof import Proof
from truearm.modeling.robot import Robot
from truearm.notices import Notice, has_error
from truearm.results.calibration import RESULT_FILES, Calibration
from truearm.shown import counted, listed
from truearm.version import __version__

Train = int | Literal["all"] | None

#: Every model that can be asked for by name; None chooses.
_MODELS: Final[dict[str, Model | None]] = {m.name: m for m in (FRAMES, *MODELS)} | {AUTO: None}

#: The hash by which the history tells which configurations were left out.
_LEFT_OUT: Final = re.compile(r"; ([0-9a-f]{8})\),")


def calibrate(
    robot: Robot | str | Path,
    data: Dataset | str | Path,
    *,
    out: str | Path | None = None,
    model: str = "geometric",
    train: Train = None,
    seed: int = 0,
    loss: Loss = "linear",
    redundancy: Redundant = "prior",
    bounds: Bounds | str | Path | None = None,
    effects: Sequence[str] = (),
    payload: Payload | str | None = None,
    gravity: Sequence[float] | None = None,
    base_changes: Sequence[str] = (),
    without: Sequence[str] = (),
    notes: Mapping[str, str] | None = None,
    command: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Calibration:
    """Calibrate a robot and judge it on configurations the fit has not seen.

    Parameters
    ----------
    robot
        A robot, or what :func:`truearm.load_robot` takes. Its parameter values are the start.
    data
        Readings, or a canonical CSV file.
    out
        Folder for calibrated.yaml, result.json, report.html and calibrated.urdf; None writes nothing, see
        :meth:`Calibration.save`.
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
    effects
        Joint effects to add to the model, of :data:`truearm.modeling.effects.EFFECTS` by name.
    payload, gravity
        What the robot carried (an object, or a text such as ``2.7kg,50mm,25mm,100mm``) and free fall in its base frame
        [m/s^2], see :meth:`truearm.Robot.with_payload`.
    base_changes
        Configurations from which on, in the order of measurement, the instrument or the robot's base stood elsewhere.
        The motion is found along with the model (``geometric`` for ``auto``) from the training configurations, and
        taken out of the readings; no deviation contains what is not known of it.
    without
        Configurations that are left out, by their labels: neither part of the split knows them.
    notes
        What to write on the report and into result.json, by its name: ``date``, ``serial``, ``operator``,
        ``instrument``, or any other.
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
    named = choice_argument(model, "model", _MODELS)
    effects = choices_argument(effects, "effects", [effect.name for effect in EFFECTS], "effect")
    if effects and named is None:
        raise InputError(
            "the model auto chooses its effects itself",
            parameter="effects",
            came=effects[0],
            cure="Name another model.",
        )
    base_changes = names_argument(base_changes, "base_changes")
    without = names_argument(without, "without")
    notes = notes_argument(notes)
    choice_argument(loss, "loss", {name: name for name in LOSSES})
    choice_argument(redundancy, "redundancy", {name: name for name in get_args(Redundant)})
    seed = whole_argument(seed, "seed")
    payload, fall = payload_argument(payload), gravity_argument(gravity)
    call = command_argument(command) or python_call(
        "calibrate",
        robot,
        data,
        model=model,
        train=train,
        seed=seed,
        loss=loss,
        redundancy=redundancy,
        bounds=bounds,
        effects=list(effects) or None,
        base_changes=list(base_changes) or None,
        without=list(without) or None,
        notes=notes or None,
        payload=payload,
        gravity=fall,
    )
    refuse_swapped(robot, data, "calibrate")
    inputs = files_of(robot, data, bounds)
    folder = None if out is None else folder_for(RESULT_FILES, out, robot, data, bounds, ours=True)
    progress("reading the robot")
    source = urdf_source(robot) if isinstance(robot, str | Path) else None
    urdf = None if source is None else read_bytes(source[0])
    nominal_robot = robot_argument(robot).with_payload(payload, fall)
    if effects and named is not None:
        with refusals_of("effects"):
            asked = named.also(effects)
            asked.free(asked.prepared(nominal_robot))
    progress("reading the data")
    readings = as_read = readings_argument(nominal_robot, data)
    sha256 = None
    if isinstance(data, str | Path):
        sha256 = hashlib.sha256(read_bytes(path_argument(data, "data"))).hexdigest()
    readings = _left_out(readings, without)
    bounds_file = str(bounds) if isinstance(bounds, str | Path) else "bounds"
    if bounds is not None and not isinstance(bounds, Bounds):
        with refusals_of("bounds"):
            bounds = read_bounds(path_argument(bounds, "bounds"))
    with refusals_of("data"):
        n = readings.configurations
        count = _train_count(train, n, readings.source)
        order = np.random.default_rng(seed).permutation(n)
        training, held_out = order[:count], order[count:]
        if not readings.has_reading.any():
            raise InputError(
                "there is no reading", parameter="data", where=readings.source, cure="Fill in x, y and z, or distance."
            )
        if readings.fixture is None and not readings.has_position.any():
            raise InputError(
                "there is no position reading", parameter="data", where=readings.source, cure="Fill in x, y and z."
            )
        _check_split(readings.of_configurations(training), readings.of_configurations(held_out))

        progress("checking the data")
        steady = without_table_motion(readings)
        moved: list[Notice] = []
        if base_changes:
            progress("finding how the base moved")
            along = named_model("geometric") if named is None else named.also(effects)
            steady, moved = with_one_base(nominal_robot, steady, training, base_changes, along, loss)
        noticed = notices_of(readings, nominal_robot, steady=steady)
        readings = steady
        first = readings.of_configurations(training)
        second = readings.of_configurations(held_out) if len(held_out) else None
        selection = None
        if named is None:
            selection = select(
                nominal_robot,
                first,
                loss=loss,
                redundancy=redundancy,
                bounds=bounds,
                bounds_file=bounds_file,
                seed=seed,
                progress=progress,
            )
        chosen: Model = selection.model if named is None and selection is not None else named.also(effects)  # type: ignore[union-attr]
        progress("placing the nominal robot")
        placed = place(nominal_robot, first, loss)
        progress(f"identifying the {chosen.name} model on {count} configurations")
        fit = identify(
            nominal_robot, first, chosen, loss=loss, redundancy=redundancy, bounds=bounds, bounds_file=bounds_file
        )
    progress("judging it")
    judged = first if second is None else second
    validation = None if second is None else errors_of(fit.robot, second)
    before = errors_of(placed, judged)
    train_errors = errors_of(fit.robot, first)
    # What the robust fit of the check could not explain, the fit itself may.
    noticed = tuple(notice for notice in noticed if notice.code != Status.IMPLAUSIBLE.value)
    left_over = LeftOver.of(fit, readings)
    off = off_configurations(left_over)
    moved_then = what_moved(left_over, off)
    changes = [] if moved_then is None else notices_of_change(*moved_then)
    told = [notice for notice in noticed if notice.code == WRONG_ROBOT]
    noticed = tuple(notice for notice in noticed if notice.code != WRONG_ROBOT)
    wrong_robot = check_robot(fit, first) if judges_lengths(fit) else told
    if has_error([*noticed, *changes]):  # what is wrong with the data bends the robot too
        wrong_robot = []
    unlike = check_plausible(fit, first, (*noticed, *wrong_robot, *told))
    if unlike:
        wrong_robot = wrong_robot or told
    expected = expected_error(as_residuals_allow(fit, first), plausible=not unlike)
    wrong_sigma = check_sigma(left_over)
    hidden = [] if unlike or has_error(wrong_sigma) else check_sigma_beside_joints(left_over)
    explained = [*changes, *check_arrival_lag(left_over)]
    doubted = has_error([*unlike, *wrong_robot, *noticed])
    if not explained and not doubted and not any(notice.code == "joints-rounded" for notice in noticed):
        explained = check_remainder(left_over)
    narrow: list[Notice] = []
    if not unlike and (hidden or not wrong_sigma):  # more configurations do not mend these
        by, seen = validation or train_errors, validation is not None
        if chosen.groups and "geometry" not in chosen.groups:
            narrow = check_narrow_data_without_geometry(fit, first, by, loss, held_out=seen)
        narrow = narrow or check_narrow_data(fit, expected, first, by, held_out=seen)
    digest = f" ({'' if sha256 is None else f'sha256 {sha256[:12]}, '}readings {readings_digest(as_read)[:12]})"
    history = (
        f"calibrated by truearm {__version__}: model {' + '.join([chosen.name, *effects])},"
        f" {count} of {n} configurations of {Path(readings.source).name}{digest}, seed {seed}, loss {loss},"
        f"{_without_words(without)}"
        f" redundancy {redundancy}{f', another base from {listed(base_changes)} on' if base_changes else ''}"
    )
    warnings = (
        *(notice for notice in noticed if notice.level == "error"),
        *unlike,
        *wrong_robot,
        *_check_proof(before, validation),
        *_check_copies(readings, training, held_out),
        *_check_trained_before(nominal_robot, as_read, sha256, (count, n, seed), _without_words(without)),
        *moved,
        *check_payload(nominal_robot),
        *check_fit(fit, expected, doubted=doubted),
        *narrow,
        *(notice for notice in noticed if notice.level != "error"),
        *check_one_sided(fit, first),
        *(hidden or wrong_sigma),
        *([] if doubted else check_separate_visits(left_over)),
        *explained,
        *check_transmission(fit, first),
    )
    steps = steps_after_fit(
        Judged(
            left_over,
            Status.IMPLAUSIBLE if unlike else fit.status,
            warnings,
            off,
            moved_then,
            validation or train_errors,
            validation is not None,
            expected,
            first,
        )
    )
    calibration = Calibration(
        fit=fit,
        nominal=before,
        train=train_errors,
        validation=validation,
        expected=expected,
        warnings=warnings,
        next=steps,
        data=readings,
        training=training,
        held_out=held_out,
        command=call,
        history=history,
        urdf=urdf,
        inputs=inputs,
        selection=selection,
        known_before=_known_before(nominal_robot),
        without=without,
        notes=notes,
    )
    if folder is not None:
        calibration.save(folder, progress)
    return calibration


def _left_out(data: Dataset, labels: Sequence[str]) -> Dataset:
    """Return the data without some configurations.

    Raises
    ------
    InputError
        For a configuration that the data do not have, or if none would be left.
    """
    if not labels:
        return data
    known = set(data.labels)
    for label in labels:
        if label not in known:
            raise InputError(
                "there is no configuration of this name",
                parameter="without",
                where=data.source,
                came=label,
                cure=did_you_mean(label, data.labels) or "Name configurations of the data.",
            )
    kept = [i for i, label in enumerate(data.labels) if label not in set(labels)]
    if not kept:
        raise InputError(
            "no configuration would be left", parameter="without", where=data.source, cure="Leave out fewer."
        )
    return data.of_configurations(kept)


def _without_words(labels: Sequence[str]) -> str:
    """Return how the history says which configurations were left out: the first few by name, all of them by a hash."""
    if not labels:
        return ""
    digest = hashlib.sha256("\n".join(sorted(labels)).encode()).hexdigest()[:8]
    return f" without {counted(len(labels), 'configuration')} ({listed(labels)}; {digest}),"


def _known_before(robot: Robot) -> Proof | None:
    """Return what is known of a robot already; of one whose values were changed since, only what speaks against it."""
    if robot.proof is None or is_intact(robot):
        return robot.proof
    return replace(robot.proof, names=(), deviations=(), factor=())


def _check_split(training: Dataset, held_out: Dataset) -> None:
    """Refuse a held-out part that holds nothing, or readings of targets that the training part does not place."""
    if held_out.configurations and not held_out.has_reading.any():
        raise InputError(
            "the held-out part has no reading",
            where=held_out.source,
            cure="Lower `train`, change `seed`, or measure again where readings are missing.",
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
                    cure=f"Did you mean {near[0]}?" if near else "Raise `train`, change `seed`, or leave it out.",
                )
        for index in dict.fromkeys(part.target[part.has_reading].tolist()):
            if index not in placed:
                raise InputError(
                    f"a target of the {name} part has no position in the training part",
                    where=training.source,
                    came=training.targets[index],
                    cure="Raise `train`, change `seed`, or leave the target out.",
                )


def _train_count(train: object, n: int, where: str) -> int:
    if isinstance(train, str) and train == "all":
        return n
    if n < 2:
        raise InputError(
            "one configuration cannot be split into training and held-out parts",
            parameter="data",
            where=where,
            cure="Measure more, or use `train=all`.",
        )
    if train is None:
        return round(0.7 * n)
    if isinstance(train, bool) or not isinstance(train, Integral):
        raise wrong_kind("a number of configurations belongs here", train, "train", "a whole number, or all")
    if not 1 <= int(train) < n:
        raise InputError(
            "the number of training configurations must leave some held out",
            parameter="train",
            came=int(train),
            allowed=f"1 to {n - 1}, or all ({where} has {n} configurations)",
        )
    return int(train)


def _check_copies(data: Dataset, training: IntArray, held_out: IntArray) -> list[Notice]:
    """Say if the fit has seen what was held out: copies, or other readings at the same joint positions."""
    seen = copies(data, held_out, training)
    known = set(seen)
    again = [label for label in revisits(data, held_out, training) if label not in known]
    if not seen and not again:
        return []
    told = []
    if seen:
        told.append(f"{len(seen)} {'is a copy' if len(seen) == 1 else 'are copies'} of training ones ({listed(seen)})")
    if again:
        told.append(
            f"{len(again)} {'has' if len(again) == 1 else 'have'} the same joint positions as training ones "
            f"({listed(again)})"
        )
    cures = ["Leave copies out; for a bootstrap, draw from the training configurations alone and use `train=all`."]
    return [
        Notice(
            "held-out-seen",
            f"Of {counted(len(held_out), 'held-out configuration')} {' and '.join(told)}: the fit has seen them, and "
            f"the errors flatter it. "
            + " ".join(
                [
                    *(cures if seen else []),
                    *(["Judge it at other joint positions with 'truearm validate'."] if again else []),
                ]
            ),
        )
    ]


def _check_trained_before(
    robot: Robot, data: Dataset, sha256: str | None, split: tuple[int, int, int], without: str
) -> list[Notice]:
    """Say if the robot to begin with has been trained on what is held out now.

    Parameters
    ----------
    data
        As they were read.
    sha256
        Of their file; None if they are in none.
    split
        How many configurations are trained on, of how many, and the seed.
    without
        What the history says of those left out.
    """
    before = training_of(robot, data, sha256)
    if before is None or split[0] == split[1]:
        return []
    if before.split == split and _LEFT_OUT.findall(before.line) == _LEFT_OUT.findall(without):
        return []
    count, of, seed = before.split
    return [
        Notice(
            "training-data",
            f"The robot to begin with was calibrated with these readings already, on {count} of its {of} "
            f"configurations (seed {seed}): what is held out now was partly seen then, and the held-out errors "
            "flatter it. Begin with the nominal robot, or with the same `train` and `seed`.",
        )
    ]


def _check_proof(before: Errors, after: Errors | None) -> list[Notice]:
    """Say if there is no proof, or if it speaks against the calibration."""
    if after is None:
        return [
            Notice(
                "nothing-held-out",
                "Nothing was held out: the errors are those of the training readings and flatter the model. "
                "Leave `train` out to see the error on configurations the fit has not seen.",
            )
        ]
    old, new = before.position or before.length, after.position or after.length
    if old is None or new is None or new.mean <= old.mean:
        return []
    return [
        Notice(
            "not-better",
            "On configurations the fit has not seen, the calibrated robot is no better than the nominal one: "
            "there are too few readings for this model, or something is wrong with them.",
        )
    ]
