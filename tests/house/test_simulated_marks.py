"""What a virtual instrument read is called simulated, first, in every result and file made from it; nothing else is."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.expecting import refused
from tests.house.examples import EXAMPLES
from tests.simulated import campaign, more_of

import truearm
from truearm import JOBS
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.document.records import Record
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.seal import is_intact
from truearm.engine.robot.robot_file.writing import robot_text

#: Jobs that simulate themselves, in their examples.
SIMULATING = {
    *(
        "simulate",
        "simulate_inclinometers",
        "iso9283_simulate",
        "measure",
        "lines",
        "study",
        "fleet",
        "example",
        "demo",
    ),
}
#: They tell nothing of what they read: it goes back, or is only looked at for its layout.
SILENT = {"revert", "import_guess"}
WORD = "SIMULATED:"


def without_mark(text: str) -> str:
    """Return a table without its column ``simulated``: the same numbers, as a real instrument has them."""
    rows = [*csv.reader(io.StringIO(text))]
    if "simulated" not in rows[0]:
        return text
    at = rows[0].index("simulated")
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([*row[:at], *row[at + 1 :]] for row in rows)
    return stream.getvalue()


def unmark(folder: Path) -> None:
    for path in folder.rglob("*.csv"):
        path.write_text(without_mark(path.read_text()))
    for path in folder.rglob("*.yaml"):
        path.write_text(path.read_text().replace("simulated: true\n", ""))


def files_in(value: Any) -> Iterator[Path]:
    """Return the files among the arguments of a job."""
    if isinstance(value, Path) and value.is_file():
        yield value
    for part in value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ():
        yield from files_in(part)


def is_marked(path: Path) -> bool:
    text = path.read_text("utf-8", "replace")
    return (path.suffix == ".csv" and text.split("\n")[0].count("simulated") > 0) or "simulated: true" in text


def told(found: object) -> bool:
    """Return whether a result says that it is simulated: in words first and once, and in JSON; else in neither."""
    if isinstance(found, Dataset | Robot):
        assert repr(found).startswith(WORD) is found.simulated
        return found.simulated
    assert isinstance(found, Record)
    lines, summary = found.lines(), found.summary()
    said = sum(line.startswith(WORD) for line in lines)
    assert said == bool(found.simulated_from)
    assert not said or lines[0].startswith(WORD)
    assert summary.get("simulated", False) is bool(said)
    assert repr(found).startswith(WORD) is bool(said)
    return bool(said)


def written(found: object, folder: Path) -> None:
    """Write a result into a folder, where it can be."""
    save = getattr(found, "save", None)
    if save is not None:
        target = folder / "saved"
        for place in (target, target.with_suffix(".csv"), target.with_suffix(".yaml")):
            try:
                save(place)
            except InputError:
                continue
            return


#: What files of a result say of themselves, by their kind: a pattern that is there once.
SAYS = {
    ".html": r'simulated"><strong>SIMULATED:</strong>',
    ".json": r'"simulated": true',
    ".urdf": r"<!-- SIMULATED: ",
    ".mod": r"SIMULATED: no real calibration",
    ".src": r"SIMULATED: no real calibration",
}
#: Files that are of something else than data and robots: what was asked, and how it began.
BESIDE = {"truearm.manifest.json", "record.json", "measuring.json"}


def check_files(folder: Path, *, marked: bool) -> int:
    seen = 0
    for path in folder.rglob("*"):
        pattern = SAYS.get(path.suffix)
        if pattern is None or path.name in BESIDE or not path.is_file() or path.name.startswith("."):
            continue
        found = len(re.findall(pattern, path.read_text("utf-8", "replace")))
        assert bool(found) is marked, path
        assert found <= 1 or path.suffix == ".json", path
        seen += 1
    return seen


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("simulated")


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder whose measurements are those of a twin too, and say nothing of it: an honest user's."""
    folder = tmp_path_factory.mktemp("real")
    EXAMPLES["load_data"](folder)
    unmark(folder)
    return folder


@pytest.mark.parametrize("job", [job for job in JOBS if job not in SILENT])
def test_every_job_says_what_is_simulated_and_nothing_of_what_is_not(job: str, simulated: Path, real: Path) -> None:
    arguments = EXAMPLES[job](simulated)
    marked = job in SIMULATING or any(map(is_marked, files_in(arguments)))
    assert told(getattr(truearm, job)(**arguments)) is marked
    if marked:
        arguments = EXAMPLES[job](real)
        unmark(real)
        assert told(getattr(truearm, job)(**arguments)) is (job in SIMULATING)


@pytest.mark.parametrize("job", ["calibrate", "validate", "axes", "tilting", "path", "iso9283_evaluate", "influence"])
def test_files_of_a_result_say_it_once(job: str, simulated: Path, real: Path, tmp_path: Path) -> None:
    for folder, marked in ((simulated, True), (real, False)):
        arguments = EXAMPLES[job](folder)
        if not marked:
            unmark(real)
        written(getattr(truearm, job)(**arguments), tmp_path / folder.name)
        assert check_files(tmp_path / folder.name, marked=marked) >= 1


def test_a_corrected_program_its_record_and_its_report_say_it(simulated: Path, real: Path) -> None:
    for folder, marked in ((simulated, True), (real, False)):
        arguments = EXAMPLES["compensate"](folder)
        if not marked:
            unmark(real)
        truearm.compensate(**arguments)
        record = json.loads((folder / "compensated" / "plate.mod.truearm.json").read_text())
        assert record["applied"].get("simulated", False) is marked
        page = (folder / "compensated" / "compensation.html").read_text()
        assert page.count('class="notice warning simulated"') == marked


def test_what_commands_write_of_simulated_measurements_has_the_mark(tmp_path: Path) -> None:
    out = tmp_path / "data.csv"
    truearm.simulate("irb120", truth="random", poses=4, noise=1e-5, out=out)
    truearm.measure(**EXAMPLES["measure"](tmp_path))
    truearm.example(tmp_path / "example")
    truearm.simulate_inclinometers("katana450", truth="tilting", poses=8, out=tmp_path / "tilts.csv")
    names = ["data.csv", "measured/measurements.csv", "example/check.csv", "tilts.csv", "tilts-pushed.csv"]
    for name in names:
        rows = [*csv.DictReader(io.StringIO((tmp_path / name).read_text()))]
        assert {row["simulated"] for row in rows} == {"yes"}, name


def test_measurements_against_fixtures_have_the_mark_and_are_read_again(tmp_path: Path) -> None:
    for device in ("two-spheres", "two-sockets", "ballbar", "drawn-circle"):
        out = tmp_path / f"{device}.csv"
        assert told(truearm.simulate("irb120", truth="random", poses=4, device=device, seed=1, out=out)), device
        assert told(truearm.load_data(out)), device
        assert csv_text(read_csv(out)) == out.read_text(), device


# -- the file of measurements -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def text() -> str:
    return csv_text(campaign("irb120", 4, 1e-5, 3)[1])


def test_the_mark_stays_with_every_row(text: str, tmp_path: Path) -> None:
    header, *rows = text.splitlines()
    file = tmp_path / "part.csv"
    for part in (rows[:3], rows[-3:], [row.removesuffix("yes") for row in rows[:-1]] + rows[-1:]):
        file.write_text("\n".join([header, *part]) + "\n")
        assert read_csv(file).simulated
    file.write_text("\n".join([header, *(row.removesuffix("yes") for row in rows)]) + "\n")
    assert not read_csv(file).simulated
    file.write_text("\n".join([without_mark(header), *rows]) + "\n")  # pasted below the header of real measurements
    refused(None, "as many cells as the header", read_csv, file)
    file.write_text(text.replace(",yes", ",perhaps", 1))
    refused(None, "line 2, column simulated.*does not say whether a virtual instrument", read_csv, file)


def test_the_mark_goes_through_what_users_do(text: str, tmp_path: Path) -> None:
    for mark, content in ((True, text), (False, without_mark(text))):
        file = tmp_path / f"{mark}.csv"
        file.write_text(content)
        data = read_csv(file)
        assert data.simulated is mark
        assert csv_text(data) == content
        assert data.of_configurations([0, 2]).simulated is mark
        mapping = tmp_path / "mapping.yaml"
        columns = [f"joint_{number} [deg]" for number in range(1, 7)]
        mapping.write_text(
            "truearm: truearm-mapping/1\nlength_unit: mm\nconfiguration: {column: configuration}\n"
            f"joints: {{columns: {columns}, unit: deg}}\n"
            "readings: [{target_column: target, x: 'x [mm]', y: 'y [mm]', z: 'z [mm]'}]\n"
        )
        assert told(truearm.import_table(file, mapping)) is mark
        table = tmp_path / f"robodk-{mark}.csv"
        robot = campaign("irb120", 4, 1e-5, 3)[0].robot
        assert told(truearm.export_robodk(robot, data, out=table)) is mark
        assert told(truearm.import_robodk(table, angle_unit="deg")) is mark


# -- robots --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def calibrated() -> tuple[Robot, Dataset]:
    """A robot that was calibrated with simulated measurements, and more of the same twin that are not marked."""
    twin, data = campaign("irb120", 30, 1e-5, 5)
    found = truearm.calibrate("irb120", data, model="offsets").robot
    return found, replace(more_of(twin, 8, 1e-5, 6), simulated=False)


def test_a_robot_keeps_the_mark_in_its_files(calibrated: tuple[Robot, Dataset], tmp_path: Path) -> None:
    robot = calibrated[0]
    assert robot.simulated
    assert robot.with_payload("1kg,0mm,0mm,50mm").simulated
    truearm.convert(robot, "hayati", out=tmp_path / "hayati.yaml")
    assert truearm.load_robot(tmp_path / "hayati.yaml").simulated
    for kind in ("urdf", "json", "python", "mdh", "dh"):
        for arm, marks in ((robot, 1), (truearm.load_robot("irb120"), 0)):
            try:
                made = truearm.export(arm, kind, out=tmp_path / f"{kind}-{marks}.{kind}")
            except InputError:  # axes that are nearly parallel have no such table
                continue
            assert told(made) is bool(marks)
            assert len(re.findall('SIMULATED: |"simulated": true', made.text)) == marks
    assert truearm.load_robot(tmp_path / "urdf-1.urdf").simulated
    assert not truearm.load_robot(tmp_path / "urdf-0.urdf").simulated
    file = tmp_path / "calibrated.yaml"
    file.write_text(robot_text(robot))
    assert is_intact(truearm.load_robot(file))
    file.write_text(file.read_text().replace("simulated: true\n", ""))
    assert not is_intact(truearm.load_robot(file))  # without its mark it is not as it was written


def test_of_a_robot_and_measurements_it_is_said_which_are_simulated(calibrated: tuple[Robot, Dataset]) -> None:
    robot, data = calibrated
    judged = truearm.validate(robot, data)
    assert judged.summary()["simulated_parts"] == ["robot"]
    assert judged.lines()[0] == "SIMULATED: the robot's parameters come from measurements of a virtual instrument."
    alone = truearm.calibrate("irb120", data, model="offsets", train="all").robot
    assert not alone.simulated
    marked = replace(data, simulated=True)
    assert truearm.validate(alone, marked).summary()["simulated_parts"] == ["data"]
    assert truearm.validate(robot, marked).summary()["simulated_parts"] == ["data", "robot"]
    # real measurements do not wash a robot clean
    again = truearm.calibrate(robot, data, model="frames", train="all")
    assert again.summary()["simulated_parts"] == ["robot"]
    assert again.robot.simulated
    assert truearm.check(robot, data).summary()["simulated_parts"] == ["robot"]
    assert not told(truearm.check("irb120", data))


def test_what_truearm_simulates_for_itself_marks_nothing(calibrated: tuple[Robot, Dataset]) -> None:
    data = calibrated[1]
    found = truearm.calibrate("irb120", data, model="offsets", train="all", monte_carlo=100)
    assert not told(found)
    assert not found.robot.simulated
    assert not told(truearm.plan(found.robot, poses=12, candidates=40, device="tracker"))
    assert told(truearm.plan(calibrated[0], poses=12, candidates=40, device="tracker"))


def test_a_fleet_of_robots_one_of_which_is_simulated_says_so(tmp_path: Path) -> None:
    entries = []
    for number in range(2):
        data = campaign("irb120", 20, 5e-5, number)[1]
        (tmp_path / f"{number}.csv").write_text(csv_text(data) if number else without_mark(csv_text(data)))
        entries.append(f"  - {{name: r{number}, robot: irb120, data: {number}.csv, options: {{model: offsets}}}}\n")
    for count, marked in ((1, False), (2, True)):
        manifest = tmp_path / f"fleet-{count}.yaml"
        manifest.write_text("truearm: truearm-fleet/1\nrobots:\n" + "".join(entries[:count]))
        out = tmp_path / f"out-{count}"
        assert told(truearm.fleet(manifest, out=out, workers=1)) is marked
        assert json.loads((out / "fleet.json").read_text()).get("simulated", False) is marked
        assert (out / "report.html").read_text().count('class="notice warning simulated"') == marked
