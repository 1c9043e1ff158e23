"""The main job on a digital twin."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.compensation.jobs import compensate
from truearm.compensation.program_correction import commanded
from truearm.compensation.result import REPORT, ProgramCorrection, SimulatedRun
from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists, read_bytes
from truearm.engine.base.writing import write_files
from truearm.engine.command.arguments import folder_for
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.document.document import Block, Words, detail, say, under
from truearm.engine.document.records import Record
from truearm.engine.fit.fit import Status
from truearm.engine.programs.gauge import best_agreement
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.transform import Transform
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import PERFECT

if TYPE_CHECKING:
    from truearm.starting.jobs import Demonstrate


@dataclass(frozen=True, eq=False, repr=False)
class Demonstration(Record):
    """A calibration, and a program corrected with it."""

    folder: Path  #: Where data and results are.
    calibration: Calibration  #: Of a digital twin.
    correction: ProgramCorrection | None  #: Of a program; None if the fit did not converge.

    @property
    def corrected_folder(self) -> Path:
        """Where the corrected program is."""
        return self.folder / "corrected"

    @property
    def finished(self) -> bool:
        """Whether the calibration can be used as it is."""
        return self.calibration.finished

    def blocks(self) -> Iterator[Block]:
        """Give both results, and where their reports are."""
        mark, dangers, errors, *rest = self.calibration.everything()
        further = (replace(block, is_detail=True) if isinstance(block, Words) else block for block in rest)
        yield under("calibration", [mark, dangers, errors, *further])
        if self.correction is None:
            yield say(correction=None)
        else:
            yield under("correction", self.correction.everything())
            yield detail(f"The corrected program is in {self.corrected_folder}, with a report of its own, {REPORT}.")

    def written_at(self, out: str) -> str:
        """Return the line that says where the report is."""
        return f"The report is {Path(out) / 'report.html'}; open it in a browser."


#: The program that is corrected, and where its work object is in the controller's base: the numbers it has itself.
_PLATE: Final = "plate.mod"
#: Readings of the plate's place that the tracker averages: what is left of their noise shifts the whole program.
_PLATE_READINGS: Final = 100
_PLATE_FRAME: Final = Transform((0.31, -0.11, 0.06))
#: Lowest and highest joint positions [deg] that the thesis measures at (section 2.5), within the robot's limits.
_REGION: Final = ((-90, 0, -80, -150, -90, -180), (90, 110, 70, 150, 90, 180))


def demonstrated(asked: Demonstrate) -> Demonstration:
    """Calibrate a digital twin of an IRB 120 and correct a program with it."""
    folder = folder_for((), asked.out)
    rng = np.random.default_rng(20240)
    robot = load_robot("irb120")
    twin = truth_twin(robot, "tracker-triangular", rng)
    gears = {2: ((240, math.radians(0.01), 0.4),), 3: ((200, math.radians(0.01), 1.9),)}
    geared = {number: replace(twin.joints.get(number, PERFECT), gear=gear) for number, gear in gears.items()}
    twin = replace(twin, joints={**twin.joints, **geared})
    asked.progress("measuring the twin with a simulated laser tracker")
    low, high = np.radians(_REGION)
    data = measure(twin, rng.uniform(low, high, (200, 6)), 0.03e-3, rng)
    path = folder / "measurements.csv"
    text = csv_text(data)
    plate = (files("truearm.starting.examples") / _PLATE).read_text("utf-8")
    for name, content in ((path.name, text), (_PLATE, plate)):
        if exists(folder / name) and read_bytes(folder / name) != content.encode():
            raise InputError(
                "this is another file of that name, and it is not overwritten",
                parameter="out",
                where=str(folder / name),
                cure="Choose another `out`.",
            )
    write_files(folder, {path.name: text, _PLATE: plate})
    calibration = calibrate("irb120", path, out=folder, payload=twin.robot.payload, progress=asked.progress)
    shown = Demonstration(folder, calibration, None)
    if calibration.status is not Status.CONVERGED:
        return shown
    correction = _corrected_plate(calibration, twin, folder, rng, asked.progress)
    correction.save(shown.corrected_folder, asked.progress)
    return replace(shown, correction=correction)


def _corrected_plate(
    calibration: Calibration, twin: Twin, folder: Path, rng: np.random.Generator, progress: Callable[[str], None]
) -> ProgramCorrection:
    """Correct a program for a plate that the tracker measured, and send the twin there with both programs."""
    # The thesis counts the height of axis 1 to the base: the base plate is where the nominal robot agrees best.
    place = twin.robot.base.matrix @ best_agreement(twin.robot)[0] @ _PLATE_FRAME.matrix
    read = place[:3, 3] + rng.normal(0.0, 0.03e-3, (_PLATE_READINGS, 3))
    x, y, z = (f"{1e3 * v:.3f}" for v in read.mean(axis=0))
    quaternion = ", ".join(f"{v:.7f}" for v in Transform.from_matrix(place[:3, :3], place[:3, 3]).quaternion)
    cell = folder / "cell.yaml"
    write_files(folder, {cell.name: _CELL.format(place=f"{x}, {y}, {z}", quaternion=quaternion)})
    correction = compensate(
        folder / "calibrated.yaml",
        [folder / _PLATE],
        tools=cell,
        frames=cell,
        taught=["none"],
        controller_kinematics="nominal",  # so does the twin's
        progress=progress,
    )
    progress("running the program on the twin")
    before, after = correction.result.corrections[0].program, correction.as_written()[0]
    poses = [row for row, target in enumerate(before.targets) if target.form.kind == "pose"]
    wanted = (place @ correction.result.corrections[0].before)[poses, :3, 3]
    missed = []
    for program in (before, after):
        joints = commanded(calibration.robot, program)[poses]
        missed.append(np.linalg.norm(twin.frames(joints)["1"][:, :3, 3] - wanted, axis=1))
    simulated = SimulatedRun(missed[0], missed[1], "the digital twin in place of the real robot")
    return replace(correction, simulated=simulated)


_CELL: Final = """\
# Where the plate and the tip of the probe really are: the tracker has seen the plate, and the tip is target 1.
truearm: truearm-cell/1
units: {{length: mm, angle: deg}}
tools:
  tProbe: {{of: flange, target: "1"}}
frames:
  wobjPlate: {{of: world, translation: [{place}], quaternion: [{quaternion}]}}
"""
