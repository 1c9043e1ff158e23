"""The page Jog in a browser: a number typed moves the arm, and it is drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tests.studio.conftest import Serving
from truearm.studio.pages.jog import JogPage


def test_a_joint_is_jogged_by_a_number_and_the_picture_changes(serving: Serving, chromium: Any, tmp_path: Path) -> None:
    studio = serving()
    page = next(page for page in studio.window.pages if isinstance(page, JogPage))
    shown = chromium.new_page(viewport={"width": 1000, "height": 560})
    errors: list[str] = []
    shown.on("pageerror", lambda error: errors.append(str(error)))
    shown.goto(f"http://127.0.0.1:{studio.access.port}/")
    shown.get_by_role("tab", name="Jog").click()
    shown.get_by_text("No real robot is connected").wait_for()
    number = shown.get_by_label("axis_2 [deg]").last
    before = shown.screenshot(path=tmp_path / "before.png")
    number.fill("45")
    number.press("Enter")
    shown.get_by_text("Smallest singular value").wait_for()
    for _ in range(100):
        shown.wait_for_timeout(50)
        if page.jogging is not None and page.jogging.joints[1] > 0.78:
            break
    assert page.jogging is not None
    assert np.rad2deg(page.jogging.joints[1]) == 45.0
    assert shown.screenshot(path=tmp_path / "after.png") != before
    assert errors == []
    shown.close()
