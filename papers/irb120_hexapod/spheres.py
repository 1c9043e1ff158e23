"""Nubiola, section 2.6.3: a ballbar between the tool of an IRB 120 and a ball on its table."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from papers.irb120 import REGION, without_beta
from papers.irb120_hexapod.worn import calibrated, in_base, tracked, worn_twin
from papers.seeds import Figures
from truearm.engine.data.hexapod import DEVICE
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.twin import Twin
from truearm.hexapod.rehearsal import ballbar
from truearm.validation.sphere import sphere_test

#: Deviation of a coordinate read by tracker and C-Track [m]: 0.035 mm over a scale bar, and 0.070 mm in space.
TRACKER: Final = 0.020e-3
C_TRACK: Final = 0.040e-3
#: Configurations that tracker, C-Track and C-Track with the spatial artefact calibrate from.
_TRAINING: Final = {"laser tracker": 38, "C-Track": 36, "C-Track, spatial": 35}
#: Tables 2.12 and 2.13: how many readings, by nest and model.
_READINGS: Final = {
    **{("1", "laser tracker"): 123, ("1", "C-Track"): 123, ("2", "laser tracker"): 95, ("2", "C-Track"): 95},
    **{("1", "C-Track, spatial"): 108, ("3", "C-Track, spatial"): 90},
}
#: Where the ball is, in the robot's base frame: invented [m].
_CENTRE: Final = (0.36, 0.0, 0.18)
_RADIUS: Final = DEVICE.leg
#: Nests of the spatial artefact in the flange frame, 150 mm before it and 45 mm from axis 6 (Nubiola, 2.2.2); the
#: angles are invented.
_SPATIAL: Final = {str(n + 1): (0.045 * math.cos(a), 0.045 * math.sin(a), 0.150) for n, a in enumerate((0, 2.09, 4.19))}
#: How far the ball is from nest 1 when a person takes them to be together, a coordinate: invented [m].
_BY_HAND: Final = 0.1e-3
_DOWN: Final = np.diag([1.0, -1.0, -1.0])
_SPATIAL_LOAD: Final = Payload(2.6, (-0.023, 0.0, 0.100))


def spheres(
    twin: Twin, tracker: Robot, rng: np.random.Generator, coarser: int = 1
) -> tuple[Figures, dict[tuple[str, str], Array]]:
    """Make all tests.

    Args:
        twin: The true robot with the triangular artefact.
        tracker: The document's model, calibrated by a tracker.
        rng: For configurations and noise.
        coarser: Only every so many-th reading.

    Returns:
        Figures about the taught centre and about the centre that fits best, and errors about the taught one [m].
    """
    nominal = without_beta(load_robot("irb120").with_payload(twin.robot.payload))
    spatial = _with_spatial(rng)
    spatial_nominal = without_beta(load_robot("irb120").with_payload(_SPATIAL_LOAD))
    seen = tracked(twin, REGION.draw(_TRAINING["C-Track"], rng), C_TRACK, rng)
    seen_spatial = tracked(spatial, REGION.draw(_TRAINING["C-Track, spatial"], rng), C_TRACK, rng)
    models = {
        "laser tracker": (twin, in_base(tracker)),
        "C-Track": (twin, in_base(calibrated(nominal, seen))),
        "C-Track, spatial": (spatial, in_base(calibrated(spatial_nominal, seen_spatial))),
    }
    errors = {}
    figures: Figures = {"sphere": {}, "about": {}}
    balls = {"triangular": _taught(twin, nominal, rng), "spatial": _taught(spatial, spatial_nominal, rng)}
    for (nest, name), count in _READINGS.items():
        true, model = models[name]
        ball = balls["spatial" if "spatial" in name else "triangular"]
        joints, lengths, centre = _readings(true, model, ball, nest, count // coarser, rng)
        taught, found = sphere_test(model, joints, lengths, nest, centre), sphere_test(model, joints, lengths, nest)
        errors[nest, name] = taught.errors
        words = f"nest {nest}, {name}"
        figures["sphere"] |= {
            f"{words}: size of the mean, {count} readings": 1e3 * abs(taught.mean),
            f"{words}: standard deviation": 1e3 * taught.deviation,
            f"{words}: maximum": 1e3 * taught.largest,
        }
        figures["about"] |= {
            f"{words}: size of the mean": 1e3 * abs(found.mean),
            f"{words}: standard deviation": 1e3 * found.deviation,
        }
    uncalibrated = nominal.with_frames(IDENTITY, nominal.tools["triangular"].targets)
    _, lengths, _ = _readings(twin, uncalibrated, balls["triangular"], "1", 123 // coarser, rng)
    in_range = 100.0 * float(np.isfinite(lengths).mean())
    figures["about"]["nominal robot: readings within the range of the bar [%]"] = in_range
    return figures, errors


def _with_spatial(rng: np.random.Generator) -> Twin:
    twin = worn_twin(rng, "ctrack-spatial")
    robot = twin.robot
    return replace(twin, robot=robot.with_frames(robot.base, _SPATIAL).with_payload(_SPATIAL_LOAD))


def _taught(twin: Twin, nominal: Robot, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return the joint positions at which nest 1 was brought to the ball by hand, and where the ball is [m]."""
    values = twin.robot.values
    nests = {t.name: [values[t.parameter(axis)] for axis in "xyz"] for t in twin.robot.targets}
    arm = nominal.with_frames(IDENTITY, nests)
    joints = inverse(arm, np.array([_CENTRE]), _DOWN[None], target="1").joints[0]
    return joints, twin.target_frames(joints)["1"][:3, 3] + _BY_HAND * rng.standard_normal(3)


def _readings(
    twin: Twin, model: Robot, ball: tuple[Array, Array], nest: str, count: int, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Return joint positions on the sphere, what the bar reads there [m], and the centre by the model [m]."""
    at_ball, place = ball
    centre = model.world_poses(at_ball[None], "1")[0][0]
    joints = _on_sphere(model, nest, centre, count, rng)
    approach = rng.choice([-1.0, 1.0], joints.shape)
    nests = np.array([posture.targets[nest][:3, 3] for posture in twin.postures(joints, approach=approach)])
    return joints, ballbar(rng).read(np.linalg.norm(nests - place, axis=1), _RADIUS), centre


def _on_sphere(model: Robot, nest: str, centre: Array, count: int, rng: np.random.Generator) -> Array:
    """Return joint positions that bring a nest to points of the sphere above the ball, ``(count, joints)``."""
    rows: list[Array] = []
    while sum(map(len, rows)) < count:
        q = REGION.draw(4000, rng)
        position, rotation = model.world_poses(q, nest)
        away = position - centre
        distance = np.linalg.norm(away, axis=1)
        near = np.flatnonzero((np.abs(distance - _RADIUS) < 0.1) & (away[:, 2] > 0.2 * distance))
        near = near[: count - sum(map(len, rows))]
        on_it = centre + _RADIUS * away[near] / distance[near, None]
        found = inverse(model, on_it, rotation[near], target=nest, seed=q[near])
        usable = np.array([status.usable for status in found.status])
        rows.append(found.joints[usable])
    return np.concatenate(rows)[:count]
