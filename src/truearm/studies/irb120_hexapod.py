"""Nubiola, sections 2.6.3 and 3.5: an IRB 120 judged, and calibrated, with one ballbar."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.library import load_robot
from truearm.measurement.hexapod.geometry import DEVICE, triangle
from truearm.measurement.hexapod.kinematics import leg_lengths
from truearm.measurement.hexapod.poses import poses
from truearm.measurement.hexapod.world_frame import plain_frame, world_frame
from truearm.measurement.statistics import Spread, errors_of
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform, rigid_motion
from truearm.planning.hexapod.reachable import Reachable, reachable
from truearm.planning.hexapod.tool import with_cups
from truearm.simulation.hexapod.session import SetUp, measure_poses, set_up
from truearm.simulation.hexapod.simulated import ballbar
from truearm.simulation.twin import Twin
from truearm.studies.hexapod_figures import reached_poses
from truearm.studies.hexapod_place import PLACE, touched
from truearm.studies.irb120_placements import Ways, ways, ways_tables
from truearm.studies.irb120_sphere import TRACKER, Spheres, sphere_pictures, sphere_tables, spheres
from truearm.studies.irb120_worn import calibrated, in_base, in_region, tracked, worn_twin
from truearm.studies.parallel_axes import without_beta
from truearm.studies.study import Row, Study, Table
from truearm.validation.pose_accuracy import PoseErrors, pose_errors, repeatability

_TRAINING: Final = 38
_UNSEEN: Final = 300
#: What the tool was turned by, about axis 6, between calibration and test: size and side are chosen for the orientation
#: and the mean leg length of Table 3.2.
_SLIPPED: Final = math.radians(0.300)
#: Wider than the ballbar's, so that what is beyond its range can be counted.
_WIDE: Final = replace(DEVICE, reach=3e-3)
#: Section 3.5: what the document's bar reads about nominal [m].
_RANGE: Final = (-0.975e-3, 1.025e-3)
#: Section 3.5: poses with the arm, poses and repetitions for repeatability.
_BY_ARM: Final = 15
_POSES: Final = 4
_REPEATED: Final = 5
#: Deviation of a coordinate that the measurement arm reads: invented, a FaroArm Platinum states about this [m].
_ARM: Final = 0.015e-3
#: What a joint does not repeat from one side [rad]: it makes ABB's 0.010 mm.
_JOINT: Final = 6e-6
#: Tables 3.2 and 3.3: smallest, largest, mean [mm and deg].
_TABLE_3_2: Final[Mapping[str, tuple[float, float, float]]] = {
    "flange, position": (0.115, 0.916, 0.319),
    "flange, orientation": (0.263, 0.512, 0.333),
    "T1": (0.127, 0.785, 0.283),
    "T2": (0.298, 0.958, 0.643),
    "T3": (0.602, 1.107, 0.834),
}
_TABLE_3_3: Final[Mapping[str, tuple[float, float, float]]] = {
    "flange, position": (0.128, 0.454, 0.246),
    "flange, orientation": (0.261, 0.369, 0.331),
    "T1": (0.152, 0.444, 0.256),
    "T2": (0.373, 1.105, 0.720),
    "T3": (0.526, 1.160, 0.980),
}
_LEGS: Final = (-0.452, 1.025, 0.220)
#: Section 3.5: multidirectional repeatability of T1, T2, T3 and the flange [mm].
_REPEATABILITY: Final = (0.036, 0.041, 0.043, 0.021)


@dataclass(frozen=True, eq=False)
class _Run:
    """One seed: errors [m], lengths minus nominal [m] ``(rows, 6)``, repeatability [m] by whether joints come freely.

    `both` and `one` are the repeatability of T1, T2, T3 and the flange, coming from both sides and from one.
    """

    tracker: Spread
    session: PoseErrors
    straight: PoseErrors
    legs: Array
    arm: PoseErrors
    both: tuple[float, ...]
    one: tuple[float, ...]
    spheres: Spheres
    ways: Ways


def study(seeds: int, progress: Callable[[str], None], unseen: int = _UNSEEN, coarser: int = 1) -> Study:
    """Run the study.

    Parameters
    ----------
    seeds
        How many: of configurations, noise, gears and lag.
    progress
        Called with a few words at each step.
    unseen
        Configurations to judge calibrations by.
    coarser
        Only every so many-th of the readings on the sphere, and of those of the sessions that are compared.
    """
    nominal, cups = with_cups(load_robot("irb120"))
    plan = reachable(nominal, PLACE, poses(cups), branches=("front-up",))
    runs = []
    for seed in range(seeds):
        progress(f"seed {seed + 1} of {seeds}")
        runs.append(_run(np.random.default_rng(seed), unseen, coarser))
    mean = {name: 1e3 * float(np.median([r.ways.everywhere[name].mean() for r in runs])) for name in runs[0].ways.near}
    near = {name: 1e3 * float(np.median([r.ways.near[name].mean() for r in runs])) for name in runs[0].ways.near}
    tracker = next(iter(mean))
    return Study(
        name="irb120-hexapod",
        title="An ABB IRB 120 and one ballbar",
        source="A. Nubiola, doctoral thesis, ETS Montreal, sections 2.6.3 and 3.5: Tables 2.12, 2.13, 3.2 and 3.3,"
        " Figures 2.13 to 2.16 and 3.10",
        answer="The spread on the sphere is that of the document. The errors of Table 3.2 are those of a tool turned"
        f" by {math.degrees(_SLIPPED):.1f} deg about axis 6, many times what the tool changer does not repeat."
        f" Calibrated with the device from one place, the robot errs by {mean['one place']:.2f} mm everywhere and"
        f" {near['one place']:.2f} mm near the fixture; from three places by {mean['three places']:.2f} mm, with a"
        f" fourth cup by {mean['four cups']:.2f} mm; from a tracker's readings by {mean[tracker]:.2f} mm and"
        f" {near[tracker]:.2f} mm near the fixture.",
        seeds=seeds,
        tables=(
            _reach(plan),
            _calibration(runs),
            _pose_table(
                "Errors in 39 configurations (Table 3.2)",
                "The calibrated robot, months later: its tool has been turned.",
                [run.session for run in runs],
                _TABLE_3_2,
                "Table 3.2",
            ),
            _legs(runs),
            _pose_table(
                "Errors in 15 poses that look up (Table 3.3)",
                "Read by a measurement arm in the frame of the base cups.",
                [run.arm for run in runs],
                _TABLE_3_3,
                "Table 3.3",
            ),
            _repeatability_table(runs),
            *sphere_tables([run.spheres for run in runs]),
            *ways_tables([run.ways for run in runs]),
        ),
        pictures=(reached_poses(poses(cups), plan.rows), *sphere_pictures(runs[0].spheres)),
        notes=(
            "The twin has the errors of Tables 2.6 and 2.7. Its gears also run out by sines once and twice a turn, axis"
            " 3 leans to the side, and joints lag behind by the backlash of Table 2.3. Size of the first two is chosen"
            " so that the document's model leaves about what it left on the real robot; single seeds differ much.",
            "Tables 2.12 to 3.3 use the document's model, without beta; the calibrations compared at the end have it.",
            "The place of the fixture, the ball, the paths on the sphere and the nests of the spatial artefact are"
            " invented: none is printed.",
            "Lag is suppressed where the document suppresses it, in the calibration by tracker or C-Track. On the"
            " sphere and with the device joints come from either side, unless a row says otherwise.",
            "In the last two tables the robot is driven by the model of the tracker, so that all poses are in range; an"
            " uncalibrated robot needs two steps.",
        ),
    )


def _run(rng: np.random.Generator, unseen: int, coarser: int) -> _Run:
    twin = worn_twin(rng)
    told = load_robot("irb120").with_payload(twin.robot.payload)
    read = tracked(twin, in_region(_TRAINING, rng), TRACKER, rng)
    truth = tracked(twin, in_region(unseen, rng), 0.0, rng)
    model = calibrated(without_beta(told), read)
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
    straight = measure_poses(twin, before, rows, plan, wide, approach=approach)
    legs = [
        leg_lengths(row.design, triangle(fixtures.base, "B"), at) - DEVICE.leg
        for row, at in zip(rows, reached, strict=True)
    ]
    chosen = rng.choice(len(rows), _POSES, replace=False)
    again = [rows[n] for n in chosen for _ in range(_REPEATED)]
    joints = np.repeat(plan[chosen], _REPEATED, axis=0)

    def repeated(directions: Array) -> tuple[float, ...]:
        stopped = joints + _JOINT * rng.standard_normal(joints.shape)
        found = measure_poses(twin, before, again, stopped, wide, approach=directions)
        return _repeatability(found.reshape(_POSES, _REPEATED, 3, 3), cups)

    beta = in_base(calibrated(told, read))
    _, cups_of_beta = with_cups(beta)
    return _Run(
        tracker=Spread.of(errors_of(model, truth).position_norms),
        session=pose_errors(cups, asked, reached),
        straight=pose_errors(cups, asked, straight),
        legs=np.array(legs),
        arm=_by_arm(later, drive, frame, fixtures, cups, rng),
        both=repeated(rng.choice([-1.0, 1.0], joints.shape)),
        one=repeated(np.ones(joints.shape)),
        spheres=spheres(twin, model, rng, coarser),
        ways=ways(twin, told, beta, poses(cups_of_beta), rows, read, truth, rng, coarser),
    )


def _predicted(robot: Robot, joints: Array) -> Array:
    """Return where a model says the cups are [m], ``(n, 3, 3)``."""
    return np.stack([robot.world_poses(joints, target.name)[0] for target in robot.targets], axis=1)


def _in(frame: Transform, points: Array) -> Array:
    return np.asarray((points - np.array(frame.translation)) @ frame.rotation)


def _by_arm(
    twin: Twin, drive: Robot, frame: Transform, fixtures: SetUp, cups: Array, rng: np.random.Generator
) -> PoseErrors:
    """Return the errors of poses that look up, read by a measurement arm from the base cups."""
    q = in_region(4000, rng)
    up = q[drive.world_poses(q)[1][:, 2, 2] > 0.5][:_BY_ARM]
    approach = rng.choice([-1.0, 1.0], up.shape)
    names = [target.name for target in twin.robot.targets]
    frames = [posture.targets for posture in twin.postures(up, approach=approach)]
    true = np.array([[at[name][:3, 3] for name in names] for at in frames])
    noise = _ARM * rng.standard_normal((_BY_ARM + 1, 3, 3))
    seen = plain_frame(fixtures.base_cups + noise[-1])
    return pose_errors(cups, _in(frame, _predicted(drive, up)), _in(seen, true + noise[:-1]))


def _repeatability(found: Array, cups: Array) -> tuple[float, ...]:
    """Return the largest repeatability over poses of T1, T2, T3 and the flange [m]; `found` is (poses, times, 3, 3)."""
    flange = [rigid_motion(cups, places)[1] for places in found]
    points = [list(found[:, :, cup]) for cup in range(3)]
    return tuple(max(repeatability(places) for places in each) for each in [*points, flange])


# -- tables ------------------------------------------------------------------------------------------------


def _reach(plan: Reachable) -> Table:
    times = Counter(row.pose for row in plan.rows)
    twice = sum(count == 2 for count in times.values())
    return Table(
        "What the robot reaches (Figure 3.10)",
        "The nominal robot, its elbow up. The place is invented and was chosen to give these counts: the document's is"
        ' not printed, "almost arbitrarily" chosen. With a flat fixture before the robot it is 40 to 60 poses.',
        (
            Row("poses", "", [plan.poses_reached], 22, "section 3.5"),
            Row("poses with two wrist configurations", "", [twice], 17, "section 3.5"),
            Row("configurations", "", [len(plan.rows)], 39, "section 3.5"),
            Row("room between arm and bars", "mm", [1e3 * float(plan.clearance.min())]),
        ),
    )


def _calibration(runs: list[_Run]) -> Table:
    return Table(
        "After the calibration by tracker (section 2.6.2.1)",
        f"The document's model from {_TRAINING} configurations, on unseen ones.",
        (
            Row(
                "mean",
                "mm",
                [1e3 * run.tracker.mean for run in runs],
                0.146,
                "section 2.6.2.1",
                relative=0.25,
                explanation="Gears and the lean of axis 3 were chosen for this.",
            ),
            Row("maximum", "mm", [1e3 * run.tracker.max for run in runs], 0.500, "section 2.7", relative=0.25),
        ),
    )


def _pose_table(
    title: str, words: str, found: list[PoseErrors], printed: Mapping[str, tuple[float, float, float]], source: str
) -> Table:
    rows = []
    for name, (least, most, mean) in printed.items():
        unit = "deg" if name == "flange, orientation" else "mm"
        values = [_of(errors, name) for errors in found]
        explanation = {
            "flange, orientation": "Chosen for its mean in Table 3.2. T1 lies on axis 6, T2 120 mm and T3 150 mm from"
            " it, and the printed errors grow in this proportion: the tool was turned about axis 6. The tool changer"
            " alone, 0.100 mm at T3, makes 0.04 deg.",
            "flange, position": "The document blames the tool changer and the months since the calibration. What a"
            " turn about axis 6 does not move must have another cause, such as joint zeros that crept; the twin has"
            " none of it.",
        }.get(name, "")
        rows.append(
            Row(
                f"{name}: mean",
                unit,
                [float(v.mean()) for v in values],
                mean,
                source,
                relative=0.25,
                explanation=explanation,
            )
        )
        rows.append(Row(f"{name}: smallest", unit, [float(v.min()) for v in values], least, source, relative=0.5))
        rows.append(Row(f"{name}: largest", unit, [float(v.max()) for v in values], most, source, relative=0.35))
    return Table(title, words, tuple(rows))


def _of(errors: PoseErrors, name: str) -> Array:
    if name == "flange, position":
        return 1e3 * errors.position
    if name == "flange, orientation":
        return np.degrees(errors.orientation)
    return 1e3 * errors.points[:, int(name[1]) - 1]


def _legs(runs: list[_Run]) -> Table:
    least, most, mean = _LEGS
    return Table(
        "Leg lengths in these configurations (Table 3.2)",
        "Measured minus nominal. The robot without the turned tool is below.",
        (
            Row(
                "smallest",
                "mm",
                [1e3 * float(run.legs.min()) for run in runs],
                least,
                "Table 3.2",
                relative=0.3,
                explanation="The -0.975 mm of the text is the lower end of the bar's range, not a leg.",
            ),
            Row("largest", "mm", [1e3 * float(run.legs.max()) for run in runs], most, "Table 3.2", relative=0.3),
            Row("mean", "mm", [1e3 * float(run.legs.mean()) for run in runs], mean, "Table 3.2", absolute=0.1),
            Row(
                "mean size",
                "mm",
                [1e3 * float(np.abs(run.legs).mean()) for run in runs],
                mean,
                "Table 3.2",
                relative=0.3,
                explanation="Should the printed mean be that of the sizes.",
            ),
            Row(
                "legs beyond the range of the bar",
                "",
                [int(((run.legs < _RANGE[0]) | (run.legs > _RANGE[1])).sum()) for run in runs],
                1,
                "section 3.5",
                absolute=2.0,
                explanation="Of 234, beyond -0.975 to 1.025 mm; the document has one that reached the limit.",
            ),
            *(
                Row(f"without the turn, {name}: mean", unit, [float(_of(run.straight, name).mean()) for run in runs])
                for name, unit in (
                    ("flange, position", "mm"),
                    ("flange, orientation", "deg"),
                    ("T1", "mm"),
                    ("T2", "mm"),
                    ("T3", "mm"),
                )
            ),
        ),
    )


def _repeatability_table(runs: list[_Run]) -> Table:
    rows = []
    for n, (name, printed) in enumerate(zip(("T1", "T2", "T3", "flange"), _REPEATABILITY, strict=True)):
        rows.append(
            Row(
                f"{name}, joints come from either side",
                "mm",
                [1e3 * run.both[n] for run in runs],
                printed,
                "section 3.5",
                relative=0.35,
                explanation="Every joint comes from either side by chance and lags by the backlash of Table 2.3, which"
                " is the document's own, measured on circles of 0.12 to 0.23 m. A quarter of it would do. How the"
                " document came to its four poses is not said; most joints may have come from one side."
                if n == 0
                else "",
            )
        )
    rows += [
        Row(f"{name}, all joints from below", "mm", [1e3 * run.one[n] for run in runs])
        for n, name in enumerate(("T1", "T2", "T3"))
    ]
    rows.append(
        Row(
            "flange, all joints from below",
            "mm",
            [1e3 * run.one[3] for run in runs],
            0.010,
            "section 3.5 (ABB)",
            relative=0.5,
            explanation="What the joints do not repeat was chosen for this.",
        )
    )
    return Table(
        "Repeatability (section 3.5)",
        f"Largest of {_POSES} poses with {_REPEATED} repetitions each, measured with the device.",
        tuple(rows),
    )
