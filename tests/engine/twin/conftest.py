from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from truearm.engine.data.dataset import IntArray
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices.lengths import HexapodPoses

Reachable = tuple[Array, IntArray, IntArray, Array]


@pytest.fixture(scope="session", autouse=True)
def hexapod_poses_found_once() -> Iterator[None]:
    """Find what a robot reaches at the hexapod once: it takes a second, and chance has no say in it."""
    find, result = HexapodPoses._reachable, dict[tuple[object, ...], Reachable]()

    def once(self: HexapodPoses, nominal: Robot) -> Reachable:
        limits = tuple(joint.limits for joint in nominal.joints)
        key = (nominal.name, limits, nominal.base.matrix.tobytes(), *nominal.values.items())
        if key not in result:
            result[key] = find(self, nominal)
        return tuple(np.copy(values) for values in result[key])  # type: ignore[return-value]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(HexapodPoses, "_reachable", once)
        yield
