"""One function a job: the one door for Python, the command, and whatever is built on them.

A job takes objects, arrays or paths and plain keywords, refuses what it cannot use with an
:class:`~truearm.errors.InputError` that names the parameter, and returns a frozen record. It is named like its file,
and listed in :data:`JOBS`, from which :mod:`truearm` imports it.
"""

from __future__ import annotations

from typing import Final

#: Every job, in the order of the work.
JOBS: Final = (
    "load_robot",
    "show",
    "load_data",
    "import_table",
    "import_guess",
    "import_matrices",
    "import_robodk",
    "import_circle",
    "import_sockets",
    "import_hand_eye",
    "import_ros",
    "import_ur_kinematics",
    "check",
    "calibrate",
    "tilting",
    "validate",
    "distances",
    "plan",
    "plan_inclinometers",
    "poses",
    "path",
    "measure",
    "simulate",
    "simulate_inclinometers",
    "inverse",
    "robots",
    "devices",
    "axes",
    "tolerance",
    "lines",
    "iso9283_plan",
    "iso9283_simulate",
    "iso9283_evaluate",
    "influence",
    "sphere",
    "hexapod_enumerate",
    "hexapod_uncertainty",
    "hexapod_plan",
    "hexapod_solve",
    "hexapod_world_frame",
    "compensate",
    "revert",
    "convert",
    "export",
    "export_robodk",
    "study",
    "fleet",
    "new_robot",
    "example",
    "demo",
)
