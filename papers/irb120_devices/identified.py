"""What a set-up identified, by the names and units of the document's Tables 2.6 to 2.11."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.engine.twin.truths import STATION

#: Kinds of parameters, with the document's units and what one of them is in ours.
_KINDS: Final = {
    "alpha": ("deg", math.degrees(1.0)),
    "a": ("mm", 1e3),
    "theta_offset": ("deg", math.degrees(1.0)),
    "compliance": ("1e-6 rad/(N mm)", 1e3),
    "d": ("mm", 1e3),
}
#: Parameters of links 2 to 6; of joints 2 and 3, whose axes are parallel, d_2 and d_3 count as one.
_LINKS: Final = tuple(f"{kind}_{i}" for i in range(2, 7) for kind in _KINDS if (kind, i) != ("d", 3))
#: The base, Rot(x, alpha) Rot(y, beta) Rot(z, gamma) behind Trans(x, y, z).
_BASE: Final = {"x": "mm", "y": "mm", "z": "mm", "alpha": "deg", "beta": "deg", "gamma": "deg"}
#: Units by name.
_UNITS: Final[Mapping[str, str]] = {
    **{f"base {name}": unit for name, unit in _BASE.items()},
    **{name: _KINDS[name.rpartition("_")[0]][0] for name in _LINKS},
}


def deviations(robot: Robot) -> dict[str, float]:
    """Return how far an identified robot is from the nominal one, by name and unit of the document.

    Args:
        robot: As identified, in the frame of an instrument that sees the robot at :data:`STATION`.
    """
    found = _deviations(robot.values, robot.base, STATION)
    return {f"{name} [{_UNITS[name]}]": off for name, off in found.items()}


def printed(truth: str) -> dict[str, str]:
    """Return the same of a set-up's printed parameters, with three digits behind the point as in the document."""
    robot = load_robot("irb120")
    found = robot.truths[truth]
    values = {**robot.values, **found.values, **{f"compliance_{i}": c for i, c in found.compliance.items()}}
    base = robot.with_values({name: value for name, value in found.values.items() if name.startswith("base")}).base
    return {name: f"{value:.3f}" for name, value in _deviations(values, base, IDENTITY).items()}


def _deviations(values: Mapping[str, float], base: Transform, place: Transform) -> dict[str, float]:
    nominal = load_robot("irb120").values
    R = place.rotation.T @ base.rotation
    # The document's base holds d_1, along its own z before it is turned; ours is turned before d_1.
    x, y, z = place.rotation.T @ (np.array(base.translation) - np.array(place.translation)) + R[:, 2] * values["d_1"]
    turns = (math.atan2(-R[1, 2], R[2, 2]), math.asin(R[0, 2]), math.atan2(-R[0, 1], R[0, 0]))
    places = (x, y, z - nominal["d_1"])
    found = dict(zip(_UNITS, (*(1e3 * p for p in places), *map(math.degrees, turns)), strict=False))
    for name in _LINKS:
        off = values.get(name, 0.0) - nominal.get(name, 0.0)
        if name == "d_2":
            off += values["d_3"] - nominal["d_3"]
        found[name] = _KINDS[name.rpartition("_")[0]][1] * off
    return {name: float(value) for name, value in found.items()}
