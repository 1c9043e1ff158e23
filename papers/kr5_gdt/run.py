"""The KR 5 of the study kr5-gdt: its joint errors found from circles, and lines before and after compensation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from papers import Progress
from papers.seeds import Seed, over_seeds
from truearm.axis_circles.fit import NORMAL_95, AxisFit, axis_circles, fit_axes
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.problem import Redundancy
from truearm.engine.motion.cube import SevenLines, seven_lines, usable_joints
from truearm.engine.robot.chain import Array
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.twin import Twin, measure
from truearm.validation.lines import LineErrors, fake_targets, on_twin

#: Table 2: lowest and highest position, step [deg], and the posture of the others.
_RUNS: Final[Mapping[int, tuple[int, int, int, tuple[float, ...]]]] = {
    1: (-54, 126, 9, (0, 0, 0, 0, 0, 0)),
    2: (-160, -24, 8, (-90, 0, 0, 0, 0, 0)),
    3: (0, 140, 7, (90, -90, 0, 0, 0, 0)),
    4: (-180, 180, 18, (0, -90, 90, 0, 0, 0)),
    5: (-108, 108, 12, (90, -90, 90, 0, 0, 0)),
    6: (-180, 180, 18, (0, -90, 90, 0, 0, 0)),
}
#: Table 3: ebeta, egamma [deg], ex, ey, ez [mm] of each joint.
TABLE_3: Final = (
    (-0.0331, 0.0218, -0.3702, -0.7174, -0.0005),
    (0.1813, 0.0068, -0.4168, 0.3069, 0.0014),
    (-0.0069, 0.0034, 0.9521, 0.5143, 0.0001),
    (-0.0295, 0.0031, 0.3414, -0.2313, 0.0002),
    (-0.0198, 0.0361, 0.4848, 0.3526, 0.0004),
    (-0.0129, 0.0772, -0.4767, -0.4767, 0.0007),
)
#: A reflector on the jig's corner, invented: the document does not say where it was [m].
_REFLECTOR: Final = (0.068, 0.05, 0.03)
#: Of a coordinate of one position, tracker and repeatability together [m].
NOISE: Final = 0.02e-3
#: Middle and size of the box, and repetitions; the middle is invented [m].
_CENTRE: Final = (0.85, 0.0, 0.6)
_SIZE: Final = (0.6, 0.8, 0.4)
REPEATS: Final = 30
#: How much larger errors are drawn.
LARGER: Final = 50


@dataclass(frozen=True, eq=False)
class Outcome:
    """What one seed gives."""

    fit: AxisFit  #: The joint errors found.
    before: LineErrors  #: before, after: the lines without compensation, and with it.
    after: LineErrors
    model: Array  #: How far the model is from the twin on the lines [m], ``(poses,)``.


@dataclass(frozen=True, eq=False)
class Run:
    """The whole study."""

    exact: AxisFit  #: The joint errors found without noise.
    #: from_poses, from_positions: how many of the errors the flange's poses determine, and its positions.
    from_poses: int
    from_positions: int
    outcomes: tuple[Outcome, ...]  #: Of the seeds.
    inside: Array  #: In how many repetitions each error found lies within its interval [%], ``(errors,)``.
    #: Where the reflector is while joint 2 turns [m], ``(n, 3)`` each: by the nominal robot, and by the twin with
    #: errors :data:`LARGER` times as large.
    circles: tuple[Array, Array]


def run(seeds: int, progress: Progress, repetitions: int) -> Run:
    """Turn joints, find their errors, drive the lines, once a seed.

    Args:
        seeds: How many: of the noise.
        progress: Called with a few words at each step.
        repetitions: How often circles are measured anew to count what lies in its interval.
    """
    nominal = converted(load_robot("kr5"), "joint-errors")
    twin = Twin(nominal.with_values(true_errors()).with_frames(IDENTITY, {"reflector": _REFLECTOR}))
    progress("turning joints")
    perfect = measure(twin, _configurations(), 0.0, np.random.default_rng(0))
    exact = fit_axes(nominal, axis_circles(perfect).circles, ("geometry",))
    lines = seven_lines(_CENTRE, _SIZE)
    joints = lines.joints(nominal)
    progress("driving lines")
    outcomes = over_seeds(seeds, progress, partial(_one, nominal, twin, perfect, lines, joints))
    progress(f"measuring {repetitions} times")
    inside = 100.0 * _inside(nominal, perfect, exact, repetitions).mean(axis=0)
    return Run(exact, *_determined(nominal), outcomes, inside, _circles(nominal))


def _determined(nominal: Robot) -> tuple[int, int]:
    """Return how many of the errors poses of the flange determine, and how many its positions."""
    names = [n for n, p in nominal.parameters.items() if p.group == "geometry"]
    q = nominal.random_configurations(40, np.random.default_rng(0))
    position, orientation = (
        part.reshape(len(names), -1).T for part in nominal.jacobians(nominal.forward_kinematics(q), q, names)
    )
    both = np.concatenate([position, orientation])
    return int(np.linalg.matrix_rank(both, tol=1e-9)), int(np.linalg.matrix_rank(position, tol=1e-9))


def true_errors() -> dict[str, float]:
    """Return the errors of Table 3 by parameter [rad, m]."""
    values: dict[str, float] = {}
    for number, (ebeta, egamma, *slides) in enumerate(TABLE_3, 1):
        values |= {f"ebeta_{number}": math.radians(ebeta), f"egamma_{number}": math.radians(egamma)}
        values |= {f"{name}_{number}": v / 1e3 for name, v in zip(("ex", "ey", "ez"), slides, strict=True)}
    return values


def _configurations() -> Array:
    rows = []
    for number, (low, high, step, posture) in _RUNS.items():
        forward = np.arange(low, high + 1, step)
        run = np.tile(posture, (2 * len(forward), 1)).astype(float)
        run[:, number - 1] = np.concatenate([forward, forward[::-1]])
        rows.append(run)
    return np.asarray(np.radians(np.concatenate(rows)))


def _circles(nominal: Robot) -> tuple[Array, Array]:
    low, high, _, posture = _RUNS[2]
    joints = np.tile(np.radians(posture), (60, 1))
    joints[:, 1] = np.radians(np.linspace(low, high, 60))
    errors = {name: LARGER * value for name, value in true_errors().items()}
    robot = nominal.with_frames(IDENTITY, {"reflector": _REFLECTOR})
    there, off = (one.world_poses(joints, "reflector")[0] for one in (robot, robot.with_values(errors)))
    return there, off


def _found(
    nominal: Robot, perfect: Dataset, rng: np.random.Generator, known: Sequence[Redundancy] | None = None
) -> AxisFit:
    """Return the joint errors found from noisy positions."""
    position = perfect.position + rng.normal(0.0, NOISE, perfect.position.shape)
    noisy = replace(perfect, position=position, sigma=np.full(len(position), NOISE))
    return fit_axes(nominal, axis_circles(noisy).circles, ("geometry",), known)


def _one(nominal: Robot, twin: Twin, perfect: Dataset, lines: SevenLines, joints: Array, seed: Seed) -> Outcome:
    rng = seed.generator()
    fit = _found(nominal, perfect, rng)
    commanded = usable_joints(fake_targets(fit.robot, joints).solutions, lines.labels, "line test")
    before = on_twin(lines, twin, joints, NOISE, REPEATS, rng)
    after = on_twin(lines, twin, commanded, NOISE, REPEATS, rng)
    apart = fit.robot.world_poses(joints)[0] - twin.robot.world_poses(joints)[0]
    return Outcome(fit, before, after, np.asarray(np.linalg.norm(apart, axis=1)))


def _inside(nominal: Robot, perfect: Dataset, exact: AxisFit, repetitions: int) -> Array:
    """Return for each repetition whether each error found lies within its interval ``(repetitions, errors)``."""
    names = exact.free.names
    true = np.array([exact.robot.values[name] for name in names])
    made = []
    for seed in range(repetitions):
        fit = _found(nominal, perfect, np.random.default_rng([1, seed]), exact.redundancies)
        value = np.array([p.value for p in fit.free.parameters])
        deviation = np.array([p.deviation or 0.0 for p in fit.free.parameters])
        made.append(np.abs(value - true) <= NORMAL_95 * deviation)
    return np.array(made, float)
