"""Holds joint curves against the geometric model: on two measured robots, and on twins whose gears and encoders err.

Arguments: which parts (ur5, irb120, twins; all), seeds of each (10), and `auto` for the model with every effect
too. Writes benchmarks/joint_curves.json, part by part. The measured data are found at
TRUEARM_DATA.
"""

from __future__ import annotations

import json
import math
import os
import sys
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.document.tables import standard_error
from truearm.engine.fit.every_effect import identify_every_effect
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import Model, named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure
from truearm.importing.files import read_matrices

OUT = Path(__file__).with_suffix(".json")
DATA = Path(os.environ.get("TRUEARM_DATA", Path(__file__).parents[2] / "shared" / "data"))
CURVE = "joint-curve"
GEOMETRIC = named_model("geometric")
#: What besides compliance and a series of the joints' angles the measured IRB 120 was found to do.
SIX = ("bearing-compliance", "hardening", "warm-up", "transmission-error", "approach")
#: Noises of a coordinate of the twins [m], and the width of the range of joint 2 where it is narrow [rad].
NOISES = (3e-5,)
NARROW = math.radians(60.0)
#: The norm of three normal coordinates is so many deviations, in the mean.
FLOOR = math.sqrt(8.0 / math.pi)
Figures = dict[str, Any]


def mean_error(fit: Fit, data: Dataset) -> tuple[float, float]:
    """Return the mean error [mm] of readings that were held out, and its standard error by configurations."""
    errors = errors_of(fit.robot, data)
    norms = errors.position_norms * 1e3
    return float(norms.mean()), standard_error(norms, data.configuration) or math.nan


def judged(robot: Robot, training: Dataset, parts: dict[str, Dataset], models: dict[str, Model | None]) -> Figures:
    """Return errors and times of some models; None is that with every effect."""
    found: Figures = {}
    for name, model in models.items():
        if model is None and "auto" not in sys.argv[3:]:
            continue
        began = perf_counter()
        fit = identify_every_effect(robot, training)[1] if model is None else identify(robot, training, model)
        effects = list(fit.model.effects)
        found[name] = {"seconds": perf_counter() - began, "status": fit.status.value, "effects": effects}
        found[name] |= {part: mean_error(fit, data) for part, data in parts.items()}
    return found


# -- measured robots -------------------------------------------------------------------------------------


def ur5_data(name: str) -> Dataset:
    """Return measurements of the UR5: the place reached is the one commanded and its error."""
    rows = np.genfromtxt(DATA / "ur5-tracker" / f"{name}.csv", delimiter=",", skip_header=1)
    n = len(rows)
    return Dataset(
        source=name,
        labels=tuple(str(i + 1) for i in range(n)),
        joints=np.radians(rows[:, 7:13]),
        joint_kinds=("revolute",) * 6,
        targets=("1",),
        configuration=np.arange(n),
        target=np.zeros(n, dtype=np.intp),
        position=(rows[:, 1:4] + rows[:, 4:7]) * 1e-3,
        sigma=None,
    )


def ur5(seeds: int) -> list[Figures]:
    """Judge on 300 of the grid, drawn by each seed, and on the 20 random configurations, from the other 700."""
    robot, grid, random = load_robot("ur5"), ur5_data("grid"), ur5_data("random")
    models = {"geometric": GEOMETRIC, CURVE: GEOMETRIC.also([CURVE]), "auto": None}
    found = []
    for seed in range(seeds):
        order = np.random.default_rng(seed).permutation(grid.configurations)
        parts = {"grid": grid.of_configurations(np.sort(order[700:])), "random": random}
        found.append(judged(robot, grid.of_configurations(np.sort(order[:700])), parts, models))
        show(f"ur5, seed {seed}", found[-1])
    return found


def irb120(seeds: int) -> list[Figures]:
    """Judge on the rest of 500 configurations, from 40 and from 300 of them."""
    folder = DATA / "irb120-faro"
    targets = {str(i): folder / f"target_{i}.txt" for i in (1, 2, 3)}
    data, _ = read_matrices(folder / "joints_commanded.txt", targets, {}, "deg", "mm")
    robot = load_robot("irb120").with_payload(Payload(2.7, (0.05, 0.025, 0.1)))
    elastic = named_model("elastic")
    models = {
        "elastic": elastic,
        CURVE: elastic.also([CURVE]),
        "six effects": elastic.also([*SIX, "fourier"]),
        f"six effects, {CURVE}": elastic.also([*SIX, CURVE]),
        "auto": None,
    }
    found = []
    for seed in range(seeds):
        order = np.random.default_rng(seed).permutation(data.configurations)
        made: Figures = {}
        for count in (40, 300):
            parts = {"held out": data.of_configurations(np.sort(order[count:]))}
            made[str(count)] = judged(robot, data.of_configurations(np.sort(order[:count])), parts, models)
            show(f"irb120, {count}, seed {seed}", made[str(count)])
        found.append(made)
    return found


# -- twins -----------------------------------------------------------------------------------------------


def twin_ratios(name: str, truth: str, seed: int, noise: float, width: float | None = None) -> Figures:
    """Return held-out errors of a twin over its floor of noise, from 200 configurations.

    Parameters
    ----------
    width
        Range of joint 2 in the training and, as `inside`, in the judged part [rad]; `outside` is the rest of its range.
    """
    nominal = load_robot(name)
    twin = truth_twin(nominal, truth, np.random.default_rng(1000 + seed))
    rng = np.random.default_rng(seed)
    low, high = nominal.joints[1].limits or (-math.pi, math.pi)
    wide = (max(low, -math.pi), min(high, math.pi))
    middle = sum(wide) / 2.0
    narrow = wide if width is None else (middle - width / 2.0, middle + width / 2.0)

    def configurations(count: int, ends: tuple[float, float]) -> Array:
        drawn = nominal.random_configurations(count, rng)
        drawn[:, 1] = rng.uniform(*ends, count)
        return drawn

    training = measure(twin, configurations(200, narrow), noise, rng)
    parts = {"inside": measure(twin, configurations(500, narrow), noise, rng)}
    if width is not None:
        parts["outside"] = measure(twin, configurations(500, wide), noise, rng)
    models = {"geometric": GEOMETRIC, CURVE: GEOMETRIC.also([CURVE])}
    found = judged(nominal, training, parts, models)
    for figures in found.values():
        for part in parts:
            figures[part] = figures[part][0] / (FLOOR * noise * 1e3)
    return found


def twins(seeds: int) -> Figures:
    """Judge twins of two robots with two kinds of errors, and with a narrow range of joint 2."""
    made: Figures = {}
    for name in ("irb120", "ur5"):
        for truth in ("gear-errors", "tooth-errors"):
            for noise in NOISES:
                case = f"{name}, {truth}, {1e3 * noise:g} mm"
                made[case] = [twin_ratios(name, truth, seed, noise) for seed in range(seeds)]
                show_twins(case, made[case])
        case = f"{name}, gear-errors, {1e3 * NOISES[0]:g} mm, joint 2 within {math.degrees(NARROW):g} deg"
        made[case] = [twin_ratios(name, "gear-errors", seed, NOISES[0], NARROW) for seed in range(seeds)]
        show_twins(case, made[case])
    return made


# -- said and written ------------------------------------------------------------------------------------


def show(what: str, found: Figures) -> None:
    """Print the errors of each model."""
    for name, figures in found.items():
        errors = ", ".join(f"{k} {v[0]:.4f} +- {v[1]:.4f}" for k, v in figures.items() if isinstance(v, tuple))
        sys.stdout.write(f"{what}: {name} {errors} mm, {figures['seconds']:.1f} s, {figures['status']}\n")
    sys.stdout.flush()


def show_twins(case: str, found: list[Figures]) -> None:
    """Print median and largest ratio of each model."""
    for model in found[0]:
        for part in ("inside", "outside"):
            if part in found[0][model]:
                ratios = [one[model][part] for one in found]
                took = np.median([one[model]["seconds"] for one in found])
                text = f"{np.median(ratios):.2f}, worst {max(ratios):.2f} times the noise, {took:.1f} s"
                sys.stdout.write(f"{case}: {model} {part} {text}\n")
    sys.stdout.flush()


def main() -> None:
    """Run the parts that were asked for, and write them beside those that were not."""
    asked = sys.argv[1] if len(sys.argv) > 1 else "all"
    seeds = int(sys.argv[2]) if len(sys.argv) > 2 else 10
    for name, part in (("ur5", ur5), ("irb120", irb120), ("twins", twins)):
        if asked in (name, "all"):
            made = {name: part(seeds)}
            record: Figures = json.loads(OUT.read_text()) if OUT.exists() else {}
            OUT.write_text(json.dumps(record | made, indent=1) + "\n")


if __name__ == "__main__":
    main()
