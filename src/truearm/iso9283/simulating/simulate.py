"""The tests of a plan by ISO 9283 on a twin that moves: what an instrument would read."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, counted, refusals_of, wrong_kind
from truearm.engine.base.files import path_argument
from truearm.engine.base.units import Marked, from_si
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.command.arguments import (
    files_of,
    folder_for,
    robot_argument,
)
from truearm.engine.document.document import Block, say
from truearm.engine.document.records import Record
from truearm.engine.programs.fake_targets import fake_targets, nominal_robot
from truearm.engine.programs.gauge import best_agreement
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rotation_from_vector, rotation_vector
from truearm.engine.robot.wrench import STANDARD_GRAVITY
from truearm.engine.twin.gear_errors import DRAWN
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin
from truearm.iso9283.planning.criteria import PerformancePlan
from truearm.iso9283.planning.records import forces_text, poses_text, samples_text
from truearm.iso9283.simulating.cell import ROBOTS, Corrected, SimulatedCampaign, Tracker, TrueRobot, simulated_campaign
from truearm.iso9283.simulating.moving_arm import drawn_compliance

if TYPE_CHECKING:
    from truearm.iso9283.jobs import SimulateTests

#: What a campaign may write.
FILES: Final = ("poses.csv", "paths.csv", "settling.csv", "forces.csv", "alignment.yaml")


@dataclass(frozen=True)
class StatedTie:
    """How the instrument is said to be tied to the robot's base: what was drawn about the true tie."""

    T_base_instrument: Transform  #: The instrument's frame in the robot's base frame.
    #: sigma, sigma_rot: standard deviations of each coordinate [m] and angle [rad] at the origin of the base.
    sigma: float
    sigma_rot: float

    def text(self) -> str:
        """Return it as ``alignment.yaml``."""
        place = self.T_base_instrument
        position = ", ".join(f"{1e3 * v:.6f}" for v in place.translation)
        quaternion = ", ".join(f"{v:.12f}" for v in place.quaternion)
        return (
            "# How the simulated instrument is tied to features of the robot's base: its frame in the base frame.\n"
            "truearm: truearm-alignment/1\n"
            "units: {length: mm, angle: deg}\n"
            "kind: base-features\n"
            f"position: [{position}]\n"
            f"quaternion: [{quaternion}]\n"
            f"sigma: {from_si(self.sigma, 'mm'):.6g}\n"
            f"sigma_rot: {from_si(self.sigma_rot, 'deg'):.6g}\n"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Iso9283Simulation(Record):
    """What an instrument reads in the tests of a plan, of a robot whose truth is known."""

    robot: str  #: Name of the nominal robot.
    truth: str  #: What the robot truly is: the name of a truth, or the robot file.
    corrected: str | None  #: The calibrated robot by which the commands were corrected; None where they were nominal.
    campaign: SimulatedCampaign  #: The readings.
    tie: StatedTie  #: How the instrument is tied to the base.
    tracker: Tracker  #: The instrument.
    tests: tuple[str, ...]  #: Those that were run.
    out: Path | None  #: The folder of the files; None if none were written.
    command: str  #: How to simulate it again.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    warnings: tuple[Notice, ...] = ()  #: What speaks against it.

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``data``: an instrument that is simulated reads."""
        return ("data",)

    def _counts(self) -> dict[str, int]:
        campaign = self.campaign
        return {
            "poses": 0 if campaign.poses is None else len(campaign.poses.cycle),
            "paths": 0 if campaign.paths is None else len(campaign.paths.time),
            "settling": 0 if campaign.settling is None else len(campaign.settling.time),
            "forces": 0 if campaign.forces is None else len(campaign.forces.force),
        }

    def blocks(self) -> Iterator[Block]:
        """Give what was run and read, in mm and deg."""
        commands = "nominal commands" if self.corrected is None else f"commands corrected by {self.corrected}"
        yield say(
            f"{counted(len(self.tests), 'test')} of {self.robot} ({self.truth}), {commands}",
            robot=self.robot,
            truth=self.truth,
            corrected=self.corrected,
            tests=list(self.tests),
        )
        nouns = {
            "poses": ("attained pose", ""),
            "paths": ("sample", " along paths"),
            "settling": ("sample", " of the way to a pose"),
            "forces": ("reading", " under a push"),
        }
        rows = self._counts()
        read = [
            f"  {counted(rows[name], noun)}{destination}" for name, (noun, destination) in nouns.items() if rows[name]
        ]
        yield say(
            *read,
            rows=rows,
            rate_hz=self.tracker.rate,
            noise_mm=from_si(self.tracker.sigma, "mm"),
            noise_rot_deg=from_si(self.tracker.sigma_rot, "deg"),
        )
        hours = self.campaign.duration / 3600.0
        files = [] if self.out is None else [str(self.out / name) for name in self.written]
        yield say(f"  {hours:.1f} hours in the cell", hours=hours, files=files)

    @property
    def written(self) -> tuple[str, ...]:
        """Names of the files that hold it."""
        counts = self._counts()
        return tuple(name for name in FILES if counts.get(name.partition(".")[0], 1))

    def save(self, folder: str | Path) -> None:
        """Write the files into a folder."""
        place = output_folder(folder, self.written, self.inputs, "folder", ours=True)
        campaign, texts = self.campaign, {}
        if campaign.poses is not None:
            texts["poses.csv"] = poses_text(campaign.poses)
        if campaign.paths is not None:
            texts["paths.csv"] = samples_text(campaign.paths, "path")
        if campaign.settling is not None:
            texts["settling.csv"] = samples_text(campaign.settling, "pose", conditions=False)
        if campaign.forces is not None:
            texts["forces.csv"] = forces_text(campaign.forces)
        write_files(place, {**texts, "alignment.yaml": self.tie.text()}, self.command)


#: How well features of a base are found by a tracker [m], [rad].
_TIE: Final = (0.02e-3, math.radians(0.002))
#: Configurations at which a tool is located on a calibrated robot.
_LOCATED: Final = 30
#: A calibrated robot and the truth stand at one place within this [m], [rad]; else they are in frames of two
#: instruments.
_SAME_PLACE: Final = (20e-3, math.radians(1.0))
#: Which numbers of a seed say how far joints give way.
_PUSHED: Final = 1
#: Share of the error of the nominal robot that a calibration of the truth leaves, at most.
_NO_BETTER: Final = 0.5
#: Arms are the same whose flanges are nearer than this [m].
_SAME_ARM: Final = 1e-6


def simulated(asked: SimulateTests) -> Iso9283Simulation:
    """Run the tests of a plan on a twin, and write what is read."""
    plan, truth, corrected = asked.plan, asked.truth, asked.corrected
    rng = np.random.default_rng(asked.seed)
    for name, value in (("plan", plan), ("corrected", corrected)):
        if isinstance(value, str | Path):
            path_argument(value, name)
    inputs = (asked.robot, plan, truth, corrected)
    folder = None if asked.out is None else folder_for(FILES, asked.out, *inputs, ours=True)
    asked.progress("reading the plan")
    planned = _plan(plan)
    nominal = robot_argument(asked.robot)
    _check_same_arm(nominal, planned.robot)
    with refusals_of("truth"):
        twin = truth_twin(nominal, truth if isinstance(truth, Robot | str) else path_argument(truth, "truth"), rng)
        _check_kinds(planned.robot, twin.robot)
    drawn = truth == "nominal" or _is_drawn(truth)
    base, tip = _frames_of(planned, twin, drawn=drawn)
    tie, tracker = _stated(base, rng), Tracker(asked.noise, asked.noise_rot, asked.rate)
    correct, warnings = None, list[Notice]()
    if corrected is not None:
        with refusals_of("corrected"):
            calibrated = robot_argument(corrected, "corrected")
            _check_kinds(planned.robot, calibrated)
            correct, warnings = _correction(planned, calibrated, TrueRobot(twin, tip), base, tie, tracker, rng)
    lever = float(np.linalg.norm(planned.cube.centre))
    weight = STANDARD_GRAVITY * (planned.rated_load or 1.0)
    # Drawn by itself, so that the seed draws the rest as it does without it.
    compliance = drawn_compliance(planned.robot, weight, lever, np.random.default_rng([asked.seed, _PUSHED]))
    robots = [TrueRobot(twin, tip, compliance)]
    if planned.test("E") is not None:
        robots += [TrueRobot(_another(nominal, twin, truth, rng), tip) for _ in range(ROBOTS - 1)]
    campaign = simulated_campaign(planned, robots, base, tracker, rng, corrected=correct, progress=asked.progress)
    iso9283_simulation = Iso9283Simulation(
        nominal.name,
        truth.name if isinstance(truth, Robot) else str(truth),
        None if corrected is None else corrected.name if isinstance(corrected, Robot) else str(corrected),
        campaign,
        tie,
        tracker,
        tuple(test.id for test in planned.tests),
        folder,
        asked.again,
        files_of(*inputs),
        tuple(warnings),
    )
    if folder is not None:
        asked.progress("writing")
        iso9283_simulation.save(folder)
    return iso9283_simulation


def _plan(plan: object) -> PerformancePlan:
    if isinstance(plan, PerformancePlan):
        return plan
    if isinstance(plan, str | Path):
        from truearm.iso9283.planning.plan_file import read_plan

        path = path_argument(plan, "plan")
        with refusals_of("plan"):
            return read_plan(path)
    raise wrong_kind("a plan belongs here", plan, "plan", "a plan.yaml, or a PerformancePlan")


def _check_kinds(robot: Robot, other: Robot) -> None:
    if [joint.kind for joint in other.joints] != [joint.kind for joint in robot.joints]:
        raise InputError(
            f"this is another robot than {robot.name}",
            where=other.name,
            came=f"{len(other.joints)} joints",
            allowed=f"{len(robot.joints)}, of the same kinds",
        )


def _check_same_arm(robot: Robot, planned: Robot) -> None:
    with refusals_of("plan"):
        _check_kinds(robot, planned)
    q = planned.random_configurations(5, np.random.default_rng(0))
    apart = np.abs(robot.forward(q)[0] - planned.forward(q)[0]).max()
    if apart > _SAME_ARM:
        raise InputError(
            "this plan is of another robot",
            parameter="plan",
            came=planned.name,
            allowed=f"a plan of {robot.name}",
            cure="Give the robot that the plan was made for.",
        )


def _is_drawn(truth: object) -> bool:
    return isinstance(truth, str) and (truth == "random" or truth in DRAWN)


def _frames_of(plan: PerformancePlan, twin: Twin, *, drawn: bool) -> tuple[Array, Transform]:
    """Return the base frame in the instrument's, as features of the foot show it, and where the tip is on the flange.

    Of a robot that was identified, base and flange are in a gauge of their own: they are taken where the nominal robot
    agrees best with it.
    """
    robot, place = twin.robot, plan.robot.tool_place(plan.target)
    inside = [p for p in robot.parameters.values() if p.group in ("geometry", "joint zero")]
    if drawn or all(p.value == p.nominal for p in inside):
        return robot.base.matrix, place
    base, flange = best_agreement(robot)
    at = flange @ place.matrix
    return robot.base.matrix @ base, Transform.from_matrix(at[:3, :3], at[:3, 3])


def _stated(base: Array, rng: np.random.Generator) -> StatedTie:
    """Return the tie of the instrument with an error of the stated uncertainty."""
    sigma, sigma_rot = _TIE
    off = np.eye(4)
    off[:3, :3] = rotation_from_vector(rng.normal(0.0, sigma_rot, 3))
    off[:3, 3] = rng.normal(0.0, sigma, 3)
    stated = off @ np.linalg.inv(base)
    return StatedTie(Transform.from_matrix(stated[:3, :3], stated[:3, 3]), sigma, sigma_rot)


def _another(nominal: Robot, twin: Twin, truth: Robot | str | Path, rng: np.random.Generator) -> Twin:
    """Return another robot of the same kind at the same place."""
    if _is_drawn(truth):
        return truth_twin(nominal, str(truth), rng)
    values = {
        p.name: p.value + p.prior * float(rng.standard_normal())
        for p in twin.robot.parameters.values()
        if p.group in ("geometry", "joint zero")
    }
    return replace(twin, robot=twin.robot.with_values(values))


def _correction(
    plan: PerformancePlan,
    calibrated: Robot,
    true: TrueRobot,
    base: Array,
    tie: StatedTie,
    tracker: Tracker,
    rng: np.random.Generator,
) -> tuple[Corrected, list[Notice]]:
    """Return how commands are corrected: with the tie as it is stated, and a tool that was located by readings.

    The notice says if the calibrated robot meets these no better than the nominal one: it is that of another truth.
    """
    q = plan.robot.random_configurations(5, np.random.default_rng(0))
    other = nominal_robot(calibrated).forward(q)[0] - plan.robot.forward(q)[0]
    if np.abs(other).max() > _SAME_PLACE[0]:
        raise InputError(
            f"this is another robot than {plan.robot.name}",
            where=calibrated.name,
            cure="Give the calibrated.yaml of the robot that the plan was made for.",
        )
    stands, stood = calibrated.base.matrix @ best_agreement(calibrated)[0], base
    apart = np.linalg.inv(stood) @ stands
    far, turned = np.linalg.norm(apart[:3, 3]), np.linalg.norm(rotation_vector(apart[:3, :3]))
    if far > _SAME_PLACE[0] or turned > _SAME_PLACE[1]:
        raise InputError(
            "this robot was calibrated in the frame of another instrument",
            where=calibrated.name,
            came=f"its base {1e3 * far:.4g} mm and {math.degrees(turned):.3g} deg from that of the truth",
            allowed=f"up to {1e3 * _SAME_PLACE[0]:g} mm and {math.degrees(_SAME_PLACE[1]):g} deg",
            cure="Calibrate it from readings of the same truth ('truearm simulate').",
        )
    q = calibrated.random_configurations(_LOCATED, rng)
    position, rotation = _read(q, true, tracker, rng)
    tip, off = _located(*calibrated.with_payload(Payload()).world_poses(q), position, rotation)
    flange, faces = plan.robot.forward(q)
    nominal = _located(flange @ base[:3, :3].T + base[:3, 3], base[:3, :3] @ faces, position, rotation)[1]
    to_flange = np.linalg.inv(tip.matrix)
    in_identified = np.linalg.inv(tie.T_base_instrument.matrix @ calibrated.base.matrix)

    def corrected(mass: float, frames: Array, near: Array) -> Array:
        carrying = calibrated.with_payload(Payload(mass, tip.translation))
        joint_solutions = fake_targets(carrying, in_identified @ frames @ to_flange, near).solutions
        lost = [row for row, status in enumerate(joint_solutions.status) if not status.usable]
        if lost:
            raise InputError(
                "the calibrated robot cannot come to a pose of the plan",
                parameter="corrected",
                where=calibrated.name,
                came=joint_solutions.status[lost[0]].value,
                cure="Plan in a smaller cube.",
            )
        return joint_solutions.joints

    return corrected, [] if off <= max(_NO_BETTER * nominal, 3.0 * tracker.sigma) else [_of_another(off, nominal)]


ANOTHER_TRUTH: Final = Rule(
    "another-truth",
    "warning",
    "`simulate corrected`: the calibrated robot misses the twin by more than half of what the nominal one does",
    cure="Correcting with it tells nothing of the robot that was measured. Give the truth, and its seed, that the "
    "measurements are of.",
)


def _of_another(off: float, nominal: float) -> Notice:
    return ANOTHER_TRUTH(
        f"The calibrated robot misses this twin by {1e3 * off:.2g} mm, the nominal one by {1e3 * nominal:.2g} mm (root "
        f"mean square at {_LOCATED} configurations): it was calibrated on another truth, or badly."
    )


def _read(joints: Array, true: TrueRobot, tracker: Tracker, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return what the instrument reads of the tip without a load: ``(n, 3)`` [m] and ``(n, 3, 3)``."""
    robot = true.twin.robot
    placed = robot.with_frames(robot.base, {"tip": true.tip})
    twin = replace(true.twin, robot=replace(placed, payload=Payload(), wrench=None))
    frames = twin.frames(joints, approach=np.zeros_like(joints))["tip"]
    position = frames[:, :3, 3] + rng.normal(0.0, tracker.sigma, (len(joints), 3))
    return position, rotation_from_vector(rng.normal(0.0, tracker.sigma_rot, (len(joints), 3))) @ frames[:, :3, :3]


def _located(at: Array, turned: Array, position: Array, rotation: Array) -> tuple[Transform, float]:
    """Return where the tip is on a flange, and by how much readings of it are off, as a root mean square [m].

    Args:
        at, turned: The flange in the instrument's frame: ``(n, 3)`` [m] and ``(n, 3, 3)``.
        position, rotation: Readings of the tip.
    """
    across = turned.transpose(0, 2, 1)
    offset = np.einsum("nij,nj->i", across, position - at) / len(at)
    U, _, Vt = np.linalg.svd((across @ rotation).sum(axis=0))
    off = float(np.sqrt(np.mean(np.sum((position - at - turned @ offset) ** 2, axis=1))))
    return Transform.from_matrix(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt, offset), off
