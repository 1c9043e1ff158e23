"""For every job a call that works, small and fast: the contract suite bends its arguments one by one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.simulated import campaign

from truearm.library import load_robot
from truearm.measurement.readers.canonical import csv_text

Arguments = dict[str, Any]


def _data(folder: Path) -> Path:
    path = folder / "data.csv"
    if not path.exists():
        _, data = campaign("irb120", 20, 0.05e-3, 1)
        path.write_text(csv_text(data))
    return path


def _calibrated(folder: Path) -> Path:
    import truearm

    path = folder / "result" / "calibrated.yaml"
    if not path.exists():
        truearm.calibrate("irb120", _data(folder), model="offsets", out=folder / "result")
    return path


#: Arguments of a call of each job, made in a folder of its own.
EXAMPLES: dict[str, Callable[[Path], Arguments]] = {
    "load_robot": lambda _: {"robot": "irb120"},
    "load_data": lambda folder: {"data": _data(folder)},
    "check": lambda folder: {"robot": load_robot("irb120"), "data": _data(folder), "device": "tracker"},
    "calibrate": lambda folder: {
        "robot": "irb120",
        "data": _data(folder),
        "model": "offsets",
        "train": 14,
        "seed": 1,
        "loss": "linear",
        "redundancy": "prior",
        "effects": ["compliance"],
        "payload": "1kg,0mm,0mm,50mm",
        "gravity": (0.0, 0.0, -9.81),
    },
    "validate": lambda folder: {"robot": _calibrated(folder), "data": _data(folder)},
}
