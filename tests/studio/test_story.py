"""The whole work by clicking, in a browser: from an empty folder to a calibrated robot and a corrected program.

The browser draws the scene by SwiftShader, that is with the processor; what a browser without WebGL shows is tested by
itself.
"""

from __future__ import annotations

import json
import re
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from tests.commanding import Truearm
from tests.commanding import truearm as truearm

from truearm.studio.pages.jog import JogPage
from truearm.studio.project import PROJECT_FILE
from truearm.studio.serving import Studio, serve

#: Sizes at which pages are pictured.
_SIZES = ((1366, 768), (1920, 1080))
#: How far from the right edge the pages begin.
_PANEL = "window.innerWidth - document.querySelector('[role=tab]').getBoundingClientRect().left"


class Person:
    """Looks at a page and clicks on it."""

    def __init__(self, page: Any, studio: Studio, pictures: Path) -> None:
        self.page, self.studio, self.pictures = page, studio, pictures
        self.faults: list[str] = []
        page.on("pageerror", lambda error: self.faults.append(str(error)))
        page.on("console", lambda said: self.faults.append(said.text) if said.type == "error" else None)
        page.on("request", lambda asked: self._asked(asked.url))
        page.set_default_timeout(90_000)
        page.goto(studio.access.entrance)
        page.get_by_role("tab", name="Cell").wait_for()
        page.wait_for_timeout(1000)
        self.panel = page.evaluate(_PANEL)

    def _asked(self, url: str) -> None:
        if not url.startswith((self.studio.access.address, "data:", "blob:")):
            self.faults.append(f"asked for {url}")

    def turn_to(self, name: str) -> None:
        self.page.get_by_role("tab", name=name, exact=True).click()

    def press(self, name: str) -> None:
        self.page.get_by_role("button", name=name, exact=True).click()

    def write(self, label: str, text: str) -> None:
        """Type into the field behind a label; what is typed is taken a little later."""
        self.field(label).fill(text)

    def choose(self, label: str, option: str) -> None:
        """Choose from the list behind a label."""
        self.field(label).click()
        self.page.get_by_role("option", name=option, exact=True).click()

    def field(self, label: str) -> Any:
        places = self.page.locator(f"xpath=//label[normalize-space(.)='{label}']").locator("visible=true")
        return places.first.locator("xpath=following::input[not(@type='hidden')][1]")

    def wait_for(self, text: str | re.Pattern[str]) -> None:
        self.page.get_by_text(text).first.wait_for()

    def shown(self) -> str:
        """Return all that the window shows, with single blanks."""
        return re.sub(r"\s+", " ", str(self.page.evaluate("document.body.innerText")))

    def picture(self, name: str, sizes: Sequence[tuple[int, int]] = _SIZES) -> None:
        """Keep a picture of what is shown, at some sizes; nothing stands out of the window's right edge."""
        for width, height in sizes:
            self.page.set_viewport_size({"width": width, "height": height})
            for _ in range(2):  # the panel slides into its place
                self.page.wait_for_function(f"Math.abs({_PANEL} - {self.panel}) < 2")
                self.page.wait_for_timeout(100)
            self.page.evaluate(_DRAWN)
            self.page.screenshot(path=self.pictures / f"{name}-{width}.png")
            beyond = self.page.evaluate(_BEYOND)
            assert beyond == [], f"{name} at {width}: {beyond}"
        if len(sizes) > 1:
            self.page.set_viewport_size({"width": _SIZES[0][0], "height": _SIZES[0][1]})


def eventually(true: Callable[[], bool]) -> bool:
    end = time.monotonic() + 30.0
    while not true() and time.monotonic() < end:
        time.sleep(0.05)
    return true()


#: Resolves once nothing moves any more, and it has been drawn.
_DRAWN = """() => new Promise((done) => {
  let before = "", still = 0;
  const look = () => {
    const shown = [...document.querySelectorAll("button, input, p, pre, td, svg")];
    const now = JSON.stringify(shown.map((element) => element.getBoundingClientRect()));
    still = now === before ? still + 1 : 0;
    before = now;
    still > 4 ? requestAnimationFrame(() => requestAnimationFrame(done)) : setTimeout(look, 40);
  };
  look();
})"""
#: The texts of elements that reach beyond the window, or are wider than what holds them.
_BEYOND = """() => [...document.querySelectorAll("button, input, label, p, pre, td, th")]
  .filter((e) => e.offsetParent !== null && e.getBoundingClientRect().width > 0)
  .filter((e) => e.getBoundingClientRect().right > innerWidth + 1 || e.scrollWidth > e.clientWidth + 2
    && ["P", "PRE", "TD", "TH"].includes(e.tagName))
  .map((e) => e.tagName + " " + e.innerText.slice(0, 60))"""


@pytest.fixture(scope="module")
def turned_away() -> list[str]:
    """What of a window's requests and messages was refused."""
    return []


@pytest.fixture(scope="module")
def demonstration(tmp_path_factory: pytest.TempPathFactory, turned_away: list[str]) -> Iterator[Studio]:
    """The studio of an empty folder that it fills itself."""
    folder = tmp_path_factory.mktemp("studio") / "project"
    studio = serve(folder, port=0, demo=True, say=turned_away.append)
    yield studio
    studio.stop()


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the test run in which the pictures stay."""
    return tmp_path_factory.mktemp("pictures")


@pytest.fixture(scope="module")
def person(demonstration: Studio, chromium: Any, pictures: Path) -> Iterator[Person]:
    """Who sits before it."""
    context = chromium.new_context(viewport={"width": 1366, "height": 768}, accept_downloads=True)
    yield Person(context.new_page(), demonstration, pictures)
    context.close()


def test_from_an_empty_folder_to_a_corrected_program_by_clicking(
    person: Person,
    turned_away: list[str],
    truearm: Truearm,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    """One test, because each part goes on with what the one before left."""
    the_whole_work(person, truearm, monkeypatch, tmp_path)
    a_plan_is_measured_and_checked(person, truearm, tmp_path)
    every_page_is_pictured_in_the_dark(person)
    refusals_stand_where_one_acts_and_edits_are_undone(person)
    what_another_program_changes_is_told_and_taken_on_request(person)
    a_calibration_is_cancelled_and_leaves_the_old_result(person)
    reopened_it_shows_what_it_showed(person, tmp_path)
    assert turned_away == []


def the_whole_work(person: Person, truearm: Truearm, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = person.studio.window.project.folder
    person.picture("cell")
    assert "measurements.csv" in person.shown()

    person.turn_to("Check")
    person.press("Check the measurements")
    person.wait_for("Check: done")
    monkeypatch.chdir(folder)
    for line in truearm("check", "irb120", "measurements.csv").out.replace("--model ", "model=").splitlines():
        assert " ".join(line.split()) in person.shown()
    person.picture("check")

    person.turn_to("Calibrate")
    person.press("Calibrate")
    person.page.get_by_role("button", name="Cancel").wait_for()
    words = ["calibrate", "irb120", "measurements.csv", "--payload", "2.7kg,50mm,25mm,100mm"]
    printed = truearm(*words, "--out", tmp_path / "by-command").out  # at the same time
    person.wait_for("Written to result: ")
    said = person.shown()
    person.picture("calibrate")
    for line in printed.splitlines()[:-1]:
        figures = re.findall(r"\d+\.\d+ ?(?:mm|deg|%)?", line)
        assert all(figure in said for figure in figures), line
    for name in ("calibrated.yaml", "result.json", "report.html", "calibrated.urdf"):
        assert (folder / "result" / name).read_bytes() == (tmp_path / "by-command" / name).read_bytes(), name

    person.turn_to("Proof")
    person.page.locator(".js-plotly-plot").locator("visible=true").first.wait_for()
    result = json.loads((folder / "result" / "result.json").read_text())
    said = person.shown()
    for part in ("nominal", "validation", "train"):
        assert " ".join(f"{result[part]['position_mm'][k]:.3f}" for k in ("mean", "rms", "p95", "max")) in said
    assert all(f"({one['code']})" in said for one in result["warnings"])
    buttons = person.page.locator(".modebar-btn").evaluate_all("all => all.map((one) => one.dataset.title)")
    assert "Zoom" in buttons
    assert not any("Share" in button for button in buttons)
    person.picture("proof")
    with person.page.expect_download() as came:
        person.press("report.html")
    assert Path(came.value.path()).read_bytes() == (folder / "result" / "report.html").read_bytes()

    person.press("Draw the errors")
    person.wait_for("Draw the errors: done")

    person.turn_to("Jog")
    person.wait_for("No real robot is connected to this window, and none moves.")
    number = person.page.locator('xpath=//label[contains(., "axis_2")]/following::input[@type="text"][1]')
    number.fill("40")
    number.press("Enter")
    jog = next(page for page in person.studio.window.pages if isinstance(page, JogPage))
    assert eventually(lambda: jog.jogging is not None and jog.jogging.joints[1] > 0.69)
    assert jog.jogging is not None
    assert jog.jogging.numbers[1] == 40.0
    assert jog.scene.ghost is not None
    person.press("record")
    person.wait_for("Recorded: P1")
    assert (folder / "recorded-irb120.csv").read_text().splitlines()[1].startswith("P1,0.0,40.0,")
    person.picture("jog")

    person.turn_to("Plan")
    person.write("Poses", "20")
    person.write("Candidates", "60")
    person.press("Plan")
    person.wait_for("Written: plan.csv, plan.html")
    person.picture("plan")

    person.turn_to("Programs")
    person.press("Correct the program")
    person.wait_for("Written to result/corrected: ")
    person.wait_for("Where the calibrated robot goes with the original and with the corrected program: ")
    person.picture("programs")
    assert (folder / "result/corrected/plate.mod").read_bytes() == (folder / "corrected/plate.mod").read_bytes()

    person.turn_to("Performance")
    person.press("Evaluate the tests")
    person.wait_for("no plan is chosen")
    person.picture("performance", _SIZES)


def a_plan_is_measured_and_checked(person: Person, truearm: Truearm, tmp_path: Path) -> None:
    """Stopped on the way, gone on, handed over as the project's measurements, which an undo takes back."""
    project = person.studio.window.project
    person.turn_to("Measure")
    person.choose("Plan", "plan.csv")
    person.choose("Device", "measurement-arm")
    person.field("Readings a second").fill("2")
    person.press("Start")
    person.wait_for(re.compile(r"[1-9]\d* of 2\d steps done"))
    person.press("stop")
    person.wait_for("Start goes on where it stood")
    assert project.settings.data == "measurements.csv"
    person.field("Readings a second").fill("50")
    person.press("Start")
    person.wait_for("Measured: the page Check tells whether the measurements can be believed.")
    person.picture("measure")
    person.press("Finish")
    person.page.get_by_role("button", name="Start", exact=True).wait_for()
    words = ["measure", "plan.csv", "irb120", "--device", "measurement-arm", "--payload", "2.7kg,50mm,25mm,100mm"]
    assert truearm(*words, "--out", tmp_path / "measured").code == 0
    measured = (project.folder / "measured" / "measurements.csv").read_bytes()
    assert measured == (tmp_path / "measured" / "measurements.csv").read_bytes()

    person.turn_to("Check")
    person.press("Check the measurements")
    person.wait_for("measured/measurements.csv: 20 configurations")
    person.press("undo")
    assert eventually(lambda: project.settings.data == "measurements.csv")


def every_page_is_pictured_in_the_dark(person: Person) -> None:
    person.press("light / dark")
    for page in person.studio.window.pages:
        person.turn_to(page.title)
        person.picture(f"{page.title.lower()}-dark")
    person.press("light / dark")
    assert person.faults == []


def refusals_stand_where_one_acts_and_edits_are_undone(person: Person) -> None:
    project = person.studio.window.project
    person.turn_to("Calibrate")
    person.write("Seed", "x")
    person.wait_for("seed: a whole number belongs here; got 'x'.")
    stands_below_the_field_within_the_panel(person, "Seed")
    person.picture("calibrate-refused")
    assert project.settings.seed == 0
    person.write("Seed", "7")
    assert eventually(lambda: project.settings.seed == 7)
    person.page.locator("p[role=alert]").wait_for(state="detached")
    person.press("undo")
    assert eventually(lambda: project.settings.seed == 0)
    person.page.keyboard.press("Control+Shift+Z")
    assert eventually(lambda: project.settings.seed == 7)
    person.press("undo")
    assert eventually(lambda: project.settings.seed == 0)


def stands_below_the_field_within_the_panel(person: Person, label: str) -> None:
    """The refusal begins where the field ends, and is as wide as the page at most."""
    refusal, panel = person.page.locator("p[role=alert]"), person.page.get_by_role("tab", name="Cell", exact=True)
    field = person.page.locator(f"xpath=//*[normalize-space(text())='{label}']").locator("visible=true").first
    refused, named, left = refusal.bounding_box(), field.bounding_box(), panel.bounding_box()["x"]
    assert 0.0 < refused["y"] - named["y"] < 60.0, (refused, named)
    assert left - 20.0 < refused["x"], (refused, left)
    assert refused["x"] + refused["width"] <= _SIZES[0][0], refused


def what_another_program_changes_is_told_and_taken_on_request(person: Person) -> None:
    project = person.studio.window.project
    file = project.folder / PROJECT_FILE
    name = "<img src=x onerror=document.title='broken'>.csv"
    (project.folder / name.replace("/", "")).write_text("x")
    file.write_text(file.read_text().replace("seed: 0", "seed: 5"))
    person.wait_for("Another program has changed files")
    person.turn_to("Calibrate")
    person.write("Seed", "9")
    person.wait_for("another program has changed this file, and it is not overwritten")
    person.press("reload")
    assert eventually(lambda: project.settings.seed == 5)
    person.turn_to("Cell")
    assert "onerror=document.title" in person.shown()
    assert person.page.title() != "broken"
    (project.folder / name).unlink()


def a_calibration_is_cancelled_and_leaves_the_old_result(person: Person) -> None:
    project = person.studio.window.project
    before = (project.folder / "result" / "result.json").read_bytes()
    person.turn_to("Calibrate")
    person.press("Calibrate")
    person.press("Cancel")
    person.wait_for("Calibrate was cancelled; nothing was written.")
    assert (project.folder / "result" / "result.json").read_bytes() == before
    assert not person.studio.window.busy


def reopened_it_shows_what_it_showed(person: Person, tmp_path: Path) -> None:
    folder = shutil.copytree(person.studio.window.project.folder, tmp_path / "copy")
    again = serve(folder, port=0)
    try:
        assert again.window.project.settings == person.studio.window.project.settings
        proof, other = (
            next(page for page in studio.window.pages if page.title == "Proof") for studio in (again, person.studio)
        )
        assert "before (60)" in proof._table.content  # type: ignore[attr-defined]
        assert proof._table.content == other._table.content  # type: ignore[attr-defined]
        assert proof._notices.content == other._notices.content  # type: ignore[attr-defined]
        assert proof._now.content == other._now.content  # type: ignore[attr-defined]
        one = Person(person.page.context.new_page(), again, tmp_path)
        one.turn_to("Proof")
        one.wait_for("after, held out (60)")
        assert one.faults == []
        one.page.close()
    finally:
        again.stop()
