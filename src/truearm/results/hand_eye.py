"""What a camera saw of a board, imported."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.measurement.board.views import Lens
from truearm.measurement.dataset import Dataset
from truearm.results.record import Record
from truearm.shown import counted

#: The lens as lines show it: what belongs together, and in which unit.
_SHOWN: Final = ((("fx", "fy"), " px"), (("cx", "cy"), " px"), (("k1", "k2", "k3"), ""), (("p1", "p2"), ""))


@dataclass(frozen=True, eq=False, repr=False)
class ImportedHandEye(Record):
    """A camera and a board, one of them on the flange, as poses of that one."""

    data: Dataset  #: The measurements.
    on_flange: str  #: ``camera`` or ``board``.
    ahead: float  #: How far before the camera, on its axis, the target is [m]; zero for a board on the flange.
    lens: Lens | None = None  #: Of the camera, where pictures were read.
    out: Path | None = None  #: The canonical CSV file that holds the measurements; None if none was written.

    @property
    def sigma(self) -> float | None:
        """Standard deviation of a coordinate of the target, root mean square [m]; None if it is not known."""
        return None if self.data.sigma is None else float(np.sqrt(np.mean(self.data.sigma**2)))

    @property
    def sigma_rot(self) -> float | None:
        """The same of a turn about an axis [rad]."""
        return None if self.data.sigma_rot is None else float(np.sqrt(np.mean(self.data.sigma_rot**2)))

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        made: dict[str, Any] = {
            "configurations": self.data.configurations,
            "on_flange": self.on_flange,
            "scale_sigma_ppm": None if self.data.scale_sigma is None else 1e6 * self.data.scale_sigma,
            "ahead_mm": 1e3 * self.ahead,
            "sigma_mm": None if self.sigma is None else 1e3 * self.sigma,
            "sigma_rot_mrad": None if self.sigma_rot is None else 1e3 * self.sigma_rot,
        }
        if self.lens is not None:
            made["lens"] = {
                "values": dict(self.lens.values),
                "deviations": dict(self.lens.deviations),
                "noise_px": self.lens.noise,
                "corners": list(self.lens.corners),
            }
        return made

    def lines(self) -> list[str]:
        """Return what was read."""
        where = "" if self.out is None else f": {self.out}"
        text = [f"{counted(self.data.configurations, 'configuration')}, target {self.data.targets[0]}{where}"]
        if self.on_flange == "camera":
            text.append(f"  the target is a point on the camera's axis, {1e3 * self.ahead:.1f} mm before it")
        if self.sigma is not None and self.sigma_rot is not None:
            text.append(f"  deviations {1e3 * self.sigma:.3f} mm a coordinate, {1e3 * self.sigma_rot:.3f} mrad an axis")
        if self.data.scale_sigma is None:
            text.append("  the board's size is taken as exact")
        else:
            text.append(f"  the board's size is known to {1e6 * self.data.scale_sigma:.3g} ppm")
        if self.lens is not None:
            text.append(f"  corners are off by {self.lens.noise:.2f} px, {min(self.lens.corners)} or more a picture")
            for names, unit in _SHOWN:
                digits = 1 if unit else 4
                of = [f"{n} {self.lens.values[n]:.{digits}f} ({self.lens.deviations[n]:.{digits}f})" for n in names]
                text.append(f"  lens: {', '.join(of)}{unit}")
        return text
