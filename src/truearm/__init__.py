"""truearm makes serial robots accurate.

>>> import truearm
>>> robot = truearm.load_robot("irb120")
>>> len(robot.joints)
6

``load_robot``, ``load_data`` and ``calibrate`` are the way from files to a :class:`Calibration`; the packages below
hold the parts it is made of. Importing ``truearm`` loads none of them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from truearm.errors import InputError
from truearm.version import __version__

if TYPE_CHECKING:
    from truearm.calibration import Calibration, calibrate, check, load_data, validate
    from truearm.robots import load_robot

__all__ = ["Calibration", "InputError", "__version__", "calibrate", "check", "load_data", "load_robot", "validate"]

_HOME = {
    "Calibration": "truearm.calibration",
    "calibrate": "truearm.calibration",
    "check": "truearm.calibration",
    "load_data": "truearm.calibration",
    "validate": "truearm.calibration",
    "load_robot": "truearm.robots",
}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'truearm' has no attribute {name!r}")
