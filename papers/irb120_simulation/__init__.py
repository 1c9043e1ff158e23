"""Nubiola, section 2.6: the calibration of an IRB 120 in simulation, without noise and with it.

The twin has the errors of Tables 2.6 and 2.7, or others that are drawn anew.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from papers import Progress
from papers.irb120 import ELASTIC, REGION, without_beta
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import told
from papers.traces import histogram
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import Spread, errors_of
from truearm.engine.document.drawing import AFTER, BEFORE
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import identify
from truearm.engine.fit.rounds import Redundant
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.truths import STATION, truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import JointTruth

_TRAINING: Final = 38  # section 2.5.3
_NOISE: Final = 0.070e-3
_WRONG: Final = 0.10
#: Standard deviations of drawn errors of links 2 to 6 [m, rad]; they leave about 5 mm, as the document forces.
_DRAWN: Final = {"m": 0.20e-3, "rad": math.radians(0.07)}


def study(seeds: int, progress: Progress, unseen: int = 1000) -> Study:
    """Calibrate the robot of each seed in all ways.

    Args:
        seeds: How many: of configurations, noise, wrong masses and drawn errors.
        progress: Called with a few words at each step.
        unseen: Configurations to judge by; 1000 in section 2.6.
    """
    tables, errors = gathered(over_seeds(seeds, progress, partial(_one, unseen=unseen)))
    before, noisy = map(np.concatenate, zip(*errors, strict=True))
    shown = (("nominal, before", BEFORE, before), ("0.070 mm noise, masses 10 % off, after", AFTER, noisy))
    drawn = histogram(shown, (1e-3, 10.0), "position error [mm]", "readings", 340)
    figures = {"errors": drawn}
    texts: dict[str, object] = {"unseen": unseen}
    return told(__file__, seeds, tables, figures, texts)


def _one(seed: Seed, unseen: int) -> tuple[Figures, tuple[Array, Array]]:
    """Return figures of one seed, and the errors before and after the calibration with noise [mm]."""
    rng = seed.generator()
    nominal = load_robot("irb120")
    joints = REGION.draw(_TRAINING, rng)
    others = REGION.draw(unseen, rng)
    published = truth_twin(nominal, "tracker-triangular", rng)
    there = nominal.with_frames(STATION, nominal.tools["triangular"].targets)

    truth = measure(published, others, 0.0, rng)
    clean = measure(published, joints, 0.0, rng)
    before = _errors(there, truth)
    known = _with_payload_of(nominal, published)
    printed = nominal.with_payload(published.robot.payload)

    drawn = _drawn(published, nominal, rng)
    drawn_truth = measure(drawn, others, 0.0, rng)
    drawn_clean = measure(drawn, joints, 0.0, rng)
    drawn_known = _with_payload_of(nominal, drawn)
    parallel = replace(drawn, robot=drawn.robot.with_values({"beta_3": 0.0}))
    clean_parallel, truth_parallel = (measure(parallel, at, 0.0, rng) for at in (joints, others))

    wrong = _wrong(printed, rng)
    readings = _with_noise(clean, _NOISE, rng)
    fitted = identify(wrong, readings, ELASTIC).robot
    noisy = _errors(fitted, truth)

    def largest(spread: Spread) -> float:
        return 1e3 * spread.max

    exact = {
        "before, errors of Tables 2.6 and 2.7": largest(Spread.of(before)),
        "before, errors drawn anew for each seed": largest(Spread.of(_errors(there, drawn_truth))),
        "after, errors of Tables 2.6 and 2.7": largest(_identified(known, clean, truth, "drop")),
        "after, drawn errors": largest(_identified(drawn_known, drawn_clean, drawn_truth, "drop")),
        "after, payload told in the true flange frame": largest(_identified(printed, clean, truth, "drop")),
        "after, drawn errors without beta, d 3 held": largest(
            _identified(without_beta(drawn_known), clean_parallel, truth_parallel, within={"d_3": 0.0})
        ),
        "after, drawn errors with beta, model without": largest(
            _identified(without_beta(drawn_known), drawn_clean, drawn_truth, "drop")
        ),
    }
    against_noise = Spread.of(_errors(fitted, _with_noise(truth, _NOISE, rng)))
    left = {
        "mean": Spread.of(noisy),
        "mean, masses known": _identified(known, readings, truth),
        "mean, no noise": _identified(wrong, clean, truth),
        "mean, one reflector a configuration": _identified(wrong, _one_reflector(readings, rng), truth),
        "mean, if 0.070 mm is the length of the error": _identified(
            wrong, _with_noise(clean, _NOISE / math.sqrt(3), rng), truth
        ),
        "mean against noisy readings": against_noise,
    }
    means = {row: 1e3 * spread.mean for row, spread in left.items()}
    figures = {"exact": exact, "noisy": {"mean": means["mean"], "maximum": largest(left["mean"]), **means}}
    return figures, (before * 1e3, noisy * 1e3)


def _identified(
    robot: Robot,
    training: Dataset,
    truth: Dataset,
    redundancy: Redundant = "prior",
    within: Mapping[str, float] | None = None,
) -> Spread:
    bounds = None
    if within is not None:
        bounds = Bounds.model_validate(
            {"truearm": "truearm-bounds/1", "units": {"length": "mm", "angle": "deg"}, "within": within}
        )
    return Spread.of(_errors(identify(robot, training, ELASTIC, redundancy=redundancy, bounds=bounds).robot, truth))


def _errors(robot: Robot, truth: Dataset) -> Array:
    return errors_of(robot, truth).position_norms


def _with_payload_of(nominal: Robot, twin: Twin) -> Robot:
    """Return the nominal robot with the twin's payload where it is in the flange frame that identification holds.

    Identification drops errors of ``theta_offset_6`` and ``d_6``, which free targets take up. The true flange is
    turned and shifted by them along axis 6, and the payload with it.
    """
    errors = {name: twin.robot.values[name] - nominal.values[name] for name in ("theta_offset_6", "d_6")}
    c, s = math.cos(errors["theta_offset_6"]), math.sin(errors["theta_offset_6"])
    x, y, z = twin.robot.payload.cog
    return nominal.with_payload(Payload(twin.robot.payload.mass, (c * x - s * y, s * x + c * y, z + errors["d_6"])))


def _drawn(twin: Twin, nominal: Robot, rng: np.random.Generator) -> Twin:
    """Return the twin with errors of links 2 to 6 drawn anew, and compliances half to one and a half times its own."""
    values = {
        p.name: p.value + _DRAWN[p.unit] * float(rng.standard_normal())
        for p in nominal.parameters.values()
        if p.group in ("geometry", "joint zero") and not p.name.endswith("_1")
    }
    joints = {number: JointTruth(truth.compliance * rng.uniform(0.5, 1.5)) for number, truth in twin.joints.items()}
    return replace(twin, robot=twin.robot.with_values(values), joints=joints)


def _wrong(robot: Robot, rng: np.random.Generator) -> Robot:
    """Return the robot with every mass and centre of gravity 10 % too large or too small."""

    def off() -> float:
        return 1.0 + _WRONG * float(rng.choice((-1.0, 1.0)))

    def moved(cog: tuple[float, float, float]) -> tuple[float, float, float]:
        factor = off()
        return (cog[0] * factor, cog[1] * factor, cog[2] * factor)

    masses = tuple(replace(mass, mass=mass.mass * off(), cog=moved(mass.cog)) for mass in robot.masses)
    payload = Payload(robot.payload.mass * off(), moved(robot.payload.cog))
    return replace(robot, masses=masses, payload=payload)


def _with_noise(data: Dataset, noise: float, rng: np.random.Generator) -> Dataset:
    position = data.position + rng.normal(0.0, noise, data.position.shape)
    return replace(data, position=position, sigma=np.full(len(position), noise))


def _one_reflector(data: Dataset, rng: np.random.Generator) -> Dataset:
    """Return the data with one reading a configuration, of a target drawn for it."""
    seen = rng.integers(len(data.targets), size=data.configurations)
    missing = data.target != seen[data.configuration]
    return replace(data, position=np.where(missing[:, None], np.nan, data.position))
