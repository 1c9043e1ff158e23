"""Refusals stand below what somebody acted on, and go away when something else is done."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

import pytest
from tests.studio.conftest import Serving
from tests.studio.pressing import act, below, notices
from tests.studio.talking import element, eventually, window, working
from tests.studio.test_uploads import upload
from tests.studio.typing_in import typed

from truearm.engine.base.errors import InputError
from truearm.studio.pages.calibrate import CalibratePage
from truearm.studio.pages.cell import CellPage
from truearm.studio.pages.check import CheckPage
from truearm.studio.pages.jog import JogPage
from truearm.studio.serving import Studio

Kind = TypeVar("Kind")


@pytest.fixture
def studio(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> Studio:
    monkeypatch.setattr("truearm.studio.typing_at_rest._REST", 0.01)  # nobody types here
    return serving()


@pytest.fixture
def over_the_window(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What comes up over the window."""
    said: list[str] = []
    monkeypatch.setattr(studio.window._windows, "notify", said.append)
    return said


def page(studio: Studio, kind: type[Kind]) -> Kind:
    return next(one for one in studio.window.pages if isinstance(one, kind))


def refused_later(progress: Callable[[str], None]) -> None:
    time.sleep(0.3)
    raise InputError("it cannot be done", came="this")


def test_a_refusal_stands_below_the_button_until_something_else_is_done(
    studio: Studio, over_the_window: list[str]
) -> None:
    check, cell = page(studio, CheckPage), page(studio, CellPage)
    act(check._run)
    assert "no measurements are chosen" in below(studio.window, check._run)
    act(check._run)
    assert below(studio.window, check._run).count("no measurements are chosen") == 1
    act(check._arm)  # in a folder; both stand
    assert "no reading is chosen" in below(studio.window, check._arm)
    assert below(studio.window, check._run) != ""
    assert notices(studio.window).count("Error (refused)") == 3
    act(cell._robot, "kr5")
    assert (below(studio.window, check._run), below(studio.window, check._arm)) == ("", "")
    assert over_the_window == []


def test_what_is_refused_without_an_element_comes_up_over_the_window(
    studio: Studio, over_the_window: list[str]
) -> None:
    def refuses() -> None:
        raise InputError("nothing is undone")

    act(SimpleNamespace(_impl=SimpleNamespace(update_cb=[studio.window.action(refuses)])))  # a key
    row = page(studio, JogPage)._sliders[0]
    row._impl.update_cb[:] = [studio.window.action(refuses)]
    callback = row._impl.update_cb[0]
    studio.window.edit(robot="kr5")  # its joints are drawn anew
    callback(SimpleNamespace(client=object(), target=row))
    assert over_the_window == ["nothing is undone."] * 2


def test_of_rows_that_are_gone_nothing_is_left(studio: Studio) -> None:
    boxes = page(studio, CellPage).boxes
    act(boxes._add)
    field = boxes._rows["box_1"].ranges[0]
    typed(studio, field, "1")
    assert "a range of two numbers belongs here" in below(studio.window, field)
    studio.window._undo_edit()
    assert boxes._rows == {}
    assert studio.window._refusals.standing() == []
    studio.window._redo_edit()
    assert below(studio.window, boxes._rows["box_1"].ranges[0]) == ""


def test_a_text_that_is_refused_stays_to_be_corrected_as_long_as_its_refusal_stands(studio: Studio) -> None:
    calibrate, check = page(studio, CalibratePage), page(studio, CheckPage)
    typed(studio, calibrate._seed, "x")
    typed(studio, calibrate._train, "half")
    act(check._run)
    studio.window.refresh()
    for field, text in ((calibrate._seed, "x"), (calibrate._train, "half")):
        assert field.value == text
        assert f"got &#x27;{text}&#x27;" in below(studio.window, field)
    typed(studio, calibrate._seed, "7")
    assert studio.window.project.settings.seed == 7
    assert (calibrate._seed.value, calibrate._train.value) == ("7", "")
    assert (below(studio.window, calibrate._seed), below(studio.window, calibrate._train)) == ("", "")
    typed(studio, calibrate._seed, "y")
    act(page(studio, JogPage)._ghost, False)
    assert calibrate._seed.value == "7"


def test_what_is_typed_and_not_taken_yet_is_not_written_over_by_what_was_refused(studio: Studio) -> None:
    seed = page(studio, CalibratePage)._seed
    typed(studio, seed, "x")
    with studio.window.lock:
        seed._impl.value = "12"
        studio.window._refusals.keep_typed(seed, None)
        studio.window._refusals.shown_anew()
        assert seed.value == "12"


def test_a_list_that_is_refused_shows_what_holds(studio: Studio) -> None:
    cell = page(studio, CellPage)
    (studio.window.project.folder / "arm.yaml").write_text("truearm: truearm-robot/1\n")
    studio.window.refresh()
    project = studio.window.project.folder / "truearm-studio.yaml"
    project.write_text(project.read_text() + "seed: 3\n")
    act(cell._robot, "arm.yaml")
    assert "another program has changed this file" in below(studio.window, cell._robot)
    assert cell._robot.value == "irb120"


def test_a_long_action_that_is_refused_in_the_end_says_so_below_what_began_it(
    studio: Studio, over_the_window: list[str]
) -> None:
    check, cell = page(studio, CheckPage), page(studio, CellPage)
    started = studio.window.action(lambda: studio.window.start("Check", refused_later, lambda _: None))
    started(SimpleNamespace(client=object(), target=check._run))
    act(cell._robot, "kr5")  # meanwhile
    act(page(studio, CalibratePage)._run)
    assert studio.window.wait(60.0)
    assert "it cannot be done; got &#x27;this&#x27;" in below(studio.window, check._run)
    assert "no measurements are chosen" in below(studio.window, page(studio, CalibratePage)._run)
    assert below(studio.window, cell._robot) == ""
    assert over_the_window == []


def test_a_file_that_is_refused_is_so_below_the_button_that_takes_it(studio: Studio) -> None:
    button: Any = page(studio, CellPage)._upload
    with window(studio) as line:
        working(studio, line)
        upload(line, element(studio, CellPage, button.label), "../a.csv", b"x", 1)
        assert eventually(lambda: "under this name" in below(studio.window, button))
        upload(line, element(studio, CellPage, button.label), "a.csv", b"x", 1)
        assert eventually(lambda: below(studio.window, button) == "")


def test_scripts_in_what_is_refused_stay_words(studio: Studio) -> None:
    train = page(studio, CalibratePage)._train
    typed(studio, train, "<script>alert(1)</script>")
    assert "&lt;script&gt;" in below(studio.window, train)
    assert "<script" not in below(studio.window, train)


def test_groups_of_buttons_have_their_refusals_below_them(studio: Studio, tmp_path: Path) -> None:
    jog = page(studio, JogPage)
    jog._list._impl.value = "../out.csv"
    act(jog._record, "record")
    assert "no place in the project" in below(studio.window, jog._record)
