from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

viser = pytest.importorskip("viser", reason="the extra studio is not installed")

from truearm.studio.serving import Studio, serve  # noqa: E402

Serving = Callable[..., Studio]


@pytest.fixture
def serving(tmp_path: Path) -> Iterator[Serving]:
    """Serve projects, each on a free port, until the test ends: ``serving(token="...")``."""
    served: list[Studio] = []

    def start(folder: Path = tmp_path / "project", **how: Any) -> Studio:
        studio = serve(folder, **{"port": 0, **how})
        served.append(studio)
        return studio

    yield start
    for studio in served:
        studio.stop()


@pytest.fixture(scope="session")
def launch() -> Iterator[Callable[..., Any]]:
    """Start Chromium without a screen, with options; without one the tests in it are skipped, and say so."""
    place = os.environ.get("CHROME") or next(
        (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None
    )
    if place is None:
        pytest.skip("no Chromium on PATH, and none named in CHROME: the studio was not tried in a browser")
    playwright = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    with playwright.sync_playwright() as driver:
        yield lambda *words: driver.chromium.launch(executable_path=place, args=["--no-sandbox", *words])


@pytest.fixture(scope="session")
def chromium(launch: Callable[..., Any]) -> Iterator[Any]:
    """A browser whose WebGL is SwiftShader's."""
    browser = launch("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def blind(launch: Callable[..., Any]) -> Iterator[Any]:
    """A browser in which WebGL is switched off: it shows everything but the scene, and quickly."""
    browser = launch("--disable-gpu", "--disable-webgl", "--disable-webgl2", "--disable-3d-apis")
    yield browser
    browser.close()
