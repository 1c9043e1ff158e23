"""From measurements to a calibrated robot: load, check, split, fit, judge, write."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final, Literal, Self, TypedDict, get_args

import numpy as np

from truearm.calibration.holding import held_argument
from truearm.calibration.result import RESULT_FILES, Calibration
from truearm.calibration.zones import choose_zones, zone_file_names, zones_argument
from truearm.engine.base.errors import InputError, Notice, listed, refusals_of
from truearm.engine.base.files import path_argument, read_bytes
from truearm.engine.base.version import __version__
from truearm.engine.choosing.candidates import (
    compared_with,
    refuse_balancers_that_are_not_there,
    without_unseen_balancers,
)
from truearm.engine.choosing.chosen_fit import check_choice, check_part, identify_chosen
from truearm.engine.choosing.selection import AUTO, select
from truearm.engine.command.arguments import (
    choice_argument,
    choices_argument,
    command_argument,
    count_argument,
    files_of,
    flag_argument,
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
from truearm.engine.command.reading import check_excluded, count_excluded, in_parts, without_excluded
from truearm.engine.command.split import (
    check_copies,
    check_split,
    check_trained_before,
    left_out,
    nothing_held_out,
    train_count,
    without_words,
)
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of, without_table_motion
from truearm.engine.data.thinning import readings_digest
from truearm.engine.diagnose.base_changes import checked_parts, with_one_base
from truearm.engine.diagnose.data_check import notices_of
from truearm.engine.diagnose.gain import check_gain
from truearm.engine.diagnose.held_places import check_held
from truearm.engine.diagnose.judgement import DOUBTED, PULLED, judge
from truearm.engine.diagnose.simulated_calibrations import (
    SimulatedCalibrations,
    check_linear,
    refuse_too_many,
    simulated_calibrations,
)
from truearm.engine.fit.bounds import Bounds, read_bounds
from truearm.engine.fit.fit import LEAST_FITS, Fit, Status, identify, place
from truearm.engine.fit.held import Held
from truearm.engine.fit.likelihood import WhitenedProblem
from truearm.engine.fit.losses import LOSSES, Loss
from truearm.engine.fit.models import FRAMES, MODELS, Model, named_model
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.rounds import Redundant
from truearm.engine.fit.solver import watching
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.library import urdf_source
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.proof import Proof
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.seal import is_intact

# What is told of a fit while it is made: its cost, and the error on configurations that it does not see.

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
        made = cls(f"step {number}: cost {cost:.4g}, {judges} error {error * 1e3:.3f} mm")
        made.number, made.cost, made.error = number, cost, error
        return made


@contextmanager
def followed(progress: Callable[[str], None], judging: Dataset, *, held_out: bool) -> Iterator[None]:
    """Tell of the steps of the fits in this block, as far as that costs next to nothing.

    Args:
        judging: What the fit is judged on.
        held_out: Whether the fit does not see it.
    """
    number, spent, start = 0, 0.0, time.process_time()

    def told(problem: object, vector: Array, cost: float) -> None:
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
        found = errors.position or errors.length
        if found is not None:
            progress(FitStep.of(number, cost, found.mean, "held-out" if held_out else "training"))
        spent += time.process_time() - began

    with watching(told):
        yield


# Intervals by Monte Carlo for a calibration: what is accepted, and how far the work has come.

#: Fewer trials than this give no interval of 95 %.
_LEAST: Final = 100
#: Length of the bar that shows how much is done.
_BAR: Final = 20


def trials_argument(value: object, loss: Loss, bounds: object) -> int | None:
    """Return how many calibrations shall be simulated; None for None.

    Raises:
        InputError: For too few or too many of them, and for fits that are no plain least squares.
    """
    if value is None:
        return None
    trials = count_argument(value, "monte_carlo", _LEAST)
    if loss != "linear":
        raise InputError(
            "calibrations are simulated by least squares, and other losses are for noise that is not normal",
            parameter="monte_carlo",
            came=f"the loss {loss}",
            cure="Leave `loss` out, or leave `monte_carlo` out: the deviations then follow from the scatter of the "
            "configurations.",
        )
    if bounds is not None:
        raise InputError(
            "calibrations are simulated without bounds",
            parameter="monte_carlo",
            came="bounds" if isinstance(bounds, Bounds) else str(bounds),
            cure="Leave `bounds` out, or leave `monte_carlo` out.",
        )
    return trials


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
            Notice(
                "not-simulated",
                f"No calibration was simulated, because this one ended with {fit.status.value}: intervals say nothing "
                "of what the data do not determine.",
                "note",
            )
        ]

    def done(count: int) -> None:
        full = _BAR * count // trials
        progress(f"simulating calibrations [{'#' * full}{'.' * (_BAR - full)}] {count} of {trials}")

    judged = training if held_out is None else held_out
    found = simulated_calibrations(fit, training, judged, trials, priors=priors, seed=seed, progress=done)
    return found, check_linear(fit, found)


Train = int | Literal["all"] | None

#: The step at which everything that was given has been read and found usable.
ACCEPTED: Final = "checking the data"
#: Every model that can be asked for by name; None chooses.
_MODELS: Final[dict[str, Model | None]] = {m.name: m for m in (FRAMES, *MODELS)} | {AUTO: None}


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
    hold: Sequence[str] = (),
    frames: str | Path | None = None,
    bootstrap: int = 0,
    effects: Sequence[str] = (),
    payload: Payload | str | None = None,
    gravity: Sequence[float] | None = None,
    base_changes: Sequence[str] = (),
    without: Sequence[str] = (),
    exclude: str | Path | None = None,
    monte_carlo: int | None = None,
    zones: int | str | Path | None = None,
    notes: Mapping[str, str] | None = None,
    replace: bool = False,
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
        One of :data:`truearm.engine.fit.models.MODELS` by name; ``frames``, which leaves the robot as it is
        and finds base, targets and fixtures alone, a tool's tip for example; or ``auto``: the joint effects that
        cross-validation on the training part says the data can carry.
    train
        How many configurations to train on, drawn with `seed`; the rest is held out. None is 70 %; ``all`` holds
        nothing out.
    seed
        Of the split: training is the first `train` of ``numpy.random.default_rng(seed).permutation(n)``; and of the
        bootstrap.
    loss
        ``linear``, ``huber``, ``cauchy``, ``l1`` (sum of the distances of the readings) or ``l1-components`` (sum of
        the absolute values of their coordinates).
    redundancy
        ``prior``, ``drop`` or ``none``, see :func:`truearm.engine.fit.fit.identify`. The last needs
        `bounds` or `hold`.
    bounds
        Limits of parameter values, or a bounds file.
    hold
        What is known and not found: ``base``, ``targets``, ``fixtures``, or targets and fixtures by name. The
        calibration is an absolute one then.
    frames
        File with the places of what is held, of the schema ``truearm-cell/1``: targets are its tools, base and fixtures
        its frames. See :mod:`truearm.engine.programs.cell`.
    bootstrap
        How many fits to configurations drawn anew the deviations follow from; 0: from one fit's residuals.
    effects
        Joint effects to add to the model, of :data:`truearm.engine.robot.effects.EFFECTS` by name.
    payload, gravity
        What the robot carried (an object, or a text such as ``2.7kg,50mm,25mm,100mm``) and free fall in its base frame
        [m/s^2], see :meth:`truearm.Robot.with_payload`.
    base_changes
        Configurations from which on, in the order of measurement, the instrument or the robot's base stood elsewhere.
        The motion is found along with the model (``geometric`` for ``auto``) from the training configurations, and
        taken out of the readings; no deviation contains what is not known of it.
    without
        Configurations that are left out, by their labels: neither part of the split knows them.
    exclude
        File of readings that are excluded, each with its reason: they count as missing, and the split stays. See
        :mod:`truearm.engine.data.excluded`.
    monte_carlo
        How many calibrations of the robot that is found are simulated (100 or more): their spread gives intervals of
        the parameters and the predictions that need no linearity, beside the linear ones. With the linear loss and
        without bounds; seeded by `seed`. None simulates none.
    zones
        Into how many zones the workspace is cut, 2 to 64, or a file of zones: each gets a model of its own, which is
        kept if it is better on the held-out configurations there; it is written as ``zone-NAME.yaml``, and
        ``zones.yaml`` says where they are.
    notes
        What to write on the report and into result.json, by its name: ``date``, ``serial``, ``operator``,
        ``instrument``, or any other.
    replace
        Whether a sound result in `out` is replaced by one that is not: by one that is worse than the nominal robot or
        has no gain over it, or that ended in another bad status or with an error.
    command
        How to run it again, for the report; None writes the call in Python.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        For anything that cannot be used, with a message that says what to do. Where a sound result stays, it is a
        :class:`truearm.calibration.parts.ResultKeptError`, which has the new one as its attribute ``calibration``.
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
    notes, replace = notes_argument(notes), flag_argument(replace, "replace")
    choice_argument(loss, "loss", {name: name for name in LOSSES})
    choice_argument(redundancy, "redundancy", {name: name for name in get_args(Redundant)})
    seed = whole_argument(seed, "seed")
    hold = names_argument(hold, "hold", "base, targets, fixtures, or names of these")
    bootstrap = _fits_argument(bootstrap)
    trials = trials_argument(monte_carlo, loss, bounds)
    wanted_zones = zones_argument(zones, held_out=train != "all")
    if trials is not None and bootstrap:
        raise InputError(
            "simulated calibrations are compared with the deviations of the fit itself, not with those of a bootstrap",
            parameter="monte_carlo, bootstrap",
            cure="Leave one of them out.",
        )
    for given, name in ((trials, "monte_carlo"), (wanted_zones, "zones")):
        if given is not None and hold:
            raise InputError(
                "this is not made with places that are held", parameter=name, cure="Leave it out, or leave out `hold`."
            )
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
        hold=list(hold) or None,
        frames=frames,
        bootstrap=bootstrap or None,
        effects=list(effects) or None,
        base_changes=list(base_changes) or None,
        without=list(without) or None,
        exclude=exclude,
        monte_carlo=trials,
        zones=zones,
        notes=notes or None,
        payload=payload,
        gravity=fall,
    )
    refuse_swapped(robot, data, "calibrate")
    inputs = files_of(robot, data, bounds, zones, frames, exclude)
    folder = (
        None
        if out is None
        else folder_for(
            (*RESULT_FILES, *zone_file_names(wanted_zones)), out, robot, data, bounds, zones, frames, exclude, ours=True
        )
    )
    progress("reading the robot")
    source = urdf_source(robot) if isinstance(robot, str | Path) else None
    urdf = None if source is None else read_bytes(source[0])
    nominal_robot = robot_argument(robot).with_payload(payload, fall)
    if effects and named is not None:
        with refusals_of("effects"):
            refuse_balancers_that_are_not_there(nominal_robot, effects)
            asked = named.also(effects)
            asked.free(asked.prepared(nominal_robot))
    progress("reading the data")
    readings = as_read = readings_argument(nominal_robot, data)
    sha256 = None
    if isinstance(data, str | Path):
        sha256 = hashlib.sha256(read_bytes(path_argument(data, "data"))).hexdigest()
    readings, excluded = without_excluded(readings, exclude)
    readings = left_out(readings, without)
    held = held_argument(hold, frames, nominal_robot, readings)
    bounds_file = str(bounds) if isinstance(bounds, str | Path) else "bounds"
    if bounds is not None and not isinstance(bounds, Bounds):
        with refusals_of("bounds"):
            bounds = read_bounds(path_argument(bounds, "bounds"))
    with refusals_of("data"):
        n = readings.configurations
        count = train_count(train, n, readings.source)
        order = np.random.default_rng(seed).permutation(n)
        training, held_out = order[:count], order[count:]
        excluded = in_parts(excluded, readings, held_out)
        if not readings.has_reading.any():
            raise InputError(
                "there is no reading", parameter="data", where=readings.source, cure="Fill in x, y and z, or distance."
            )
        if readings.fixture is None and not readings.has_position.any():
            raise InputError(
                "there is no position reading", parameter="data", where=readings.source, cure="Fill in x, y and z."
            )
        check_split(readings.of_configurations(training), readings.of_configurations(held_out))
        if base_changes:
            checked_parts(readings, training, base_changes)

        progress(ACCEPTED)
        steady = without_table_motion(readings)
        moved: list[Notice] = []
        if base_changes:
            progress("finding how the base moved")
            along = named_model("geometric") if named is None else named.also(effects)
            steady, moved = with_one_base(nominal_robot, steady, training, base_changes, along, loss, held)
        noticed = notices_of(readings, nominal_robot, steady=steady, excluded=count_excluded(excluded))
        readings = steady
        first = readings.of_configurations(training)
        second = readings.of_configurations(held_out) if len(held_out) else None
        judges = first if second is None else second
        progress("placing the nominal robot")
        placed = place(nominal_robot, first, loss, held)
        if trials is not None:
            refuse_too_many(placed, first, named_model("geometric") if named is None else named.also(effects))
        how = _How(loss=loss, redundancy=redundancy, bounds=bounds, bounds_file=bounds_file)
        selection, compared, held_effects = None, first, list[Notice]()
        if named is None:
            compared = compared_with(nominal_robot, first)
            selection = select(nominal_robot, compared, **how, held=held, seed=seed, progress=progress)
            with followed(progress, judges, held_out=second is not None):
                selection, fit = identify_chosen(
                    nominal_robot, first, selection, **how, held=held, bootstrap=bootstrap, seed=seed, progress=progress
                )
            nominal_robot, chosen = selection.prepared(nominal_robot), selection.model
        else:
            chosen, held_effects = without_unseen_balancers(named.also(effects), first)
            progress(f"identifying the {chosen.name} model on {count} configurations")
            with followed(progress, judges, held_out=second is not None):
                fit = identify(
                    nominal_robot, first, chosen, **how, held=held, bootstrap=bootstrap, seed=seed, progress=progress
                )
        contradicted = check_held(nominal_robot, fit, first, **how)
    progress("judging it")
    validation = None if second is None else errors_of(fit.robot, second)
    before = errors_of(placed, judges)
    train_errors = errors_of(fit.robot, first)
    of_split = (
        *contradicted,
        *_beside_nominal(placed, fit, first, second, noticed, held),
        *check_excluded(
            excluded, fit.robot, None if base_changes else left_out(as_read, without), held_out, validation
        ),
        *check_copies(readings, training, held_out),
        *check_trained_before(nominal_robot, as_read, sha256, (count, n, seed), without_words(without)),
        *moved,
        *held_effects,
        *(() if selection is None else (*check_choice(selection), *check_part(compared, first))),
    )
    judged = judge(
        fit, readings, first, validation or train_errors, noticed, of_split, loss, held_out=second is not None
    )
    simulated, told = None, list[Notice]()
    if trials is not None:
        simulated, told = simulate_calibrations(
            fit, first, second, trials, priors=redundancy == "prior", seed=seed, progress=progress
        )
    chosen_zones = None
    if wanted_zones is not None and second is not None:
        progress("identifying zones")
        chosen_zones = choose_zones(
            wanted_zones, nominal_robot, fit, (first, second), loss=loss, redundancy=redundancy, bounds=bounds
        )
    digest = f" ({'' if sha256 is None else f'sha256 {sha256[:12]}, '}readings {readings_digest(as_read)[:12]})"
    freed = " + ".join([chosen.name, *(name for name in effects if name in chosen.effects)])
    history = (
        f"calibrated by truearm {__version__}: model {freed},"
        f" {count} of {n} configurations of {Path(readings.source).name}{digest}, seed {seed}, loss {loss},"
        f"{without_words(without)}"
        f"{f' {sum(one.readings for one in excluded)} readings excluded,' if excluded else ''}"
        f" redundancy {redundancy}{f', {listed(hold)} held' if hold else ''}"
        f"{f', bootstrap {bootstrap}' if bootstrap else ''}"
        f"{f', another base from {listed(base_changes)} on' if base_changes else ''}"
    )
    calibration = Calibration(
        fit=fit,
        nominal=before,
        train=train_errors,
        validation=validation,
        expected=judged.expected,
        warnings=(*judged.warnings, *told),
        next=judged.next,
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
        excluded=excluded,
        notes=notes,
        monte_carlo=simulated,
        zones=chosen_zones,
    )
    if folder is not None:
        calibration.save(folder, progress, replace=replace)
    return calibration


def _beside_nominal(
    placed: Robot, fit: Fit, training: Dataset, held_out: Dataset | None, noticed: Sequence[Notice], held: Held
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
    nominal = place(fit.start, training, "cauchy", held) if doubted else placed
    return check_gain(errors_of(nominal, held_out), errors_of(fit.robot, held_out), held_out, doubted=doubted)


def _fits_argument(bootstrap: object) -> int:
    """Return how many fits the deviations shall follow from; none, or enough."""
    if isinstance(bootstrap, int) and not isinstance(bootstrap, bool) and bootstrap == 0:
        return 0
    return count_argument(bootstrap, "bootstrap", LEAST_FITS)


class _How(TypedDict):
    """How parameters are identified, whatever is held."""

    loss: Loss
    redundancy: Redundant
    bounds: Bounds | None
    bounds_file: str


def _known_before(robot: Robot) -> Proof | None:
    """Return what is known of a robot already; of one whose values were changed since, only what speaks against it."""
    if robot.proof is None or is_intact(robot):
        return robot.proof
    return replace(robot.proof, names=(), deviations=(), factor=())
