"""truearm: the fit of the joints' curves to many configurations; each count in a process of its own, for its memory."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time

import numpy as np
from stopwatch import report

import truearm
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import MODELS
from truearm.engine.robot.library import load_robot

COUNTS, NOISE, POINT = (500, 2500), 0.05e-3, (0.075, 0.0937, 0.215)


def fitted(count: int) -> dict[str, float]:
    """Return the seconds that a fit to so many configurations of one target takes, and the memory of the process."""
    nominal = load_robot("irb120")
    model = next(model for model in MODELS if model.name == "geometric").also(["joint-curve"])
    robot, rng = model.prepared(nominal).with_frames(nominal.base, {"1": POINT}), np.random.default_rng(0)
    errs = {"geometry": 1.0, "joint zero": 1.0, "joint-curve": 0.3}
    true = robot.with_values(
        {
            p.name: p.value + errs[p.group] * p.prior * rng.standard_normal()
            for p in robot.parameters.values()
            if p.group in errs
        }
    )
    q = robot.random_configurations(count, rng)
    data = Dataset(
        source="benchmark",
        labels=tuple(map(str, range(count))),
        joints=q,
        joint_kinds=("revolute",) * 6,
        targets=("1",),
        configuration=np.arange(count),
        target=np.zeros(count, dtype=np.intp),
        position=true.world_poses(q, "1")[0] + NOISE * rng.standard_normal((count, 3)),
        sigma=np.full(count, NOISE),
    )
    start = time.perf_counter()
    free = identify(nominal, data, model).free
    seconds = time.perf_counter() - start
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return {"seconds": seconds, "memory": memory, "parameters": len(free.names)}


if len(sys.argv) == 2:
    print(json.dumps(fitted(int(sys.argv[1]))))  # noqa: T201
else:
    figures: dict[str, object] = {}
    for number in COUNTS:
        command = [sys.executable, __file__, str(number)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        figures[str(number)] = json.loads(done.stdout)
    report(figures, {"truearm": truearm.__version__, "numpy": np.__version__})
