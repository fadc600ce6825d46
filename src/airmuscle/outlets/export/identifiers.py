"""Identifiers: names of users as names that C, C++, JavaScript, MATLAB and file systems accept."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections.abc import Sequence

LONGEST = 48
"""Characters of an identifier: with a prefix it stays within the 63 that C99 and MATLAB distinguish."""
_DIGEST = 8
_WORDS = """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char class compl concept const consteval
    constexpr constinit const_cast continue co_await co_return co_yield decltype default delete do double dynamic_cast
    else enum explicit export extern false final float for friend goto if import inline int long module mutable
    namespace new noexcept not not_eq nullptr operator or or_eq override private protected public register
    reinterpret_cast requires restrict return short signed sizeof static static_assert static_cast struct switch
    template this thread_local throw true try typedef typeid typename typeof union unsigned using virtual void volatile
    wchar_t while xor xor_eq main errno
    arguments async await debugger eval extends finally function implements in instanceof interface let null of package
    super undefined var with yield infinity nan
    elseif end endif endfunction endwhile endfor global otherwise parfor persistent spmd until classdef methods events
    properties enumeration ans pi eps i j inf zeros real imag abs sqrt exp log plot print disp
    con prn aux nul com1 com2 com3 com4 com5 com6 com7 com8 com9 lpt1 lpt2 lpt3 lpt4 lpt5 lpt6 lpt7 lpt8 lpt9
"""
RESERVED = frozenset(_WORDS.split())
"""Words that cannot be identifiers or file names, in lower case: keywords of C, C++, JavaScript, MATLAB and Octave,
functions that printed files call, and device names of Windows."""


def make_identifiers(names: Sequence[str]) -> tuple[str, ...]:
    """An identifier for every name, in order: ASCII letters, digits and single underscores, distinct in any case.

    Accents are dropped, other letters are written as their code point, `.` and all other characters become `_`. A
    keyword gets a final `_`, an identifier longer than LONGEST the digest of its name at its end, the second of two
    equal identifiers a number. The same names give the same identifiers.
    """
    taken: set[str] = set()
    identifiers = []
    for name in names:
        word = _shortened(_word(name), name)
        candidate, number = word, 1
        while candidate.casefold() in taken:
            number += 1
            candidate = f"{word[: LONGEST - 8]}_{number}"
        taken.add(candidate.casefold())
        identifiers.append(candidate)
    return tuple(identifiers)


def make_identifier(name: str) -> str:
    """The identifier of one name."""
    return make_identifiers([name])[0]


def _word(name: str) -> str:
    plain = "".join(c for c in unicodedata.normalize("NFKD", name) if not unicodedata.combining(c))
    letters = "".join(c if c.isascii() else f"_u{ord(c):X}_" if c.isalnum() else "_" for c in plain)
    word = re.sub(r"_+", "_", re.sub(r"[^A-Za-z0-9]", "_", letters)).strip("_")
    if not word or not word[0].isalpha():
        word = f"n_{word}".rstrip("_")
    return f"{word}_" if word.casefold() in RESERVED else word


def _shortened(word: str, name: str) -> str:
    if len(word) <= LONGEST:
        return word
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:_DIGEST]
    return f"{word[: LONGEST - _DIGEST - 1].rstrip('_')}_{digest}"
