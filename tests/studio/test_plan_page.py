"""The page Plan, without a browser: its files are the command's, its fields stay, its ways are driven in the scene."""

from __future__ import annotations

import json
import re
import shlex
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.commanding import Truearm
from tests.commanding import truearm as truearm
from tests.plate import PLATE
from tests.studio.conftest import Serving
from tests.studio.pressing import at_once, below
from tests.studio.test_jog_page import act, eventually
from tests.studio.typing_in import typed as type_in

from truearm.engine.base.errors import InputError
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.planning.plan import plan
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


_SRC = """&ACCESS RVP
DEF part ( )
  LIN XP1
  LIN XP2
END
"""
_DAT = """&ACCESS RVP
DEFDAT part
  DECL E6POS XP1={X 400.0,Y 0.0,Z 400.0,A 0.0,B 90.0,C 0.0}
  DECL E6POS XP2={X 400.0,Y 50.0,Z 400.0,A 0.0,B 90.0,C 0.0}
ENDDAT
"""
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
def test_what_is_no_number_is_refused_below_its_field_and_stays_there_to_be_corrected(
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
        ({"speed": "fast"}, "speed"),
        ({"noise": 0.0}, "noise"),
    ],
)
def test_texts_that_cannot_be_are_refused_by_their_parameter(said: dict[str, Any], parameter: str) -> None:
    with pytest.raises(InputError) as refused:
        plan_arguments(said)
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
    assert " mm (blue) to " in page._scale.content
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


def with_a_plan(studio: Studio, monkeypatch: pytest.MonkeyPatch, **fields: Any) -> PlanPage:
    """Let the page make a plan of a robot file and a constraints file."""
    window, folder = studio.window, studio.window.project.folder
    at_once(window, monkeypatch)
    (folder / "arm.yaml").write_text(robot_text(load_robot("irb120")))
    (folder / "room.yaml").write_text(_ROOM)
    window.edit(robot="arm.yaml", constraints="room.yaml", plan={"poses": "8", "candidates": 40, **fields})
    page = page_of(studio)
    act(page._run)
    assert "Written: plan" in page._said.content, said(studio)
    return page


def told(page: PlanPage) -> str:
    """Return what the first line of the page says of the plan that stands there."""
    assert page._other.visible is bool(page._other.content)
    assert page._other.order < page.fields.element("poses").order
    assert ("(other-settings)" in page._other.content) is page._other.visible
    return unescape(page._other.content)


def test_the_first_line_tells_what_is_not_as_the_plan_was_made_with(
    studio: Studio, serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    window, folder = studio.window, studio.window.project.folder
    assert told(page_of(studio)) == ""
    page = with_a_plan(studio, monkeypatch, noise=0.05)
    assert told(page) == ""
    window.edit(plan={"poses": "9", "candidates": 40, "no_floor": True}, payload="2.7kg,50mm,25mm,100mm")
    words = (
        "The plan in plan.csv was made with poses 8; noise 0.05; payload not said; no_floor not said. "
        "Chosen now: poses 9; noise 0.1; payload 2.7kg,50mm,25mm,100mm; no_floor yes. Picture, files and scene are of "
        "the plan as it was made: plan again to have it as chosen."
    )
    assert words in told(page)
    assert words in told(page_of(serving(folder)))  # what has seen nothing before says the same
    window._undo_edit()
    assert told(page) == ""
    window.edit(robot="irb120")
    assert "was made with robot arm.yaml. Chosen now: robot irb120." in told(page)
    (folder / "same.yaml").write_bytes((folder / "arm.yaml").read_bytes())
    window.edit(robot="same.yaml")
    assert told(page) == ""
    window.edit(robot="arm.yaml", constraints=None)
    assert "made with constraints room.yaml. Chosen now: constraints not said." in told(page)
    window.edit(constraints="room.yaml")
    (folder / "room.yaml").write_text(_ROOM.replace("-450", "-500"))
    (folder / "arm.yaml").unlink()
    page.refresh()
    assert "not as they were when the plan in plan.csv was made: robot arm.yaml, constraints room.yaml." in told(page)
    window.edit(robot="irb120", constraints=None, plan={"poses": "8", "candidates": 40, "noise": 0.05})
    act(page._run)
    assert told(page) == ""


def test_a_plan_of_other_measured_data_or_another_program_is_told(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    window, folder = studio.window, studio.window.project.folder
    page = with_a_plan(studio, monkeypatch, poses="20")
    (folder / "measured.csv").write_bytes((folder / "plan.csv").read_bytes())
    (folder / "part.src").write_text(_SRC)
    (folder / "part.dat").write_text(_DAT)
    fields = {"poses": "12", "candidates_from": "measured.csv", "accurate_at": "part.src", "out": "again.csv"}
    window.edit(plan=fields)
    act(page._run)
    assert told(page) == "", said(studio)
    window.edit(plan={**fields, "candidates": 77})  # none are drawn
    assert told(page) == ""
    (folder / "measured.csv").write_text((folder / "measured.csv").read_text().replace("\n1,", "\none,"))
    page.refresh()
    assert "not as they were when the plan in again.csv was made: candidates_from measured.csv." in told(page)
    (folder / "part.dat").write_text(_DAT.replace("X 400", "X 410"))
    page.refresh()
    assert "made: candidates_from measured.csv, accurate_at part.src." in told(page)


def test_a_plan_that_the_command_has_written_is_compared_as_well(
    studio: Studio, truearm: Truearm, monkeypatch: pytest.MonkeyPatch
) -> None:
    window, folder = studio.window, studio.window.project.folder
    (folder / "arm.yaml").write_text(robot_text(load_robot("irb120")))
    given = [folder / "arm.yaml", "--poses", 8, "--candidates", 40, "--noise", "0.10", "--model", "geometric"]
    found = truearm("plan", *given, "--out", folder / "plan.csv")
    assert found.code == 0, found.err
    window.edit(robot="arm.yaml", plan={"poses": "8", "candidates": 40})
    page = page_of(studio)
    assert told(page) == ""
    assert page._enough.place.visible
    assert "The plan in plan.csv was not made in this window: its report says" in page._said.content
    window.edit(plan={"poses": "8", "candidates": 41})
    assert "was made with candidates 40. Chosen now: candidates 41." in told(page)

    manifest, table = folder / "truearm.manifest.json", folder / "plan.csv"
    record, text = manifest.read_text(), table.read_text()
    content = json.loads(record)
    del content["sets"][0]["inputs"]
    content["sets"][0]["command"] = "truearm plan arm.yaml --poses 8 --candidates 41 --out PLAN"
    manifest.write_text(json.dumps(content))
    page.refresh()
    assert "Whether files are as they were, the record of plan.csv does not say: robot arm.yaml." in told(page)
    content["sets"][0]["command"] = "truearm plan arm.yaml --poses"
    manifest.write_text(json.dumps(content))
    page.refresh()
    assert "is not compared: it was written by truearm plan arm.yaml --poses." in told(page)
    manifest.write_text("{}")
    page.refresh()
    assert "cannot be compared: " in told(page)
    manifest.unlink()
    page.refresh()
    assert "What the plan in plan.csv was made with is not known: no record of it stands beside it." in told(page)
    manifest.write_text(record)
    table.write_text(text + "\n")
    page.refresh()
    assert "plan.csv was changed after it was written: its record tells of another plan." in told(page)
    plan("irb120", poses=8, candidates=40, out=folder / "plans" / "mine.csv")
    window.edit(robot="irb120", plan={"poses": "8", "candidates": 40, "out": "plans/mine.csv"})
    assert "is not compared: it was written by truearm.plan('irb120', poses=8, candidates=40" in told(page)


def test_picture_and_words_are_of_the_plan_that_stands_there(
    studio: Studio, serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = with_a_plan(studio, monkeypatch)
    window = studio.window
    assert page._enough.place.visible
    window.edit(plan={"poses": "8", "candidates": 40, "out": "other.csv"})
    assert told(page) == ""
    assert not page._enough.place.visible
    assert "no plan of this window yet" in page._said.content
    window.edit(plan={"poses": "8", "candidates": 40})
    assert "Written: plan.csv" in page._said.content
    assert page_of(serving(window.project.folder))._enough.place.visible


def test_a_device_has_as_many_candidates_as_are_said(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    page = with_a_plan(studio, monkeypatch, device="point", candidates=60, poses="20")
    assert "20 of 60 usable configurations" in page._said.content
    report = unescape((studio.window.project.folder / "plan.html").read_text())
    assert "--device point --candidates 60" in report
    assert "chosen by O1 from 60 usable ones of 60 candidates." in report


@pytest.mark.parametrize("parts", [("tools",), ("frames",), ("tools", "frames")])
def test_a_cell_file_is_given_for_what_it_has(
    parts: tuple[str, ...], studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    window, folder = studio.window, studio.window.project.folder
    at_once(window, monkeypatch)
    has = {
        "tools": "tools:\n  tProbe: {of: flange, translation: [0, 0, 125]}\n",
        "frames": "frames:\n  wobjPlate: {of: base, translation: [310, -110, 60]}\n",
    }
    head = "truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\n"
    (folder / "cell.yaml").write_text(head + "".join(has[part] for part in parts))
    (folder / "plate.mod").write_text(PLATE)
    window.edit(cell="cell.yaml", plan={"poses": "20", "candidates": 60, "accurate_at": "plate.mod"})
    page = page_of(studio)
    act(page._run)
    assert "at the 44 targets of plate.mod" in page._said.content, said(studio)
    page_text = unescape((folder / "plan.html").read_text())
    assert " ".join(f"--{part} cell.yaml" for part in parts) + " --candidates" in page_text
    assert told(page) == ""
    (folder / "cell.yaml").write_text("truearm: truearm-cell/1\nunits: {length: mm}\n")
    page.refresh()
    assert "cell.yaml" in told(page)
