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
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

from truearm.engine.base.version import __version__

if TYPE_CHECKING:
    from truearm import hexapod as hexapod
    from truearm import iso9283 as iso9283
    from truearm.axis_circles.axes import axes as axes
    from truearm.bags.import_ros import import_ros as import_ros
    from truearm.board.import_hand_eye import import_hand_eye as import_hand_eye
    from truearm.calibration.calibrate import calibrate as calibrate
    from truearm.calibration.result import Calibration as Calibration
    from truearm.checking.check import check as check
    from truearm.compensation.jobs import compensate as compensate
    from truearm.compensation.jobs import path as path
    from truearm.compensation.jobs import revert as revert
    from truearm.drawn_circle.import_circle import import_circle as import_circle
    from truearm.engine.base.errors import InputError as InputError
    from truearm.engine.command.loading import load_data as load_data
    from truearm.engine.command.loading import load_robot as load_robot
    from truearm.engine.data.dataset import Dataset as Dataset
    from truearm.engine.robot.parameters import Parameter as Parameter
    from truearm.engine.robot.parts import Payload as Payload
    from truearm.engine.robot.robot import Robot as Robot
    from truearm.fleets.fleet import fleet as fleet
    from truearm.hexapod.jobs import hexapod_enumerate as hexapod_enumerate
    from truearm.hexapod.jobs import hexapod_plan as hexapod_plan
    from truearm.hexapod.jobs import hexapod_solve as hexapod_solve
    from truearm.hexapod.jobs import hexapod_uncertainty as hexapod_uncertainty
    from truearm.hexapod.jobs import hexapod_world_frame as hexapod_world_frame
    from truearm.importing.jobs import import_guess as import_guess
    from truearm.importing.jobs import import_matrices as import_matrices
    from truearm.importing.jobs import import_robodk as import_robodk
    from truearm.importing.jobs import import_sockets as import_sockets
    from truearm.importing.jobs import import_table as import_table
    from truearm.inclinometers.jobs import plan_inclinometers as plan_inclinometers
    from truearm.inclinometers.jobs import simulate_inclinometers as simulate_inclinometers
    from truearm.inclinometers.jobs import tilting as tilting
    from truearm.iso9283.jobs import iso9283_evaluate as iso9283_evaluate
    from truearm.iso9283.jobs import iso9283_plan as iso9283_plan
    from truearm.iso9283.jobs import iso9283_simulate as iso9283_simulate
    from truearm.measuring.measure import measure as measure
    from truearm.planning.plan import plan as plan
    from truearm.planning.poses import poses as poses
    from truearm.robot_files.jobs import convert as convert
    from truearm.robot_files.jobs import export as export
    from truearm.robot_files.jobs import export_robodk as export_robodk
    from truearm.robot_files.jobs import import_ur_kinematics as import_ur_kinematics
    from truearm.robot_files.jobs import inverse as inverse
    from truearm.robot_files.jobs import robots as robots
    from truearm.robot_files.jobs import show as show
    from truearm.simulation.jobs import devices as devices
    from truearm.simulation.jobs import influence as influence
    from truearm.simulation.jobs import simulate as simulate
    from truearm.starting.jobs import demo as demo
    from truearm.starting.jobs import example as example
    from truearm.starting.jobs import new_robot as new_robot
    from truearm.starting.study import study as study
    from truearm.validation.jobs import distances as distances
    from truearm.validation.jobs import lines as lines
    from truearm.validation.jobs import sphere as sphere
    from truearm.validation.jobs import tolerance as tolerance
    from truearm.validation.jobs import validate as validate

    class read:  # noqa: N801
        """Imports by short names: ``truearm.read.table`` is ``truearm.import_table``."""

        from truearm.bags.import_ros import import_ros as ros
        from truearm.board.import_hand_eye import import_hand_eye as hand_eye
        from truearm.drawn_circle.import_circle import import_circle as circle
        from truearm.importing.jobs import import_guess as guess
        from truearm.importing.jobs import import_matrices as matrices
        from truearm.importing.jobs import import_robodk as robodk
        from truearm.importing.jobs import import_sockets as sockets
        from truearm.importing.jobs import import_table as table
        from truearm.robot_files.jobs import import_ur_kinematics as ur_kinematics


#: Every job, in the order of the work, and where it is. A job is a function that takes objects, arrays or paths and
#: plain keywords, refuses what it cannot use with an :class:`InputError` that names the parameter, and returns a frozen
#: record.
JOBS: Final = {
    "load_robot": "truearm.engine.command.loading",
    "show": "truearm.robot_files.jobs",
    "load_data": "truearm.engine.command.loading",
    "import_table": "truearm.importing.jobs",
    "import_guess": "truearm.importing.jobs",
    "import_matrices": "truearm.importing.jobs",
    "import_robodk": "truearm.importing.jobs",
    "import_circle": "truearm.drawn_circle.import_circle",
    "import_sockets": "truearm.importing.jobs",
    "import_hand_eye": "truearm.board.import_hand_eye",
    "import_ros": "truearm.bags.import_ros",
    "import_ur_kinematics": "truearm.robot_files.jobs",
    "check": "truearm.checking.check",
    "calibrate": "truearm.calibration.calibrate",
    "tilting": "truearm.inclinometers.jobs",
    "validate": "truearm.validation.jobs",
    "distances": "truearm.validation.jobs",
    "plan": "truearm.planning.plan",
    "plan_inclinometers": "truearm.inclinometers.jobs",
    "poses": "truearm.planning.poses",
    "path": "truearm.compensation.jobs",
    "measure": "truearm.measuring.measure",
    "simulate": "truearm.simulation.jobs",
    "simulate_inclinometers": "truearm.inclinometers.jobs",
    "inverse": "truearm.robot_files.jobs",
    "robots": "truearm.robot_files.jobs",
    "devices": "truearm.simulation.jobs",
    "axes": "truearm.axis_circles.axes",
    "tolerance": "truearm.validation.jobs",
    "lines": "truearm.validation.jobs",
    "iso9283_plan": "truearm.iso9283.jobs",
    "iso9283_simulate": "truearm.iso9283.jobs",
    "iso9283_evaluate": "truearm.iso9283.jobs",
    "influence": "truearm.simulation.jobs",
    "sphere": "truearm.validation.jobs",
    "hexapod_enumerate": "truearm.hexapod.jobs",
    "hexapod_uncertainty": "truearm.hexapod.jobs",
    "hexapod_plan": "truearm.hexapod.jobs",
    "hexapod_solve": "truearm.hexapod.jobs",
    "hexapod_world_frame": "truearm.hexapod.jobs",
    "compensate": "truearm.compensation.jobs",
    "revert": "truearm.compensation.jobs",
    "convert": "truearm.robot_files.jobs",
    "export": "truearm.robot_files.jobs",
    "export_robodk": "truearm.robot_files.jobs",
    "study": "truearm.starting.study",
    "fleet": "truearm.fleets.fleet",
    "new_robot": "truearm.starting.jobs",
    "example": "truearm.starting.jobs",
    "demo": "truearm.starting.jobs",
}
_CLASSES: Final = {
    "Calibration": "truearm.calibration.result",
    "Dataset": "truearm.engine.data.dataset",
    "InputError": "truearm.engine.base.errors",
    "Parameter": "truearm.engine.robot.parameters",
    "Payload": "truearm.engine.robot.parts",
    "Robot": "truearm.engine.robot.robot",
}
#: Features whose jobs have names of their own there.
_FEATURES: Final = ("hexapod", "iso9283")
__all__ = ["__version__", "read", *_FEATURES, *_CLASSES, *JOBS]


def __getattr__(name: str) -> Any:
    if name in _FEATURES:
        return import_module(f"truearm.{name}")
    if name == "read":
        jobs = {one.removeprefix("import_"): __getattr__(one) for one in JOBS if one.startswith("import_")}
        return globals().setdefault("read", SimpleNamespace(**jobs))
    home = JOBS.get(name) or _CLASSES.get(name)
    if home is None:
        raise AttributeError(f"module 'truearm' has no attribute {name!r}")
    return getattr(import_module(home), name)


def __dir__() -> list[str]:
    return __all__
