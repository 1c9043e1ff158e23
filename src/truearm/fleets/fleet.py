"""What the calibration of many robots is asked for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from truearm.engine.base.errors import InputError
from truearm.engine.command.groups import InParts, Long, Repeatable
from truearm.engine.command.kinds import File, Flag, Text
from truearm.engine.command.request import job, option, required

if TYPE_CHECKING:
    from truearm.fleets.result import Fleet


class CalibrateFleet(InParts, Repeatable, Long):
    """Calibrate many robots of a series, measured or simulated; run again, it goes on where it stopped.

    What is done is written into the folder part by part, and the result is the same to the last digit, whoever does how
    many parts. Whoever stops the work is told how many parts are on disk.
    """

    job = "fleet"
    refuses = "If the manifest, a file that it names, the folder, the executor or the scheduler cannot be used."
    manifest: str | Path = required(
        File("MANIFEST.yaml"),
        "Which robots, or which experiment.",
        kw_only=False,
        more="See :mod:`truearm.fleets.manifest`.",
    )
    out: str | Path = required(
        File("DIR"),
        "Folder for the parts and the result.",
        kw_only=True,
        word="out",
        more="It gets record.json, fleet.json, robots.csv and report.html.",
        repeated=False,
    )
    scheduler: str | None = option(
        Text("ADDRESS"),
        "Dask scheduler whose workers do the parts.",
        default=None,
        shown=False,
        more="Such as ``tcp://127.0.0.1:8786``; it needs the extra ``truearm[fleet]``.",
    )
    insecure: bool = option(
        Flag(),
        "Reach a scheduler on another machine without TLS.",
        default=False,
        more="Whoever can reach it can run programs there.",
    )

    def check(self) -> None:
        """Refuse several who do the parts."""
        several = [name for name in ("workers", "scheduler", "executor") if getattr(self, name) is not None]
        if len(several) > 1:
            raise InputError("one of them does the parts", parameter=", ".join(several), cure="Leave the others out.")

    def run(self) -> Fleet:
        """Calibrate them."""
        from truearm.fleets.running import calibrated_fleet

        return calibrated_fleet(self)


fleet = job(CalibrateFleet)
