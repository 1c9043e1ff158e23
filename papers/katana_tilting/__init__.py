"""Patel, chapter 4: joints that tilt, found by inclinometers first, and what that leaves of the pose errors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Final

import numpy as np

from papers import Progress
from papers.katana.pose_errors import QUANTITIES, Quantity, least_mean, pose_errors, same_angles, tip_poses, true_poses
from papers.katana.robot import NAMES, NOISE, PERTURBATIONS, TIP, UNITS, katana, published, workspace_cube
from papers.katana.tilting import TILTING, compliance, tilting_from_inclinometers, twin, with_tilting
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import Rows, printed_in, told
from papers.traces import histogram
from truearm.engine.document.drawing import AFTER, BEFORE
from truearm.engine.document.planning_figures import pose_cube
from truearm.engine.motion.cube import Cube
from truearm.engine.motion.largest_cube import POSES, PosePlan, plan_poses
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import measure
from truearm.inclinometers.fit import TILTING as EFFECTS
from truearm.inclinometers.fit import TiltingFit
from truearm.simulation.influences import influence_based, least_squares, minimum_norm

_BASE: Final = tuple(f"base_{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz"))
#: What the two-stage calibration shall leave at most of what the conventional one leaves on unseen poses [%].
_ASKED: Final = 15.0
_CONVENTIONAL: Final = "conventional, geometry alone"
_TWO_STAGE: Final = "two-stage, tilting first"
#: The methods of Tables 4.5 and 4.6, by the tables here of their columns.
_COLUMNS: Final = {"before": "before", "conventional": _CONVENTIONAL, "two_stage": _TWO_STAGE}

#: Absolute errors [mm, deg], ``(n,)`` each.
_Errors = Mapping[Quantity, Array]
#: Of one seed: the poses, and position errors at unseen configurations by method [mm].
_Drawn = tuple[PosePlan, Mapping[str, Array]]


def study(seeds: int, progress: Progress, count: int = POSES, unseen: int = 200) -> Study:
    """Calibrate a twin by every method, in one stage and in two, once a seed.

    Args:
        seeds: How many: of the orientations at the poses, of the postures for the inclinometers, of the unseen
            configurations and of the noise.
        progress: Called with a few words at each step.
        count: Poses to calibrate with.
        unseen: Configurations to judge by.
    """
    progress("looking for the largest cube")
    cube = workspace_cube()
    found, drawn = gathered(over_seeds(seeds, progress, partial(_one, cube=cube, count=count, unseen=unseen)))
    within = found["constants"].pop("within")
    stated = {"values within two of their own stated deviations of the truth [%]": 100 * float(np.mean(within))}
    ten: dict[str, list[float]] = {}
    for method in _COLUMNS.values():
        ranks = np.sort([errors[method][:10] for _, errors in drawn], axis=1).T.tolist()
        ten |= {f"{method}, {rank} of 10": values for rank, values in enumerate(ranks, 1)}
    tables: dict[str, Rows] = {
        **found,
        "ten": ten,
        "constants": {**found["constants"], **stated},
        "contradictions": _contradictions(),
    }
    shown = [
        (method, colour, np.concatenate([errors[method] for _, errors in drawn]))
        for method, colour in zip(_COLUMNS.values(), (BEFORE, "#b3261e", AFTER), strict=True)
    ]
    errors_figure = histogram(shown, (1e-3, 3.0), "|dP| [mm]", "configurations", 360, opacity=0.75)
    figures = {"poses": pose_cube(drawn[0][0]), "errors": errors_figure}
    texts: dict[str, object] = {"asked": _ASKED, "unseen_count": unseen, "side": cube.side * 1e3, "noise": NOISE * 1e3}
    return told(__file__, seeds, tables, figures, texts)


def _one(seed: Seed, cube: Cube, count: int, unseen: int) -> tuple[Figures, _Drawn]:
    rng = seed.generator()
    nominal, truth = katana(), twin(published("standard"))
    plan = plan_poses(nominal, cube, target=TIP, count=count, seed=seed.number)
    others = nominal.random_configurations(unseen, rng)
    data = measure(truth, plan.joints, NOISE, rng)
    fit = tilting_from_inclinometers(nominal, truth, rng)
    everything = (*NAMES, *fit.names)
    influence = influence_based(fit.robot, data, NAMES, TIP, units=UNITS, perturbations=PERTURBATIONS)
    found: dict[str, Robot] = {
        "before": nominal,
        _CONVENTIONAL: least_squares(nominal, data, NAMES, TIP),
        "conventional, base free as well": least_squares(nominal, data, (*NAMES, *_BASE), TIP),
        _TWO_STAGE: least_squares(fit.robot, data, NAMES, TIP),
        "all at once, from poses and inclinometers": least_squares(fit.with_priors, data, everything, TIP),
        "all at once, from the poses alone": least_squares(nominal.with_effects(EFFECTS), data, everything, TIP),
        "tilting told exactly, then geometry": least_squares(with_tilting(nominal, TILTING), data, NAMES, TIP),
        "tilting first, then minimum norm pose by pose": minimum_norm(fit.robot, data, NAMES, TIP, units=UNITS).robot,
        "tilting first, then influence-based pose by pose": influence.robot,
    }
    true, elsewhere = true_poses(truth, plan.joints), true_poses(truth, others)
    left = {method: pose_errors(tip_poses(robot, others), elsewhere)["dP"] for method, robot in found.items()}
    means = {method: float(errors.mean()) for method, errors in left.items()}

    def share(method: str) -> float:
        return 100 * (means[method] / means[_CONVENTIONAL])

    figures: Figures = {
        "shares": {
            method: share(method) for method in means if method == _TWO_STAGE or method.startswith("all at once")
        }
        | {"before any calibration": share("before")},
        "unseen": {},
        "methods": means,
        "constants": _constants(fit),
    }
    for table, method in _COLUMNS.items():
        figures[table] = _statistics(pose_errors(tip_poses(found[method], plan.joints), true))
        figures["unseen"] |= {f"{method}, mean": means[method], f"{method}, largest": float(left[method].max())}
    return figures, (plan, left)


def _statistics(errors: _Errors) -> dict[str, float]:
    return {
        f"|{quantity}|, {name} [{QUANTITIES[quantity]}]": float(statistic(of))
        for name, statistic in (("mean", np.mean), ("smallest", np.min), ("largest", np.max))
        for quantity, of in errors.items()
    }


def _constants(fit: TiltingFit) -> dict[str, float]:
    """Return the constants of the first stage, and the share within two stated deviations of the truth."""
    known = {name: p for name, p in fit.robot.parameters.items() if name in TILTING}
    rows = {}
    for effect in ("clearance", "backlash", "compliance"):
        for joint in range(1, 6):
            value = known[f"{effect}_{joint}"].value
            if effect == "compliance":
                rows[f"stiffness, joint {joint} [kgf m/deg]"] = compliance(value)
            else:
                rows[f"{effect}, joint {joint}"] = math.degrees(value)
    within = [abs(p.value - TILTING[name]) <= 2 * (p.deviation or 0.0) for name, p in known.items()]
    return rows | {"within": float(np.mean(within))}


def _contradictions() -> dict[str, float]:
    """Return what follows from the printed figures alone [mm, deg]."""
    rows = {}
    for table, name in zip(_COLUMNS, ("before calibration", "conventional", "with tilting"), strict=True):
        printed = printed_in(__file__, table)
        least = least_mean(printed)
        rows[f"printed mean |dP| less the least possible one, {name}"] = float(printed["|dP|, mean"]) - least
    rows["|dPhi|, |dTheta| and |dPsi| less those of Table 3.4, mean, largest difference [deg]"] = same_angles()
    conventional = printed_in(__file__, "conventional")["|dP|, mean"]
    return rows | {"printed mean |dP| of the conventional calibration, Table 4.5": float(conventional)}
