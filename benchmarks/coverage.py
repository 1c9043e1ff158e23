"""How often the 95 % intervals of calibrations contain the truth. Arguments: calibrations a line, lines (all).

Every calibration is one of :func:`truearm.engine.fit.fit.identify` as it stands, of an IRB 120 of its own:
parameters drawn from their priors, base and targets at random, joints that miss by a repeatability, an instrument with
noise. Counted are parameters that the data inform by half or more, by group, and coordinates of targets predicted at
configurations that the calibration has not seen. One line of JSON a line of the study goes to standard output.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import MODELS
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

SIGMA = 0.02e-3
INFORMED = 0.5
UNSEEN = 20
GEOMETRIC = next(model for model in MODELS if model.name == "geometric")
#: Number of targets, and of configurations that are measured with so many.
CONFIGURATIONS = {1: 60, 3: 60, 40: 35}


@dataclass(frozen=True)
class Line:
    """What is simulated: repeatability [deg], targets, declared sigma, loss, share of outliers, instrument."""

    repeatability: float = 0.0
    targets: int = 3
    declared: bool = True
    loss: Loss = "linear"
    outliers: float = 0.0
    one_sided: bool = False
    ballbar: bool = False


def lines() -> Iterator[Line]:
    """Go through the study."""
    for targets in CONFIGURATIONS:
        for repeatability in (0.0, 0.003, 0.02):
            for declared in (True, False):
                yield Line(repeatability, targets, declared)
    losses: tuple[Loss, ...] = ("huber", "cauchy", "l1")
    for loss in losses:
        for share in (0.0, 0.05, 0.3):
            yield Line(loss=loss, outliers=share)
    yield Line(ballbar=True)
    yield Line(ballbar=True, declared=False)
    for loss in losses:
        yield Line(loss=loss, outliers=0.3, one_sided=True)


def robot_of(nominal: Robot, targets: int, rng: np.random.Generator) -> Robot:
    """Return a robot with parameters from the priors, somewhere, with targets on a tool of 0.2 m."""
    turned = np.array([1.0, *rng.uniform(-0.05, 0.05, 2), rng.uniform(-1.0, 1.0)])
    base = Transform(tuple(rng.uniform(-2, 2, 3).tolist()), tuple((turned / np.linalg.norm(turned)).tolist()))
    places = {
        str(i + 1): tuple((np.array([0.0, 0.0, 0.1]) + rng.uniform(-0.1, 0.1, 3)).tolist()) for i in range(targets)
    }
    placed = nominal.with_frames(base, places)
    drawn = GEOMETRIC.prepared(placed).parameters.values()
    own = [p for p in drawn if p.group in GEOMETRIC.groups]
    return placed.with_values({p.name: p.nominal + p.prior * rng.standard_normal() for p in own})


def measured(true: Robot, line: Line, rng: np.random.Generator) -> Dataset:
    """Return readings of a robot."""
    n = CONFIGURATIONS[line.targets]
    q = true.random_configurations(n, rng)
    at = q + math.radians(line.repeatability) * rng.standard_normal(q.shape)
    positions = np.stack([true.world_poses(at, target.name)[0] for target in true.targets], axis=1)
    if line.ballbar:
        return _distances(true, positions, q, line, rng)
    positions = positions + SIGMA * rng.standard_normal(positions.shape)
    wrong = rng.random(positions.shape[:2]) < line.outliers
    far = rng.standard_normal((*wrong.shape, 3))
    far *= rng.uniform(0.0, 5e-3, wrong.shape)[..., None] / np.linalg.norm(far, axis=2, keepdims=True)
    if line.one_sided:
        far = np.abs(far)
    positions = positions + np.where(wrong[..., None], far, 0.0)
    names = [target.name for target in true.targets]
    return Dataset.of(q, positions, targets=names, sigma=SIGMA if line.declared else None)


def _distances(
    true: Robot, positions: NDArray[np.float64], q: NDArray[np.float64], line: Line, rng: np.random.Generator
) -> Dataset:
    """Return distances from two points beside the robot: a closed loop."""
    base = np.array(true.base.translation)
    points = base + rng.uniform(-0.6, 0.6, (2, 3))
    d = np.linalg.norm(positions[:, :, None, :] - points, axis=3) + SIGMA * rng.standard_normal(
        (*positions.shape[:2], 2)
    )
    n, k = positions.shape[:2]
    return Dataset(
        source="ballbar",
        labels=tuple(str(i + 1) for i in range(n)),
        joints=q,
        joint_kinds=tuple(joint.kind for joint in true.joints),
        targets=tuple(target.name for target in true.targets),
        configuration=np.repeat(np.arange(n), 2 * k),
        target=np.tile(np.repeat(np.arange(k), 2), n),
        position=np.full((2 * n * k, 3), np.nan),
        distance=d.reshape(-1),
        fixtures=("a", "b"),
        fixture=np.tile([0, 1], n * k),
        sigma=np.full(2 * n * k, SIGMA) if line.declared else None,
    )


@dataclass
class Counts:
    """Intervals that contain the truth, and all of them."""

    inside: int = 0
    all: int = 0

    def add(self, apart: NDArray[np.float64], deviation: NDArray[np.float64]) -> None:
        """Count more."""
        self.inside += int(np.sum(np.abs(apart) <= 1.959964 * deviation))
        self.all += apart.size

    @property
    def share(self) -> float | None:
        """Coverage."""
        return round(self.inside / self.all, 4) if self.all else None


def judge(fit: Fit, true: Robot, counts: dict[str, Counts], rng: np.random.Generator, gauged: bool) -> None:
    """Count the intervals of a calibration."""
    for name in fit.free.names:
        p = fit.robot.parameters[name]
        if p.group == "base" and (gauged or p.unit == "rad"):
            continue  # angles of the base are counted from where each robot was placed
        if gauged and p.group not in GEOMETRIC.groups:
            continue
        if p.deviation is None or p.informed is None or p.informed < INFORMED:
            continue
        of = f"{p.group} [{p.unit}]"
        for group in (of, "parameters"):
            apart = np.array([p.value - true.values[name]])
            counts.setdefault(group, Counts()).add(apart, np.array([p.deviation]))
    if gauged:
        return
    q = true.random_configurations(UNSEEN, rng)
    for target in true.targets[:3]:
        kinematics = fit.robot.forward_kinematics(q, target.name)
        J = fit.robot.position_jacobian(kinematics, q, fit.free.names).reshape(len(fit.free.names), -1).T
        apart = kinematics.position.reshape(-1) - true.forward_kinematics(q, target.name).position.reshape(-1)
        deviation = np.sqrt(np.einsum("ij,jk,ik->i", J, fit.covariance, J))
        counts.setdefault("predictions", Counts()).add(apart, deviation)


def study(line: Line, trials: int, seed: int = 2026) -> dict[str, object]:
    """Return the coverage of a line."""
    nominal = load_robot("irb120")
    counts: dict[str, Counts] = {}
    errors, held = [], 0
    for trial in range(trials):
        rng = np.random.default_rng([seed, trial])
        true = robot_of(nominal, line.targets, rng)
        data = measured(true, line, rng)
        fit = identify(nominal, data, GEOMETRIC, loss=line.loss)
        judge(fit, true, counts, rng, line.ballbar)
        kinds = np.array([joint.kind for joint in nominal.joints]) == "revolute"
        errors.append(math.degrees(float(fit.joint_error[kinds].mean())))
        held += fit.status.value == "converged"
    told = {name: c.share for name, c in counts.items()}
    return {**asdict(line), "calibrations": trials, "converged": held, "joint_error": float(np.mean(errors)), **told}


def main() -> None:
    """Run the lines asked for."""
    trials = int(sys.argv[1])
    chosen = [int(k) for k in sys.argv[2:]]
    for number, line in enumerate(lines()):
        if not chosen or number in chosen:
            sys.stdout.write(json.dumps({"line": number, **study(line, trials)}) + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
