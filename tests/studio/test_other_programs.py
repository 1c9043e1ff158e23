"""What other programs change is told until the pages show it."""

from __future__ import annotations

import pytest
from tests.studio.conftest import Serving
from tests.studio.pressing import act, notices

from truearm.engine.base.errors import InputError
from truearm.studio.pages.cell import CellPage
from truearm.studio.project import PROJECT_FILE
from truearm.studio.serving import Studio


def warning(studio: Studio) -> str:
    """Return what is told above the pages, once the folder has been looked at."""
    others = studio.window._others
    others.look()
    return str(others._said.content) if others._said.visible else ""


def test_it_is_told_above_the_pages_until_they_show_it_and_among_the_notices_then(serving: Serving) -> None:
    studio = serving()
    folder = studio.window.project.folder
    (folder / "new.csv").write_text("x")
    assert "new.csv (new). Press reload" in warning(studio)
    cell = next(page for page in studio.window.pages if isinstance(page, CellPage))
    act(cell._robot, "kr5")  # every page is shown anew
    assert "new.csv" in cell._files.content
    assert warning(studio) == ""
    assert "new.csv (new). The pages show them as they are now." in notices(studio.window)
    file = folder / PROJECT_FILE
    file.write_text(file.read_text() + "# mine\n")
    studio.window.refresh()
    assert f"{PROJECT_FILE} (changed). Press reload" in warning(studio)  # its settings are still the old ones
    studio.window._reload()
    assert warning(studio) == ""


def test_a_page_that_cannot_be_shown_leaves_the_warning(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> None:
    studio = serving()
    (studio.window.project.folder / "a.csv").write_text("1")

    def refused() -> None:
        raise InputError("nothing of the kind")

    monkeypatch.setattr(studio.window.pages[0], "refresh", refused)
    studio.window.refresh()
    assert "nothing of the kind" in notices(studio.window)
    assert "a.csv (new). Press reload" in warning(studio)
    monkeypatch.undo()
    studio.window.refresh()
    assert warning(studio) == ""


def test_what_is_changed_once_more_while_pages_are_shown_stays_told(serving: Serving) -> None:
    studio = serving()
    file = studio.window.project.folder / "a.csv"
    file.write_text("1")
    before = studio.window.project.changes()
    file.write_text("12")
    studio.window._others.shown(before)
    assert "a.csv (changed). Press reload" in warning(studio)


def test_what_a_long_action_writes_is_not_told_meanwhile(serving: Serving) -> None:
    studio = serving()
    studio.window._work = object()  # type: ignore[assignment]
    (studio.window.project.folder / "a.csv").write_text("1")
    studio.window.refresh()
    assert "files-changed" not in notices(studio.window)
    studio.window._work = None
    assert "a.csv (new)" in warning(studio)
