"""Errors of gears and encoders, drawn joint by joint: what the angle of a joint is wrong by, whatever the load.

An encoder whose disc sits off its axis errs once in a turn, and an oval one twice (Sanchez-Brea and Morlanes 2008). The
wheels of a gear err as often as they turn, and its teeth as often as they mesh: some ten to sixty times in a turn of
the joint. Amplitudes are fixed and stated here, so that what a calibration leaves can be held against them; phases,
periods and places are drawn.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.engine.robot.robot import Robot
from truearm.engine.twin.twin_joint import PERFECT, JointTruth

#: Amplitude of the encoder's error [rad], by periods in a turn.
ENCODER: Final = ((1, math.radians(0.010)), (2, math.radians(0.004)))
#: How often a gear errs in a turn: so many different numbers of periods are drawn between these two.
LINES: Final = 3
LOWEST, HIGHEST = 10, 60
#: Amplitude of each [rad], of sines and of triangles.
LINE: Final = math.radians(0.006)
#: Worn places of a turn: how many, half of the width of each [rad], height [rad] forward or backward.
BUMPS: Final = 4
HALF_WIDTH: Final = math.radians(8.0)
HEIGHT: Final = math.radians(0.020)


def gear_errors(rng: np.random.Generator) -> JointTruth:
    """Return a joint with an eccentric encoder and a gear whose wheels and teeth err as sines: 0.011 deg rms."""
    return JointTruth(gear=(*_encoder(rng), *_lines(rng)))


def tooth_errors(rng: np.random.Generator) -> JointTruth:
    """Return a joint with an eccentric encoder, teeth that err in straight lines, and worn places of the turn.

    No Fourier series of finitely many periods is this curve, so what one finds is not what was put in.
    """
    places = tuple(
        (float(rng.uniform(-math.pi, math.pi)), HALF_WIDTH, float(rng.choice((-1.0, 1.0))) * HEIGHT)
        for _ in range(BUMPS)
    )
    return JointTruth(gear=_encoder(rng), teeth=_lines(rng), bumps=places)


#: The truths that are drawn with each, by their names.
DRAWN: Final[dict[str, Callable[[np.random.Generator], JointTruth]]] = {
    "gear-errors": gear_errors,
    "tooth-errors": tooth_errors,
}


def with_errors_drawn(
    robot: Robot,
    joints: dict[int, JointTruth],
    draw: Callable[[np.random.Generator], JointTruth],
    rng: np.random.Generator,
) -> dict[int, JointTruth]:
    """Return what is true of the joints with errors drawn for each that turns; a prismatic one stays as it is."""
    changed = dict(joints)
    for number, joint in enumerate(robot.joints, 1):
        if joint.kind == "revolute":
            drawn, known = draw(rng), joints.get(number, PERFECT)
            changed[number] = replace(known, gear=(*known.gear, *drawn.gear), teeth=drawn.teeth, bumps=drawn.bumps)
    return changed


def _encoder(rng: np.random.Generator) -> tuple[tuple[int, float, float], ...]:
    return tuple((k, size, float(rng.uniform(-math.pi, math.pi))) for k, size in ENCODER)


def _lines(rng: np.random.Generator) -> tuple[tuple[int, float, float], ...]:
    periods = sorted(rng.choice(np.arange(LOWEST, HIGHEST + 1), LINES, replace=False).tolist())
    return tuple((int(k), LINE, float(rng.uniform(-math.pi, math.pi))) for k in periods)
