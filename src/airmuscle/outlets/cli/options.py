"""Arguments and options shared by several commands, and the completion of library names by the shell."""

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated

import typer

from ...core import suggestion
from ...files.library.files import list_data, list_laws, list_library, list_plants
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
Name = Annotated[
    str,
    typer.Argument(
        metavar="NAME",
        help="A library entry, a unique prefix of its name, or a muscle file (TOML).",
        autocompletion=complete_entry,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON in SI units instead of a table.")]
Folder = Annotated[Path, typer.Option("--out", metavar="DIR", help="Output folder; created if it does not exist.")]
"""An output folder that the command always writes."""
OptionalFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Output folder for figures and data; default: none.")
]


def print_completion_script(shell: str | None) -> None:
    """Print the completion script of a shell and exit; nothing happens without a shell. Raises BadParameter."""
    if shell is None:
        return
    if shell not in SHELLS:
        raise typer.BadParameter(
            f"'{shell}' is not supported; allowed are {', '.join(SHELLS)}.{suggestion(shell, SHELLS)}"
        )
    from typer._completion_shared import get_completion_script

    echo(get_completion_script(prog_name=PROGRAM, complete_var=REQUEST, shell=shell))
    raise typer.Exit


def install_completion_classes() -> None:
    """Prepare typer for the completion requests of these scripts, which arrive in environment variables."""
    if REQUEST in os.environ:
        from typer._completion_classes import completion_init

        completion_init()
