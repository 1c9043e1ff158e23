"""Tables of any make, read through a mapping file."""

from __future__ import annotations

import math
import re
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.expecting import refusing

from truearm.engine.base.files import read_text
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.data.readers.table import read_noting
from truearm.importing.files import read_matrices

LONG = "pose,q1,q2,ball,X,Y,Z\na,10,20,one,1,2,3\na,10,20,two,4,5,6\nb,30,40,one,7,,9\n"
MAP = """
truearm: truearm-mapping/1
configuration: {column: pose}
length_unit: mm
readings:
  - {target_column: ball, x: X, y: Y, z: Z}
joints:
  columns: [q1, q2]
  unit: deg
"""
SPATIAL = """
truearm: truearm-mapping/1
layout: {header: none, comment: //}
names: {column: 1, pattern: '.*::(?P<configuration>\\w+)::(?P<target>\\w+)'}
length_unit: mm
readings:
  - {x: 2, y: 3, z: 4}
joints:
  file: joints.csv
  key: label
  columns: [q1]
  unit: deg
"""
POINTS = "// X Y Z\nA::b::one, 1, 2, 3\nA::b::two, 4, 5, 6\nA::a::one, 7, 8, 9\n"
JOINTS = "label,q1\na,10\nb,20\nc,30\n"


def read(folder: Path, table: str, mapping: str, joints: str | None = None) -> Dataset:
    (folder / "table.txt").write_text(table, encoding="utf-8", newline="")
    (folder / "map.yaml").write_text(mapping, encoding="utf-8")
    if joints is not None:
        (folder / "joints.csv").write_text(joints, encoding="utf-8", newline="")
    return read_noting(folder / "table.txt", folder / "map.yaml")[0]


# -- meaning ---------------------------------------------------------------------------------------------


def test_a_long_table(tmp_path: Path) -> None:
    data = read(tmp_path, LONG, MAP)
    assert (data.labels, data.targets, data.joint_kinds) == (("a", "b"), ("one", "two"), ("revolute",) * 2)
    assert data.joints.tolist() == [[math.radians(v) for v in row] for row in ([10, 20], [30, 40])]
    assert (data.configuration.tolist(), data.target.tolist()) == ([0, 0, 1], [0, 1, 0])
    assert data.has_position.tolist() == [True, True, False]
    assert data.position[1].tolist() == [0.004, 0.005, 0.006]
    assert (data.sigma, data.quaternion, data.references) == (None, None, None)
    assert data.source.endswith("table.txt")


def test_references_fixed_sigma_and_a_fixed_target_name(tmp_path: Path) -> None:
    data = read(tmp_path, LONG, MAP + "references: [two]\nsigma: {value: 20, unit: um}\n")
    assert data.targets == ("one",)
    assert data.references is not None
    assert data.references.targets == ("two",)
    np.testing.assert_array_equal(data.sigma, [2e-5, 2e-5])
    table = "\n".join(LONG.splitlines()[::2])
    fixed = read(tmp_path, table, MAP.replace("target_column: ball", "target: tcp"))
    assert fixed.targets == ("tcp",)


def test_quaternions_and_their_sigma(tmp_path: Path) -> None:
    mapping = MAP.replace("z: Z", "z: Z, qw: w, qx: a, qy: b, qz: c") + "sigma_rot: {value: 2, unit: mrad}\n"
    data = read(tmp_path, "pose,q1,q2,ball,X,Y,Z,w,a,b,c\np,1,2,t,1,2,3,0,1,0,0\np,1,2,u,1,2,3,,,,\n", mapping)
    assert data.quaternion is not None
    assert data.quaternion[0].tolist() == [0, 1, 0, 0]
    assert data.has_orientation.tolist() == [True, False]
    assert data.sigma_rot is not None
    assert data.sigma_rot[0] == 2e-3


def test_each_row_a_configuration_with_mixed_joints(tmp_path: Path) -> None:
    mapping = MAP.replace("{column: pose}", "{each: row}").replace("unit: deg", "units: [mm, rad]")
    data = read(tmp_path, LONG, mapping)
    assert data.labels == ("1", "2", "3")
    assert data.joint_kinds == ("prismatic", "revolute")
    assert data.joints[0].tolist() == [0.01, 20.0]


def test_delimiters(tmp_path: Path) -> None:
    for delimiter, sign in (("semicolon", ";"), ("tab", "\t"), ("whitespace", "  ")):
        table = LONG.replace("7,,9", "7,8,9").replace(",", sign)
        data = read(tmp_path, table, MAP + f"layout: {{delimiter: {delimiter}}}\n")
        assert data.position[2].tolist() == [0.007, 0.008, 0.009], delimiter


def test_decimal_commas_title_lines_units_line_comments_and_encoding(tmp_path: Path) -> None:
    table = "Große Zelle\n%;\npose;q1;q2;ball;X;Y;Z\n;deg;deg;;mm;mm;mm\na;1,5;2;ä;-1,25e1;2;3\n% more\n"
    (tmp_path / "table.txt").write_bytes(table.encode("cp1252"))
    (tmp_path / "map.yaml").write_text(
        MAP
        + "layout: {delimiter: semicolon, decimal: comma, header: 3, first_row: 5, comment: '%', encoding: cp1252}\n",
        encoding="utf-8",
    )
    data = read_noting(tmp_path / "table.txt", tmp_path / "map.yaml")[0]
    assert data.targets == ("ä",)
    assert data.position.tolist() == [[-0.0125, 0.002, 0.003]]


def test_zero_bytes_all_over_are_said_to_be_of_another_encoding(tmp_path: Path) -> None:
    table, mapping = tmp_path / "table.txt", tmp_path / "map.yaml"
    for encoding in ("utf-16-le", "utf-16-be"):
        table.write_bytes(LONG.encode(encoding))
        mapping.write_text(MAP, encoding="utf-8")
        with refusing("zero bytes are those of UTF-16", "layout.encoding", f": {encoding}"):
            read_noting(table, mapping)
        mapping.write_text(f"{MAP}layout: {{encoding: {encoding}}}\n", encoding="utf-8")
        assert read_noting(table, mapping)[0].labels == ("a", "b")
        with refusing("UTF-16", "Save it as UTF-8"):
            read_text(table)


def test_a_header_in_a_comment_line_and_a_byte_order_mark(tmp_path: Path) -> None:
    data = read(tmp_path, "\ufeff# " + LONG + "# end\n", MAP + "layout: {comment: '#'}\n")
    assert data.labels == ("a", "b")


def test_names_are_split_and_joints_come_by_key(tmp_path: Path) -> None:
    data = read(tmp_path, POINTS, SPATIAL, JOINTS)
    assert data.labels == ("a", "b", "c")
    assert data.targets == ("one", "two")
    assert data.configuration.tolist() == [1, 1, 0, 2, 2]
    assert data.target.tolist() == [0, 1, 0, 0, 1]
    assert data.has_position.tolist() == [True, True, True, False, False]
    assert data.joints[:, 0].tolist() == [math.radians(v) for v in (10, 20, 30)]
    assert read_csv_of(tmp_path, data).labels == data.labels


def test_unmeasured_configurations_do_not_hold_references(tmp_path: Path) -> None:
    data = read(tmp_path, POINTS, SPATIAL + "references: [two]\n", JOINTS)
    assert (data.targets, data.configuration.tolist()) == (("one",), [1, 0, 2])
    assert data.references is not None
    assert data.references.configuration.tolist() == [1]


def test_joints_come_by_row_order_without_a_key(tmp_path: Path) -> None:
    data = read(tmp_path, POINTS, SPATIAL.replace("  key: label\n", ""), "label,q1\n?,10\n?,20\n")
    assert data.labels == ("b", "a")
    assert data.joints[:, 0].tolist() == [math.radians(10), math.radians(20)]


def test_rows_with_other_names_are_skipped_when_told(tmp_path: Path) -> None:
    points = POINTS + "A::instrument, 0, 0, 0\n"
    data = read(tmp_path, points, SPATIAL.replace("names: {", "names: {others: skip, "), JOINTS)
    assert data.targets == ("one", "two")


def test_a_pattern_may_give_the_target_alone(tmp_path: Path) -> None:
    mapping = MAP.replace("target_column: ball, ", "") + "names: {column: ball, pattern: '(?P<target>..).*'}\n"
    assert read(tmp_path, LONG, mapping).targets == ("on", "tw")


def read_csv_of(folder: Path, data: Dataset) -> Dataset:
    (folder / "canonical.csv").write_text(csv_text(data), encoding="utf-8")
    return read_csv(folder / "canonical.csv")


# -- the guide's examples --------------------------------------------------------------------------------


@pytest.fixture
def guide(tmp_path: Path) -> Path:
    """Folder with every example file of the guide page."""
    page = (Path(__file__).parents[3] / "docs" / "guide" / "data.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```\{code-block\} \w+\n:caption: (\S+)\n(.*?)```", page, re.DOTALL)
    for name, content in blocks:
        (tmp_path / name).write_text(content, encoding="utf-8")
    assert {"measurements.csv", "spatial.yaml", "wide.yaml"} <= {name for name, _ in blocks}
    return tmp_path


def test_the_guides_examples_all_say_the_same(guide: Path) -> None:
    canonical = read_csv(guide / "measurements.csv")
    plain, missing = read_matrices(
        guide / "joints.txt", {n: guide / f"{n}.txt" for n in ("smr_1", "smr_2")}, {}, "deg", "mm"
    )
    spatial = read_noting(guide / "points.txt", guide / "spatial.yaml")[0]
    wide = read_noting(guide / "wide.csv", guide / "wide.yaml")[0]
    blanks = read_noting(guide / "blanks.txt", guide / "blanks.yaml")[0]
    assert missing == {"smr_1": 0, "smr_2": 1}
    assert spatial.references is not None
    assert spatial.references.targets == ("floor_1",)
    for data in (plain, spatial, wide, blanks):
        assert data.targets == canonical.targets
        np.testing.assert_array_equal(data.joints, canonical.joints)
        np.testing.assert_array_equal(data.position[:3], canonical.position[:3])
    assert wide.labels == spatial.labels == canonical.labels
    assert canonical.sigma is not None
    np.testing.assert_array_equal(spatial.sigma, canonical.sigma[:3])
    assert wide.has_position.tolist() == [True, True, True, False]


# -- refusals --------------------------------------------------------------------------------------------


TWO = MAP.replace("target_column: ball", "target: a").replace("joints:", "  - {target: b, x: Z, y: V, z: W}\njoints:")
SKIP = SPATIAL.replace("'.*::", "'Q::").replace("names: {", "names: {others: skip, ")
REFUSED: list[tuple[str, str, list[str]]] = [
    (LONG, MAP.replace("x: X", "x: Xx"), ["map.yaml, readings[1].x", "no such column", "Y, Z", "Did you mean X?"]),
    (LONG, MAP.replace("q2]", "A2]"), ["map.yaml, joints.columns[2]", "'A2'"]),
    (LONG, MAP.replace("column: pose", "column: poses"), ["configuration.column", "Did you mean pose?"]),
    (LONG, MAP.replace("column: ball", "column: bal"), ["readings[1].target_column", "Did you mean ball?"]),
    (LONG.replace("q2", "X"), MAP.replace(", q2", ""), ["readings[1].x", "2 columns of this name"]),
    (LONG.replace("q2", "q1"), MAP, ["has 2 columns of this name, columns 2 and 3"]),
    (LONG.replace("Y", "Y [mm]"), MAP, ["got 'Y'", "Did you mean Y [mm]?"]),
    (LONG, MAP + "layout: {header: none}", ["configuration.column", "'pose'", "allowed: 1, 2, 3, 4, 5, 6, 7"]),
    (LONG, MAP + "layout: {delimiter: tab}", ["no such column", "Check the header line and the delimiter"]),
    (LONG, MAP + "layout: {header: 9}", ["table.txt, line 9", "should hold the header is empty"]),
    ("\n" + LONG, MAP, ["table.txt, line 1", "should hold the header is empty"]),
    (LONG, MAP + "layout: {header: 4}", ["a header and no rows"]),
    ("", MAP, ["table.txt: the file is empty"]),
    ("# x\n", MAP + "layout: {header: none, comment: '#'}", ["the file holds no rows"]),
    (LONG, MAP + "layout: {encoding: klingon}", ["map.yaml, layout.encoding", "no such encoding"]),
    (LONG + "é", MAP + "layout: {encoding: ascii}", ["not ascii text", "layout.encoding"]),
    (LONG, MAP + "layout: {encoding: hex}", ["not hex text"]),
    (LONG, MAP + "layout: {delimiter: pipe}", ["map.yaml, layout.delimiter", "allowed: comma, semicolon"]),
    (LONG, MAP + "layout: {first_row: 1}", ["map.yaml, layout", "first_row must be below the header"]),
    (LONG.replace("7,,9", "7,nan,9"), MAP, ["table.txt, line 4, column Y", "NaN and infinity"]),
    (LONG.replace("q1", '"q1'), MAP, ["line 1, cell 2: the quotes do not fit together"]),
    (LONG.replace("7,,9", '7,"8,5",9'), MAP, ["line 4, column Y", "decimal: comma"]),
    (LONG.replace("7,,9", "7,8.5,9"), MAP + "layout: {decimal: comma}", ["line 4", "decimal: point"]),
    (LONG + "b,30,40\n", MAP, ["line 5, column ball", "as many cells as the header", "3 cells", "7 cells"]),
    (LONG + "b,30,40,one,7,8,9,10\n", MAP, ["line 5, cell 8: the row does not have as many cells as the header"]),
    (LONG.replace("two", '"two'), MAP, ["line 3, cell 4: the quotes do not fit together"]),
    (LONG.replace("a,10,20,two", 'a,"10",20,"t""wo'), MAP, ["line 3, cell 4: the quotes do not fit together"]),
    ("1 2\n1 2 3\n", MAP + "layout: {header: none, delimiter: whitespace}", ["the first row", "blanks in it"]),
    ("1;2\n1;2;3\n", MAP + "layout: {header: none, delimiter: semicolon}", ["separator inside a name"]),
    (LONG.replace("b,30", "a,30"), MAP, ["table.txt, line 4, column q1", "differ from those on line 2"]),
    (LONG, MAP + "references: [tvo]", ["map.yaml, references", "allowed: one, two", "mean two?"]),
    (LONG, MAP + "references: [one, two]", ["all rows are reference points"]),
    (LONG, MAP + "refs: [two]", ["map.yaml, refs", "Did you mean references"]),
    (LONG, MAP.replace("length_unit: mm\n", ""), ["map.yaml, length_unit", "missing"]),
    (LONG, MAP.replace("unit: deg", "unit: grad"), ["map.yaml, joints.unit", "allowed: deg, rad"]),
    (LONG, MAP.replace("  unit: deg\n", ""), ["map.yaml, joints", "give either unit:"]),
    (LONG, MAP.replace("unit: deg", "units: [deg]"), ["map.yaml, joints", "2 columns and 1 unit"]),
    (LONG, MAP + "  key: pose\n", ["map.yaml, joints", "name it with file:"]),
    (LONG, MAP.partition("joints:")[0], ["map.yaml, joints: this entry is missing", "Only `truearm measure`"]),
    (LONG, MAP.replace("joints:", "joint:"), ["map.yaml, joint", "Did you mean joints"]),
    (LONG, MAP.replace("{column: pose}", "{}"), ["map.yaml, configuration", "each: row"]),
    (LONG, MAP.replace("configuration: {column: pose}\n", ""), ["map.yaml", "from one place", "?P<configuration>"]),
    (LONG, MAP.replace("target_column: ball, ", ""), ["target of readings[1]", "one place", "target_column"]),
    (LONG, MAP.replace("target_column", "target: a, target_column"), ["target of readings[1]", "one place"]),
    (LONG, MAP.replace("joints:", "  - {target: a, x: X, y: Y, z: Z}\njoints:"), ["several readings a row"]),
    (LONG, MAP.replace("z: Z", "z: Z, qw: X"), ["readings[1]", "all of qw, qx, qy, qz"]),
    (LONG, MAP + "sigma: {value: 0, unit: mm}", ["map.yaml, sigma.value", "allowed: more than 0"]),
    (LONG, MAP + "sigma_rot: {value: 1, unit: mrad}", ["map.yaml", "no reading has an orientation"]),
    (LONG, MAP + "names: {column: ball, pattern: '('}", ["names.pattern", "not a regular expression"]),
    (LONG, MAP + "names: {column: ball, pattern: 'x{1001}'}", ["names.pattern", "not a regular"]),
    (LONG, MAP + "names: {column: ball, pattern: 'x'}", ["names.pattern", "?P<configuration>", "or both"]),
    (LONG, MAP + "names: {column: ball, pattern: '(?P<configuration>.*)'}", ["map.yaml", "from one place"]),
    (POINTS, SPATIAL.replace("'.*::", "'Q::"), ["table.txt, line 2, column 1", "'A::b::one'", "names.pattern"]),
    (POINTS, SKIP, ["map.yaml, names.pattern", "no name fits", "names such as 'A::b::one'"]),
    (POINTS + "A::instrument, 0, 0, 0\n", SPATIAL, ["line 5, column 1", "from end to end", "others: skip"]),
    (POINTS.replace("::b::", "::d::"), SPATIAL, ["table.txt, line 2", "no joints in", "'d'", "joints.key"]),
    (POINTS, SPATIAL.replace("key: label", "key: lable"), ["map.yaml, joints.key", "Did you mean label?"]),
    (POINTS, SPATIAL.replace("  key: label\n", ""), ["joints.csv", "3 rows", "allowed: 2 rows"]),
    (POINTS, SPATIAL.replace("joints.csv", "joint.csv"), ["no such file", "Did you mean joints.csv"]),
    (LONG, MAP.replace("y: Y", "y: X"), ["used twice, for readings[1].x and for readings[1].y; got 'X'"]),
    (LONG, MAP.replace("q2]", "Z]"), ["used twice, for readings[1].z and for joints.columns[2]"]),
    (LONG, MAP.replace("z: Z", "z: Z, qw: w, qx: a, qy: a, qz: c"), ["used twice", "got 'a'", "readings[1].qy"]),
    (LONG, TWO, ["used twice, for readings[1].z and for readings[2].x; got 'Z'"]),
    (LONG, MAP.replace("target_column: ball", 'target: "a\\nb"'), ["readings[1].target", "allowed: one line of text"]),
]


def test_refusals(tmp_path: Path) -> None:
    for table, mapping, parts in REFUSED:
        with refusing(*parts, of=parts):
            read(tmp_path, table, mapping, JOINTS)
    (tmp_path / "map.yaml").write_text(MAP)
    (tmp_path / "table.txt").write_bytes(LONG.replace("two", "tw@").encode().replace(b"@", b"\xe4"))
    with refusing("line 3, cell 4: the file is not utf-8 text"):
        read_noting(tmp_path / "table.txt", tmp_path / "map.yaml")


def test_one_name_may_stand_in_two_files(tmp_path: Path) -> None:
    data = read(tmp_path, POINTS, SPATIAL.replace("[q1]", "[2]").replace("q1", "2"), JOINTS.replace("q1", "2"))
    assert data.joints[0].tolist() == [math.radians(10)]


# -- round trip ------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.lists(st.floats(-1e4, 1e4, allow_subnormal=False), min_size=8, max_size=8), min_size=1, max_size=5),
    st.sampled_from([("comma", ",", "point"), ("semicolon", ";", "comma"), ("whitespace", " ", "comma")]),
)
def test_wide_tables_keep_every_number(rows: list[list[float]], layout: tuple[str, str, str]) -> None:
    delimiter, sign, decimal = layout
    text = "\n".join(sign.join(repr(v).replace(".", "," if decimal == "comma" else ".") for v in row) for row in rows)
    mapping = f"""
truearm: truearm-mapping/1
layout: {{delimiter: {delimiter}, decimal: {decimal}, header: none}}
configuration: {{each: row}}
length_unit: m
readings:
  - {{target: one, x: 3, y: 4, z: 5}}
  - {{target: two, x: 6, y: 7, z: 8}}
joints: {{columns: [1, 2], unit: rad}}
"""
    with tempfile.TemporaryDirectory() as folder:
        data = read(Path(folder), text, mapping)
    values = np.array(rows)
    np.testing.assert_array_equal(data.joints, values[:, :2])
    np.testing.assert_array_equal(data.position, values[:, 2:].reshape(-1, 3))
    assert data.target.tolist() == [0, 1] * len(rows)


def test_real_points_in_spatial_analyzer_form(measured_data: Path, tmp_path: Path) -> None:
    folder = measured_data / "irb120-faro"
    names = ("target_1", "target_2", "target_3")
    plain, _ = read_matrices(folder / "joints_read.txt", {n: folder / f"{n}.txt" for n in names}, {}, "deg", "mm")
    points = {name: (folder / f"{name}.txt").read_text(encoding="utf-8").split("\n") for name in names}
    lines = [f"Cell::{row + 1}::{name}, {', '.join(points[name][row].split())}" for row in range(500) for name in names]
    joints = (folder / "joints_read.txt").read_text(encoding="utf-8")
    mapping = SPATIAL.replace("  key: label\n", "  layout: {delimiter: whitespace, header: none}\n")
    data = read(tmp_path, "\n".join(lines), mapping.replace("[q1]", "[1, 2, 3, 4, 5, 6]"), joints)
    assert csv_text(data) == csv_text(plain)
