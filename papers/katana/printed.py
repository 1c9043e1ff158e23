"""Tables of Patel's thesis that more than one study stands beside: 3.2 to 3.4, 4.5 and 4.6, digit for digit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from papers.katana.pose_errors import Quantity

#: Errors before calibration, and after the two calibrations that a table compares.
Columns = tuple[str, str, str]
_Errors = Mapping[Quantity, Columns]

#: Tables 3.2 and 3.3: deviations from nominal by the document's names [deg, mm]. Alphas and lengths are printed whole.
TABLE_3_2: Final[Mapping[str, str]] = {
    "theta 1": "-0.061",
    "theta 2": "0.0232",
    "theta 3": "-0.057",
    "theta 4": "0.0641",
    "theta 5": "-0.121",
    "alpha 0": "0",
    "alpha 1": "-0.08",
    "alpha 2": "0.003",
    "alpha 3": "0.007",
    "alpha 4": "-0.01",
    "alpha 5": "0.03",
    "beta 2": "0.0021",
    "beta 3": "0.0013",
    "a 3": "0.003",
    "a 4": "0.01",
    "d 5": "0.002",
    "d 6": "0.001",
}
TABLE_3_3: Final[Mapping[str, str]] = {
    "theta 1": "-0.061",
    "theta 2": "0.0341",
    "theta 3": "0.066",
    "theta 4": "0.0231",
    "theta 5": "-0.01",
    "alpha 0": "0",
    "alpha 1": "0.053",
    "alpha 2": "-0.016",
    "alpha 3": "0.062",
    "alpha 4": "0.18",
    "alpha 5": "0.01",
    "beta 2": "0.005",
    "beta 3": "-0.003",
    "a 3": "0.00",
    "a 4": "0.00",
    "d 5": "0.000",
    "d 6": "0.000",
}
#: Table 3.4, mean over 118 poses: before, simultaneous, influence-based [mm, deg].
TABLE_3_4: Final[_Errors] = {
    "dX": ("0.63", "0.28", "0.18"),
    "dY": ("0.44", "0.13", "0.10"),
    "dZ": ("0.85", "0.25", "0.16"),
    "dP": ("1.21", "0.38", "0.21"),
    "dPhi": ("0.27", "0.096", "0.088"),
    "dTheta": ("0.17", "0.027", "0.022"),
    "dPsi": ("0.26", "0.084", "0.079"),
}
#: Table 4.5, over 118 poses: before, conventional, with tilting [mm, deg].
TABLE_4_5_LEAST: Final[_Errors] = {
    "dX": ("0.04", "0.02", "0.01"),
    "dY": ("0.02", "0.01", "0.00"),
    "dZ": ("0.08", "0.03", "0.02"),
    "dP": ("0.16", "0.05", "0.03"),
    "dPhi": ("0.04", "0.02", "0.02"),
    "dTheta": ("0.05", "0.02", "0.02"),
    "dPsi": ("0.03", "0.01", "0.01"),
}
TABLE_4_5_MOST: Final[_Errors] = {
    "dX": ("1.35", "0.28", "0.14"),
    "dY": ("0.92", "0.41", "0.13"),
    "dZ": ("1.82", "0.63", "0.16"),
    "dP": ("2.11", "0.70", "0.24"),
    "dPhi": ("0.46", "0.125", "0.119"),
    "dTheta": ("0.26", "0.087", "0.078"),
    "dPsi": ("0.45", "0.130", "0.09"),
}
TABLE_4_5_MEAN: Final[_Errors] = {
    "dX": ("0.63", "0.17", "0.08"),
    "dY": ("0.44", "0.09", "0.05"),
    "dZ": ("0.85", "0.25", "0.11"),
    "dP": ("1.21", "0.33", "0.12"),
    "dPhi": ("0.27", "0.096", "0.088"),
    "dTheta": ("0.17", "0.027", "0.022"),
    "dPsi": ("0.26", "0.084", "0.079"),
}
#: Table 4.6: |dP| of ten uncalibrated points: before, conventional, with tilting [mm].
TABLE_4_6: Final[tuple[Columns, ...]] = (
    ("1.16", "0.51", "0.11"),
    ("0.95", "0.67", "0.12"),
    ("1.52", "0.75", "0.14"),
    ("1.31", "0.55", "0.12"),
    ("0.89", "0.53", "0.11"),
    ("0.93", "0.47", "0.14"),
    ("1.17", "0.28", "0.12"),
    ("1.38", "0.72", "0.16"),
    ("1.54", "0.41", "0.15"),
    ("0.76", "0.25", "0.11"),
)


def column_of_4_6(column: int) -> tuple[str, str]:
    """Return mean and largest of a column of Table 4.6 [mm].

    The mean has three digits behind the point: ten figures of two were added up.
    """
    found = [row[column] for row in TABLE_4_6]
    return f"{sum(map(float, found)) / len(found):.3f}", max(found, key=float)


def same_angles() -> float:
    """Return by how much the orientation errors of Tables 3.4 and 4.5 differ at most [deg]."""
    return max(
        abs(float(a) - float(b))
        for quantity in ("dPhi", "dTheta", "dPsi")
        for a, b in zip(TABLE_3_4[quantity], TABLE_4_5_MEAN[quantity], strict=True)
    )
