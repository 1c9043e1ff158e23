"""How inclinometers sit on their links, found from the angles themselves before any change is used.

Only changes of inclination are fitted, so the zero of an instrument does not matter. How it is turned on its link does
where the link turns, and axes that are exchanged or reversed would make every change wrong. So each instrument is
turned, from each of the 24 ways in which its axes can lie along those of the link, until its angles follow the nominal
robot best, with zeros of its own. Where the way that the file states fits, small turns from it are taken over; where
another one fits and the stated one does not, the readings are refused.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import permutations, product
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, listed
from truearm.engine.data.inclinations import Inclinations
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.inclinometers.fit import link_ends, upwards

#: What an uncalibrated arm may leave of the angles, root mean square [rad].
_FITS: Final = math.radians(3.0)
#: A turn that is worth a word [rad].
_NOTED_TURN: Final = math.radians(5.0)
#: An instrument that is turned further does not sit as the file states [rad].
_AS_STATED: Final = math.radians(30.0)
#: How far an instrument sits from one of the 24 ways, and its zero, one standard deviation [rad].
_TURN: Final = 0.2
_ZERO: Final = 0.5
#: What is left of an angle where all is well [rad].
_SIGMA: Final = math.radians(1.0)
#: Share of what the stated way leaves that another one may leave at most to be believed.
_BETTER: Final = 1 / 3
_ROUNDS: Final = 15
#: Configurations from which on the angles of an instrument tell how it sits; with fewer it sits as the file says.
_LEAST: Final = 8


@dataclass(frozen=True, eq=False)
class Mounting:
    """How instruments sit."""

    mounts: Array  #: Rotation from each link's frame to its instrument's, ``(instruments, 3, 3)``.
    #: What each axis reads more than it stands above the horizontal [rad], ``(instruments, 3)``; NaN where it was never
    #: read.
    zeros: Array
    notices: tuple[Notice, ...]  #: What to know about them.

    @property
    def turns(self) -> Array:
        """How far each instrument is turned from how the file states it [rad], ``(instruments,)``."""
        return np.array([_turn_of(mount) for mount in self.mounts])


INSTRUMENT_TURNED: Final = Rule("instrument-turned", "note", "an instrument sits turned by more than 5 deg on its link")


def find_mounting(robot: Robot, read: Inclinations) -> Mounting:
    """Find how instruments sit on their links.

    Args:
        robot: Nominal, or as far as it is known.
        read: With the joint positions of the model.

    Raises:
        InputError: If the angles of an instrument do not follow the robot as stated: its axes are exchanged or
            reversed, it sits on another link, or the joint positions are not this robot's.
    """
    at = robot.loaded(read.postures(robot))
    kinematics, up = robot.forward_kinematics(at), upwards(robot)
    plumb = np.stack([up @ kinematics.matrix(end) for end in link_ends(robot)])  # (links, n, 3)
    mounts, zeros, notices = [], [], []
    for number, (name, link) in enumerate(zip(read.instruments.names, read.instruments.links, strict=True)):
        angle = read.angle[:, number]
        mount, zero, left = (array[0] for array in _turned(plumb[link], angle, np.eye(3)[None]))
        few = int(np.isfinite(angle).any(axis=1).sum()) < _LEAST  # too few to tell a turn from a zero
        if few or left > _FITS or _turn_of(mount) > _AS_STATED:
            if not few and _unlike(plumb[link], angle) > _FITS:
                _refuse(read.source, name, link, plumb, angle)
            mount, zero = np.eye(3), _zeros_as_stated(plumb[link], angle)
        mounts.append(mount)
        zeros.append(np.where(np.isfinite(angle).any(axis=0), zero, np.nan))
    mounting = Mounting(np.array(mounts), np.array(zeros), ())
    turned = [
        f"{name} by {math.degrees(turn):.1f} deg"
        for name, turn in zip(read.instruments.names, mounting.turns.tolist(), strict=True)
        if turn > _NOTED_TURN
    ]
    if turned:
        notices.append(
            INSTRUMENT_TURNED(
                f"By their angles instruments sit turned on their links: {listed(turned)}. This is taken into account."
            )
        )
    return Mounting(mounting.mounts, mounting.zeros, tuple(notices))


def _turn_of(R: Array) -> float:
    """Return the angle of a rotation [rad]."""
    return math.acos(min(max(0.5 * (float(np.trace(R)) - 1.0), -1.0), 1.0))


def _ways() -> Array:
    """Return the 24 rotations that bring axes onto axes, the one that changes nothing first."""
    ways = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            R = np.zeros((3, 3))
            R[order, range(3)] = signs
            if np.linalg.det(R) > 0.0:
                ways.append(R)
    return np.array(ways)


def _turned(plumb: Array, angle: Array, start: Array) -> tuple[Array, Array, Array]:
    """Turn an instrument from each of some ways until its angles follow the robot.

    Args:
        plumb: Upwards in the link's frame, ``(n, 3)``.
        angle: ``(n, 3)`` [rad], NaN where none was read.
        start: ``(ways, 3, 3)``.

    Returns:
        Rotations ``(ways, 3, 3)``, zeros ``(ways, 3)`` [rad], and what is left of the angles, root mean square [rad],
        ``(ways,)``.
    """
    is_read = np.isfinite(angle)
    M, w, zero = start.copy(), np.zeros((len(start), 3)), np.zeros((len(start), 3))
    weight = np.diag(np.r_[np.full(3, (_SIGMA / _TURN) ** 2), np.full(3, (_SIGMA / _ZERO) ** 2)])
    for _ in range(_ROUNDS):
        r, J = _residual(plumb, angle, is_read, M, zero)
        N = np.einsum("waip,waiq->wpq", J, J) + weight
        g = np.einsum("waip,wai->wp", J, r) + np.concatenate([w, zero], axis=1) @ weight
        step = np.clip(-np.linalg.solve(N, g[..., None])[..., 0], -0.5, 0.5)
        w, zero = w + step[:, :3], zero + step[:, 3:]
        M = M @ _rotations(step[:, :3])
    r, _ = _residual(plumb, angle, is_read, M, zero)
    return M, zero, np.asarray(np.sqrt((r**2).sum(axis=(1, 2)) / max(int(is_read.sum()), 1)))


def _residual(plumb: Array, angle: Array, is_read: Array, M: Array, zero: Array) -> tuple[Array, Array]:
    """Return predicted less read angles, each times its cosine, and the derivative by turn and zero."""
    rising = np.einsum("ni,wia->wna", plumb, M)
    cosine = np.sqrt(np.maximum(1.0 - rising**2, 0.0))
    predicted = np.arcsin(np.clip(rising, -1.0, 1.0))
    r = np.where(is_read, cosine * (predicted + zero[:, None] - np.where(is_read, angle, 0.0)), 0.0)
    J = np.zeros((*r.shape, 6))
    for axis, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        J[:, :, j, axis] = rising[:, :, k]  # a turn about x takes y to z, and z to -y
        J[:, :, k, axis] = -rising[:, :, j]
        J[:, :, axis, 3 + axis] = cosine[:, :, axis]
    return r, np.where(is_read[..., None], J, 0.0)


def _rotations(w: Array) -> Array:
    """Return the rotations of rotation vectors ``(ways, 3)``."""
    size = np.maximum(np.linalg.norm(w, axis=1), 1e-12)[:, None, None]
    x, y, z = w.T
    zero = np.zeros(len(w))
    S = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), -1, 0) / size
    return np.asarray(np.eye(3) + np.sin(size) * S + (1.0 - np.cos(size)) * S @ S)


def _unlike(plumb: Array, angle: Array) -> float:
    """Return what angles as they are stated leave, but for a zero of each axis, root mean square [rad]."""
    apart = np.arcsin(np.clip(plumb, -1.0, 1.0)) - angle
    read = np.isfinite(apart).any(axis=0)
    apart = apart[:, read] - np.nanmean(apart[:, read], axis=0)
    return float(np.sqrt(np.nanmean(apart**2)))


def _zeros_as_stated(plumb: Array, angle: Array) -> Array:
    """Return the zeros of the axes of an instrument that sits as stated [rad], ``(3,)``; NaN where none was read."""
    apart = angle - np.arcsin(np.clip(plumb, -1.0, 1.0))
    known = np.isfinite(apart)
    return np.where(
        known.any(axis=0), np.where(known, apart, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1), np.nan
    )


def _refuse(source: str, name: str, link: int, plumb: Array, angle: Array) -> None:
    """Refuse angles that do not follow the robot, and say what would."""
    left = _unlike(plumb[link], angle)
    axes = [number for number in range(3) if np.isfinite(angle[:, number]).any()]
    for sign in (1.0, -1.0) if len(axes) == 3 else (1.0,):
        mounts, _, others = _turned(plumb[link], sign * angle, _ways())
        best = int(np.argmin(others))
        if others[best] < min(_BETTER * left, _FITS):
            way = sign * mounts[best]
            along = [int(np.argmax(np.abs(way[:, axis]))) for axis in axes]
            words = [
                f"{'xyz'[axis]} is {'-' if way[to, axis] < 0 else ''}{'xyz'[to]}"
                for axis, to in zip(axes, along, strict=True)
                if to != axis or way[to, axis] < 0
            ]
            raise InputError(
                "the axes of an inclinometer are exchanged or reversed",
                where=f"{source}, {name}",
                came=f"angles that miss the robot's by {math.degrees(left):.1f} deg; they fit if {listed(words)}",
                allowed="angles of the link's own x, y and z above the horizontal, positive upwards",
                cure="Rename the columns of this instrument, or reverse their signs.",
            )
    elsewhere = [float(_turned(other, angle, np.eye(3)[None])[2][0]) for other in plumb]
    best = int(np.argmin(elsewhere))
    if elsewhere[best] < min(_BETTER * left, _FITS):
        cure = f"They fit link {best + 1}: correct the column link."
    else:
        cure = "Check the robot, the order and signs of the joints, and how the robot is mounted (`gravity`)."
    raise InputError(
        "the angles of an inclinometer do not follow the robot at these joint positions",
        where=f"{source}, {name}",
        came=f"{math.degrees(left):.1f} deg off, root mean square",
        allowed=f"{math.degrees(_FITS):g} deg, however the instrument is turned and whatever its zero",
        cure=cure,
    )
