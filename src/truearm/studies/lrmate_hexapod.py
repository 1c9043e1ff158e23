"""Nubiola, chapter 4: an LR Mate calibrated with the hexapod device in two steps, and with a tracker."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.identification.fit import identify
from truearm.identification.models import MODELS
from truearm.measurement.devices.hexapod.geometry import DEVICE
from truearm.measurement.devices.hexapod.poses import HexapodPose, poses
from truearm.measurement.devices.hexapod.sheet import PlannedRow
from truearm.measurement.devices.hexapod.simulated import ballbar
from truearm.measurement.devices.hexapod.world_frame import world_frame
from truearm.measurement.twin import Twin, measure
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform, rotation_vector
from truearm.planning.hexapod.campaign import Campaign, two_steps
from truearm.planning.hexapod.reachable import Reachable, reachable
from truearm.planning.measurement_plan import plan_measurements
from truearm.studies.lrmate import (
    BACK_DOWN,
    FIXTURE,
    FRONT_UP,
    Cups,
    Judgement,
    Unseen,
    allowed_configurations,
    drawn_twin,
    identified_as_printed,
    invented_twin,
    judged,
    nominal_robot,
    standing_in,
    touches,
    unseen,
)
from truearm.studies.lrmate_pictures import away_pictures, distance_pictures
from truearm.studies.study import Row, Study, Table

_ELASTIC: Final = next(model for model in MODELS if model.name == "elastic")
_CONFIGURATIONS: Final = 9905
#: Unseen configurations for each of the other robots.
_OTHERS: Final = 1000
_TRACKER: Final = 50
_CANDIDATES: Final = 1000
#: Of a coordinate that the tracker reads, invented [m].
_NOISE: Final = 0.02e-3
#: Around the reference point (text on Figure 4.7), and what counts as away from it [m].
_NEAR: Final = 0.2
_AWAY: Final = 0.4
#: Tables 4.3 to 4.6: mean, standard deviation, maximum [mm].
_Figures = Mapping[str, tuple[float, float, float]]
_TABLE_4_3: Final[_Figures] = {
    "nominal": (1.355, 1.029, 5.197),
    "preliminary": (0.517, 0.219, 1.223),
    "final": (0.796, 0.275, 1.630),
    "tracker": (0.156, 0.067, 0.490),
}
_TABLE_4_4: Final[_Figures] = {
    "nominal": (0.873, 0.416, 2.717),
    "preliminary": (0.479, 0.214, 1.039),
    "final": (0.697, 0.253, 1.406),
}
_TABLE_4_5: Final[_Figures] = {
    "nominal": (1.062, 0.960, 7.873),
    "preliminary": (0.318, 0.219, 1.706),
    "final": (0.400, 0.244, 1.666),
    "tracker": (0.110, 0.083, 0.803),
}
_TABLE_4_6: Final[_Figures] = {
    "nominal": (0.595, 0.511, 4.963),
    "preliminary": (0.384, 0.237, 1.231),
    "final": (0.456, 0.243, 1.394),
}
#: Models by the names used here, in words.
_MODELS: Final = {
    "nominal": "nominal, base known",
    "preliminary": "preliminary, base by three cups",
    "final": "final, base by three cups",
    "preliminary found": "preliminary, base and cups found",
    "final found": "final, base and cups found",
    "tracker": "tracker, 50 positions",
}
_STATISTICS: Final = ("mean", "standard deviation", "maximum")


@dataclass(frozen=True, eq=False)
class _Station:
    """What is the same for every robot: the nominal one, the plan, where it touches, what the tracker looks at."""

    robot: Robot
    wanted: tuple[HexapodPose, ...]
    plan: Reachable
    touches: Array
    tracked: Array


@dataclass(frozen=True, eq=False)
class _Outcome:
    """One campaign: its steps, every model judged, and how the world frame came out.

    `front` says which of the measured rows are front/up; `repeated` is the mean error of the final model after ten
    more rounds, `plain` without the correction by distances [m]; `shift` and `tilt` [m, rad] are the errors of the
    frame by each model.
    """

    campaign: Campaign
    front: tuple[bool, ...]
    judgements: Mapping[str, Judgement]
    away: Array
    front_up: Array
    plain: float
    repeated: float
    shift: Mapping[str, float]
    tilt: Mapping[str, float]


def study(
    seeds: int, progress: Callable[[str], None], configurations: int = _CONFIGURATIONS, others: int = _OTHERS
) -> Study:
    """Run the study.

    Parameters
    ----------
    seeds
        How many: of the ballbar's and the tracker's noise and of the choice between flip and noflip; and as many other
        robots.
    progress
        Called with a few words at each step.
    configurations
        To judge the robot of the robot file by.
    others
        To judge each of the other robots by.
    """
    progress("planning")
    station = _station()
    progress(f"moving the twin to {configurations} configurations")
    joints = allowed_configurations(station.robot, configurations, np.random.default_rng(0))
    twin = invented_twin(station.robot)
    truth = unseen(station.robot, twin, joints)
    outcomes = []
    for seed in range(seeds):
        progress(f"seed {seed + 1} of {seeds}")
        outcomes.append(_one(station, twin, truth, seed))
    drawn = []
    for seed in range(seeds):
        progress(f"other robot {seed + 1} of {seeds}")
        other = drawn_twin(station.robot, seed)
        drawn.append(_one(station, other, unseen(station.robot, other, joints[:others]), seed))

    def mean(name: str) -> float:
        return float(np.median([1e3 * o.judgements[name].position.mean() for o in outcomes]))

    worse = sum(_mean(o, "final") > _mean(o, "preliminary") for o in drawn)
    better = sum(_mean_away(o, "tracker") < _mean_away(o, "final found") for o in drawn)
    return Study(
        name="lrmate-hexapod",
        title="A FANUC LR Mate 200iC calibrated with one ballbar",
        source="A. Nubiola, doctoral thesis, ETS Montreal, chapter 4: Tables 4.1 to 4.6, Figures 4.7 and 4.8; the truth"
        " is invented",
        answer=f"Done as printed, with the base held where the three cups are, the final calibration leaves"
        f" {mean('final'):.2f} mm on average, more than the preliminary one ({mean('preliminary'):.2f} mm), as in the"
        f" document (0.80 and 0.52 mm); of {seeds} other robots this happens to {worse}. It is the base that costs so"
        f" much: found together with the robot from the very same readings, {mean('final found'):.2f} mm are left. A"
        f" tracker leaves {mean('tracker'):.2f} mm (document: 0.16 mm), and away from the fixture it is better than the"
        f" device for {better} of {seeds} other robots. Chapter 4 prints no identified parameters, so this robot is"
        " invented: its nominal errors were chosen, everything else follows.",
        seeds=seeds,
        tables=(
            _steps(station, outcomes),
            _frames(outcomes),
            _errors("4.3", "all configurations", "position", outcomes, _position, _TABLE_4_3),
            _errors("4.4", "front/up only", "position", outcomes, _position_front_up, _TABLE_4_4),
            _errors("4.5", "all pairs", "distance", outcomes, _pairs, _TABLE_4_5),
            _errors("4.6", "pairs of front/up", "distance", outcomes, _pairs_front_up, _TABLE_4_6),
            _signs(outcomes),
            _orientations(outcomes),
            _by_distance(outcomes),
            _other_robots(drawn),
        ),
        pictures=(
            *away_pictures(outcomes[0].judgements, truth.front_up, outcomes[0].away),
            *distance_pictures(outcomes[0].judgements),
        ),
        notes=(
            "The truth in the robot file is one of 5457 random draws: the one whose nominal errors come nearest to"
            " Tables 4.3 and 4.4. The rows of the nominal model show how near; they are no result.",
            "Beyond that, the twin has what no model here contains: sines of its gears (0.007 deg), backlash (0.004"
            " deg), bearings that tilt (3e-6 rad/(N m), joints 1 to 4) and hardening (1e-4 of the compliance per"
            " N^2 m^2). They are invented too, so that a tracker leaves about what it leaves in the document.",
            "The document does not print where its fixture stood. Ours stands beside the robot, its middle 0.39 m from"
            " axis 1 and 0.2 m above the table, 17 deg off level, where as many poses can be reached. The document's"
            " back/down is back-up here: elbow above, wrist behind axis 1.",
            "As printed: 24 parameters by least squares without priors, cups of the tool at their nominal places; the"
            " base stands where the model before (nominal, then preliminary) finds the three cups, and is looked for"
            " again by the model that comes out. What this costs is the difference to the rows below it, where"
            " truearm finds base and cups together with the robot, with priors, and no cup needs to be touched.",
            "The tracker reads one cup in each of 50 configurations chosen by O1 from 1000, with 0.02 mm a coordinate."
            " All errors are against true places in the true frame of the fixture; each configuration counts with"
            " one cup, in turns, as in the document.",
            "Nothing is drawn of Figure 4.6, 61 pictures of the arm; Figures 4.1 to 4.5 show the set-up. The columns"
            " mean + 3 std follow from the others.",
        ),
    )


def _station() -> _Station:
    robot, cups = nominal_robot()
    wanted = poses(cups)
    candidates = Postures(allowed_configurations(robot, _CANDIDATES, np.random.default_rng(1)))
    tracked = plan_measurements(robot, candidates, _ELASTIC, poses=_TRACKER, rng=np.random.default_rng(1))
    plan = reachable(robot, FIXTURE, wanted, branches=(FRONT_UP, BACK_DOWN))
    return _Station(robot, wanted, plan, touches(robot), tracked.joints)


def _one(station: _Station, twin: Twin, truth: Unseen, seed: int) -> _Outcome:
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
    return _Outcome(
        campaign=campaign,
        front=tuple(row.branch.startswith(FRONT_UP) for row in rows),
        judgements={name: judged(model, truth) for name, model in models.items()},
        away=truth.away,
        front_up=truth.front_up,
        plain=float(judged(as_printed(replace(cups, corrected=False))[1], truth).position.mean()),
        repeated=float(judged(again, truth).position.mean()),
        shift={name: float(np.linalg.norm(of.translation)) for name, of in found.items()},
        tilt={name: float(np.linalg.norm(rotation_vector(of.rotation))) for name, of in found.items()},
    )


def _without_twins(plan: Reachable, rng: np.random.Generator) -> list[PlannedRow]:
    """Return the rows of a plan with one of flip and noflip, by chance, as in section 4.4."""
    same: dict[tuple[int, str], list[int]] = {}
    for number, row in enumerate(plan.rows):
        same.setdefault((row.pose, row.branch.rpartition("-")[0]), []).append(number)
    return [plan.rows[number] for number in sorted(int(rng.choice(numbers)) for numbers in same.values())]


def _tracked(station: _Station, twin: Twin, frame: Transform, rng: np.random.Generator) -> Robot:
    data = measure(twin, station.tracked, _NOISE, rng)
    seen = (data.target == data.configuration % len(data.targets))[:, None]
    from_fixture = (data.position - np.array(frame.translation)) @ frame.rotation
    return identify(station.robot, replace(data, position=np.where(seen, from_fixture, np.nan)), _ELASTIC).robot


# -- figures -----------------------------------------------------------------------------------------------


def _position(outcome: _Outcome, name: str) -> tuple[float, ...]:
    return _spread(outcome.judgements[name].position)


def _position_front_up(outcome: _Outcome, name: str) -> tuple[float, ...]:
    return _spread(outcome.judgements[name].position[outcome.front_up])


def _pairs(outcome: _Outcome, name: str) -> tuple[float, ...]:
    pairs = outcome.judgements[name].pairs
    return pairs.mean, pairs.deviation, pairs.maximum


def _pairs_front_up(outcome: _Outcome, name: str) -> tuple[float, ...]:
    pairs = outcome.judgements[name].pairs_front_up
    return pairs.mean, pairs.deviation, pairs.maximum


def _spread(errors: Array) -> tuple[float, ...]:
    return float(errors.mean()), float(errors.std()), float(errors.max())


def _mean(outcome: _Outcome, name: str) -> float:
    return float(outcome.judgements[name].position.mean())


def _mean_away(outcome: _Outcome, name: str) -> float:
    return float(outcome.judgements[name].position[outcome.away > _AWAY].mean())


# -- tables ------------------------------------------------------------------------------------------------


def _steps(station: _Station, outcomes: Sequence[_Outcome]) -> Table:
    def count(of: str, front: bool) -> list[int]:
        return [sum(o.front[row] == front for row in getattr(o.campaign, of)) for o in outcomes]

    farthest = [1e3 * float(np.abs(o.campaign.sides - DEVICE.base).max()) for o in outcomes]
    return Table(
        "The two steps",
        "What the robot reaches with the fixture where it stands, and what the ballbar can measure: the six lengths"
        " within +/- 1 mm. The fixture was put where the first four counts are the document's.",
        (
            Row("poses", "", [station.plan.poses_reached], 46, "section 4.4"),
            Row(
                "configurations",
                "",
                [len(station.plan.rows)],
                124,
                "section 4.4",
                absolute=2,
                explanation="Each pose once with flip and once without. The document counts some poses three times.",
            ),
            Row("of these measured or tried", "", [len(o.front) for o in outcomes], 61, "section 4.4"),
            Row("front/up among them", "", [sum(o.front) for o in outcomes], 46, "section 4.4"),
            Row(
                "largest error of a base distance", "mm", farthest, explanation="Usually below 1 mm, says the document."
            ),
            Row(
                "first step: front/up measured",
                "",
                count("first", True),
                46,
                "section 4.4",
                absolute=4,
                explanation="A few of them are more than 1 mm off with this invented robot.",
            ),
            Row("first step: back/down measured", "", count("first", False), 0, "section 4.4", absolute=2),
            Row("second step: front/up measured", "", count("second", True), 0, "section 4.4", absolute=4),
            Row("second step: back/down measured", "", count("second", False), 15, "section 4.4", absolute=2),
            Row("never in range", "", [len(o.campaign.out_of_range) for o in outcomes], 0, "section 4.4", absolute=1),
        ),
    )


def _frames(outcomes: Sequence[_Outcome]) -> Table:
    gain = [100.0 * (1.0 - _mean(o, "final") / o.plain) for o in outcomes]
    return Table(
        "World frame from three cups",
        "The robot touches the cups with one cup of its tool and its model says where they are. The correction lays the"
        " measured triangle onto them.",
        (
            Row(
                "gain by the correction, mean error of the final model",
                "%",
                gain,
                15.0,
                "section 4.2",
                absolute=15.0,
                explanation="The gain is that of one robot, the document's or ours; see the other robots below.",
            ),
            *(
                Row(f"frame by the {words}, {what}", unit, [scale * getattr(o, of)[name] for o in outcomes])
                for name, words in (("nominal", "nominal model"), ("final found", "final model, base and cups found"))
                for what, of, unit, scale in (("shift", "shift", "mm", 1e3), ("turn", "tilt", "deg", np.degrees(1.0)))
            ),
            Row(
                "final, ten more rounds of touching and identifying, mean error",
                "mm",
                [1e3 * o.repeated for o in outcomes],
                explanation="Holding the base, identifying, and looking for the base again is no iteration that settles:"
                " what is wrong with the base goes into the robot and from there into the base. The document says that"
                " its identification is stable after four iterations, and not that the frame was found again in them.",
            ),
        ),
    )


def _errors(
    table: str,
    of_what: str,
    kind: str,
    outcomes: Sequence[_Outcome],
    figures: Callable[[_Outcome, str], tuple[float, ...]],
    published: _Figures,
) -> Table:
    rows = []
    for name, words in _MODELS.items():
        ours = np.array([figures(outcome, name) for outcome in outcomes])
        printed = published.get(name)
        for place, statistic in enumerate(_STATISTICS):
            rows.append(
                Row(
                    f"{words}: {statistic}",
                    "mm",
                    [1e3 * value for value in ours[:, place].tolist()],
                    None if printed is None else printed[place],
                    "" if printed is None else "section 4.4" if name == "tracker" else f"Table {table}",
                    relative=0.2 if name == "nominal" else 0.5,
                    explanation=_REASONS.get((table, name, statistic), ""),
                )
            )
    return Table(
        f"{kind.capitalize()} errors, {of_what} (Table {table})",
        f"The truth is invented, so a figure within half of the document's counts as agreeing; a fifth for the nominal"
        f" model, whose {'position' if kind == 'position' else 'other'} errors were chosen.",
        tuple(rows),
    )


#: Why a figure differs, or what it means: by table, model and statistic.
_REASONS: Final[Mapping[tuple[str, str, str], str]] = {}


def _signs(outcomes: Sequence[_Outcome]) -> Table:
    return Table(
        "Positive distance errors (Figure 4.8)",
        "Predicted minus true. A robot whose distances are nearly all too long, or all too short, is one that is scaled.",
        tuple(
            Row(
                f"{_MODELS[name]}",
                "%",
                [100.0 * o.judgements[name].pairs.positive for o in outcomes],
                published,
                "section 4.4" if published else "",
                absolute=15.0,
                explanation=why,
            )
            for name, published, why in (
                (
                    "preliminary",
                    60.0,
                    "The document does not say what it subtracts from what; the other way round ours is the rest to 100."
                    " With other robots the share is anything, see below.",
                ),
                (
                    "final",
                    86.0,
                    "A base held at a wrong place scales the robot; in which direction depends on the robot.",
                ),
                ("preliminary found", None, ""),
                ("final found", None, ""),
                ("tracker", None, ""),
            )
        ),
    )


def _orientations(outcomes: Sequence[_Outcome]) -> Table:
    return Table(
        "Orientation errors, all configurations",
        "Angle between the predicted and the true flange. The document measures positions only.",
        tuple(
            Row(
                f"{words}: {statistic}",
                "deg",
                [float(np.degrees(_spread(o.judgements[name].orientation)[place])) for o in outcomes],
            )
            for name, words in _MODELS.items()
            for place, statistic in ((0, "mean"), (2, "maximum"))
        ),
    )


def _by_distance(outcomes: Sequence[_Outcome]) -> Table:
    rows = []
    for name in ("preliminary", "final", "preliminary found", "final found", "tracker"):
        near = [o.judgements[name].position[(o.away < _NEAR) & o.front_up] for o in outcomes]
        rows.append(
            Row(
                f"{_MODELS[name]}: largest within 200 mm, front/up",
                "mm",
                [1e3 * float(errors.max(initial=0.0)) for errors in near],
                0.4 if name == "preliminary" else None,
                "section 4.4" if name == "preliminary" else "",
                relative=0.5,
            )
        )
    for name in ("preliminary", "final", "preliminary found", "final found", "tracker"):
        rows.append(
            Row(f"{_MODELS[name]}: mean beyond 400 mm", "mm", [1e3 * _mean_away(o, name) for o in outcomes]),
        )
    return Table(
        "Near the fixture and away from it (Figure 4.7)",
        "Distance from the point 300 mm from the three base cups and above them. The pictures show all configurations.",
        tuple(rows),
    )


def _other_robots(drawn: Sequence[_Outcome]) -> Table:
    def ratio(over: str, under: str) -> list[float]:
        return [_mean(o, over) / _mean(o, under) for o in drawn]

    return Table(
        "Other robots",
        "As many robots as seeds, drawn anew: errors of the same size, other gears, half to one and a half times as"
        " compliant. What holds for all of them is no accident of the invented truth.",
        (
            *(
                Row(
                    f"{_MODELS[name]}: mean",
                    "mm",
                    [1e3 * _mean(o, name) for o in drawn],
                    _TABLE_4_3[name][0] if name in _TABLE_4_3 else None,
                    "section 4.4" if name == "tracker" else "Table 4.3" if name in _TABLE_4_3 else "",
                    relative=0.5,
                )
                for name in _MODELS
            ),
            Row(
                "final over preliminary, base by three cups", "", ratio("final", "preliminary"), 1.54, "Table 4.3", 0.5
            ),
            Row("final over preliminary, base and cups found", "", ratio("final found", "preliminary found")),
            Row("preliminary, base by three cups, over tracker", "", ratio("preliminary", "tracker"), 3.31, "4.4", 1.7),
            Row(
                "final, base and cups found, over tracker, beyond 400 mm",
                "",
                [_mean_away(o, "final found") / _mean_away(o, "tracker") for o in drawn],
                explanation="Above 1 for every robot for which the tracker is the better one away from the fixture.",
            ),
            Row(
                "gain by the correction",
                "%",
                [100 * (1 - _mean(o, "final") / o.plain) for o in drawn],
                15.0,
                "4.2",
                15.0,
            ),
            Row(
                "positive distance errors, final, base by three cups",
                "%",
                [100.0 * o.judgements["final"].pairs.positive for o in drawn],
                86.0,
                "section 4.4",
                absolute=15.0,
            ),
            Row("never in range", "", [len(o.campaign.out_of_range) for o in drawn], 0, "section 4.4", absolute=1),
        ),
    )
