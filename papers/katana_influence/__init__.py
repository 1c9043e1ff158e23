"""Patel, sections 3.5 to 3.7: what each parameter does to the tip, and whether identification gains by knowing it.

The Katana is identified pose by pose, and from all poses at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Final, Literal

import numpy as np

from papers import Progress
from papers.katana import robot as arm
from papers.katana.pose_errors import QUANTITIES, least_mean, pose_errors, same_angles, tip_poses, true_poses
from papers.katana.robot import DOCUMENT_NAMES, NAMES, PERTURBATIONS, TIP, UNITS, katana, published
from papers.katana.tilting import TILTING, twin
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import Rows, printed_in, told
from truearm.engine.data.dataset import Dataset
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, rounded
from truearm.engine.motion.cube import Cube
from truearm.engine.motion.largest_cube import POSES, plan_poses
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import Twin, measure
from truearm.simulation.influence_report import influence_figure
from truearm.simulation.influences import (
    Combination,
    Influence,
    influence,
    influence_based,
    least_squares,
    minimum_norm,
)

#: The robots that are calibrated: geometry of Table 3.2 alone, of Table 3.3 alone, of Table 3.2 with joints that tilt.
_TRUTHS: Final = ("Table 3.2", "Table 3.3", "Table 3.2 and tilting joints")
_OnePose = Literal["minimum norm", "influence"]
_ONE_POSE: Final[tuple[_OnePose, ...]] = ("minimum norm", "influence")
#: Methods by name, in words.
_METHODS: Final = {
    "nominal": "before",
    "minimum norm": "minimum norm, pose by pose",
    "influence": "influence-based, pose by pose",
    "least squares": "joint least squares",
}
_COMBINATIONS: Final[Mapping[Combination, str]] = {
    "mean": "mean of the sets",
    "scaled-mean": "mean, scaled to fit best",
    "best-pose": "best single set",
}
#: Whose parameters the document prints, which of our methods stand beside them, and in which table.
_PARAMETERS: Final = {
    ("Table 3.2", "least squares"): "least_squares_3_2",
    ("Table 3.2", "minimum norm"): "minimum_norm_3_2",
    ("Table 3.3", "least squares"): "least_squares_3_3",
    ("Table 3.3", "influence"): "influence_3_3",
}
#: Which methods stand beside the columns of Table 3.4: before, simultaneous, influence-based.
_COLUMNS: Final = {"nominal": "before", "least squares": "simultaneous", "influence": "influence"}
_LENGTHS: Final = ("a_3", "a_4", "d_5", "target_tip_z")
_ANGLES: Final = {"rad": 1.0, "deg": math.radians(1.0)}


def study(seeds: int, progress: Progress, count: int = POSES, unseen: int = 200) -> Study:
    """Calibrate three twins by every method, once a seed.

    Args:
        seeds: How many: of the orientations at the poses, of the unseen configurations and of the noise.
        progress: Called with a few words at each step.
        count: Poses to calibrate with.
        unseen: Configurations to judge by.
    """
    progress("looking for the largest cube")
    cube = arm.workspace_cube()
    one = partial(_one, cube=cube, count=count, unseen=unseen)
    found, influences = gathered(over_seeds(seeds, progress, one))
    methods = found["methods"]

    def left(truth: str, method: str) -> float:
        return float(np.median(methods[f"{truth}: {_METHODS[method]}"]))

    beaten = all(left(truth, "influence") > left(truth, "least squares") for truth in _TRUTHS)
    bent = influence(katana(), np.radians([[0.0, 0.0, 0.0, 80.0, 0.0]]), NAMES, TIP, PERTURBATIONS)
    third = DOCUMENT_NAMES.index("theta 3")
    there = {
        "theta 3, at theta 4 = 80 deg and all others 0": 1e3 * float(bent.mean[third]),
        "theta 4, there": 1e3 * float(bent.mean[third + 1]),
    }
    floors = {
        f"least possible mean |dP|, {name}": least_mean(printed_in(__file__, table))
        for table, name in (("simultaneous", "simultaneous"), ("influence", "influence-based"))
    }
    same = {"|dPhi|, |dTheta| and |dPsi| of Table 4.5 less those of Table 3.4, largest [deg]": same_angles()}
    tables: dict[str, Rows] = {
        **found,
        "influences": {**found["influences"], **there, **found["averages"]},
        "contradictions": {**floors, **found["contradictions"], **same},
    }
    shown = replace(influences[0], names=DOCUMENT_NAMES)
    figures = {"influence": influence_figure(shown), "methods": _methods_figure(left)}
    texts: dict[str, object] = {
        "beats": "does not beat joint least squares on any" if beaten else "beats joint least squares on one"
    }
    texts |= {"count": count, "side": cube.side * 1e3, "noise": arm.NOISE * 1e3}
    return told(__file__, seeds, tables, figures, texts)


def _one(seed: Seed, cube: Cube, count: int, unseen: int) -> tuple[Figures, Influence]:
    rng = seed.generator()
    nominal = katana()
    joints, central = (
        plan_poses(nominal, c, target=TIP, count=count, seed=seed.number).joints for c in (cube, arm.CHAPTER_5_CUBE)
    )
    others = nominal.random_configurations(unseen, rng)
    truths: dict[str, Twin] = {  # in the order in which their noise is drawn
        "Table 3.3": twin(published("influence"), {}),
        "Table 3.2 and tilting joints": twin(published("standard"), TILTING),
        "Table 3.2": twin(published("standard"), {}),
    }
    at_poses: dict[tuple[str, str], Mapping[str, float]] = {}
    left: dict[tuple[str, str], float] = {}
    figures: Figures = {}
    for name, truth in truths.items():
        data = measure(truth, joints, arm.NOISE, rng)
        true, elsewhere = true_poses(truth, joints), true_poses(truth, others)
        found: dict[str, Robot] = {
            "nominal": nominal,
            "minimum norm": _pose_by_pose("minimum norm", nominal, data, "mean"),
            "influence": _pose_by_pose("influence", nominal, data, "mean"),
            "least squares": least_squares(nominal, data, NAMES, TIP),
        }
        for method, robot in found.items():
            errors = pose_errors(tip_poses(robot, joints), true)
            if table := _PARAMETERS.get((name, method)):
                off = arm.deviations(robot.values)
                figures[table] = {f"{p} [mm]" if p[:2] in ("a ", "d ") else p: value for p, value in off.items()}
            at_poses[name, method] = {quantity: float(values.mean()) for quantity, values in errors.items()}
            left[name, method] = float(pose_errors(tip_poses(robot, others), elsewhere)["dP"].mean())
    figures["combinations"] = {}
    for one in _ONE_POSE:  # data and true poses are those of Table 3.2, the last truth
        for combination, words in _COMBINATIONS.items():
            robot = _pose_by_pose(one, nominal, data, combination)
            off_by = float(pose_errors(tip_poses(robot, others), elsewhere)["dP"].mean())
            figures["combinations"][f"{_METHODS[one]}: {words}"] = off_by
    standard, other = (published(table).world_poses(joints, TIP)[0] for table in ("standard", "influence"))
    apart = 1e3 * float(np.linalg.norm(standard - other, axis=1).mean())
    figures["contradictions"] = {"Tables 3.2 and 3.3 predict positions apart by, mean": apart}
    for unit, size in _ANGLES.items():
        change = f"largest change of a length by minimum norm, angles in {unit} and lengths in mm"
        figures["contradictions"][change] = _length_change(nominal, data, size)
    over_poses = influence(nominal, joints, NAMES, TIP, PERTURBATIONS)
    figures |= _influences(over_poses, influence(nominal, central, NAMES, TIP, PERTURBATIONS))
    return figures | _at_poses(at_poses) | {"methods": _side_by_side(left)}, over_poses


def _influences(over_poses: Influence, chapter_5: Influence) -> Figures:
    means = {name: 1e3 * float(mean) for name, mean in zip(DOCUMENT_NAMES, over_poses.mean, strict=True)}
    second, third = (DOCUMENT_NAMES.index(f"theta {i}") for i in (2, 3))
    cube = "theta 2, average in a cube of 250 mm about the circle of chapter 5"
    rows = {
        "theta 2, average": means["theta 2"],
        cube: 1e3 * float(chapter_5.mean[second]),
        "alpha 2 as a share of theta 2 (k8) [%]": 100 * means["alpha 2"] / means["theta 2"],
        "a 3, a 4, d 5, d 6": means["a 3"],
        "theta 2, smallest": 1e3 * float(over_poses.least[second]),
        "theta 3, greatest": 1e3 * float(over_poses.greatest[third]),
    }
    shown = [name for name in means if name != "theta 2" and name.startswith(("theta", "alpha", "beta"))]
    return {"influences": rows, "averages": {f"{name}, average": means[name] for name in shown}}


def _at_poses(found: Mapping[tuple[str, str], Mapping[str, float]]) -> Figures:
    """Return errors at the poses that stand beside the columns of Table 3.4."""
    tilting = _TRUTHS[-1]
    figures = {
        table: {
            f"|{quantity}|, mean [{unit}]": found[tilting, method][quantity] for quantity, unit in QUANTITIES.items()
        }
        for method, table in _COLUMNS.items()
    }
    for truth in _TRUTHS[:-1]:
        figures["before"][f"|dP|, mean, {truth}, joints that do not tilt"] = found[truth, "nominal"]["dP"]
    figures["simultaneous"]["|dP|, mean, by the document's own method"] = found[tilting, "minimum norm"]["dP"]
    return figures


def _side_by_side(left: Mapping[tuple[str, str], float]) -> dict[str, float]:
    rows: dict[str, float] = {}
    for truth in _TRUTHS:
        rows |= {f"{truth}: {words}": left[truth, method] for method, words in _METHODS.items()}
        over = left[truth, "influence"] / left[truth, "least squares"]
        rows[f"{truth}: influence-based over joint least squares [times]"] = over
    share = 100 * left["Table 3.2", "influence"] / left["Table 3.2", "minimum norm"]
    return rows | {"Table 3.2: influence-based over minimum norm [%]": share}


def _pose_by_pose(method: _OnePose, nominal: Robot, data: Dataset, combination: Combination) -> Robot:
    if method == "minimum norm":
        return minimum_norm(nominal, data, NAMES, TIP, combination=combination, units=UNITS).robot
    return influence_based(
        nominal, data, NAMES, TIP, combination=combination, units=UNITS, perturbations=PERTURBATIONS
    ).robot


def _length_change(nominal: Robot, data: Dataset, angle: float) -> float:
    """Return the largest change of a length [mm] if angles are counted in `angle` [rad] and lengths in mm."""
    units = {name: angle * UNITS.get(name, 1.0) for name in NAMES if name not in _LENGTHS}
    found = minimum_norm(nominal, data, NAMES, TIP, units=units).robot
    return 1e3 * max(abs(found.values[name] - nominal.values[name]) for name in _LENGTHS)


def _methods_figure(left: Callable[[str, str], float]) -> Figure:
    """Draw what each method leaves on unseen poses, median over the seeds."""
    traces: list[Figure] = [
        {
            "type": "bar",
            "name": words,
            "x": list(_TRUTHS),
            "y": rounded(np.array([left(truth, method) for truth in _TRUTHS]), 4),
            "marker": {"color": colour, "line": {"width": 0}},
            "hovertemplate": f"%{{x}}, {words}: %{{y}} mm<extra></extra>",
        }
        for (method, words), colour in zip(_METHODS.items(), (BEFORE, "#8a6d1d", "#b3261e", AFTER), strict=True)
    ]
    across = {**axis("the truth"), "type": "category"}
    up = {**axis("mean |dP| on unseen poses [mm]"), "rangemode": "tozero"}
    return figure(traces, 380, xaxis=across, yaxis=up, barmode="group")
