"""What a Gaussian process on the residuals of a fit would gain on the two measured robots.

The process has a squared exponential kernel on sines and cosines of the joint positions, a length for every joint, one
variance and one noise for the three coordinates of the position; all of them by marginal likelihood from at most 300
training configurations. Gains are of the mean error, by blocks in joint space of the training configurations (8, by
k-means: process and blocks know nothing of each other), and on configurations that were held out. The model is fitted
to all training configurations, so that the blocks leave out the process alone. Argument: robots (both).
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import named_model
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.importing.files import read_matrices

DATA = Path(os.environ.get("TRUEARM_DATA", "../shared/data"))
BLOCKS, MOST = 8, 300
Array = NDArray[np.float64]


def features(joints: Array) -> Array:
    return np.stack([np.sin(joints), np.cos(joints)], axis=2)


def kernel(a: Array, b: Array, logs: Array) -> Array:
    apart = ((a[:, None] - b[None]) ** 2).sum(axis=3)
    return np.asarray(np.exp(2 * logs[0] - 0.5 * (apart @ np.exp(-2 * logs[2:]))))


def hyperparameters(x: Array, y: Array) -> Array:
    """Return logarithms of signal, noise and the length of each joint that make the residuals most likely."""
    apart = ((x[:, None] - x[None]) ** 2).sum(axis=3)
    n, outputs = y.shape

    def cost(logs: Array) -> tuple[float, Array]:
        signal = np.exp(2 * logs[0] - 0.5 * (apart @ np.exp(-2 * logs[2:])))
        factor = cho_factor(signal + np.exp(2 * logs[1]) * np.eye(n), lower=True)
        alpha = cho_solve(factor, y)
        inverse = cho_solve(factor, np.eye(n))
        value = 0.5 * float((y * alpha).sum()) + outputs * float(np.log(np.diag(factor[0])).sum())
        rate = 0.5 * (outputs * inverse - alpha @ alpha.T)
        by = [2 * (rate * signal).sum(), 2 * np.exp(2 * logs[1]) * np.trace(rate)]
        by += [((rate * signal) * apart[:, :, j]).sum() * np.exp(-2 * logs[2 + j]) for j in range(x.shape[1])]
        return value, np.array(by)

    size = np.log(y.std())
    start = np.array([size - 0.5, size - 0.3, *np.zeros(x.shape[1])])
    bounds = [(size - 6, size + 2)] * 2 + [(-3.0, 4.0)] * x.shape[1]
    return np.asarray(minimize(cost, start, jac=True, bounds=bounds, options={"maxiter": 40}).x)


def predicted(x: Array, y: Array, at: Array, logs: Array) -> Array:
    K = kernel(x, x, logs) + np.exp(2 * logs[1]) * np.eye(len(x))
    return np.asarray(kernel(at, x, logs) @ cho_solve(cho_factor(K, lower=True), y))


def gains(before: Array, after: Array, block: NDArray[np.intp]) -> dict[str, float]:
    """Return mean errors [mm], the gain, and its standard error over blocks."""
    gain = np.linalg.norm(before, axis=1) - np.linalg.norm(after, axis=1)
    labels = np.unique(block)
    sums = np.array([(gain[block == b] - gain.mean()).sum() for b in labels])
    error = np.sqrt((sums**2).sum() * len(labels) / max(len(labels) - 1, 1)) / len(gain)
    figures = {"before": np.linalg.norm(before, axis=1).mean(), "after": np.linalg.norm(after, axis=1).mean()}
    return {k: round(1e3 * float(v), 5) for k, v in {**figures, "gain": gain.mean(), "standard_error": error}.items()}


def residuals(robot: object, data: Dataset, targets: int) -> Array:
    """Return the mean error of the targets of each configuration [m], ``(n, 3)``."""
    off = errors_of(robot, data).position_errors  # type: ignore[arg-type]
    found = np.zeros((data.configurations, 3))
    np.add.at(found, data.configuration, off)
    return found / targets


def judged(name: str, robot: object, training: Dataset, others: dict[str, Dataset], model: object) -> dict[str, object]:
    targets = len(training.targets)
    fit = identify(robot, training, model)  # type: ignore[arg-type]
    r, x = residuals(fit.robot, training, targets), features(training.joints)
    some = np.linspace(0, len(x) - 1, min(MOST, len(x))).astype(int)
    logs = hyperparameters(x[some], r[some])
    block = kmeans2(x.reshape(len(x), -1), BLOCKS, seed=0, minit="++")[1].astype(np.intp)
    after = r.copy()
    for b in np.unique(block):
        out = block == b
        after[out] -= predicted(x[~out], r[~out], x[out], logs)
    found: dict[str, object] = {
        "signal_mm": round(1e3 * float(np.exp(logs[0])), 4),
        "noise_mm": round(1e3 * float(np.exp(logs[1])), 4),
        "lengths": np.exp(logs[2:]).round(2).tolist(),
        "blocks": gains(r, after, block),
    }
    for part, data in others.items():
        e = residuals(fit.robot, data, targets)
        made = e - predicted(x, r, features(data.joints), logs)
        found[part] = gains(e, made, np.arange(len(e), dtype=np.intp))
    print(name, json.dumps(found), flush=True)  # noqa: T201
    return found


def ur5_data(name: str) -> Dataset:
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


def main() -> None:
    asked = sys.argv[1:] or ["ur5", "irb120"]
    curve = ["joint-curve"] if "joint-curve" in {effect.name for effect in EFFECTS} else []
    if "ur5" in asked:
        grid, order = ur5_data("grid"), np.random.default_rng(0).permutation(1000)
        parts = {"held out": grid.of_configurations(np.sort(order[700:])), "random": ur5_data("random")}
        training = grid.of_configurations(np.sort(order[:700]))
        for effects in ([], curve) if curve else ([],):
            model = named_model("geometric").also(effects)
            judged(f"ur5 geometric {effects}", load_robot("ur5"), training, parts, model)
    if "irb120" in asked:
        folder = DATA / "irb120-faro"
        read = {str(i): folder / f"target_{i}.txt" for i in (1, 2, 3)}
        data, _ = read_matrices(folder / "joints_commanded.txt", read, {}, "deg", "mm")
        robot = load_robot("irb120").with_payload(Payload(2.7, (0.05, 0.025, 0.1)))
        order = np.random.default_rng(0).permutation(data.configurations)
        training = data.of_configurations(np.sort(order[:300]))
        parts = {"held out": data.of_configurations(np.sort(order[300:]))}
        for effects in ([], curve) if curve else ([],):
            judged(f"irb120 elastic {effects}", robot, training, parts, named_model("elastic").also(effects))


if __name__ == "__main__":
    main()
