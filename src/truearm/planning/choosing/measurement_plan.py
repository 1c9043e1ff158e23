"""Which configurations to measure for a calibration, in which order, and what comes of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError, did_you_mean
from truearm.identification.solving.models import Model
from truearm.identification.solving.redundancy import gauge_freedoms
from truearm.identification.start_values.frames import initial_frames
from truearm.identification.start_values.from_readings import unanchored, with_fixtures_of
from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.planning.choosing.exchange import FIRST, most_informative, most_informative_number
from truearm.planning.choosing.observability import INDICES, OfPredictions, observability
from truearm.planning.choosing.ordering import short_order
from truearm.planning.choosing.prediction import Prediction, There, model_error, predict
from truearm.planning.choosing.reachable import Reachable, chosen_with_ways
from truearm.planning.choosing.sensitivity import sensitivity, sensitivity_of_readings
from truearm.planning.constraints.constraints import Constraints, allowed, refuse_clearance_of
from truearm.planning.driving.drawing import Drawn, drawn_clear
from truearm.planning.driving.joint_window import joint_window, on_principal_turn
from truearm.planning.driving.ways import WayFinder
from truearm.simulated import Marked
from truearm.simulation.devices import Device, in_view_of
from truearm.simulation.truths import carrying_targets

#: How far before a configuration each joint stops, to come to it moving forward [rad; m for sliding joints].
APPROACH: Final = {"revolute": np.deg2rad(2.0), "prismatic": 5e-3}
_PREDICTED_CONFIGURATIONS: Final = 500
_DRAWN_ELSEWHERE: Final = 5000
_FEWEST_ELSEWHERE: Final = 50


@dataclass(frozen=True, eq=False)
class MeasurementPlan:
    """Configurations to measure, in the order in which to measure them."""

    robot: Robot  #: With the targets that are measured.
    model: Model  #: What will be identified.
    objective: str  #: ``O1`` to ``O5``, or ``error``.
    labels: tuple[str, ...]  #: Name of each configuration.
    chosen: NDArray[np.intp]  #: Indices among the candidates, ``(n,)``.
    joints: Array  #: Readings [rad or m], ``(n, joints)``.
    #: Where each joint stops before, so that all come to a configuration moving forward and backlash cancels; as far as
    #: the limits allow, those of the constraints too, ``(n, joints)``; None where it does not stop there.
    before: Array | None
    indices: Mapping[str, float]  #: O1 to O5 of the whole.
    candidates: int  #: How many configurations there were to choose from, before constraints.
    rejected: Mapping[str, int]  #: How many of them break each constraint; one may break several.
    usable: int  #: How many break none.
    left_out: tuple[str, ...]  #: Parameters that the candidates do not tell from others, or hardly at all.
    seconds: float  #: Processor time of the search alone.
    prediction: Prediction  #: How accurate the calibration will be.
    #: What the device reads at each configuration, in words; nothing if no device was named.
    reads: tuple[str, ...] = ()
    #: Where fixtures stand in the base frame [m], ``(3,)`` each; of a plane the foot of its distance from the origin.
    fixtures: Mapping[str, Array] = field(default_factory=dict)
    drawn: Drawn | None = None  #: How the candidates were drawn; None if they were given, or are a device's.

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``robot``, if it is for a robot that was calibrated with simulated measurements."""
        return self.robot.simulated_from

    #: The usable candidates [rad or m], ``(usable, joints)``.
    among: Array = field(default_factory=lambda: np.zeros((0, 0)))


def with_targets(robot: Robot, data: Dataset | None = None) -> Robot:
    """Return a robot that is seen: with its own targets, else placed by readings, else with its tool's targets.

    The tool is the robot file's first, or three reflectors 150 mm apart. Where the robot stands is then not known, and
    it does not matter to what its readings tell.
    """
    if not robot.targets and data is not None and data.has_position.any():
        return initial_frames(robot, data)
    return carrying_targets(robot)


def random_candidates(robot: Robot, count: int, rng: np.random.Generator) -> Postures:
    """Return configurations drawn within the limits, each joint coming to it moving forward."""
    return _forward(robot.random_configurations(count, rng))


def driven_candidates(robot: Robot, count: int, rng: np.random.Generator, finder: WayFinder) -> tuple[Postures, Drawn]:
    """Return configurations drawn where the arm keeps clear, each joint coming to it moving forward; what that cost.

    There are fewer than `count` if the cell leaves little room.

    Args:
        robot: Whose configurations they are.
        finder: What is kept clear, and the limits.

    Raises:
        InputError: If there is none.
    """
    drawn = drawn_clear(finder, count, _approach(robot), rng)
    return _forward(drawn.joints), drawn


def _forward(joints: Array) -> Postures:
    return Postures(joints, approach=np.ones_like(joints), number=np.zeros(len(joints)))


def _approach(robot: Robot) -> Array:
    return np.array([APPROACH[joint.kind] for joint in robot.joints])


@dataclass(frozen=True)
class _AsSaid:
    """A robot taken at its word, as a device measures it."""

    robot: Robot

    def frames(self, joints: Array) -> Mapping[str, Array]:
        found = {}
        for target in self.robot.targets:
            frame = np.tile(np.eye(4), (len(joints), 1, 1))
            frame[:, :3, 3], frame[:, :3, :3] = self.robot.world_poses(joints, target.name)
            found[target.name] = frame
        return found


def device_candidates(
    robot: Robot, device: Device, count: int, rng: np.random.Generator
) -> tuple[Robot, Dataset, Postures]:
    """Return configurations that a device could measure.

    Returns:
        The robot where the device has it stand, with its tool; what the device would read of it without noise; and the
        postures, each joint coming to them moving forward.
    """
    seen = in_view_of(device, robot)
    readings = device.campaign(seen, _AsSaid(seen.rigid), count, 0.0, rng)
    readings = replace(readings, joints=on_principal_turn(seen, readings.joints))
    return seen, readings, _forward(readings.joints)


def plan_measurements(
    robot: Robot,
    candidates: Postures,
    model: Model,
    *,
    poses: int | None,
    rng: np.random.Generator,
    objective: str = "O1",
    accurate_at: Postures | None = None,
    noise: float = 1e-4,
    labels: tuple[str, ...] | None = None,
    constraints: Constraints | None = None,
    where: str = "constraints",
    seen_from_the_origin: bool = True,
    readings: Dataset | None = None,
    finder: WayFinder | None = None,
    drawn: Drawn | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> MeasurementPlan:
    """Choose configurations to measure.

    Args:
        robot: Nominal or calibrated, with targets, see :func:`with_targets`; derivatives are taken at its parameter
            values.
        candidates: To choose from.
        model: What will be identified.
        poses: How many; None lets O1 decide.
        rng: For the prediction.
        objective: ``O1`` to ``O5``; ``error`` for the mean square error where the robot shall be accurate.
        accurate_at: Where that is; None for everywhere.
        noise: Standard deviation of a coordinate about a well identified model [m].
        labels: Names of the candidates; numbers in the order of measurement if None.
        constraints, where: What a configuration must keep besides the robot's limits, and the file that says so, for
            messages.
        seen_from_the_origin: Whether the instrument stands at the origin of the robot's world, as after a calibration.
        readings: What a device would read at the candidates, see :func:`device_candidates`; None for the positions of
            all targets at each.
        finder: What the arm keeps clear of, at the candidates, on the ways to those that are chosen and where its
            accuracy is predicted; None for nothing.
        drawn: How the candidates were drawn, see :func:`driven_candidates`.
        progress: Called with a few words at each step.

    Raises:
        InputError: If the objective is not known or does not decide on a number, too few candidates keep the
            constraints, or there are fewer rows than parameters, candidates that were drawn are all alike, or there are
            ways to fewer candidates than are chosen.
    """
    _check_objective(objective, poses, accurate_at)
    seen = model.prepared(robot)
    refuse_clearance_of(seen, constraints, where)
    kept = dict(allowed(seen, candidates, constraints, where, seen_from_the_origin=seen_from_the_origin))
    if finder is not None:
        kept |= {name: keeps for name, keeps in finder.check.kept(candidates.joints).items() if not keeps.all()}
    rejected = {name: int(np.sum(~keeps)) for name, keeps in kept.items()}
    total = len(candidates)
    usable = np.flatnonzero(np.all(list(kept.values()), axis=0))
    given = "candidates" if labels is None else "candidates_from"
    count = FIRST if poses is None else poses
    _refuse_too_few(count, len(usable), total, rejected, given, drawn)
    if readings is None:
        free = model.free(seen)
        gauge: tuple[str, ...] = ()
        derivatives = sensitivity(seen, candidates.at(usable), free, noise)
    else:
        seen = with_fixtures_of(seen, readings)
        free, gauge = unanchored(model.free(seen), readings), gauge_freedoms(readings)
        derivatives = sensitivity_of_readings(seen, readings.of_configurations(usable), free, noise)
    among = derivatives.identifiable(count)
    known = derivatives.known[np.ix_(among, among)]
    if not len(among):
        raise InputError(
            "with so much noise nothing can be identified",
            parameter="noise",
            came=f"{noise:g} m",
            cure="Lower `noise`.",
        )
    elsewhere = _elsewhere(seen, finder, rng)
    predicted = sensitivity(seen, elsewhere, free, noise, gauge)
    needed = len(among)
    if readings is None:  # few candidates show less than there is to identify
        needed = max(needed, len(predicted.identifiable(count)))
    if poses is not None and poses * derivatives.rows.shape[1] < needed:
        raise InputError(
            "there are fewer equations than parameters",
            parameter="poses",
            came=poses,
            allowed=f"{-(-needed // derivatives.rows.shape[1])} or more for the model {model.name}, or auto",
        )
    wanted = None if accurate_at is None else sensitivity(seen, accurate_at, free, noise, gauge)
    goal = INDICES["O1"] if wanted is None else OfPredictions.of(wanted.rows[..., among])
    goal = INDICES.get(objective, goal)
    of_candidate = np.zeros(len(candidates), dtype=np.intp)
    of_candidate[usable] = np.arange(len(usable))
    seconds = 0.0

    def rows_of(these: NDArray[np.intp]) -> Array:
        return np.ascontiguousarray(derivatives.rows[of_candidate[these]][..., among])

    def choose(these: NDArray[np.intp]) -> NDArray[np.intp]:
        nonlocal seconds
        rows, started = rows_of(these), time.process_time()
        found = most_informative_number(rows, known) if poses is None else most_informative(rows, poses, known, goal)
        seconds += time.process_time() - started
        return these[np.array(found, dtype=np.intp)]

    stops = before(seen, candidates.joints, None if finder is None else finder.low)
    reachable = None if finder is None else Reachable(finder, candidates.joints, stops)
    chosen, cost = chosen_with_ways(choose, usable, reachable, count, progress)
    rejected |= cost
    chosen = chosen[short_order(candidates.joints[chosen])]
    order = of_candidate[chosen]
    joints = candidates.joints[chosen]
    if drawn is not None and len(np.unique(joints, axis=0)) < len(joints):
        raise InputError(
            "configurations that were chosen coincide, as the joints have hardly any range",
            parameter="constraints",
            came=f"{len(np.unique(joints, axis=0))} different ones of {len(joints)}",
            cure="Widen the limits of the joints; check their unit.",
        )
    chosen_rows = rows_of(chosen).reshape(-1, len(among))
    left = len(usable) - sum(cost.values())
    progress("predicting the accuracy")
    there = None
    if wanted is not None and accurate_at is not None:
        alike = None
        if objective != "O1":
            by_o1 = np.array(most_informative(rows_of(usable), len(order), known, INDICES["O1"]), dtype=np.intp)
            alike = model_error(derivatives, by_o1, wanted, noise)
        there = There(seen.world_poses(accurate_at)[0], model_error(derivatives, order, wanted, noise), alike)
    at_fixtures = {}
    for fixture in seen.fixtures if readings is not None else ():
        place = seen.fixture_kinematics(fixture.name).position[:, 0]
        at_fixtures[fixture.name] = (place - np.array(seen.base.translation)) @ seen.base.rotation
    return MeasurementPlan(
        drawn=drawn,
        reads=() if readings is None else _in_words(readings.of_configurations(chosen)),
        fixtures=at_fixtures,
        among=candidates.joints[usable],
        robot=seen,
        model=model,
        objective=objective,
        labels=tuple(str(k + 1) for k in range(len(chosen))) if labels is None else tuple(labels[k] for k in chosen),
        chosen=chosen,
        joints=joints,
        before=stops[chosen],
        indices=observability(known + chosen_rows.T @ chosen_rows, len(chosen)),
        candidates=total,
        rejected=rejected,
        usable=left,
        left_out=tuple(name for k, name in enumerate(derivatives.free.names) if k not in among),
        seconds=seconds,
        prediction=replace(predict(seen, derivatives, order, predicted, elsewhere.joints, noise, rng), there=there),
    )


#: What is made small where the robot shall be accurate.
ERROR: Final = "error"


def _check_objective(objective: str, poses: int | None, accurate_at: Postures | None) -> None:
    known = (*INDICES, ERROR)
    if objective not in known:
        raise InputError(
            "there is no objective of this name",
            parameter="objective",
            came=objective,
            allowed=", ".join(known),
            cure=did_you_mean(objective, known),
        )
    if objective == ERROR and accurate_at is None:
        raise InputError(
            "nothing was said of where the error shall be small",
            parameter="objective",
            came=objective,
            cure="Give `accurate_at` or `region`, or another objective.",
        )
    if poses is None and objective != "O1":
        raise InputError(
            "only O1 can choose the number of poses",
            parameter="poses",
            came=f"auto, and the objective {objective}",
            cure="Name a number of poses, or use `objective=O1`.",
        )


def _in_words(readings: Dataset) -> tuple[str, ...]:
    """Say what is read at each configuration."""
    words: list[list[str]] = [[] for _ in readings.labels]
    for row, (c, t, f) in enumerate(zip(readings.configuration, readings.target, readings.against, strict=True)):
        said = readings.targets[t]
        beside = readings.fixtures[f] if f >= 0 else ""
        if readings.distance is not None and np.isfinite(readings.distance[row]):
            said += f" from {beside} {readings.distance[row] * 1e3:.2f} mm"
        elif readings.height is not None and np.isfinite(readings.height[row]):
            said += f" over {beside} {readings.height[row] * 1e3:.2f} mm"
        elif beside:
            said += f" at {beside} ({', '.join(f'{v * 1e3:.2f}' for v in readings.position[row])}) mm"
        words[c].append(said)
    return tuple("; ".join(one) for one in words)


def before(robot: Robot, joints: Array, low: Array | None = None) -> Array:
    """Return where each joint stops before configurations ``(n, joints)``, no lower than `low`, or its limits."""
    if low is None:
        low = np.array([-np.inf if joint.limits is None else joint.limits[0] for joint in robot.joints])
    return np.asarray(np.minimum(np.maximum(joints - _approach(robot), low), joints))


def _elsewhere(robot: Robot, finder: WayFinder | None, rng: np.random.Generator) -> Postures:
    """Return configurations at which the accuracy is predicted: all over the robot's own limits, where it is clear."""
    if finder is None:
        return random_candidates(robot, _PREDICTED_CONFIGURATIONS, rng)
    low, high = joint_window(robot)
    some = rng.uniform(low, high, (_DRAWN_ELSEWHERE, len(low)))
    clear = some[finder.check.room(some) >= finder.check.cell.clearance]
    return _forward((clear if len(clear) >= _FEWEST_ELSEWHERE else some)[:_PREDICTED_CONFIGURATIONS])


def _refuse_too_few(
    needed: int, usable: int, candidates: int, rejected: Mapping[str, int], given: str, drawn: Drawn | None
) -> None:
    if needed < 1:
        raise InputError("at least one pose is needed", parameter="poses", came=needed, allowed="1 or more, or auto")
    if usable < needed:
        cost = ", ".join(f"{name} {count}" for name, count in rejected.items() if count)
        came = f"{usable} of {candidates} usable" + (f"; rejected by {cost}" if cost else "")
        cure = "Widen the constraint that costs most, or give more candidates." if cost else "Give more candidates."
        if drawn is not None and len(drawn.joints) < drawn.wanted:
            came += f"; of {drawn.tried} drawn, too near to {drawn.words}"
            cure = "Make room where most was lost: smaller boxes, wider limits, a lower `floor`, less `clearance`."
        raise InputError(
            "too few configurations are left to choose from",
            parameter=given,
            came=came,
            allowed=f"{needed} or more",
            cure=cure,
        )
