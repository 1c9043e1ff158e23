"""A simulated campaign of tests by ISO 9283, and the files that hold it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from truearm.measurement.performance.writing import forces_text, poses_text, samples_text
from truearm.modeling.transform import Transform
from truearm.notices import Notice
from truearm.results.record import Record, notice_lines, notice_summaries
from truearm.shown import counted
from truearm.simulated import Marked
from truearm.units import from_si
from truearm.validation.iso9283.simulated_readings import SimulatedCampaign, Tracker
from truearm.writing import output_folder, write_files

#: What a campaign may write.
FILES: Final = ("poses.csv", "paths.csv", "settling.csv", "forces.csv", "alignment.yaml")


@dataclass(frozen=True)
class StatedTie:
    """How the instrument is said to be tied to the robot's base: what was drawn about the true tie."""

    T_base_instrument: Transform  #: The instrument's frame in the robot's base frame.
    #: sigma, sigma_rot: standard deviations of each coordinate [m] and angle [rad] at the origin of the base.
    sigma: float
    sigma_rot: float

    def text(self) -> str:
        """Return it as ``alignment.yaml``."""
        place = self.T_base_instrument
        position = ", ".join(f"{1e3 * v:.6f}" for v in place.translation)
        quaternion = ", ".join(f"{v:.12f}" for v in place.quaternion)
        return (
            "# How the simulated instrument is tied to features of the robot's base: its frame in the base frame.\n"
            "truearm: truearm-alignment/1\n"
            "units: {length: mm, angle: deg}\n"
            "kind: base-features\n"
            f"position: [{position}]\n"
            f"quaternion: [{quaternion}]\n"
            f"sigma: {from_si(self.sigma, 'mm'):.6g}\n"
            f"sigma_rot: {from_si(self.sigma_rot, 'deg'):.6g}\n"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Iso9283Simulation(Record):
    """What an instrument reads in the tests of a plan, of a robot whose truth is known."""

    robot: str  #: Name of the nominal robot.
    truth: str  #: What the robot truly is: the name of a truth, or the robot file.
    corrected: str | None  #: The calibrated robot by which the commands were corrected; None where they were nominal.
    campaign: SimulatedCampaign  #: The readings.
    tie: StatedTie  #: How the instrument is tied to the base.
    tracker: Tracker  #: The instrument.
    tests: tuple[str, ...]  #: Those that were run.
    out: Path | None  #: The folder of the files; None if none were written.
    command: str  #: How to simulate it again.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    warnings: tuple[Notice, ...] = ()  #: What speaks against it.

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``data``: an instrument that is simulated reads."""
        return ("data",)

    def _counts(self) -> dict[str, int]:
        campaign = self.campaign
        return {
            "poses": 0 if campaign.poses is None else len(campaign.poses.cycle),
            "paths": 0 if campaign.paths is None else len(campaign.paths.time),
            "settling": 0 if campaign.settling is None else len(campaign.settling.time),
            "forces": 0 if campaign.forces is None else len(campaign.forces.force),
        }

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "robot": self.robot,
            "truth": self.truth,
            "corrected": self.corrected,
            "tests": list(self.tests),
            "rows": self._counts(),
            "rate_hz": self.tracker.rate,
            "noise_mm": from_si(self.tracker.sigma, "mm"),
            "noise_rot_deg": from_si(self.tracker.sigma_rot, "deg"),
            "hours": self.campaign.duration / 3600.0,
            "files": [] if self.out is None else [str(self.out / name) for name in self.files()],
            "warnings": notice_summaries(self.warnings),
        }

    def lines(self) -> list[str]:
        """Return what was run and read."""
        commands = "nominal commands" if self.corrected is None else f"commands corrected by {self.corrected}"
        text = [f"{counted(len(self.tests), 'test')} of {self.robot} ({self.truth}), {commands}"]
        words = {"poses": "attained pose", "paths": "sample", "settling": "sample", "forces": "reading"}
        where = {"paths": " along paths", "settling": " of the way to a pose", "forces": " under a push"}
        for name, count in self._counts().items():
            if count:
                text.append(f"  {counted(count, words[name])}{where.get(name, '')}")
        text.append(f"  {self.campaign.duration / 3600.0:.1f} hours in the cell")
        if self.out is not None:
            text.append(f"Written to {self.out}: {', '.join(self.files())}")
        return text + notice_lines(self.warnings)

    def files(self) -> tuple[str, ...]:
        """Return the names of the files that hold it."""
        counts = self._counts()
        return tuple(name for name in FILES if counts.get(name.partition(".")[0], 1))

    def save(self, folder: str | Path) -> None:
        """Write the files into a folder."""
        place = output_folder(folder, self.files(), self.inputs, "folder", ours=True)
        campaign, texts = self.campaign, {}
        if campaign.poses is not None:
            texts["poses.csv"] = poses_text(campaign.poses)
        if campaign.paths is not None:
            texts["paths.csv"] = samples_text(campaign.paths, "path")
        if campaign.settling is not None:
            texts["settling.csv"] = samples_text(campaign.settling, "pose", conditions=False)
        if campaign.forces is not None:
            texts["forces.csv"] = forces_text(campaign.forces)
        write_files(place, {**texts, "alignment.yaml": self.tie.text()}, self.command)
