"""Mapping files that are shipped: a file of the documented form, cell by cell."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.house.test_documents import ROOT, blocks

import truearm
from truearm.engine.base.errors import InputError
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.readers.presets import PRESETS, mapping_path

JOINTS = """\
configuration,axis_1 [deg],axis_2 [deg]
P001,10.0,-20.5
P002,-35.0,12.0
P003,5.0,7.0
"""
SPATIAL = """\
// SpatialAnalyzer, working frame: Cell 4
// Collection, Group, Target, X, Y, Z, Ux, Uy, Uz, Time
Cell 4, P001, smr_1, 1841.2213, 112.8402, 655.1041, 0.02, 0.02, 0.02, 03/12/2026 10:00:05
Cell 4, P001, smr_2, 1839.0071, 96.1175, 602.3398, 0.01, 0.01, 0.04, 03/12/2026 10:00:15
Cell 4, P003, smr_1, 1702.5519, -640.2207, 790.6644, 0.02, 0.02, 0.02, 03/12/2026 10:02:05
"""
T_MAC = """\
Point;X;Y;Z;Rx;Ry;Rz;Std X;Std Y;Std Z;Std Rx;Std Ry;Std Rz
P001;1841,2213;112,8402;655,1041;0,0;0,0;1,5707963267948966;0,01;0,01;0,01;0,0001;0,0001;0,0001
P002;-;-;-;n/a;n/a;n/a;-;-;-;-;-;-
P003;1702,5519;-640,2207;790,6644;0,5;0,0;0,0;0,01;0,02;0,02;0,0001;0,0001;0,0004
"""


@pytest.fixture
def cell(tmp_path: Path) -> Path:
    (tmp_path / "joints.csv").write_text(JOINTS)
    (tmp_path / "points.txt").write_text(SPATIAL)
    (tmp_path / "poses.csv").write_text(T_MAC)
    return tmp_path


def imported(cell: Path, file: str, preset: str) -> str:
    truearm.import_table(cell / file, preset, out=cell / "data.csv")
    return (cell / "data.csv").read_text()


def test_spatial_analyzer_cell_by_cell(cell: Path) -> None:
    text = imported(cell, "points.txt", "spatial-analyzer")
    sigma = text.splitlines()[2].rpartition(",")[2]
    assert float(sigma) == pytest.approx(6e-4**0.5)
    assert text == (
        "configuration,order,axis_1 [deg],axis_2 [deg],target,x [mm],y [mm],z [mm],sigma [mm]\n"
        "P001,1,10.0,-20.5,smr_1,1841.2213,112.8402,655.1041,0.02\n"
        f"P001,1,10.0,-20.5,smr_2,1839.0071,96.1175,602.3398,{sigma}\n"
        "P002,2,-35.0,12.0,smr_1,,,,\n"
        "P002,2,-35.0,12.0,smr_2,,,,\n"
        "P003,3,5.0,7.0,smr_1,1702.5519,-640.2207,790.6644,0.02\n"
    )


def test_t_mac_cell_by_cell(cell: Path) -> None:
    text = imported(cell, "poses.csv", "t-mac").splitlines()
    assert text[0] == (
        "configuration,order,axis_1 [deg],axis_2 [deg],target,x [mm],y [mm],z [mm],qw,qx,qy,qz,sigma [mm],"
        "sigma_rot [mrad]"
    )
    first = text[1].split(",")
    assert first[:8] == ["P001", "1", "10.0", "-20.5", "t-mac", "1841.2213", "112.8402", "655.1041"]
    assert [float(v) for v in first[8:12]] == pytest.approx([0.5**0.5, 0, 0, 0.5**0.5])
    assert first[12:] == ["0.01", "0.1"]
    assert text[2] == "P002,2,-35.0,12.0,t-mac,,,,,,,,,"
    last = [float(v) for v in text[3].split(",")[5:]]
    assert last[:3] == [1702.5519, -640.2207, 790.6644]
    assert last[3:7] == pytest.approx([0.9689124217106447, 0.24740395925452294, 0, 0])
    assert last[7:] == pytest.approx([3e-4**0.5, 6e-2**0.5])


def test_another_file_of_joints_and_a_file_of_the_preset_s_name(cell: Path) -> None:
    (cell / "joints.csv").rename(cell / "driven.csv")
    with pytest.raises(InputError, match=r"joints.csv: there is no such file"):
        truearm.import_table(cell / "points.txt", "spatial-analyzer")
    read = truearm.import_table(cell / "points.txt", "spatial-analyzer", joints_file=cell / "driven.csv")
    assert read.data.joints_are == "controller"
    with pytest.raises(InputError, match=r"no such preset.*presets spatial-analyzer, t-mac\. Did you mean t-mac"):
        truearm.import_table(cell / "points.txt", "tmac")


def test_every_preset_stands_in_the_guide_as_it_is_shipped() -> None:
    text = (ROOT / "docs" / "guide" / "from-your-instrument.md").read_text()
    for preset in PRESETS:
        assert mapping_path(preset).read_text() in text, preset


@pytest.fixture(scope="module")
def guide(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with every file that the guide shows."""
    folder = tmp_path_factory.mktemp("guide")
    for kind, body in blocks(ROOT / "docs" / "guide" / "from-your-instrument.md"):
        if kind.startswith("{code-block}"):
            caption, _, content = body.partition("\n")
            (folder / caption.removeprefix(":caption:").strip()).write_text(content)
    return folder


JOINED = {
    1: "10.0,-20.5,31.25,0.0,45.0,-90.0",
    2: "-35.0,12.0,5.5,60.0,-30.0,15.0",
    3: "20.0,8.0,-14.0,35.0,40.0,100.0",
}


@pytest.mark.parametrize(
    ("table", "rows"),
    [
        (
            "arm.txt",
            [
                "1,1,{1},ball,1841.2213,112.8402,655.1041,0.025",
                "2,2,{2},ball,,,,0.025",
                "3,3,{3},ball,1702.5519,-640.2207,790.6644,0.025",
            ],
        ),
        (
            "inspector.csv",
            [
                "1,1,{1},smr_1,1841.2213,112.8402,655.1041",
                "1,1,{1},smr_2,1839.0071,96.1175,602.3398",
                "2,2,{2},smr_1,,,",
                "2,2,{2},smr_2,,,",
                "3,3,{3},smr_1,1702.5519,-640.2207,790.6644",
            ],
        ),
        ("tool.csv", ["1,1,{1},tool,112.41,-35.22,-1502.3", "2,2,{2},tool,,,", "3,3,{3},tool,98.16"]),
        ("take.csv", ["1,{1},flange,142.319,160.392,2000.101,0.1215", "2,{2},flange,,,,,,,", "3,{3},flange,221.6"]),
        (
            "frames.csv",
            [
                "1,1,{1},t-mac,1841.2213,112.8402,655.1041,0.6683075331759019,0.26073047460871",
                "2,2,{2},t-mac,,,,,,,",
                "3,3,{3},t-mac,1702.5519,-640.2207,790.6644,0.336416460752141",
            ],
        ),
        (
            "rounds.csv",
            [
                "1,1,{1},smr_1,1,1841.2213,112.8402,655.1041",
                "1,1,{1},smr_2,2,1839.0071,96.1175,602.3398",
                "2,2,{2},smr_1,1,,,",
                "2,2,{2},smr_2,1,,,",
                "3,3,{3},smr_1,1,1702.5519,-640.2207,790.6644",
            ],
        ),
    ],
)
def test_the_mappings_of_the_guide_cell_by_cell(guide: Path, table: str, rows: list[str]) -> None:
    mapping = (guide / table).with_suffix(".yaml")
    lines = csv_text(truearm.import_table(guide / table, mapping).data).splitlines()
    assert ",axis_1 [deg],axis_2 [deg]," in lines[0]
    assert len(lines) == len(rows) + 1
    label = "" if table == "take.csv" else "P00"
    for line, row in zip(lines[1:], rows, strict=True):
        wanted = row.replace("{1}", JOINED[1]).replace("{2}", JOINED[2]).replace("{3}", JOINED[3])
        assert line.startswith(label + wanted), line


def test_a_table_of_robodk_cell_by_cell(guide: Path) -> None:
    data = truearm.import_robodk(guide / "robodk.csv", joints_are="controller").data
    assert csv_text(data) == (
        "configuration,axis_1 [deg],axis_2 [deg],axis_3 [deg],axis_4 [deg],axis_5 [deg],axis_6 [deg],"
        "target,x [mm],y [mm],z [mm]\n"
        f"1,{JOINED[1]},1,1841.2213,112.8402,655.1041\n2,{JOINED[2]},1,,,\n"
    )
