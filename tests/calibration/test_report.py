"""The report says what the numbers are, needs nothing but itself, and trusts no name; curves and choices are drawn."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from html.parser import HTMLParser
from typing import Any, Final

import numpy as np
import pytest
from tests.expecting import known

from truearm.calibration.figures import curve_figure, curves_table, shares_figure, shares_table
from truearm.calibration.report import Report, report_html
from truearm.calibration.result import Calibration
from truearm.engine.base.errors import Notice
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.curves import FittedCurve
from truearm.engine.diagnose.expected_error import expected_error
from truearm.engine.document.drawing import DARK, deserved, logarithmic_axis, significant, student_975
from truearm.engine.document.page import json_for_script
from truearm.engine.fit.every_effect import EffectShare, Shares
from truearm.engine.fit.fit import Fit, identify, place
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.models import named_model
from truearm.engine.fit.rounds import Redundant
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, quaternion_from_rotation
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure

HOSTILE: Final = "</script><b>"
VOID: Final = {"meta", "br", "link", "img", "input", "hr"}


def true_robot(names: tuple[str, ...], poses: bool) -> Robot:
    robot = load_robot("irb120")
    truth = robot.truths["tracker-triangular"].values
    places = list(robot.tools["triangular"].targets.values())
    quaternion = (0.5, 0.5, 0.5, 0.5)
    targets = {n: Transform(p, quaternion) if poses else p for n, p in zip(names, places, strict=False)}
    base = Transform((0.4, -0.3, 0.29), (0.6, 0.0, 0.0, 0.8))
    return robot.with_values(truth).with_frames(base, targets).with_values(truth)


def readings(names: tuple[str, ...], poses: bool, noise: float) -> Dataset:
    rng = np.random.default_rng(3)
    true = true_robot(names, poses)
    twin = Twin(true)
    data = measure(twin, true.random_configurations(40, rng), noise, rng, source="some/folder/cell <7>.csv")
    if not poses:
        return data
    frames = [twin.target_frames(q) for q in data.joints]
    quaternion = np.array([quaternion_from_rotation(at[name][:3, :3]) for at in frames for name in names])
    return replace(data, quaternion=quaternion, sigma_rot=np.full(len(quaternion), 1e-4))


@cache
def calibration_of(
    names: tuple[str, ...] = ("1", "2", "3"),
    *,
    poses: bool = False,
    train: int = 28,
    model: str = "geometric",
    loss: Loss = "linear",
    redundancy: Redundant = "prior",
    noise: float = 5e-5,
    outlier: bool = False,
) -> Calibration:
    data = readings(names, poses, noise)
    order = np.random.default_rng(0).permutation(data.configurations)
    if outlier:
        reading = np.flatnonzero(data.configuration == order[4])[1]
        position = data.position.copy()
        position[reading] += [0.02, -0.01, 0.03]
        data = replace(data, position=position)
    fit_with = partial(identify, model=named_model(model), loss=loss, redundancy=redundancy)
    return calibration(load_robot("irb120"), data, order[:train], order[train:], fit_with)


def calibration(
    robot: Robot, data: Dataset, training: IntArray, held_out: IntArray, fit_with: Callable[[Robot, Dataset], Fit]
) -> Calibration:
    """Return a calibration without all that takes long and is not looked at here."""
    first = data.of_configurations(training)
    fit = fit_with(robot, first)
    judged = data.of_configurations(held_out) if len(held_out) else first
    return Calibration(
        fit=fit,
        data=data,
        training=training,
        held_out=held_out,
        nominal=errors_of(place(robot, first), judged),
        train=errors_of(fit.robot, first),
        validation=errors_of(fit.robot, judged) if len(held_out) else None,
        expected=expected_error(fit),
        warnings=(Notice("odd", "Residuals are <i>odd</i> & large."),),
        command="truearm calibrate irb120 'cell <7>.csv' --seed 0",
        history="calibrated by truearm: 28 of 40 configurations of cell <7>.csv (sha256 0123456789ab)",
    )


class Page(HTMLParser):
    """Collects what a page holds and fails where its elements do not nest."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self.words: list[str] = []
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "script":
            self.scripts.append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script":
            self.scripts[-1] += data
        elif not self.open or self.open[-1] != "style":
            self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words))

    @property
    def figures(self) -> dict[str, Any]:
        (place,) = (i for i, attrs in enumerate(a for t, a in self.elements if t == "script") if "id" in attrs)
        figures: dict[str, Any] = json.loads(self.scripts[place])
        return figures


@cache
def page(report: Calibration) -> Page:
    return Page(report_html(report))


def cells(html: str) -> list[tuple[float, str]]:
    """Return every number cell as its value and its text."""
    return [(float(v), t) for v, t in re.findall(r'<td class="n" data-value="([^"]+)">([^<]*)</td>', html)]


# -- the page ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", [{}, {"train": 40}, {"poses": True, "model": "offsets"}, {"redundancy": "drop"}])
def test_elements_nest_and_nothing_is_fetched(options: dict[str, Any]) -> None:
    shown = page(calibration_of(**options))
    for tag, attributes in shown.elements:
        assert tag not in ("link", "img", "iframe", "object", "embed")
        assert not {"src", "href", "action", "data", "srcset"} & set(attributes)
    policy = next(a["content"] for t, a in shown.elements if a.get("http-equiv") == "Content-Security-Policy")
    assert known(policy).startswith("default-src 'none'")
    assert "http" not in known(policy)
    assert sum("plotly.js v" in script for script in shown.scripts) == 1
    assert "showSendToCloud: false" in shown.scripts[-1]
    assert {a["id"] for t, a in shown.elements if t == "div" and a.get("class") == "figure"} == set(shown.figures)
    assert report_html(calibration_of(**options)) == report_html(calibration_of(**options))


def test_which_figures_there_are() -> None:
    limits = {"limits-of-accuracy", "limits-over-the-workspace", "expected-error"}
    own = {"position-histogram", "orientation-histogram", "workspace", "residuals", "correlations"}
    assert set(page(calibration_of(poses=True)).figures) == own | limits
    exact = page(calibration_of(noise=0.0, train=40)).figures
    assert sum(exact["position-histogram"]["data"][1]["y"]) == 120


def text_of(**changed: Any) -> str:
    """Return the text of a report with other parts."""
    return Page(report_html(replace(calibration_of(), **changed))).text


def test_plotly_itself_is_not_imported() -> None:
    code = "import sys, truearm.calibration.report; sys.exit('plotly.graph_objects' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_names_are_text() -> None:
    report = calibration_of(("a", HOSTILE), poses=True, model="offsets")
    html = report_html(report)
    shown = page(report)
    assert HOSTILE not in html
    assert all(tag not in ("b", "i") for tag, _ in shown.elements)
    assert f"a, {HOSTILE}" in shown.text
    assert f"target_{HOSTILE}_rx" in shown.text
    assert "Residuals are <i>odd</i> & large." in shown.text
    assert "Data: cell <7>.csv" in shown.text
    # Plotly reads tags in its texts, so they reach it as entities.
    assert {row[1] for row in shown.figures["workspace"]["data"][0]["customdata"]} == {
        "a",
        "&lt;/script&gt;&lt;b&gt;",
    }


def test_json_cannot_leave_its_script() -> None:
    text = json_for_script({"x": "</script><!--&\u2028é"})
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text) == {"x": "</script><!--&\u2028é"}
    with pytest.raises(ValueError, match="Out of range"):
        json_for_script([float("nan")])


# -- the numbers -------------------------------------------------------------------------------------------


def test_errors_are_those_of_the_statistics() -> None:
    report = calibration_of(poses=True)
    shown = cells(report_html(report))[:24]
    expected = []
    for kind in ("position", "orientation"):
        for errors in (report.nominal, known(report.validation), report.train):
            spread = getattr(errors, kind)
            expected += [spread.mean, spread.rms, spread.p95, spread.max]
    assert [value for value, _ in shown] == pytest.approx([1e3 * value for value in expected], rel=1e-12)
    for value, text in shown:
        assert float(text) == pytest.approx(value, rel=5e-3)


def test_the_first_figure_is_the_held_out_error() -> None:
    report = calibration_of()
    after = known(known(report.validation).position)
    text = page(report).text
    old, new = Report(report).position[:2]
    assert f"{old.texts[0]} → {new.texts[0]} mm" in text
    assert float(new.texts[0]) == pytest.approx(after.mean * 1e3, abs=new.deviation)
    assert "on the 12 configurations that the fit has not seen" in text
    assert f"the largest is {new.texts[3]} mm (before: {old.texts[3]} mm)" in text
    assert "the mean lies between {} and {} mm with 95 %".format(*known(new.interval)) in text
    assert "The declared noise alone makes a mean of 0.080 mm" in text
    assert "28 for training, 12 held out" in text
    assert "orientation" not in text.split("Warnings")[0]
    for words in (report.fit.status.advice, report.command, report.history, f"NumPy {np.__version__}"):
        assert words in text
    nothing = page(calibration_of(train=40)).text
    for words in (
        "Nothing was held out.",
        "Mean position error on the 40 training configurations",
        "40 for training, 0 held out",
        "Nothing was held out, so together they are what to expect",
    ):
        assert (words in nothing, words in text) == (True, False)
    assert not [words for words in ("has not seen", "Held-out", "noise alone") if words in nothing]
    turned = page(calibration_of(poses=True)).text
    assert "Mean orientation error on the 12 configurations" in turned
    assert "Orientation error of single readings [mrad]" in turned
    assert re.search(r"orientation 0\.\d+ mrad rotation axis declared in the data", turned)


def test_the_error_to_expect_is_on_the_first_page_with_what_it_is_of() -> None:
    result, text = calibration_of().expected, page(calibration_of()).text
    low, high = result.overall.interval_90
    assert f"{deserved(result.overall.mean * 1e3, (high - low) * 1e3 / 3.29)} mm" in text
    assert "Mean position error to expect over the whole workspace" in text
    assert "Targets 1, 2, 3 in the instrument's frame, no payload" in text
    bound = replace(calibration_of(), expected=replace(result, omissions=("values at a bound count as exact",)))
    message = Page(report_html(bound)).text
    assert "The errors may be larger: values at a bound count as exact." in message
    assert ("may be larger" in text, "positions are expected below" in text) == (False, True)
    assert "positions are expected below" not in message  # nor anywhere else an upper end
    table = report_html(bound).partition('id="expected-targets"')[2].partition("</table>")[0]
    assert table.count("or more") == 1 + len(result.targets)


def test_noise_and_notices_in_sentences() -> None:
    for declared, excess, words in (
        (True, 1.0, "no larger than the declared deviations allow"),
        (True, 2.345, "2.35 times as large as the declared deviations allow"),
        (False, 1.0, "estimated from the training residuals"),
    ):
        text = text_of(fit=replace(calibration_of().fit, declared=declared, excess=excess))
        assert words in text
        assert f"position 0.0500 mm coordinate {'declared' if declared else 'estimated'}" in text
    assert "Errors, warnings and notes None." in text_of(warnings=())
    notice = Notice("odd", "Leave `train` out, or use `loss=cauchy` & <b>.")
    html = report_html(replace(calibration_of(), warnings=(notice,)))
    assert "Leave <code>train</code> out, or use <code>loss=cauchy</code> &amp; &lt;b&gt;." in html


def test_held_out_readings_without_position() -> None:
    report = calibration_of(poses=True, model="offsets")
    hidden = np.isin(report.data.configuration, report.held_out)
    data = replace(report.data, position=np.where(hidden[:, None], np.nan, report.data.position))
    judged = data.of_configurations(report.held_out)
    errors = [errors_of(robot, judged) for robot in (report.fit.start, report.fit.robot)]
    blind = replace(report, data=data, nominal=errors[0], validation=errors[1])
    shown = Page(report_html(blind))
    assert "workspace" not in shown.figures
    assert "Mean position error on the" not in shown.text
    assert "Mean orientation error" in shown.text


def test_parameters_in_their_units() -> None:
    report = calibration_of()
    text = page(report).text
    for name, unit, scale in (("a_3", "mm", 1e3), ("theta_offset_2", "deg", 180 / np.pi)):
        p, start = report.fit.robot.parameters[name], report.fit.start.parameters[name]
        digits = 3 if unit == "mm" else 4
        change = (p.value - start.value) * scale
        row = f"{start.value * scale:.{digits}f} {p.value * scale:.{digits}f} {change:+.{digits}f}"
        assert f"{unit} {row}" in text
    assert " uninformed" in text
    assert "is its prior" in report_html(report)
    assert "Base, targets and fixtures (15 parameters)" in text
    fit = replace(report.fit, at_bound=("a_3",), unobservable=("d_4",))
    html = report_html(replace(report, fit=fit))
    assert re.search(r'<tr class="at-bound"><td><code>a_3</code>.*<td>at bound</td></tr>', html)
    assert re.search(r'<tr class="not-determined"><td><code>d_4</code>.*<td>not determined</td></tr>', html)
    fixed = re.search(r'<tr class="fixed">(.*?)</tr>', report_html(calibration_of(poses=True, model="offsets")))
    assert known(fixed)[1].endswith("<td>fixed</td>")
    assert "bar" not in known(fixed)[1]


def test_drop_names_every_combination() -> None:
    report = calibration_of(redundancy="drop")
    text = page(report).text
    assert report.fit.redundancies
    for redundancy in report.fit.redundancies:
        assert f"{redundancy.dropped} held: {redundancy.combination}" in text
    assert text.count("held: redundant") == len(report.fit.redundancies)
    assert f"{len(report.fit.redundancies)} held because they are redundant" in text
    assert "Redundant combinations" not in page(calibration_of()).text


# -- the pictures ------------------------------------------------------------------------------------------


def test_histograms_count_every_reading_in_the_same_bins() -> None:
    report = calibration_of(poses=True)
    for name in ("position-histogram", "orientation-histogram"):
        before, after = page(report).figures[name]["data"]
        assert before["x"] == after["x"]
        assert before["width"] == after["width"]
        assert sum(before["y"]) == sum(after["y"]) == 36


def test_workspace_is_in_the_base_frame_in_mm() -> None:
    report = calibration_of()
    cloud = page(report).figures["workspace"]["data"][0]
    part = Report(report).judged_part
    shown = np.array([cloud["x"], cloud["y"], cloud["z"]]).T
    at_origin = replace(report.fit.robot, base_quaternion=(1.0, 0.0, 0.0, 0.0)).with_values(
        {f"base_{axis}": 0.0 for axis in ("x", "y", "z", "rx", "ry", "rz")}
    )
    predicted = np.array([at_origin.world_poses(part.joints, name)[0] for name in part.targets])
    expected = predicted[part.target, part.configuration] * 1e3
    assert np.abs(shown - expected).max() < 0.5  # noise and rounding
    errors = np.linalg.norm(known(report.validation).position_errors, axis=1) * 1e3
    assert cloud["marker"]["color"] == pytest.approx(errors, rel=5e-3)
    assert [row[0] for row in cloud["customdata"]] == [part.labels[i] for i in part.configuration]
    before, same, own = (
        button["args"][0] for button in page(report).figures["workspace"]["layout"]["updatemenus"][0]["buttons"]
    )
    nominal = np.linalg.norm(report.nominal.position_errors, axis=1) * 1e3
    assert before["marker.color"][0] == pytest.approx(nominal, rel=5e-3)
    assert before["marker.cmax"] == same["marker.cmax"] > own["marker.cmax"]


def test_residuals_are_means_over_targets_in_measuring_order() -> None:
    report = calibration_of()
    training, held_out = page(report).figures["residuals"]["data"]
    assert training["x"] == sorted((report.training + 1).tolist())
    assert held_out["x"] == sorted((report.held_out + 1).tolist())
    errors = errors_of(report.fit.robot, report.data)
    means = np.linalg.norm(errors.position_errors, axis=1).reshape(-1, 3).mean(axis=1) * 1e3
    for trace in (training, held_out):
        assert trace["y"] == pytest.approx(means[np.array(trace["x"]) - 1], rel=1e-3)


def test_readings_with_little_weight_are_marked() -> None:
    losses: tuple[Loss, ...] = ("huber", "cauchy", "l1")
    for loss in losses:
        report = calibration_of(loss=loss, outlier=True)
        marks = page(report).figures["residuals"]["data"][2]
        worst = int(np.argmax(marks["y"]))
        assert marks["x"][worst] == report.training[4] + 1, loss
        assert marks["customdata"][worst] == [str(report.training[4] + 1), "2"], loss
        assert 20 < marks["y"][worst] < 60, loss
        assert len(marks["y"]) < 12, loss


def test_correlations_of_the_arms_own_parameters() -> None:
    report = calibration_of()
    drawn = page(report).figures["correlations"]["data"][0]
    free = report.fit.free
    own = [i for i, p in enumerate(free.parameters) if p.group not in ("base", "target", "fixture")]
    assert tuple(drawn["x"]) == tuple(drawn["y"]) == tuple(free.names[i] for i in own)
    r = report.fit.correlations[np.ix_(own, own)]
    assert np.abs(np.array(drawn["z"]) - r).max() < 0.006
    pairs = re.findall(
        r"<tr><td><code>(\S+)</code></td><td><code>(\S+)</code></td><td class=\"n\">([+-][0-9.]+)<", report_html(report)
    )
    assert len(pairs) == 10
    listed = [abs(float(value)) for _, _, value in pairs]
    assert listed == sorted(listed, reverse=True)
    # The IRB 120 has parallel axes 2 and 3: only the sum of their offsets moves anything, whatever is measured.
    assert abs(report.fit.correlations[free.names.index("d_2"), free.names.index("d_3")]) > 0.99
    assert {"d_2", "d_3"} not in [{a, b} for a, b, _ in pairs]
    assert not {name for a, b, _ in pairs for name in (a, b)} - {free.names[i] for i in own}


# -- screens and paper -------------------------------------------------------------------------------------


def test_a_dark_screen_has_colours_for_every_picture() -> None:
    html = report_html(calibration_of(poses=True, outlier=True))
    shown = page(calibration_of(poses=True, outlier=True))
    used = set(re.findall(r'"(#[0-9a-f]{6})"', json.dumps(shown.figures)))
    assert used <= set(DARK)
    assert "prefers-color-scheme: dark" in html
    assert "max-width: 640px" in html


def test_the_first_page_is_a_certificate() -> None:
    noted = replace(calibration_of(), notes={"serial": "4711", "operator": "A & B", "room": "20 degC"})
    html = report_html(replace(noted, warnings=(Notice("odd", "Odd."), Notice("bad", "Bad.", "error"))))
    first = html[html.index('<div class="certificate">') : html.index('<section id="warnings">')]
    for words in ("Serial number</dt><dd>4711", "A &amp; B", "Room</dt><dd>20 degC", "converged", "Signature", "Bad."):
        assert words in first
    # What was not noted can be filled in by hand on paper.
    assert '<div class="blank"><dt>Instrument</dt>' in first
    assert '<div class="blank"><dt>Operator</dt>' not in first
    assert "Warnings and notes, explained below: odd." in re.sub(r"\s+", " ", first)
    assert "break-after: page" in html


# -- digits ------------------------------------------------------------------------------------------------


def test_numbers_have_the_digits_that_they_deserve() -> None:
    for value, deviation, text in (
        (3.7186, 0.25, "3.72"),
        (0.07464, 0.0035, "0.075"),
        (0.07464, 0.0299, "0.075"),
        (1234.5, 20.0, "1234"),
        (0.0004, 0.05, "0.0004"),
        (0.07464, None, "0.0746"),
        (0.07464, 0.0, "0.0746"),
    ):
        assert deserved(value, deviation) == text
    for value, text in (
        *((0.0, "0"), (0.199_4, "0.199"), (0.0790, "0.0790"), (0.999_6, "1.00"), (12.34, "12.3"), (1234.5, "1234")),
        *((1e-9, "< 0.0001"), (float("nan"), "–")),
    ):
        assert significant(value) == text
    for freedom, t in ((1, 12.706), (2, 4.303), (3, 3.182), (5, 2.571), (17, 2.110), (99, 1.984)):
        assert student_975(freedom) == pytest.approx(t, rel=0.01)
    for low, high, ticks in (
        (0.08, 0.3, [0.1, 0.2]),
        (0.105, 0.16, [0.11, 0.12, 0.13, 0.14, 0.15, 0.16]),
        (2.1, 4.9, [2.5, 3.0, 3.5, 4.0, 4.5]),
        (1300.0, 1310.0, [1300.0, 1302.0, 1304.0, 1306.0, 1308.0, 1310.0]),
    ):
        shown = logarithmic_axis("error [mm]", low, high)["tickvals"]
        assert [tick for tick in shown if low <= tick <= high] == ticks


def test_the_shares_of_the_square_are_drawn_and_listed() -> None:
    shown = page(calibration_of())
    assert calibration_of().budget is not None
    (bars,) = shown.figures["limits-of-accuracy"]["data"]
    shares = ["instrument noise", "what the model cannot express", "uncertain parameters", "remainder"]
    assert bars["y"] == [*shares, "held out, together"]
    assert sum(bars["x"][:-1]) == pytest.approx(bars["x"][-1], rel=1e-3)
    for begin, length, after in zip(bars["base"], bars["x"][:-1], bars["base"][1:-1], strict=False):
        assert begin + length == pytest.approx(after, abs=1e-3 * bars["x"][-1])
    assert "no posture was visited again: it is in what the model cannot express" in shown.text


# -- joint curves ------------------------------------------------------------------------------------------


def curve(places: Array, deviation: float = 1.0) -> FittedCurve:
    """Return a curve of 10 mdeg, 7 periods in a turn, of a joint from -120 to 150 deg; deviation of terms in mdeg."""
    amounts = np.zeros(120)
    amounts[12] = math.radians(0.010)
    shown = math.radians(-120), math.radians(150)
    return FittedCurve(3, "J3", amounts, np.eye(120) * math.radians(deviation * 1e-3) ** 2, shown, np.radians(places))


@cache
def curved() -> Calibration:
    nominal, rng = load_robot("li3"), np.random.default_rng(2)
    twin = truth_twin(nominal, "gear-errors", np.random.default_rng(1))
    data = measure(twin, nominal.random_configurations(80, rng), 1e-5, rng)
    fit_with = partial(identify, model=named_model("geometric").also(["joint-curve"]))
    return calibration(nominal, data, np.arange(60), np.arange(60, 80), fit_with)


def test_a_picture_has_the_curve_its_band_and_where_was_measured() -> None:
    drawn = curve_figure(curve(np.linspace(-60, 150, 60)))
    low, high, line, marks = drawn["data"]
    x = np.radians(line["x"])
    assert np.array(line["y"]) == pytest.approx(10 * np.sin(7 * x), abs=0.02)
    half = 1.959964 * math.sqrt(60)
    assert np.array(high["y"]) - np.array(line["y"]) == pytest.approx(half, abs=2e-3)
    assert np.array(line["y"]) - np.array(low["y"]) == pytest.approx(half, abs=2e-3)
    assert high["fill"] == "tonexty"
    assert len(marks["x"]) == 60
    assert drawn["layout"]["xaxis"]["range"] == [-120, 150]
    (grey,) = drawn["layout"]["shapes"]
    assert (grey["x0"], grey["x1"]) == (-120, -60)
    bottom, top = drawn["layout"]["yaxis"]["range"]
    assert bottom < min(low["y"])
    assert top > max(high["y"])
    assert {grey["fillcolor"], high["fillcolor"], line["line"]["color"], marks["marker"]["color"]} <= set(DARK)
    drawn = curve_figure(curve(np.zeros(0)))  # nothing measured is grey all over
    (grey,) = drawn["layout"]["shapes"]
    assert (grey["x0"], grey["x1"]) == (-120, 150)
    ((_, _, band, _, measured),) = curves_table([curve(np.zeros(0))]).rows
    assert (measured, band) == ("nowhere", "–")


def test_a_wide_band_outside_the_measured_range_does_not_flatten_the_curve() -> None:
    result = curve(np.linspace(-60, 150, 60))
    amounts = np.zeros((120, 120))
    amounts[0, 0] = math.radians(1.0) ** 2  # the sine of one period: a degree, which no picture of 10 mdeg can hold
    wide = FittedCurve(result.number, result.name, result.amounts, amounts, result.shown, np.radians([-5.0, 0.0, 5.0]))
    bottom, top = curve_figure(wide)["layout"]["yaxis"]["range"]
    assert 100 < top - bottom < 2000  # the band has 170 mdeg to either side at 5 deg, 2000 at 90 deg
    (row,) = curves_table([curve(np.linspace(-60, 150, 60), deviation=0.1)]).rows
    assert tuple(row) == ("3, J3", "7.1", "1.5", "7 (10 mdeg)", "-60 to 150")


def test_the_report_shows_each_curve_and_not_its_hundreds_of_numbers() -> None:
    run = curved()
    names = [f"joint-curve-{fitted_curve.number}" for fitted_curve in run.curves]
    assert names
    drawn = Report(run).figures()
    assert [name for name in drawn if name.startswith("joint-curve")] == names
    page = report_html(run)
    for name in names:
        assert f'id="{name}"' in page
    assert page.count("<h2>Curves of the joints</h2>") == 1
    tables = page.split('<script type="application/json"')[0]
    assert "curve_sin1_" not in tables
    assert not [name for name in drawn["correlations"]["data"][0]["x"] if name.startswith("curve_")]
    result = json.loads(json.dumps(run.result()))
    assert [entry["joint"] for entry in result["curves"]] == [fitted_curve.number for fitted_curve in run.curves]
    assert not [row for row in result["parameters"] if row["name"].startswith("curve_")]
    assert [line for line in run.lines() if line.startswith("Joint 1: curve of ")]
    assert len(run.plot(f"joint-curve-{run.curves[0].number}").data) == 4


# -- what every effect does --------------------------------------------------------------------------------


def shares() -> Shares:
    """Return effects of which one moves the targets two hundred times as far as another."""
    rows = (
        EffectShare("joint-curve", 4e-5, 11.26, 14),
        EffectShare("backlash", 2e-7, 2.0, 6),
        EffectShare("clearance", 0.0, 5.9, 6),
        EffectShare("thermal-growth", None, 0.0, 0, "no temperature was recorded"),
    )
    return Shares(rows)


def test_small_moves_are_seen_beside_a_large_one() -> None:
    drawn = shares_figure(shares())
    (bars,) = drawn["data"]
    lengths = dict(zip(bars["y"], bars["x"], strict=True))
    assert list(lengths) == ["clearance", "backlash", "joint-curve"]
    assert lengths["clearance"] == 0.0
    assert 0.02 < lengths["backlash"] / lengths["joint-curve"] < 0.5
    assert bars["customdata"] == [0.0, 0.0002, 0.04]
    layout = drawn["layout"]["xaxis"]
    places = dict(zip(layout["ticktext"], layout["tickvals"], strict=True))
    assert places["0"] == 0.0
    assert places["0.01"] > places["0.001"] > 0.0
    assert np.all(np.diff(layout["tickvals"]) > 0.0)


def test_a_row_says_what_an_effect_does_or_why_it_is_left_out() -> None:
    table = shares_table(shares())
    first, second, _, untold = (tuple(each) for each in table.rows)
    assert first == ("joint-curve", "0.0400", "11.3 of 14", "")
    assert second == ("backlash", "0.0002", "2.0 of 6", "")
    assert untold == ("thermal-growth", "–", "–", "no temperature was recorded")
    assert table.marks == ("taken", "", "", "")  # a micrometre is next to nothing
