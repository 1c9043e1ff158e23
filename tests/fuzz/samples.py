"""Sound files of every kind that truearm reads, small: what is damaged."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from collections.abc import Callable
from datetime import datetime
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np
from tests.engine.data.test_fixture_rows import MIXED
from tests.engine.data.test_table import JOINTS, POINTS, SPATIAL
from tests.house.examples import (
    EXAMPLES,
    FORCES,
    PATH,
    ROBODK,
    calibrated,
    cell,
    corrected,
    data_file,
    joint_errors,
    performance_files,
    program,
    table,
)

import truearm
from truearm.engine.data.hexapod import poses, triangle
from truearm.engine.programs.corrected_targets import LEDGER, LedgerEntry, remember
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Joint
from truearm.hexapod.rehearsal import ballbar, measured_legs, measured_sides
from truearm.hexapod.sheet import PlannedRow, sheet_csv

PROGRAMS = Path(__file__).parents[1] / "engine" / "programs" / "samples"

CUBE = "truearm: truearm-cube/1\nunits: {length: mm}\ncentre: [350, 0, 350]\nside: 200\n"
BOUNDS = """\
truearm: truearm-bounds/1
units: {length: mm, angle: deg}
within: {theta_offset: 2, d: 5, a_3: 0.05}
between: {alpha_4: [-90.2, -89.8]}
"""
ZONES = """\
truearm: truearm-zones/1
units: {length: mm}
overlap: 30
zones:
  left: {y: [0, null], z: [100, 900]}
  right: {x: [-500, 500], y: [-600, 0]}
"""
CONSTRAINTS = """\
truearm: truearm-constraints/1
units: {length: mm, angle: deg}
limits: {1: [-90, 90]}
moments: {2: positive}
box: {of: targets, x: [0, 900]}
floor: 50
visibility:
  within: 60
  instrument: [2500, 0, 500]
  targets: {"1": [0, 0, 1]}
clearance: 60
keep_out:
  table: {x: [600, 900], y: [-300, 300], z: [-100, 20]}
  wall: {x: [-2000, -700]}
"""
FLEET = """\
truearm: truearm-fleet/1
robots: robots.csv
options: {model: elastic, seed: 3, effects: [backlash], bounds: bounds.yaml}
chunk: 2
"""
ROBOTS = """\
name,robot,data,of,date,train,effects,gravity,payload
one,irb120,data.csv,4711,2026-01-05,40,,"0,0,-9.81",
# again
two,kr5,again.csv,4712,2026-07-05,all,backlash;clearance,,"2.7kg,50mm,25mm,100mm"
"""
EXPERIMENT = """\
truearm: truearm-fleet/1
units: {length: mm}
experiment: {robot: irb120, count: 30, configurations: 20, targets: 1, noise: 0.05, seed: 1}
"""
#: A table in which everything stands that a mapping can name, the mapping, and the joints of the second file.
WHOLE_TABLE = """\
// remark
Point;X;Y;Z;Rx;Ry;Rz;Ux;Uy;Uz;U rot;T;When
P001;841,2;112,8;655,1;10,5;20;-30;0,02;0,03;0,02;0,1;20,5;2026-11-23 10:00:00
P002;n/a;n/a;n/a;-;-;-;;;;;20,6;2026-11-23 10:01:00
P003;702,5;-640,2;790,6;5;15;25;0,02;0,03;0,02;0,1;20,7;2026-11-23 10:02:00
"""
WHOLE_MAPPING = """\
truearm: truearm-mapping/1
confirmed: yes
layout: {delimiter: semicolon, decimal: comma, header: 2, comment: //}
missing: [n/a, '-']
configuration: {column: Point}
length_unit: mm
readings:
  - target: ball
    x: X
    y: Y
    z: Z
    angles: {columns: [Rx, Ry, Rz], about: xyz, axes: fixed, unit: deg}
    sigma: {columns: [Ux, Uy, Uz], unit: mm, coverage: 2}
    sigma_rot: {columns: [U rot], unit: mrad}
temperature: {column: T, unit: degC}
order: {column: When, time: iso}
joints: {file: driven.csv}
"""
DRIVEN = """\
configuration,axis_1 [deg],axis_2 [deg]
P001,10,-20
P002,-35,12
P003,5,7
"""
WORKBOOK_MAPPING = """\
truearm: truearm-mapping/1
layout: {sheet: Points, header: 2}
configuration: {column: Pose}
length_unit: mm
readings: [{target: ball, x: X, y: Y, z: Z, rotation_vector: {columns: [rx, ry, rz], unit: rad}}]
order: {by: labels}
joints: {columns: [J1, J2], unit: deg}
"""


ABOUT = """\
truearm: truearm-about/1
units: {length: mm, temperature: degC, pressure: hPa, humidity: percent}
instrument: {name: tracker, serial: "750123"}
robot: {serial: "120-501234"}
reflector: {radius: 19.05, offset: 0.0}
environment:
  - {at: start, temperature: 20.4, pressure: 1013.2, humidity: 45}
"""
#: Rows as they are written into a folder that is watched, and their mapping.
ROWS = """\
Pose,Point,X,Y,Z,W,I,J,K,S,When,RMS,Moved,N,Lost
P1,smr,1841.2,112.8,655.1,1,0,0,0,0.02,2026-11-23 10:00:00,0.01,0.01,20,0
P2,smr,702.5,-640.2,790.6,0.6,0.8,0,0,0.02,2026-11-23 10:01:00,0.2,0.01,20,0
P3,floor,702.5,-640.2,790.7,0.6,0.8,0,0,0.02,2026-11-23 10:02:00,,,,
"""
ROWS_MAPPING = """\
truearm: truearm-mapping/1
configuration: {column: Pose}
length_unit: mm
readings: [{target_column: Point, x: X, y: Y, z: Z, qw: W, qx: I, qy: J, qz: K, sigma: {columns: [S], unit: mm}}]
references: [floor]
order: {column: When, time: iso}
dwell: {deviation: RMS, settling: Moved, unit: mm, samples: N, breaks: Lost}
joints: {file: plan.csv}
"""


def _workbook(path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    sheet = book.create_sheet("Points")
    sheet.append(["Campaign"])
    sheet.merge_cells("A1:F1")
    sheet.append(["Pose", "J1", "J2", "X", "Y", "Z", "rx", "ry", "rz", "Time"])
    sheet.append(["P1", 10, 20.5, 841.2, 112.5, 655.1, 0.1, 0.2, 0.3, datetime(2026, 11, 23, 10, 0)])
    sheet.append(["P2", 11, 21.5, 741.2, 12.5, 655.1, 0.1, 0.2, -0.3, datetime(2026, 11, 23, 10, 1)])
    book.save(path)


#: What samples hold that are nothing but a text.
TEXTS = {
    "fixtures.csv": MIXED,
    "points.csv": POINTS,
    "spatial.yaml": SPATIAL,
    "joints.csv": JOINTS,
    "bounds.yaml": BOUNDS,
    "fleet.yaml": FLEET,
    "robots.csv": ROBOTS,
    "experiment.yaml": EXPERIMENT,
    "zones.yaml": ZONES,
    "robodk.csv": ROBODK,
    "path.yaml": PATH,
    "forces.yaml": FORCES,
    "excluded.csv": "configuration,target,reason\n1,1,beam broken\n2,2,touched\n",
    "constraints.yaml": CONSTRAINTS,
    "cube.yaml": CUBE,
    "whole.csv": WHOLE_TABLE,
    "whole.yaml": WHOLE_MAPPING,
    "driven.csv": DRIVEN,
    "workbook.yaml": WORKBOOK_MAPPING,
    "about.yaml": ABOUT,
    "rows.csv": ROWS,
    "rows.yaml": ROWS_MAPPING,
}


@cache
def folder() -> Path:
    """Return a folder with all of them, made once."""
    place = Path(tempfile.mkdtemp(prefix="truearm-fuzz-"))
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    remember(place / LEDGER, [LedgerEntry(program="plate.mod", date="2026-11-27", robot="irb120", targets="AAAAAAAA")])
    for name in ("irb120", "kr5"):
        (place / f"{name}.yaml").write_text((files("truearm.engine.robot.library") / f"{name}.yaml").read_text())
    for name, make in MADE.items():
        if not (place / name).exists():
            make(place)
    for name, text in TEXTS.items():
        (place / name).write_text(text)
    # the same readings twice are refused
    (place / "again.csv").write_text((place / "data.csv").read_text() + "\n")
    _workbook(place / "points.xlsx")
    _pose_set(place)
    return place


def _pose_set(place: Path) -> None:
    at = load_robot("irb120").forward_kinematics(np.radians([[10.0, 20.0, -30.0, 40.0, 50.0, 60.0]]))
    numbers = ",".join(f"{v:.9g}" for v in (*(at.position[:, 0] * 1e3), 0.5, 0.5, 0.5, 0.5))
    (place / "poses.csv").write_text(f"pose,x [mm],y [mm],z [mm],qw,qx,qy,qz\na,{numbers}\nb,{numbers}\n")


def _log(place: Path) -> None:
    truearm.measure(**EXAMPLES["measure"](place))
    shutil.copyfile(place / "measured" / "readings.csv", place / "log.csv")


def _robots(place: Path) -> None:
    """Write robots of other formats."""
    truearm.import_ur_kinematics(**EXAMPLES["import_ur_kinematics"](place))
    truearm.export(place / "ur10-controller.yaml", "ur-kinematics", out=place / "ros-kinematics.yaml")
    truearm.export("irb120", "urdf", out=place / "arm.urdf")


def _new_robot(place: Path) -> None:
    truearm.new_robot(place / "robot.yaml")


@cache
def content(name: str) -> bytes:
    """Return what a sample holds, or a program of the samples (``rapid/polish.mod``)."""
    path = PROGRAMS / name if "/" in name else folder() / name
    return path.read_bytes()


def _corrected(place: Path) -> None:
    """Write a corrected program and its record."""
    program = corrected(place)
    for path in program.parent.glob(f"{program.name}*"):
        shutil.copyfile(path, place / path.name.replace(program.name, "done.mod"))


def _performance(place: Path) -> None:
    """Write a plan of tests by ISO 9283 and what was read for it, few samples of each cycle."""
    here = {"plan": "performance", "robot": "tested", "poses": "attained", "paths": "along", "forces": "pushes"}
    texts = performance_files()
    texts = texts | {name: _thinned(texts[name]) for name in ("paths.csv", "settling.csv")}
    for name, text in texts.items():
        path = Path(name)
        text = text.replace("robot: robot.yaml", "robot: tested.yaml")
        (place / path.with_stem(here.get(path.stem, path.stem))).write_text(text)


def _thinned(text: str) -> str:
    header, *rows = text.splitlines(keepends=True)
    return header + "".join(rows[::4])


def _sheet(place: Path) -> None:
    """Write a sheet with two places, two sides of four cups and two attachments of the tool."""
    found, bar, base = poses(), ballbar(np.random.default_rng(0)), triangle([0.3] * 3, "B")
    rows, lengths = [], []
    for label, number in zip("abcdefgh", (5, 40, 66, 12, 20, 33, 50, 70), strict=True):
        at, side, attachment = ("l", 1 + number % 2, "1") if label in "abcd" else ("r", 1, "2")
        pose = found[number - 1]
        row = PlannedRow(
            label, "front-up-flip", number, pose.design, pose.solution, np.full(6, 0.1), at, side, attachment
        )
        read = measured_legs(bar, pose.design, base, pose.cups)
        lengths.append({name: read[own] for name, own in zip(row.leg_names, pose.design.leg_names, strict=True)})
        rows.append(row)
        if label in "ae":
            lengths[-1] |= measured_sides(bar, base, "B") | dict.fromkeys(("B1-B4", "B2-B4", "B3-B4"), 0.3)
    lengths[0] |= measured_sides(bar, found[0].cups, "T")
    joints = [Joint(f"axis_{n}", "revolute", {}) for n in range(1, 7)]
    (place / "sheet.csv").write_text(sheet_csv(rows, joints, lengths))


def _touches(place: Path) -> None:
    joints = np.degrees(EXAMPLES["hexapod_world_frame"](Path())["touches"])
    rows = [f"{cup},{','.join(f'{v:.6f}' for v in row)}" for cup, row in zip(("B1", "B2", "B3"), joints, strict=True)]
    header = f"cup,{','.join(f'joint_{n} [deg]' for n in range(1, 7))}"
    (place / "touches.csv").write_text("\n".join([header, *rows]) + "\n")


#: What makes a sample that is more than a text; some make several at once. A reader goes with its sample, and a sample
#: with what makes it.
MADE: dict[str, Callable[[Path], object]] = {
    "data.csv": data_file,
    "table.csv": table,
    "mapping.yaml": table,
    "joints.txt": EXAMPLES["import_matrices"],
    "points.txt": EXAMPLES["import_matrices"],
    "page.csv": EXAMPLES["import_circle"],
    "page.png": EXAMPLES["import_circle"],
    "sockets.csv": EXAMPLES["import_sockets"],
    "views.csv": EXAMPLES["import_hand_eye"],
    "cell.bag": EXAMPLES["import_ros"],
    "axes.csv": EXAMPLES["axes"],
    "inclinations.csv": EXAMPLES["tilting"],
    "ballbar.csv": EXAMPLES["sphere"],
    "cell.yaml": cell,
    "plate.mod": program,
    "calibrated.yaml": lambda place: shutil.copyfile(calibrated(place), place / "calibrated.yaml"),
    "joint-errors.yaml": lambda place: shutil.copyfile(joint_errors(place), place / "joint-errors.yaml"),
    "done.mod": _corrected,
    "done.mod.truearm.json": _corrected,
    "measured-plan.csv": _log,
    "log.csv": _log,
    "robot.yaml": _new_robot,
    "calibration.conf": _robots,
    "ur10-controller.yaml": _robots,
    "ros-kinematics.yaml": _robots,
    "arm.urdf": _robots,
    "performance.yaml": _performance,
    "tested.yaml": _performance,
    "attained.csv": _performance,
    "along.csv": _performance,
    "settling.csv": _performance,
    "pushes.csv": _performance,
    "alignment.yaml": _performance,
    "sheet.csv": _sheet,
    "touches.csv": _touches,
}
