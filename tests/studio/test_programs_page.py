"""The page Programs: a program in the scene, on the nominal robot and on the calibrated one."""

from __future__ import annotations

import re
import shlex
from dataclasses import replace
from html import unescape
from pathlib import Path
from shutil import copytree
from typing import Any

import numpy as np
import pytest
from tests import ur_controller as ur
from tests.commanding import Truearm
from tests.commanding import truearm as truearm
from tests.plate import PLATE
from tests.simulated import campaign
from tests.studio.conftest import Serving
from tests.studio.pressing import act, at_once, below, notices
from tests.studio.typing_in import typed

from truearm.calibration.calibrate import calibrate
from truearm.compensation.jobs import compensate
from truearm.engine.robot.library import load_robot
from truearm.robot_files.jobs import export, import_ur_kinematics
from truearm.studio.drawn_program import corrected_program
from truearm.studio.pages.jog import JogPage
from truearm.studio.pages.programs import ProgramsPage
from truearm.studio.pages.proof import ProofPage
from truearm.studio.window import Window


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the result of a calibration."""
    folder = tmp_path_factory.mktemp("calibrated") / "result"
    _, data = campaign("irb120", 24, 0.02e-3, 4)
    calibrate("irb120", data, model="offsets", out=folder)
    return folder


def project(place: Path) -> Path:
    """Make a project with a program, whose correction needs nothing more than a result."""
    folder = place / "project"
    folder.mkdir()
    (folder / "plate.mod").write_text(PLATE)
    (folder / "truearm-studio.yaml").write_text(
        "truearm: truearm-studio/1\nrobot: irb120\nprogram: plate.mod\ntaught: [none]\ncontroller_kinematics: nominal\n"
    )
    return folder


def programs(window: Window) -> ProgramsPage:
    """Return the page Programs."""
    (page,) = (page for page in window.pages if isinstance(page, ProgramsPage))
    return page


def test_a_program_is_drawn_before_and_after_its_correction(
    serving: Serving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, calibrated: Path
) -> None:
    folder = project(tmp_path)
    studio = serving(folder)
    window = studio.window
    page = programs(window)
    (jog,) = (page for page in window.pages if isinstance(page, JogPage))
    at_once(window, monkeypatch)
    space = page._space
    act(page._read)
    assert len(jog.scene._parts["program-targets"][0].points) == 44
    assert "as the controller takes it to be" in space._said.content
    assert jog.scene._parts["program-errors"] == []
    act(space._go)
    assert "no target is chosen" in notices(window)
    act(space._target, "pHole12, line 20")
    act(space._go)
    # The tool of the program is 125 mm long, and its frame stands at (310, -110, 60) mm.
    assert jog.jogging is not None
    position, rotation = load_robot("irb120").forward(jog.jogging.joints)
    assert position[0] + 0.125 * rotation[0][:, 2] == pytest.approx([0.47, 0.09, 0.06], abs=1e-6)
    assert jog.scene._parts["program-chosen"][0].points[0] == pytest.approx([0.47, 0.09, 0.06], abs=1e-6)

    copytree(calibrated, folder / "result")
    window.edit(robot="gp25")
    act(page._run)
    assert "the result is of another robot than the one that is chosen; got &#x27;irb120&#x27;" in notices(window)
    (proof,) = (page for page in window.pages if isinstance(page, ProofPage))
    assert "This result is of the robot irb120, and gp25 is chosen" in proof._now.content
    window.edit(robot="irb120")
    assert "This result is of the robot" not in proof._now.content
    typed(studio, page._accept, "nonsense, maker")
    assert window.project.settings.accept == ("nonsense", "maker")
    act(page._run)
    assert "accept: there is no status or notice of this name" in notices(window)
    typed(studio, page._accept, "")
    assert window.project.settings.accept is None
    act(page._run)
    made = compensate(
        folder / "result/calibrated.yaml", [folder / "plate.mod"], taught=["none"], controller_kinematics="nominal"
    )
    correction = made.result.corrections[0]
    drawn = space._drawn
    assert drawn is not None
    kept = ~correction.corrected
    assert np.isnan(drawn.between(0.0)[kept]).all()
    before, after = (np.linalg.norm(drawn.between(share)[~kept], axis=1) for share in (0.0, 1.0))
    # What is corrected is what was wrong, but for the corrections of the corrections.
    assert before == pytest.approx(correction.moved[~kept], rel=0.05, abs=1e-5)
    assert after.max() < 2e-6
    assert f"largest {before.max() * 1e3:.3g} mm" in jog.scene._parts["program-errors"][1].text
    figures = re.findall(r"([0-9.]+) mm on average, ([0-9.]+) at most", space._said.content)
    assert figures[0] == (f"{before.mean() * 1e3:.3f}", f"{before.max() * 1e3:.3f}")
    act(space._share, 1.0)
    assert f"largest {after.max() * 1e3:.3g} mm" in jog.scene._parts["program-errors"][1].text
    act(space._target, "pHole12, line 20")
    act(space._of, "corrected program")
    act(space._go)
    row = drawn.names.index("pHole12, line 20")
    assert jog.jogging.joints == pytest.approx(correction.joints[row], abs=1e-5)
    space.take(replace(drawn, meant=np.full_like(drawn.meant, np.nan)))
    assert "No target was corrected." in space._said.content
    assert jog.scene._parts["program-errors"] == []
    window.edit(program=None)
    assert not space.place.visible
    assert all(jog.scene._parts[name] == [] for name in ("program-way", "program-targets", "program-errors"))


_TOOL = """\
truearm: truearm-cell/1
units: {length: mm, angle: deg}
tools:
  tProbe: {of: flange, translation: [0, 0, 125]}
"""


def other_result(folder: Path) -> None:
    """Write the result of another calibration of the same robot."""
    _, data = campaign("irb120", 24, 0.02e-3, 5)
    calibrate("irb120", data, model="offsets", out=folder / "result")


def test_a_correction_is_of_the_project_as_it_is_now_or_is_not_handed_out(
    serving: Serving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, calibrated: Path
) -> None:
    folder = project(tmp_path)
    copytree(calibrated, folder / "result")
    (folder / "cell.yaml").write_text(_TOOL)
    (folder / "other.mod").write_text((folder / "plate.mod").read_text().replace("plate", "other"))
    window = serving(folder).window
    page, sent = programs(window), list[str]()
    at_once(window, monkeypatch)
    monkeypatch.setattr(window, "download", lambda path: sent.append(path.name))

    def is_current() -> None:
        assert page._downloads.visible
        assert page._stands.content == ""

    def is_of_another_state(what: str) -> None:
        """The page that stands, and one that has seen nothing before, say so, show nothing and hand nothing out."""
        anew = ProgramsPage(window)
        anew.refresh()
        for one in (page, anew):
            assert not one._downloads.visible
            assert "(other-program)" in one._stands.content
            assert f"Changed since: {what}. It is not handed out: correct the program again." in one._stands.content
            assert one._said.content == ""
            assert not one._space.place.visible
        act(page._downloads, "plate.mod")
        assert sent == []
        assert f"changed since: {what}. Correct it again." in notices(window)

    assert not page._downloads.visible
    act(page._run)
    is_current()
    assert "44 targets" in page._said.content
    for name in ("plate.mod", "report"):
        act(page._downloads, name)
    assert sent == ["plate.mod", "compensation.html"]
    sent.clear()
    opened = programs(serving(folder).window)
    assert opened._downloads.visible
    assert opened._stands.content == ""

    for changes, what in (
        ({"taught": ["tools"]}, "what was taught"),
        ({"controller_kinematics": "proprietary"}, "what the controller has"),
        ({"cell": "cell.yaml"}, "tools and frames"),
        ({"robot": "gp25"}, "the robot, irb120 then"),
    ):
        window.edit(**changes)
        is_of_another_state(what)
        window.project.undo()
        window.refresh()
        is_current()
        assert page._said.content == ""  # what was said of it is not known any more

    window.edit(program="other.mod")
    assert not page._downloads.visible
    assert page._stands.content == ""
    act(page._run)
    is_current()
    window.edit(program="plate.mod")
    assert page._downloads.visible
    act(page._downloads, "report")
    assert "the report in this folder is of another correction" in notices(window)
    assert sent == []

    act(page._run)
    text = (folder / "plate.mod").read_text()
    changed: dict[str, tuple[Any, str]] = {
        "the program": (lambda: (folder / "plate.mod").write_text(text.replace("125", "126")), text),
        "the corrected program": (
            lambda: (folder / "result/corrected/plate.mod").write_text(text),
            (folder / "result/corrected/plate.mod").read_text(),
        ),
    }
    for what, (change, before) in changed.items():
        change()
        sent.clear()
        act(page._downloads, "plate.mod")  # also where the page has not been shown anew since
        assert sent == []
        window.refresh()
        is_of_another_state(what)
        (folder / ("plate.mod" if what == "the program" else "result/corrected/plate.mod")).write_text(before)
        window.refresh()
        is_current()
    other_result(folder)
    window.refresh()
    is_of_another_state("the result")
    act(page._run)
    is_current()


def test_a_correction_that_is_refused_leaves_nothing_of_the_one_before(
    serving: Serving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, calibrated: Path
) -> None:
    folder = project(tmp_path)
    copytree(calibrated, folder / "result")
    (folder / "cell.yaml").write_text(_TOOL)
    window = serving(folder).window
    page = programs(window)
    at_once(window, monkeypatch)
    window.edit(cell="cell.yaml")
    act(page._run)
    assert "44 targets" in page._said.content
    assert page._stands.content == ""
    report = (folder / "result/corrected/compensation.html").read_text()
    assert " --tools cell.yaml " in report
    (folder / "cell.yaml").write_text(_TOOL.replace("tProbe", "tOther"))
    act(page._run)
    assert "tother" in notices(window)
    window.refresh()  # as after every long action
    assert page._said.content == ""
    assert not page._space.place.visible
    assert not page._downloads.visible
    assert "Changed since: tools and frames." in page._stands.content


def test_the_files_of_a_controllers_kinematics_are_offered_and_taken(
    serving: Serving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = project(tmp_path)
    (folder / "calibration.conf").write_text(ur.UR10_CONF)
    own = import_ur_kinematics(folder / "calibration.conf", "ur10", out=tmp_path / "own.yaml").robot
    export(own, "ur-kinematics", out=folder / "driver.yaml")
    (folder / "cell.yaml").write_text(_TOOL)
    (folder / "part.script").write_text(
        "def part():\n  set_tcp(p[0,0,0.1,0,0,0])\n  movel(p[0.6, 0.1, 0.3, 3.141593, 0, 0])\n"
        "  movel(p[0.7, 0.2, 0.3, 3.141593, 0, 0])\nend\n"
    )
    _, data = campaign(str(tmp_path / "own.yaml"), 40, 0.02e-3, 4)
    calibrate("ur10", data, out=folder / "result")
    window = serving(folder).window
    page = programs(window)
    at_once(window, monkeypatch)
    window.edit(robot="ur10", program="part.script", controller_kinematics=None)
    assert page._kinematics.options[-2:] == ("calibration.conf", "driver.yaml")
    assert {"points", "tools, frames"} <= {*page._taught.options}  # as a notice tells to answer
    act(page._run)
    assert "calibration.conf" in notices(window)
    assert page._said.content == ""
    act(page._kinematics, "calibration.conf")
    act(page._run)
    assert "2 targets: 2 corrected" in page._said.content
    assert page._stands.content == ""
    (folder / "calibration.conf").write_text(ur.UR10_CONF + "# edited\n")
    window.refresh()
    assert "Changed since: what the controller has." in page._stands.content


@pytest.mark.parametrize("parts", [("tools",), ("frames",), ("tools", "frames")])
def test_the_command_that_the_report_names_does_the_same(
    parts: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, calibrated: Path, truearm: Truearm
) -> None:
    folder = project(tmp_path)
    copytree(calibrated, folder / "result")
    frame = "frames:\n  wobjPlate: {of: base, translation: [310, -110, 60]}\n"
    head, _, tool = _TOOL.partition("tools:")
    text = head + f"tools:{tool}" * ("tools" in parts) + frame * ("frames" in parts)
    (folder / "cell.yaml").write_text(text)
    monkeypatch.chdir(folder)
    corrected_program(
        folder,
        "result/calibrated.yaml",
        "plate.mod",
        "studio",
        "cell.yaml",
        "0,0,-20,0,0,1.5",
        "tool",
        ["none"],
        "nominal",
        ["maker", "not-better-here"],
        "95mm,3deg",
        print,
    )
    found = re.search(
        r"truearm (compensate result/calibrated.yaml plate.mod .*) --out DIR",
        unescape((folder / "studio/compensation.html").read_text()),
    )
    assert found is not None
    run = truearm(*shlex.split(found[1]), "--out", "command")
    assert run.code == 0, run.err
    for name in ("plate.mod", "plate.mod.truearm.json", "compensation.html"):
        assert (folder / "command" / name).read_bytes() == (folder / "studio" / name).read_bytes()


_WRENCHES = """\
truearm: truearm-cell/1
units: {length: mm, angle: deg, force: N, moment: N m}
wrenches:
  - {targets: ["pHole*"], force: [0, 0, -20], moment: [0, 0, 1.5], frame: tool}
"""


def test_the_process_force_is_kept_given_and_compared(
    serving: Serving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, calibrated: Path
) -> None:
    monkeypatch.setattr("truearm.studio.typing_at_rest._REST", 0.01)  # nobody types here
    folder = project(tmp_path)
    copytree(calibrated, folder / "result")
    (folder / "forces.yaml").write_text(_WRENCHES)
    (folder / "cell.yaml").write_text(_TOOL)
    studio = serving(folder)
    window = studio.window
    page = programs(window)
    at_once(window, monkeypatch)
    force, axes = page.force.element("wrench"), page.force.element("wrench_frame")

    def is_of_the_command(words: str) -> None:
        act(page._run)
        assert "44 targets" in page._said.content, notices(window)
        assert page._stands.content == ""
        shown = unescape((folder / "result/corrected/compensation.html").read_text())
        command = next(line for line in shown.splitlines() if "<pre>truearm compensate" in line)
        assert all(part in command for part in re.split(r" (?=--)", words)), command
        assert programs(serving(folder).window)._stands.content == ""

    act(axes, "tool")  # says nothing by itself, as there are no numbers
    is_of_the_command(
        "truearm compensate result/calibrated.yaml plate.mod --taught none --controller-kinematics nominal"
    )
    typed(studio, force, "0,0,-20,0,0,1.5")
    assert (window.project.settings.wrench, window.project.settings.wrench_frame) == ("0,0,-20,0,0,1.5", "tool")
    assert "Changed since: the process force." in page._stands.content
    is_of_the_command("plate.mod --wrench 0,0,-20,0,0,1.5 --wrench-frame tool --controller-kinematics nominal")
    window.edit(wrench="0 N, 0 N, -20 N, 0, 0, 1.5 Nm")
    assert page._stands.content == ""
    window.edit(wrench_frame=None)
    assert "Changed since: the process force." in page._stands.content
    typed(studio, force, "forces.yaml")
    is_of_the_command("plate.mod --wrench forces.yaml --controller-kinematics nominal")
    (folder / "forces.yaml").write_text(_WRENCHES.replace("-20", "-25"))
    window.refresh()
    assert "Changed since: the process force." in page._stands.content
    for text, words in (
        ("0,0,80", "three forces and three moments belong here"),
        ("0,0,80kg,0,0,0", "this is no unit of a force"),
        ("cell.yaml", "the file has no wrenches"),
        ("missing.yaml", "missing.yaml"),
        ("../forces.yaml", "no place in the project"),
    ):
        typed(studio, force, text)
        assert words in below(window, force)
        assert window.project.settings.wrench == "forces.yaml"
    typed(studio, force, "")
    assert window.project.settings.wrench is None


_SRC = "DEF part ( )\n  LIN XP1\n  LIN XP2\nEND\n"
_DAT = """\
DEFDAT part
  DECL E6POS XP1={X 900.0,Y 0.0,Z 900.0,A 0.0,B 90.0,C 0.0}
  DECL E6POS XP2={X 900.0,Y 50.0,Z 900.0,A 0.0,B 90.0,C 0.0}
ENDDAT
"""


def test_all_files_of_a_corrected_program_are_handed_out(
    serving: Serving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = project(tmp_path)
    (folder / "part.src").write_text(_SRC)
    (folder / "part.dat").write_text(_DAT)
    _, data = campaign("kr5", 40, 0.02e-3, 4)
    calibrate("kr5", data, model="offsets", out=folder / "result")
    window = serving(folder).window
    page, sent = programs(window), list[str]()
    at_once(window, monkeypatch)
    monkeypatch.setattr(window, "download", lambda path: sent.append(path.read_text()))
    window.edit(robot="kr5", program="part.src")
    act(page._run)
    assert page._stands.content == "", notices(window)
    assert page._downloads.options == ("part.src", "part.dat", "report"), notices(window)
    for name in page._downloads.options[:2]:
        act(page._downloads, name)
    assert sent == [(folder / "result/corrected" / name).read_text() for name in ("part.src", "part.dat")]
    assert sent[0] == _SRC
    assert sent[1] != _DAT  # the numbers of the points are there
    (folder / "part.dat").write_text(_DAT.replace("50.0", "60.0"))
    window.refresh()
    assert "Changed since: the program." in page._stands.content
    act(page._downloads, "part.src")
    assert len(sent) == 2
    window.edit(robot="irb120", program="plate.mod")
    assert not page._downloads.visible
