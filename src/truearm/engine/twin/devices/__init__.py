"""Instruments: what each sees of a robot, how well, and which readings are its own."""

from __future__ import annotations

from typing import Final

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.twin.devices.device import MEASUREMENT_ARM, TRACKER, Arm, Device, in_view_of, measured_with, seen_by
from truearm.engine.twin.devices.lengths import BALLBAR, CALIBRATION_TABLE, HEXAPOD, STRINGS, TOUCH_UP
from truearm.engine.twin.devices.pencil import DRAWN_CIRCLE
from truearm.engine.twin.devices.touching import (
    FIVE_LASERS,
    GAUGES,
    MARKERS,
    PLANAR_ARTEFACT,
    PLANE,
    POINT,
    SPATIAL_ARTEFACT,
    SPHERE,
    STEREO,
    TWO_SOCKETS,
    TWO_SPHERES,
)

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
