"""Templates of exported files: package data in which names and places are replaced."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping
from importlib import resources


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
