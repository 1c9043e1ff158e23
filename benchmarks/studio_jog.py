"""Jogging in the studio: from the event that a window sends to the pose that comes back, over its own connection.

``python benchmarks/studio_jog.py [--moves N]`` serves a project of a rigid, of an elastic and of a redundant elastic
arm, opens a window without a browser beside it, and drags sliders and the handle. It prints the time from sending the
event to having the flange's new pose, in ms, the browser's share left out. The window may gather messages for a
sixtieth of a second; that is in the times.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import viser
import zstandard
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

import truearm
from truearm.library import load_robot
from truearm.modeling.formats.robot_file import robot_text
from truearm.modeling.robot import Robot
from truearm.modeling.transform import quaternion_from_rotation
from truearm.studio.pages.jog import JogPage
from truearm.studio.serving import Studio, serve

CAMERA: dict[str, Any] = {
    "type": "ViewerCameraMessage",
    "wxyz": [1.0, 0.0, 0.0, 0.0],
    "position": [3.0, 3.0, 3.0],
    "fov": 1.3,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 600,
    "image_width": 800,
    "look_at": [0.0, 0.0, 0.0],
    "up_direction": [0.0, 0.0, 1.0],
}


def elastic(name: str) -> Robot:
    """Return an arm of the library whose joints give way by as much as that of an IRB 120."""
    robot = load_robot(name).with_effects(["compliance"])
    return robot.with_values({name: 3e-5 for name in robot.parameters if name.startswith("compliance")})


def opened(studio: Studio) -> ClientConnection:
    place = f"127.0.0.1:{studio.access.port}"
    return connect(
        f"ws://{place}/",
        origin=f"http://{place}",  # type: ignore[arg-type]
        subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
        max_size=None,
        compression=None,
        proxy=None,
    )


def answered(line: ClientConnection, seconds: float = 5.0) -> bool:
    """Wait until the flange has been moved."""
    end = time.perf_counter() + seconds
    while (left := end - time.perf_counter()) > 0.0:
        try:
            content = line.recv(timeout=left)
        except TimeoutError:
            return False
        assert isinstance(content, bytes)
        unpacked = zstandard.ZstdDecompressor().decompressobj().decompress(content[16:])
        if b"SetPositionMessage" in unpacked and b"/nominal/flange" in unpacked:
            return True
    return False


def quiet(line: ClientConnection) -> None:
    """Read on until nothing comes any more."""
    while True:
        try:
            line.recv(timeout=0.15)
        except TimeoutError:
            return


def timed(line: ClientConnection, messages: Iterator[dict[str, Any]], moves: int) -> list[float]:
    taken = []
    for _ in range(moves):
        message = msgspec.msgpack.encode(next(messages))
        quiet(line)
        began = time.perf_counter()
        line.send(message)
        if answered(line):
            taken.append((time.perf_counter() - began) * 1e3)
    return taken


def measure(robot: Robot, moves: int) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        project = Path(folder) / "project"
        project.mkdir()
        (project / "truearm-studio.yaml").write_text("truearm: truearm-studio/1\nrobot: arm.yaml\n")
        (project / "arm.yaml").write_text(robot_text(robot))
        studio = serve(project, port=0)
        try:
            page = next(page for page in studio.window.pages if isinstance(page, JogPage))
            with opened(studio) as line:
                line.send(msgspec.msgpack.encode(CAMERA))
                quiet(line)
                rng = np.random.default_rng(0)
                arm = page.jogging
                assert arm is not None
                start = robot.random_configurations(1, rng)[0] * 0.3 + arm.joints * 0.7

                def slid() -> Iterator[dict[str, Any]]:
                    for k in range(10**6):
                        slider = page._sliders[k % len(page._sliders)]
                        value = slider.min + (slider.max - slider.min) * float(rng.uniform(0.3, 0.7))
                        yield {"type": "GuiUpdateMessage", "uuid": slider._impl.uuid, "updates": {"value": value}}

                def dragged() -> Iterator[dict[str, Any]]:
                    arm.go(start)
                    for k in range(10**6):
                        p, R = robot.forward(start + 0.05 * np.sin(0.3 * k + np.arange(len(start))), frame="world")
                        q = quaternion_from_rotation(R[0])
                        yield {
                            "type": "TransformControlsUpdateMessage",
                            "name": "/handle",
                            "wxyz": q.tolist(),
                            "position": p[0].tolist(),
                            "owner": "",
                        }

                found: dict[str, Any] = {}
                for name, messages in (("joint", slid()), ("handle", dragged())):
                    taken = timed(line, messages, moves)
                    found[name] = {
                        "moves": len(taken),
                        "median_ms": round(float(np.median(taken)), 1),
                        "p95_ms": round(float(np.percentile(taken, 95)), 1),
                        "max_ms": round(float(np.max(taken)), 1),
                    }
                return found
        finally:
            studio.stop()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moves", type=int, default=60)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    arms = {"irb120": load_robot("irb120"), "irb120 elastic": elastic("irb120"), "fr3 elastic": elastic("fr3")}
    found = {name: measure(robot, given.moves) for name, robot in arms.items()}
    for name, kinds in found.items():
        for kind, figures in kinds.items():
            print(f"{name:16} {kind:8} {figures}")  # noqa: T201
    if given.out:
        content = {"truearm": truearm.__version__, "arms": found}
        given.out.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
