"""How joints follow their commands: each a damped spring between command and joint, as a position loop makes it.

``q'' = w^2 (u - q) + 2 D w (k u' - q')`` with command ``u``, natural frequency ``w``, damping ratio ``D`` and the share
``k`` of the command's speed that is fed forward. Commands run straight from one to the next. For such a command ``u + 2
D (k - 1) / w u'`` is a solution, and what is left decays as a free oscillation: every step is exact, however long.
Source: closed forms of the linear oscillator, as in any text on control.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array

#: What is left of a free oscillation when it is no longer followed.
_GONE: Final = 1e-18
#: Frequencies of a free motion nearer to each other than this share are one.
_CRITICAL: Final = 1e-8


@dataclass(frozen=True)
class Servo:
    """The position loop of the joints."""

    frequency: float  #: Natural frequency without damping [rad/s].
    damping: float  #: Ratio; below 1 the joint overshoots.
    velocity: float = math.inf  #: velocity, acceleration: what a joint cannot exceed [rad/s, rad/s^2 or m/s, m/s^2].
    acceleration: float = math.inf
    #: Share of the command's speed that is fed forward: 1 follows a steady motion without lag.
    feedforward: float = 0.0

    def __post_init__(self) -> None:
        for name in ("frequency", "damping", "velocity", "acceleration"):
            if not getattr(self, name) > 0 or (name in ("frequency", "damping") and math.isinf(getattr(self, name))):
                raise InputError(
                    "it must be a positive number", where=name, came=getattr(self, name), allowed="above 0"
                )

    def follow(self, command: Array, step: float, start: Array | None = None) -> tuple[Array, Array]:
        """Return positions and velocities of joints that follow a command from rest.

        Args:
            command: ``(n, joints)`` [rad or m], `step` [s] apart.
            start: Where the joints stand at first, ``(joints,)``; None for the first command.

        Returns:
            position, velocity: ``(n, joints)`` each, at the times of the commands. Where a limit is met, the
                acceleration of that step is constant: the one that keeps to the limit.
        """
        command = np.asarray(command, float)
        first = command[0] if start is None else np.asarray(start, float)
        position, velocity = self._unlimited(command, step, first)
        before = np.concatenate([np.zeros((1, command.shape[1])), velocity[:-1]])
        changes = np.abs(velocity - before).max(initial=0.0)
        if np.abs(velocity).max(initial=0.0) <= self.velocity and changes <= self.acceleration * step:
            return position, velocity
        return self._limited(command, step, first)

    def _unlimited(self, command: Array, step: float, first: Array) -> tuple[Array, Array]:
        """Return the motion by what every command adds to it: decaying oscillations, summed."""
        n = len(command)
        slope = np.diff(command, axis=0) / step
        taps = min(n, self._memory(step))
        decay = self._free(step * np.arange(1, taps + 1, dtype=float))
        before = np.concatenate([np.eye(2)[None], decay[: taps - 1]])
        answers = (before - decay) @ np.array([self._lag, 1.0])  # to a slope of one step, after 0, 1 .. steps
        position, velocity = command.copy(), np.zeros_like(command)
        for j in range(command.shape[1]):
            for k, into in ((0, position), (1, velocity)):
                into[1:, j] += np.convolve(slope[:, j], answers[:, k])[: n - 1]
        off = first - command[0]
        if off.any():
            rest = self._free(step * np.arange(n, dtype=float))
            position += rest[:, 0, 0, None] * off
            velocity += rest[:, 1, 0, None] * off
        return position, velocity

    def _limited(self, command: Array, step: float, first: Array) -> tuple[Array, Array]:
        """Return the motion step by step, with the limits."""
        decay = self._free(np.array([step]))[0]
        position, velocity = np.empty_like(command), np.empty_like(command)
        q, v = first, np.zeros(command.shape[1])
        position[0], velocity[0] = q, v
        for k in range(1, len(command)):
            slope = (command[k] - command[k - 1]) / step
            off, speed = q - command[k - 1] - self._lag * slope, v - slope
            free = decay[0, 0] * off + decay[0, 1] * speed + command[k] + self._lag * slope
            wanted = decay[1, 0] * off + decay[1, 1] * speed + slope
            most = self.acceleration * step
            held = np.clip(np.clip(wanted, v - most, v + most), -self.velocity, self.velocity)
            q = np.where(held == wanted, free, q + (v + held) / 2 * step)
            v = held
            position[k], velocity[k] = q, v
        return position, velocity

    @property
    def _lag(self) -> float:
        return 2.0 * self.damping * (self.feedforward - 1.0) / self.frequency

    def _memory(self, step: float) -> int:
        """Return after how many steps nothing is left of a free oscillation."""
        w, d = self.frequency, self.damping
        slowest = d * w if d <= 1 else w * (d - math.sqrt(d * d - 1))
        return max(2, math.ceil(-2.0 * math.log(_GONE) / (slowest * step)))

    def _free(self, time: Array) -> Array:
        """Return what becomes of position and velocity in a time of free motion, ``(n, 2, 2)``."""
        w, d = self.frequency, self.damping
        beside = d * d - 1.0
        t = np.asarray(time, float)
        if abs(beside) < _CRITICAL:
            fall, c, s = np.exp(-w * t), np.ones_like(t), t
        elif beside < 0:
            turn = w * math.sqrt(-beside)
            fall, c, s = np.exp(-d * w * t), np.cos(turn * t), np.sin(turn * t) / turn
        else:
            rate = w * math.sqrt(beside)
            slow, fast = np.exp((rate - d * w) * t), np.exp((-rate - d * w) * t)
            fall, c, s = np.ones_like(t), (slow + fast) / 2, (slow - fast) / (2 * rate)
        return np.stack(
            [
                np.stack([fall * (c + d * w * s), fall * s], axis=-1),
                np.stack([-fall * w * w * s, fall * (c - d * w * s)], axis=-1),
            ],
            axis=-2,
        )
