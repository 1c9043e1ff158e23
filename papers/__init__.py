"""Published experiments made again: ours beside the document's, over several seeds.

One study a folder: its function ``study`` repeats the experiment once a seed and finds figures by table and row, and
its ``study.yaml`` has the words and the printed numbers (:mod:`papers.texts`). What is here is light: the command's
help reads it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast

from truearm.engine.base.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from papers.study import Study

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Entry:
    """A study in the list."""

    name: str  #: As the command line spells it.
    about: str  #: What it does, in a few words.
    files: tuple[str, ...] = ()  #: Measured data that its folder must hold; none for a study on digital twins.

    @property
    def module(self) -> str:
        """Its folder, whose function ``study(seeds, progress)`` runs it; it takes a folder too if it needs data."""
        return f"{__name__}.{self.name.replace('-', '_')}"


STUDIES: Final = (
    Entry("hexapod-device", "what one ballbar between six cups can measure, and how well (Nubiola 3)"),
    Entry("irb120-axes", "one joint of an IRB 120 turned at a time: compliance, run-out and backlash (Nubiola 2.4)"),
    Entry(
        "irb120-devices",
        "a simulated IRB 120 calibrated with tracker, cameras and every other instrument (Nubiola 1.7, 2.2 to 2.7)",
    ),
    Entry(
        "irb120-faro",
        "a measured IRB 120: what every model leaves, and where it comes from",
        ("joints_commanded.txt", *(f"{kind}_{number}.txt" for kind in ("target", "base") for number in (1, 2, 3))),
    ),
    Entry("irb120-hexapod", "a simulated IRB 120 judged and calibrated with one ballbar (Nubiola 2.6.3 and 3.5)"),
    Entry(
        "irb120-simulation",
        "calibration of a simulated IRB 120, without noise and with noise and wrong masses (Nubiola 2.6)",
    ),
    Entry(
        "katana-devices",
        "a simulated Katana 450 calibrated with every instrument, and the circle it draws (Patel 3.3 and 5.5.2)",
    ),
    Entry(
        "katana-influence",
        "influence of each parameter, and identification by it, on a simulated Katana 450 (Patel 3.5 to 3.7)",
    ),
    Entry(
        "katana-tilting",
        "joints that tilt, found by inclinometers before the geometry, on a simulated Katana 450 (Patel 4)",
    ),
    Entry("katana-trajectory", "a circle predicted, corrected and followed by a simulated Katana 450 (Patel 5)"),
    Entry(
        "kr5-gdt",
        "a KUKA KR 5: joint errors from circles, tolerances, seven lines before and after compensation (KR5 paper)",
    ),
    Entry(
        "li-table", "an arm of three joints that touches a tilted table of known points, fitted in bounds (Li et al.)"
    ),
    Entry(
        "lrmate-hexapod",
        "an LR Mate calibrated with one ballbar in two steps, and with a tracker; its truth is invented (Nubiola 4)",
    ),
)


def run_study(name: str, seeds: int = 10, data: str | Path | None = None, progress: Progress = lambda _: None) -> Study:
    """Run a study.

    Args:
        name: One of :data:`STUDIES`.
        seeds: How often to do it anew, with seeds 0, 1, 2 and so on.
        data: Folder of the measured data, for a study that needs them.
        progress: Called with a few words at each step.

    Raises:
        InputError: If there is no such study, or its data are missing, or it needs none.
    """
    entry = _entry(name)
    study = import_module(entry.module).study
    if not entry.files:
        if data is not None:
            raise InputError(
                "this study simulates its data", parameter="data", came=str(data), cure="Leave `data` out."
            )
        return cast("Study", study(seeds, progress))
    return cast("Study", study(seeds, progress, _folder(entry, data)))


def _entry(name: str) -> Entry:
    for entry in STUDIES:
        if entry.name == name:
            return entry
    names = [entry.name for entry in STUDIES]
    raise InputError(
        "there is no study of this name",
        parameter="study",
        came=name,
        allowed=", ".join(names),
        cure=did_you_mean(name, names),
    )


def _folder(entry: Entry, data: str | Path | None) -> Path:
    needed = f"a folder with {', '.join(entry.files)}"
    if data is None:
        raise InputError(
            "this study needs measured data, which truearm does not bring along", parameter="data", allowed=needed
        )
    folder = Path(data)
    missing = [name for name in entry.files if not (folder / name).is_file()]
    if missing:
        raise InputError("a file of the measured data is missing", where=str(folder / missing[0]), allowed=needed)
    return folder
