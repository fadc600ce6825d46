"""Standard streams of a command: plain characters where the encoding of an output lacks one, and
no output where a stream is closed.

Imported before anything else of the command line, so it imports only modules that load in less than
a millisecond.
"""

import codecs
import contextlib
import os
import sys
import unicodedata
from typing import TextIO

PLAIN = {
    "─": "-",
    "━": "-",
    "│": "|",
    "–": "-",
    "—": "-",
    "−": "-",
    "…": "...",
    "·": "*",
    "•": "*",
    "×": "x",
    "±": "+/-",
    "≈": "~",
    "≤": "<=",
    "≥": ">=",
    "≠": "!=",
    "→": "->",
    "←": "<-",
    "\u2044": "/",
    "√": "sqrt",
    "∂": "d",
    "ß": "ss",
    "ø": "o",
    "Ø": "O",
    "∞": "inf",
    "°": "deg",
    "µ": "u",
    "‘": "'",
    "’": "'",
    "“": '"',
    "”": '"',
    "\u00a0": " ",
    "\u2009": " ",
    "\u202f": " ",
}
"""Symbols of tables, units and formulas in ASCII; the lines of a table keep their width."""
_HANDLER = "airmuscle.plain"
"""Name of the handler of encoding errors."""
_STREAMS = (("stdin", "r"), ("stdout", "w"), ("stderr", "w"))


def prepare_streams() -> None:
    """Open closed standard streams on the null device, and let outputs replace what they cannot
    encode by `plain`.
    """
    for number, (name, mode) in enumerate(_STREAMS):
        stream = getattr(sys, name)
        if stream is None:
            _occupy(number)
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115
        elif mode == "w" and hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=_HANDLER)


def _occupy(descriptor: int) -> None:
    """Open a closed descriptor on the null device; otherwise the next file of the program would
    become the standard stream of its child processes.
    """
    try:
        os.fstat(descriptor)
    except OSError:
        with contextlib.suppress(OSError):
            os.open(os.devnull, os.O_RDWR)  # takes the lowest that is free


def plain(text: str) -> str:
    r"""The text in ASCII: symbols by similar ones, Greek letters by name, Latin letters without
    accents, raised digits after ^; other characters by escapes such as \u4e2d.
    """
    parts = []
    raised = False
    for character in text:
        is_raised = unicodedata.decomposition(character).startswith("<super>")
        parts.append("^" * (is_raised and not raised) + _plain_character(character))
        raised = is_raised
    return "".join(parts)


def _plain_character(character: str) -> str:
    if character.isascii():
        return character
    if character in PLAIN:
        return PLAIN[character]
    if unicodedata.combining(character):
        return ""
    if base := unicodedata.decomposition(character):
        return plain(_base_character(base))
    name = unicodedata.name(character, "").split()
    if name[:1] == ["GREEK"] and name[2:3] == ["LETTER"]:
        letter = name[3]
        return letter.capitalize() if name[1] == "CAPITAL" else letter.lower()
    return character.encode("ascii", "backslashreplace").decode("ascii")


def _base_character(decomposition: str) -> str:
    """The character of a decomposition such as "<super> 0032" or "0061 0301" without its accent."""
    codes = [code for code in decomposition.split() if not code.startswith("<")]
    characters = (chr(int(code, 16)) for code in codes)
    return "".join(character for character in characters if not unicodedata.combining(character))


def _replace(error: UnicodeError) -> tuple[str, int]:
    """The handler of encoding errors."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return plain(error.object[error.start : error.end]), error.end


codecs.register_error(_HANDLER, _replace)


def encodable(text: str, stream: TextIO) -> str:
    """The text with plain characters for those that a stream cannot encode."""
    encoding = stream.encoding or "utf-8"
    return text.encode(encoding, _HANDLER).decode(encoding)
