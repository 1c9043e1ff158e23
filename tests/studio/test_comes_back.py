"""The page of a studio that was away says so, and comes back with it."""

from __future__ import annotations

from typing import Any

from tests.studio.conftest import Serving
from tests.studio.talking import eventually, get


def test_a_page_comes_back_after_the_studio_was_away(serving: Serving, blind: Any) -> None:
    """Longer than a few seconds away, and Chromium delayed what viser's page gave up after one."""
    studio = serving()
    page = blind.new_page()
    page.goto(studio.access.entrance)
    page.get_by_role("tab", name="Cell").wait_for()
    studio.stop()
    page.locator("#no-answer").wait_for()
    assert "does not answer" in page.locator("#no-answer").inner_text()
    page.wait_for_timeout(12_000)
    again = serving(studio.window.project.folder, port=studio.access.port)
    assert eventually(lambda: again.window.gate.has_worker)
    page.locator("#no-answer").wait_for(state="detached")
    page.get_by_role("tab", name="Cell").wait_for()
    page.close()


def test_whether_it_is_there_is_told_to_its_own_page_alone(serving: Serving) -> None:
    studio = serving()
    assert get(studio, "/alive")[::2] == (200, b"yes\n")
    assert get(studio, "/alive", Host="evil.example")[0] == 403
