"""Arguments and options that commands share, and completion of names by the shell."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated

import click
from click.shell_completion import get_completion_class

from ...core import alternatives
from ...files.library.folders import list_data, list_laws, list_library, list_plants
from .parser import Argument, CommandOption
from .terminal import echo

SHELLS = ("bash", "zsh", "fish")
"""Shells for which a completion script is printed."""
PROGRAM = "airmuscle"
REQUEST = f"_{PROGRAM.upper()}_COMPLETE"
"""Environment variable by which a shell asks for completions."""


def _beginning_with(names: Callable[[], Iterable[str]]) -> Callable[[str], list[str]]:
    return lambda incomplete: [name for name in names() if name.startswith(incomplete.lower())]


complete_entry = _beginning_with(list_library)
"""Names of the library for an argument that takes any entry."""
complete_law = _beginning_with(list_laws)
"""Names of muscles and laws."""
complete_plant = _beginning_with(list_plants)
"""Names of plants, for an argument that also takes a scenario file."""
complete_data = _beginning_with(list_data)
"""Names of data sets, for an argument that also takes files."""
complete_model = _beginning_with(lambda: (*list_laws(), *list_plants()))
"""Names of muscles, laws and plants, for an argument that also takes their files."""


NAME = "A library entry, a unique prefix of its name, or a muscle file (TOML)."
Name = Annotated[str, Argument("NAME", NAME, complete_entry)]
Json = Annotated[bool, CommandOption("--json", "Print JSON in SI units instead of a table.")]
Folder = Annotated[
    Path, CommandOption("--out", "Output folder; created if it does not exist.", "DIR")
]
"""An output folder that the command always writes."""
OptionalFolder = Annotated[
    Path | None,
    CommandOption("--out", "Output folder for figures and data; default: none.", "DIR"),
]


def print_completion_script(ctx: click.Context, shell: str | None) -> None:
    """Print the completion script of a shell and exit; nothing happens without a shell. Raises
    BadParameter.
    """
    if shell is None:
        return
    kind = get_completion_class(shell) if shell in SHELLS else None
    if kind is None:
        raise click.BadParameter(
            f"'{shell}' is not supported{alternatives(shell, SHELLS, 'allowed are')}"
        )
    script = kind(ctx.command, {}, PROGRAM, REQUEST)
    echo(script.source_template % script.source_vars())
    ctx.exit()
