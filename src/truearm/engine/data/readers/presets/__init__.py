"""Mapping files for the exports of well-known programs, used by their names."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Final

#: What each preset reads.
PRESETS: Final[dict[str, str]] = {
    "spatial-analyzer": "points of SpatialAnalyzer with uncertainties and time stamps",
    "t-mac": "poses of a T-Mac: semicolons, decimal commas, angles in radians, deviations",
}


def is_preset(mapping: str | Path) -> bool:
    """Return whether a mapping is named, and no file of that name is there."""
    return str(mapping) in PRESETS and not Path(mapping).exists()


def mapping_path(mapping: str | Path) -> Path:
    """Return the file of a mapping, which may be named."""
    if is_preset(mapping):
        return Path(str(files(__package__) / f"{mapping}.yaml"))
    return Path(mapping)
