"""The result that is in a folder already: a sound one is not replaced by one that is not, unless that is asked for."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from truearm.errors import InputError, Words
from truearm.files import read_text
from truearm.identification.judging.gain import NO_GAIN
from truearm.identification.solving.fit import Status
from truearm.modeling.formats.robot_file import read_robot
from truearm.shown import listed

if TYPE_CHECKING:
    from truearm.results.calibration import Calibration

#: Ends of a fit with which a result can be sound.
SOUND: Final = (Status.CONVERGED.value, Status.AT_BOUND.value)
#: Warnings that speak against a result; the second is of earlier versions.
_WARNINGS: Final = (NO_GAIN, "not-better")


class ResultKeptError(InputError):
    """A result that is not sound would have replaced a sound one; nothing was written.

    Args:
        calibration: The new result. It can be saved in another folder.
        standing: The figures of the sound one, in words.
        folder: Where that is.
    """

    def __init__(self, calibration: Calibration, standing: str, folder: Path) -> None:
        self.calibration = calibration
        new = said_of(calibration.summary(), calibration.faults)
        super().__init__(
            "a sound result is in this folder, and the new one is not sound. Nothing was written",
            parameter="out",
            where=str(folder),
            came=Words(f"{new}; in the folder: {standing}"),
            cure="Choose another `out`, or replace the sound result with `replace`.",
        )


def sound_result(folder: Path) -> str | None:
    """Return the figures of the sound result in a folder, in words; None if there is none.

    A result is sound if its fit ended well, without an error and not without a gain over the nominal robot. The robot
    file says so, and ``result.json`` if that is of a calibration.
    """
    proof, summary = None, dict[str, Any]()
    with suppress(InputError):
        proof = read_robot(folder / "calibrated.yaml").proof
    with suppress(InputError, ValueError, RecursionError):
        content = json.loads(read_text(folder / "result.json"))
        if isinstance(content, dict) and content.get("truearm") == "truearm-result/1":
            summary = content
    status = summary.get("status") if proof is None else proof.status
    warnings = summary.get("warnings", ())
    bad = any(notice["level"] == "error" or notice["code"] in _WARNINGS for notice in warnings)
    if status not in SOUND or bad or (proof is not None and proof.errors):
        return None
    return said_of({**summary, "status": status}, [])


def said_of(summary: dict[str, Any], faults: Sequence[str]) -> str:
    """Return the status, what speaks against a result and its error on unseen configurations, in words.

    Args:
        summary: As ``result.json`` begins.
        faults: Codes of what speaks against it.
    """
    text = listed([summary["status"], *(fault for fault in faults if fault != summary["status"])])
    for kind in ("position_mm", "length_mm"):
        figures = (summary.get("validation") or {}).get(kind)
        if figures:
            return f"{text}, unseen configurations off by {figures['mean']:.3f} mm on average"
    return f"{text}, nothing held out" if "validation" in summary else text
