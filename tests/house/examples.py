"""For every job a call that works, small and fast: the contract suite bends its arguments one by one."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from tests.answered import compensate
from tests.axis_circles.test_axes import runs
from tests.performance_plan import small_plan
from tests.ros_bags import joint_messages, recorded, target_messages, write_ros1
from tests.simulated import campaign
from tests.ur_controller import UR10_CONF

from truearm.engine.data.hexapod import triangle
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.robot.inverse.kinematics import inverse
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import measure
from truearm.hexapod.reachable import with_cups
from truearm.iso9283.planning.plan_file import PLAN, ROBOT, plan_text
from truearm.iso9283.simulating.simulate import FILES as SIMULATED_FILES

Arguments = dict[str, Any]


def data_file(folder: Path) -> Path:
    path = folder / "data.csv"
    if not path.exists():
        _, data = campaign("irb120", 20, 0.05e-3, 1)
        path.write_text(csv_text(data))
    return path


def _recorded(folder: Path, name: str) -> Path:
    """Return a file that another job has written, so that this job needs none but its own."""
    path = folder / name
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        shutil.copyfile(Path(__file__).parents[1] / "recordings" / "inputs" / path.name, path)
    return path


def calibrated(folder: Path) -> Path:
    return _recorded(folder, "result/calibrated.yaml")


def _poses(_: Path) -> Arguments:
    """Return two poses of an IRB 120 that are easily reached."""
    q = np.radians([[10.0, 20.0, -30.0, 40.0, 50.0, 60.0], [-70.0, 30.0, 0.0, -20.0, 40.0, 0.0]])
    at = load_robot("irb120").forward_kinematics(q)
    return {
        "robot": "irb120",
        "poses": at.position.T,
        "rotations": at.matrix(),
        "seed_joints": q,
        "branch": "front-up-noflip",
        "wrench": (0.0, 5.0, 0.0, 0.0, 0.0, 0.1),
        "wrench_frame": "tool",
    }


def _written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


_CUBE = "truearm: truearm-cube/1\nunits: {length: mm}\ncentre: [350, 0, 350]\nside: 200\n"
#: Where a target of the IRB 120 is on the flange.
_KNOWN = """\
truearm: truearm-cell/1
units: {length: mm, angle: deg}
tools:
  "2": {of: flange, translation: [75, 93.7, 215]}
"""


ROBODK = "J1,J2,J3,J4,J5,J6,X,Y,Z,RX,RY,RZ,TX,TY,TZ,TRX,TRY,TRZ\n10,20,30,0,45,90,500,20,800,0,0,90,0,0,50,0,0,0\n"


def _matrices(folder: Path) -> Arguments:
    joints = _written(folder / "joints.txt", "0 10 20 30 40 50\n5 10 25 30 45 50\n")
    points = _written(folder / "points.txt", "100 200 300\n0 0 0\n")
    names = {"targets": {"1": points}, "references": {"base": points}}
    return {"joints_file": joints, **names, "angle_unit": "deg", "length_unit": "mm"}


def table(folder: Path) -> Arguments:
    mapping = """\
truearm: truearm-mapping/1
length_unit: mm
configuration: {each: row}
joints: {columns: [q1, q2], unit: deg}
readings: [{target: tip, x: x, y: y, z: z}]
"""
    rows = "q1,q2,x,y,z\n10,20,100,200,300\n15,25,110,210,310\n"
    return {"file": _written(folder / "table.csv", rows), "mapping": _written(folder / "mapping.yaml", mapping)}


def _circle(folder: Path) -> Arguments:
    from tests.drawn_circle.test_drawn_circles import drawn

    rows = "configuration,joint_1 [deg],joint_2 [deg],angle [deg],height [mm]\n1,10,20,0,0.5\n2,12,22,180,-0.2\n"
    points = _written(folder / "page.csv", rows)
    return {"scans": {"a": drawn(folder / "page.png")}, "points": {"a": points}, "dpi": 300.0, "sigma": 2e-5}


def _sockets(folder: Path) -> Arguments:
    rows = "configuration,joint_1 [deg],joint_2 [deg],socket\n1,10,20,left\n2,12,22,right\n3,15,25,left\n"
    return {"file": _written(folder / "sockets.csv", rows), "apart": "200mm,0.02mm", "ball": "25mm", "sigma": 2e-5}


def _recording(folder: Path) -> Arguments:
    times, joints, seen, positions, turns = recorded(stand=1.2, move=0.3, joint_rate=50.0)
    messages = [*joint_messages(times, joints), *target_messages(seen, positions, turns)]
    names = tuple(f"joint_{number}" for number in range(1, 7))
    return {
        "file": write_ros1(folder / "cell.bag", messages),
        "targets": {"tip": "/tracker/pose"},
        "joint_topic": "/joint_states",
        "joint_names": names,
    }


def _views(folder: Path) -> Arguments:
    header = "configuration,joint_1 [deg],joint_2 [deg],x [mm],y [mm],z [mm],qw,qx,qy,qz,sigma [mm],sigma_rot [mrad]"
    rows = "1,10,20,5,-3,400,1,0,0,0,0.05,0.2\n2,12,22,4,8,450,0.6,0.8,0,0,0.05,0.2\n"
    return {"file": _written(folder / "views.csv", f"{header}\n{rows}"), "on_flange": "camera"}


def _inclinations(folder: Path) -> Path:
    """What inclinometers on a Katana read in eight pairs of configurations."""
    import truearm

    path = folder / "inclinations.csv"
    if not path.exists():
        truearm.simulate_inclinometers("katana450", truth="tilting", poses=16, out=path)
    return path


def _axis_runs(folder: Path) -> Path:
    """Runs in which one joint of a KR5 with joint errors moves at a time, in its own frame."""
    path = folder / "axes.csv"
    if not path.exists():
        rng = np.random.default_rng(0)
        twin = truth_twin(load_robot("kr5"), "axis-tests", rng)
        own = replace(twin, robot=twin.robot.with_frames(IDENTITY, {"smr": (0.1, 0.05, 0.03)}))
        path.write_text(csv_text(measure(own, runs(20.0, (0, -90, 90, 0, 30, 0)), 2e-5, rng)))
    return path


def joint_errors(folder: Path) -> Path:
    return _recorded(folder, "axes/joint-errors.yaml")


@cache
def performance_files() -> dict[str, str]:
    """Return a plan of few tests and what was read for it, by name."""
    import truearm

    plan = small_plan(
        ["AP", "t", "AV", "compliance"], cycles={"AP": 5, "t": 3, "AV": 3, "compliance": 3}, rated_velocity=1.0
    )
    with tempfile.TemporaryDirectory() as folder:
        truearm.iso9283_simulate("irb120", plan, rate=250.0, seed=1, noise=1e-6, out=folder)
        read = {name: (Path(folder) / name).read_text() for name in SIMULATED_FILES}
    return {PLAN: plan_text(plan), ROBOT: robot_text(plan.robot), **read}


def _performance(folder: Path) -> Arguments:
    """Return the arguments with which it is evaluated."""
    for name, text in performance_files().items():
        if not (folder / name).exists():
            _written(folder / name, text)
    names = ("poses", "paths", "settling", "forces")
    return {
        "plan": folder / PLAN,
        **{name: folder / f"{name}.csv" for name in names},
        "alignment": folder / "alignment.yaml",
    }


def _touches() -> Arguments:
    robot, _ = with_cups(load_robot("irb120"))
    cups = triangle([0.3003, 0.3, 0.2996], "B") + np.array([0.25, -0.1, 0.1])
    found = inverse(robot, cups, np.broadcast_to(np.diag([1.0, -1.0, -1.0]), (3, 3, 3)), target="1")
    return {"robot": "irb120", "touches": found.joints, "base_sides": (0.3003, 0.3, 0.2996), "cup": "1"}


def program(folder: Path) -> Path:
    return _recorded(folder, "plate.mod")


def cell(folder: Path) -> Path:
    path = folder / "cell.yaml"
    path.write_text(
        "truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\n"
        "tools:\n  tProbe: {of: flange, translation: [0.2, 0, 125]}\n"
        "frames:\n  wobjPlate: {of: base, translation: [310.5, -110, 60]}\n"
    )
    return path


FORCES = (
    "truearm: truearm-cell/1\nunits: {length: mm, angle: deg, force: N}\n"
    "wrenches:\n  - {targets: [pHole1], force: [0, 5, 0]}\n"
)


def corrected(folder: Path) -> Path:
    path = folder / "corrected" / "plate.mod"
    if not path.exists():
        compensate(calibrated(folder), [program(folder)], out=path.parent)
    return path


#: A line, a circle and waypoints with times, over an IRB 120's table.
PATH = """\
truearm: truearm-path/1
units: {length: mm, angle: deg, time: s}
frame: nominal
tip: [0, 0, 100]
orientation: {quaternion: [0, 1, 0, 0]}
speed: 200
acceleration: 1000
step: 0.1
joint_speeds: [250, 250, 250, 320, 320, 420]
start: [350, 0, 250]
sections:
  - line: [350, 60, 250]
  - {circle: {centre: [350, 80, 250], normal: [0, 0, 1]}, speed: 100}
  - {hermite: [[340, 30, 260], [350, 0, 250]], velocities: [[0, 0, 0], [0, -80, 0], [0, 0, 0]], times: [0, 0.6, 1.2]}
"""


def _new(folder: Path, name: str) -> Path:
    """Return a path that does not exist."""
    path = folder / name
    if path.is_file():
        path.unlink()
    return path


_SERIES = """\
truearm: truearm-fleet/1
units: {length: mm}
experiment: {robot: irb120, count: 3, configurations: 12, noise: 0.05, held_out: 5, model: offsets}
chunk: 2
"""

#: Arguments of a call of each job, made in a folder of its own.
MEASURED_PLAN = "configuration," + ",".join(f"joint_{k} [deg]" for k in range(1, 7)) + "\n"
MEASURED_PLAN += "".join(f"P{k},{10 * k},10,{5 * k},20,{30 - k},40\n" for k in range(1, 4))

EXAMPLES: dict[str, Callable[[Path], Arguments]] = {
    "load_robot": lambda _: {"robot": "irb120"},
    "show": lambda _: {
        "robot": "lrmate200ic",
        "joint_positions": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
        "joints_are": "model",
    },
    "load_data": lambda folder: {"data": data_file(folder), "robot": "irb120"},
    "check": lambda folder: {"robot": load_robot("irb120"), "data": data_file(folder), "device": "tracker"},
    "calibrate": lambda folder: {
        "robot": "irb120",
        "data": data_file(folder),
        "model": "offsets",
        "train": 14,
        "seed": 1,
        "loss": "linear",
        "redundancy": "prior",
        "hold": ["2"],
        "frames": _written(folder / "known.yaml", _KNOWN),
        "bootstrap": 20,
        "effects": ["compliance"],
        "payload": "1kg,0mm,0mm,50mm",
        "gravity": (0.0, 0.0, -9.81),
    },
    "tilting": lambda folder: {"robot": "katana450", "inclinations": _inclinations(folder)},
    "validate": lambda folder: {
        "robot": calibrated(folder),
        "data": data_file(folder),
        "wrench": "0N,5N,0N,0Nm,0Nm,0Nm",
        "wrench_frame": "world",
        "wrench_at": "1",
    },
    "import_table": table,
    "import_guess": lambda folder: {"file": table(folder)["file"], "out": _new(folder, "guessed.yaml")},
    "import_matrices": _matrices,
    "import_robodk": lambda folder: {
        "file": _written(folder / "robodk.csv", ROBODK),
        "angle_unit": "deg",
    },
    "export_robodk": lambda folder: {
        "robot": calibrated(folder),
        "data": data_file(folder),
        "out": _new(folder, "r.csv"),
    },
    "import_circle": _circle,
    "import_sockets": _sockets,
    "import_hand_eye": _views,
    "import_ros": _recording,
    "import_ur_kinematics": lambda folder: {
        "file": _written(folder / "calibration.conf", UR10_CONF),
        "robot": "ur10",
        "out": _new(folder, "ur10-controller.yaml"),
    },
    "distances": lambda folder: {"robot": calibrated(folder), "data": data_file(folder), "payload": "1kg,0mm,0mm,50mm"},
    "plan": lambda _: {
        "robot": "irb120",
        "poses": 12,
        "candidates": 40,
        "device": "ballbar",
        "seed": 1,
        "region": ((0.3, 0.5), (-0.1, 0.1), (0.2, 0.4)),
        "floor": -0.2,
        "clearance": 0.03,
        "home": (0.0, -0.5, 0.5, 0.0, 0.5, 0.0),
    },
    "plan_inclinometers": lambda _: {"robot": "katana450", "poses": 8, "candidates": 100, "seed": 1},
    "simulate_inclinometers": lambda _: {"robot": "katana450", "truth": "tilting", "poses": 8},
    "poses": lambda _: {
        "robot": "irb120",
        "set": "diagonal",
        "centre": (0.35, 0.0, 0.35),
        "side": 0.2,
        "count": 5,
        "tip": (0.0, 0.0, 0.05),
        "tip_orientation": (0.0, 1.0, 0.0, 0.0),
        "seed": 1,
    },
    "path": lambda folder: {
        "robot": calibrated(folder),
        "file": _written(folder / "path.yaml", PATH),
        "seed_joints": (0.0, 0.2, 0.4, 0.0, 0.9, 0.0),
        "languages": ["rapid", "krl"],
        "wrench": (0.0, 5.0, 0.0, 0.0, 0.0, 0.1),
        "wrench_frame": "base",
        "spacing": 0.3,
        "payload": "1kg,0mm,0mm,50mm",
    },
    "sphere": lambda folder: {
        "robot": "irb120",
        "data": _recorded(folder, "ballbar.csv"),
        "tip": (0.0, 0.0, 0.125),
        "payload": "1kg,0mm,0mm,50mm",
    },
    "measure": lambda folder: {
        "plan": _written(folder / "measured-plan.csv", MEASURED_PLAN),
        "robot": "irb120",
        "out": folder / "measured",
        "device": "measurement-arm",
        "truth": "random",
        "noise": 1e-5,
        "seed": 1,
        "disturbed": 0.1,
        "drift": 1e-5,
        "targets": ["nest"],
        "every": 2,
        "about": _written(folder / "about.yaml", "truearm: truearm-about/1\nunits: {}\nrobot: {serial: '12'}\n"),
    },
    "simulate": lambda _: {
        "robot": "irb120",
        "truth": "random",
        "poses": 3,
        "noise": 1e-4,
        "device": "tracker",
        "wrench": (0.0, 5.0, 0.0, 0.0, 0.0, 0.1),
        "wrench_frame": "base",
        "wrench_at": "flange",
    },
    "inverse": _poses,
    "robots": lambda _: {"text": "irb1200", "maker": "ABB", "axes": 6},
    "devices": lambda _: {},
    "axes": lambda folder: {"robot": "kr5", "data": _axis_runs(folder), "measurement_frame": "robot"},
    "tolerance": lambda folder: {"robot": joint_errors(folder), "depth": 0.05, "lean": (1e-5,) * 6, "position": 1e-4},
    "lines": lambda folder: {
        "robot": "kr5",
        "centre": (0.85, 0.0, 0.6),
        "size": (0.3, 0.4, 0.2),
        "joint_errors": joint_errors(folder),
        "truth": "axis-tests",
        "noise": 1e-5,
        "repeats": 2,
    },
    "influence": lambda folder: {
        "robot": "irb120",
        "data": data_file(folder),
        "model": "offsets",
        "train": 14,
        "target": "2",
        "placement": "placed",
        "combination": "mean",
    },
    "hexapod_enumerate": lambda _: {},
    "hexapod_uncertainty": lambda _: {"trials": 100, "seed": 1},
    "hexapod_plan": lambda _: {
        "robot": "irb120",
        "fixture": (0.22, 0.0, 0.1, -0.5),
        "tool": "triangular",
        "distinct": True,
        "branches": ["front-up"],
    },
    "hexapod_solve": lambda _: {"pose": 7, "legs": (0.3,) * 6, "base_sides": (0.3,) * 3, "tool_sides": (0.15,) * 3},
    "hexapod_world_frame": lambda _: _touches(),
    "iso9283_plan": lambda folder: {
        "robot": "irb120",
        "criteria": ["ap", "t"],
        "cube": _written(folder / "cube.yaml", _CUBE),
        "tip": (0.0, 0.0, 0.1),
        "target": None,
        "load": 2.0,
        "velocity": 0.5,
        "velocities": (50.0,),
        "loads": (100.0,),
        "clearance": 0.02,
        "out": folder / "performance-plan",
    },
    "iso9283_simulate": lambda _: {
        "robot": "irb120",
        "plan": small_plan(["AP"], cycles={"AP": 2}),
        "noise": 1e-5,
        "rate": 100.0,
        "seed": 1,
    },
    "iso9283_evaluate": lambda folder: _performance(folder) | {"noise": 1e-5, "noise_rot": 1e-4},
    "compensate": lambda folder: {
        "robot": calibrated(folder),
        "programs": [program(folder)],
        "out": folder / "compensated",
        "tools": cell(folder),
        "frames": cell(folder),
        "payload": "1kg,0mm,0mm,50mm",
        "wrench": _written(folder / "forces.yaml", FORCES),
        "controller_kinematics": "nominal",
        "taught": ["none"],
        "split": 5e-5,
        "accept": ["not-better-here"],
    },
    "revert": lambda folder: {"programs": [corrected(folder)], "out": folder / "reverted"},
    "convert": lambda folder: {"robot": "irb120", "convention": "hayati", "out": _new(folder, "hayati.yaml")},
    "export": lambda folder: {"robot": "irb120", "format": "hayati", "out": _new(folder, "hayati.csv")},
    "study": lambda folder: {"study": "irb120-simulation", "seeds": 1, "out": folder / "study"},
    "fleet": lambda folder: {
        "manifest": _written(folder / "fleet.yaml", _SERIES),
        "out": folder / "fleet",
        "workers": 1,
    },
    "new_robot": lambda folder: {"file": _new(folder, "new_robot.yaml")},
    "example": lambda folder: {"folder": Path(tempfile.mkdtemp(dir=folder))},
    "demo": lambda folder: {"out": folder / "demo"},
}
