"""What a campaign was measured with: read, shown, and what is missing is said."""

from __future__ import annotations

from pathlib import Path

import pytest

from truearm.engine.base.errors import InputError
from truearm.measuring.reading_log import About, read_about

WHOLE = """\
truearm: truearm-about/1
units: {length: mm, temperature: degC, pressure: hPa, humidity: percent}
instrument: {name: tracker of the hall, serial: "750123"}
robot: {serial: "120-501234"}
reflector: {radius: 19.05, offset: 0.0}
environment:
  - {at: start, temperature: 20.4, pressure: 1013.2, humidity: 45}
  - {at: end, temperature: 21.0}
"""


def test_everything_that_is_said_is_shown(tmp_path: Path) -> None:
    path = tmp_path / "about.yaml"
    path.write_text(WHOLE)
    about = read_about(path)
    assert about.missing == []
    assert about.notices() == []
    rows = dict(about.rows())
    assert rows["serial number of the robot"] == "120-501234"
    assert rows["radius of the reflector"] == "19.05 mm"
    assert rows["air, start"] == "20.4 degC, 1013.2 hPa, 45 percent"
    assert rows["air, end"] == "21 degC"


def test_what_nobody_said_is_named() -> None:
    (notice,) = About(instrument_serial="7").notices()
    assert (notice.code, notice.level) == ("not-said", "note")
    assert "serial number of the instrument" not in notice.message
    for word in ("serial number of the robot", "radius of the reflector", "temperature of the air"):
        assert word in notice.message


def test_what_cannot_be_meant_is_refused_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "about.yaml"
    for old, new, word in (
        ("radius: 19.05", "radius: 1905", "reflector.radius"),
        ("radius: 19.05", "radius: 0", "reflector.radius"),
        ("temperature: 20.4", "temperature: 293.5", r"environment\[1\].temperature"),
        ("pressure: 1013.2", "pressure: 101320", r"environment\[1\].pressure"),
        ("humidity: 45", "humidity: 145", r"environment\[1\].humidity"),
        ("length: mm", "length: furlong", "units.length"),
        ("serial:", "seriel:", "seriel"),
        ("at: start", 'at: "st\\x07art"', "one line of text"),
    ):
        path.write_text(WHOLE.replace(old, new))
        with pytest.raises(InputError, match=word):
            read_about(path)
