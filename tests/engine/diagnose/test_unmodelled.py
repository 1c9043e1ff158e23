from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from truearm.engine.diagnose.unmodelled import _judged, _Residual


def test_products_of_columns_and_of_rows_tell_the_same() -> None:
    """Columns of zeros explain nothing. With many of them, the products of the rows are the smaller system."""
    rng = np.random.default_rng(0)
    columns = 3.0 * rng.standard_normal((90, 5))
    residual = columns @ (0.3 * rng.standard_normal(5)) + rng.standard_normal(90)
    place = np.repeat(np.arange(30), 3)
    problem: Any = None  # it is not asked
    remaining = _Residual(problem, residual, np.zeros((90, 0)), place % 10, place)
    few, many = (
        _judged(remaining, "compliance", np.pad(columns, ((0, 0), (0, zeros))), 0.0, 90, 3) for zeros in (0, 200)
    )
    assert few is not None
    assert many is not None
    assert 0.3 < few.left < 0.9
    assert many.left == pytest.approx(few.left, rel=1e-9)
    assert many.chance == pytest.approx(few.chance, rel=1e-6)
