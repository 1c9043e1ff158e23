"""Texts as they may be shown."""

from __future__ import annotations

import pytest

from truearm.engine.base.errors import InputError, is_one_line, printable, shortened, with_short_words
from truearm.engine.document.page import json_for_script, with_code


@pytest.mark.parametrize("text", ["smr 1", "<b>", "Träger", "a: #{}", "日本", "\u00a0x", "שלום", "👩\u200d🔧"])
def test_one_line(text: str) -> None:
    assert is_one_line(text)
    assert printable(text) == text


@pytest.mark.parametrize("text", ["", "  ", "\u00a0"])
def test_nothing_that_can_be_seen(text: str) -> None:
    assert not is_one_line(text)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("a\nb", r"a\nb"),
        ("a\tb", r"a\tb"),
        ("a\0", r"a\x00"),
        ("a\x7f", r"a\x7f"),
        ("a\u2028b", r"a\u2028b"),
        ("a\x85b", r"a\x85b"),
        ("\x1b[31mred", r"\x1b[31mred"),
        ("\x9b31m", r"\x9b31m"),
        ("gpj.\u202eexe", r"gpj.\u202eexe"),
        ("\u2066a\u2069", r"\u2066a\u2069"),
        ("\ud800", r"\ud800"),
    ],
)
def test_what_would_steer_a_terminal(text: str, shown: str) -> None:
    assert not is_one_line(text)
    assert printable(text) == shown
    refusal = str(InputError(text, where=text, came=text, allowed=text, cure=text))
    assert refusal == f"{shown}: {shown}; got '{shown}'; allowed: {shown}. {shown}"


def test_long_texts_lose_their_middle() -> None:
    assert shortened("x" * 50, 50) == "x" * 50
    assert shortened("a" * 100 + "b" * 100, 40) == "a" * 27 + "..." + "b" * 10
    assert with_short_words(f"a {'x' * 5000} b") == f"a {'x' * 222}...{'x' * 75} b"
    assert len(str(InputError("x" * 9000, where="y" * 9000, came="z" * 9000, allowed="w" * 9000))) < 5000
    assert len(str(InputError("x" * 9000, allowed="a, b, " + "w" * 9000))) < 700
    assert "got 'zzz" in str(InputError("wrong", came="z" * 9000))


def test_a_report_shows_what_cannot_be_seen() -> None:
    assert with_code("a\x1b `b\u202e` <c>") == r"a\x1b <code>b\u202e</code> &lt;c&gt;"
    assert json_for_script({"x" * 5000: [1.25] * 400}) == f'{{"{"x" * 222}...{"x" * 75}":[{",".join(["1.25"] * 400)}]}}'
    assert json_for_script(["a\u202eb\u2028"]) == r'["a\\u202eb\u2028"]'
