"""Every reader of files, with what is checked of what it read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from ruamel.yaml import YAML

from truearm.board.readings import read_hand_eye
from truearm.drawn_circle.pages import Page, read_drawn_circles
from truearm.engine.base.errors import InputError
from truearm.engine.choosing.zones import boxes_of, read_zones
from truearm.engine.command.loading import load_robot
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.excluded import read_exclusions
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.data.readers.configurations import read_poses
from truearm.engine.data.readers.mapping import MappingFile
from truearm.engine.data.readers.robodk import read_robodk
from truearm.engine.data.readers.table import read_noting
from truearm.engine.fit.bounds import read_bounds
from truearm.engine.motion.constraints import read_constraints
from truearm.engine.motion.path_file import read_path
from truearm.engine.programs.cell import read_frames, read_tools, read_wrenches
from truearm.engine.programs.corrected_targets import LEDGER, known_by_ledger
from truearm.engine.programs.program_files import program_files, read_programs, restored
from truearm.engine.robot.library import load_robot as of_library
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.fleets.manifest import read_manifest
from truearm.hexapod.sheet import together
from truearm.hexapod.sheet_reading import read_sheet, read_touches
from truearm.importing.files import Apart, read_matrices, read_sockets
from truearm.importing.guess import guess_mapping
from truearm.inclinometers.reading import inclinations_text, read_inclinations
from truearm.iso9283.criteria.alignment import read_alignment
from truearm.iso9283.evaluating.reading import read_attained_poses, read_pushes
from truearm.iso9283.evaluating.samples import read_path_samples, read_settling_samples
from truearm.iso9283.planning.plan_file import plan_text, read_cube, read_plan
from truearm.measuring.campaign import Campaign
from truearm.measuring.reading_log import ReadingLog, read_about
from truearm.measuring.session import Quality, Session
from truearm.measuring.watched_folder import WatchedFolder
from truearm.robot_files.jobs import import_ur_kinematics


@dataclass(frozen=True)
class Reader:
    """A reader.

    Attributes
    ----------
    files
        Sample of each file that it reads, by the name that it has in the folder of the case.
    read
        Reads them, and checks what was read.
    """

    files: Mapping[str, str]
    read: Callable[[Path], object]


def _dataset(data: Dataset, folder: Path) -> None:
    """Check that data have numbers, and are the same again when they were written."""
    assert np.isfinite(data.joints).all(), "joints are not finite"
    assert not np.isinf(data.position).any(), "a position is infinite"
    assert repr(data)
    try:
        text = csv_text(data)
    except InputError:
        return
    (folder / "again.csv").write_text(text, encoding="utf-8", newline="")
    again = read_csv(folder / "again.csv")
    assert again.labels == data.labels, "labels change when written"
    assert np.allclose(again.joints, data.joints, rtol=1e-14, atol=0.0), "joints change when written"
    assert csv_text(again) == text, "what was written is not what is read"


def _robot(robot: Robot, folder: Path) -> None:
    """Check that a robot stands somewhere, and at the same place when it was written."""
    at, turned = robot.forward(np.zeros(len(robot.joints)))
    assert np.isfinite(at).all(), "the flange is nowhere"
    assert np.isfinite(turned).all(), "the flange has no orientation"
    assert repr(robot)
    (folder / "again.yaml").write_text(robot_text(robot), encoding="utf-8")
    again = load_robot(folder / "again.yaml")
    size = float(np.abs(at).max())
    assert np.allclose(again.forward(np.zeros(len(robot.joints)))[0], at, rtol=1e-9, atol=1e-9 + 1e-9 * size), (
        "the flange moves when the robot is written"
    )


def _data_file(name: str) -> Reader:
    return Reader({"data.csv": name}, lambda folder: _dataset(read_csv(folder / "data.csv"), folder))


def _robot_file(name: str) -> Reader:
    end = Path(name).suffix
    return Reader({f"arm{end}": name}, lambda folder: _robot(load_robot(folder / f"arm{end}"), folder))


def _table(table: str, mapping: str, **more: str) -> Reader:
    given = {"table.csv": table, "map.yaml": mapping, **{f"{name}.csv": f"{file}.csv" for name, file in more.items()}}
    return Reader(given, lambda folder: _dataset(read_noting(folder / "table.csv", folder / "map.yaml")[0], folder))


def _matrices(folder: Path) -> None:
    targets, references = {"1": folder / "points.txt"}, {"base": folder / "points.txt"}
    _dataset(read_matrices(folder / "joints.txt", targets, references, "deg", "mm")[0], folder)


def _kinematics(name: str) -> Reader:
    def read(folder: Path) -> None:
        made = import_ur_kinematics(folder / name, "ur10").robot
        _robot(made, folder)

    return Reader({name: name}, read)


def _programs(language: str, *names: str) -> Reader:
    def read(folder: Path) -> None:
        for program in read_programs(program_files([folder / Path(name).name for name in names])):
            for target in program.targets:
                assert np.isfinite(target.values).all(), "a target is not finite"

    return Reader({Path(name).name: f"{language}/{name}" for name in names}, read)


def _log(folder: Path) -> None:
    """Check that a log goes on, whatever its end is, and is then read as it was."""
    log = ReadingLog(folder)
    log.close()
    again = ReadingLog(folder)
    again.close()
    assert (again.torn, len(again.entries)) == (0, len(log.entries)), "a log is not read as it was left"


def _rows(folder: Path) -> None:
    """Check that a session takes whatever rows come, and that its log holds them."""
    inside = folder / "in"
    inside.mkdir()
    (folder / "points.csv").rename(inside / "points.csv")
    source = WatchedFolder(inside, folder / "rows.yaml", ("P1", "P2", "P3"))
    session = Session(("P1", "P2", "P3"), ("smr",), ("floor",), 2, Quality(deviation=1e-4))
    with Campaign(session, source, folder) as campaign:
        entries = campaign.step()
        assert all(notice.message for notice in campaign.notices)
    log = ReadingLog(folder)
    log.close()
    reasons = [[entry.reason for entry in some] for some in (log.entries, entries)]
    assert reasons[0] == reasons[1], "the log holds other readings"
    Session(("P1", "P2", "P3"), ("smr",), ("floor",), 2, Quality()).add(*log.entries)


def _inclinations(folder: Path) -> None:
    """Check that angles are angles, and that what is written is read again."""
    read = read_inclinations(folder / "inclinations.csv")
    assert not np.abs(read.angle[np.isfinite(read.angle)]).max(initial=0.0) > np.pi / 2, "an angle is none"
    text = inclinations_text(read)
    (folder / "again.csv").write_text(text, encoding="utf-8", newline="")
    assert inclinations_text(read_inclinations(folder / "again.csv")) == text, "what was written is not what is read"


def _finite(position: np.ndarray) -> None:
    assert np.isfinite(position).all(), "a position is not finite"


def _guess(path: Path) -> None:
    """Check that a guess is a mapping that nobody has confirmed, or asks."""
    made = guess_mapping(path)
    read = YAML(typ="safe", pure=True).load(made.text)
    assert read["confirmed"] == "no", "a guess is confirmed"
    if not made.open:
        MappingFile.model_validate(read)


def _performance_plan(folder: Path) -> None:
    """Check that a plan is the same when it is written and read again."""
    read = read_plan(folder / "performance.yaml")
    (folder / "robot.yaml").write_text(robot_text(read.robot), encoding="utf-8")
    (folder / "again.yaml").write_text(plan_text(read), encoding="utf-8")
    assert plan_text(read_plan(folder / "again.yaml")) == plan_text(read), "what was written is not what is read"


def _record(folder: Path) -> None:
    read_programs(restored([folder / "done.mod"]))


def _ledger(folder: Path) -> None:
    known_by_ledger(folder / LEDGER)


READERS: Final[Mapping[str, Reader]] = {
    "canonical": _data_file("data.csv"),
    "fixtures": _data_file("fixtures.csv"),
    "axis-runs": _data_file("axes.csv"),
    "table": _table("table.csv", "mapping.yaml"),
    "spatial": _table("points.csv", "spatial.yaml", joints="joints"),
    "whole-table": _table("whole.csv", "whole.yaml", driven="driven"),
    "workbook": Reader(
        {"points.xlsx": "points.xlsx", "map.yaml": "workbook.yaml"},
        lambda folder: _dataset(read_noting(folder / "points.xlsx", folder / "map.yaml")[0], folder),
    ),
    "guess": Reader({"table.csv": "whole.csv"}, lambda folder: _guess(folder / "table.csv")),
    "guess-workbook": Reader({"points.xlsx": "points.xlsx"}, lambda folder: _guess(folder / "points.xlsx")),
    "reading-log": Reader({"readings.csv": "log.csv"}, _log),
    "watched-rows": Reader({"points.csv": "rows.csv", "rows.yaml": "rows.yaml"}, _rows),
    "about": Reader({"about.yaml": "about.yaml"}, lambda folder: read_about(folder / "about.yaml").rows()),
    "matrices": Reader({"joints.txt": "joints.txt", "points.txt": "points.txt"}, _matrices),
    "inclinations": Reader({"inclinations.csv": "inclinations.csv"}, _inclinations),
    "robodk": Reader(
        {"robodk.csv": "robodk.csv"},
        lambda folder: _dataset(read_robodk(folder / "robodk.csv", "deg", "model").data, folder),
    ),
    "poses": Reader({"poses.csv": "poses.csv"}, lambda folder: read_poses(folder / "poses.csv")),
    "excluded": Reader({"excluded.csv": "excluded.csv"}, lambda folder: read_exclusions(folder / "excluded.csv")),
    "drawn-circle": Reader(
        {"page.csv": "page.csv", "page.png": "page.png"},
        lambda folder: _dataset(
            read_drawn_circles({"a": Page(folder / "page.png", folder / "page.csv")}, 300.0, 2e-5), folder
        ),
    ),
    "sockets": Reader(
        {"sockets.csv": "sockets.csv"},
        lambda folder: _dataset(read_sockets(folder / "sockets.csv", Apart(0.2, 2e-5), 0.025, None), folder),
    ),
    "hand-eye": Reader(
        {"views.csv": "views.csv"},
        lambda folder: _dataset(read_hand_eye(folder / "views.csv", "camera", None).data, folder),
    ),
    "hexapod-sheet": Reader(
        {"sheet.csv": "sheet.csv"},
        lambda folder: _dataset(together([read_sheet(folder / "sheet.csv")]).dataset(), folder),
    ),
    "hexapod-touches": Reader(
        {"touches.csv": "touches.csv"}, lambda folder: read_touches(folder / "touches.csv", of_library("irb120"))
    ),
    "robot-new": _robot_file("robot.yaml"),
    "robot-irb120": _robot_file("irb120.yaml"),
    "robot-kr5": _robot_file("kr5.yaml"),
    "robot-calibrated": _robot_file("calibrated.yaml"),
    "robot-joint-errors": _robot_file("joint-errors.yaml"),
    "robot-controller": _robot_file("ur10-controller.yaml"),
    "ur-conf": _kinematics("calibration.conf"),
    "ur-ros": _kinematics("ros-kinematics.yaml"),
    "urdf": _robot_file("arm.urdf"),
    "fleet": Reader(
        {name: name for name in ("fleet.yaml", "robots.csv", "data.csv", "again.csv", "bounds.yaml")},
        lambda folder: read_manifest(folder / "fleet.yaml"),
    ),
    "fleet-experiment": Reader(
        {"experiment.yaml": "experiment.yaml"}, lambda folder: read_manifest(folder / "experiment.yaml")
    ),
    "zones": Reader(
        {"zones.yaml": "zones.yaml"}, lambda folder: boxes_of(read_zones(folder / "zones.yaml"), "zones.yaml")
    ),
    "bounds": Reader({"bounds.yaml": "bounds.yaml"}, lambda folder: read_bounds(folder / "bounds.yaml")),
    "path": Reader({"way.yaml": "path.yaml"}, lambda folder: read_path(folder / "way.yaml")),
    "constraints": Reader({"limits.yaml": "constraints.yaml"}, lambda folder: read_constraints(folder / "limits.yaml")),
    "tools": Reader({"cell.yaml": "cell.yaml"}, lambda folder: read_tools(of_library("irb120"), folder / "cell.yaml")),
    "frames": Reader(
        {"cell.yaml": "cell.yaml"}, lambda folder: read_frames(of_library("irb120"), folder / "cell.yaml")
    ),
    "wrenches": Reader({"forces.yaml": "forces.yaml"}, lambda folder: read_wrenches(folder / "forces.yaml")),
    "performance-plan": Reader(
        {"performance.yaml": "performance.yaml", "tested.yaml": "tested.yaml"}, lambda folder: _performance_plan(folder)
    ),
    "performance-cube": Reader({"cube.yaml": "cube.yaml"}, lambda folder: read_cube(folder / "cube.yaml")),
    "performance-alignment": Reader(
        {"alignment.yaml": "alignment.yaml"}, lambda folder: read_alignment(folder / "alignment.yaml")
    ),
    "attained-poses": Reader(
        {"attained.csv": "attained.csv"}, lambda folder: _finite(read_attained_poses(folder / "attained.csv").position)
    ),
    "path-samples": Reader(
        {"along.csv": "along.csv"}, lambda folder: _finite(read_path_samples(folder / "along.csv").position)
    ),
    "settling-samples": Reader(
        {"settling.csv": "settling.csv"},
        lambda folder: _finite(read_settling_samples(folder / "settling.csv").position),
    ),
    "pushes": Reader({"pushes.csv": "pushes.csv"}, lambda folder: _finite(read_pushes(folder / "pushes.csv").position)),
    "rapid": _programs("rapid", "polish.mod"),
    "rapid-cell": _programs("rapid/cell", "MainModule.mod", "Data.sys"),
    "krl": _programs("krl", "milling.src"),
    "krl-cell": _programs("krl/cell", "cell.src", "cell.dat", "$config.dat"),
    "fanuc": _programs("fanuc_ls", "bracket.ls"),
    "fanuc-seam": _programs("fanuc_ls", "seam.ls", "wipe.ls"),
    "urscript": _programs("urscript", "milling.script"),
    "urscript-pallet": _programs("urscript", "palletizing.script", "handling.urscript"),
    "jbi": _programs("jbi", "weld.jbi"),
    "jbi-cell": _programs("jbi/cell", "main.jbi", "track.jbi"),
    "val3": _programs("val3/cell", "cell.pjx", "cell.dtx", "start.pgx", "pick.pgx"),
    "val3-points": _programs("val3", "points.dtx"),
    "record": Reader({"done.mod": "done.mod", "done.mod.truearm.json": "done.mod.truearm.json"}, _record),
    "ledger": Reader({LEDGER: LEDGER}, _ledger),
}
