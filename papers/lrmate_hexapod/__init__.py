"""Nubiola, chapter 4: an LR Mate calibrated with the hexapod device in two steps, and with a tracker."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from papers import Progress
from papers.campaign import Campaign, two_steps
from papers.lrmate_hexapod import judgement
from papers.lrmate_hexapod.identification import Cups, identified_following, identified_holding, rebased
from papers.lrmate_hexapod.judgement import Diagnosis, HeldOut, held_out, mean_position_error
from papers.lrmate_hexapod.robot import BACK_DOWN, FIXTURE, FRONT_UP, drawn_twin, invented_twin, nominal_robot, touches
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import Rows, told
from papers.traces import scatter
from truearm.engine.data.hexapod import DEVICE, HexapodPose, poses
from truearm.engine.document.drawing import AFTER, BEFORE, COLOURS, Figure, axis, figure, rounded, rounded_to
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.motion.cell import skeleton
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
from truearm.validation.distances import PairDistances

_ELASTIC: Final = named_model("elastic")
_TRACKER: Final = 50
_CANDIDATES: Final = 1000
#: Of a coordinate that the tracker reads, invented [m].
_NOISE: Final = 0.02e-3
#: Nearer to the reference point than this the cup is near (text on Figure 4.7), and beyond this away [m].
_NEAR: Final = 0.2
_AWAY: Final = 0.4
#: Models in words: the document's words in two readings, base by three cups, held by the model before, or following the
#: model that is identified; with base and cups found together with the robot; and by a tracker.
_NOMINAL: Final = "nominal, base known"
_BY_TRACKER: Final = "tracker, 50 positions"
_HELD: Final = ("preliminary, base held", "final, base held")
_FOLLOWING: Final = ("preliminary, base following", "final, base following")
_FOUND: Final = ("preliminary, base and cups found", "final, base and cups found")
#: Points drawn at most, and width of the bands of distance [m], of which those with fewer configurations are not drawn.
_POINTS: Final = 1500
_BAND: Final = 0.1
_FEW: Final = 10
#: Arms side by side, and the room that each has [m].
_COLUMNS: Final = 9
_CELL: Final = 1.1
_DISTANCE: Final = "distance from the reference point [mm]"
_ERROR: Final = "position error [mm]"


@dataclass(frozen=True, eq=False)
class _Station:
    """What is the same for every robot: the nominal one, the plan, where it touches, what the tracker looks at."""

    robot: Robot
    wanted: tuple[HexapodPose, ...]
    plan: Reachable
    touches: Array
    tracked: Array


@dataclass(frozen=True, eq=False)
class _Drawn:
    """What one campaign shows beside its figures."""

    campaign: Campaign  #: With the device.
    front: tuple[bool, ...]  #: Which of the measured rows are front/up.
    judgements: Mapping[str, Diagnosis]  #: Of every model.
    away: Array  #: Distance of each held-out configuration from the reference point [m], ``(n,)``.
    front_up: NDArray[np.bool_]  #: Which of them are front/up, ``(n,)``.


def study(seeds: int, progress: Progress, configurations: int = 9905, others: int = 500) -> Study:
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
    joints = judgement.allowed_configurations(station.robot, configurations, np.random.default_rng(0))
    twin = invented_twin(station.robot)
    truth = held_out(station.robot, twin, joints)
    found, drawn = gathered(over_seeds(seeds, progress, partial(_campaign, station, twin, truth)))
    other_robots = over_seeds(seeds, progress, partial(_other, station, joints[:others]), what="other robot")
    of_others, _ = gathered(other_robots)
    reached = {"poses": station.plan.poses_reached, "configurations": len(station.plan.rows)}
    tables: dict[str, Rows] = {**found, "steps": {**reached, **found["steps"]}, "others": of_others["others"]}
    means = {model: of_others["others"][f"{model}: mean"] for model in (*_HELD, *_FOLLOWING)}
    preliminary, final = (means[name] for name in _HELD)
    tracked, device = (of_others["near"][f"{name}: mean beyond 400 mm"] for name in (_BY_TRACKER, _FOUND[1]))
    first = drawn[0]
    every = _every(first)
    figures = {
        "arms": _arms_figure(station.robot, first),
        "away": _bands_figure(first),
        **_scattered(first),
        **_signed(first),
    }
    texts: dict[str, object] = {"held": (min(final), max(final))}
    texts |= {"following": (min(means[_FOLLOWING[1]]), max(means[_FOLLOWING[1]]))}
    texts |= {"worse": sum(a > b for a, b in zip(final, preliminary, strict=True))}
    texts |= {"better": sum(a < b for a, b in zip(tracked, device, strict=True))}
    texts |= {"shown": "All configurations" if every == 1 else f"One of {every} configurations"}
    return told(__file__, seeds, tables, figures, texts)


def _station() -> _Station:
    """Return what is the same for every robot."""
    robot, cups = nominal_robot()
    wanted = poses(cups)
    candidates = Postures(judgement.allowed_configurations(robot, _CANDIDATES, np.random.default_rng(1)))
    tracked = plan_measurements(robot, candidates, _ELASTIC, poses=_TRACKER, rng=np.random.default_rng(1))
    plan = reachable(robot, FIXTURE, wanted, branches=(FRONT_UP, BACK_DOWN))
    return _Station(robot, wanted, plan, touches(robot), tracked.joints)


def _other(station: _Station, joints: Array, seed: Seed) -> tuple[Figures, _Drawn]:
    """Do so with another robot, drawn for the seed."""
    drawn = drawn_twin(station.robot, seed.number)
    return _campaign(station, drawn, held_out(station.robot, drawn, joints), seed)


def _campaign(station: _Station, twin: Twin, truth: HeldOut, seed: Seed) -> tuple[Figures, _Drawn]:
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
    models = {
        _NOMINAL: rebased(robot, frame),
        **dict(zip(_HELD, (preliminary, final), strict=True)),
        **{m: identified_following(robot, d, cups) for m, d in zip(_FOLLOWING, (first, campaign.data), strict=True)},
        **dict(zip(_FOUND, (campaign.preliminary.robot, campaign.final.robot), strict=True)),
        _BY_TRACKER: _tracked(station, twin, frame, rng),
    }
    judgements = {name: judgement.judged(model, truth) for name, model in models.items()}
    uncorrected = {_HELD[1]: held(plain)[1], _FOLLOWING[1]: identified_following(robot, campaign.data, plain)}
    gains = {
        name: 100.0 * (1.0 - judgements[name].mean / mean_position_error(model, truth))
        for name, model in uncorrected.items()
    }
    frames: dict[str, float] = {}
    for words, name in (("nominal model", _NOMINAL), ("final model, base and cups found", _FOUND[1])):
        # In the base of the true frame, so that what is found there would be no motion at all.
        of = cups.frame_by(models[name]).frame
        turn = float(np.degrees(1.0)) * float(np.linalg.norm(rotation_vector(of.rotation)))
        frames[f"frame by the {words}, shift"] = 1e3 * float(np.linalg.norm(of.translation))
        frames[f"frame by the {words}, turn [deg]"] = turn
    rounds = "final, base held, ten more rounds of touching and identifying, mean error"
    drawn = _Drawn(
        campaign, tuple(row.branch.startswith(FRONT_UP) for row in rows), judgements, truth.away, truth.front_up
    )
    figures: Figures = {
        "steps": _steps(drawn),
        "frames": {
            **{f"gain by the correction, mean error of {name} [%]": gain for name, gain in gains.items()},
            **frames,
            rounds: 1e3 * mean_position_error(again, truth),
        },
        **_errors(drawn),
        "others": _others(drawn, gains, frames),
    }
    return figures, drawn


def _steps(drawn: _Drawn) -> dict[str, float]:
    """Count what the two steps measured."""
    campaign, front = drawn.campaign, drawn.front
    rows = {
        "of these measured or tried": len(front),
        "front/up among them": sum(front),
        "largest error of a base distance [mm]": 1e3 * float(np.abs(campaign.sides - DEVICE.base).max()),
    }
    for step, measured in (("first", campaign.first), ("second", campaign.second)):
        up = sum(front[row] for row in measured)
        rows |= {f"{step} step: front/up measured": up, f"{step} step: back/down measured": len(measured) - up}
    return rows | {"never in range": len(campaign.out_of_range)}


def _errors(drawn: _Drawn) -> Figures:
    """Return errors of every model [mm, deg, %]."""
    figures: Figures = {"signs": {}, "orientations": {}}
    near, beyond = {}, {}
    for name, one in drawn.judgements.items():
        pairs, front = one.pairs, one.pairs_front_up
        for table, three in (
            ("positions", _spread(one.position)),
            ("positions_front_up", _spread(one.position[drawn.front_up])),
            ("distances", (pairs.mean, pairs.deviation, pairs.maximum)),
            ("distances_front_up", (front.mean, front.deviation, front.maximum)),
        ):
            named = zip(("mean", "standard deviation", "maximum"), three, strict=True)
            figures.setdefault(table, {}).update({f"{name}: {what}": 1e3 * value for what, value in named})
        mean, _, most = np.degrees(_spread(one.orientation)).tolist()
        figures["orientations"] |= {f"{name}: mean": mean, f"{name}: maximum": most}
        if name != _NOMINAL:
            figures["signs"][name] = 100.0 * pairs.positive
            close = one.position[(drawn.away < _NEAR) & drawn.front_up]
            near[f"{name}: largest within 200 mm, front/up"] = 1e3 * float(close.max(initial=0.0))
            beyond[f"{name}: mean beyond 400 mm"] = 1e3 * _mean_away(drawn, name)
    return {**figures, "near": {**near, **beyond}}


def _spread(errors: Array) -> tuple[float, float, float]:
    return float(errors.mean()), float(errors.std()), float(errors.max())


def _mean_away(drawn: _Drawn, model: str) -> float:
    """Return the mean position error beyond 400 mm from the reference point [m]."""
    return float(drawn.judgements[model].position[drawn.away > _AWAY].mean())


def _others(drawn: _Drawn, gains: Mapping[str, float], frames: Mapping[str, float]) -> dict[str, float]:
    """Return what is shown of other robots."""
    judgements = drawn.judgements

    def ratio(over: str, under: str) -> float:
        return judgements[over].mean / judgements[under].mean

    shift = "frame by the nominal model, shift"
    return {
        **{f"{name}: mean": 1e3 * one.mean for name, one in judgements.items()},
        shift: frames[shift],
        "final over preliminary, base held []": ratio(_HELD[1], _HELD[0]),
        "final over preliminary, base following []": ratio(_FOLLOWING[1], _FOLLOWING[0]),
        "final over preliminary, base and cups found []": ratio(_FOUND[1], _FOUND[0]),
        **{f"{name}, over tracker []": ratio(name, _BY_TRACKER) for name in (_HELD[0], _FOLLOWING[0])},
        "final, base and cups found, over tracker, beyond 400 mm []": _mean_away(drawn, _FOUND[1])
        / _mean_away(drawn, _BY_TRACKER),
        **{f"gain by the correction, {name} [%]": gain for name, gain in gains.items()},
        "positive distance errors, final, base held [%]": 100.0 * judgements[_HELD[1]].pairs.positive,
        "never in range []": len(drawn.campaign.out_of_range),
    }


def _one_of_flip_and_noflip(plan: Reachable, rng: np.random.Generator) -> list[PlannedRow]:
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


def _bands_figure(first: _Drawn) -> Figure:
    """Draw mean position errors of one seed in bands of distance."""
    band = np.floor(first.away / _BAND).astype(int)
    drawn = [number for number in range(band.max() + 1) if np.sum(band == number) >= _FEW]
    traces = []
    pairs = ((_HELD, COLOURS[0]), (_FOLLOWING, COLOURS[2]), (_FOUND, AFTER))
    shown = [(*of, colour) for models, colour in pairs for of in zip(models, models, ("dot", "solid"), strict=True)]
    for name, words, dash, colour in (*shown, (_BY_TRACKER, "tracker", "solid", COLOURS[1])):
        errors = first.judgements[name].position
        x = [1e3 * _BAND * (number + 0.5) for number in drawn]
        y = rounded_to(1e3 * np.array([errors[band == number].mean() for number in drawn]), 4)
        look, said = {"color": colour, "dash": dash}, f"{words}: %{{y:.3f}} mm<extra></extra>"
        traces.append(scatter(words, "lines+markers", x, y, line=look, hovertemplate=said))
    return figure(traces, 420, xaxis=axis(_DISTANCE), yaxis=axis(f"mean {_ERROR}") | {"rangemode": "tozero"})


def _every(first: _Drawn) -> int:
    """Return one of how many configurations is drawn."""
    return max(1, -(-len(first.away) // _POINTS))


def _scattered(first: _Drawn) -> dict[str, Figure]:
    """Draw position errors of one seed against the distance from the calibrated region."""
    every, said = _every(first), "%{x:.0f} mm away: %{y:.3f} mm<extra></extra>"
    figures = {}
    for name in (*_HELD, _FOLLOWING[1]):
        traces = []
        for words, colour, chosen in (("others", BEFORE, ~first.front_up), ("front/up", AFTER, first.front_up)):
            x = rounded_to(1e3 * first.away[chosen][::every], 1)
            y = rounded_to(1e3 * first.judgements[name].position[chosen][::every], 4)
            look = {"color": colour, "size": 4}
            traces.append(scatter(words, "markers", x, y, marker=look, hovertemplate=said))
        up = axis(_ERROR) | {"rangemode": "tozero"}
        figures[f"away-{_picture(name)}"] = figure(traces, 380, xaxis=axis(_DISTANCE), yaxis=up)
    return figures


def _picture(model: str) -> str:
    return model.partition(", 50")[0].replace(", base ", "-")


def _signed(first: _Drawn) -> dict[str, Figure]:
    """Draw the histograms of distance errors of both calibrations as printed, and of a tracker's."""
    figures = {}
    for name in (*_HELD, _FOLLOWING[1], _BY_TRACKER):
        one = first.judgements[name]
        traces = [_steps_of("all pairs", BEFORE, one.pairs), _steps_of("both front/up", AFTER, one.pairs_front_up)]
        across, up = axis("distance error [mm]"), axis("share of the pairs per mm")
        figures[f"distances-{_picture(name)}"] = figure(traces, 340, xaxis=across, yaxis=up)
    return figures


def _steps_of(words: str, colour: str, pairs: PairDistances) -> Figure:
    edges = 1e3 * pairs.edges
    share = pairs.counts / pairs.pairs / np.diff(edges)
    look, said = {"shape": "hv", "color": colour}, f"{words}: %{{x:.3f}} mm<extra></extra>"
    x, y = rounded(edges, 6), rounded(np.append(share, share[-1]), 4)
    return scatter(words, "lines", x, y, line=look, hovertemplate=said)


def _arms_figure(robot: Robot, first: _Drawn) -> Figure:
    """Draw the measured configurations."""
    data = first.campaign.data
    rows = (*first.campaign.first, *first.campaign.second)
    joints = np.stack(skeleton(robot, data.joints), axis=1)
    turn = data.joints[:, 0]
    # Side view: along the direction in which joint 1 turns the arm, and up.
    along = joints[:, :, 0] * np.cos(turn)[:, None] + joints[:, :, 1] * np.sin(turn)[:, None]
    places = [(_CELL * (number % _COLUMNS), -_CELL * (number // _COLUMNS)) for number in range(len(rows))]
    traces, labels = [], []
    for words, colour, front in (("front/up", AFTER, True), ("back/down", "#b3261e", False)):
        x: list[float | None] = []
        y: list[float | None] = []
        for number, row in enumerate(rows):
            if first.front[row] == front:
                right, up = places[number]
                x += [*rounded_to(along[number] + right, 4), None]
                y += [*rounded_to(joints[number, :, 2] + up, 4), None]
        look = {"line": {"color": colour, "width": 1.5}, "marker": {"color": colour, "size": 3}, "hoverinfo": "skip"}
        traces.append(scatter(words, "lines+markers", x, y, **look))
    for number, (row, (right, up)) in enumerate(zip(rows, places, strict=True)):
        text = f"{'F' if first.front[row] else 'B'} {data.labels[number].partition('#')[0]}"
        labels.append({"text": text, "x": right, "y": up - 0.1, "showarrow": False, "font": {"size": 10}})
    hidden = {"visible": False}
    return figure(traces, 860, xaxis=hidden, yaxis=hidden | {"scaleanchor": "x"}, annotations=labels)
