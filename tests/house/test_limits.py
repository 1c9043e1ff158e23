"""Nothing takes memory or time without bound: what is too much is refused, and says how to allow more."""

from __future__ import annotations

import json
import os
import socket
import tracemalloc
import zlib
from base64 import b64encode
from collections.abc import Callable
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from tests.expecting import refused
from tests.simulated import campaign

import truearm
from truearm.drawn_circle.scan import read_circle, read_page
from truearm.engine.base.files import read_bytes, read_yaml
from truearm.engine.base.limits import LIMITS, VARIABLE, limit, refuse_beyond
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.data.readers.mapping import name_pattern
from truearm.engine.data.readers.table import read_noting
from truearm.engine.programs.program_files import program_files, recorded, restored
from truearm.engine.robot.robot_file.schema import RobotFile
from truearm.engine.robot.urdf import read_urdf
from truearm.importing.files import read_matrices

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


said_of = partial(refused, None, "")


# -- the limits ----------------------------------------------------------------------------------------


def test_every_limit_can_be_changed(allowing: Callable[[str], None]) -> None:
    for name in LIMITS:
        allowing("")
        usual = limit(name)
        refuse_beyond(name, usual)
        told = said_of(refuse_beyond, name, usual + 1, where="here")
        assert told.startswith(f"here: {LIMITS[name].what}; got"), told
        assert f"{VARIABLE}={name}={usual + 1}." in told
        allowing(f"rows=5, {name}={usual + 1}")
        refuse_beyond(name, usual + 1)
    assert "got 'very many poses'" in said_of(refuse_beyond, "poses", 10**9999)


def test_what_is_no_limit_is_refused(allowing: Callable[[str], None]) -> None:
    for text in ("rows", "rows=0", "rows=-1", "rows=1e6", "row=5", "rows = 5", f"rows={'9' * 5000}"):
        allowing(text)
        told = said_of(limit, "cells")
        for part in (f"environment variable {VARIABLE}", "NAME=COUNT", "file_size"):
            assert part in told, text


# -- files ---------------------------------------------------------------------------------------------


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="no named pipes, sockets and /proc here")
def test_only_files_on_disk_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, allowing: Callable[[str], None]
) -> None:
    monkeypatch.chdir(tmp_path)  # the name of a socket must be short
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind("s")
        for path, told in ((pipe, "got 'a named pipe'"), (Path("/dev/zero"), "a device"), (Path("s"), "a socket")):
            assert "this is no file; got" in refused(None, told, read_bytes, path)
    refused(None, "this is a folder", read_bytes, tmp_path)
    for call in (truearm.check, truearm.load_robot, lambda path: program_files([Path(path)])):
        refused(None, "a file on disk", call, str(pipe))
    assert b"Name:" in read_bytes(Path("/proc/self/status"))  # which does not tell its size
    allowing("file_size=10")
    refused(None, "the file is too large", read_bytes, Path("/proc/self/status"))


def test_files_too_large_are_not_read(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    path = written(tmp_path, "data.csv", HEADER + ROWS)
    allowing("file_size=100 yaml_size=20")
    refused(None, "the file is too large; got", read_csv, path)
    path = written(tmp_path, "robot.yaml", "truearm: truearm-robot/1\n")
    refused(None, "too large for YAML; got '25 bytes'", read_yaml, path, RobotFile)


def test_entries_of_yaml_are_counted_before_it_is_read(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    many = ("a:\n" + "- 1\n" * 30, f"a: [{'1, ' * 50}1]", "".join(f"k{i}: 1\n" for i in range(40)))
    for text in (*many, "a: " + "- " * 80 + "1"):
        path = written(tmp_path, "robot.yaml", text)
        allowing("")
        assert "too many entries" not in said_of(read_yaml, path, RobotFile)
        allowing("entries=50")
        refused(None, "the file has too many entries", read_yaml, path, RobotFile)


def test_aliases_count_as_what_they_stand_for_and_depth_is_bounded(tmp_path: Path) -> None:
    cases = [("truearm: 1\na: &a [*a]\n", "line 2: an entry holds itself"), ("name: &n x\nid: *n\n", "missing")]
    for entry in ("a{i}: &a{i} [{many}]\n", "a{i}: &a{i}\n  <<: [{many}]\n"):
        made = [entry.format(i=i, many=", ".join([f"*a{i - 1}"] * 10)) for i in range(1, 9)]
        cases.append(("a0: &a0 {k: 1}\n" + "".join(made), "too many entries"))
    cases += [("a:\n  " + many, "nested too deep") for many in ("[" * 101, "{a: " * 101, "- " * 2000)]
    for text, said in cases:
        refused(None, said, read_yaml, written(tmp_path, "robot.yaml", text), RobotFile)


def test_urdf_files_are_bounded_by_their_entries(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    path = written(tmp_path, "r.urdf", URDF)
    assert "too many entries" not in said_of(read_urdf, path)
    allowing("entries=4")
    refused(None, "line 1: the file has too many entries; got '6 entries'", read_urdf, path)


# -- programs ------------------------------------------------------------------------------------------


def test_a_record_is_unpacked_up_to_the_limit(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    program = written(tmp_path, "m.mod", MODULE)
    (file,) = program_files([program])
    record = json.loads(recorded(file, MODULE, "RAPID", {}))
    much = b"0" * 1_000_000
    early = b64encode(zlib.compress(MODULE)[:-6]).decode()
    written(tmp_path, "m.mod.truearm.json", json.dumps(record | {"original": early}))
    refused(None, "the original in this record is damaged", restored, [program])
    record |= {"original": b64encode(zlib.compress(much)).decode(), "original_sha256": sha256(much).hexdigest()}
    written(tmp_path, "m.mod.truearm.json", json.dumps(record))
    assert restored([program])[0].original == much
    allowing("program_size=999999")
    told = refused(None, "m.mod.truearm.json, original: the program is too large", restored, [program])
    assert "got '1000000 bytes'" in told


# -- tables --------------------------------------------------------------------------------------------


def test_tables_too_large_are_refused(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    path = written(tmp_path, "data.csv", HEADER + ROWS)
    assert read_csv(path).configurations == 8
    for limits, said in (
        ("rows=5", "the table has too many lines; got '9 lines'"),
        ("columns=5", "line 1: the table has too many columns; got '6 columns'"),
        ("cells=40", "the table has too many cells; got"),
        ("cells=46", "the table has too many cells; got '48 cells'"),
    ):
        allowing(limits)
        refused(None, said, read_csv, path)
    matrix = written(tmp_path, "m.txt", "1 2 3\n4 5 6\n7 8 9\n")
    for limits, said in (("rows=2", "many lines"), ("columns=2", "many columns"), ("cells=8", "many cells")):
        allowing(limits)
        refused(None, f"too {said}", read_matrices, matrix, {"a": matrix}, {}, "deg", "mm")
    allowing("")
    long = written(tmp_path, "long.csv", HEADER + ROWS + "9,9," + "a" * 200_000 + ",1,2,3\n")
    refused(None, "line 10: a cell is too long", read_csv, long)


def test_patterns_take_a_time_that_grows_with_the_names_alone(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    table = written(tmp_path, "t.csv", f"name,q,x,y,z\n{'a' * 5000}c,1,2,3,4\n")
    mapping = written(tmp_path, "map.yaml", MAPPING.format(pattern="(?P<configuration>(a+)+)(?P<target>b)"))
    refused(None, "does not fit the pattern", read_noting, table, mapping)
    allowing("steps=1000")
    refused(None, "names.pattern: the pattern takes too long", read_noting, table, mapping)
    for pattern in ("(?=a)b", r"(a)\1", "(?<!a)b", "(", "a{2000}", "((a{100}){100}){100}"):
        refused(None, "not a regular expression that can be used", name_pattern, pattern)


def test_images_are_bounded_by_their_dots(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    path = tmp_path / "page.png"
    Image.new("L", (400, 400), 255).save(path, dpi=(300, 300))
    assert read_page(path).brightness.shape == (400, 400)
    allowing("dots=1000")
    refused(None, "the page is too large to look for a circle on it", read_circle, path)
    allowing("pixels=100000")
    refused(None, "the image has too many dots; got '160000 dots'", read_page, path)


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


def test_ten_thousand_targets_are_checked_in_memory_that_grows_with_the_readings() -> None:
    truearm.check(scattered(10, 10))  # what is loaded now takes memory too
    for configurations, targets in ((10_000, 1), (1, 10_000), (100, 100)):
        data = scattered(configurations, targets)
        tracemalloc.start()
        try:
            assert [notice.code for notice in truearm.check(data).warnings] == []
            most = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert most < 40e6, (configurations, targets)  # all pairs of targets would be 800 MB


def test_a_name_for_every_reading_is_told(allowing: Callable[[str], None]) -> None:
    data = scattered(100, 10)
    (notice,) = truearm.check("irb120", data).warnings
    assert notice.code == "not-compared"
    assert "1000 targets of 100 configurations" in notice.message
    words = "there are too many parameters; got '3003 parameters'"
    refused(None, words, truearm.calibrate, "irb120", data, train="all")


def test_a_large_campaign_is_compared_with_the_robot_in_part(allowing: Callable[[str], None]) -> None:
    _, data = campaign("irb120", 60, 0.05e-3, 3)
    assert [notice.code for notice in truearm.check("irb120", data).warnings] == []
    allowing("derivatives=30000")
    (notice,) = truearm.check("irb120", data).warnings
    assert (notice.code, notice.level) == ("judged-in-part", "note")
    assert "of 60 configurations and 3 of 3 targets" in notice.message


def test_reference_points_are_a_table_that_is_bounded(tmp_path: Path, allowing: Callable[[str], None]) -> None:
    rows = "".join(f"{n},{n},a,target,1,2,{n}\n{n},{n},r{n},reference,1,2,3\n" for n in range(1, 9))
    path = written(tmp_path, "data.csv", HEADER.replace("target,", "target,role,") + rows)
    allowing("places=63")
    refused(None, "too many points for so many configurations; got '64 places'", truearm.check, path)


def test_counts_end_at_their_limits(allowing: Callable[[str], None]) -> None:
    for parameter, call in (
        ("poses", partial(truearm.simulate, "irb120", truth="nominal", noise=0.0)),
        ("poses", partial(truearm.plan, "irb120")),
        ("candidates", partial(truearm.plan, "irb120", poses=30)),
        ("trials", truearm.hexapod_uncertainty),
        ("repeats", partial(truearm.lines, "irb120", (0.4, 0.0, 0.4))),
        ("seeds", partial(truearm.study, "li-table")),
    ):
        allowing("")
        told = refused(parameter, "out of range", call, **{parameter: 99_999_999_999})
        assert f"More is allowed by the environment variable: {VARIABLE}={parameter}=99999999999." in told
        allowing(f"{parameter}=20")
        refused(parameter, f"allowed: 20 {parameter} or fewer", call, **{parameter: 21})


def test_products_of_counts_are_bounded(allowing: Callable[[str], None]) -> None:
    allowing("readings=20")
    words, asked = "there would be too many readings; got '21 readings'", {"truth": "nominal", "noise": 0.0}
    refused(None, words, truearm.simulate, "irb120", poses=7, **asked)
    allowing("derivatives=10000")
    refused(None, "too many readings for so many parameters", truearm.plan, "irb120", poses=30, candidates=100)


def test_what_is_simulated_at_the_limit_can_be_read_again() -> None:
    _, data = campaign("irb120", 3, 0.0, 1)
    header, row = csv_text(data).splitlines()[:2]
    assert limit("readings") * len(header.split(",")) <= limit("cells")
    assert limit("readings") * (len(row) + 2) <= limit("file_size")


# -- fits with more derivatives than there may be at once ---------------------------------------------------


@pytest.mark.parametrize("how", [{}, {"loss": "huber", "redundancy": "drop"}, {"bootstrap": 20}])
def test_a_large_campaign_is_calibrated_to_the_end_or_refused_first(
    how: dict[str, Any], allowing: Callable[[str], None]
) -> None:
    _, data = campaign("irb120", 60, 0.05e-3, 3)
    steps: list[str] = []
    calibrate = partial(truearm.calibrate, "irb120", data, model="geometric", progress=steps.append, **how)
    whole = calibrate()
    steps.clear()
    allowing("derivatives=3000")
    refused(None, "too many readings for so many parameters", calibrate)
    assert not any(step.startswith("identifying") for step in steps)
    for most, parts in ((12_000, ("looked at", "compared")), (50_000, ("compared",))):
        allowing(f"derivatives={most}")
        result = calibrate()
        said = sorted(notice.message for notice in result.warnings if notice.code == "judged-in-part")
        assert all(part in one for part, one in zip(parts, said, strict=True))
        for name in result.fit.free.names:
            assert result.fit.robot.values[name] == pytest.approx(whole.fit.robot.values[name], abs=1e-9)
        np.testing.assert_allclose(result.fit.covariance, whole.fit.covariance, atol=1e-6 * whole.fit.covariance.max())


def test_what_needs_all_derivatives_at_once_is_refused_before_anything_is_fitted(
    allowing: Callable[[str], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, data = campaign("irb120", 60, 0.05e-3, 3)
    for module in ("calibration.calibrating", "engine.diagnose.base_changes"):
        monkeypatch.setattr(f"truearm.{module}.identify", lambda *_, **__: pytest.fail("something was fitted"))
    allowing("derivatives=12000")
    for how in ({"monte_carlo": 100}, {"base_changes": ["31"]}):
        words = "there are too many readings for so many parameters.*allowed: 12000 derivatives"
        refused(None, words, truearm.calibrate, "irb120", data, train="all", **how)


def test_every_effect_of_large_data_is_found_in_portions(allowing: Callable[[str], None]) -> None:
    _, data = campaign("irb120", 60, 0.05e-3, 3)
    whole = truearm.calibrate("irb120", data, train="all", model="auto")
    allowing("derivatives=200000")
    result = truearm.calibrate("irb120", data, train="all", model="auto")
    for p in whole.fit.free.parameters:
        assert result.fit.robot.values[p.name] == pytest.approx(whole.fit.robot.values[p.name], abs=1e-6 * p.prior)
