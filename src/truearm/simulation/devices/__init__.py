"""Instruments: what each sees of a robot, how well, and which readings are its own."""

from __future__ import annotations

from typing import Final

from truearm.errors import InputError, did_you_mean
from truearm.simulation.devices.artefacts import MARKERS, PLANAR_ARTEFACT, SPATIAL_ARTEFACT
from truearm.simulation.devices.device import Arm, Device, in_view_of, measured_with, seen_by
from truearm.simulation.devices.hexapod_poses import HEXAPOD
from truearm.simulation.devices.known_points import CALIBRATION_TABLE, TOUCH_UP
from truearm.simulation.devices.lengths import BALLBAR, STRINGS
from truearm.simulation.devices.pencil import DRAWN_CIRCLE
from truearm.simulation.devices.small_volumes import FIVE_LASERS, GAUGES, STEREO
from truearm.simulation.devices.touching import PLANE, POINT, SPHERE, TWO_SOCKETS, TWO_SPHERES
from truearm.simulation.devices.tracker import MEASUREMENT_ARM, TRACKER

__all__ = ["DEVICES", "Arm", "Device", "in_view_of", "measured_with", "named_device", "seen_by"]

DEVICES: Final[tuple[Device, ...]] = (
    TRACKER,
    MEASUREMENT_ARM,
    PLANAR_ARTEFACT,
    SPATIAL_ARTEFACT,
    MARKERS,
    BALLBAR,
    HEXAPOD,
    STRINGS,
    STEREO,
    FIVE_LASERS,
    GAUGES,
    PLANE,
    SPHERE,
    TWO_SPHERES,
    POINT,
    TWO_SOCKETS,
    CALIBRATION_TABLE,
    TOUCH_UP,
    DRAWN_CIRCLE,
)


def named_device(name: str) -> Device:
    """Return the device of this name.

    Raises:
        InputError: If there is none.
    """
    known = {device.name: device for device in DEVICES}
    if name in known:
        return known[name]
    raise InputError(
        "there is no device of this name",
        parameter="device",
        came=name,
        allowed=", ".join(known),
        cure=did_you_mean(name, known),
    )
