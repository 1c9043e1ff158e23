"""A program is not corrected twice, however it is disguised; originals, and what shares targets with them, are."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from tests.answered import compensate
from tests.plate import PLATE
from tests.simulated import campaign, more_of

import truearm
from truearm.compensation.program_correction import commanded, corrected_programs
from truearm.compensation.result import ProgramCorrection
from truearm.engine.base.errors import InputError
from truearm.engine.programs.cell import Cell, read_frames, read_tools
from truearm.engine.programs.corrected_targets import LEDGER
from truearm.engine.programs.gauge import best_agreement
from truearm.engine.programs.program import MARK, Program, Source
from truearm.engine.programs.program_files import edited
from truearm.engine.programs.rapid import RAPID
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.twin import Twin

NOISE = 2e-5
CELL = """\
truearm: truearm-cell/1
units: {{length: mm, angle: deg}}
tools: {{tProbe: {{of: flange, target: "1"}}}}
frames: {{wobjPlate: {{of: world, translation: [{place}], quaternion: [{turned}]}}}}
"""


@dataclass(frozen=True)
class Workshop:
    """A twin, calibrated twice, and a program for it that was corrected with the first calibration."""

    folder: Path
    twin: Twin
    place: np.ndarray

    def compensated(self, program: Path, out: str | None = None, result: str = "first", **more: object) -> object:
        given = {"tools": self.folder / "cell.yaml", "frames": self.folder / "cell.yaml", "taught": ["none"]} | more
        robot = self.folder / result / "calibrated.yaml"
        return compensate(robot, [program], out=None if out is None else self.folder / out, **given)  # type: ignore[arg-type]

    def missed(self, program: Program) -> float:
        """Return how far the tip of the twin is from where the original meant it to be, on average [mm]."""
        meant = (self.place @ truearm_poses(self.original))[:, :3, 3]
        robot = truearm.load_robot(self.folder / "first" / "calibrated.yaml")
        tips = self.twin.frames(commanded(robot, program))["1"][:, :3, 3]
        poses = [row for row, target in enumerate(self.original.targets) if target.form.kind == "pose"]
        return float(np.linalg.norm(tips - meant, axis=1)[poses].mean() * 1e3)

    @property
    def original(self) -> Program:
        return read(self.folder / "plate.mod")


def read(path: Path) -> Program:
    return RAPID.read([Source(path, path.read_text())])


def truearm_poses(program: Program) -> np.ndarray:
    """Return where the tips shall be in the work object."""
    return corrected_programs(calibrated_once(), [program], Cell({}, {})).corrections[0].before


def calibrated_once() -> truearm.Robot:
    return truearm.load_robot("irb120").with_values({"a_3": 0.2708})


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    folder = tmp_path_factory.mktemp("workshop") / "cell"
    folder.mkdir()
    twin, data = campaign("irb120", 60, NOISE, 3)
    for name, readings in (("first", data), ("second", more_of(twin, 60, NOISE, 4))):
        truearm.calibrate("irb120", readings, out=folder / name, model="geometric")
    (folder / "plate.mod").write_text(PLATE)
    place = (
        twin.robot.base.matrix @ best_agreement(twin.robot)[0] @ read(folder / "plate.mod").frames["wobjPlate"].matrix
    )
    x, y, z = 1e3 * place[:3, 3]
    turned = ", ".join(f"{v:.9f}" for v in Transform.from_matrix(place[:3, :3], place[:3, 3]).quaternion)
    (folder / "cell.yaml").write_text(CELL.format(place=f"{x:.6f}, {y:.6f}, {z:.6f}", turned=turned))
    made = Workshop(folder, twin, place)
    made.compensated(folder / "plate.mod", "corrected")
    return made


def without_comment(text: str) -> str:
    lines = text.splitlines(keepends=True)
    first = next(number for number, line in enumerate(lines) if MARK in line)
    behind = first + 3 + ("SIMULATED" in lines[first + 3])
    assert all(line.lstrip().startswith("!") for line in lines[first:behind])
    return "".join(lines[:first] + lines[behind:])


def with_a_line(text: str) -> str:
    return text.replace("  PROC main()", "  ! looked at\n  PROC main()").replace("v100", "v50")


def reformatted(text: str) -> str:
    """Return it as a controller might store it: other decimals, quaternions with the other sign, other line ends."""

    def position(found: re.Match[str]) -> str:
        return ":=[[" + ", ".join(f"{float(v) + 2e-5:.5f}" for v in found[1].split(",")) + "],"

    return re.sub(r":=\[\[([^\]]*)\],", position, text).replace("\n", "\r\n")


def some_targets(text: str) -> str:
    """Return it as another program that has taken two of its targets over: the rest are the original ones."""
    original = PLATE
    for name in ("pHole3", "pHole7"):
        taken = re.search(rf"{name}:=(.*);", text)
        assert taken is not None
        original = re.sub(rf"{name}:=.*;", f"{name}:={taken[1]};", original)
    return original


def plain(text: str) -> str:
    return text


DISGUISES: list[tuple[str, str, Callable[[str], str]]] = [
    ("where it was written", "corrected/plate.mod", plain),
    ("another name", "corrected/copy.mod", plain),
    ("another folder", "elsewhere/plate.mod", plain),
    ("another name and folder", "elsewhere/copy.mod", plain),
    ("without its comment", "corrected/copy.mod", without_comment),
    ("without its comment, elsewhere", "elsewhere/copy.mod", without_comment),
    ("with a line and another speed", "elsewhere/copy.mod", lambda text: with_a_line(without_comment(text))),
    ("reformatted", "elsewhere/copy.mod", lambda text: reformatted(without_comment(text))),
    ("all at once", "far/away/copy.modx", lambda text: reformatted(with_a_line(without_comment(text)))),
    ("some targets in another program", "elsewhere/copy.mod", lambda text: some_targets(without_comment(text))),
]


@pytest.mark.parametrize("result", ["first", "second"])
@pytest.mark.parametrize(("place", "disguise"), [one[1:] for one in DISGUISES], ids=[one[0] for one in DISGUISES])
def test_a_corrected_program_is_refused(
    workshop: Workshop, tmp_path: Path, place: str, disguise: Callable[[str], str], result: str
) -> None:
    """With the calibration that it was corrected with, and with another one of the same robot."""
    folder = shutil.copytree(workshop.folder, tmp_path / "cell")
    copied = Workshop(folder, workshop.twin, workshop.place)
    program = folder / place
    program.parent.mkdir(parents=True, exist_ok=True)
    program.write_bytes(disguise((folder / "corrected" / "plate.mod").read_text()).encode())
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with pytest.raises(InputError, match="this program was corrected already") as refusal:
        copied.compensated(program, "twice", result)
    assert refusal.value.parameter == "programs"
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_what_would_come_of_it(workshop: Workshop) -> None:
    """Corrected once the twin is right; corrected twice, it would be as wrong as before, to the other side."""
    once = read(workshop.folder / "corrected" / "plate.mod")
    robot = truearm.load_robot(workshop.folder / "first" / "calibrated.yaml")
    file = workshop.folder / "cell.yaml"
    again = corrected_programs(robot, [once], Cell(read_tools(robot, file), read_frames(robot, file))).corrections[0]
    twice = RAPID.read([Source(Path("twice.mod"), edited(once.sources[0].text, again.edits))])
    original, corrected, worse = (workshop.missed(one) for one in (workshop.original, once, twice))
    assert corrected < 0.15 * original
    assert worse > 0.8 * original


# -- and what is not


def test_the_original_is_corrected_again_and_with_another_calibration(workshop: Workshop, tmp_path: Path) -> None:
    folder = shutil.copytree(workshop.folder, tmp_path / "cell")
    copied = Workshop(folder, workshop.twin, workshop.place)
    ledger = (folder / "first" / LEDGER).read_bytes()
    for out, result in (("corrected", "first"), ("other", "first"), ("other", "second"), ("anew", "second")):
        assert copied.compensated(folder / "plate.mod", out, result).files[0].corrected == 43  # type: ignore[attr-defined]
    assert (folder / "first" / LEDGER).read_bytes() == ledger  # what it knows already is not written again
    copied.compensated(folder / "corrected" / "plate.mod", "again", "second", again=True)
    truearm.revert([folder / "corrected" / "plate.mod"], out=folder / "back")
    assert (folder / "back" / "plate.mod").read_bytes() == (folder / "plate.mod").read_bytes()
    copied.compensated(folder / "back" / "plate.mod", "once more")


def test_another_program_that_shares_targets_is_corrected(workshop: Workshop, tmp_path: Path) -> None:
    """Its home is the same, which is given by joints, and so are its holes."""
    folder = shutil.copytree(workshop.folder, tmp_path / "cell")
    other = folder / "corrected" / "other.mod"
    text = (folder / "plate.mod").read_text()
    other.write_text(re.sub(r"pHole[1-6]:=\[\[(\d+)", lambda found: found[0][:-1] + "5", text))
    assert other.read_text() != text
    Workshop(folder, workshop.twin, workshop.place).compensated(other, "others")


def test_targets_that_stay_are_no_evidence(workshop: Workshop, tmp_path: Path) -> None:
    """Of a program nothing is corrected; it carries no comment, and is given again under another name."""
    folder = shutil.copytree(workshop.folder, tmp_path / "cell")
    copied = Workshop(folder, workshop.twin, workshop.place)
    made = copied.compensated(folder / "plate.mod", "still", keep=["p*"], taught=["points"])
    assert isinstance(made, ProgramCorrection)
    copied.compensated(folder / "plate.mod", "kept", only=["pHole1"])
    kept = (folder / "kept" / "plate.mod").read_text()
    assert MARK in kept
    other = folder / "elsewhere.mod"
    other.write_text(without_comment(kept))
    copied.compensated(other, "the rest", keep=["pHole1"])
    with pytest.raises(InputError, match=r"elsewhere\.mod, line 9: this program was corrected already"):
        copied.compensated(other, "twice")
