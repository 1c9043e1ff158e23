"""A tool changer: the tool sits a little differently after every attachment (Nubiola, 3.5).

The coupling lies at the flange, so the tool is shifted and turned about the flange's origin. What stands far from it
moves most.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.engine.robot.transform import rotation_from_quaternion
from truearm.engine.twin.twin import Twin

#: Deviation of a coordinate [m] and of a turn about each axis [rad]. Nubiola (3.5) saw T3, 195 mm from the flange's
#: origin, "as much as 0.100 mm" off between two attachments: that is the largest of ten pairs, three times in four due
#: to the turns. ATI states 0.010 mm for its QC-5.
SHIFT: Final = 0.010e-3
TURN: Final = 0.15e-3


@dataclass(frozen=True)
class ToolChanger:
    """A tool changer in use."""

    rng: np.random.Generator  #: For what it does not repeat.
    shift: float = SHIFT  #: Standard deviation of each coordinate of the tool [m].
    turn: float = TURN  #: Standard deviation of its turn about each axis of the flange [rad].

    def attached(self, twin: Twin) -> Twin:
        """Return the twin with its tool attached anew: its targets moved as one body on the flange.

        The tool's weight stays where it was: a tenth of a millimetre changes no moment that matters.
        """
        half = np.array([1.0, *(self.turn / 2 * self.rng.standard_normal(3))])
        R = rotation_from_quaternion(half / np.linalg.norm(half))
        p = self.shift * self.rng.standard_normal(3)
        robot, values = twin.robot, twin.robot.values
        targets: dict[str, list[float]] = {}
        for target in robot.targets:
            place = np.array([values[target.parameter(axis)] for axis in "xyz"])
            targets[target.name] = (R @ place + p).tolist()
        return replace(twin, robot=robot.with_frames(robot.base, targets))
