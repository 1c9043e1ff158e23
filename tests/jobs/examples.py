"""For every job a call that works, small and fast: the contract suite bends its arguments one by one."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from importlib.resources import files
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


def _program(folder: Path) -> Path:
    path = folder / "plate.mod"
    if not path.exists():
        path.write_text((files("truearm.examples") / "plate.mod").read_text())
    return path


def _cell(folder: Path) -> Path:
    path = folder / "cell.yaml"
    path.write_text(
        "truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\n"
        "tools:\n  tProbe: {of: flange, translation: [0.2, 0, 125]}\n"
        "frames:\n  wobjPlate: {of: base, translation: [310.5, -110, 60]}\n"
    )
    return path


def _corrected(folder: Path) -> Path:
    import truearm

    path = folder / "corrected" / "plate.mod"
    if not path.exists():
        truearm.compensate(_calibrated(folder), [_program(folder)], out=path.parent)
    return path


def _new(folder: Path, name: str) -> Path:
    """Return a path that does not exist."""
    path = folder / name
    if path.is_file():
        path.unlink()
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
    "compensate": lambda folder: {
        "robot": _calibrated(folder),
        "programs": [_program(folder)],
        "out": folder / "compensated",
        "tools": _cell(folder),
        "frames": _cell(folder),
        "payload": "1kg,0mm,0mm,50mm",
        "strict": True,
        "split": 5e-5,
    },
    "revert": lambda folder: {"programs": [_corrected(folder)], "out": folder / "reverted"},
    "convert": lambda folder: {"robot": "irb120", "convention": "hayati", "out": _new(folder, "hayati.yaml")},
    "export": lambda folder: {"robot": "irb120", "format": "hayati", "out": _new(folder, "hayati.csv")},
    "new_robot": lambda folder: {"file": _new(folder, "robot.yaml")},
    "example": lambda folder: {"folder": Path(tempfile.mkdtemp(dir=folder))},
    "demo": lambda folder: {"out": folder / "demo"},
}
