"""truearm makes serial robots accurate.

>>> import truearm
>>> robot = truearm.load_robot("irb120")
>>> len(robot.joints)
6

One function a job leads from files to results: :func:`load_robot`, :func:`load_data`, :func:`check`,
:func:`calibrate`, :func:`validate` and the others that ``dir(truearm)`` lists. Importing ``truearm`` loads none of
them.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from truearm.errors import InputError
from truearm.jobs import JOBS
from truearm.version import __version__

if TYPE_CHECKING:
    from truearm.jobs.calibrate import calibrate
    from truearm.jobs.check import check
    from truearm.jobs.compensate import compensate
    from truearm.jobs.convert import convert
    from truearm.jobs.demo import demo
    from truearm.jobs.example import example
    from truearm.jobs.export import export
    from truearm.jobs.load_data import load_data
    from truearm.jobs.load_robot import load_robot
    from truearm.jobs.new_robot import new_robot
    from truearm.jobs.revert import revert
    from truearm.jobs.validate import validate
    from truearm.measurement.dataset import Dataset
    from truearm.modeling.parameters import Parameter
    from truearm.modeling.parts import Payload
    from truearm.modeling.robot import Robot
    from truearm.results.calibration import Calibration

__all__ = [
    "Calibration",
    "Dataset",
    "InputError",
    "Parameter",
    "Payload",
    "Robot",
    "__version__",
    "calibrate",
    "check",
    "compensate",
    "convert",
    "demo",
    "example",
    "export",
    "load_data",
    "load_robot",
    "new_robot",
    "revert",
    "validate",
]

_HOME: Final = {
    "Calibration": "truearm.results.calibration",
    "Dataset": "truearm.measurement.dataset",
    "Parameter": "truearm.modeling.parameters",
    "Payload": "truearm.modeling.parts",
    "Robot": "truearm.modeling.robot",
    **{job: f"truearm.jobs.{job}" for job in JOBS},
}


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'truearm' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
