"""Pairs of postures for inclinometers: which to hold under which loads, and what instruments would read there."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, Unpack

import numpy as np

from truearm.engine.base.errors import InputError, Notice, counted, listed, refusals_of
from truearm.engine.base.units import SHOWN_AS, from_si
from truearm.engine.base.writing import output_file, write_files
from truearm.engine.command.arguments import file_for, files_of, joints_argument, robot_argument
from truearm.engine.command.driving import cell_argument, finder_argument, plan_files_for, replaced_notices
from truearm.engine.command.texts import positions_of
from truearm.engine.data.controller_joints import in_controller_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.inclinations import (
    Inclinations,
    InclinometerReadings,
    Instruments,
    Pairs,
    deviation_of_change,
    deviation_of_reading,
)
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.document.document import Block, detail, each, say
from truearm.engine.document.records import Record, joints_lines
from truearm.engine.fit.design import OfInterest, most_informative
from truearm.engine.motion.tour import Tour, tour_csv, tour_summary, tour_words, ways_beside
from truearm.engine.motion.touring import tour_of
from truearm.engine.motion.ways import WayFinder, drawn_clear
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.library.wider_limits import wider_limits_notices
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.urdf_writing import counting, joint_cells, joint_headings
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Conditions, Twin, measure
from truearm.inclinometers.fit import (
    DECIDING_MOMENTS,
    SEAT,
    TILTING,
    change_derivatives,
    decided,
    readable,
    tilting_parameters,
)
from truearm.inclinometers.reading import inclinations_text

if TYPE_CHECKING:
    from truearm.inclinometers.jobs import PlanInclinometers, SimulateInclinometers

# Which postures to hold, under which loads, to tell tilt, backlash and stiffness of the joints apart.
#
# Nothing is said about single joints. Candidates are pairs of postures drawn within the limits, and those are taken
# that together tell most about all constants: where the moment about an axis changes its sign (backlash), where it
# changes much without (stiffness), where the moment across the axis turns round (clearance). What inclinometers cannot
# see, the turn about a vertical axis, is left to poses, which are chosen in the same way knowing what the inclinometers
# will tell; they come out with horizontal loads that turn joint 1 both ways (Patel, section 4.4.1).

#: Pairs of postures that are drawn.
CANDIDATES: Final = 1500


@dataclass(frozen=True, eq=False)
class TiltingPlan:
    """What to measure before geometry is identified."""

    inclined: Pairs  #: Pairs of postures for inclinometers.
    posed: Pairs  #: Pairs of postures for poses.
    #: Standard deviation that each constant of the joints will have [SI]; its prior for one that stays unknown.
    expected: Mapping[str, float]


def plan_tilting(
    robot: Robot,
    rng: np.random.Generator,
    *,
    inclined: int = 24,
    posed: int = 8,
    force: float = 20.0,
    move: float = 0.0,
    axes: Sequence[int] = (0, 1, 2),
    candidates: int = CANDIDATES,
    deviation: float,
    pose_deviation: float = 1e-5,
    finder: WayFinder | None = None,
) -> TiltingPlan:
    """Choose pairs of postures.

    Args:
        robot: Nominal, with masses, limits and payload.
        inclined, posed: Number of pairs for inclinometers and for poses.
        force: Of a string or weight on the flange [N], along or against x, y or z of the base; 0 leaves gravity alone.
        move: How far joints move within a pair at most [rad]; 0 keeps the joint positions and changes the load only.
            Poses are always compared at the same joint positions.
        axes: Which axes of each link its inclinometer has: 0, 1 and 2 for x, y and z.
        candidates: Pairs to draw and to choose from.
        deviation: Standard deviation of a change of inclination [rad].
        pose_deviation: Standard deviation of a coordinate of the flange's position [m].
        finder: What the arm keeps clear of in every posture; None for nothing.

    Raises:
        InputError: If nothing may differ within a pair, or too few postures decide to which side the joints tilt.
    """
    if not (force >= 0.0 and move >= 0.0 and (move > 0.0 or force > 0.0)):
        raise InputError(
            "the two postures of a pair do not differ",
            where="force and move",
            came=f"{force:g} N and {math.degrees(move):g} deg",
            allowed="0 or more, one of them more than 0",
        )
    if posed and not force:
        raise InputError(
            "poses are compared under two loads",
            where="force",
            came="0 N",
            allowed="more than 0",
            cure="Give a force, or choose no pairs of poses; then joints about a vertical axis stay unobservable.",
        )
    model = robot.with_effects(TILTING)
    effects, nuisance = tilting_parameters(model)
    names = [p.name for p in (*effects, *nuisance)]
    prior = np.concatenate([[p.prior for p in (*effects, *nuisance)], np.full(3 * len(robot.joints), SEAT)])
    known = np.eye(len(prior))

    pairs = _candidates(model, rng, candidates, force, move, finder)
    rows = change_derivatives(model, pairs, names) / deviation
    rows = np.where(readable(model, pairs)[..., None], rows, 0.0)[:, :, list(axes)].reshape(len(pairs), -1, len(prior))
    by_inclination, known = _chosen(pairs, rows * prior, inclined, known, len(effects))
    by_pose = pairs.at(np.arange(0))
    if posed:
        pairs = _candidates(model, rng, candidates, force, 0.0, finder)
        rows = _displacement_derivatives(model, pairs, names) / (math.sqrt(2.0) * pose_deviation)
        for posture in (pairs.first, pairs.second):
            rows[~decided(model, posture, upright=False).all(axis=1)] = 0.0
        rows = np.pad(rows, ((0, 0), (0, 0), (0, len(prior) - len(names))))
        by_pose, known = _chosen(pairs, rows * prior, posed, known, len(effects))
    spread = prior * np.sqrt(np.diag(np.linalg.inv(known)))
    return TiltingPlan(by_inclination, by_pose, {p.name: float(s) for p, s in zip(effects, spread, strict=False)})


def _chosen(candidates: Pairs, rows: Array, count: int, known: Array, interest: int) -> tuple[Pairs, Array]:
    """Return the most useful candidates, and what is known once they are measured."""
    useful = np.flatnonzero(rows.any(axis=(1, 2)))
    if len(useful) < count:
        raise InputError(
            "too few postures decide to which side the joints tilt",
            where="postures to compare",
            came=f"{len(useful)} of {len(rows)} pairs that can be used",
            allowed=f"{DECIDING_MOMENTS}, in {count} pairs",
            cure="Give a larger force, or a payload beside the last axis.",
        )
    chosen = useful[most_informative(rows[useful], count, known, OfInterest(interest))]
    measured = rows[chosen].reshape(-1, rows.shape[2])
    return candidates.at(chosen), known + measured.T @ measured


def _candidates(
    robot: Robot, rng: np.random.Generator, count: int, force: float, move: float, finder: WayFinder | None
) -> Pairs:
    """Return pairs of postures under two different pulls."""
    if finder is None:
        low, high = np.array([joint.limits or (-np.inf, np.inf) for joint in robot.joints]).T
        joints = robot.random_configurations(count, rng)
    else:
        low, high = finder.low, finder.high
        joints = drawn_clear(finder, count, np.zeros(len(low)), rng).joints
    moved = np.clip(joints + move * rng.uniform(-1.0, 1.0, joints.shape), low, high)
    if finder is not None and move:
        clear = finder.check.ways(joints, moved).clear
        joints, moved = joints[clear], moved[clear]
    count = len(joints)
    ways = rng.permuted(np.tile(np.arange(6), (count, 1)), axis=1)  # the first two differ
    pulls = np.zeros((2, count, 6))
    pulls[..., :3] = force * np.concatenate([np.eye(3), -np.eye(3)])[ways[:, :2].T]
    return Pairs(*(robot.loaded(Postures(q, wrench=p)) for q, p in zip((joints, moved), pulls, strict=True)))


def _displacement_derivatives(robot: Robot, pairs: Pairs, names: Sequence[str]) -> Array:
    """Return the derivative of the flange's displacement within pairs ``(n, 3, parameters)`` [m per unit]."""
    first, second = (
        robot.position_jacobian(robot.forward_kinematics(q), q, names) for q in (pairs.first, pairs.second)
    )
    return np.moveaxis(second - first, (0, 2), (2, 0))


#: What the poses under a load are called, beside what inclinometers read.
PUSHED: Final = "-pushed"


def pushed_file(file: Path) -> Path:
    """Return where the poses under a load are written, beside a file of inclinations."""
    return file.with_name(f"{file.stem}{PUSHED}{file.suffix}")


@dataclass(frozen=True, eq=False, repr=False)
class InclinometerPlan(Record):
    """Configurations in which inclinometers are read, in pairs, and poses under a load for what they do not see."""

    robot: Robot  #: With its payload.
    made: TiltingPlan  #: The pairs, and how accurate every constant of the joints will be.
    pull: float  #: Force on the flange [N], 0 for gravity alone.
    command: str  #: How to run it again.
    tour: Tour  #: How the configurations are driven, each way checked.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    #: Whose joint positions the file holds: the ``model``'s, or those that the ``controller`` shows.
    joints_are: JointsOf = "model"
    replaced: tuple[Notice, ...] = ()  #: What to know of another plan that it was written over.

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know of its ways, and of the files."""
        return (*self.tour.notices, *wider_limits_notices(self.robot), *self.replaced)

    def _expected(self) -> list[tuple[str, str, float, float]]:
        """Return name, unit, deviation to expect and prior of each constant, as they are shown."""
        known = self.robot.with_effects(sorted({name.rpartition("_")[0] for name in self.made.expected})).parameters
        rows = []
        for name, deviation in self.made.expected.items():
            unit = SHOWN_AS[known[name].unit]
            rows.append((name, unit, from_si(deviation, unit), from_si(known[name].prior, unit)))
        return rows

    @property
    def unseen(self) -> tuple[str, ...]:
        """Constants that stay about as unknown as they were."""
        return tuple(name for name, _, deviation, prior in self._expected() if deviation > 0.7 * prior)

    def blocks(self) -> Iterator[Block]:
        """Give what was chosen, and how accurate every constant will be."""
        load = f"under pulls of {self.pull:g} N at the flange" if self.pull else "by gravity alone"
        inclined, posed = 2 * len(self.made.inclined), 2 * len(self.made.posed)
        yield say(
            f"{counted(inclined, 'configuration')} for inclinometers, in pairs, {load}.",
            inclined=inclined,
            posed=posed,
            pull_n=self.pull,
        )
        if posed:
            yield say(
                f"{counted(posed, 'configuration')} for poses, in pairs under pulls: they tell what "
                "inclinometers cannot see, the turn of a joint about a vertical axis."
            )
        ways = tour_summary(self.tour, self.robot, self.joints_are)
        yield say(*tour_words(self.tour, self.robot, self.joints_are), ways=ways)
        unseen = self.unseen
        yield each(
            "expected",
            (
                detail(
                    f"  {name:<14} {'stays unknown' if name in unseen else f'known to {deviation:.2g} {unit}'} "
                    f"(before: {prior:.2g} {unit})",
                    name=name,
                    unit=unit,
                    deviation=deviation,
                    prior=prior,
                )
                for name, unit, deviation, prior in self._expected()
            ),
        )
        yield say(*joints_lines(self.joints_are), unseen=list(unseen), joints_are=self.joints_are)

    def csv_text(self) -> str:
        """Return the plan as CSV: one row a configuration, in the order of measurement, and what is read there."""
        joints, controller = self.robot.joints, counting(self.robot, self.joints_are)
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        forces = [f"force_{axis} [N]" for axis in "xyz"]
        writer.writerow(["configuration", "order", *joint_headings(joints, controller), *forces, "reads"])
        number = 0
        for pairs, reads in ((self.made.inclined, "inclinations"), (self.made.posed, "positions")):
            if not len(pairs):
                continue
            at, wrench = pairs.joints_in_turn()
            for cells, force in zip(joint_cells(at, joints, controller), (wrench[:, :3] + 0.0).tolist(), strict=True):
                number += 1
                writer.writerow([number, number, *cells, *(f"{part:g}" for part in force), reads])
        return stream.getvalue()

    def written_at(self, out: str) -> str:
        """Return the line that says which files hold it."""
        file = Path(out)
        return f"Written: {file}, {file.with_name(f'{file.stem}-ways.csv')}"

    def save(self, file: str | Path) -> tuple[Path, ...]:
        """Write the plan as CSV, and every stop on the ways in a second one.

        Returns:
            The files written; the second ends in ``-ways.csv``.
        """
        table = output_file(file, self.inputs, ours=True)
        ways = output_file(ways_beside(table), self.inputs, ours=True)
        stops = tour_csv(self.tour, self.robot, self.joints_are)
        write_files(table.parent, {table.name: self.csv_text(), ways.name: stops}, self.command)
        return table, ways


@dataclass(frozen=True, eq=False, repr=False)
class InclinometerSimulation(Record):
    """What inclinometers read of a simulated robot, and its poses under loads that push the joints both ways."""

    robot: str  #: Name of the nominal robot.
    truth: str  #: What the simulated robot truly is: the name of a truth, or the robot file.
    inclinations: Inclinations  #: The readings.
    #: Positions of the targets in pairs of configurations under two loads; None where nothing pulls.
    pushed: Dataset | None = None
    #: The file that holds the readings, see :func:`pushed_file` for the poses; None if none was written.
    out: Path | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """The files written."""
        if self.out is None:
            return ()
        return (self.out,) if self.pushed is None else (self.out, pushed_file(self.out))

    def blocks(self) -> Iterator[Block]:
        """Give what was read."""
        read = self.inclinations
        angles, pushed = int(np.isfinite(read.angle).sum()), 0 if self.pushed is None else self.pushed.configurations
        beside = "" if self.pushed is None else f"; {counted(pushed, 'configuration')} for poses under loads"
        destination = f": {listed([str(file) for file in self.files])}" if self.files else ""
        yield say(
            f"{counted(len(read.labels), 'configuration')} of {self.robot} ({self.truth}), {angles} angles of "
            f"{len(read.instruments)} inclinometers{beside}{destination}",
            robot=self.robot,
            truth=self.truth,
            configurations=len(read.labels),
            instruments=list(read.instruments.names),
            joints_are=read.joints_are,
            angles=angles,
            pushed=pushed,
        )

    def texts(self) -> dict[str, str]:
        """Return what its files hold, by name."""
        if self.out is None:
            return {}
        contents = {self.out.name: inclinations_text(self.inclinations)}
        return contents if self.pushed is None else contents | {pushed_file(self.out).name: csv_text(self.pushed)}


#: Of a two-axis inclinometer (Patel, section 4.4.1) [rad]. It has the axes x and y of its link.
RESOLUTION: Final = math.radians(0.001)
AXES: Final = (0, 1)
#: Standard deviation of a coordinate of the poses under loads [m]: the document's cameras (Patel, section 4.4.2).
POSE_DEVIATION: Final = 1e-5
#: How far joints move within a pair without a pull [rad], and pairs of poses under pulls.
_MOVE: Final = math.radians(20.0)
_POSED: Final = 8


def planned(asked: PlanInclinometers) -> InclinometerPlan:
    """Choose pairs of configurations, look for ways between them, and write the plan."""
    table = None if asked.out is None else file_for(asked.out, asked.robot)
    if table is not None:
        plan_files_for((table.name, ways_beside(table).name), table, asked.robot)
    asked.progress("reading the robot")
    carrying = asked.loads.on(robot_argument(asked.robot))
    joints_are = joints_argument(asked.joints, carrying)
    asked.progress("looking where the arm keeps clear")
    cell = cell_argument(carrying, None, "", asked.floor, asked.no_floor, asked.clearance)
    home = None if asked.home is None else positions_of(asked.home, carrying, joints_are, "home")
    finder = finder_argument(carrying, None, "", cell, home)
    asked.progress("choosing pairs of configurations")
    rng = np.random.default_rng(asked.seed)
    plan = planned_pairs(carrying, asked.poses, rng, asked.pull, asked.candidates, asked.noise, finder)
    asked.progress("looking for ways that keep clear")
    at = np.concatenate([pairs.joints_in_turn()[0] for pairs in (plan.inclined, plan.posed) if len(pairs)])
    tour = tour_of(finder, at, [str(k + 1) for k in range(len(at))])
    inclinometer_plan = InclinometerPlan(
        carrying, plan, asked.pull, asked.again, tour, files_of(asked.robot), joints_are
    )
    if table is None:
        return inclinometer_plan
    replaced = replaced_notices(table.parent, table.name, inclinometer_plan.csv_text())
    inclinometer_plan.save(table)
    return replace(inclinometer_plan, replaced=replaced)


def planned_pairs(
    robot: Robot,
    count: int,
    rng: np.random.Generator,
    pull: float,
    candidates: int,
    pose_deviation: float,
    finder: WayFinder | None = None,
) -> TiltingPlan:
    """Choose the postures that inclinometers are read in, `count` of them, and poses under pulls if there is one."""
    if not robot.layout.turning:
        raise InputError("no joint of this robot turns, so no link leans", parameter="robot", where=robot.name)
    with refusals_of("poses"):
        return plan_tilting(
            robot,
            rng,
            inclined=count // 2,
            posed=_POSED if pull else 0,
            force=pull,
            move=0.0 if pull else _MOVE,
            axes=AXES,
            candidates=candidates,
            deviation=deviation_of_change(RESOLUTION),
            pose_deviation=pose_deviation,
            finder=finder,
        )


def inclinations(
    twin: Twin,
    joints: Array,
    noise: float,
    rng: np.random.Generator,
    resolution: float = 0.0,
    **conditions: Unpack[Conditions],
) -> Array:
    """Return what inclinometers on all links read at joint positions ``(n, joints)``.

    Each link carries one with three sensitive axes along x, y and z of the link's frame (the frame behind the tilt of
    its joint, :attr:`Posture.links`). A reading is the angle of such an axis above the horizontal plane, -pi/2 to
    pi/2: ``asin(-g . axis)`` with the unit vector g along gravity. The direction of gravity in the link's frame is
    therefore ``-sin`` of the three readings. An axis that is horizontal sees a small turn about a horizontal axis
    across it in full; one near the vertical hardly sees it. Differences between configurations are free of how the
    instrument sits on its link as long as the link turns little between them.

    Args:
        noise: Standard deviation of each reading [rad].
        resolution: Readings are whole multiples of it [rad], unless it is zero.
        conditions: See :class:`Conditions`.

    Returns:
        inclinations: ``(n, links, 3)`` [rad].
    """
    down = np.array(twin.robot.gravity) / np.linalg.norm(twin.robot.gravity)
    links = np.array([posture.links for posture in twin.postures(joints, **conditions)])
    pulled = np.einsum("nlij,i->nlj", links[:, :, :3, :3], down)
    read = np.arcsin(np.clip(-pulled, -1.0, 1.0))
    read = read + rng.normal(0.0, 1.0, read.shape) * noise
    return np.asarray(np.round(read / resolution) * resolution if resolution else read)


def read_pairs(
    twin: Twin, pairs: Pairs, resolution: float, rng: np.random.Generator, axes: Sequence[int] = (0, 1)
) -> Inclinations:
    """Return what inclinometers on all links of a twin read at the postures of pairs, in turn.

    Args:
        resolution: Of each reading [rad].
        axes: Which axes of the link each of them has: 0, 1 and 2 for x, y and z.
    """
    joints, wrench = pairs.joints_in_turn()
    count, links = len(joints), len(twin.robot.joints)
    angle = np.full((count, links, 3), np.nan)
    angle[..., list(axes)] = inclinations(twin, joints, 0.0, rng, resolution, wrench=wrench)[..., list(axes)]
    return Inclinations(
        source="twin",
        labels=tuple(str(number) for number in range(1, count + 1)),
        joints=joints,
        joint_kinds=tuple(joint.kind for joint in twin.robot.joints),
        instruments=Instruments.on_every_link(links),
        angle=angle,
        sigma=np.full((count, links), deviation_of_reading(resolution)),
        order=np.arange(1, count + 1),
        wrench=wrench + 0.0,  # no negative zeros
        payload=np.zeros((count, 4)),
        simulated=True,
    )


def compare(
    twin: Twin, pairs: Pairs, resolution: float, rng: np.random.Generator, noise: float = 0.0
) -> InclinometerReadings:
    """Return by how much inclinometers on the links of a twin change their readings between postures.

    Args:
        resolution, noise: Of each reading [rad]; see :func:`inclinations`.
    """
    joints, wrench = pairs.joints_in_turn()
    read = inclinations(twin, joints, noise, rng, resolution, wrench=wrench)
    return InclinometerReadings(pairs, read[1::2] - read[::2], deviation_of_change(resolution, noise))


def measure_pairs(twin: Twin, pairs: Pairs, noise: float, rng: np.random.Generator) -> Dataset:
    """Return what an instrument reads of a twin's targets at the postures of pairs, in turn; noise in metres."""
    joints, wrench = pairs.joints_in_turn()
    return measure(twin, joints, noise, rng, wrench=wrench)


def simulated(asked: SimulateInclinometers) -> InclinometerSimulation:
    """Read inclinometers of a twin, and its poses under pulls, and write them."""
    file, truth = None, asked.truth
    if asked.out is not None:
        file = file_for(asked.out, asked.robot, truth)
        file_for(pushed_file(file), asked.robot, truth)
    rng = np.random.default_rng(asked.seed)
    nominal = robot_argument(asked.robot)
    joints_are = joints_argument(asked.joints, nominal)
    with refusals_of("truth"):
        twin = truth_twin(nominal, truth, rng)
    twin = replace(twin, robot=asked.loads.on(twin.robot))
    asked.progress("choosing pairs of configurations")
    pairs = planned_pairs(asked.loads.on(nominal), asked.poses, rng, asked.pull, CANDIDATES, POSE_DEVIATION)
    asked.progress(f"reading {asked.poses} configurations")
    read = read_pairs(twin, pairs.inclined, RESOLUTION, rng, AXES)
    pushed = measure_pairs(twin, pairs.posed, POSE_DEVIATION, rng) if len(pairs.posed) else None
    if joints_are == "controller":
        read = replace(read, joints=nominal.controller.from_model(read.joints), joints_are="controller")
        pushed = None if pushed is None else in_controller_joints(nominal, pushed)
    named = truth.name if isinstance(truth, Robot) else str(truth)
    simulation = InclinometerSimulation(nominal.name, named, read, pushed, file)
    if file is not None:
        write_files(file.parent, simulation.texts())
    return simulation
