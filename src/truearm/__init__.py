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

from truearm.version import __version__

if TYPE_CHECKING:
    from truearm.errors import InputError
    from truearm.jobs.axes import axes
    from truearm.jobs.calibrate import calibrate
    from truearm.jobs.check import check
    from truearm.jobs.compensate import compensate
    from truearm.jobs.convert import convert
    from truearm.jobs.demo import demo
    from truearm.jobs.devices import devices
    from truearm.jobs.distances import distances
    from truearm.jobs.example import example
    from truearm.jobs.export import export
    from truearm.jobs.export_robodk import export_robodk
    from truearm.jobs.fleet import fleet
    from truearm.jobs.hexapod_enumerate import hexapod_enumerate
    from truearm.jobs.hexapod_plan import hexapod_plan
    from truearm.jobs.hexapod_solve import hexapod_solve
    from truearm.jobs.hexapod_uncertainty import hexapod_uncertainty
    from truearm.jobs.hexapod_world_frame import hexapod_world_frame
    from truearm.jobs.import_circle import import_circle
    from truearm.jobs.import_guess import import_guess
    from truearm.jobs.import_hand_eye import import_hand_eye
    from truearm.jobs.import_matrices import import_matrices
    from truearm.jobs.import_robodk import import_robodk
    from truearm.jobs.import_ros import import_ros
    from truearm.jobs.import_sockets import import_sockets
    from truearm.jobs.import_table import import_table
    from truearm.jobs.import_ur_kinematics import import_ur_kinematics
    from truearm.jobs.influence import influence
    from truearm.jobs.inverse import inverse
    from truearm.jobs.iso9283_evaluate import iso9283_evaluate
    from truearm.jobs.iso9283_plan import iso9283_plan
    from truearm.jobs.iso9283_simulate import iso9283_simulate
    from truearm.jobs.lines import lines
    from truearm.jobs.load_data import load_data
    from truearm.jobs.load_robot import load_robot
    from truearm.jobs.measure import measure
    from truearm.jobs.new_robot import new_robot
    from truearm.jobs.path import path
    from truearm.jobs.plan import plan
    from truearm.jobs.plan_inclinometers import plan_inclinometers
    from truearm.jobs.poses import poses
    from truearm.jobs.revert import revert
    from truearm.jobs.robots import robots
    from truearm.jobs.show import show
    from truearm.jobs.simulate import simulate
    from truearm.jobs.simulate_inclinometers import simulate_inclinometers
    from truearm.jobs.sphere import sphere
    from truearm.jobs.study import study
    from truearm.jobs.tilting import tilting
    from truearm.jobs.tolerance import tolerance
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
    "axes",
    "calibrate",
    "check",
    "compensate",
    "convert",
    "demo",
    "devices",
    "distances",
    "example",
    "export",
    "export_robodk",
    "fleet",
    "hexapod_enumerate",
    "hexapod_plan",
    "hexapod_solve",
    "hexapod_uncertainty",
    "hexapod_world_frame",
    "import_circle",
    "import_guess",
    "import_hand_eye",
    "import_matrices",
    "import_robodk",
    "import_ros",
    "import_sockets",
    "import_table",
    "import_ur_kinematics",
    "influence",
    "inverse",
    "iso9283_evaluate",
    "iso9283_plan",
    "iso9283_simulate",
    "lines",
    "load_data",
    "load_robot",
    "measure",
    "new_robot",
    "path",
    "plan",
    "plan_inclinometers",
    "poses",
    "revert",
    "robots",
    "show",
    "simulate",
    "simulate_inclinometers",
    "sphere",
    "study",
    "tilting",
    "tolerance",
    "validate",
]

_HOME: Final = {
    "Calibration": "truearm.results.calibration",
    "Dataset": "truearm.measurement.dataset",
    "InputError": "truearm.errors",
    "Parameter": "truearm.modeling.parameters",
    "Payload": "truearm.modeling.parts",
    "Robot": "truearm.modeling.robot",
}


def __getattr__(name: str) -> Any:
    from truearm.jobs import JOBS  # not before: the command can be interrupted quietly once it has begun

    home = f"truearm.jobs.{name}" if name in JOBS else _HOME.get(name)
    if home is not None:
        return getattr(import_module(home), name)
    raise AttributeError(f"module 'truearm' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
