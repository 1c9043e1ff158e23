"""Every image of the repository is whole."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]
Image.init()
IMAGES = sorted(
    path
    for folder in ("docs", "src", "tests", "benchmarks")
    for path in (ROOT / folder).rglob("*")
    if path.suffix.lower() in Image.EXTENSION and "_build" not in path.parts and ".env" not in path.parts
)


def decode(content: bytes) -> None:
    """Decode every pixel, and compare the sum of every chunk up to the last one."""
    with Image.open(io.BytesIO(content)) as image:
        image.load()
    with Image.open(io.BytesIO(content)) as image:
        image.verify()


def test_every_image_is_whole_and_no_text_to_git() -> None:
    binary = (ROOT / ".gitattributes").read_text().splitlines()
    assert IMAGES
    for path in IMAGES:
        try:
            decode(path.read_bytes())
        except (OSError, SyntaxError) as error:
            pytest.fail(f"{path}: {error}")
        assert f"*{path.suffix} binary" in binary, path


def test_damage_of_an_image_is_found() -> None:
    content = io.BytesIO()
    noise = np.random.default_rng(0).integers(256, size=(300, 300), dtype=np.uint8)
    Image.fromarray(noise).save(content, "PNG")
    whole = content.getvalue()
    decode(whole)
    middle = len(whole) // 2
    for damaged in (
        whole[:middle] + whole[middle + 2 :],  # as where a word was once taken out of all files, images among them
        whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :],
        whole[:-30],
        whole.replace(b"\r\n", b"\n"),
    ):
        with pytest.raises((OSError, SyntaxError)):
            decode(damaged)
