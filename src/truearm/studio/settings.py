"""What the file of a project says: which files of the folder are meant, and with which settings."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from truearm.calibration.calibrate import Calibrate
from truearm.engine.robot.wrench import WrenchFrame
from truearm.iso9283.jobs import EvaluateTests
from truearm.studio.measure_fields import MeasureFields
from truearm.studio.plan_fields import PlanFields

_Name = Annotated[str, Field(min_length=1)]
_Above0 = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class TestedFiles(BaseModel):
    """Of a project: the tests by ISO 9283."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    #: plan, poses, paths, settling, forces, alignment, compare: files, as for :func:`truearm.iso9283_evaluate`.
    plan: _Name | None = None
    poses: _Name | None = None
    paths: _Name | None = None
    settling: _Name | None = None
    forces: _Name | None = None
    alignment: _Name | None = None
    compare: _Name | None = None
    #: noise_mm, noise_rot_deg: of the instrument.
    noise_mm: _Above0 = float(EvaluateTests.typed_default("noise"))
    noise_rot_deg: _Above0 = float(EvaluateTests.typed_default("noise_rot"))
    result: _Name = "iso9283/result"  #: Folder of the evaluation.


class Settings(BaseModel):
    """Schema ``truearm-studio/1``: what the studio's pages say."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    truearm: Literal["truearm-studio/1"] = "truearm-studio/1"
    robot: _Name = "irb120"  #: A library id, or a file of the folder.
    data: _Name | None = None  #: File of measurements; None for none yet.
    exclude: _Name | None = None  #: File of readings that are excluded; None for none.
    payload: _Name | None = None  #: What the robot carried, as a text such as ``2.7kg,50mm,25mm,100mm``.
    model: _Name | None = None  #: model, train, loss, seed: as for :func:`truearm.calibrate`.
    train: Annotated[int, Field(strict=True, ge=1)] | Literal["all"] | None = None
    seed: Annotated[int, Field(strict=True, ge=0)] = Calibrate.default("seed")
    loss: _Name = Calibrate.default("loss")
    result: _Name = "result"  #: Folder of the calibration's results, in the project's.
    program: _Name | None = None  #: File of a robot program.
    cell: _Name | None = None  #: File that says where tools and frames are; None for what the program says.
    #: wrench, wrench_frame: what acts on the tool, six numbers or a file, and in whose axes, as for
    #: :func:`truearm.compensate`.
    wrench: _Name | None = None
    wrench_frame: WrenchFrame | None = None
    taught: tuple[_Name, ...] | None = None  #: As for :func:`truearm.compensate`; None if that was not said.
    controller_kinematics: _Name | None = None  #: Likewise.
    #: Names of what may speak against the calibration or a correction, likewise.
    accept: tuple[_Name, ...] | None = None
    #: How far targets may be moved and turned, likewise; None for what the robot's errors explain.
    accept_correction: _Name | None = None
    corrected: _Name = "result/corrected"  #: Folder of the corrected program.
    #: File of boxes to keep clear of and of what else a configuration must keep; None for none.
    constraints: _Name | None = None
    path: _Name | None = None  #: File of a path that the arm follows in the scene; None for none yet.
    meshes: _Name | None = None  #: URDF whose meshes show the robot; None for the robot's own, if it is one.
    plan: PlanFields = PlanFields()  #: What the page Plan says.
    measure: MeasureFields = MeasureFields()  #: What the page Measure says.
    performance: TestedFiles = TestedFiles()  #: Files of tests by ISO 9283.
    dark: bool = False  #: Whether the window is dark.

    @property
    def wrench_file(self) -> str | None:
        """The file that says what acts on the tool; None where numbers say it, or nothing does."""
        named = self.wrench is not None and self.wrench.lower().endswith((".yaml", ".yml"))
        return self.wrench if named else None

    @property
    def wrench_axes(self) -> WrenchFrame | None:
        """The frame of `wrench` as the job takes it: none without numbers, as a file says its own."""
        return None if self.wrench is None or self.wrench_file is not None else self.wrench_frame

    def text(self) -> str:
        """Return the file."""
        from ruamel.yaml import YAML
        from ruamel.yaml.compat import StringIO

        stream, yaml = StringIO(), YAML()
        yaml.default_flow_style = False
        yaml.dump(self.model_dump(mode="json", exclude_none=True), stream)
        return str(stream.getvalue())
