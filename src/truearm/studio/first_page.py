"""The page as it is served: viser's, with a few styles, and what a browser without WebGL needs to show anything."""

from __future__ import annotations

import gzip
from functools import lru_cache
from pathlib import Path
from typing import Final

from websockets.http11 import Response

_SCRIPT: Final = Path(__file__).with_name("without_webgl.js")
_BEFORE: Final = b"<head>"
#: The tabs of all pages stand in one row, a number beside a slider is shown whole, and the buttons of a picture come up
#: below its legend.
_STYLE: Final = (
    b"<style>[role=tab] { padding-left: 6px !important; padding-right: 6px !important }"
    b" .mantine-Slider-root + .mantine-NumberInput-root { width: 4.2rem !important }"
    b" .modebar-container { top: 48px !important }</style>"
)


def complete(response: Response) -> None:
    """Put the script that speaks for browsers without WebGL before everything else in viser's page."""
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
    whole = head + found + b"\n<script>\n" + _SCRIPT.read_bytes() + b"</script>" + _STYLE + title
    return gzip.compress(whole) if packed else whole
