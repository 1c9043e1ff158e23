"""Nubiola, sections 2.6.3 and 3.5: a worn IRB 120 judged, and calibrated, with one ballbar."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from papers import Progress
from papers.hexapod_place import PLACE, poses_figure, touched
from papers.irb120 import REGION, without_beta
from papers.irb120_hexapod.spheres import TRACKER, spheres
from papers.irb120_hexapod.ways import TURNS, Bench, ways
from papers.irb120_hexapod.worn import calibrated, in_base, tracked, worn_twin
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import Rows, told
from papers.traces import scatter
from truearm.engine.data.hexapod import DEVICE, leg_lengths, poses, triangle
from truearm.engine.data.statistics import Spread, errors_of
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, rounded_to
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rigid_motion
from truearm.engine.twin.twin import Twin
from truearm.hexapod.places import plain_frame, world_frame
from truearm.hexapod.reachable import Reachable, reachable, with_cups
from truearm.hexapod.rehearsal import SetUp, ballbar, measure_poses, set_up
from truearm.validation.pose_accuracy import PoseErrors, pose_errors, repeatability

_TRAINING: Final = 38
#: What the tool was turned by, about axis 6, between calibration and test: size and side are chosen for the orientation
#: and the mean leg length of Table 3.2.
_SLIPPED: Final = math.radians(0.300)
#: Wider than the ballbar's, so that what is beyond its range can be counted.
_WIDE: Final = replace(DEVICE, reach=3e-3)
#: Section 3.5: poses with the arm, poses and repetitions for repeatability.
_BY_ARM: Final = 15
_POSES: Final = 4
_REPEATED: Final = 5
#: Deviation of a coordinate that the measurement arm reads: invented, a FaroArm Platinum states about this [m].
_ARM: Final = 0.015e-3
#: What a joint does not repeat from one side [rad]: it makes ABB's 0.010 mm.
_JOINT: Final = 6e-6
#: Section 3.5: what the document's bar reads about nominal [m].
_RANGE: Final = (-0.975e-3, 1.025e-3)
#: Of the sphere: distances that the bar misses [m], by nest and model.
_Missed = Mapping[tuple[str, str], Array]


def study(seeds: int, progress: Progress, unseen: int = 300, coarser: int = 1) -> Study:
    """Calibrate and judge the robot, once a seed.

    Args:
        seeds: How many: of configurations, noise, gears and lag.
        progress: Called with a few words at each step.
        unseen: Configurations to judge calibrations by.
        coarser: Only every so many-th of the readings on the sphere, and of those of the sessions that are compared.
    """
    nominal, cups = with_cups(load_robot("irb120"))
    designed = poses(cups)
    plan = reachable(nominal, PLACE, designed, branches=("front-up",))
    found, missed = gathered(over_seeds(seeds, progress, partial(_one, unseen=unseen, coarser=coarser)))
    counts = {name: int(np.median(of)) for name, of in found.pop("configurations").items()}
    tables: dict[str, Rows] = {**found, "reach": _reach(plan)}
    means: dict[str, dict[str, float]] = {}
    for table in ("everywhere", "near"):
        rows: dict[str, Sequence[float]] = {}
        for name, count in counts.items():
            words = f"{name}, {count} configurations" if name == "tracker" else f"{name} ({count} configurations)"
            rows |= {f"{words}: {what}": found[table][f"{name}: {what}"] for what in ("mean", "maximum")}
            means.setdefault(table, {})[name] = float(np.median(rows[f"{words}: mean"]))
        tables[table] = rows
    taken = {row.pose for row in plan.rows}
    reached = poses_figure([("reached", AFTER, [pose for pose in designed if pose.number in taken])])
    figures = {
        "reached": reached,
        "sphere": _sphere_figure(missed[0], "12", {"laser tracker": AFTER, "C-Track": BEFORE}),
        "spatial": _sphere_figure(missed[0], "13", {"C-Track, spatial": BEFORE}),
    }
    texts: dict[str, object] = {"slipped": math.degrees(_SLIPPED), "all": means["everywhere"], "close": means["near"]}
    texts |= {"n": counts, "turns": TURNS, "training": _TRAINING, "poses": _POSES, "repeated": _REPEATED}
    return told(__file__, seeds, tables, figures, texts)


def _reach(plan: Reachable) -> dict[str, float]:
    times = Counter(row.pose for row in plan.rows)
    return {
        "poses": plan.poses_reached,
        "poses with two wrist configurations": sum(count == 2 for count in times.values()),
        "configurations": len(plan.rows),
        "room between arm and bars [mm]": 1e3 * float(plan.clearance.min()),
    }


def _one(seed: Seed, unseen: int, coarser: int) -> tuple[Figures, _Missed]:
    rng = seed.generator()
    twin = worn_twin(rng)
    nominal = load_robot("irb120").with_payload(twin.robot.payload)
    read = tracked(twin, REGION.draw(_TRAINING, rng), TRACKER, rng)
    truth = tracked(twin, REGION.draw(unseen, rng), 0.0, rng)
    model = calibrated(without_beta(nominal), read)
    drive, cups = with_cups(in_base(model))
    wanted = poses(cups)
    rows = reachable(drive, PLACE, wanted, branches=("front-up",)).rows
    plan = np.array([row.joints for row in rows])
    approach = rng.choice([-1.0, 1.0], plan.shape)
    slipped = {"theta_offset_6": twin.robot.values["theta_offset_6"] + _SLIPPED}
    later = replace(twin, robot=twin.robot.with_values(slipped))
    touches = touched(drive, PLACE)
    frame = world_frame(drive.world_poses(touches, "1")[0], np.full(3, DEVICE.base)).plain
    wide = ballbar(rng, _WIDE)
    fixtures = set_up(later, touches, wide)
    reached = measure_poses(later, fixtures, rows, plan, wide, approach=approach)
    asked = _in(frame, _predicted(drive, plan))
    before = set_up(twin, touches, wide)
    unturned = measure_poses(twin, before, rows, plan, wide, approach=approach)
    base = triangle(fixtures.base, "B")
    legs = np.array([leg_lengths(row.design, base, at) - DEVICE.leg for row, at in zip(rows, reached, strict=True)])
    chosen = rng.choice(len(rows), _POSES, replace=False)
    again = [rows[n] for n in chosen for _ in range(_REPEATED)]
    joints = np.repeat(plan[chosen], _REPEATED, axis=0)

    def repeated(directions: Array, on: Twin = twin, draws: np.random.Generator = rng) -> dict[str, float]:
        stopped = joints + _JOINT * draws.standard_normal(joints.shape)
        found = measure_poses(on, before, again, stopped, ballbar(draws, _WIDE), approach=directions)
        return _repeatability(found.reshape(_POSES, _REPEATED, 3, 3), cups)

    beta = in_base(calibrated(nominal, read))
    _, cups_of_beta = with_cups(beta)
    left = Spread.of(errors_of(model, truth).position_norms)
    without_turn = {
        f"without the turn, {part}: mean [{unit}]": float(errors.mean())
        for (part, unit), errors in _parts(pose_errors(cups, asked, unturned)).items()
    }
    figures: Figures = {
        "calibration": {"mean": 1e3 * left.mean, "maximum": 1e3 * left.max},
        "session": _of_poses(pose_errors(cups, asked, reached)),
        "legs": {
            "smallest": 1e3 * float(legs.min()),
            "largest": 1e3 * float(legs.max()),
            "mean": 1e3 * float(legs.mean()),
            "mean size": 1e3 * float(np.abs(legs).mean()),
            "legs beyond the range of the bar []": int(((legs < _RANGE[0]) | (legs > _RANGE[1])).sum()),
            **without_turn,
        },
        "arm": _of_poses(_by_arm(later, drive, frame, fixtures, cups, rng)),
    }
    sides, below = rng.choice([-1.0, 1.0], joints.shape), np.ones(joints.shape)
    ways_there = {
        "joints come from either side": repeated(sides),
        "all joints from below": repeated(below),
        **_explained(partial(repeated, draws=rng.spawn(1)[0]), twin, plan[chosen], sides),
    }
    figures["repeatability"] = {
        f"{name}, {way}": 1e3 * at for way, found in ways_there.items() for name, at in found.items()
    }
    of_spheres, missed = spheres(twin, model, rng, coarser)
    figures |= of_spheres
    figures |= ways(Bench(twin, nominal, beta, poses(cups_of_beta), rng, coarser), rows, read, truth)
    return figures, missed


def _explained(
    repeated: Callable[..., dict[str, float]], twin: Twin, poses_in_turn: Array, sides: Array
) -> dict[str, dict[str, float]]:
    """Return the repeatability if other joints come from either side, or lag less.

    Args:
        repeated: Measures poses repeatedly, by the sides from which joints come, and by the twin.
        twin: The robot.
        poses_in_turn: Joint positions of the poses ``(poses, joints)`` [rad].
        sides: By chance, ``(poses * times, joints)``.
    """
    in_turn = np.sign(poses_in_turn - np.roll(poses_in_turn, 1, axis=0))
    wrist, first = np.ones(sides.shape), np.ones(sides.shape)
    wrist[:, [3, 5]], first[:, 0] = sides[:, [3, 5]], sides[:, 0]
    joints = {number: replace(joint, hysteresis=joint.hysteresis / 5) for number, joint in twin.joints.items()}
    return {
        "joints 4 and 6 come from either side": repeated(wrist),
        "joint 1 comes from either side": repeated(first),
        "each pose always from the one before": repeated(np.repeat(in_turn, _REPEATED, axis=0)),
        "a fifth of the backlash, joints come from either side": repeated(sides, replace(twin, joints=joints)),
    }


def _parts(errors: PoseErrors) -> dict[tuple[str, str], Array]:
    """Return what of poses errs, by name and unit."""
    return {
        ("flange, position", "mm"): 1e3 * errors.position,
        ("flange, orientation", "deg"): np.degrees(errors.orientation),
        **{(f"T{number}", "mm"): 1e3 * errors.points[:, number - 1] for number in (1, 2, 3)},
    }


def _of_poses(errors: PoseErrors) -> dict[str, float]:
    return {
        f"{part}: {name} [{unit}]": float(statistic(values))
        for (part, unit), values in _parts(errors).items()
        for name, statistic in (("mean", np.mean), ("smallest", np.min), ("largest", np.max))
    }


def _predicted(robot: Robot, joints: Array) -> Array:
    """Return where a model says the cups are [m], ``(n, 3, 3)``."""
    return np.stack([robot.world_poses(joints, target.name)[0] for target in robot.targets], axis=1)


def _in(frame: Transform, points: Array) -> Array:
    return np.asarray((points - np.array(frame.translation)) @ frame.rotation)


def _by_arm(
    twin: Twin, drive: Robot, frame: Transform, fixtures: SetUp, cups: Array, rng: np.random.Generator
) -> PoseErrors:
    """Return the errors of poses that look up, read by a measurement arm from the base cups."""
    q = REGION.draw(4000, rng)
    up = q[drive.world_poses(q)[1][:, 2, 2] > 0.5][:_BY_ARM]
    approach = rng.choice([-1.0, 1.0], up.shape)
    names = [target.name for target in twin.robot.targets]
    frames = [posture.targets for posture in twin.postures(up, approach=approach)]
    true = np.array([[at[name][:3, 3] for name in names] for at in frames])
    noise = _ARM * rng.standard_normal((_BY_ARM + 1, 3, 3))
    seen = plain_frame(fixtures.base_cups + noise[-1])
    return pose_errors(cups, _in(frame, _predicted(drive, up)), _in(seen, true + noise[:-1]))


def _repeatability(found: Array, cups: Array) -> dict[str, float]:
    """Return the largest repeatability over poses of T1, T2, T3 and the flange [m]; `found` is (poses, times, 3, 3)."""
    points = {f"T{cup + 1}": list(found[:, :, cup]) for cup in range(3)}
    points["flange"] = [rigid_motion(cups, places)[1] for places in found]
    return {name: max(repeatability(places) for places in each) for name, each in points.items()}


def _sphere_figure(missed: _Missed, nests: str, models: Mapping[str, str]) -> Figure:
    """Draw distance errors, reading after reading and one nest after the other, by model and its colour."""
    traces = []
    for name, colour in models.items():
        errors = np.concatenate([missed[nest, name] for nest in nests])
        said = f"{name}, reading %{{x}}: %{{y:.3f}} mm<extra></extra>"
        x, y, look = list(range(1, len(errors) + 1)), rounded_to(1e3 * errors, 4), {"color": colour, "size": 5}
        traces.append(scatter(name, "markers", x, y, marker=look, hovertemplate=said))
    return figure(traces, 340, xaxis=axis("reading"), yaxis=axis("error [mm]"))
