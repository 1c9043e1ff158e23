"""One campaign with the hexapod device on a twin of the LR Mate, and what its models are worth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from truearm.studies.lrmate import (
    BACK_DOWN,
    FIXTURE,
    FRONT_UP,
    Cups,
    Judgement,
    Unseen,
    allowed_configurations,
    identified_as_printed,
    judged,
    mean_position_error,
    nominal_robot,
    standing_in,
    touches,
)

from truearm.identification.hexapod.campaign import Campaign, two_steps
from truearm.identification.solving.fit import identify
from truearm.identification.solving.models import MODELS
from truearm.measurement.hexapod.poses import HexapodPose, poses
from truearm.measurement.hexapod.sheet import PlannedRow
from truearm.measurement.hexapod.world_frame import world_frame
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform, rotation_vector
from truearm.planning.choosing.measurement_plan import plan_measurements
from truearm.planning.hexapod.reachable import Reachable, reachable
from truearm.simulation.hexapod.simulated import ballbar
from truearm.simulation.twin import Twin, measure

_ELASTIC: Final = next(model for model in MODELS if model.name == "elastic")
_TRACKER: Final = 50
_CANDIDATES: Final = 1000
#: Of a coordinate that the tracker reads, invented [m].
_NOISE: Final = 0.02e-3


@dataclass(frozen=True, eq=False)
class Station:
    """What is the same for every robot: the nominal one, the plan, where it touches, what the tracker looks at."""

    robot: Robot
    wanted: tuple[HexapodPose, ...]
    plan: Reachable
    touches: Array
    tracked: Array


@dataclass(frozen=True, eq=False)
class Outcome:
    """One campaign: its steps, every model judged, and how the world frame came out.

    `front` says which of the measured rows are front/up; `repeated` is the mean error of the final model after ten
    more rounds, `plain` without the correction by distances [m]; `shift` and `tilt` [m, rad] are the errors of the
    frame by each model.
    """

    campaign: Campaign
    front: tuple[bool, ...]
    judgements: Mapping[str, Judgement]
    away: Array
    front_up: NDArray[np.bool_]
    plain: float
    repeated: float
    shift: Mapping[str, float]
    tilt: Mapping[str, float]


def station() -> Station:
    """Return what is the same for every robot."""
    robot, cups = nominal_robot()
    wanted = poses(cups)
    candidates = Postures(allowed_configurations(robot, _CANDIDATES, np.random.default_rng(1)))
    tracked = plan_measurements(robot, candidates, _ELASTIC, poses=_TRACKER, rng=np.random.default_rng(1))
    plan = reachable(robot, FIXTURE, wanted, branches=(FRONT_UP, BACK_DOWN))
    return Station(robot, wanted, plan, touches(robot), tracked.joints)


def campaign_of(station: Station, twin: Twin, truth: Unseen, seed: int) -> Outcome:
    """Measure and calibrate a twin with the device and with a tracker, and judge all models by `truth`."""
    rng = np.random.default_rng(seed)
    robot = station.robot
    rows = _without_twins(station.plan, rng)
    campaign = two_steps(robot, twin, station.touches, station.wanted, rows, _ELASTIC, ballbar(rng))
    sides = np.linalg.norm(campaign.base_cups - np.roll(campaign.base_cups, -1, axis=0), axis=1)
    frame = world_frame(campaign.base_cups, sides).frame
    truth = truth.seen_from(frame)
    first = campaign.data.of_configurations(range(len(campaign.first)))

    def as_printed(cups: Cups) -> tuple[Robot, Robot]:
        preliminary = identified_as_printed(robot, robot, first, cups)
        return preliminary, identified_as_printed(robot, preliminary, campaign.data, cups)

    cups = Cups(campaign.touches, campaign.sides)
    preliminary, final = as_printed(cups)
    again = final
    for _ in range(10):
        again = identified_as_printed(robot, again, campaign.data, cups)
    placed = standing_in(robot, frame)
    models = {
        "nominal": placed,
        "preliminary": preliminary,
        "final": final,
        "preliminary found": campaign.preliminary.robot,
        "final found": campaign.final.robot,
        "tracker": _tracked(station, twin, frame, rng),
    }
    # In the base of the true frame, so that what is found there would be no motion at all.
    found = {name: cups.frame_by(models[name]).frame for name in ("nominal", "final found")}
    return Outcome(
        campaign=campaign,
        front=tuple(row.branch.startswith(FRONT_UP) for row in rows),
        judgements={name: judged(model, truth) for name, model in models.items()},
        away=truth.away,
        front_up=truth.front_up,
        plain=mean_position_error(as_printed(replace(cups, corrected=False))[1], truth),
        repeated=mean_position_error(again, truth),
        shift={name: float(np.linalg.norm(of.translation)) for name, of in found.items()},
        tilt={name: float(np.linalg.norm(rotation_vector(of.rotation))) for name, of in found.items()},
    )


def _without_twins(plan: Reachable, rng: np.random.Generator) -> list[PlannedRow]:
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
