"""Jogging in the studio: from the event that a window sends to the pose that comes back, over its own connection.

``python benchmarks/studio_jog.py [--moves N] [--runs N] [--out FILE]`` starts ``truearm studio`` in a process of its
own with a rigid, an elastic and a redundant elastic arm, opens a window without a browser beside it, and drags sliders
and the handle. It prints the time from sending the event to having the flange's new pose, in ms, the browser's share
left out, and how much comes with each move. What counts is the median over the runs of the 95th percentile, with its
range; a machine that does something else meanwhile slows the moves, so the load before each run is kept.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from studio_line import Line, Message, moved, studio

import truearm
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import quaternion_from_rotation
from truearm.studio.jogging import Jogging

_KINDS = ("joint", "handle")


def elastic(name: str) -> Robot:
    """Return an arm of the library whose joints give way by as much as that of an IRB 120."""
    robot = load_robot(name).with_effects(["compliance"])
    return robot.with_values({name: 3e-5 for name in robot.parameters if name.startswith("compliance")})


def slid(line: Line, arm: Jogging, rng: np.random.Generator) -> Iterator[Message]:
    """Yield messages of sliders, one joint after the other."""
    sliders = [line.elements[f"{joint.name} [{unit}]"] for joint, unit in zip(arm.robot.joints, arm.units, strict=True)]
    while True:
        for slider, (low, high) in zip(sliders, arm.ranges(), strict=True):
            value = low + (high - low) * float(rng.uniform(0.3, 0.7))
            yield {"type": "GuiUpdateMessage", "uuid": slider["uuid"], "updates": {"value": value}}


def dragged(arm: Jogging) -> Iterator[Message]:
    """Yield messages of the handle on a way that the arm can follow, from where it is."""
    for k in range(10**6):
        joints = arm.joints + 0.05 * np.sin(0.3 * k + np.arange(len(arm.joints)))
        p, R = arm.robot.forward(joints, frame="world")
        pose = {"wxyz": quaternion_from_rotation(R[0]).tolist(), "position": p[0].tolist()}
        yield {"type": "TransformControlsUpdateMessage", "name": "/handle", "owner": "", **pose}


def timed(line: Line, messages: Iterator[Message], moves: int) -> dict[str, Any]:
    taken, before = [], (line.bytes, line.messages)
    for _ in range(moves):
        message = next(messages)
        line.quiet()
        began = time.perf_counter()
        line.send(**message)
        if line.until(moved, 5.0):
            taken.append((time.perf_counter() - began) * 1e3)
    line.quiet()
    return {
        "moves": len(taken),
        "median_ms": round(float(np.median(taken)), 1),
        "p95_ms": round(float(np.percentile(taken, 95)), 1),
        "max_ms": round(float(np.max(taken)), 1),
        "bytes": round((line.bytes - before[0]) / moves),
        "messages": round((line.messages - before[1]) / moves, 1),
    }


def measure(robot: Robot, moves: int) -> dict[str, Any]:
    rng = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as folder:
        project = Path(folder) / "project"
        project.mkdir()
        (project / "truearm-studio.yaml").write_text("truearm: truearm-studio/1\nrobot: arm.yaml\n")
        (project / "arm.yaml").write_text(robot_text(robot))
        with studio(project) as (_, address):
            line, arm = Line(address), Jogging(robot)
            line.quiet(1.0)
            found = {"joint": timed(line, slid(line, arm, rng), moves)}
            # From the middle of what the sliders have been led through the handle is dragged.
            arm.joints = robot.random_configurations(1, rng)[0] * 0.3 + arm.joints * 0.7
            for slider, value in zip(slid(line, arm, rng), arm.numbers, strict=False):
                line.send(**{**slider, "updates": {"value": value}})
                line.quiet()
            return {**found, "handle": timed(line, dragged(arm), moves)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moves", type=int, default=60)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    arms = {"irb120": load_robot("irb120"), "irb120 elastic": elastic("irb120"), "fr3 elastic": elastic("fr3")}
    runs = []
    for number in range(given.runs):
        run = {}
        for name, robot in arms.items():
            busy = os.getloadavg()[0]
            run[name] = {**measure(robot, given.moves), "load_before": round(busy, 1)}
            for kind in _KINDS:
                print(f"run {number + 1} {name:16} {kind:8} {run[name][kind]}", flush=True)  # noqa: T201
        runs.append(run)
    found = summary(runs)
    print(json.dumps(found, indent=1))  # noqa: T201
    if given.out:
        content = {"truearm": truearm.__version__, "processors": os.cpu_count(), "p95_ms": found, "runs": runs}
        given.out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def summary(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the median and the range over runs of the 95th percentile, by arm and by what is dragged [ms]."""
    found: dict[str, Any] = {}
    for name in runs[0]:
        for kind in _KINDS:
            p95 = sorted(run[name][kind]["p95_ms"] for run in runs)
            found[f"{name} {kind}"] = {"median": statistics.median(p95), "range": [p95[0], p95[-1]]}
    return found


if __name__ == "__main__":
    main()
