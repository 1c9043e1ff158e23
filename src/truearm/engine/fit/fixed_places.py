"""Frames that are known and held: where the base stands, where targets are on the flange, where fixtures stand.

An instrument whose frame is the robot's base, or a tool that was measured on a coordinate measuring machine, make a
calibration absolute (Patel 2017; Li et al. 2016): the base is not found from the readings, and what was
redundant with it, such as the height of axis 2 over the base, is observed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform


@dataclass(frozen=True)
class FixedPlaces:
    """What is known of base, targets and fixtures, and held while the rest is found."""

    base: Transform | None = None  #: ``T_world_base``; None if it is found.
    #: Where targets are on the flange, by name; of a point the rotation counts for nothing.
    targets: Mapping[str, Transform] = field(default_factory=dict)
    #: ``T_world_fixture`` by name; of a plane its origin is in the plane and its z axis is the normal.
    fixtures: Mapping[str, Transform] = field(default_factory=dict)

    def __bool__(self) -> bool:
        """Whether anything is held."""
        return self.base is not None or bool(self.targets) or bool(self.fixtures)

    @property
    def words(self) -> tuple[str, ...]:
        """What is held, in words."""
        base = () if self.base is None else ("base",)
        return (*base, *(f"target {name}" for name in self.targets), *(f"fixture {name}" for name in self.fixtures))

    def names(self, robot: Robot) -> tuple[str, ...]:
        """Return the parameters of a robot that are held."""
        own = [p.name for p in robot.parameters.values() if p.group == "base"] if self.base is not None else []
        own += [name for target in robot.targets if target.name in self.targets for name in target.chain.parameters]
        own += [
            name for fixture in robot.fixtures if fixture.name in self.fixtures for name in fixture.chain.parameters
        ]
        return tuple(own)

    def free_of(self, free: FreeParameters, robot: Robot) -> FreeParameters:
        """Return those of some parameters that are not held."""
        return free.without(self.names(robot))

    def locates(self, data: Dataset) -> bool:
        """Whether it says where the robot stands among what the readings see, where the readings do not."""
        return any(name in data.fixtures for name in self.fixtures)

    def seen_from(self, fixture: str) -> FixedPlaces:
        """Return what is held, with the frame of a fixture as the world."""
        if self.base is None or fixture not in self.fixtures:
            return FixedPlaces(targets=self.targets)
        from_it = np.linalg.inv(self.fixtures[fixture].matrix) @ self.base.matrix
        return FixedPlaces(Transform.from_matrix(from_it[:3, :3], from_it[:3, 3]), self.targets)


#: Base, targets and fixtures are all found.
NOTHING_FIXED: Final = FixedPlaces()
