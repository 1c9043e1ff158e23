"""One HTML file that needs nothing else, not even a network: style, scripts and data are inside."""

from __future__ import annotations

import json
import platform
import re
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version as installed_version
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup, escape

from truearm.engine.base.errors import (
    LONGEST_WORD,
    TURNING,
    printable,
    shortened,
    with_short_words,
)
from truearm.engine.base.units import mark_lines, parts_of
from truearm.engine.base.version import __version__
from truearm.engine.document.drawing import AFTER, BEFORE, DARK, Figure

#: Characters that could end a script element or a line of JavaScript, as JSON escapes them.
_UNSAFE: Final = {ord(c): f"\\u{ord(c):04x}" for c in "<>&\u2028\u2029"}
#: Part of a text, and of nothing else that JSON has.
_LONG_WORD: Final = re.compile(rf'[^\s"\\,:\[\]{{}}]{{{LONGEST_WORD + 1},}}')


def page(template: Path, figures: Mapping[str, Figure], of: object, **content: Any) -> str:
    """Return a page.

    Args:
        template: A template; it includes ``style.css.jinja`` and ``script.html.jinja`` of this package.
        figures: Pictures by the name of their place on the page.
        of: The record that it tells about: if that is simulated, the page begins with it.
        content: What the template tells about.
    """
    return _template(template).render(
        **content,
        mark=mark_lines(parts_of([of])),
        drawn=set(figures),
        heights={name: figure["layout"]["height"] for name, figure in figures.items()},
        figures=Markup(json_for_script(figures)),
        plotly=Markup(_plotly()),
        versions={
            "truearm": __version__,
            "Python": platform.python_version(),
            "NumPy": np.__version__,
            "SciPy": installed_version("scipy"),
        },
        colours={"before": BEFORE, "after": AFTER},
        dark_colours=Markup(json_for_script(DARK)),
    )


@cache
def _template(path: Path) -> Template:
    """Return a template, compiled once."""
    return _environment().from_string(path.read_text("utf-8"))


@cache
def _environment() -> Environment:
    """Return what reads the templates, each of which it compiles once."""
    environment = Environment(
        loader=PackageLoader("truearm.engine.document", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_shown,
    )
    environment.filters["with_code"] = with_code
    return environment


def _shown(value: object) -> object:
    """Return what a template puts on the page: of texts that come from files, only what can be seen."""
    if isinstance(value, str) and not isinstance(value, Markup):
        return with_short_words(printable(value))
    return value


def with_code(text: str) -> Markup:
    """Return a text for a page: what is in backticks, parameters and values, as code."""
    plain = str(escape(with_short_words(printable(text))))
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", plain))


def json_for_script(value: object) -> str:
    """Return JSON that can stand inside a script element whatever its texts hold."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
    text = _LONG_WORD.sub(lambda match: shortened(match[0], LONGEST_WORD), text)
    return text.translate(_UNSAFE | {ord(c): f"\\\\u{ord(c):04x}" for c in TURNING})


def _plotly() -> str:
    """Return Plotly's own script, which its package brings along."""
    return (files("plotly") / "package_data" / "plotly.min.js").read_text("utf-8")
