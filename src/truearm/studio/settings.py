"""What the file of a project says: which files of the folder are meant, and with which settings."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from truearm.modeling.wrench import WrenchFrame
from truearm.studio.measure_fields import MeasureFields
from truearm.studio.plan_fields import PlanFields

_Name = Annotated[str, Field(min_length=1)]


class TestedFiles(BaseModel):
    """Of a project: the tests by ISO 9283.

    Attributes
    ----------
    plan, poses, paths, settling, forces, alignment, compare
        Files, as for :func:`truearm.iso9283_evaluate`.
    noise_mm, noise_rot_deg
        Of the instrument.
    result
        Folder of the evaluation.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    plan: _Name | None = None
    poses: _Name | None = None
    paths: _Name | None = None
    settling: _Name | None = None
    forces: _Name | None = None
    alignment: _Name | None = None
    compare: _Name | None = None
    noise_mm: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 0.01
    noise_rot_deg: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 0.005
    result: _Name = "iso9283/result"


class Settings(BaseModel):
    """Schema ``truearm-studio/1``: what the studio's pages say.

    Attributes
    ----------
    robot
        A library id, or a file of the folder.
    data
        File of measurements; None for none yet.
    exclude
        File of readings that are excluded; None for none.
    payload
        What the robot carried, as a text such as ``2.7kg,50mm,25mm,100mm``.
    model, train, loss, seed
        As for :func:`truearm.calibrate`.
    result
        Folder of the calibration's results, in the project's.
    program
        File of a robot program.
    cell
        File that says where tools and frames are; None for what the program says.
    wrench, wrench_frame
        What acts on the tool, six numbers or a file, and in whose axes, as for :func:`truearm.compensate`.
    taught
        As for :func:`truearm.compensate`; None if that was not said.
    controller_kinematics
        Likewise.
    accept
        Names of what may speak against the calibration or a correction, likewise.
    accept_correction
        How far targets may be moved and turned, likewise; None for what the robot's errors explain.
    corrected
        Folder of the corrected program.
    constraints
        File of boxes to keep clear of and of what else a configuration must keep; None for none.
    path
        File of a path that the arm follows in the scene; None for none yet.
    meshes
        URDF whose meshes show the robot; None for the robot's own, if it is one.
    plan
        What the page Plan says.
    measure
        What the page Measure says.
    performance
        Files of tests by ISO 9283.
    dark
        Whether the window is dark.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    truearm: Literal["truearm-studio/1"] = "truearm-studio/1"
    robot: _Name = "irb120"
    data: _Name | None = None
    exclude: _Name | None = None
    payload: _Name | None = None
    model: _Name = "geometric"
    train: Annotated[int, Field(strict=True, ge=1)] | Literal["all"] | None = None
    seed: Annotated[int, Field(strict=True, ge=0)] = 0
    loss: _Name = "linear"
    result: _Name = "result"
    program: _Name | None = None
    cell: _Name | None = None
    wrench: _Name | None = None
    wrench_frame: WrenchFrame | None = None
    taught: tuple[_Name, ...] | None = None
    controller_kinematics: _Name | None = None
    accept: tuple[_Name, ...] | None = None
    accept_correction: _Name | None = None
    corrected: _Name = "result/corrected"
    constraints: _Name | None = None
    path: _Name | None = None
    meshes: _Name | None = None
    plan: PlanFields = PlanFields()
    measure: MeasureFields = MeasureFields()
    performance: TestedFiles = TestedFiles()
    dark: bool = False

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
