"""Where jobs write: never over what they read, by whatever name or path; and not where nothing can be written."""

from __future__ import annotations

import inspect
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.expecting import refused
from tests.house.examples import EXAMPLES
from tests.performance_plan import small_plan

import truearm
from truearm import JOBS
from truearm.axis_circles.result import AXIS_FILES
from truearm.calibration.result import RESULT_FILES
from truearm.compensation.path import MOTION
from truearm.compensation.path import REPORT as PATH_REPORT
from truearm.compensation.result import REPORT
from truearm.engine.base.manifest import MANIFEST, UNFINISHED
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.fleets.recorded import RECORD
from truearm.fleets.result import FLEET_FILES
from truearm.inclinometers.tilting import GEOMETRY, TILTING_FILES
from truearm.iso9283.evaluating.evaluate import EVALUATION_FILES
from truearm.iso9283.planning.plan_file import PLAN, ROBOT, plan_text
from truearm.iso9283.planning.result import PLAN_FILES
from truearm.iso9283.simulating.simulate import FILES as SIMULATED_FILES
from truearm.measuring.begun import BEGUN
from truearm.measuring.reading_log import LOG
from truearm.measuring.result import DATA, PAGE
from truearm.simulation.influence import INFLUENCE_FILES
from truearm.validation.validate import VALIDATION_FILES

#: How a job refuses it; a program that is called as a record is no program to begin with.
REFUSED = r"would be overwritten|not overwritten|of this name itself|no robot language has files of this kind"
#: Parameters that name what a job writes.
OUTPUTS = ("out", "steps", "file", "folder")
#: Jobs that read `file`.
FILES = {
    *(f"import_{kind}" for kind in ("table", "guess", "robodk", "ur_kinematics", "hand_eye", "ros", "sockets")),
    "path",
}
Arguments = dict[str, Any]
_UNITS = "units: {length: mm, angle: deg}\n"


def _written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def _robot(folder: Path) -> Path:
    return _written(folder / "given.yaml", robot_text(truearm.load_robot("irb120")))


def _katana(folder: Path, name: str = "katana") -> Path:
    return _written(folder / f"{name}.yaml", robot_text(truearm.load_robot("katana450")))


def _katana_poses(folder: Path) -> Path:
    path = folder / "katana-poses.csv"
    truearm.simulate("katana450", truth="tilting", poses=12, noise=1e-5, out=path)
    return path


def _constraints(folder: Path) -> Path:
    text = f"truearm: truearm-constraints/1\n{_UNITS}limits: {{1: [-99, 99]}}\n"
    return _written(folder / "c.yaml", text)


def _kr5(folder: Path) -> Path:
    return _written(folder / "k.yaml", robot_text(truearm.load_robot("kr5")))


def _tools(folder: Path) -> Path:
    return Path(shutil.copy(EXAMPLES["compensate"](folder)["tools"], folder / "tools.yaml"))


def _performance_plan(folder: Path) -> Path:
    plan = small_plan(["AP"], cycles={"AP": 2})
    _written(folder / ROBOT, robot_text(plan.robot))
    return _written(folder / PLAN, plan_text(plan))


#: A mapping that takes the joints from a second file.
BESIDE_MAPPING = """\
truearm: truearm-mapping/1
length_unit: mm
configuration: {each: row}
joints: {file: others.csv}
readings: [{target: tip, x: x, y: y, z: z}]
"""
#: What each job can read, all of it as files; the rest is as in the examples.
READ: dict[str, Callable[[Path], Arguments]] = {
    "calibrate": lambda folder: {
        "robot": _robot(folder),
        "bounds": _written(folder / "bounds.yaml", f"truearm: truearm-bounds/1\n{_UNITS}within: {{d_1: 5}}\n"),
        "exclude": _written(folder / "excluded.csv", "configuration,target,reason\n1,1,beam broken\n"),
    },
    "tilting": lambda folder: {
        "robot": _katana(folder),
        "poses": _katana_poses(folder),
        "pushed": folder / "inclinations-pushed.csv",
    },
    "influence": lambda folder: {"robot": _robot(folder), "data": EXAMPLES["load_data"](folder)["data"], "poses": None},
    "plan_inclinometers": lambda folder: {"robot": _katana(folder)},
    "simulate_inclinometers": lambda folder: {
        "robot": _katana(folder),
        "truth": _katana(folder, "true"),
    },
    "plan": lambda folder: {
        "robot": _robot(folder),
        "candidates_from": EXAMPLES["load_data"](folder)["data"],
        "device": None,
        "constraints": _constraints(folder),
        "region": None,
        "accurate_at": EXAMPLES["compensate"](folder)["programs"][0],
        "tools": EXAMPLES["compensate"](folder)["tools"],
        "frames": _tools(folder),
    },
    "poses": lambda folder: {"robot": _robot(folder)},
    "path": lambda folder: {"robot": _robot(folder), "languages": (), "payload": None},
    "sphere": lambda folder: {"robot": _robot(folder)},
    "simulate": lambda folder: {
        "robot": _robot(folder),
        "truth": EXAMPLES["validate"](folder)["robot"],
        "poses": EXAMPLES["load_data"](folder)["data"],
        "device": None,
    },
    "measure": lambda folder: {
        "robot": _robot(folder),
        "truth": EXAMPLES["validate"](folder)["robot"],
        "constraints": _constraints(folder),
    },
    "iso9283_plan": lambda folder: {
        "robot": _robot(folder),
        "slow_run": _written(folder / "slow.yaml", "{}"),
        "constraints": _constraints(folder),
        "program": "rapid",
    },
    "iso9283_evaluate": lambda folder: {"compare": _written(folder / "other.json", "{}")},
    "iso9283_simulate": lambda folder: {
        "robot": _robot(folder),
        "plan": _performance_plan(folder),
        "truth": EXAMPLES["validate"](folder)["robot"],
        "corrected": EXAMPLES["validate"](folder)["robot"],
    },
    "inverse": lambda folder: {
        "robot": _robot(folder),
        "poses": _written(folder / "p.csv", "pose,x [mm],y [mm],z [mm],qw,qx,qy,qz\n1,300,0,500,0,0,1,0\n"),
        "rotations": None,
        "seed_joints": None,
    },
    "lines": lambda folder: {
        "robot": _kr5(folder),
        "truth": EXAMPLES["tolerance"](folder)["robot"],
        "joint_errors": EXAMPLES["tolerance"](folder)["robot"],
    },
    "axes": lambda folder: {"robot": _kr5(folder)},
    "hexapod_plan": lambda folder: {"robot": _robot(folder), "steps": None},
    "hexapod_solve": lambda folder: {"sheet": _written(folder / "filled.csv", "a\n"), "pose": None, "legs": None},
    "convert": lambda folder: {"robot": _robot(folder)},
    "export": lambda folder: {"robot": _robot(folder)},
    "compensate": lambda folder: {"tools": _tools(folder)},
    "import_table": lambda folder: {
        "joints_file": _written(folder / "joints.csv", "configuration,joint_1 [deg],joint_2 [deg]\n1,10,20\n2,15,25\n"),
        "mapping": _written(folder / "beside.yaml", BESIDE_MAPPING),
    },
    "import_ur_kinematics": lambda folder: {
        "robot": _written(folder / "ur10.yaml", robot_text(truearm.load_robot("ur10"))),
    },
}
#: What is no file that a job reads and overwrites: a folder of data whose files have names of their own.
FOLDERS = (("study", "data"), ("lines", "data"), ("measure", "watch"))
#: What only another robot reads: tests/compensation/test_controller_model.py tries it.
#: and what goes with nothing that is held, test_a_file_of_zones_stays below; measuring/test_measure_job.py a mapping.
ELSEWHERE = (
    ("measure", "mapping"),
    ("compensate", "controller_kinematics"),
    ("path", "controller_kinematics"),
    ("calibrate", "zones"),
)


#: The names of what a job writes into the folder `out`.
INTO_FOLDERS = {
    "calibrate": RESULT_FILES,
    "tilting": (*TILTING_FILES, GEOMETRY),
    "influence": INFLUENCE_FILES,
    "validate": VALIDATION_FILES,
    "axes": AXIS_FILES,
    "compensate": ("plate.mod", "plate.mod.truearm.json", REPORT),
    "revert": ("plate.mod",),
    "path": (MOTION, PATH_REPORT),
    "fleet": (*FLEET_FILES, RECORD),
    "measure": (BEGUN, LOG, DATA, PAGE),
    "iso9283_plan": PLAN_FILES,
    "iso9283_simulate": SIMULATED_FILES,
    "iso9283_evaluate": EVALUATION_FILES,
}
#: The names of what a job writes where `out` is one of them, or the parameter beside it.
BESIDE = {
    "plan": {"plan.csv": {"out": "plan.csv"}, "plan.html": {"out": "plan.csv"}},
    "poses": {name: {"out": "set.csv"} for name in ("set.csv", "set-poses.csv", "set.html")},
    "hexapod_plan": {name: {"out": "sheet.csv", "steps": "steps.txt"} for name in ("sheet.csv", "steps.txt")},
}
#: How what is read stands where the job writes.
WAYS = ("the file itself", "a hard link", "a link")
#: Jobs that overwrite nothing at all, and those that read no files of a person's.
NEVER = ("new_robot", "example", "demo", "study")


def read_by(job: str) -> list[str]:
    """Return the parameters of a job that take files to read."""
    named = inspect.signature(getattr(truearm, job)).parameters.values()
    return [
        p.name
        for p in named
        if "Path" in str(p.annotation)
        and (p.name not in OUTPUTS or (p.name == "file" and job in FILES))
        and (job, p.name) not in (*FOLDERS, *ELSEWHERE)
    ]


WRITING = [job for job in JOBS if {*inspect.signature(getattr(truearm, job)).parameters} & {*OUTPUTS}]
CASES = [(job, name) for job in WRITING if job not in NEVER for name in read_by(job)]


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder in which everything has been made once that the calls read."""
    folder = tmp_path_factory.mktemp("examples")
    for job in dict.fromkeys(job for job, _ in CASES):
        given(job, folder)
    return folder


def given(job: str, folder: Path) -> Arguments:
    return EXAMPLES[job](folder) | (READ[job](folder) if job in READ else {})


def paths(value: object) -> list[Path]:
    """Return the files that an argument names."""
    if isinstance(value, str | Path):
        return [Path(value)] if Path(value).is_file() else []
    if isinstance(value, dict):
        return [path for entry in value.values() for path in paths(entry)]
    return [path for entry in value for path in paths(entry)] if isinstance(value, list) else []


def instead(value: Any, old: Path, new: Path) -> Any:
    """Return an argument that names another file instead of one."""
    if isinstance(value, dict):
        return {key: instead(entry, old, new) for key, entry in value.items()}
    if isinstance(value, list):
        return [instead(entry, old, new) for entry in value]
    return new if value == old else value


def outputs(job: str, path: Path) -> list[tuple[str, Arguments]]:
    """Return what a job writes that reads a file: the names in a folder, and with what arguments; `.` is the folder."""
    if job in INTO_FOLDERS:
        return [(name, {"out": "."}) for name in (*INTO_FOLDERS[job], MANIFEST, UNFINISHED)]
    if job in BESIDE:
        return [*BESIDE[job].items(), *((name, {"out": "any.csv"}) for name in (MANIFEST, UNFINISHED))]
    return [(path.name, {"out": path.name}), (MANIFEST, {"out": MANIFEST})]


@pytest.mark.parametrize(("job", "parameter"), CASES)
def test_no_job_overwrites_what_it_reads(job: str, parameter: str, examples: Path, tmp_path: Path) -> None:
    work = shutil.copytree(examples, tmp_path / "work")
    arguments = given(job, work)
    sources = paths(arguments[parameter])
    assert sources, f"no file is tried for {parameter}"
    tried = 0
    for source in sources:
        before = source.read_bytes()
        for number, (name, places) in enumerate(outputs(job, source)):
            # Every name is tried, the first in every way and the others in one after the other.
            for way in WAYS if number == 0 else [WAYS[number % len(WAYS)]]:
                out = tmp_path / "out"
                shutil.rmtree(out, ignore_errors=True)
                out.mkdir()
                target = out / name
                call = arguments | {key: out / place for key, place in places.items()}
                if way == "the file itself":
                    target.write_bytes(before)
                    call = instead(call, source, target)
                elif way == "a hard link":
                    os.link(source, target)
                else:
                    target.symlink_to(source)
                refused(None, REFUSED, getattr(truearm, job), **call)
                assert target.read_bytes() == source.read_bytes() == before
                assert [path.name for path in out.iterdir()] == [name]
                tried += 1
    assert tried >= 3


def test_a_file_of_zones_stays(examples: Path, tmp_path: Path) -> None:
    data = EXAMPLES["load_data"](shutil.copytree(examples, tmp_path / "work"))["data"]
    text = "truearm: truearm-zones/1\nunits: {length: mm}\nzones: {left: {y: [0, null]}}\n"
    zones = _written(tmp_path / "zones.yaml", text)
    refused(None, REFUSED, truearm.calibrate, "irb120", data, zones=zones, out=tmp_path)
    assert zones.read_text() == text


def test_every_job_that_writes_is_tried_or_overwrites_nothing() -> None:
    assert {job for job, _ in CASES} | {*NEVER} == {*WRITING}


@pytest.mark.parametrize("job", ["simulate", "inverse", "plan", "export", "lines", "calibrate"])
def test_a_job_refuses_a_place_that_cannot_be_before_its_work(
    job: str, examples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    given = EXAMPLES[job](examples)
    for place in ("/proc/x", "/dev/null" if job == "calibrate" else "w/.."):
        refused("out", "", getattr(truearm, job), **{**given, "out": place})
    assert list(tmp_path.iterdir()) == []


def test_templates_and_records_name_the_place(examples: Path, tmp_path: Path) -> None:
    refused("folder", "cannot be written to", truearm.example, "/proc/x")
    refused("file", "cannot be written to", truearm.new_robot, "/proc/x")
    one = truearm.hexapod_solve(**EXAMPLES["hexapod_solve"](tmp_path))
    refused(None, "no joint positions", one.save, tmp_path / "cups.csv")


def test_a_record_does_not_overwrite_what_its_job_read(examples: Path) -> None:
    data = EXAMPLES["load_data"](examples)["data"]
    before = data.read_bytes()
    made = truearm.plan("irb120", poses=10, candidates_from=data)
    refused("file", "is read, and would be overwritten", made.save, data)
    assert data.read_bytes() == before
    robot = EXAMPLES["validate"](examples)["robot"]
    again = truearm.calibrate(robot, data, model="offsets")
    refused("folder", "is read, and would be overwritten", again.save, robot.parent)


def test_a_sheet_and_its_steps_are_two_files(examples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("sub").mkdir()
    good = EXAMPLES["hexapod_plan"](examples) | {"out": "sheet.csv"}
    for steps in ("sub/../sheet.csv", "./sheet.csv", tmp_path / "sheet.csv", "/proc/x"):
        refused("steps", "", truearm.hexapod_plan, **{**good, "steps": steps})
        assert not Path("sheet.csv").exists()
