"""Which configurations to measure for a calibration, in which order, and what comes of it."""

from __future__ import annotations

import csv
import io
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.base.units import Marked
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.design import (
    FIRST,
    INDICES,
    OfPredictions,
    most_informative,
    most_informative_number,
    observability,
)
from truearm.engine.fit.frames import initial_frames
from truearm.engine.fit.models import Model
from truearm.engine.fit.problem import gauge_freedoms
from truearm.engine.fit.start_values import unanchored, with_fixtures_of
from truearm.engine.motion.constraints import Constraints, allowed, joint_window, on_principal_turn, refuse_clearance_of
from truearm.engine.motion.ordering import short_order
from truearm.engine.motion.touring import unreached
from truearm.engine.motion.ways import Drawn, WayFinder, drawn_clear
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.urdf_writing import counting, joint_cells, joint_headings
from truearm.engine.twin.devices.device import Device, in_view_of
from truearm.engine.twin.truths import carrying_targets
from truearm.planning.accuracy import Prediction, There, model_error, predict, sensitivity, sensitivity_of_readings

#: After as many choices with configurations that have no way, those are chosen from whose ways are known.
_ROUNDS: Final = 3
#: So many times as many as are chosen are enough to choose from, and so many ways around are looked for to have them.
_ENOUGH: Final = 10
_TRIED: Final = 300
_AT_ONCE: Final = 30
#: As many ways tell what is in the way most often.
_TOLD: Final = 200

Indices = NDArray[np.intp]


class Reachable:
    """Candidates as they are found to have a way from the safe configuration, or none.

    Args:
        finder: Finds the ways.
        joints: The candidates, ``(n, joints)`` [rad or m].
        before: Where the arm stops right before each, ``(n, joints)``.
    """

    def __init__(self, finder: WayFinder, joints: Array, before: Array) -> None:
        self.finder, self.joints, self.before = finder, joints, before
        self.known = np.zeros(len(joints), bool)
        self.lost = np.zeros(len(joints), bool)

    def look(self, at: Indices) -> None:
        """Look for the ways to candidates, as far as they are not known."""
        at = at[~(self.known | self.lost)[at]]
        if len(at):
            without = unreached(self.finder, self.joints[at], self.before[at])
            self.known[at] = True
            self.known[at[without]] = False
            self.lost[at[without]] = True

    def with_straight_ways(self, at: Indices, wanted: int, progress: Callable[[str], None]) -> Indices:
        """Return those of candidates to which a way is known: all with straight ones, and others until it is enough.

        Args:
            at: To choose from, in any order.
            wanted: How many are chosen.
            progress: Called with a few words at each step.
        """
        progress(f"looking which of {len(at)} configurations are driven to straight")
        check, left = self.finder.check, at[~(self.known | self.lost)[at]]
        home = np.broadcast_to(self.finder.home, self.joints.shape)
        for start, end in ((self.joints, home), (self.before, home), (self.before, self.joints)):
            left = left[check.ways(start[left], end[left]).clear]
        self.known[left] = True
        others = np.random.default_rng(0).permutation(at[~(self.known | self.lost)[at]])[:_TRIED]
        while self.known[at].sum() < _ENOUGH * wanted and len(others):
            progress(f"looking for ways around, {int(self.known[at].sum())} configurations to choose from so far")
            self.look(others[:_AT_ONCE])
            others = others[_AT_ONCE:]
        return at[self.known[at]]

    def refuse_too_few(self, usable: Indices, wanted: int) -> None:
        """Refuse where there are not as many candidates with ways as shall be chosen."""
        reached = int(self.known[usable].sum())
        if reached >= wanted:
            return
        at = usable[~self.known[usable]][:_TOLD]
        looked = self.finder.check.ways(
            self.joints[at], np.broadcast_to(self.finder.home, (len(at), len(self.finder.home)))
        )
        ways = Counter(self.finder.check.words(int(k)) for k in looked.worst[~looked.clear])
        most = "".join(f"; on the straight ones most often {obstacle}" for obstacle, _ in ways.most_common(1))
        raise InputError(
            "too few configurations have a way from the safe one on which the arm keeps clear",
            parameter="home",
            came=f"{reached} of {len(usable)}{most}",
            allowed=f"{wanted} or more",
            cure="Name another safe configuration (`home`), lower `clearance`, see that boxes and floor leave room for "
            "ways, or give more `candidates`.",
        )


def chosen_with_ways(
    choose: Callable[[Indices], Indices],
    usable: Indices,
    reachable: Reachable | None,
    poses: int,
    progress: Callable[[str], None],
) -> tuple[Indices, dict[str, int]]:
    """Choose among candidates until there is a way to each that is chosen.

    Those without a way are left out, and it is chosen again; after some rounds only those count whose ways are known.

    Args:
        choose: Returns which of some candidates are best; it may refuse.
        usable: Which candidates there are.
        reachable: What is known of their ways; None for no need of any.
        poses: How many are chosen at least.
        progress: Called with a few words at each step.

    Returns:
        Which are chosen; and how many were left out, by why.

    Raises:
        InputError: If there are fewer with ways than are chosen, with what is in the way.
    """
    left = usable
    progress(f"choosing among {len(left)} configurations")
    chosen = choose(left)
    if reachable is None:
        return chosen, {}
    straight = 0
    for number in range(1, _ROUNDS + 1):
        progress(f"looking for ways that keep clear, round {number}")
        reachable.look(chosen)
        lost = int(reachable.lost[chosen].sum())
        if not lost:
            break
        left = left[~reachable.lost[left]]
        if number == _ROUNDS or len(left) < poses:
            every = len(left)
            left = reachable.with_straight_ways(left, poses, progress)
            straight = every - int(reachable.lost[usable].sum() - (len(usable) - every)) - len(left)
            reachable.refuse_too_few(usable, poses)
        progress(f"choosing among {len(left)} configurations, as there was no way to {lost}")
        chosen = choose(left)
    without = int(reachable.lost[usable].sum())
    return chosen, {name: cost for name, cost in (("ways", without), ("straight ways", straight)) if cost}


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
        frames = {}
        for target in self.robot.targets:
            frame = np.tile(np.eye(4), (len(joints), 1, 1))
            frame[:, :3, 3], frame[:, :3, :3] = self.robot.world_poses(joints, target.name)
            frames[target.name] = frame
        return frames


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
    place: str = "constraints",
    seen_from_the_origin: bool = True,
    readings: Dataset | None = None,
    finder: WayFinder | None = None,
    drawn: Drawn | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> MeasurementPlan:
    """Choose configurations to measure.

    Args:
        robot: Nominal or calibrated, with targets, see :func:`with_targets`; derivatives are taken at its values.
        candidates: To choose from.
        model: What will be identified.
        poses: How many; None lets O1 decide.
        rng: For the prediction.
        objective: ``O1`` to ``O5``; ``error`` for the mean square error where the robot shall be accurate.
        accurate_at: Where that is; None for everywhere.
        noise: Standard deviation of a coordinate about a well identified model [m].
        labels: Names of the candidates; numbers in the order of measurement if None.
        constraints, place: What a configuration must keep besides the robot's limits, and the file that says so.
        seen_from_the_origin: Whether the instrument stands at the origin of the robot's world, as after a calibration.
        readings: What a device would read at the candidates, see :func:`device_candidates`; None for the positions of
            all targets at each.
        finder: What the arm keeps clear of, at the candidates, on the ways to those that are chosen and where its
            accuracy is predicted; None for nothing.
        drawn: How the candidates were drawn, see :func:`driven_candidates`.
        progress: Called with a few words at each step.

    Raises:
        InputError: If the objective is not known or does not decide on a number, there are fewer rows than parameters,
            too few candidates keep the constraints or have a way, or those that were drawn are all alike.
    """
    _check_objective(objective, poses, accurate_at)
    seen = model.prepared(robot)
    refuse_clearance_of(seen, constraints, place)
    fulfilled = dict(allowed(seen, candidates, constraints, place, seen_from_the_origin=seen_from_the_origin))
    clear = {} if finder is None else finder.check.clear_of(candidates.joints)
    fulfilled |= {name: keeps for name, keeps in clear.items() if not keeps.all()}
    rejected = {name: int(np.sum(~keeps)) for name, keeps in fulfilled.items()}
    usable = np.flatnonzero(np.all(list(fulfilled.values()), axis=0))
    _refuse_too_few(poses, len(usable), len(candidates), rejected, labels is not None, drawn)
    search = _Search(seen, model, candidates, usable, readings, finder, rng, noise, poses, objective, accurate_at)
    stops = before(seen, candidates.joints, None if finder is None else finder.low)
    reachable = None if finder is None else Reachable(finder, candidates.joints, stops)
    chosen, cost = chosen_with_ways(search.choose, usable, reachable, search.count, progress)
    chosen = chosen[short_order(candidates.joints[chosen])]
    _refuse_coinciding(candidates.joints[chosen], drawn)
    progress("predicting the accuracy")
    return MeasurementPlan(
        drawn=drawn,
        reads=() if readings is None else _in_words(readings.of_configurations(chosen)),
        fixtures={} if readings is None else _fixtures_in_base(search.robot),
        among=candidates.joints[usable],
        robot=search.robot,
        model=model,
        objective=objective,
        labels=tuple(str(k + 1) for k in range(len(chosen))) if labels is None else tuple(labels[k] for k in chosen),
        chosen=chosen,
        joints=candidates.joints[chosen],
        before=stops[chosen],
        indices=search.indices(chosen),
        candidates=len(candidates),
        rejected=rejected | cost,
        usable=len(usable) - sum(cost.values()),
        left_out=tuple(name for k, name in enumerate(search.free.names) if k not in search.among),
        seconds=search.seconds,
        prediction=search.prediction(chosen),
    )


class _Search:
    """The search among usable candidates, by what readings there tell of the parameters."""

    def __init__(
        self,
        robot: Robot,
        model: Model,
        candidates: Postures,
        usable: Indices,
        readings: Dataset | None,
        finder: WayFinder | None,
        rng: np.random.Generator,
        noise: float,
        poses: int | None,
        objective: str,
        accurate_at: Postures | None,
    ) -> None:
        gauge: tuple[str, ...] = ()
        if readings is None:
            free = model.free(robot)
            self.derivatives = sensitivity(robot, candidates.at(usable), free, noise)
        else:
            robot = with_fixtures_of(robot, readings)
            free, gauge = unanchored(model.free(robot), readings), gauge_freedoms(readings)
            self.derivatives = sensitivity_of_readings(robot, readings.of_configurations(usable), free, noise)
        self.robot, self.free, self.noise, self.rng = robot, free, noise, rng
        self.poses, self.objective, self.accurate_at = poses, objective, accurate_at
        self.count, self.seconds = FIRST if poses is None else poses, 0.0
        self.among = self.derivatives.identifiable(self.count)
        self.known = self.derivatives.known[np.ix_(self.among, self.among)]
        if not len(self.among):
            raise InputError(
                "with so much noise nothing can be identified",
                parameter="noise",
                came=f"{noise:g} m",
                cure="Lower `noise`.",
            )
        self.elsewhere = _elsewhere(robot, finder, rng)
        self.predicted = sensitivity(robot, self.elsewhere, free, noise, gauge)
        needed, each = len(self.among), self.derivatives.rows.shape[1]
        if readings is None:  # few candidates show less than there is to identify
            needed = max(needed, len(self.predicted.identifiable(self.count)))
        if poses is not None and poses * each < needed:
            raise InputError(
                "there are fewer equations than parameters",
                parameter="poses",
                came=poses,
                allowed=f"{-(-needed // each)} or more for the model {model.name}, or auto",
            )
        self.wanted = None if accurate_at is None else sensitivity(robot, accurate_at, free, noise, gauge)
        goal = INDICES["O1"] if self.wanted is None else OfPredictions.of(self.wanted.rows[..., self.among])
        self.goal = INDICES.get(objective, goal)
        self.place = np.zeros(len(candidates), dtype=np.intp)
        self.place[usable] = np.arange(len(usable))

    def rows(self, these: Indices) -> Array:
        return np.ascontiguousarray(self.derivatives.rows[self.place[these]][..., self.among])

    def choose(self, these: Indices) -> Indices:
        rows, known, started = self.rows(these), self.known, time.process_time()
        if self.poses is None:
            picked = most_informative_number(rows, known)
        else:
            picked = most_informative(rows, self.poses, known, self.goal)
        self.seconds += time.process_time() - started
        return these[np.array(picked, dtype=np.intp)]

    def indices(self, chosen: Indices) -> dict[str, float]:
        rows = self.rows(chosen).reshape(-1, len(self.among))
        return observability(self.known + rows.T @ rows, len(chosen))

    def prediction(self, chosen: Indices) -> Prediction:
        at_wanted, order = None, self.place[chosen]
        if self.wanted is not None and self.accurate_at is not None:
            alike = None
            if self.objective != "O1":
                rows = np.ascontiguousarray(self.derivatives.rows[..., self.among])
                by_o1 = np.array(most_informative(rows, len(order), self.known, INDICES["O1"]), dtype=np.intp)
                alike = model_error(self.derivatives, by_o1, self.wanted, self.noise)
            error = model_error(self.derivatives, order, self.wanted, self.noise)
            at_wanted = There(self.robot.world_poses(self.accurate_at)[0], error, alike)
        elsewhere = self.elsewhere.joints
        predicted = predict(self.robot, self.derivatives, order, self.predicted, elsewhere, self.noise, self.rng)
        return replace(predicted, there=at_wanted)


def _fixtures_in_base(robot: Robot) -> dict[str, Array]:
    places = {fixture.name: robot.fixture_kinematics(fixture.name).position[:, 0] for fixture in robot.fixtures}
    return {name: (place - np.array(robot.base.translation)) @ robot.base.rotation for name, place in places.items()}


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
        reading = readings.targets[t]
        beside = readings.fixtures[f] if f >= 0 else ""
        if readings.distance is not None and np.isfinite(readings.distance[row]):
            reading += f" from {beside} {readings.distance[row] * 1e3:.2f} mm"
        elif readings.height is not None and np.isfinite(readings.height[row]):
            reading += f" over {beside} {readings.height[row] * 1e3:.2f} mm"
        elif beside:
            reading += f" at {beside} ({', '.join(f'{v * 1e3:.2f}' for v in readings.position[row])}) mm"
        words[c].append(reading)
    return tuple("; ".join(word) for word in words)


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
    clear = some[finder.check.smallest_distance(some) >= finder.check.cell.clearance]
    return _forward((clear if len(clear) >= _FEWEST_ELSEWHERE else some)[:_PREDICTED_CONFIGURATIONS])


def _refuse_too_few(
    poses: int | None, usable: int, candidates: int, rejected: Mapping[str, int], named: bool, drawn: Drawn | None
) -> None:
    needed = FIRST if poses is None else poses
    if needed < 1:
        raise InputError("at least one pose is needed", parameter="poses", came=needed, allowed="1 or more, or auto")
    if usable < needed:
        cost = ", ".join(f"{name} {count}" for name, count in rejected.items() if count)
        shortage = f"{usable} of {candidates} usable" + (f"; rejected by {cost}" if cost else "")
        cure = "Widen the constraint that costs most, or give more candidates." if cost else "Give more candidates."
        if drawn is not None and len(drawn.joints) < drawn.wanted:
            shortage += f"; of {drawn.tried} drawn, too near to {drawn.words}"
            cure = "Make room where most was lost: smaller boxes, wider limits, a lower `floor`, less `clearance`."
        raise InputError(
            "too few configurations are left to choose from",
            parameter="candidates_from" if named else "candidates",
            came=shortage,
            allowed=f"{needed} or more",
            cure=cure,
        )


def _refuse_coinciding(joints: Array, drawn: Drawn | None) -> None:
    different = len(np.unique(joints, axis=0))
    if drawn is not None and different < len(joints):
        raise InputError(
            "configurations that were chosen coincide, as the joints have hardly any range",
            parameter="constraints",
            came=f"{different} different ones of {len(joints)}",
            cure="Widen the limits of the joints; check their unit.",
        )


def plan_csv(plan: MeasurementPlan, joints_are: JointsOf = "model") -> str:
    """Return a plan as CSV, one row a configuration in the order of measurement, joints in deg or mm.

    ``joint_i``, or ``axis_i`` as the controller shows it, is where to measure, ``approach_i`` likewise where to stop
    right before, if it stops there, ``reads`` what a device reads there.
    """
    joints, controller = plan.robot.joints, counting(plan.robot, joints_are)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    positions = {None: plan.joints} | ({} if plan.before is None else {"approach": plan.before})
    names = [heading for name in positions for heading in joint_headings(joints, controller, name)]
    writer.writerow(["configuration", *names, *(["reads"] if plan.reads else [])])
    reads = [[words] for words in plan.reads] or [[] for _ in plan.labels]
    cells = zip(*(joint_cells(values, joints, controller) for values in positions.values()), strict=True)
    for label, row, read in zip(plan.labels, cells, reads, strict=True):
        writer.writerow([label, *(cell for part in row for cell in part), *read])
    return stream.getvalue()
