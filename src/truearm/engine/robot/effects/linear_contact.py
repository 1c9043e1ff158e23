"""Clearance tilt as the document has it: the contact angle is linear in the moments (Patel, 5.16)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.clearance import SEATED, Clearance


@dataclass(frozen=True)
class LinearContactClearance(Clearance):
    """Clearance tilt with the document's contact angle, gamma = pi/2 |M_x| / (|M_x| + |M_y|) (Patel, 5.16).

    It is up to 4 deg away from the exact one, and stands for the document's own numbers.
    """

    name: ClassVar[str] = "clearance-linear-contact"
    selectable: ClassVar[bool] = False

    def contact(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return sine and cosine of the contact angle, signed like the moments x and y, as far as it is seated."""
        total = np.abs(x) + np.abs(y)
        gamma = 0.5 * np.pi * np.abs(x) / np.where(total > 0.0, total, 1.0)
        seated = np.tanh(np.hypot(x, y) / SEATED)
        return seated * np.sign(x) * np.sin(gamma), seated * np.sign(y) * np.cos(gamma)
