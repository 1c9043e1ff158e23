"""The page as it is served: viser's, with styles, and with scripts for what viser's page does not know to do."""

from __future__ import annotations

import gzip
from functools import lru_cache
from pathlib import Path
from typing import Final

from websockets.http11 import Response

_SCRIPTS: Final = tuple(Path(__file__).with_name(name) for name in ("without_webgl.js", "comes_back.js"))
_BEFORE: Final = b"<head>"
#: The tabs of all pages stand in one row, a number beside a slider is shown whole, and the buttons of a picture come up
#: below its legend.
_STYLE: Final = (
    b"<style>[role=tab] { padding-left: 6px !important; padding-right: 6px !important }"
    b" .mantine-Slider-root + .mantine-NumberInput-root { width: 4.2rem !important }"
    b" .modebar-container { top: 48px !important }</style>"
)


def complete(response: Response) -> None:
    """Put the scripts before everything else in viser's page."""
    packed = response.headers.get("Content-Encoding") == "gzip"
    if response.headers.get("Content-Type", "").startswith("text/html"):
        response.body = _completed(bytes(response.body), packed)
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(response.body))


@lru_cache(maxsize=2)
def _completed(body: bytes, packed: bool) -> bytes:
    page = gzip.decompress(body) if packed else body
    head, found, rest = page.partition(_BEFORE)
    if not found:
        return body
    title = rest.replace(b"<title>Viser</title>", b"<title>truearm studio</title>", 1)
    scripts = b"".join(b"\n<script>\n" + script.read_bytes() + b"</script>" for script in _SCRIPTS)
    whole = head + found + scripts + _STYLE + title
    return gzip.compress(whole) if packed else whole
