"""The program of the demonstration: a plate that an ABB robot drills."""

from __future__ import annotations

from pathlib import Path
from typing import Final

PLATE: Final = (Path(__file__).parent / "recordings" / "inputs" / "plate.mod").read_text()
