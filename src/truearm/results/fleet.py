"""What was found of a fleet: how accurate its robots are, and which could not be calibrated."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.fleets.recorded import Recorded
from truearm.fleets.rows import Accuracy
from truearm.notices import Notice
from truearm.results.record import Record, notice_lines, notice_summaries
from truearm.shown import counted, listed
from truearm.writing import output_folder, write_files

#: What a fleet writes into its folder beside its parts.
FLEET_FILES: Final = ("fleet.json", "robots.csv")
#: Of what accuracies are shown [percent of the robots].
_SHARES: Final = (5.0, 50.0, 95.0)
#: What an accuracy is of, by its name in a row.
_KINDS: Final = {
    "nominal": "Nominal robots",
    "held_out": "Calibrated robots",
    "truth": "Calibrated robots, without the instrument's noise",
}


@dataclass(frozen=True)
class Run:
    """How the parts of a fleet were computed this time; no result depends on it.

    Attributes
    ----------
    parts, before
        How many there are, and how many were on disk already.
    told
        What happened to workers, in plain words.
    lost
        Robots of parts that were given up, because their workers died of them.
    """

    parts: int
    before: int
    told: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, repr=False)
class Fleet(Record):
    """A fleet of robots.

    Attributes
    ----------
    recorded
        Its parts on disk.
    run
        How they were computed.
    command
        How to make it again; empty if that is not known.
    """

    recorded: Recorded
    run: Run
    command: str = ""

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about the result, in plain words."""
        found = []
        if self.run.lost:
            found.append(
                Notice(
                    "workers-died",
                    f"Workers died again and again of parts with {counted(len(self.run.lost), 'robot')} "
                    f"({listed(self.run.lost)}), and these are not in the result. Run it again with more memory, or "
                    "leave these robots out.",
                    "error",
                )
            )
        failed = self._found["failed"]
        if failed:
            names = listed([name for name, _ in failed])
            found.append(
                Notice(
                    "robots-failed",
                    f"{len(failed)} of {counted(self._found['robots'], 'robot')} could not be calibrated ({names}); "
                    f"the first: {failed[0][1]}",
                )
            )
        return tuple(found)

    @cached_property
    def _found(self) -> dict[str, Any]:
        """Figures of all rows, read once."""
        means: dict[str, list[float]] = {kind: [] for kind in _KINDS}
        failed = []
        count = 0
        for row in self.recorded.rows():
            count += 1
            if row.status == "failed":
                failed.append((row.name, row.message))
            for kind, values in means.items():
                accuracy: Accuracy | None = getattr(row, kind)
                if accuracy is not None:
                    values.append(accuracy.mean)
        return {"robots": count, "failed": failed, "means": {kind: np.array(v) for kind, v in means.items()}}

    def _accuracies(self) -> dict[str, Mapping[str, float]]:
        shown: dict[str, Mapping[str, float]] = {}
        for kind, values in self._found["means"].items():
            if len(values):
                quantiles = np.percentile(values, _SHARES) * 1e3
                shown[kind] = {
                    **{f"p{share:g}": float(value) for share, value in zip(_SHARES, quantiles, strict=True)},
                    "max": float(values.max()) * 1e3,
                    "robots": len(values),
                }
        return shown

    def content(self) -> dict[str, Any]:
        """Return what ``fleet.json`` holds, in mm: the same however the parts were computed."""
        found = self._found
        return {
            "truearm": "truearm-fleet-result/1",
            "digest": self.recorded.manifest.digest,
            "robots": self.recorded.manifest.count,
            "calibrated": found["robots"] - len(found["failed"]),
            "failed": [{"name": name, "message": message} for name, message in found["failed"]],
            "missing": [*self.run.lost],
            "mean_error_mm": self._accuracies(),
        }

    def summary(self) -> dict[str, Any]:
        """Return what ``fleet.json`` holds, and how it was computed."""
        run = self.run
        return {
            **self.content(),
            "run": {"parts": run.parts, "on_disk_before": run.before, "told": [*run.told]},
            "warnings": notice_summaries(self.warnings),
        }

    def lines(self) -> list[str]:
        """Return what the command prints."""
        found, run = self._found, self.run
        text = [
            f"{counted(self.recorded.manifest.count, 'robot')}, "
            f"{found['robots'] - len(found['failed'])} calibrated, {len(found['failed'])} failed."
        ]
        if run.before:
            text.append(f"{run.before} of {counted(run.parts, 'part')} were on disk already.")
        text += [f"{words[0].upper()}{words[1:]}." for words in run.told]
        for kind, shown in self._accuracies().items():
            text.append(
                f"{_KINDS[kind]}: mean error {shown['p50']:.3f} mm in the middle of the series, "
                f"{shown['p5']:.3f} to {shown['p95']:.3f} mm for 90 % of it, {shown['max']:.3f} mm at most."
            )
        return text + notice_lines(self.warnings)

    def csv_text(self) -> str:
        """Return the robots as a table, one row each."""
        stream = io.StringIO()
        table = csv.writer(stream, lineterminator="\n")
        kinds = [kind for kind in _KINDS if len(self._found["means"][kind])]
        table.writerow(["name", "of", "date", "status", *(f"{kind} mean [mm]" for kind in kinds), "message"])
        for row in self.recorded.rows():
            means = [getattr(row, kind) for kind in kinds]
            table.writerow(
                [
                    row.name,
                    row.of or "",
                    row.date or "",
                    row.status,
                    *("" if a is None else f"{a.mean * 1e3:.6f}" for a in means),
                    row.message,
                ]
            )
        return stream.getvalue()

    def save(self) -> tuple[Path, ...]:
        """Write ``fleet.json`` and ``robots.csv`` beside the parts.

        Returns
        -------
        The files written.
        """
        folder = output_folder(self.recorded.folder, FLEET_FILES, (self.recorded.manifest.file,), ours=True)
        files = {
            "fleet.json": json.dumps(self.content(), indent=2, allow_nan=False) + "\n",
            "robots.csv": self.csv_text(),
        }
        write_files(folder, files, self.command or None)
        return tuple(folder / name for name in files)
