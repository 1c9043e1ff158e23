"""What a user gives an element holds, whatever the window does at the same time."""

from __future__ import annotations

import threading
import time

import pytest
from tests.studio.conftest import Serving
from tests.studio.pressing import act
from tests.studio.talking import eventually

from truearm.studio.pages.calibrate import CalibratePage


@pytest.mark.parametrize(("name", "given"), [("_loss", "huber"), ("_seed", "7")])
def test_what_is_chosen_while_the_pages_are_shown_anew_is_not_set_back(
    serving: Serving, monkeypatch: pytest.MonkeyPatch, name: str, given: str
) -> None:
    monkeypatch.setattr("truearm.studio.typing_at_rest._REST", 0.01)
    studio = serving()
    page = next(one for one in studio.window.pages if isinstance(one, CalibratePage))
    field, before = getattr(page, name), getattr(page, name).value
    user = threading.Thread(target=act, args=(field, given))
    with studio.window.lock:  # as at the end of a long action
        user.start()
        assert eventually(lambda: field.value == given)
        time.sleep(0.05)  # until it waits for the lock
        page.refresh()
        assert field.value == before
    user.join()
    assert eventually(lambda: str(getattr(studio.window.project.settings, name[1:])) == given)
    assert field.value == given


def test_what_is_typed_is_what_a_window_has_sent_also_where_the_page_is_shown_anew_before_it_is_read(
    serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between the message and its callback the field was set back, and what was typed was lost."""
    monkeypatch.setattr("truearm.studio.typing_at_rest._REST", 0.01)
    studio = serving()
    window = studio.window
    page = next(one for one in window.pages if isinstance(one, CalibratePage))
    for field, given in ((page._loss, "huber"), (page._seed, "7")):
        assert window.gate.fits(field._impl.uuid, given)  # as the gate asks before the message goes on
        page.refresh()
        act(field)
    assert eventually(lambda: (window.project.settings.loss, window.project.settings.seed) == ("huber", 7))
