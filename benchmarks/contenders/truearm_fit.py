"""truearm: the geometric fit, whole and its solver alone, and a thousand Monte-Carlo calibrations."""

from __future__ import annotations

import numpy as np
from stopwatch import inputs, median_seconds, report

import truearm
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.fit import identify
from truearm.engine.fit.frames import initial_frames
from truearm.engine.fit.models import MODELS
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.solver import solve
from truearm.engine.robot.library import load_robot
from truearm.engine.twin.truths import truth_twin
from truearm.fleets.series import monte_carlo

NOISE = 0.05e-3
nominal = load_robot("irb120")
geometric = next(model for model in MODELS if model.name == "geometric")
figures: dict[str, object] = {}


def dataset(q: np.ndarray, position: np.ndarray) -> Dataset:
    count, targets = position.shape[:2]
    return Dataset(
        source="benchmark",
        labels=tuple(map(str, range(count))),
        joints=q,
        joint_kinds=("revolute",) * 6,
        targets=tuple(str(i + 1) for i in range(targets)),
        configuration=np.tile(np.arange(count), targets),
        target=np.repeat(np.arange(targets), count),
        position=np.swapaxes(position, 0, 1).reshape(-1, 3),
        sigma=np.full(count * targets, NOISE),
    )


for kind in ("simulated", "measured"):
    whole, alone, errors = [], [], []
    for path in sorted(inputs().glob(f"{kind}-*.npz")):
        given = np.load(path)
        data = dataset(given["q"], given["position"])
        whole.append(median_seconds(lambda data=data: identify(nominal, data, geometric), 15))
        start = initial_frames(geometric.prepared(nominal), data)
        problem = Problem(start, data, geometric.free(start), {})
        alone.append(median_seconds(lambda problem=problem: solve(problem), 15))
        robot = identify(nominal, data, geometric).robot
        found = np.stack([robot.world_poses(given["held_out"], t.name)[0] for t in robot.targets], 1)
        errors.append(float(np.linalg.norm(found - given["held_out_position"], axis=2).mean()))
        figures["parameters"] = len(problem.free.names)
    if whole:
        figures[kind] = {"fit": whole, "solver": alone, "held_out": errors}

robot = truth_twin(nominal, "nominal", np.random.default_rng(0)).robot
rng = np.random.default_rng(1)
q, held_out = robot.random_configurations(50, rng), robot.random_configurations(50, rng)
figures["monte_carlo_1000"] = median_seconds(
    lambda: monte_carlo(robot, q, geometric, NOISE, 1000, np.random.default_rng(2), held_out), 3
)
report(figures, {"truearm": truearm.__version__, "numpy": np.__version__})
