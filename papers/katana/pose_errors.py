"""Errors of poses of the Katana's tip by the names of Patel's Tables 3.4 and 4.5."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Final, Literal

import numpy as np

from papers.katana.robot import TIP, TOOL
from papers.texts import printed_in
from truearm.engine.robot.chain import Array
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin import Twin

Quantity = Literal["dX", "dY", "dZ", "dP", "dPhi", "dTheta", "dPsi"]
#: What Tables 3.4 and 4.5 are of, and in which unit.
QUANTITIES: Final[Mapping[Quantity, str]] = {
    **{"dX": "mm", "dY": "mm", "dZ": "mm", "dP": "mm"},
    **{"dPhi": "deg", "dTheta": "deg", "dPsi": "deg"},
}
#: Tables of studies that have a column of Tables 3.4 and 4.5: before, and after two calibrations.
_COLUMNS: Final = {
    "katana_influence": ("before", "simultaneous", "influence"),
    "katana_tilting": ("before", "conventional", "two_stage"),
}


def same_angles() -> float:
    """Return by how much the printed orientation errors of Tables 3.4 and 4.5 differ at most [deg]."""
    here, there = (
        [printed_in(Path(__file__).parents[1] / study / "study.yaml", table) for table in tables]
        for study, tables in _COLUMNS.items()
    )
    rows = [f"|{quantity}|, mean" for quantity, unit in QUANTITIES.items() if unit == "deg"]
    return max(abs(float(a[row]) - float(b[row])) for a, b in zip(here, there, strict=True) for row in rows)


def least_mean(printed: Mapping[str, str]) -> float:
    """Return the least possible mean |dP| of the printed mean absolute components [mm]."""
    return math.sqrt(sum(float(printed[f"|{quantity}|, mean"]) ** 2 for quantity in ("dX", "dY", "dZ")))


def tip_poses(robot: Robot, q: Array | Postures) -> tuple[Array, Array]:
    """Return positions ``(n, 3)`` and rotations ``(n, 3, 3)`` of the tip.

    A tip that is a point leans by the turn alpha_6 that its y stands for.
    """
    position, rotation = robot.world_poses(q, TIP)
    if robot.target(TIP).quaternion is None:
        leaning = -math.atan2(robot.values["target_tip_y"], TOOL + robot.values["target_tip_z"])
        c, s = math.cos(leaning), math.sin(leaning)
        rotation = rotation @ np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    return position, rotation


def true_poses(truth: Twin, joints: Array) -> tuple[Array, Array]:
    """Return the true poses of a twin's tip: positions ``(n, 3)`` and rotations ``(n, 3, 3)``."""
    frames = np.array([posture.targets[TIP] for posture in truth.postures(joints)])
    return frames[:, :3, 3], frames[:, :3, :3]


def zxz(rotation: Array) -> Array:
    """Return the document's Euler angles Phi, Theta and Psi of rotations ``(n, 3, 3)`` [rad], ``(n, 3)``.

    ``R = Rz(Phi) Rx(Theta) Rz(Psi)`` with Theta from 0 to pi. All three need atan2 of two arguments.
    """
    R = rotation
    return np.stack(
        [
            np.arctan2(R[:, 0, 2], -R[:, 1, 2]),
            np.arctan2(np.hypot(R[:, 0, 2], R[:, 1, 2]), R[:, 2, 2]),
            np.arctan2(R[:, 2, 0], R[:, 2, 1]),
        ],
        axis=1,
    )


def pose_errors(predicted: tuple[Array, Array], true: tuple[Array, Array]) -> Mapping[Quantity, Array]:
    """Return absolute errors by the document's names: dX, dY, dZ, dP [mm], dPhi, dTheta, dPsi [deg], ``(n,)`` each."""
    apart = 1e3 * (predicted[0] - true[0])
    turned = zxz(predicted[1]) - zxz(true[1])
    turned = np.abs(np.degrees((turned + np.pi) % (2 * np.pi) - np.pi))
    x, y, z = np.abs(apart).T
    phi, theta, psi = turned.T
    return {"dX": x, "dY": y, "dZ": z, "dP": np.linalg.norm(apart, axis=1), "dPhi": phi, "dTheta": theta, "dPsi": psi}
