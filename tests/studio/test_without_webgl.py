"""A browser that cannot draw: it says so, and everything but the scene works."""

from __future__ import annotations

from typing import Any

from tests.studio.conftest import Serving
from tests.studio.talking import eventually, get


def test_without_webgl_it_says_so_and_pages_tables_and_edits_work(serving: Serving, blind: Any) -> None:
    studio = serving()
    page = blind.new_page(viewport={"width": 1366, "height": 768})
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
    page.goto(studio.access.entrance)
    page.get_by_role("tab", name="Cell").wait_for()
    assert page.title() == "truearm studio"
    assert page.locator("#without-webgl").inner_text() == (
        "This browser has no WebGL: the scene stays empty. Pages, tables and jobs work all the same."
    )
    page.get_by_text("What is known of the robot").click()
    page.get_by_text("ABB IRB 120").first.wait_for()
    assert eventually(lambda: studio.window.gate.has_worker)
    page.get_by_role("button", name="light / dark").click()
    assert eventually(lambda: studio.window.project.settings.dark)
    page.get_by_role("tab", name="Jog", exact=True).click()
    page.get_by_text("No real robot is connected to this window, and none moves.").wait_for()
    assert faults == []


def test_the_script_for_it_comes_before_everything_else_packed_or_not(serving: Serving) -> None:
    import gzip

    studio = serving()
    _, headers, plain = get(studio)
    assert plain.index(b"without-webgl") < plain.index(b"<title>truearm studio</title>") < 20_000
    assert int(headers["Content-Length"]) == len(plain)
    _, headers, packed = get(studio, Accept_Encoding="gzip")
    assert headers["Content-Encoding"] == "gzip"
    assert int(headers["Content-Length"]) == len(packed)
    assert gzip.decompress(packed) == plain
