"""Which postures to hold, under which loads, to tell tilt, backlash and stiffness of the joints apart.

Nothing is said about single joints. Candidates are pairs of postures drawn within the limits, and those are taken that
together tell most about all constants: where the moment about an axis changes its sign (backlash), where it changes
much without (stiffness), where the moment across the axis turns round (clearance). What inclinometers cannot see, the
turn about a vertical axis, is left to poses, which are chosen in the same way knowing what the inclinometers will tell;
they come out with horizontal loads that turn joint 1 both ways (Patel, section 4.4.1).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.identification.inclinometers.fit import SEAT, TILTING, tilting_parameters
from truearm.identification.inclinometers.inclination import DECIDING_MOMENTS, change_derivatives, decided, readable
from truearm.measurement.inclinometer import Pairs
from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.planning.choosing.exchange import most_informative
from truearm.planning.choosing.observability import OfInterest
from truearm.planning.driving.drawing import drawn_clear
from truearm.planning.driving.ways import WayFinder

#: Pairs of postures that are drawn.
CANDIDATES: Final = 1500


@dataclass(frozen=True, eq=False)
class TiltingPlan:
    """What to measure before geometry is identified."""

    inclined: Pairs  #: Pairs of postures for inclinometers.
    posed: Pairs  #: Pairs of postures for poses.
    #: Standard deviation that each constant of the joints will have [SI]; its prior for one that stays unknown.
    expected: Mapping[str, float]


def plan_tilting(
    robot: Robot,
    rng: np.random.Generator,
    *,
    inclined: int = 24,
    posed: int = 8,
    force: float = 20.0,
    move: float = 0.0,
    axes: Sequence[int] = (0, 1, 2),
    candidates: int = CANDIDATES,
    deviation: float,
    pose_deviation: float = 1e-5,
    finder: WayFinder | None = None,
) -> TiltingPlan:
    """Choose pairs of postures.

    Args:
        robot: Nominal, with masses, limits and payload.
        inclined, posed: Number of pairs for inclinometers and for poses.
        force: Of a string or weight on the flange [N], along or against x, y or z of the base; 0 leaves gravity alone.
        move: How far joints move within a pair at most [rad]; 0 keeps the joint positions and changes the load only.
            Poses are always compared at the same joint positions.
        axes: Which axes of each link its inclinometer has: 0, 1 and 2 for x, y and z.
        candidates: Pairs to draw and to choose from.
        deviation: Standard deviation of a change of inclination [rad].
        pose_deviation: Standard deviation of a coordinate of the flange's position [m].
        finder: What the arm keeps clear of in every posture; None for nothing.

    Raises:
        InputError: If nothing may differ within a pair, or too few postures decide to which side the joints tilt.
    """
    if not (force >= 0.0 and move >= 0.0 and (move > 0.0 or force > 0.0)):
        raise InputError(
            "the two postures of a pair do not differ",
            where="force and move",
            came=f"{force:g} N and {math.degrees(move):g} deg",
            allowed="0 or more, one of them more than 0",
        )
    if posed and not force:
        raise InputError(
            "poses are compared under two loads",
            where="force",
            came="0 N",
            allowed="more than 0",
            cure="Give a force, or choose no pairs of poses; then joints about a vertical axis stay unobservable.",
        )
    model = robot.with_effects(TILTING)
    effects, nuisance = tilting_parameters(model)
    names = [p.name for p in (*effects, *nuisance)]
    prior = np.concatenate([[p.prior for p in (*effects, *nuisance)], np.full(3 * len(robot.joints), SEAT)])
    known = np.eye(len(prior))

    pairs = _candidates(model, rng, candidates, force, move, finder)
    rows = change_derivatives(model, pairs, names) / deviation
    rows = np.where(readable(model, pairs)[..., None], rows, 0.0)[:, :, list(axes)].reshape(len(pairs), -1, len(prior))
    by_inclination, known = _chosen(pairs, rows * prior, inclined, known, len(effects))
    by_pose = pairs.at(np.arange(0))
    if posed:
        pairs = _candidates(model, rng, candidates, force, 0.0, finder)
        rows = _displacement_derivatives(model, pairs, names) / (math.sqrt(2.0) * pose_deviation)
        for posture in (pairs.first, pairs.second):
            rows[~decided(model, posture, upright=False).all(axis=1)] = 0.0
        rows = np.pad(rows, ((0, 0), (0, 0), (0, len(prior) - len(names))))
        by_pose, known = _chosen(pairs, rows * prior, posed, known, len(effects))
    spread = prior * np.sqrt(np.diag(np.linalg.inv(known)))
    return TiltingPlan(by_inclination, by_pose, {p.name: float(s) for p, s in zip(effects, spread, strict=False)})


def _chosen(candidates: Pairs, rows: Array, count: int, known: Array, interest: int) -> tuple[Pairs, Array]:
    """Return the most useful candidates, and what is known once they are measured."""
    useful = np.flatnonzero(rows.any(axis=(1, 2)))
    if len(useful) < count:
        raise InputError(
            "too few postures decide to which side the joints tilt",
            where="postures to compare",
            came=f"{len(useful)} of {len(rows)} pairs that can be used",
            allowed=f"{DECIDING_MOMENTS}, in {count} pairs",
            cure="Give a larger force, or a payload beside the last axis.",
        )
    chosen = useful[most_informative(rows[useful], count, known, OfInterest(interest))]
    measured = rows[chosen].reshape(-1, rows.shape[2])
    return candidates.at(chosen), known + measured.T @ measured


def _candidates(
    robot: Robot, rng: np.random.Generator, count: int, force: float, move: float, finder: WayFinder | None
) -> Pairs:
    """Return pairs of postures under two different pulls."""
    if finder is None:
        low, high = np.array([joint.limits or (-np.inf, np.inf) for joint in robot.joints]).T
        joints = robot.random_configurations(count, rng)
    else:
        low, high = finder.low, finder.high
        joints = drawn_clear(finder, count, np.zeros(len(low)), rng).joints
    moved = np.clip(joints + move * rng.uniform(-1.0, 1.0, joints.shape), low, high)
    if finder is not None and move:
        clear = finder.check.ways(joints, moved).clear
        joints, moved = joints[clear], moved[clear]
    count = len(joints)
    ways = rng.permuted(np.tile(np.arange(6), (count, 1)), axis=1)  # the first two differ
    pulls = np.zeros((2, count, 6))
    pulls[..., :3] = force * np.concatenate([np.eye(3), -np.eye(3)])[ways[:, :2].T]
    return Pairs(*(robot.loaded(Postures(q, wrench=p)) for q, p in zip((joints, moved), pulls, strict=True)))


def _displacement_derivatives(robot: Robot, pairs: Pairs, names: Sequence[str]) -> Array:
    """Return the derivative of the flange's displacement within pairs ``(n, 3, parameters)`` [m per unit]."""
    first, second = (
        robot.position_jacobian(robot.forward_kinematics(q), q, names) for q in (pairs.first, pairs.second)
    )
    return np.moveaxis(second - first, (0, 2), (2, 0))
