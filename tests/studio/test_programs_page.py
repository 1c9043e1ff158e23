"""The page Programs: a program in the scene, on the nominal robot and on the calibrated one."""

from __future__ import annotations

import re
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from tests.simulated import campaign
from tests.studio.conftest import Serving
from tests.studio.pressing import act, at_once, notices

from truearm.jobs.calibrate import calibrate
from truearm.jobs.compensate import compensate
from truearm.library import load_robot
from truearm.studio.pages.jog import JogPage
from truearm.studio.pages.programs import ProgramsPage
from truearm.studio.pages.proof import ProofPage


def test_a_program_is_drawn_before_and_after_its_correction(
    serving: Serving, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "project"
    folder.mkdir()
    (folder / "plate.mod").write_text((files("truearm.examples") / "plate.mod").read_text("utf-8"))
    (folder / "truearm-studio.yaml").write_text(
        "truearm: truearm-studio/1\nrobot: irb120\nprogram: plate.mod\ntaught: [none]\ncontroller_kinematics: nominal\n"
    )
    window = serving(folder).window
    (page,) = (page for page in window.pages if isinstance(page, ProgramsPage))
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

    _, data = campaign("irb120", 24, 0.02e-3, 4)
    calibrate("irb120", data, model="offsets", out=folder / "result")
    window.edit(robot="gp25")
    act(page._run)
    assert "the result is of another robot than the one that is chosen; got &#x27;irb120&#x27;" in notices(window)
    (proof,) = (page for page in window.pages if isinstance(page, ProofPage))
    assert "This result is of the robot irb120, and gp25 is chosen" in proof._notices.content
    window.edit(robot="irb120")
    assert "This result is of the robot" not in proof._notices.content
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
