"""The canonical CSV: what it means, what is refused, and that writing what was read changes nothing."""

from __future__ import annotations

import contextlib
import math
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.expecting import refusing

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.data.readers.configurations import read_poses

HEADER = "configuration,joint_1 [deg],joint_2 [deg],target,x [mm],y [mm],z [mm]"
PLAIN = f"""{HEADER}
P1,10,-20.5,tcp,1000,2,3
P1,10.0,-20.5,side,1001,2,3
P2,0,90,tcp,1e3,,3
"""


@pytest.fixture
def write(tmp_path: Path) -> WriteFile:
    return WriteFile(tmp_path)


class WriteFile:
    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(self, content: str | bytes) -> Path:
        path = self.folder / "data.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path


def same(a: Dataset, b: Dataset) -> bool:
    """Whether two datasets agree to the last bit in everything but their source."""

    def equal(left: object, right: object) -> bool:
        if left is None or right is None:
            return left is right
        if isinstance(left, Dataset) and isinstance(right, Dataset):
            return same(left, right)
        if isinstance(left, np.ndarray) and isinstance(right, np.ndarray):
            return left.dtype == right.dtype and np.array_equal(left, right, equal_nan=True)
        return left == right

    return all(equal(value, vars(b)[name]) for name, value in vars(a).items() if name != "source")


# -- meaning ---------------------------------------------------------------------------------------------


def test_reads_configurations_targets_and_si_units(write: WriteFile) -> None:
    data = read_csv(write(PLAIN))
    assert data.labels == ("P1", "P2")
    assert data.targets == ("tcp", "side")
    assert data.joint_kinds == ("revolute", "revolute")
    assert data.joints.tolist() == [[math.radians(10), math.radians(-20.5)], [0.0, math.radians(90)]]
    assert data.configuration.tolist() == [0, 0, 1]
    assert data.target.tolist() == [0, 1, 0]
    assert data.position[:2].tolist() == [[1.0, 0.002, 0.003], [1.001, 0.002, 0.003]]
    assert data.source.endswith("data.csv")
    assert (data.quaternion, data.sigma, data.sigma_rot, data.references) == (None, None, None, None)


def test_an_empty_coordinate_is_a_missing_position_and_the_row_stays(write: WriteFile) -> None:
    data = read_csv(write(PLAIN))
    assert data.has_position.tolist() == [True, True, False]
    assert np.isnan(data.position[2]).all()
    assert csv_text(data).splitlines()[-1] == "P2,0.0,90.0,tcp,,,"


def test_columns_come_in_any_order(write: WriteFile) -> None:
    data = read_csv(write("z [mm],target,joint_2 [deg],y [mm],configuration,x [mm],joint_1 [deg]\n3,t,2,2,c,1,1"))
    assert data.position.tolist() == [[0.001, 0.002, 0.003]]
    assert data.joints.tolist() == [[math.radians(1), math.radians(2)]]


def test_units(write: WriteFile) -> None:
    for unit, metres in (("mm", 0.0015), ("m", 1.5), ("um", 1.5e-6), ("in", 1.5 * 0.0254)):
        header = f"configuration,joint_1 [{unit}],target,x [{unit}],y [mm],z [m],sigma [{unit}]"
        data = read_csv(write(f"{header}\nc,1.5,t,1.5,2,3,1.5\n"))
        assert data.joint_kinds == ("prismatic",)
        assert data.sigma is not None
        found = [data.joints[0, 0], *data.position[0], data.sigma[0]]
        assert found == pytest.approx([metres, metres, 0.002, 3.0, metres], rel=1e-15), unit
    header = HEADER.replace("[deg]", "[rad]")
    for unit, radians in (("mrad", 2e-3), ("rad", 2.0), ("deg", math.radians(2))):
        data = read_csv(write(f"{header},qw,qx,qy,qz,sigma_rot [{unit}]\nc,1,2,t,1,2,3,1,0,0,0,2\n"))
        assert data.joints.tolist() == [[1.0, 2.0]]
        assert data.sigma_rot == pytest.approx([radians], rel=1e-15), unit


def test_quaternions_are_normalised_and_may_be_missing(write: WriteFile) -> None:
    rows = "a,1,2,t,1,2,3,0.5,0.5,0.5,0.5005\na,1,2,u,1,2,3,,0,0,0\n"
    data = read_csv(write(f"{HEADER},qw,qx,qy,qz\n{rows}"))
    assert data.quaternion is not None
    assert np.linalg.norm(data.quaternion[0]) == pytest.approx(1.0, abs=1e-15)
    assert np.isnan(data.quaternion[1]).all()
    assert data.has_orientation.tolist() == [True, False]
    assert data.has_position.tolist() == [True, True]


def test_columns_without_any_entry_declare_nothing(write: WriteFile) -> None:
    assert read_csv(write(f"{HEADER},qw,qx,qy,qz\na,1,2,t,1,2,3,,,,\n")).quaternion is None
    assert read_csv(write(f"{HEADER},sigma [mm]\na,1,2,t,1,2,3,\n")).sigma is None


def test_references_stand_beside_the_targets(write: WriteFile) -> None:
    rows = "a,1,2,b1,target,1,2,3\na,1,2,base,reference,4,5,6\nb,3,4,base,reference,,5,6\n"
    data = read_csv(write(f"{HEADER.replace('target', 'target,role')}\n{rows}"))
    assert (data.targets, data.labels, len(data.target)) == (("b1",), ("a", "b"), 1)
    assert data.references is not None
    assert (data.references.targets, data.references.labels) == (("base",), ("a", "b"))
    assert data.references.configuration.tolist() == [0, 1]
    assert data.references.has_position.tolist() == [True, False]
    assert data.references.position[0].tolist() == [0.004, 0.005, 0.006]


def test_sigma_may_lack_where_there_is_no_reading_and_for_the_references(write: WriteFile) -> None:
    rows = "a,1,2,t,target,1,2,3,0.01\na,1,2,u,target,,2,3,\na,1,2,base,reference,1,2,3,\n"
    data = read_csv(write(f"{HEADER.replace('target', 'target,role')},sigma [mm]\n{rows}"))
    assert data.sigma is not None
    assert data.sigma[0] == pytest.approx(1e-5)
    assert np.isnan(data.sigma[1])
    assert data.references is not None
    assert data.references.sigma is None


def test_windows_files_quotes_blank_lines_and_blanks(write: WriteFile) -> None:
    content = PLAIN.replace("tcp", '"big, ""red"" ball"').replace(",2,3", " , 2 ,3 ").replace("\n", "\r\n")
    data = read_csv(write(b"\xef\xbb\xbf\r\n" + content.encode() + b"\r\n\r\n"))
    assert data.targets == ('big, "red" ball', "side")
    assert data.position[0].tolist() == [1.0, 0.002, 0.003]


def test_a_target_may_be_measured_twice_at_a_configuration(write: WriteFile) -> None:
    assert len(read_csv(write(f"{HEADER}\na,1,2,t,1,2,3\na,1,2,t,1,2,3.1\n")).target) == 2


# -- refusals --------------------------------------------------------------------------------------------

Q = ",qw,qx,qy,qz"
ROLE, SIGMA, TURNED = f"{HEADER},role\n", f"{HEADER},sigma [mm]\n", f"{HEADER}{Q}\n"
ORDERED = "configuration,order,joint_1 [deg],target,x [mm],y [mm],z [mm]\n"
VISITED = "configuration,joint_1 [deg],target,visit,x [mm],y [mm],z [mm]\n1,0.0,a,VISIT,1.0,2.0,3.0\n"
PULL = "force_x [N],force_y [N],force_z [N],moment_x [N m],moment_y [N m],moment_z [N m]"


def beside(column: str, cells: str) -> str:
    """A row with further columns."""
    return f"{HEADER},{column}\nc,1,2,t,1,2,3,{cells}\n"


REFUSED: list[tuple[str, list[str]]] = [
    ("", ["the file is empty"]),
    ("  \n\n", ["the file is empty"]),
    (HEADER, ["a header and no rows"]),
    (PLAIN.replace(",", ";"), ["line 1", "semicolons", "import table"]),
    (PLAIN.replace(",", "\t"), ["line 1", "tabs", "allowed: commas"]),
    (PLAIN.replace(",", " "), ["line 1", "blanks", "import table"]),
    (PLAIN.replace(",", "|"), ["line 1", "vertical bars"]),
    (PLAIN.replace("x [mm]", "x"), ["line 1, column 5, x", "no unit is given", "mm, m, um, in"]),
    (PLAIN.replace("x [mm]", "x []"), ["no unit is given"]),
    (PLAIN.replace("x [mm]", "x [cm]"), ["line 1, column 5", "'cm'", "allowed: mm, m, um, in"]),
    (PLAIN.replace("x [mm]", "x [deg]"), ["'deg'", "allowed: mm, m, um, in"]),
    (PLAIN.replace("joint_1 [deg]", "joint_1"), ["column 2, joint_1", "no unit", "deg, rad, mm, m, um, in"]),
    (PLAIN.replace("joint_1 [deg]", "joint_1 [mrad]"), ["'mrad'", "deg, rad, mm"]),
    (beside(f"{Q[1:]},sigma_rot [mm]", "1,0,0,0,1"), ["'mm'", "mrad, rad, deg"]),
    (PLAIN.replace("target", "target [mm]"), ["column 4", "takes no unit"]),
    (PLAIN.replace("target", "taget"), ["line 1, column 4", "not known", "Did you mean target?"]),
    (PLAIN.replace("x [mm]", "X [mm]"), ["'X [mm]'", "Did you mean x [mm]?"]),
    (PLAIN.replace("x [mm]", "x (mm)"), ["'x (mm)'", "Did you mean x [mm]?"]),
    (PLAIN.replace("x [mm]", "x [mm] [mm]"), ["'x [mm] [mm]'", "Did you mean x [mm]?"]),
    (PLAIN.replace("joint_1 [", "Joint 1 ["), ["'Joint 1 [deg]'", "Did you mean joint_1 [deg]?"]),
    (PLAIN.replace("target", "???"), ["'???'", "allowed: configuration, joint_1 [deg] .."]),
    (PLAIN.replace("target", ""), ["column 4", "the column has no name"]),
    (PLAIN.replace("y [mm]", "x [m]"), ["column 6 as well as column 5", "column x appears twice"]),
    (PLAIN.replace("joint_2", "joint_1"), ["joint_1 appears twice"]),
    (PLAIN.replace("joint_2", "joint_3"), ["joint_2 is missing", "joint_1, joint_3", "without a gap"]),
    (PLAIN.replace("joint_1", "joint_3"), ["joint_1 is missing", "joint_2, joint_3"]),
    (PLAIN.replace("joint_1", "joint_0"), ["'joint_0 [deg]'", "not known"]),
    (beside(Q[1:-3], "1,0,0"), ["line 1", "not complete", "Add qz"]),
    (beside("sigma_rot [mrad]", "1"), ["sigma_rot", "no orientation"]),
    (PLAIN + "P3,1\n", ["line 5", "2 cells", "allowed: 7 cells"]),
    (PLAIN + "P3,1,2,tcp,1,5,2,3\n", ["line 5", "8 cells", "decimal commas"]),
    (PLAIN.replace(",2,3", ',"2,5",3'), ["line 2, column y [mm]", "decimal comma", "decimal: comma"]),
    (PLAIN.replace("1001", "1001?"), ["line 3, column x [mm]", "a number belongs here", "'1001?'"]),
    (PLAIN.replace("1001", "1_001"), ["line 3, column x [mm]", "'1_001'"]),
    (PLAIN.replace("1001", "١"), ["line 3, column x [mm]", "a number belongs here"]),
    (PLAIN.replace("1001", "NaN"), ["line 3, column x [mm]", "NaN and infinity", "Leave the cell empty"]),
    (PLAIN.replace("1001", "-inf"), ["NaN and infinity", "'-inf'"]),
    (PLAIN.replace("1001", "1e999"), ["line 3, column x [mm]", "too large", "'1e999'"]),
    (PLAIN.replace("1001", "-1.001e9"), ["line 3, column x [mm]", "too large to be plausible", "1e+09 mm"]),
    (PLAIN.replace("10.0", "1e8"), ["line 3, column joint_1 [deg]", "too large", "5.72958e+07 deg"]),
    (PLAIN.replace("10.0", "nan"), ["line 3, column joint_1 [deg]", "NaN and infinity", "Fill in the number"]),
    (PLAIN.replace("10.0", ""), ["line 3, column joint_1 [deg]", "the cell is empty"]),
    (PLAIN.replace("10.0", "10.1"), ["line 3", "joint_1 [deg]", "'P1'", "10, as on line 2"]),
    (PLAIN.replace("side", "si\tde"), ["line 3, column target", "control character", r"'si\tde'"]),
    (PLAIN.replace("side", "si\0de"), ["line 3, column target", "control character"]),
    (PLAIN.replace("side", ""), ["line 3, column target", "the cell is empty", "Only readings may be missing"]),
    (PLAIN.replace("side", '"side'), ["quotes do not fit"]),
    (PLAIN.replace("side", '"si"de"'), ["line 3", "quotes do not fit"]),
    (PLAIN.replace("P2", " "), ["line 4, column configuration", "the cell is empty"]),
    (PLAIN.replace("P2", '"P\n2"'), ["line 5, column configuration", "line break"]),
    (SIGMA + "a,1,2,t,1,2,3,1e-7\n", ["line 2, column sigma [mm]", "too small", "1e-06 to 1e+06 mm"]),
    (beside("sigma [m]", "1001"), ["column sigma [m]", "too large", "1e-09 to 1000 m"]),
    (beside(f"{Q[1:]},sigma_rot [rad]", "1,0,0,0,11"), ["column sigma_rot [rad]", "too large", "1e-09 to 10 rad"]),
    (SIGMA + "a,1,2,t,1,2,3,0\n", ["line 2, column sigma [mm]", "above zero"]),
    (SIGMA + "a,1,2,t,1,2,3,1\na,1,2,u,1,2,3,-1\n", ["line 3, column sigma [mm]", "'-1'"]),
    (SIGMA + "a,1,2,t,1,2,3,1\na,1,2,u,1,2,3,\n", ["line 3, column sigma", "for all readings, or for none"]),
    (
        f"{HEADER}{Q},sigma_rot [mrad]\na,1,2,t,1,2,3,1,0,0,0,1\na,1,2,u,1,2,3,1,0,0,0,\n",
        ["line 3, column sigma_rot", "for all readings, or for none"],
    ),
    (ROLE + "a,1,2,t,1,2,3,base\n", ["line 2, column role", "'base'", "target, reference or fixture"]),
    (ROLE + "a,1,2,t,1,2,3,\n", ["line 2, column role", "the cell is empty"]),
    (ROLE + "a,1,2,t,1,2,3,reference\n", ["all rows are reference points"]),
    (ROLE + "a,1,2,t,1,2,3,target\nb,1,2,t,1,2,3,reference\n", ["lines 2 and 3", "'t' is a target on one line"]),
    (TURNED + "a,1,2,t,1,2,3,1,0,0,0.1\n", ["line 2, columns qw qx qy qz", "length 1.00499"]),
    (TURNED + "a,1,2,t,1,2,3,0,0,0,0\n", ["length 0"]),
    (beside("temperature", "20"), ["column 8, temperature", "no unit is given", "allowed: degC"]),
    (beside("temperature [K]", "293"), ["got 'K'; allowed: degC"]),
    (beside("temperature [degC]", ""), ["line 2, column temperature [degC]", "the cell is empty"]),
    (beside("temperature [degC]", "warm"), ["a number belongs here; got 'warm'"]),
    (beside("force_x [kN],force_y [N],force_z [N]", "1,2,3"), ["got 'kN'; allowed: N"]),
    (beside("force_x [N],force_y [N]", "1,2"), ["force_z is missing", "Add force_z [N]; it may be zero"]),
    (beside("force_z [N]", "1"), ["the column force_x is missing"]),
    (beside("moment_x [N m],moment_y [N m],moment_z [N m]", "1,2,3"), ["the column force_x is missing"]),
    (beside(PULL.rpartition(",")[0], "1,2,3,4,5"), ["the column moment_z is missing"]),
    (beside("weight [N]", "1"), ["the column is not known", "temperature [degC], force_x [N]"]),
    (ORDERED + "a,1,0,t,1,2,3\nb,1,0,t,1,2,3\n", ["line 3, column order", "'a' has this place in the order"]),
    (ORDERED + "a,1,0,t,1,2,3\na,2,0,u,1,2,3\n", ["line 3, column order: order differs from line 2"]),
    (ORDERED + "a,-1,0,t,1,2,3\n", ["line 2, column order: this is no place in an order"]),
    (ORDERED + "a,,0,t,1,2,3\n", ["line 2, column order: the cell is empty"]),
    *((VISITED.replace("VISIT", visit), ["data.csv, line 2"]) for visit in ("", "-1", "1.5", "first")),
]


def test_refusals_name_the_place_what_came_what_is_allowed_and_the_cure(write: WriteFile) -> None:
    for content, parts in REFUSED:
        with refusing("data.csv", *parts, of=content):
            read_csv(write(content))
    for name in ("configuration", "joint_1 [deg]", "target", "x [mm]", "y [mm]", "z [mm]"):
        header = ",".join(n for n in HEADER.replace("joint_2 [deg],", "").split(",") if n != name)
        with refusing("is missing", f"Add {name}"):
            read_csv(write(f"{header}\n1,2,3,4,5\n"))
    with refusing("Save it as UTF-8"):
        read_csv(write(PLAIN.encode("utf-16")))
    with refusing("Did you mean data.csv"):
        read_csv(write(PLAIN).with_name("date.csv"))


def test_writing_refuses_units_and_configurations_without_readings(write: WriteFile) -> None:
    data = read_csv(write(PLAIN))
    with refusing("length unit: ", "allowed: mm, m, um, in"):
        csv_text(data, length_unit="cm")
    with refusing("angle unit: ", "allowed: deg, rad"):
        csv_text(data, angle_unit="grad")
    unseen = Dataset(**(vars(data) | {"configuration": np.zeros(3, dtype=np.intp)}))
    with refusing("configuration P2: ", "without a reading", "missing readings"):
        csv_text(unseen)


# -- writing ---------------------------------------------------------------------------------------------


def test_written_text_is_as_expected(write: WriteFile) -> None:
    rows = "a,0.1,-3,t,target,0.1,2,3,1,0,0,0,0.02,0.5\na,0.1,-3,base,reference,1,2,3,,,,,0.02,\n"
    header = f"{HEADER.replace('joint_2 [deg]', 'joint_2 [mm]').replace('target', 'target,role')}{Q}"
    text = csv_text(read_csv(write(f"{header},sigma [mm],sigma_rot [mrad]\n{rows}")))
    assert text == (
        "configuration,joint_1 [deg],joint_2 [mm],target,role,x [mm],y [mm],z [mm],qw,qx,qy,qz,"
        "sigma [mm],sigma_rot [mrad]\n"
        "a,0.1,-3.0,t,target,0.1,2.0,3.0,1.0,0.0,0.0,0.0,0.02,0.5\n"
        "a,0.1,-3.0,base,reference,1.0,2.0,3.0,,,,,0.02,\n"
    )


def test_written_configuration_by_configuration(write: WriteFile) -> None:
    data = read_csv(write(f"{HEADER}\na,1,2,t,1,2,3\nb,3,4,t,1,2,3\na,1,2,u,1,2,3\n"))
    assert [line[0] for line in csv_text(data).splitlines()[1:]] == ["a", "a", "b"]


def _lengths(scale: float) -> st.SearchStrategy[float]:
    return st.floats(-scale, scale, allow_subnormal=False).map(lambda v: v if abs(v) > 1e-9 else 0.0)


_NAMES = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")) | st.just(" "), min_size=1).filter(
    lambda name: name == name.strip() != ""
)


@st.composite
def datasets(draw: st.DrawFn) -> Dataset:
    """Datasets of any content, configuration by configuration, as a file can hold them."""
    labels = tuple(draw(st.lists(_NAMES, min_size=1, max_size=4, unique=True)))
    names = draw(st.lists(_NAMES, min_size=2, max_size=5, unique=True))
    kinds = tuple(draw(st.lists(st.sampled_from(["revolute", "prismatic"]), min_size=1, max_size=3)))
    joints = np.array([[draw(_lengths(7.0)) for _ in kinds] for _ in labels])
    oriented, sigma, sigma_rot = draw(st.booleans()), draw(st.booleans()), draw(st.booleans())

    def part(targets: tuple[str, ...], references: Dataset | None) -> Dataset:
        count = len(labels) * len(targets)
        position = np.array([[draw(_lengths(100.0)) for _ in range(3)] for _ in range(count)])
        q = np.array([[draw(st.floats(0.1, 1.0)) for _ in range(4)] for _ in range(count)])
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        position[np.array(draw(st.lists(st.booleans(), min_size=count, max_size=count)))] = np.nan
        q[np.array(draw(st.lists(st.booleans(), min_size=count, max_size=count)))] = np.nan
        spread = np.array([draw(st.floats(1e-7, 1.0)) for _ in range(count)])
        return Dataset(
            source="drawn",
            labels=labels,
            joints=joints,
            joint_kinds=kinds,
            targets=targets,
            configuration=np.repeat(np.arange(len(labels), dtype=np.intp), len(targets)),
            target=np.tile(np.arange(len(targets), dtype=np.intp), len(labels)),
            position=position,
            quaternion=q if oriented and not np.isnan(q).all() else None,
            sigma=spread if sigma else None,
            sigma_rot=spread if oriented and sigma_rot else None,
            references=references,
        )

    beside = part(tuple(names[-1:]), None) if draw(st.booleans()) else None
    return part(tuple(names[:-1]), beside)


@settings(max_examples=25, deadline=None)
@given(datasets(), st.sampled_from(["mm", "m", "um", "in"]), st.sampled_from(["deg", "rad"]))
def test_writing_what_was_read_changes_nothing(drawn: Dataset, length: str, angle: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "data.csv"
        path.write_text(csv_text(drawn, length, angle), encoding="utf-8", newline="")
        read = read_csv(path)
        path.write_text(written := csv_text(read, length, angle), encoding="utf-8", newline="")
        again = read_csv(path)
    assert same(read, again)
    assert csv_text(again, length, angle) == written
    assert (read.labels, read.targets, read.joint_kinds) == (drawn.labels, drawn.targets, drawn.joint_kinds)
    np.testing.assert_allclose(read.joints, drawn.joints, rtol=1e-15)
    np.testing.assert_allclose(read.position, drawn.position, rtol=1e-15)
    assert (read.quaternion is None) == (drawn.quaternion is None)
    if read.quaternion is not None and drawn.quaternion is not None:
        np.testing.assert_allclose(read.quaternion, drawn.quaternion, rtol=1e-14)


@settings(max_examples=25, deadline=None)
@given(st.text(max_size=200) | st.text(st.sampled_from('a1.,;"\n\r\t -e'), max_size=60).map(lambda t: f"{HEADER}\n{t}"))
def test_any_text_is_read_or_refused_and_nothing_else(text: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "data.csv"
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        with contextlib.suppress(InputError):
            read_csv(path)


# -- circumstances -----------------------------------------------------------------------------------------


UNDER_LOAD = f"""{HEADER},temperature [degC],{PULL}
3,10.0,-20.5,tcp,1000.0,2.0,3.0,21.5,10.0,-0.5,0.1,0.0,1.25,-3.0
3,10.0,-20.5,side,1001.0,2.0,3.0,21.5,10.0,-0.5,0.1,0.0,1.25,-3.0
1,0.0,90.0,tcp,1000.0,,3.0,-4.0,0.0,0.0,0.0,0.0,0.0,0.0
2,5.0,90.0,tcp,1000.0,1.0,3.0,22.125,0.30000000000000004,0.0,0.0,0.0,0.0,0.0
"""


def test_circumstances_belong_to_configurations(write: WriteFile) -> None:
    data = read_csv(write(UNDER_LOAD))
    assert data.wrench is not None
    np.testing.assert_array_equal(data.temperature, [21.5, -4.0, 22.125])
    assert data.wrench.tolist() == [[10, -0.5, 0.1, 0, 1.25, -3], [0] * 6, [0.30000000000000004, *[0] * 5]]
    assert data.postures.wrench is data.wrench
    part = data.of_configurations([2, 0])
    np.testing.assert_array_equal(part.temperature, [22.125, 21.5])


def test_a_force_may_come_without_a_moment(write: WriteFile) -> None:
    header = f"{HEADER},force_x [N],force_y [N],force_z [N]"
    data = read_csv(write(f"{header}\nc,1,2,t,1,2,3,5,6,7\n"))
    np.testing.assert_array_equal(data.wrench, [[5, 6, 7, 0, 0, 0]])
    assert read_csv(write(PLAIN)).wrench is None
    assert read_csv(write(PLAIN)).temperature is None


def test_circumstances_are_written_as_they_were_read(write: WriteFile) -> None:
    first = csv_text(read_csv(write(UNDER_LOAD)))
    assert first.replace(",tcp,1000.0,,3.0,", ",tcp,,,,") == UNDER_LOAD.replace(",tcp,1000.0,,3.0,", ",tcp,,,,")
    again = read_csv(write(first))
    assert csv_text(again) == first
    assert same(again, read_csv(write(UNDER_LOAD)))
    warm = first.replace(f",{PULL}", "")
    warm = "\n".join(line if i == 0 else line.rsplit(",", 6)[0] for i, line in enumerate(warm.splitlines())) + "\n"
    assert csv_text(read_csv(write(warm))) == warm


def test_numbers_are_the_order_of_measurement(write: WriteFile) -> None:
    data = read_csv(write(UNDER_LOAD))  # 1, 2, 3 were measured in this order: 0, 5, 10 deg
    np.testing.assert_array_equal(data.number, [2, 0, 1])
    np.testing.assert_array_equal(data.approach, [[1, -1], [0, 0], [1, 0]])


def test_numbers_count_from_the_first_of_the_campaign_and_other_labels_say_nothing(write: WriteFile) -> None:
    for labels, numbers in (("1 2", [0, 1]), ("0 1", [0, 1]), ("301 305", [300, 304]), ("2 1", [1, 0])):
        first, second = labels.split()
        data = read_csv(write(f"{HEADER}\n{first},1,2,t,1,2,3\n{second},2,2,t,1,2,3\n"))
        assert data.number is not None, labels
        assert data.number.tolist() == numbers
    for labels in ("P1 P2", "1 2b", "1 01", "1.0 2.0", "-1 2", "1 1234567890"):
        first, second = labels.split()
        data = read_csv(write(f"{HEADER}\n{first},1,2,t,1,2,3\n{second},2,2,t,1,2,3\n"))
        assert (data.number, data.approach) == (None, None), labels


def test_a_circumstance_that_changes_within_a_configuration(write: WriteFile) -> None:
    for column, place in (("temperature [degC]", 7), ("force_y [N]", 9), ("moment_z [N m]", 13)):
        lines = UNDER_LOAD.splitlines()
        cells = lines[2].split(",")
        before, cells[place] = cells[place], "7"
        said = f"data.csv, line 3, column {column}: {column} differs from line 2, which has the same configuration"
        with refusing(said, f"got '7'; allowed: {before}, as on line 2"):
            read_csv(write("\n".join([*lines[:2], ",".join(cells), *lines[3:]]) + "\n"))


def test_visits_of_a_configuration_are_read_and_written(write: WriteFile) -> None:
    text = VISITED.replace("VISIT", "1") + "1,0.0,b,2,1.0,2.0,3.0\n2,10.0,a,1,1.0,2.0,3.0\n"
    data = read_csv(write(text))
    np.testing.assert_array_equal(data.visit, [1, 2, 1])
    assert csv_text(data) == text
    part = data.of_configurations([1, 0]).of_readings([2, 0])
    np.testing.assert_array_equal(part.visit, [1, 1])


def test_the_column_order_says_when_each_configuration_was_measured(write: WriteFile) -> None:
    rows = "P7,2,10.0,a,1.0,2.0,3.0\nP7,2,10.0,b,1.0,2.0,3.0\n3,1,0.0,a,1.0,2.0,3.0\n1,4,5.0,a,1.0,2.0,3.0\n"
    data = read_csv(write(ORDERED + rows))
    assert data.approach is not None
    np.testing.assert_array_equal(data.number, [1, 0, 3])
    assert data.approach[:, 0].tolist() == [1, 0, 0]  # nothing is known of the way to 1: the third is not there
    assert csv_text(data) == ORDERED + rows
    assert "order" in csv_text(Dataset.of([[0.1], [0.2]], [[1, 2, 3]] * 2, configurations=["1", "2"], order=[2, 1]))
    assert "order" not in csv_text(Dataset.of([[0.1], [0.2]], [[1, 2, 3]] * 2, configurations=["1", "2"], order=[1, 2]))


# -- pose files: what they may look like

POSE_HEAD = "pose,x [mm],y [mm],z [mm],qw,qx,qy,qz\n"
POSE_ROW = "P1,300,0,500,1,0,0,0\n"


def test_pose_files_come_in_any_order_and_unit(tmp_path: Path) -> None:
    file = tmp_path / "poses.csv"
    file.write_text("qz,qy,qx,qw,z [m],y [mm],x [um],pose\n0,0.6,0,0.8002,0.5,-20,300000,a b\n")
    poses = read_poses(file)
    assert poses.labels == ("a b",)
    assert poses.position == pytest.approx(np.array([[0.3, -0.02, 0.5]]))
    assert poses.quaternion is not None
    assert np.linalg.norm(poses.quaternion) == pytest.approx(1, abs=1e-15)
    assert poses.quaternion[0] == pytest.approx([0.8, 0, 0.6, 0], abs=2e-4)
    file.write_text("pose,x [mm],y [mm],z [mm]\n1,1,2,3\n")
    assert read_poses(file).quaternion is None


def test_pose_files_that_are_none_are_refused(tmp_path: Path) -> None:
    for words, text in (
        ("takes no unit", POSE_HEAD.replace("qw", "qw [1]") + POSE_ROW),
        ("appears twice", POSE_HEAD.replace("qx", "qw") + POSE_ROW),
        ("Did you mean pose", POSE_HEAD.replace("pose", "poses") + POSE_ROW),
        ("column z is missing", POSE_HEAD.replace("z [mm],", "") + POSE_ROW.replace("500,", "")),
        ("column qz is missing", POSE_HEAD.replace(",qz", "") + POSE_ROW.replace(",0\n", "\n")),
        ("'P1' appears twice", POSE_HEAD + POSE_ROW + POSE_ROW),
        ("does not have length 1", POSE_HEAD + POSE_ROW.replace(",1,", ",1.002,")),
        ("a header and no rows", POSE_HEAD),
    ):
        file = tmp_path / "poses.csv"
        file.write_text(text)
        with refusing(words, of=text):
            read_poses(file)
