"""Files that say where the base and the targets of a twin truly are."""

from __future__ import annotations

import json
from pathlib import Path

from truearm.engine.robot.robot import Robot


def frames_of(robot: Robot, path: Path, *, base: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Path:
    """Write the places of a robot's base and targets; the base off by `base` [mm]."""
    tools = {
        target.name: {
            "of": "flange",
            "translation": [1e3 * robot.values[target.parameter(axis)] for axis in "xyz"],
            **({"quaternion": list(target.quaternion)} if target.quaternion else {}),
        }
        for target in robot.targets
    }
    place = [1e3 * v + off for v, off in zip(robot.base.translation, base, strict=True)]
    frames = {"base": {"of": "world", "translation": place, "quaternion": list(robot.base.quaternion)}}
    content = {"truearm": "truearm-cell/1", "units": {"length": "mm", "angle": "deg"}, "tools": tools, "frames": frames}
    path.write_text(json.dumps(content))
    return path
