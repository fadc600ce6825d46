"""Provenance of an exported file: program, hash of the model, parameters, references and licence."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from importlib import metadata
from typing import Any

from ...core.errors import printable
from ...core.fingerprint import fingerprint
from ...core.reference import cite
from ...core.tree import leaves

LICENCE = (
    "SPDX-License-Identifier: BSD-3-Clause",
    "Integrator and form of the equations are part of airmuscle, copyright the airmuscle developers, and may be used",
    "under its BSD-3-Clause licence; parameters and signals are those of the user.",
)
WIDTH = 112


def provenance(title: str, model: Any, further: Iterable[Any] = (), notes: Sequence[str] = ()) -> list[str]:
    """The lines that state where an exported file comes from; they depend on their arguments and the version alone.

    model    the plant, law or controller
    further  other objects whose references belong to the file, such as the integrator
    notes    further paragraphs
    """
    version = metadata.version("airmuscle")
    lines = [title, f"Exported by airmuscle {version}.", f"SHA-256 of the model: {fingerprint(model)}", *LICENCE]
    for note in notes:
        lines += ["", *textwrap.wrap(note, WIDTH)]
    lines += ["", "Parameters (SI):", *(f"  {row}" for row in _parameters(model))]
    references = {r.key: r for thing in (model, *further) for r in cite(thing)}
    lines += ["", "References:" if references else "References: none."]
    for key in sorted(references):
        lines += textwrap.wrap(str(references[key]), WIDTH, initial_indent="  ", subsequent_indent="    ")
    return [_harmless(line) for line in lines]


def _parameters(model: Any) -> list[str]:
    rows = []
    for leaf in leaves(model):
        unit = "" if leaf.declared.unit == "1" else f" {leaf.declared.unit}"
        rows.append(f"{leaf.path} = {float(leaf.value)!r}{unit}  ({leaf.declared.meaning})")
    return rows or ["none"]


def _harmless(line: str) -> str:
    """A line that cannot end the comment in which it stands, or continue into the next line."""
    text = " ".join(printable(line).split("\n")).replace("*/", "* /").replace("/*", "/ *").replace("??/", "? ?/")
    return text.rstrip("\\ \t")


def block_comment(lines: Iterable[str]) -> str:
    """The lines as a comment of C or JavaScript."""
    return "/*\n" + "".join(f" * {line}".rstrip() + "\n" for line in lines) + " */\n"


def line_comment(lines: Iterable[str]) -> str:
    """The lines as a comment of MATLAB."""
    return "".join(f"% {line}".rstrip() + "\n" for line in lines)
