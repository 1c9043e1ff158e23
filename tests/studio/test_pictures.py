"""Pictures of the window: nothing of one is left in the next."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import pytest
from tests.studio.conftest import Serving
from tests.studio.talking import eventually
from viser._messages import GuiPlotlyMessage

from truearm.calibration.calibrating import FitStep
from truearm.studio.fit_course import fit_course
from truearm.studio.pictures import Picture, report_figures
from truearm.studio.window import Window

Figure = dict[str, Any]
#: Errors of 60 configurations, each larger than the one before [mm].
_ERRORS = [0.004 * (k + 1) for k in range(60)]


def _residuals(errors: list[float]) -> Figure:
    points = {"type": "scatter", "mode": "markers", "name": "held out", "x": list(range(len(errors))), "y": errors}
    return {"data": [points], "layout": {"showlegend": True, "yaxis": {"rangemode": "tozero"}}}


def _shares() -> Figure:
    """Three bars, the first one on top, as the report draws what limits the accuracy."""
    bars = {"type": "bar", "orientation": "h", "name": "shares", "y": [0, 1, 2], "x": [0.1, 0.9, 0.2]}
    return {"data": [bars], "layout": {"showlegend": True, "yaxis": {"range": [2.5, -0.5]}}}


class _OnePicture:
    """A page with something above its picture and something below."""

    title: ClassVar[str] = "One picture"

    def __init__(self, window: Window) -> None:
        window.gui.add_html("<p>above</p>")
        self.picture = Picture(window, "Picture")
        window.gui.add_html("<p>below</p>")

    def refresh(self) -> None:
        pass


@pytest.fixture
def picture(serving: Serving) -> Picture:
    (page,) = serving(pages=(_OnePicture,)).window.pages
    assert isinstance(page, _OnePicture)
    return page.picture


class _Seen:
    """What somebody sees of the picture, and does with it."""

    def __init__(self, picture: Picture, browser: Any) -> None:
        self.picture = picture
        self.faults: list[str] = []
        self.page = browser.new_page(viewport={"width": 1366, "height": 900})
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("console", lambda said: self.faults.append(said.text) if said.type == "error" else None)
        self.page.goto(f"http://127.0.0.1:{picture._window.server.get_port()}/")
        self.page.get_by_text("below").wait_for()

    def show(self, drawn: Figure, of: object = None) -> list[tuple[float, float]]:
        """Show a picture; return where its points are, of the width and of the height from below, 0 to 1."""
        self.picture.show(drawn, of)
        assert eventually(lambda: self.page.evaluate(_PLOTS) == [[len(curve["x"]) for curve in drawn["data"]]])
        self.page.evaluate(_AT_REST)
        return self.points()

    def points(self) -> list[tuple[float, float]]:
        return [(round(x, 4), round(y, 4)) for x, y in self.page.evaluate(_POINTS)]

    def zoom_in(self) -> None:
        """Drag a rectangle in the middle."""
        box = self.page.locator(".nsewdrag").bounding_box()
        self.page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 0.4 * box["height"])
        self.page.mouse.down()
        self.page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 0.6 * box["height"], steps=5)
        self.page.mouse.up()
        self.page.evaluate(_AT_REST)


@pytest.fixture
def seen(picture: Picture, blind: Any) -> Iterator[_Seen]:
    seen = _Seen(picture, blind)
    yield seen
    seen.page.close()


#: How many points each curve of each plot has.
_PLOTS = """() => [...document.querySelectorAll(".js-plotly-plot")].map((plot) => plot._fullData.map(
  (curve) => curve.x.length))"""
_AT_REST = """() => new Promise((done) => {
  let before = "", still = 0;
  const look = () => {
    const now = JSON.stringify([...document.querySelectorAll(".js-plotly-plot *")].map(
      (one) => one.getBoundingClientRect()));
    still = now === before ? still + 1 : 0;
    before = now;
    still > 6 ? done() : setTimeout(look, 40);
  };
  look();
})"""
_POINTS = """() => {
  const frame = document.querySelector(".nsewdrag").getBoundingClientRect();
  return [...document.querySelectorAll(".point")].map((point) => point.getBoundingClientRect()).map((at) => [
    (at.left + at.width / 2 - frame.left) / frame.width, (frame.bottom - at.top - at.height / 2) / frame.height]);
}"""


def _are_the_errors(points: list[tuple[float, float]]) -> bool:
    """Whether all 60 points stand within the axes, in a line that rises from the zero of the errors."""
    within = len(points) == 60 and all(0.0 < x < 1.0 and 0.0 < y < 1.0 for x, y in points)
    high = max((y for _, y in points), default=0.0)
    return within and all(abs(y / high - (k + 1) / 60) < 0.005 for k, (_, y) in enumerate(points))


def test_the_first_picture_shows_all_its_points(seen: _Seen) -> None:
    assert _are_the_errors(seen.show(_residuals(_ERRORS)))
    assert seen.page.evaluate(_PLACES) == ["above", "picture", "below"]


def test_a_picture_has_nothing_of_the_one_before(seen: _Seen) -> None:
    alone = seen.show(_residuals(_ERRORS))
    seen.show(_shares())
    assert seen.show(_residuals(_ERRORS)) == alone  # before: upside down, 5 of 60 points within the axes

    seen.zoom_in()
    assert seen.points() != alone
    seen.page.locator('.modebar-btn[data-title="Pan"]').click()
    seen.show(_shares())
    seen.page.locator(".legendtoggle").click()  # a moment later it is hidden: a second click would mean another thing
    seen.page.wait_for_function("document.querySelectorAll('.point').length === 0")
    assert seen.show(_residuals(_ERRORS)) == alone
    assert seen.page.evaluate("document.querySelector('.js-plotly-plot')._fullLayout.dragmode") == "zoom"
    assert seen.page.evaluate(_PLACES) == ["above", "picture", "below"]


#: What stands from above to below.
_PLACES = """() => [...document.querySelectorAll("p, .js-plotly-plot")]
  .filter((one) => ["above", "below"].includes(one.innerText) || one.tagName === "DIV")
  .sort((a, b) => a.getBoundingClientRect().top - b.getBoundingClientRect().top)
  .map((one) => one.tagName === "DIV" ? "picture" : one.innerText)"""


def test_a_run_that_goes_on_keeps_what_is_zoomed_and_the_next_one_does_not(seen: _Seen) -> None:
    run = object()
    seen.show(_residuals(_ERRORS[:50]), run)
    seen.zoom_in()
    zoomed = seen.points()
    assert max(x for x, _ in zoomed) > 1.0
    assert seen.show(_residuals(_ERRORS), run)[:50] == zoomed
    assert _are_the_errors(seen.show(_residuals(_ERRORS), object()))


def test_a_picture_is_a_new_element_unless_the_same_run_goes_on(picture: Picture) -> None:
    def element() -> str:
        """The one plot that a window is told of which comes now."""
        sent = picture._window.server._websock_server._broadcast_buffer.message_from_id.values()
        (plot,) = [one for one in sent if isinstance(one, GuiPlotlyMessage)]
        return plot.uuid

    run = object()
    picture.show(_residuals(_ERRORS[:50]), run)
    first = element()
    picture.show(_residuals(_ERRORS), run)
    assert element() == first
    more = _residuals(_ERRORS)
    picture.show({**more, "data": [*more["data"], {**more["data"][0], "name": "set aside"}]}, run)
    assert (second := element()) != first, "a curve may have come before others that the user has hidden"
    picture.show(_residuals(_ERRORS))
    assert (third := element()) != second
    picture.show(_residuals(_ERRORS))
    assert element() != third


def test_what_cannot_be_drawn_leaves_the_page_as_it_is(seen: _Seen) -> None:
    nothing: Figure = {"data": [], "layout": {}}
    unknown = {**_residuals([math.nan, math.inf, 0.1]), "layout": {"yaxis": {"type": "log", "range": [math.nan, 1.0]}}}
    alone = seen.show(_residuals(_ERRORS))
    assert seen.show(nothing) == []
    assert len(seen.show(unknown)) == 1
    seen.show(fit_course([FitStep.of(1, math.inf, math.nan, "training")]))
    assert seen.show(_residuals(_ERRORS)) == alone
    assert seen.faults == []


def test_the_course_of_a_fit_is_drawn_where_a_step_has_no_finite_cost() -> None:
    steps = [FitStep.of(1, math.inf, math.nan, "training"), FitStep.of(2, 100.0, 1e-3, "training")]
    drawn = fit_course(steps)["layout"]
    assert drawn["yaxis2"]["range"] == fit_course(steps[1:])["layout"]["yaxis2"]["range"]
    low, high = drawn["yaxis2"]["range"]
    assert low < 2.0 < high  # the logarithm of the cost


@pytest.mark.parametrize(
    "damaged",
    [5, {}, {"data": 3, "layout": {}}, {"data": [], "layout": []}, {"data": [], "layout": {"xaxis": 5}}],
)
def test_of_a_damaged_report_those_pictures_are_shown_that_are_some(tmp_path: Path, damaged: Any) -> None:
    report, whole = tmp_path / "report.html", _residuals(_ERRORS)
    figures = json.dumps({"damaged": damaged, "residuals": whole})
    report.write_text(f'<script type="application/json" id="figures">{figures}</script>')
    assert report_figures(report) == {"residuals": whole}
