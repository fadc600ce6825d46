"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Name = Annotated[
    str,
    typer.Argument(metavar="NAME", help="A library entry, a unique beginning of its name, or a muscle's TOML file."),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, in SI units, instead of a table.")]
Folder = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files; made where it is missing.")]
"""A folder that the command cannot do without."""
OptionalFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder for chart and data; none are written without it.")
]
Map = Annotated[Path | None, typer.Option("--mapping", metavar="FILE", help="TOML that says what the files do not.")]
"""A mapping of columns, for files whose headings leave names or units open."""
