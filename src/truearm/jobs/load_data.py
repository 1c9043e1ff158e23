"""Measurements from a canonical CSV file."""

from __future__ import annotations

from pathlib import Path

from truearm.jobs.arguments import data_argument
from truearm.measurement.dataset import Dataset


def load_data(data: Dataset | str | Path) -> Dataset:
    """Return the measurements in a canonical CSV file.

    Parameters
    ----------
    data
        The file. A dataset is returned as it is.

    Raises
    ------
    InputError
        If the file cannot be used; the message names the line and the column.
    """
    return data_argument(data)
