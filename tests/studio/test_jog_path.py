"""Paths of the page Jog, without a browser: made where the tip is, written as a path file, drawn and played."""

from __future__ import annotations

import numpy as np
import pytest
from tests.studio.conftest import Serving
from tests.studio.pressing import below
from tests.studio.test_jog_page import act, eventually
from tests.studio.typing_in import typed

from truearm.compensation.jobs import path as job
from truearm.engine.base.errors import InputError
from truearm.engine.robot.library import load_robot
from truearm.studio.pages.jog import JogPage
from truearm.studio.path_points import entries_of, in_words, new_path, path_text, with_section, without_last
from truearm.studio.serving import Studio

_START = (350.0, 0.0, 250.0)


@pytest.fixture
def studio(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> Studio:
    monkeypatch.setattr("truearm.studio.typing_at_rest._REST", 0.01)  # nobody types here
    return serving()


@pytest.fixture
def page(studio: Studio) -> JogPage:
    return next(page for page in studio.window.pages if isinstance(page, JogPage))


def go(page: JogPage, *place: float) -> None:
    page._place._impl.value, page._turns._impl.value = place, (180.0, 0.0, 0.0)
    act(page._go)


def said(studio: Studio) -> str:
    return "".join(studio.window._told)


def test_a_path_is_made_where_the_tip_is_drawn_and_played(studio: Studio, page: JogPage) -> None:
    window, made = studio.window, page.path
    file = window.project.folder / "path.yaml"
    act(made._add, "line")
    assert "the path has no start yet" in said(studio)
    made._kept._impl.value = "direction of z as at its start"
    go(page, *_START)
    act(made._add, "start")
    assert not file.exists()
    go(page, 350.0, 100.0, 250.0)
    act(made._add, "line")
    go(page, 400.0, 150.0, 250.0)
    act(made._add, "circle")
    assert "go to another point of it" in made._said.content
    go(page, 350.0, 200.0, 250.0)
    act(made._add, "circle")
    for place in ((340.0, 50.0, 270.0), _START):
        go(page, *place)
        act(made._add, "waypoint")
    assert window.project.settings.path == "path.yaml"
    assert window.project.changes() == ()
    assert "curve through (340, 50, 270), (350, 0, 250)" in made._said.content
    typed(studio, made._speed, 400.0)
    assert "speed: 400.0" in file.read_text()
    line = page.scene._parts["path"][0].points
    assert np.abs(line[0, 0] - np.array(_START) / 1e3).max() < 1e-6
    assert np.abs(line[-1, 1] - np.array(_START) / 1e3).max() < 1e-6
    go(page, *_START)
    assert page.jogging is not None
    seed = page.jogging.joints
    act(made._do, "play")
    assert window.wait(60.0)
    assert eventually(lambda: page._playing is not None), said(studio)
    followed = job("irb120", file, seed_joints=seed)
    assert followed.lines()[0] in said(studio)
    playing = page._playing
    assert playing is not None
    act(made._do, "stop")
    assert playing.is_set()
    act(made._do, "remove last")
    assert "curve through (340, 50, 270)" in made._said.content
    assert "(350, 0, 250)" not in made._said.content.splitlines()[-1]


def test_a_calibrated_arm_plays_its_corrected_motion(studio: Studio, page: JogPage) -> None:
    from truearm.engine.robot.robot_file.writing import robot_text

    robot = load_robot("irb120").with_frames(load_robot("irb120").base, {"1": (0.0, 0.0, 0.1)})
    (studio.window.project.folder / "result").mkdir()
    found = robot.with_values({"a_3": 0.2712, "theta_offset_2": -1.565})
    (studio.window.project.folder / "result" / "calibrated.yaml").write_text(robot_text(found))
    studio.window.refresh()
    act(page._arm, "calibrated")
    act(page._tip, "1")
    go(page, *_START)
    act(page.path._add, "start")
    go(page, 360.0, 10.0, 250.0)
    act(page.path._add, "line")
    assert "target: '1'" in (studio.window.project.folder / "path.yaml").read_text()
    page.path._speed._impl.value = 400.0
    act(page.path._do, "play")
    assert studio.window.wait(60.0)
    assert page.jogging is not None
    end = np.array([0.36, 0.01, 0.25])
    assert eventually(lambda: np.abs(page.jogging.pose("base")[0] - end).max() < 1e-6)  # type: ignore[union-attr]


def test_what_cannot_be_is_refused_and_the_file_stays(studio: Studio, page: JogPage) -> None:
    made, file = page.path, studio.window.project.folder / "path.yaml"
    act(made._do, "play")
    assert "there is no path to play" in said(studio)
    go(page, *_START)
    act(made._add, "start")
    go(page, 350.0, 100.0, 250.0)
    act(made._add, "line")
    before = file.read_text()
    for place in ((350.0, 50.0, 250.0), _START):
        go(page, *place)
        act(made._add, "circle")
    assert "three points on a line define no circle" in said(studio)
    assert file.read_text() == before
    act(made._add, "start")
    assert "this path has begun already" in said(studio)
    act(made._do, "remove last")
    assert "the only section of a file is not removed" in said(studio)
    file.write_text(before + "# mine\n")
    studio.window.refresh()
    go(page, 350.0, 50.0, 250.0)
    act(made._add, "line")
    assert "was not made here" in said(studio)
    assert file.read_text().endswith("# mine\n")
    file.write_text("truearm: truearm-path/1\n")
    studio.window.refresh()
    assert "units" in made._said.content
    typed(studio, made._file, "../path.yaml")
    assert "no place in the project" in said(studio)


def test_sections_are_undone_and_done_again(studio: Studio, page: JogPage) -> None:
    window, made, file = studio.window, page.path, studio.window.project.folder / "path.yaml"
    window.edit(seed=7)
    go(page, *_START)
    act(made._add, "start")
    texts: list[str | None] = [None]
    for place in ((350.0, 100.0, 250.0), (400.0, 150.0, 250.0)):
        go(page, *place)
        act(made._add, "line")
        texts.append(file.read_text())
    typed(studio, made._speed, 400.0)
    texts.append(file.read_text())
    act(made._do, "remove last")
    assert "(400, 150, 250)" not in made._said.content
    for text in texts[::-1]:
        window._undo_edit()
        assert (file.read_text() if file.exists() else None) == text
        assert ("(400, 150, 250)" in made._said.content) == (text in texts[2:])
        assert made._speed.value == (400.0 if text == texts[3] else 200.0)
    assert "path" not in page.scene._parts or not page.scene._parts["path"]
    assert "from (350, 0, 250)" in made._said.content
    assert window.project.settings.seed == 7
    for text in texts[1:]:
        window._redo_edit()
        assert file.read_text() == text
    for _ in texts[1:]:
        window._undo_edit()
    go(page, 340.0, 50.0, 270.0)
    act(made._add, "line")
    assert "(350, 100, 250)" not in file.read_text()  # what is undone comes not back with what is added
    assert window.project.changes() == ()


def test_the_orientation_of_a_path_that_has_begun_is_changed_or_that_is_refused(studio: Studio, page: JogPage) -> None:
    """The list shows what the file says, whatever was chosen."""
    made, file = page.path, studio.window.project.folder / "path.yaml"
    free, kept = made._kept.options
    go(page, *_START)
    act(made._add, "start")
    act(made._kept, kept)
    go(page, 350.0, 100.0, 250.0)
    act(made._add, "line")
    assert "axis: [0.0, 0.0, -1.0]" in file.read_text()
    with_axis = file.read_text()
    act(made._kept, free)
    assert "orientation" not in file.read_text()
    page._place._impl.value, page._turns._impl.value = (350.0, 50.0, 250.0), (90.0, 0.0, 0.0)
    act(page._go)
    act(made._kept, kept)
    assert file.read_text() == with_axis
    studio.window._undo_edit()
    assert made._kept.value == free
    typed(studio, made._file, "other.yaml")
    typed(studio, made._file, "path.yaml")
    act(made._kept, kept)
    assert "where z pointed at the start of this path is not known any more" in below(studio.window, made._kept)
    assert made._kept.value == free
    assert "orientation" not in file.read_text()


def test_another_file_begins_another_path(studio: Studio, page: JogPage) -> None:
    made, folder = page.path, studio.window.project.folder
    go(page, *_START)
    act(made._add, "start")
    go(page, 350.0, 100.0, 250.0)
    act(made._add, "line")
    typed(studio, made._file, "other.yaml")
    assert "No path yet" in made._said.content
    act(made._add, "line")
    assert "the path has no start yet" in said(studio)
    act(made._add, "start")
    go(page, *_START)
    act(made._add, "line")
    assert "start: [350.0, 100.0, 250.0]" in (folder / "other.yaml").read_text()
    assert "start: [350.0, 0.0, 250.0]" in (folder / "path.yaml").read_text()


def test_a_path_file_is_the_same_after_reading_it() -> None:
    path = new_path(_START, 200.0, frame="world", target="a b", axis=(0.0, 0.0, -1.0))
    with pytest.raises(InputError):
        path_text(path)
    path = with_section(path, "circle", [(1.0, 2.0, 3.0), (4.0, 5.0, -0.0)])
    path = with_section(path, "hermite", [(0.0, 0.0, 1.0)])
    path = with_section(path, "hermite", [(0.0, 0.0, 2.0)])
    assert entries_of(path_text(path)) == path
    assert in_words(path)[1:] == ["circle through (1, 2, 3), (4, 5, 0)", "curve through (0, 0, 1), (0, 0, 2)"]
    counts = []
    for _ in range(3):
        left = without_last(path)
        assert left is not None
        path = left
        counts.append(len(path["sections"]))
    assert counts == [2, 1, 0]
    line = with_section(new_path(_START, 1.0, frame="base", target=None, axis=None), "line", [(1.0, 1.0, 1.0)])
    assert entries_of(path_text(line) + "# x") is None
    assert without_last({**line, "sections": []}) is None
