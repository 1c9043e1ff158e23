"""Programs are drawn in space, and those whose targets lie in a plane in that plane."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.answered import compensate
from tests.plate import PLATE

import truearm
from truearm.compensation.report import _flat_view, path_figure
from truearm.compensation.result import ProgramCorrection

GRID = np.array([[x, y, 0.0] for x in (0.0, 100.0, 200.0) for y in (0.0, 50.0)])


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> ProgramCorrection:
    folder = tmp_path_factory.mktemp("plate")
    (folder / "plate.mod").write_text(PLATE)
    data = truearm.simulate("irb120", truth="random", poses=20, noise=5e-5, seed=1).data
    robot = truearm.calibrate("irb120", data, model="offsets").robot
    return compensate(
        robot, [folder / "plate.mod"], out=folder / "out", notes={"serial": "12 <3>"}, accept=["not-better-here"]
    )


def test_a_plane_keeps_distances_and_space_is_none() -> None:
    c, s = np.cos(0.6), np.sin(0.6)
    level, wall = GRID + np.array([300.0, 0.0, 80.0]), GRID[:, [2, 0, 1]]
    slope = GRID @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    line = np.outer(np.linspace(0.0, 1.0, 5), [100.0, 200.0, 300.0])
    for points, titles in ((level, ("x [mm]", "y [mm]")), (wall, (None, "z [mm]")), (slope, ()), (line, ())):
        view = _flat_view(points)
        assert view is not None
        assert all(title in (None, seen) for title, seen in zip(titles, view.titles, strict=False))
        seen = view.seen(points)
        assert np.linalg.norm(seen - seen[0], axis=1) == pytest.approx(np.linalg.norm(points - points[0], axis=1))
        if titles and titles[0]:  # from above
            assert view.seen(GRID) == pytest.approx(GRID[:, :2], abs=1e-9)
        elif titles:  # from the side
            assert np.abs(seen[:, 1]) == pytest.approx(np.abs(wall[:, 2]), abs=1e-9)
    assert _flat_view(GRID + np.array([[0.0, 0.0, 2.1 * (i == 2)] for i in range(6)])) is None
    assert _flat_view(GRID[:2]) is None


def test_the_report_draws_what_the_program_is(plate: ProgramCorrection) -> None:
    drawn = path_figure(plate.result.corrections)
    points = np.concatenate([c.tips[c.corrected][:, :3, 3] for c in plate.result.corrections]) * 1e3
    flat = _flat_view(points) is not None
    assert {trace["type"] for trace in drawn["data"]} == ({"scatter"} if flat else {"scatter3d"})
    assert ("scene" in drawn["layout"]) is not flat


def test_notes_are_on_the_page_and_in_the_records(plate: ProgramCorrection) -> None:
    folder = Path(plate.files[0].file.path).parent / "out"
    page = (folder / "compensation.html").read_text()
    assert "Serial number</dt><dd>12 &lt;3&gt;</dd>" in page
    assert plate.summary()["notes"] == plate.applied()["notes"] == {"serial": "12 <3>"}
    assert "12 <3>" in (folder / "plate.mod.truearm.json").read_text()
