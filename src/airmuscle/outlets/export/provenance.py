"""Frame of exported files: their templates, and comments that state where they come from."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from importlib import metadata, resources
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


def filled(name: str, values: Mapping[str, str], prefix: str) -> str:
    """A template with the values of its places `@name@`; `model_` and `MODEL_` become the prefix of the program.

    Values are inserted as they are: what stands in them is not replaced. Of a place that is indented and alone in its
    line every line of the value is indented so; an empty value leaves no line.
    """
    text = template(name).replace("model_", f"{prefix}_").replace("MODEL_", f"{prefix.upper()}_")
    text = re.sub(r"^( +)@(\w+)@\n", lambda mark: textwrap.indent(f"{values[mark[2]]}\n".lstrip("\n"), mark[1]), text,
                  flags=re.MULTILINE)  # fmt: skip
    return re.sub(r"@(\w+)@", lambda mark: values[mark.group(1)], text)


def template(name: str) -> str:
    """The text of a template, or of a header that is shipped with the program."""
    return resources.files(__package__).joinpath("templates", *name.split("/")).read_text(encoding="utf-8")
