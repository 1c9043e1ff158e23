"""The designs, assemblies and poses of the hexapod device."""

from __future__ import annotations

from truearm.measurement.hexapod.geometry import designs
from truearm.measurement.hexapod.poses import assemblies, distinct, near_equal, poses
from truearm.results.hexapod import HexapodPoses


def hexapod_enumerate() -> HexapodPoses:
    """Count designs, assemblies and poses of the device, and list the poses that teach much the same."""
    found = poses()
    return HexapodPoses(len(designs()), len(list(assemblies())), found, distinct(found), near_equal(found))
