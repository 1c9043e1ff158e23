"""The page Plan, without a browser: its files are the command's, its fields stay, its ways are driven in the scene."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.cli.conftest import Truearm
from tests.cli.conftest import truearm as truearm
from tests.studio.conftest import Serving
from tests.studio.pressing import at_once, below
from tests.studio.test_jog_page import act, eventually
from tests.studio.typing_in import typed as type_in

from truearm.errors import InputError
from truearm.studio.pages.jog import JogPage
from truearm.studio.pages.plan import PlanPage
from truearm.studio.plan_fields import PlanFields, plan_arguments
from truearm.studio.project import open_project
from truearm.studio.recorded import read_recorded
from truearm.studio.serving import Studio


@pytest.fixture
def studio(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> Studio:
    monkeypatch.setattr("truearm.studio.typing_at_rest._REST", 0.01)  # nobody types here
    return serving()


def page_of(studio: Studio) -> PlanPage:
    return next(page for page in studio.window.pages if isinstance(page, PlanPage))


def typed(studio: Studio, name: str, value: Any) -> None:
    """Give a field a value as somebody does who types it, and wait for it to be taken."""
    type_in(studio, page_of(studio).fields.element(name), value)


def said(studio: Studio) -> str:
    return "".join(studio.window._told)


_ROOM = """truearm: truearm-constraints/1
units: {length: mm, angle: deg}
keep_out: {wall: {x: [-2000, -450]}}
"""


def test_a_plan_with_its_program_is_the_commands_byte_by_byte(
    studio: Studio, truearm: Truearm, monkeypatch: pytest.MonkeyPatch
) -> None:
    window, folder = studio.window, studio.window.project.folder
    (folder / "room.yaml").write_text(_ROOM)
    window.edit(payload="2.7kg,50mm,25mm,100mm")
    for name, value in {"poses": "15", "candidates": "80", "noise": "0.05", "seed": "3", "program": "rapid"}.items():
        typed(studio, name, value)
    for name, value in {"floor": "-600", "clearance": "60", "home": "0,-30,30,0,30,0", "speed": "100,5"}.items():
        typed(studio, name, value)
    rest: dict[str, Any] = {"approach": True, "wait": "operator", "dwell": "3", "constraints": "room.yaml"}
    for name, value in rest.items():
        typed(studio, name, value)
    typed(studio, "region", "350..450,-50..50,250..350")
    page = page_of(studio)
    act(page._run)
    assert window.wait(90.0)
    assert eventually(lambda: "Written: plan/plan.csv" in page._said.content), said(studio)
    names = sorted(path.name for path in (folder / "plan").iterdir() if not path.name.startswith("."))
    assert {"plan.csv", "plan.html", "plan-ways.csv", "sheet.html", "MEASURE.mod"} <= set(names)
    found = re.search(r"truearm plan irb120 [^<]*--out PLAN", (folder / "plan" / "plan.html").read_text())
    assert found is not None
    words = shlex.split(found[0].replace("&#39;", "'").replace("&quot;", '"'))[1:]
    monkeypatch.chdir(folder)
    printed = truearm(*words[:-1], "by-command").out
    for name in ("plan.csv", "plan.html", "plan-ways.csv", "sheet.html", "MEASURE.mod"):
        assert (folder / "plan" / name).read_bytes() == (folder / "by-command" / name).read_bytes(), name
    assert printed.splitlines()[0] in page._said.content
    wanted = {"plan/sheet.html", "plan/MEASURE.mod", "plan/plan.csv", "plan/plan.html"}
    assert eventually(lambda: set(page._file.options) >= wanted)


def test_fields_are_kept_are_undone_and_shown_again(studio: Studio) -> None:
    typed(studio, "poses", "auto")
    typed(studio, "home", "0,0,0,0,30,0")
    window = studio.window
    assert open_project(window.project.folder).settings.plan == PlanFields(poses="auto", home="0,0,0,0,30,0")
    window._undo_edit()
    assert page_of(studio).fields.element("home").value == ""
    window._redo_edit()
    assert page_of(studio).fields.element("home").value == "0,0,0,0,30,0"
    typed(studio, "home", "")
    assert window.project.settings.plan.home is None


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("floor", "low", "a number belongs here"),
        ("noise", "", "a number belongs here"),
        ("candidates", "12.5", "a whole number belongs here"),
        ("candidates", "0", "too small"),
        ("candidates", "1e999", "a whole number belongs here"),
        ("poses", "2 0", "poses: a number of poses belongs here; got &#x27;2 0&#x27;; allowed: a whole"),
        ("poses", "12.5", "a number of poses belongs here"),
        ("poses", "0", "poses: the number is out of range; got 0; allowed: 1 to 50000"),
        ("poses", "", "a number of poses belongs here"),
    ],
)
def test_what_is_no_number_is_refused_below_its_field_and_stays_there_to_be_mended(
    studio: Studio, name: str, value: str, words: str
) -> None:
    before = studio.window.project.settings
    typed(studio, name, value)
    field = page_of(studio).fields.element(name)
    assert words in below(studio.window, field)
    assert studio.window.project.settings == before
    assert field.value == value
    act(page_of(studio)._cloud, False)
    assert (field.value != value, below(studio.window, field)) == (True, "")


@pytest.mark.parametrize(
    ("said", "parameter"),
    [
        ({"region": "1..2"}, "region"),
        ({"home": "1,2"}, "home"),
        ({"speed": "fast"}, "speed"),
        ({"noise": 0.0}, "noise"),
    ],
)
def test_texts_that_cannot_be_are_refused_by_their_parameter(said: dict[str, Any], parameter: str) -> None:
    with pytest.raises(InputError) as refused:
        plan_arguments("irb120", said)
    assert refused.value.parameter == parameter


def test_a_file_outside_the_folder_is_no_place_of_a_plan(studio: Studio) -> None:
    for name in ("candidates_from", "accurate_at", "out"):
        with pytest.raises(InputError, match="no place in the project's folder"):
            studio.window.edit(plan={name: "../part.mod"})


def test_a_plan_is_written_where_it_is_said(studio: Studio) -> None:
    window, page = studio.window, page_of(studio)
    (window.project.folder / "plan.csv").write_text("mine")
    window.edit(plan={"poses": "8", "candidates": 40})
    act(page._run)
    assert window.wait(60.0)
    assert eventually(lambda: "plan.csv" in said(studio))
    assert (window.project.folder / "plan.csv").read_text() == "mine"
    typed(studio, "out", "plans/first.csv")
    act(page._run)
    assert window.wait(60.0)
    names = ("plans/first.csv", "plans/first.html", "plans/first-ways.csv", "plans/first-sheet.html")
    assert eventually(lambda: page._file.options == names), said(studio)
    assert f"Written: {', '.join(names)}" in page._said.content
    assert window.project.changes() == ()
    assert "Another program has changed files: plan.csv (new). The pages show them as they are now." in said(studio)


def test_a_plan_from_a_file_has_ways_where_they_are_asked_for(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    window, page = studio.window, page_of(studio)
    at_once(window, monkeypatch)
    rows = [f"{k},{','.join(str(10 + 7 * ((k * j) % 5)) for j in range(1, 7))}" for k in range(1, 13)]
    head = f"configuration,{','.join(f'joint_{j} [deg]' for j in range(1, 7))}"
    (window.project.folder / "mine.csv").write_text("\n".join([head, *rows]) + "\n")
    window.edit(plan={"poses": "8", "candidates_from": "mine.csv"})
    act(page._run)
    assert page._file.options == ("plan.csv", "plan.html")
    act(page._tour, "drive")
    told = "plan.csv: no ways stand beside this plan. Say a clearance, a floor, no floor or home"
    assert told in below(window, page._tour)
    window.edit(plan={"poses": "8", "candidates_from": "mine.csv", "clearance": 10.0})
    act(page._run)
    assert "plan-ways.csv" in page._file.options
    act(page._tour, "drive")
    jog = next(page for page in window.pages if isinstance(page, JogPage))
    assert jog._playing is not None
    act(page._tour, "stop")


def test_the_ways_are_driven_from_home_and_shown_after_reopening(
    studio: Studio, serving: Serving, tmp_path: Path
) -> None:
    window, page = studio.window, page_of(studio)
    act(page._tour, "drive")
    assert "there are no ways to drive yet" in said(studio)
    window.edit(plan={"poses": "12", "candidates": 60})
    act(page._run)
    assert window.wait(60.0)
    jog = next(page for page in window.pages if isinstance(page, JogPage))
    assert eventually(lambda: bool(jog.scene._parts.get("chosen")))
    assert page._scale.visible
    assert " mm (dark) to " in page._scale.content
    act(page._among, True)
    assert len(jog.scene._parts["candidates"][0].points) >= 12
    page._speed._impl.value = 1000.0
    act(page._tour, "drive")
    ways = read_recorded(window.project.path("plan-ways.csv"), jog.scene.solid.robot)  # type: ignore[union-attr]
    assert ways.labels[0] == ways.labels[-1] == "home"
    assert [label for label in ways.labels if label.startswith("measure")] == [f"measure {k}" for k in range(1, 13)]
    assert len(jog.scene._parts["ways"]) == 1
    playing = jog._playing
    assert playing is not None
    act(page._tour, "stop")
    assert playing.is_set()
    chosen = jog.scene._parts["chosen"][0].points
    studio.stop()
    again = serving(window.project.folder)
    shown = next(page for page in again.window.pages if isinstance(page, JogPage)).scene._parts["chosen"][0].points
    assert np.asarray(shown) == pytest.approx(np.asarray(chosen), abs=1e-6)
    assert page_of(again)._file.options == ("plan.csv", "plan.html", "plan-ways.csv", "plan-sheet.html")
    again.window.edit(robot="katana450")
    assert next(p for p in again.window.pages if isinstance(p, JogPage)).scene._parts["chosen"] == []
