"""The study lrmate-hexapod: campaigns with the hexapod device on twins of the LR Mate, and what models are worth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from papers import Progress
from papers.campaign import Campaign, two_steps
from papers.lrmate_hexapod.identification import Cups, identified_following, identified_holding, rebased
from papers.lrmate_hexapod.judgement import (
    HeldOut,
    Judgement,
    allowed_configurations,
    held_out,
    judged,
    mean_position_error,
)
from papers.lrmate_hexapod.robot import BACK_DOWN, FIXTURE, FRONT_UP, drawn_twin, invented_twin, nominal_robot, touches
from papers.seeds import Seed, over_seeds
from truearm.engine.data.hexapod import HexapodPose, poses
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import MODELS
from truearm.engine.robot.chain import Array
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rotation_vector
from truearm.engine.twin.twin import Twin, measure
from truearm.hexapod.places import world_frame
from truearm.hexapod.reachable import Reachable, reachable
from truearm.hexapod.rehearsal import ballbar
from truearm.hexapod.sheet import PlannedRow
from truearm.planning.choosing import plan_measurements

_ELASTIC: Final = next(model for model in MODELS if model.name == "elastic")
_TRACKER: Final = 50
_CANDIDATES: Final = 1000
#: Of a coordinate that the tracker reads, invented [m].
_NOISE: Final = 0.02e-3
#: Beyond this the cup is away from the reference point [m].
_AWAY: Final = 0.4

#: The document's words in two readings, base by three cups: held by the model before, or following the model that is
#: identified; with base and cups found together with the robot; and by a tracker.
Model = Literal[
    "nominal",
    "preliminary held",
    "final held",
    "preliminary following",
    "final following",
    "preliminary found",
    "final found",
    "tracker",
]
#: The final models whose base three cups give.
FinalByCups = Literal["final held", "final following"]
#: The models that look for the fixture's frame by its cups.
FrameModel = Literal["nominal", "final found"]


@dataclass(frozen=True, eq=False)
class Station:
    """What is the same for every robot: the nominal one, the plan, where it touches, what the tracker looks at."""

    robot: Robot
    wanted: tuple[HexapodPose, ...]
    plan: Reachable
    touches: Array
    tracked: Array


@dataclass(frozen=True)
class FrameError:
    """How far the fixture's frame by a model is from the true one [m], and by how much it is turned [rad]."""

    shift: float
    turn: float


@dataclass(frozen=True, eq=False)
class Outcome:
    """One campaign: its steps, every model judged, and how the world frame came out."""

    campaign: Campaign  #: With the device.
    front: tuple[bool, ...]  #: Which of the measured rows are front/up.
    judgements: Mapping[Model, Judgement]  #: Of every model.
    away: Array  #: Distance of each held-out configuration from the reference point [m], ``(n,)``.
    front_up: NDArray[np.bool_]  #: Which of them are front/up, ``(n,)``.
    #: Mean error of the final models, held and following, without the correction of the frame by distances [m].
    uncorrected: Mapping[FinalByCups, float]
    repeated: float  #: Mean error of the final model, held, after ten more rounds of touching and identifying [m].
    frames: Mapping[FrameModel, FrameError]  #: Error of the fixture's frame by models.

    def mean_away(self, model: Model) -> float:
        """Return the mean position error beyond 400 mm from the reference point [m]."""
        return float(self.judgements[model].position[self.away > _AWAY].mean())

    def gain(self, model: FinalByCups) -> float:
        """Return by how much the correction of the frame reduces the mean error of a final model [%]."""
        return 100.0 * (1.0 - self.judgements[model].mean / self.uncorrected[model])


@dataclass(frozen=True, eq=False)
class Run:
    """The whole study."""

    station: Station  #: What is the same for every robot.
    outcomes: tuple[Outcome, ...]  #: Of the robot file's truth, one a seed.
    others: tuple[Outcome, ...]  #: Of other robots, one a seed.


def run(seeds: int, progress: Progress, configurations: int, others: int) -> Run:
    """Plan, measure and calibrate the robot file's truth and other robots, once a seed.

    Args:
        seeds: How many: of the ballbar's and the tracker's noise and of the choice between flip and noflip; and as many
            other robots.
        progress: Called with a few words at each step.
        configurations: To judge the robot of the robot file by.
        others: To judge each of the other robots by.
    """
    progress("planning")
    station = _station()
    progress(f"moving the twin to {configurations} configurations")
    joints = allowed_configurations(station.robot, configurations, np.random.default_rng(0))
    twin = invented_twin(station.robot)
    truth = held_out(station.robot, twin, joints)

    return Run(
        station=station,
        outcomes=over_seeds(seeds, progress, partial(_campaign, station, twin, truth)),
        others=over_seeds(seeds, progress, partial(_other, station, joints[:others]), what="other robot"),
    )


def _station() -> Station:
    """Return what is the same for every robot."""
    robot, cups = nominal_robot()
    wanted = poses(cups)
    candidates = Postures(allowed_configurations(robot, _CANDIDATES, np.random.default_rng(1)))
    tracked = plan_measurements(robot, candidates, _ELASTIC, poses=_TRACKER, rng=np.random.default_rng(1))
    plan = reachable(robot, FIXTURE, wanted, branches=(FRONT_UP, BACK_DOWN))
    return Station(robot, wanted, plan, touches(robot), tracked.joints)


def _other(station: Station, joints: Array, seed: Seed) -> Outcome:
    """Do so with another robot, drawn for the seed."""
    drawn = drawn_twin(station.robot, seed.number)
    return _campaign(station, drawn, held_out(station.robot, drawn, joints), seed)


def _campaign(station: Station, twin: Twin, truth: HeldOut, seed: Seed) -> Outcome:
    """Measure and calibrate a twin with the device and with a tracker, and judge all models by `truth`."""
    rng = seed.generator()
    robot = station.robot
    rows = _one_of_flip_and_noflip(station.plan, rng)
    campaign = two_steps(robot, twin, station.touches, station.wanted, rows, _ELASTIC, ballbar(rng))
    sides = np.linalg.norm(campaign.base_cups - np.roll(campaign.base_cups, -1, axis=0), axis=1)
    frame = world_frame(campaign.base_cups, sides).frame
    truth = truth.seen_from(frame)
    first = campaign.data.of_configurations(range(len(campaign.first)))

    def held(cups: Cups) -> tuple[Robot, Robot]:
        preliminary = identified_holding(robot, robot, first, cups)
        return preliminary, identified_holding(robot, preliminary, campaign.data, cups)

    cups = Cups(campaign.touches, campaign.sides)
    plain = replace(cups, corrected=False)
    preliminary, final = held(cups)
    again = final
    for _ in range(10):
        again = identified_holding(robot, again, campaign.data, cups)
    placed = rebased(robot, frame)
    models: dict[Model, Robot] = {
        "nominal": placed,
        "preliminary held": preliminary,
        "final held": final,
        "preliminary following": identified_following(robot, first, cups),
        "final following": identified_following(robot, campaign.data, cups),
        "preliminary found": campaign.preliminary.robot,
        "final found": campaign.final.robot,
        "tracker": _tracked(station, twin, frame, rng),
    }
    # In the base of the true frame, so that what is found there would be no motion at all.
    frame_models: tuple[FrameModel, ...] = ("nominal", "final found")
    found = {name: cups.frame_by(models[name]).frame for name in frame_models}
    return Outcome(
        campaign=campaign,
        front=tuple(row.branch.startswith(FRONT_UP) for row in rows),
        judgements={name: judged(model, truth) for name, model in models.items()},
        away=truth.away,
        front_up=truth.front_up,
        uncorrected={
            "final held": mean_position_error(held(plain)[1], truth),
            "final following": mean_position_error(identified_following(robot, campaign.data, plain), truth),
        },
        repeated=mean_position_error(again, truth),
        frames={
            name: FrameError(float(np.linalg.norm(of.translation)), float(np.linalg.norm(rotation_vector(of.rotation))))
            for name, of in found.items()
        },
    )


def _one_of_flip_and_noflip(plan: Reachable, rng: np.random.Generator) -> list[PlannedRow]:
    """Return the rows of a plan with one of flip and noflip, by chance, as in section 4.4."""
    same: dict[tuple[int, str], list[int]] = {}
    for number, row in enumerate(plan.rows):
        same.setdefault((row.pose, row.branch.rpartition("-")[0]), []).append(number)
    return [plan.rows[number] for number in sorted(int(rng.choice(numbers)) for numbers in same.values())]


def _tracked(station: Station, twin: Twin, frame: Transform, rng: np.random.Generator) -> Robot:
    data = measure(twin, station.tracked, _NOISE, rng)
    seen = (data.target == data.configuration % len(data.targets))[:, None]
    from_fixture = (data.position - np.array(frame.translation)) @ frame.rotation
    return identify(station.robot, replace(data, position=np.where(seen, from_fixture, np.nan)), _ELASTIC).robot
