"""Pages of the command line, generated from the parser: usage, arguments, options and examples of
each command.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any

from airmuscle.outlets.cli import COMMANDS, app

from .formulas_in_text import escape
from .tables import table


def pages() -> Iterator[tuple[str, str]]:
    """(path without suffix, text) of all pages."""
    yield "commands/index", overview()
    context = app.make_context("airmuscle", ["list"], resilient_parsing=True)
    for row in COMMANDS:
        yield f"commands/{row.name}", command_page(row.name, app.get_command(context, row.name))


def overview() -> str:
    """The index of the commands."""
    rows = [(f"[airmuscle {row.name}]({row.name}.md)", escape(row.summary)) for row in COMMANDS]
    head = (
        "# Command line\n\nGenerated from the parser of the program; `airmuscle COMMAND --help`"
        " shows the same text. Exit code 0: success; 1: failure, with one line on stderr that gives"
        " the reason; 2: wrong usage; 130: interrupted.\n"
    )
    tree = "\n".join(row.name for row in COMMANDS)
    return (
        f"{head}\n{table(('command', 'purpose'), rows)}\n```{{toctree}}\n:hidden:\n\n{tree}\n```\n"
    )


def command_page(name: str, command: Any) -> str:
    """The page of one command."""
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option" and p.name != "help"]
    usage = " ".join(
        [f"airmuscle {name}", *(["[OPTIONS]"] if options else []), *map(_metavar, arguments)]
    )
    parts = [f"# airmuscle {name}\n", f"```text\n{usage}\n```\n", help_text(command.help or "")]
    if arguments:
        rows = [(f"`{_metavar(p)}`", escape(p.meaning)) for p in arguments]
        parts.append("## Arguments\n\n" + table(("argument", "meaning"), rows))
    if options:
        rows = [(_names(p), escape(p.help or "") + _default(p)) for p in options]
        parts.append("## Options\n\n" + table(("option", "meaning"), rows))
    return "\n".join(parts)


def _metavar(parameter: Any) -> str:
    text = parameter.metavar or parameter.name.upper()
    return text if parameter.required or text.startswith("[") else f"[{text}]"


def _names(option: Any) -> str:
    names = ", ".join(f"`{each}`" for each in [*option.opts, *option.secondary_opts])
    takes = "" if option.is_flag else f" `{option.metavar or option.type.name.upper()}`"
    return names + takes


def _default(option: Any) -> str:
    value = option.default
    if value in (None, (), "", False) or option.is_flag or not isinstance(value, str | int | float):
        return ""
    return f" Default: `{value}`."


def help_text(text: str) -> str:
    """The help of a command: paragraphs, and examples as code."""
    parts = []
    for paragraph in inspect.cleandoc(text).replace("\b\n", "").replace("\b", "").split("\n\n"):
        lines = paragraph.strip("\n").split("\n")
        if re.fullmatch(r"Examples?:", lines[0].strip()):
            code = "\n".join(line.strip() for line in lines[1:])
            parts.append(f"## Examples\n\n```sh\n{code}\n```")
        elif any(line.startswith("  ") for line in lines):
            parts.append("```text\n" + "\n".join(lines) + "\n```")
        else:
            parts.append(escape(" ".join(line.strip() for line in lines)))
    return "\n\n".join(parts) + "\n"
