"""Patel, chapter 5: what tilting joints make of a circle, and of what is corrected before it is commanded.

A circle is predicted, corrected and followed by a Katana in one posture a seed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from papers import Progress
from papers.katana.circle import PENCIL, POINTS, RAMP, SPEED, motions, paths
from papers.katana.robot import CHAPTER_5_CUBE, NAMES, NOISE, TIP, katana, published
from papers.katana.tilting import TILTING, tilting_from_inclinometers, twin, with_tilting
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import told
from papers.traces import in_space, scatter, scene
from truearm.compensation.corrected_path import corrected, path_error
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.document.drawing import AFTER, BEFORE, COLOURS, Figure, axis, figure, rounded
from truearm.engine.document.planning_figures import joint_trajectories
from truearm.engine.motion.cell import skeleton
from truearm.engine.motion.joint_motion import JointMotion, joint_motion
from truearm.engine.motion.largest_cube import POSES, plan_poses
from truearm.engine.motion.paths import Circle, Trajectory, timed
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import Twin, measure
from truearm.simulation.influences import least_squares

#: A tenfold speed, to see what motion does [m/s].
_FAST: Final = 1.0
#: Samples of the circle that geometry is identified from.
_SAMPLES: Final = 24
#: What chapter 5 identifies: it takes lengths as perfect (equation 5.11).
_ANGLES: Final = tuple(name for name in NAMES if name not in ("a_3", "a_4", "d_5", "target_tip_z"))
#: Causes of which the largest error is shown, and what motion adds.
_MOVING: Final = ("stiffness alone", "tilting")
#: What a model knows.
_MODELS: Final = ("geometric", "geometric and stiffness", "with tilting")
_RED: Final = "#b3261e"


@dataclass(frozen=True, eq=False)
class _Drawn:
    """One posture of the arm along the circle; distances from the circle are ``(n,)`` [mm]."""

    motion: JointMotion  #: What the nominal robot would have to do.
    distance: Array  #: Along the circle [mm], ``(n,)``.
    loads: Array  #: Force [N] and moment [N m] of the load at every joint, ``(joints, 6, n)``.
    predicted: Mapping[str, Array]  #: By cause.
    before: Array  #: Of the twin without correction.
    followed: Mapping[tuple[str, str], Array]  #: Of the corrected twin, by model and source.


def study(seeds: int, progress: Progress, step: float = 0.05, poses: int = POSES) -> Study:
    """Draw a posture, plan the circle in it, calibrate a twin in three ways, correct, and let the twin follow.

    Args:
        seeds: How many: of the posture in which the arm follows the circle, of the noise, and of the postures for the
            inclinometers.
        progress: Called with a few words at each step.
        step: Time between samples [s].
        poses: How many geometry is identified from, besides the samples of the circle.
    """
    tables, drawn = gathered(over_seeds(seeds, progress, partial(_one, step=step, poses=poses)))
    alone = tables["causes"]["tilting, mean"]
    texts: dict[str, object] = {"least": min(alone), "most": max(alone), "count": poses, "speed": SPEED}
    texts |= {"samples": _SAMPLES}
    return told(__file__, seeds, tables, _figures(drawn[0]), texts)


def _one(seed: Seed, step: float, poses: int) -> tuple[Figures, _Drawn]:
    rng = seed.generator()
    nominal, truth = katana(PENCIL), twin(published("standard", PENCIL))
    circle, line = paths(step)
    motion, on_line = motions(nominal, circle, line, rng)

    causes = _causes()
    predicted = {cause: _norms(path_error(robot, motion, circle.position, TIP)) for cause, robot in causes.items()}
    rows = {f"{cause}, mean": float(errors.mean()) for cause, errors in predicted.items()}
    rows |= {f"{cause}, largest": float(predicted[cause].max()) for cause in _MOVING}
    quick = timed(Circle.through(*POINTS), _FAST, 40 * RAMP, step * SPEED / _FAST)
    quickly = joint_motion(nominal, quick, target=TIP, seed=motion.joints[0])
    for speed, at, path in ((SPEED, motion, circle), (_FAST, quickly, quick)):
        for cause in _MOVING:
            apart = [path_error(causes[cause], m, path.position, TIP) for m in (at, _at_rest(at))]
            rows[f"{cause}, {speed:g} m/s against rest, largest"] = float(_norms(apart[0] - apart[1]).max())

    data = _samples(truth, motion, rng)
    joints = plan_poses(nominal, CHAPTER_5_CUBE, target=TIP, count=poses, seed=seed.number).joints
    elsewhere = measure(truth, joints, NOISE, rng)
    fit = tilting_from_inclinometers(nominal, truth, rng)
    stiff = {name: value for name, value in fit.robot.values.items() if name.startswith("compliance")}
    starts = dict(zip(_MODELS, (nominal, with_tilting(nominal, stiff), fit.robot), strict=True))
    sources = {"circle": (data, _ANGLES), "poses": (elsewhere, NAMES)}
    followed: dict[tuple[str, str], Array] = {}
    after: Figures = {}
    for source, (positions, names) in sources.items():
        robots = {model: least_squares(start, positions, names, TIP) for model, start in starts.items()}
        for model, robot in robots.items():
            followed[model, source] = _corrected_and_followed(robot, truth, motion, circle)
        straight = {m: _corrected_and_followed(robot, truth, on_line, line) for m, robot in robots.items()}
        after[source] = {f"{model}, mean": float(followed[model, source].mean()) for model in robots}
        after[source] |= {f"{m}, on the straight line, mean": float(errors.mean()) for m, errors in straight.items()}
        if source == "circle":
            for model, robot in (("before", nominal), *robots.items()):
                after[source][f"{model}, error at the {poses} poses, mean"] = _error(robot, elsewhere)
    before = _followed(truth, motion.joints, motion, circle)
    perfect = _followed(twin(nominal), motion.joints, motion, circle)
    after["poses"] = {
        "before, mean": float(before.mean()),
        "before, with perfect geometry, mean": float(perfect.mean()),
        **after["poses"],
    }
    figures = {"causes": rows, **after, "rest": _rest(truth, motion, circle, after["poses"]["with tilting, mean"])}
    loads, at_rest = (causes["tilting"].loaded(at.postures()).joint_loads for at in (motion, _at_rest(motion)))
    figures["moments"] = _moments(loads, at_rest)
    return figures, _Drawn(motion, circle.distance * 1e3, loads, predicted, before, followed)


def _rest(truth: Twin, motion: JointMotion, circle: Trajectory, tilting: float) -> dict[str, float]:
    """Return what is left when all tilting is corrected [mm]: told exactly, and without backlash of joint 1."""
    true = published("standard", PENCIL)
    seated = replace(truth, joints={**truth.joints, 1: replace(truth.joints[1], backlash=0.0)})
    without = {name: value for name, value in TILTING.items() if name != "backlash_1"}
    exact = _corrected_and_followed(with_tilting(true, TILTING), truth, motion, circle)
    exact_seated = _corrected_and_followed(with_tilting(true, without), seated, motion, circle)
    return {
        "all tilting, geometry from poses": tilting,
        "model told exactly": float(exact.mean()),
        "joint 1 without backlash, model told exactly": float(exact_seated.mean()),
        "largest distance, joint 1 without backlash, model told exactly": float(exact_seated.max()),
    }


def _moments(loads: Array, at_rest: Array) -> dict[str, float]:
    """Return moments of the load at every joint [N m]; loads are ``(joints, 6, n)``."""
    rows = {}
    for joint, of in enumerate(loads, 1):
        rows[f"joint {joint}, about its axis, largest"] = float(np.abs(of[5]).max())
        rows[f"joint {joint}, across its axis, largest"] = float(np.hypot(of[3], of[4]).max())
    moving = float(np.abs(loads[:, 3:] - at_rest[:, 3:]).max())
    return rows | {f"any joint, {SPEED:g} m/s against rest, largest difference": moving}


def _causes() -> dict[str, Robot]:
    """Return robots whose error has one cause each."""
    nominal = katana(PENCIL)

    def only(*effects: str, gap: float = 1.0) -> Robot:
        known = {n: v * (gap if n.startswith("backlash") else 1.0) for n, v in TILTING.items() if n.startswith(effects)}
        return with_tilting(nominal, known)

    return {
        "stiffness alone": only("compliance"),
        "clearance alone": only("clearance"),
        "backlash alone": only("backlash"),
        "tilting": only("compliance", "clearance", "backlash"),
        "tilting, full gap": only("compliance", "clearance", "backlash", gap=2.0),
        "tilting and geometry of Table 3.2": with_tilting(published("standard", PENCIL), TILTING),
    }


def _samples(truth: Twin, motion: JointMotion, rng: np.random.Generator) -> Dataset:
    """Return positions measured on the way, evenly along the circle."""
    at = np.linspace(0, len(motion.time), _SAMPLES, endpoint=False).astype(int)
    return measure(
        truth, motion.joints[at], NOISE, rng, velocity=motion.velocity[at], acceleration=motion.acceleration[at]
    )


def _at_rest(motion: JointMotion) -> JointMotion:
    return replace(motion, velocity=0 * motion.velocity, acceleration=0 * motion.acceleration)


def _corrected_and_followed(model: Robot, truth: Twin, motion: JointMotion, path: Trajectory) -> Array:
    """Return how far a twin is from the path [mm], ``(n,)``, if a model corrects the joints of a motion."""
    return _followed(truth, corrected(model, motion, path.position, TIP).joints, motion, path)


def _followed(truth: Twin, joints: Array, motion: JointMotion, path: Trajectory) -> Array:
    """Return how far a twin that is commanded these joints in motion is from the path [mm], ``(n,)``."""
    went = truth.postures(joints, velocity=motion.velocity, acceleration=motion.acceleration)
    return _norms(np.array([posture.targets[TIP][:3, 3] for posture in went]) - path.position)


def _error(robot: Robot, data: Dataset) -> float:
    """Return the mean position error [mm]."""
    return 1e3 * float(errors_of(robot, data).position_norms.mean())


def _norms(errors: Array) -> Array:
    return np.asarray(1e3 * np.linalg.norm(errors, axis=1))


def _figures(first: _Drawn) -> dict[str, Figure]:
    """Draw the first seed: arm, joints, moments, and distances from the circle, as Figures 5.6 to 5.12."""
    coloured = list(enumerate((*COLOURS, "#8a6d1d", "#5b3a8c")))
    about = [_curve(first, f"joint {k + 1}", first.loads[k, 5], colour, "N m") for k, colour in coloured]
    across = [
        _curve(first, f"joint {k + 1}, {name}", first.loads[k, row], colour, "N m", dash)
        for k, colour in coloured
        for row, name, dash in ((3, "x", "solid"), (4, "y", "dot"))
    ]
    shown = {"stiffness alone": (AFTER, "solid"), "tilting": (_RED, "solid"), "tilting, full gap": (_RED, "dot")}
    predicted = [_curve(first, cause, first.predicted[cause], c, "mm", dash) for cause, (c, dash) in shown.items()]
    followed = [_curve(first, "before", first.before, BEFORE, "mm")]
    followed += [
        _curve(first, f"{model}, geometry from the {source}", first.followed[model, source], colour, "mm", dash)
        for source, dash in (("poses", "solid"), ("circle", "dot"))
        for model, colour in zip(_MODELS, ("#8a6d1d", _RED, AFTER), strict=True)
    ]
    return {
        "robot": _robot_figure(first),
        "joints": joint_trajectories(first.motion, katana()),
        "about": _along(about, "moment about z [N m]"),
        "across": _along(across, "moment about x and y [N m]", 420),
        "predicted": _along(predicted, "distance from the circle [mm]"),
        "followed": _along(followed, "distance from the circle [mm]", 440),
    }


def _robot_figure(first: _Drawn) -> Figure:
    """Draw arm and circle."""
    robot = katana(PENCIL)
    circle = robot.world_poses(first.motion.joints, TIP)[0]
    start = first.motion.joints[:1]
    arm = np.concatenate([*skeleton(robot, start), robot.world_poses(start, TIP)[0]])
    traces = [
        in_space(
            name,
            mode,
            [rounded(1e3 * points[:, k], 5) for k in range(3)],
            line={"color": colour, "width": width},
            marker={"color": colour, "size": 4},
        )
        for name, points, colour, mode, width in (
            ("circle", circle, _RED, "lines", 4),
            ("arm", arm, AFTER, "lines+markers", 7),
        )
    ]
    camera = {"eye": {"x": 1.9, "y": 2.3, "z": 1.3}, "center": {"z": -0.2}}
    return figure(traces, 460, scene=scene("mm", camera=camera))


def _curve(first: _Drawn, name: str, values: Array, colour: str, unit: str, dash: str = "solid") -> Figure:
    look = {"color": colour, "width": 1.8, "dash": dash}
    said = f"{name}: %{{y:.3g}} {unit} at %{{x:.0f}} mm<extra></extra>"
    return scatter(name, "lines", rounded(first.distance, 5), rounded(values, 5), line=look, hovertemplate=said)


def _along(traces: list[Figure], title: str, height: int = 360) -> Figure:
    return figure(traces, height, xaxis=axis("along the circle [mm]"), yaxis=axis(title))
