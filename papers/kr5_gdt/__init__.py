"""KR5 paper: joint errors of a KUKA KR 5 from circles, its tolerances, and lines before and after compensation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from papers import Progress
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import Rows, told
from papers.traces import scatter
from truearm.axis_circles.fit import NORMAL_95, AxisFit, axis_circles, fit_axes
from truearm.engine.data.dataset import Dataset
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, rounded_to
from truearm.engine.fit.problem import Redundancy
from truearm.engine.motion.cube import DIRECTIONS, SevenLines, seven_lines, usable_joints
from truearm.engine.robot.chain import Array
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.twin import Twin, measure
from truearm.validation.lines import LineErrors, fake_targets, on_twin, reduction
from truearm.validation.tolerances import tolerance_of

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
_TABLE_3: Final = (
    (-0.0331, 0.0218, -0.3702, -0.7174, -0.0005),
    (0.1813, 0.0068, -0.4168, 0.3069, 0.0014),
    (-0.0069, 0.0034, 0.9521, 0.5143, 0.0001),
    (-0.0295, 0.0031, 0.3414, -0.2313, 0.0002),
    (-0.0198, 0.0361, 0.4848, 0.3526, 0.0004),
    (-0.0129, 0.0772, -0.4767, -0.4767, 0.0007),
)
#: Table 4: perpendicularity or parallelism [mm].
_TABLE_4: Final = (0.0346, 0.1742, 0.0013, 0.0145, 0.0086, 0.0164)
#: A reflector on the jig's corner, invented: the document does not say where it was [m].
_REFLECTOR: Final = (0.068, 0.05, 0.03)
#: Of a coordinate of one position, tracker and repeatability together [m].
_NOISE: Final = 0.02e-3
#: Middle and size of the box, and repetitions; the middle is invented [m].
_CENTRE: Final = (0.85, 0.0, 0.6)
_SIZE: Final = (0.6, 0.8, 0.4)
_REPEATS: Final = 30
#: How much larger errors are drawn.
_LARGER: Final = 50

#: Of one seed: the lines before and after compensation, and how far the model is from the twin on them [m].
_Drawn = tuple[LineErrors, LineErrors, Array]


def study(seeds: int, progress: Progress, repetitions: int = 1000) -> Study:
    """Turn joints, find their errors, drive the lines, once a seed.

    Args:
        seeds: How many: of the noise.
        progress: Called with a few words at each step.
        repetitions: How often circles are measured anew to count what lies in its interval.
    """
    nominal = converted(load_robot("kr5"), "joint-errors")
    twin = Twin(nominal.with_values(_true_errors()).with_frames(IDENTITY, {"reflector": _REFLECTOR}))
    progress("turning joints")
    perfect = measure(twin, _configurations(), 0.0, np.random.default_rng(0))
    exact = fit_axes(nominal, axis_circles(perfect).circles, ("geometry",))
    lines = seven_lines(_CENTRE, _SIZE)
    joints = lines.joints(nominal)
    progress("driving lines")
    one = partial(_one, nominal, twin, perfect, lines, joints)
    tables, drawn = gathered(over_seeds(seeds, progress, one))
    progress(f"measuring {repetitions} times")
    inside = 100.0 * _inside(nominal, perfect, exact, repetitions).mean(axis=0)
    sums, truth = {}, _true_errors()
    for p in exact.free.parameters:
        total = sum(w * _scale(p.unit) * truth[n] for n, w in exact.combination(p.name).items())
        sums[_words(exact, p.name)] = f"{total:.4f}"
    counted: dict[str, Rows] = {
        "intervals": {_words(exact, n): float(s) for n, s in zip(exact.free.names, inside, strict=True)},
        "determined": {**_determined(nominal), "from circles": len(exact.free.names)},
        "tolerances": _tolerances(),
    }
    figures = {"circles": _circles_figure(nominal), "model": _model_figure(drawn[0]), "lines": _lines_figure(drawn[0])}
    texts: dict[str, object] = {"repetitions": repetitions, "least": inside.min(), "most": inside.max()}
    texts |= {"worst": min(min(tables["reductions"][d]) for d in DIRECTIONS)}
    texts |= {"unseen": "; ".join(r.combination for r in exact.redundancies), "moving": ", ".join(exact.moving_flange)}
    texts |= {"larger": _LARGER, "noise": _NOISE * 1e3, "repeats": _REPEATS}
    return told(__file__, seeds, {**tables, **counted}, figures, texts, printed={"errors": sums})


def _scale(unit: str) -> float:
    """Return what 1 m is in mm, or 1 rad in deg."""
    return 1e3 if unit == "m" else math.degrees(1.0)


def _words(fit: AxisFit, name: str) -> str:
    """Return what an error found is, in words: sums with factors of one."""
    members = {n: w for n, w in fit.combination(name).items() if abs(w) > 0.02}
    return "".join(f" {'-' if w < 0 else '+'} {n}" for n, w in members.items()).removeprefix(" + ")


def _determined(nominal: Robot) -> dict[str, float]:
    """Return how many of the errors poses of the flange determine, and how many its positions."""
    names = [n for n, p in nominal.parameters.items() if p.group == "geometry"]
    q = nominal.random_configurations(40, np.random.default_rng(0))
    position, orientation = (
        part.reshape(len(names), -1).T for part in nominal.jacobians(nominal.forward_kinematics(q), q, names)
    )
    seen = {"poses": np.concatenate([position, orientation]), "positions": position}
    return {f"from {of} of the flange": int(np.linalg.matrix_rank(rows, tol=1e-9)) for of, rows in seen.items()}


def _tolerances() -> dict[str, float]:
    rows = {}
    for number, ((ebeta, egamma, *_), delta) in enumerate(zip(_TABLE_3, _TABLE_4, strict=True), 1):
        lean = tolerance_of(math.radians(ebeta), math.radians(egamma), 1.0).delta
        rows[f"joint {number}, lean of a hole 100 mm deep"] = 100.0 * lean
        rows[f"joint {number}, depth that Table 4 implies"] = delta / lean
    return rows


def _true_errors() -> dict[str, float]:
    """Return the errors of Table 3 by parameter [rad, m]."""
    values: dict[str, float] = {}
    for number, (ebeta, egamma, *slides) in enumerate(_TABLE_3, 1):
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


def _found(
    nominal: Robot, perfect: Dataset, rng: np.random.Generator, known: Sequence[Redundancy] | None = None
) -> AxisFit:
    """Return the joint errors found from noisy positions."""
    position = perfect.position + rng.normal(0.0, _NOISE, perfect.position.shape)
    noisy = replace(perfect, position=position, sigma=np.full(len(position), _NOISE))
    return fit_axes(nominal, axis_circles(noisy).circles, ("geometry",), known)


def _one(
    nominal: Robot, twin: Twin, perfect: Dataset, lines: SevenLines, joints: Array, seed: Seed
) -> tuple[Figures, _Drawn]:
    rng = seed.generator()
    fit = _found(nominal, perfect, rng)
    commanded = usable_joints(fake_targets(fit.robot, joints).solutions, lines.labels, "line test")
    before = on_twin(lines, twin, joints, _NOISE, _REPEATS, rng)
    after = on_twin(lines, twin, commanded, _NOISE, _REPEATS, rng)
    apart = np.linalg.norm(fit.robot.world_poses(joints)[0] - twin.robot.world_poses(joints)[0], axis=1)
    units = {"m": "mm", "rad": "deg"}
    figures = {
        "errors": {
            f"{_words(fit, p.name)} [{units[p.unit]}]": _scale(p.unit) * fit.robot.values[p.name]
            for p in fit.free.parameters
        },
        "before": {"largest of all seven lines": 1e3 * max(before.largest(d) for d in DIRECTIONS)}
        | {f"{d}, largest": 1e3 * before.largest(d) for d in DIRECTIONS},
        "reductions": {d: reduction(before, after, d) for d in DIRECTIONS}
        | {f"{d}, largest error left [mm]": 1e3 * after.largest(d) for d in DIRECTIONS},
        "models": {d: 1e3 * float(apart[lines.rows(d)].max()) for d in DIRECTIONS},
    }
    return figures, (before, after, np.asarray(apart))


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


def _lines_figure(first: _Drawn) -> Figure:
    traces = [
        scatter(
            name,
            "markers",
            list(errors.lines.labels),
            rounded_to(1e3 * errors.error, 4),
            marker={"color": colour, "size": 6},
            hovertemplate=f"%{{x}}, {name}: %{{y:.4f}} mm<extra></extra>",
        )
        for name, errors, colour in (("uncompensated", first[0], BEFORE), ("compensated", first[1], AFTER))
    ]
    across = axis("pose") | {"tickvals": [f"{d}-1" for d in DIRECTIONS], "ticktext": list(DIRECTIONS)}
    return figure(traces, 380, xaxis=across, yaxis=axis("error [mm], logarithmic") | {"type": "log"})


def _circles_figure(nominal: Robot) -> Figure:
    """Draw where the reflector is while joint 2 turns, by the nominal robot and by a twin with larger errors."""
    low, high, _, posture = _RUNS[2]
    joints = np.tile(np.radians(posture), (60, 1))
    joints[:, 1] = np.radians(np.linspace(low, high, 60))
    errors = {name: _LARGER * value for name, value in _true_errors().items()}
    robot = nominal.with_frames(IDENTITY, {"reflector": _REFLECTOR})
    traces = []
    for name, of, colour, mode in (
        ("nominal, C1", robot, BEFORE, "lines"),
        (f"{_LARGER} times off, C2", robot.with_values(errors), AFTER, "markers"),
    ):
        y, z = (rounded_to(1e3 * of.world_poses(joints, "reflector")[0][:, k], 3) for k in (1, 2))
        traces.append(
            scatter(name, mode, y, z, line={"color": colour, "width": 2}, marker={"color": colour, "size": 5})
        )
    return figure(traces, 420, xaxis=axis("y [mm]"), yaxis=axis("z [mm]") | {"scaleanchor": "x"})


def _model_figure(first: _Drawn) -> Figure:
    before, _, apart = first
    traces = []
    for direction in DIRECTIONS:
        along = apart[before.lines.rows(direction)]
        traces.append(
            scatter(
                direction,
                "lines+markers",
                list(range(1, len(along) + 1)),
                rounded_to(1e3 * along, 5),
                marker={"size": 4},
                hovertemplate=f"{direction}, pose %{{x}}: %{{y:.4f}} mm<extra></extra>",
            )
        )
    return figure(traces, 380, xaxis=axis("pose on the line"), yaxis=axis("difference [mm]") | {"rangemode": "tozero"})
