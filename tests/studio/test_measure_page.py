"""The page Measure, without a browser: what comes, what is shown of it, and what is written."""

from __future__ import annotations

import re
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.commanding import truearm as truearm
from tests.house.examples import MEASURED_PLAN
from tests.studio.conftest import Serving
from tests.studio.pressing import act, below

from truearm.engine.base.errors import InputError
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform
from truearm.measuring.measure import open_campaign
from truearm.measuring.report import drift_figure, quality_figure
from truearm.measuring.session import REASONS
from truearm.studio.measure_fields import MeasureFields, measure_arguments, measure_command
from truearm.studio.measuring import ASIDE, Measuring
from truearm.studio.pages.jog import JogPage
from truearm.studio.pages.measure import MeasurePage
from truearm.studio.serving import Studio
from truearm.studio.window import Window

FILES = ("measuring.json", "readings.csv", "measurements.csv", "measure.html", "truearm.manifest.json")
ARM: dict[str, Any] = {
    "plan": "plan.csv",
    "device": "measurement-arm",
    "nests": "n1, n2",
    "every": 2,
    "disturbed": 0.3,
    "seed": 4,
}
MAPPING = """\
truearm: truearm-mapping/1
configuration: {column: Pose}
length_unit: mm
readings: [{target_column: Point, x: X, y: Y, z: Z}]
dwell: {deviation: RMS, unit: mm, breaks: Lost}
joints: {file: plan.csv}
"""
ROWS = "Pose,Point,X,Y,Z,RMS,Lost\nP1,smr,500,100.5,200,0.008,0\nP2,smr,400,1OO,300,0.007,0\nP2,smr,410,100,310,0.2,0\n"


@pytest.fixture
def studio(serving: Serving, tmp_path: Path) -> Studio:
    studio = serving(pages=(JogPage, MeasurePage))
    (tmp_path / "project" / "plan.csv").write_text(MEASURED_PLAN)
    studio.window.project.look()
    return studio


@pytest.fixture
def page(studio: Studio) -> Iterator[MeasurePage]:
    page = page_of(studio)
    yield page
    with studio.window.lock:
        page._close()


def page_of(studio: Studio) -> MeasurePage:
    found = next(page for page in studio.window.pages if isinstance(page, MeasurePage))
    found._pace._impl.value = 50
    return found


def ask(page: MeasurePage, **fields: Any) -> None:
    page._window.edit(measure=fields)


def eventually(true: Callable[[], bool]) -> bool:
    end = time.monotonic() + 30.0
    while not true() and time.monotonic() < end:
        time.sleep(0.02)
    return true()


def going(page: MeasurePage) -> Measuring:
    assert page.measuring is not None
    return page.measuring


def session(page: MeasurePage) -> Any:
    return going(page).campaign.session


def frozen(page: MeasurePage, entries: int) -> None:
    """Start, and take no more than some readings: nothing comes by itself."""
    page._pace._impl.value = 5  # one in a turn
    page._run = lambda measuring: None  # type: ignore[method-assign]
    act(page._begin)
    with page._window.lock:
        for _ in range(entries):
            page._taken(going(page))


def told(window: Window) -> str:
    return re.sub("<[^>]*>", " ", "\n".join(window._told))


def scene_of(page: MeasurePage) -> Any:
    return next(page for page in page._window.pages if isinstance(page, JogPage)).scene


def test_files_of_a_virtual_instrument_are_those_of_the_command(
    page: MeasurePage, studio: Studio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, truearm: Truearm
) -> None:
    ask(page, **ARM)
    act(page._begin)
    assert eventually(lambda: studio.window.project.settings.data is not None)
    assert studio.window.project.settings.data == "measured/measurements.csv"
    assert eventually(lambda: "the page Check tells" in told(studio.window))
    with studio.window.lock:
        assert session(page).done
        drift, quality = drift_figure(session(page)), quality_figure(session(page))
        page._pictures()
        assert drift is not None
        assert quality is not None
        assert [one.y for one in page._quality._plot.figure.data] == [tuple(one["y"]) for one in quality["data"]]
        assert len(page._drift._plot.figure.data) == len(drift["data"])
    assert "All is measured" in page._next.content
    assert (page._stop.visible, page._end_all.visible, page.settings.visible) == (False, True, False)
    act(page._end_all)
    assert page.measuring is None
    assert told(studio.window).count("3 of 3 configurations measured") == 1
    assert told(studio.window).count("the page Check tells") == 1
    assert (page._stop.visible, page._end_all.visible, page.settings.visible) == (False, False, True)
    assert studio.window.project.changes() == ()
    other = tmp_path / "other"
    other.mkdir()
    (other / "plan.csv").write_text(MEASURED_PLAN)
    monkeypatch.chdir(other)
    words = "measure plan.csv irb120 --device measurement-arm --seed 4 --disturbed 0.3 --nest n1 --nest n2 --every 2"
    assert truearm(*words.split(), "--out", "measured").code == 0
    project = studio.window.project.folder
    for name in FILES:
        assert (project / "measured" / name).read_bytes() == (other / "measured" / name).read_bytes(), name
    studio.window._undo_edit()
    assert studio.window.project.settings.data is None


def test_what_is_next_and_what_came_is_said_and_drawn(page: MeasurePage) -> None:
    ask(page, **{**ARM, "disturbed": 0.9, "seed": 1})
    frozen(page, 9)
    drawn = session(page).drawn()
    assert 0 < drawn.kept.sum() < len(drawn.kept)
    said = re.sub("<[^>]*>", " ", page._next.content)
    assert "still to come" in said
    assert going(page).kept_words() in said
    table = page._last.content
    for code, count in session(page).aside_by_reason.items():
        assert f"aside: {code}" in table
        assert REASONS[code] in table
        assert f">{count}<" in table
    assert f"{drawn.deviation[-1] * 1e3:.4f}" in table
    parts = scene_of(page)._parts
    assert len(parts["measured-kept"][0].points) == drawn.kept.sum()
    assert len(parts["measured-aside"][0].points) == (~drawn.kept).sum()
    assert tuple(parts["measured-aside"][0].colors.tolist()) == ASIDE
    placed = going(page).campaign.placed
    assert placed is not None
    base = placed.base
    first = drawn.position[np.flatnonzero(drawn.kept)[0]]
    at = base.rotation.T @ (first - np.array(base.translation))
    assert parts["measured-kept"][0].points[0] == pytest.approx(at, abs=1e-5)
    named = parts["measured-names"][0]
    assert named.text == "instrument"
    above = base.rotation.T @ -np.array(base.translation) + [
        0.0,
        0.0,
        0.22 * scene_of(page).length,
    ]  # at it stands "world"
    assert named.position == pytest.approx(above, abs=1e-5)
    act(page.scene._points, False)
    assert not parts["measured-kept"]


def test_lines_of_sight_lead_to_the_targets_of_the_arm_at_the_next_configuration(page: MeasurePage) -> None:
    ask(page, plan="plan.csv", device="measurement-arm")
    frozen(page, 1)
    step = session(page).next
    scene = scene_of(page)
    q = going(page).campaign.joints[step.configuration]
    assert scene.joints == pytest.approx(q)
    lines = scene._parts["measured-sight"][0].points
    placed = going(page).campaign.placed
    assert placed is not None
    nominal = placed.with_frames(Transform(), {one.name: placed.tool_place(one.name) for one in placed.targets})
    ends = [nominal.world_poses(q[None], target.name)[0][0] for target in nominal.targets]
    assert lines[:, 1] == pytest.approx(np.array(ends), abs=1e-6)
    assert "sees all of them" in page._next.content
    assert [label.text for label in scene._parts["measured-names"]] == ["instrument", f"{step.names[0]}, next"]


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({}, "plan: no plan is chosen"),
        ({"plan": "plan.csv", "targets": "9"}, "targets: the tool has no such target"),
        ({"plan": "plan.csv", "disturbed": 2.0}, "disturbed: the number is out of range; got 2"),
        ({"plan": "plan.csv", "nests": "1"}, "a name stands for a target and for a nest"),
        ({"plan": "plan.csv", "source": "watched folder"}, "watch: no folder is given. Write into the field Folder"),
        ({"plan": "plan.csv", "source": "watched folder", "mapping": "m.yaml"}, "watch: no folder is given"),
        ({"plan": "plan.csv", "source": "watched folder", "watch": "rows"}, "mapping: nobody says what the columns"),
        ({"plan": "plan.csv", "source": "watched folder", "watch": "none", "mapping": "m.yaml"}, "no such folder"),
        ({"plan": "gone.csv"}, "gone.csv: there is no such file"),
    ],
)
def test_what_the_job_refuses_is_said_in_its_words(page: MeasurePage, fields: dict[str, Any], said: str) -> None:
    ask(page, **fields)
    act(page._begin)
    assert page.measuring is None
    assert said in told(page._window)
    assert page.settings.visible


def test_how_much_of_a_plan_is_seen_is_told_at_the_start_and_a_blind_one_is_refused(
    page: MeasurePage, tmp_path: Path
) -> None:
    ask(page, plan="plan.csv", device="tracker")
    act(page._begin)
    assert page.measuring is None
    refusal = below(page._window, page._begin)
    assert "plan: nothing of this plan can be read with the tracker" in refusal
    assert "device=tracker, on the page Plan of the studio the field Instrument" in refusal
    assert not (tmp_path / "project" / "measured").exists()
    plan = tmp_path / "project" / "plan.csv"
    plan.write_text(plan.read_text() + "P4,180,0,0,0,0,0\n")
    ask(page, plan="plan.csv", device="markers", truth="nominal")
    frozen(page, 0)
    assert "Warning (not-seen) : With the markers 2 of 4 pairs of configuration and target" in told(page._window)
    assert "none at 2 of 4 configurations" in page._notices.content


@pytest.mark.parametrize("name", ["plan", "watch", "mapping", "about", "out"])
def test_no_place_out_of_the_folder_is_taken(page: MeasurePage, name: str) -> None:
    with pytest.raises(InputError, match="no place in the project's folder"):
        ask(page, **{name: "../elsewhere"})


def test_a_measuring_that_was_stopped_goes_on_in_another_studio(
    page: MeasurePage, studio: Studio, serving: Serving, tmp_path: Path
) -> None:
    ask(page, **ARM)
    frozen(page, 7)
    act(page._stop, "stop")
    assert studio.window.project.settings.data is None
    assert re.search(r"are still to be taken; next is P\d, \w+\. Start goes on there\.", told(studio.window))
    assert "same command" not in told(studio.window)
    assert "The same command goes on there." in (tmp_path / "project" / "measured" / "measure.html").read_text()
    assert "Start goes on where it stood" in page._next.content
    del page._run
    page._pace._impl.value = 1
    act(page._begin)
    assert "Going on after 7 entries" in told(studio.window)
    studio.stop()
    assert eventually(lambda: page.measuring is None)
    again = page_of(serving(pages=(JogPage, MeasurePage)))
    act(again._begin)
    assert eventually(lambda: again._window.project.settings.data is not None)
    straight = tmp_path / "straight"
    given = measure_arguments(MeasureFields(**ARM).said(None))
    with open_campaign(tmp_path / "project" / "plan.csv", "irb120", straight, **given) as campaign:
        while not campaign.session.done:
            campaign.step()
    for name in ("measuring.json", "readings.csv"):
        assert (tmp_path / "project" / "measured" / name).read_bytes() == (straight / name).read_bytes()


def test_the_operator_sets_aside_and_leaves_out(page: MeasurePage) -> None:
    ask(page, plan="plan.csv", device="measurement-arm")
    act(page._act, "set the reading aside")
    assert "nothing is being measured" in told(page._window)
    frozen(page, 2)
    page._reading._impl.value, page._why._impl.value = "1", "the nest was not clean"
    act(page._act, "set the reading aside")
    assert session(page).aside_by_reason == {"operator": 1}
    assert "the nest was not clean" in (going(page).campaign.log.path).read_text()
    page._reading._impl.value = "1"
    act(page._act, "set the reading aside")
    assert "no kept reading of this number" in told(page._window)
    page._reading._impl.value = "one"
    act(page._act, "set the reading aside")
    assert "the number of a reading belongs here" in told(page._window)
    point = session(page).next.names[0]
    act(page._point, point)
    act(page._act, "leave the point out")
    assert session(page).left_out == ((session(page).labels[0], point),)
    assert "left out" in page._last.content


def test_finish_before_the_end_takes_what_is_there(page: MeasurePage) -> None:
    ask(page, plan="plan.csv", device="measurement-arm", nests="n", out="first")
    frozen(page, 1)
    act(page._stop, "finish")
    assert "no reading of a target is kept" in told(page._window)
    assert page.measuring is not None
    with page._window.lock:
        page._taken(going(page))
        act(page._stop, "finish")
    assert page._window.project.settings.data == "first/measurements.csv"
    assert page._file.value == "first/measurements.csv"


def test_readings_of_a_former_folder_are_no_longer_shown_for_another(page: MeasurePage) -> None:
    ask(page, **ARM)
    frozen(page, 9)
    nests = sum(entry.is_nest for entry in session(page).kept)
    assert 0 < nests < len(session(page).kept)
    assert re.search(rf" {len(session(page).kept) - nests} readings? kept, {nests} of nests", page._next.content)
    page._pictures()
    act(page._stop, "stop")
    assert page._last.content
    assert page._quality.place.visible
    assert scene_of(page)._parts["measured-kept"]
    page._change("out", "new")
    page._window.refresh()
    assert not page._last.content
    assert not page._notices.content
    assert not page._quality.place.visible
    assert not page._drift.place.visible
    parts = scene_of(page)._parts
    assert not any(parts[name] for name in ("measured-kept", "measured-aside", "measured-sight", "measured-names"))
    assert "begins with the first" in page._next.content


@pytest.mark.parametrize(
    ("name", "number"),
    [("every", 0), ("every", -3), ("every", 10001), ("fewest_samples", 0), ("fewest_samples", 10**7)],
)
def test_a_whole_number_that_cannot_be_is_refused_where_it_is_typed(page: MeasurePage, name: str, number: int) -> None:
    before = page._now()
    with pytest.raises(InputError, match=r"too (small|large)") as refusal:
        page._change(name, number)
    assert refusal.value.came == number
    assert page._now() == before


def test_rows_of_a_watched_folder_are_taken_and_broken_ones_named(page: MeasurePage, tmp_path: Path) -> None:
    project = tmp_path / "project"
    (project / "map.yaml").write_text(MAPPING)
    (project / "rows").mkdir()
    (project / "rows" / "points.csv").write_text(ROWS)
    page._window.project.look()
    ask(
        page,
        plan="plan.csv",
        source="watched folder",
        watch="rows",
        mapping="map.yaml",
        targets="smr",
        most_deviation=0.03,
    )
    act(page._begin)
    assert eventually(lambda: page.measuring is not None and len(session(page).entries) == 2)
    window = page._window
    assert eventually(lambda: "points.csv, line 3, column Y" in told(window))
    assert eventually(lambda: "1OO" in page._notices.content)
    with (project / "rows" / "points.csv").open("a") as stream:
        stream.write("P2,smr,410.1,100,310,0.005,0\n")
    assert eventually(lambda: len(session(page).entries) == 3)
    assert "Where the instrument stands is not known" in page._next.content
    assert not scene_of(page)._parts.get("measured-kept")
    with window.lock:
        assert window.project.changes() == ()
    act(page._stop, "finish")
    report = (project / "measured" / "measure.html").read_text()
    assert str(tmp_path) not in report
    assert "files in rows" in report


def test_readings_of_a_real_instrument_are_drawn_where_the_robot_file_says_that_the_base_is(
    page: MeasurePage, tmp_path: Path
) -> None:
    project = tmp_path / "project"
    base = Transform((2.0, 0.5, 0.0), (0.0, 0.0, 1.0, 0.0))
    (project / "placed.yaml").write_text(robot_text(load_robot("irb120").with_frames(base, {"smr": (0.0, 0.0, 0.1)})))
    (project / "map.yaml").write_text(MAPPING)
    (project / "rows").mkdir()
    (project / "rows" / "points.csv").write_text(ROWS)
    page._window.edit(robot="placed.yaml")
    ask(page, plan="plan.csv", source="watched folder", watch="rows", mapping="map.yaml")
    act(page._begin)
    assert eventually(lambda: bool(scene_of(page)._parts.get("measured-kept")))
    assert scene_of(page)._parts["measured-kept"][0].points[0] == pytest.approx([0.5, 0.1005, 0.2], abs=1e-6)


def test_a_port_is_open_only_between_start_and_stop_and_its_token_is_shown_once(
    page: MeasurePage, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    shown: list[str] = []
    monkeypatch.setattr(page._window, "show_once", lambda title, texts: shown.extend(texts))
    ask(page, plan="plan.csv", source="port of this machine", targets="smr")
    assert not shown
    act(page._begin)
    port, token = int(shown[0].split()[-1]), shown[1].split()[-1]
    with socket.create_connection(("127.0.0.1", port), timeout=10) as stream:
        lines = stream.makefile("rw")
        for line in (f"token {token}", "reading smr 500 100 200 mm at=P1 deviation=0.01"):
            print(line, file=lines, flush=True)
            assert lines.readline()
    assert eventually(lambda: len(session(page).entries) == 1)
    act(page._stop, "finish")
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", port), timeout=10)
    assert token not in told(page._window)
    assert token not in "".join(capfd.readouterr())
    for path in (tmp_path / "project").rglob("*"):
        assert path.is_dir() or token not in path.read_text()


def test_what_it_was_measured_with_is_asked_for_and_written(page: MeasurePage, tmp_path: Path) -> None:
    file = tmp_path / "project" / "about.yaml"
    with_it = page.about
    with_it._set("instrument_serial", "750123")
    assert page._window.project.settings.measure.about == "about.yaml"
    with_it._set("reflector_radius", 19.05)
    with_it._set("reflector_offset", 0.0)
    file.write_text(file.read_text().replace("radius: 19.05", "radius: 19.05  # of the ball"))
    for when in ("start", "end"):
        with_it._when._impl.value, with_it._air["temperature"]._impl.value = when, "20.5"
        act(with_it._add)
    text = file.read_text()
    assert "# of the ball" in text
    assert text.count("temperature: 20.5") == 2
    assert "19.05 mm" in with_it._said.content
    act(with_it._add)
    assert "nobody says when" in told(page._window)
    with_it._air["pressure"]._impl.value, with_it._when._impl.value = "10", "noon"
    act(with_it._add)
    assert "no hall has such air" in told(page._window)
    with_it._air["pressure"]._impl.value = ""
    assert file.read_text() == text
    page._window._undo_edit()
    assert file.read_text().count("temperature: 20.5") == 1
    ask(page, plan="plan.csv", device="measurement-arm")
    frozen(page, 3)
    ask(page, **{**page._now(), "about": "about.yaml"})
    with_it._when._impl.value, with_it._air["temperature"]._impl.value = "at the end", "22.5"
    act(with_it._add)
    act(page._stop, "finish")
    report = (tmp_path / "project" / "measured" / "measure.html").read_text()
    assert "750123" in report
    assert "22.5 degC" in report


def test_a_log_that_cannot_be_written_ends_the_measuring_and_says_so(
    page: MeasurePage, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    ask(page, plan="plan.csv", device="measurement-arm")
    monkeypatch.setattr(Measuring, "step", lambda *_: 1 / 0)
    act(page._begin)
    assert eventually(lambda: page.measuring is None)
    assert eventually(lambda: "this failed in an unforeseen way (ZeroDivisionError" in told(page._window))
    assert "ZeroDivisionError" in capfd.readouterr().err


def test_the_command_of_the_page_has_every_option_by_its_name() -> None:
    fields = MeasureFields(
        source="watched folder",
        watch="rows",
        mapping="m.yaml",
        targets="a, b",
        nests="n",
        every=5,
        most_deviation=0.03,
        fewest_samples=4,
    )
    assert measure_command("plan.csv", "irb120", fields.said("2kg")) == (
        "truearm measure plan.csv irb120 --watch rows --map m.yaml --target a --target b --nest n --every 5 "
        "--most-deviation 0.03 --fewest-samples 4 --out DIR"
    )
    assert measure_arguments(fields.said(None))["most_deviation"] == pytest.approx(3e-5)


def test_a_nest_that_a_box_hides_is_said_before_it_is_left_out_and_its_line_is_red(studio: Studio) -> None:
    project, page = studio.window.project, page_of(studio)
    (project.folder / "boxes.yaml").write_text(
        "truearm: truearm-constraints/1\nunits: {length: mm, angle: deg}\nkeep_out: {shed: {z: [-1, 2000]}}\n"
    )
    project.look()
    ask(page, **{**ARM, "device": "optical-cmm-spatial", "constraints": "boxes.yaml"})
    measuring = Measuring(project, studio.window.robot())
    try:
        assert measuring.next_words()[-1] == "It does not see n1, n2 there."
        lines = measuring.lines_of_sight()
        assert lines is not None
        assert (len(lines.segments), [*lines.names]) == (2, ["instrument", "n1, hidden"])
        assert lines.colours[0].tolist() == lines.colours[1].tolist()
        (entry,), _ = measuring.step(1)
        assert (entry.event, entry.words) == ("left", "the box 'shed' is in the line of sight")
    finally:
        measuring.campaign.close()
