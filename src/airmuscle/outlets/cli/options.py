"""Arguments and options shared by several commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .completion import complete_entry

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
