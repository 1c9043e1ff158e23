"""Every job, called with arguments that are bent."""

from __future__ import annotations

import inspect
import math
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from tests.fuzz import samples
from tests.fuzz.mutations import ODD, Random, damaged, one_of
from tests.house.examples import EXAMPLES

import truearm
from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.robot import Robot

#: No number of these lets a job work for long: they are small, or no job can take them.
_NUMBERS: Final = (math.nan, math.inf, -math.inf, 0, -1, 1, 2, 3, 0.5, -0.0, 1e-300, 1e300, 1e-6, 10**13, 10**400, True)


class Odd:
    """Nothing that a job knows."""


@cache
def arguments(job: str) -> dict[str, Any]:
    """Return arguments of a call that works."""
    return EXAMPLES[job](samples.folder())


def bent_arguments(rng: Random, job: str, folder: Path) -> dict[str, Any]:
    """Return arguments of a call whose files lie in a folder, damaged or not, and some of which are bent."""
    signature = inspect.signature(getattr(truearm, job)).parameters
    parameters = list(signature)
    given = {name: _brought(rng, value, folder) for name, value in arguments(job).items()}
    if "out" in parameters and ("out" in given or rng.random() < 0.5):
        given["out"] = folder / "out" / f"new{Path(str(given.get('out', ''))).suffix}"
    for name in ("file", "folder"):
        if name in given and isinstance(given[name], Path) and not given[name].exists():
            given[name] = folder / "out" / given[name].name
    for _ in range(int(rng.integers(3))):
        if parameters:
            name = str(one_of(rng, parameters))
            if name in given or rng.random() < 0.5:
                given[name] = _bent(rng, given.get(name), folder)
            if rng.random() < 0.1 and signature[name].default is not inspect.Parameter.empty:
                given.pop(name, None)
    return given


def _brought(rng: Random, value: Any, folder: Path) -> Any:
    """Return an argument with its files copied into a folder."""
    if isinstance(value, Path) and value.is_file():
        for file in value.parent.glob(f"{value.name}*"):
            content = file.read_bytes()
            (folder / file.name).write_bytes(damaged(rng, file.name, content) if rng.random() < 0.3 else content)
        return folder / value.name
    if isinstance(value, dict):
        return {key: _brought(rng, entry, folder) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(_brought(rng, entry, folder) for entry in value)
    return value


def _bent(rng: Random, value: Any, folder: Path) -> Any:
    """Return something like an argument, or nothing like it."""
    way = int(rng.integers(4))
    if way == 0:
        return one_of(rng, (None, Odd(), "", "twelve", b"x", {}, [], (), {0: 1.0}, np.zeros(0), np.array(1.0)))
    if isinstance(value, Robot | Dataset):
        return one_of(rng, (truearm.load_robot("ur5"), truearm.load_robot("kr5"), value))
    if isinstance(value, bool):
        return one_of(rng, (not value, 1, 0.0, "yes"))
    if isinstance(value, int | float):
        return one_of(rng, _NUMBERS)
    if isinstance(value, np.ndarray):
        bent = np.array(value, dtype=float)
        if way == 1 and bent.size:
            bent.reshape(-1)[int(rng.integers(bent.size))] = one_of(rng, (math.nan, math.inf, 1e300, 1e9, 0.0, -1.0))
        elif way == 2 and bent.ndim:
            bent = bent[..., :-1]
        else:
            with np.errstate(over="ignore"):  # of what was bent already
                bent = bent * one_of(rng, (-1.0, 0.0, 1e3, 1e-3, 1e200))
        return bent
    if isinstance(value, list | tuple) and value:
        entries = list(value)
        at = int(rng.integers(len(entries)))
        if way == 1:
            entries[at] = _bent(rng, entries[at], folder)
        elif way == 2:
            del entries[at]
        else:
            entries.append(entries[at])
        return type(value)(entries)
    if isinstance(value, dict) and value:
        key = one_of(rng, list(value))
        return (
            {**value, str(one_of(rng, ODD)): value[key]} if way == 1 else {**value, key: _bent(rng, value[key], folder)}
        )
    if isinstance(value, Path):
        return one_of(rng, (folder, folder / "none.csv", folder / "x" / "y.csv", Path("/dev/null"), str(value), "a\0b"))
    return one_of(rng, _NUMBERS if rng.random() < 0.3 else (*ODD, "kr5", "ur5", "irb120", "katana450"))
