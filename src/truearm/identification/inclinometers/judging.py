"""What to know about tilt, backlash and stiffness that inclinometers told."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from truearm.identification.inclinometers.fit import TiltingFit
from truearm.identification.inclinometers.inclination import upwards
from truearm.measurement.inclinometer import Inclinations
from truearm.modeling.parameters import Parameter
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.shown import counted, listed

#: Share of the prior variance that readings remove of a constant that they see: a quarter of the deviation is left.
SEEN: Final = 1.0 - 0.25**2
#: Larger than declared by so much, changes hold something that the model does not know; or nothing that it knows.
_SCATTER: Final = 2.0
_WRONG: Final = 10.0
#: So many deviations below zero a spring, a play or a gap cannot be.
_BELOW: Final = 3.0
#: Sine of the angle between gravity and an axis that stands upright whatever the posture.
_UPRIGHT: Final = 0.05


def seen(parameter: Parameter) -> bool:
    """Return whether readings told a constant, and not its prior alone."""
    return (parameter.informed or 0.0) >= SEEN


def check_tilting(start: Robot, fit: TiltingFit, read: Inclinations, *, pushed: bool) -> tuple[Notice, ...]:
    """Return what to know about the first stage.

    Args:
        start: The robot before.
        pushed: Whether poses under loads were given beside the inclinations.
    """
    return (
        *_not_converged(fit),
        *_below_zero(fit),
        *_scatter(fit, read),
        *_unseen(start, fit, pushed=pushed),
        *_unpaired(read),
    )


def _not_converged(fit: TiltingFit) -> list[Notice]:
    if fit.converged:
        return []
    message = "The solver's steps did not become small. Check forces, payloads, masses and joint positions."
    return [Notice("tilting-not-converged", message, "error")]


def _below_zero(fit: TiltingFit) -> list[Notice]:
    found = [fit.robot.parameters[name] for name in fit.names]
    below = [p.name for p in found if p.value < -_BELOW * (p.deviation or math.inf)]
    if not below:
        return []
    return [
        Notice(
            "tilting-below-zero",
            f"{listed(below)}: found to be negative, which no spring, play or gap is. Check the signs of forces and "
            "joints, the masses in the robot file, and which configurations were compared.",
            "error",
        )
    ]


def _scatter(fit: TiltingFit, read: Inclinations) -> list[Notice]:
    if fit.excess <= _SCATTER:
        return []
    used = np.isfinite(fit.left)
    squares = np.where(used, fit.left, 0.0) ** 2
    left = np.sqrt(squares.sum(axis=(0, 2)) / np.maximum(used.sum(axis=(0, 2)), 1))
    worst = int(np.argmax(left))
    return [
        Notice(
            "inclinations-scatter",
            f"What is left of the changes of inclination is {fit.excess:.1f} times as large as their declared "
            f"deviations, most on {read.instruments.names[worst]} ({math.degrees(float(left[worst])):.2g} deg): an "
            "instrument moved, a force or payload is not as stated, or bearings and links give way too. Deviations are "
            "widened by that.",
            "error" if fit.excess > _WRONG else "warning",
        )
    ]


def _unseen(start: Robot, fit: TiltingFit, *, pushed: bool) -> list[Notice]:
    unseen = [name for name in fit.names if not seen(fit.robot.parameters[name])]
    upright = set(_upright(start))
    by_poses = [name for name in unseen if _number(name) in upright and not name.startswith("clearance")]
    others = [name for name in unseen if name not in by_poses]
    told = []
    if by_poses:
        cure = (
            "The poses under loads do not tell them either: push the flange sideways, one way and the other."
            if pushed
            else "They come from poses: at the same joint positions push the flange sideways, one way and the other, "
            "and give the poses of both as `pushed`."
        )
        told.append(
            Notice(
                "upright-unseen",
                f"{_stay(by_poses)}: gravity does not turn a joint whose axis stands "
                f"upright, and inclinometers do not see its turn. {cure}",
            )
        )
    if others:
        told.append(
            Notice(
                "tilting-unseen",
                f"{_stay(others)}: no change of load that was read tells them well. Read "
                "inclinometers behind these joints where the moment about or across their axes turns round; "
                "'truearm plan' with the device inclinometers chooses such postures.",
            )
        )
    return told


def _stay(names: Sequence[str]) -> str:
    return f"{listed(names)} {'stays about as it was' if len(names) == 1 else 'stay about as they were'} believed"


def _number(name: str) -> int:
    return int(name.rpartition("_")[2])


def _upright(robot: Robot) -> Iterable[int]:
    """Return the numbers of the joints whose axis stands upright wherever the arm moves."""
    at = robot.random_configurations(50, np.random.default_rng(0))
    kinematics, up = robot.forward_kinematics(at), upwards(robot)
    for joint in robot.layout.turning:
        across = np.linalg.norm(np.cross(kinematics.axis(robot.moving[joint]).T, up), axis=1)
        if across.max() < _UPRIGHT:
            yield joint + 1


def _unpaired(read: Inclinations) -> list[Notice]:
    if not read.unpaired:
        return []
    return [
        Notice(
            "unpaired",
            f"{counted(len(read.unpaired), 'configuration')} ({listed(read.unpaired)}) had no partner and "
            f"{'was' if len(read.unpaired) == 1 else 'were'} left out: those of the orders 1 and 2, 3 and 4 and so on "
            "are compared.",
            "note",
        )
    ]
