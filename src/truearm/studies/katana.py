"""The Katana 450 of Patel's thesis as its three studies have it: parameters, truths, tilting joints and poses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Final, Literal

import numpy as np

from truearm.identification.inclinometers.fit import TiltingFit, calibrate_tilting
from truearm.library import load_robot
from truearm.measurement.inclinometer import deviation_of_change
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.modeling.transform import IDENTITY, Transform
from truearm.planning.choosing.inclinometer import plan_tilting
from truearm.planning.poses.iso9283 import Cube
from truearm.planning.poses.largest_cube import largest_cube
from truearm.simulation.inclinometer import compare, measure_pairs
from truearm.simulation.twin import Twin
from truearm.simulation.twin_joint import JointTruth

TIP: Final = "tip"
#: The length of the tool link, d_6 [m].
TOOL: Final = 0.2
#: The 17 parameters of Table 3.2. The document's alpha_0 to alpha_4 are alpha_1 to alpha_5 here. Its tool link is the
#: flange here, so d_6 is z of the tip, and alpha_6, a turn with an arm of 200 mm, is y of the tip.
NAMES: Final = (
    *(f"theta_offset_{i}" for i in range(1, 6)),
    *(f"alpha_{i}" for i in range(1, 6)),
    "target_tip_y",
    "beta_3",
    "beta_4",
    "a_3",
    "a_4",
    "d_5",
    "target_tip_z",
)
#: As the document calls them.
DOCUMENT_NAMES: Final = (
    *(f"theta {i}" for i in range(1, 6)),
    *(f"alpha {i}" for i in range(6)),
    *("beta 2", "beta 3", "a 3", "a 4", "d 5", "d 6"),
)
#: What the tip's y is counted in, so that it counts like the turn that it stands for, and how far it is perturbed.
UNITS: Final = {"target_tip_y": TOOL}
PERTURBATIONS: Final = {"target_tip_y": TOOL * math.radians(0.05)}
#: Resolution of the Optotrak, taken as one standard deviation of a coordinate [m].
NOISE: Final = 1e-5
#: Resolution of the inclinometers [rad].
RESOLUTION: Final = math.radians(0.001)

#: Cube of ISO 9283 whose circle of 0.8 times the side is the circle of section 5.5.1.
CHAPTER_5_CUBE: Final = Cube((0.0, -0.3, 0.1392893), 0.25)

#: What Tables 3.4 and 4.5 are of, and in which unit.
QUANTITIES: Final = {
    **dict.fromkeys(("dX", "dY", "dZ", "dP"), "mm"),
    **dict.fromkeys(("dPhi", "dTheta", "dPsi"), "deg"),
}

Table = Literal["standard", "influence"]
#: The tool link's alpha_6 [deg] and d_6 [mm], Tables 3.2 and 3.3.
_TOOL_LINK: Final[Mapping[Table, tuple[float, float]]] = {"standard": (90.03, 200.001), "influence": (90.01, 200.000)}

#: Tables 4.3 and 4.4 [deg, deg, kgf m/deg], joints 1 to 5.
CLEARANCE: Final = (0.022, 0.024, 0.017, 0.015, 0.018)
BACKLASH: Final = (0.063, 0.061, 0.057, 0.046, 0.051)
STIFFNESS: Final = (122.0, 90.0, 75.0, 78.0, 80.0)
_KILOGRAM_FORCE: Final = 9.80665  # N


def compliance(stiffness: float) -> float:
    """Return the compliance [rad/(N m)] of a stiffness [kgf m/deg], or the other way round."""
    return math.radians(1.0 / stiffness) / _KILOGRAM_FORCE


#: By parameter [rad, rad/(N m)].
TILTING: Final[Mapping[str, float]] = {
    **{f"clearance_{i}": math.radians(c) for i, c in enumerate(CLEARANCE, 1)},
    **{f"backlash_{i}": math.radians(b) for i, b in enumerate(BACKLASH, 1)},
    **{f"compliance_{i}": compliance(k) for i, k in enumerate(STIFFNESS, 1)},
}


def katana(beyond: float = 0.0) -> Robot:
    """Return the nominal Katana with its tip, some way beyond the 200 mm attachment [m]."""
    return load_robot("katana450").with_frames(IDENTITY, {TIP: (0.0, 0.0, beyond)})


def published(table: Table, beyond: float = 0.0) -> Robot:
    """Return the Katana with the parameters of Table 3.2 or 3.3; its tip has an orientation."""
    robot = katana()
    leaning, length = math.radians(_TOOL_LINK[table][0] - 90.0), _TOOL_LINK[table][1] * 1e-3 + beyond
    tip = Transform(
        (0.0, -length * math.sin(leaning), length * math.cos(leaning) - TOOL),
        (math.cos(leaning / 2), math.sin(leaning / 2), 0.0, 0.0),
    )
    return robot.with_frames(IDENTITY, {TIP: tip}).with_values(robot.truths[table].values)


def twin(robot: Robot, tilting: Mapping[str, float] = TILTING) -> Twin:
    """Return a twin whose joints tilt."""

    def of(name: str, number: int) -> float:
        return tilting.get(f"{name}_{number}", 0.0)

    joints = {
        i: JointTruth(of("compliance", i), backlash=of("backlash", i), clearance=of("clearance", i))
        for i in range(1, len(robot.joints) + 1)
    }
    return Twin(robot, joints)


@cache
def workspace_cube() -> Cube:
    """Return the largest cube in front of the Katana with its attachment."""
    return largest_cube(katana(), target=TIP)


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
    """Return where a twin's tip truly is: positions ``(n, 3)`` and rotations ``(n, 3, 3)``."""
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


def pose_errors(predicted: tuple[Array, Array], true: tuple[Array, Array]) -> Mapping[str, Array]:
    """Return absolute errors by the document's names: dX, dY, dZ, dP [mm], dPhi, dTheta, dPsi [deg]."""
    apart = 1e3 * (predicted[0] - true[0])
    turned = zxz(predicted[1]) - zxz(true[1])
    turned = np.abs(np.degrees((turned + np.pi) % (2 * np.pi) - np.pi))
    named = dict(zip(("dX", "dY", "dZ"), np.abs(apart).T, strict=True))
    return {
        **named,
        "dP": np.linalg.norm(apart, axis=1),
        **dict(zip(("dPhi", "dTheta", "dPsi"), turned.T, strict=True)),
    }


def knowing(robot: Robot, tilting: Mapping[str, float]) -> Robot:
    """Return the robot with joint effects at these values."""
    effects = tuple(dict.fromkeys(name.rpartition("_")[0] for name in tilting))
    return replace(robot, effect_names=(*robot.effect_names, *effects)).with_values(tilting)


def inclined(nominal: Robot, truth: Twin, rng: np.random.Generator, pairs: tuple[int, int] = (24, 8)) -> TiltingFit:
    """Return what the first stage finds of a twin's joints: pairs planned for the nominal robot, then measured.

    Parameters
    ----------
    pairs
        How many for inclinometers, and how many for poses.
    """
    plan = plan_tilting(
        nominal,
        rng,
        inclined=pairs[0],
        posed=pairs[1],
        deviation=deviation_of_change(RESOLUTION),
        pose_deviation=NOISE,
    )
    readings = compare(truth, plan.inclined, RESOLUTION, rng)
    return calibrate_tilting(nominal, readings, measure_pairs(truth, plan.posed, NOISE, rng))
