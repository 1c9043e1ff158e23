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

__version__ = "0.1.0"

if TYPE_CHECKING:
    from truearm.errors import InputError as InputError
    from truearm.jobs.axes import axes as axes
    from truearm.jobs.calibrate import calibrate as calibrate
    from truearm.jobs.check import check as check
    from truearm.jobs.compensate import compensate as compensate
    from truearm.jobs.convert import convert as convert
    from truearm.jobs.demo import demo as demo
    from truearm.jobs.devices import devices as devices
    from truearm.jobs.distances import distances as distances
    from truearm.jobs.example import example as example
    from truearm.jobs.export import export as export
    from truearm.jobs.export_robodk import export_robodk as export_robodk
    from truearm.jobs.fleet import fleet as fleet
    from truearm.jobs.hexapod_enumerate import hexapod_enumerate as hexapod_enumerate
    from truearm.jobs.hexapod_plan import hexapod_plan as hexapod_plan
    from truearm.jobs.hexapod_solve import hexapod_solve as hexapod_solve
    from truearm.jobs.hexapod_uncertainty import hexapod_uncertainty as hexapod_uncertainty
    from truearm.jobs.hexapod_world_frame import hexapod_world_frame as hexapod_world_frame
    from truearm.jobs.import_circle import import_circle as import_circle
    from truearm.jobs.import_guess import import_guess as import_guess
    from truearm.jobs.import_hand_eye import import_hand_eye as import_hand_eye
    from truearm.jobs.import_matrices import import_matrices as import_matrices
    from truearm.jobs.import_robodk import import_robodk as import_robodk
    from truearm.jobs.import_ros import import_ros as import_ros
    from truearm.jobs.import_sockets import import_sockets as import_sockets
    from truearm.jobs.import_table import import_table as import_table
    from truearm.jobs.import_ur_kinematics import import_ur_kinematics as import_ur_kinematics
    from truearm.jobs.influence import influence as influence
    from truearm.jobs.inverse import inverse as inverse
    from truearm.jobs.iso9283_evaluate import iso9283_evaluate as iso9283_evaluate
    from truearm.jobs.iso9283_plan import iso9283_plan as iso9283_plan
    from truearm.jobs.iso9283_simulate import iso9283_simulate as iso9283_simulate
    from truearm.jobs.lines import lines as lines
    from truearm.jobs.load_data import load_data as load_data
    from truearm.jobs.load_robot import load_robot as load_robot
    from truearm.jobs.measure import measure as measure
    from truearm.jobs.new_robot import new_robot as new_robot
    from truearm.jobs.path import path as path
    from truearm.jobs.plan import plan as plan
    from truearm.jobs.plan_inclinometers import plan_inclinometers as plan_inclinometers
    from truearm.jobs.poses import poses as poses
    from truearm.jobs.revert import revert as revert
    from truearm.jobs.robots import robots as robots
    from truearm.jobs.show import show as show
    from truearm.jobs.simulate import simulate as simulate
    from truearm.jobs.simulate_inclinometers import simulate_inclinometers as simulate_inclinometers
    from truearm.jobs.sphere import sphere as sphere
    from truearm.jobs.study import study as study
    from truearm.jobs.tilting import tilting as tilting
    from truearm.jobs.tolerance import tolerance as tolerance
    from truearm.jobs.validate import validate as validate
    from truearm.measurement.dataset import Dataset as Dataset
    from truearm.modeling.parameters import Parameter as Parameter
    from truearm.modeling.parts import Payload as Payload
    from truearm.modeling.robot import Robot as Robot
    from truearm.results.calibration import Calibration as Calibration

#: Every job, in the order of the work, and where it is. A job is a function that takes objects, arrays or paths and
#: plain keywords, refuses what it cannot use with an :class:`InputError` that names the parameter, and returns a frozen
#: record.
JOBS: Final = {
    "load_robot": "truearm.jobs.load_robot",
    "show": "truearm.jobs.show",
    "load_data": "truearm.jobs.load_data",
    "import_table": "truearm.jobs.import_table",
    "import_guess": "truearm.jobs.import_guess",
    "import_matrices": "truearm.jobs.import_matrices",
    "import_robodk": "truearm.jobs.import_robodk",
    "import_circle": "truearm.jobs.import_circle",
    "import_sockets": "truearm.jobs.import_sockets",
    "import_hand_eye": "truearm.jobs.import_hand_eye",
    "import_ros": "truearm.jobs.import_ros",
    "import_ur_kinematics": "truearm.jobs.import_ur_kinematics",
    "check": "truearm.jobs.check",
    "calibrate": "truearm.jobs.calibrate",
    "tilting": "truearm.jobs.tilting",
    "validate": "truearm.jobs.validate",
    "distances": "truearm.jobs.distances",
    "plan": "truearm.jobs.plan",
    "plan_inclinometers": "truearm.jobs.plan_inclinometers",
    "poses": "truearm.jobs.poses",
    "path": "truearm.jobs.path",
    "measure": "truearm.jobs.measure",
    "simulate": "truearm.jobs.simulate",
    "simulate_inclinometers": "truearm.jobs.simulate_inclinometers",
    "inverse": "truearm.jobs.inverse",
    "robots": "truearm.jobs.robots",
    "devices": "truearm.jobs.devices",
    "axes": "truearm.jobs.axes",
    "tolerance": "truearm.jobs.tolerance",
    "lines": "truearm.jobs.lines",
    "iso9283_plan": "truearm.jobs.iso9283_plan",
    "iso9283_simulate": "truearm.jobs.iso9283_simulate",
    "iso9283_evaluate": "truearm.jobs.iso9283_evaluate",
    "influence": "truearm.jobs.influence",
    "sphere": "truearm.jobs.sphere",
    "hexapod_enumerate": "truearm.jobs.hexapod_enumerate",
    "hexapod_uncertainty": "truearm.jobs.hexapod_uncertainty",
    "hexapod_plan": "truearm.jobs.hexapod_plan",
    "hexapod_solve": "truearm.jobs.hexapod_solve",
    "hexapod_world_frame": "truearm.jobs.hexapod_world_frame",
    "compensate": "truearm.jobs.compensate",
    "revert": "truearm.jobs.revert",
    "convert": "truearm.jobs.convert",
    "export": "truearm.jobs.export",
    "export_robodk": "truearm.jobs.export_robodk",
    "study": "truearm.jobs.study",
    "fleet": "truearm.jobs.fleet",
    "new_robot": "truearm.jobs.new_robot",
    "example": "truearm.jobs.example",
    "demo": "truearm.jobs.demo",
}
_CLASSES: Final = {
    "Calibration": "truearm.results.calibration",
    "Dataset": "truearm.measurement.dataset",
    "InputError": "truearm.errors",
    "Parameter": "truearm.modeling.parameters",
    "Payload": "truearm.modeling.parts",
    "Robot": "truearm.modeling.robot",
}
__all__ = ["__version__", *_CLASSES, *JOBS]


def __getattr__(name: str) -> Any:
    home = JOBS.get(name) or _CLASSES.get(name)
    if home is None:
        raise AttributeError(f"module 'truearm' has no attribute {name!r}")
    return getattr(import_module(home), name)


def __dir__() -> list[str]:
    return __all__
