"""Nubiola, chapter 3: what the hexapod device measures of a robot that does what its model says, and what spoils it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from itertools import combinations
from typing import Final

import numpy as np

from papers import Progress
from papers.hexapod_place import PLACE, fixture_at, placed, poses_figure, touched
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import Rows, told
from papers.traces import scatter
from truearm.engine.base.errors import InputError
from truearm.engine.data import hexapod
from truearm.engine.data.dataset import IntArray
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, rounded
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform, rigid_motion
from truearm.engine.twin.twin import Twin
from truearm.hexapod.places import all_solutions, cup_monte_carlo, cup_uncertainty, plain_frame
from truearm.hexapod.reachable import Reachable, reachable, with_cups
from truearm.hexapod.rehearsal import ToolChanger, ballbar, measure_poses, set_up
from truearm.hexapod.sheet import SIDES_OF_FOUR, four_cups, side_frames
from truearm.validation.pose_accuracy import repeatability

#: How often the tool is attached, and each pose measured.
_ATTACHED: Final = 5
_REPEATED: Final = 5
#: Section 3.5: by how much the bar is off when it was long not put on its calibrator [m].
_DRIFT: Final = 3e-6
#: By library id: what a robot is called, and how far before it the middle of a flat fixture stands [m].
_ROBOTS: Final = {"irb120": ("IRB 120", 0.30), "lrmate200ic": ("LR Mate 200iC", 0.40)}
#: Section 3.2: near-equal pairs of the three groups, from the closest.
_GROUPS: Final = (
    ((10, 37), (46, 49), (2, 70), (34, 61), (22, 25), (13, 58)),
    ((14, 59), (35, 62), (11, 38), (47, 50), (23, 26), (3, 71)),
    ((1, 72), (12, 39), (15, 60), (48, 51), (24, 27), (36, 63)),
)


def study(seeds: int, progress: Progress, trials: int = 20_000, places: bool = True) -> Study:
    """Measure with the device, once a seed.

    Args:
        seeds: How many: of the bar's noise, of the tool changer, and of places of a fixture with four cups.
        progress: Called with a few words at each step.
        trials: Of each Monte Carlo.
        places: Whether robots are asked what they reach with a fourth cup.
    """
    robot, cups = with_cups(load_robot("irb120"))
    plan = reachable(robot, PLACE, hexapod.poses(cups), branches=("front-up",))
    found, _ = gathered(over_seeds(seeds, progress, partial(_one, robot, plan, trials=trials, places=places)))
    designed = hexapod.poses()
    apart = np.array([hexapod.distance(a, b) for a, b in combinations(designed, 2)])
    _, alike = np.unique(np.round(apart, 6), axis=0, return_counts=True)
    alike.sort()
    tables: dict[str, Rows] = {
        **found,
        "counts": _counts(designed, apart, alike),
        "uncertainty": _uncertainty(found["monte carlo"]),
        "accuracy": {**_accuracy(), **found["accuracy"]},
        "fourth": {"sides, and times as many poses of the device": len(SIDES_OF_FOUR)}
        | {row: found.get("fourth", {}).get(row, []) for row in map(_gain_of, _ROBOTS)},
    }
    del tables["monte carlo"]
    largest = {row: float(np.median(values)) for row, values in {**found["drift"], **found["changer"]}.items()}
    figures = {"poses": _poses_figure(designed), "distances": _distances_figure(designed)}
    texts: dict[str, object] = {"never": largest["never put on its calibrator: largest"]}
    texts |= {"fresh": largest["a bar that does not drift: largest"]}
    texts |= {"changed": largest["attached anew before every pose: largest"], "alike": alike[-1]}
    texts |= {"readings": 6 * len(plan.rows), "times": _REPEATED, "configurations": len(plan.rows)}
    texts |= {"poses": plan.poses_reached}
    return told(__file__, seeds, tables, figures, texts)


def _gain_of(name: str) -> str:
    return f"times as many configurations of the {_ROBOTS[name][0]}"


def _counts(designed: Sequence[hexapod.HexapodPose], apart: Array, alike: IntArray) -> dict[str, float]:
    """Count designs, assemblies and poses, and see how far apart poses are."""
    pairs = set(hexapod.near_equal(designed))
    by_number = {pose.number: pose for pose in designed}
    flanges = np.array([pose.position for pose in designed])
    apex = four_cups(np.full(3, hexapod.DEVICE.base), np.full(3, hexapod.DEVICE.base))[3] * [1.0, 1.0, -1.0]
    rows: dict[str, float] = {
        "designs": len(hexapod.designs()),
        "assemblies above the base": len(list(hexapod.assemblies())),
        "poses": len(designed),
        "near-equal pairs (30 deg, 50 mm)": len(pairs),
        "poses kept": len(hexapod.distinct(designed)),
    }
    for n, group in enumerate(_GROUPS, 1):
        turned, way = (np.mean([hexapod.distance(by_number[a], by_number[b])[k] for a, b in group]) for k in (0, 1))
        rows[f"group {n}: pairs as printed"] = len(pairs & set(group))
        rows |= {f"group {n}: angle [deg]": math.degrees(turned), f"group {n}: distance [mm]": 1e3 * float(way)}
    return rows | {
        "fewest pairs that a point of Figure 3.7 stands for": int(alike.min()),
        "most pairs that a point of Figure 3.7 stands for, but for one": int(alike[-2]),
        "radius of the sphere that holds all flanges [mm]": 1e3 * float(np.linalg.norm(flanges - apex, axis=1).max()),
        "largest distance of two flanges [mm]": 1e3 * float(apart[:, 1].max()),
    }


def _uncertainty(drawn: Rows) -> Rows:
    """Return Table 3.1 beside what is drawn, its third cup also as if nothing were correlated."""
    rows: dict[str, Sequence[float] | float] = {}
    for solution, u in all_solutions().items():
        name = f"solution {solution}, t"
        for cup, norm in enumerate(u.norms, 1):
            rows |= {f"{name}{cup}": norm, f"{name}{cup}, Monte Carlo": drawn[f"{name}{cup}"]}
        per_axis = np.sqrt(np.diag(u.covariance)).reshape(3, 3)
        per_axis[2] = u.third_as_printed
        alone = f"{name}3 as if nothing were correlated"
        for at, along in zip((f"{name}1", f"{name}2", alone), per_axis.tolist(), strict=True):
            rows |= {f"{at}, along {letter}": value for letter, value in zip("xyz", along, strict=True)}
        rows[alone] = float(np.linalg.norm(u.third_as_printed))
    return rows


def _accuracy() -> dict[str, float]:
    """Return what Table 3.1 means in micrometres."""
    worst = max(norm for u in all_solutions().values() for norm in u.norms)
    radius = max(radius for u in all_solutions().values() for radius in u.radii)
    of_designs = [max(cup_uncertainty(solution, design).norms) for design, solution in hexapod.assemblies()]
    rng = np.random.default_rng(0)
    d = np.repeat([hexapod.DEVICE.base, hexapod.DEVICE.tool, hexapod.DEVICE.leg], (3, 3, 6))
    off = [
        max(cup_uncertainty(solution, lengths=d + rng.uniform(-1.0, 1.0, 12) * hexapod.DEVICE.reach).norms)
        / max(cup_uncertainty(solution).norms)
        - 1.0
        for solution in hexapod.SOLUTIONS
        for _ in range(25)
    ]
    return {
        "standard deviation": worst * hexapod.DEVICE.sigma * 1e6,
        "at 95 %": radius * hexapod.DEVICE.sigma * 1e6,
        "standard deviation, best of all designs": min(of_designs) * hexapod.DEVICE.sigma * 1e6,
        "standard deviation, worst of all designs": max(of_designs) * hexapod.DEVICE.sigma * 1e6,
        "largest change by lengths 1 mm off [%]": 100.0 * float(np.abs(off).max()),
        "lengths to cups and back, largest difference [mm]": 1e3 * _round_trip(),
    }


def _round_trip() -> float:
    rng = np.random.default_rng(0)
    base, tool, legs = (
        nominal + rng.uniform(-1.0, 1.0, (count, 100)) * hexapod.DEVICE.reach
        for nominal, count in ((hexapod.DEVICE.base, 3), (hexapod.DEVICE.tool, 3), (hexapod.DEVICE.leg, 6))
    )
    feet = hexapod.triangle(base, "B")
    return max(
        float(
            np.abs(
                hexapod.leg_lengths(design, feet, hexapod.tool_cups(design, solution, base, tool, legs)) - legs
            ).max()
        )
        for design, solution in hexapod.assemblies()
    )


def _one(robot: Robot, plan: Reachable, seed: Seed, trials: int, places: bool) -> tuple[Figures, None]:
    """Return what the device makes of a session, of a tool that is attached anew, and of poses measured repeatedly."""
    rng = seed.generator()
    twin = Twin(robot)
    joints = np.array([row.joints for row in plan.rows])
    fixtures = set_up(twin, touched(robot, PLACE), ballbar(rng))
    true = _cups(twin, joints, plain_frame(fixtures.base_cups))
    drift = _DRIFT / (6 * len(joints))

    def errors(drifting: float, *, initialise: bool = True, changer: ToolChanger | None = None) -> Array:
        bar = ballbar(rng, drift=drifting)
        found = measure_poses(twin, fixtures, plan.rows, joints, bar, initialise=initialise, changer=changer)
        return np.asarray(np.linalg.norm(found - true, axis=2))

    sessions = {
        "a bar that does not drift": errors(0.0),
        "put on its calibrator before each pose": errors(drift),
        "never put on its calibrator": errors(drift, initialise=False),
    }
    changed = 1e3 * errors(0.0, changer=ToolChanger(rng))
    chosen = rng.choice(len(joints), 4, replace=False)
    rows = [plan.rows[row] for row in chosen for _ in range(_REPEATED)]
    bar = ballbar(rng)
    repeated = measure_poses(twin, fixtures, rows, np.repeat(joints[chosen], _REPEATED, axis=0), bar)
    repeated = repeated.reshape(4, _REPEATED, 3, 3)
    attaching = ToolChanger(rng)
    attached = [_cups(attaching.attached(twin), joints[:1], IDENTITY)[0] for _ in range(_ATTACHED)]
    figures: Figures = {"monte carlo": {}, "drift": {}, "changer": {}, "repeated": {}}
    for solution in hexapod.SOLUTIONS:
        deviations = enumerate(cup_monte_carlo(solution, trials, rng), 1)
        figures["monte carlo"] |= {f"solution {solution}, t{cup}": deviation for cup, deviation in deviations}
    place, turn = _flange(trials, rng)
    figures["accuracy"] = {
        "flange, standard deviation of its place": 1e6 * place,
        "flange, standard deviation of its turn [urad]": 1e6 * turn,
    }
    for words, norms in sessions.items():
        figures["drift"] |= {f"{words}: mean": 1e6 * float(norms.mean()), f"{words}: largest": 1e6 * float(norms.max())}
    for cup in range(3):
        apart = max(float(np.linalg.norm(a[cup] - b[cup])) for a, b in combinations(attached, 2))
        figures["changer"][f"T{cup + 1}, largest difference between {_ATTACHED} attachments"] = 1e3 * apart
        figures["repeated"][f"T{cup + 1}"] = 1e6 * max(repeatability(of[:, cup]) for of in repeated)
    figures["changer"] |= {
        "attached anew before every pose: mean error of the cups": float(changed.mean()),
        "attached anew before every pose: largest": float(changed.max()),
    }
    figures["repeated"]["flange"] = 1e6 * max(repeatability(rigid_motion(hexapod.CUPS, of)[1]) for of in repeated)
    if places:
        figures["fourth"] = {_gain_of(name): _gain(name, rng) for name in _ROBOTS}
    return figures, None


def _cups(twin: Twin, joints: Array, frame: Transform) -> Array:
    """Return the true cups in a frame of the twin's world [m], ``(n, 3, 3)``."""
    names = [target.name for target in twin.robot.targets]
    at = [twin.target_frames(reading) for reading in joints]
    world = np.array([[frames[name][:3, 3] for name in names] for frames in at])
    return np.asarray((world - np.array(frame.translation)) @ frame.rotation)


def _flange(trials: int, rng: np.random.Generator) -> tuple[float, float]:
    """Return the standard deviation of the flange's place [m] and of its turn [rad], each over all axes together.

    Worst of the document's solutions, for its design and its tool.
    """
    worst = np.zeros(2)
    for pose in (p for p in hexapod.poses() if p.design.name == "112212331"):
        lengths = np.repeat([hexapod.DEVICE.base, hexapod.DEVICE.tool, hexapod.DEVICE.leg], (3, 3, 6))[:, None]
        d = lengths + hexapod.DEVICE.sigma * rng.standard_normal((12, trials // 10))
        cups = hexapod.tool_cups(pose.design, pose.solution, d[:3], d[3:6], d[6:])
        R, p = rigid_motion(hexapod.CUPS, np.moveaxis(cups, -1, 0))
        turned = np.swapaxes(R, 1, 2) @ pose.rotation
        small = np.array([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]])
        worst = np.maximum(worst, [math.sqrt(p.var(axis=0).sum()), math.sqrt(small.var(axis=1).sum())])
    return float(worst[0]), float(worst[1])


def _gain(name: str, rng: np.random.Generator) -> float:
    """Return how many times as many configurations a robot reaches with the fourth cup, at a place drawn for it."""
    robot, cups = with_cups(load_robot(name))
    wanted = hexapod.poses(cups)
    place = fixture_at((_ROBOTS[name][1], rng.uniform(-0.1, 0.1), rng.uniform(0.1, 0.3)), rng.uniform(-180.0, 180.0))
    cups_of_four = four_cups(np.full(3, hexapod.DEVICE.base), np.full(3, hexapod.DEVICE.base))
    counts = [_reached(robot, placed(place, frame), wanted) for frame in side_frames(cups_of_four)]
    return sum(counts) / counts[0]


def _reached(robot: Robot, place: Transform, wanted: Sequence[hexapod.HexapodPose]) -> int:
    try:
        return len(reachable(robot, place, wanted).rows)
    except InputError:  # a side of the tetrahedron may face away from the robot
        return 0


def _poses_figure(found: Sequence[hexapod.HexapodPose]) -> Figure:
    """Draw the 72 poses, the superfluous ones apart."""
    kept = {pose.number for pose in hexapod.distinct(found)}
    groups = [
        (name, colour, [pose for pose in found if (pose.number in kept) == inside])
        for name, colour, inside in (("kept", AFTER, True), ("superfluous", BEFORE, False))
    ]
    return poses_figure(groups)


def _distances_figure(found: Sequence[hexapod.HexapodPose]) -> Figure:
    """Draw angle and distance between all pairs of poses."""
    near = set(hexapod.near_equal(found))
    pairs = list(combinations(found, 2))
    apart = np.array([hexapod.distance(a, b) for a, b in pairs]) * [np.degrees(1.0), 1e3]
    is_near = np.array([(a.number, b.number) in near for a, b in pairs])
    traces = []
    for name, colour, mask in (("pairs", AFTER, ~is_near), ("near-equal pairs", "#b3261e", is_near)):
        points, counts = np.unique(np.round(apart[mask], 2), axis=0, return_counts=True)
        x, y = rounded(points[:, 1], 6), rounded(points[:, 0], 6)
        said = {
            "text": [f"{count} pairs" for count in counts.tolist()],
            "hovertemplate": "%{x} mm, %{y} deg: %{text}<extra></extra>",
        }
        traces.append(scatter(name, "markers", x, y, **said, marker={"color": colour, "size": 5}))
    return figure(traces, 380, xaxis=axis("distance of the flanges [mm]"), yaxis=axis("angle between them [deg]"))
