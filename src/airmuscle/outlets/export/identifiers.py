"""Texts of exported sources: identifiers in all languages, constants in C, templates of files, and
comments that state where a file comes from."""

import hashlib
import itertools
import re
import textwrap
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from importlib import metadata, resources
from typing import Any

import numpy as np

from ...core import Leaf, ParameterError, abridged, cite, leaves, printable
from ...core.tree import fingerprint
from ...engine.compile.text.languages import CLanguage, MatlabLanguage

LONGEST = 48
"""Characters of an identifier: with a prefix it stays within the 63 that C99 and MATLAB
distinguish.
"""
_DIGEST = 8
MATLAB = MatlabLanguage()
IN_LINE = 6
"""Numbers in a line of MATLAB."""


def template(name: str) -> str:
    """The text of a template, or of a header that is shipped with the program."""
    return (
        resources.files(__package__)
        .joinpath("templates", *name.split("/"))
        .read_text(encoding="utf-8")
    )


RESERVED = frozenset(template("reserved.txt").split())
"""Words that cannot be identifiers or file names, in lower case: keywords of C, C++, JavaScript,
MATLAB and Octave, functions that printed files call, and device names of Windows."""


def make_identifiers(names: Sequence[str]) -> tuple[str, ...]:
    """An identifier for every name, in order: ASCII letters, digits and single underscores,
    distinct in any case.

    Accents are dropped, other letters are written as their code point, `.` and all other characters
    become `_`. A keyword gets a final `_`, an identifier longer than LONGEST the digest of its name
    at its end, the second of two equal identifiers a number. The same names give the same
    identifiers. Raises ParameterError for a single text.
    """
    if isinstance(names, str):
        raise ParameterError(
            f"make_identifiers takes a sequence of names, not the text {abridged(names)}; give"
            " [text], or use make_identifier."
        )
    taken: set[str] = set()
    last: dict[str, int] = {}
    identifiers = []
    for name in names:
        word = _word(name)
        for number in itertools.count(last.get(word, 1)):
            candidate = word if number == 1 else f"{word[: LONGEST - 8]}_{number}"
            if candidate.casefold() not in taken:
                break
        taken.add(candidate.casefold())
        last[word] = number
        identifiers.append(candidate)
    return tuple(identifiers)


def make_identifier(name: str) -> str:
    """The identifier of one name."""
    return make_identifiers([name])[0]


def program_name(stated: str, title: str) -> str:
    """The name of a program that the user has given, or else one from a title, in lower case.
    Raises ParameterError, with a name that is possible, if the given one is not an identifier."""
    if stated and make_identifier(stated) != stated:
        raise ParameterError(
            f"'{stated[:80]}' cannot be the name of an exported program: it must consist of ASCII"
            " letters, digits and single underscores, begin with a letter, and be no keyword. Use"
            f" '{make_identifier(stated)}'."
        )
    return stated or make_identifier(make_identifier(title).lower())


def _in_ascii(character: str) -> str:
    """A character in ASCII: a letter of another alphabet by the number of its code point, so that
    different names remain different.
    """
    if character.isascii():
        return character
    return f"_u{ord(character):X}_" if character.isalnum() else "_"


def _word(name: str) -> str:
    """A name as one word of ASCII letters, digits and single underscores."""
    characters = unicodedata.normalize("NFKD", name)
    plain = [character for character in characters if not unicodedata.combining(character)]
    letters = "".join(map(_in_ascii, plain))
    underscored = re.sub(r"[^A-Za-z0-9]", "_", letters)
    word = re.sub(r"_+", "_", underscored).strip("_")
    if not word or not word[0].isalpha():
        word = f"n_{word}".rstrip("_")
    word = f"{word}_" if word.casefold() in RESERVED else word
    if len(word) <= LONGEST:
        return word
    content = name.encode("utf-8", "surrogatepass")
    digest = hashlib.sha256(content).hexdigest()[:_DIGEST]
    beginning = word[: LONGEST - _DIGEST - 1].rstrip("_")
    return f"{beginning}_{digest}"


_PROGRAM = "add_executable({0}_run main.c)\ntarget_link_libraries({0}_run PRIVATE {0})"
_PLAIN = frozenset(
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 _.,:;[](){}<>+-*/=^%!'|~#$@&"
)
_LANGUAGES = {number: CLanguage(number) for number in ("double", "float")}


def c_number(value: float, number: str = "double") -> str:
    """A double, which is read back bit by bit, or the nearest float."""
    return _LANGUAGES[number].constant(float(value)).strip("()")


def c_string(text: str) -> str:
    """A text as a string of ASCII characters; all others are written as octal bytes of their UTF-8
    form.
    """
    encoded = text.encode("utf-8", "replace")
    return '"' + "".join(chr(b) if chr(b) in _PLAIN else f"\\{b:03o}" for b in encoded) + '"'


def c_strings(texts: Iterable[str]) -> str:
    """The elements of an array of texts, with an empty one at its end."""
    return _wrapped([*map(c_string, texts), c_string("")])


def c_values(values: Any, padding: int = 0, number: str = "double") -> str:
    """The elements of an array (N,) or the rows of a table (N, m), each with so many zeros at its
    end.
    """
    table = np.asarray(values, dtype=float)
    rows = [
        [c_number(value, number) for value in (*row, *[0.0] * padding)]
        for row in np.atleast_2d(table).tolist()
    ]
    texts = rows[0] if table.ndim == 1 else [f"{{{', '.join(row)}}}" for row in rows]
    return _wrapped(texts)


def c_integers(values: Sequence[Any]) -> str:
    """The whole numbers of an array, or the rows of a table; of none, one zero, because C has no
    empty array.
    """
    rows = [
        f"{{{', '.join(map(str, row))}}}" if isinstance(row, tuple) else str(row) for row in values
    ]
    return _wrapped(rows or ["0"])


def with_cmake(name: str, files: Mapping[str, str]) -> dict[str, str]:
    """The files of a C program or law with a CMakeLists.txt, which compiles them as C99 or as
    C++.
    """
    main = "main.c" if "main.c" in files else ""
    places = {
        "file": name,
        "sources": " ".join(file for file in files if file.endswith(".c") and file != main),
        "main": f" {main}" if main else "",
        "program": _PROGRAM.format(name) if main else "",
    }
    return {**files, "CMakeLists.txt": filled("CMakeLists.txt", places, name).rstrip() + "\n"}


def _wrapped(items: Sequence[str]) -> str:
    """The items with commas, in one line or in lines of at most WIDTH characters."""
    if sum(len(item) + 2 for item in items) < WIDTH - 60:
        return ", ".join(items)
    lines = [""]
    for item in items:
        if lines[-1] and len(lines[-1]) + len(item) > WIDTH:
            lines.append("")
        lines[-1] += f" {item},"
    return "\n" + "\n".join(f" {line}" for line in lines).removesuffix(",") + "\n"


LICENCE = (
    "SPDX-License-Identifier: BSD-3-Clause",
    (
        "Integrator and form of the equations are part of airmuscle, copyright the airmuscle"
        " developers, and may be used"
    ),
    "under its BSD-3-Clause licence; parameters and signals are those of the user.",
)
WIDTH = 112


def provenance(
    title: str, model: Any, further: Iterable[Any] = (), notes: Sequence[str] = ()
) -> list[str]:
    """The lines that state where a file comes from, by its model, `further` objects with
    references, such as the integrator, and paragraphs of notes; they depend on these and the
    version alone."""
    version = metadata.version("airmuscle")
    lines = [
        title,
        f"Exported by airmuscle {version}.",
        f"SHA-256 of the model: {fingerprint(model)}",
        *LICENCE,
    ]
    for note in notes:
        lines += ["", *textwrap.wrap(note, WIDTH)]
    units = (
        (leaf, "" if leaf.declared.unit == "1" else f" {leaf.declared.unit}")
        for leaf in leaves(model)
        if not is_unstated_rating(leaf)
    )
    rows = [
        f"  {leaf.path} = {float(leaf.value)!r}{unit}  ({leaf.declared.meaning})"
        for leaf, unit in units
    ]
    lines += ["", "Parameters (SI):", *(rows or ["  none"])]
    references = {r.key: r for thing in (model, *further) for r in cite(thing)}
    lines += ["", "References:" if references else "References: none."]
    for key in sorted(references):
        lines += textwrap.wrap(
            str(references[key]), WIDTH, initial_indent="  ", subsequent_indent="    "
        )
    lines = [" ".join(printable(line).split("\n")) for line in lines]
    for ending, harmless in (
        ("*/", "* /"),
        ("/*", "/ *"),
        ("??/", "? ?/"),
    ):  # no line ends its comment
        lines = [line.replace(ending, harmless) for line in lines]
    return [line.rstrip("\\ \t") for line in lines]  # nor continues into the next one


def is_unstated_rating(leaf: Leaf) -> bool:
    """Whether a number stands for a rating that the maker does not state, which is no fact to
    print.
    """
    return ".ratings." in f".{leaf.path}" and leaf.value == leaf.declared.default


def block_comment(lines: Iterable[str]) -> str:
    """The lines as a comment of C or JavaScript."""
    return "/*\n" + "".join(f" * {line}".rstrip() + "\n" for line in lines) + " */\n"


def line_comment(lines: Iterable[str]) -> str:
    """The lines as a comment of MATLAB."""
    return "".join(f"% {line}".rstrip() + "\n" for line in lines)


def filled(name: str, values: Mapping[str, str], prefix: str) -> str:
    """A template with the values of its places `@name@`; `model_` and `MODEL_` become the prefix of
    the program.

    Values are inserted as they are: what stands in them is not replaced. Of a place that is
    indented and alone in its line every line of the value is indented so; an empty value leaves no
    line.
    """
    text = template(name).replace("model_", f"{prefix}_").replace("MODEL_", f"{prefix.upper()}_")
    text = re.sub(
        r"^( +)@(\w+)@\n",
        lambda mark: textwrap.indent(f"{values[mark[2]]}\n".lstrip("\n"), mark[1]),
        text,
        flags=re.MULTILINE,
    )
    return re.sub(r"@(\w+)@", lambda mark: values[mark.group(1)], text)


def m_number(value: float) -> str:
    """A number as MATLAB text; it is read back bit by bit."""
    return MATLAB.constant(float(value)).strip("()")


def m_array(values: Any) -> str:
    """An array (N,) as a column, or a table (N, m)."""
    table = np.asarray(values, dtype=float)
    if not table.size:
        shape = table.shape if table.ndim == 2 else (0, 1)
        return f"zeros({', '.join(map(str, shape))})"
    if table.ndim == 2:
        lines = [", ".join(map(m_number, row)) for row in table.tolist()]
    else:
        numbers = [m_number(value) for value in table.tolist()]
        lines = ["; ".join(numbers[i : i + IN_LINE]) for i in range(0, len(numbers), IN_LINE)]
    return f"[{f'; ...{chr(10)}    '.join(lines)}]"
