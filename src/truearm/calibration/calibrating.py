"""From measurements to a calibrated robot: read, split, identify, judge, write."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self, TypedDict

import numpy as np
from numpy.typing import NDArray

from truearm.calibration.holding import fixed_places_argument
from truearm.calibration.result import RESULT_FILES, Calibration
from truearm.calibration.zones import WantedZones, choose_zones, zone_file_names, zones_argument
from truearm.engine.base.errors import InputError, Notice, Rule, has_error, listed, refusals_of
from truearm.engine.base.files import path_argument, read_bytes
from truearm.engine.base.manifest import hash_of
from truearm.engine.base.version import __version__
from truearm.engine.command.arguments import (
    files_of,
    folder_for,
    readings_argument,
    refuse_swapped,
    robot_argument,
)
from truearm.engine.command.reading import Excluded, check_excluded, count_excluded, in_parts, without_excluded
from truearm.engine.command.split import (
    check_split,
    check_trained_before,
    left_out,
    nothing_held_out,
    train_count,
    without_words,
)
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.parting import parted
from truearm.engine.data.statistics import errors_of, without_table_motion
from truearm.engine.data.thinning import readings_digest
from truearm.engine.diagnose.base_changes import checked_parts, with_one_base
from truearm.engine.diagnose.case import DOUBTED, PULLED, Case
from truearm.engine.diagnose.data_check import notices_of
from truearm.engine.diagnose.diagnosis import diagnose
from truearm.engine.diagnose.fixed_places import check_fixed_places
from truearm.engine.diagnose.gain import check_gain
from truearm.engine.diagnose.simulated_calibrations import (
    SimulatedCalibrations,
    check_linear,
    refuse_too_many,
    simulated_calibrations,
)
from truearm.engine.diagnose.unseen import Unseen
from truearm.engine.fit.bounds import Bounds, read_bounds
from truearm.engine.fit.every_effect import (
    AUTO,
    Shares,
    check_shares,
    identify_every_effect,
    refuse_balancers_that_are_not_there,
    without_unseen_balancers,
)
from truearm.engine.fit.fit import Fit, Status, identify, place
from truearm.engine.fit.fixed_places import FixedPlaces
from truearm.engine.fit.likelihood import WhitenedProblem
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import FRAMES, Model, named_model
from truearm.engine.fit.models import MODELS as EVERY_MODEL
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.rounds import Redundant
from truearm.engine.fit.solver import watching
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import urdf_source
from truearm.engine.robot.robot import Robot

if TYPE_CHECKING:
    from truearm.calibration.calibrate import Calibrate

#: What is identified along with a base that moved, and simulated, where every effect is in the model.
GEOMETRIC: Final = named_model("geometric")
#: That much time may go into the errors that are told of a fit [s], and that share of the fit's own.
_TIME: Final = 0.5
_SHARE: Final = 0.05


class FitStep(str):
    """A step of a fit in words."""

    number: int  #: Of the step, from 1, over all rounds.
    cost: float  #: The sum of squares that is made small; each round weighs the readings anew.
    error: float  #: Mean error on the configurations that judge [m].

    @classmethod
    def of(cls, number: int, cost: float, error: float, judges: str) -> Self:
        """Return the words of a step."""
        step = cls(f"step {number}: cost {cost:.4g}, {judges} error {error * 1e3:.3f} mm")
        step.number, step.cost, step.error = number, cost, error
        return step


@contextmanager
def followed(progress: Callable[[str], None], judging: Dataset, *, held_out: bool) -> Iterator[None]:
    """Tell of the steps of the fits in this block, as far as that costs next to nothing.

    Args:
        judging: What the fit is judged on.
        held_out: Whether the fit does not see it.
    """
    number, spent, start = 0, 0.0, time.process_time()

    def report(problem: object, vector: Array, cost: float) -> None:
        nonlocal number, spent
        number += 1
        began = time.process_time()
        if spent > _TIME + _SHARE * (began - start):
            return
        inner = problem.plain if isinstance(problem, WhitenedProblem) else problem
        if not isinstance(inner, Problem):
            return
        values = dict(zip(inner.free.names, vector.tolist(), strict=True))
        try:
            with np.errstate(all="ignore"):
                errors = errors_of(inner.robot.with_values(values), judging)
        except InputError:  # a step on the way may be no robot
            return
        spread = errors.position or errors.length
        if spread is not None:
            progress(FitStep.of(number, cost, spread.mean, "held-out" if held_out else "training"))
        spent += time.process_time() - began

    with watching(report):
        yield


#: Fewer trials than this give no interval of 95 %.
_LEAST: Final = 100
#: Length of the bar that shows how much is done.
_BAR: Final = 20


NOT_SIMULATED: Final = Rule(
    "not-simulated", "note", "no calibration was simulated, because the fit leaves open what predictions depend on"
)


def simulate_calibrations(
    fit: Fit,
    training: Dataset,
    held_out: Dataset | None,
    trials: int,
    *,
    priors: bool,
    seed: int,
    progress: Callable[[str], None],
) -> tuple[SimulatedCalibrations | None, list[Notice]]:
    """Return simulated calibrations, and what they say against the linear intervals.

    None are made of a fit that leaves open what predictions depend on: where base and targets are is not drawn.
    """
    if fit.status not in (Status.CONVERGED, Status.AT_BOUND):
        return None, [
            NOT_SIMULATED(
                f"No calibration was simulated, because this one ended with {fit.status.value}: intervals say nothing "
                "of what the data do not determine."
            )
        ]

    def report(count: int) -> None:
        full = _BAR * count // trials
        progress(f"simulating calibrations [{'#' * full}{'.' * (_BAR - full)}] {count} of {trials}")

    judged = training if held_out is None else held_out
    simulated = simulated_calibrations(fit, training, judged, trials, priors=priors, seed=seed, progress=report)
    return simulated, check_linear(fit, simulated)


#: The step at which everything that was given has been read and found usable.
ACCEPTED: Final = "checking the data"
#: Every model that can be asked for by name; None for every effect.
MODELS: Final[dict[str, Model | None]] = {m.name: m for m in (FRAMES, *EVERY_MODEL)} | {AUTO: None}


class _FitOptions(TypedDict):
    """How parameters are identified, whatever is held."""

    loss: Loss
    redundancy: Redundant
    bounds: Bounds | None
    bounds_file: str


@dataclass(frozen=True, eq=False)
class _Read:
    robot: Robot  #: The nominal one, with its loads.
    urdf: bytes | None  #: The user's own, if that is where the robot came from.
    as_read: Dataset  #: All readings.
    readings: Dataset  #: Those that count.
    sha256: str | None  #: Of their file.
    excluded: tuple[Excluded, ...]
    fixed: FixedPlaces
    options: _FitOptions
    zones: WantedZones | None


@dataclass(frozen=True, eq=False)
class _Parts:
    """The readings in two parts, without what moved meanwhile."""

    readings: Dataset
    training: NDArray[np.intp]  #: training, held_out: indices of configurations.
    held_out: NDArray[np.intp]
    model: Model | None  #: None for every effect.
    because: str  #: Why it is this one; empty if it was named.
    first: Dataset  #: What is trained on.
    second: Dataset | None  #: What judges; None if nothing is held out.
    excluded: tuple[Excluded, ...]  #: With the part that each belongs to.
    noticed: tuple[Notice, ...]  #: What is to be known about the data.
    moved: tuple[Notice, ...]  #: What is to be known about the base that moved.

    @property
    def judges(self) -> Dataset:
        """What judges: the training part where nothing is held out."""
        return self.first if self.second is None else self.second


@dataclass(frozen=True, eq=False)
class _Identified:
    """What was identified."""

    robot: Robot  #: The nominal one, with the periods of gears that were found.
    placed: Robot  #: The nominal one, base and targets found as the fit finds them.
    model: Model
    fit: Fit  #: As uncertain as held-out readings show it.
    unseen: Unseen | None  #: These, where they say that.
    shares: Shares | None  #: What every effect does; None if the model was named.
    contradicted: tuple[Notice, ...]  #: What speaks against what was held.
    notices: tuple[Notice, ...]  #: What is to be known about the effects.


def calibrated(asked: Calibrate) -> Calibration:
    """Read, split, fit, judge, write."""
    files = (asked.robot, asked.data, asked.bounds, asked.zones, asked.frames, asked.exclude)
    zones = zones_argument(asked.zones, held_out=asked.train != "all")
    refuse_swapped(asked.robot, asked.data, "calibrate")
    inputs = files_of(*files)
    if asked.out is not None:
        folder_for((*RESULT_FILES, *zone_file_names(zones)), asked.out, *files, ours=True)
    read = _read(asked, zones)
    with refusals_of("data"):
        parts = _split(asked, read)
        solved = _identified(asked, read, parts)
    calibration = replace(_judged(asked, read, parts, solved), inputs=inputs)
    if asked.out is not None:
        calibration.save(asked.out, asked.progress, replace=asked.replace)
    return calibration


def _read(asked: Calibrate, zones: WantedZones | None) -> _Read:
    """Read robot, data and what else was given."""
    asked.progress("reading the robot")
    source = urdf_source(asked.robot) if isinstance(asked.robot, str | Path) else None
    urdf = None if source is None else read_bytes(source[0])
    robot = asked.loads.on(robot_argument(asked.robot))
    with refusals_of("effects"):
        refuse_balancers_that_are_not_there(robot, asked.effects)
    asked.progress("reading the data")
    as_read = readings_argument(robot, asked.data)
    sha256 = None
    if isinstance(asked.data, str | Path):
        sha256 = hash_of(read_bytes(path_argument(asked.data, "data")))
    readings, excluded = without_excluded(as_read, asked.exclude)
    readings = left_out(readings, asked.without)
    fixed = fixed_places_argument(asked.hold, asked.frames, robot, readings)
    bounds, bounds_file = asked.bounds, "bounds"
    if bounds is not None and not isinstance(bounds, Bounds):
        bounds_file = str(bounds)
        with refusals_of("bounds"):
            bounds = read_bounds(path_argument(bounds, "bounds"))
    options = _FitOptions(loss=asked.loss, redundancy=asked.redundancy, bounds=bounds, bounds_file=bounds_file)
    return _Read(robot, urdf, as_read, readings, sha256, tuple(excluded), fixed, options, zones)


def _model(asked: Calibrate, robot: Robot, training: Dataset) -> tuple[Model | None, str]:
    """Return the model with the effects that are added, and why it is this one."""
    name, because = asked.model_for(robot, training)
    model = MODELS[name]
    if model is not None and asked.effects:
        with refusals_of("effects"):
            model = model.also(asked.effects)
            model.free(model.prepared(robot))
    return model, because


def _split(asked: Calibrate, read: _Read) -> _Parts:
    """Check the data, and part them into what is trained on and what judges."""
    readings = read.readings
    count = train_count(asked.train, readings.configurations, readings.source)
    training, held_out = parted(readings.joints, readings.joint_kinds, count, asked.seed)
    model, because = _model(asked, read.robot, readings.of_configurations(training))
    excluded = in_parts(read.excluded, readings, held_out)
    if not readings.has_reading.any():
        raise InputError(
            "there is no reading", parameter="data", where=readings.source, cure="Fill in x, y and z, or distance."
        )
    if readings.fixture is None and not readings.has_position.any():
        raise InputError(
            "there is no position reading", parameter="data", where=readings.source, cure="Fill in x, y and z."
        )
    check_split(readings.of_configurations(training), readings.of_configurations(held_out))
    if asked.base_changes:
        checked_parts(readings, training, asked.base_changes)
    asked.progress(ACCEPTED)
    steady = without_table_motion(readings)
    moved: Sequence[Notice] = ()
    if asked.base_changes:
        asked.progress("finding how the base moved")
        steady, moved = with_one_base(
            read.robot, steady, training, asked.base_changes, model or GEOMETRIC, asked.loss, read.fixed
        )
    noticed = notices_of(readings, read.robot, steady=steady, excluded=count_excluded(excluded))
    if model is None and asked.model is None and has_error(noticed):  # its result is not to be used, whatever the model
        model, because = GEOMETRIC, "the data have an error"
    first = steady.of_configurations(training)
    second = steady.of_configurations(held_out) if len(held_out) else None
    return _Parts(
        steady, training, held_out, model, because, first, second, tuple(excluded), tuple(noticed), tuple(moved)
    )


def _identified(asked: Calibrate, read: _Read, parts: _Parts) -> _Identified:
    """Identify the robot from the training part."""
    asked.progress("placing the nominal robot")
    robot, first = read.robot, parts.first
    placed = place(robot, first, asked.loss, read.fixed)
    if asked.monte_carlo is not None:
        refuse_too_many(placed, first, parts.model or GEOMETRIC)
    shares, notices = None, list[Notice]()
    if parts.model is None:
        with followed(asked.progress, parts.judges, held_out=parts.second is not None):
            robot, fit, shares = identify_every_effect(
                robot,
                first,
                **read.options,
                fixed=read.fixed,
                bootstrap=asked.bootstrap,
                seed=asked.seed,
                progress=asked.progress,
            )
        model = fit.model
        notices += check_shares(shares)
    else:
        model, notices = without_unseen_balancers(parts.model, first)
        asked.progress(f"identifying the {model.name} model on {len(parts.training)} configurations")
        with followed(asked.progress, parts.judges, held_out=parts.second is not None):
            fit = identify(
                robot,
                first,
                model,
                **read.options,
                fixed=read.fixed,
                bootstrap=asked.bootstrap,
                seed=asked.seed,
                progress=asked.progress,
            )
    contradicted = check_fixed_places(robot, fit, first, **read.options)
    unseen = None if parts.second is None else Unseen.of(fit, parts.second, first)
    fit = fit if unseen is None else unseen.as_shown(fit)
    return _Identified(robot, placed, model, fit, unseen, shares, tuple(contradicted), tuple(notices))


def _judged(asked: Calibrate, read: _Read, parts: _Parts, solved: _Identified) -> Calibration:
    """Judge what was identified by the part that it has not seen."""
    asked.progress("judging it")
    fit, first, second = solved.fit, parts.first, parts.second
    validation = None if second is None else errors_of(fit.robot, second)
    train_errors = errors_of(fit.robot, first)
    of_split = (
        *solved.contradicted,
        *_beside_nominal(solved.placed, fit, first, second, parts.noticed, read.fixed),
        *check_excluded(
            parts.excluded,
            fit.robot,
            None if asked.base_changes else left_out(read.as_read, asked.without),
            parts.held_out,
            validation,
        ),
        *check_trained_before(
            solved.robot,
            read.as_read,
            read.sha256,
            (len(parts.training), parts.readings.configurations, asked.seed),
            without_words(asked.without),
        ),
        *parts.moved,
        *solved.notices,
    )
    diagnosis = diagnose(
        Case(
            fit,
            parts.readings,
            first,
            solved.unseen,
            validation or train_errors,
            tuple(parts.noticed),
            of_split,
            held_out=second is not None,
        )
    )
    simulated, notices = None, list[Notice]()
    if asked.monte_carlo is not None:
        simulated, notices = simulate_calibrations(
            fit,
            first,
            second,
            asked.monte_carlo,
            priors=asked.redundancy == "prior",
            seed=asked.seed,
            progress=asked.progress,
        )
    zones = None
    if read.zones is not None and second is not None:
        asked.progress("identifying zones")
        bounds = read.options["bounds"]
        zones = choose_zones(
            read.zones, solved.robot, fit, (first, second), loss=asked.loss, redundancy=asked.redundancy, bounds=bounds
        )
    return Calibration(
        fit=fit,
        nominal=errors_of(solved.placed, parts.judges),
        train=train_errors,
        validation=validation,
        expected=diagnosis.expected,
        warnings=(*diagnosis.warnings, *notices),
        next=diagnosis.next,
        data=parts.readings,
        training=parts.training,
        held_out=parts.held_out,
        command=asked.again,
        history=_history(asked, read, parts, solved),
        urdf=read.urdf,
        shares=solved.shares,
        because=parts.because,
        without=tuple(asked.without),
        excluded=parts.excluded,
        notes=dict(asked.notes or {}),
        monte_carlo=simulated,
        zones=zones,
    )


def _history(asked: Calibrate, read: _Read, parts: _Parts, solved: _Identified) -> str:
    """Return what was done, in one line with the hash of the data."""
    by_file = "" if read.sha256 is None else f"sha256 {read.sha256[:12]}, "
    digest = f" ({by_file}readings {readings_digest(read.as_read)[:12]})"
    freed = " + ".join([solved.model.name, *(name for name in asked.effects if name in solved.model.effects)])
    return (
        f"calibrated by truearm {__version__}: model {freed},"
        f" {len(parts.training)} of {parts.readings.configurations} configurations of"
        f" {Path(parts.readings.source).name}{digest}, seed {asked.seed}, loss {asked.loss},"
        f"{without_words(asked.without)}"
        f"{f' {sum(rows.readings for rows in parts.excluded)} readings excluded,' if parts.excluded else ''}"
        f" redundancy {asked.redundancy}{f', {listed(asked.hold)} held' if asked.hold else ''}"
        f"{f', bootstrap {asked.bootstrap}' if asked.bootstrap else ''}"
        f"{f', another base from {listed(asked.base_changes)} on' if asked.base_changes else ''}"
    )


def _beside_nominal(
    placed: Robot, fit: Fit, training: Dataset, held_out: Dataset | None, noticed: Sequence[Notice], fixed: FixedPlaces
) -> list[Notice]:
    """Say what the held-out part tells of the calibrated robot beside the nominal one.

    Where single readings are doubted, they pull base and targets of the nominal robot too, unless the loss is robust.

    Args:
        placed: The nominal robot, base and targets found as the fit finds them.
        noticed: What was said of the data.
    """
    if held_out is None:
        return [nothing_held_out()]
    if fit.model is FRAMES:  # the robot is the nominal one
        return []
    doubted = fit.loss in PULLED and any(notice.code in DOUBTED for notice in noticed)
    nominal = place(fit.start, training, "cauchy", fixed) if doubted else placed
    return check_gain(errors_of(nominal, held_out), errors_of(fit.robot, held_out), held_out, doubted=doubted)
