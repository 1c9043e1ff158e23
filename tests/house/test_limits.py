"""Nothing takes memory or time without bound: what is too much is refused, and says how to allow more."""

from __future__ import annotations

import json
import os
import socket
import zlib
from base64 import b64encode
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.simulated import campaign

import truearm
from truearm.calibration.result import Calibration
from truearm.drawn_circle.scan import read_circle, read_page
from truearm.engine.base.errors import InputError
from truearm.engine.base.files import read_bytes, read_yaml
from truearm.engine.base.limits import LIMITS, VARIABLE, limit, refuse_beyond
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.data.readers.mapping import name_pattern
from truearm.engine.data.readers.table import read_table
from truearm.engine.data.rigid_tool import rigid_suspects
from truearm.engine.programs.program_files import program_files, recorded, restored
from truearm.engine.robot.robot_file.schema import RobotFile
from truearm.engine.robot.urdf import read_urdf
from truearm.importing.files import read_matrices
from truearm.robot_files.formats import read_dh_csv

HEADER = "configuration,joint_1 [deg],target,x [mm],y [mm],z [mm]\n"
ROWS = "".join(f"{n},{n},a,1,2,{n}\n" for n in range(1, 9))
MAPPING = """truearm: truearm-mapping/1
length_unit: mm
names: {{column: name, pattern: '{pattern}'}}
readings: [{{x: x, y: y, z: z}}]
joints: {{columns: [q], unit: deg}}
"""
URDF = '<robot name="r"><link name="a"/><link name="b"/></robot>'
POINT = "  CONST robtarget p1:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n"
MODULE = f"MODULE m\n{POINT}ENDMODULE\n".encode()


@pytest.fixture
def allowing(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Change limits as a user does."""
    return lambda text: monkeypatch.setenv(VARIABLE, text)


def written(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def refused(call: Callable[[], object]) -> str:
    with pytest.raises(InputError) as caught:
        call()
    return str(caught.value)


# -- the limits ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", LIMITS)
def test_every_limit_can_be_changed(name: str, allowing: Callable[[str], None]) -> None:
    usual = limit(name)
    refuse_beyond(name, usual)
    told = refused(lambda: refuse_beyond(name, usual + 1, where="here"))
    assert told.startswith(f"here: {LIMITS[name].what}; got")
    assert f"{VARIABLE}={name}={usual + 1}." in told
    allowing(f"rows=5, {name}={usual + 1}")
    refuse_beyond(name, usual + 1)


@pytest.mark.parametrize("text", ["rows", "rows=0", "rows=-1", "rows=1e6", "row=5", "rows = 5", f"rows={'9' * 5000}"])
def test_what_is_no_limit_is_refused(text: str, allowing: Callable[[str], None]) -> None:
    allowing(text)
    told = refused(lambda: limit("cells"))
    assert f"environment variable {VARIABLE}" in told
    assert "NAME=COUNT" in told
    assert "file_size" in told


def test_a_number_that_cannot_be_written_is_refused_without_it() -> None:
    assert "got 'very many poses'" in refused(lambda: refuse_beyond("poses", 10**9999))


# -- files ---------------------------------------------------------------------------------------------


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_only_files_on_disk_are_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert "this is no file; got 'a named pipe'" in refused(lambda: read_bytes(tmp_path / "pipe"))
    assert "got 'a device'" in refused(lambda: read_bytes(Path("/dev/zero")))
    assert "this is a folder" in refused(lambda: read_bytes(tmp_path))
    for call in (truearm.check, truearm.load_robot, lambda path: program_files([Path(path)])):
        assert "a file on disk" in refused(lambda call=call: call(str(tmp_path / "pipe")))  # type: ignore[misc]


@pytest.mark.skipif(not hasattr(socket, "AF_UNIX"), reason="no sockets with names here")
def test_a_socket_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # the name of a socket must be short
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind("s")
        assert "got 'a socket'" in refused(lambda: read_bytes(Path("s")))


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no /proc here")
def test_a_file_that_does_not_tell_its_size_is_read_up_to_the_limit(allowing: Callable[[str], None]) -> None:
    assert b"Name:" in read_bytes(Path("/proc/self/status"))
    allowing("file_size=10")
    assert "the file is too large" in refused(lambda: read_bytes(Path("/proc/self/status")))


def test_files_too_large_are_not_read(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    path = written(tmp_path, "data.csv", HEADER + ROWS)
    allowing("file_size=100 yaml_size=20")
    assert "the file is too large; got" in refused(lambda: read_csv(path))
    path = written(tmp_path, "robot.yaml", "truearm: truearm-robot/1\n")
    assert "too large for YAML; got '25 bytes'" in refused(lambda: read_yaml(path, RobotFile))


@pytest.mark.parametrize(
    "text",
    ["a:\n" + "- 1\n" * 30, f"a: [{'1, ' * 50}1]", "".join(f"k{i}: 1\n" for i in range(40)), "a: " + "- " * 80 + "1"],
)
def test_entries_of_yaml_are_counted_before_it_is_read(
    tmp_path: Path, text: str, allowing: Callable[[str], None]
) -> None:
    path = written(tmp_path, "robot.yaml", text)
    assert "too many entries" not in refused(lambda: read_yaml(path, RobotFile))
    allowing("entries=50")
    assert "the file has too many entries" in refused(lambda: read_yaml(path, RobotFile))


@pytest.mark.parametrize("entry", ["a{i}: &a{i} [{many}]\n", "a{i}: &a{i}\n  <<: [{many}]\n"])
def test_aliases_count_as_what_they_stand_for(tmp_path: Path, entry: str) -> None:
    text = "a0: &a0 {k: 1}\n"
    for i in range(1, 9):
        text += entry.format(i=i, many=", ".join([f"*a{i - 1}"] * 10))
    path = written(tmp_path, "robot.yaml", text)
    assert "too many entries" in refused(lambda: read_yaml(path, RobotFile))


@pytest.mark.parametrize("many", ["[" * 101, "{a: " * 101, "- " * 2000])
def test_entries_nested_too_deep_are_refused(tmp_path: Path, many: str) -> None:
    path = written(tmp_path, "robot.yaml", "a:\n  " + many)
    assert "nested too deep" in refused(lambda: read_yaml(path, RobotFile))


def test_an_entry_that_holds_itself_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, "robot.yaml", "truearm: 1\na: &a [*a]\n")
    assert "line 2: an entry holds itself" in refused(lambda: read_yaml(path, RobotFile))


def test_aliases_that_stand_for_little_are_read(tmp_path: Path) -> None:
    path = written(tmp_path, "robot.yaml", "name: &n x\nid: *n\n")
    assert "missing" in refused(lambda: read_yaml(path, RobotFile))


def test_urdf_files_are_bounded_by_their_entries(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    path = written(tmp_path, "r.urdf", URDF)
    assert "too many entries" not in refused(lambda: read_urdf(path))
    allowing("entries=4")
    assert "line 1: the file has too many entries; got '6 entries'" in refused(lambda: read_urdf(path))


def test_dh_tables_are_bounded_by_their_entries(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    path = written(tmp_path, "dh.csv", "joint,a [mm]\n" + "1,2\n" * 10)
    allowing("entries=10")
    assert "the file has too many entries" in refused(lambda: read_dh_csv(path, "standard_dh"))  # type: ignore[arg-type]


def test_a_dh_table_with_a_cell_too_long_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, "dh.csv", "x" * 200_000)
    assert "the table cannot be read" in refused(lambda: read_dh_csv(path, "standard_dh"))  # type: ignore[arg-type]


# -- programs ------------------------------------------------------------------------------------------


def test_a_record_is_unpacked_up_to_the_limit(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    program = written(tmp_path, "m.mod", MODULE)
    (file,) = program_files([program])
    record = json.loads(recorded(file, MODULE, "RAPID", {}))
    much = b"0" * 1_000_000
    record |= {"original": b64encode(zlib.compress(much)).decode(), "original_sha256": sha256(much).hexdigest()}
    written(tmp_path, "m.mod.truearm.json", json.dumps(record))
    assert restored([program])[0].original == much
    allowing("program_size=999999")
    told = refused(lambda: restored([program]))
    assert "m.mod.truearm.json, original: the program is too large" in told
    assert "got '1000000 bytes'" in told


def test_a_record_that_ends_too_early_is_damaged(tmp_path: Path) -> None:
    program = written(tmp_path, "m.mod", MODULE)
    (file,) = program_files([program])
    record = json.loads(recorded(file, MODULE, "RAPID", {}))
    record["original"] = b64encode(zlib.compress(MODULE)[:-6]).decode()
    written(tmp_path, "m.mod.truearm.json", json.dumps(record))
    assert "the original in this record is damaged" in refused(lambda: restored([program]))


# -- tables --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ("rows=5", "the table has too many lines; got '9 lines'"),
        ("columns=5", "line 1: the table has too many columns; got '6 columns'"),
        ("cells=40", "the table has too many cells; got"),
        ("cells=46", "the table has too many cells; got '48 cells'"),
    ],
)
def test_tables_too_large_are_refused(tmp_path: Path, limits: str, said: str, allowing: Callable[[str], None]) -> None:
    path = written(tmp_path, "data.csv", HEADER + ROWS)
    assert read_csv(path).configurations == 8
    allowing(limits)
    assert said in refused(lambda: read_csv(path))


@pytest.mark.parametrize(
    ("limits", "said"), [("rows=2", "too many lines"), ("columns=2", "too many columns"), ("cells=8", "too many cells")]
)
def test_matrices_too_large_are_refused(
    tmp_path: Path, limits: str, said: str, allowing: Callable[[str], None]
) -> None:
    path = written(tmp_path, "m.txt", "1 2 3\n4 5 6\n7 8 9\n")
    allowing(limits)
    assert said in refused(lambda: read_matrices(path, {"a": path}, {}, "deg", "mm"))


def test_a_cell_too_long_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, "data.csv", HEADER + ROWS + "9,9," + "a" * 200_000 + ",1,2,3\n")
    assert "line 10: a cell is too long" in refused(lambda: read_csv(path))


def test_patterns_take_a_time_that_grows_with_the_names_alone(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    table = written(tmp_path, "t.csv", f"name,q,x,y,z\n{'a' * 5000}c,1,2,3,4\n")
    mapping = written(tmp_path, "map.yaml", MAPPING.format(pattern="(?P<configuration>(a+)+)(?P<target>b)"))
    assert "does not fit the pattern" in refused(lambda: read_table(table, mapping))
    allowing("steps=1000")
    assert "names.pattern: the pattern takes too long" in refused(lambda: read_table(table, mapping))


@pytest.mark.parametrize("pattern", ["(?=a)b", r"(a)\1", "(?<!a)b", "(", "a{2000}", "((a{100}){100}){100}"])
def test_patterns_without_bound_are_refused(pattern: str) -> None:
    assert "not a regular expression that can be used" in refused(lambda: name_pattern(pattern))


def test_images_are_bounded_by_their_dots(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    path = tmp_path / "page.png"
    Image.new("L", (400, 400), 255).save(path, dpi=(300, 300))
    assert read_page(path).brightness.shape == (400, 400)
    allowing("dots=1000")
    assert "the page is too large to look for a circle on it" in refused(lambda: read_circle(path))
    allowing("pixels=100000")
    assert "the image has too many dots; got '160000 dots'" in refused(lambda: read_page(path))


# -- data and counts -----------------------------------------------------------------------------------


def scattered(configurations: int, targets: int) -> Dataset:
    """Return readings that have a target's name of their own each."""
    rng = np.random.default_rng(0)
    count = configurations * targets
    return Dataset(
        source="scattered",
        labels=tuple(str(n + 1) for n in range(configurations)),
        joints=rng.uniform(-1, 1, (configurations, 6)),
        joint_kinds=("revolute",) * 6,
        targets=tuple(f"p{n}" for n in range(count)),
        configuration=np.repeat(np.arange(configurations), targets),
        target=np.arange(count),
        position=rng.uniform(-1, 1, (count, 3)),
    )


@pytest.mark.parametrize(("configurations", "targets"), [(10_000, 1), (1, 10_000), (100, 100)])
def test_ten_thousand_targets_are_checked_in_memory_that_grows_with_the_readings(
    configurations: int, targets: int
) -> None:
    import tracemalloc

    truearm.check(scattered(10, 10))  # what is loaded now takes memory too
    data = scattered(configurations, targets)
    tracemalloc.start()
    try:
        assert [notice.code for notice in truearm.check(data).warnings] == []
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 40e6  # all pairs of targets would be 800 MB


def test_a_name_for_every_reading_is_told(allowing: Callable[[str], None]) -> None:
    data = scattered(100, 10)
    (notice,) = truearm.check("irb120", data).warnings
    assert notice.code == "not-compared"
    assert "1000 targets of 100 configurations" in notice.message
    told = refused(lambda: truearm.calibrate("irb120", data, train="all"))
    assert "there are too many parameters; got '3003 parameters'" in told


def test_a_large_campaign_is_compared_with_the_robot_in_part(allowing: Callable[[str], None]) -> None:
    _, data = campaign("irb120", 60, 0.05e-3, 3)
    assert [notice.code for notice in truearm.check("irb120", data).warnings] == []
    allowing("derivatives=30000")
    (notice,) = truearm.check("irb120", data).warnings
    assert (notice.code, notice.level) == ("compared-in-part", "note")
    assert "of 60 configurations and 3 of 3 targets" in notice.message


def test_of_many_targets_the_wrong_one_is_named() -> None:
    rng = np.random.default_rng(4)
    tool, configurations = rng.uniform(-0.3, 0.3, (40, 3)), 12
    position = np.tile(tool, (configurations, 1)) + rng.normal(0, 1e-5, (configurations * 40, 3))
    position[5 * 40 + 17] += 0.004
    data = Dataset(
        source="plate",
        labels=tuple(map(str, range(configurations))),
        joints=np.zeros((configurations, 6)),
        joint_kinds=("revolute",) * 6,
        targets=tuple(f"t{n}" for n in range(40)),
        configuration=np.repeat(np.arange(configurations), 40),
        target=np.tile(np.arange(40), configurations),
        position=position,
    )
    (suspect,) = rigid_suspects(data)
    assert (suspect.rule.code, suspect.configuration, suspect.target) == ("outliers", "5", "t17")


def test_reference_points_are_a_table_that_is_bounded(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    rows = "".join(f"{n},{n},a,target,1,2,{n}\n{n},{n},r{n},reference,1,2,3\n" for n in range(1, 9))
    path = written(tmp_path, "data.csv", HEADER.replace("target,", "target,role,") + rows)
    allowing("places=63")
    assert "too many points for so many configurations; got '64 places'" in refused(lambda: truearm.check(path))


@pytest.mark.parametrize(
    ("parameter", "call"),
    [
        ("poses", lambda n: truearm.simulate("irb120", truth="nominal", noise=0.0, poses=n)),
        ("poses", lambda n: truearm.plan("irb120", poses=n)),
        ("candidates", lambda n: truearm.plan("irb120", poses=30, candidates=n)),
        ("trials", lambda n: truearm.hexapod_uncertainty(trials=n)),
        ("repeats", lambda n: truearm.lines("irb120", (0.4, 0.0, 0.4), repeats=n)),
        ("seeds", lambda n: truearm.study("li-table", seeds=n)),
    ],
)
def test_counts_end_at_their_limits(
    parameter: str, call: Callable[[int], object], allowing: Callable[[str], None]
) -> None:
    with pytest.raises(InputError, match="out of range") as caught:
        call(99_999_999_999)
    assert caught.value.parameter == parameter
    assert caught.value.cure == f"More is allowed by the environment variable: {VARIABLE}={parameter}=99999999999."
    allowing(f"{parameter}=20")
    assert f"allowed: 20 {parameter} or fewer" in refused(lambda: call(21))


def test_products_of_counts_are_bounded(allowing: Callable[[str], None]) -> None:
    allowing("readings=20")
    told = refused(lambda: truearm.simulate("irb120", truth="nominal", noise=0.0, poses=7))
    assert "there would be too many readings; got '21 readings'" in told
    allowing("derivatives=10000")
    told = refused(lambda: truearm.plan("irb120", poses=30, candidates=100))
    assert "too many readings for so many parameters" in told


def test_what_is_simulated_at_the_limit_can_be_read_again() -> None:
    _, data = campaign("irb120", 3, 0.0, 1)
    header, row = csv_text(data).splitlines()[:2]
    assert limit("readings") * len(header.split(",")) <= limit("cells")
    assert limit("readings") * (len(row) + 2) <= limit("file_size")


# -- fits with more derivatives than there may be at once ---------------------------------------------------


@cache
def calibrated_whole(*how: tuple[str, object]) -> Calibration:
    """Return a calibration with all derivatives at once, as is allowed now."""
    return truearm.calibrate("irb120", campaign("irb120", 60, 0.05e-3, 3)[1], **dict(how))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("most", "told"),
    [
        (3_000, None),
        (12_000, {"compared-in-part", "judged-in-part"}),
        (50_000, {"compared-in-part"}),
    ],
)
@pytest.mark.parametrize("how", [{}, {"loss": "huber", "redundancy": "drop"}, {"bootstrap": 20}])
def test_a_large_campaign_is_calibrated_to_the_end_or_refused_first(
    most: int, told: set[str] | None, how: dict[str, object], allowing: Callable[[str], None]
) -> None:
    _, data = campaign("irb120", 60, 0.05e-3, 3)
    steps: list[str] = []
    allowing(f"derivatives={most}")
    if told is None:
        assert "too many readings for so many parameters" in refused(
            lambda: truearm.calibrate("irb120", data, progress=steps.append, **how)  # type: ignore[arg-type]
        )
        assert not any(step.startswith("identifying") for step in steps)
        return
    result = truearm.calibrate("irb120", data, progress=steps.append, **how)  # type: ignore[arg-type]
    parts = {"compared-in-part", "judged-in-part"}
    assert {notice.code for notice in result.warnings} & parts == told
    allowing("derivatives=10000000")
    whole = calibrated_whole(*how.items())
    for name in result.fit.free.names:
        assert result.fit.robot.values[name] == pytest.approx(whole.fit.robot.values[name], abs=1e-9)
    np.testing.assert_allclose(result.fit.covariance, whole.fit.covariance, atol=1e-6 * whole.fit.covariance.max())


@pytest.mark.parametrize("how", [{"monte_carlo": 100}, {"base_changes": ["31"]}])
def test_what_needs_all_derivatives_at_once_is_refused_before_anything_is_fitted(
    how: dict[str, object], allowing: Callable[[str], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, data = campaign("irb120", 60, 0.05e-3, 3)
    for module in ("calibration.calibrating", "engine.diagnose.base_changes"):
        monkeypatch.setattr(f"truearm.{module}.identify", lambda *_, **__: pytest.fail("something was fitted"))
    allowing("derivatives=12000")
    told = refused(lambda: truearm.calibrate("irb120", data, train="all", **how))  # type: ignore[arg-type]
    assert "there are too many readings for so many parameters" in told
    assert "allowed: 12000 derivatives" in told


def test_a_model_is_chosen_by_a_part_of_large_data_and_that_is_said(allowing: Callable[[str], None]) -> None:
    _, data = campaign("irb120", 60, 0.05e-3, 3)
    allowing("derivatives=200000")
    result = truearm.calibrate("irb120", data, train="all", model="auto")
    (notice,) = (one for one in result.warnings if one.code == "chosen-in-part")
    assert notice.level == "note"
    assert "of 60 training configurations, evenly spaced, and fitted to all of them" in notice.message
