"""What tests of corrections write: the plate's program, small programs, files of tools and frames."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from tests.plate import PLATE

import truearm

HEAD: Final = "truearm: truearm-cell/1\nunits: {length: mm, angle: deg}\n"
NO_AXES: Final = "[9E9,9E9,9E9,9E9,9E9,9E9]"


def plate(folder: Path, *changes: tuple[str, str]) -> Path:
    """Write the program of the plate, with some changes."""
    folder.mkdir(exist_ok=True)
    text, path = PLATE, folder / "plate.mod"
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path


def module(folder: Path, *moves: str, data: tuple[str, ...] = ()) -> Path:
    """Write a RAPID program of some moves."""
    path = folder / "m.mod"
    path.write_text("\n".join(["MODULE m", *data, "PROC main()", *moves, "ENDPROC", "ENDMODULE", ""]))
    return path


def pose(x: float, y: float, z: float = 300, turned: str = "[0,0,1,0],[0,0,0,0]") -> str:
    return f"[[{x},{y},{z}],{turned},{NO_AXES}]"


def cell(folder: Path, entries: str, name: str = "cell.yaml") -> Path:
    folder.mkdir(exist_ok=True)
    path = folder / name
    path.write_text(HEAD + entries)
    return path


def codes(result: truearm.ProgramCorrection) -> dict[str, str]:
    """Return the codes and levels of what is warned of."""
    return {notice.code: notice.level for notice in result.warnings}
