"""Pages and tables to distances and heights; what cannot be used is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.expecting import known, refused

from truearm.drawn_circle.pages import Page, read_drawn_circles
from truearm.engine.data.readers.canonical import csv_text, read_csv

HEADER = "configuration,joint_1 [deg],joint_2 [deg],angle [deg],height [mm]"


def drawn(path: Path) -> Path:
    """Draw a circle of 25 mm with a gap at 90 deg, dot by dot, and return the file."""
    pitch = 25.4e-3 / 300
    x, y = np.meshgrid(pitch * np.arange(830), pitch * np.arange(800)[::-1])
    away, around = np.hypot(x - 0.035, y - 0.034), np.arctan2(y - 0.034, x - 0.035)
    ink = np.clip((0.25e-3 - np.abs(away - 0.025)) / pitch + 0.5, 0, 1) * (np.abs(around - np.pi / 2) > 0.1)
    Image.fromarray(np.uint8(245 - 180 * ink)).save(path, dpi=(300, 300))
    return path


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return drawn(tmp_path_factory.mktemp("scan") / "page.png")


def table(folder: Path, *rows: str, header: str = HEADER, name: str = "points.csv") -> Path:
    path = folder / name
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_distances_and_heights_of_two_pages(scan: Path, tmp_path: Path) -> None:
    first = table(tmp_path, "1,10,20,0,0.5", "2,11,21,90,0.1", "3,12,22,180,-0.2")
    second = table(tmp_path, "4,20,30,0,0", "5,21,31,200,0.3", name="more.csv")
    data = read_drawn_circles({"a": Page(scan, first), "b": Page(scan, second)}, sigma=2e-5)
    assert data.labels == ("1", "2", "3", "4", "5")
    assert data.fixtures == ("centre_a", "centre_b", "paper_a", "paper_b")
    far, high = known(data.distance)[0::2], known(data.height)[1::2]
    assert high == pytest.approx([5e-4, 1e-4, -2e-4, 0.0, 3e-4])
    assert np.isnan(far).tolist() == [False, True, False, False, False]
    assert far[[0, 2, 3, 4]] == pytest.approx(np.hypot(0.025, [5e-4, 2e-4, 0.0, 3e-4]), abs=5e-6)
    assert data.against.tolist() == [0, 2, 0, 2, 0, 2, 1, 3, 1, 3]
    assert data.joints[4] == pytest.approx(np.radians([21, 31]))
    setup = known(data.setup)
    assert (setup.targets, setup.against.tolist()) == (("centre_a", "centre_b"), [2, 3])
    text = csv_text(data)
    (tmp_path / "data.csv").write_text(text)
    assert csv_text(read_csv(tmp_path / "data.csv")) == text


def test_tables_and_pages_that_do_not_go_together_are_refused(scan: Path, tmp_path: Path) -> None:
    for header, rows, message in (
        (HEADER, ["1,10,20,0,0", "1,10,20,60,0"], r"points\.csv, column configuration.*twice|twice.*got '1'"),
        (HEADER.replace("angle [deg]", "angle"), ["1,10,20,0,0"], r"no unit is given"),
        (HEADER.replace("height [mm]", "depth [mm]"), ["1,10,20,0,0"], r"the column is not known.*depth \[mm\]"),
        (HEADER.replace("joint_2", "joint_3"), ["1,10,20,0,0"], r"the column joint_2 is missing"),
        (HEADER.replace("joint_2", "joint_1"), ["1,10,20,0,0"], r"joint_1 appears twice"),
        (HEADER.replace(",height [mm]", ""), ["1,10,20,0"], r"the column height is missing"),
        (HEADER, ["1,10,20,north,0"], r"line 2, column angle \[deg\].*north"),
        (HEADER.replace(",", ";"), ["1;10;20;0;0"], r"not separated by commas"),
    ):
        refused(None, message, read_drawn_circles, {"a": Page(scan, table(tmp_path, *rows, header=header))})
    first = Page(scan, table(tmp_path, "1,10,20,0,0"))
    refused(None, r"a configuration is on two pages.*'1'", read_drawn_circles, {"a": first, "b": first})
    pendant = table(tmp_path, "2,10,20,0,0", header=HEADER.replace("joint_", "axis_"), name="pendant.csv")
    assert read_drawn_circles({"b": Page(scan, pendant)}).joints_are == "controller"
    words = r"the pages have joint positions of two kinds.*Name the columns"
    refused(None, words, read_drawn_circles, {"a": first, "b": Page(scan, pendant)})
    longer = table(tmp_path, "2,1,2,3,0,0", header=HEADER.replace(",angle", ",joint_3 [deg],angle"), name="b.csv")
    words = r"different joints.*2 and 3 joints"
    refused(None, words, read_drawn_circles, {"a": first, "b": Page(scan, longer)})
